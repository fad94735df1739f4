//! `learned`: a trained network chooses where to go next.

mod network;

use swath_core::config::ActionConfig;
use swath_core::observation::CandidateEncoder;
use swath_core::view::View;

use crate::agent::{Agent, Decision};
use crate::pursuit::Pursuit;

pub use network::Network;

/// Budget of the trainings, in boustrophedon paths: it scales a column of the table.
const BUDGET: f64 = 4.0;

/// A policy for the places of the action kind `target`, trained by `make train-learned`.
///
/// It sees the table of the observation `candidates` and takes the place with the highest score. Where that has brought
/// nothing for longer than the pasture is long and wide, it goes on with the search until something new is seen or mowed, so
/// that it ends wherever the search does.
#[derive(Debug, Default)]
pub struct Learned {
    state: Option<State>,
}

#[derive(Debug)]
struct State {
    pursuit: Pursuit,
    encoder: CandidateEncoder,
    table: Vec<f32>,
    /// Weeds known and ground unseen when something last changed, and the way driven until then, metres.
    progress: (usize, usize),
    progress_m: f64,
}

impl Learned {
    /// The policy that is shipped.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl State {
    fn choose(&mut self, view: &View) {
        let candidates = self.pursuit.candidates(view);
        let rows = candidates.rows();
        let progress = (view.known_weeds.len(), view.ground.unseen_count());
        if progress != self.progress {
            (self.progress, self.progress_m) = (progress, view.path_m);
        }
        let patience_m = view.site.length_m + view.site.width_m;
        let place = if view.path_m - self.progress_m > patience_m {
            rows.len() - 1
        } else {
            self.encoder.encode(view, candidates, &mut self.table);
            Network::shipped().best(&self.table)
        };
        self.pursuit.choose(place, view);
    }
}

impl Agent for Learned {
    fn reset(&mut self, view: &View) {
        let config = ActionConfig::default();
        let rows = config.candidates();
        self.state = Some(State {
            pursuit: Pursuit::new(&config, view),
            encoder: CandidateEncoder::flat(rows, BUDGET * view.site.bcp_length_m),
            table: vec![0.0; rows * Network::shipped().columns()],
            progress: (0, 0),
            progress_m: 0.0,
        });
    }

    fn act(&mut self, view: &View) -> Decision {
        if Pursuit::is_over(view) {
            return Decision::Done;
        }
        let state = self.state.as_mut().expect("an episode has begun");
        if let Some(command) = state.pursuit.next(view) {
            return Decision::Drive(command);
        }
        state.choose(view);
        Decision::Drive(state.pursuit.next(view).expect("every way is longer than nothing"))
    }
}
