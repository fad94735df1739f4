//! Any bytes as the payload of `SpecReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::SpecReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(SpecReply, data);
});
