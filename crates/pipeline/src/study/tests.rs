//! Tests of the interpretation of valid manifests, and of messages about invalid ones.

mod rectangles;

use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use asperity_manifest::decimal;
use asperity_mechanics::topography::random::RandomSurface;
use asperity_stages::surface::Origin;
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::{Recipe, solve};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/manifests")
}

// Compares all messages with snapshots. Review changes with `cargo insta review`.
#[test]
fn every_mistake_is_explained() {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(folder().join("messages"));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    let entries = fs::read_dir(folder()).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    assert!(paths.len() > 50, "the manifests are gone");
    for path in paths {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let errors = Study::parse(&text, &format!("{name}.toml"), &folder());
        let page = errors.expect_err(name).render(false);
        settings.bind(|| insta::assert_snapshot!(name, page));
    }
}

const ALL_KINDS: &str = r#"
[study]
name = "all-kinds"
seed = 7

[stage.rough]
kind = "generate"
nodes = 64
hurst = [0.5, 0.8]
cases = [{ k_lower = 1, k_upper = 16 }, { k_lower = 4, k_upper = 32 }]
realizations = 3
heights = "redraw"

[stage.map]
kind = "generate"
method = "file"
path = "maps/rough.npy"
side = 2
periodic = false
edges = "taper"

[stage.ball]
kind = "generate"
method = "paraboloid"
nodes = 64
radius = [1, 2.5]

[stage.light]
kind = "solve"
from = ["rough", "map"]
loads = { to = 0.06, steps = 3 }
pressures = [0.02]

[stage.heavy]
kind = "solve"
from = ["rough", "map"]
bodies = [{ youngs_modulus = 2e11, poisson_ratio = 0.3 }, { youngs_modulus = 7e10, poisson_ratio = 0.33 }]
loads = { from = 0.06, to = 0.6, steps = 2, spacing = "geometric" }

[stage.area]
kind = "measure"
from = ["light", "heavy"]

[stage.heights]
kind = "measure"
from = "rough"
bins = 50

[stage.true_area]
kind = "correct"
from = "area"
correction = ["none", "pi/8", "2017", 0.1, { name = "mine", coefficient = 0.2 }]

[stage.law]
kind = "fit"
from = "true_area"
kappa = ["free", 2.5]

[stage.growth]
kind = "fit"
law = "mean-pressure"
from = "area"

[stage.separation]
kind = "fit"
law = "load-separation"
from = "area"

[stage.means]
kind = "aggregate"
from = "true_area"
over = ["area_corrected", "switches"]
statistics = ["mean", "median", "q05", "ci95", "slope"]

[stage.counts]
kind = "aggregate"
from = ["rough", "area"]
sql = "select count(*) as n from area"
"#;

fn parse(text: &str) -> Result<Study, ManifestErrors> {
    Study::parse(text, "test.toml", &folder())
}

#[track_caller]
fn study(text: &str) -> Study {
    parse(text).unwrap_or_else(|errors| panic!("{}", errors.render(false)))
}

#[track_caller]
fn message(text: &str) -> String {
    parse(text).expect_err(text).render(false)
}

/// Reverses the order of the tables in a manifest, and of the keys in each table.
fn reversed(text: &str) -> String {
    let tables = text.trim().split("\n\n").map(|table| {
        let (head, keys) = table.split_once('\n').unwrap();
        let keys: Vec<_> = keys.lines().rev().collect();
        format!("# a comment\n{head} # another\n\n  {}\n", keys.join("\n\t"))
    });
    let mut tables: Vec<_> = tables.collect();
    tables.reverse();
    tables.join("\n")
}

fn by_name(study: &Study) -> Vec<(String, Vec<String>, Work)> {
    let name = |input: &usize| study.stages[*input].name.clone();
    let stages = study.stages.iter().map(|stage| {
        let inputs = stage.inputs.iter().map(name).collect();
        (stage.name.clone(), inputs, stage.work.clone())
    });
    let mut stages: Vec<_> = stages.collect();
    stages.sort_by(|one, other| one.0.cmp(&other.0));
    stages
}

#[test]
fn comments_order_and_formatting_change_nothing() {
    let (plain, changed) = (study(ALL_KINDS), study(&reversed(ALL_KINDS)));
    assert_eq!(by_name(&plain), by_name(&changed));
    assert_eq!((plain.name, plain.sources), (changed.name, changed.sources));
}

#[test]
fn whole_numbers_stand_for_numbers() {
    let written = ALL_KINDS.replace("side = 2\n", "side = 2.0\n");
    let written = written.replace("radius = [1,", "radius = [1e0,");
    assert_eq!(study(ALL_KINDS), study(&written));
}

