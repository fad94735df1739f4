//! The ground that the implement passes over while the mower follows an arc.

use wide::f64x2;

use super::{Arc, Footprint, Frame, Point, SidePair};

/// How far outside the bar a point still counts as mowed, metres.
///
/// A planner puts the bar's end exactly on a weed (equation 1 of Maini, Gonultas & Isler, 2022), so the test has to include it.
const BORDER_M: f64 = 1e-6;

/// A bar of given width, across the heading, moved along an arc that turns by less than half a circle.
#[derive(Debug, Clone, Copy)]
pub struct BarSweep {
    start: Frame,
    end: Frame,
    curvature_per_m: f64,
    half_width_m: f64,
    border_m: f64,
    /// Whether the bar reaches beyond its turning centre, where it sweeps backwards.
    sweeps_backwards: bool,
    x_range: (f64, f64),
    y_range: (f64, f64),
}

impl BarSweep {
    /// The ground under a bar of `width_m` while its middle follows `arc`.
    ///
    /// # Panics
    ///
    /// In debug builds, if the arc turns by half a circle or more.
    #[must_use]
    pub fn new(arc: &Arc, width_m: f64) -> Self {
        let start = Frame::from(arc.start);
        let end = start.advanced(arc.curvature_per_m, arc.length_m);
        Self::between(start, end, arc.curvature_per_m, arc.length_m, width_m)
    }

    /// The same for an arc whose two ends are known already.
    pub(crate) fn between(
        start: Frame,
        end: Frame,
        curvature_per_m: f64,
        length_m: f64,
        width_m: f64,
    ) -> Self {
        Self::with_border(start, end, curvature_per_m, length_m, width_m, BORDER_M)
    }

    /// The same, a little wider than any of the pieces that the arc can be cut into.
    pub(crate) fn around(
        start: Frame,
        end: Frame,
        curvature_per_m: f64,
        length_m: f64,
        width_m: f64,
    ) -> Self {
        Self::with_border(start, end, curvature_per_m, length_m, width_m, 2.0 * BORDER_M)
    }

    fn with_border(
        start: Frame,
        end: Frame,
        curvature_per_m: f64,
        length_m: f64,
        width_m: f64,
        border_m: f64,
    ) -> Self {
        let k = curvature_per_m.abs();
        debug_assert!(
            k * length_m < std::f64::consts::PI,
            "an arc of {length_m} m with curvature {k} cannot be tested in one piece"
        );
        let half_width_m = 0.5 * width_m;
        // The bar's outer end leaves the hull of the two bars by (1/k + b)(1 - cos(ks/2)) <= (|k| + b k^2) s^2 / 8.
        let bulge_m = (k + half_width_m * k * k) * length_m * length_m / 8.0 + 2.0 * border_m;
        // The four ends of the two bars, along x and y at once.
        let ends = |bar: Frame| {
            let half_m = f64x2::splat(half_width_m) * f64x2::new([bar.sin, bar.cos]).abs();
            let middle = f64x2::new([bar.pose.x_m, bar.pose.y_m]);
            (middle - half_m, middle + half_m)
        };
        let (from, to) = (ends(start), ends(end));
        let [low_x_m, low_y_m] = (from.0.fast_min(to.0) - f64x2::splat(bulge_m)).to_array();
        let [high_x_m, high_y_m] = (from.1.fast_max(to.1) + f64x2::splat(bulge_m)).to_array();
        let (x_range, y_range) = ((low_x_m, high_x_m), (low_y_m, high_y_m));
        let sweeps_backwards = k * (half_width_m + border_m) >= 1.0;
        Self {
            start,
            end,
            curvature_per_m,
            half_width_m,
            border_m,
            sweeps_backwards,
            x_range,
            y_range,
        }
    }

