//! Results in other units of length and pressure.

use std::fs;
use std::sync::LazyLock;

use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use asperity::tables::table::Table;

use crate::bench::{Bench, STUDY, text};
use crate::columns::assert_kept;
use crate::manifest::{manifest, stages_from};

/// Returns dimensionless columns of a study in other units: Nayak's parameters and loads at full
/// contact, and the areas.
fn without_units(side: &str, rms_slope: &str, effective_modulus: &str) -> (Vec<f64>, Vec<f64>) {
    let units = format!("nodes = 32\nside = {side}\nrms_slope = {rms_slope}");
    let modulus = format!("from = \"surfaces\"\neffective_modulus = {effective_modulus}");
    let study = STUDY.replace("nodes = 32", &units).replace("from = \"surfaces\"", &modulus);
    let bench = Bench::new();
    bench.run(&study);
    let reals = |stage: &str, column: &str| {
        let table = bench.table("small", stage);
        table.reals(column).unwrap().values().to_vec()
    };
    let surfaces = ["nayak", "full_contact_load"].map(|column| reals("surfaces", column));
    (surfaces.concat(), reals("area", "area_fraction"))
}

#[test]
fn what_has_no_unit_is_the_same_at_the_ends_of_the_units_that_may_be_chosen() {
    let (surfaces, areas) = without_units("1", "1", "1");
    for units in [
        ["1e30", "1e-30", "1e30"],
        ["1e-30", "1e30", "1e-30"],
        ["1e-30", "1e-30", "1e-30"],
        ["1e30", "1e30", "1e30"],
    ] {
        let [side, rms_slope, effective_modulus] = units;
        let (scaled_surfaces, scaled_areas) = without_units(side, rms_slope, effective_modulus);
        for (scaled, plain) in scaled_surfaces.iter().zip(&surfaces) {
            // The tolerance covers the rounding of some dozen operations.
            assert!((scaled / plain - 1.0).abs() < 1e-13, "{units:?}");
        }
        assert_eq!(scaled_areas, areas, "{units:?}");
    }
}

/// Glass pressed against a rough steel surface, with a placeholder for each quantity.
static STEEL_ON_GLASS: LazyLock<String> = LazyLock::new(|| {
    manifest("steel", "")
        .generate(
            "surfaces",
            "nodes = 32; side = SIDE; hurst = 0.8; longest_wavelength = LONGEST; \
             shortest_wavelength = SHORTEST; rms_height = [HEIGHT, HIGHER]; realizations = 2",
        )
        .solve(
            "contact",
            "bodies = [{ youngs_modulus = STEEL, poisson_ratio = 0.3, hardness = YIELD }, \
             { youngs_modulus = GLASS, poisson_ratio = 0.2 }]; hardness = HARDNESS; \
             loads = LOADS; load_unit = UNIT",
        )
        .measure("area", "")
        .aggregate("means", "over = ['area_fraction']; statistics = ['mean']")
        .text()
});

/// Replaces the placeholders of [`STEEL_ON_GLASS`].
fn steel_on_glass(values: [&str; 11]) -> String {
    let names = [
        "SIDE", "LONGEST", "SHORTEST", "HEIGHT", "HIGHER", "STEEL", "YIELD", "GLASS", "HARDNESS",
        "LOADS", "UNIT",
    ];
    let text = STEEL_ON_GLASS.to_owned();
    names.iter().zip(values).fold(text, |text, (name, value)| text.replace(name, value))
}

fn with_units() -> String {
    steel_on_glass([
        "\"100 um\"",
        "\"50000 nm\"",
        "\"0.0125 mm\"",
        "\"200 nm\"",
        "\"0.0003 mm\"",
        "\"210 GPa\"",
        "\"2e9 Pa\"",
        "\"70 GPa\"",
        "\"5.5 GPa\"",
        "[\"10 MPa\", \"0.02 GPa\", \"400 bar\"]",
        "\"MPa\"",
    ])
}

