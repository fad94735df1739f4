//! The plan: places to pass, in order.

use std::f32::consts::{PI, TAU};

use swath_core::geometry::{DubinsPath, Point, Pose};

use super::spot::{Spot, cos_sin, single};
use super::ways::Ways;

/// A place to pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) spot: Spot,
    /// What is mowed there; `None` for a place to look from.
    pub(super) weed: Option<PlannedWeed>,
}

/// A weed, and where along the bar it passes: so far left of the middle, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlannedWeed {
    pub(super) number: u32,
    pub(super) x_m: f32,
    pub(super) y_m: f32,
    pub(super) left_m: f32,
}

impl Node {
    /// A place to look from.
    pub(super) fn view(spot: Spot) -> Self {
        Self { spot, weed: None }
    }

    /// A weed that passes under the bar `left_m` left of its middle, the mower heading that way.
    pub(super) fn weed(
        number: u32,
        (x_m, y_m): (f32, f32),
        left_m: f32,
        (cos, sin): (f32, f32),
    ) -> Self {
        let spot = Spot::facing(x_m + left_m * sin, y_m - left_m * cos, (cos, sin));
        Self { spot, weed: Some(PlannedWeed { number, x_m, y_m, left_m }) }
    }

    /// The same weed passed in another direction, or elsewhere under the bar.
    pub(super) fn turned(weed: &PlannedWeed, left_m: f32, direction: (f32, f32)) -> Self {
        Self::weed(weed.number, (weed.x_m, weed.y_m), left_m, direction)
    }

    /// The same place passed the other way.
    pub(super) fn reversed(&self) -> Self {
        let Spot { x_m, y_m, heading_rad, cos, sin } = self.spot;
        let heading_rad = if heading_rad > 0.0 { heading_rad - PI } else { heading_rad + PI };
        Self {
            spot: Spot { x_m, y_m, heading_rad, cos: -cos, sin: -sin },
            weed: self.weed.map(|weed| PlannedWeed { left_m: -weed.left_m, ..weed }),
        }
    }

    /// Where the weed stands, or the place itself.
    pub(super) fn at(&self) -> (f32, f32) {
        self.weed.map_or((self.spot.x_m, self.spot.y_m), |weed| (weed.x_m, weed.y_m))
    }
}

/// Nodes in the order in which they are passed, from where the mower stands.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub(super) start: Spot,
    pub(super) ways: Ways,
    pub(super) nodes: Vec<Node>,
    /// The length of the leg to each node, metres.
    pub(super) legs_m: Vec<f32>,
}

impl Plan {
    pub(super) fn new(start: Spot, ways: Ways) -> Self {
        Self { start, ways, nodes: Vec::new(), legs_m: Vec::new() }
    }

    pub(super) fn length_m(&self) -> f32 {
        self.legs_m.iter().sum()
    }

    /// The spot before that place in the order.
    #[inline]
    pub(super) fn before(&self, place: usize) -> &Spot {
        place.checked_sub(1).map_or(&self.start, |before| &self.nodes[before].spot)
    }

    /// The spot at that place in the order, if there is one.
    #[inline]
    pub(super) fn after(&self, place: usize) -> Option<&Spot> {
        self.nodes.get(place).map(|node| &node.spot)
    }

    #[inline]
    pub(super) fn leg_m(&self, from: &Spot, to: &Spot) -> f32 {
        self.ways.leg_m(from, to)
    }

    /// How much longer the plan would be with a spot before that place.
    #[inline]
    pub(super) fn detour_m(&self, place: usize, spot: &Spot) -> f32 {
        let there_m = self.leg_m(self.before(place), spot);
        match self.after(place) {
            Some(after) => there_m + self.leg_m(spot, after) - self.legs_m[place],
            None => there_m,
        }
    }

    /// Adds a node before that place.
    pub(super) fn insert(&mut self, place: usize, node: Node) {
        let leg_m = self.leg_m(self.before(place), &node.spot);
        self.nodes.insert(place, node);
        self.legs_m.insert(place, leg_m);
        self.measure(place + 1);
    }

    /// Leaves out a node.
    pub(super) fn remove(&mut self, place: usize) -> Node {
        let node = self.nodes.remove(place);
        self.legs_m.remove(place);
        self.measure(place);
        node
    }

    /// Leaves out all nodes but some.
    pub(super) fn retain(&mut self, keep: impl FnMut(&Node) -> bool) {
        self.nodes.retain(keep);
        self.measure_all();
    }

    /// Measures the leg to that place.
    pub(super) fn measure(&mut self, place: usize) {
        if place < self.nodes.len() {
            self.legs_m[place] = self.leg_m(self.before(place), &self.nodes[place].spot);
        }
    }

    /// Measures every leg.
    pub(super) fn measure_all(&mut self) {
        self.legs_m.resize(self.nodes.len(), 0.0);
        (0..self.nodes.len()).for_each(|place| self.measure(place));
    }

    /// Adds a weed where the detour is shortest: before one of the few places that are nearest to it, in one of many directions
    /// and under one of a few parts of the bar, or where the plan passes over it already.
    pub(super) fn insert_weed(&mut self, number: u32, at: Point, reach_m: f32) {
        let (x_m, y_m) = (single(at.x), single(at.y));
        let here = Spot { x_m, y_m, ..Spot::default() };
        let mut places: Vec<(f32, usize)> = (0..=self.nodes.len())
            .map(|place| {
                let before = self.before(place);
                let there_m = before.distance_to(&here);
                let detour_m = self.after(place).map_or(there_m, |after| {
                    there_m + here.distance_to(after) - before.distance_to(after)
                });
                (detour_m, place)
            })
            .collect();
        let few = places.len().min(PLACES);
        places.select_nth_unstable_by(few - 1, |one, other| one.0.total_cmp(&other.0));
        let mut best: Option<(f32, usize, Node)> = None;
        for &(_, place) in &places[..few] {
            let mut offer = |node: Node| {
                let detour_m = self.detour_m(place, &node.spot);
                if best.as_ref().is_none_or(|&(least_m, ..)| detour_m < least_m) {
                    best = Some((detour_m, place, node));
                }
            };
            for direction in 0..DIRECTIONS {
                let direction = cos_sin(direction as f32 * TAU / DIRECTIONS as f32);
                for left_m in [-0.9 * reach_m, 0.0, 0.9 * reach_m] {
                    offer(Node::weed(number, (x_m, y_m), left_m, direction));
                }
            }
            if let Some(after) = self.after(place) {
                let (from, to) = (self.before(place).pose(), after.pose());
                for_each_pose(&self.ways.way(from, to), STRIDE_M.into(), |pose| {
                    let spot = Spot::from(pose);
                    let (ahead_m, left_m) = spot.offsets_to(&here);
                    if ahead_m.abs() <= 0.6 * STRIDE_M && left_m.abs() <= reach_m {
                        offer(Node::weed(number, (x_m, y_m), left_m, (spot.cos, spot.sin)));
                    }
                });
            }
        }
        let (_, place, node) = best.expect("there is a place at the end");
        self.insert(place, node);
    }
}

/// How many places are tried for a weed, how many directions, and how finely the legs there are looked through, metres.
const PLACES: usize = 8;
const DIRECTIONS: usize = 16;
const STRIDE_M: f32 = 0.5;

/// Calls `visit` with poses on a way, so far apart, without the first one.
fn for_each_pose(way: &DubinsPath, spacing_m: f64, mut visit: impl FnMut(Pose)) {
    let poses = swath_core::math::floor_index(way.length_m() / spacing_m);
    (1..=poses).for_each(|pose| visit(way.at(spacing_m * pose as f64)));
}
