//! Any bytes as the payload of `Open`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::Open;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(Open, data);
});
