//! Any bytes as the payload of `CloseReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::CloseReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(CloseReply, data);
});
