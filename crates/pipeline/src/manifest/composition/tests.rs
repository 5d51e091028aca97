//! Manifests that extend each other, and settings.

use std::fs;

use tempfile::TempDir;

use super::*;
use crate::study::Study;

const BASE: &str = r#"
[study]
name = "base"
seed = 7

[parameters]
k = 8

[stage.surfaces]
kind = "generate"
nodes = "8 * k"
hurst = 0.8     # a comment
k_lower = 1
k_rolloff = 2
k_upper = "k"

[stage.contact]
kind = "solve"
from = "surfaces"
loads = { from = 0.1, to = 0.2, steps = 2 }
"#;

/// Writes files into a folder and reads the first one, with settings.
fn read(files: &[(&str, &str)], settings: &[&str]) -> (TempDir, Result<Study, String>) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().unwrap()).collect();
    let study = Study::read(&folder.path().join(files[0].0), &settings);
    (folder, study.map_err(|errors| errors.render(false)))
}

/// Asserts that both studies have the same stages, and returns the text of the first one.
fn same(composed: Study, plain: &str) -> String {
    let plain = Study::parse(plain, "plain.toml", Path::new(""))
        .unwrap_or_else(|errors| panic!("{}", errors.render(false)));
    assert_eq!(composed.stages, plain.stages);
    assert_eq!(composed.name, plain.name);
    composed.manifest.text
}

#[test]
fn a_manifest_overrides_what_it_extends() {
    let variant = "[study]\nname = \"variant\"\nextends = \"../base.toml\"\n\
                   remove = [\"stage.surfaces.k_rolloff\", \"stage.contact.loads.from\"]\n\
                   [parameters]\nk = 4\n\
                   [stage.surfaces]\nhurst = [0.3, 0.5]\n[stage.contact.loads]\nto = 0.4\n";
    let (_folder, study) = read(&[("a/variant.toml", variant), ("base.toml", BASE)], &[]);
    let study = study.unwrap();
    assert_eq!(study.manifest.bases, [Path::new("../base.toml")]);
    let plain = BASE
        .replace("\"base\"", "\"variant\"")
        .replace("k = 8", "k = 4")
        .replace("hurst = 0.8", "hurst = [0.3, 0.5]")
        .replace("k_rolloff = 2\n", "")
        .replace("from = 0.1, to = 0.2", "to = 0.4");
    let text = same(study, &plain);
    // The effective manifest stands alone.
    let alone = Study::parse(&text, "effective.toml", Path::new("")).unwrap();
    assert_eq!(same(alone, &plain), text);
    assert!(text.contains("nodes = \"8 * k\"") && text.contains("`variant.toml`, which extends"));
}

#[test]
fn a_chain_of_manifests_is_read_from_the_folder_of_each() {
    let top = "[study]\nname = \"top\"\nextends = \"sub/middle.toml\"\n";
    let middle = "[study]\nextends = \"../base.toml\"\nseed = 8\n[stage.surfaces]\nhurst = 0.5\n";
    let files = [("top.toml", top), ("sub/middle.toml", middle), ("base.toml", BASE)];
    let (_folder, study) = read(&files, &[]);
    let study = study.unwrap();
    assert_eq!(study.manifest.bases, ["sub/middle.toml", "base.toml"].map(PathBuf::from));
    let plain = BASE.replace("\"base\"", "\"top\"").replace("seed = 7", "seed = 8");
    same(study, &plain.replace("hurst = 0.8", "hurst = 0.5"));
}

#[test]
fn settings_override_the_manifest() {
    let settings =
        ["stage.surfaces.realizations=3", "parameters.k=4", "stage.contact.boundary=free"];
    let (_folder, study) = read(&[("base.toml", BASE)], &settings);
    let study = study.unwrap();
    assert_eq!(study.manifest.settings[2], "stage.contact.boundary=\"free\"");
    let plain = BASE
        .replace("k = 8", "k = 4")
        .replace("hurst", "realizations = 3\nhurst")
        .replace("loads =", "boundary = \"free\"\nloads =");
    let text = same(study, &plain);
    assert!(text.contains("# --set parameters.k=4"), "{text}");
    let (_folder, plain) = read(&[("base.toml", BASE)], &[]);
    assert_eq!(
        plain.unwrap().manifest,
        EffectiveManifest { text: BASE.to_owned(), ..Default::default() }
    );
}

