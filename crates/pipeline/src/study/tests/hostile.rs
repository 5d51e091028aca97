//! Manifests that nobody writes, and that break nothing.

use super::*;

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
    assert!(message(&text).contains("10000 is the most"));
    let many = surface("nodes = 64\nk_upper = 32\nk_lower = 1\nrealizations = 1000000\n");
    let twice = many.replace("hurst = 0.8", "hurst = [0.8, 0.9]");
    assert!(message(&twice).contains("1000000 is the most"));
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