#[test]
fn quantities_with_units_give_the_numbers_of_converted_plain_numbers() {
    let with_units = with_units();
    let plain = steel_on_glass([
        "100",
        "50",
        "12.5",
        "0.2",
        "0.3",
        "210000",
        "2000",
        "70000",
        "5500",
        "[10, 20, 40]",
        "\"absolute\"",
    ]);
    let (one, other) = (Bench::new(), Bench::new());
    one.run(&with_units);
    other.run(&plain);
    for stage in ["surfaces", "contact", "area", "means"] {
        let [one, other] = [&one, &other].map(|bench| bench.table("steel", stage));
        let mut numeric = 0;
        for name in other.names() {
            if let (Ok(one), Ok(other)) = (one.reals(name), other.reals(name)) {
                assert_eq!(one, other, "{stage}.{name}");
                numeric += 1;
            }
        }
        assert!(numeric > 2, "{stage} has numbers");
        let units: Vec<&str> = one.texts("unit").unwrap().iter().flatten().collect();
        assert_eq!(units, vec!["µm"; one.rows()], "{stage}");
        assert!(!other.has("unit") && !other.has("pressure_unit"), "{stage}");
        assert_eq!(one.has("pressure_unit"), stage != "surfaces");
    }
    let contact = fs::File::open(one.path("data/results/steel/contact.parquet")).unwrap();
    let described = ParquetRecordBatchReaderBuilder::try_new(contact).unwrap();
    let metadata = |name: &str| described.schema().field_with_name(name).unwrap().metadata();
    let units = ["pressure", "load", "mean_gap", "energy"].map(|name| &*metadata(name)["unit"]);
    assert_eq!(units, ["MPa", "E* × rms slope", "µm", "J/m²"]);
    let table = one.table("steel", "contact");
    assert_eq!(table.reals("pressure").unwrap().value(2), 40.0);
    assert_eq!(table.texts("pressure_unit").unwrap().value(0), "MPa");
}

#[test]
fn every_surface_has_the_given_rms_height_whatever_its_method() {
    for method in ["filter", "random-phase"] {
        let bench = Bench::new();
        let heights =
            format!("nodes = 32\nmethod = \"{method}\"\nside = \"2 mm\"\nrms_height = \"1 um\"");
        bench.run(&STUDY.replace("nodes = 32", &heights));
        let table = bench.table("small", "surfaces");
        let reals = |name: &str| table.reals(name).unwrap().values().to_vec();
        assert!(reals("rms_height").iter().all(|height| *height == 0.001), "{method}");
        for m00 in reals("m00") {
            assert!((m00.sqrt() / 0.001 - 1.0).abs() < 1e-12, "{method}");
        }
        let squares = reals("m20").into_iter().zip(reals("m02"));
        for (slope, (m20, m02)) in reals("rms_slope").iter().zip(squares) {
            assert!((slope / (m20 + m02).sqrt() - 1.0).abs() < 1e-12, "{method}");
        }
        // Two surfaces of one spectrum have the same slope only if their amplitudes are fixed.
        let slopes = reals("rms_slope");
        assert_eq!(((slopes[0] / slopes[1]) - 1.0).abs() < 1e-12, method == "random-phase");
        // A surface is chosen by its realization, not by the digits of its slope.
        let path = bench.path("study.toml");
        let refused = bench.output(&["view", path.to_str().unwrap(), "light", "k_upper=4"]);
        let refused = text(&refused.stderr);
        assert!(refused.ends_with("choose one by\n  realization=0 | 1\n"), "{refused}");
    }
}

#[test]
fn loads_out_of_order_have_the_results_of_the_sorted_list() {
    let bench = Bench::new();
    let loads = |list: &str| STUDY.replace("{ to = 0.1, steps = 4 }", list);
    bench.run(&loads("[0.01, 0.05, 0.1]"));
    let counts = bench.run(&loads("[0.1, 0.01, 0.05, 0.10]"));
    assert!(counts.values().all(|count| count.to_run == 0), "{counts:?}");
    // Another block of loads is one edit of the list.
    let counts = bench.plan(&loads("[0.1, 0.01, 0.05, 0.02]"));
    assert_eq!((counts["surfaces"].to_run, counts["light"].to_run), (0, 4));
}

