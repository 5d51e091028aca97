//! The commands `init`, `schema` and `man`.

use std::fs;

use crate::bench::{Bench, text};

#[test]
fn a_new_manifest_runs_as_it_is_and_is_never_overwritten() {
    let bench = Bench::new();
    let init = |name: &str| {
        let mut command = bench.asperity(&["init", name]);
        command.current_dir(bench.path("")).output().unwrap()
    };
    assert!(init("first").status.success());
    let manifest = bench.path("first.toml");
    let run = bench.output(&["run", manifest.to_str().unwrap()]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    assert_eq!(bench.table("first", "curves").rows(), 20);

    fs::write(&manifest, "# mine\n").unwrap();
    let again = init("first");
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("`first.toml` already exists"));
    assert_eq!(fs::read_to_string(&manifest).unwrap(), "# mine\n");

    let wrong = init("no name");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("`no name`"));
}

#[test]
fn the_schema_lies_where_the_first_line_of_the_manifest_says() {
    let bench = Bench::new();
    let init = bench.asperity(&["init"]).current_dir(bench.path("")).output().unwrap();
    assert!(init.status.success());
    let manifest = fs::read_to_string(bench.path("study.toml")).unwrap();
    let named = manifest.lines().next().and_then(|line| line.strip_prefix("#:schema ./"));
    let written_schema = fs::read(bench.path(named.unwrap())).unwrap();
    assert_eq!(text(&written_schema), text(&bench.output(&["schema"]).stdout));
}

#[test]
fn every_command_has_a_manual_page() {
    let bench = Bench::new();
    let folder = bench.path("man");
    let written = bench.output(&["man", "--output", folder.to_str().unwrap()]);
    assert!(written.status.success(), "{}", text(&written.stderr));
    let help = text(&bench.output(&["--help"]).stdout);
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.take_while(|line| !line.is_empty());
    let named = commands.filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    let mut count = 0;
    for name in named.filter(|name| *name != "help" && !name.is_empty()) {
        if !help.contains(&format!("\n  {name} ")) {
            continue;
        }
        let page = folder.join(format!("asperity-{name}.1"));
        let page = fs::read_to_string(&page).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(page.contains(".SH NAME"), "{name}");
        count += 1;
    }
    assert!(count > 15, "{count} commands");
}
