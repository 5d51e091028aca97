//! Pages and figures of `asperity report`.

use std::fs;
use std::sync::LazyLock;

use serde_json::Value;

use crate::bench::{Bench, STUDY, text};
use crate::manifest::manifest;

/// Writes a report and returns the output of the command and the page.
pub fn report(bench: &Bench) -> (Value, String) {
    let path = bench.path("study.toml");
    let output = bench.output(&["report", path.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let page = fs::read_to_string(said["page"].as_str().unwrap()).unwrap();
    (said, page)
}

#[test]
fn a_page_needs_no_other_file_and_holds_figures_tables_and_manifest() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let (said, page) = report(&bench);
    let drawn = said["drawn"].as_array().unwrap().len();
    assert!(drawn >= 7, "{said}");
    assert_eq!(page.matches("<figure ").count(), drawn);
    for fetched in ["src=\"http", "href=\"http", "<link", "@import", "src=\"figures"] {
        assert!(!page.contains(fetched), "{fetched}");
    }
    for part in ["complete: all", "realizations = 2", "area.parquet", "all 16 loads converged"] {
        assert!(page.contains(part), "{part}");
    }
}

/// Parses a number from the caption of each map of a slider.
fn caption_numbers(slider: &str, what: &str) -> Vec<f64> {
    let opening = format!("data-{what}=\"");
    let printed = slider.split(&opening).skip(1);
    let number = |printed: &str| printed.split([' ', '"']).next().unwrap().parse().unwrap();
    printed.map(number).collect()
}

#[test]
fn sliders_go_through_the_loads_of_single_surfaces_and_tell_what_their_tables_do() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let (_, page) = report(&bench);
    let sliders: Vec<&str> = page.split("<div class=\"loads\"").skip(1).collect();
    assert!(!sliders.is_empty());
    let area = bench.table("small", "area");
    let first = area.texts("surface").unwrap().value(0).to_owned();
    let surfaces = area.texts("surface").unwrap();
    let rows: Vec<usize> = (0..area.rows()).filter(|&row| surfaces.value(row) == first).collect();
    for (printed, column, unit) in
        [("load", "load", 1.0), ("area", "area_fraction", 100.0), ("gap", "mean_gap", 1.0)]
    {
        let values = area.reals(column).unwrap();
        let shown = caption_numbers(sliders[0], printed);
        assert_eq!(shown.len(), rows.len(), "{printed}");
        for (row, shown) in rows.iter().zip(shown) {
            // The captions have three digits.
            let expected = unit * values.value(*row);
            assert!((shown - expected).abs() <= 5e-3 * expected, "{printed}: {shown}");
        }
    }
    let pictures = sliders[0].matches("src=\"data:image/png;base64,").count();
    assert_eq!(pictures, rows.len());
}

#[test]
fn figures_are_the_same_bytes_again() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let figures = |bench: &Bench| {
        let folder = bench.data().join("results/small/figures");
        let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        let mut files: Vec<_> = files.map(|path| (path.clone(), fs::read(path).unwrap())).collect();
        files.sort();
        files
    };
    report(&bench);
    let first = figures(&bench);
    report(&bench);
    assert!(first == figures(&bench));
    assert!(first.iter().any(|(path, _)| path.ends_with("area-light.svg")));
    assert!(first.iter().any(|(path, _)| path.ends_with("area-light.png")));
}

