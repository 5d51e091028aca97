//! The command `asperity view`.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use asperity::tables::parquet;
use asperity::tables::parquet::Columns;
use asperity_mechanics::morphology::map::ContactMap;
use serde_json::Value;

use crate::bench::{Bench, STUDY, text};

/// Returns the width and the pixels of a picture, row by row from the top.
fn pixels(path: &Path) -> (usize, Vec<[u8; 3]>) {
    let file = BufReader::new(File::open(path).unwrap());
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    let (pixels, _) = bytes.as_chunks();
    (frame.width as usize, pixels.to_vec())
}

/// Draws a picture, which must succeed, and returns it with the output of the command.
fn view(bench: &Bench, arguments: &[&str]) -> (Value, Vec<u8>) {
    let path = bench.path("view.png");
    let options = ["--json", "--replace", "--output", path.to_str().unwrap()];
    let output = bench.output(&[&["view"], arguments, &options].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed = serde_json::from_slice(&output.stdout).unwrap();
    (printed, fs::read(path).unwrap())
}

#[test]
fn a_picture_replaces_no_other_file_unless_it_is_asked_for_and_nothing_but_pictures() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.path("study.toml");
    let manifest = manifest.to_str().unwrap();
    let map = bench.path("map.png");
    let map = map.to_str().unwrap();
    let view = |load: &str, options: &[&str]| {
        let start = ["view", manifest, "light", "k_upper=8", "realization=1"];
        let output = bench.output(&[&start, &["--load", load][..], options].concat());
        (output.status.code(), text(&output.stderr))
    };
    assert_eq!(view("0.1", &["-o", map]).0, Some(0));
    let first = fs::read(map).unwrap();
    assert_eq!(view("0.1", &["-o", map]), (Some(0), String::new()), "the same");
    let (code, printed) = view("0.025", &["-o", map]);
    assert!(code == Some(2) && printed.contains("already exists"), "{printed}");
    assert_eq!(fs::read(map).unwrap(), first);
    assert_eq!(view("0.025", &["-o", map, "--replace"]).0, Some(0));
    assert_ne!(fs::read(map).unwrap(), first);

    fs::write(map, STUDY.as_bytes()).unwrap();
    let (code, printed) = view("0.1", &["-o", map, "--replace"]);
    assert!(code == Some(2) && printed.contains("is not a PNG file"), "{printed}");
    assert_eq!(fs::read_to_string(map).unwrap(), *STUDY);
    let (code, printed) = view("0.1", &["-o", manifest, "--replace"]);
    assert!(code == Some(2) && printed.contains("must end in"), "{printed}");
    assert_eq!(fs::read_to_string(manifest).unwrap(), *STUDY);
}

#[test]
fn the_suffix_of_a_picture_names_its_format_and_other_suffixes_are_refused() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let key = first_task(&bench, "light");
    for (suffix, beginning) in [
        ("png", &b"\x89PNG"[..]),
        ("PNG", &b"\x89PNG"[..]),
        ("svg", &b"<svg"[..]),
        ("pdf", &b"%PDF"[..]),
        ("gif", &b"GIF89a"[..]),
        ("apng", &b"\x89PNG"[..]),
    ] {
        let path = bench.path(&format!("map.{suffix}"));
        let output = bench.output(&["view", &key, "--output", path.to_str().unwrap()]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(fs::read(&path).unwrap().starts_with(beginning), "{suffix}");
    }
    for suffix in ["webp", "txt", "parquet"] {
        let path = bench.path(&format!("map.{suffix}"));
        let printed = refused(&bench, &[&key, "--output", path.to_str().unwrap()]);
        assert!(printed.contains("`.png`, `.svg`, `.pdf`"), "{printed}");
        assert!(!path.exists());
    }
}

