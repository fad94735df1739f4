//! The six planners against what is known of them: closed forms, statements of Maini, Gonultas & Isler (2022), and the means of
//! a second simulator of the same rules that shares no code with this one.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use swath_agents::registry::AgentSpec;
use swath_agents::runner::{run_episode, run_summary};
use swath_core::config::{Document, ValidScenario};
use swath_core::env::Summary;
use swath_core::geometry::Point;

fn open(name: &str, overlay: &str) -> ValidScenario {
    let mut document = Document::open(name).unwrap();
    document.overlay(overlay.parse().unwrap());
    document.scenario().unwrap()
}

fn agent(name: &str) -> AgentSpec {
    name.parse().unwrap()
}

#[test]
fn bcp_is_as_long_as_its_closed_form_and_mows_everything() {
    // n L + (n - 1) R (pi + 4 acos((2R + B) / 4R)); the paper prints 897 m for the field.
    for (name, length_m) in [("cowbot-field", 897.519), ("pasture", 2229.236)] {
        let episode = run_episode(&open(name, ""), &agent("bcp"), 0, None);
        assert!(
            (episode.summary.path_length_m - length_m).abs() < 1e-3,
            "{name}: {:?}",
            episode.summary
        );
        assert_eq!(episode.summary.weeds_mowed, episode.summary.weeds_total);
    }
    for (radius_m, length_m) in [(1.0, 2059.690), (3.0, 2370.834), (4.0, 2511.043), (5.0, 2650.823)]
    {
        let scenario = open("pasture", &format!("mower.turning_radius_m = {radius_m:.1}"));
        let (summary, _) = run_summary(&scenario, &agent("bcp"), 0);
        assert!((summary.path_length_m - length_m).abs() < 1e-3, "R = {radius_m}: {summary:?}");
    }
}

#[test]
fn the_search_sweep_is_as_long_as_its_closed_form() {
    // ceil(W / S_w) passes and half circles with a straight between: 4 L + 3 (pi R + S_w - 2R), and the like for the field.
    for (name, length_m) in [("pasture", 442.850), ("cowbot-field", 135.425)] {
        let (summary, _) = run_summary(&open(name, ""), &agent("bcp:spacing=sensor"), 0);
        assert!((summary.path_length_m - length_m).abs() < 1e-3, "{name}: {summary:?}");
    }
}

#[test]
fn bcp_tsp_mows_every_weed_that_its_search_sweep_found() {
    let scenario = open("pasture", "weeds.count = 120");
    for seed in 0..5 {
        let sweep = run_episode(&scenario, &agent("bcp:spacing=sensor"), seed, None).weeds;
        let toured = run_episode(&scenario, &agent("bcp-tsp"), seed, None).weeds;
        let is_found = sweep.is_detected().iter();
        assert!(is_found.zip(toured.is_mowed()).all(|(&found, &mowed)| !found || mowed));
    }
}

#[test]
fn react_drives_exactly_the_length_of_bcp() {
    for seed in 0..5 {
        let (summary, _) = run_summary(&open("pasture", ""), &agent("react"), seed);
        assert!((summary.path_length_m - summary.bcp_length_m).abs() < 1e-6, "{summary:?}");
    }
}

#[test]
fn jump_mows_every_weed() {
    for seed in 0..20 {
        let (summary, _) = run_summary(&open("pasture", "weeds.count = 80"), &agent("jump"), seed);
        assert_eq!(summary.weeds_mowed, summary.weeds_total, "seed {seed}");
    }
}

#[test]
fn jump_takes_one_detour_to_a_weed_above_and_springs_on() {
    // One weed 3 m above the first pass: a tight jump with R = 2 is 2 x 2 R phi long, cos phi = 1 - 3/4, over 2 sqrt(3 x 5) m.
    let scenario = open("pasture", "");
    let episode = run_episode(&scenario, &agent("jump"), 0, Some(&[Point::new(50.0, 4.0)]));
    assert_eq!(episode.summary.weeds_mowed, 1);
    let bare = run_episode(&scenario, &agent("jump"), 0, Some(&[]));
    let detour_m = 8.0 * 0.25_f64.acos() - 2.0 * 15.0_f64.sqrt();
    let extra_m = episode.summary.path_length_m - bare.summary.path_length_m;
    // The jump starts within one piece of 0.2 m before its last chance, with a slanted straight that is shorter than the way saved.
    assert!(extra_m > 0.0 && (extra_m - detour_m).abs() < 0.2, "{extra_m} against {detour_m}");
}

