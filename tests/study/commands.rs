//! Output and exit codes of the commands.

use std::collections::BTreeSet;
use std::fs;

use serde_json::{Value, json};

use crate::bench::{Bench, STUDY, text, with_claims};

#[test]
fn a_wrong_manifest_ends_with_two_and_nothing_is_run() {
    let bench = Bench::new();
    let path = bench.write(&STUDY.replace("k_upper = [4, 8]", "k_uper = [4, 8]"));
    for command in ["check", "plan", "run"] {
        let output = bench.output(&[command, path.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(2), "{command}");
        let printed = text(&output.stderr);
        for part in ["k_uper", "k_upper", "study.toml", "^"] {
            assert!(printed.contains(part), "{command}: {part} in\n{printed}");
        }
    }
    assert!(!bench.data().exists());
}

#[test]
fn all_mistakes_of_a_manifest_are_reported_together() {
    let bench = Bench::new();
    let wrong = STUDY
        .replace("hurst = 0.8", "hurst = 1.8")
        .replace("from = \"light\"", "from = \"lihgt\"")
        .replace("bootstrap = 20", "bootstrap = -20");
    let path = bench.write(&wrong);
    let printed = text(&bench.output(&["check", path.to_str().unwrap()]).stderr);
    for part in ["1.8", "lihgt", "-20"] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
}

#[test]
fn a_missing_manifest_is_named() {
    let bench = Bench::new();
    let output = bench.output(&["check", "nowhere.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("nowhere.toml"));
}

#[test]
fn plan_touches_nothing() {
    let bench = Bench::new();
    let counts = bench.plan(&STUDY);
    assert_eq!((counts["light"].cached, counts["light"].to_run), (0, 4));
    assert!(!bench.data().exists());
}

/// Returns the tasks of a study from `plan --tasks`.
fn tasks(bench: &Bench, manifest: &str) -> Vec<Value> {
    let path = bench.write(manifest);
    let output = bench.output(&["plan", path.to_str().unwrap(), "--tasks"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let lines = text(&output.stdout);
    let rows = lines.lines().map(serde_json::from_str);
    rows.collect::<Result<_, _>>().unwrap()
}

#[test]
fn plan_lists_every_task_once_with_what_it_takes_to_run_it_alone() {
    let bench = Bench::new();
    let planned = tasks(&bench, &STUDY);
    let keys: BTreeSet<&str> = planned.iter().map(|task| task["task"].as_str().unwrap()).collect();
    assert_eq!((planned.len(), keys.len()), (19, 19));
    assert!(planned.iter().all(|task| task["state"] == "missing"));
    assert!(planned.iter().all(|task| task["core_seconds"].as_f64() > Some(0.0)));
    let of = |stage: &str| planned.iter().filter(|task| task["stage"] == stage).collect::<Vec<_>>();
    let places: Vec<_> = of("light")
        .iter()
        .map(|task| (task["k_upper"].as_i64(), task["realization"].as_i64()))
        .collect();
    let each = |k_upper: i64| (0..2).map(move |number| (Some(k_upper), Some(number)));
    assert_eq!(places, [each(4), each(8)].into_iter().flatten().collect::<Vec<_>>());
    assert_eq!(of("law")[1]["k_upper"], 8, "of several surfaces, what they have in common");
    assert!(of("law")[1]["realization"].is_null());
    assert!(!bench.data().exists());

    let key = of("light")[2]["task"].as_str().unwrap();
    bench.run_with(&STUDY, &["--only", key]);
    let done = tasks(&bench, &STUDY);
    let cached: Vec<_> = done.iter().filter(|task| task["state"] == "cached").collect();
    let cached: Vec<_> = cached.iter().map(|task| (&task["stage"], &task["task"])).collect();
    let surface = of("surfaces")[2];
    assert_eq!(cached, [(&surface["stage"], &surface["task"]), (&json!("light"), &json!(key))]);
}

#[test]
fn a_task_of_two_stages_is_listed_once() {
    let bench = Bench::new();
    let twice = format!("{}\n[stage.again]\nkind = \"measure\"\nfrom = \"light\"\n", *STUDY);
    assert_eq!(tasks(&bench, &twice).len(), 19);
}

#[test]
fn run_ends_with_a_line_per_stage_and_the_place_of_the_tables() {
    let bench = Bench::new();
    let path = bench.write(&STUDY);
    let output = bench.output(&["run", path.to_str().unwrap()]);
    let printed = text(&output.stdout);
    for part in [
        "surfaces",
        "Nayak α",
        "all converged",
        "none, 2017",
        "4 fits · 4 not-converged\n",
        "*.parquet",
    ] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
}

#[test]
fn show_tells_how_a_table_was_made() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let table = bench.table("small", "light");
    let key = table.texts("task").unwrap().value(0).to_owned();
    let by_key = text(&bench.output(&["show", &key]).stdout);
    for part in
        [key.as_str(), "solve", "effective_modulus", "rows           load 0.025", "converged"]
    {
        assert!(by_key.contains(part), "{part} in\n{by_key}");
    }
    let file = bench.data().join("results/small/curves.parquet");
    let by_file = text(&bench.output(&["show", file.to_str().unwrap()]).stdout);
    assert!(by_file.contains("area_corrected_mean"), "{by_file}");
}

#[test]
fn show_says_what_it_wants_when_it_gets_something_else() {
    let bench = Bench::new();
    let unknown = bench.output(&["show", &"0".repeat(32)]);
    assert_eq!(unknown.status.code(), Some(1));
    assert!(text(&unknown.stderr).contains("no finished task 0000"));
    let nonsense = bench.output(&["show", "nonsense"]);
    assert!(text(&nonsense.stderr).contains("is not a key"));
    let foreign = bench.write("[study]");
    let foreign = bench.output(&["show", foreign.to_str().unwrap()]);
    assert_eq!(foreign.status.code(), Some(2));
    assert!(text(&foreign.stderr).contains("study.toml` is not a Parquet file"));
}

#[test]
fn table_refuses_unknown_columns_and_a_stage_beside_a_query() {
    let bench = Bench::new();
    bench.run(&STUDY);
    let path = bench.path("study.toml");
    let refused = |words: &[&str]| {
        let output = bench.output(&[&["table", path.to_str().unwrap()], words].concat());
        assert_eq!(output.status.code(), Some(2));
        text(&output.stderr)
    };
    let unknown = refused(&["area", "--columns", "cluster"]);
    assert!(unknown.contains("did you mean `clusters`?"), "{unknown}");
    let query = refused(&["area", "--sql", "select avg(area_fraction) from area"]);
    assert!(query.contains("cannot be used with '--sql <QUERY>'"), "{query}");
}

#[test]
fn a_shape_is_not_compared_with_gaussian_roughness() {
    let bench = Bench::new();
    let path = bench.write(
        "[study]\nname = \"ball\"\n[stage.ball]\nkind = \"generate\"\n\
         method = \"paraboloid\"\nnodes = 32\nradius = 2.0\n",
    );
    let printed = text(&bench.output(&["run", path.to_str().unwrap()]).stdout);
    assert!(printed.starts_with("ball  1 surface · full contact at "), "{printed}");
    assert!(!printed.contains("Gaussian") && !printed.contains("Nayak"), "{printed}");
}

#[test]
fn claims_are_judged_or_name_what_they_lack_and_say_the_same_twice() {
    let bench = Bench::new();
    let study = with_claims(&STUDY);
    let path = bench.write(&study);
    let claims = |more: &[&str]| {
        let arguments = [&["claims", path.to_str().unwrap()], more].concat();
        let output = bench.output(&arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let before = claims(&[]);
    assert!(before.contains("not computed"), "{before}");
    assert!(before.contains("of the study not computed yet"), "{before}");
    bench.run(&study);
    let after = claims(&[]);
    for part in [
        "area-above-persson",
        "alpha-in-asperity-models",
        "does not hold",
        "needs 5 or more surfaces",
        "Statements of asperity",
        "noted",
        "claims of the paper:",
    ] {
        assert!(after.contains(part), "{part} in\n{after}");
    }
    assert_eq!(after, claims(&[]));
    let json: serde_json::Value = serde_json::from_str(&claims(&["--json"])).unwrap();
    for claim in json["claims"].as_array().unwrap() {
        let quantities = claim["quantities"].as_array().unwrap();
        for quantity in quantities {
            let [lower, value, upper] =
                ["lower", "value", "upper"].map(|name| quantity[name].as_f64().unwrap());
            assert!(lower <= value && value <= upper, "{claim}");
        }
        let verdict = claim["verdict"].as_str().unwrap();
        let is_judged = !["not computed", "noted"].contains(&verdict);
        assert_eq!(quantities.is_empty(), !is_judged, "{claim}");
        assert_eq!(claim["needs"].is_string(), verdict == "not computed", "{claim}");
        assert_eq!(claim["kind"] == "misprint", verdict == "noted", "{claim}");
        assert!(claim["says"].is_string() && claim["where"].is_string(), "{claim}");
    }
}

#[test]
fn claims_without_a_manifest_are_listed_with_their_texts() {
    let bench = Bench::new();
    let printed = text(&bench.output(&["claims"]).stdout);
    for part in [
        "Statements of the paper · yastrebov-2015\n\n",
        "\narea-above-persson · counted area\n    “",
    ] {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
    assert!(!printed.contains("not computed"), "{printed}");
    assert_eq!(bench.output(&["claims", "--json"]).status.code(), Some(2));
}

#[test]
fn one_claim_is_explained_at_length_and_an_unknown_one_is_named() {
    let bench = Bench::new();
    let study = STUDY.replace("realizations = 2", "realizations = 5");
    let path = bench.write(&with_claims(&study));
    let path = path.to_str().unwrap();
    bench.output(&["run", path]);
    let printed = text(&bench.output(&["claims", path, "area-above-persson"]).stdout);
    for part in
        ["paper  ", "section 5.2", "expected    at least 0.1", "alone, 95 % per end", "k_upper 4"]
    {
        assert!(printed.contains(part), "{part} in\n{printed}");
    }
    let unknown = bench.output(&["claims", path, "area-above-person"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("did you mean `area-above-persson`"));
}

#[test]
fn schema_is_json_that_knows_every_kind() {
    let bench = Bench::new();
    let output = bench.output(&["schema"]);
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let printed = schema.to_string();
    for word in ["generate", "solve", "measure", "correct", "fit", "aggregate", "k_rolloff"] {
        assert!(printed.contains(word), "{word}");
    }
}

#[test]
fn completions_are_printed_for_every_shell() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish"] {
        let output = bench.output(&["completions", shell]);
        assert!(text(&output.stdout).contains("asperity"), "{shell}");
    }
}

#[test]
fn data_can_be_put_anywhere() {
    let bench = Bench::new();
    let path = bench.write(STUDY.split("[stage.light]").next().unwrap());
    let elsewhere = bench.path("elsewhere");
    let arguments = ["--data", elsewhere.to_str().unwrap(), "run", path.to_str().unwrap()];
    assert!(bench.output(&arguments).status.success());
    assert!(elsewhere.join("results/small/surfaces.parquet").is_file());
    assert!(!bench.data().exists());
}

#[test]
fn a_data_folder_that_cannot_be_made_is_named() {
    let bench = Bench::new();
    let path = bench.write(&STUDY);
    fs::write(bench.path("data"), "a file").unwrap();
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("data"), "{}", text(&output.stderr));
}
