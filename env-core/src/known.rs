//! The weeds that a mower has still to mow, as far as it knows.

use std::ops::Deref;

use crate::geometry::Point;
use crate::math::floor_index;

/// A weed that was detected and not yet mowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownWeed {
    /// Order of detection, from 0. It says nothing about weeds that were not detected.
    pub number: u32,
    /// World frame, metres.
    pub position: Point,
}

/// Smallest side of a bucket, metres; larger pastures have larger buckets, so that there are at most about this many.
const BUCKET_M: f64 = 1.0;
const BUCKETS: f64 = 16_384.0;
/// The end of a bucket's chain.
const NONE: u32 = u32::MAX;

/// Known weeds in the order of detection, read as a slice; buckets find the nearest ones.
#[derive(Debug, Clone)]
pub struct KnownWeeds {
    list: Vec<KnownWeed>,
    side_m: f64,
    columns: usize,
    rows: usize,
    /// For each bucket the first weed of its chain, by number.
    first: Vec<u32>,
    /// For each weed number its position, and the next weed of its bucket.
    chain: Vec<(Point, u32)>,
}

impl Deref for KnownWeeds {
    type Target = [KnownWeed];

    fn deref(&self) -> &[KnownWeed] {
        &self.list
    }
}

impl KnownWeeds {
    /// No weed on a pasture of `length_m` by `width_m`.
    #[must_use]
    pub fn none(length_m: f64, width_m: f64) -> Self {
        let side_m = (length_m * width_m / BUCKETS).sqrt().max(BUCKET_M);
        let count = |size_m: f64| floor_index((size_m / side_m).ceil()).max(1);
        let (columns, rows) = (count(length_m), count(width_m));
        Self {
            list: Vec::new(),
            side_m,
            columns,
            rows,
            first: vec![NONE; columns * rows],
            chain: Vec::new(),
        }
    }

    /// Forgets every weed.
    pub fn clear(&mut self) {
        for index in 0..self.list.len() {
            let bucket = self.bucket_of(self.list[index].position);
            self.first[bucket] = NONE;
        }
        self.list.clear();
        self.chain.clear();
    }

    /// Adds a weed that was detected after all others.
    ///
    /// # Panics
    ///
    /// If the weed's number is not above those of all weeds so far.
    pub fn add(&mut self, weed: KnownWeed) {
        let number = weed.number as usize;
        assert!(number >= self.chain.len(), "weeds are known in the order of their detection");
        let bucket = self.bucket_of(weed.position);
        // Numbers left out belong to weeds that were mowed before this list began.
        self.chain.resize(number, (weed.position, NONE));
        self.chain.push((weed.position, self.first[bucket]));
        self.first[bucket] = weed.number;
        self.list.push(weed);
    }

    /// Strikes out the weed of that number, if it is known.
    pub fn remove(&mut self, number: u32) {
        let Ok(index) = self.list.binary_search_by_key(&number, |weed| weed.number) else { return };
        let weed = self.list.remove(index);
        let bucket = self.bucket_of(weed.position);
        let after = self.chain[number as usize].1;
        if self.first[bucket] == number {
            self.first[bucket] = after;
            return;
        }
        let mut before = self.first[bucket] as usize;
        while self.chain[before].1 != number {
            before = self.chain[before].1 as usize;
        }
        self.chain[before].1 = after;
    }

    /// Whether the weed of that number is known and not yet mowed.
    #[must_use]
    pub fn holds(&self, number: u32) -> bool {
        self.list.binary_search_by_key(&number, |weed| weed.number).is_ok()
    }

