//! Known weeds in the order of detection.

use super::{KnownWeed, WORD};
use crate::geometry::Point;

/// The weeds of [`KnownWeeds`](super::KnownWeeds) from a number on.
#[derive(Debug, Clone)]
pub struct Iter<'a> {
    standing: &'a [u64],
    chain: &'a [(Point, u32)],
    /// The word that is looked into, and which bits of it are still to come.
    index: usize,
    bits: u64,
}

impl<'a> Iter<'a> {
    /// Those whose bit is set, from that of `number` on.
    #[inline]
    pub(super) fn since(standing: &'a [u64], chain: &'a [(Point, u32)], number: u32) -> Self {
        let (index, bit) = (number as usize / WORD, number as usize % WORD);
        let bits = standing.get(index).map_or(0, |word| word & (u64::MAX << bit));
        Self { standing, chain, index, bits }
    }
}

impl Iterator for Iter<'_> {
    type Item = KnownWeed;

    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "numbers have 32 bits")]
    fn next(&mut self) -> Option<KnownWeed> {
        while self.bits == 0 {
            self.bits = *self.standing.get(self.index + 1)?;
            self.index += 1;
        }
        let number = WORD * self.index + self.bits.trailing_zeros() as usize;
        self.bits &= self.bits - 1;
        Some(KnownWeed { number: number as u32, position: self.chain[number].0 })
    }
}
