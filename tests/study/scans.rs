//! Measured surfaces, from the file to the report.

use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::LazyLock;

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::bench::{Bench, text};
use crate::manifest::manifest;

const NODES: [usize; 2] = [24, 20];
const STEP: f64 = 2e-6;

/// Returns whether a point is missing: holes are inside, at a corner and along an edge.
fn is_hole(i: usize, j: usize) -> bool {
    (5..9).contains(&i) && (7..12).contains(&j) || i + j < 3 || i == 23 && j > 15
}

fn height(i: usize, j: usize) -> f64 {
    let [x, y] = [i, j].map(|node| node as f64);
    1e-6 * (x * 1.3).sin() * (y * 0.9).cos() + 4e-7 * x - 2e-7 * y
}

/// Creates an X3P file of doubles with lines along x; missing points are NaN.
fn x3p() -> Vec<u8> {
    let [nodes_x, nodes_y] = NODES;
    let axis = |name: &str, kind: &str| {
        format!(
            "<{name}><AxisType>{kind}</AxisType><DataType>D</DataType><Increment>{}</Increment>\
             <Offset>0</Offset></{name}>",
            if kind == "I" { STEP } else { 1.0 }
        )
    };
    let axes = [axis("CX", "I"), axis("CY", "I"), axis("CZ", "A")].concat();
    let description = format!(
        "<p:ISO5436_2 xmlns:p=\"http://www.opengps.eu/2008/ISO5436_2\"><Record1><FeatureType>SUR\
         </FeatureType><Axes>{axes}</Axes></Record1><Record3><MatrixDimension><SizeX>{nodes_x}\
         </SizeX><SizeY>{nodes_y}</SizeY><SizeZ>1</SizeZ></MatrixDimension><DataLink>\
         <PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3></p:ISO5436_2>"
    );
    let nodes = (0..nodes_y).flat_map(|j| (0..nodes_x).map(move |i| (i, j)));
    let heights = nodes.flat_map(|(i, j)| {
        let height = if is_hole(i, j) { f64::NAN } else { height(i, j) };
        height.to_le_bytes()
    });
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    archive.start_file("main.xml", options).unwrap();
    archive.write_all(description.as_bytes()).unwrap();
    archive.start_file("bindata/data.bin", options).unwrap();
    archive.write_all(&heights.collect::<Vec<u8>>()).unwrap();
    archive.finish().unwrap().into_inner()
}

static STUDY: LazyLock<String> = LazyLock::new(|| {
    manifest("scanned", "")
        .generate(
            "scan",
            "method = 'file'; path = 'scan.x3p'; periodic = false; fill = 'harmonic'; \
             level = ['none', 'plane']",
        )
        .solve("contact", "boundary = 'free'; effective_modulus = 1e9; loads = [0.02, 0.1]")
        .measure("area", "")
        .correct("corrected", "correction = '2017'")
        .text()
});

fn bench() -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("scan.x3p"), x3p()).unwrap();
    bench
}

fn holes() -> usize {
    let [nodes_x, nodes_y] = NODES;
    let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| (i, j)));
    nodes.filter(|&(i, j)| is_hole(i, j)).count()
}

