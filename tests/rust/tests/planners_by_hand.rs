//! The planners' rules one by one, on views drawn by hand: what a planner knows changes only where a test says so, and the
//! mower goes exactly where it is told. No sensor and no deck are involved.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use swath_agents::agent::{Agent, Decision};
use swath_agents::registry::AgentSpec;
use swath_core::config::Scenario;
use swath_core::env::Env;
use swath_core::geometry::{Arc, Frame, Point, Pose};
use swath_core::known::{KnownWeed, KnownWeeds};
use swath_core::view::View;

/// A planner on the default pasture, 100 m by 40 m: B = R = 2 m, and 12 m of sight in depth and width.
struct Desk {
    env: Env,
    agent: Box<dyn Agent>,
    known: KnownWeeds,
    pose: Pose,
    path_m: f64,
}

impl Desk {
    fn of(name: &str) -> Self {
        let mut env = Env::new(&Scenario::default().check().unwrap());
        env.lift_limits();
        env.reset(0);
        let mut agent = name.parse::<AgentSpec>().unwrap().build(0);
        let (known, pose) = (KnownWeeds::none(100.0, 40.0), env.view().pose);
        agent.reset(&View { known_weeds: &known, weeds_detected: 0, ..env.view() });
        Self { env, agent, known, pose, path_m: 0.0 }
    }

    fn learn(&mut self, x_m: f64, y_m: f64) {
        let number = u32::try_from(self.known.len()).unwrap();
        self.known.add(KnownWeed { number, position: Point::new(x_m, y_m) });
    }

    /// Carries out the next decision; `None` at the planner's end.
    fn go(&mut self) -> Option<Decision> {
        let Frame { cos, sin, .. } = self.pose.into();
        let view = View {
            pose: self.pose,
            direction: (cos, sin),
            path_m: self.path_m,
            known_weeds: &self.known,
            weeds_detected: u32::try_from(self.known.len()).unwrap(),
            ..self.env.view()
        };
        let decision = self.agent.act(&view);
        let Decision::Drive(command) = decision else { return Some(decision) };
        let arc = Arc {
            start: self.pose,
            curvature_per_m: command.curvature_per_m,
            length_m: command.distance_m,
        };
        self.pose = arc.end();
        self.path_m += command.distance_m;
        None
    }

    /// Drives until the mower is within a piece of the beginning of the pass at that height.
    fn go_to_pass(&mut self, y_m: f64) {
        for _ in 0..20_000 {
            let Pose { x_m, y_m: at_y_m, heading_rad } = self.pose;
            let has_begun = if heading_rad.abs() < 1.0 { x_m < 0.5 } else { x_m > 99.5 };
            let is_level = heading_rad.sin().abs() < 1e-6;
            if has_begun && is_level && (at_y_m - y_m).abs() < 1e-6 {
                return;
            }
            assert_eq!(self.go(), None, "the pass at {y_m} m comes before the end");
        }
        panic!("no pass at {y_m} m");
    }

    /// Drives to the end of a pass; returns the first of some places at which a piece of the path has ended.
    fn first_reached(&mut self, places: &[(f64, f64)]) -> Option<(f64, f64)> {
        let begun_m = self.path_m;
        while self.path_m < begun_m + 90.0 {
            assert_eq!(self.go(), None);
            let is_here = |&&(x_m, y_m): &&(f64, f64)| {
                (self.pose.x_m - x_m).hypot(self.pose.y_m - y_m) < 1e-6
            };
            if let Some(&place) = places.iter().find(is_here) {
                return Some(place);
            }
        }
        None
    }
}

