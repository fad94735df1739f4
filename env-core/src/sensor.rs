//! The weed sensor.

use crate::deck::Ahead;
use crate::geometry::{Frame, Sight, Triangle};
use crate::grid::Cell;
use crate::ground::SeenGround;
use crate::mower::{MAX_PIECE_M, Piece};
use crate::weeds::Weeds;

/// A camera that sees a triangle in front of the mower, without error and at once.
#[derive(Debug, Clone)]
pub struct Sensor {
    triangle: Triangle,
    ahead: Ahead,
    detected: Vec<u32>,
    seen: Vec<Cell>,
}

/// What one look showed for the first time.
#[derive(Debug)]
pub struct Percept<'a> {
    /// Numbers of weeds, ascending.
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
        match piece.sight(self.triangle) {
            Some(sight) => self.prepare_for(&sight, weeds, ground),
            None => self.ahead.clear(),
        }
    }

    fn prepare_for(&mut self, sight: &Sight, weeds: &Weeds, ground: &SeenGround) {
        let Ahead { weeds: found, cells } = &mut self.ahead;
        weeds.find_undetected(sight, ground, found, cells);
    }

    /// Looks from a pose that it is prepared for.
    #[inline]
    pub fn look(&mut self, from: &Frame, weeds: &mut Weeds) -> Percept<'_> {
        self.detected.clear();
        self.seen.clear();
        if !self.ahead.is_empty() {
            self.look_ahead(from, weeds);
        }
        Percept { detected: &self.detected, seen: &self.seen }
    }

    fn look_ahead(&mut self, from: &Frame, weeds: &mut Weeds) {
        let Self { triangle, ahead, detected, seen } = self;
        let grid = weeds.grid();
        ahead.weeds.retain(|&weed| {
            let is_out = triangle.contains(from, weeds.positions()[weed as usize]);
            // A weed that was mowed meanwhile is nowhere to be seen.
            detected.extend((is_out && !weeds.is_mowed()[weed as usize]).then_some(weed));
            !is_out
        });
        ahead.cells.retain(|&cell| {
            let is_out = triangle.contains(from, grid.centre(cell.column, cell.row));
            seen.extend(is_out.then_some(cell));
            !is_out
        });
        weeds.detect(detected);
    }

    /// Looks from a pose at once.
    pub fn look_around(
        &mut self,
        from: Frame,
        weeds: &mut Weeds,
        ground: &SeenGround,
    ) -> Percept<'_> {
        self.prepare_for(&Sight::new(self.triangle, &[from]), weeds, ground);
        self.look(&from, weeds)
    }
}
