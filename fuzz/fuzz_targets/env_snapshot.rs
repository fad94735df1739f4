//! Any bytes as the snapshot of an environment.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::snapshot::feed_env(data);
});
