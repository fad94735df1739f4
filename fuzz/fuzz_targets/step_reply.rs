//! Any bytes as the payload of `StepReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::StepReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(StepReply, data);
});