#[test]
fn r_snake_leaves_weeds_more_than_one_and_a_half_sensor_widths_below_its_pass() {
    // Equation (5) of Maini, Gonultas & Isler (2022): below 29 m the border is at 11 m.
    for (name, y_m, is_visited) in [
        ("r-snake", 11.05, true),
        ("r-snake", 10.95, false),
        ("snake", 11.05, true),
        ("snake", 10.95, true),
    ] {
        let mut desk = Desk::of(name);
        desk.go_to_pass(29.0);
        desk.learn(50.0, y_m);
        let visited = desk.first_reached(&[(50.0, y_m)]);
        assert_eq!(visited.is_some(), is_visited, "{name}, a weed at {y_m} m");
    }
}

#[test]
fn snake_takes_the_next_weed_along_the_pass_however_far_across_it_is() {
    for name in ["snake", "r-snake"] {
        for weeds in [[(30.0, 30.0), (31.0, 2.0)], [(31.0, 2.0), (30.0, 30.0)]] {
            let mut desk = Desk::of(name);
            for (x_m, y_m) in weeds {
                desk.learn(x_m, y_m);
            }
            assert_eq!(desk.first_reached(&weeds), Some((30.0, 30.0)), "{name}");
        }
    }
}

#[test]
fn snake_gives_up_after_forty_passes_on_which_it_mows_nothing() {
    let mut desk = Desk::of("snake");
    desk.learn(50.0, 20.0);
    let mut passes = 0;
    let end = loop {
        let was_turning = desk.pose.heading_rad.sin().abs() > 1e-6;
        if let Some(end) = desk.go() {
            break end;
        }
        // A turn ends at the border, where a pass begins.
        let is_level = desk.pose.heading_rad.sin().abs() < 1e-6;
        let is_at_border = desk.pose.x_m.abs() < 1e-6 || (desk.pose.x_m - 100.0).abs() < 1e-6;
        passes += usize::from(was_turning && is_level && is_at_border);
    };
    // The first pass begins without a turn.
    assert_eq!((end, 1 + passes), (Decision::Capped, 40));
}

#[test]
fn jump_takes_the_nearest_of_the_weeds_that_it_has_to_jump_for_now() {
    // Both jumps start on the piece that begins at 6 m: 4.0 m ahead of a weed 3 m above, where sqrt(3 x 5) = 3.87 m are needed,
    // and 4.1 m ahead of one 5 m above, where 2 R = 4 m are.
    for weeds in [[(10.0, 4.0), (10.1, 6.0)], [(10.1, 6.0), (10.0, 4.0)]] {
        let mut desk = Desk::of("jump");
        for (x_m, y_m) in weeds {
            desk.learn(x_m, y_m);
        }
        assert_eq!(desk.first_reached(&weeds), Some((10.0, 4.0)));
    }
}

#[test]
fn jump_stays_on_its_pass_while_a_known_weed_lies_under_the_rest_of_it() {
    for (under, is_visited) in [(Some((90.0, 1.5)), false), (None, true)] {
        let mut desk = Desk::of("jump");
        desk.learn(10.0, 4.0);
        if let Some((x_m, y_m)) = under {
            desk.learn(x_m, y_m);
        }
        assert_eq!(desk.first_reached(&[(10.0, 4.0)]).is_some(), is_visited, "{under:?}");
    }
}

#[test]
fn the_next_pass_of_jump_is_half_a_sensor_width_higher_or_as_low_as_a_known_weed_needs() {
    // Equation (1): 1 + 6 m; a weed at 3 m is under the bar's lower end from 4 m.
    for (weed_y_m, pass_y_m) in [(39.0, 7.0), (3.0, 4.0)] {
        let mut desk = Desk::of("jump");
        while desk.pose.x_m < 50.0 {
            assert_eq!(desk.go(), None);
        }
        desk.learn(10.0, weed_y_m);
        desk.go_to_pass(pass_y_m);
    }
}

#[test]
fn jump_goes_down_again_for_a_weed_that_it_learns_of_on_its_last_pass() {
    // Equation (2) asks for the top and for no known weed.
    let mut desk = Desk::of("jump");
    desk.go_to_pass(39.0);
    desk.learn(50.0, 20.0);
    desk.go_to_pass(21.0);
}
