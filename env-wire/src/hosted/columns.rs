//! What a step writes, as the tables of a reply.

use std::borrow::Cow;

use swath_core::batch::{BatchEnv, StepMut};
use swath_core::observation::Observation;

use crate::layout::Layout;
use crate::numbers::bytes_in;

/// What a step writes.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) observation: Observation,
    pub(super) reward: Vec<f64>,
    pub(super) terminated: Vec<bool>,
    pub(super) truncated: Vec<bool>,
    pub(super) weed: Vec<f64>,
    pub(super) path: Vec<f64>,
    pub(super) failure: Vec<f64>,
    pub(super) is_clipped: Vec<bool>,
    pub(super) distance_m: Vec<f64>,
    pub(super) action_mask: Vec<bool>,
}

impl Columns {
    pub(super) fn new(batch: &BatchEnv) -> Self {
        let rows = batch.rows().len();
        let (zeros, flags) = (vec![0.0; rows], vec![false; rows]);
        Self {
            observation: batch.observation_spec().rows(rows),
            reward: zeros.clone(),
            terminated: flags.clone(),
            truncated: flags.clone(),
            weed: zeros.clone(),
            path: zeros.clone(),
            failure: zeros.clone(),
            is_clipped: flags,
            distance_m: zeros,
            action_mask: vec![false; rows * batch.mask_width()],
        }
    }

    pub(super) fn out(&mut self) -> StepMut<'_> {
        StepMut {
            observation: self.observation.as_mut(),
            reward: &mut self.reward,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            weed: &mut self.weed,
            path: &mut self.path,
            failure: &mut self.failure,
            is_clipped: &mut self.is_clipped,
            distance_m: &mut self.distance_m,
            action_mask: &mut self.action_mask,
        }
    }

    pub(super) fn observation(&self, layout: &Layout) -> Vec<Cow<'_, [u8]>> {
        let Observation { features, candidates, action_mask, maps } = &self.observation;
        let table = |name: &str| match name {
            "features" => bytes_in(features),
            "candidates" => bytes_in(candidates),
            "action_mask" => bytes_in(action_mask),
            _ => bytes_in(maps),
        };
        layout.observation.iter().map(|leaf| table(&leaf.name)).collect()
    }

    /// The tables of every info, or only the action mask.
    pub(super) fn info(&self, infos: bool) -> Vec<Cow<'_, [u8]>> {
        let mut tables = Vec::new();
        if infos {
            tables.extend([&self.weed, &self.path, &self.failure].map(|terms| bytes_in(terms)));
            tables.push(bytes_in(&self.is_clipped));
        }
        if !self.action_mask.is_empty() {
            tables.extend(infos.then(|| bytes_in(&self.distance_m)));
            tables.push(bytes_in(&self.action_mask));
        }
        tables
    }
}
