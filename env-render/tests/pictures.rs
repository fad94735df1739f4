//! What a picture promises.

use swath_core::action::Command;
use swath_core::config::Document;
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Point;
use swath_render::{Painter, Picture, Replay, Size};

/// An environment that keeps its path, with the defaults and the keys of `toml` over them.
fn begun(toml: &str, seed: u64) -> Env {
    let mut document = Document::empty("pictures");
    document.overlay(toml.parse().expect("this is TOML"));
    let mut env = Env::new(&document.scenario().expect("the scenario is valid"));
    env.keep_trace();
    env.reset(seed);
    env
}

/// Turns of all kinds: gentle, tight, straight, and a command so long that it leads over the fence and far away.
fn commands() -> impl Iterator<Item = Command> {
    let curvatures = [0.0, 0.5, -0.5, 0.1, 0.0, -0.2];
    (0..90).map(move |i: usize| Command {
        curvature_per_m: curvatures[i % 6],
        distance_m: if i == 60 { 45.0 } else { 0.3 + 0.37 * (i % 5) as f64 },
    })
}

fn painter() -> Painter {
    Painter::new(Size::new(640, 360).expect("a picture may have this size"), "a title")
}

#[test]
fn a_picture_depends_on_the_state_and_not_on_the_pictures_before() {
    let endless = "pasture.headland_m = inf\nepisode.budget = inf";
    let (mut env, mut often) = (begun(endless, 3), painter());
    for _ in 0..2 {
        for command in commands() {
            env.drive(command).unwrap();
            let picture = often.paint(&env);
            if env.view().path_m > 100.0 {
                assert_eq!(picture, painter().paint(&env), "after {} m", env.view().path_m);
            }
        }
        // The same painter goes on with another episode.
        env.reset(4);
        assert_eq!(often.paint(&env), painter().paint(&env));
    }
}

#[test]
fn a_way_cut_into_other_commands_looks_the_same() {
    let (mut whole, mut cut) =
        (begun("mower.start = 'centre'", 1), begun("mower.start = 'centre'", 1));
    whole.drive(Command { curvature_per_m: 0.0, distance_m: 40.0 }).unwrap();
    for _ in 0..80 {
        cut.drive(Command { curvature_per_m: 0.0, distance_m: 0.5 }).unwrap();
    }
    assert_eq!(painter().paint(&whole), painter().paint(&cut));
}

#[test]
fn an_environment_that_keeps_no_path_is_painted_without_it() {
    let mut env = begun("", 7);
    let mut plain = Env::new(env.scenario());
    plain.reset(7);
    assert_eq!(painter().paint(&env), painter().paint(&plain), "nothing is driven yet");
    for env in [&mut env, &mut plain] {
        env.drive(Command { curvature_per_m: 0.0, distance_m: 20.0 }).unwrap();
    }
    assert_ne!(painter().paint(&env), painter().paint(&plain));
}

#[test]
fn a_restored_environment_shows_its_path_from_there_on() {
    let mut env = begun("", 7);
    env.drive(Command { curvature_per_m: 0.0, distance_m: 20.0 }).unwrap();
    let (snapshot, mut painter) = (env.snapshot(), painter());
    let before = painter.paint(&env);
    env.restore(&snapshot).unwrap();
    assert!(env.trace().unwrap().path().arcs().is_empty());
    assert_ne!(painter.paint(&env), before);
}

#[test]
fn a_replay_drives_the_arcs_again_whichever_way_it_is_cut() {
    let mut env = begun("pasture.headland_m = inf\nepisode.budget = inf", 5);
    for command in commands() {
        env.drive(command).unwrap();
    }
    let points = env.trace().unwrap().path().sample();
    let weeds: Vec<Point> = env.weeds().positions().to_vec();
    let mut replay = Replay::new(env.scenario(), &weeds, points).unwrap();
    for step in 0..=400 {
        replay.drive_to(replay.length_m() * f64::from(step) / 400.0);
    }
    let again = replay.env();
    assert_eq!(again.weeds().is_mowed(), env.weeds().is_mowed());
    assert_eq!(again.weeds().is_detected(), env.weeds().is_detected());
    assert!(again.view().pose.distance_to(&env.view().pose) < 1e-6);
}

#[test]
fn a_replay_of_nothing_or_of_nonsense_is_refused_by_name() {
    let env = begun("", 0);
    let refused = |points: Vec<[f64; 4]>| {
        Replay::new(env.scenario(), &[], points).expect_err("it is refused").to_string()
    };
    assert!(refused(vec![]).starts_with("`trajectory` must be at least one row"));
    assert!(refused(vec![[f64::NAN, 0.0, 0.0, 0.0]]).starts_with("`trajectory` must be finite"));
    assert!(refused(vec![[-50.0, 0.0, 0.0, 0.0]]).contains("on the pasture or its headland"));
    let back = vec![[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.5]];
    assert!(refused(back).contains("a path that never gets shorter"));
}

#[test]
fn marks_are_where_the_weeds_are() {
    let mut env = begun("pasture.length_m = 60\npasture.width_m = 30", 0);
    let weeds = [Point::new(10.0, 1.0), Point::new(16.0, 3.0), Point::new(50.0, 25.0)];
    env.reset_from(0, Beginning { weeds: Some(&weeds), start: None });
    env.drive(Command { curvature_per_m: 0.0, distance_m: 12.0 }).unwrap();
    let picture = painter().paint(&env);
    let count = |colour: [u8; 3]| {
        picture.rgb().as_chunks::<3>().0.iter().filter(|&&at| at == colour).count()
    };
    // A detected weed is also in the legend.
    let (detected, mowed) = ([213, 94, 0], [122, 31, 98]);
    let before = {
        env.reset_from(0, Beginning { weeds: Some(&[]), start: None });
        let empty = painter().paint(&env);
        [detected, mowed]
            .map(|colour| empty.rgb().as_chunks::<3>().0.iter().filter(|&&at| at == colour).count())
    };
    assert!(count(detected) > before[0] && count(mowed) > before[1]);
}

#[test]
fn tiles_lie_side_by_side_and_the_rest_is_white() {
    let tile = |byte: u8| Picture::from_rgb(2, 1, vec![byte; 6]).unwrap();
    let tiled = Picture::tiled(&[tile(1), tile(2), tile(3)], 2);
    assert_eq!((tiled.width(), tiled.height()), (4, 2));
    let rows = [[1, 1, 2, 2], [3, 3, 255, 255]].concat();
    assert_eq!(tiled.rgb(), rows.iter().flat_map(|&byte| [byte; 3]).collect::<Vec<u8>>());
}

#[test]
fn a_png_begins_as_one_and_is_smaller_than_its_pixels() {
    let picture = painter().paint(&begun("", 7));
    let png = picture.png();
    assert!(png.starts_with(b"\x89PNG") && png.len() < picture.rgb().len() / 10);
}
