//! The command `asperity export`.

use std::fs;
use std::sync::LazyLock;

use asperity::topography_files::{Channel, HeightMap, Size, read};
use serde_json::Value;

use crate::bench::{Bench, STUDY, text};
use crate::manifest::manifest;

/// Rectangle with a ridge along y near the end of x, which no exchange of axes leaves unchanged.
static RIDGE: LazyLock<String> = LazyLock::new(|| {
    manifest("ridge", "")
        .generate(
            "surface",
            "method = 'file'; path = 'ridge.npy'; side = [6.0, 4.0]; unit = 'µm'; periodic = false",
        )
        .solve("contact", "boundary = 'free'; loads = [0.01, 0.02]")
        .text()
});

const NODES: [usize; 2] = [24, 16];

fn height(i: usize, j: usize) -> f64 {
    if i >= 20 { 0.1 + 0.001 * j as f64 } else { 0.0 }
}

/// Runs the study of a ridge.
fn ridge() -> Bench {
    let bench = Bench::new();
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (24, 16), }";
    let header = format!("{header:<117}\n");
    let heights = (0..NODES[0] * NODES[1]).map(|node| height(node / NODES[1], node % NODES[1]));
    let start = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()];
    let file: Vec<u8> =
        start.concat().into_iter().chain(heights.flat_map(f64::to_le_bytes)).collect();
    fs::write(bench.path("ridge.npy"), file).unwrap();
    bench.run(&RIDGE);
    bench
}

fn export(bench: &Bench, stage: &str, file: &str, options: &[&str]) -> Result<Value, String> {
    let (study, path) = (bench.path("study.toml"), bench.path(file));
    let start = ["export", study.to_str().unwrap(), stage, "--json"];
    let end = ["--output", path.to_str().unwrap()];
    let output = bench.output(&[&start, options, &end].concat());
    if output.status.success() {
        return Ok(serde_json::from_slice(&output.stdout).unwrap());
    }
    assert_eq!(output.status.code(), Some(2));
    Err(text(&output.stderr))
}

#[test]
fn a_numpy_array_has_x_along_its_first_axis() {
    let bench = ridge();
    let printed = export(&bench, "contact", "heights.npy", &["--map", "heights"]).unwrap();
    assert_eq!(printed["arrays"], serde_json::json!(["height"]));
    assert_eq!(printed["nodes"], serde_json::json!([24, 16]));
    assert_eq!((&printed["side"][0], &printed["unit"]), (&6.0.into(), &"µm".into()));
    let bytes = fs::read(bench.path("heights.npy")).unwrap();
    let header = String::from_utf8_lossy(&bytes[10..128]);
    assert!(header.contains("'shape': (24, 16), }"), "{header}");
    let file = read(&bytes).unwrap();
    let map = file.channels()[0].map();
    assert_eq!(map.nodes(), NODES);
    let mean = map.heights().iter().sum::<f64>() / map.heights().len() as f64;
    let given: Vec<f64> = (0..24 * 16).map(|node| height(node / 16, node % 16)).collect();
    let given_mean = given.iter().sum::<f64>() / given.len() as f64;
    for (found, given) in map.heights().iter().zip(&given) {
        assert!((found - mean - (given - given_mean)).abs() < 1e-12);
    }
}

#[test]
fn a_sweep_has_an_axis_of_loads_and_a_single_load_has_none() {
    let bench = ridge();
    let shape = |file: &str, options: &[&str]| {
        export(&bench, "contact", file, options).unwrap();
        let bytes = fs::read(bench.path(file)).unwrap();
        String::from_utf8_lossy(&bytes[10..128]).trim_end().to_owned()
    };
    let sweep = shape("gap.npy", &["--map", "gap"]);
    assert!(sweep.contains("'shape': (2, 24, 16), }"), "{sweep}");
    let single = shape("contact.npy", &["--map", "contact", "--load", "0.02"]);
    assert!(single.contains("'descr': '|b1'") && single.contains("(24, 16)"), "{single}");
}

