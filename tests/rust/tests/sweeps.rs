//! A document with `[[sweep]]` tables: the product of the values within one, the union over all, and what is refused.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::path::Path;

use swath_core::config::{Cell, ConfigError, Document};
use toml::Value;

fn cells(text: &str, only: Option<&str>) -> Result<Vec<Cell>, ConfigError> {
    Document::parse("meadow", text, Path::new(""))?.cells(only)
}

#[track_caller]
fn refusal(text: &str, only: Option<&str>) -> String {
    match cells(text, only) {
        Ok(cells) => panic!("accepted as {} cells", cells.len()),
        Err(error) => error.to_string(),
    }
}

const TWO_SWEEPS: &str = r#"
[weeds]
count = 7
[[sweep]]
name = "reach"
"sensor.range_m" = [4, 8.5]
"mower.deck_width_m" = [1.0, 2.0, 3.0]
[[sweep]]
name = "weeds"
"weeds.count" = [1, 2]
"#;

#[test]
fn a_document_without_sweeps_is_one_cell() {
    let cells = cells("[weeds]\ncount = 7", None).unwrap();
    assert_eq!(cells.len(), 1);
    assert_eq!((cells[0].name.as_str(), cells[0].values.len()), ("meadow", 0));
    assert_eq!(cells[0].scenario.weeds.count, 7);
}

#[test]
fn within_a_sweep_every_combination_is_a_cell_and_sweeps_add_up() {
    let all = cells(TWO_SWEEPS, None).unwrap();
    let rows: Vec<(&str, f64, f64, u32)> = all
        .iter()
        .map(|cell| {
            let s = &cell.scenario;
            (cell.name.as_str(), s.sensor.range_m, s.mower.deck_width_m, s.weeds.count)
        })
        .collect();
    assert_eq!(
        rows,
        [
            ("meadow/reach", 4.0, 1.0, 7),
            ("meadow/reach", 4.0, 2.0, 7),
            ("meadow/reach", 4.0, 3.0, 7),
            ("meadow/reach", 8.5, 1.0, 7),
            ("meadow/reach", 8.5, 2.0, 7),
            ("meadow/reach", 8.5, 3.0, 7),
            ("meadow/weeds", 12.0, 2.0, 1),
            ("meadow/weeds", 12.0, 2.0, 2),
        ]
    );
}

/// Every cell of an evaluation has the same columns, a whole number written for a length is a length.
#[test]
fn values_that_a_sweep_leaves_alone_are_shown_as_the_scenario_has_them() {
    let all = cells(TWO_SWEEPS, None).unwrap();
    let expected = |range_m: f64, deck_m: f64, count: i64| {
        vec![
            ("sensor.range_m".to_owned(), Value::Float(range_m)),
            ("mower.deck_width_m".to_owned(), Value::Float(deck_m)),
            ("weeds.count".to_owned(), Value::Integer(count)),
        ]
    };
    assert_eq!(all[0].values, expected(4.0, 1.0, 7));
    assert_eq!(all[7].values, expected(12.0, 2.0, 2));
    let only = cells(TWO_SWEEPS, Some("weeds")).unwrap();
    assert_eq!(only[1].values, [("weeds.count".to_owned(), Value::Integer(2))]);
}

#[test]
fn keys_without_a_block_and_keys_with_lists_can_be_swept() {
    let text = r#"
[[sweep]]
name = "start"
"mower.start" = ["corner", "centre", [3.0, 4.0, 0.5]]
"weeds.positions_m" = [[[1.0, 1.0]], [[2.0, 2.0], [3.0, 3.0]]]
id = ["swath/MowerRouting-v0"]
"#;
    let cells = cells(text, None).unwrap();
    assert_eq!(cells.len(), 6);
    assert_eq!(cells[5].scenario.weeds.count, 2);
}

#[test]
fn a_sweep_that_is_not_declared_is_refused_with_those_that_are() {
    assert_eq!(refusal(TWO_SWEEPS, Some("speed")), "`only` must be one of reach, weeds, got speed");
    assert_eq!(
        refusal("", Some("speed")),
        "`only` must be left out, since meadow declares no sweep, got speed"
    );
}

#[test]
fn a_sweep_over_a_key_that_does_not_exist_is_refused_with_the_nearest() {
    let text = "[[sweep]]\nname = \"a\"\n\"weeds.cuont\" = [1]";
    let message = refusal(text, None);
    assert_eq!(message, "`weeds.cuont` is not a known key; did you mean `weeds.count`?");
    // A block is no key that has values.
    assert!(
        refusal("[[sweep]]\nname = \"a\"\nweeds = [1]", None)
            .starts_with("`weeds` is not a known key")
    );
}

#[test]
fn a_sweep_that_is_not_written_as_one_is_refused_by_its_key() {
    for (text, start) in [
        ("sweep = 3", "`sweep` must be one or more [[sweep]] tables, got 3"),
        ("sweep = [3]", "`sweep` must be one or more [[sweep]] tables, got 3"),
        ("[sweep]\nname = \"a\"", "`sweep` must be one or more [[sweep]] tables"),
        ("[[sweep]]\n\"weeds.count\" = [1]", "`sweep.name` must be a string, got none"),
        (
            "[[sweep]]\nname = 'n'",
            "`sweep` must be a name and lists of values, such as \"weeds.count\" = [20, 40], got `n` without any list",
        ),
        ("[[sweep]]\nname = 3\n\"weeds.count\" = [1]", "`sweep.name` must be a string, got 3"),
        ("[[sweep]]\nname = \"a\"\n\"weeds.count\" = 20", "`sweep.\"weeds.count\"` must be a list"),
        ("[[sweep]]\nname = \"a\"\n\"weeds.count\" = []", "`sweep.\"weeds.count\"` must be a list"),
        ("[[sweep]]\nname = \"a\"\nweeds.count = [1]", "`sweep.\"weeds\"` must be a list"),
    ] {
        let message = refusal(text, None);
        assert!(message.starts_with(start), "{text}\n{message}");
    }
}

