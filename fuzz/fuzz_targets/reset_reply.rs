//! Any bytes as the payload of `ResetReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::ResetReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(ResetReply, data);
});
