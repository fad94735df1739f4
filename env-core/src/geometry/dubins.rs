//! The six words of Dubins: shortest paths for a vehicle that drives forward only and turns no tighter than a radius.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Arc, Pose};
use crate::math::{acos, atan2, sin_cos, wrap_to_tau};

/// Angles this close below a full circle are rounding, not a circle.
pub(super) const PHANTOM_CIRCLE_RAD: f64 = 1e-9;
/// A squared straight (in units of the radius) this little below zero is rounding: the arcs touch.
pub(super) const TOUCHING: f64 = 1e-9;

/// A straight this short (in radii) has no direction: the word is one arc.
pub(super) const ONE_ARC: f64 = 1e-9;

/// A path that cannot be asked for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PathError {
    /// The turning radius is not a length.
    #[error("`radius_m` must be finite and > 0, got {0}")]
    Radius(f64),
    /// A pose that is none.
    #[error("`{0}` must be finite, got {1:?}")]
    Pose(&'static str, Pose),
}

/// The order of turns of a Dubins path: L turns left, R turns right, S goes straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Word {
    /// Left, straight, left.
    Lsl,
    /// Right, straight, right.
    Rsr,
    /// Left, straight, right.
    Lsr,
    /// Right, straight, left.
    Rsl,
    /// Right, left, right.
    Rlr,
    /// Left, right, left.
    Lrl,
}

/// One piece of a path: how sharply to turn, and for how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Signed curvature, 1/m, left positive.
    pub curvature_per_m: f64,
    /// Length, metres.
    pub length_m: f64,
}

impl Word {
    /// All six words, in the order in which ties are broken.
    pub const ALL: [Self; 6] = [Self::Lsl, Self::Rsr, Self::Lsr, Self::Rsl, Self::Rlr, Self::Lrl];

    /// The sense of each of the three pieces: +1 left, 0 straight, -1 right.
    #[must_use]
    pub fn turns(self) -> [f64; 3] {
        match self {
            Self::Lsl => [1.0, 0.0, 1.0],
            Self::Rsr => [-1.0, 0.0, -1.0],
            Self::Lsr => [1.0, 0.0, -1.0],
            Self::Rsl => [-1.0, 0.0, 1.0],
            Self::Rlr => [-1.0, 1.0, -1.0],
            Self::Lrl => [1.0, -1.0, 1.0],
        }
    }

    /// The path of this word from `start` to `goal`, or `None` if the word cannot join them.
    ///
    /// Shkel & Lumelsky (2001), "Classification of the Dubins set", equations 3 to 11.
    /// Deviations: arcs within 1e-9 rad below a full circle count as none; LSL and RSR with a straight below 1e-9 radii
    /// are one arc; words whose arcs miss touching by rounding (1e-9 of the squared radius) exist.
    ///
    /// # Panics
    ///
    /// If `radius_m` is not finite and positive.
    #[must_use]
    pub fn path(self, start: Pose, goal: Pose, radius_m: f64) -> Option<DubinsPath> {
        Query::new(start, goal, radius_m).path(self)
    }
}

/// The question in Shkel and Lumelsky's normalised frame: unit radius, goal at distance `d` along +x.
struct Query {
    start: Pose,
    radius_m: f64,
    d: f64,
    alpha: f64,
    beta: f64,
    sin_a: f64,
    cos_a: f64,
    sin_b: f64,
    cos_b: f64,
    cos_ab: f64,
}

impl Query {
    fn new(start: Pose, goal: Pose, radius_m: f64) -> Self {
        assert!(
            radius_m.is_finite() && radius_m > 0.0,
            "`radius_m` must be finite and > 0, got {radius_m}"
        );
        let (dx, dy) = (goal.x_m - start.x_m, goal.y_m - start.y_m);
        let direction = if dx == 0.0 && dy == 0.0 { 0.0 } else { atan2(dy, dx) };
        let alpha = wrap_to_tau(start.heading_rad - direction);
        let beta = wrap_to_tau(goal.heading_rad - direction);
        let ((sin_a, cos_a), (sin_b, cos_b)) = (sin_cos(alpha), sin_cos(beta));
        let d = (dx * dx + dy * dy).sqrt() / radius_m;
        let cos_ab = cos_a * cos_b + sin_a * sin_b;
        Self { start, radius_m, d, alpha, beta, sin_a, cos_a, sin_b, cos_b, cos_ab }
    }