#[test]
fn a_report_needs_results_and_says_which_are_missing() {
    let bench = Bench::new();
    let path = bench.write(&STUDY);
    let refused = bench.output(&["report", path.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    let printed = text(&refused.stderr);
    assert!(printed.contains("`small` has no results for the current manifest; run"), "{printed}");
    assert!(!bench.data().exists());
    bench.run(&STUDY[..STUDY.find("[stage.light]").unwrap()]);
    bench.write(&STUDY);
    let (_, page) = report(&bench);
    assert!(page.contains("unfinished: 4 of"));
    assert!(page.contains("Not finished yet: light"), "{page}");
}

#[test]
fn what_is_missing_is_named_with_the_lines_that_would_add_it() {
    let bench = Bench::new();
    let no_corrections = &STUDY[..STUDY.find("[stage.corrected]").unwrap()];
    bench.run(no_corrections);
    let (said, page) = report(&bench);
    let missing = said["missing"].as_array().unwrap();
    let corrected = missing.iter().find(|one| one["figure"] == "Corrected contact area");
    assert!(corrected.is_some(), "{said}");
    // These lines define a stage that reads the measured contacts.
    let proposed = "[stage.corrected]\nkind = &quot;correct&quot;\nfrom = &quot;area&quot;";
    assert!(page.contains(proposed));
}

#[test]
fn a_figure_that_a_study_has_no_more_is_taken_away() {
    let bench = Bench::new();
    bench.run(&STUDY);
    report(&bench);
    let file = bench.data().join("results/small/figures/area-corrected.svg");
    assert!(file.exists());
    bench.run(&STUDY[..STUDY.find("[stage.corrected]").unwrap()]);
    report(&bench);
    assert!(!file.exists());
}

/// Writes heights as a NumPy file.
fn npy(nodes: usize, height: impl Fn(f64, f64) -> f64) -> Vec<u8> {
    let header =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({nodes}, {nodes}), }}");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(118u16.to_le_bytes());
    bytes.extend(format!("{header:117}\n").bytes());
    let at = |node: usize| std::f64::consts::TAU * node as f64 / nodes as f64;
    for node in 0..nodes * nodes {
        bytes.extend(height(at(node / nodes), at(node % nodes)).to_le_bytes());
    }
    bytes
}

/// Study of two measured surfaces at pressures in pascals, from light to full contact.
fn measured(bench: &Bench, surfaces: &[&str]) {
    let waves = |x: f64, y: f64| (2.0 * x).cos() * y.sin() + 0.5 * (3.0 * x + 2.0 * y).sin();
    let worn = |x: f64, y: f64| 1e-8 * waves(x, y).min(0.2);
    std::fs::write(bench.path("new.npy"), npy(32, |x, y| 1e-8 * waves(x, y))).unwrap();
    std::fs::write(bench.path("worn.npy"), npy(32, worn)).unwrap();
    let surface = |name: &&str| {
        format!(
            "[stage.{name}]\nkind = \"generate\"\nmethod = \"file\"\npath = \"{name}.npy\"\n\
             side = 1e-6\nunit = \"m\"\nperiodic = true\n\n"
        )
    };
    let stages: String = surfaces.iter().map(surface).collect();
    bench.run(&format!(
        "[study]\nname = \"pascals\"\n\n{stages}[stage.contact]\nkind = \"solve\"\nfrom = {surfaces:?}\n\
         bodies = [{{ youngs_modulus = 50e9, poisson_ratio = 0.3 }}]\nload_unit = \"absolute\"\n\
         loads = {{ from = 2e7, to = 1e9, steps = 6, spacing = \"geometric\" }}\n\n\
         [stage.area]\nkind = \"measure\"\nfrom = \"contact\"\n"
    ));
}

fn figure(bench: &Bench, name: &str) -> String {
    let path = format!("data/results/pascals/figures/{name}.svg");
    fs::read_to_string(bench.path(&path)).unwrap()
}

#[test]
fn measured_surfaces_are_called_by_their_files() {
    let bench = Bench::new();
    measured(&bench, &["new", "worn"]);
    report(&bench);
    for name in ["area-full", "pressure", "gap"] {
        let svg = figure(&bench, name);
        for file in [">new.npy<", ">worn.npy<"] {
            assert_eq!(svg.matches(file).count(), 1, "{file} in {name}");
        }
        assert!(!svg.contains("rms_slope"), "{name}");
    }
}

#[test]
fn a_single_surface_is_no_mean() {
    let bench = Bench::new();
    measured(&bench, &["worn"]);
    let (_, page) = report(&bench);
    assert!(figure(&bench, "area-full").contains(">worn.npy<"));
    assert!(!page.contains("mean of the surfaces"));
}

