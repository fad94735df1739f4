//! Replies of a server as the columns that a batch in the same process would have written.

use swath_core::batch::{Last, StepMut};
use swath_core::env::Summary;
use swath_core::observation::ObservationMut;
use swath_core::reward::RewardTerms;

use crate::fault::Fault;
use crate::layout::OUTCOMES;
use crate::message::{ResetReply, StepReply};
use crate::numbers::{self, Number, read_into};

/// Where the ends of episodes are written, row by row.
#[derive(Debug)]
pub struct EndedMut<'a> {
    /// How the episode that ended with the step ended; of rows whose episode goes on, nothing is written.
    pub last: &'a mut [Option<Last>],
    /// Their last observations; without rows but in the mode `SameStep`.
    pub observation: ObservationMut<'a>,
    /// Their last action masks; empty but for the action kind `target`.
    pub mask: &'a mut [bool],
}

/// Writes what a step brought. Returns how many episodes ended. Without infos their columns stay as they are.
///
/// # Errors
///
/// [`Fault::Malformed`] if the tables are not those of a step of as many rows.
pub fn read_step(reply: &StepReply, mut out: StepMut, ended: EndedMut) -> Result<usize, Fault> {
    let rows = out.reward.len();
    read_observation(&reply.observation, out.observation.reborrow())?;
    read_into(reply.reward, out.reward)?;
    read_into(reply.terminated, out.terminated)?;
    read_into(reply.truncated, out.truncated)?;
    read_info(&reply.info, &mut out)?;
    let done: Vec<u32> = numbers::read(reply.done_index)?;
    let has_ended = |row: &u32| {
        let row = *row as usize;
        row < rows && (out.terminated[row] || out.truncated[row])
    };
    let flags = out.terminated.iter().zip(&*out.truncated);
    let ended_rows = flags.filter(|&(&terminated, &truncated)| terminated | truncated).count();
    let are_listed = done.len() == ended_rows && done.is_sorted_by(|a, b| a < b);
    if !are_listed || !done.iter().all(has_ended) {
        return Err(malformed());
    }
    read_ended(reply, &done, ended, rows)?;
    Ok(done.len())
}

/// Writes the state after a reset; rewards and flags stay as they are, and without infos their columns do.
///
/// # Errors
///
/// [`Fault::Malformed`] if the tables are not those of as many rows.
pub fn read_reset(reply: &ResetReply, mut out: StepMut) -> Result<(), Fault> {
    read_observation(&reply.observation, out.observation.reborrow())?;
    read_info(&reply.info, &mut out)
}

fn read_info(tables: &[&[u8]], out: &mut StepMut) -> Result<(), Fault> {
    let StepMut { weed, path, failure, is_clipped, distance_m, action_mask, .. } = out;
    let masks = usize::from(!action_mask.is_empty());
    let has_infos = tables.len() > masks;
    let mut tables = Tables(tables.iter());
    if has_infos {
        tables.next_into(weed)?;
        tables.next_into(path)?;
        tables.next_into(failure)?;
        tables.next_into(is_clipped)?;
        if masks > 0 {
            tables.next_into(distance_m)?;
        }
    }
    if masks > 0 {
        tables.next_into(action_mask)?;
    }
    tables.end()
}

fn read_observation(tables: &[&[u8]], observation: ObservationMut) -> Result<(), Fault> {
    let ObservationMut { features, candidates, action_mask, maps } = observation;
    let mut tables = Tables(tables.iter());
    if !features.is_empty() {
        tables.next_into(features)?;
    }
    if !candidates.is_empty() {
        tables.next_into(candidates)?;
    }
    if !action_mask.is_empty() {
        tables.next_into(action_mask)?;
    }
    if !maps.is_empty() {
        tables.next_into(maps)?;
    }
    tables.end()
}

