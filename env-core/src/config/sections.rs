//! The blocks of a scenario, not yet checked. Every field tells its meaning, its unit, its default and the effect of more.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::error::{expect, machine_length, positive};

/// Largest pasture, in square metres: 64 km2 take 8 MB a set of cells. They are kept in tiles of [`TILE_M`], whole ones.
const MAX_AREA_M2: f64 = 64e6;
const TILE_M: f64 = 8.0;
/// Most weeds of one pasture.
const MAX_WEEDS: u32 = 10_000_000;
/// Longest way of one control period, metres.
const MAX_CONTROL_DISTANCE_M: f64 = 100.0;

/// Which problem is posed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum ScenarioId {
    /// Find and mow every weed of a rectangular pasture (Maini, Gonultas & Isler, 2022).
    #[default]
    #[serde(rename = "swath/MowerRouting-v0")]
    MowerRouting,
}

/// The rectangle to be mown: x from 0 to the length, y from 0 to the width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PastureConfig {
    /// Size along x, the direction of the passes, in metres (default 100). Longer passes mean fewer turns.
    pub length_m: f64,
    /// Size along y, in metres (default 40). Wider means more passes.
    pub width_m: f64,
    /// How far outside the mower may turn, in metres (default 10; `inf` for no limit, as in the paper). Leaving it ends the episode as a failure.
    pub headland_m: f64,
}

impl Default for PastureConfig {
    fn default() -> Self {
        Self { length_m: 100.0, width_m: 40.0, headland_m: 10.0 }
    }
}

impl PastureConfig {
    /// Whether a point, x and y in metres, lies on the pasture.
    pub(super) fn holds(&self, [x_m, y_m]: [f64; 2]) -> bool {
        (0.0..=self.length_m).contains(&x_m) && (0.0..=self.width_m).contains(&y_m)
    }

    /// Where a point has to lie, in words.
    pub(super) fn place(&self) -> String {
        format!("on the pasture, 0..={} by 0..={} m", self.length_m, self.width_m)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        positive("pasture.length_m", self.length_m)?;
        positive("pasture.width_m", self.width_m)?;
        let in_tiles_m = |size_m: f64| (size_m / TILE_M).ceil() * TILE_M;
        let area_m2 = in_tiles_m(self.length_m) * in_tiles_m(self.width_m);
        let expected = "at most 64000000 m2 (in squares of 8 m by 8 m, begun ones counted)";
        expect(area_m2 <= MAX_AREA_M2, "pasture.length_m x pasture.width_m", expected, area_m2)?;
        expect(self.headland_m >= 0.0, "pasture.headland_m", ">= 0 or inf", self.headland_m)
    }
}

/// How weeds are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Distribution {
    /// Independently and evenly over the pasture.
    #[default]
    Uniform,
    /// In Gaussian clusters around seed weeds that are spread evenly.
    Gaussian,
}

/// Where weeds stand: drawn from the episode's seed, or given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WeedsConfig {
    /// Number of weeds drawn (default 40). More weeds mean longer paths.
    pub count: u32,
    /// How they are spread: `uniform` (default) or `gaussian`.
    pub distribution: Distribution,
    /// Spread of a Gaussian cluster, in metres (default 3; the paper gives none). Larger approaches uniform.
    pub sigma_m: f64,
    /// Share of the weeds that are cluster seeds, 0 to 1 (default 0.2, as in the paper). Smaller means fewer, denser clusters.
    pub cluster_fraction: f64,
    /// The weeds themselves, [[`x_m`, `y_m`], ...], instead of drawing them (default: drawn).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub positions_m: Option<Vec<[f64; 2]>>,
    /// A CSV file with one weed a line, x and y in metres, instead of drawing them (default: drawn). Relative to the scenario's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

impl Default for WeedsConfig {
    fn default() -> Self {
        Self {
            count: 40,
            distribution: Distribution::Uniform,
            sigma_m: 3.0,
            cluster_fraction: 0.2,
            positions_m: None,
            file: None,
        }
    }
}

