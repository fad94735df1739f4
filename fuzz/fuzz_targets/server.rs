//! Any messages to a server with a session.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| swath_fuzz::server::feed(data));
