//! Any bytes as the payload of `Step`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::Step;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(Step, data);
});
