//! Expressions at the points of a small table.

use schemars::JsonSchema;
use serde::Deserialize;

use super::*;
use crate::diagnostics::Problems;
use crate::keys::declare::{length, load, pair, pressure, swept};
use crate::keys::expected_keys::ExpectedKeys;
use crate::keys::quantity::Dimension;
use crate::keys::{Key, OnAxes, Section, Spanned, reader, table};

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Example {
    #[schemars(range(min = 1, max = 4096), transform = pair, transform = swept)]
    nodes: Key<OnAxes<u32>>,
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 2.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    side: Key<OnAxes<f64>>,
    #[schemars(transform = swept)]
    k: Key<u32>,
    #[schemars(transform = swept)]
    factor: Key<Factor>,
    range: Key<Range>,
    seed: Key<u64>,
    list: Key<Vec<Spanned<f64>>>,
    #[schemars(transform = load)]
    loads: Key<Vec<Spanned<f64>>>,
    #[schemars(transform = pressure)]
    modulus: Key<f64>,
}

table!(Example);

#[derive(Debug, Clone, Copy, PartialEq, JsonSchema)]
#[schemars(untagged)]
enum Factor {
    Word(Word),
    Number(f64),
}

crate::keys::deserialize_either!(Factor { word => Word, number => Number });

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
enum Word {
    #[serde(rename = "pi/8")]
    PiEighth,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "only the declarations are used")]
struct Range {
    #[schemars(transform = length)]
    to: Spanned<f64>,
    #[serde(default)]
    steps: Key<u32>,
}

/// Reads a table with parameters, and returns its points and problems.
fn read(parameters: &str, text: &str) -> (Section<Example>, Vec<String>) {
    let mut problems = Problems::default();
    let parameters = DeTable::parse(parameters).unwrap().into_inner();
    let parameters = Parameters::read(parameters, &mut problems);
    let scope = Scope { parameters: Some(&parameters), ..Scope::default() };
    let expected = ExpectedKeys { scope: Some(&scope), ..ExpectedKeys::of_table("the table") };
    let table = DeTable::parse(text).unwrap().into_inner();
    let section = reader::read(table, 0..0, &expected, &mut problems);
    let errors = problems.into_errors("study.toml", text);
    (section, errors.problems().iter().map(ToString::to_string).collect())
}

/// Returns nodes, `k` and the factor of each point of a table without problems.
fn points(parameters: &str, text: &str) -> Vec<([u32; 2], Option<u32>, Option<Factor>)> {
    let (section, problems) = read(parameters, text);
    assert_eq!(problems, [""; 0], "{text}");
    let points = section.points.iter().map(|point| &point.table);
    let values = points.map(|point| {
        let nodes = point.nodes.value().map_or([0; 2], |nodes| nodes.pair());
        (nodes, point.k.value(), point.factor.value())
    });
    values.collect()
}

#[test]
fn an_expression_is_evaluated_at_each_point() {
    let written = points("", "k = [4, 8]\nnodes = \"8 * k\"");
    assert_eq!(written, [([32; 2], Some(4), None), ([64; 2], Some(8), None)]);
    // In lists, pairs and cases, and through other keys.
    let written = points("", "nodes = [[\"k\", \"2 * k\"], [\"4 * k\", \"k\"]]\nk = \"4 * side\"");
    assert_eq!(written, [([8, 16], Some(8), None), ([32, 8], Some(8), None)]);
    let written =
        points("", "cases = [{ k = 2, nodes = \"k + 1\" }, { k = \"nodes / 2\", nodes = 6 }]");
    assert_eq!(written, [([3; 2], Some(2), None), ([6; 2], Some(3), None)]);
}

#[test]
fn a_swept_parameter_is_one_axis() {
    let written = points("n = [1, 2]", "k = \"n\"\nnodes = \"8 * n\"");
    assert_eq!(written, [([8; 2], Some(1), None), ([16; 2], Some(2), None)]);
    // The parameter varies where its first key would: more slowly than `k`.
    let written = points("n = [1, 2]\nm = \"8 * n\"", "k = [3, 4]\nnodes = \"m\"");
    let numbers: Vec<_> = written.iter().map(|(nodes, k, _)| (nodes[0], k.unwrap())).collect();
    assert_eq!(numbers, [(8, 3), (8, 4), (16, 3), (16, 4)]);
}

#[test]
fn parameters_that_build_on_each_other_are_evaluated_once() {
    let chain: String = (1..20_000).map(|i| format!("p{i} = \"p{} + 0\"\n", i - 1)).collect();
    let twice: String =
        (2..200).map(|i| format!("q{i} = \"(q{} + q{}) / 2\"\n", i - 1, i - 2)).collect();
    let parameters = format!("p0 = 3\n{chain}q0 = 5\nq1 = 5\n{twice}");
    let expected = vec![([3, 3], Some(5), None)];
    assert_eq!(points(&parameters, "nodes = \"p19999\"\nk = \"q199\""), expected);
}