#[test]
fn a_value_of_a_sweep_that_is_not_allowed_is_refused_by_its_key() {
    let text = "[[sweep]]\nname = \"a\"\n\"mower.deck_width_m\" = [2.0, -1.0]";
    assert_eq!(refusal(text, None), "`mower.deck_width_m` must be finite and > 0, got -1");
    let text = "[[sweep]]\nname = \"a\"\n\"weeds.count\" = [1, \"many\"]";
    assert!(refusal(text, None).starts_with("`weeds.count` must be a whole number"));
}

/// Two sweeps of one name could not be told apart in a table of results.
#[test]
fn two_sweeps_of_one_name_are_refused() {
    let text = "[[sweep]]\nname = \"a\"\n\"weeds.count\" = [1]\n[[sweep]]\nname = \"a\"\n\"weeds.count\" = [2]";
    assert!(refusal(text, None).starts_with("`sweep.name` must be "));
}

/// Weeds that stand where they are given are not drawn, so a sweep over their draw would repeat itself.
#[test]
fn a_sweep_over_the_draw_of_weeds_that_are_given_is_refused() {
    let given = "[weeds]\npositions_m = [[1.0, 1.0]]\n[[sweep]]\nname = \"a\"\n";
    for (key, values) in [
        ("weeds.count", "[20, 40]"),
        ("weeds.distribution", "[\"uniform\", \"gaussian\"]"),
        ("weeds.sigma_m", "[1.0, 2.0]"),
        ("weeds.cluster_fraction", "[0.1, 0.2]"),
    ] {
        assert_eq!(
            refusal(&format!("{given}\"{key}\" = {values}"), None),
            format!(
                "`{key}` must be left out of sweeps where weeds.positions_m gives the weeds, since none is drawn, got it in `a`"
            )
        );
    }
}

#[test]
fn a_sweep_that_gives_weeds_and_goes_over_their_draw_is_refused_in_any_order() {
    for (giver, given) in [
        ("weeds.positions_m", "[[[1.0, 1.0]], [[2.0, 2.0], [3.0, 3.0]]]"),
        ("weeds.file", "[\"nowhere.csv\"]"),
    ] {
        for (key, values) in [
            ("weeds.count", "[20, 40]"),
            ("weeds.distribution", "[\"uniform\", \"gaussian\"]"),
            ("weeds.sigma_m", "[1.0, 2.0]"),
        ] {
            let (gives, draws) =
                (format!("\"{giver}\" = {given}"), format!("\"{key}\" = {values}"));
            for axes in [format!("{gives}\n{draws}"), format!("{draws}\n{gives}")] {
                assert_eq!(
                    refusal(&format!("[[sweep]]\nname = \"a\"\n{axes}"), None),
                    format!(
                        "`{key}` must be left out of sweeps where {giver} gives the weeds, since none is drawn, got it in `a`"
                    )
                );
            }
        }
    }
}

#[test]
fn a_sweep_over_given_weeds_stands_beside_one_over_their_number() {
    let text = r#"
[weeds]
count = 7
[[sweep]]
name = "given"
"weeds.positions_m" = [[[1.0, 1.0]], [[2.0, 2.0], [3.0, 3.0]]]
[[sweep]]
name = "drawn"
"weeds.count" = [5, 6]
"#;
    let counts: Vec<u32> =
        cells(text, None).unwrap().iter().map(|cell| cell.scenario.weeds.count).collect();
    assert_eq!(counts, [1, 2, 5, 6]);
}

#[test]
fn keywords_laid_over_a_document_win_key_by_key() {
    let mut document = Document::parse(
        "meadow",
        "[weeds]\ncount = 7\nsigma_m = 2.0\n[pasture]\nlength_m = 50.0",
        Path::new(""),
    )
    .unwrap();
    document.overlay("[weeds]\ncount = 9\n[mower]\nspeed_mps = 2.0".parse().unwrap());
    let scenario = document.scenario().unwrap();
    assert_eq!((scenario.weeds.count, scenario.weeds.sigma_m), (9, 2.0));
    assert_eq!((scenario.pasture.length_m, scenario.mower.speed_mps), (50.0, 2.0));
}

/// Whoever asks for a number of weeds, or gives weeds, wants neither those of the file below nor as many.
#[test]
fn weeds_laid_over_a_document_replace_the_weeds_given_there() {
    let one = "[weeds]\npositions_m = [[1.0, 1.0]]";
    let counted = "[weeds]\ncount = 1\npositions_m = [[1.0, 1.0]]";
    let drawn = "[weeds]\ncount = 7";
    let two = "[weeds]\npositions_m = [[2.0, 2.0], [3.0, 3.0]]";
    for (text, overlay, count) in [
        (one, "[weeds]\ncount = 9", 9),
        (one, two, 2),
        (one, "[weeds]\nsigma_m = 2.0", 1),
        (counted, "[weeds]\ncount = 9", 9),
        (counted, two, 2),
        (counted, "[weeds]\nsigma_m = 2.0", 1),
        (drawn, two, 2),
    ] {
        let mut document = Document::parse("meadow", text, Path::new("")).unwrap();
        document.overlay(overlay.parse().unwrap());
        assert_eq!(document.scenario().unwrap().weeds.count, count, "{text}\n{overlay}");
    }
}
