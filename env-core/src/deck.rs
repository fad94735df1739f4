//! The mowing deck.

use crate::geometry::BarSweep;
use crate::grid::Cell;
use crate::ground::SeenGround;
use crate::motion::{MAX_PIECE_M, Piece, Stretch};
use crate::weeds::{Ahead, Weeds};

/// The implement: a bar across the heading whose middle is the mower's pose.
#[derive(Debug, Clone)]
pub struct Deck {
    width_m: f64,
    /// What the bar meets on a piece: mostly nothing.
    ahead: Ahead<()>,
    mowed: Vec<u32>,
    seen: Vec<Cell>,
}

/// What one stretch cut.
#[derive(Debug)]
pub struct Cut<'a> {
    /// Numbers of the weeds mowed, ascending.
    pub mowed: &'a [u32],
    /// Cells not seen before whose centre the bar passed over.
    pub seen: &'a [Cell],
}

impl Deck {
    /// A deck of `width_m`.
    #[must_use]
    pub fn new(width_m: f64) -> Self {
        Self { width_m, ahead: Ahead::default(), mowed: Vec::new(), seen: Vec::new() }
    }

    /// Makes room for all weeds of an episode and for the cells of a piece, so that no step has to.
    pub(crate) fn reserve(&mut self, weeds: &Weeds) {
        let count = weeds.positions().len();
        let cells = weeds.grid().cells_around(0.5 * self.width_m + MAX_PIECE_M);
        self.ahead.reserve(count, cells);
        self.mowed.reserve(count.saturating_sub(self.mowed.len()));
        self.seen.reserve(cells.saturating_sub(self.seen.len()));
    }

    /// Finds what the bar will meet on a piece, before its stretches are driven: only what [`Deck::mow`] has to look at, which
    /// decides by [`BarSweep::contains`].
    pub fn prepare(&mut self, piece: &Piece, weeds: &Weeds, ground: &SeenGround) {
        weeds.find_standing(&piece.sweep(self.width_m), ground, &mut self.ahead);
    }

    /// Whether the bar meets nothing on the piece that it is prepared for.
    #[must_use]
    #[inline]
    pub fn is_idle(&self) -> bool {
        self.ahead.is_empty()
    }

    /// Mows what the bar passes over on `stretch`: swept, exact, its ends included.
    #[inline]
    pub fn mow(&mut self, stretch: &Stretch, weeds: &mut Weeds) -> Cut<'_> {
        self.mowed.clear();
        self.seen.clear();
        if !self.ahead.is_empty() {
            self.mow_ahead(stretch, weeds);
        }
        Cut { mowed: &self.mowed, seen: &self.seen }
    }

    fn mow_ahead(&mut self, stretch: &Stretch, weeds: &mut Weeds) {
        let Self { width_m, ahead, mowed, seen } = self;
        let Stretch { start, end, curvature_per_m, length_m, .. } = *stretch;
        let sweep = BarSweep::between(start, end, curvature_per_m, length_m, *width_m);
        let grid = weeds.grid();
        ahead.weeds.retain(|&(weed, ())| {
            let is_out = sweep.contains(weeds.positions()[weed as usize]);
            mowed.extend(is_out.then_some(weed));
            !is_out
        });
        ahead.cells.retain(|&(cell, ())| {
            let is_out = sweep.contains(grid.centre(cell.column, cell.row));
            seen.extend(is_out.then_some(cell));
            !is_out
        });
        weeds.mow(mowed);
    }
}
