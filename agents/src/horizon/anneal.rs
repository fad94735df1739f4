//! Making a plan shorter by many small changes.

use std::f32::consts::TAU;

use swath_core::math;
use swath_core::rng::{StreamRng, below, bits, uniform};

use super::deadline::Deadline;
use super::plan::{Node, Plan};
use super::spot::{Spot, cos_sin, single};
use super::ways::Ways;

/// Changes that make a plan longer by about this much are accepted at the beginning and at the end, metres.
const HOT_M: f32 = 1.0;
const COLD_M: f32 = 0.02;
/// So many changes are tried between two looks at the clock.
const ROUNDS_A_CLOCK: usize = 64;
/// How many nodes near to each are considered to come before or after it.
const NEIGHBOURS: usize = 8;
/// Most nodes whose order is reversed, and most that are moved together.
const LONGEST_REVERSAL: usize = 41;
const LONGEST_MOVE: usize = 7;

/// Shortens a plan, whose last best form is kept; `reach_m` is how far from the bar's middle a weed may pass.
///
/// Simulated annealing (Kirkpatrick, Gelatt & Vecchi, 1983) over the order of the nodes, the direction in which each weed is
/// passed, and where along the bar. Places to look from stay in their order. It ends early when time is over.
pub(super) fn anneal(
    plan: &mut Plan,
    reach_m: f32,
    rounds: usize,
    until: Option<Deadline>,
    rng: &mut StreamRng,
) {
    if plan.nodes.iter().all(|node| node.weed.is_none()) {
        return;
    }
    let mut search = Search::new(plan, reach_m);
    let cooling = cooling(HOT_M, COLD_M, rounds);
    let mut heat_m = HOT_M;
    for round in 0..rounds {
        if round.is_multiple_of(ROUNDS_A_CLOCK) && until.is_some_and(Deadline::is_over) {
            break;
        }
        search.change(heat_m, rng);
        heat_m *= cooling;
    }
    search.keep_best();
    search.write_to(plan);
}

struct Search {
    start: Spot,
    ways: Ways,
    reach_m: f32,
    nodes: Vec<Node>,
    /// Length of the leg to each node.
    legs_m: Vec<f32>,
    /// Nodes in the order in which they are passed, and the place of each.
    order: Vec<usize>,
    place: Vec<usize>,
    neighbours: Vec<[usize; NEIGHBOURS]>,
    weeds: Vec<usize>,
    /// How much longer the plan is than the best one.
    excess_m: f32,
    best: (Vec<Node>, Vec<usize>, Vec<f32>),
    is_best_kept: bool,
}

impl Search {
    fn new(plan: &Plan, reach_m: f32) -> Self {
        let nodes = plan.nodes.clone();
        let count = nodes.len();
        let weeds: Vec<usize> = (0..count).filter(|&node| nodes[node].weed.is_some()).collect();
        let mut neighbours = vec![[usize::MAX; NEIGHBOURS]; count];
        let mut near: Vec<(f32, usize)> = Vec::with_capacity(count);
        for &weed in &weeds {
            let (x_m, y_m) = nodes[weed].at();
            near.clear();
            near.extend((0..count).filter(|&other| other != weed).map(|other| {
                let (other_x_m, other_y_m) = nodes[other].at();
                let (dx, dy) = (other_x_m - x_m, other_y_m - y_m);
                (dx * dx + dy * dy, other)
            }));
            if near.len() > NEIGHBOURS {
                near.select_nth_unstable_by(NEIGHBOURS, |one, other| one.0.total_cmp(&other.0));
            }
            for (neighbour, &(_, other)) in neighbours[weed].iter_mut().zip(&near) {
                *neighbour = other;
            }
        }
        let order: Vec<usize> = (0..count).collect();
        Self {
            start: plan.start,
            ways: plan.ways,
            reach_m,
            legs_m: plan.legs_m.clone(),
            place: order.clone(),
            best: (nodes.clone(), order.clone(), plan.legs_m.clone()),
            order,
            neighbours,
            weeds,
            nodes,
            excess_m: 0.0,
            is_best_kept: true,
        }
    }

