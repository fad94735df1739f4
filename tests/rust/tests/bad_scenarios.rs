//! A scenario that cannot be used is refused in one line that names the field, the value and what was expected.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::path::Path;

use proptest::prelude::*;
use swath_core::config::{ConfigError, Document, Scenario, ValidScenario};
use swath_tests::cases::cases;
use toml::{Table, Value};

fn read(text: &str) -> Result<ValidScenario, ConfigError> {
    Document::parse("meadow", text, Path::new(""))?.scenario()
}

/// What is said about a scenario that must be refused.
fn refusal(text: &str) -> String {
    match read(text) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.to_string(),
    }
}

/// The refusal of a field, of which the text says what was found there.
#[track_caller]
fn assert_refused(text: &str, field: &str, got: &str) {
    let message = refusal(text);
    assert!(
        message.starts_with(&format!("`{field}` must be "))
            && message.ends_with(&format!(", got {got}")),
        "{text}\n{message}"
    );
    assert!(!message.contains('\n'), "{message}");
}

/// Every key of the default scenario that holds a number, with it.
fn numbers() -> Vec<(String, Value)> {
    let text = Scenario::default().check().unwrap().to_toml();
    let blocks: Table = text.parse().unwrap();
    let mut numbers = Vec::new();
    for (block, keys) in blocks {
        for (key, value) in keys.as_table().into_iter().flatten() {
            if value.is_float() || value.is_integer() {
                numbers.push((format!("{block}.{key}"), value.clone()));
            }
        }
    }
    assert!(numbers.len() > 12, "{numbers:?}");
    numbers
}

fn with(field: &str, value: &str) -> String {
    let (block, key) = field.split_once('.').unwrap();
    format!("[{block}]\n{key} = {value}\n")
}

#[test]
fn nan_is_refused_in_every_number() {
    for (field, value) in numbers() {
        let got = if value.is_float() { "NaN" } else { "floating point `NaN`" };
        assert_refused(&with(&field, "nan"), &field, got);
        assert_refused(&with(&field, "-nan"), &field, got);
    }
}

#[test]
fn a_negative_number_is_refused_wherever_it_makes_no_sense() {
    for (field, value) in numbers() {
        match field.as_str() {
            // A weed may be worth keeping; a path that pays would make quitting pay.
            "reward.weed" => assert!(read(&with(&field, "-1.0")).is_ok()),
            _ if value.is_float() => assert_refused(&with(&field, "-1.0"), &field, "-1"),
            _ => assert_refused(&with(&field, "-1"), &field, "integer `-1`"),
        }
    }
}

#[test]
fn infinity_is_refused_wherever_it_does_not_mean_no_limit() {
    for (field, value) in numbers() {
        match field.as_str() {
            "pasture.headland_m" | "episode.budget" => {
                assert!(read(&with(&field, "inf")).is_ok(), "{field}");
                assert_refused(&with(&field, "-inf"), &field, "-inf");
            }
            _ if value.is_float() => assert_refused(&with(&field, "inf"), &field, "inf"),
            _ => assert_refused(&with(&field, "inf"), &field, "floating point `inf`"),
        }
    }
}

#[test]
fn text_is_refused_in_every_number() {
    for (field, _) in numbers() {
        assert_refused(&with(&field, "\"many\""), &field, "string \"many\"");
    }
}

#[test]
fn zero_is_refused_in_every_size() {
    for field in [
        "pasture.length_m",
        "pasture.width_m",
        "mower.turning_radius_m",
        "mower.deck_width_m",
        "mower.speed_mps",
        "sensor.range_m",
        "sensor.width_m",
        "weeds.sigma_m",
        "episode.control_period_s",
        "episode.budget",
        "episode.seen_goal",
    ] {
        assert_refused(&with(field, "0.0"), field, "0");
    }
    for field in ["observation.nearest_weeds", "observation.rays"] {
        assert_refused(&with(field, "0"), field, "0");
    }
    for field in ["pasture.headland_m", "weeds.cluster_fraction", "reward.weed"] {
        assert!(read(&with(field, "0.0")).is_ok(), "{field}");
    }
    assert!(read(&with("weeds.count", "0")).is_ok());
}

