//! What swath says over a network, without a network.
//!
//! A client opens a session: a batch of environments on a server. It resets and steps them, and no step is ever lost, done
//! twice or mixed up, whatever happens to messages on the way. This crate holds the messages, their bytes, and both ends
//! of a session as state machines. It does no I/O, and knows neither clocks nor threads nor random numbers: time, bytes
//! and identities come in as arguments.
//!
//! | module | what it is |
//! |---|---|
//! | [`header`] | the 53 bytes before every message |
//! | [`leaf`] | tables of numbers as bytes: name, type and shape of each |
//! | [`fault`] | what a server may answer instead, a closed set |
//! | [`numbers`] | numbers as bytes |
//! | [`message`] | what is asked and answered |
//! | [`codec`] | messages as bytes, and back |
//! | [`layout`] | which tables the messages of a batch hold |
//! | [`percept`] | what mowers perceive, as tables, and back |
//! | [`hosted`] | the batch behind a session: requests in, replies out |
//! | [`peer`] | whether a server is of the same build |
//! | [`received`] | replies as the columns of a batch |
//! | [`client`] | the client's end of one session |
//! | [`resume`] | a session that goes on at the next server |
//! | [`server`] | the server's end of all sessions |
//!
//! The protocol is described for other implementations in `docs/protocol`.

pub mod header;
pub mod leaf;
pub mod fault;
pub mod numbers;
pub mod message;
pub mod codec;
pub mod layout;
pub mod percept;
pub mod hosted;
pub mod peer;
pub mod received;
pub mod client;
pub mod resume;
pub mod server;
