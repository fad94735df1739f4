//! What the operator tells a mower before it starts: the numbers of a scenario that are public.

use crate::config::ValidScenario;
use crate::geometry::{Pose, boustrophedon_length};
use crate::math::floor_index;

/// How far beyond the headland's border counts as on it, metres.
const BORDER_M: f64 = 1e-9;

/// The public numbers of a scenario. Nothing about weeds is among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Size of the pasture along x, metres.
    pub length_m: f64,
    /// Size of the pasture along y, metres.
    pub width_m: f64,
    /// How far outside the mower may drive, metres; infinite for no limit.
    pub headland_m: f64,
    /// Width B of the cut, metres.
    pub deck_width_m: f64,
    /// Smallest turning radius R, metres.
    pub turning_radius_m: f64,
    /// Speed, metres a second.
    pub speed_mps: f64,
    /// Depth of the detection triangle, metres.
    pub sensor_range_m: f64,
    /// Width of the detection triangle at its far side, metres.
    pub sensor_width_m: f64,
    /// Way of one control period, metres.
    pub control_distance_m: f64,
    /// Length of the boustrophedon path over the whole pasture, metres: the paper's upper bound.
    pub bcp_length_m: f64,
}

impl Site {
    /// The public part of a scenario.
    #[must_use]
    pub fn new(scenario: &ValidScenario) -> Self {
        let (pasture, mower, sensor) = (&scenario.pasture, &scenario.mower, &scenario.sensor);
        let passes = passes(pasture.width_m, mower.deck_width_m);
        Self {
            length_m: pasture.length_m,
            width_m: pasture.width_m,
            headland_m: pasture.headland_m,
            deck_width_m: mower.deck_width_m,
            turning_radius_m: mower.turning_radius_m,
            speed_mps: mower.speed_mps,
            sensor_range_m: sensor.range_m,
            sensor_width_m: sensor.width_m,
            control_distance_m: scenario.episode.control_period_s * mower.speed_mps,
            bcp_length_m: boustrophedon_length(
                passes,
                pasture.length_m,
                mower.deck_width_m,
                mower.turning_radius_m,
            ),
        }
    }

    /// Whether a point lies on the pasture, metres.
    #[must_use]
    pub fn holds(&self, x_m: f64, y_m: f64) -> bool {
        (0.0..=self.length_m).contains(&x_m) && (0.0..=self.width_m).contains(&y_m)
    }

    /// Whether the mower may stand here: on the pasture or its headland.
    #[must_use]
    #[inline]
    pub fn allows(&self, pose: Pose) -> bool {
        self.allows_within(pose, self.headland_m + BORDER_M)
    }

    /// Whether the mower may stand wherever a way leads that leaves the line from `start` to `end` by `sagitta_m` at most.
    /// Near the border it is false even where the mower may.
    #[must_use]
    #[inline]
    pub fn allows_between(&self, start: Pose, end: Pose, sagitta_m: f64) -> bool {
        let reach_m = self.headland_m - sagitta_m;
        self.allows_within(start, reach_m) && self.allows_within(end, reach_m)
    }

    #[inline]
    fn allows_within(&self, pose: Pose, reach_m: f64) -> bool {
        (-reach_m..=self.length_m + reach_m).contains(&pose.x_m)
            && (-reach_m..=self.width_m + reach_m).contains(&pose.y_m)
    }
}

/// How many passes of `spacing_m` cover `width_m`.
#[must_use]
pub fn passes(width_m: f64, spacing_m: f64) -> usize {
    floor_index((width_m / spacing_m - 1e-9).ceil()).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Document;

    #[test]
    fn the_boustrophedon_lengths_of_the_shipped_pastures_are_those_of_the_paper() {
        let length_of =
            |name: &str| Site::new(&Document::open(name).unwrap().scenario().unwrap()).bcp_length_m;
        // The paper prints 897 m for the field; both to the millimetre from n L + (n - 1) R (pi + 4 acos((2R + B) / 4R)).
        assert!((length_of("cowbot-field") - 897.519).abs() < 1e-3);
        assert!((length_of("pasture") - 2229.236).abs() < 1e-3);
    }

    #[test]
    fn a_width_of_whole_decks_is_not_given_one_pass_too_many_by_rounding() {
        assert_eq!(passes(26.0, 1.3), 20);
        assert_eq!(passes(40.0, 12.0), 4);
        assert_eq!(passes(1.0, 1.0), 1);
    }
}