#[test]
fn stages_follow_what_they_read_and_otherwise_the_file() {
    let study = study(ALL_KINDS);
    for (position, stage) in study.stages.iter().enumerate() {
        assert!(stage.inputs.iter().all(|&input| input < position), "{}", stage.name);
    }
    let names: Vec<_> = study.stages.iter().map(|stage| stage.name.as_str()).collect();
    assert_eq!(names[..5], ["rough", "map", "ball", "light", "heavy"]);
}

#[test]
fn cases_come_first_and_the_last_swept_key_runs_fastest() {
    let text = |rest: &str| format!("{}{rest}", surface("k_lower = [1, 2]\nnodes = [64, 128]\n"));
    let grid: Vec<_> = surfaces(&text("cases = [{ k_upper = 16 }, { k_upper = 8 }]\n"))
        .iter()
        .map(|(nodes, surface)| (surface.spectrum.k_upper, *nodes, surface.spectrum.k_lower))
        .collect();
    let expected = [16, 8].into_iter().flat_map(|k_upper| {
        [(64, 1), (64, 2), (128, 1), (128, 2)].map(|(nodes, k_lower)| (k_upper, nodes, k_lower))
    });
    assert_eq!(grid, expected.collect::<Vec<_>>());
}

fn surface(rest: &str) -> String {
    let head = "[study]\nname = \"s\"\nseed = 3\n[stage.s]\nkind = \"generate\"\nhurst = 0.8\n";
    format!("{head}{rest}")
}

fn surfaces(text: &str) -> Vec<(u32, RandomSurface)> {
    let Work::Generate(ensembles) = &study(text).stages[0].work else {
        panic!("no surfaces");
    };
    let form = |ensemble: &PlannedSurfaces| match &ensemble.params.origin {
        Origin::Random { nodes, surface, .. } => (nodes.0[0], *surface),
        _ => panic!("not random"),
    };
    ensembles.iter().map(form).collect()
}

#[test]
fn a_study_has_the_surfaces_of_all_its_points() {
    let text = surface("nodes = 64\nk_lower = [1, 2]\nk_upper = 16\nrealizations = 3\n");
    let study = study(&text);
    assert_eq!(study.surfaces(), 6);
    assert_eq!(crate::plan::Plan::new(&study).tasks.len(), 6);
}

#[test]
fn the_plateau_ends_at_the_lower_cutoff_and_the_seed_is_the_studys() {
    let found = surfaces(&surface("nodes = 64\nk_lower = 2\nk_upper = 32\n"));
    assert_eq!(found[0].1.spectrum.k_rolloff, 2);
    assert_eq!((found[0].1.seed, found[0].1.realization), (3, 0));
}

fn block(loads: &str) -> solve::Params {
    let surface = surface("nodes = 64\nk_lower = 2\nk_upper = 32\n");
    let text = format!("{surface}[stage.c]\nkind = \"solve\"\nfrom = \"s\"\n{loads}\n");
    match &study(&text).stages[1].work {
        Work::Evaluate(recipes) => match &recipes[0] {
            Recipe::Solve(block) => block.as_ref().clone(),
            _ => panic!("no block"),
        },
        _ => panic!("no block"),
    }
}

#[test]
fn bins_to_a_pressure_with_a_unit_are_multiples_of_the_modulus_and_the_given_slope() {
    let keys = "effective_modulus = \"100 GPa\"\nloads = [\"1 GPa\"]\n\
                pressure_bins = { count = 4, to = \"20000 MPa\" }\n";
    let given = block(keys);
    assert_eq!(given.pressure_bins.map(|bins| bins.to), Some(0.2));
    assert_eq!(given, block(&keys.replace("\"20000 MPa\"", "0.2")));
    let rough = "nodes = 64\nside = \"9 um\"\nk_lower = 2\nk_upper = 32\n";
    let pressed = format!("[stage.c]\nkind = \"solve\"\nfrom = \"s\"\n{keys}");
    for several in ["rms_height = \"1 um\"\n", "rms_slope = [0.1, 0.2]\n"] {
        let told = message(&format!("{}{several}{pressed}", surface(rough)));
        assert!(told.contains("surfaces do not have one given `rms_slope`"), "{told}");
        assert!(told.contains("this pressure is 0.2 / (rms slope)"), "{told}");
    }
    let gaps = message(&format!(
        "{}{pressed}gap_bins = {{ count = 4, to = \"10 nm\" }}\n",
        surface("nodes = 64\nk_lower = 2\nk_upper = 32\n")
    ));
    assert!(gaps.contains("`gap_bins.to` has a unit, but its bins"), "{gaps}");
}

