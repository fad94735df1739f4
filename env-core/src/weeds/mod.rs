//! The weeds of an episode: where they stand, which were detected, which were mowed.

mod ahead;
mod fine;
mod index;
mod placement;

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::{BarSweep, Footprint, Point};
use crate::grid::{Cell, CellSet, Grid};
use crate::ground::SeenGround;
use fine::FineCells;
use index::{CellIndex, State};

pub use ahead::Ahead;
pub(crate) use ahead::push_if;
pub use placement::draw;

/// All weeds of an episode, found through the grid.
///
/// A cell is looked into only while it holds a weed that is still sought, so ground without news costs the same
/// whatever grows there.
#[derive(Debug, Clone)]
pub struct Weeds {
    grid: Arc<Grid>,
    positions: Vec<Point>,
    is_detected: Vec<bool>,
    is_mowed: Vec<bool>,
    index: Box<CellIndex>,
    /// Cells that hold a weed neither detected nor mowed.
    undetected_cells: CellSet,
    /// Cells that hold a weed not mowed.
    unmowed_cells: CellSet,
    unmowed_fine: FineCells,
    /// Whether so many weeds were planted that almost every bar passes near one, [`DENSE_PER_CELL`].
    is_dense: bool,
}

/// From so many weeds a cell on.
const DENSE_PER_CELL: f64 = 0.5;

impl Weeds {
    /// A pasture without weeds.
    #[must_use]
    pub fn none(grid: Arc<Grid>) -> Self {
        let cells = CellSet::empty(&grid);
        Self {
            positions: Vec::new(),
            is_detected: Vec::new(),
            is_mowed: Vec::new(),
            index: Box::new(CellIndex::none(&grid)),
            undetected_cells: cells.clone(),
            unmowed_cells: cells,
            unmowed_fine: FineCells::empty(&grid),
            is_dense: false,
            grid,
        }
    }

    /// Replaces all weeds by those that `fill` writes; none of them is detected or mowed.
    pub fn plant(&mut self, fill: impl FnOnce(&mut Vec<Point>)) {
        self.positions.clear();
        fill(&mut self.positions);
        let count = self.positions.len();
        for flags in [&mut self.is_detected, &mut self.is_mowed] {
            flags.clear();
            flags.resize(count, false);
        }
        self.index();
    }

    /// Puts weeds back as they stood: where, which ones detected, whether mowed.
    pub(crate) fn restore(&mut self, positions: Vec<Point>, detected: &[u32], is_mowed: Vec<bool>) {
        debug_assert!(positions.len() == is_mowed.len(), "one flag a weed");
        self.is_detected.clear();
        self.is_detected.resize(positions.len(), false);
        for &weed in detected {
            self.is_detected[weed as usize] = true;
        }
        self.positions = positions;
        self.is_mowed = is_mowed;
        self.index();
    }

    /// Builds the index from positions, and the sets of cells from flags.
    fn index(&mut self) {
        let Self { grid, positions, is_detected, is_mowed, index, .. } = self;
        self.is_dense = positions.len() as f64 > DENSE_PER_CELL * grid.cells() as f64;
        let (undetected, unmowed) = (&mut self.undetected_cells, &mut self.unmowed_cells);
        undetected.clear();
        unmowed.clear();
        self.unmowed_fine.clear();
        index.build(grid, positions, |weed, cell| {
            let fine = self.unmowed_fine.at(positions[weed]);
            let is_standing = !is_mowed[weed];
            let is_sought = is_standing && !is_detected[weed];
            if is_standing {
                unmowed.insert(cell);
                self.unmowed_fine.insert(fine);
            }
            if is_sought {
                undetected.insert(cell);
            }
            State { fine_bit: fine.bit, is_standing, is_sought }
        });
    }

    /// Finds the standing weeds, and the unseen cells by their centre, that a bar passes over.
    #[inline]
    pub fn find_standing(&self, sweep: &BarSweep, ground: &SeenGround, ahead: &mut Ahead<()>) {
        let grid = &self.grid;
        ahead.clear();
        let Some(near) = self.unmowed_fine.around(sweep) else { return };
        let unseen = ground.unseen().words();
        // Where weeds stand everywhere it is not worth asking whether there is one: unseen ground twice is soonest passed.
        let cells = self.unmowed_fine.cells_of(near);
        let has_weeds = if self.is_dense {
            // Where weeds stand everywhere it is not worth asking whether there is one.
            if grid.may_meet(&cells, unseen) {
                let words = |tile: usize| (unseen[tile], 0);
                Self::find_unseen(grid, cells, words, sweep, &mut ahead.cells);
            }
            true
        } else {
            let unmowed = self.unmowed_cells.words();
            let words = |tile: usize| (unseen[tile], unmowed[tile]);
            Self::find_unseen(grid, cells, words, sweep, &mut ahead.cells)
        };
        if has_weeds {
            self.unmowed_fine.for_each_in(near, |cell, fine_bit| {
                self.find_in_fine(cell, fine_bit, sweep, &mut ahead.weeds);
            });
            if ahead.weeds.len() > 1 {
                ahead.weeds.sort_unstable_by_key(|&(weed, ())| weed);
            }
        }
    }

