//! Servers over a real network, which is the loopback: each listens at a free port and looks for nobody.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

mod common;
mod agent;
mod relay;
mod sessions;
mod processes;
mod access;
mod exactly_once;
mod kills;
mod hostile;