#[test]
fn all_output_has_the_units_that_the_manifest_names() {
    let bench = Bench::new();
    let manifest = bench.write(&with_units());
    let manifest = manifest.to_str().unwrap();
    let printed = |arguments: &[&str]| {
        let output = bench.output(arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let checked = printed(&["check", manifest]);
    assert!(checked.contains("side 100 µm, rms height Sq = 0.2 … 0.3 µm"), "{checked}");
    let contact = checked.lines().last().unwrap();
    assert!(contact.contains(" MPa, 3 loads 10 … 40 MPa") && !contact.contains("GPa"), "{contact}");
    let run = printed(&["run", manifest]);
    let surfaces = run.lines().next().unwrap();
    // The load of full contact is y* E* h′, with y* from 1 to 3.
    let pressure = surfaces.split(" full contact at ").nth(1).unwrap();
    let pressure = pressure.split(" · ").next().unwrap();
    assert!(pressure.ends_with(" MPa"), "{surfaces}");
    let lowest: f64 = pressure.split(' ').next().unwrap().parse().unwrap();
    assert!((1e3..1e5).contains(&lowest), "{surfaces}");

    printed(&["report", manifest]);
    let figures = bench.data().join("results/steel/figures");
    let drawn = |name: &str| fs::read_to_string(figures.join(name)).unwrap();
    let pressure = drawn("pressure.svg");
    assert!(
        pressure.contains(">mean pressure p₀, in MPa<") && pressure.contains(">mean gap ū, in µm<")
    );
    for file in fs::read_dir(&figures).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".svg") {
            let drawing = drawn(&name);
            for unit in [" nm<", "GPa", " m<"] {
                assert!(!drawing.contains(unit), "{name} has {unit}");
            }
        }
    }
    let page = fs::read_to_string(bench.data().join("results/steel/report.html")).unwrap();
    assert!(page.contains("Loads are mean pressures divided by E* h′, which is "));
}

#[test]
fn a_map_is_drawn_at_a_pressure_with_any_unit() {
    let bench = Bench::new();
    bench.run(&with_units());
    let manifest = bench.path("study.toml");
    let picture = bench.path("map.png");
    let view = |load: &str| {
        let task = ["contact", "rms_height=0.2", "realization=0", "--map", "pressures"];
        let options = ["--load", load, "--replace", "-o", picture.to_str().unwrap()];
        let start = ["view", manifest.to_str().unwrap()];
        let output = bench.output(&[&start[..], &task, &options].concat());
        (text(&output.stdout), text(&output.stderr))
    };
    let (at_20, _) = view("20");
    assert!(at_20.contains("pressures at 20 MPa on 32 × 32 nodes, 0 … "), "{at_20}");
    assert!(at_20.ends_with(" MPa\n"), "{at_20}");
    for load in ["20 MPa", "0.02 GPa", "200bar", "2e7 Pa"] {
        assert_eq!(view(load).0, at_20, "{load}");
    }
    let (_, error) = view("15 MPa");
    assert!(error.contains("no row has `pressure` = 15 MPa; the nearest are 10 MPa and 20 MPa"));
    let (_, error) = view("15 Mpa");
    assert!(error.contains("unknown unit `Mpa`; units of pressure are `Pa`, "), "{error}");
    let export = bench.path("maps.npz");
    let output = bench.output(&[
        "export",
        manifest.to_str().unwrap(),
        "contact",
        "rms_height=0.2",
        "realization=0",
        "--load",
        "0.04 GPa",
        "-o",
        export.to_str().unwrap(),
        "--json",
    ]);
    let exported: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(exported["loads"], serde_json::json!([40.0]));
}