impl WeedsConfig {
    pub(super) fn check(&self, pasture: &PastureConfig) -> Result<(), ConfigError> {
        expect(self.count <= MAX_WEEDS, "weeds.count", "at most 10000000", self.count)?;
        // A wider cluster would hardly ever hit the pasture, and drawing it would take for ever.
        let widest_m = 10.0 * pasture.length_m.min(pasture.width_m);
        let is_drawable = self.distribution == Distribution::Uniform || self.sigma_m <= widest_m;
        let expected =
            format!("> 0 and at most ten times the pasture's smaller side, {widest_m} m");
        let is_usable = self.sigma_m.is_finite() && self.sigma_m > 0.0 && is_drawable;
        expect(is_usable, "weeds.sigma_m", &expected, self.sigma_m)?;
        expect(
            (0.0..=1.0).contains(&self.cluster_fraction),
            "weeds.cluster_fraction",
            "from 0 to 1",
            self.cluster_fraction,
        )?;
        for (index, &[x_m, y_m]) in self.positions_m.iter().flatten().enumerate() {
            let field = format!("weeds.positions_m[{index}]");
            expect(pasture.holds([x_m, y_m]), &field, &pasture.place(), format!("[{x_m}, {y_m}]"))?;
        }
        Ok(())
    }
}

/// Where the mower stands when an episode begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "\"corner\", \"centre\" or [x_m, y_m, heading_rad]")]
pub enum Start {
    /// One of the two named poses.
    Named(NamedStart),
    /// A pose: x and y in metres, heading in radians counter-clockwise from +x.
    Pose([f64; 3]),
}

/// A start pose with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NamedStart {
    /// (0, B/2), heading +x: the first pass of a boustrophedon path.
    Corner,
    /// The middle of the pasture, heading +x.
    Centre,
}

/// The mower's geometry and limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MowerConfig {
    /// Smallest turning radius R, in metres (default 2). Larger means longer turns and fewer weeds within reach.
    pub turning_radius_m: f64,
    /// Speed, in metres a second (default 1). Faster means a longer way per control period.
    pub speed_mps: f64,
    /// Width B of the cut, in metres (default 2). Wider mows more on one pass.
    pub deck_width_m: f64,
    /// Where an episode begins: `corner` (default), `centre` or [`x_m`, `y_m`, `heading_rad`].
    pub start: Start,
}

impl Default for MowerConfig {
    fn default() -> Self {
        Self {
            turning_radius_m: 2.0,
            speed_mps: 1.0,
            deck_width_m: 2.0,
            start: Start::Named(NamedStart::Corner),
        }
    }
}

impl MowerConfig {
    pub(super) fn check(&self, pasture: &PastureConfig) -> Result<(), ConfigError> {
        machine_length("mower.turning_radius_m", self.turning_radius_m)?;
        positive("mower.speed_mps", self.speed_mps)?;
        machine_length("mower.deck_width_m", self.deck_width_m)?;
        let widest_m = pasture.width_m.min(pasture.length_m);
        let expected = format!("at most the pasture's smaller side, {widest_m} m");
        expect(self.deck_width_m <= widest_m, "mower.deck_width_m", &expected, self.deck_width_m)?;
        if let Start::Pose([x_m, y_m, heading_rad]) = self.start {
            let reach_m = pasture.headland_m;
            let is_inside = (-reach_m..=pasture.length_m + reach_m).contains(&x_m)
                && (-reach_m..=pasture.width_m + reach_m).contains(&y_m);
            let got = format!("[{x_m}, {y_m}, {heading_rad}]");
            let is_usable =
                is_inside && [x_m, y_m, heading_rad].iter().all(|value| value.is_finite());
            expect(is_usable, "mower.start", "finite and on the pasture or its headland", got)?;
        }
        Ok(())
    }
}

/// The detection triangle, with its apex at the mower's pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SensorConfig {
    /// Depth `S_d` of the triangle, in metres (default 12). Deeper sees weeds earlier.
    pub range_m: f64,
    /// Width `S_w` of the triangle at its far side, in metres (default 12). Wider sees more ground on one pass.
    pub width_m: f64,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self { range_m: 12.0, width_m: 12.0 }
    }
}

impl SensorConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        machine_length("sensor.range_m", self.range_m)?;
        machine_length("sensor.width_m", self.width_m)
    }
}

/// What a step is worth: the sum of the named terms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RewardConfig {
    /// For each weed mowed (default 1).
    pub weed: f64,
    /// Charged for each metre driven (default 1). More makes short paths matter more than the last weed.
    pub path_per_m: f64,
}

impl Default for RewardConfig {
    fn default() -> Self {
        Self { weed: 1.0, path_per_m: 1.0 }
    }
}

impl RewardConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        expect(self.weed.is_finite(), "reward.weed", "finite", self.weed)?;
        let is_cost = self.path_per_m.is_finite() && self.path_per_m >= 0.0;
        expect(is_cost, "reward.path_per_m", "finite and >= 0", self.path_per_m)
    }
}

