//! Where things lie in a picture.

use swath_core::geometry::{Point, Pose};
use swath_core::site::Site;

/// Size of a picture in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    width: u32,
    height: u32,
}

impl Size {
    /// Smallest width and height, pixels.
    pub const LEAST: (u32, u32) = (160, 90);
    /// Largest width and height, pixels.
    pub const MOST: u32 = 4096;

    /// A size of so many pixels; `None` if a picture of it could not be read or would be too large.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Option<Self> {
        let is_fit = (Self::LEAST.0..=Self::MOST).contains(&width)
            && (Self::LEAST.1..=Self::MOST).contains(&height);
        is_fit.then_some(Self { width, height })
    }

    /// Pixels across.
    #[must_use]
    pub fn width(self) -> u32 {
        self.width
    }

    /// Pixels from top to bottom.
    #[must_use]
    pub fn height(self) -> u32 {
        self.height
    }

    /// How large letters and marks are: 1 at 640 x 360.
    pub(crate) fn zoom(self) -> f32 {
        let fit = (self.width as f32 / 640.0).min(self.height as f32 / 360.0);
        fit.max(0.75)
    }
}

/// The part of the world that a picture shows, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Left and lower border.
    pub low_m: [f64; 2],
    /// Right and upper border.
    pub high_m: [f64; 2],
}

/// A window grows by whole multiples of this, metres.
const GROWTH_M: f64 = 5.0;

impl Window {
    /// The pasture, and as much of its headland as turns take.
    #[must_use]
    pub fn around(site: &Site) -> Self {
        let turn_m = 3.0 * site.turning_radius_m + 0.5 * site.deck_width_m;
        let margin_m = site.headland_m.min(turn_m).max(0.5 * site.deck_width_m);
        Self { low_m: [-margin_m; 2], high_m: [site.length_m + margin_m, site.width_m + margin_m] }
    }

    /// The smallest window that shows both.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self {
            low_m: [0, 1].map(|axis| self.low_m[axis].min(other.low_m[axis])),
            high_m: [0, 1].map(|axis| self.high_m[axis].max(other.high_m[axis])),
        }
    }

    /// The same, grown so that it shows all of a path: `x_m`, `y_m`, `heading_rad` and `path_m` of its points.
    #[must_use]
    pub fn grown_along(self, points: &[[f64; 4]], deck_width_m: f64) -> Self {
        points.iter().fold(self, |window, &[x_m, y_m, heading_rad, _]| {
            window.grown_to(Pose::new(x_m, y_m, heading_rad), deck_width_m)
        })
    }

    /// The window, grown where a mower at `pose` with a deck of `deck_width_m` would not be shown whole.
    pub(crate) fn grown_to(mut self, pose: Pose, deck_width_m: f64) -> Self {
        for (axis, at_m) in [pose.x_m, pose.y_m].into_iter().enumerate() {
            let (low_m, high_m) = (at_m - 0.5 * deck_width_m, at_m + 0.5 * deck_width_m);
            let steps = |beyond_m: f64| (beyond_m / GROWTH_M).ceil().max(0.0) * GROWTH_M;
            self.low_m[axis] -= steps(self.low_m[axis] - low_m);
            self.high_m[axis] += steps(high_m - self.high_m[axis]);
        }
        self
    }

    fn size_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.high_m[axis] - self.low_m[axis])
    }
}

/// A rectangle of whole pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// How the world lies in a plot: x to the right, y up, both in the same scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plot {
    pub(crate) area: Area,
    pub(crate) window: Window,
    pub(crate) px_per_m: f64,
    pub(crate) zoom: f32,
}

impl Plot {
    /// The largest plot of a window that fits into an area, in its middle.
    pub(crate) fn within(area: Area, window: Window, zoom: f32) -> Self {
        let [length_m, width_m] = window.size_m();
        let px_per_m = (f64::from(area.width) / length_m).min(f64::from(area.height) / width_m);
        let width = pixels(px_per_m * length_m).clamp(1, area.width);
        let height = pixels(px_per_m * width_m).clamp(1, area.height);
        let left = area.left + (area.width - width) / 2;
        let top = area.top + (area.height - height) / 2;
        Self { area: Area { left, top, width, height }, window, px_per_m, zoom }
    }

    /// A point of the world in the plot's own pixels.
    pub(crate) fn at(&self, point: Point) -> (f32, f32) {
        (self.x(point.x), self.y(point.y))
    }

    pub(crate) fn x(&self, x_m: f64) -> f32 {
        single((x_m - self.window.low_m[0]) * self.px_per_m)
    }

    pub(crate) fn y(&self, y_m: f64) -> f32 {
        single((self.window.high_m[1] - y_m) * self.px_per_m)
    }

    /// A length, in pixels.
    pub(crate) fn px(&self, length_m: f64) -> f32 {
        single(length_m * self.px_per_m)
    }
}

/// The lengths 1, 2, 5, 10, 20 ... m: the first that is not below `least_m`.
pub(crate) fn round_length(least_m: f64) -> f64 {
    let mut length_m = 1e-3;
    for factor in [2.0, 2.5, 2.0].into_iter().cycle() {
        if length_m >= least_m * (1.0 - 1e-9) {
            break;
        }
        length_m *= factor;
    }
    length_m
}

/// A length with its unit, as short as it can be.
pub(crate) fn label_of(length_m: f64) -> String {
    let rounded = (length_m * 1e3).round() / 1e3;
    // No minus before a zero.
    format!("{} m", rounded + 0.0)
}

#[expect(clippy::cast_possible_truncation, reason = "pixels need no more digits")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
pub(crate) fn pixels(value: f64) -> u32 {
    value.round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_axes_have_one_scale_for_any_pasture_and_any_picture() {
        for (length_m, width_m) in [(100.0, 40.0), (400.0, 3.0), (5.0, 300.0), (0.5, 0.5)] {
            let window = Window { low_m: [-1.0, -1.0], high_m: [length_m, width_m] };
            for (width, height) in [(640, 360), (300, 800), (160, 90)] {
                let area = Area { left: 30, top: 20, width, height };
                let plot = Plot::within(area, window, 1.0);
                let (right, bottom) = (plot.x(length_m), plot.y(-1.0));
                assert!((right - plot.area.width as f32).abs() <= 1.0);
                assert!((bottom - plot.area.height as f32).abs() <= 1.0);
                assert!((plot.x(1.0) - plot.x(0.0) - (plot.y(0.0) - plot.y(1.0))).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn round_lengths_begin_with_1_2_or_5() {
        let lengths = [0.7, 1.0, 1.1, 4.9, 12.0, 51.0, 199.0].map(round_length);
        assert_eq!(lengths.map(label_of), ["1 m", "1 m", "2 m", "5 m", "20 m", "100 m", "200 m"]);
    }

    #[test]
    fn a_window_grows_only_where_the_mower_leaves_it() {
        let window = Window { low_m: [-5.0, -5.0], high_m: [20.0, 10.0] };
        assert_eq!(window.grown_to(Pose::new(1.0, 1.0, 0.0), 2.0), window);
        let grown = window.grown_to(Pose::new(21.0, -5.0, 0.0), 2.0);
        assert_eq!(grown, Window { low_m: [-5.0, -10.0], high_m: [25.0, 10.0] });
    }
}
