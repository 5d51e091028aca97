//! What `report` writes of a study.

use std::fs;

use serde_json::Value;

use crate::bench::{Bench, STUDY, text};

/// Writes a report of the bench's manifest; what it says, and the page.
fn report(bench: &Bench) -> (Value, String) {
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
    bench.run(STUDY);
    let (said, page) = report(&bench);
    let drawn = said["drawn"].as_array().unwrap().len();
    assert!(drawn >= 7, "{said}");
    assert_eq!(page.matches("<figure ").count(), drawn);
    for fetched in [
        "src=\"http",
        "href=\"http",
        "<link",
        "@import",
        "src=\"figures",
    ] {
        assert!(!page.contains(fetched), "{fetched}");
    }
    for part in [
        "complete: all",
        "realizations = 2",
        "area.parquet",
        "all 16 loads converged",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn figures_are_the_same_bytes_again() {
    let bench = Bench::new();
    bench.run(STUDY);
    let figures = |bench: &Bench| {
        let folder = bench.data().join("results/small/figures");
        let files = fs::read_dir(folder)
            .unwrap()
            .map(|file| file.unwrap().path());
        let mut files: Vec<_> = files
            .map(|path| (path.clone(), fs::read(path).unwrap()))
            .collect();
        files.sort();
        files
    };
    report(&bench);
    let first = figures(&bench);
    report(&bench);
    assert!(first == figures(&bench));
    assert!(
        first
            .iter()
            .any(|(path, _)| path.ends_with("area-light.svg"))
    );
    assert!(
        first
            .iter()
            .any(|(path, _)| path.ends_with("area-light.png"))
    );
}

#[test]
fn a_study_that_has_not_been_run_has_a_page_that_says_what_is_missing() {
    let bench = Bench::new();
    bench.write(STUDY);
    let (said, page) = report(&bench);
    assert_eq!(said["drawn"].as_array().unwrap().len(), 0);
    assert!(page.contains("unfinished: 0 of"));
    assert!(page.contains("Not finished yet: surfaces"), "{page}");
}

#[test]
fn what_is_missing_is_named_with_the_lines_that_would_add_it() {
    let bench = Bench::new();
    let no_corrections = &STUDY[..STUDY.find("[stage.corrected]").unwrap()];
    bench.run(no_corrections);
    let (said, page) = report(&bench);
    let missing = said["missing"].as_array().unwrap();
    let corrected = missing
        .iter()
        .find(|one| one["figure"] == "Corrected contact area");
    assert!(corrected.is_some(), "{said}");
    // The lines are a stage that reads this study's measured contacts.
    let proposed = "[stage.corrected]\nkind = &quot;correct&quot;\nfrom = &quot;area&quot;";
    assert!(page.contains(proposed));
}

#[test]
fn a_figure_that_a_study_has_no_more_is_taken_away() {
    let bench = Bench::new();
    bench.run(STUDY);
    report(&bench);
    let file = bench
        .data()
        .join("results/small/figures/area-corrected.svg");
    assert!(file.exists());
    bench.run(&STUDY[..STUDY.find("[stage.corrected]").unwrap()]);
    report(&bench);
    assert!(!file.exists());
}

#[test]
fn a_page_or_a_figure_that_somebody_has_changed_is_found_and_stays_where_it_is() {
    let bench = Bench::new();
    bench.run(STUDY);
    report(&bench);
    let verify = || bench.output(&["verify", "--json"]);
    assert!(verify().status.success());
    let folder = bench.data().join("results/small");
    for (name, from, to) in [
        (
            "report.html",
            "all 16 loads converged",
            "all 17 loads converged",
        ),
        ("figures/slope.svg", "load", "lead"),
    ] {
        let path = folder.join(name);
        let written = fs::read_to_string(&path).unwrap();
        fs::write(&path, written.replacen(from, to, 1)).unwrap();
        let output = verify();
        assert_eq!(output.status.code(), Some(1), "{name}");
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        let damaged = said["damaged"].as_array().unwrap();
        assert_eq!(damaged.len(), 1, "{said}");
        assert!(
            damaged[0]["cause"].as_str().unwrap().contains(name),
            "{said}"
        );
        assert!(path.exists());
        fs::write(&path, written).unwrap();
    }
    let by_hand = bench.data().join("results/small/area.parquet");
    fs::write(&by_hand, "edited").unwrap();
    assert_eq!(verify().status.code(), Some(1));
}