    /// Writes the weeds nearest to `from` to `nearest` with their squared distances, nearest first, ties by order of detection; returns how many.
    pub fn nearest(&self, from: Point, nearest: &mut [(f64, KnownWeed)]) -> usize {
        let mut found = Nearest { places: nearest, count: 0 };
        let (column, row) = self.cell_of(from);
        for ring in 0..self.columns.max(self.rows) {
            let gap_m = self.gap_m(from, column, row, ring);
            if found.is_full() && gap_m > 0.0 && gap_m * gap_m > found.farthest_m2() {
                break;
            }
            // Where weeds are few and far between, looking at each of them is quicker than at empty buckets.
            if ring * ring > self.list.len() {
                found.count = 0;
                self.list.iter().for_each(|&weed| found.offer(from, weed));
                break;
            }
            self.for_each_in_ring(column, row, ring, |weed| found.offer(from, weed));
        }
        found.count
    }

    /// How far `from` is from anything in this ring or beyond: its distance to the nearest side of the square of rings
    /// within, sides along the pasture's border left out.
    fn gap_m(&self, from: Point, column: usize, row: usize, ring: usize) -> f64 {
        let side = |at_m: f64, cell: usize, cells: usize| {
            let below_m = (cell + 1 > ring).then(|| at_m - self.side_m * (cell + 1 - ring) as f64);
            let above_m = (cell + ring < cells).then(|| self.side_m * (cell + ring) as f64 - at_m);
            below_m.unwrap_or(f64::INFINITY).min(above_m.unwrap_or(f64::INFINITY))
        };
        side(from.x, column, self.columns).min(side(from.y, row, self.rows))
    }

    /// Calls `visit` with the weeds of the buckets at `ring` buckets from the one given.
    fn for_each_in_ring(
        &self,
        column: usize,
        row: usize,
        ring: usize,
        mut visit: impl FnMut(KnownWeed),
    ) {
        let (left, right) = (column.checked_sub(ring), column + ring);
        for r in row.saturating_sub(ring)..=(row + ring).min(self.rows - 1) {
            if r + ring == row || r == row + ring {
                for c in left.unwrap_or(0)..=right.min(self.columns - 1) {
                    self.for_each_in_bucket(c, r, &mut visit);
                }
            } else {
                if let Some(left) = left {
                    self.for_each_in_bucket(left, r, &mut visit);
                }
                if right < self.columns {
                    self.for_each_in_bucket(right, r, &mut visit);
                }
            }
        }
    }

    fn for_each_in_bucket(&self, column: usize, row: usize, visit: &mut impl FnMut(KnownWeed)) {
        let mut number = self.first[row * self.columns + column];
        while number != NONE {
            let (position, next) = self.chain[number as usize];
            visit(KnownWeed { number, position });
            number = next;
        }
    }

    fn cell_of(&self, point: Point) -> (usize, usize) {
        let column = floor_index(point.x / self.side_m).min(self.columns - 1);
        (column, floor_index(point.y / self.side_m).min(self.rows - 1))
    }

    fn bucket_of(&self, point: Point) -> usize {
        let (column, row) = self.cell_of(point);
        row * self.columns + column
    }
}

/// The nearest weeds so far, nearest first.
struct Nearest<'a> {
    places: &'a mut [(f64, KnownWeed)],
    count: usize,
}

impl Nearest<'_> {
    fn is_full(&self) -> bool {
        self.count == self.places.len()
    }

    fn farthest_m2(&self) -> f64 {
        self.places[self.count - 1].0
    }

    #[inline]
    fn offer(&mut self, from: Point, weed: KnownWeed) {
        let distance_m2 = (weed.position - from).norm_squared();
        let is_before =
            |other: &(f64, KnownWeed)| (distance_m2, weed.number) < (other.0, other.1.number);
        let mut place = self.count;
        while place > 0 && is_before(&self.places[place - 1]) {
            place -= 1;
        }
        if place == self.places.len() {
            return;
        }
        self.count = (self.count + 1).min(self.places.len());
        self.places[place..self.count].rotate_right(1);
        self.places[place] = (distance_m2, weed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, stream, uniform};

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
                    .map(|&weed| ((weed.position - from).norm_squared(), weed))
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
