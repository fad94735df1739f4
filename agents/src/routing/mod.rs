//! The planners of Maini, Gonultas & Isler (2022), "Online Coverage Planning for an Autonomous Weed Mowing Robot with
//! Curvature Constraints". `agents/README.md` lists them with their equations and every reading that the paper leaves open.

mod bcp;
mod bcp_tsp;
mod jump;
mod react;
mod snake;

pub use bcp::{Bcp, BcpOptions, Spacing};
pub use bcp_tsp::BcpTsp;
pub use jump::Jump;
pub use react::React;
pub use snake::Snake;