#[test]
fn keys_shadow_parameters_but_never_mean_themselves() {
    let written = points("k = 3\nnodes = 7", "k = \"k + 1\"\nnodes = \"nodes * k\"");
    assert_eq!(written, [([28; 2], Some(4), None)]);
}

#[test]
fn words_remain_words_and_numbers_keep_all_digits() {
    let written = points("pi = 8", "factor = \"pi/8\"");
    assert_eq!(written[0].2, Some(Factor::Word(Word::PiEighth)));
    let written = points("half = \"1 / 2\"", "factor = \"half + 1\"");
    assert_eq!(written[0].2, Some(Factor::Number(1.5)));
    let (section, problems) = read("large = 9223372036854775807", "seed = \"large\"");
    assert_eq!(problems, [""; 0]);
    assert_eq!(section.points[0].table.seed.value(), Some(i64::MAX as u64));
    // Three times a tenth is rounded to the number that was meant.
    let (section, _) = read("", "list = [\"3 * k / 10\"]\nk = 1");
    assert_eq!(section.points[0].table.list.written().unwrap().value[0].value, 0.3);
}

#[test]
fn quantities_are_computed_in_the_units_of_the_table() {
    let sides = |parameters: &str, text: &str| {
        let (section, problems) = read(parameters, text);
        assert_eq!(problems, [""; 0], "{parameters} {text}");
        let unit = section.units.length.as_ref().map_or("", |named| named.unit.symbol);
        let points = section.points.iter().map(|point| &point.table);
        let values: Vec<_> =
            points.map(|point| (point.side.value().unwrap().pair()[0], point.k.value())).collect();
        (unit, values)
    };
    let length = "length = \"10 um\"";
    assert_eq!(sides(length, "side = \"2 * length\""), ("µm", vec![(20.0, None)]));
    let text = "side = \"length / 4\"\nrange = { to = \"100 nm\" }";
    assert_eq!(sides(length, text), ("µm", vec![(2.5, None)]), "of the first key");
    let half = format!("{length}\nhalf = \"length / 2\"\nstep = \"50 nm\"");
    let text = "side = \"sqrt(half * length / 2)\"\nk = \"2 * side / (step * 20)\"";
    assert_eq!(sides(&half, text), ("µm", vec![(5.0, Some(10))]));
    let swept = "length = [\"10 um\", \"0.02 mm\"]";
    assert_eq!(sides(swept, "side = \"length\"").1, [(10.0, None), (20.0, None)]);
}

#[test]
fn loads_may_be_forces_or_pressures() {
    let parameters = "f = \"10 N\"\np = \"1 MPa\"\na = \"1 um\"\nb = \"4 um\"";
    let loads = |text: &str| {
        let (section, problems) = read(parameters, text);
        assert_eq!(problems, [""; 0], "{text}");
        let loads = &section.points[0].table.loads.written().unwrap().value;
        let units = &section.units;
        loads.iter().map(|load| (load.value, units.dimension_of(&load.span))).collect::<Vec<_>>()
    };
    let [pressure, force] = [Dimension::Pressure, Dimension::Force].map(Some);
    assert_eq!(loads("loads = [\"2 * f\"]"), [(20.0, force)]);
    assert_eq!(loads("loads = [\"f / a^2\"]"), [(1e13, pressure)]);
    let text = "loads = [\"2 * a\"]";
    let (_, problems) = read(parameters, text);
    assert_eq!(problems.len(), 1, "{problems:?}");
    let expected = "must be a pressure or a force, but this is a length";
    assert!(problems[0].contains(expected), "{problems:?}");
}

#[test]
fn a_key_without_a_unit_is_not_computed_with_a_quantity() {
    let parameters = "step = \"100 mm\"\nhalf = \"step / 2\"\np = \"1 MPa\"\nratio = 2";
    for (text, expected) in [
        ("side = 3.2\nnodes = \"side / step\"", "`side` has no unit, but `step` has one"),
        ("nodes = \"side / half\"", "`side` has no unit, but `step` has one"),
        ("modulus = 20\nloads = [\"p / modulus\"]", "`modulus` has no unit, but `p` has one"),
        ("side = \"4 m\"\nmodulus = 20\nk = \"modulus / p\"", "`modulus` has no unit"),
    ] {
        let (_, problems) = read(parameters, text);
        assert_eq!(problems.len(), 1, "{text}: {problems:?}");
        assert!(problems[0].contains(expected), "{text}: {problems:?}");
    }
    let nodes = |text: &str| points(parameters, text)[0].0[0];
    assert_eq!(nodes("side = \"3.2 m\"\nnodes = \"side / step\""), 32);
    assert_eq!(nodes("side = \"32 * step\"\nnodes = \"side / step\""), 32);
    assert_eq!(nodes("side = 32\nnodes = \"ratio * side\""), 64);
    // A parameter shadows a key that the table does not contain.
    let (section, problems) = read("side = \"3.2 m\"\nstep = \"0.1 m\"", "nodes = \"side / step\"");
    assert_eq!(problems, [""; 0]);
    assert_eq!(section.points[0].table.nodes.value().unwrap().pair(), [32; 2]);
}

