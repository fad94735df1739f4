//! How far the mower had come when it found what there is to find.

use swath_core::deck::Cut;
use swath_core::env::{Env, Watch};
use swath_core::grid::{Cell, Grid};
use swath_core::sensor::Percept;

/// The path driven when each weed and each cell of the ground was found, metres since reset; infinite: never.
///
/// A weed that was mowed is placed at the end of the stretch that mowed it, which is at most 0.2 m long.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timeline {
    /// When the sensor saw each weed, in the order of the weeds.
    pub weed_detected_m: Vec<f64>,
    /// When each weed was mowed, in the same order.
    pub weed_mowed_m: Vec<f64>,
    /// When each cell of the ground was seen, row by row from y = 0, each row along x.
    pub cell_seen_m: Vec<f64>,
    /// Number of cells in a row.
    pub columns: usize,
}

/// What a [`Timeline`] is made of, in the order in which it came about.
#[derive(Debug, Default)]
pub struct Log {
    detected: Vec<(u32, f64)>,
    mowed: Vec<(u32, f64)>,
    seen: Vec<(Cell, f64)>,
}

impl Watch for Log {
    fn on_cut(&mut self, path_m: f64, cut: &Cut) {
        self.mowed.extend(cut.mowed.iter().map(|&weed| (weed, path_m)));
        self.seen.extend(cut.seen.iter().map(|&cell| (cell, path_m)));
    }

    fn on_look(&mut self, path_m: f64, percept: &Percept) {
        self.detected.extend(percept.detected.iter().map(|&weed| (weed, path_m)));
        self.seen.extend(percept.seen.iter().map(|&cell| (cell, path_m)));
    }
}

impl Log {
    /// Sums up the episode that `env` has come through while this was listening: what has been found and was never told was
    /// found by the look at the start.
    #[must_use]
    pub fn timeline(&self, env: &Env) -> Timeline {
        let (weeds, view) = (env.weeds(), env.view());
        let grid: &Grid = view.ground.grid();
        let at_start = |is_found: bool| if is_found { 0.0 } else { f64::INFINITY };
        let mut weed_detected_m: Vec<f64> =
            weeds.is_detected().iter().map(|&is_detected| at_start(is_detected)).collect();
        let mut weed_mowed_m = vec![f64::INFINITY; weeds.positions().len()];
        let mut cell_seen_m: Vec<f64> = (0..grid.rows())
            .flat_map(|row| (0..grid.columns()).map(move |column| (column, row)))
            .map(|(column, row)| at_start(view.ground.is_seen(column, row)))
            .collect();
        // A cell may be told twice, by the deck and by the sensor: the first one counts.
        for &(cell, path_m) in self.seen.iter().rev() {
            cell_seen_m[cell.row * grid.columns() + cell.column] = path_m;
        }
        for &(weed, path_m) in &self.detected {
            weed_detected_m[weed as usize] = path_m;
        }
        for &(weed, path_m) in &self.mowed {
            weed_mowed_m[weed as usize] = path_m;
        }
        Timeline { weed_detected_m, weed_mowed_m, cell_seen_m, columns: grid.columns() }
    }
}
