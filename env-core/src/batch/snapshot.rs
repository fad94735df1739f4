//! A batch as bytes, and back: the snapshots of its rows, one after the other.

use super::{BatchEnv, State};
use crate::env::{Env, SnapshotError, damaged};

impl BatchEnv {
    /// The whole state as bytes.
    #[must_use]
    pub fn snapshot(&self) -> Vec<u8> {
        joined(&self.envs.iter().map(Env::snapshot).collect::<Vec<_>>())
    }

    /// Puts back the state that [`BatchEnv::snapshot`] returned, here or in another batch of as many rows.
    ///
    /// # Errors
    ///
    /// [`SnapshotError`]; every row is then as it was.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let rows = split(snapshot, self.envs.len())?;
        let mut envs = self.envs.clone();
        for (env, row) in envs.iter_mut().zip(&rows) {
            env.restore(row)?;
        }
        self.states = envs.iter().map(State::of).collect();
        self.envs = envs;
        Ok(())
    }

    /// Puts back one row, from [`Env::snapshot`] of any environment of the same scenario.
    ///
    /// # Errors
    ///
    /// [`SnapshotError`]; the row is then as it was.
    ///
    /// # Panics
    ///
    /// If there is no such row.
    pub fn restore_row(&mut self, row: usize, snapshot: &[u8]) -> Result<(), SnapshotError> {
        self.envs[row].restore(snapshot)?;
        self.states[row] = State::of(&self.envs[row]);
        Ok(())
    }
}

/// The snapshot of a batch with these rows, each as [`Env::snapshot`] returned it.
///
/// # Panics
///
/// If there is no memory for it.
#[must_use]
pub fn joined(rows: &[Vec<u8>]) -> Vec<u8> {
    postcard::to_allocvec(rows).expect("bytes in memory can be written to memory")
}

/// The snapshots of the rows of a batch that has so many.
///
/// # Errors
///
/// [`SnapshotError::Damaged`] if it is no such snapshot; the rows themselves are not looked into.
pub fn split(snapshot: &[u8], expected: usize) -> Result<Vec<Vec<u8>>, SnapshotError> {
    let (rows, rest) = postcard::take_from_bytes::<Vec<Vec<u8>>>(snapshot).map_err(damaged)?;
    if !rest.is_empty() {
        let got = format!("{} bytes too many", rest.len());
        return Err(SnapshotError::Damaged { got });
    }
    if rows.len() != expected {
        let got = format!("those of {} rows for {expected}", rows.len());
        return Err(SnapshotError::Damaged { got });
    }
    Ok(rows)
}
