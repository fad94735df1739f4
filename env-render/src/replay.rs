//! An episode driven once more.

use swath_core::action::Command;
use swath_core::config::{ConfigError, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::episode::End;
use swath_core::geometry::{Point, Pose};
use swath_core::math::wrap_to_pi;

/// A recorded episode, driven again along its points: what was detected, mowed and seen comes about as it did.
#[derive(Debug, Clone)]
pub struct Replay {
    env: Env,
    points: Vec<[f64; 4]>,
    /// Points passed.
    passed: usize,
}

impl Replay {
    /// An episode at its start.
    ///
    /// `points` are `x_m`, `y_m`, `heading_rad` and `path_m`, so close together that the mower turns by less than half a
    /// circle between them; every two of them are joined by an arc.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Value`] if there are no points, one is not finite, the path gets shorter, or the first one or a weed is
    /// off the pasture (and its headland).
    pub fn new(
        scenario: &ValidScenario,
        weeds: &[Point],
        points: Vec<[f64; 4]>,
    ) -> Result<Self, ConfigError> {
        let wrong = |expected: &str, got: String| {
            Err(ConfigError::value("trajectory", expected.to_owned(), got))
        };
        let mut env = Env::new(scenario);
        env.lift_limits();
        env.keep_trace();
        if let Some(row) = points.iter().position(|point| !point.iter().all(|v| v.is_finite())) {
            return wrong("finite", format!("{:?} in row {row}", points[row]));
        }
        if let Some(row) = points.windows(2).position(|pair| pair[1][3] < pair[0][3]) {
            return wrong(
                "a path that never gets shorter",
                format!("a shorter one in row {}", row + 1),
            );
        }
        let Some(&[x_m, y_m, heading_rad, _]) = points.first() else {
            return wrong("at least one row", "none".to_owned());
        };
        let start = Pose::new(x_m, y_m, heading_rad);
        if !env.site().allows(start) {
            return wrong("a start on the pasture or its headland", format!("({x_m}, {y_m})"));
        }
        if let Some(weed) = weeds.iter().find(|weed| !env.site().holds(weed.x, weed.y)) {
            let got = format!("({}, {})", weed.x, weed.y);
            return Err(ConfigError::value("weeds", "on the pasture", got));
        }
        env.reset_from(0, Beginning { weeds: Some(weeds), start: Some(start) });
        Ok(Self { env, points, passed: 1 })
    }

    /// Drives on to `path_m`, or to the end where that is earlier. It never drives back.
    ///
    /// # Panics
    ///
    /// Never: a curvature is cut to what the mower can turn.
    pub fn drive_to(&mut self, path_m: f64) {
        let largest_per_m = 1.0 / self.env.site().turning_radius_m;
        let first_m = self.points[0][3];
        while self.env.end() == Some(End::Running) {
            let Some(&[_, _, heading_rad, next_m]) = self.points.get(self.passed) else { break };
            let [_, _, before_rad, before_m] = self.points[self.passed - 1];
            let driven_m = first_m + self.env.view().path_m;
            let goal_m = next_m.min(path_m);
            if goal_m > driven_m && next_m > before_m {
                let curvature_per_m = wrap_to_pi(heading_rad - before_rad) / (next_m - before_m);
                let command = Command {
                    curvature_per_m: curvature_per_m.clamp(-largest_per_m, largest_per_m),
                    distance_m: goal_m - driven_m,
                };
                self.env.drive(command).expect("the mower can turn so, and the episode runs");
            }
            if next_m > path_m {
                break;
            }
            self.passed += 1;
        }
    }

    /// The environment as it stands now.
    #[must_use]
    pub fn env(&self) -> &Env {
        &self.env
    }

    /// Path at the end, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.points[self.points.len() - 1][3]
    }
}
