//! The weeds that a mower has still to mow, as far as it knows.

mod iter;
mod window;

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point;
use crate::grid::{Cell, CellSet, Grid};
use crate::math::{floor_index, larger};

pub use iter::Iter;
pub(crate) use window::Window;

/// A weed that was detected and not yet mowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownWeed {
    /// Order of detection, from 0; weeds of one look are sorted by where they stand, x first. It says nothing about weeds that
    /// were not detected, nor about the order in which weeds were drawn.
    pub number: u32,
    /// World frame, metres.
    pub position: Point,
}

/// Smallest side of a bucket, metres; larger pastures have larger buckets, so that there are at most about this many.
const BUCKET_M: f64 = 1.0;
const BUCKETS: f64 = 16_384.0;
/// Bits of a word.
const WORD: usize = u64::BITS as usize;
/// The end of a bucket's chain.
const NONE: u32 = u32::MAX;
/// Half the side of the first square that is searched for the nearest weeds, in buckets, and how it grows.
const FIRST_REACH: usize = 1;
const GROWTH: usize = 2;

/// Known weeds in the order of detection; buckets find the nearest ones.
///
/// To add a weed, to remove one and to ask for one by its number takes as long among many as among few, but for the others
/// of the same bucket. To list them takes a look at every 64 detections.
#[derive(Debug, Clone)]
pub struct KnownWeeds {
    /// Which numbers are those of known weeds, 64 to a word, lowest bit first; and how many.
    standing: Vec<u64>,
    count: usize,
    grid: Arc<Grid>,
    /// Buckets that hold a weed.
    occupied: Box<CellSet>,
    /// For each of them the first weed of its chain, by number.
    first: Vec<u32>,
    /// For each weed number its position, and the next weed of its bucket.
    chain: Vec<(Point, u32)>,
    /// The numbers struck out, in that order.
    removed: Vec<u32>,
}

impl KnownWeeds {
    /// No weed on a pasture of `length_m` by `width_m`.
    #[must_use]
    pub fn none(length_m: f64, width_m: f64) -> Self {
        let side_m = (length_m * width_m / BUCKETS).sqrt().max(BUCKET_M);
        let grid = Grid::with_cells_of(side_m, length_m, width_m);
        let occupied = Box::new(CellSet::empty(&grid));
        let first = vec![NONE; 64 * occupied.words().len()];
        let (standing, chain, removed) = (Vec::new(), Vec::new(), Vec::new());
        Self { standing, count: 0, grid: Arc::new(grid), occupied, first, chain, removed }
    }

    /// Forgets every weed.
    pub fn clear(&mut self) {
        self.occupied.clear();
        self.standing.clear();
        self.count = 0;
        self.chain.clear();
        self.removed.clear();
    }

    /// Makes room for so many detections.
    pub(crate) fn reserve(&mut self, weeds: usize) {
        let words = weeds.div_ceil(WORD);
        self.standing.reserve(words.saturating_sub(self.standing.len()));
        self.chain.reserve(weeds.saturating_sub(self.chain.len()));
        self.removed.reserve(weeds.saturating_sub(self.removed.len()));
    }

    /// Adds a weed that was detected after all others.
    ///
    /// # Panics
    ///
    /// If the weed's number is not above those of all weeds so far.
    pub fn add(&mut self, weed: KnownWeed) {
        let number = weed.number as usize;
        assert!(number >= self.chain.len(), "weeds are known in the order of their detection");
        let cell = self.grid.cell_at(weed.position);
        let after = if self.occupied.insert(cell) { NONE } else { self.first[bucket(cell)] };
        // Numbers left out belong to weeds that were mowed before this list began.
        self.chain.resize(number, (weed.position, NONE));
        self.chain.push((weed.position, after));
        self.first[bucket(cell)] = weed.number;
        self.standing.resize(number / WORD + 1, 0);
        self.standing[number / WORD] |= 1 << (number % WORD);
        self.count += 1;
    }

    /// Takes note that a detected weed was mowed, even one that was never in this list.
    pub(crate) fn strike_out(&mut self, number: u32) {
        if self.holds(number) {
            self.remove(number);
        } else {
            self.removed.push(number);
        }
    }

    /// Strikes out the weed of that number, if it is known.
    pub fn remove(&mut self, number: u32) {
        if !self.holds(number) {
            return;
        }
        self.standing[number as usize / WORD] &= !(1 << (number as usize % WORD));
        self.count -= 1;
        self.removed.push(number);
        let (position, after) = self.chain[number as usize];
        let cell = self.grid.cell_at(position);
        let first = &mut self.first[bucket(cell)];
        if *first == number {
            *first = after;
            if after == NONE {
                self.occupied.remove(cell);
            }
            return;
        }
        let mut before = *first as usize;
        while self.chain[before].1 != number {
            before = self.chain[before].1 as usize;
        }
        self.chain[before].1 = after;
    }

