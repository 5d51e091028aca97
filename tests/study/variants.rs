//! Studies with expressions, parameters, extended manifests and settings.

use std::fs;

use crate::bench::{Bench, STUDY, assert_same_files, counts, text, with_claims};

/// The study of the bench, written with parameters and expressions.
fn derived() -> String {
    STUDY
        .replace(
            "seed = 7",
            "seed = 7\n\n[parameters]\nk = [4, 8]\nhurst = \"0.1 * 8\"\nsurfaces = 2",
        )
        .replace("nodes = 32", "nodes = \"16 * k_lower\"")
        .replace("hurst = 0.8", "hurst = \"hurst\"")
        .replace("k_upper = [4, 8]", "k_upper = \"k\"")
        .replace("realizations = 2", "realizations = \"surfaces\"")
        .replace("{ to = 0.1, steps = 4 }", "{ to = \"10 ^ -1\", steps = \"2 * 2\" }")
}

#[test]
fn expressions_give_the_keys_and_the_bytes_of_numbers() {
    let [plain, written] = [Bench::new(), Bench::new()];
    plain.run(&STUDY);
    written.run(&derived());
    assert_same_files(&written.files(), &plain.files());
    // Every task is found in the store of the other study.
    for (name, count) in plain.plan(&derived()) {
        assert_eq!(count.to_run, 0, "{name}");
    }
}

#[test]
fn a_variant_has_the_bytes_of_the_manifest_that_it_stands_for() {
    let [plain, variant] = [Bench::new(), Bench::new()];
    plain.run(&STUDY.replace("hurst = 0.8", "hurst = 0.5"));
    fs::write(variant.path("base.toml"), STUDY.replace("\"small\"", "\"base\"")).unwrap();
    variant
        .run("[study]\nname = \"small\"\nextends = \"base.toml\"\n[stage.surfaces]\nhurst = 0.5\n");
    let results = |bench: &Bench| -> Vec<(String, Vec<u8>)> {
        let files = bench.files().into_iter();
        let files = files.map(|(path, bytes)| (path.display().to_string(), bytes));
        files.filter(|(path, _)| path.ends_with(".parquet")).collect()
    };
    assert!(results(&variant) == results(&plain));
    // The effective manifest is the same study.
    let effective = variant.data().join("results/small/manifest.toml");
    let effective = fs::read_to_string(effective).unwrap();
    for (name, count) in plain.plan(&effective) {
        assert_eq!(count.to_run, 0, "{name}");
    }
    let owner = fs::read_to_string(variant.data().join("results/small/owner.json")).unwrap();
    assert!(owner.contains("\"extends\":[\"base.toml\"]"), "{owner}");
}

#[test]
fn a_setting_is_an_edit_of_the_manifest() {
    let [edited, set] = [Bench::new(), Bench::new()];
    edited.run(&STUDY.replace("realizations = 2", "realizations = 3"));
    set.run(&STUDY);
    let settings = ["--set", "stage.surfaces.realizations=3"];
    let manifest = set.path("study.toml");
    let manifest = manifest.to_str().unwrap();
    let planned = set.output(&[&["plan", manifest, "--json"], &settings[..]].concat());
    assert_eq!(counts(&planned.stdout)["surfaces"].to_run, 2);
    let explained = set.output(&[&["explain", manifest], &settings[..]].concat());
    assert!(text(&explained.stdout).contains("2 to run"), "{}", text(&explained.stdout));
    let checked = set.output(&[&["check", manifest], &settings[..]].concat());
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    set.run_with(&STUDY, &settings);
    assert_eq!(set.table("small", "area").rows(), edited.table("small", "area").rows());
    let results = set.data().join("results/small");
    let effective = fs::read_to_string(results.join("manifest.toml")).unwrap();
    assert!(effective.contains("realizations = 3") || effective.contains("realizations=3"));
    assert!(effective.contains("# --set stage.surfaces.realizations=3"), "{effective}");
    // Without the setting the study is the one of the file again, and nothing is computed.
    let counts = set.run(&STUDY);
    assert!(counts.values().all(|count| count.computed == 0));
    assert!(!results.join("manifest.toml").exists());
    let other = Bench::new();
    other.run(&STUDY);
    let tables = |bench: &Bench| {
        let names = ["surfaces", "area", "law", "curves"];
        names.map(|name| {
            fs::read(bench.data().join(format!("results/small/{name}.parquet"))).unwrap()
        })
    };
    assert!(tables(&set) == tables(&other));
}

