//! The rules of the problem a second time, from their statement and by other means than the core's.
//!
//! Every test of a shape answers with a [`Verdict`]: what lies within a small band around a border is left to the core.

use std::f64::consts::{PI, TAU};

use swath_core::action::Command;
use swath_core::config::{MowerConfig, SensorConfig};
use swath_core::geometry::{Point, Pose};

/// Points this close to a border are not judged, metres: wider than the core's own 1e-6, narrower than anything that matters.
pub const BAND_M: f64 = 1e-5;
/// Way between two looks, metres.
pub const LOOK_SPACING_M: f64 = 0.2;

/// Whether a point lies in a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It does, by more than the band.
    Inside,
    /// It does not, by more than the band.
    Outside,
    /// It is too close to the border to say.
    Border,
}

/// The pose after a drive, by the textbook form that divides by the curvature.
#[must_use]
pub fn driven(from: Pose, command: Command) -> Pose {
    let Command { curvature_per_m: k, distance_m: s } = command;
    let t = from.heading_rad;
    if k == 0.0 {
        return Pose::new(from.x_m + s * t.cos(), from.y_m + s * t.sin(), t);
    }
    let turned = t + k * s;
    Pose::new(
        from.x_m + (turned.sin() - t.sin()) / k,
        from.y_m - (turned.cos() - t.cos()) / k,
        turned,
    )
}

/// Forward and left offset of a point from a pose, metres.
#[must_use]
pub fn offsets(pose: Pose, point: Point) -> (f64, f64) {
    let (dx, dy) = (point.x - pose.x_m, point.y - pose.y_m);
    let (sin, cos) = pose.heading_rad.sin_cos();
    (cos * dx + sin * dy, cos * dy - sin * dx)
}

/// Whether the bar passes over a point, by moving it in `steps` small steps: the point's forward offset changes sign
/// while its left offset is within half a width.
#[must_use]
pub fn is_under_the_moving_bar(
    from: Pose,
    command: Command,
    width_m: f64,
    point: Point,
    steps: u32,
) -> bool {
    let at = |step: u32| {
        let distance_m = command.distance_m * f64::from(step) / f64::from(steps);
        offsets(driven(from, Command { distance_m, ..command }), point)
    };
    (0..steps).any(|step| {
        let ((ahead_before, left_before), (ahead_after, left_after)) = (at(step), at(step + 1));
        let is_crossed =
            ahead_before.min(ahead_after) <= 0.0 && ahead_before.max(ahead_after) >= 0.0;
        let apart = ahead_before - ahead_after;
        let share = if apart == 0.0 { 0.0 } else { ahead_before / apart };
        let left = left_before + share * (left_after - left_before);
        is_crossed && left.abs() <= 0.5 * width_m
    })
}

/// How far along a drive the bar first passes over a point, metres, if it does; `wider_m` widens (or narrows) the bar and
/// lengthens (or shortens) the drive at both ends.
///
/// In polar coordinates about the turning centre the bar turns at a constant rate and covers the radii within half a
/// width of the turning radius, and, where it reaches beyond the centre, those of the opposite side too.
#[must_use]
pub fn first_under_the_bar(
    from: Pose,
    command: Command,
    width_m: f64,
    point: Point,
    wider_m: f64,
) -> Option<f64> {
    let Command { curvature_per_m: k, distance_m: s } = command;
    let half_m = 0.5 * width_m + wider_m;
    if k == 0.0 {
        let (ahead, left) = offsets(from, point);
        let is_under = ahead >= -wider_m && ahead <= s + wider_m && left.abs() <= half_m;
        return is_under.then(|| ahead.clamp(0.0, s));
    }
    let (sin, cos) = from.heading_rad.sin_cos();
    let centre = Point::new(from.x_m - sin / k, from.y_m + cos / k);
    let (spoke, bar) = (point - centre, from.position() - centre);
    let (distance_m, radius_m) = (spoke.norm(), 1.0 / k.abs());
    if distance_m < 10.0 * BAND_M {
        return (radius_m <= half_m && wider_m > 0.0).then_some(0.0);
    }
    let slack_rad = wider_m / distance_m;
    // How far the bar has to turn until its own side, or its other side, points at the point.
    let to_turn_rad = k.signum() * (spoke.y.atan2(spoke.x) - bar.y.atan2(bar.x));
    let at = |turn_rad: f64| {
        let turn_rad = turn_rad.rem_euclid(TAU);
        if turn_rad >= -slack_rad && turn_rad <= k.abs() * s + slack_rad {
            Some((turn_rad * radius_m).min(s))
        } else {
            (turn_rad >= TAU - slack_rad).then_some(0.0)
        }
    };
    let own_side = (distance_m - radius_m).abs() <= half_m;
    let other_side = distance_m + radius_m <= half_m;
    let (own, other) = (
        own_side.then(|| at(to_turn_rad)).flatten(),
        other_side.then(|| at(to_turn_rad + PI)).flatten(),
    );
    match (own, other) {
        (Some(own_m), Some(other_m)) => Some(own_m.min(other_m)),
        (own, other) => own.or(other),
    }
}

