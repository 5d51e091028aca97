//! Reuse of results: extensions compute only new tasks, cosmetic edits compute nothing.

use std::collections::BTreeSet;

use asperity::tables::table::Table;

use crate::bench::{Bench, STUDY, assert_same_files, is_idle, text};
use crate::manifest::manifest;

/// Returns what identifies each row: the key of its task and, if it has one, its load.
fn identities(table: &Table) -> Vec<(String, u64)> {
    let tasks = table.texts("task").unwrap();
    let loads = table.reals("load").ok();
    let load = |row: usize| loads.map_or(0.0, |loads| loads.value(row));
    (0..table.rows()).map(|row| (tasks.value(row).to_owned(), load(row).to_bits())).collect()
}

/// Returns the rows of a table that an older table contains, too.
fn old_rows(new: &Table, old: &Table) -> Table {
    let known: BTreeSet<_> = identities(old).into_iter().collect();
    let rows = identities(new).into_iter().enumerate();
    let rows: Vec<usize> =
        rows.filter(|(_, row)| known.contains(row)).map(|(row, _)| row).collect();
    new.pick(&rows)
}

/// Sorts the rows by task, because new surfaces come between old ones.
fn by_task(table: &Table) -> Table {
    let identities = identities(table);
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    rows.sort_by_key(|&row| (identities[row].clone(), row));
    table.pick(&rows)
}

fn keeps_its_rows(bench: &Bench, before: &[(&str, Table)]) {
    for (stage, old) in before {
        let new = bench.table("small", stage);
        assert_eq!(by_task(&old_rows(&new, old)), by_task(old), "{stage}");
    }
}

fn tables(bench: &Bench) -> Vec<(&'static str, Table)> {
    let stages = ["surfaces", "light", "area", "corrected"];
    stages.map(|stage| (stage, bench.table("small", stage))).into()
}

#[test]
fn a_study_ends_with_one_table_per_stage() {
    let bench = Bench::new();
    let counts = bench.run(&STUDY);
    let computed = |stage: &str| counts[stage].computed;
    assert_eq!(["surfaces", "light", "area", "corrected"].map(computed), [4, 4, 4, 4]);
    assert_eq!(["law", "curves"].map(computed), [2, 1]);
    let rows = |stage: &str| bench.table("small", stage).rows();
    let all = ["surfaces", "light", "area", "corrected", "law", "curves"];
    // Two spectra × two corrections give four fits, each with four loads per curve.
    assert_eq!(all.map(rows), [4, 16, 16, 32, 4, 16]);
}

#[test]
fn second_run_computes_nothing() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = bench.files();
    assert!(bench.run(&STUDY).values().all(is_idle));
    assert_same_files(&bench.files(), &before);
}

#[test]
fn more_realizations_compute_the_new_surfaces_and_what_pools_them() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = tables(&bench);
    let counts = bench.run(&STUDY.replace("realizations = 2", "realizations = 3"));
    for stage in ["surfaces", "light", "area", "corrected"] {
        assert_eq!((counts[stage].cached, counts[stage].computed), (4, 2), "{stage}");
    }
    assert_eq!((counts["law"].computed, counts["curves"].computed), (2, 1));
    keeps_its_rows(&bench, &before);
}

#[test]
fn one_more_cutoff_leaves_the_other_spectra_and_their_fits_alone() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = tables(&bench);
    let fits = bench.table("small", "law");
    let counts = bench.run(&STUDY.replace("k_upper = [4, 8]", "k_upper = [4, 6, 8]"));
    for stage in ["surfaces", "light", "area", "corrected"] {
        assert_eq!((counts[stage].cached, counts[stage].computed), (4, 2), "{stage}");
    }
    assert_eq!((counts["law"].cached, counts["law"].computed), (2, 1));
    keeps_its_rows(&bench, &before);
    let new_fits = bench.table("small", "law");
    assert_eq!(by_task(&old_rows(&new_fits, &fits)), by_task(&fits));
}