#[test]
fn loads_beyond_light_ones_are_on_a_figure_and_pressures_where_there_is_a_modulus() {
    let bench = Bench::new();
    measured(&bench, &["new", "worn"]);
    let loads = bench.table("pascals", "area");
    let loads = loads.reals("load").unwrap().values().to_vec();
    let heaviest = loads.iter().copied().fold(0.0, f64::max);
    assert!(0.06 < heaviest && heaviest < 0.3, "{heaviest}");
    let (said, page) = report(&bench);
    let drawn = said["drawn"].as_array().unwrap();
    for title in
        ["Contact area under all loads", "Area and mean gap against the mean pressure", "Mean gap"]
    {
        assert!(drawn.iter().any(|one| one == title), "{title} in {said}");
    }
    // E* = 50 GPa/(1 − 0.3²); lengths and pressures have suitable SI prefixes.
    assert!(page.contains("E* = 54.9451 GPa"), "{page}");
    let pressure = figure(&bench, "pressure");
    assert!(pressure.contains(">mean gap ū, in nm<"), "{pressure}");
    assert!(pressure.contains(">mean pressure p₀, in GPa<"));

    let bench = Bench::new();
    bench.run(&STUDY);
    let (said, _) = report(&bench);
    let missing = said["missing"].to_string();
    assert!(missing.contains("against the mean pressure"), "{said}");
}

/// Study of a tilted scan of 24 × 16 nodes on 6 µm × 3 µm with three missing points, at pressures
/// in pascals, with additional stages.
fn scanned(bench: &Bench, further: &str) {
    let mut text = "# Width: 6 µm\n# Height: 3 µm\n# Value units: nm\n".to_owned();
    for j in 0..16_i32 {
        for i in 0..24_i32 {
            let height = rough(i, j) + f64::from(3 * i - 2 * j);
            let missing = [(3, 4), (4, 4), (20, 9)].contains(&(i, j));
            text += &if missing { "nan ".to_owned() } else { format!("{height:.6} ") };
        }
        text += "\n";
    }
    std::fs::write(bench.path("scan.txt"), text).unwrap();
    bench.run(&format!(
        "[study]\nname = \"pascals\"\n\n[stage.scan]\nkind = \"generate\"\nmethod = \"file\"\n\
         path = \"scan.txt\"\nperiodic = false\nlevel = \"plane\"\nfill = \"harmonic\"\n\n\
         [stage.contact]\nkind = \"solve\"\nfrom = \"scan\"\nboundary = \"free\"\n\
         bodies = [{{ youngs_modulus = 50e9, poisson_ratio = 0.3 }}]\nload_unit = \"absolute\"\n\
         loads = {{ from = 2e7, to = 1e9, steps = 4, spacing = \"geometric\" }}\n\n\
         [stage.area]\nkind = \"measure\"\nfrom = \"contact\"\n\n{further}"
    ));
}

/// Returns heights of a few nanometres whose amplitudes decrease with the wavelength.
fn rough(i: i32, j: i32) -> f64 {
    let wave = |k: i32| {
        let k = f64::from(k);
        let along = k.sin() * f64::from(i) / 24.0 + k.cos() * f64::from(j) / 16.0;
        20.0 * k.powf(-1.8) * (std::f64::consts::TAU * k * along + k * k).cos()
    };
    (1..12).map(wave).sum()
}

#[test]
fn a_measured_surface_has_its_map_its_heights_its_spectrum_and_its_slopes_without_being_asked() {
    let bench = Bench::new();
    scanned(&bench, "");
    let (said, page) = report(&bench);
    let drawn = said["drawn"].to_string();
    for title in [
        "Maps of heights",
        "Distribution of heights",
        "Power spectral density",
        "Slope by scale",
        "Contact maps",
    ] {
        assert!(drawn.contains(title), "{title} in {drawn}");
    }
    let maps = figure(&bench, "surfaces");
    for words in ["as measured", "0.78 % missing", "as pressed"] {
        assert_eq!(maps.matches(words).count(), 1, "{words} in {maps}");
    }
    // Two maps, each with a scale bar of a fifth to a third of 6 µm and a colour bar.
    assert_eq!(maps.matches(">2 µm<").count(), 2);
    assert_eq!(maps.matches(" nm<").count(), 4);
    for (name, words) in [
        ("heights", "height, nm"),
        ("spectrum", "power spectral density C(q), m⁴"),
        ("slope-at-scale", "distance ℓ, µm"),
        ("contact-maps", "2 µm"),
    ] {
        let svg = figure(&bench, name);
        assert!(svg.contains(&format!(">{words}<")), "{words} in {svg}");
    }
    assert_eq!(page.matches("</span>2 µm</div>").count(), 1, "one slider");
    assert!(page.contains("width: 33.33%"), "2 of 6 µm");
}