#[test]
fn whole_numbers_may_be_written_for_lengths_and_no_others_for_counts() {
    assert_eq!(
        read("[pasture]\nlength_m = 60").unwrap(),
        read("[pasture]\nlength_m = 60.0").unwrap()
    );
    assert_refused("[weeds]\ncount = 4.5", "weeds.count", "floating point `4.5`");
    assert_refused("[observation]\nrays = 8.0", "observation.rays", "floating point `8.0`");
}

#[test]
fn values_beyond_what_can_be_computed_are_refused() {
    assert_refused("[weeds]\ncount = 10000001", "weeds.count", "10000001");
    assert_refused("[weeds]\ncount = 99999999999", "weeds.count", "integer `99999999999`");
    let too_wide = "[weeds]\ndistribution = \"gaussian\"\nsigma_m = 1000.0";
    assert_refused(too_wide, "weeds.sigma_m", "1000");
    assert_refused("[weeds]\ncluster_fraction = 1.5", "weeds.cluster_fraction", "1.5");
    assert_refused("[observation]\nrays = 65", "observation.rays", "65");
    assert_refused("[observation]\nnearest_weeds = 65", "observation.nearest_weeds", "65");
    for (key, value) in [("weeds", 0), ("weeds", 65), ("views", 65)] {
        let field = format!("action.{key}");
        assert_refused(&format!("[action]\n{key} = {value}"), &field, &value.to_string());
    }
    assert_refused("[episode]\nseen_goal = 1.1", "episode.seen_goal", "1.1");
    assert_refused(
        "[pasture]\nlength_m = 1e6\nwidth_m = 1e6",
        "pasture.length_m x pasture.width_m",
        "1000000000000",
    );
    assert_refused(
        "[episode]\ncontrol_period_s = 60\n[mower]\nspeed_mps = 2",
        "episode.control_period_s x mower.speed_mps",
        "120",
    );
}

/// Nobody who asks for a small pasture has asked for clusters of weeds, so their spread is no reason to refuse it.
#[test]
fn a_number_that_is_not_used_is_no_reason_to_refuse_a_small_pasture() {
    let text = "[pasture]\nlength_m = 2.5\nwidth_m = 2.5";
    assert!(read(text).is_ok(), "{}", refusal(text));
}

/// The limit on the area is there for the cells, of which a strip narrower than a metre has one for each metre of its length.
#[test]
fn a_pasture_of_more_cells_than_the_largest_is_refused() {
    let text = "[pasture]\nlength_m = 1e11\nwidth_m = 1e-4\n[mower]\ndeck_width_m = 1e-4";
    assert!(read(text).is_err(), "a hundred thousand million cells were accepted");
}

#[test]
fn a_pasture_smaller_than_the_deck_is_refused() {
    let text = "[pasture]\nlength_m = 1.5\nwidth_m = 40";
    assert_refused(text, "mower.deck_width_m", "2");
    assert!(refusal(text).contains("at most the pasture's smaller side, 1.5 m"));
    assert_refused("[mower]\ndeck_width_m = 40.5", "mower.deck_width_m", "40.5");
    assert!(read("[mower]\ndeck_width_m = 40").is_ok());
}

#[test]
fn weeds_off_the_pasture_are_refused_by_their_number() {
    for (weed, got) in [
        ("[100.5, 3.0]", "[100.5, 3]"),
        ("[3.0, -0.1]", "[3, -0.1]"),
        ("[nan, 3.0]", "[NaN, 3]"),
        ("[3.0, inf]", "[3, inf]"),
    ] {
        let text = format!("[weeds]\npositions_m = [[1.0, 1.0], {weed}, [2.0, 2.0]]");
        assert_refused(&text, "weeds.positions_m[1]", got);
    }
    assert!(read("[weeds]\npositions_m = [[0.0, 0.0], [100.0, 40.0]]").is_ok());
    assert_eq!(read("[weeds]\npositions_m = [[1, 2], [3, 4]]").unwrap().weeds.count, 2);
}