    /// Number of known weeds.
    #[must_use]
    #[inline]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether no weed is known that is still to be mowed.
    #[must_use]
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The weeds in the order of their detection.
    #[must_use]
    #[inline]
    pub fn iter(&self) -> Iter<'_> {
        self.since(0)
    }

    /// The weeds whose numbers are not below `number`, in the order of their detection.
    #[must_use]
    #[inline]
    pub fn since(&self, number: u32) -> Iter<'_> {
        Iter::since(&self.standing, &self.chain, number)
    }

    /// A number above those of all weeds that were added; it tells nothing of those that were struck out unseen.
    #[must_use]
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "numbers have 32 bits")]
    pub(crate) fn next_number(&self) -> u32 {
        self.chain.len() as u32
    }

    /// Whether the weed of that number is known and not yet mowed.
    #[must_use]
    #[inline]
    pub fn holds(&self, number: u32) -> bool {
        let word = self.standing.get(number as usize / WORD);
        word.is_some_and(|word| word >> (number as usize % WORD) & 1 == 1)
    }

    /// The weed of that number, if it is known and not yet mowed.
    #[must_use]
    pub fn of_number(&self, number: u32) -> Option<KnownWeed> {
        let weed = || KnownWeed { number, position: self.chain[number as usize].0 };
        self.holds(number).then(weed)
    }

    /// The numbers of the weeds that were struck out, in that order.
    #[must_use]
    pub fn removed(&self) -> &[u32] {
        &self.removed
    }

    /// Writes the weeds nearest to `from` to `nearest` with their squared distances, nearest first, ties by order of detection; returns how many.
    pub fn nearest(&self, from: Point, nearest: &mut [(f64, KnownWeed)]) -> usize {
        let mut found = Nearest { places: nearest, count: 0, limit_m2: f64::INFINITY };
        let (column, row) = self.grid.cell_of(from);
        let side_m = self.smallest_side_m();
        let mut reach = FIRST_REACH;
        loop {
            // Where weeds are few and far between, looking at each of them is quicker than at empty buckets.
            if self.count <= found.places.len().max(4 * reach * reach) {
                self.iter().for_each(|weed| found.offer(from, weed));
                break;
            }
            let around =
                |at: usize, cells: usize| at.saturating_sub(reach)..(at + reach + 1).min(cells);
            let columns = around(column, self.grid.columns());
            let rows = around(row, self.grid.rows());
            self.for_each_bucket(columns, rows, |bucket| {
                if bucket.nearest_m2(from) <= found.limit_m2 {
                    self.for_each_in(bucket.cell, |weed| found.offer(from, weed));
                }
            });
            let gap_m = self.gap_m(from, column, row, reach);
            if gap_m == f64::INFINITY || (found.is_full() && gap_m * gap_m > found.limit_m2) {
                break;
            }
            reach = if found.is_full() {
                // No weed outside this square is closer than the farthest one found.
                reach.max(floor_index(found.limit_m2.sqrt() / side_m)) + 1
            } else {
                GROWTH * reach
            };
            found.count = 0;
        }
        found.count
    }

    /// Calls `visit` with the weeds that are not farther than `reach_m` from a point along x and y, and with others close by;
    /// in no particular order.
    pub fn for_each_near(&self, at: Point, reach_m: f64, visit: impl FnMut(KnownWeed)) {
        let window = Window::around(at, (reach_m, reach_m), &self.grid);
        self.for_each_between(&Window::NOWHERE, &window, visit);
    }

    /// Size of the pasture along x and y, metres.
    pub(crate) fn size_m(&self) -> (f64, f64) {
        self.grid.size_m()
    }

    /// A window that holds all weeds within about `reach_m` of a point: the window's slack may be missing.
    pub(crate) fn window(&self, around: Point, reach_m: f64) -> Window {
        let (off_x_m, off_y_m) = self.off_m(around);
        // Half a chord of the circle, at the pasture's border.
        let along = |off_m: f64| {
            if off_m > 0.0 { (reach_m * reach_m - off_m * off_m).max(0.0).sqrt() } else { reach_m }
        };
        Window::around(around, (along(off_y_m), along(off_x_m)), &self.grid)
    }

    /// How far a point is off the pasture along x and y, metres; 0 on it.
    pub(crate) fn off_m(&self, point: Point) -> (f64, f64) {
        let (length_m, width_m) = self.size_m();
        let off_m = |at_m: f64, size_m: f64| larger(larger(-at_m, at_m - size_m), 0.0);
        (off_m(point.x, length_m), off_m(point.y, width_m))
    }

    /// Whether a weed there would be in a window.
    pub(crate) fn is_in(&self, window: &Window, position: Point) -> bool {
        window.holds(self.grid.cell_of(position))
    }

    /// Calls `visit` with the weeds in `outer` that are not in `inner`, which it holds.
    pub(crate) fn for_each_between(
        &self,
        inner: &Window,
        outer: &Window,
        mut visit: impl FnMut(KnownWeed),
    ) {
        let counts = [self.grid.columns(), self.grid.rows()];
        let [columns, rows] = outer.buckets(counts);
        let [inner_columns, inner_rows] = inner.buckets(counts);
        let mut visit_buckets = |columns: Range<usize>, rows: Range<usize>| {
            if !columns.is_empty() && !rows.is_empty() {
                self.occupied.for_each_in(&self.grid, columns, rows, |cell| {
                    self.for_each_in(cell, &mut visit);
                });
            }
        };
        if inner_columns.is_empty() || inner_rows.is_empty() {
            visit_buckets(columns, rows);
            return;
        }
        visit_buckets(columns.clone(), rows.start..inner_rows.start);
        visit_buckets(columns.clone(), inner_rows.end..rows.end);
        visit_buckets(columns.start..inner_columns.start, inner_rows.clone());
        visit_buckets(inner_columns.end..columns.end, inner_rows);
    }

    fn smallest_side_m(&self) -> f64 {
        let (side_x_m, side_y_m) = self.grid.cell_m();
        side_x_m.min(side_y_m)
    }

    /// How far `from` is at least from anything outside the square of buckets that reach so far from its own, metres:
    /// sides beyond the pasture's border left out, and 0 for a point outside the square.
    fn gap_m(&self, from: Point, column: usize, row: usize, reach: usize) -> f64 {
        let (side_x_m, side_y_m) = self.grid.cell_m();
        let side = |at_m: f64, side_m: f64, cell: usize, cells: usize| {
            let below_m = (cell > reach).then(|| at_m - side_m * (cell - reach) as f64);
            let end = cell + reach + 1;
            let above_m = (end < cells).then_some(side_m * end as f64 - at_m);
            below_m.unwrap_or(f64::INFINITY).min(above_m.unwrap_or(f64::INFINITY)).max(0.0)
        };
        let x_m = side(from.x, side_x_m, column, self.grid.columns());
        x_m.min(side(from.y, side_y_m, row, self.grid.rows()))
    }

    /// Calls `visit` with the buckets that hold weeds in these columns and rows.
    #[inline]
    fn for_each_bucket(
        &self,
        columns: Range<usize>,
        rows: Range<usize>,
        mut visit: impl FnMut(Bucket),
    ) {
        let (half_x_m, half_y_m) = (0.5 * self.grid.cell_m().0, 0.5 * self.grid.cell_m().1);
        self.occupied.for_each_in(&self.grid, columns, rows, |cell| {
            let middle = self.grid.centre(cell.column, cell.row);
            visit(Bucket { cell, middle, half_x_m, half_y_m });
        });
    }

    /// Calls `visit` with the weeds of a bucket that holds some.
    #[inline]
    fn for_each_in(&self, cell: Cell, mut visit: impl FnMut(KnownWeed)) {
        let mut number = self.first[bucket(cell)];
        while number != NONE {
            let (position, next) = self.chain[number as usize];
            visit(KnownWeed { number, position });
            number = next;
        }
    }
}