#[test]
fn what_stages_have_measured_of_a_surface_is_drawn_from_their_tables() {
    let bench = Bench::new();
    scanned(
        &bench,
        "[stage.spectrum]\nkind = \"measure\"\nfrom = \"scan\"\nwhat = \"spectrum\"\n\n\
         [stage.scales]\nkind = \"measure\"\nfrom = \"scan\"\nwhat = \"scales\"\n\n\
         [stage.law]\nkind = \"fit\"\nfrom = \"spectrum\"\nlaw = \"self-affine\"\n",
    );
    let (_, page) = report(&bench);
    let [spectrum, scales] = ["spectrum", "slope-at-scale"].map(|name| figure(&bench, name));
    // One curve each: the page prefers a table to its own computation.
    assert_eq!(spectrum.matches(">scan.txt<").count(), 1, "{spectrum}");
    assert_eq!(scales.matches(">scan.txt, along x<").count(), 1);
    assert_eq!(spectrum.matches(">self-affine law, fitted<").count(), 1);
    let law = bench.table("pascals", "law");
    let hurst = law.reals("hurst_exponent").unwrap().value(0);
    let printed = page.split("scan.txt H = ").nth(1).unwrap();
    let printed: f64 = printed.split(' ').next().unwrap().parse().unwrap();
    assert!((printed - hurst).abs() <= 5e-3 * hurst, "{printed} {hurst}");
    // Without a table, the page computes the same curve.
    let alone = Bench::new();
    scanned(&alone, "");
    report(&alone);
    assert!(figure(&alone, "slope-at-scale") == scales);
}

#[test]
fn a_measured_surface_whose_file_is_gone_is_shown_as_far_as_its_heights_were_kept() {
    let bench = Bench::new();
    scanned(&bench, "");
    report(&bench);
    fs::remove_file(bench.path("scan.txt")).unwrap();
    let heights = figure(&bench, "heights");
    report(&bench);
    assert!(figure(&bench, "heights") == heights);
    let maps = figure(&bench, "surfaces");
    assert!(maps.contains(">2 µm<") && !maps.contains("as measured"));

    let bench = Bench::new();
    scanned(&bench, "");
    let redrawn = fs::read_to_string(bench.path("study.toml")).unwrap();
    let redrawn = redrawn.replace("periodic = false", "periodic = false\nheights = \"redraw\"");
    bench.run(&redrawn);
    report(&bench);
    fs::remove_file(bench.path("scan.txt")).unwrap();
    let (said, page) = report(&bench);
    assert!(!said["drawn"].to_string().contains("Maps of heights"), "{said}");
    assert!(page.contains("the file of a measured surface, which is missing"), "{page}");
}

#[test]
fn theories_for_worn_surfaces_have_a_caveat_with_numbers() {
    let bench = Bench::new();
    measured(&bench, &["worn"]);
    let path = bench.path("study.toml");
    let printed = bench.output(&["run", path.to_str().unwrap()]);
    let printed = text(&printed.stdout);
    assert!(printed.contains("not isotropic Gaussian roughness: "), "{printed}");
    let (_, page) = report(&bench);
    let caveat = "assume isotropic Gaussian roughness, unlike worn.npy (";
    assert!(page.matches(caveat).count() >= 2, "{page}");

    // Random surfaces with an isotropic spectrum have no such note.
    let bench = Bench::new();
    let random = STUDY.replace("k_lower = 2", "k_lower = 6").replace("[4, 8]", "[12, 16]");
    bench.run(&random);
    let (_, page) = report(&bench);
    let said = page.split("isotropic Gaussian roughness").nth(1);
    assert_eq!(said.map(|after| &after[..80.min(after.len())]), None);
}