#[test]
fn a_count_of_weeds_that_is_not_that_of_the_given_ones_is_refused() {
    let with = |count: u32| format!("[weeds]\ncount = {count}\npositions_m = [[1, 2], [3, 4]]");
    assert_eq!(
        refusal(&with(40)),
        "`weeds.count` must be left out or 2, as many as weeds.positions_m gives, got 40"
    );
    assert_eq!(read(&with(2)).unwrap().weeds.count, 2);
}

#[test]
fn a_weed_that_is_no_pair_of_numbers_is_refused() {
    for weeds in ["[[1.0]]", "[[1.0, 2.0, 3.0]]", "[1.0, 2.0]", "[[\"a\", 2.0]]", "7"] {
        let message = refusal(&format!("[weeds]\npositions_m = {weeds}"));
        assert!(message.starts_with("`weeds.positions_m"), "{message}");
    }
}

#[test]
fn a_start_that_is_nowhere_is_refused() {
    for (start, got) in [
        ("[-10.5, 1.0, 0.0]", "[-10.5, 1, 0]"),
        ("[1.0, 50.1, 0.0]", "[1, 50.1, 0]"),
        ("[1.0, 1.0, nan]", "[1, 1, NaN]"),
        ("[nan, 1.0, 0.0]", "[NaN, 1, 0]"),
        ("[1.0, 1.0, inf]", "[1, 1, inf]"),
    ] {
        assert_refused(&format!("[mower]\nstart = {start}"), "mower.start", got);
    }
    // No limit on the headland is no leave to stand nowhere.
    assert_refused(
        "[pasture]\nheadland_m = inf\n[mower]\nstart = [inf, 0, 0]",
        "mower.start",
        "[inf, 0, 0]",
    );
}

#[test]
fn a_start_that_is_no_pose_is_refused_with_what_would_be_one() {
    for start in ["\"middle\"", "[1.0, 2.0]", "[1.0, 2.0, 3.0, 4.0]", "true", "{ x = 1 }"] {
        let message = refusal(&format!("[mower]\nstart = {start}"));
        let expected = "`mower.start` must be \"corner\", \"centre\" or [x_m, y_m, heading_rad]";
        assert!(message.starts_with(expected), "{start}: {message}");
    }
}

#[test]
fn a_start_that_is_a_pose_is_taken() {
    assert!(read("[mower]\nstart = [-10.0, 50.0, 7.0]").is_ok());
    assert!(read("[pasture]\nheadland_m = inf\n[mower]\nstart = [-1000, 0, 0]").is_ok());
}

#[test]
fn names_are_refused_with_the_names_there_are() {
    for (text, field, names) in [
        ("id = \"swath/Chess-v0\"", "id", "swath/MowerRouting-v0"),
        ("[weeds]\ndistribution = \"normal\"", "weeds.distribution", "gaussian"),
        ("[action]\nkind = \"fly\"", "action.kind", "drive"),
        ("[observation]\nkind = \"sound\"", "observation.kind", "features"),
    ] {
        let message = refusal(text);
        assert!(message.starts_with(&format!("`{field}` must be ")), "{message}");
        assert!(message.contains(names) && message.contains(", got `"), "{message}");
    }
}