impl<'a> IntoIterator for &'a KnownWeeds {
    type Item = KnownWeed;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

/// The ground of a bucket.
struct Bucket {
    cell: Cell,
    middle: Point,
    half_x_m: f64,
    half_y_m: f64,
}

impl Bucket {
    /// Squared distance from a point to the nearest point of the bucket.
    #[inline]
    fn nearest_m2(&self, from: Point) -> f64 {
        let x_m = larger((from.x - self.middle.x).abs() - self.half_x_m, 0.0);
        let y_m = larger((from.y - self.middle.y).abs() - self.half_y_m, 0.0);
        x_m * x_m + y_m * y_m
    }
}

/// Where a cell's chain begins: buckets lie as the bits of their tiles.
#[inline]
fn bucket(cell: Cell) -> usize {
    cell.tile * 64 + cell.bit as usize
}

/// Whether a weed at a squared distance is listed before another: the nearer one, and of two as near that detected first.
#[inline]
pub(crate) fn is_before(weed: &(f64, KnownWeed), other: &(f64, KnownWeed)) -> bool {
    weed.0 < other.0 || (weed.0 <= other.0 && weed.1.number < other.1.number)
}

/// The nearest weeds so far, nearest first.
struct Nearest<'a> {
    places: &'a mut [(f64, KnownWeed)],
    count: usize,
    /// Weeds farther than this are not wanted, squared metres.
    limit_m2: f64,
}

