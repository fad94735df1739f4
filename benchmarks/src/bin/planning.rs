//! How long `horizon` thinks: the time of each plan and of whole episodes, with its own options; `make bench-planning` runs it.
//!
//! Times are those of the one thread that plans, as the system counts them, so that others who use the machine lengthen them little.
//! The first episode of a process also makes the plan with which each episode on that pasture begins.

use rustix::time::{ClockId, clock_gettime};
use swath_agents::agent::{Agent, Decision};
use swath_agents::horizon::{Horizon, HorizonOptions};
use swath_agents::runner::run_agent;
use swath_benchmarks::scenario;
use swath_core::env::Env;
use swath_core::view::View;

/// Weeds on the pasture, and its headland, metres.
const CASES: [(u32, f64); 9] = [
    (40, f64::INFINITY),
    (20, f64::INFINITY),
    (80, f64::INFINITY),
    (160, f64::INFINITY),
    (320, f64::INFINITY),
    (640, f64::INFINITY),
    (40, 10.0),
    (40, 4.0),
    (40, 2.0),
];
/// Instances, unless the command says how many; at least two, since the first of a process takes longer.
const INSTANCES: u64 = 3;

/// An agent whose plans are timed.
struct Timed {
    horizon: Horizon,
    plans_s: Vec<f64>,
}

impl Agent for Timed {
    fn reset(&mut self, view: &View) {
        self.horizon.reset(view);
    }

    fn act(&mut self, view: &View) -> Decision {
        let (plans, began_s) = (self.horizon.plans(), now_s());
        let decision = self.horizon.act(view);
        if self.horizon.plans() > plans {
            self.plans_s.push(now_s() - began_s);
        }
        decision
    }
}

/// Time that this thread has run, seconds.
fn now_s() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The value below which so many per cent of sorted values lie.
fn quantile(sorted: &[f64], percent: usize) -> f64 {
    let place = (percent * sorted.len()).div_ceil(100);
    sorted[place.clamp(1, sorted.len()) - 1]
}

#[expect(clippy::print_stdout, reason = "this is a program")]
fn main() {
    let instances = std::env::args().nth(1);
    let instances =
        instances.map_or(INSTANCES, |text| text.parse().expect("a number of instances")).max(2);
    println!(
        "horizon, default options, 100 x 40 m, weeds spread evenly, instances 0 to {}",
        instances - 1
    );
    println!(
        "| weeds | headland, m | plans an episode | median, ms | p99, ms | longest, ms | first episode, s | mean of the others, s |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (count, headland_m) in CASES {
        let overlay = format!("pasture.headland_m = {headland_m}\nweeds.count = {count}");
        let scenario = scenario(&overlay);
        let mut agent =
            Timed { horizon: Horizon::new(HorizonOptions::default()), plans_s: Vec::new() };
        let episodes_s: Vec<f64> = (0..instances)
            .map(|seed| {
                let began_s = now_s();
                run_agent(&mut Env::new(&scenario), &mut agent, seed, None, |_| ());
                now_s() - began_s
            })
            .collect();
        let mut plans_s = agent.plans_s;
        plans_s.sort_by(f64::total_cmp);
        let [median, p99, longest] = [50, 99, 100].map(|percent| 1e3 * quantile(&plans_s, percent));
        let plans = plans_s.len() as f64 / instances as f64;
        let others = episodes_s[1..].iter().sum::<f64>() / (instances - 1) as f64;
        println!(
            "| {count} | {headland_m:?} | {plans:.0} | {median:.1} | {p99:.1} | {longest:.1} | {:.2} | {others:.2} |",
            episodes_s[0]
        );
    }
}