#[test]
fn an_unknown_key_is_refused_with_the_nearest_one() {
    for (text, key, nearest) in [
        ("[weeds]\ncuont = 5", "weeds.cuont", "weeds.count"),
        ("[mower]\ndeck_width = 2.0", "mower.deck_width", "mower.deck_width_m"),
        ("[mower]\nturn_radius_m = 2.0", "mower.turn_radius_m", "mower.turning_radius_m"),
        // In no block, or in the wrong one.
        ("count = 5", "count", "weeds.count"),
        ("turning_radius_m = 2.0", "turning_radius_m", "mower.turning_radius_m"),
        ("[pasture]\ncount = 5", "pasture.count", "weeds.count"),
        ("[sensor]\ndeck_width_m = 2.0", "sensor.deck_width_m", "mower.deck_width_m"),
    ] {
        let message = refusal(text);
        let expected = format!("`{key}` is not a known key; did you mean `{nearest}`?");
        assert_eq!(message, expected, "{text}");
    }
}

/// `weed` is a key of `reward`, but a block of keys must have meant a block.
#[test]
fn an_unknown_block_is_refused_with_the_nearest_block() {
    for (block, nearest) in [
        ("mowers", "mower"),
        ("Mower", "mower"),
        ("observations", "observation"),
        ("weed", "weeds"),
    ] {
        let message = refusal(&format!("[{block}]\ncount = 5"));
        let expected = format!("`{block}` is not a known key; did you mean `{nearest}`?");
        assert_eq!(message, expected);
    }
}

#[test]
fn a_key_that_resembles_none_is_refused_without_a_guess() {
    assert_eq!(refusal("zzzzzzzzzzzz = 1"), "`zzzzzzzzzzzz` is not a known key");
    assert_eq!(refusal("[weeds]\nqqqqqqqqqq = 1"), "`weeds.qqqqqqqqqq` is not a known key");
}

#[test]
fn a_value_where_a_block_belongs_is_refused() {
    assert_refused("weeds = 40", "weeds", "40");
    assert!(refusal("mower = []").starts_with("`mower` must be a block of keys"));
}

#[test]
fn text_that_is_not_toml_is_refused_with_its_line() {
    for (text, line) in [
        ("[pasture\nlength_m = 1", 1),
        ("[pasture]\nlength_m = \n", 2),
        ("# ü\n[pasture]\nlength_m = 1\nlength_m = 2\n", 4),
        ("[pasture]\n\n\nlength_m := 3", 4),
    ] {
        let message = refusal(text);
        assert!(message.starts_with(&format!("meadow, line {line}: ")), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn a_file_that_is_not_there_is_refused_with_the_names_that_are() {
    let message = Document::open("no/such/meadow.toml").unwrap_err().to_string();
    assert!(message.starts_with("cannot read no/such/meadow.toml: "), "{message}");
    assert!(message.contains("default, pasture, cowbot-field, table1"), "{message}");
}

#[test]
fn one_environment_is_not_made_from_a_sweep() {
    let text = "[[sweep]]\nname = \"density\"\n\"weeds.count\" = [20, 40]";
    let message = refusal(text);
    assert!(message.starts_with("meadow declares the sweep `density`: "), "{message}");
    assert!(Document::open("table1").unwrap().scenario().is_err());
}

#[test]
fn what_was_not_resolved_by_a_document_is_refused_by_the_check() {
    let mut scenario = Scenario::default();
    scenario.weeds.file = Some("weeds.csv".to_owned());
    let message = scenario.check().unwrap_err().to_string();
    assert!(message.starts_with("`weeds.file` must be ") && message.ends_with(", got weeds.csv"));
}

/// Anything that somebody could write after a key.
fn values() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        any::<i64>().prop_map(Value::Integer),
        any::<f64>().prop_map(Value::Float),
        any::<bool>().prop_map(Value::Boolean),
        "(?s).{0,12}".prop_map(Value::String),
        Just(Value::String("two\nlines".to_owned())),
        (0.0..200.0).prop_map(Value::Float),
    ];
    leaf.prop_recursive(2, 8, 3, |inner| {
        prop_oneof![
            proptest::collection::vec(inner.clone(), 0..3).prop_map(Value::Array),
            proptest::collection::vec(("(?s).{1,6}", inner), 0..3)
                .prop_map(|pairs| Value::Table(pairs.into_iter().collect())),
        ]
    })
}

/// A known key, a known block, or anything.
fn keys() -> impl Strategy<Value = String> {
    let known: Vec<String> = numbers().into_iter().map(|(field, _)| field).collect();
    let others =
        ["mower.start", "weeds.positions_m", "weeds.file", "weeds", "id", "sweep", "action.kind"];
    prop_oneof![
        proptest::sample::select(known),
        proptest::sample::select(others.map(str::to_owned).to_vec()),
        "(?s).{1,12}",
        "[a-z]{1,8}\\.[a-z_\n]{1,8}",
    ]
}

fn insert(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        Some((block, key)) => {
            let block = table.entry(block).or_insert_with(|| Value::Table(Table::new()));
            if let Some(block) = block.as_table_mut() {
                block.insert(key.to_owned(), value);
            }
        }
        None => {
            table.insert(key.to_owned(), value);
        }
    }
}