/// The detection triangle of a pose, by its corners: apex, right end, left end.
#[derive(Debug, Clone, Copy)]
struct Corners([(f64, f64); 3]);

impl Corners {
    fn of(pose: Pose, range_m: f64, width_m: f64) -> Self {
        let (sin, cos) = pose.heading_rad.sin_cos();
        let corner = |ahead: f64, left: f64| {
            (pose.x_m + cos * ahead - sin * left, pose.y_m + sin * ahead + cos * left)
        };
        let half_m = 0.5 * width_m;
        Self([corner(0.0, 0.0), corner(range_m, -half_m), corner(range_m, half_m)])
    }

    /// A point lies inside where it lies to the left of all three sides.
    fn verdict(&self, x_m: f64, y_m: f64) -> Verdict {
        let Self([a, b, c]) = *self;
        let mut inside_m = f64::INFINITY;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (side_x, side_y) = (to.0 - from.0, to.1 - from.1);
            let cross = side_x * (y_m - from.1) - side_y * (x_m - from.0);
            inside_m = inside_m.min(cross / (side_x * side_x + side_y * side_y).sqrt());
            if inside_m < -BAND_M {
                return Verdict::Outside;
            }
        }
        if inside_m > BAND_M { Verdict::Inside } else { Verdict::Border }
    }
}

/// Whether a point lies in the detection triangle of a pose.
#[must_use]
pub fn in_triangle(pose: Pose, range_m: f64, width_m: f64, point: Point) -> Verdict {
    Corners::of(pose, range_m, width_m).verdict(point.x, point.y)
}

/// A whole drive: the bar sweeps along every arc, the sensor looks at path 0, 0.2, 0.4 ... m.
#[derive(Debug)]
pub struct Course {
    deck_width_m: f64,
    /// Where each command begins, the command, and the path driven before it.
    pieces: Vec<(Pose, Command, f64)>,
    looks: Vec<Corners>,
}

/// What a whole drive does to one point of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fate {
    /// Path at which the bar first passed over it, metres.
    pub swept_m: Option<f64>,
    /// Path of the first look that showed it, metres.
    pub shown_m: Option<f64>,
    /// Whether some border came too close to it to be sure.
    pub is_close: bool,
}

impl Course {
    /// The course of a mower with this deck and this sensor from `start`.
    #[must_use]
    pub fn new(start: Pose, drive: &[Command], mower: &MowerConfig, sensor: &SensorConfig) -> Self {
        let look = |pose| Corners::of(pose, sensor.range_m, sensor.width_m);
        let (mut pieces, mut looks) = (Vec::new(), vec![look(start)]);
        let (mut pose, mut path_m) = (start, 0.0);
        for &command in drive {
            pieces.push((pose, command, path_m));
            loop {
                let distance_m = looks.len() as f64 * LOOK_SPACING_M - path_m;
                if distance_m > command.distance_m + 1e-9 {
                    break;
                }
                looks.push(look(driven(pose, Command { distance_m, ..command })));
            }
            pose = driven(pose, command);
            path_m += command.distance_m;
        }
        Self { deck_width_m: mower.deck_width_m, pieces, looks }
    }

    /// What the drive does to a point.
    #[must_use]
    pub fn fate(&self, point: Point) -> Fate {
        let mut fate = Fate { swept_m: None, shown_m: None, is_close: false };
        for (number, corners) in self.looks.iter().enumerate() {
            match corners.verdict(point.x, point.y) {
                Verdict::Outside => {}
                Verdict::Border => fate.is_close = true,
                Verdict::Inside => {
                    fate.shown_m = Some(number as f64 * LOOK_SPACING_M);
                    break;
                }
            }
        }
        for &(pose, command, path_m) in &self.pieces {
            let far_m = command.distance_m + self.deck_width_m;
            if (point.x - pose.x_m).abs().max((point.y - pose.y_m).abs()) > far_m {
                continue;
            }
            let under =
                |wider_m| first_under_the_bar(pose, command, self.deck_width_m, point, wider_m);
            let (narrow, wide) = (under(-BAND_M), under(BAND_M));
            fate.is_close |= narrow.is_some() != wide.is_some();
            if let Some(along_m) = narrow {
                fate.swept_m = Some(path_m + along_m);
                break;
            }
        }
        fate
    }
}

impl Fate {
    /// Whether a weed there is detected: it is shown before it is mowed, and mowing comes first where both are at once.
    #[must_use]
    pub fn is_detected(&self) -> bool {
        match (self.shown_m, self.swept_m) {
            (Some(shown_m), Some(swept_m)) => shown_m < swept_m,
            (shown_m, _) => shown_m.is_some(),
        }
    }

    /// Whether a border, or the order of mowing and looking, is too close to call.
    #[must_use]
    pub fn is_close_call(&self) -> bool {
        let is_close = |(shown_m, swept_m): (f64, f64)| (shown_m - swept_m).abs() < BAND_M;
        self.is_close || self.shown_m.zip(self.swept_m).is_some_and(is_close)
    }
}
