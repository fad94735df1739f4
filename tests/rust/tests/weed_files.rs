//! Weeds from a CSV file: what is read, and what is refused with the file's name and the number of the line.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::fs;
use std::path::PathBuf;

use swath_core::config::{Document, ValidScenario};
use swath_core::env::Env;
use swath_core::geometry::Point;

/// A folder of its own for a test, with a weed file in it.
fn folder(test: &str, weeds: &[u8]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("weeds.csv"), weeds).unwrap();
    folder
}

/// The scenario of a document in that folder.
fn scenario_with(test: &str, weeds: &[u8]) -> Result<ValidScenario, String> {
    let text = "[weeds]\nfile = \"weeds.csv\"\n";
    let document = Document::parse("meadow", text, &folder(test, weeds)).unwrap();
    document.scenario().map_err(|error| error.to_string())
}

fn weeds_in(test: &str, weeds: &[u8]) -> Vec<[f64; 2]> {
    let scenario = scenario_with(test, weeds).unwrap();
    assert_eq!(scenario.weeds.file, None, "a file that was read is not read again");
    let positions_m = scenario.weeds.positions_m.clone().unwrap();
    assert_eq!(scenario.weeds.count as usize, positions_m.len());
    positions_m
}

fn refusal(test: &str, weeds: &[u8]) -> String {
    let message = scenario_with(test, weeds).unwrap_err();
    assert_eq!(message.lines().count(), 1, "{message:?}");
    message
}

#[test]
fn weeds_are_read_with_and_without_names_for_the_columns() {
    let expected = [[12.0, 3.5], [40.25, 20.0], [0.0, 0.0]];
    for (test, text) in [
        ("plain", "12,3.5\n40.25,20\n0,0\n"),
        ("no-last-break", "12,3.5\n40.25,20\n0,0"),
        ("windows", "x_m,y_m\r\n12,3.5\r\n40.25,20\r\n0,0\r\n"),
        ("named", "x_m,y_m\n12,3.5\n40.25,20\n0,0\n"),
        ("short-names", "x,y\n12,3.5\n40.25,20\n0,0\n"),
        ("other-columns", "number,y_m,x_m,height_m\n1,3.5,12,0.1\n2,20,40.25,0.2\n3,0,0,0.3\n"),
        ("extra-column", "12,3.5,dock\n40.25,20,dock\n0,0,dock\n"),
        ("spaces", " 12 , 3.5 \n 40.25 , 20 \n 0 , 0 \n"),
        ("comments", "# surveyed in May\nx_m,y_m\n12,3.5\n# by the gate\n40.25,20\n0,0\n"),
        ("blank-lines", "12,3.5\n\n40.25,20\n\n0,0\n\n"),
        ("quoted", "\"x_m\",\"y_m\"\n\"12\",\"3.5\"\n40.25,20\n0,0\n"),
        ("exponents", "1.2e1,35e-1\n40.25,2E1\n0,-0\n"),
        ("spreadsheet", "\u{feff}x_m,y_m\n12,3.5\n40.25,20\n0,0\n"),
        ("spreadsheet-plain", "\u{feff}12,3.5\n40.25,20\n0,0\n"),
    ] {
        assert_eq!(weeds_in(test, text.as_bytes()), expected, "{test}");
    }
}

#[test]
fn a_file_without_weeds_is_a_pasture_without_weeds() {
    assert!(weeds_in("empty", b"").is_empty());
    assert!(weeds_in("names-only", b"x_m,y_m\n").is_empty());
}

#[test]
fn weeds_of_a_file_stand_on_the_pasture_in_the_order_of_the_file() {
    let scenario = scenario_with("stand", b"5,5\n1,2\n").unwrap();
    let mut env = Env::new(&scenario);
    env.reset(9);
    assert_eq!(env.weeds().positions(), [Point::new(5.0, 5.0), Point::new(1.0, 2.0)]);
}

