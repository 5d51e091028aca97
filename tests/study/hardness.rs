//! Materials that yield, through the command.

use std::fs;

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;
use asperity::store::table::Table;
use serde_json::Value;

use crate::bench::{Bench, is_idle, text};
use crate::reference::{column, reference};

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().values().to_vec()
}

fn counts(table: &Table, name: &str) -> Vec<i64> {
    table.integers(name).unwrap().values().to_vec()
}

/// Every column but that of keys.
fn without_keys(table: &Table) -> Table {
    table.without(&["task"])
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let error = (found / expected - 1.0).abs();
        assert!(error <= tolerance, "{found} should be {expected}");
    }
}

/// Contact and saturation at each load: bits most significant first behind a header of 128 bytes.
fn maps_by_others(name: &str) -> Vec<Vec<bool>> {
    let bytes = fs::read(reference(&format!("hardness/{name}_maps.npy"))).unwrap();
    let bits = |byte: &u8| [7, 6, 5, 4, 3, 2, 1, 0].map(|bit| byte >> bit & 1 == 1);
    let maps = bytes[128..].chunks(128 * 128 / 8);
    maps.map(|map| map.iter().flat_map(bits).collect())
        .collect()
}

#[test]
fn contact_and_saturation_are_what_another_code_finds() {
    for name in ["h128_hard03", "h128_hard08"] {
        let csv = fs::read_to_string(reference("hardness/hardness.csv")).unwrap();
        let is_wanted = |line: &&str| line.starts_with("name,") || line.starts_with(name);
        let csv: Vec<&str> = csv.lines().filter(is_wanted).collect();
        let csv = csv.join("\n");
        let of_others = |name: &str| column(&csv, name);
        let bench = Bench::new();
        let file = format!("{name}.npy");
        fs::copy(reference("hardness").join(&file), bench.path(&file)).unwrap();
        let hardness = of_others("hardness")[0];
        bench.run(&format!(
            r#"
[study]
name = "outside"

[stage.scan]
kind = "generate"
method = "file"
path = "{file}"
side = 1.0
periodic = true

[stage.contact]
kind = "solve"
from = "scan"
effective_modulus = 1.0
hardness = {hardness:?}
loads = {:?}
load_unit = "absolute"
tolerance = 1e-8
pressures = "all"

[stage.area]
kind = "measure"
from = "contact"
"#,
            of_others("pressure"),
        ));
        let area = bench.table("outside", "area");
        for (here, there) in [
            ("contact_nodes", "contact_nodes"),
            ("saturated_nodes", "saturated_nodes"),
            ("switches_along_columns", "switches_x"),
            ("switches_along_rows", "switches_y"),
            ("clusters", "clusters"),
        ] {
            let found: Vec<f64> = counts(&area, here).iter().map(|&n| n as f64).collect();
            assert_eq!(found, of_others(there), "{name}: {here}");
        }
        let cells = 128.0 * 128.0;
        let [open, yielded] = ["contact_nodes", "saturated_nodes"].map(of_others);
        let gaps = of_others("mean_gap_outside").into_iter().zip(open);
        let gaps: Vec<f64> = gaps.map(|(gap, n)| gap * (1.0 - n / cells)).collect();
        assert_near(&reals(&area, "mean_gap"), &gaps, 1e-6);
        let depths = of_others("mean_penetration").into_iter().zip(&yielded);
        let depths: Vec<f64> = depths.map(|(depth, n)| depth * n / cells).collect();
        assert_near(&reals(&area, "mean_yielded_depth"), &depths, 1e-6);
        let shares: Vec<f64> = yielded.iter().map(|n| n / cells).collect();
        assert_eq!(reals(&area, "saturated_fraction"), shares);
        assert_eq!(reals(&area, "hardness"), vec![hardness; shares.len()]);
        let contact = bench.with_maps("outside", "contact");
        assert_near(
            &reals(&contact, "peak_pressure"),
            &of_others("peak_pressure"),
            1e-12,
        );
        let pressures = contact.lists("pressures").unwrap();
        for (load, maps) in maps_by_others(name).chunks(2).enumerate() {
            let list = pressures.value(load);
            let list = list.as_primitive::<Float64Type>();
            let touches: Vec<bool> = list.iter().map(|p| p.is_some()).collect();
            assert!(touches == maps[0], "{name}, load {load}");
            let saturated = |p: Option<f64>| p.is_some_and(|p| p > (1.0 - 1e-12) * hardness);
            assert!(list.iter().map(saturated).eq(maps[1].iter().copied()));
        }
    }
}

const SMALL: &str = r#"
[study]
name = "yielding"
seed = 3

[stage.rough]
kind = "generate"
nodes = 48
hurst = 0.8
k_lower = 2
k_upper = 12
rms_slope = 0.02
realizations = 2

[stage.contact]
kind = "solve"
from = "rough"
effective_modulus = 2.0
loads = [0.01, 0.05, 0.2, 2.0, 4.0]

