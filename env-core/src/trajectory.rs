//! The path that a mower took.

use crate::geometry::{Arc, Pose};
use crate::math::{floor_index, larger, wrap_to_pi};

/// Largest distance between two points of a sampled path, metres.
pub const SAMPLE_SPACING_M: f64 = 0.1;
/// Largest turn between them, radians: a chord is shorter than its arc by less than half a thousandth then.
const SAMPLE_TURN_RAD: f64 = 0.1;
/// Curvatures this alike belong to one arc, 1/m.
const SAME_CURVATURE_PER_M: f64 = 1e-12;

/// The arcs of a path, in driving order; what was driven in several commands of one curvature is one arc.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    arcs: Vec<Arc>,
}

impl Trajectory {
    /// Adds what was driven last.
    pub fn push(&mut self, arc: Arc) {
        if arc.length_m <= 0.0 {
            return;
        }
        match self.arcs.last_mut() {
            Some(last)
                if (last.curvature_per_m - arc.curvature_per_m).abs() < SAME_CURVATURE_PER_M =>
            {
                last.length_m += arc.length_m;
            }
            _ => self.arcs.push(arc),
        }
    }

    /// The arcs.
    #[must_use]
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }

    /// Points of the path at most 0.1 m and 0.1 radians apart, arc ends included: `x_m`, `y_m`, `heading_rad` in [-pi, pi) and `path_m`.
    #[must_use]
    pub fn sample(&self) -> Vec<[f64; 4]> {
        let point =
            |pose: Pose, path_m: f64| [pose.x_m, pose.y_m, wrap_to_pi(pose.heading_rad), path_m];
        let mut points: Vec<[f64; 4]> =
            self.arcs.first().map(|arc| point(arc.start, 0.0)).into_iter().collect();
        let mut path_m = 0.0;
        for arc in &self.arcs {
            let turn_rad = arc.length_m * arc.curvature_per_m.abs();
            let pieces = larger(arc.length_m / SAMPLE_SPACING_M, turn_rad / SAMPLE_TURN_RAD);
            let pieces = floor_index(pieces.ceil()).max(1);
            for piece in 1..=pieces {
                let along_m = arc.length_m * piece as f64 / pieces as f64;
                points.push(point(arc.at(along_m), path_m + along_m));
            }
            path_m += arc.length_m;
        }
        points
    }
}

/// The path of a running episode, for pictures of it.
#[derive(Debug, Clone)]
pub struct Trace {
    path: Trajectory,
    /// Where the mower stands.
    at: Pose,
    beginnings: u64,
}

impl Trace {
    /// A trace that begins where the mower stands.
    pub(crate) fn at(pose: Pose) -> Self {
        Self { path: Trajectory::default(), at: pose, beginnings: 0 }
    }

    /// Forgets the path: an episode begins at `pose`, or goes on there.
    pub(crate) fn begin(&mut self, pose: Pose) {
        self.path = Trajectory::default();
        self.at = pose;
        self.beginnings += 1;
    }

    /// Adds what led to `pose`.
    pub(crate) fn follow(&mut self, curvature_per_m: f64, length_m: f64, pose: Pose) {
        self.path.push(Arc { start: self.at, curvature_per_m, length_m });
        self.at = pose;
    }

    /// The path since the trace began.
    #[must_use]
    pub fn path(&self) -> &Trajectory {
        &self.path
    }

    /// How often the trace has begun anew: what was drawn of it before is of no use then.
    #[must_use]
    pub fn beginnings(&self) -> u64 {
        self.beginnings
    }
}