    /// Adds the unseen cells of a box by their centre that a bar passes over; returns whether the box has any of the others.
    #[inline]
    fn find_unseen(
        grid: &Grid,
        cells: (Range<usize>, Range<usize>),
        unseen_and_others: impl Fn(usize) -> (u64, u64),
        sweep: &BarSweep,
        found: &mut Vec<(Cell, ())>,
    ) -> bool {
        let mut has_others = false;
        grid.for_each_in_box(cells, unseen_and_others, |tile, unseen, others| {
            has_others |= others != 0;
            tile.for_each(unseen, |cell| {
                let is_met = sweep.contains(grid.centre(cell.column, cell.row));
                found.extend(is_met.then_some((cell, ())));
            });
        });
        has_others
    }

    /// Adds the standing weeds of a fine cell that a bar passes over.
    #[inline]
    fn find_in_fine(
        &self,
        (column, row): (usize, usize),
        fine_bit: u8,
        sweep: &BarSweep,
        found: &mut Vec<(u32, ())>,
    ) {
        let (tile, bit) = self.grid.place(column, row);
        for weed in self.index.in_cell(Cell { column, row, tile, bit }) {
            if weed.state.fine_bit == fine_bit
                && weed.state.is_standing
                && sweep.contains(weed.position)
            {
                found.push((weed.number, ()));
            }
        }
    }

    /// Finds the standing weeds that were not detected yet, and the unseen cells by their centre, for which `test` has an
    /// answer; it has none for points outside `footprint`.
    pub fn find_undetected<const PAIRS: usize, T: Copy + Default>(
        &self,
        footprint: &impl Footprint<PAIRS>,
        test: impl Fn(Point) -> Option<T>,
        ground: &SeenGround,
        ahead: &mut Ahead<T>,
    ) {
        let Self { grid, index, positions, .. } = self;
        ahead.clear();
        let Ahead { weeds: found, cells } = ahead;
        // Weeds and ground are looked up in one go, since the same cells are touched.
        let (unseen, sought) = (ground.unseen().words(), self.undetected_cells.words());
        let words = |tile: usize| (unseen[tile], sought[tile]);
        grid.for_each_touched(footprint, words, |tile, unseen, weeds, edges| {
            tile.for_each(unseen, |cell| {
                let answer = test(grid.centre(cell.column, cell.row));
                let is_met = answer.is_some();
                push_if(cells, (cell, answer.unwrap_or_default()), is_met);
            });
            tile.for_each(weeds, |cell| {
                for weed in index.in_cell(cell) {
                    // Most weeds of a cell at the rim are out of sight, which is seen more quickly.
                    if weed.state.is_sought
                        && edges.may_hold(grid.in_cells(weed.position.x, weed.position.y))
                        && let Some(answer) = test(weed.position)
                    {
                        found.push((weed.number, answer));
                    }
                }
            });
        });
        // By place, since the order in which weeds were drawn is nobody's business. Coordinates are positive, once -0 has become
        // 0: their bits are sorted as they are.
        if found.len() > 1 {
            found.sort_unstable_by_key(|&(weed, _)| {
                let at = positions[weed as usize];
                ((at.x + 0.0).to_bits(), (at.y + 0.0).to_bits(), weed)
            });
        }
    }

    /// Takes note that these standing weeds were mowed.
    pub fn mow(&mut self, mowed: &[u32]) {
        for &weed in mowed {
            self.is_mowed[weed as usize] = true;
            self.note(weed);
        }
    }

    /// Takes note that these standing weeds were detected.
    pub fn detect(&mut self, detected: &[u32]) {
        for &weed in detected {
            self.is_detected[weed as usize] = true;
            self.note(weed);
        }
    }

    /// Writes a weed's flags into the index, and strikes out the cells of it where none is sought any more.
    fn note(&mut self, number: u32) {
        let position = self.positions[number as usize];
        let (cell, fine) = (self.grid.cell_at(position), self.unmowed_fine.at(position));
        let (mut is_standing, mut is_sought, mut stands_near) = (false, false, false);
        for weed in self.index.in_cell_mut(cell) {
            if weed.number == number {
                weed.state.is_standing = !self.is_mowed[number as usize];
                weed.state.is_sought = false;
            }
            is_standing |= weed.state.is_standing;
            is_sought |= weed.state.is_sought;
            stands_near |= weed.state.is_standing && weed.state.fine_bit == fine.bit;
        }
        if !is_standing {
            self.unmowed_cells.remove(cell);
        }
        if !is_sought {
            self.undetected_cells.remove(cell);
        }
        if !stands_near {
            self.unmowed_fine.remove(fine);
        }
    }