#[test]
fn a_line_that_is_no_weed_is_refused_with_its_number() {
    for (test, text, line, got) in [
        ("word", "12,3.5\n40,north\n0,0\n", 2, "`40,north`"),
        ("one-number", "12,3.5\n40,20\n7\n", 3, "`7`"),
        ("nan", "x_m,y_m\n12,3.5\nNaN,2\n", 3, "`NaN,2`"),
        ("infinite", "12,inf\n", 1, "`12,inf`"),
        ("empty-cell", "12,\n", 1, "`12,`"),
        ("after-comments", "# one\n# two\n1,1\n\n# three\n2,two\n", 6, "`2,two`"),
        ("decimal-comma", "x_m;y_m\n12,5;3,5\n", 1, "`x_m;y_m`"),
        ("wrong-names", "east,north\n12,3.5\n", 1, "`east,north`"),
        ("names-in-the-middle", "1,1\nx_m,y_m\n2,2\n", 2, "`x_m,y_m`"),
        ("short-after-names", "id,x_m,y_m\n1,2,3\n2,3\n", 3, "`2,3`"),
    ] {
        assert_eq!(
            refusal(test, text.as_bytes()),
            format!(
                "`weeds.file` weeds.csv, line {line}: expected two finite numbers, x and y in metres, got {got}"
            ),
            "{test}"
        );
    }
}

#[test]
fn bytes_that_are_no_text_are_refused_with_the_file() {
    let message = refusal("latin", b"12,3.5\n40,\xfcber\n");
    assert!(message.contains("`weeds.file` weeds.csv"), "{message}");
    assert!(message.contains("line 2"), "{message}");
}

#[test]
fn a_line_break_in_a_quoted_cell_does_not_break_the_message() {
    let message = refusal("broken-cell", b"12,3.5\n\"4\n0\",20\n");
    assert!(message.starts_with("`weeds.file` weeds.csv, line 2: "), "{message}");
}

#[test]
fn a_weed_of_a_file_that_is_off_the_pasture_is_refused() {
    let message = refusal("off", b"12,3.5\n101,20\n");
    assert!(message.contains("must be on the pasture"), "{message}");
    assert!(message.ends_with(", got [101, 20]"), "{message}");
}

/// Whoever gave a file looks for the weed in the file, not in a key that the scenario does not have.
#[test]
fn a_weed_of_a_file_that_is_off_the_pasture_is_refused_with_file_and_line() {
    let message = refusal("off-line", b"x_m,y_m\n12,3.5\n101,20\n");
    assert!(message.contains("weeds.csv") && message.contains("line 3"), "{message}");
}

#[test]
fn a_file_that_cannot_be_read_is_refused_by_its_name() {
    let folder = folder("missing", b"");
    for name in ["none.csv", "."] {
        let text = format!("[weeds]\nfile = \"{name}\"\n");
        let document = Document::parse("meadow", &text, &folder).unwrap();
        let message = document.scenario().unwrap_err().to_string();
        assert!(message.starts_with(&format!("cannot read `weeds.file` {name}: ")), "{message}");
        assert_eq!(message.lines().count(), 1, "{message:?}");
        // The folder is nobody's business but the machine's.
        assert!(!message.contains(&*folder.to_string_lossy()), "{message}");
    }
}

#[test]
fn weeds_given_in_two_ways_are_refused() {
    let folder = folder("both", b"1,1\n");
    let text = "[weeds]\nfile = \"weeds.csv\"\npositions_m = [[2.0, 2.0]]\n";
    let message =
        Document::parse("meadow", text, &folder).unwrap().scenario().unwrap_err().to_string();
    assert_eq!(
        message,
        "`weeds.file` must be absent where weeds.positions_m is given, got weeds.csv"
    );
}

/// A file is looked for beside the scenario that names it, not where the program was started.
#[test]
fn a_file_is_found_beside_its_scenario() {
    let folder = folder("beside", b"7,7\n");
    let path = folder.join("meadow.toml");
    fs::write(&path, "[weeds]\nfile = \"weeds.csv\"\n").unwrap();
    let document = Document::open(path.to_str().unwrap()).unwrap();
    assert_eq!(document.name(), "meadow");
    assert_eq!(document.scenario().unwrap().weeds.positions_m, Some(vec![[7.0, 7.0]]));
}

#[test]
fn a_count_that_is_not_that_of_the_file_is_refused() {
    let folder = folder("counted", b"12,3.5\n40.25,20\n");
    let with = |count: u32| {
        let text = format!("[weeds]\ncount = {count}\nfile = \"weeds.csv\"\n");
        Document::parse("meadow", &text, &folder).unwrap().scenario()
    };
    assert_eq!(
        with(3).unwrap_err().to_string(),
        "`weeds.count` must be left out or 2, as many as weeds.file gives, got 3"
    );
    // What is written out says how many there are, and reads back the same.
    let scenario = with(2).unwrap();
    let again = Document::parse("meadow", &scenario.to_toml(), &folder).unwrap();
    assert_eq!(again.scenario().unwrap(), scenario);
}