    /// Takes note of the plan as it is, if it is the best one.
    fn keep_best(&mut self) {
        if self.is_best_kept || self.excess_m > 0.0 {
            return;
        }
        self.best.0.clone_from(&self.nodes);
        self.best.1.clone_from(&self.order);
        self.best.2.clone_from(&self.legs_m);
        self.is_best_kept = true;
    }

    fn write_to(&self, plan: &mut Plan) {
        let (nodes, order, legs_m) = &self.best;
        plan.nodes.clear();
        plan.nodes.extend(order.iter().map(|&node| nodes[node]));
        plan.legs_m.clear();
        plan.legs_m.extend(order.iter().map(|&node| legs_m[node]));
    }

    /// Tries one change.
    fn change(&mut self, heat_m: f32, rng: &mut StreamRng) {
        let weed = self.weeds[below(self.weeds.len(), rng)];
        match uniform(rng) {
            choice if choice < 0.5 => self.twist(weed, heat_m, rng),
            choice if choice < 0.8 => self.relocate(weed, heat_m, rng),
            choice if choice < 0.9 => self.reverse(weed, heat_m, rng),
            _ => self.move_run(weed, heat_m, rng),
        }
    }

    /// Whether a change is made that makes the plan so much longer.
    fn accepts(&mut self, longer_m: f32, heat_m: f32, rng: &mut StreamRng) -> bool {
        if longer_m > 0.0 {
            // e to the -x, from below: what is accepted seldom matters little.
            let hotness = longer_m / heat_m;
            if hotness > 6.0 {
                return false;
            }
            let chance = single(uniform(rng));
            let eighth = 1.0 - hotness / 8.0;
            if chance >= eighth.powi(8) {
                return false;
            }
            self.keep_best();
        }
        self.excess_m += longer_m;
        if self.excess_m < -1e-4 {
            self.excess_m = 0.0;
            self.is_best_kept = false;
        }
        true
    }

    fn before(&self, place: usize) -> &Spot {
        place.checked_sub(1).map_or(&self.start, |before| &self.nodes[self.order[before]].spot)
    }

    fn leg_m(&self, from: &Spot, to: &Spot) -> f32 {
        self.ways.leg_m(from, to)
    }

    /// Passes a weed in another direction, or elsewhere under the bar.
    fn twist(&mut self, node: usize, heat_m: f32, rng: &mut StreamRng) {
        let weed = self.nodes[node].weed.expect("weeds are twisted");
        let heading_rad = if uniform(rng) < 0.7 {
            self.nodes[node].spot.heading_rad + 0.35 * bell(rng)
        } else {
            TAU * (single(uniform(rng)) - 0.5)
        };
        let left_m =
            (weed.left_m + 0.4 * self.reach_m * bell(rng)).clamp(-self.reach_m, self.reach_m);
        let twisted = Node::turned(&weed, left_m, cos_sin(heading_rad));
        let place = self.place[node];
        let to_m = self.leg_m(self.before(place), &twisted.spot);
        let next = self.order.get(place + 1).copied();
        let from_m = next.map(|next| self.leg_m(&twisted.spot, &self.nodes[next].spot));
        let longer_m = to_m - self.legs_m[node]
            + next.zip(from_m).map_or(0.0, |(next, from_m)| from_m - self.legs_m[next]);
        if self.accepts(longer_m, heat_m, rng) {
            self.nodes[node] = twisted;
            self.legs_m[node] = to_m;
            if let Some((next, from_m)) = next.zip(from_m) {
                self.legs_m[next] = from_m;
            }
        }
    }

    /// A random neighbour.
    fn neighbour(&self, node: usize, rng: &mut StreamRng) -> Option<usize> {
        let neighbour = self.neighbours[node][below(NEIGHBOURS, rng)];
        (neighbour != usize::MAX).then_some(neighbour)
    }