#[test]
fn a_scan_with_holes_goes_all_the_way_to_a_report() {
    let bench = bench();
    let manifest = bench.write(&STUDY);
    let manifest = manifest.to_str().unwrap();
    let checked = bench.output(&["check", manifest]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let printed = text(&checked.stderr);
    let share = format!("{} of 480 points of `scan.x3p` were not measured", holes());
    assert!(printed.contains(&share), "{printed}");
    let run = bench.output(&["run", manifest]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let printed = text(&run.stdout) + &text(&run.stderr);
    let summary = format!("x3p, lengths in m, {} missing nodes filled", holes());
    assert!(printed.contains(&summary), "{printed}");

    let scan = bench.table("scanned", "scan");
    assert_eq!(scan.rows(), 2);
    for row in 0..2 {
        let words = |name: &str| scan.texts(name).unwrap().value(row).to_owned();
        assert_eq!(words("unit"), "m");
        assert_eq!(words("format"), "x3p");
        assert_eq!(words("fill"), "harmonic");
        assert_eq!(words("level"), ["none", "plane"][row]);
        let filled = scan.integers("filled_nodes").unwrap().value(row);
        assert_eq!(filled as usize, holes());
        assert_eq!(scan.integers("nodes_x").unwrap().value(row), 24);
        let side = scan.reals("side_y").unwrap().value(row);
        assert!((side / (20.0 * STEP) - 1.0).abs() < 1e-12);
    }
    let slopes = scan.reals("rms_slope").unwrap();
    assert!(slopes.value(1) < slopes.value(0), "the tilt is gone");

    // The level is a coordinate of contacts and corrections, too, and gives separate points.
    for stage in ["contact", "area", "corrected"] {
        let table = bench.table("scanned", stage);
        assert_eq!(table.rows(), 4, "{stage}");
        let levels: Vec<_> = table.texts("level").unwrap().iter().flatten().collect();
        assert_eq!(levels.iter().filter(|level| **level == "plane").count(), 2);
        let stops = table.texts("stop").unwrap();
        assert!(stops.iter().all(|stop| stop == Some("converged")), "{stage}");
    }

    let report = bench.output(&["report", manifest, "--json"]);
    assert!(report.status.success(), "{}", text(&report.stderr));
    assert!(text(&report.stdout).contains("Contact maps"));
    let page = fs::read_to_string(bench.data().join("results/scanned/report.html")).unwrap();
    assert!(page.contains("scan.x3p"));
    assert!(page.contains("level plane"));
}

#[test]
fn a_number_that_stands_far_from_all_heights_is_named_and_may_be_missing() {
    let bench = Bench::new();
    let line = |j: usize| {
        let number = |i: usize| if i + j == 9 { -9999.0 } else { 1e7 * height(i, j) };
        (0..12).map(|i| format!("{:.3}", number(i))).collect::<Vec<_>>().join(" ")
    };
    let lines: Vec<String> = (0..8).map(line).collect();
    let header = "# Width: 12 µm\n# Height: 8 µm\n# Value units: nm\n";
    fs::write(bench.path("scan.txt"), format!("{header}{}\n", lines.join("\n"))).unwrap();
    let path = bench.path("scan.txt");
    let printed = text(&bench.output(&["surface", path.to_str().unwrap()]).stdout);
    assert!(printed.contains("8 points have the number -9999.0, far from all others"), "{printed}");
    let stage = STUDY.split("[stage.contact]").next().unwrap().replace("scan.x3p", "scan.txt");
    let check = |stage: &str| {
        let manifest = bench.write(stage);
        let checked = bench.output(&["check", manifest.to_str().unwrap()]);
        assert!(checked.status.success(), "{}", text(&checked.stderr));
        text(&checked.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let warned = check(&stage);
    let warning = "8 points of `scan.txt` have the number -9999.0, far from all others; if it marks \
                   points without a height, set `missing = -9999.0` and `fill`";
    assert!(warned.contains(warning), "{warned}");
    let stage = stage.replace("fill =", "missing = -9999\nfill =");
    let said = check(&stage);
    assert!(!said.contains("far from all others"), "{said}");
    assert!(said.contains("8 of 96 points of `scan.txt` were not measured"), "{said}");
    let run = bench.output(&["run", bench.write(&stage).to_str().unwrap()]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let scan = bench.table("scanned", "scan");
    assert_eq!(scan.reals("missing").unwrap().value(0), -9999.0);
    assert_eq!(scan.integers("filled_nodes").unwrap().value(0), 8);
}

#[test]
fn points_under_a_mask_are_missing_unless_the_mask_is_ignored() {
    let bench = Bench::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/topography/field");
    fs::copy(folder.join("gwy_mask.gwy"), bench.path("scan.gwy")).unwrap();
    let stage = "[study]\nname = \"scanned\"\n\n[stage.scan]\nkind = \"generate\"\n\
                 method = \"file\"\npath = \"scan.gwy\"\nperiodic = false\n";
    let refused = bench.output(&["check", bench.write(stage).to_str().unwrap()]);
    assert!(text(&refused.stderr).contains("lacks 2 of 35 points"), "{}", text(&refused.stderr));
    let check = |keys: &str| {
        let checked =
            bench.output(&["check", bench.write(&(stage.to_owned() + keys)).to_str().unwrap()]);
        assert!(checked.status.success(), "{}", text(&checked.stderr));
        text(&checked.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let note = "2 points are under a mask and count as missing; `mask = false` keeps their heights";
    let filled = check("fill = \"harmonic\"\n");
    assert!(filled.contains(note), "{filled}");
    let kept = check("mask = false\n");
    assert!(!kept.contains("under a mask"), "{kept}");
    bench.run(&(stage.to_owned() + "mask = [true, false]\nfill = \"harmonic\"\n"));
    let scan = bench.table("scanned", "scan");
    let masks: Vec<_> = scan.texts("mask").unwrap().iter().collect();
    assert_eq!(masks, [None, Some("ignored")]);
    let filled = scan.integers("filled_nodes").unwrap();
    assert_eq!([filled.value(0), filled.value(1)], [2, 0]);
}

/// Reads the stored heights of the only surface of a study.
fn kept(bench: &Bench) -> Vec<f64> {
    let files = bench.files();
    let tables = files.iter().filter(|(path, _)| {
        let path = path.to_str().unwrap();
        path.contains("store") && path.ends_with(".parquet")
    });
    let mut found = tables.filter_map(|(path, _)| {
        let file = fs::File::open(bench.data().join(path)).unwrap();
        let (table, _) =
            asperity::tables::parquet::decode(file, asperity::tables::parquet::Columns::All)
                .ok()?;
        let list = table.lists("heights").ok()?.value(0);
        Some(list.as_primitive::<Float64Type>().values().to_vec())
    });
    found.next().expect("a table with heights")
}

#[test]
fn heights_of_holes_solve_laplaces_equation_and_others_are_those_of_the_file() {
    let bench = bench();
    let stage = STUDY.split("[stage.contact]").next().unwrap();
    bench.run(&stage.replace("level = [\"none\", \"plane\"]", ""));
    let heights = kept(&bench);
    let [nodes_x, nodes_y] = NODES;
    let at = |i: usize, j: usize| heights[i * nodes_y + j];
    for i in 0..nodes_x {
        for j in 0..nodes_y {
            if !is_hole(i, j) {
                assert_eq!(at(i, j), height(i, j));
                continue;
            }
            let mut neighbours = Vec::new();
            let mut neighbour = |is_there: bool, i: usize, j: usize| {
                if is_there {
                    neighbours.push(at(i, j));
                }
            };
            neighbour(i > 0, i.wrapping_sub(1), j);
            neighbour(i + 1 < nodes_x, i + 1, j);
            neighbour(j > 0, i, j.wrapping_sub(1));
            neighbour(j + 1 < nodes_y, i, j + 1);
            let mean = neighbours.iter().sum::<f64>() / neighbours.len() as f64;
            assert!((at(i, j) - mean).abs() < 1e-18, "{i}, {j}");
        }
    }
}

#[test]
fn a_scan_whose_file_is_gone_is_the_one_that_the_tables_are_of() {
    let bench = bench();
    bench.run(&STUDY);
    let manifest = bench.path("study.toml");
    let table = || {
        let output = bench.output(&["table", manifest.to_str().unwrap(), "corrected", "--csv"]);
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let whole = table();
    assert_eq!(whole.0, Some(0));
    fs::remove_dir_all(bench.data().join("store")).unwrap();
    fs::remove_file(bench.path("scan.x3p")).unwrap();
    let (code, rows, printed) = table();
    assert_eq!((code, rows), (Some(0), whole.1));
    assert!(printed.contains("`scan.x3p` cannot be read"), "{printed}");
}

#[test]
fn a_side_that_contradicts_the_file_needs_to_override_it() {
    let bench = bench();
    let stage = STUDY.split("[stage.contact]").next().unwrap();
    // A side that agrees with the file within typed digits is accepted.
    let side = stage.replace("periodic", "side = [48e-6, 40e-6]\nunit = \"m\"\nperiodic");
    bench.run(&side);
    let scan = bench.table("scanned", "scan");
    assert_eq!(scan.reals("side_x").unwrap().value(0), 48e-6);
    assert!(scan.texts("unit").unwrap().iter().all(|unit| unit == Some("m")));
    // Overriding the file stretches the map and its moments.
    let wide = side.replace("48e-6, 40e-6", "480e-6, 400e-6");
    let refused = bench.output(&["check", bench.write(&wide).to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2));
    let slope = scan.reals("rms_slope").unwrap().value(0);
    bench.run(&wide.replace("periodic", "override = true\nperiodic"));
    let scan = bench.table("scanned", "scan");
    let stretched = scan.reals("rms_slope").unwrap().value(0);
    assert!((10.0 * stretched / slope - 1.0).abs() < 1e-12);
}

#[test]
fn lengths_with_units_prepare_a_map_as_plain_numbers_do() {
    let stage = STUDY.split("[stage.contact]").next().unwrap();
    let stage = stage.replace("level = [\"none\", \"plane\"]", "heights = \"keep\"\n");
    // The unit of the file is the metre.
    let written = |length: &dyn Fn(f64) -> String| {
        let [step, corner, sides] = [1.0, 2.0, 16.0].map(|steps| length(steps * STEP));
        let (long, short) = (length(8.0 * STEP), length(3.0 * STEP));
        format!(
            "{stage}crop = {{ from = [{corner}, {step}], size = [{sides}, {sides}] }}\n\
             high_pass = {long}\nlow_pass = {short}\n"
        )
    };
    let plain = bench();
    plain.run(&written(&|length| format!("{length:e}")));
    let heights = kept(&plain);
    assert_eq!(heights.len(), 16 * 16);
    for (unit, factor) in [("um", 1e6), ("nm", 1e9)] {
        let bench = bench();
        bench.run(&written(&|length| format!("\"{} {unit}\"", length * factor)));
        for (one, other) in kept(&bench).iter().zip(&heights) {
            assert!((one - other).abs() <= 1e-12 * other.abs().max(1e-9), "{unit}");
        }
    }
}

/// Returns a study with the files of instruments, each with the radius of its tip.
fn with_tips() -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/topography");
    let stage = |name: &str, file: &str, keys: &str| {
        format!(
            "[stage.{name}]\nkind = \"generate\"\nmethod = \"file\"\npath = \"{folder}/{file}\"\n\
             periodic = false\n{keys}\n"
        )
    };
    [
        "[study]\nname = \"tips\"\n".to_owned(),
        stage("nanoscope", "di-3.di", "channel = \"ZSensor\"\ntip_radius = [20e-9, 100e-9]"),
        stage("text", "matrix-4.txt", "tip_radius = [20e-9, 1e-6]"),
        stage(
            "alicona",
            "al3d-1.al3d",
            "level = \"plane\"\ntip_radius = 10e-6\nnoise_floor = true",
        ),
        stage(
            "smooth",
            "al3d-1.al3d",
            "level = \"plane\"\nnoise_floor = true\nlow_pass = \"reliable\"",
        ),
    ]
    .concat()
}

#[test]
fn tips_limit_scans_as_another_program_finds() {
    let bench = Bench::new();
    let manifest = bench.write(&with_tips());
    let run = bench.output(&["run", manifest.to_str().unwrap()]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    // `scanning_probe_reliability_cutoff` of SurfaceTopography 1.27.1, in metres; two steps of the
    // map where it finds no cutoff.
    for (stage, row, cutoff, reliable) in [
        ("nanoscope", 0, Some(1.0768063890520979e-7), 1.0768063890520979e-7),
        ("nanoscope", 1, Some(4.082346401422341e-7), 4.082346401422341e-7),
        ("text", 0, None, 2.0 * 2.773965e-5 / 75.0),
        ("text", 1, Some(1.0876144845877778e-6), 1.0876144845877778e-6),
        ("alicona", 0, Some(1.237674988670525e-5), 1.237674988670525e-5),
    ] {
        let table = bench.table("tips", stage);
        let value = |name: &str| table.reals(name).unwrap().iter().nth(row).unwrap();
        match (value("tip_wavelength"), cutoff) {
            (Some(found), Some(exact)) => {
                assert!((found / exact - 1.0).abs() < 1e-6, "{stage}: {found:e} {exact:e}");
            }
            (found, exact) => assert_eq!(found, exact, "{stage}"),
        }
        let found = value("reliable_wavelength").unwrap();
        assert!((found / reliable - 1.0).abs() < 1e-6, "{stage}: {found:e} {reliable:e}");
        let (share, slope) = (value("unreliable_share"), value("rms_slope_reliable"));
        let whole = value("rms_slope").unwrap();
        assert!((slope.unwrap() - whole * (1.0 - share.unwrap()).sqrt()).abs() < 1e-9 * whole);
    }
    // The spectrum of the optical map is flat below 1.9 µm, at 1.4e-30 m⁴ and steps of 0.44 µm.
    let optical = bench.table("tips", "smooth");
    let value = |name: &str| optical.reals(name).unwrap().value(0);
    assert!((1.7e-6..2.2e-6).contains(&value("noise_wavelength")));
    assert_eq!(value("noise_wavelength"), value("reliable_wavelength"));
    assert!((value("noise_rms_height") / 2.7e-9 - 1.0).abs() < 0.05);
    assert_eq!(optical.texts("low_pass_at").unwrap().value(0), "reliable");
    let slope = bench.table("tips", "alicona").reals("rms_slope").unwrap().value(0);
    assert!(value("rms_slope") < slope);
}

#[test]
fn a_slope_of_unresolved_waves_has_a_warning() {
    let bench = Bench::new();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/topography");
    let manifest = bench.write(&format!(
        "[study]\nname = \"blunt\"\n[stage.scan]\nkind = \"generate\"\nmethod = \"file\"\n\
         path = \"{folder}/di-3.di\"\nchannel = \"ZSensor\"\nperiodic = false\n\
         tip_radius = \"1 um\"\n"
    ));
    let manifest = manifest.to_str().unwrap();
    let printed = text(&bench.output(&["check", manifest]).stderr);
    assert!(printed.contains("of the mean square slope of"), "{printed}");
    assert!(printed.contains("comes from waves shorter than 1.5 µm"), "{printed}");
    let run = bench.output(&["run", manifest]);
    let printed = text(&run.stdout);
    assert!(
        printed.contains("of the mean square slope comes from waves shorter than"),
        "{printed}"
    );
    let filtered = ["check", manifest, "--set", "stage.scan.low_pass=\"reliable\""];
    let printed = text(&bench.output(&filtered).stderr);
    assert!(!printed.contains("mean square slope"), "{printed}");
}