[stage.area]
kind = "measure"
from = "contact"
"#;

/// The tables of contacts and of areas with these lines in the stage that presses.
fn pressed(lines: &str) -> (Bench, [Table; 2]) {
    let bench = Bench::new();
    let manifest = SMALL.replace(
        "from = \"rough\"\n",
        &format!("from = \"rough\"\n{lines}\n"),
    );
    bench.run(&manifest);
    let tables = ["contact", "area"].map(|stage| bench.table("yielding", stage));
    (bench, tables)
}

#[test]
fn a_hardness_that_nothing_reaches_changes_no_bit() {
    for boundary in ["periodic", "free"] {
        let lines = format!("boundary = \"{boundary}\"");
        let (_, elastic) = pressed(&lines);
        let (_, hard) = pressed(&format!("{lines}\nhardness = 1e9"));
        for (elastic, hard) in elastic.iter().zip(&hard) {
            let elastic = without_keys(elastic);
            assert_eq!(hard.only(&elastic.names()), elastic, "{boundary}");
            assert!(counts(hard, "saturated_nodes").iter().all(|n| *n == 0));
            assert!(reals(hard, "mean_yielded_depth").iter().all(|d| *d == 0.0));
            assert!(!elastic.has("hardness") && !elastic.has("saturated_nodes"));
        }
    }
}

#[test]
fn a_hardness_in_either_unit_is_the_same() {
    let loads = SMALL.replace("0.2, 2.0, 4.0]", "0.2]");
    let run = |lines: &str| {
        let bench = Bench::new();
        bench.run(&loads.replace(
            "from = \"rough\"\n",
            &format!("from = \"rough\"\n{lines}\n"),
        ));
        ["contact", "area"].map(|stage| without_keys(&bench.table("yielding", stage)))
    };
    let relative = run("hardness = [0.3, 0.8]\nhardness_unit = \"relative\"");
    let absolute = run("hardness = [0.012, 0.032]");
    assert_eq!(relative, absolute);
    let [contact, _] = relative;
    assert_eq!(contact.rows(), 2 * 2 * 3);
    let [hardness, reduced] = ["hardness", "hardness_reduced"].map(|name| reals(&contact, name));
    assert_eq!(hardness, [[0.012; 6], [0.032; 6]].concat());
    assert_eq!(reduced, [[0.3; 6], [0.8; 6]].concat());
}

#[test]
fn what_saturates_bears_no_more_than_the_load_and_the_rest_must_touch_for_it() {
    for boundary in ["periodic", "free"] {
        // 4.1 in units of E* × rms slope: the last load is nearly all that it bears.
        let lines = format!("hardness = 0.164\nboundary = \"{boundary}\"");
        let (_, [contact, area]) = pressed(&lines);
        let [hardness, pressure, shares, peaks, depths] = [
            "hardness",
            "pressure",
            "saturated_fraction",
            "peak_pressure",
            "mean_yielded_depth",
        ]
        .map(|name| reals(&contact, name));
        let areas = reals(&area, "area_fraction");
        assert!(shares.iter().any(|share| *share > 0.1), "{shares:?}");
        for row in 0..contact.rows() {
            let bearable = pressure[row] / hardness[row];
            assert!(shares[row] <= bearable * (1.0 + 1e-12), "{boundary}");
            assert!(areas[row] >= bearable * (1.0 - 1e-12), "{boundary}");
            assert_eq!(depths[row] > 0.0, shares[row] > 0.0);
            let is_saturated = peaks[row] >= hardness[row] * (1.0 - 1e-12);
            assert_eq!(is_saturated, shares[row] > 0.0);
        }
        assert_eq!(contact.has("mean_displacement"), boundary == "free");
    }
}

#[test]
fn hardnesses_are_parameter_points() {
    let curves = r#"
[stage.curves]
kind = "aggregate"
from = "area"
over = ["saturated_fraction", "area_fraction"]
statistics = ["mean"]

[stage.asked]
kind = "aggregate"
from = "contact"
sql = "SELECT hardness, SUM(saturated_nodes) AS nodes FROM contact GROUP BY hardness ORDER BY hardness"
"#;
    let bench = Bench::new();
    bench.run(SMALL);
    let points = "cases = [{}, { hardness = 0.2 }, { hardness = 0.3 }]";
    let with_cases = SMALL.replace(
        "from = \"rough\"\n",
        &format!("from = \"rough\"\n{points}\n"),
    );
    let counts_of = bench.run(&format!("{with_cases}{curves}"));
    // What nothing bounds is the recipe that it was.
    assert_eq!(counts_of["contact"].cached, 2);
    let means = bench.table("yielding", "curves");
    let known: Vec<Option<f64>> = means.reals("hardness").unwrap().iter().collect();
    for hardness in [None, Some(0.2), Some(0.3)] {
        let loads = known.iter().filter(|known| **known == hardness).count();
        assert!((4..=5).contains(&loads), "{hardness:?}: {loads}");
    }
    assert!(counts(&means, "count").iter().all(|count| *count == 2));
    let asked = bench.table("yielding", "asked");
    assert_eq!(asked.rows(), 3);
    let nodes = asked.integers("nodes").unwrap();
    assert!(
        nodes.value(1) > nodes.value(2),
        "the softer one yields more"
    );
}

