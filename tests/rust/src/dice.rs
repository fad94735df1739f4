//! Chance for tests that are too large for a property: the same numbers for the same seed.

/// `SplitMix64`; Steele, Lea & Flood (2014).
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    /// Dice of that seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed(self.0)
    }

    /// From 0 up to, not including, `count`.
    pub fn below(&mut self, count: u64) -> u64 {
        self.bits() % count
    }

    /// True once in `count` throws.
    pub fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }
}

/// Bits that look as if they had nothing to do with these.
#[must_use]
pub fn mixed(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Says what a test has measured; `make test-faults` collects it.
#[expect(clippy::print_stdout, reason = "what was measured is there to be read")]
pub fn measured(text: &str) {
    println!("measured: {text}");
}

/// `long` if the environment variable `LONG` is set, as `make test LONG=1` does, or else `short`.
#[must_use]
pub fn size(short: u64, long: u64) -> u64 {
    if std::env::var_os("LONG").is_some_and(|value| !value.is_empty()) { long } else { short }
}
