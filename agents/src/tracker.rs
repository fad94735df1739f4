//! Following a planner's path with one curvature a control period: how planners act through `steer`.

use swath_core::action::Command;
use swath_core::geometry::{Arc, BarSweep, Pose};
use swath_core::known::KnownWeeds;
use swath_core::site::Site;
use swath_core::view::View;

use crate::agent::{Agent, Decision, PIECE_M};

/// Share of the deck that tracking may miss on either side of a planned path, metres: the default margin.
pub const TRACKING_MARGIN_M: f64 = 0.1;
/// Planned way ahead of the mower that the tracker aims at, metres.
const AIM_M: f64 = 1.0;
/// Spacing of the points of the planned path, metres.
const POINT_SPACING_M: f64 = 0.05;
/// Way after which a weed that the plan has passed but the deck has missed counts as known again, metres.
const MISSED_AFTER_M: f64 = 1.0;

/// An agent that lets a planner drive a ghost some way ahead and steers the mower after it, one curvature a control period.
///
/// The planner is asked as if the mower stood where the ghost stands; what it knows is what the mower has seen. Its deck is
/// narrower than the mower's by `margin_m` on either side, so that a path followed within the margin mows what was planned.
/// The mower aims at the point 1 m ahead on the planned path: pure pursuit (Coulter, 1992), exact on circles and straights.
pub struct Tracker {
    planner: Box<dyn Agent>,
    margin_m: f64,
    ghost: Option<Ghost>,
}

/// Where the plan has got to.
struct Ghost {
    pose: Pose,
    path_m: f64,
    is_done: bool,
    /// Points of the planned path with the way to each, and the index of the one nearest to the mower.
    points: Vec<(Pose, f64)>,
    nearest: usize,
    /// Weeds that the plan has mowed, and how far along it.
    mowed: Vec<(u32, f64)>,
    /// Known weeds as the planner sees them; how many had been detected, and struck out, when they were last brought up to date.
    known: KnownWeeds,
    weeds_detected: u32,
    struck_out: usize,
}

impl Ghost {
    fn at(pose: Pose, site: &Site) -> Self {
        Self {
            pose,
            path_m: 0.0,
            is_done: false,
            points: vec![(pose, 0.0)],
            nearest: 0,
            mowed: Vec::new(),
            known: KnownWeeds::none(site.length_m, site.width_m),
            weeds_detected: 0,
            struck_out: 0,
        }
    }

    /// Moves along an arc; weeds under the planned bar count as mowed by the plan.
    fn follow(&mut self, arc: &Arc, deck_width_m: f64) {
        let pieces = swath_core::math::floor_index((arc.length_m / POINT_SPACING_M).ceil()).max(1);
        let piece_m = arc.length_m / pieces as f64;
        for piece in 0..pieces {
            let start = arc.at(piece_m * piece as f64);
            let end_m = self.path_m + piece_m * (piece + 1) as f64;
            let sweep = BarSweep::new(&Arc { start, length_m: piece_m, ..*arc }, deck_width_m);
            let (known, mowed) = (&self.known, &mut self.mowed);
            known.for_each_near(start.position(), 0.5 * deck_width_m + 2.0 * piece_m, |weed| {
                mowed.extend(sweep.contains(weed.position).then_some((weed.number, end_m)));
            });
            self.points.push((arc.at(piece_m * (piece + 1) as f64), end_m));
        }
        self.pose = arc.end();
        self.path_m += arc.length_m;
        for (number, _) in &self.mowed {
            self.known.remove(*number);
        }
    }

    /// Finds the point nearest to the mower, from the last one onwards.
    fn locate(&mut self, mower: Pose) {
        let distance_m = |point: &(Pose, f64)| point.0.distance_to(&mower);
        while let Some(next) = self.points.get(self.nearest + 1)
            && distance_m(next) <= distance_m(&self.points[self.nearest])
        {
            self.nearest += 1;
        }
    }

    /// Way from the start of the plan to the point nearest to the mower, metres.
    fn followed_m(&self) -> f64 {
        self.points[self.nearest].1
    }

    /// The point `ahead_m` further along the plan than the mower, or its end.
    fn aim(&self, ahead_m: f64) -> Pose {
        let aim_m = self.followed_m() + ahead_m;
        let beyond = self.points[self.nearest..].partition_point(|&(_, path_m)| path_m < aim_m);
        self.points[(self.nearest + beyond).min(self.points.len() - 1)].0
    }

    /// What the planner knows: weeds that the mower knows, less those that the plan has mowed, unless in vain.
    fn update_known(&mut self, view: &View) {
        let followed_m = self.followed_m();
        let removed = view.known_weeds.removed();
        // Seldom has everything to be listed anew: where the deck has missed a weed, or another state was put back.
        let mut is_outdated =
            removed.len() < self.struck_out || view.weeds_detected < self.weeds_detected;
        self.mowed.retain(|&(number, path_m)| {
            let is_to_come = followed_m < path_m + MISSED_AFTER_M;
            is_outdated |= !is_to_come && view.known_weeds.holds(number);
            is_to_come
        });
        if is_outdated {
            self.known.clear();
            (self.weeds_detected, self.struck_out) = (0, 0);
        }
        removed[self.struck_out..].iter().for_each(|&number| self.known.remove(number));
        let is_planned = |number| self.mowed.iter().any(|&(mowed, _)| mowed == number);
        let news = view.known_weeds.since(self.weeds_detected);
        news.filter(|weed| !is_planned(weed.number)).for_each(|weed| self.known.add(weed));
        (self.weeds_detected, self.struck_out) = (view.weeds_detected, removed.len());
    }
}

