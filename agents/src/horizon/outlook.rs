//! How long the way will be, by the weeds that are likely on the ground that is still open.

use swath_core::geometry::Point;
use swath_core::rng::{agent_rng, below};
use swath_core::site::Site;

use super::HorizonOptions;
use super::anneal::anneal;
use super::deadline::Deadline;
use super::open::OpenGround;
use super::plan::Plan;

/// What is planned once is longer than what is planned over and over, as the mower does: this share of it remains.
const REMAINS: f32 = 0.88;
/// Most weeds that are imagined.
const MOST: usize = 1_000;

/// Length of the plan if it also passes weeds imagined on the open ground, as many to a cell as the `detected` ones.
pub(super) fn length_m(
    plan: &Plan,
    ground: &OpenGround,
    detected: u32,
    until: Option<Deadline>,
    options: &HorizonOptions,
    site: &Site,
) -> f32 {
    let mut rng = agent_rng(2);
    let mut plan = plan.clone();
    let open = ground.open_centres();
    let settled = ground.settled_share();
    let unknown = f64::from(detected) * f64::from((1.0 - settled) / settled);
    let unknown = swath_core::math::floor_index(unknown).min(MOST);
    for weed in 0..unknown.min(open.len()) {
        let (x_m, y_m) = open[below(open.len(), &mut rng)];
        let number = u32::MAX - u32::try_from(weed).expect("few are imagined");
        plan.insert_weed(number, Point::new(x_m.into(), y_m.into()), options.reach_m(site));
    }
    let rounds = options.rounds(plan.nodes.len());
    anneal(&mut plan, options.reach_m(site), rounds, until, &mut rng);
    REMAINS * plan.length_m()
}
