//! Repairs of measured maps, and the part of the contact on filled nodes.

use std::fs;
use std::sync::LazyLock;

use arrow::array::Array as _;

use crate::bench::{Bench, text};
use crate::manifest::manifest;

/// Returns a text file of a map with a step of 1 µm and heights in µm. Missing points are NaN.
fn text_file(nodes: [usize; 2], height: impl Fn(usize, usize) -> f64) -> String {
    let [nodes_x, nodes_y] = nodes;
    let lines = (0..nodes_y).map(|j| {
        let line = (0..nodes_x).map(|i| height(i, j).to_string());
        line.collect::<Vec<_>>().join(" ")
    });
    let lines: Vec<_> = lines.collect();
    let header = format!("# Width: {nodes_x} µm\n# Height: {nodes_y} µm\n# Value units: µm\n");
    header + &lines.join("\n")
}

fn is_hole(i: usize, j: usize) -> bool {
    (4..9).contains(&i) && (4..9).contains(&j)
}

/// Returns the height of a wave along x with an offset of each line, a spike, and an island of one
/// point in a hole.
fn damaged(i: usize, j: usize) -> f64 {
    if is_hole(i, j) && (i, j) != (6, 6) {
        return f64::NAN;
    }
    let spike = if (i, j) == (20, 12) { 3.0 } else { 0.0 };
    (0.3 * i as f64).sin() + (7.0 * (j * j) as f64).sin() + spike
}

static DAMAGED: LazyLock<String> = LazyLock::new(|| {
    manifest("repaired", "")
        .generate(
            "scan",
            "method = 'file'; path = 'scan.txt'; periodic = false; spikes = [8, 1000]; \
             islands = 1; align = 'differences'; fill = 'nearest'",
        )
        .text()
});

#[test]
fn removed_points_are_counted_and_told() {
    let bench = Bench::new();
    fs::write(bench.path("scan.txt"), text_file([32, 24], damaged)).unwrap();
    let manifest = bench.write(&DAMAGED);
    let manifest = manifest.to_str().unwrap();
    let checked = text(&bench.output(&["check", manifest]).stderr);
    let told =
        "24 of 768 points of `scan.txt` were not measured and 2 were removed as spikes or islands";
    assert!(checked.contains(told), "{checked}");
    let run = bench.output(&["run", manifest]);
    let printed = text(&run.stdout) + &text(&run.stderr);
    let summary = "1 spike removed, 1 point of islands removed, 26 missing nodes filled";
    assert!(printed.contains(summary), "{printed}");

    let scan = bench.table("repaired", "scan");
    let counts = |name: &str| scan.integers(name).unwrap().values().to_vec();
    assert_eq!(scan.reals("spikes").unwrap().values().to_vec(), [8.0, 1000.0]);
    assert_eq!(counts("spike_window"), [5, 5]);
    assert_eq!(counts("removed_spikes"), [1, 0]);
    assert_eq!(counts("removed_islands"), [1, 1]);
    assert_eq!(counts("filled_nodes"), [26, 25]);
    assert_eq!(scan.texts("align").unwrap().value(0), "differences");
    assert_eq!(scan.texts("align_along").unwrap().value(0), "x");
    // Without the spike, the aligned map is a wave along x, except at the edges of filled points.
    let slopes = scan.reals("m02").unwrap();
    assert!(slopes.value(0) < 0.05 * slopes.value(1), "{slopes:?}");

    let unfilled = DAMAGED.replace("fill = \"nearest\"", "").replace("[8, 1000]", "8");
    let refused = bench.output(&["check", bench.write(&unfilled).to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2));
    // The terminal wraps the message.
    let refused = text(&refused.stderr);
    let words: Vec<&str> = refused.split_whitespace().filter(|word| *word != "|").collect();
    let told = "`spikes` removed 1 and `islands` removed 1 of them";
    assert!(words.join(" ").contains(told), "{refused}");
}

#[test]
fn every_repair_is_swept() {
    let bench = Bench::new();
    fs::write(bench.path("scan.txt"), text_file([32, 24], damaged)).unwrap();
    let cases = r#"fill = "nearest"
islands = [1, 2]
cases = [
    { align = "median" },
    { align = "median", align_along = "y" },
    { align = "polynomial", align_degree = 3 },
    { level_through = { a = ["2 um", "0 um"], b = ["30 um", "0 um"], c = ["0 um", "20 um"] } },
]
"#;
    bench.run(&[DAMAGED.split("spikes").next().unwrap(), cases].concat());
    let scan = bench.table("repaired", "scan");
    assert_eq!(scan.rows(), 8);
    assert_eq!(scan.texts("align_along").unwrap().value(2), "y");
    assert_eq!(scan.integers("align_degree").unwrap().value(4), 3);
    let position = scan.reals("level_b_x").unwrap();
    assert!(position.is_null(0) && (position.value(6) / 30e-6 - 1.0).abs() < 1e-12);
}

/// Returns the heights of a frame around a hole, high above everything else.
fn frame(i: usize, j: usize) -> f64 {
    let is_in = |from: usize, to: usize| (from..to).contains(&i) && (from..to).contains(&j);
    match (is_in(6, 10), is_in(5, 11)) {
        (true, _) => f64::NAN,
        (false, true) => 1.0,
        _ => -9.0 - 0.1 * ((i + 2 * j) % 5) as f64,
    }
}

static FRAME: LazyLock<String> = LazyLock::new(|| {
    manifest("framed", "")
        .generate(
            "scan",
            "method = 'file'; path = ['frame.txt', 'whole.txt']; periodic = false; \
             edges = 'mirror'; fill = 'harmonic'",
        )
        .solve("contact", "effective_modulus = 1e9; loads = [1e-4, 1e-3]")
        .measure("area", "")
        .text()
});

#[test]
fn the_filled_share_of_a_frame_in_contact_is_that_of_its_hole() {
    let bench = Bench::new();
    fs::write(bench.path("frame.txt"), text_file([16, 16], frame)).unwrap();
    let whole = |i, j| if frame(i, j).is_nan() { 1.0 } else { frame(i, j) };
    fs::write(bench.path("whole.txt"), text_file([16, 16], whole)).unwrap();
    let run = bench.output(&["run", bench.write(&FRAME).to_str().unwrap()]);
    let printed = text(&run.stdout) + &text(&run.stderr);
    let warning = "up to 44.4 % of the contact area is on filled nodes, not measured";
    assert!(printed.contains(warning), "{printed}");
    let area = bench.table("framed", "area");
    assert_eq!(area.rows(), 4);
    let (nodes, shares) =
        (area.integers("contact_nodes").unwrap(), area.reals("filled_area_share").unwrap());
    for row in 0..2 {
        assert_eq!(nodes.value(row), 4 * 36);
        assert!((shares.value(row) - 16.0 / 36.0).abs() < 1e-15);
    }
    assert!(shares.is_null(2) && shares.is_null(3));
    assert!(!bench.table("framed", "contact").has("filled_area_share"));
}

#[test]
fn contacts_of_complete_maps_have_no_filled_share() {
    let bench = Bench::new();
    let rough = |i: usize, j: usize| (1.3 * i as f64).sin() * (0.9 * j as f64).cos();
    fs::write(bench.path("frame.txt"), text_file([16, 16], rough)).unwrap();
    bench.run(&FRAME.replace(", \"whole.txt\"", ""));
    assert!(!bench.table("framed", "area").has("filled_area_share"));
}
