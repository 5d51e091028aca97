//! The command `asperity surface`.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use serde_json::{Value, json};

use crate::bench::{Bench, text};

fn example(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/topography");
    folder.join(name).to_str().unwrap().to_owned()
}

fn printed(bench: &Bench, arguments: &[&str]) -> String {
    let output = bench.output(&[&["surface"], arguments].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout)
}

fn refused(bench: &Bench, arguments: &[&str], code: i32) -> String {
    let output = bench.output(&[&["surface"], arguments].concat());
    assert_eq!(output.status.code(), Some(code), "{arguments:?}");
    text(&output.stderr)
}

fn channels(bench: &Bench, arguments: &[&str]) -> Vec<Value> {
    let printed = printed(bench, &[arguments, &["--json"]].concat());
    let printed: Value = serde_json::from_str(&printed).unwrap();
    printed["channels"].as_array().unwrap().clone()
}

#[test]
fn a_slope_that_no_solid_surface_has_is_told_with_the_unit_that_would_explain_it() {
    let bench = Bench::new();
    let told = |heights: &str| {
        let path = bench.path("map.txt");
        fs::write(
            &path,
            format!(
                "# Width: 4 µm\n# Height: 2 µm\n# Value units: {heights}\n\
                                  12 -9 31 2\n-20 5 -7 18\n"
            ),
        )
        .unwrap();
        text(&bench.output(&["surface", path.to_str().unwrap()]).stderr)
    };
    assert_eq!(told("nm"), "");
    let warning = told("µm");
    assert!(warning.starts_with("warning: the rms slope of `"), "{warning}");
    assert!(warning.contains("with heights that span 51 µm on 4 µm × 2 µm; check"), "{warning}");
    assert_eq!(warning.lines().count(), 1, "{warning}");
}

#[test]
fn a_file_is_described_in_metres() {
    let bench = Bench::new();
    let sdf = channels(&bench, &[&example("sdf-1.sdf")]);
    let lowest = sdf[0]["lowest"].as_f64().unwrap();
    assert!((lowest - 0.94907e-6).abs() < 1e-18);
    assert_eq!(sdf[0]["nodes"], json!([7, 4]));
    assert_eq!(sdf[0]["unit"], "m");
    let gwy = channels(&bench, &[&example("test.gwy")]);
    assert_eq!(gwy[0]["unit"], Value::Null);
    assert_eq!(gwy[0]["size"], json!([128.0, 128.0]));
    let frt = channels(&bench, &[&example("frt-2.frt")]);
    assert_eq!(frt[0]["missing"], 12314);
    assert_eq!(frt[0]["corners"]["first"], Value::Null);
}

#[test]
fn channels_are_chosen_by_name_or_number() {
    let bench = Bench::new();
    let file = example("di-3.di");
    assert_eq!(channels(&bench, &[&file]).len(), 4);
    let named = channels(&bench, &[&file, "--channel", "Height"]);
    assert_eq!(named, channels(&bench, &[&file, "--channel", "4"]));
    let all = printed(&bench, &[&file]);
    let all = all.split_whitespace().collect::<Vec<_>>().join(" ");
    let default = "heights channel 1, `ZSensor`, the first of the file; channel 4 (`Height`) may be \
                   the heights as well";
    assert!(all.contains(default), "{all}");
    let message = refused(&bench, &[&file, "--channel", "Heigth"], 2);
    assert!(message.contains("did you mean `Height`?"), "{message}");
    assert!(refused(&bench, &[&file, "--channel", "5"], 2).contains("no channel `5`"));
}

#[test]
fn missing_points_are_reported_and_drawn() {
    let bench = Bench::new();
    let path = bench.path("frt.png");
    let printed = printed(&bench, &[&example("frt-2.frt"), "--output", path.to_str().unwrap()]);
    assert!(printed.contains("12314 points of channel 1, 27.364 %"), "{printed}");
    let mut decoder = png::Decoder::new(Cursor::new(fs::read(path).unwrap()));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((frame.width, frame.height), (150, 300));
    let (pixels, _) = bytes.as_chunks::<3>();
    // Yellow, the colour of the highest points, contains red and green.
    let holes = pixels.iter().filter(|[red, green, _]| *red > 200 && *green < 100);
    assert_eq!(holes.count(), 12314);
}

#[test]
fn a_file_that_cannot_be_read_is_named_with_the_reason() {
    let bench = Bench::new();
    let path = bench.path("broken.x3p");
    fs::write(&path, b"PK\x03\x04").unwrap();
    let message = refused(&bench, &[path.to_str().unwrap()], 1);
    let start = format!(
        "error: cannot read surface file `{}`: damaged or unsupported x3p file (X3P, ISO 25178-72): ",
        path.display()
    );
    assert!(message.starts_with(&start), "{message}");
    assert!(refused(&bench, &["nothing.x3p"], 1).contains("`nothing.x3p`"));
}

#[test]
fn names_and_units_of_a_file_cannot_steer_the_terminal() {
    let bench = Bench::new();
    let path = bench.path("scan.gsf");
    let steering = "\u{1b}]0;owned\u{7}\u{9b}2J";
    let header = format!(
        "Gwyddion Simple Field 1.0\nXRes = 2\nYRes = 2\nZUnits = V{steering}\nTitle = a{steering}\n"
    );
    let mut bytes = header.into_bytes();
    bytes.resize((bytes.len() + 1).next_multiple_of(4), 0);
    bytes.extend([0; 16]);
    fs::write(&path, bytes).unwrap();
    let path = path.to_str().unwrap();
    let is_plain = |printed: &str| printed.chars().all(|c| !c.is_control() || c == '\n');
    let words = printed(&bench, &[path]);
    assert!(is_plain(&words), "{words:?}");
    let escaped = "a\\u001b]0;owned\\u0007\\u009b2J";
    assert!(words.contains(escaped), "{words}");
    let error = refused(&bench, &[path, "--channel", "b"], 2);
    assert!(is_plain(&error) && error.contains(escaped), "{error:?}");
    // JSON keeps the names as they are.
    let json = printed(&bench, &[path, "--json"]);
    assert!(is_plain(&json), "{json:?}");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["channels"][0]["name"], format!("a{steering}"));
}

#[test]
fn a_picture_never_takes_the_place_of_the_measurement() {
    let bench = Bench::new();
    let measured = fs::read(example("di-3.di")).unwrap();
    for name in ["scan.di", "scan.png"] {
        let path = bench.path(name);
        fs::write(&path, &measured).unwrap();
        let path = path.to_str().unwrap();
        for options in [&[][..], &["--replace"]] {
            refused(&bench, &[&[path, "--output", path], options].concat(), 2);
            assert!(fs::read(path).unwrap() == measured, "{name}");
        }
    }
}
