//! Materials with a hardness, from manifest to report.

use std::fs;
use std::sync::LazyLock;

use asperity::tables::table::Table;
use serde_json::Value;

use crate::bench::{Bench, is_idle, text};
use crate::manifest::{manifest, stages_from};
use crate::reference::{assert_near, with_hardness};

fn reals(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().values().to_vec()
}

fn counts(table: &Table, name: &str) -> Vec<i64> {
    table.integers(name).unwrap().values().to_vec()
}

/// Returns every column except the key of the task.
fn without_keys(table: &Table) -> Table {
    table.without(&["task"])
}

static SMALL: LazyLock<String> = LazyLock::new(|| {
    manifest("yielding", "seed = 3")
        .generate(
            "rough",
            "nodes = 48; hurst = 0.8; k_lower = 2; k_upper = 12; rms_slope = 0.02; \
             realizations = 2",
        )
        .solve("contact", "effective_modulus = 2.0; loads = [0.01, 0.05, 0.2, 2.0, 4.0]")
        .measure("area", "")
        .text()
});

/// Runs a study with these lines in its `solve` stage; returns the tables of contacts and areas.
fn pressed(lines: &str) -> (Bench, [Table; 2]) {
    let bench = Bench::new();
    let manifest = SMALL.replace("from = \"rough\"\n", &format!("from = \"rough\"\n{lines}\n"));
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
        bench.run(&loads.replace("from = \"rough\"\n", &format!("from = \"rough\"\n{lines}\n")));
        ["contact", "area"].map(|stage| without_keys(&bench.table("yielding", stage)))
    };
    let relative = run("hardness = [0.3, 0.8]\nhardness_unit = \"relative\"");
    let absolute = run("hardness = [0.012, 0.032]");
    for (relative, absolute) in relative.iter().zip(&absolute) {
        // The given hardness is a parameter; the one in the other unit is derived from it.
        let roles = |table: &Table| {
            let columns = table.descriptions().into_iter();
            let of_hardness = columns.filter(|column| column.name.starts_with("hardness"));
            of_hardness.map(|column| column.role).collect::<Vec<_>>()
        };
        assert_eq!(roles(relative), ["derived", "parameter"]);
        assert_eq!(roles(absolute), ["parameter", "derived"]);
        assert_eq!(relative.batch().columns(), absolute.batch().columns());
    }
    let [contact, _] = relative;
    assert_eq!(contact.rows(), 2 * 2 * 3);
    let [hardness, reduced] = ["hardness", "hardness_reduced"].map(|name| reals(&contact, name));
    assert_eq!(hardness, [[0.012; 6], [0.032; 6]].concat());
    assert_eq!(reduced, [[0.3; 6], [0.8; 6]].concat());
}

