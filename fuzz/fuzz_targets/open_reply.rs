//! Any bytes as the payload of `OpenReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::OpenReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(OpenReply, data);
});