#[test]
fn vtk_image_data_has_a_cell_for_each_node_with_x_fastest_and_units() {
    let bench = ridge();
    export(&bench, "contact", "maps.vti", &["--load", "0.02", "--map", "heights,contact"]).unwrap();
    let bytes = fs::read(bench.path("maps.vti")).unwrap();
    let start = bytes.windows(5).position(|window| window == b"raw\">").unwrap() + 7;
    let head = String::from_utf8_lossy(&bytes[..start]);
    assert!(head.contains("WholeExtent=\"0 24 0 16 0 0\""), "{head}");
    assert!(head.contains("Origin=\"-0.125 -0.125 0\""), "{head}");
    assert!(head.contains("<CellData>") && !head.contains("<PointData>"), "{head}");
    assert!(head.contains("Spacing=\"0.25 0.25 0.25\""), "{head}");
    assert!(head.contains(">µm</InformationKey>"), "{head}");
    let unit = "<InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">";
    let load = "Name=\"load\" NumberOfTuples=\"1\" format=\"ascii\">";
    let reduced = format!("{load}{unit}E* × rms slope</InformationKey>0.02<");
    assert!(head.contains(&reduced), "{head}");
    assert!(head.contains("Name=\"contact\" format=\"appended\" offset=\"3080\""), "{head}");
    let number = |at: usize| -> [u8; 8] { bytes[start + at..start + at + 8].try_into().unwrap() };
    assert_eq!(u64::from_le_bytes(number(0)), 24 * 16 * 8);
    let found = |i: usize, j: usize| f64::from_le_bytes(number(8 + 8 * (j * 24 + i)));
    for (i, j) in [(0, 0), (19, 15), (20, 0), (23, 7), (22, 15)] {
        let difference = found(i, j) - found(0, 0) - height(i, j);
        assert!(difference.abs() < 1e-12, "({i}, {j})");
    }
}

#[test]
fn a_collection_has_a_file_for_each_load() {
    let bench = ridge();
    let printed = export(&bench, "contact", "sweep.pvd", &["--map", "pressures"]).unwrap();
    assert_eq!(printed["loads"], serde_json::json!([0.01, 0.02]));
    assert_eq!(printed["files"].as_array().unwrap().len(), 3);
    let collection = fs::read_to_string(bench.path("sweep.pvd")).unwrap();
    assert!(collection.contains("timestep=\"0.02\" part=\"0\" file=\"sweep/0001.vti\""));
    assert!(bench.path("sweep/0000.vti").exists() && bench.path("sweep/0001.vti").exists());
}

#[test]
fn equal_maps_are_equal_archives_of_all_arrays() {
    let bench = ridge();
    let printed = export(&bench, "contact", "maps.npz", &[]).unwrap();
    let arrays = ["height", "contact", "pressure", "gap", "displacement"];
    assert_eq!(printed["arrays"], serde_json::json!(arrays));
    let first = fs::read(bench.path("maps.npz")).unwrap();
    export(&bench, "contact", "again.npz", &[]).unwrap();
    assert_eq!(fs::read(bench.path("again.npz")).unwrap(), first);
    let names = String::from_utf8_lossy(&first).into_owned();
    for name in arrays.iter().chain(&["side", "load", "unit", "load_unit"]) {
        assert!(names.contains(&format!("{name}.npy")), "{name}");
    }
    let surface = export(&bench, "surface", "surface.npz", &[]).unwrap();
    assert_eq!(surface["arrays"], serde_json::json!(["height"]));
}

#[test]
fn loads_that_are_pressures_are_told_from_maps_of_pressures() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("loads =", "load_unit = \"absolute\"\nloads ="));
    let task = ["k_upper=8", "realization=1"];
    let printed = export(&bench, "light", "maps.npz", &task).unwrap();
    assert_eq!(printed["load_column"], "pressure");
    let bytes = fs::read(bench.path("maps.npz")).unwrap();
    let names = String::from_utf8_lossy(&bytes).into_owned();
    assert!(names.contains("load.npy") && names.contains("pressure.npy"));
}

#[test]
fn loads_and_times_have_the_unit_of_the_study() {
    let bench = Bench::new();
    let study = STUDY
        .replace("loads = {", "effective_modulus = \"10 GPa\"\nload_unit = \"MPa\"\nloads = {");
    bench.run(&study);
    let task = ["k_upper=8", "realization=1", "--map", "contact"];
    export(&bench, "light", "sweep.pvd", &task).unwrap();
    let collection = fs::read_to_string(bench.path("sweep.pvd")).unwrap();
    assert!(collection.contains("<!-- timestep: load in MPa -->"), "{collection}");
    let first = fs::read(bench.path("sweep/0000.vti")).unwrap();
    let head = String::from_utf8_lossy(&first);
    assert!(head.contains("location=\"vtkDataArray\">MPa</InformationKey>"), "{head}");
}