#[test]
fn what_saturates_bears_no_more_than_the_load_and_the_rest_must_touch_for_it() {
    for boundary in ["periodic", "free"] {
        // 4.1 in units of E* × rms slope, slightly above the last load.
        let lines = format!("hardness = 0.164\nboundary = \"{boundary}\"");
        let (_, [contact, area]) = pressed(&lines);
        let [hardness, pressure, shares, peaks, depths] =
            ["hardness", "pressure", "saturated_fraction", "peak_pressure", "mean_yielded_depth"]
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
    let curves = &stages_from("area")
        .aggregate(
            "curves",
            "over = ['saturated_fraction', 'area_fraction']; statistics = ['mean']",
        )
        .aggregate(
            "asked",
            "from = 'contact'; sql = 'SELECT hardness, SUM(saturated_nodes) AS nodes FROM contact \
             WHERE hardness > 0 GROUP BY hardness ORDER BY hardness'",
        )
        .text();
    let bench = Bench::new();
    bench.run(&SMALL);
    let points = "cases = [{}, { hardness = 0.2 }, { hardness = 0.3 }]";
    let with_cases = SMALL.replace("from = \"rough\"\n", &format!("from = \"rough\"\n{points}\n"));
    let counts_of = bench.run(&format!("{with_cases}{curves}"));
    // Without a hardness the recipe is unchanged.
    assert_eq!(counts_of["contact"].cached, 2);
    let means = bench.table("yielding", "curves");
    let known: Vec<Option<f64>> = means.reals("hardness").unwrap().iter().collect();
    for hardness in [None, Some(0.2), Some(0.3)] {
        let loads = known.iter().filter(|known| **known == hardness).count();
        assert!((4..=5).contains(&loads), "{hardness:?}: {loads}");
    }
    assert!(counts(&means, "count").iter().all(|count| *count == 2));
    let asked = bench.table("yielding", "asked");
    assert_eq!(asked.rows(), 2);
    let nodes = asked.integers("nodes").unwrap();
    assert!(nodes.value(0) > nodes.value(1), "the softer one yields more");
}

#[test]
fn loads_go_on_beyond_full_contact_as_long_as_the_material_yields_there() {
    let wave = |hardness: f64| {
        let bench = Bench::new();
        // Full contact at 1/√2, where the peak is twice as high; crests yield at loads above 1.061.
        bench.run(
            &manifest("wave", "")
                .generate("wave", "method = 'wave'; nodes = 32; amplitude = 0.01; waves = 1")
                .solve(
                    "contact",
                    &format!(
                        "hardness = {hardness}; hardness_unit = 'relative'; \
                         loads = [0.4, 0.99, 1.27, 1.5]"
                    ),
                )
                .text(),
        );
        bench.table("wave", "contact")
    };
    let yields = wave(1.7678);
    let contact = counts(&yields, "contact_nodes");
    assert!(contact[0] < 1024 && contact[1..] == [1024; 3], "{contact:?}");
    let saturated = counts(&yields, "saturated_nodes");
    assert_eq!(saturated[..2], [0, 0]);
    assert!(0 < saturated[2] && saturated[2] < saturated[3]);
    for gap in &reals(&yields, "mean_gap")[1..] {
        assert!((0.0..1e-15).contains(gap), "{gap}");
    }
    let stops = yields.texts("stop").unwrap();
    assert_eq!([1, 2].map(|row| stops.value(row)), ["full-contact", "converged"]);
    let stops = wave(1e3);
    let stops = stops.texts("stop").unwrap();
    let expected = ["converged", "full-contact", "full-contact", "full-contact"];
    assert_eq!(stops.iter().flatten().collect::<Vec<_>>(), expected);
}

#[test]
fn a_load_that_only_the_surface_shows_to_be_too_much_fails_and_leaves_the_rest() {
    let bench = Bench::new();
    let from = with_hardness("h128_hard03.npy");
    fs::copy(from, bench.path("scan.npy")).unwrap();
    // 0.006 E* is 0.3 of E* × rms slope.
    let path = bench.write(
        &manifest("overloaded", "")
            .generate("scan", "method = 'file'; path = 'scan.npy'; side = 1.0; periodic = true")
            .solve("contact", "hardness = [0.006, 0.009]; loads = [0.1, 0.3]")
            .text(),
    );
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    let printed = text(&output.stderr);
    assert!(printed.contains("cannot solve the contact with this hardness"), "{printed}");
    assert!(printed.contains("the mean pressure 0.3"), "{printed}");
    let contact = bench.table("overloaded", "contact");
    assert_eq!(reals(&contact, "hardness"), [0.009, 0.009]);
}

#[test]
fn pressures_above_the_hardness_give_a_warning_only() {
    let bodies = |hardness: &str| {
        let body = "youngs_modulus = 2.0, poisson_ratio = 0.0";
        SMALL.replace("effective_modulus = 2.0", &format!("bodies = [{{ {body}{hardness} }}]"))
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
    let printed = text(&output.stderr);
    let warned = format!("under {beyond} of {} loads", peaks.len());
    assert!(printed.contains("warning: stage `contact`"), "{printed}");
    assert!(printed.contains(&warned), "{printed}");
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
        let printed = text(&output.stderr);
        assert!(!printed.contains("exceeds the hardness"), "{printed}");
    }
}

#[test]
fn maps_of_a_page_are_of_one_hardness() {
    let bench = Bench::new();
    let two = "from = \"rough\"\nhardness = [0.012, 0.032]\n";
    let manifest = SMALL.replace("from = \"rough\"\n", two).replace("0.2, 2.0, 4.0]", "0.2]");
    let path = bench.write(&manifest);
    bench.run(&manifest);
    let said = bench.output(&["report", path.to_str().unwrap(), "--json"]);
    let said: Value = serde_json::from_slice(&said.stdout).unwrap();
    let page = fs::read_to_string(said["page"].as_str().unwrap()).unwrap();
    let areas = page.split("data-area=\"").skip(1);
    let areas: Vec<f64> =
        areas.map(|printed| printed.split(' ').next().unwrap().parse().unwrap()).collect();
    // Rows are sorted by hardness, surface and load.
    let expected = &reals(&bench.table("yielding", "area"), "area_fraction")[..3];
    assert_near(&areas, &expected.iter().map(|a| 100.0 * a).collect::<Vec<_>>(), 5e-3);
    assert!(page.contains("hardness 0.012 ·"), "it says which");
    assert!(!page.contains("hardness_reduced 0.3 ·"));
    assert!(page.contains("assume elastic contact without a hardness"));
}
