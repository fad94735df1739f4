//! The observation parts `candidates` and `action_mask`: a row for each place that the action kind `target` offers.

use std::f64::consts::FRAC_PI_2;

use crate::candidates::{Candidate, Candidates, Purpose};
use crate::config::ValidScenario;
use crate::geometry::{Frame, Point};
use crate::math::{atan2, floor_index, wrap_to_tau};
use crate::view::View;

use super::{Bound, Dtype, Part};

/// Name and lowest value of each column; the highest is 1.
const COLUMNS: [(&str, f32); 18] = [
    ("is_weed", 0.0),
    ("is_view", 0.0),
    ("is_search", 0.0),
    ("forward", -1.0),
    ("left", -1.0),
    ("distance", 0.0),
    ("bearing_cos", -1.0),
    ("bearing_sin", -1.0),
    ("way", 0.0),
    ("unseen_share", 0.0),
    ("budget_share", 0.0),
    ("heading_cos", -1.0),
    ("heading_sin", -1.0),
    ("detour", -1.0),
    ("unseen_around", 0.0),
    ("next_weed", 0.0),
    ("seen", 0.0),
    ("known", 0.0),
];
/// Known weeds at which the last column is a half.
const MANY_WEEDS: f64 = 10.0;

/// Writes the `candidates` table: a row of 18 numbers for each candidate, zeros where there is none.
///
/// Lengths v are written as v / (|v| + s) with the sensor range s, so that near places are told apart well, far ones
/// stay below 1, and the size of the pasture does not matter.
///
/// | column | value | range |
/// |---|---|---|
/// | 0, 1, 2 | 1 for a weed, for a view, for the search | 0 to 1 |
/// | 3, 4 | forward and left offset of the goal, as lengths | -1 to 1 |
/// | 5 | its straight distance, as a length | 0 to 1 |
/// | 6, 7 | cosine and sine of its bearing | -1 to 1 |
/// | 8 | length of the way, as a length | 0 to 1 |
/// | 9 | share of what the sensor will show there that is unseen ground | 0 to 1 |
/// | 10 | share of the whole budget that the way costs | 0 to 1 |
/// | 11, 12 | cosine and sine of the heading in which the mower arrives, from its own | -1 to 1 |
/// | 13 | by how much the way of the search gets longer if this comes first, as a length | -1 to 1 |
/// | 14 | share of the square around the end of the way, two sensor ranges wide, that is unseen ground | 0 to 1 |
/// | 15 | from its end with one turn and a straight to the nearest of the other weeds in the table, as a length; 1 if there is none | 0 to 1 |
/// | 16 | share of the pasture that was seen; the same in every row | 0 to 1 |
/// | 17 | number n of known weeds as n / (n + 10); the same in every row | 0 to 1 |
#[derive(Debug, Clone)]
pub struct CandidateEncoder {
    rows: usize,
    is_flat: bool,
    budget_m: f64,
}

impl CandidateEncoder {
    /// The encoder of a scenario whose path may be `budget_m` long.
    #[must_use]
    pub fn new(scenario: &ValidScenario, budget_m: f64) -> Self {
        let rows = scenario.action.candidates();
        Self { rows, is_flat: scenario.observation.flat, budget_m }
    }

    /// The encoder of a flat table with so many rows, for a path that may be `budget_m` long.
    #[must_use]
    pub fn flat(rows: usize, budget_m: f64) -> Self {
        Self { rows, is_flat: true, budget_m }
    }

    /// The table.
    #[must_use]
    pub fn part(&self) -> Part {
        let bound = |prefix: &str, (name, low): (&str, f32)| Bound {
            name: format!("{prefix}{name}"),
            low,
            high: 1.0,
        };
        let (shape, bounds) = if self.is_flat {
            let row = |i: usize| COLUMNS.map(|column| bound(&format!("candidate_{i}_"), column));
            (vec![self.rows * COLUMNS.len()], (0..self.rows).flat_map(row).collect())
        } else {
            (vec![self.rows, COLUMNS.len()], COLUMNS.map(|column| bound("", column)).into())
        };
        Part { name: "candidates", dtype: Dtype::Float32, shape, bounds }
    }

    /// The mask.
    #[must_use]
    pub fn mask_part(&self) -> Part {
        let bounds = (0..self.rows)
            .map(|i| Bound { name: format!("candidate_{i}_open"), low: 0.0, high: 1.0 })
            .collect();
        Part { name: "action_mask", dtype: Dtype::Int8, shape: vec![self.rows], bounds }
    }