    /// The cells that the weeds are found through.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Where the weeds stand, in the order in which they were drawn or given; world frame, metres.
    #[must_use]
    pub fn positions(&self) -> &[Point] {
        &self.positions
    }

    /// Which weeds the sensor has seen, in the same order.
    #[must_use]
    pub fn is_detected(&self) -> &[bool] {
        &self.is_detected
    }

    /// Which weeds were mowed, in the same order.
    #[must_use]
    pub fn is_mowed(&self) -> &[bool] {
        &self.is_mowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{self, Pose};
    use crate::rng::{Stream, stream, uniform};

    /// The cells less than 14 m from a point along both axes, row by row.
    fn around(grid: &Grid, point: Point) -> impl Iterator<Item = (usize, usize)> {
        let cells = |at_m: f64| grid.cell_of(Point::new(point.x + at_m, point.y + at_m));
        let ((first_column, first_row), (last_column, last_row)) = (cells(-14.0), cells(14.0));
        (first_row..=last_row)
            .flat_map(move |row| (first_column..=last_column).map(move |column| (column, row)))
    }

    #[test]
    fn what_stands_and_is_unseen_under_a_bar_is_what_is_found_by_looking_at_all() {
        // A pasture of one cell, sizes that are cut into cells of a metre and of less, and one so large that its cells are
        // not cut more finely.
        for (length_m, width_m, count, least) in [
            (0.8, 0.7, 40, 1),
            (40.0, 25.0, 4000, 30),
            (66.3, 7.9, 300, 30),
            (2000.0, 900.0, 9000, 30),
        ] {
            let mut rng = stream(count, Stream::Weeds);
            let grid = Arc::new(Grid::new(length_m, width_m));
            let mut weeds = Weeds::none(Arc::clone(&grid));
            let mut ground = SeenGround::none(Arc::clone(&grid));
            weeds.plant(|positions| {
                let mut at = |size_m| size_m * uniform(&mut rng);
                positions.extend((0..count).map(|_| Point::new(at(length_m), at(width_m))));
                // Some stand as close together as can be.
                positions.extend_from_within(..20);
            });
            let (mut ahead, mut mowed, mut seen) = (Ahead::default(), 0, 0);
            for step in 0..400 {
                let mut at = |size_m: f64| size_m * uniform(&mut rng);
                // Around a weed, so that something is met.
                let near = weeds.positions()[step % 30];
                let start = Pose::new(near.x + at(2.0) - 1.0, near.y + at(2.0) - 1.0, at(6.0));
                let arc =
                    geometry::Arc { start, curvature_per_m: at(2.0) - 1.0, length_m: at(1.0) };
                // Some bars reach over more than two tiles along both axes.
                let widest_m = if step % 8 == 0 { 20.0 } else { 3.0 };
                let sweep = BarSweep::new(&arc, 0.2 + at(widest_m));
                weeds.find_standing(&sweep, &ground, &mut ahead);
                let found: Vec<u32> = ahead.weeds.iter().map(|&(weed, ())| weed).collect();
                let expected: Vec<u32> = (0..)
                    .zip(weeds.positions().iter().zip(weeds.is_mowed()))
                    .filter(|&(_, (&position, is_mowed))| !is_mowed && sweep.contains(position))
                    .map(|(weed, _)| weed)
                    .collect();
                assert_eq!(found, expected, "step {step}");
                let mut found: Vec<Cell> = ahead.cells.iter().map(|&(cell, ())| cell).collect();
                found.sort_unstable_by_key(|cell| (cell.row, cell.column));
                let expected = around(&grid, near).filter(|&(column, row)| {
                    !ground.is_seen(column, row) && sweep.contains(grid.centre(column, row))
                });
                let places: Vec<_> = found.iter().map(|cell| (cell.column, cell.row)).collect();
                assert_eq!(places, expected.collect::<Vec<_>>(), "step {step}");
                // Only some are mowed and seen, so that others go on beside them.
                let some: Vec<u32> =
                    ahead.weeds.iter().map(|&(weed, ())| weed).step_by(2).collect();
                mowed += some.len();
                weeds.mow(&some);
                found.truncate(found.len().div_ceil(4));
                seen += found.len();
                ground.absorb(&found);
            }
            assert!(mowed >= least && seen >= least, "{mowed} weeds mowed, {seen} cells seen");
        }
    }
}