#[test]
fn a_page_or_a_figure_that_somebody_has_changed_is_found_and_stays_where_it_is() {
    let bench = Bench::new();
    bench.run(&STUDY);
    report(&bench);
    let verify = || bench.output(&["verify", "--json"]);
    assert!(verify().status.success());
    let folder = bench.data().join("results/small");
    for (name, from, to) in [
        ("report.html", "all 16 loads converged", "all 17 loads converged"),
        ("figures/area-light.svg", "load", "lead"),
    ] {
        let path = folder.join(name);
        let written = fs::read_to_string(&path).unwrap();
        fs::write(&path, written.replacen(from, to, 1)).unwrap();
        let output = verify();
        assert_eq!(output.status.code(), Some(1), "{name}");
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        let damaged = said["damaged"].as_array().unwrap();
        assert_eq!(damaged.len(), 1, "{said}");
        assert!(damaged[0]["cause"].as_str().unwrap().contains(name), "{said}");
        assert!(path.exists());
        fs::write(&path, written).unwrap();
    }
    let by_hand = bench.data().join("results/small/area.parquet");
    fs::write(&by_hand, "edited").unwrap();
    assert_eq!(verify().status.code(), Some(1));
}

#[test]
fn a_page_begins_with_the_answer_and_ends_with_its_provenance() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let (_, page) = report(&bench);
    let sections = ["summary", "results", "paper", "maps", "tables", "missing", "provenance"];
    let place = |id: &str| page.find(&format!("<section id=\"{id}\"")).expect(id);
    let places = sections.map(place);
    assert!(places.is_sorted(), "{places:?}");
    let summary = &page[places[0]..places[1]];
    for part in [
        "<code>k_upper</code> = 4, 8",
        "2 surfaces for each of 2 parameter points, 4 in total",
        "4 loads from 0.025 to 0.1",
        "means over the surfaces with 95 % intervals, at the load y = 0.05",
    ] {
        assert!(summary.contains(part), "{part} in {summary}");
    }
    // The intervals follow from the surfaces, though the stage has only the standard deviation.
    assert!(summary.contains(" ± "), "{summary}");
    for stage in ["surfaces", "light", "area", "corrected", "law", "curves"] {
        assert!(page[places[6]..].contains(&format!("<td>{stage}</td>")), "{stage}");
    }
}

#[test]
fn loads_in_pascals_are_in_pascals_on_axes_maps_and_sliders() {
    let bench = Bench::new();
    measured(&bench, &["worn"]);
    let (_, page) = report(&bench);
    for name in ["area-full", "gap"] {
        let svg = figure(&bench, name);
        let is_in_pascals = |unit| svg.contains(&format!(">mean pressure p₀, in {unit}<"));
        assert!(["MPa", "GPa"].into_iter().any(is_in_pascals), "{name}");
        assert!(!svg.contains(">load p₀/(E* h′)<"), "{name}");
    }
    let maps = figure(&bench, "contact-maps");
    assert!(maps.contains(">worn.npy · (a) ") && maps.contains("MPa<"), "{maps}");
    let slider = page.split("<div class=\"loads\"").nth(1).unwrap();
    assert!(slider.contains("data-load-name=\"mean pressure p₀\""), "{slider}");
    let loads = slider.split("data-load=\"").skip(1).map(|load| load.split('"').next().unwrap());
    assert!(loads.clone().count() > 1 && loads.clone().all(|load| load.ends_with("Pa")));
    assert_eq!(loads.last(), Some("1 GPa"));
    assert!(page.contains("6 loads from 38.4 MPa to 1 GPa"), "{page}");
}

#[test]
fn a_study_with_one_load_has_no_chart_of_one_place() {
    let bench = Bench::new();
    let study = &STUDY[..STUDY.find("[stage.law]").unwrap()];
    bench.run(&study.replace("{ to = 0.1, steps = 4 }", "[0.1]"));
    let (_, page) = report(&bench);
    for series in page.split("<g class=\"chart\"").skip(1) {
        let chart = series.split("</svg>").next().unwrap();
        let points = chart.split("data-points=\"").skip(1);
        let points = points.flat_map(|points| points.split('"').next().unwrap().split(' '));
        let places = points.map(|point| point.split(',').next().unwrap());
        let places: std::collections::BTreeSet<&str> = places.collect();
        assert!(places.len() > 1, "{chart}");
    }
}