#[test]
fn a_variant_needs_no_longer_use_an_inherited_parameter() {
    let overridden = "[stage.surfaces]\nnodes = 64\nk_upper = 8\n";
    let variant = format!("[study]\nname = \"v\"\nextends = \"base.toml\"\n{overridden}");
    let (_folder, study) = read(&[("v.toml", &variant), ("base.toml", BASE)], &[]);
    let text = study.unwrap().manifest.text;
    assert!(!text.contains("parameters"), "{text}");
    // The effective manifest stands alone.
    Study::parse(&text, "effective.toml", Path::new("")).unwrap();
    let settings = ["stage.surfaces.nodes=64", "stage.surfaces.k_upper=8"];
    let (_folder, study) = read(&[("base.toml", BASE)], &settings);
    assert!(!study.unwrap().manifest.text.contains("parameters"));
    // A parameter of the variant itself is probably misspelt.
    let misspelt = format!("{variant}[parameters]\nkk = 4\n");
    for (files, settings, expected) in [
        (vec![("v.toml", misspelt.as_str()), ("base.toml", BASE)], vec![], "v.toml:8:1"),
        (vec![("base.toml", BASE)], vec!["parameters.kk=4"], "--set:1:12"),
    ] {
        let (_folder, study) = read(&files, &settings);
        let message = study.unwrap_err();
        assert!(message.contains("no stage uses the parameter `kk`"), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn mistakes_are_shown_in_the_text_that_has_them() {
    let variant = |rest: &str| format!("[study]\nname = \"v\"\nextends = \"base.toml\"\n{rest}");
    let bad_base = BASE.replace("hurst = 0.8", "hurst = 8");
    for (files, settings, expected) in [
        (vec![("v.toml", variant("")), ("base.toml", bad_base)], vec![], "base.toml:12:9"),
        (
            vec![
                ("v.toml", variant("[stage.surfaces]\nhurst = -1\n")),
                ("base.toml", BASE.to_owned()),
            ],
            vec![],
            "v.toml:5:9",
        ),
        (
            vec![("v.toml", variant("seed = +\n")), ("base.toml", BASE.to_owned())],
            vec![],
            "v.toml:4:8",
        ),
        (vec![("base.toml", BASE.to_owned())], vec!["stage.surfaces.hurst=7"], "--set:1:22"),
        (
            vec![("base.toml", BASE.to_owned())],
            vec!["stage.surface.hurst=0.7"],
            "did you mean `surfaces`?",
        ),
        (
            vec![("base.toml", BASE.to_owned())],
            vec!["surfaces.hurst=0.7"],
            "write `[stage.surfaces]`",
        ),
        (
            vec![
                ("v.toml", variant("[stage.surfaces]\nk_lower = 4\n")),
                ("base.toml", BASE.to_owned()),
            ],
            vec![],
            "base.toml:14:13: smaller",
        ),
        (
            vec![
                ("v.toml", variant("[stage.surface]\nk_lower = 4\n")),
                ("base.toml", BASE.to_owned()),
            ],
            vec![],
            "no extended manifest has a stage `surface`",
        ),
        (vec![("v.toml", variant(""))], vec![], "extended here"),
        (
            vec![("v.toml", variant("")), ("base.toml", variant("").replace("base", "v"))],
            vec![],
            "`v.toml` is extended by itself",
        ),
        (
            vec![
                ("v.toml", variant("remove = [\"stage.surfaces.hust\"]")),
                ("base.toml", BASE.to_owned()),
            ],
            vec![],
            "did you mean `hurst`?",
        ),
        (
            vec![
                ("v.toml", "[study]\nextends = \"base.toml\"".to_owned()),
                ("base.toml", BASE.to_owned()),
            ],
            vec![],
            "`name` is not given",
        ),
        (
            vec![("base.toml", BASE.replace("seed = 7", "remove = \"stage\""))],
            vec![],
            "`remove` needs `extends`",
        ),
    ] {
        let files: Vec<(&str, &str)> =
            files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let (_folder, study) = read(&files, &settings);
        let errors = study.unwrap_err();
        assert!(errors.contains(expected), "{expected} in\n{errors}");
    }
}

#[test]
fn a_plain_load_in_place_of_a_pressure_has_a_warning_with_both_readings() {
    let base = BASE.replace("hurst = 0.8", "hurst = 0.8\nside = \"1 mm\"").replace(
        "loads = { from = 0.1, to = 0.2, steps = 2 }",
        "effective_modulus = \"70 GPa\"\nloads = [\"10 MPa\", \"0.1 GPa\"]",
    );
    assert!(base.contains("10 MPa"), "the base has pressures");
    let variant = |rest: &str| format!("[study]\nname = \"v\"\nextends = \"base.toml\"\n{rest}");
    let warnings = |rest: &str, settings: &[&str]| -> Vec<String> {
        let (_folder, study) = read(&[("v.toml", &variant(rest)), ("base.toml", &base)], settings);
        let warnings = study.unwrap().warnings().into_iter().map(|warning| warning.message);
        warnings.filter(|message| message.contains("`loads` have no unit")).collect()
    };
    let found = warnings("[stage.contact]\nloads = [0.02, 0.05]\n", &[]);
    assert!(found[0].contains("0.05 is read as 0.05 × E* × rms slope, here "), "{found:?}");
    assert_eq!(warnings("", &["stage.contact.loads=[0.05]"]).len(), 1);
    for (rest, setting) in [
        ("", "stage.contact.loads=[\"5 MPa\"]"),
        ("[stage.contact]\nload_unit = \"relative\"", "stage.contact.loads=[0.05]"),
        ("[stage.contact]\nload_unit = \"MPa\"", "stage.contact.loads=[50]"),
    ] {
        assert_eq!(warnings(rest, &[setting]), [""; 0], "{rest} {setting}");
    }
}

#[test]
fn a_description_is_the_first_paragraph_of_the_first_comment() {
    let manifest =
        "#:schema s.json\n# Area against H,\n# in two lines.\n#\n# More.\n[study]\n# No.";
    assert_eq!(description(manifest).as_deref(), Some("Area against H, in two lines."));
    assert_eq!(description("[study]\n# No."), None);
}

#[test]
fn a_file_that_is_no_manifest_is_named_and_not_quoted() {
    let variant = "[study]\nname = \"v\"\nextends = \"private\"\n";
    let (folder, study) = read(&[("v.toml", variant), ("private", "a = 1\nroot:x:secret\n")], &[]);
    let message = study.unwrap_err();
    let place = format!("cannot extend `{}`", folder.path().join("private").display());
    assert!(message.contains(&place) && message.contains("in line 2, column"), "{message}");
    assert!(message.contains("v.toml:3:11") && !message.contains("secret"), "{message}");
}
