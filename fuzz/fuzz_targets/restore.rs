//! Any bytes as the payload of `Restore`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::Restore;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(Restore, data);
});
