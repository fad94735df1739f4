//! The files in `configs/`: each can be used, `default.toml` lists every key with its default, `table1.toml` holds the sweeps of the paper.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value as Json;
use swath_core::config::{Cell, Distribution, Document, SHIPPED, Scenario, schema, shipped};
use swath_core::env::Env;
use swath_core::site::Site;
use toml::{Table, Value};

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs")
}

/// Dotted names of the leaves of a JSON Schema node, its references followed.
fn leaves_of(root: &Json, node: &Json, path: &str, leaves: &mut BTreeSet<String>) {
    let target = node.get("$ref").and_then(Json::as_str);
    let node = target.map_or(node, |target| {
        root.pointer(target.trim_start_matches('#')).expect("a reference leads somewhere")
    });
    match node.get("properties").and_then(Json::as_object) {
        Some(properties) => {
            for (name, inner) in properties {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                leaves_of(root, inner, &path, leaves);
            }
        }
        None => assert!(leaves.insert(path.to_owned()), "{path} twice"),
    }
}

/// Every key that a scenario can have.
fn keys_of_the_schema() -> BTreeSet<String> {
    let schema = schema();
    let mut leaves = BTreeSet::new();
    leaves_of(schema.as_value(), schema.as_value(), "", &mut leaves);
    leaves
}

/// Every key that a file shows, `key = value` or, for a key without a default, `# key = value`.
fn keys_shown(text: &str) -> BTreeSet<String> {
    let mut block = String::new();
    let mut keys = BTreeSet::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            block = format!("{name}.");
            continue;
        }
        let Some((key, _)) = line.trim_start_matches("# ").split_once(" = ") else { continue };
        if key.chars().all(|c| c.is_ascii_lowercase() || c == '_') {
            assert!(keys.insert(format!("{block}{key}")), "{block}{key} twice");
        }
    }
    keys
}

#[test]
fn every_file_in_configs_is_shipped_under_its_name_as_it_is() {
    let mut found: Vec<String> = fs::read_dir(configs())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    found.sort();
    let mut names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    assert_eq!(found, names);
    for (name, text) in SHIPPED {
        assert_eq!(fs::read_to_string(configs().join(format!("{name}.toml"))).unwrap(), text);
        assert_eq!(shipped(name), Some(text));
    }
    assert_eq!(shipped("meadow"), None);
}

#[test]
fn every_shipped_file_checks_and_can_be_played() {
    for (name, _) in SHIPPED {
        for cell in Document::open(name).unwrap().cells(None).unwrap() {
            let mut env = Env::new(&cell.scenario);
            env.reset(1);
            assert_eq!(env.summary().weeds_total, cell.scenario.weeds.count as usize);
        }
    }
}

/// Opened by its path a file is the same as by its shipped name.
#[test]
fn a_shipped_name_and_its_file_are_the_same_scenario() {
    for name in ["default", "pasture", "cowbot-field"] {
        let path = configs().join(format!("{name}.toml"));
        let by_path = Document::open(path.to_str().unwrap()).unwrap();
        let by_name = Document::open(name).unwrap();
        assert_eq!(by_path.name(), by_name.name());
        assert_eq!(by_path.scenario().unwrap(), by_name.scenario().unwrap());
    }
}

#[test]
fn the_default_file_is_the_default_scenario() {
    let default = Document::open("default").unwrap().scenario().unwrap();
    assert_eq!(*default, Scenario::default());
    assert_eq!(default, Document::empty("nothing").scenario().unwrap());
}

#[test]
fn the_default_file_lists_every_key_there_is_and_no_other() {
    let shown = keys_shown(shipped("default").unwrap());
    assert_eq!(shown, keys_of_the_schema());
    assert!(shown.contains("weeds.positions_m") && shown.contains("id"), "{shown:?}");
}

/// Only what has no default stands behind a `#`, so that every default is one that was read.
#[test]
fn the_default_file_gives_a_value_to_every_key_with_a_default() {
    let given: Table = shipped("default").unwrap().parse().unwrap();
    let written: Table = Scenario::default().check().unwrap().to_toml().parse().unwrap();
    assert_eq!(given, written);
}

/// The examples behind `#` are good ones; whoever gives weeds leaves out their number, as the file says.
#[test]
fn the_commented_examples_of_the_default_file_can_be_used() {
    let text = shipped("default").unwrap().replace("# positions_m = ", "positions_m = ");
    assert_eq!(
        Document::parse("default", &text, Path::new(""))
            .unwrap()
            .scenario()
            .unwrap_err()
            .to_string(),
        "`weeds.count` must be left out or 2, as many as weeds.positions_m gives, got 40"
    );
    let text = text.replace("count = 40 ", "# count = 40 ");
    let scenario = Document::parse("default", &text, Path::new("")).unwrap().scenario().unwrap();
    assert_eq!(scenario.weeds.positions_m, Some(vec![[12.0, 3.5], [40.0, 20.0]]));
}

