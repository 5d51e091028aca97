//! Figures that a study declares, and automatic ones.

use std::fs;
use std::sync::LazyLock;

use crate::bench::{Bench, text};
use crate::manifest::{manifest, stages_from};
use crate::report::report;

/// Study of the area against the Hurst exponent under one load.
static HURST: LazyLock<String> = LazyLock::new(|| {
    manifest("hurst", "")
        .generate(
            "surfaces",
            "nodes = 32; hurst = [0.2, 0.5, 0.8]; k_lower = 2; k_upper = 8; realizations = 3",
        )
        .solve("contact", "loads = [0.05]")
        .measure("area", "")
        .text()
});

/// Statistics of the areas, and a figure of them.
static DECLARED: LazyLock<String> = LazyLock::new(|| {
    stages_from("area")
        .aggregate("statistics", "over = 'area_fraction'")
        .table(
            "figure.Poster",
            "from = 'statistics'; x = 'hurst'; y = 'area_fraction'; \
             theories = ['persson', 'greenwood-mccool']; title = 'Area against H'; \
             caption = 'The answer.'",
        )
        .text()
});

fn files(bench: &Bench) -> Vec<String> {
    let folder = bench.data().join("results/hurst/figures");
    let names = fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name());
    let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn areas_against_a_swept_parameter_are_the_first_figure_without_being_asked() {
    let bench = Bench::new();
    bench.run(&HURST);
    let (said, page) = report(&bench);
    assert_eq!(said["drawn"][0], "Contact area A/A₀ against Hurst exponent H", "{said}");
    assert!(page.contains("Points are means over 3 surfaces. Bars are 95 % confidence"), "{page}");
    assert!(page.contains("At y = 0.05."));
    let pdf = fs::read(bench.data().join("results/hurst/figures/area.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.7") && pdf.ends_with(b"%%EOF"));
}

#[test]
fn a_declared_figure_comes_first_and_replaces_the_automatic_one_of_its_stage() {
    let bench = Bench::new();
    bench.run(&format!("{}{}", *HURST, *DECLARED));
    let (said, page) = report(&bench);
    assert_eq!(said["drawn"][0], "Area against H");
    let drawn = said["drawn"].as_array().unwrap();
    let of_area = drawn.iter().filter(|title| title.as_str().unwrap().contains("against H"));
    assert_eq!(of_area.count(), 1, "{said}");
    assert!(page.contains("The answer. Points are means over 3 surfaces."));
    for ending in ["svg", "png", "pdf"] {
        assert!(files(&bench).contains(&format!("Poster.{ending}")));
    }
    let svg = fs::read_to_string(bench.data().join("results/hurst/figures/Poster.svg")).unwrap();
    for label in [">Hurst exponent H<", ">contact area A/A₀<", ">Persson 2001<"] {
        assert!(svg.contains(label), "{label} in {svg}");
    }
}

#[test]
fn files_of_a_figure_that_is_no_longer_declared_are_removed_and_no_task_is_computed_again() {
    let bench = Bench::new();
    bench.run(&format!("{}{}", *HURST, *DECLARED));
    report(&bench);
    let path =
        bench.write(&format!("{}{}", *HURST, *DECLARED).replace("figure.Poster", "figure.other"));
    let plan = bench.output(&["plan", path.to_str().unwrap(), "--json"]);
    let plan: serde_json::Value = serde_json::from_slice(&plan.stdout).unwrap();
    let stages = plan["stages"].as_array().unwrap();
    assert_eq!(stages.len(), 4);
    let is_finished = |stage: &serde_json::Value| stage["reasons"].as_array().unwrap().is_empty();
    assert!(stages.iter().all(is_finished), "{plan}");
    report(&bench);
    assert!(!files(&bench).iter().any(|name| name.starts_with("Poster")), "{:?}", files(&bench));
    assert!(files(&bench).contains(&"other.pdf".to_owned()));
}

