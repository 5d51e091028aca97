//! Reads files of instruments and programs and compares the results with those of other readers.

use std::fs;
use std::path::{Path, PathBuf};

use asperity_topography_files::{Statistics, read};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/topography")
}

/// Parses a number, or returns `None` for an empty cell.
fn number(cell: &str) -> Option<f64> {
    (!cell.is_empty()).then(|| cell.parse().unwrap())
}

#[test]
fn files_agree_with_other_readers() {
    let truth = fs::read_to_string(folder().join("truth.csv")).unwrap();
    let rows: Vec<Vec<&str>> =
        truth.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert!(rows.len() > 8);
    for (index, row) in rows.iter().enumerate() {
        // Rows with equal file and channel names are about different channels, in order.
        let before = rows[..index].iter().filter(|other| other[..2] == row[..2]);
        agrees(row, before.count());
    }
}

#[track_caller]
fn agrees(row: &[&str], before: usize) {
    let [name, channel] = [row[0], row[1]];
    let bytes = fs::read(folder().join(name)).unwrap();
    let file = read(&bytes).unwrap_or_else(|error| panic!("{name}: {error:?}"));
    let mut named = file.channels().iter().filter(|known| known.name() == channel);
    let channel = named.nth(before).unwrap_or(&file.channels()[0]);
    let map = channel.map();
    let statistics = Statistics::new(&map);
    let heights = statistics.heights.unwrap();
    let corners = statistics.corners;
    let sides = channel.size().sides();
    let found = [
        Some(map.nodes()[0] as f64),
        Some(map.nodes()[1] as f64),
        sides.map(|[x, _]| x),
        sides.map(|[_, y]| y),
        Some(statistics.missing as f64),
        Some(heights.rms_height),
        Some(heights.lowest),
        Some(heights.highest),
        corners.first,
        corners.x_end,
        corners.y_end,
        corners.last,
    ];
    for (column, found) in found.into_iter().enumerate() {
        let expected = number(row[2 + column]);
        // Readers round sides and rms heights differently because they sum in another order.
        let tolerance = if [2, 3, 5].contains(&column) { 1e-9 } else { 1e-12 };
        let agree = match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() <= tolerance * expected.abs(),
            (found, expected) => found.is_none() && expected.is_none(),
        };
        assert!(agree, "{name}, column {column}: {found:?}, expected {expected:?}");
    }
}

#[test]
fn rows_of_gwyddion_run_along_x() {
    let bytes = fs::read(folder().join("test.gwy")).unwrap();
    let map = read(&bytes).unwrap().channels()[0].map();
    // Five digits of row 44, column 33, as read by `gwyfile`, which wrote the file.
    assert!((map.get(33, 44).unwrap() - 8.5301e-4).abs() < 1e-8);
    assert!((map.get(0, 0).unwrap() - 8.2494e-4).abs() < 1e-8);
    let rms = Statistics::new(&map).heights.unwrap().rms_height;
    assert!((rms - 1.87711262e-4).abs() < 5e-13);
}