fn read_ended(reply: &StepReply, done: &[u32], ended: EndedMut, rows: usize) -> Result<(), Fault> {
    let EndedMut { last, observation, mask } = ended;
    let mut tables = Tables(reply.ended.iter());
    let floats = |tables: &mut Tables| tables.next_numbers::<f64>(done.len());
    let [weed, path, failure] = [floats(&mut tables)?, floats(&mut tables)?, floats(&mut tables)?];
    let is_clipped: Vec<bool> = tables.next_numbers(done.len())?;
    let mut distance_m = vec![0.0; done.len()];
    let choices = mask.len() / rows;
    if choices > 0 {
        distance_m = floats(&mut tables)?;
        let masks: Vec<bool> = tables.next_numbers(done.len() * choices)?;
        for (of_row, &row) in masks.chunks_exact(choices).zip(done) {
            let first = row as usize * choices;
            mask[first..first + choices].copy_from_slice(of_row);
        }
    }
    let [path_length_m, bcp_length_m, seen_fraction] =
        [floats(&mut tables)?, floats(&mut tables)?, floats(&mut tables)?];
    let count = |tables: &mut Tables| -> Result<Vec<usize>, Fault> {
        let counts: Vec<i64> = tables.next_numbers(done.len())?;
        counts.into_iter().map(|count| usize::try_from(count).map_err(|_| malformed())).collect()
    };
    let [weeds_total, weeds_detected, weeds_mowed] =
        [count(&mut tables)?, count(&mut tables)?, count(&mut tables)?];
    let outcomes: Vec<u8> = tables.next_numbers(done.len())?;
    tables.end()?;
    for (i, &row) in done.iter().enumerate() {
        let outcome = *OUTCOMES.get(usize::from(outcomes[i])).ok_or(malformed())?;
        last[row as usize] = Some(Last {
            terms: RewardTerms { weed: weed[i], path: path[i], failure: failure[i] },
            is_clipped: is_clipped[i],
            distance_m: distance_m[i],
            summary: Summary {
                path_length_m: path_length_m[i],
                bcp_length_m: bcp_length_m[i],
                weeds_total: weeds_total[i],
                weeds_detected: weeds_detected[i],
                weeds_mowed: weeds_mowed[i],
                seen_fraction: seen_fraction[i],
            },
            outcome,
        });
    }
    let mut tables = Tables(reply.final_observation.iter());
    let ObservationMut { features, candidates, action_mask, maps } = observation;
    tables.next_rows(features, done, rows)?;
    tables.next_rows(candidates, done, rows)?;
    tables.next_rows(action_mask, done, rows)?;
    tables.next_rows(maps, done, rows)?;
    tables.end()
}

/// Tables that are still to be read.
struct Tables<'a>(std::slice::Iter<'a, &'a [u8]>);

impl Tables<'_> {
    fn next(&mut self) -> Result<&[u8], Fault> {
        self.0.next().copied().ok_or(malformed())
    }

    /// Reads the next table into numbers that it has to fill.
    fn next_into<T: Number>(&mut self, numbers: &mut [T]) -> Result<(), Fault> {
        read_into(self.next()?, numbers)
    }

    /// Reads the next table, which has so many numbers.
    fn next_numbers<T: Number>(&mut self, count: usize) -> Result<Vec<T>, Fault> {
        let numbers: Vec<T> = numbers::read(self.next()?)?;
        if numbers.len() == count { Ok(numbers) } else { Err(malformed()) }
    }

    /// Reads the next table into some of `rows` rows, if there are such rows at all.
    fn next_rows<T: Number>(
        &mut self,
        numbers: &mut [T],
        wanted: &[u32],
        rows: usize,
    ) -> Result<(), Fault> {
        if numbers.is_empty() {
            return Ok(());
        }
        let width = numbers.len() / rows;
        let table: Vec<T> = self.next_numbers(wanted.len() * width)?;
        for (of_row, &row) in table.chunks_exact(width).zip(wanted) {
            let first = row as usize * width;
            numbers[first..first + width].copy_from_slice(of_row);
        }
        Ok(())
    }

    /// There must be no more.
    fn end(&mut self) -> Result<(), Fault> {
        if self.0.next().is_none() { Ok(()) } else { Err(malformed()) }
    }
}

fn malformed() -> Fault {
    Fault::Malformed { offset: 0 }
}
