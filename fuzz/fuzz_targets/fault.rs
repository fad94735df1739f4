//! Any bytes as the payload of a fault.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::fault::feed(data);
});