#[test]
fn a_pressure_selects_a_reduced_load_and_needs_a_known_unit() {
    let bench = Bench::new();
    let contact = "from = \"surfaces\"\neffective_modulus = \"70 GPa\"";
    bench.run(&STUDY.replace("from = \"surfaces\"", contact));
    let pressure = bench.table("small", "light").reals("pressure").unwrap().value(1);
    let view = |load: &str| {
        let picture = bench.path("map.png");
        let task = ["study.toml", "light", "k_upper=8", "realization=0", "--load", load];
        let task = task.map(|word| match word {
            "study.toml" => bench.path(word).to_str().unwrap().to_owned(),
            word => word.to_owned(),
        });
        let task: Vec<&str> = task.iter().map(String::as_str).collect();
        let options = ["--replace", "-o", picture.to_str().unwrap()];
        bench.output(&[&["view"], &task[..], &options].concat())
    };
    let drawn = text(&view(&format!("{pressure} GPa")).stdout);
    assert!(drawn.contains("contact at load 0.05 on"), "{drawn}");
    bench.run(&STUDY);
    let error = text(&view("1 MPa").stderr);
    assert!(error.contains("has no unit of pressure; omit the unit"), "{error}");
}

#[test]
fn a_map_without_a_unit_has_the_unit_of_its_side() {
    let measured = |lengths: &str| {
        let bench = Bench::new();
        let shape = "{'descr': '<f8', 'fortran_order': False, 'shape': (16, 16), }";
        let mut file = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        file.extend(format!("{shape:117}\n").bytes());
        let heights = (0..256).map(|node| f64::from(node * 37 % 101) / 1e3);
        file.extend(heights.flat_map(f64::to_le_bytes));
        fs::write(bench.path("rough.npy"), file).unwrap();
        bench.run(&format!(
            "[study]\nname = \"scan\"\n[stage.scan]\nkind = \"generate\"\nmethod = \"file\"\n\
             path = \"rough.npy\"\nperiodic = false\n{lengths}"
        ));
        bench.table("scan", "scan")
    };
    let plain =
        measured("side = 100\ncrop = { from = [0, 25], size = [50, 50] }\nhigh_pass = 40\n");
    let written = measured(
        "side = \"100 um\"\ncrop = { from = [\"0 m\", \"25 um\"], size = [\"0.05 mm\", \"5e4 nm\"] }\n\
         high_pass = \"0.04 mm\"\n",
    );
    for column in ["side", "rms_height", "rms_slope"] {
        assert_eq!(plain.reals(column).unwrap(), written.reals(column).unwrap(), "{column}");
    }
    assert_eq!(written.reals("side").unwrap().value(0), 50.0);
    assert_eq!(written.texts("unit").unwrap().value(0), "µm");
}

/// A study with numbers of each reduced unit.
fn in_megapascals() -> String {
    manifest("reduced", "")
        .generate(
            "surfaces",
            "nodes = 32; side = '100 um'; hurst = 0.8; k_lower = 2; k_upper = 4; rms_slope = 0.1; \
             realizations = 2",
        )
        .solve(
            "contact",
            "effective_modulus = '100 GPa'; loads = ['500 MPa', '1 GPa']; load_unit = 'MPa'; \
             stiffness = true; pressure_bins = { count = 4, to = '10 GPa' }",
        )
        .measure("pressures", "what = 'pressures'")
        .text()
}

#[test]
fn reduced_pressures_and_stiffnesses_have_columns_in_the_units_of_the_study() {
    let bench = Bench::new();
    let study = in_megapascals();
    bench.run(&study);
    assert_kept(&bench, "reduced", &bench.path("study.toml"));
    // E* h′ is 10⁴ MPa, and E*/side 1000 MPa/µm.
    for (stage, reduced, absolute, unit, factor) in [
        ("surfaces", "full_contact_load", "full_contact_pressure", "MPa", 1e4),
        ("contact", "stiffness", "stiffness_absolute", "MPa/µm", 1e3),
        ("pressures", "contact_pressure", "contact_pressure_absolute", "MPa", 1e4),
        ("pressures", "pressure_density", "pressure_density_absolute", "1/MPa", 1e-4),
    ] {
        let table = bench.table("reduced", stage);
        let [values, expected] = [absolute, reduced].map(|name| table.reals(name).unwrap());
        for (value, expected) in values.iter().zip(expected) {
            let (value, expected) = (value.unwrap(), factor * expected.unwrap());
            assert!((value - expected).abs() <= 1e-11 * expected, "{absolute}: {value}");
        }
        let described = table.descriptions_in_units().into_iter();
        let described = described.filter(|column| column.name == absolute);
        assert_eq!(described.map(|column| column.unit).collect::<Vec<_>>(), [unit]);
    }
    // Without a unit of pressure, the same numbers have no second column.
    let plain = Bench::new();
    let numbers = [
        ("\"100 GPa\"", "1e5"),
        ("\"10 GPa\"", "1"),
        ("load_unit = \"MPa\"\n", ""),
        ("[\"500 MPa\", \"1 GPa\"]", "[0.05, 0.1]"),
    ];
    plain.run(&numbers.iter().fold(study, |text, (from, to)| text.replace(from, to)));
    for stage in ["surfaces", "contact", "pressures"] {
        let table = plain.table("reduced", stage);
        assert!(table.names().iter().all(|name| !name.ends_with("_absolute")), "{stage}");
    }
}