#[test]
fn without_weeds_jump_and_snake_only_spring_upwards() {
    // Passes at 1, 7, 13, 19, 25, 31, 37, 39 (S_w/2 = 6) and at 1, 8, 15, 22, 29, 36, 39 (S_w/2 + B/2 = 7).
    let scenario = open("pasture", "");
    for (name, passes) in [("jump", 8.0), ("snake", 7.0)] {
        let episode = run_episode(&scenario, &agent(name), 0, Some(&[]));
        let straights_m: f64 = episode
            .trajectory
            .arcs()
            .iter()
            .filter(|arc| arc.curvature_per_m == 0.0 && arc.length_m > 50.0)
            .map(|arc| arc.length_m)
            .sum();
        assert!((straights_m - passes * 100.0).abs() < 1e-6, "{name}: {straights_m}");
    }
}

#[test]
fn snake_goes_from_weed_to_weed_with_the_heading_of_its_pass() {
    let scenario = open("pasture", "");
    let weeds = [Point::new(20.0, 3.0), Point::new(40.0, 1.5), Point::new(60.0, 6.0)];
    let episode = run_episode(&scenario, &agent("snake"), 0, Some(&weeds));
    for weed in weeds {
        let at_weed = episode
            .trajectory
            .sample()
            .into_iter()
            .find(|&[x_m, y_m, ..]| (x_m - weed.x).hypot(y_m - weed.y) < 1e-6);
        let [_, _, heading_rad, _] = at_weed.expect("a word ends on the weed");
        assert!(heading_rad.abs() < 1e-9, "{heading_rad}");
    }
}

#[test]
fn r_snake_is_never_longer_than_snake_where_it_ignores_no_weed() {
    // The pasture is 16 m wide: 1.5 S_w = 18 m below a pass lies nothing.
    let scenario = open("pasture", "pasture.width_m = 16.0\nweeds.count = 60");
    for seed in 0..5 {
        let (snake, _) = run_summary(&scenario, &agent("snake"), seed);
        let (restricted, _) = run_summary(&scenario, &agent("r-snake"), seed);
        assert!(restricted.path_length_m <= snake.path_length_m + 1e-6, "{restricted:?} {snake:?}");
    }
}

/// Agent, distribution, number of weeds; mean and standard deviation of the path in % of bcp, and of the weeds mowed in %.
type Cell = (&'static str, &'static str, u32, [f64; 2], [f64; 2]);

/// Cells of the second simulator, 100 instances each.
const SECOND_SIMULATOR: [Cell; 12] = [
    ("bcp-tsp", "uniform", 20, [30.6, 1.1], [96.2, 4.2]),
    ("bcp-tsp", "gaussian", 80, [45.6, 2.1], [97.1, 2.8]),
    ("react", "uniform", 320, [100.0, 0.0], [86.9, 4.6]),
    ("react", "gaussian", 20, [100.0, 0.0], [99.9, 1.0]),
    ("jump", "uniform", 20, [48.0, 3.9], [100.0, 0.0]),
    ("jump", "uniform", 160, [96.8, 6.4], [100.0, 0.0]),
    ("jump", "gaussian", 80, [78.1, 5.0], [100.0, 0.0]),
    ("snake", "uniform", 20, [37.8, 3.7], [96.3, 5.1]),
    ("snake", "uniform", 160, [111.3, 5.5], [100.0, 0.0]),
    ("snake", "gaussian", 80, [55.4, 5.2], [99.6, 1.3]),
    ("r-snake", "uniform", 40, [42.5, 4.0], [96.1, 4.4]),
    ("r-snake", "gaussian", 80, [53.6, 5.7], [98.3, 2.7]),
];

/// Two independent means differ by at most three standard errors; half a point more is for ties and the phase of the pieces.
#[test]
fn means_agree_with_a_second_simulator() {
    let instances = 40;
    let standard_errors = 3.0 * (1.0 / 100.0 + 1.0 / f64::from(instances)).sqrt();
    for (name, distribution, count, [path, path_sd], [mowed, mowed_sd]) in SECOND_SIMULATOR {
        let scenario = open(
            "pasture",
            &format!("weeds.count = {count}\nweeds.distribution = '{distribution}'"),
        );
        let summaries: Vec<Summary> = (0..u64::try_from(instances).unwrap())
            .map(|seed| run_summary(&scenario, &agent(name), 10_000 + seed).0)
            .collect();
        let mean =
            |of: fn(&Summary) -> f64| summaries.iter().map(of).sum::<f64>() / f64::from(instances);
        let mean_path = mean(|summary| 100.0 * summary.path_fraction());
        let mean_mowed =
            mean(|summary| 100.0 * summary.weeds_mowed as f64 / summary.weeds_total as f64);
        let cell = format!("{name}, {distribution}, {count} weeds");
        assert!(
            (mean_path - path).abs() <= standard_errors * path_sd + 0.5,
            "{cell}: path {mean_path} against {path} %"
        );
        assert!(
            (mean_mowed - mowed).abs() <= (standard_errors * mowed_sd).max(0.5),
            "{cell}: mowed {mean_mowed} against {mowed} %"
        );
    }
}