#[test]
fn a_figure_that_cannot_be_drawn_says_what_it_needs() {
    let bench = Bench::new();
    let figures = "\n[figure.negative]\nfrom = \"surfaces\"\nx = \"hurst\"\ny = \"excess_kurtosis\"\n\
                   scale = \"log-y\"\n\n[figure.nothing]\nfrom = \"area\"\nx = \"hurst\"\n\
                   y = \"area_fraction\"\nwhere = { hurst = 0.4 }\n";
    bench.run(&format!("{}{figures}", *HURST));
    let path = bench.path("study.toml");
    let output = bench.output(&["report", path.to_str().unwrap()]);
    let printed = text(&output.stdout);
    assert!(output.status.success(), "{printed}");
    for part in ["missing  [figure.negative] needs ", "missing  [figure.nothing] needs "] {
        assert!(printed.contains(part), "{part} in {printed}");
    }
    assert!(printed.contains("needs rows with the values in `where`"), "{printed}");
    // Figures of the paper that do not apply are counted; the page lists them.
    assert_eq!(printed.matches("missing").count(), 2, "{printed}");
    assert!(printed.contains(" figures of the paper would need other data"), "{printed}");
}

#[test]
fn a_figure_has_the_size_the_title_and_the_legend_of_the_manifest() {
    let bench = Bench::new();
    let figure = DECLARED.replace(
        "caption =",
        "width = 86\nfont_size = 8\nlegend = { persson = \"theory of Persson\", \"this study\" = \
         \"exact\", \"0.7\" = \"misspelt\" }\ncaption =",
    );
    bench.run(&format!("{}{figure}", *HURST));
    let (_, page) = report(&bench);
    let folder = bench.data().join("results/hurst/figures");
    let svg = fs::read_to_string(folder.join("Poster.svg")).unwrap();
    // 86 mm are 325.04 pixels of 1/96 inch.
    for part in [" width=\"325.04\"", ">Area against H<", ">theory of Persson<", ">exact<"] {
        assert!(svg.contains(part), "{part} in {svg}");
    }
    assert!(!svg.contains("Persson 2001"));
    assert!(page.contains("<span>exact</span>"));
    assert!(page.contains("</code> renames &quot;0.7&quot;, which the figure does not have."));
    assert!(!page.contains("renames &quot;persson"));
    let png = fs::File::open(folder.join("Poster.png")).unwrap();
    let info = png::Decoder::new(std::io::BufReader::new(png)).read_info().unwrap();
    // 300 pixels to the inch.
    assert_eq!(info.info().width, (86.0f64 / 25.4 * 300.0).ceil() as u32);
    let pdf = fs::read(folder.join("Poster.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.7"));
}

#[test]
fn reasons_name_what_the_study_lacks_and_nothing_that_it_has() {
    let bench = Bench::new();
    bench.run(&HURST);
    let needs = |said: &serde_json::Value, name: &str| {
        let missing = said["missing"].as_array().unwrap();
        let found = missing.iter().find(|figure| figure["name"] == name);
        found.map(|figure| figure["needs"].as_str().unwrap().to_owned())
    };
    let (said, _) = report(&bench);
    let cutoffs = "random surfaces with two or more values of `k_upper`";
    assert_eq!(needs(&said, "nayak").as_deref(), Some(cutoffs));
    let collapse = "corrected areas of random surfaces with three or more spectra, at loads \
                    near 0.024, 0.06 and 0.14";
    assert_eq!(needs(&said, "collapse").as_deref(), Some(collapse));
    let light = "measured contacts at two or more loads up to 0.06";
    assert_eq!(needs(&said, "area-light").as_deref(), Some(light));
    let heavy = "measured contacts at loads above 0.06";
    assert_eq!(needs(&said, "area-full").as_deref(), Some(heavy));
    let correct =
        "\n[stage.corrected]\nkind = \"correct\"\nfrom = \"area\"\ncorrection = \"2017\"\n";
    let one = HURST.replace("hurst = [0.2, 0.5, 0.8]", "hurst = 0.8\nk_upper = [4, 8]");
    let one = one.replace("k_lower = 2\nk_upper = 8\n", "k_lower = 2\n");
    bench.run(&format!("{}{correct}", one.replace("[0.05]", "[0.024, 0.06, 0.14]")));
    let (said, _) = report(&bench);
    assert_eq!(needs(&said, "collapse").as_deref(), Some(collapse), "two spectra");
    assert_eq!(needs(&said, "nayak"), None);
    assert_eq!(needs(&said, "area-full"), None);
}

/// Areas of three exponents at four loads.
fn four_loads() -> String {
    HURST.replace("loads = [0.05]", "loads = [0.01, 0.02, 0.04, 0.08]")
}