#[test]
fn mistakes_in_expressions_name_the_place_and_the_reason() {
    for (parameters, text, expected) in [
        ("", "nodes = \"8 * k_uper\"\nk = 1", "unknown name, `k_uper`"),
        ("", "nodes = \"8 * zz\"", "no key of the stage and no parameter is called `zz`"),
        (
            "hurst = 1",
            "k = \"hust\"",
            "`k` must be a number or an expression (did you mean `hurst`?)",
        ),
        ("", "nodes = \"8 * (k\"", "`)` is missing"),
        ("", "nodes = \"slope(k)\"", "`slope` needs the loads of a surface"),
        ("", "nodes = \"8 * k\"", "`k` is not given"),
        ("", "nodes = \"8 / k\"\nk = 0", "`k` is 0, the result is inf"),
        ("", "nodes = \"0 / 0\"", "the result is NaN"),
        ("", "nodes = \"k / 2\"\nk = 3", "(this is the number 1.5)"),
        ("", "nodes = \"k - 4\"\nk = 3", "`nodes` is -1 (must be from 1 to 4096)"),
        (
            "",
            "range = { to = \"1 / k\", steps = \"k / 2\" }\nk = 3",
            "`range.steps` must be a whole",
        ),
        (
            "",
            "nodes = \"2 * k\"\nk = \"nodes / 2\"",
            "keys depend on each other in a cycle: k ← nodes ← k (`k` uses `nodes`)",
        ),
        ("", "k = \"k + 1\"", "`k` depends on itself, and there is no parameter `k`"),
        ("", "nodes = \"2 * factor\"\nfactor = \"pi/8\"", "`factor` is not a single number here"),
        ("n = [1, 2]", "seed = \"n\"", "the parameter `n` is a list, and this key is not swept"),
        ("length = \"10 um\"", "k = \"2 * length\"", "must be a pure number, but this is a length"),
        ("a = \"1 um\"", "side = \"2 * a + 1\"", "this adds a pure number to a length"),
        ("a = \"1 MPa\"", "side = \"2 * a\"", "must be a length, but this is a pressure"),
        ("a = \"1 um\"", "side = \"a^2\"", "must be a length, but this is another quantity"),
        ("a = \"1 um\"", "k = \"ln(a)\"", "`ln` of a length"),
        ("a = \"1 um\"\nb = \"a / 2\"", "k = 5\nside = \"a / b\"", "this is a pure number"),
        ("a = [\"1 um\", 2]", "side = \"a\"", "the values of `a` are different quantities"),
        ("", "nodes = \"8 * 2 um\"", "write the result with its unit, such as \"20 µm\", or name"),
        (
            "a = \"1 um\"",
            "k = \"(((((((((((a^9)^9)^9)^9)^9)^9)^9)^9)^9)^9)^9)\"",
            "another quantity",
        ),
        ("", "side = \"1,5 um\"", "numbers have a decimal point: write \"1.5 um\""),
        ("", "factor = \"pi/9\"", "`factor` cannot be \"pi/9\""),
        ("", "nodes = \"32\"", "write numbers without quotes"),
    ] {
        let (_, problems) = read(parameters, text);
        assert_eq!(problems.len(), 1, "{text}: {problems:?}");
        assert!(problems[0].contains(expected), "{text}: {problems:?}");
    }
}

#[test]
fn a_reported_key_causes_no_further_problems() {
    let (section, problems) = read("", "k = -1\nnodes = \"2 * k\"");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(section.reported_keys.contains("nodes"));
}

#[test]
fn quantities_have_a_number_and_a_unit() {
    for text in ["2", "10 MPa", "-2.5e-3 m", "3µm", "5 %", "1e9Pa", "2 N/mm^2"] {
        assert!(has_unit(text), "{text}");
    }
    for text in ["8 * k", "k", "2e", "1 / 2", "(2)", "-k", "2^k", ""] {
        assert_eq!(has_unit(text), text == "2e", "{text}");
    }
}
