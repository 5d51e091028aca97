//! Reads small files as instruments, exports and people write them, and compares the maps with
//! `data/topography/field/truth.json`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use asperity_topography_files::{Channel, Statistics, TopographyFile, formats, read};
use serde_json::Value;

/// Files that are not read right yet. The test fails as soon as one of them is.
const FAILING: &[&str] = &[];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/topography/field")
}

#[test]
fn field_files_show_their_truth() {
    let truth = fs::read_to_string(folder().join("truth.json")).unwrap();
    let truth: Vec<Value> = serde_json::from_str(&truth).unwrap();
    let of = |truth: &Value| truth["file"].as_str().unwrap().to_owned();
    let listed: BTreeSet<String> = truth.iter().map(of).collect();
    let names = fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name());
    let there = names.map(|name| name.into_string().unwrap()).filter(|name| name != "truth.json");
    assert_eq!(listed, there.collect(), "files and rows of truth.json");
    let mut wrong = Vec::new();
    for truth in &truth {
        let name = of(truth);
        let problems = problems(truth, &fs::read(folder().join(&name)).unwrap());
        match (problems.is_empty(), FAILING.contains(&name.as_str())) {
            (false, false) => wrong.push(format!("{name}: {}", problems.join("; "))),
            (true, true) => wrong.push(format!("{name} is read right: remove it from the list")),
            _ => {}
        }
    }
    assert!(wrong.is_empty(), "{} files:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_note_counts_the_points_under_a_mask() {
    let bytes = fs::read(folder().join("gwy_mask.gwy")).unwrap();
    let file = read(&bytes).unwrap();
    let channel = &file.channels()[0];
    let missing = Statistics::new(&channel.map()).missing;
    let note = format!(
        "{missing} points are under a mask and count as missing; `mask = false` keeps their heights"
    );
    assert!(missing > 1 && channel.notes() == [note], "{missing}: {:?}", channel.notes());
    let kept = channel.clone().without_mask();
    assert!(kept.notes().is_empty());
    let (all, masked) = (kept.map(), channel.map());
    assert_eq!(Statistics::new(&all).missing, 0);
    let mut pairs = masked.heights().iter().zip(all.heights());
    assert!(pairs.all(|(masked, all)| masked.is_nan() || masked == all));
}

#[test]
fn rows_about_other_readers_name_formats_and_files_that_are_read_right() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/disagreements.toml");
    let rows: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
    for row in rows["row"].as_array().unwrap() {
        let text = |name: &str| row[name].as_str().unwrap();
        assert!(formats().iter().any(|format| format.name() == text("format")), "{row}");
        for name in ["kind", "others", "asperity", "evidence"] {
            assert!(!text(name).is_empty() && !text(name).contains('|'), "{name} of {row}");
        }
        for file in row.get("files").and_then(|files| files.as_array()).into_iter().flatten() {
            let file = file.as_str().unwrap();
            assert!(folder().join(file).is_file() && !FAILING.contains(&file), "{file}");
        }
    }
}

/// Returns the differences between a file and its row of `truth.json`.
fn problems(truth: &Value, bytes: &[u8]) -> Vec<String> {
    let expect = truth["expect"].as_str().unwrap();
    match (read(bytes), expect) {
        (Err(_), "refuse" | "value or refuse") => vec![],
        (Err(error), _) => {
            let source = std::error::Error::source(&error);
            vec![format!("{error}: {}", source.map(ToString::to_string).unwrap_or_default())]
        }
        (Ok(_), "refuse") => vec!["it is read, but holds no map".to_owned()],
        (Ok(file), _) => match channel(&file, truth["channel"].as_str(), truth["unit"].as_str()) {
            Ok(channel) => differences(truth, channel),
            Err(problem) => vec![problem],
        },
    }
}

fn channel<'a, 'b>(
    file: &'a TopographyFile<'b>,
    name: Option<&str>,
    unit: Option<&str>,
) -> Result<&'a Channel<'b>, String> {
    let index = match name {
        Some(name) => file.find(name).map_err(|error| error.to_string())?,
        // The row of a file of phases is about the phases.
        None if unit.is_some_and(|unit| unit != "m") => {
            let mut channels = file.channels().iter();
            channels.position(|channel| channel.unit() == unit).unwrap_or(0)
        }
        None => file.default_channel().map_or(0, |one| one.index),
    };
    Ok(&file.channels()[index])
}

fn differences(truth: &Value, channel: &Channel<'_>) -> Vec<String> {
    let map = channel.map();
    let statistics = Statistics::new(&map);
    let heights = statistics.heights;
    let of_file = truth["file"].as_str().unwrap();
    let corners = &truth["corners"];
    let corner = |name: &str, index: usize| {
        if corners.is_array() { &corners[index] } else { &corners[name] }
    };
    let mut problems = Vec::new();
    let mut compare = |what: &str, expected: &Value, found: Option<f64>, tolerance: f64| {
        let expected = expected.as_f64();
        let agree = match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() <= tolerance,
            (found, expected) => found.is_none() && expected.is_none(),
        };
        if !agree {
            problems.push(format!("{what} is {found:?}, expected {expected:?}"));
        }
    };
    for axis in [0, 1] {
        let nodes = map.nodes()[axis] as f64;
        compare(["nodes_x", "nodes_y"][axis], &truth["nodes"][axis], Some(nodes), 0.0);
        let (expected, side) = (&truth["size"][axis], map.size().sides().map(|sides| sides[axis]));
        // Some headers store steps in single precision, or with seven digits.
        let tolerance = 1e-6 * expected.as_f64().unwrap_or(0.0);
        compare(["side_x", "side_y"][axis], expected, side, tolerance);
    }
    compare("missing", &truth["missing"], Some(statistics.missing as f64), 0.0);
    let [lowest, highest] = ["lo", "hi"].map(|name| truth[name].as_f64().unwrap());
    // BCRF has heights in single precision, Digital Surf their spacing and offset; texts round to
    // twelve digits.
    let is_single = ["bcrf", "sur"].iter().any(|suffix| of_file.ends_with(suffix));
    let [precision, of_rms] = if is_single { [3e-7; 2] } else { [1e-11, 1e-9] };
    let tolerance = precision * lowest.abs().max(highest.abs());
    compare("rms", &truth["rms"], heights.map(|h| h.rms_height), of_rms * (highest - lowest));
    compare("lowest", &truth["lo"], heights.map(|h| h.lowest), tolerance);
    compare("highest", &truth["hi"], heights.map(|h| h.highest), tolerance);
    if !corners.is_null() {
        let found = statistics.corners;
        let found = [
            ("first", found.first),
            ("x_end", found.x_end),
            ("y_end", found.y_end),
            ("last", found.last),
        ];
        for (index, (name, found)) in found.into_iter().enumerate() {
            compare(name, corner(name, index), found, tolerance);
        }
    }
    if channel.unit() != truth["unit"].as_str() {
        problems.push(format!("the unit is {:?}, expected {}", channel.unit(), truth["unit"]));
    }
    problems
}
