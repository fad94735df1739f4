//! The observation `features`: one flat vector.

use std::f64::consts::TAU;

use super::nearest::NearestWeeds;
use super::{Bound, Dtype, Part, signed};
use crate::config::ValidScenario;
use crate::math;
use crate::view::View;

/// Finite stand-in for an unlimited headland, metres: positions are scaled by it and clipped.
const REACH_M: f64 = 10.0;
/// Range of the rays, in sensor ranges.
const RAY_RANGES: f64 = 4.0;

/// Writes the `features` observation: 7 + 3 k + r numbers for k nearest weeds and r rays (39 by default).
///
/// | index | value | range |
/// |---|---|---|
/// | 0, 1 | x and y, scaled over the pasture and its headland (at most 10 m), clipped | -1 to 1 |
/// | 2, 3 | cosine and sine of the heading | -1 to 1 |
/// | 4 | share of the budget left | 0 to 1 |
/// | 5 | share of the pasture's cells seen | 0 to 1 |
/// | 6 | n / (n + k) for n known weeds | 0 to 1 |
/// | 7 + 3i ... | the i-th nearest known weed: forward and left offset over length plus width, and 1; zeros where there is none | -1 to 1, -1 to 1, 0 to 1 |
/// | 7 + 3k + j | distance to unseen ground along the bearing j x 360 / r degrees from the heading (left), over four sensor ranges, at most 1 | 0 to 1 |
#[derive(Debug, Clone)]
pub struct FeatureEncoder {
    /// Directions of the rays in the mower's frame.
    rays: Vec<(f64, f64)>,
    budget_m: f64,
    reach_m: f64,
    /// How many weeds are listed.
    listed: usize,
}

impl FeatureEncoder {
    /// The encoder of a scenario whose path may be `budget_m` long.
    #[must_use]
    pub fn new(scenario: &ValidScenario, budget_m: f64) -> Self {
        let rays = scenario.observation.rays;
        let direction = |j: usize| {
            let (sin, cos) = math::sin_cos(TAU * j as f64 / rays as f64);
            (cos, sin)
        };
        Self {
            rays: (0..rays).map(direction).collect(),
            budget_m,
            reach_m: scenario.pasture.headland_m.min(REACH_M),
            listed: scenario.observation.nearest_weeds,
        }
    }

    /// The part of the observation that this encoder writes.
    #[must_use]
    pub fn part(&self) -> Part {
        let feature = |name: String, low: f32| Bound { name, low, high: 1.0 };
        let mut bounds: Vec<Bound> = ["x", "y", "heading_cos", "heading_sin"]
            .map(|name| feature(name.to_owned(), -1.0))
            .into();
        bounds.extend(
            ["budget_left", "seen_fraction", "known_weeds"]
                .map(|name| feature(name.to_owned(), 0.0)),
        );
        for i in 0..self.listed {
            bounds.push(feature(format!("weed_{i}_forward"), -1.0));
            bounds.push(feature(format!("weed_{i}_left"), -1.0));
            bounds.push(feature(format!("weed_{i}_present"), 0.0));
        }
        bounds.extend((0..self.rays.len()).map(|j| feature(format!("unseen_range_{j}"), 0.0)));
        Part { name: "features", dtype: Dtype::Float32, shape: vec![bounds.len()], bounds }
    }

    /// Memory for one environment.
    pub(super) fn memory(&self) -> NearestWeeds {
        NearestWeeds::new(self.listed)
    }

    /// Writes the observation of `view` to `observation`; `nearest` is the memory of this environment.
    ///
    /// # Panics
    ///
    /// If `observation` does not have as many places as [`FeatureEncoder::part`] has bounds.
    pub(super) fn encode(&self, view: &View, nearest: &mut NearestWeeds, observation: &mut [f32]) {
        let (site, pose) = (view.site, view.pose);
        let scaled = |value_m: f64, size_m: f64| {
            2.0 * (value_m + self.reach_m) / (size_m + 2.0 * self.reach_m) - 1.0
        };
        let (cos, sin) = view.direction;
        let budget_left = 1.0 - view.path_m / self.budget_m;
        let known = view.known_weeds.len() as f64;
        let listed = self.listed;
        let (ego, rest) = observation.split_at_mut(7);
        let (weeds, rays) = rest.split_at_mut(3 * listed);
        ego[0] = signed(scaled(pose.x_m, site.length_m));
        ego[1] = signed(scaled(pose.y_m, site.width_m));
        ego[2] = signed(cos);
        ego[3] = signed(sin);
        ego[4] = share(budget_left);
        ego[5] = share(view.ground.fraction());
        ego[6] = share(known / (known + listed as f64));

        let nearest = nearest.find(pose.position(), view.known_weeds);
        let (weeds, nothing) = weeds.split_at_mut(3 * nearest.len());
        let per_m = 1.0 / (site.length_m + site.width_m);
        let (ahead, left) = ((cos * per_m, sin * per_m), (-sin * per_m, cos * per_m));
        for (weed, row) in nearest.zip(weeds.chunks_exact_mut(3)) {
            let offset = weed.position - pose.position();
            row[0] = signed(ahead.0 * offset.x + ahead.1 * offset.y);
            row[1] = signed(left.0 * offset.x + left.1 * offset.y);
            row[2] = 1.0;
        }
        // Often there is none to fill, which is not worth a call.
        if !nothing.is_empty() {
            nothing.fill(0.0);
        }

        let cap_m = RAY_RANGES * site.sensor_range_m;
        let per_cap = 1.0 / cap_m;
        let mut rays = rays.iter_mut();
        view.ground.ranges_to_unseen(
            pose.position(),
            view.direction,
            &self.rays,
            cap_m,
            |range_m| {
                if let Some(range) = rays.next() {
                    *range = single(range_m * per_cap);
                }
            },
        );
    }
}

/// A value as float32.
#[expect(clippy::cast_possible_truncation, reason = "observations are float32 by contract")]
fn single(value: f64) -> f32 {
    value as f32
}

/// A value clipped into [0, 1], as float32.
fn share(value: f64) -> f32 {
    signed(value.max(0.0))
}