/// Returns the values of an attribute of the markers of a drawing, or other parts of its text.
fn count(text: &str, part: &str) -> usize {
    text.matches(part).count()
}

#[test]
fn panels_show_expressions_curves_and_ranges_with_their_labels() {
    let bench = Bench::new();
    let figure = r#"
[figure.law]
from = "area"
x = "load"
where = { hurst = [0.2, 0.8] }
panels = [
    { y = "area_fraction / load", scale = "log-x" },
    { y = "slope(area_fraction)", where = { load = { to = 0.04 } } },
]
labels = { "area_fraction/load" = "secant of the area", "slope(area_fraction)" = "its slope" }
curves = [
    { area = "erf(sqrt(2) * load)", label = "as Persson" },
    { theory = "bush-gibson-thomas", nayak = 10 },
]
"#;
    bench.run(&format!("{}{figure}", four_loads()));
    let (_, page) = report(&bench);
    let folder = bench.data().join("results/hurst/figures");
    let svg = fs::read_to_string(folder.join("law.svg")).unwrap();
    for label in ["secant of the area", "its slope", "as Persson", "Bush, Gibson &amp; Thomas 1975"]
    {
        assert_eq!(count(&svg, &format!(">{label}<")), 1, "{label} in {svg}");
    }
    assert!(page.contains("Points are means over 3 surfaces."), "{page}");
}

#[test]
fn lines_and_panels_tell_several_parameters_apart() {
    let bench = Bench::new();
    let drawn = "from = 'area'; x = 'load'; y = 'area_fraction'";
    let told = stages_from("area")
        .table("figure.lines", &format!("{drawn}; colour = 'method'; dash = 'hurst'"))
        .table(
            "figure.panels",
            &format!("{drawn}; facet = ['method', 'hurst']; facet_in = 'column'"),
        )
        .table("figure.markers", &format!("{drawn}; lines = false"))
        .text();
    bench.run(&format!("{}{told}", four_loads()));
    report(&bench);
    let folder = bench.data().join("results/hurst/figures");
    let svg = |name: &str| fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
    for hurst in ["H = 0.2", "H = 0.5", "H = 0.8"] {
        assert!(svg("lines").contains(&format!(">{hurst}<")), "{hurst}");
        assert!(svg("panels").contains(&format!(">method filter · {hurst}<")), "{hurst}");
    }
    assert!(svg("lines").contains("stroke-dasharray"));
    assert!(!svg("markers").contains("stroke-dasharray"));
}

#[test]
fn a_curve_of_another_stage_has_the_parameters_of_its_rows() {
    let bench = Bench::new();
    let figure = &stages_from("area")
        .fit("relation", "law = 'load-separation'")
        .table(
            "figure.gaps",
            "from = 'area'; x = 'load'; y = 'mean_gap'; scale = 'log-x'; \
             curves = [{ value = 'decay_length * ln(closing_load / load)', from = 'relation', \
             label = 'fits' }]",
        )
        .text();
    bench.run(&format!("{}{figure}", four_loads()));
    report(&bench);
    let svg = fs::read_to_string(bench.data().join("results/hurst/figures/gaps.svg")).unwrap();
    assert_eq!(count(&svg, ">fits<"), 1, "{svg}");
    let without = figure.replace("decay_length * ln(closing_load / load)", "nothing * load");
    bench.run(&format!("{}{without}", four_loads()));
    report(&bench);
    let svg = fs::read_to_string(bench.data().join("results/hurst/figures/gaps.svg")).unwrap();
    assert_eq!(count(&svg, ">fits<"), 0, "no table has such a column");
}

#[test]
fn a_declared_figure_takes_the_place_of_that_of_the_report_with_its_name() {
    let bench = Bench::new();
    let figure = "\n[figure.Slope]\nfrom = \"area\"\nx = \"load\"\ny = \"area_fraction\"\n\
                  title = \"My own\"\n";
    bench.run(&format!("{}{figure}", four_loads()));
    let (said, _) = report(&bench);
    let drawn: Vec<&str> =
        said["drawn"].as_array().unwrap().iter().filter_map(|title| title.as_str()).collect();
    assert_eq!(drawn[0], "My own");
    assert!(!drawn.contains(&"Slope of the contact area under light load"), "{drawn:?}");
    assert!(drawn.contains(&"Contact area under light load"), "{drawn:?}");
}
