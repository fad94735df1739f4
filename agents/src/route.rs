//! A path being driven.

use swath_core::action::Command;
use swath_core::geometry::{DubinsPath, Pose, Segment, shortest};
use swath_core::view::View;

/// What is left of a piece when it counts as driven, metres: half a step of a float32 action is a few times 1e-8 m.
pub const ARRIVED_M: f64 = 1e-7;

/// Pieces of a path, driven one after another however short the steps are.
#[derive(Debug, Clone)]
pub struct Route {
    /// Each piece with the path length at which it ends.
    pieces: Vec<(Segment, f64)>,
    next: usize,
}

impl Route {
    /// The route along a path that starts where the mower stands.
    #[must_use]
    pub fn along(path: &DubinsPath, view: &View) -> Self {
        Self { pieces: Vec::with_capacity(6), next: 0 }.then(path.segments(), view.path_m)
    }

    /// The route through pieces that follow each other, from where the mower stands.
    #[must_use]
    pub fn through(segments: impl IntoIterator<Item = Segment>, view: &View) -> Self {
        Self { pieces: Vec::with_capacity(4), next: 0 }.then(segments, view.path_m)
    }

    /// Nothing to drive.
    #[must_use]
    pub fn empty() -> Self {
        Self { pieces: Vec::new(), next: 0 }
    }

    /// The shortest route from where the mower stands.
    #[must_use]
    pub fn shortest_to(goal: Pose, view: &View) -> Self {
        let path = shortest(view.pose, goal, view.site.turning_radius_m)
            .expect("a checked scenario has a turning radius");
        Self::along(&path, view)
    }

    /// The same route with another path behind it.
    #[must_use]
    pub fn followed_by(self, path: &DubinsPath) -> Self {
        let end_m = self.pieces.last().map_or(0.0, |(_, end_m)| *end_m);
        self.then(path.segments(), end_m)
    }

    fn then(mut self, segments: impl IntoIterator<Item = Segment>, mut end_m: f64) -> Self {
        for segment in segments {
            end_m += segment.length_m;
            self.pieces.push((segment, end_m));
        }
        self
    }

    /// Whether every piece is driven.
    pub fn is_driven(&mut self, view: &View) -> bool {
        self.next(view).is_none()
    }

    /// The next command: the rest of the piece that the mower is on; `None` when all are driven.
    pub fn next(&mut self, view: &View) -> Option<Command> {
        while let Some((segment, end_m)) = self.pieces.get(self.next) {
            let distance_m = end_m - view.path_m;
            if distance_m > ARRIVED_M {
                return Some(Command { curvature_per_m: segment.curvature_per_m, distance_m });
            }
            self.next += 1;
        }
        None
    }
}