    /// Angle, straight or angle, angle: the three pieces in units of the radius.
    fn pieces(&self, word: Word) -> Option<[f64; 3]> {
        let Self { d, alpha, beta, sin_a, cos_a, sin_b, cos_b, cos_ab, .. } = *self;
        match word {
            Word::Lsl => {
                let (x, y) = (d + sin_a - sin_b, cos_b - cos_a);
                let p = (x * x + y * y).sqrt();
                if p < ONE_ARC {
                    return Some([turn(beta - alpha), 0.0, 0.0]);
                }
                let along = atan2(y, x);
                Some([turn(along - alpha), p, turn(beta - along)])
            }
            Word::Rsr => {
                let (x, y) = (d - sin_a + sin_b, cos_a - cos_b);
                let p = (x * x + y * y).sqrt();
                if p < ONE_ARC {
                    return Some([turn(alpha - beta), 0.0, 0.0]);
                }
                let along = atan2(y, x);
                Some([turn(alpha - along), p, turn(along - beta)])
            }
            Word::Lsr => {
                let (x, y) = (d + sin_a + sin_b, -cos_a - cos_b);
                let p = straight(x * x + y * y - 4.0)?;
                let along = atan2(y, x) - atan2(-2.0, p);
                Some([turn(along - alpha), p, turn(along - beta)])
            }
            Word::Rsl => {
                let (x, y) = (d - sin_a - sin_b, cos_a + cos_b);
                let p = straight(x * x + y * y - 4.0)?;
                let along = atan2(y, x) - atan2(2.0, p);
                Some([turn(alpha - along), p, turn(beta - along)])
            }
            Word::Rlr => {
                let p = middle((6.0 - d * d + 2.0 * cos_ab + 2.0 * d * (sin_a - sin_b)) / 8.0)?;
                let t = turn(alpha - atan2(cos_a - cos_b, d - sin_a + sin_b) + 0.5 * p);
                Some([t, p, turn(alpha - beta - t + p)])
            }
            Word::Lrl => {
                let p = middle((6.0 - d * d + 2.0 * cos_ab + 2.0 * d * (sin_b - sin_a)) / 8.0)?;
                let t = turn(-alpha - atan2(cos_a - cos_b, d + sin_a - sin_b) + 0.5 * p);
                Some([t, p, turn(beta - alpha - t + p)])
            }
        }
    }

    fn path(&self, word: Word) -> Option<DubinsPath> {
        let pieces = self.pieces(word)?;
        Some(DubinsPath {
            start: self.start,
            word,
            radius_m: self.radius_m,
            lengths_m: pieces.map(|p| p * self.radius_m),
        })
    }
}

/// Length of the straight from its square, in units of the radius.
fn straight(squared: f64) -> Option<f64> {
    (squared > -TOUCHING).then(|| squared.max(0.0).sqrt())
}

/// The middle arc of RLR and LRL from its cosine.
fn middle(cosine: f64) -> Option<f64> {
    (cosine.abs() <= 1.0 + TOUCHING).then(|| turn(TAU - acos(cosine)))
}

/// An arc in [0, 2 pi), phantom full circles removed.
fn turn(angle_rad: f64) -> f64 {
    let wrapped = wrap_to_tau(angle_rad);
    if wrapped > TAU - PHANTOM_CIRCLE_RAD { 0.0 } else { wrapped }
}

/// A path of one Dubins word between two poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DubinsPath {
    pub(super) start: Pose,
    pub(super) word: Word,
    pub(super) radius_m: f64,
    pub(super) lengths_m: [f64; 3],
}

impl DubinsPath {
    /// Where the path begins.
    #[must_use]
    pub fn start(&self) -> Pose {
        self.start
    }

    /// Which word the path spells.
    #[must_use]
    pub fn word(&self) -> Word {
        self.word
    }

    /// Length of the whole path, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.lengths_m.iter().sum()
    }

    /// The three pieces in driving order; any of them may have length 0.
    #[must_use]
    pub fn segments(&self) -> [Segment; 3] {
        let turns = self.word.turns();
        std::array::from_fn(|i| Segment {
            curvature_per_m: turns[i] / self.radius_m,
            length_m: self.lengths_m[i],
        })
    }

    /// The three pieces as arcs, in driving order.
    pub fn arcs(&self) -> impl Iterator<Item = Arc> {
        let mut start = self.start;
        self.segments().into_iter().map(move |Segment { curvature_per_m, length_m }| {
            let arc = Arc { start, curvature_per_m, length_m };
            start = arc.end();
            arc
        })
    }

    /// The pose after `distance_m` along the path, clamped to its ends.
    #[must_use]
    pub fn at(&self, distance_m: f64) -> Pose {
        let mut left_m = distance_m.max(0.0);
        let mut pose = self.start;
        for Segment { curvature_per_m, length_m } in self.segments() {
            let arc = Arc { start: pose, curvature_per_m, length_m };
            if left_m <= length_m {
                return arc.at(left_m);
            }
            pose = arc.end();
            left_m -= length_m;
        }
        pose
    }

    /// Poses from start to end inclusive, evenly spaced and at most `spacing_m` apart.
    ///
    /// # Panics
    ///
    /// If `spacing_m` is not positive.
    #[must_use]
    pub fn sample(&self, spacing_m: f64) -> Vec<Pose> {
        assert!(spacing_m > 0.0, "`spacing_m` must be > 0, got {spacing_m}");
        let length_m = self.length_m();
        let pieces = crate::math::floor_index((length_m / spacing_m).ceil()).max(1);
        (0..=pieces).map(|i| self.at(length_m * i as f64 / pieces as f64)).collect()
    }
}

