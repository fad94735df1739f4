//! The numbers of an episode that result files hold.

use super::Env;

/// How an episode stands. It knows the truth, so agents never see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Way driven, metres.
    pub path_length_m: f64,
    /// Length of the boustrophedon path, metres.
    pub bcp_length_m: f64,
    /// Number of weeds on the pasture.
    pub weeds_total: usize,
    /// Number of weeds that the sensor has seen.
    pub weeds_detected: usize,
    /// Number of weeds mowed, seen or not.
    pub weeds_mowed: usize,
    /// Share of the pasture's cells seen, 0 to 1.
    pub seen_fraction: f64,
}

impl Summary {
    /// Way driven, in lengths of the boustrophedon path.
    #[must_use]
    pub fn path_fraction(&self) -> f64 {
        self.path_length_m / self.bcp_length_m
    }
}

impl Env {
    /// How the episode stands.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let count = |flags: &[bool]| flags.iter().filter(|&&flag| flag).count();
        Summary {
            path_length_m: self.mower.path_m(),
            bcp_length_m: self.setup.site.bcp_length_m,
            weeds_total: self.weeds.positions().len(),
            weeds_detected: count(self.weeds.is_detected()),
            weeds_mowed: count(self.weeds.is_mowed()),
            seen_fraction: self.belief.ground().fraction(),
        }
    }
}
