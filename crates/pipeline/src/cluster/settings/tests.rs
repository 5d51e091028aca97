use super::*;

fn refused(text: &str) -> String {
    Settings::parse(text, FILE).unwrap_err().render(false)
}

#[test]
fn what_is_written_is_read() {
    let text = "
        [cluster]
        partition = \"short\"
        cores = 8
        memory = \"16GB\"
        time_limit = 2
        per_element = 0.5
        rounds = 0
        before = [\"module load rust\", \"ulimit -c 0\"]
        directives = \"--constraint=avx2\"
    ";
    let settings = Settings::parse(text, FILE).unwrap();
    let expected = Settings {
        partition: Some("short".to_owned()),
        cores: Some(8),
        memory: Some(ByteSize::gb(16)),
        time_limit: Some(2.0),
        per_element: Some(0.5),
        rounds: Some(0),
        before: Some(vec!["module load rust".to_owned(), "ulimit -c 0".to_owned()]),
        directives: Some(vec!["--constraint=avx2".to_owned()]),
        ..Settings::default()
    };
    assert_eq!(settings, expected);
    assert_eq!(Settings::parse("", FILE).unwrap(), Settings::default());
}

#[test]
fn what_is_said_nearer_counts() {
    let of = |text| Settings::parse(text, FILE).unwrap();
    let near = of("[cluster]\npartition = \"short\"");
    let far = of("[cluster]\npartition = \"long\"\naccount = \"rough\"");
    let both = of("[cluster]\npartition = \"short\"\naccount = \"rough\"");
    assert_eq!(near.or(far), both);
}

#[test]
fn mistakes_are_shown_at_their_places() {
    insta::assert_snapshot!(refused(
        "[cluster]
partitoin = \"short\"
account = \"a b\"
cores = 0
memory = \"much\"
per_element = -1
before = [\"module load x\", \"a\\nb\"]
directives = [\"constraint=avx2\", \"--array=1-4\"]

[clustre]
"
    ));
}

#[test]
fn a_file_that_is_no_toml_or_not_there_is_told_apart() {
    assert!(refused("[cluster").contains("not TOML"));
    assert_eq!(Settings::read(Path::new("/nowhere/asperity.toml")).unwrap(), None);
}

#[test]
fn no_job_runs_for_longer_than_eleven_years() {
    for key in ["time_limit", "per_element"] {
        let of = |hours: &str| format!("[cluster]\n{key} = {hours}");
        assert!(Settings::parse(&of("1e5"), FILE).is_ok());
        let message = refused(&of("1e12"));
        assert!(message.contains("at most 100000"), "{message}");
    }
}
