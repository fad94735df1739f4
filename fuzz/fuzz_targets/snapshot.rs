//! Any bytes as the payload of `Snapshot`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::Snapshot;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(Snapshot, data);
});