#[test]
fn an_animation_has_a_picture_for_each_load_and_no_vectors() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let key = first_task(&bench, "light");
    let (printed, bytes) = view(&bench, &[&key, "--map", "gap", "--animate"]);
    assert_eq!((&printed["pictures"], &printed["load"]), (&4.into(), &Value::Null));
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 4);
    let (_, slow) = view(&bench, &[&key, "--map", "gap", "--animate", "--frame-time", "2.5"]);
    let reader = png::Decoder::new(std::io::Cursor::new(slow)).read_info().unwrap();
    let frame = reader.info().frame_control.unwrap();
    assert_eq!((frame.delay_num, frame.delay_den), (250, 100));
    let printed = refused(&bench, &[&key, "--frame-time", "2.5"]);
    assert!(printed.contains("add `--animate`"), "{printed}");
    let path = bench.path("gap.svg");
    let printed = refused(&bench, &[&key, "--animate", "--output", path.to_str().unwrap()]);
    assert!(printed.contains("cannot hold an animation"), "{printed}");
    let surface = first_task(&bench, "surfaces");
    let printed = refused(&bench, &[&surface, "--animate"]);
    assert!(printed.contains("shows all loads"), "{printed}");
}

fn refused(bench: &Bench, arguments: &[&str]) -> String {
    let output = bench.output(&[&["view"], arguments].concat());
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    text(&output.stderr)
}

/// Returns the key of the first task of a stage.
fn first_task(bench: &Bench, stage: &str) -> String {
    let table = bench.table("small", stage);
    table.texts("task").unwrap().value(0).to_owned()
}

#[test]
fn a_contact_map_has_a_dark_pixel_for_each_node_that_touches() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let key = first_task(&bench, "light");
    let file = File::open(bench.file_of(&key)).unwrap();
    let (table, _) = parquet::decode(file, Columns::All).unwrap();
    for row in 0..table.rows() {
        let load = table.reals("load").unwrap().value(row);
        view(&bench, &[&key, "--load", &load.to_string(), "--bare"]);
        let (nodes, pixels) = pixels(&bench.path("view.png"));
        let map = ContactMap::from_bytes([nodes; 2], table.bytes("contact").unwrap().value(row));
        let map = map.unwrap();
        for (pixel, [red, ..]) in pixels.into_iter().enumerate() {
            let (i, j) = (pixel % nodes, nodes - 1 - pixel / nodes);
            assert_eq!(red < 128, map.get(i, j), "node ({i}, {j}) at load {load}");
        }
    }
}

#[test]
fn a_load_is_asked_for_in_the_unit_of_the_study_and_refused_where_there_is_none() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let key = first_task(&bench, "light");
    let (printed, _) = view(&bench, &[&key, "--load", "0.1"]);
    assert_eq!(printed["load"], 0.1);
    assert_eq!(printed["load_column"], "load");
    assert_eq!(printed["nodes"], 32);
    let refused_load = refused(&bench, &[&key, "--load", "7"]);
    assert!(refused_load.contains("the nearest is 0.1"), "{refused_load}");

    let pascals = "load_unit = \"absolute\"\neffective_modulus = 1e9\nloads = [1e7, 5e7]";
    bench.run(&STUDY.replace("loads = { to = 0.1, steps = 4 }", pascals));
    let key = first_task(&bench, "light");
    let (printed, lightest) = view(&bench, &[&key, "--load", "1e7"]);
    assert_eq!(printed["load"], 1e7);
    assert_eq!(printed["load_column"], "pressure");
    assert_ne!(lightest, view(&bench, &[&key, "--load", "5e7"]).1);
    let refused_load = refused(&bench, &[&key, "--load", "0.01"]);
    assert!(refused_load.contains("the nearest is 1e7"), "{refused_load}");
}

#[test]
fn a_task_is_found_by_its_first_digits_and_by_its_coordinates() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let path = bench.path("study.toml");
    let path = path.to_str().unwrap();
    let by_place = view(&bench, &[path, "light", "k_upper=8", "realization=1"]);
    let key = by_place.0["task"].as_str().unwrap();
    assert_eq!(view(&bench, &[key]), by_place);
    assert_eq!(view(&bench, &[&key[..8]]), by_place);
    let other = view(&bench, &[path, "light", "k_upper=8", "realization=0"]);
    assert_ne!(other.1, by_place.1);
}