#[test]
fn a_new_block_of_loads_keeps_existing_results() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let before = tables(&bench);
    let extended = STUDY.replace(
        "[stage.area]\nkind = \"measure\"\nfrom = \"light\"",
        "[stage.heavy]\nkind = \"solve\"\nfrom = \"surfaces\"\n\
         loads = { from = 0.1, to = 1, steps = 3, spacing = \"geometric\" }\n\
         [stage.area]\nkind = \"measure\"\nfrom = [\"light\", \"heavy\"]",
    );
    let counts = bench.run(&extended);
    assert!(is_idle(&counts["light"]));
    assert_eq!(counts["heavy"].computed, 4);
    assert_eq!((counts["area"].cached, counts["area"].computed), (4, 4));
    keeps_its_rows(&bench, &before);
}

#[test]
fn one_more_statistic_computes_one_task() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let counts = bench.run(&STUDY.replace(r#"["mean", "sd"]"#, r#"["mean", "sd", "max"]"#));
    let computed: u64 = counts.values().map(|count| count.computed).sum();
    assert_eq!((computed, counts["curves"].computed), (1, 1));
}

#[test]
fn names_order_comments_and_written_defaults_change_no_key() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let cosmetic = r#"
# The same study, written by another person.
study.seed = 7
study.name = "another"

[stage.mean-curves]
statistics = ["mean", "sd"]
over = ["area_corrected"]
from = "estimates"
kind = "aggregate"

[stage.fits]
kind = "fit"
law = "contact-evolution"
kappa = "free"
from = "estimates"
window = [0.0, 1e-1]
level = 0.95
to = "area"
bootstrap = 20

[stage.estimates]
kind = "correct"
from = ["counts"]
correction = ["none", "2017"]

[stage.counts]
kind = "measure"
from = "press"

[stage.press]
kind = "solve"
from = "rough"
loads = { from = 0, steps = 4, to = 0.1, spacing = "linear" }
effective_modulus = 1
pressures = "none"

[stage.rough]
k_upper = [4, 8]  # inclusive
k_lower = 2
k_rolloff = 2
hurst = 0.80
nodes = 32
side = 1.0
rms_slope = 1
method = "filter"
seed = 7
realizations = 2
heights = "keep"
kind = "generate"
"#;
    assert!(bench.plan(cosmetic).values().all(is_idle));
}

#[test]
fn every_parameter_of_a_surface_changes_its_key() {
    let bench = Bench::new();
    bench.run(&STUDY);
    for (old, new) in [
        ("seed = 7", "seed = 8"),
        ("nodes = 32", "nodes = 36"),
        ("hurst = 0.8", "hurst = 0.7"),
        ("k_lower = 2", "k_lower = 3"),
        ("k_lower = 2", "k_lower = 2\nk_rolloff = 3"),
        ("k_lower = 2", "k_lower = 2\nside = 2"),
        ("k_lower = 2", "k_lower = 2\nrms_slope = 0.5"),
        ("k_lower = 2", "k_lower = 2\nmethod = \"random-phase\""),
    ] {
        let counts = bench.plan(&STUDY.replace(old, new));
        assert_eq!(counts["surfaces"].cached, 0, "{new}");
        assert_eq!(counts["light"].cached, 0, "{new}");
    }
}

#[test]
fn every_parameter_of_a_block_of_loads_changes_its_key() {
    let bench = Bench::new();
    bench.run(&STUDY);
    for (old, new) in [
        ("steps = 4", "steps = 5"),
        ("to = 0.1, steps", "to = 0.2, steps"),
        ("steps = 4 }", "steps = 4 }\ntolerance = 1e-6"),
        ("steps = 4 }", "steps = 4 }\neffective_modulus = 2"),
        ("steps = 4 }", "steps = 4 }\nmax_pairs = 50"),
        ("steps = 4 }", "steps = 4 }\nload_unit = \"absolute\""),
    ] {
        let counts = bench.plan(&STUDY.replace(old, new));
        assert!(is_idle(&counts["surfaces"]), "{new}");
        assert_eq!((counts["light"].cached, counts["area"].cached), (0, 0), "{new}");
    }
}