#[test]
fn commands_that_read_results_take_the_settings_of_the_run() {
    let bench = Bench::new();
    let path = bench.write(&with_claims(&STUDY));
    let path = path.to_str().unwrap();
    let with =
        |words: &[&str]| bench.output(&[words, &["--set", "stage.surfaces.hurst=0.5"]].concat());
    assert!(with(&["run", path]).status.success());
    let [picture, maps] = ["light.png", "light.npz"].map(|name| bench.path(name));
    for words in [
        &["status", path, "--json"][..],
        &["columns", path, "area"],
        &["claims", path, "area-above-persson"],
        &["view", path, "light", "hurst=0.5", "k_upper=4", "realization=0", "-o"],
        &["export", path, "light", "hurst=0.5", "k_upper=4", "realization=0", "-o"],
    ] {
        let file = if words[0] == "view" { &picture } else { &maps };
        let file = words.ends_with(&["-o"]).then(|| file.to_str().unwrap());
        let output = with(&[words, file.as_slice()].concat());
        assert!(output.status.success(), "{words:?}: {}", text(&output.stderr));
    }
    let status = text(&with(&["status", path]).stdout);
    assert!(status.ends_with("0 core-hours left\n"), "{status}");
    let key = with(&["view", "0123abcd"]);
    assert!(text(&key.stderr).contains("`--set` needs a manifest"), "{}", text(&key.stderr));
}

#[test]
fn mistakes_point_to_the_file_or_the_option() {
    let bench = Bench::new();
    let manifest = bench.write(&STUDY);
    let manifest = manifest.to_str().unwrap();
    for (setting, expected) in [
        ("stage.surfaces.hurst=8", "--set:1:22"),
        ("stage.surface.hurst=0.8", "did you mean `surfaces`?"),
        ("stage.surfaces.nodes=8 * k_uper", "did you mean `k_upper`?"),
        ("stage.surfaces.hurst", "must be `KEY=VALUE`"),
    ] {
        let output = bench.output(&["check", manifest, "--set", setting]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
}

#[test]
fn an_archive_holds_the_extended_manifests() {
    let bench = Bench::new();
    fs::write(bench.path("base.toml"), STUDY.replace("\"small\"", "\"base\"")).unwrap();
    bench.run("[study]\nname = \"small\"\nextends = \"base.toml\"\n");
    let (manifest, archive) = (bench.path("study.toml"), bench.path("small.zip"));
    let arguments = ["share", manifest.to_str().unwrap(), "-o", archive.to_str().unwrap()];
    let output = bench.output(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let unpacked = bench.path("unpacked");
    let mut zip = zip::ZipArchive::new(fs::File::open(archive).unwrap()).unwrap();
    zip.extract(&unpacked).unwrap();
    assert!(unpacked.join("base.toml").is_file());
    let output = bench.output(&[
        "--data",
        unpacked.join("data").to_str().unwrap(),
        "table",
        unpacked.join("study.toml").to_str().unwrap(),
        "area",
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn every_command_that_reads_a_manifest_reads_settings() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let manifest = bench.path("study.toml");
    let manifest = manifest.to_str().unwrap();
    let setting = ["--set", "stage.surfaces.hurst=2"];
    let npz = bench.path("maps.npz");
    let commands: [&[&str]; 14] = [
        &["check", manifest],
        &["plan", manifest],
        &["explain", manifest],
        &["run", manifest],
        &["status", manifest],
        &["cancel", manifest],
        &["claims", manifest],
        &["errors", manifest],
        &["columns", manifest],
        &["table", manifest, "area"],
        &["view", manifest, "light"],
        &["export", manifest, "light", "-o", npz.to_str().unwrap()],
        &["verify", manifest],
        &["prune", manifest],
    ];
    for command in commands {
        let output = bench.output(&[command, &setting].concat());
        let printed = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {printed}");
        assert!(printed.contains("`hurst`"), "{command:?}: {printed}");
    }
    for command in [&["verify"][..], &["prune"], &["columns"], &["view", "abcd"]] {
        let printed = text(&bench.output(&[command, &setting].concat()).stderr);
        assert!(printed.contains("`--set` needs a manifest"), "{command:?}: {printed}");
    }
}