/// Shortest path between two poses for a vehicle that only drives forward and turns with at least `radius_m`.
///
/// Tries the six words of Dubins (LSL, RSR, LSR, RSL, RLR, LRL); Shkel & Lumelsky (2001).
/// Deviation: poses closer than 1e-9 m and 1e-9 rad give the empty path, where the words degenerate.
/// The length is not a metric: `shortest(a, b)` and `shortest(b, a)` may differ.
///
/// # Errors
///
/// [`PathError::Radius`] if `radius_m` is not finite and positive, [`PathError::Pose`] if a pose is not finite.
///
/// ```
/// use swath_core::geometry::{Pose, shortest};
/// let u_turn = shortest(Pose::new(0.0, 0.0, 0.0), Pose::new(0.0, 4.0, std::f64::consts::PI), 2.0)?;
/// assert!((u_turn.length_m() - 2.0 * std::f64::consts::PI).abs() < 1e-9);
/// # Ok::<(), swath_core::geometry::PathError>(())
/// ```
pub fn shortest(start: Pose, goal: Pose, radius_m: f64) -> Result<DubinsPath, PathError> {
    if !(radius_m.is_finite() && radius_m > 0.0) {
        return Err(PathError::Radius(radius_m));
    }
    for (name, pose) in [("start", start), ("goal", goal)] {
        if ![pose.x_m, pose.y_m, pose.heading_rad].iter().all(|value| value.is_finite()) {
            return Err(PathError::Pose(name, pose));
        }
    }
    let turned_rad = wrap_to_tau(goal.heading_rad - start.heading_rad);
    if start.distance_to(&goal) < 1e-9 && turned_rad.min(TAU - turned_rad) < 1e-9 {
        return Ok(DubinsPath { start, word: Word::Lsl, radius_m, lengths_m: [0.0; 3] });
    }
    let best = words(start, goal, radius_m)
        .reduce(|best, path| if path.length_m() < best.length_m() { path } else { best });
    Ok(best.expect("LSL and RSR join any two poses"))
}

/// The path of every word that joins two poses, in the order of [`Word::ALL`]; LSL and RSR are always among them.
///
/// # Panics
///
/// If `radius_m` is not finite and positive.
pub fn words(start: Pose, goal: Pose, radius_m: f64) -> impl Iterator<Item = DubinsPath> {
    let query = Query::new(start, goal, radius_m);
    Word::ALL.into_iter().filter_map(move |word| query.path(word))
}

/// Length of a boustrophedon path of `passes` parallel passes of `length_m`, `spacing_m` apart, with the shortest U-turns.
///
/// Maini, Gonultas & Isler (2022), section V-B. The U-turn is an omega of `R (pi + 4 acos((2R + s) / 4R))` below a
/// spacing of `2R`, and `pi R + s - 2R` from there on; both are the shortest Dubins paths between the pass ends.
#[must_use]
pub fn boustrophedon_length(passes: usize, length_m: f64, spacing_m: f64, radius_m: f64) -> f64 {
    let turns = passes.saturating_sub(1) as f64;
    let turn_m = if spacing_m < 2.0 * radius_m {
        radius_m * (PI + 4.0 * acos((2.0 * radius_m + spacing_m) / (4.0 * radius_m)))
    } else {
        2.0 * radius_m * FRAC_PI_2 + spacing_m - 2.0 * radius_m
    };
    passes as f64 * length_m + turns * turn_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_boustrophedon_path_has_the_length_of_its_closed_form() {
        // Omega turns of R (pi + 4 acos((2R + s) / 4R)), worked out by hand for the two shipped pastures.
        assert!((boustrophedon_length(20, 100.0, 2.0, 2.0) - 2229.236).abs() < 1e-3);
        assert!((boustrophedon_length(20, 36.0, 1.3, 1.5) - 897.519).abs() < 1e-3);
        assert!((boustrophedon_length(4, 100.0, 12.0, 2.0) - 442.850).abs() < 1e-3);
    }

    #[test]
    fn the_u_turn_of_the_closed_form_is_the_shortest_path() {
        for spacing_m in [0.5, 1.3, 2.0, 3.9, 4.0, 4.1, 12.0] {
            let u_turn =
                shortest(Pose::new(0.0, 0.0, 0.0), Pose::new(0.0, spacing_m, PI), 2.0).unwrap();
            let closed_form_m = boustrophedon_length(2, 0.0, spacing_m, 2.0);
            assert!((u_turn.length_m() - closed_form_m).abs() < 1e-9, "{spacing_m}: {u_turn:?}");
        }
    }

    #[test]
    fn equal_poses_are_joined_by_the_empty_path() {
        let pose = Pose::new(4.0, 5.0, 1.0);
        let path = shortest(pose, pose, 2.0).unwrap();
        assert!(path.length_m() < 1e-12);
    }

    #[test]
    fn a_radius_of_zero_is_refused_by_name() {
        let error = shortest(Pose::new(0.0, 0.0, 0.0), Pose::new(1.0, 0.0, 0.0), 0.0).unwrap_err();
        assert_eq!(error.to_string(), "`radius_m` must be finite and > 0, got 0");
    }
}
