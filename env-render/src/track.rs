//! The path of an episode as points, cut into parts that are drawn once.

use swath_core::geometry::{Arc, Frame, Pose};
use swath_core::trajectory::{Trace, Trajectory};

use crate::layout::Window;

/// Largest and smallest way between two points, metres.
const SPACING_M: (f64, f64) = (0.05, 0.25);
/// So many ways between points are a part.
const PART: usize = 32;

/// Points of a path, at multiples of one distance, whatever commands the mower was given.
///
/// A part that is complete never changes, so what was drawn of it can be kept, and a picture depends on the path only,
/// not on the pictures before.
#[derive(Debug, Clone)]
pub(crate) struct Track {
    spacing_m: f64,
    points: Vec<Frame>,
    /// Where the mower is.
    end: Option<Frame>,
    /// Parts handed out.
    parts: usize,
    /// The arc that holds the last point, and the way before it, metres.
    arc: usize,
    before_m: f64,
    beginnings: Option<u64>,
    window: Window,
    deck_width_m: f64,
}

impl Track {
    /// A path not yet begun, of a mower that turns no tighter than `turning_radius_m`.
    pub(crate) fn new(turning_radius_m: f64, deck_width_m: f64, window: Window) -> Self {
        Self {
            spacing_m: (0.125 * turning_radius_m).clamp(SPACING_M.0, SPACING_M.1),
            points: Vec::new(),
            end: None,
            parts: 0,
            arc: 0,
            before_m: 0.0,
            beginnings: None,
            window,
            deck_width_m,
        }
    }

    /// Takes over how far the mower has come. Returns whether what was drawn before is of use still.
    pub(crate) fn follow(&mut self, trace: &Trace, pose: Pose, least: Window) -> bool {
        let goes_on = self.beginnings == Some(trace.beginnings());
        if !goes_on {
            self.points.clear();
            (self.parts, self.arc, self.before_m) = (0, 0, 0.0);
            self.beginnings = Some(trace.beginnings());
            self.window = least;
        }
        let known = self.points.len();
        self.extend(trace.path());
        for point in &self.points[known..] {
            self.window = self.window.grown_to(point.pose, self.deck_width_m);
        }
        self.end = Some(pose.into());
        goes_on
    }

    /// The same of a mower whose path is not kept.
    pub(crate) fn stand(&mut self, pose: Pose, least: Window) -> bool {
        self.points.clear();
        (self.parts, self.window, self.end) = (0, least, Some(pose.into()));
        false
    }

    /// Adds the points that the mower has passed.
    fn extend(&mut self, path: &Trajectory) {
        let arcs = path.arcs();
        while let Some(arc) = arcs.get(self.arc) {
            let along_m = self.points.len() as f64 * self.spacing_m - self.before_m;
            if along_m <= arc.length_m {
                let Arc { start, curvature_per_m, .. } = *arc;
                self.points.push(Frame::from(start).advanced(curvature_per_m, along_m));
            } else if self.arc + 1 < arcs.len() {
                self.before_m += arc.length_m;
                self.arc += 1;
            } else {
                break;
            }
        }
    }

    /// A window that shows the path and the mower.
    pub(crate) fn window(&self) -> Window {
        self.end.map_or(self.window, |end| self.window.grown_to(end.pose, self.deck_width_m))
    }

    /// Where the path begins, if it is kept.
    pub(crate) fn start(&self) -> Option<Frame> {
        self.points.first().copied()
    }

    /// Begins again with handing out parts.
    pub(crate) fn rewind(&mut self) {
        self.parts = 0;
    }

    /// The next complete part that was not handed out yet. It begins with the last point of the part before.
    pub(crate) fn next_part(&mut self) -> Option<&[Frame]> {
        let (first, last) = (self.parts * PART, (self.parts + 1) * PART);
        if last >= self.points.len() {
            return None;
        }
        self.parts += 1;
        Some(&self.points[first..=last])
    }

    /// What is left: less than a part, as far as the mower.
    pub(crate) fn rest(&self) -> impl Iterator<Item = Frame> {
        self.points.iter().skip(self.parts * PART).copied().chain(self.end)
    }
}
