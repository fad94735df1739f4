//! Any bytes as a message.

#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    swath_fuzz::header::feed(data);
});