    /// Whether a point of the world lies on the ground that the bar passes over.
    ///
    /// Exact and inclusive: between the two bar lines, and within half a width of the arc.
    ///
    /// With (a, l) the offsets in the start frame and k the curvature, `rho = |(k a, 1 - k l)|` is the distance from the
    /// turning centre in units of the radius, and `|1 - rho| / |k|` the distance from the arc; multiplied out, nothing
    /// is divided by k. A bar that reaches beyond its turning centre sweeps the opposite wedge backwards as well.
    #[must_use]
    #[inline]
    pub fn contains(&self, point: Point) -> bool {
        let (ahead, left) = self.start.offsets_to(point);
        let border_m = self.border_m;
        // Most points fail one of these two, before the root is taken.
        if ahead < -border_m && !self.sweeps_backwards {
            return false;
        }
        let (past_end, _) = self.end.offsets_to(point);
        let is_between = ahead >= -border_m && past_end <= border_m;
        let is_opposite = self.sweeps_backwards && ahead <= border_m && past_end >= -border_m;
        if !is_between && !is_opposite {
            return false;
        }
        let reach_m = self.half_width_m + border_m;
        if is_between {
            return self.is_beside(reach_m, ahead, left);
        }
        let k = self.curvature_per_m;
        1.0 + self.radii_from_centre(ahead, left) <= k.abs() * reach_m
    }

    /// Whether a point, by its offsets in the start frame, is within a distance of the whole circle that the arc is of.
    #[inline]
    fn is_beside(&self, reach_m: f64, ahead: f64, left: f64) -> bool {
        let twice_offset_m = 2.0 * left - self.curvature_per_m * (ahead * ahead + left * left);
        twice_offset_m.abs() <= reach_m * (1.0 + self.radii_from_centre(ahead, left))
    }

    /// The distance from the turning centre in units of the radius.
    #[inline]
    fn radii_from_centre(&self, ahead: f64, left: f64) -> f64 {
        let k = self.curvature_per_m;
        let (from_centre_x, from_centre_y) = (k * ahead, 1.0 - k * left);
        (from_centre_x * from_centre_x + from_centre_y * from_centre_y).sqrt()
    }
}

impl Footprint<0> for BarSweep {
    #[inline]
    fn x_range(&self) -> (f64, f64) {
        self.x_range
    }

    #[inline]
    fn y_range(&self) -> (f64, f64) {
        self.y_range
    }

    /// None: who looks for something under it looks into the box around it.
    #[inline]
    fn sides(&self) -> [SidePair; 0] {
        []
    }
}

#[cfg(test)]
mod tests {
    use super::super::Pose;
    use super::*;

    fn sweep(curvature_per_m: f64, length_m: f64, width_m: f64) -> BarSweep {
        BarSweep::new(&Arc { start: Pose::new(0.0, 0.0, 0.0), curvature_per_m, length_m }, width_m)
    }

    #[test]
    fn a_weed_exactly_on_the_bars_end_is_under_it() {
        assert!(sweep(0.0, 0.2, 2.0).contains(Point::new(0.1, 1.0)));
        assert!(!sweep(0.0, 0.2, 2.0).contains(Point::new(0.1, 1.0001)));
    }

    #[test]
    fn behind_the_start_and_beyond_the_end_nothing_is_under_it() {
        assert!(!sweep(0.0, 0.2, 2.0).contains(Point::new(-0.01, 0.0)));
        assert!(!sweep(0.0, 0.2, 2.0).contains(Point::new(0.21, 0.0)));
    }

    #[test]
    fn on_a_left_turn_the_right_end_of_the_bar_runs_ahead() {
        // Radius 2, quarter turn: the right end of a bar of width 2 runs on a circle of radius 3 around (0, 2).
        let quarter = sweep(0.5, std::f64::consts::PI, 2.0);
        assert!(quarter.contains(Point::new(2.9 * 0.5_f64.sqrt(), 2.0 - 2.9 * 0.5_f64.sqrt())));
        assert!(!quarter.contains(Point::new(3.1 * 0.5_f64.sqrt(), 2.0 - 3.1 * 0.5_f64.sqrt())));
        assert!(!quarter.contains(Point::new(0.9 * 0.5_f64.sqrt(), 2.0 - 0.9 * 0.5_f64.sqrt())));
    }

    #[test]
    fn a_bar_wider_than_its_circle_mows_behind_the_turning_centre_too() {
        // Radius 0.5 around (0, 0.5), bar 2 wide: its left end at (0, 1) runs backwards on a circle of radius 0.5.
        let tight = sweep(2.0, 0.2, 2.0);
        assert!(tight.contains(Point::new(-0.05, 0.8)));
        assert!(!tight.contains(Point::new(0.05, 0.8)));
        assert!(!tight.contains(Point::new(-0.4, 0.6)));
    }
}