    /// Moves a weed to before or after a neighbour.
    fn relocate(&mut self, node: usize, heat_m: f32, rng: &mut StreamRng) {
        let Some(neighbour) = self.neighbour(node, rng) else { return };
        let place = self.place[node];
        let beside = self.place[neighbour];
        // Counted without the weed.
        let slot = beside - usize::from(beside > place) + usize::from(uniform(rng) < 0.5);
        if slot == place {
            return;
        }
        let without = |at: usize| at + usize::from(at >= place);
        let weed = self.nodes[node].weed.expect("weeds are moved");
        let prior = match slot.checked_sub(1) {
            Some(before) => self.nodes[self.order[without(before)]].spot,
            None => self.start,
        };
        let follower = self.order.get(without(slot)).copied();
        let spot = self.nodes[node].spot;
        let direction = match below(4, rng) {
            0 => (spot.cos, spot.sin),
            1 => {
                let beside = self.nodes[neighbour].spot;
                (beside.cos, beside.sin)
            }
            2 => towards((prior.x_m, prior.y_m), (weed.x_m, weed.y_m)),
            _ => follower.map_or((spot.cos, spot.sin), |follower| {
                let after = self.nodes[follower].spot;
                towards((prior.x_m, prior.y_m), (after.x_m, after.y_m))
            }),
        };
        let moved = Node::turned(&weed, weed.left_m, direction);
        let next = self.order.get(place + 1).copied();
        let closed_m = next.map(|next| self.leg_m(self.before(place), &self.nodes[next].spot));
        let to_m = self.leg_m(&prior, &moved.spot);
        let from_m = follower.map(|follower| self.leg_m(&moved.spot, &self.nodes[follower].spot));
        let longer_m = to_m - self.legs_m[node]
            + next.zip(closed_m).map_or(0.0, |(next, closed_m)| closed_m - self.legs_m[next])
            + follower.zip(from_m).map_or(0.0, |(follower, from_m)| from_m - self.legs_m[follower]);
        if !self.accepts(longer_m, heat_m, rng) {
            return;
        }
        self.nodes[node] = moved;
        if let Some((next, closed_m)) = next.zip(closed_m) {
            self.legs_m[next] = closed_m;
        }
        self.legs_m[node] = to_m;
        if let Some((follower, from_m)) = follower.zip(from_m) {
            self.legs_m[follower] = from_m;
        }
        if slot > place {
            self.order[place..=slot].rotate_left(1);
        } else {
            self.order[slot..=place].rotate_right(1);
        }
        self.number(place.min(slot), place.max(slot));
    }

    /// Writes the places of the nodes from one place to another.
    fn number(&mut self, first: usize, last: usize) {
        for place in first..=last {
            self.place[self.order[place]] = place;
        }
    }

    /// Whether there are only weeds between two places, both included.
    fn are_weeds(&self, first: usize, last: usize) -> bool {
        self.order[first..=last].iter().all(|&node| self.nodes[node].weed.is_some())
    }

    /// Passes a run of weeds the other way round, so that a weed and its neighbour come to lie next to each other.
    fn reverse(&mut self, node: usize, heat_m: f32, rng: &mut StreamRng) {
        let Some(neighbour) = self.neighbour(node, rng) else { return };
        let (one, other) = (self.place[node], self.place[neighbour]);
        let (first, last) = if one < other { (one + 1, other) } else { (other, one - 1) };
        if first > last || last - first >= LONGEST_REVERSAL || !self.are_weeds(first, last) {
            return;
        }
        let (from, to) = (self.order[first], self.order[last]);
        let entry = self.nodes[to].reversed();
        let to_m = self.leg_m(self.before(first), &entry.spot);
        let next = self.order.get(last + 1).copied();
        let exit = self.nodes[from].reversed();
        let from_m = next.map(|next| self.leg_m(&exit.spot, &self.nodes[next].spot));
        // The legs between are as long the other way.
        let longer_m = to_m - self.legs_m[from]
            + next.zip(from_m).map_or(0.0, |(next, from_m)| from_m - self.legs_m[next]);
        if !self.accepts(longer_m, heat_m, rng) {
            return;
        }
        self.turn_round(first, last);
        self.legs_m[to] = to_m;
        if let Some((next, from_m)) = next.zip(from_m) {
            self.legs_m[next] = from_m;
        }
    }