/// 100 x 40 m, B = R = 2, `S_d` = `S_w` = 12, 40 weeds, no limit outside; 36 x 26 m, 14 weeds, B = 1.3, R = 1.5.
#[test]
fn the_papers_pastures_have_the_papers_numbers() {
    let numbers = |name: &str| {
        let scenario = Document::open(name).unwrap().scenario().unwrap();
        let Site { length_m, width_m, headland_m, deck_width_m, turning_radius_m, .. } =
            Site::new(&scenario);
        let sensor = (scenario.sensor.range_m, scenario.sensor.width_m);
        let weeds = (scenario.weeds.count, scenario.weeds.distribution);
        ([length_m, width_m, headland_m, deck_width_m, turning_radius_m], sensor, weeds)
    };
    let inf = f64::INFINITY;
    assert_eq!(
        numbers("pasture"),
        ([100.0, 40.0, inf, 2.0, 2.0], (12.0, 12.0), (40, Distribution::Uniform))
    );
    assert_eq!(
        numbers("cowbot-field"),
        ([36.0, 26.0, inf, 1.3, 1.5], (12.0, 12.0), (14, Distribution::Uniform))
    );
}

fn cells(only: Option<&str>) -> Vec<Cell> {
    Document::open("table1").unwrap().cells(only).unwrap()
}

fn columns(cells: &[Cell]) -> Vec<&str> {
    cells[0].values.iter().map(|(key, _)| key.as_str()).collect()
}

/// 2 distributions x 6 counts; and 5 radii, widths and ranges, each with all twelve.
#[test]
fn table_1_has_12_and_60_and_60_and_60_cells() {
    for (sweep, expected) in
        [("density", 12), ("turning-radius", 60), ("sensor-width", 60), ("sensor-range", 60)]
    {
        let cells = cells(Some(sweep));
        assert_eq!(cells.len(), expected, "{sweep}");
        assert!(cells.iter().all(|cell| cell.name == format!("table1/{sweep}")));
    }
    let all = cells(None);
    assert_eq!(all.len(), 12 + 60 + 60 + 60);
    assert_eq!(all[0].name, "table1/density");
    assert_eq!(all[191].name, "table1/sensor-range");
}

#[test]
fn one_sweep_has_the_columns_of_its_keys_and_all_sweeps_those_of_all() {
    assert_eq!(columns(&cells(Some("density"))), ["weeds.distribution", "weeds.count"]);
    assert_eq!(
        columns(&cells(Some("turning-radius"))),
        ["mower.turning_radius_m", "weeds.distribution", "weeds.count"]
    );
    let all = cells(None);
    let expected = [
        "weeds.distribution",
        "weeds.count",
        "mower.turning_radius_m",
        "sensor.width_m",
        "sensor.range_m",
    ];
    for cell in &all {
        assert_eq!(columns(std::slice::from_ref(cell)), expected);
    }
}

/// The last key runs fastest; keys that a sweep leaves alone show the value that the scenario has.
#[test]
fn the_values_of_a_cell_are_those_of_its_scenario() {
    let density: Vec<(String, i64)> = cells(Some("density"))
        .iter()
        .map(|cell| {
            let [(_, distribution), (_, count)] = &cell.values[..] else { panic!("two columns") };
            (distribution.as_str().unwrap().to_owned(), count.as_integer().unwrap())
        })
        .collect();
    let counts = [20, 40, 80, 160, 320, 640];
    let expected: Vec<(String, i64)> = ["uniform", "gaussian"]
        .iter()
        .flat_map(|distribution| counts.map(|count| ((*distribution).to_owned(), count)))
        .collect();
    assert_eq!(density, expected);
    for cell in cells(None) {
        let scenario = &cell.scenario;
        let distribution = match scenario.weeds.distribution {
            Distribution::Uniform => "uniform",
            Distribution::Gaussian => "gaussian",
        };
        let expected = [
            Value::String(distribution.to_owned()),
            Value::Integer(i64::from(scenario.weeds.count)),
            Value::Float(scenario.mower.turning_radius_m),
            Value::Float(scenario.sensor.width_m),
            Value::Float(scenario.sensor.range_m),
        ];
        assert_eq!(
            cell.values.iter().map(|(_, value)| value.clone()).collect::<Vec<_>>(),
            expected
        );
    }
}

/// Table I holds R in 1 to 5, `S_w` and `S_d` in 4 to 20, the others at 2, 12 and 12.
#[test]
fn every_value_of_table_1_is_run_with_the_others_at_their_defaults() {
    let distinct = |sweep: &str, key: &str| {
        let value_of = |cell: &Cell| {
            let text: Table = cell.scenario.to_toml().parse().unwrap();
            let (block, key) = key.split_once('.').unwrap();
            text[block][key].as_float().unwrap()
        };
        let mut values: Vec<f64> = cells(Some(sweep)).iter().map(value_of).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let (five, sizes) = (vec![1.0, 2.0, 3.0, 4.0, 5.0], vec![4.0, 8.0, 12.0, 16.0, 20.0]);
    for (sweep, radii, widths, ranges) in [
        ("density", vec![2.0], vec![12.0], vec![12.0]),
        ("turning-radius", five, vec![12.0], vec![12.0]),
        ("sensor-width", vec![2.0], sizes.clone(), vec![12.0]),
        ("sensor-range", vec![2.0], vec![12.0], sizes),
    ] {
        assert_eq!(distinct(sweep, "mower.turning_radius_m"), radii, "{sweep}");
        assert_eq!(distinct(sweep, "sensor.width_m"), widths, "{sweep}");
        assert_eq!(distinct(sweep, "sensor.range_m"), ranges, "{sweep}");
    }
}