#[test]
fn bins_to_a_length_are_multiples_of_the_given_rms_height() {
    let rough =
        surface("nodes = 64\nside = \"9 um\"\nk_lower = 2\nk_upper = 32\nrms_height = \"1 um\"\n");
    let stages = |to: &str| {
        let bins = format!("gap_bins = {{ count = 4, to = {to} }}");
        let pressed = format!("[stage.c]\nkind = \"solve\"\nfrom = \"s\"\nloads = [0.1]\n{bins}\n");
        study(&format!("{rough}{pressed}")).stages
    };
    assert_eq!(stages("\"2500 nm\""), stages("2.5"));
}

#[test]
fn the_modulus_ratio_of_a_coating_may_be_a_ratio_of_moduli() {
    let coated = |ratio: &str| {
        block(&format!(
            "loads = [0.1]\nsubstrate = {{ poisson_ratio = 0.3 }}\n\
             layer = {{ thickness = 0.1, poisson_ratio = 0.3, modulus_ratio = {ratio} }}\n"
        ))
    };
    let plain = coated("\"2 / 210\"");
    for ratio in ["\"2 GPa / 210 GPa\"", "\"2000 MPa/210 GPa\"", "0.00952380952381"] {
        assert_eq!(coated(ratio), plain, "{ratio}");
    }
}

#[test]
fn a_block_leaves_its_start_out_and_ends_exactly() {
    let linear = block("loads = { from = 0.1, to = 0.7, steps = 3 }").loads;
    assert_eq!(linear, [0.3, 0.5, 0.7]);
    let geometric = block("loads = { from = 0.01, to = 1, steps = 2, spacing = \"geometric\" }");
    assert_eq!(geometric.loads, [0.1, 1.0]);
    assert_eq!(block("loads = { to = 2, steps = 1 }").loads, [2.0]);
}

#[test]
fn spaced_loads_are_the_numbers_that_a_person_would_write() {
    let loads = block("loads = { to = 0.06, steps = 6 }").loads;
    assert_eq!(loads, [0.01, 0.02, 0.03, 0.04, 0.05, 0.06]);
    let octaves = block("loads = { from = 1e-3, to = 0.008, steps = 3, spacing = \"geometric\" }");
    assert_eq!(octaves.loads, [0.002, 0.004, 0.008]);
    let to_full_contact =
        block("loads = { from = 0.06, to = 1.7, steps = 40, spacing = \"geometric\" }");
    for load in to_full_contact.loads {
        let written = format!("{load:e}");
        let digits = written.split('e').next().unwrap().replace('.', "");
        assert!(digits.len() <= decimal::DIGITS, "{load}");
    }
}

#[test]
fn a_load_with_a_computers_rounding_is_the_one_that_was_meant() {
    let computed = block("loads = [0.019999999999999997, 0.06000000000000001]");
    assert_eq!(computed.loads, block("loads = [0.02, 0.06]").loads);
}

#[test]
fn swept_numbers_that_differ_by_rounding_are_one() {
    let surface = surface("nodes = 64\nk_lower = 2\nk_upper = 32\n");
    for text in [
        surface.replace("0.8", "[0.3, 0.30000000000000004]"),
        format!("{surface}rms_slope = [0.1, 0.09999999999999999]\n"),
        format!("{surface}side = [1, 1.0000000000000002]\n"),
    ] {
        let page = message(&text);
        assert!(page.contains("two cases are identical"), "{page}");
    }
    let computed = surfaces(&surface.replace("0.8", "0.30000000000000004"));
    assert_eq!(computed[0].1.spectrum.hurst, 0.3);
}

#[test]
fn chosen_loads_are_those_of_the_block() {
    let written = "loads = { to = 0.3, steps = 3 }\npressures = [0.2, 0.1, 0.3]";
    let block = block(written);
    assert_eq!(block.pressures, solve::Pressures::At(block.loads));
}

#[test]
fn two_equal_bodies_have_half_the_modulus_of_one_against_a_rigid_body() {
    let body = "{ youngs_modulus = 3, poisson_ratio = 0.5 }";
    // E* = E/(1 − ν²) for a single elastic body.
    assert_eq!(block(&format!("loads = [1]\nbodies = [{body}]")).effective_modulus, 4.0);
    let two = block(&format!("loads = [1]\nbodies = [{body}, {body}]"));
    assert_eq!(two.effective_modulus, 2.0);
}

