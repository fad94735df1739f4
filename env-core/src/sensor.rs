//! The weed sensor.

use crate::geometry::{Frame, Sight, Triangle};
use crate::grid::Cell;
use crate::ground::SeenGround;
use crate::motion::{MAX_PIECE_M, Piece};
use crate::weeds::{Ahead, Weeds, push_if};

/// A camera that sees a triangle in front of the mower, without error and at once.
#[derive(Debug, Clone)]
pub struct Sensor {
    triangle: Triangle,
    /// What comes in sight for the first time on a piece, and at the end of which stretch.
    ahead: Ahead<u32>,
    detected: Vec<u32>,
    seen: Vec<Cell>,
}

/// What one look showed: weeds for the first time, and ground that was unseen when the piece began.
#[derive(Debug)]
pub struct Percept<'a> {
    /// Numbers of weeds, sorted by where they stand.
    pub detected: &'a [u32],
    /// Cells whose centre was seen.
    pub seen: &'a [Cell],
}

impl Sensor {
    /// A sensor of depth `range_m` and far width `width_m`.
    #[must_use]
    pub fn new(range_m: f64, width_m: f64) -> Self {
        Self {
            triangle: Triangle::new(range_m, width_m),
            ahead: Ahead::default(),
            detected: Vec::new(),
            seen: Vec::new(),
        }
    }

    /// Makes room for all weeds of an episode and for the cells in sight on a piece, so that no step has to.
    pub(crate) fn reserve(&mut self, weeds: &Weeds) {
        let count = weeds.positions().len();
        let cells = weeds.grid().cells_around(self.triangle.reach_m() + MAX_PIECE_M);
        self.ahead.reserve(count, cells);
        self.detected.reserve(count.saturating_sub(self.detected.len()));
        self.seen.reserve(cells.saturating_sub(self.seen.len()));
    }

    /// Finds what will come in sight on a piece, before its stretches are driven.
    pub fn prepare(&mut self, piece: &Piece, weeds: &Weeds, ground: &SeenGround) {
        let Self { triangle, ahead, .. } = self;
        if piece.looks() == 0 {
            ahead.clear();
            return;
        }
        let looks = !(u32::MAX << piece.looks());
        let seen_at = |point| {
            let seen_from = triangle.seen_from(piece.stops(), point) & looks;
            (seen_from != 0).then(|| seen_from.trailing_zeros())
        };
        weeds.find_undetected(&piece.sight(triangle), seen_at, ground, ahead);
    }

    /// Whether nothing comes in sight on the piece that it is prepared for.
    #[must_use]
    #[inline]
    pub fn is_idle(&self) -> bool {
        self.ahead.is_empty()
    }

    /// Whether no weed comes in sight on the piece that it is prepared for.
    #[must_use]
    #[inline]
    pub fn meets_no_weed(&self) -> bool {
        self.ahead.weeds.is_empty()
    }

    /// The cells whose centre comes in sight on the piece that it is prepared for.
    #[inline]
    pub fn seen_ahead(&self) -> impl Iterator<Item = &Cell> {
        self.ahead.cells.iter().map(|(cell, _)| cell)
    }

    /// Looks at the end of a stretch of the piece that it is prepared for.
    #[inline]
    pub fn look(&mut self, stretch: u32, weeds: &mut Weeds) -> Percept<'_> {
        let Self { ahead, detected, seen, .. } = self;
        detected.clear();
        seen.clear();
        if !ahead.is_empty() {
            // A weed that was mowed meanwhile is nowhere to be seen.
            let is_in_sight =
                |&(weed, at): &(u32, u32)| at == stretch && !weeds.is_mowed()[weed as usize];
            detected.extend(
                ahead.weeds.iter().filter(|entry| is_in_sight(entry)).map(|&(weed, _)| weed),
            );
            for &(cell, at) in &ahead.cells {
                push_if(seen, cell, at == stretch);
            }
            weeds.detect(detected);
        }
        Percept { detected, seen }
    }

    /// Looks from a pose at once.
    pub fn look_around(
        &mut self,
        from: &Frame,
        weeds: &mut Weeds,
        ground: &SeenGround,
    ) -> Percept<'_> {
        let Self { triangle, ahead, .. } = self;
        let seen_at = |point| triangle.contains(from, point).then_some(0);
        weeds.find_undetected(&Sight::from(triangle, from), seen_at, ground, ahead);
        self.look(0, weeds)
    }
}