#[test]
fn loads_go_on_beyond_full_contact_as_long_as_the_material_yields_there() {
    let wave = |hardness: f64| {
        let bench = Bench::new();
        // Full contact at 1/√2, where the peak is twice as high; crests yield beyond 1.061 of load.
        bench.run(&format!(
            "
[study]
name = \"wave\"
[stage.wave]
kind = \"generate\"
method = \"wave\"
nodes = 32
amplitude = 0.01
waves = 1
[stage.contact]
kind = \"solve\"
from = \"wave\"
hardness = {hardness}
hardness_unit = \"relative\"
loads = [0.4, 0.99, 1.27, 1.5]
"
        ));
        bench.table("wave", "contact")
    };
    let yields = wave(1.7678);
    let contact = counts(&yields, "contact_nodes");
    assert!(
        contact[0] < 1024 && contact[1..] == [1024; 3],
        "{contact:?}"
    );
    let saturated = counts(&yields, "saturated_nodes");
    assert_eq!(saturated[..2], [0, 0]);
    assert!(0 < saturated[2] && saturated[2] < saturated[3]);
    for gap in &reals(&yields, "mean_gap")[1..] {
        assert!((0.0..1e-15).contains(gap), "{gap}");
    }
    let stops = yields.texts("stop").unwrap();
    assert_eq!(
        [1, 2].map(|row| stops.value(row)),
        ["full-contact", "converged"]
    );
    assert_eq!(wave(1e3).rows(), 2);
}

#[test]
fn a_load_that_only_the_surface_shows_to_be_too_much_fails_and_leaves_the_rest() {
    let bench = Bench::new();
    let from = reference("hardness/h128_hard03.npy");
    fs::copy(from, bench.path("scan.npy")).unwrap();
    // 0.006 E* is 0.3 of E* × rms slope.
    let path = bench.write(
        "
[study]
name = \"overloaded\"
[stage.scan]
kind = \"generate\"
method = \"file\"
path = \"scan.npy\"
side = 1.0
periodic = true
[stage.contact]
kind = \"solve\"
from = \"scan\"
hardness = [0.006, 0.009]
loads = [0.1, 0.3]
",
    );
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    let told = text(&output.stderr);
    assert!(
        told.contains("the material does not bear the load"),
        "{told}"
    );
    assert!(told.contains("a mean pressure of 0.3"), "{told}");
    let contact = bench.table("overloaded", "contact");
    assert_eq!(reals(&contact, "hardness"), [0.009, 0.009]);
}

#[test]
fn pressures_beyond_the_hardness_of_bodies_are_told_and_change_nothing() {
    let bodies = |hardness: &str| {
        let body = "youngs_modulus = 2.0, poisson_ratio = 0.0";
        SMALL.replace(
            "effective_modulus = 2.0",
            &format!("bodies = [{{ {body}{hardness} }}]"),
        )
    };
    let bench = Bench::new();
    bench.run(&bodies(""));
    let before = bench.table("yielding", "contact");
    let peaks = reals(&before, "peak_pressure");
    let mut sorted = peaks.clone();
    sorted.sort_by(f64::total_cmp);
    let (hardness, beyond) = (0.5 * (sorted[2] + sorted[3]), peaks.len() - 3);

    let path = bench.write(&bodies(&format!(", hardness = {hardness:?}")));
    let path = path.to_str().unwrap();
    let output = bench.output(&["run", path, "--json"]);
    assert!(crate::bench::counts(&output.stdout).values().all(is_idle));
    let told = text(&output.stderr);
    let warned = format!("under {beyond} of {} loads", peaks.len());
    assert!(told.contains("warning: stage `contact`"), "{told}");
    assert!(told.contains(&warned), "{told}");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings = json["warnings"].as_array().unwrap();
    let of_contact = warnings.iter().find(|one| one["stage"] == "contact");
    let message = of_contact.unwrap()["message"].as_str().unwrap();
    assert!(message.contains(&warned), "{json}");
    assert_eq!(bench.table("yielding", "contact"), before);
    let page = bench.output(&["report", path, "--json"]);
    let said: Value = serde_json::from_slice(&page.stdout).unwrap();
    let page = fs::read_to_string(said["page"].as_str().unwrap()).unwrap();
    assert!(page.contains(&warned));

    for silent in [
        bodies(", hardness = 1e3"),
        bodies(", hardness = 0.2")
            .replace("from = \"rough\"\n", "from = \"rough\"\nhardness = 0.2\n"),
    ] {
        let path = bench.write(&silent);
        let output = bench.output(&["run", path.to_str().unwrap()]);
        let told = text(&output.stderr);
        assert!(!told.contains("passes the hardness"), "{told}");
    }
}