    /// Reverses the order between two places, and the directions there; the leg to the first one is left to be measured.
    fn turn_round(&mut self, first: usize, last: usize) {
        // The leg to a node becomes the leg to the one before it.
        for place in first..last {
            self.legs_m[self.order[place]] = self.legs_m[self.order[place + 1]];
        }
        self.order[first..=last].reverse();
        for place in first..=last {
            let node = self.order[place];
            self.nodes[node] = self.nodes[node].reversed();
            self.place[node] = place;
        }
    }

    /// Moves a run of weeds, either way round, to before or after a neighbour of its first one.
    fn move_run(&mut self, node: usize, heat_m: f32, rng: &mut StreamRng) {
        let Some(neighbour) = self.neighbour(node, rng) else { return };
        let first = self.place[node];
        let last = first + 1 + below(LONGEST_MOVE - 1, rng);
        let beside = self.place[neighbour];
        if last >= self.order.len()
            || (first..=last).contains(&beside)
            || !self.are_weeds(first, last)
        {
            return;
        }
        let is_reversed = uniform(rng) < 0.5;
        let count = last - first + 1;
        // Counted without the run.
        let slot = beside - if beside > last { count } else { 0 } + usize::from(uniform(rng) < 0.5);
        if slot == first {
            return;
        }
        let without = |at: usize| at + if at >= first { count } else { 0 };
        let prior = match slot.checked_sub(1) {
            Some(before) => self.nodes[self.order[without(before)]].spot,
            None => self.start,
        };
        let follower = self.order.get(without(slot)).copied();
        let (head, tail) = (self.order[first], self.order[last]);
        let (entry, exit) = if is_reversed {
            (self.nodes[tail].reversed(), self.nodes[head].reversed())
        } else {
            (self.nodes[head], self.nodes[tail])
        };
        let next = self.order.get(last + 1).copied();
        let closed_m = next.map(|next| self.leg_m(self.before(first), &self.nodes[next].spot));
        let to_m = self.leg_m(&prior, &entry.spot);
        let from_m = follower.map(|follower| self.leg_m(&exit.spot, &self.nodes[follower].spot));
        let longer_m = to_m - self.legs_m[head]
            + next.zip(closed_m).map_or(0.0, |(next, closed_m)| closed_m - self.legs_m[next])
            + follower.zip(from_m).map_or(0.0, |(follower, from_m)| from_m - self.legs_m[follower]);
        if !self.accepts(longer_m, heat_m, rng) {
            return;
        }
        if is_reversed {
            self.turn_round(first, last);
        }
        let entry = self.order[first];
        if let Some((next, closed_m)) = next.zip(closed_m) {
            self.legs_m[next] = closed_m;
        }
        self.legs_m[entry] = to_m;
        if let Some((follower, from_m)) = follower.zip(from_m) {
            self.legs_m[follower] = from_m;
        }
        if slot > first {
            self.order[first..slot + count].rotate_left(count);
        } else {
            self.order[slot..=last].rotate_right(count);
        }
        self.number(first.min(slot), last.max(slot + count - 1));
    }
}

/// By what to multiply so many times to come from one number to a lower one, nearly: the system's power function rounds
/// differently elsewhere.
pub(super) fn cooling(from: f32, to: f32, times: usize) -> f32 {
    (1.0 - single(math::ln((from / to).into())) / times as f32).max(0.0)
}

/// A number that is spread like a bell with a standard deviation of 1, but no farther than 3.
pub(super) fn bell(rng: &mut StreamRng) -> f32 {
    // The sum of twelve even numbers, four of them from each draw.
    let mut sum = 0.0;
    for _ in 0..3 {
        let drawn = bits(rng);
        for part in 0..4 {
            sum += f32::from(u16::try_from(drawn >> (16 * part) & 0xffff).expect("16 bits"));
        }
    }
    sum / 65_536.0 - 6.0
}

/// The direction from one point to another, or along x if they are the same.
fn towards(from: (f32, f32), to: (f32, f32)) -> (f32, f32) {
    let (x_m, y_m) = (to.0 - from.0, to.1 - from.1);
    let distance_m = (x_m * x_m + y_m * y_m).sqrt();
    if distance_m > 0.0 { (x_m / distance_m, y_m / distance_m) } else { (1.0, 0.0) }
}
