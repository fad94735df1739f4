//! How much the environments of a session hold: cells and weeds.

use swath_core::batch::split;
use swath_core::config::ValidScenario;
use swath_core::env::{SnapshotError, weeds_in};
use swath_core::grid::Grid;

use crate::fault::Fault;
use crate::room::Bounds;

/// Most weeds of an episode that the scenario itself begins.
pub(super) fn most_weeds(scenario: &ValidScenario) -> usize {
    let weeds = &scenario.weeds;
    weeds.positions_m.as_ref().map_or(weeds.count as usize, Vec::len)
}

/// Of each row the larger number.
pub(super) fn most_of(weeds: &[u64], others: impl IntoIterator<Item = u64>) -> Vec<u64> {
    weeds.iter().zip(others).map(|(&weeds, other)| weeds.max(other)).collect()
}

/// The weeds of all rows together, if they are few enough.
pub(super) fn check_weeds(field: &str, weeds: &[u64], bounds: Bounds) -> Result<u64, Fault> {
    let got = weeds.iter().fold(0_u64, |sum, &weeds| sum.saturating_add(weeds));
    let most = bounds.max_weeds;
    if got <= most {
        return Ok(got);
    }
    let text = format!(
        "`{field}` must leave at most {most} weeds in all environments of a session together, each counted with the most \
         that it has had, got {got}"
    );
    Err(Fault::BadConfig { text })
}

/// Number of weeds in the snapshot of a row, of which it may have `most` where there are percepts.
pub(super) fn weeds_of(snapshot: &[u8], row: usize, most: Option<u64>) -> Result<u64, Fault> {
    let weeds = weeds_in(snapshot).map_err(|error| bad_snapshot(&error))?;
    match most {
        Some(most) if weeds > most => {
            let text = format!(
                "`snapshot` must have at most {most} weeds in environment {row} with `percept`, got {weeds}"
            );
            Err(Fault::BadConfig { text })
        }
        _ => Ok(weeds),
    }
}

/// The same of every row of a batch.
pub(super) fn weeds_of_rows(
    snapshot: &[u8],
    rows: usize,
    most: Option<u64>,
) -> Result<Vec<u64>, Fault> {
    let snapshots = split(snapshot, rows).map_err(|error| bad_snapshot(&error))?;
    snapshots.iter().enumerate().map(|(row, snapshot)| weeds_of(snapshot, row, most)).collect()
}

pub(super) fn bad_snapshot(error: &SnapshotError) -> Fault {
    Fault::BadConfig { text: error.to_string() }
}

/// Cells of so many environments, unless they are larger together than a session's may be.
pub(super) fn check_size(
    scenario: &ValidScenario,
    rows: u64,
    has_percept: bool,
    bounds: Bounds,
) -> Result<u64, Fault> {
    let pasture = &scenario.pasture;
    let one = Grid::new(pasture.length_m, pasture.width_m).cells_kept() as u64;
    // A percept needs to know what it has told of each cell.
    let (one, cells) = if has_percept {
        (
            2 * one,
            "twice the cells of the pasture with `percept`, 1 m by 1 m in whole squares of 8 by 8,",
        )
    } else {
        (one, "the cells of the pasture, 1 m by 1 m in whole squares of 8 by 8,")
    };
    let weeds = most_weeds(scenario) as u64;
    for (what, one, most) in
        [(cells, one, bounds.max_cells), ("the number of weeds", weeds, bounds.max_weeds)]
    {
        let all = rows.saturating_mul(one);
        if all > most {
            let text =
                format!("`num_envs` x {what} must be at most {most} on this server, got {all}");
            return Err(Fault::BadConfig { text });
        }
    }
    Ok(rows.saturating_mul(one))
}
