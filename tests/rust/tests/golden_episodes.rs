//! Episodes as committed in `tests/rust/golden`: one of each planner arc by arc, and the lengths of others.
//! `make test-rust GOLDEN=1` rewrites them.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::fmt::Write as _;
use std::path::Path;

use swath_agents::runner::{run_episode, run_summary};
use swath_core::config::Document;
use swath_tests::agents;

#[test]
fn an_episode_of_each_planner_is_as_it_was() {
    let scenario = Document::open("cowbot-field").unwrap().scenario().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    for name in agents::quick() {
        let episode = run_episode(&scenario, &name.parse().unwrap(), 0, None);
        let mut text = format!(
            "# {} on cowbot-field, instance 0: {:.6} m, {} of {} weeds mowed, {}\n",
            name,
            episode.summary.path_length_m,
            episode.summary.weeds_mowed,
            episode.summary.weeds_total,
            episode.outcome.name()
        );
        text.push_str("#     x_m       y_m heading_rad curvature_per_m  length_m\n");
        for arc in episode.trajectory.arcs() {
            let [x_m, y_m] = [arc.start.x_m, arc.start.y_m].map(positive_zero);
            let heading_rad = positive_pi(positive_zero(arc.start.heading_rad));
            let curvature_per_m = positive_zero(arc.curvature_per_m);
            writeln!(
                text,
                "{x_m:9.5} {y_m:9.5} {heading_rad:11.6} {curvature_per_m:15.6} {:9.5}",
                arc.length_m
            )
            .unwrap();
        }
        let file = folder.join(format!("{}.txt", name.split(':').next().unwrap_or(name)));
        compare(&file, &text);
    }
}

/// The field has few weeds. Among more, rules come into play that it does not need.
#[test]
fn episodes_on_the_pasture_are_as_long_as_they_were() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/pasture.txt");
    let mut text = String::from("# agent weeds seed path_length_m weeds_mowed outcome\n");
    for count in [20, 80, 320] {
        let mut document = Document::open("pasture").unwrap();
        document.overlay(format!("weeds.count = {count}").parse().unwrap());
        let scenario = document.scenario().unwrap();
        for name in ["bcp", "bcp-tsp", "react", "jump", "snake", "r-snake", "greedy"] {
            for seed in 6..10 {
                let (summary, outcome) = run_summary(&scenario, &name.parse().unwrap(), seed);
                let (length_m, mowed) = (summary.path_length_m, summary.weeds_mowed);
                let outcome = outcome.name();
                writeln!(text, "{name} {count} {seed} {length_m:.4} {mowed} {outcome}").unwrap();
            }
        }
    }
    compare(&file, &text);
}

/// Compares with a committed file, or writes it.
fn compare(file: &Path, text: &str) {
    if std::env::var_os("GOLDEN").is_some() {
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, text).unwrap();
    }
    let golden = std::fs::read_to_string(file).unwrap_or_default();
    let first = text.lines().zip(golden.lines()).find(|(now, was)| now != was);
    assert!(
        text == golden,
        "{} has changed, first {first:?}; look at it with `make test-rust GOLDEN=1` and git diff",
        file.display()
    );
}

/// The same number without the sign of a rounded zero.
fn positive_zero(value: f64) -> f64 {
    if value.abs() < 5e-7 { 0.0 } else { value }
}

/// Half a circle to the left, where rounding decides between left and right.
fn positive_pi(heading_rad: f64) -> f64 {
    if heading_rad < -std::f64::consts::PI + 5e-7 { std::f64::consts::PI } else { heading_rad }
}
