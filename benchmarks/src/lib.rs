//! Benchmarks of swath, run by `make bench`; the crate itself is empty.
