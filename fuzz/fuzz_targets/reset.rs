//! Any bytes as the payload of `Reset`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::Reset;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(Reset, data);
});
