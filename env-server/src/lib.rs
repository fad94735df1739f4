//! The Zenoh front of swath: environments that agents elsewhere open, reset and step.
//!
//! Zenoh's callbacks put queries into a bounded channel; one thread asks the state machine of `swath-wire` what is to be
//! done; workers step environments. What may be asked when, and what is answered, is decided in `swath-wire` alone.
//!
//! | module | what it is |
//! |---|---|
//! | [`endpoint`] | where a server listens |
//! | [`access`] | who may reach it |
//! | [`options`] | what an operator may set, by file and by flag |
//! | [`settings`] | Zenoh's settings, and its threads |
//! | [`clock`] | the time since a start |
//! | [`worker`] | environments at work |
//! | [`front`] | Zenoh's side: keys, queries, signs of life |
//! | [`stall`] | connections whose other end takes nothing |
//! | [`post`] | replies on their way out |
//! | [`memory`] | memory that sessions leave behind |
//! | [`server`] | the thread between the two |

pub mod endpoint;
pub mod access;
pub mod options;
pub mod settings;
pub mod clock;
pub mod worker;
pub mod front;
pub mod stall;
pub mod post;
pub mod memory;
pub mod server;