impl Nearest<'_> {
    fn is_full(&self) -> bool {
        self.count == self.places.len()
    }

    #[inline]
    fn offer(&mut self, from: Point, weed: KnownWeed) {
        let distance_m2 = (weed.position - from).norm_squared();
        if distance_m2 > self.limit_m2 {
            return;
        }
        let offered = (distance_m2, weed);
        let mut place = self.count;
        while place > 0 && is_before(&offered, &self.places[place - 1]) {
            place -= 1;
        }
        let is_listed = place > 0 && self.places[place - 1].1.number == weed.number;
        if is_listed || place == self.places.len() {
            return;
        }
        self.count = (self.count + 1).min(self.places.len());
        for later in (place + 1..self.count).rev() {
            self.places[later] = self.places[later - 1];
        }
        self.places[place] = offered;
        if self.is_full() {
            self.limit_m2 = self.places[self.count - 1].0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, StreamRng, below, stream, uniform};

    #[test]
    fn what_is_known_is_what_was_added_less_what_was_removed_in_the_order_of_detection() {
        let mut rng = stream(7, Stream::Weeds);
        let number_below = |end: u32, rng: &mut StreamRng| {
            u32::try_from(below(end as usize, rng)).expect("below 32 bits")
        };
        let mut known = KnownWeeds::none(53.0, 31.0);
        for longest in [0, 1, 63, 64, 65, 3000] {
            known.clear();
            assert_eq!((known.len(), known.next_number(), known.iter().count()), (0, 0, 0));
            assert_eq!(
                (known.since(5).count(), known.of_number(0), known.holds(64)),
                (0, None, false)
            );
            let (mut listed, mut removed, mut next) = (Vec::<KnownWeed>::new(), Vec::new(), 0);
            while next < longest {
                // Numbers may be left out, many in a row too, since those weeds were mowed before the list began.
                let gap = if number_below(20, &mut rng) == 0 { 300 } else { 2 };
                let number = next + number_below(gap, &mut rng);
                let position = Point::new(53.0 * uniform(&mut rng), 31.0 * uniform(&mut rng));
                let weed = KnownWeed { number, position };
                known.add(weed);
                listed.push(weed);
                next = number + 1;
                if below(3, &mut rng) > 0 {
                    let number = number_below(next, &mut rng);
                    known.remove(number);
                    if let Some(place) = listed.iter().position(|weed| weed.number == number) {
                        removed.push(listed.remove(place).number);
                    }
                }
                assert_eq!((known.len(), known.is_empty()), (listed.len(), listed.is_empty()));
                assert_eq!((known.next_number(), known.removed()), (next, &removed[..]));
                assert!(known.iter().eq(listed.iter().copied()));
                let from = number_below(next + 70, &mut rng);
                let later = listed.iter().copied().filter(|weed| weed.number >= from);
                assert!(known.since(from).eq(later), "from {from} of {next}");
                let asked = listed.iter().copied().find(|weed| weed.number == from);
                assert_eq!((known.of_number(from), known.holds(from)), (asked, asked.is_some()));
            }
        }
    }

    #[test]
    fn the_nearest_by_buckets_are_the_nearest_by_looking_at_all() {
        let mut rng = stream(3, Stream::Weeds);
        for count in [0, 1, 7, 24, 25, 60, 400] {
            let mut known = KnownWeeds::none(53.0, 31.0);
            for number in 0..count {
                let position = Point::new(53.0 * uniform(&mut rng), 31.0 * uniform(&mut rng));
                known.add(KnownWeed { number, position });
            }
            for number in (0..count).filter(|number| number % 3 == 0) {
                known.remove(number);
            }
            for _ in 0..50 {
                let from =
                    Point::new(80.0 * uniform(&mut rng) - 15.0, 60.0 * uniform(&mut rng) - 15.0);
                let mut all: Vec<(f64, KnownWeed)> = known
                    .iter()
                    .map(|weed| ((weed.position - from).norm_squared(), weed))
                    .collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.number.cmp(&b.1.number)));
                all.truncate(8);
                let mut nearest = [(0.0, KnownWeed { number: 0, position: Point::origin() }); 8];
                let found = known.nearest(from, &mut nearest);
                assert_eq!(nearest[..found], all[..], "{count} weeds from {from}");
            }
        }
    }
}