    /// Writes the table of `candidates`, which are those of `view`.
    pub fn encode(&self, view: &View, candidates: &Candidates, table: &mut [f32]) {
        let frame = Frame::from(view.pose);
        let soft = |value_m: f64| value_m / (value_m.abs() + view.site.sensor_range_m);
        let known = view.known_weeds.len() as f64;
        for (row, candidate) in table.chunks_exact_mut(COLUMNS.len()).zip(candidates.rows()) {
            row.fill(0.0);
            let Some(candidate) = candidate else { continue };
            let (forward_m, left_m) = frame.offsets_to(candidate.way.goal().position());
            let distance_m = (forward_m * forward_m + left_m * left_m).sqrt();
            let (cos, sin) = if distance_m > 0.0 {
                (forward_m / distance_m, left_m / distance_m)
            } else {
                (1.0, 0.0)
            };
            let way_m = candidate.way.length_m();
            let arrival = candidate.way.end();
            row[match candidate.purpose {
                Purpose::Weed(_) => 0,
                Purpose::View => 1,
                Purpose::Search => 2,
            }] = 1.0;
            let values = [
                soft(forward_m),
                soft(left_m),
                soft(distance_m),
                cos,
                sin,
                soft(way_m),
                candidate.unseen_share,
                way_m / self.budget_m,
                arrival.cos * frame.cos + arrival.sin * frame.sin,
                arrival.sin * frame.cos - arrival.cos * frame.sin,
                soft(candidates.detour_m(candidate, view.site)),
                unseen_around(arrival.pose.position(), view),
                next_weed_m(candidate, candidates, view).map_or(1.0, soft),
                view.ground.fraction(),
                known / (known + MANY_WEEDS),
            ];
            for (number, value) in row[3..].iter_mut().zip(values) {
                *number = super::signed(value);
            }
        }
    }

    /// Writes 1 where there is a candidate, 0 elsewhere.
    pub fn encode_mask(&self, candidates: &Candidates, mask: &mut [i8]) {
        for (is_open, row) in mask.iter_mut().zip(candidates.rows()) {
            *is_open = i8::from(row.is_some());
        }
    }
}

/// Share of the square around a point, two sensor ranges wide, that is unseen ground, 0 to 1.
fn unseen_around(middle: Point, view: &View) -> f64 {
    let (grid, range_m) = (view.ground.grid(), view.site.sensor_range_m);
    if view.ground.unseen_count() == 0 {
        return 0.0;
    }
    let (side_x_m, side_y_m) = grid.cell_m();
    // Cells whose centres lie within.
    let cells = |at_m: f64, side_m: f64, count: usize| {
        let place = |at_m: f64| floor_index((at_m / side_m + 0.5).max(0.0)).min(count);
        place(at_m - range_m)..place(at_m + range_m)
    };
    let columns = cells(middle.x, side_x_m, grid.columns());
    let mut unseen = 0;
    for row in cells(middle.y, side_y_m, grid.rows()) {
        view.ground.for_each_unseen(columns.clone(), row, |_, bits| unseen += bits.count_ones());
    }
    f64::from(unseen) * side_x_m * side_y_m / (4.0 * range_m * range_m)
}

/// From the end of a candidate's way with one turn and a straight to the nearest of the other weeds among the candidates,
/// metres; `None` if there is none.
fn next_weed_m(candidate: &Candidate, candidates: &Candidates, view: &View) -> Option<f64> {
    let (end, radius_m) = (candidate.way.end(), view.site.turning_radius_m);
    let others = candidates.rows().iter().flatten().filter_map(|other| match other.purpose {
        Purpose::Weed(number) if other.purpose != candidate.purpose => {
            let weed = view.known_weeds.of_number(number)?;
            Some(turn_and_straight_m(end.offsets_to(weed.position), radius_m))
        }
        _ => None,
    });
    others.min_by(f64::total_cmp)
}

/// The shorter of a turn to the left and one to the right, each with a straight behind it, to a point so far ahead and to
/// the left, metres.
fn turn_and_straight_m((ahead_m, left_m): (f64, f64), radius_m: f64) -> f64 {
    let way_m = |left_m: f64| {
        // Seen from the turning centre.
        let across_m = left_m - radius_m;
        let straight_m2 = ahead_m * ahead_m + across_m * across_m - radius_m * radius_m;
        if straight_m2 < 0.0 {
            return f64::INFINITY;
        }
        let straight_m = straight_m2.sqrt();
        let turn_rad = atan2(across_m, ahead_m) - atan2(straight_m, radius_m) + FRAC_PI_2;
        straight_m + radius_m * wrap_to_tau(turn_rad)
    };
    way_m(left_m).min(way_m(-left_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_turn_and_a_straight_are_as_long_as_they_are_by_hand() {
        let cases = [
            ((7.0, 0.0), 7.0),             // straight ahead
            ((2.0, 2.0), PI),              // a quarter of the left circle
            ((2.0, -2.0), PI),             // and of the right one
            ((0.0, 4.0), 2.0 * PI),        // half of it
            ((-3.0, 4.0), 2.0 * PI + 3.0), // and straight back
            ((2.0, 7.0), PI + 5.0),        // a quarter, then across
        ];
        for (point, expected_m) in cases {
            let length_m = turn_and_straight_m(point, 2.0);
            assert!((length_m - expected_m).abs() < 1e-9, "{point:?}: {length_m} m");
        }
    }
}
