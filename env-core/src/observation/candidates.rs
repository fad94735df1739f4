//! The observation parts `candidates` and `action_mask`: a row for each place that the action kind `target` offers.

use crate::candidates::{Candidates, Purpose};
use crate::config::ValidScenario;
use crate::geometry::Frame;
use crate::view::View;

use super::{Bound, Dtype, Part};

/// Name and lowest value of each column; the highest is 1.
const COLUMNS: [(&str, f32); 11] = [
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
];

/// Writes the `candidates` table: a row of 11 numbers for each candidate, zeros where there is none.
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