#[test]
fn texts_on_a_page_have_no_backticks() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("nodes = 32", "nodes = 16"));
    let (_, page) = report(&bench);
    let head = &page[page.find("<body>").unwrap()..page.find("<h3>Manifest</h3>").unwrap()];
    assert!(head.contains("Warning:") && head.contains("<code>nodes = 16</code>"), "{head}");
    let outside = head.split("<pre>").map(|part| part.split("</pre>").last().unwrap());
    assert!(outside.clone().all(|part| !part.contains('`')));
}

/// Runs `asperity report --index` and returns its answer and the page.
fn index(bench: &Bench) -> (Value, String) {
    let output = bench.output(&["report", "--index", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let page = fs::read_to_string(said["page"].as_str().unwrap()).unwrap();
    (said, page)
}

#[test]
fn an_index_lists_all_studies_with_their_states_and_main_figures() {
    let bench = Bench::new();
    bench.run(&format!("# Two spectra.\n{}", *STUDY));
    report(&bench);
    let (said, page) = index(&bench);
    let study = &said["studies"][0];
    assert_eq!(study["name"], "small");
    assert_eq!(study["state"], "finished");
    assert_eq!(study["description"], "Two spectra.");
    assert_eq!(study["surfaces"], 4);
    assert_eq!(study["problems"], serde_json::json!([]));
    let picture = study["picture"].as_str().unwrap();
    assert!(bench.data().join("results").join(picture).is_file(), "{picture}");
    assert!(page.contains("small&#x2f;report.html") && page.contains("Two spectra."));
    // A second study, of which a task is missing, and which has no report.
    bench.run(&STUDY.replace("\"small\"", "\"more\""));
    let record = bench.data().join("plans/more.json");
    let mut recorded: Value = serde_json::from_slice(&fs::read(&record).unwrap()).unwrap();
    recorded["stages"][0]["finished"] = 3.into();
    fs::write(&record, recorded.to_string()).unwrap();
    let (said, page) = index(&bench);
    let more = &said["studies"][0];
    assert_eq!(more["name"], "more");
    assert_eq!(more["state"], "incomplete");
    assert_eq!(more["page"], Value::Null);
    assert_eq!(said["studies"].as_array().unwrap().len(), 2);
    assert!(page.contains("3 of 4 tasks") && page.contains("no report yet"), "{page}");
}

#[test]
fn an_index_says_what_is_damaged_and_refuses_an_empty_folder() {
    let bench = Bench::new();
    let refused = bench.output(&["report", "--index"]);
    assert!(!refused.status.success());
    assert!(text(&refused.stderr).contains("has no studies"), "{}", text(&refused.stderr));
    bench.run(&STUDY);
    report(&bench);
    let results = bench.data().join("results/small");
    fs::write(results.join("area.parquet"), "edited").unwrap();
    fs::write(results.join("owner.json"), "{").unwrap();
    let page = fs::read_to_string(results.join("report.html")).unwrap();
    fs::write(results.join("report.html"), page.replacen("4 loads", "5 loads", 1)).unwrap();
    fs::remove_file(bench.data().join("plans/small.json")).unwrap();
    let (said, page) = index(&bench);
    let study = &said["studies"][0];
    assert_eq!(study["state"], "unknown");
    let problems = study["problems"].to_string();
    for part in ["area.parquet", "owner.json", "small/report.html", "small.json"] {
        assert!(problems.contains(part), "{part} in {problems}");
    }
    assert_eq!(page.matches("Damaged:").count(), 4, "{page}");
    // A page of somebody else stays.
    fs::write(bench.data().join("results/index.html"), "<html>").unwrap();
    let refused = bench.output(&["report", "--index"]);
    assert!(text(&refused.stderr).contains("was not written by"), "{}", text(&refused.stderr));
}

/// Returns a text that would end a script, a tag and an attribute.
fn hostile(name: &str) -> String {
    format!("</script><evil-{name}>\" evil='{name}' &")
}

#[test]
fn no_text_of_a_page_is_read_as_markup() {
    let bench = Bench::new();
    let heights = |j: i32| -> String {
        (0..24).map(|i| format!("{:.6} ", rough(i, j))).chain(["\n".to_owned()]).collect()
    };
    let rows: String = (0..16).map(heights).collect();
    let head = "# Channel: <evil-channel>\n# Width: 6 µm\n# Height: 3 µm\n# Value units: nm\n";
    fs::write(bench.path("<evil-file>\" &.txt"), format!("{head}{rows}")).unwrap();
    let [description, title, caption, code, legend, theory] =
        ["description", "title", "caption", "code", "legend", "theory"].map(hostile);
    bench.run(&format!(
        r#"# {description}
[study]
name = "hostile"

[stage.scan]
kind = "generate"
method = "file"
path = '<evil-file>" &.txt'
periodic = false
level = "plane"

[stage.contact]
kind = "solve"
from = "scan"
boundary = "free"
bodies = [{{ youngs_modulus = "50 GPa", poisson_ratio = 0.3 }}]
loads = ["10 MPa", "20 MPa"]

[stage.area]
kind = "measure"
from = "contact"

[stage.query]
kind = "aggregate"
from = "area"
sql = '''select load, area_fraction as "<evil-column>", '<evil-value>' as word from area'''

[figure.one]
from = "area"
x = "pressure"
y = "area_fraction"
facet = "content"
title = '''{title}'''
caption = '''{caption} `{code}`'''
legend = {{ area_fraction = '''{legend}''', persson = '''{theory}''' }}
theories = ["persson"]

[figure.two]
from = "query"
x = "load"
y = "<evil-column>"
"#
    ));
    let (_, page) = report(&bench);
    for name in [
        "description",
        "title",
        "caption",
        "code",
        "legend",
        "theory",
        "channel",
        "file",
        "column",
        "value",
    ] {
        assert!(page.contains(&format!("&lt;evil-{name}")), "`{name}` is not on the page");
    }
    assert!(!page.contains("<evil"), "{page}");
    assert_eq!((page.matches("<script").count(), page.matches("</script").count()), (2, 2));
    // The title is also in the JSON of the page, which has its own quotes.
    assert!(!page.replace("\\\" evil", "").contains("\" evil"), "{page}");
    let figures = bench.data().join("results/hostile/figures");
    for file in fs::read_dir(&figures).unwrap() {
        let file = file.unwrap().path();
        let is_svg = file.extension().is_some_and(|ending| ending == "svg");
        assert!(!is_svg || !fs::read_to_string(&file).unwrap().contains("<evil"), "{file:?}");
    }
    // The page still lists the digests of its figures.
    assert!(bench.output(&["verify"]).status.success());
    let figure = figures.join("one.svg");
    fs::write(&figure, fs::read_to_string(&figure).unwrap() + " ").unwrap();
    assert_eq!(bench.output(&["verify"]).status.code(), Some(1));
    let copy = bench.data().join("results/<evil-study>");
    fs::create_dir(&copy).unwrap();
    fs::copy(bench.data().join("results/hostile/owner.json"), copy.join("owner.json")).unwrap();
    let (_, page) = index(&bench);
    assert!(page.contains("&lt;evil-study") && page.contains("&lt;evil-description"), "{page}");
    assert!(!page.contains("<evil") && !page.contains("\" evil"), "{page}");
}

#[test]
fn files_that_a_received_page_or_owner_names_are_not_read() {
    let bench = Bench::new();
    bench.run(&STUDY);
    report(&bench);
    fs::write(bench.path("private.toml"), "# A secret.\n[study]\nname = \"small\"\n").unwrap();
    let folder = bench.data().join("results/small");
    let owner = fs::read_to_string(folder.join("owner.json")).unwrap();
    fs::write(folder.join("owner.json"), owner.replace("study.toml", "private.toml")).unwrap();
    // A device has no end, and a pipe would wait for a writer.
    let listed = ["../../../../../../../../dev/zero", "/dev/zero", "link.svg"];
    let files: Vec<String> = listed.iter().map(|name| format!("\"{name}\":\"00\"")).collect();
    let basis = format!("{{\"figures\":[],\"rows\":{{}},\"files\":{{{}}}}}", files.join(","));
    let page = format!("<script id=\"basis\">{basis}</script>");
    fs::write(folder.join("report.html"), page).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.join("figures/link.svg")).unwrap();
    let pipe = folder.join("pipe.parquet");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let output = bench.output(&["verify"]);
    let printed = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    for part in ["report.html` was edited", "link.svg` was edited", "it is not a regular file"] {
        assert!(printed.contains(part), "{part} in {printed}");
    }
    let (said, page) = index(&bench);
    assert!(said["studies"][0]["manifest"].as_str().unwrap().ends_with("private.toml"), "{said}");
    assert!(!said.to_string().contains("secret") && !page.contains("secret"), "{page}");
    fs::remove_file(pipe).unwrap();
}

/// Study of two spectra under light pressures in MPa, with means that are grouped by pressure.
static IN_MEGAPASCALS: LazyLock<String> = LazyLock::new(|| {
    manifest("pascals", "")
        .generate(
            "surfaces",
            "nodes = 32; side = '100 um'; hurst = [0.5, 0.8]; k_lower = 2; k_upper = 8; \
             rms_slope = 0.1; realizations = 2",
        )
        .solve(
            "contact",
            "bodies = [{ youngs_modulus = '105 GPa', poisson_ratio = 0.3, \
             conductivity = '50 W/(m K)' }]; \
             loads = { from = '5 MPa', to = '50 MPa', steps = 6, spacing = 'geometric' }; \
             stiffness = true",
        )
        .measure("area", "")
        .aggregate(
            "means",
            "group_by = ['hurst', 'pressure']; over = ['mean_gap', 'thermal_conductance']; \
             statistics = ['mean', 'sd']",
        )
        .aggregate(
            "query",
            "from = 'area'; sql = 'select hurst, pressure, \
             avg(mean_gap) as mean_gap from area group by hurst, pressure'",
        )
        .text()
});

#[test]
fn axes_summary_and_tables_of_statistics_have_the_units_of_the_manifest() {
    let bench = Bench::new();
    bench.run(&IN_MEGAPASCALS);
    let (_, page) = report(&bench);
    let svg = figure(&bench, "means");
    for label in ["mean pressure p₀, in MPa", "mean gap ū, in µm"] {
        assert!(svg.contains(&format!(">{label}<")), "{label} in {svg}");
    }
    // The symbol has a subscript.
    assert!(svg.contains(">thermal conductance h<tspan ") && svg.contains(">c</tspan>"), "{svg}");
    let summary = page.split("<section id=\"summary\"").nth(1).unwrap();
    let summary = summary.split("</section>").next().unwrap();
    for part in
        ["mean gap ū, in µm", "thermal conductance h<sub>c</sub>, in kW/(m² K)", "7.339 MPa"]
    {
        assert!(summary.contains(part), "{part} in {summary}");
    }
    for head in ["pressure [MPa]", "mean_gap_mean [µm]", "mean_gap [µm]"] {
        assert!(page.contains(&format!(">{head}</button>")), "{head}");
    }
    assert!(!page.contains("in the unit of"), "{page}");
    let manifest = bench.path("study.toml");
    let print = |arguments: &[&str]| {
        let output = bench.output(&[&["table", manifest.to_str().unwrap()], arguments].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    for arguments in [
        &["means", "--columns", "pressure,mean_gap_mean"][..],
        &["query"],
        &["--sql", "select pressure, mean_gap from area"],
    ] {
        let printed = print(arguments);
        assert!(printed.contains("pressure [MPa]") && printed.contains(" [µm]"), "{printed}");
    }
}

#[test]
fn axes_of_light_loads_end_where_the_data_end() {
    let bench = Bench::new();
    bench.run(&IN_MEGAPASCALS);
    let (_, page) = report(&bench);
    for name in ["area-light", "slope", "area-corrected"] {
        let Some(figure) = page.split(&format!("<figure id=\"{name}\"")).nth(1) else {
            assert_eq!(name, "area-corrected", "the study corrects no areas");
            continue;
        };
        let ends = figure.split("data-x=\"").nth(1).unwrap().split('"').next().unwrap();
        let end: f64 = ends.split(' ').nth(1).unwrap().parse().unwrap();
        assert!((50.0..53.0).contains(&end), "{name} ends at {end} MPa, its data at 50 MPa");
    }
}