#[test]
fn a_number_is_named_in_its_shortest_form() {
    let study = study(&ALL_KINDS.replace("0.1, { name", "0.100, 1e-3, { name"));
    let corrections = study.stages.iter().find_map(|stage| match &stage.work {
        Work::Evaluate(recipes) => match &recipes[0] {
            Recipe::Correct(params) => Some(&params.corrections),
            _ => None,
        },
        _ => None,
    });
    let names = corrections.unwrap().iter().map(|correction| correction.name.as_str());
    let names: Vec<_> = names.collect();
    assert_eq!(names, ["none", "pi/8", "2017", "0.1", "0.001", "mine"]);
}

#[test]
fn one_mistake_hides_no_other() {
    let text = ALL_KINDS
        .replace("nodes = 64\nhurst", "nodes = \"many\"\nhurst")
        .replace("side = 2", "side = -2")
        .replace("steps = 3", "steps = 0")
        .replace("from = \"true_area\"\nkappa", "from = \"true-area\"\nkappa")
        .replace("\"q05\"", "\"q5\"");
    assert_eq!(parse(&text).unwrap_err().problems().len(), 5, "{}", message(&text));
}

#[test]
fn manifests_that_ship_make_sense() {
    let root = &Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let entries = fs::read_dir(root.join("manifests")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    for path in paths.filter(|path| path.extension().is_some_and(|end| end == "toml")) {
        if let Err(errors) = Study::read(&path, &[]) {
            panic!("{}", errors.render(false));
        }
    }
}

#[test]
fn a_manifest_that_cannot_be_read_says_why() {
    let missing = Study::read(Path::new("no/such.toml"), &[]).unwrap_err();
    assert!(missing.render(false).contains("cannot read manifest `no/such.toml`"));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("latin.toml");
    fs::write(&file, b"[study]\nname = \"\xe9\"\n").unwrap();
    let latin = Study::read(&file, &[]).unwrap_err().render(false);
    assert!(latin.contains("invalid utf-8"), "{latin}");
}

// Manifests that are not realistic must not break anything.

#[test]
fn huge_grids_are_refused_without_being_spread() {
    let list = |numbers: std::ops::Range<u32>| {
        let numbers: Vec<_> = numbers.map(|number| number.to_string()).collect();
        numbers.join(", ")
    };
    let text = surface(&format!(
        "nodes = 64\nk_upper = 32\nk_lower = [{0}]\nseed = [{1}]\nside = [{1}]\nrms_slope = [{1}]\n",
        list(1..33),
        list(1..2000)
    ));
    assert!(message(&text).contains("the maximum is 10000"));
    let many = surface("nodes = 64\nk_upper = 32\nk_lower = 1\nrealizations = 1000000\n");
    let twice = many.replace("hurst = 0.8", "hurst = [0.7, 0.8, 0.9]");
    assert!(message(&twice).contains("more than 2000000 tasks"));
}

#[test]
fn hostile_manifests_are_refused_and_nothing_breaks() {
    let deep =
        |open: &str, close: &str| format!("a = {}{}", open.repeat(100_000), close.repeat(100_000));
    let stages = (1..3000).map(|n| format!("[stage.s{n}]\nkind='fit'\nfrom='s{}'\n", n - 1));
    let texts = [
        deep("[", "]"),
        deep("{a=", "}"),
        format!("{} = 1", ["a"; 100_000].join(".")),
        stages.collect(),
        "[[stage]]\n[[study]]\n".to_owned(),
        "stage = 1\nstudy = []\n".to_owned(),
        "[study]\nname='s'\n[stage]\na=1\nb=[1]\nc={kind={}}\nd={kind='solve',from={a=1}}"
            .to_owned(),
        "a=1\n".repeat(20_000),
        surface(&(0..20_000).map(|n| format!("k{n} = {n}\n")).collect::<String>()),
        surface(&format!("hurst = [{}]", "'x',".repeat(50_000))),
        surface(&format!("[stage.t]\nkind='fit'\nfrom=[{}]", "'x',".repeat(50_000))),
        "\u{feff}".to_owned(),
    ];
    for text in texts {
        assert!(!message(&text).is_empty());
    }
}

proptest::proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(text in "(?s)[\\[\\]{}=,.\"'\\n# a-z0-9]{0,200}|.{0,60}") {
        if let Err(errors) = parse(&text) {
            errors.render(true);
        }
    }

    #[test]
    fn no_change_of_a_manifest_makes_the_reader_panic(
        start in 0..ALL_KINDS.len(),
        length in 0..40_usize,
        insert in "[\\[\\]{}=,.\"\\n# a-z0-9-]{0,8}|nan|-inf|1e400|99999999999999999999|-1|\\[\\]",
    ) {
        let end = (start + length).min(ALL_KINDS.len());
        let text = format!("{}{insert}{}", &ALL_KINDS[..start], &ALL_KINDS[end..]);
        if let Err(errors) = parse(&text) {
            errors.render(false);
        }
    }
}