#[test]
fn impossible_exports_are_refused_with_advice() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let task = ["k_upper=8", "realization=1"];
    for (stage, file, options, message) in [
        ("light", "map.csv", &[][..], "`.vti` (VTK, one load)"),
        ("light", "map.vti", &[][..], "write all to"),
        ("light", "map.npy", &[][..], "choose one of `height`, `contact`"),
        ("light", "map.gsf", &[][..], "choose one of `height`, `contact`"),
        ("light", "map.gsf", &["--map", "gap"][..], "write all to"),
        ("light", "map.gwy", &[][..], "a `.gwy` file holds one load"),
        ("light", "map.npz", &["--load", "7"][..], "the nearest is 0.1"),
        ("surfaces", "map.npz", &["--map", "gap"][..], "generates a surface and has no gap"),
    ] {
        let refused = export(&bench, stage, file, &[&task[..], options].concat()).unwrap_err();
        assert!(refused.contains(message), "{message} in\n{refused}");
        assert!(!bench.path(file).exists());
    }
}

/// Checks that a channel of a file has the nodes, the sides and the heights of the ridge.
fn check_is_ridge(channel: &Channel<'_>, map: &HeightMap, tolerance: f64) {
    assert_eq!(channel.name(), "height");
    assert_eq!(channel.unit(), Some("m"));
    assert_eq!(map.nodes(), NODES);
    assert_eq!(map.size(), Size::Metres([6e-6, 4e-6]));
    for (i, j) in [(0, 0), (23, 0), (0, 15), (23, 15), (20, 7)] {
        let difference = 1e6 * (map.get(i, j).unwrap() - map.get(0, 0).unwrap());
        assert!((difference - height(i, j)).abs() < tolerance, "({i}, {j}): {difference}");
    }
}

#[test]
fn a_gwyddion_simple_field_is_read_again_as_the_same_map() {
    let bench = ridge();
    let options = ["--map", "heights"];
    let printed = export(&bench, "contact", "heights.gsf", &options).unwrap();
    assert_eq!(printed["arrays"], serde_json::json!(["height"]));
    let bytes = fs::read(bench.path("heights.gsf")).unwrap();
    let file = read(&bytes).unwrap();
    assert_eq!(file.format().name(), "gsf");
    let channel = &file.channels()[0];
    check_is_ridge(channel, &channel.map(), 1e-7);
    // The numbers follow one to four zeros, at a multiple of four bytes.
    let header = bytes.len() - 4 * NODES[0] * NODES[1];
    let zeros = bytes[..header].iter().rev().take_while(|byte| **byte == 0).count();
    assert!(header.is_multiple_of(4) && (1..=4).contains(&zeros), "{header}, {zeros}");
    let contact = ["--map", "contact", "--load", "0.02"];
    export(&bench, "contact", "contact.gsf", &contact).unwrap();
    let bytes = fs::read(bench.path("contact.gsf")).unwrap();
    let map = read(&bytes).unwrap().channels()[0].map();
    assert_eq!((map.get(0, 0), map.get(23, 15)), (Some(0.0), Some(1.0)));
}

#[test]
fn a_gwyddion_file_has_a_channel_for_each_map_and_the_contact_as_mask_of_the_heights() {
    let bench = ridge();
    let load = ["--load", "0.02"];
    let printed = export(&bench, "contact", "maps.gwy", &load).unwrap();
    let arrays = ["height", "contact", "pressure", "gap", "displacement"];
    assert_eq!(printed["arrays"], serde_json::json!(arrays));
    let bytes = fs::read(bench.path("maps.gwy")).unwrap();
    let file = read(&bytes).unwrap();
    let names: Vec<&str> = file.channels().iter().map(Channel::name).collect();
    assert_eq!(names, ["height", "pressure", "gap", "displacement"]);
    assert_eq!(file.default_channel().unwrap().index, 0);
    let [heights, pressure, gap, _] = file.channels() else { unreachable!() };
    check_is_ridge(heights, &heights.clone().without_mask().map(), 1e-12);
    let (masked, pressure, gap) = (heights.map(), pressure.map(), gap.map());
    assert_eq!((pressure.size(), gap.size()), (masked.size(), masked.size()));
    let in_contact = |map: &HeightMap, i: usize, j: usize| map.get(i, j).unwrap() > 0.0;
    let mut count = 0;
    for (i, j) in (0..NODES[0]).flat_map(|i| (0..NODES[1]).map(move |j| (i, j))) {
        assert_eq!(masked.get(i, j).is_none(), in_contact(&pressure, i, j), "({i}, {j})");
        assert!(!(in_contact(&pressure, i, j) && in_contact(&gap, i, j)));
        count += usize::from(in_contact(&pressure, i, j));
    }
    assert!(count > 0);
    export(&bench, "contact", "contact.gwy", &["--load", "0.02", "--map", "contact"]).unwrap();
    let bytes = fs::read(bench.path("contact.gwy")).unwrap();
    let map = read(&bytes).unwrap().channels()[0].map();
    assert_eq!(map.heights().iter().sum::<f64>(), count as f64);
}