/// How an episode of the Gymnasium environment is cut into steps, and when it ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EpisodeConfig {
    /// Time between two decisions, in seconds (default 0.5). Longer steps make shorter episodes and coarser paths.
    pub control_period_s: f64,
    /// Longest path, in lengths of the boustrophedon path (default 1, the paper's upper bound; `inf` for no limit). Then the episode is truncated.
    pub budget: f64,
    /// Share of the pasture's cells that must have been seen before the episode can be won, above 0 to 1 (default 1). A cell, 1 m by 1 m or less, counts as seen with its centre, so a weed at its edge may be left.
    pub seen_goal: f64,
}

impl Default for EpisodeConfig {
    fn default() -> Self {
        Self { control_period_s: 0.5, budget: 1.0, seen_goal: 1.0 }
    }
}

impl EpisodeConfig {
    pub(super) fn check(&self, mower: &MowerConfig) -> Result<(), ConfigError> {
        positive("episode.control_period_s", self.control_period_s)?;
        let distance_m = self.control_period_s * mower.speed_mps;
        let is_short = distance_m <= MAX_CONTROL_DISTANCE_M;
        expect(
            is_short,
            "episode.control_period_s x mower.speed_mps",
            "at most 100 m",
            distance_m,
        )?;
        expect(self.budget > 0.0, "episode.budget", "> 0 or inf", self.budget)?;
        expect(
            self.seen_goal > 0.0 && self.seen_goal <= 1.0,
            "episode.seen_goal",
            "above 0 and at most 1",
            self.seen_goal,
        )
    }
}

/// What an observation looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ObservationKind {
    /// One flat vector: the mower's own state, the nearest known weeds, ranges to unseen ground.
    #[default]
    Features,
    /// Pictures of the surroundings at four scales: unseen ground, known weeds, what lies outside.
    Maps,
    /// A table of the places that the action kind `target` offers.
    Candidates,
    /// All of these, and which candidates may be chosen.
    Dict,
}

/// What an agent is shown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ObservationConfig {
    /// The kind: `features` (default), `maps`, `candidates` or `dict`.
    pub kind: ObservationKind,
    /// How many of the nearest known weeds `features` lists, 1 to 64 (default 8).
    pub nearest_weeds: usize,
    /// How many bearings `features` looks along for unseen ground, 1 to 64 (default 8).
    pub rays: usize,
    /// Whether `candidates` and `maps` are flat vectors (default true), row by row, instead of tables of two and three
    /// axes: stable-baselines3 warns of tables, and of pictures of fewer than 36 x 36 points.
    pub flat: bool,
}

impl Default for ObservationConfig {
    fn default() -> Self {
        Self { kind: ObservationKind::Features, nearest_weeds: 8, rays: 8, flat: true }
    }
}

impl ObservationConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        expect(
            (1..=64).contains(&self.nearest_weeds),
            "observation.nearest_weeds",
            "from 1 to 64",
            self.nearest_weeds,
        )?;
        expect((1..=64).contains(&self.rays), "observation.rays", "from 1 to 64", self.rays)
    }
}

/// How an agent speaks to the mower.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ActionKind {
    /// One number: curvature as a fraction of 1/R, for one control period.
    #[default]
    Steer,
    /// Two numbers: curvature as a fraction of 1/R, and how much of the control period's distance to drive.
    Drive,
    /// A choice of five curvatures, from sharp right to sharp left, for one control period.
    Discrete,
    /// A choice of places: known weeds, views of unseen ground, and the next piece of a search sweep. A step goes there.
    Target,
}

impl ActionKind {
    /// The name in configurations.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Steer => "steer",
            Self::Drive => "drive",
            Self::Discrete => "discrete",
            Self::Target => "target",
        }
    }

    /// Whether an action is numbers; else it is a choice.
    #[must_use]
    pub fn is_continuous(self) -> bool {
        matches!(self, Self::Steer | Self::Drive)
    }
}

/// How an agent's numbers become a drive command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ActionConfig {
    /// The kind: `steer` (default), `drive`, `discrete` or `target`.
    pub kind: ActionKind,
    /// How many of the nearest known weeds are candidates of `target`, 1 to 64 (default 10).
    pub weeds: usize,
    /// How many views of unseen ground are candidates of `target`, 0 to 64 (default 5).
    pub views: usize,
}

impl Default for ActionConfig {
    fn default() -> Self {
        Self { kind: ActionKind::Steer, weeds: 10, views: 5 }
    }
}

impl ActionConfig {
    /// Number of candidates: weeds, views and the search sweep, which is the last one.
    #[must_use]
    pub fn candidates(&self) -> usize {
        self.weeds + self.views + 1
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        expect((1..=64).contains(&self.weeds), "action.weeds", "from 1 to 64", self.weeds)?;
        expect(self.views <= 64, "action.views", "from 0 to 64", self.views)
    }
}
