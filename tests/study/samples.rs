//! Scans as samples of one ensemble, and their labels.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;

use crate::bench::{Bench, Count, is_idle, real, text};
use crate::manifest::{manifest, stages_from};

const NODES: usize = 16;

/// Writes a scan of `side` micrometres a side, as the text of an instrument.
fn write_scan(bench: &Bench, name: &str, seed: u64, side: f64) {
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let phases: Vec<f64> = (0..6).map(|_| 6.2 * uniform()).collect();
    let line = |j: usize| {
        let height = |i: usize| {
            let [x, y] = [i, j].map(|node| TAU * node as f64 / NODES as f64);
            let waves = phases.iter().zip(1..);
            let sum: f64 = waves
                .map(|(phase, k)| (f64::from(k) * x + phase).sin() * (2.0 * y + phase).cos())
                .sum();
            format!("{:.3}", 100.0 * sum)
        };
        (0..NODES).map(height).collect::<Vec<_>>().join(" ")
    };
    let lines: Vec<String> = (0..NODES).map(line).collect();
    let header = format!("# Width: {side} µm\n# Height: {side} µm\n# Value units: nm\n");
    let path = bench.path(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, format!("{header}{}\n", lines.join("\n"))).unwrap();
}

/// Returns a bench with three scans of specimen A and two of specimen B.
fn bench() -> Bench {
    let bench = Bench::new();
    let names = ["A-1", "A-2", "A-3", "B-1", "B-2"];
    for (seed, name) in (1..).zip(names) {
        write_scan(&bench, &format!("scans/{name}.txt"), seed, 10.0);
    }
    bench
}

/// Returns the keys of a stage that reads scans.
fn scans(keys: &str) -> String {
    format!("method = 'file'; periodic = false; {keys}")
}

const LOADS: &str =
    "boundary = 'free'; effective_modulus = '100 GPa'; loads = ['50 MPa', '200 MPa']";

/// Returns a study that presses scans and computes the mean area.
fn study(keys: &str) -> String {
    manifest("scans", "")
        .generate("scan", &scans(keys))
        .solve("contact", LOADS)
        .measure("area", "")
        .aggregate("mean", "over = 'area_fraction'; statistics = ['mean', 'sem', 'ci95']")
        .text()
}