#[test]
fn published_rows_are_read_without_the_columns_of_absolute_numbers() {
    let bench = Bench::new();
    bench.run(&in_megapascals());
    let published = bench.published("reduced");
    // Published rows take the place of those of the store, which are computed again for their maps.
    fs::remove_dir_all(bench.data().join("store")).unwrap();
    let extended = stages_from("pressures").aggregate(
        "means",
        "over = ['pressure_density', 'pressure_bin_width']; statistics = ['mean', 'sd']",
    );
    bench.run(&format!("{}{}", in_megapascals(), extended.text()));
    assert_kept(&bench, "reduced", &bench.path("study.toml"));
    for (path, bytes) in published {
        if path.extension().is_some_and(|end| end == "parquet") {
            assert!(bench.published("reduced")[&path] == bytes, "{}", path.display());
        }
    }
    let means = bench.table("reduced", "means");
    let [absolute, reduced] = ["pressure_density_absolute_mean", "pressure_density_mean"]
        .map(|name| means.reals(name).unwrap().value(0));
    assert!((absolute / (1e-4 * reduced) - 1.0).abs() < 1e-11);
}

#[test]
fn figures_and_claims_name_columns_in_the_units_of_the_study() {
    let bench = Bench::new();
    let declared = "[figure.stiffness]\nfrom = 'contact'\nx = 'pressure'\ny = 'stiffness_absolute'\n\
                    [claim.stiff]\ntext = 'The contact is stiff.'\nfrom = 'contact'\n\
                    value = 'stiffness_absolute'\nexpected = '> 10'\n";
    let manifest = bench.write(&format!("{}{declared}", in_megapascals()));
    let manifest = manifest.to_str().unwrap();
    for command in ["run", "report"] {
        let output = bench.output(&[command, manifest]);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    let figure = bench.data().join("results/reduced/figures/stiffness.svg");
    let drawn = fs::read_to_string(figure).unwrap();
    assert!(drawn.contains(">stiffness K, in MPa/µm<"), "{drawn}");
    let claims = text(&bench.output(&["claims", manifest, "stiff"]).stdout);
    assert!(claims.contains("in MPa/µm"), "{claims}");
}

#[test]
fn queries_and_csv_tell_the_units_of_their_columns() {
    let bench = Bench::new();
    bench.run(&in_megapascals());
    let manifest = bench.path("study.toml");
    let query = "select load, avg(pressure) as p, pressure / mean_gap as r, 2 * pressure as d \
                 from contact group by load, pressure, mean_gap";
    let asked = |options: &[&str]| {
        let all = [&["table", manifest.to_str().unwrap(), "--sql", query], options].concat();
        let output = bench.output(&all);
        assert!(output.status.success(), "{}", text(&output.stderr));
        [text(&output.stdout), text(&output.stderr)]
    };
    let first = |text: &str| text.lines().next().unwrap_or_default().to_owned();
    let heads = "load [E* × rms slope],p [MPa],r [MPa/µm],d";
    let [with_units, nothing] = asked(&["--csv", "--units"]);
    assert_eq!((first(&with_units).as_str(), nothing.as_str()), (heads, ""));
    let [plain, told] = asked(&["--csv"]);
    assert_eq!(first(&plain), "load,p,r,d");
    assert_eq!(told, "units: load [E* × rms slope], p [MPa], r [MPa/µm]\n");
    assert_eq!(asked(&["--json"])[1], told);
    let [printed, _] = asked(&[]);
    assert!(first(&printed).contains("r [MPa/µm]"), "{printed}");
}

/// A study in megapascals and micrometres with a parameter, a figure and a claim.
fn with_parameters(study: &str, rest: &str) -> String {
    let text = manifest("shown", study)
        .generate(
            "surfaces",
            "nodes = 32; side = 'length'; hurst = 0.8; k_lower = 1; k_upper = 8; \
             rms_height = '0.002 * length'; realizations = 5",
        )
        .solve(
            "contact",
            "effective_modulus = '2 GPa'; loads = ['0.5 * heavy', 'heavy']; gap_bins = GAPS; \
             load_unit = 'MPa'",
        )
        .measure("area", "")
        .aggregate("means", "over = ['mean_gap']; statistics = ['mean']")
        .aggregate(
            "asked",
            "from = 'contact'; sql = 'select pressure, avg(mean_gap) as gap, \
             max(pressure / mean_gap) as steepness from contact group by pressure'",
        )
        .text();
    format!("{}\n[parameters]\nlength = \"100 um\"\nheavy = \"20 MPa\"\n{rest}", text)
}

#[test]
fn expressions_and_bins_with_units_are_the_tasks_of_their_numbers() {
    let bench = Bench::new();
    let study = with_parameters("", "");
    bench.run(&study.replace("GAPS", "{ count = 10, to = 2 }"));
    let surfaces = bench.table("shown", "surfaces");
    assert_eq!(
        [surfaces.reals("side"), surfaces.reals("rms_height")].map(|of| of.unwrap().value(0)),
        [100.0, 0.2]
    );
    assert_eq!(
        bench.table("shown", "contact").reals("pressure").unwrap().values()[..2],
        [10.0, 20.0]
    );
    let counts = bench.plan(&study.replace("GAPS", "{ count = 10, to = \"400 nm\" }"));
    assert!(counts.values().all(|count| count.to_run == 0), "{counts:?}");
    let plain = study.replace("'length'", "\"100 um\"").replace("\"length\"", "\"100 um\"");
    let counts = bench.plan(&plain.replace("GAPS", "{ count = 10, to = 2 }"));
    assert!(counts.values().all(|count| count.to_run == 0), "{counts:?}");
}

#[test]
fn units_of_output_change_what_is_shown_and_compute_nothing() {
    let bench = Bench::new();
    let stored = with_parameters("", "").replace("GAPS", "{ count = 10, to = 2 }");
    bench.run(&stored);
    let stages = ["surfaces", "contact", "area", "means", "asked"];
    let before = stages.map(|stage| bench.table("shown", stage));
    let rest = "[claim.gap]\ntext = \"gaps are small\"\nfrom = \"contact\"\nvalue = \"mean_gap\"\n\
                expected = \"< 1 um\"\nwhere = { pressure = { from = \"15 MPa\" } }\n\
                [figure.gaps]\nfrom = \"contact\"\nx = \"pressure\"\ny = \"mean_gap\"\n\
                where = { pressure = [\"10 MPa\", 0.02] }\nlimits = { pressure = { from = 0, to = \"30 MPa\" } }\n\
                ticks = { pressure = [0, \"20 MPa\"] }\n";
    let study = "output_units = { length = \"nm\", pressure = \"GPa\" }";
    let shown = with_parameters(study, rest).replace("GAPS", "{ count = 10, to = 2 }");
    let counts = bench.run(&shown);
    assert!(counts.values().all(|count| count.computed == 0), "{counts:?}");
    let after = stages.map(|stage| bench.table("shown", stage));
    let value =
        |table: &asperity::tables::table::Table, name: &str| table.reals(name).unwrap().value(0);
    for (name, stage, factor) in [
        ("side", 0, 1e3),
        ("rms_height", 0, 1e3),
        ("pressure", 1, 1e-3),
        ("effective_modulus", 1, 1e-3),
        ("mean_gap", 1, 1e3),
        ("load", 1, 1.0),
        ("mean_contact_pressure", 2, 1e-3),
        ("mean_gap_mean", 3, 1e3),
        ("gap", 4, 1e3),
        ("steepness", 4, 1e-6),
    ] {
        let [one, other] = [&before, &after].map(|tables| value(&tables[stage], name));
        assert!((other / (factor * one) - 1.0).abs() < 1e-15, "{name}: {one} and {other}");
    }
    assert_eq!(value(&after[1], "pressure"), 0.01, "coordinates are rounded");
    assert_eq!(after[1].texts("unit").unwrap().value(0), "nm");
    assert_eq!(after[1].texts("pressure_unit").unwrap().value(0), "GPa");
    let path = bench.path("study.toml");
    let path = path.to_str().unwrap();
    let printed = |arguments: &[&str]| text(&bench.output(arguments).stdout);
    let claims = printed(&["claims", path]);
    assert!(claims.contains("holds") && claims.contains("nm"), "{claims}");
    let table = printed(&["table", path, "contact", "--columns", "pressure,mean_gap"]);
    assert!(table.contains("pressure [GPa]") && table.contains("mean_gap [nm]"), "{table}");
    let asked = printed(&["table", path, "asked"]);
    assert!(asked.contains("gap [nm]") && asked.contains("steepness [GPa/nm]"), "{asked}");
    let exported = printed(&[
        "export",
        path,
        "contact",
        "realization=0",
        "pressure=20 MPa",
        "--output",
        bench.path("maps.npz").to_str().unwrap(),
        "--json",
    ]);
    for expected in ["\"unit\":\"nm\"", "\"pressure_unit\":\"GPa\"", "\"loads\":[0.02]"] {
        assert!(exported.replace([' ', '\n'], "").contains(expected), "{exported}");
    }
    let report = bench.output(&["report", path]);
    assert!(report.status.success(), "{}", text(&report.stderr));
    let page = fs::read_to_string(bench.path("data/results/shown/report.html")).unwrap();
    assert!(!page.contains("rms height 200"), "a constant parameter names no series");
    // Without units of output, tables have the bytes that they had before.
    bench.run(&stored);
    assert_eq!(
        stages.map(|stage| bench.table("shown", stage).batch().clone()),
        before.map(|table| table.batch().clone())
    );
    let wrong = study.replace("nm", "kg");
    let path = bench.write(&with_parameters(&wrong, "").replace("GAPS", "{ count = 10, to = 2 }"));
    let refused = text(&bench.output(&["check", path.to_str().unwrap()]).stderr);
    assert!(refused.contains("`kg` is not a unit of length"), "{refused}");
}

/// Two sizes of a surface, pressed by loads.
fn pressed(loads: &str) -> String {
    manifest("forces", "")
        .generate(
            "surfaces",
            "nodes = 32; side = ['100 um', '200 um']; hurst = 0.8; k_lower = 2; k_upper = 8; \
             rms_slope = 0.1",
        )
        .solve("contact", &format!("effective_modulus = '70 GPa'; load_unit = 'MPa'; {loads}"))
        .measure("area", "")
        .aggregate("means", "over = ['area_fraction']; statistics = ['mean']")
        .text()
}

#[test]
fn forces_are_the_pressures_that_they_mean_on_each_nominal_area() {
    let (forces, pressures) = (Bench::new(), Bench::new());
    // (100 µm)² bear 1 N at 100 MPa, and (200 µm)² at 25 MPa.
    forces.run(&pressed("loads = ['2 N', '500 mN', '1 N']"));
    pressures.run(&pressed("loads = ['12.5 MPa', '25 MPa', '50 MPa', '100 MPa', '200 MPa']"));
    let [given, other] = [&forces, &pressures].map(|bench| bench.table("forces", "contact"));
    let numbers = |table: &Table, column: &str| table.reals(column).unwrap().values().to_vec();
    assert_eq!(numbers(&given, "force"), [0.5, 1.0, 2.0, 0.5, 1.0, 2.0]);
    assert_eq!(numbers(&given, "pressure"), [50.0, 100.0, 200.0, 12.5, 25.0, 50.0]);
    assert!(!other.has("force"));
    let rows = |table: &Table| -> Vec<(f64, f64, f64, i64)> {
        let [sides, loads, gaps] =
            ["side", "load", "mean_gap"].map(|column| numbers(table, column));
        let nodes = table.integers("contact_nodes").unwrap();
        let all =
            (0..table.rows()).map(|row| (sides[row], loads[row], gaps[row], nodes.value(row)));
        all.collect()
    };
    let known = rows(&other);
    assert!(rows(&given).iter().all(|row| known.contains(row)), "the rows of pressures");
    for stage in ["area", "means"] {
        assert_eq!(numbers(&forces.table("forces", stage), "force").len(), 6, "{stage}");
    }
}

#[test]
fn a_load_that_is_a_force_is_a_row_which_any_unit_finds() {
    let bench = Bench::new();
    let range = "loads = { from = 0, to = '4 N', steps = 4 }; pressures = ['1 N']";
    let study = pressed(range).replace("[\"100 um\", \"200 um\"]", "\"100 um\"");
    bench.run(&study);
    let manifest = bench.path("study.toml");
    let manifest = manifest.to_str().unwrap();
    let view = |load: &str| {
        let picture = bench.path("map.png");
        let options = ["--load", load, "--replace", "-o", picture.to_str().unwrap()];
        let task = ["view", manifest, "contact", "--map", "pressures"];
        let output = bench.output(&[&task[..], &options].concat());
        (text(&output.stdout), text(&output.stderr))
    };
    let (at_one, error) = view("1 N");
    assert!(at_one.contains("pressures at 100 MPa"), "{at_one}{error}");
    assert_eq!(view("1000 mN").0, at_one);
    assert_eq!(view("100 MPa").0, at_one);
    let (_, error) = view("1.7 N");
    assert!(error.contains("no row has `force` = 1.7 N; the nearest are 1 N and 2 N"), "{error}");
    let checked = text(&bench.output(&["check", manifest]).stdout);
    assert!(checked.contains("contact: E* = 70000 MPa, 4 loads 1 … 4 N"), "{checked}");
    // Known forces are known rows.
    let with = |loads: &str| study.replace("{ from = 0, to = \"4 N\", steps = 4 }", loads);
    assert_eq!(bench.plan(&with("[\"1 N\", \"3000 mN\"]"))["contact"].to_run, 0);
    assert_eq!(bench.plan(&with("[\"1 N\", \"1500 mN\"]"))["contact"].to_run, 1);
}

#[test]
fn another_modulus_changes_the_pressures_of_surfaces_that_are_not_computed_again() {
    let bench = Bench::new();
    let pressure_of_full_contact = |modulus: &str| {
        let study = pressed("loads = ['10 MPa']").replace("70 GPa", modulus);
        let counts = bench.run(&study);
        let surfaces = bench.table("forces", "surfaces");
        (counts["surfaces"].computed, surfaces.reals("full_contact_pressure").unwrap().value(0))
    };
    let (first, soft) = pressure_of_full_contact("70 GPa");
    let (second, stiff) = pressure_of_full_contact("140 GPa");
    assert_eq!((first, second), (2, 0));
    assert!((stiff / soft - 2.0).abs() < 1e-15, "{soft} and {stiff}");
}

#[test]
fn a_bound_of_an_error_is_in_the_units_of_output() {
    let bench = Bench::new();
    let study = |output_units: &str, bound: &str| {
        let until = format!(
            "realizations = {{ at_least = 3, at_most = 40, until = \"sem(contact.mean_gap) < {bound}\" }}"
        );
        with_parameters(output_units, "")
            .replace("GAPS", "{ count = 10, to = 2 }")
            .replace("realizations = 5", &until)
            .replace("[\"0.5 * heavy\", \"heavy\"]", "[\"heavy\"]")
    };
    bench.run(&study("", "0.002"));
    let surfaces = bench.table("shown", "surfaces").rows();
    assert!((4..40).contains(&surfaces), "{surfaces}");
    let counts = bench.run(&study("output_units = { length = \"nm\" }", "2"));
    assert!(counts.values().all(|count| count.computed == 0), "{counts:?}");
    assert_eq!(bench.table("shown", "surfaces").rows(), surfaces);
}