proptest! {
    #![proptest_config(cases())]

    /// A document that names no files is accepted or refused in one line, whatever stands in it; it never panics.
    #[test]
    fn every_refusal_is_one_line(
        entries in proptest::collection::vec((keys(), values()), 1..3), only in "(?s).{0,8}",
    ) {
        let mut table = Table::new();
        for (key, value) in entries {
            insert(&mut table, &key, value);
        }
        let outcome = Document::from_table("meadow", table.clone(), Path::new("")).and_then(|document| {
            let _ = document.cells(None)?;
            let _ = document.cells(Some(&only));
            document.scenario()
        });
        if let Err(error) = outcome {
            let message = error.to_string();
            prop_assert_eq!(message.lines().count(), 1, "{:?} says {:?}", table, message);
        }
    }

    #[test]
    fn text_of_any_kind_is_read_or_refused_in_one_line(text in "(?s).{0,60}") {
        if let Err(error) = read(&text) {
            prop_assert_eq!(error.to_string().lines().count(), 1, "{:?}", error.to_string());
        }
    }
}

/// Text from outside is quoted in messages; its line breaks must not break them.
#[test]
fn a_line_break_in_a_key_or_a_value_does_not_break_the_message() {
    let texts = [
        "\"two\\nlines\" = 1",
        "id = \"two\\nlines\"",
        "mower = \"two\\nlines\"",
        "[weeds]\ndistribution = \"two\\nlines\"",
        "[weeds]\nfile = \"two\\nlines.csv\"",
        "[weeds]\nfile = \"two\\nlines.csv\"\npositions_m = [[1, 1]]",
        "[mower]\nstart = \"two\\nlines\"",
        "sweep = \"two\\nlines\"",
        "[[sweep]]\nname = [\"two\\nlines\"]",
        "[[sweep]]\nname = \"two\\nlines\"\n\"weeds.count\" = [1]",
        "[[sweep]]\nname = \"a\"\n\"weeds.count\" = \"two\\nlines\"",
        "[[sweep]]\nname = \"a\"\n\"weeds.two\\nlines\" = [1]",
    ];
    let messages = texts.map(refusal);
    let broken: Vec<&String> = messages.iter().filter(|text| text.lines().count() != 1).collect();
    assert!(broken.is_empty(), "{} of {}: {broken:#?}", broken.len(), messages.len());
}

/// To look for what it could be meant for would take minutes, and nobody could read the message.
#[test]
fn a_very_long_key_or_value_is_quoted_in_part() {
    let long = "x".repeat(8 << 20);
    for text in [
        format!("{long} = 1"),
        format!("[pasture]\n{long} = 1"),
        format!("[mower]\nstart = '{long}'"),
        format!("[[sweep]]\nname = 'a'\n\"{long}\" = [1]"),
    ] {
        let message = refusal(&text);
        assert!(message.len() < 1100 && message.ends_with("..."), "{} bytes", message.len());
    }
}