impl Tracker {
    /// `planner`, tracked with `margin_m` of the deck to spare on either side.
    #[must_use]
    pub fn new(planner: Box<dyn Agent>, margin_m: f64) -> Self {
        Self { planner, margin_m, ghost: None }
    }

    /// The scenario's numbers as the planner is told them: with a narrower deck.
    fn planned_site(&self, site: &Site) -> Site {
        let deck_width_m = (site.deck_width_m - 2.0 * self.margin_m).max(0.5 * site.deck_width_m);
        Site { deck_width_m, ..*site }
    }

    /// Lets the ghost go on until it is far enough ahead.
    fn plan_ahead(&mut self, ghost: &mut Ghost, view: &View) {
        let site = self.planned_site(view.site);
        let wanted_m = AIM_M + view.site.control_distance_m;
        while !ghost.is_done && ghost.path_m < ghost.followed_m() + wanted_m {
            let Ghost { pose, path_m, ref known, .. } = *ghost;
            let planned = View { site: &site, pose, path_m, known_weeds: known, ..*view };
            let arc = match self.planner.act(&planned) {
                Decision::Drive(Command { curvature_per_m, distance_m }) => {
                    Arc { start: pose, curvature_per_m, length_m: distance_m.min(PIECE_M) }
                }
                Decision::Done | Decision::Capped => {
                    // A straight end, so that the deck passes over the last weed.
                    ghost.is_done = true;
                    Arc { start: pose, curvature_per_m: 0.0, length_m: AIM_M }
                }
            };
            ghost.follow(&arc, site.deck_width_m);
        }
    }
}

impl Agent for Tracker {
    fn start(&self, site: &Site) -> Option<Pose> {
        self.planner.start(&self.planned_site(site))
    }

    fn reset(&mut self, view: &View) {
        let site = self.planned_site(view.site);
        self.ghost = Some(Ghost::at(view.pose, &site));
        self.planner.reset(&View { site: &site, ..*view });
    }

    fn act(&mut self, view: &View) -> Decision {
        let mut ghost = self.ghost.take().unwrap_or_else(|| Ghost::at(view.pose, view.site));
        ghost.locate(view.pose);
        ghost.update_known(view);
        self.plan_ahead(&mut ghost, view);
        let is_followed = ghost.is_done && ghost.path_m <= ghost.followed_m() + 0.5 * AIM_M;
        let aim = ghost.aim(AIM_M);
        self.ghost = Some(ghost);
        if is_followed {
            return Decision::Done;
        }
        let to_aim = view.pose.world_from_mower().inverse_transform_point(&aim.position());
        let limit_per_m = 1.0 / view.site.turning_radius_m;
        let near_m2 = POINT_SPACING_M * POINT_SPACING_M;
        let curvature_per_m = 2.0 * to_aim.y / to_aim.coords.norm_squared().max(near_m2);
        Decision::Drive(Command {
            curvature_per_m: curvature_per_m.clamp(-limit_per_m, limit_per_m),
            distance_m: view.site.control_distance_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use swath_core::config::Scenario;
    use swath_core::env::Env;
    use swath_core::known::KnownWeed;
    use swath_core::rng::agent_rng;

    use super::*;
    use crate::routing::Snake;

    /// Now and then the mower does something else than the tracker says, so that weeds of the plan are missed; or it is put
    /// back to where it was.
    #[test]
    fn the_planner_is_told_of_all_known_weeds_but_those_that_the_plan_has_just_mowed() {
        let mut scenario = Scenario::default();
        scenario.weeds.count = 640;
        let mut env = Env::new(&scenario.check().unwrap());
        env.lift_limits();
        env.reset(0);
        let mut tracker = Tracker::new(Box::new(Snake::new()), TRACKING_MARGIN_M);
        tracker.reset(&env.view());
        let mut rng = agent_rng(0);
        let (mut before, mut missed, mut strayed) = (None, 0, 0);
        for step in 0..3000 {
            let planned: Vec<u32> = tracker.ghost.iter().flat_map(Ghost::planned).collect();
            let points = tracker.ghost.as_ref().unwrap().points.len();
            let Decision::Drive(mut command) = tracker.act(&env.view()) else { break };
            let ghost = tracker.ghost.as_ref().unwrap();
            let still_planned: Vec<u32> = ghost.planned().collect();
            let is_told = |weed: &KnownWeed| !still_planned.contains(&weed.number);
            assert!(ghost.known.iter().eq(env.view().known_weeds.iter().filter(is_told)), "{step}");
            // Nor of any that the plan's bar, two metres less the margins wide, has passed over in this step.
            for (pose, _) in &ghost.points[points..] {
                let is_under = |weed: KnownWeed| {
                    let at = pose.world_from_mower().inverse_transform_point(&weed.position);
                    (-0.02..=0.0).contains(&at.x) && at.y.abs() < 0.8
                };
                assert!(!ghost.known.iter().any(is_under), "{step}");
            }
            let told_again = |number: &&u32| ghost.known.holds(**number);
            missed += planned.iter().filter(told_again).count();
            if step % 100 > 90 {
                command.curvature_per_m = swath_core::rng::uniform(&mut rng) - 0.5;
                strayed += 1;
            }
            env.drive(command).unwrap();
            match step % 50 {
                0 => before = Some(env.snapshot()),
                3 => env.restore(before.as_ref().unwrap()).unwrap(),
                _ => {}
            }
        }
        assert!(missed > 10 && strayed > 100, "{missed} weeds missed, {strayed} steps astray");
    }

    impl Ghost {
        fn planned(&self) -> impl Iterator<Item = u32> {
            self.mowed.iter().map(|&(number, _)| number)
        }
    }
}
