//! Any bytes as the snapshot of a batch.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::snapshot::feed_batch(data);
});