#[test]
fn keeping_heights_or_pressures_recomputes_nothing_that_follows() {
    let bench = Bench::new();
    bench.run(&STUDY.replace("hurst = 0.8", "hurst = 0.8\nheights = \"redraw\""));
    let kept = bench.plan(&STUDY);
    assert_eq!(kept["surfaces"].cached, 0);
    assert!(["light", "area", "corrected", "law", "curves"].iter().all(|s| is_idle(&kept[*s])));
    let pressures = bench.plan(&STUDY.replace("steps = 4 }", "steps = 4 }\npressures = \"all\""));
    assert_eq!(pressures["light"].cached, 0);
    assert!(["area", "corrected", "law", "curves"].iter().all(|s| is_idle(&pressures[*s])));
}

#[test]
fn kept_and_redrawn_heights_give_the_same_contacts() {
    let (kept, redrawn) = (Bench::new(), Bench::new());
    kept.run(&STUDY);
    redrawn.run(&STUDY.replace("hurst = 0.8", "hurst = 0.8\nheights = \"redraw\""));
    for stage in ["light", "area", "corrected", "law", "curves"] {
        assert_eq!(kept.table("small", stage), redrawn.table("small", stage), "{stage}");
    }
}

#[test]
fn studies_that_overlap_share_their_work() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let other = STUDY
        .replace("name = \"small\"", "name = \"other\"")
        .replace("k_upper = [4, 8]", "k_upper = [8, 12]");
    let counts = bench.run(&other);
    assert_eq!((counts["light"].cached, counts["light"].computed), (2, 2));
}

#[test]
fn jobs_change_no_byte() {
    let (one, two) = (Bench::new(), Bench::new());
    one.run_with(&STUDY, &["--jobs", "1"]);
    two.run_with(&STUDY, &["--jobs", "2"]);
    assert_same_files(&one.files(), &two.files());
}

#[test]
fn a_surface_that_has_all_cores_has_the_bytes_of_one() {
    // One mesh uses transforms in registers, the other mixed-radix transforms; cores share both.
    let manifest = STUDY.replace("nodes = 32", "nodes = [640, 637]");
    let manifest = manifest.replace("k_upper = [4, 8]\nrealizations = 2", "k_upper = 8");
    let [alone, shared] = [Bench::new(), Bench::new()];
    alone.run_with(&manifest, &["--jobs", "1"]);
    shared.run_with(&manifest, &["--jobs", "5"]);
    assert_same_files(&alone.files(), &shared.files());
}

/// Checks that an extension does not read the stored tables, which the test overwrites.
#[test]
fn an_extension_reads_what_is_published_in_place_of_thousands_of_files() {
    let many = |realizations: usize| {
        manifest("small", "seed = 7")
            .generate(
                "surfaces",
                &format!(
                    "nodes = 16; heights = 'redraw'; hurst = [0.3, 0.8]; k_lower = 1; \
                     k_upper = 4; realizations = {realizations}"
                ),
            )
            .aggregate("nayak", "over = ['nayak']; statistics = ['mean', 'sd']")
            .text()
    };
    let bench = Bench::new();
    bench.run(&many(8));
    let store = bench.data().join("store");
    let tasks = bench.table("small", "surfaces");
    for task in tasks.texts("task").unwrap().iter().flatten() {
        let path = store.join(&task[..2]).join(format!("{task}.parquet"));
        std::fs::write(path, "nothing").unwrap();
    }
    let counts = bench.run(&many(9));
    assert_eq!([counts["surfaces"].computed, counts["nayak"].computed], [2, 1]);
    let anew = Bench::new();
    anew.run(&many(9));
    for stage in ["surfaces", "nayak"] {
        let path = format!("results/small/{stage}.parquet");
        let bytes = [&bench, &anew].map(|bench| std::fs::read(bench.data().join(&path)).unwrap());
        assert!(bytes[0] == bytes[1], "{stage}");
    }
    let checked = bench.output(&["verify"]);
    assert!(text(&checked.stdout).contains("16 damaged"), "{}", text(&checked.stdout));
}
