//! Any bytes as the payload of `SnapshotReply`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use swath_wire::message::SnapshotReply;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::feed_payload!(SnapshotReply, data);
});