#[test]
fn rows_of_later_stages_lead_to_the_map_that_they_were_counted_in() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let contact = view(&bench, &[&first_task(&bench, "light")]).1;
    for stage in ["area", "corrected"] {
        assert_eq!(view(&bench, &[&first_task(&bench, stage)]).1, contact);
    }
    let heights = view(&bench, &[&first_task(&bench, "surfaces")]).1;
    let pressed = first_task(&bench, "light");
    assert_eq!(view(&bench, &[&pressed, "--map", "heights"]).1, heights);
}

#[test]
fn heights_that_were_not_kept_are_drawn_again() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let kept = view(&bench, &[&first_task(&bench, "surfaces")]);
    let redrawn = STUDY.replace("realizations = 2", "realizations = 2\nheights = \"redraw\"");
    bench.run(&redrawn);
    let redrawn = view(&bench, &[&first_task(&bench, "surfaces")]);
    assert_ne!(redrawn.0["task"], kept.0["task"]);
    assert_eq!(redrawn.1, kept.1);
}

#[test]
fn pressures_are_drawn_whether_they_are_kept_or_not() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("[stage.area]", "pressures = \"all\"\n\n[stage.area]"));
    let key = first_task(&bench, "light");
    let (printed, _) = view(&bench, &[&key, "--map", "pressures"]);
    let table = bench.table("small", "light");
    assert_eq!(printed["load"], table.reals("load").unwrap().value(3));
    assert_eq!(printed["lowest"], 0.0);
    // The number was printed and parsed; the parser is exact up to the last bit.
    let peak = table.reals("peak_pressure").unwrap().value(3).to_string();
    let peak: serde_json::Value = serde_json::from_str(&peak).unwrap();
    assert_eq!(printed["highest"], peak);

    let other = Bench::new();
    other.run(&STUDY);
    let kept = view(&bench, &[&key, "--map", "pressures"]).1;
    assert_eq!(view(&other, &[&key, "--map", "pressure"]).1, kept);
}

#[test]
fn impossible_pictures_are_refused_with_advice() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let path = bench.path("study.toml");
    let path = path.to_str().unwrap();
    let (surface, fit) = (first_task(&bench, "surfaces"), first_task(&bench, "law"));
    for (arguments, message) in [
        (vec![path], "name the stage of"),
        (vec![path, "ligth"], "did you mean `light`?"),
        (vec![path, "light"], "k_upper=4 | 8"),
        (vec![path, "light", "k_uper=4"], "did you mean `k_upper`?"),
        (vec![path, "light", "k_upper=5"], "available: 4, 8"),
        (vec![path, "light", "8"], "such as `k_upper=32`"),
        (vec![path, "light", "load=8"], "no row has `load` = 8; the nearest is"),
        (vec![path, "light", "k_upper=4", "load=8 MPa"], "the study has no unit of pressure"),
        (vec!["nonsense"], "is not a key"),
        (vec![&surface, "--map", "contact"], "has no contact"),
        (vec![&surface, "--load", "0.1"], "omit `--load`"),
        (vec![&surface, "--load", "nan"], "expected a finite number"),
        (vec![&fit], "has no map; choose a task of a `generate` or `solve` stage"),
    ] {
        let refused = refused(&bench, &arguments);
        assert!(refused.contains(message), "{message} in\n{refused}");
    }
    let unknown = bench.output(&["view", &"0".repeat(32)]);
    assert_eq!(unknown.status.code(), Some(1));
    assert!(text(&unknown.stderr).contains("no finished task 0000"));
}

#[test]
fn a_stage_with_one_load_has_the_map_of_this_load() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("loads = { to = 0.1, steps = 4 }", "loads = [0.1]"));
    let manifest = bench.path("study.toml");
    let task = [manifest.to_str().unwrap(), "light", "k_upper=8", "realization=1"];
    let (printed, picture) = view(&bench, &task);
    let (_, at_load) = view(&bench, &[&task[..], &["--load", "0.1"]].concat());
    assert_eq!(picture, at_load, "{printed}");
}