/// Runs `check` on a manifest that it refuses, and returns what it prints, on one line.
fn refused(bench: &Bench, manifest: &str) -> String {
    let checked = bench.output(&["check", bench.write(manifest).to_str().unwrap()]);
    assert_eq!(checked.status.code(), Some(2), "{}", text(&checked.stdout));
    text(&checked.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
}

fn check(bench: &Bench, manifest: &str) -> [String; 2] {
    let checked = bench.output(&["check", bench.write(manifest).to_str().unwrap()]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    [text(&checked.stdout), text(&checked.stderr)]
}

#[test]
fn means_of_samples_are_over_the_files_of_each_label() {
    let bench = bench();
    bench.run(&study("path = 'scans/{specimen}-*.txt'; samples = true"));
    let (area, mean) = (bench.table("scans", "area"), bench.table("scans", "mean"));
    assert_eq!([area.rows(), mean.rows()], [10, 4]);
    let specimens = area.texts("specimen").unwrap();
    for row in 0..4 {
        let specimen = mean.texts("specimen").unwrap().value(row);
        let load = real(&mean, "pressure", row);
        let own: Vec<f64> = (0..10)
            .filter(|&row| {
                specimens.value(row) == specimen
                    && (real(&area, "pressure", row) / load - 1.0).abs() < 1e-9
            })
            .map(|row| real(&area, "area_fraction", row))
            .collect();
        let count = if specimen == "A" { 3 } else { 2 };
        assert_eq!(own.len(), count);
        assert_eq!(mean.integers("surfaces").unwrap().value(row), count as i64);
        let expected = own.iter().sum::<f64>() / count as f64;
        assert!((real(&mean, "area_fraction_mean", row) / expected - 1.0).abs() < 1e-12);
        let squares = own.iter().map(|area| (area - expected).powi(2)).sum::<f64>();
        let sem = (squares / (count * (count - 1)) as f64).sqrt();
        assert!((real(&mean, "area_fraction_sem", row) - sem).abs() < 1e-12);
    }
}

#[test]
fn without_samples_each_file_is_a_parameter_point() {
    let bench = bench();
    bench.run(&study("path = 'scans/*.txt'"));
    let mean = bench.table("scans", "mean");
    assert_eq!(mean.rows(), 10);
    assert!(!mean.has("specimen"));
    let surfaces = mean.integers("surfaces").unwrap();
    assert!(surfaces.iter().all(|count| count == Some(1)));
}

#[test]
fn labels_and_samples_can_change_without_computing_a_contact_again() {
    let bench = bench();
    bench.run(&study("path = 'scans/*.txt'"));
    let (stored, published) = (bench.content(), bench.published("scans"));
    let run = |keys: &str, computed: &[&str]| {
        let counts: BTreeMap<String, Count> = bench.run(&study(keys));
        for (stage, count) in &counts {
            assert_eq!(!is_idle(count), computed.contains(&stage.as_str()), "{stage} {counts:?}");
        }
    };
    run("path = 'scans/*.txt'; samples = true", &["mean"]);
    let mean = bench.table("scans", "mean");
    assert_eq!((mean.rows(), mean.integers("surfaces").unwrap().value(0)), (2, 5));
    run("path = 'scans/*.txt'; samples = true; labels = { part = 'ring' }", &["mean"]);
    assert_eq!(bench.table("scans", "area").texts("part").unwrap().value(0), "ring");
    run("path = 'scans/*.txt'; samples = true; labels = { part = 7 }", &["mean"]);
    assert_eq!(bench.table("scans", "area").integers("part").unwrap().value(0), 7);
    // The first study has its tables back, and the store has all files that it wrote.
    run("path = 'scans/*.txt'", &[]);
    assert_eq!(bench.published("scans"), published);
    let now = bench.content();
    for (path, bytes) in stored.iter().filter(|(path, _)| path.starts_with("store")) {
        assert_eq!(now.get(path), Some(bytes), "{}", path.display());
    }
}

#[test]
fn a_lost_store_is_read_from_published_tables_with_labels() {
    let bench = bench();
    let keys = "path = 'scans/{specimen}-*.txt'; samples = true";
    bench.run(&study(keys));
    let mean = bench.table("scans", "mean");
    fs::remove_dir_all(bench.data().join("store")).unwrap();
    let more = study(keys) + &stages_from("area").aggregate("gap", "over = 'mean_gap'").text();
    bench.run(&more);
    assert_eq!(bench.table("scans", "mean"), mean);
    assert_eq!(bench.table("scans", "gap").rows(), 4);
    assert_eq!(bench.table("scans", "area").texts("specimen").unwrap().value(9), "B");
}

#[test]
fn queries_and_groups_use_labels_and_paths() {
    let bench = bench();
    let cases = "cases = [{ path = 'scans/A-1.txt', specimen = 'A', run = 1 }, \
                 { path = 'scans/B-1.txt', specimen = 'B', run = 2.5 }]";
    let text = study(cases)
        + &stages_from("area")
            .aggregate("of_paths", "over = 'area_fraction'; group_by = ['path', 'pressure']")
            .aggregate(
                "asked",
                "from = ['area', 'scan']; sql = 'select a.specimen, a.path, max(s.run) as run, \
                 max(a.area_fraction) as area from area a join scan s using (surface) \
                 group by a.specimen, a.path order by a.specimen'",
            )
            .text();
    bench.run(&text);
    let asked = bench.table("scans", "asked");
    let paths: Vec<_> = asked.texts("path").unwrap().iter().flatten().collect();
    assert_eq!(paths, ["scans/A-1.txt", "scans/B-1.txt"]);
    assert_eq!([real(&asked, "run", 0), real(&asked, "run", 1)], [1.0, 2.5]);
    let of_paths = bench.table("scans", "of_paths");
    assert_eq!(of_paths.rows(), 4);
    assert_eq!(of_paths.texts("path").unwrap().value(3), "scans/B-1.txt");
    // A moved file has the same contacts, and only stages that name its path are computed again.
    fs::rename(bench.path("scans/B-1.txt"), bench.path("scans/moved.txt")).unwrap();
    let counts = bench.run(&text.replace("scans/B-1.txt", "scans/moved.txt"));
    let computed: Vec<_> = counts.iter().filter(|(_, count)| !is_idle(count)).collect();
    let stages: Vec<&str> = computed.iter().map(|(stage, _)| stage.as_str()).collect();
    assert_eq!(stages, ["asked", "of_paths"]);
    assert_eq!(bench.table("scans", "asked").texts("path").unwrap().value(1), "scans/moved.txt");
}

#[test]
fn a_csv_file_gives_labels_by_path_or_name() {
    let bench = bench();
    let lines = "file;hours;note\nA-1.txt;1;first\nscans/A-2.txt;2.5;\nA-3.txt;4;last\n";
    fs::write(bench.path("labels.csv"), lines).unwrap();
    let keys = "path = 'scans/A-*.txt'; labels = 'labels.csv'";
    bench.run(&study(keys));
    let scan = bench.table("scans", "scan");
    let hours: Vec<f64> = (0..3).map(|row| real(&scan, "hours", row)).collect();
    assert_eq!(hours, [1.0, 2.5, 4.0]);
    let notes: Vec<_> = scan.texts("note").unwrap().iter().collect();
    assert_eq!(notes, [Some("first"), None, Some("last")]);
    let missing = refused(&bench, &study(&keys.replace("A-*", "B-*")));
    assert!(missing.contains("no line for \"scans/B-1.txt\""), "{missing}");
}

#[test]
fn scans_are_used_until_the_mean_is_known() {
    let bench = bench();
    let until = |limit: &str| {
        let until = format!("until = 'sem(area.area_fraction) < {limit}'");
        let number = format!("realizations = {{ at_least = 2, at_most = 9, {until} }}");
        bench.run(&study(&format!("path = 'scans/*.txt'; samples = true; {number}")));
        bench.table("scans", "mean").integers("surfaces").unwrap().value(0)
    };
    assert_eq!(until("90 %"), 2);
    // There are no more than five.
    assert_eq!(until("0.0001 %"), 5);
    bench.run(&study("path = 'scans/*.txt'; samples = true; realizations = 3"));
    assert_eq!(bench.table("scans", "mean").integers("surfaces").unwrap().value(0), 3);
}

#[test]
fn regions_of_one_scan_are_samples_if_they_do_not_overlap() {
    let bench = bench();
    let regions = |corner: f64| {
        let region = |x: f64| format!("{{ from = ['{x} um', '0 um'], size = ['5 um', '10 um'] }}");
        let crop = format!("crop = [{}, {}]", region(0.0), region(corner));
        study(&format!("path = 'scans/A-1.txt'; samples = true; {crop}"))
    };
    bench.run(&regions(5.0));
    let mean = bench.table("scans", "mean");
    assert_eq!((mean.rows(), mean.integers("surfaces").unwrap().value(0)), (2, 2));
    let overlapping = refused(&bench, &regions(2.5));
    assert!(overlapping.contains("two samples are maps of the same place"), "{overlapping}");
}

#[test]
fn samples_of_different_sides_are_compared_under_equal_pressures() {
    let bench = bench();
    write_scan(&bench, "scans/A-4.txt", 9, 20.0);
    let absolute = study("path = 'scans/A-*.txt'; samples = true");
    bench.run(&absolute);
    let mean = bench.table("scans", "mean");
    assert_eq!((mean.rows(), mean.integers("surfaces").unwrap().value(0)), (2, 4));
    let relative = absolute.replace("\"100 GPa\"", "1").replace("\"50 MPa\", \"200 MPa\"", "0.1");
    let said = refused(&bench, &relative);
    assert!(said.contains("samples of `scan` have different sides or steps"), "{said}");
}

#[test]
fn keys_that_resemble_others_and_names_of_columns_are_no_labels() {
    let bench = bench();
    let cases = |key: &str| study(&format!("cases = [{{ path = 'scans/A-1.txt', {key} }}]"));
    assert!(refused(&bench, &cases("levl = 'plane'")).contains("did you mean `level`?"));
    let taken = refused(&bench, &cases("pressure = 3"));
    assert!(taken.contains("a label cannot be called `pressure`"), "{taken}");
    assert!(refused(&bench, &cases("hurst = 'low'")).contains("must be a number"));
    bench.run(&cases("hurst = 0.3, part = 'ring', site = 2"));
    assert_eq!(bench.table("scans", "area").texts("part").unwrap().value(0), "ring");
    assert_eq!(real(&bench.table("scans", "area"), "hurst", 0), 0.3);
    let none = refused(&bench, &study("path = 'scans/C*.txt'"));
    assert!(none.contains("no file matches"), "{none}");
    let twice = study("path = 'scans/*-1.txt'").replace(
        "[stage.contact]",
        "[stage.other]\nkind = \"generate\"\nmethod = \"file\"\npath = \"scans/A-1.txt\"\n\
         periodic = false\nlabels = { specimen = \"A\" }\n\n[stage.contact]",
    );
    let said = refused(&bench, &twice);
    assert!(said.contains("same surface in `scan` and `other`"), "{said}");
}

#[test]
fn check_prints_a_line_about_each_map_and_warns_of_noise() {
    let bench = bench();
    let [said, _] = check(&bench, &study("path = 'scans/{specimen}-*.txt'; samples = true"));
    assert!(said.contains("scan: 2 parameter points with 2 to 3 samples each"), "{said}");
    let line =
        "scan: `scans/B-2.txt` 10 × 10 µm along x and y, 16 × 16 points with steps of 625 nm";
    assert!(said.contains(line), "{said}");
}

#[test]
fn studies_with_labels_are_compared_and_reported() {
    let bench = bench();
    let keys = "path = 'scans/{specimen}-*.txt'; samples = true";
    let first = study(keys);
    bench.run(&first);
    let manifest = bench.write(&first);
    let report = bench.output(&["report", manifest.to_str().unwrap()]);
    assert!(report.status.success(), "{}", text(&report.stderr));
    let page = fs::read_to_string(bench.data().join("results/scans/report.html")).unwrap();
    assert!(page.contains("specimen A") && page.contains("specimen B"));
    let second = bench.path("second.toml");
    fs::write(&second, first.replace("\"scans\"", "\"again\"").replace("100 GPa", "90 GPa"))
        .unwrap();
    let run = bench.output(&["run", second.to_str().unwrap()]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let diff =
        bench.output(&["diff", manifest.to_str().unwrap(), second.to_str().unwrap(), "--all"]);
    let printed = text(&diff.stdout) + &text(&diff.stderr);
    assert!(printed.contains("specimen"), "{printed}");
}

#[test]
fn pairs_and_yielded_surfaces_have_the_labels_of_the_surface_of_which_they_are_made() {
    let bench = bench();
    let keys = "path = 'scans/{specimen}-*.txt'; samples = true; edges = 'mirror'";
    let text = manifest("scans", "")
        .generate("scan", &scans(keys))
        .generate(
            "other",
            "nodes = 32; side = 20e-6; unit = 'm'; hurst = 0.8; k_lower = 2; k_upper = 8; \
             rms_slope = 0.1; realizations = 2",
        )
        .solve(
            "contact",
            "from = 'scan'; against = 'other'; mirror = 'x'; effective_modulus = '100 GPa'; \
             loads = ['50 MPa']",
        )
        .measure("area", "")
        .aggregate("mean", "over = 'area_fraction'")
        .solve(
            "pressed",
            "from = 'scan'; effective_modulus = '100 GPa'; hardness = '5 GPa'; loads = ['200 MPa']",
        )
        .generate("worn", "from = 'pressed'; method = 'yielded'; load = '200 MPa'")
        .measure("roughness", "what = 'roughness'")
        .aggregate("mean_roughness", "over = 'Sq'")
        .text();
    bench.run(&text);
    let mean = bench.table("scans", "mean");
    assert_eq!(mean.rows(), 2);
    let [count, surfaces] =
        ["count", "surfaces"].map(|name| mean.integers(name).unwrap().values().to_vec());
    // Both pairs of a scan are one sample.
    assert_eq!((count, surfaces), (vec![6, 4], vec![3, 2]));
    let rough = bench.table("scans", "mean_roughness");
    assert_eq!(rough.rows(), 2);
    assert_eq!(rough.integers("surfaces").unwrap().values(), &[3, 2]);
    let worn = bench.table("scans", "worn");
    assert!(worn.texts("specimen").unwrap().iter().all(|specimen| specimen.is_some()));
}
