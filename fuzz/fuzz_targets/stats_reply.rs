//! Any bytes as the payload of `StatsReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::StatsReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(StatsReply, data);
});
