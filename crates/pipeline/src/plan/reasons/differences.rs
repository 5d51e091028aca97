//! Differences between the parameters of two studies, stage by stage.
//!
//! The comparison uses the records of the studies, which contain the checked parameters with all
//! defaults. How a manifest writes a parameter makes no difference.

use std::collections::{BTreeSet, HashSet};
use std::fmt;

use serde::Serialize;
use serde_json::Value;

use super::changes::{Shown, part_version_change, unit_of, version_change};
use super::counterparts;
use super::record::{PointRecord, Record, StageRecord};
use asperity_manifest::decimal;
use asperity_stages::Kind;
use asperity_stages::version::VersionChange;

/// Maximum number of elements of a list that are named as missing in the other list.
const MAX_ELEMENTS: usize = 6;

/// Difference between two studies A and B in one stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageDifference {
    /// Name of the stage, in A if A has it.
    pub stage: String,
    #[serde(flatten)]
    pub what: Difference,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Difference {
    OnlyInA {
        kind: Kind,
    },
    OnlyInB {
        kind: Kind,
    },
    /// Versions of the stage's computation, or of a part of it, from A to B.
    Version {
        a: u32,
        b: u32,
        /// Numbers that have the version: a kind of stage, or a part of its numbers.
        of: String,
        /// Reasons of the versions after that of A.
        reasons: Vec<&'static str>,
    },
    /// Stages that the stage reads, by their names in A.
    Reads {
        a: Vec<String>,
        b: Vec<String>,
    },
    /// Key with different values at the parameter points; empty if the key has no value.
    Key {
        key: String,
        a: Vec<Value>,
        b: Vec<Value>,
        /// Units of the values of A and of B, if the manifests name them.
        #[serde(skip)]
        units: [Option<String>; 2],
    },
    /// Numbers of parameter points that only one study has, although each key has the same values
    /// in both.
    Combinations {
        a: usize,
        b: usize,
    },
}

/// Pairs the stages of two studies by name and kind. A stage whose name only one study has
/// corresponds to the only such stage of the same kind in the other study. Each pair has the
/// indices of the stages in `a` and `b`.
pub fn stage_pairs(a: &Record, b: &Record) -> Vec<(usize, usize)> {
    let stages = counterparts(Some(a), b).into_iter().enumerate();
    let index = |stage: &StageRecord| a.stages.iter().position(|known| known.name == stage.name);
    let mut pairs: Vec<(usize, usize)> =
        stages.filter_map(|(at, stage)| Some((index(stage?)?, at))).collect();
    // Two renamed stages of B could claim the same stage of A.
    let mut taken = HashSet::new();
    pairs.retain(|(at, _)| taken.insert(*at));
    pairs.sort_unstable();
    pairs
}

/// Compares the parameters of two studies, in the order of the stages of `a`.
pub fn differences(a: &Record, b: &Record) -> Vec<StageDifference> {
    let pairs = stage_pairs(a, b);
    let mut found = Vec::new();
    for (at, stage) in a.stages.iter().enumerate() {
        let differences = match pairs.iter().find(|(first, _)| *first == at) {
            Some(&(_, other)) => stage_differences(stage, &b.stages[other], |name| {
                let other = b.stages.iter().position(|stage| stage.name == name);
                let pair = pairs.iter().find(|(_, second)| Some(*second) == other);
                pair.map_or(name, |(first, _)| &a.stages[*first].name)
            }),
            None => vec![Difference::OnlyInA { kind: stage.kind }],
        };
        let named = |what| StageDifference { stage: stage.name.clone(), what };
        found.extend(differences.into_iter().map(named));
    }
    let is_paired = |at: usize| pairs.iter().any(|(_, second)| *second == at);
    let more = b.stages.iter().enumerate().filter(|(at, _)| !is_paired(*at));
    found.extend(more.map(|(_, stage)| StageDifference {
        stage: stage.name.clone(),
        what: Difference::OnlyInB { kind: stage.kind },
    }));
    found
}

/// Compares two stages; `name_in_a` returns the name in A of a stage of B.
fn stage_differences<'a>(
    a: &StageRecord,
    b: &'a StageRecord,
    name_in_a: impl Fn(&'a str) -> &'a str,
) -> Vec<Difference> {
    let mut found = Vec::new();
    found.extend(version_change(a, b).map(Difference::from));
    let reads: Vec<String> = b.reads.iter().map(|name| name_in_a(name).to_owned()).collect();
    if a.reads != reads {
        found.push(Difference::Reads { a: a.reads.clone(), b: reads });
    }
    let before = found.len();
    let points = a.points.iter().chain(&b.points);
    let keys: BTreeSet<&str> =
        points.flat_map(|point| point.fields.keys()).map(String::as_str).collect();
    for key in keys.into_iter().chain([REALIZATIONS]) {
        let units = [a, b].map(|stage| unit_of(stage.points.first()?, key));
        let mut versions = a.points.iter().chain(&b.points).flat_map(|point| &point.versions);
        let part = versions.find(|part| part.parameter == key);
        let [a, b] = [a, b].map(|stage| values(stage, key));
        if has_same_elements(&a, &b) {
            continue;
        }
        // All values of the parameter differ in nothing but the same version.
        let version = part.and_then(|part| {
            let change = |at| part_version_change(part, a.get(at).cloned(), b.get(at).cloned());
            let mut changes = (0..a.len().max(b.len()).max(1)).map(change);
            let first = changes.next()??;
            changes.all(|other| other.as_ref() == Some(&first)).then_some(first)
        });
        found.push(match version {
            Some(change) => change.into(),
            None => Difference::Key { key: key.to_owned(), a, b, units },
        });
    }
    if found.len() == before {
        let only = |one: &StageRecord, other: &StageRecord| {
            let known: HashSet<_> = other.points.iter().map(identified).collect();
            one.points.iter().filter(|point| !known.contains(&identified(point))).count()
        };
        let [a, b] = [only(a, b), only(b, a)];
        if a + b > 0 {
            found.push(Difference::Combinations { a, b });
        }
    }
    found
}

impl From<VersionChange> for Difference {
    fn from(VersionChange { of, old, new, reasons }: VersionChange) -> Difference {
        Difference::Version { a: old, b: new, of, reasons }
    }
}

/// Name under which the number of surfaces per point is compared.
const REALIZATIONS: &str = "realizations";

fn identified(point: &PointRecord) -> (Vec<(&String, &String)>, u32) {
    (point.fields.iter().collect(), point.realizations)
}

/// Returns the distinct values of a key at the points of a stage, in the order of the points.
fn values(stage: &StageRecord, key: &str) -> Vec<Value> {
    let mut known = HashSet::new();
    let texts = stage.points.iter().filter_map(|point| match key {
        REALIZATIONS if stage.kind == Kind::Generate => Some(point.realizations.to_string()),
        _ => point.fields.get(key).cloned(),
    });
    let new = texts.filter(|text| known.insert(text.clone()));
    new.map(|text| serde_json::from_str(&text).unwrap_or(Value::String(text))).collect()
}

fn has_same_elements(a: &[Value], b: &[Value]) -> bool {
    a.len() == b.len() && a.iter().all(|value| b.contains(value))
}

/// Formats the values of a key.
fn shown(values: &[Value]) -> String {
    match values {
        [] => "–".to_owned(),
        // Numbers as users write them: 2e9 and not 2000000000.0.
        [Value::Number(number)] if number.is_f64() => {
            number.as_f64().map_or_else(|| number.to_string(), decimal::written)
        }
        [one] => Shown::from_json(&one.to_string()).0,
        all => Shown::from_json(&Value::from(all.to_vec()).to_string()).0,
    }
}

/// Formats the elements of `of` that `other` lacks.
fn lacking(of: &[Value], other: &[Value]) -> String {
    let elements = |values: &[Value]| match values {
        [Value::Array(list)] => list.clone(),
        values => values.to_vec(),
    };
    let other = elements(other);
    let mut only = elements(of);
    only.retain(|value| !other.contains(value));
    let named: Vec<String> =
        only.iter().take(MAX_ELEMENTS).map(|one| Shown::from_json(&one.to_string()).0).collect();
    let more = if only.len() > MAX_ELEMENTS { ", …" } else { "" };
    if named.is_empty() { "–".to_owned() } else { named.join(", ") + more }
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Difference::OnlyInA { kind } => write!(formatter, "stage ({kind}) only in A"),
            Difference::OnlyInB { kind } => write!(formatter, "stage ({kind}) only in B"),
            Difference::Version { a, b, of, reasons } => {
                let (of, reasons) = (of.clone(), reasons.clone());
                VersionChange { of, old: *a, new: *b, reasons }.fmt(formatter)
            }
            Difference::Reads { a, b } => {
                write!(formatter, "from {} → {}", a.join(", "), b.join(", "))
            }
            Difference::Key { key, a, b, units } => {
                let [old, new] = [(a, &units[0]), (b, &units[1])].map(|(values, unit)| {
                    let symbol = unit.as_ref().filter(|_| !values.is_empty());
                    shown(values) + &symbol.map(|unit| format!(" {unit}")).unwrap_or_default()
                });
                if old == new {
                    // The texts of long lists name only their ends.
                    let (only_a, only_b) = (lacking(a, b), lacking(b, a));
                    write!(formatter, "{key} {old}; only in A: {only_a}; only in B: {only_b}")
                } else {
                    write!(formatter, "{key} {old} → {new}")
                }
            }
            Difference::Combinations { a, b } => write!(
                formatter,
                "other combinations of the same values: {a} only in A, {b} only in B"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn stage(name: &str, kind: Kind, points: &[&[(&str, &str)]]) -> StageRecord {
        let point = |fields: &&[(&str, &str)]| PointRecord {
            fields: BTreeMap::from_iter(
                fields.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())),
            ),
            realizations: 1,
            identity: String::new(),
            versions: Vec::new(),
        };
        StageRecord {
            name: name.to_owned(),
            kind,
            version: 1,
            reads: Vec::new(),
            points: points.iter().map(point).collect(),
            tasks: points.len(),
            finished: 0,
            stores: Vec::new(),
        }
    }

    /// Formats the differences between two studies of one stage.
    fn compared(a: &StageRecord, b: &StageRecord) -> Vec<String> {
        let [a, b] = [a, b].map(|stage| Record { stages: vec![stage.clone()] });
        differences(&a, &b).iter().map(|found| format!("{}: {}", found.stage, found.what)).collect()
    }

    #[test]
    fn added_removed_and_changed_keys_have_their_values() {
        let a = stage(
            "contact",
            Kind::Solve,
            &[&[("tolerance", "1e-6"), ("hardness", "2500000000.0")]],
        );
        let b = stage("contact", Kind::Solve, &[&[("tolerance", "0.01"), ("flow", "true")]]);
        let expected = [
            "contact: flow – → true",
            "contact: hardness 2.5e9 → –",
            "contact: tolerance 1e-6 → 0.01",
        ];
        assert_eq!(compared(&a, &b), expected);
        assert!(compared(&a, &a).is_empty());
    }

    #[test]
    fn a_sweep_is_compared_by_its_values() {
        let hurst = |values: &[&'static str]| {
            let points: Vec<Vec<(&str, &str)>> =
                values.iter().map(|value| vec![("hurst", *value)]).collect();
            let points: Vec<&[(&str, &str)]> = points.iter().map(Vec::as_slice).collect();
            stage("surfaces", Kind::Generate, &points)
        };
        let found = compared(&hurst(&["0.3", "0.8"]), &hurst(&["0.3", "0.5", "0.8"]));
        assert_eq!(found, ["surfaces: hurst 0.3, 0.8 → 0.3, 0.5, 0.8"]);
        // The order of the points has no effect on a surface.
        assert!(compared(&hurst(&["0.3", "0.8"]), &hurst(&["0.8", "0.3"])).is_empty());
        let mut more = hurst(&["0.3"]);
        more.points[0].realizations = 5;
        assert_eq!(compared(&hurst(&["0.3"]), &more), ["surfaces: realizations 1 → 5"]);
    }

    #[test]
    fn equal_values_in_other_combinations_are_counted() {
        let point = |hurst, upper| [("hurst", hurst), ("k_upper", upper)];
        let a = stage("s", Kind::Generate, &[&point("0.3", "8"), &point("0.8", "16")]);
        let b = stage("s", Kind::Generate, &[&point("0.3", "16"), &point("0.8", "8")]);
        let expected = "s: other combinations of the same values: 2 only in A, 2 only in B";
        assert_eq!(compared(&a, &b), [expected]);
    }

    #[test]
    fn long_lists_with_the_same_ends_name_the_elements_that_differ() {
        let loads = |third: &str| {
            let list = format!("[0.1,0.2,{third},0.4,0.5,0.6,0.7]");
            stage("contact", Kind::Solve, &[&[("loads", list.as_str())]])
        };
        let expected = "contact: loads 7 values, 0.1 … 0.7; only in A: 0.3; only in B: 0.35";
        assert_eq!(compared(&loads("0.3"), &loads("0.35")), [expected]);
    }

    #[test]
    fn values_have_the_unit_that_each_manifest_names() {
        let loads = |list: &str, unit: &str| {
            let unit = format!("\"{unit}\"");
            let fields = [("loads", list), ("load_unit", "\"absolute\""), ("pressure_unit", &unit)];
            stage("contact", Kind::Solve, &[&fields])
        };
        let found = compared(&loads("[10,20]", "MPa"), &loads("[0.01]", "GPa"));
        let expected = ["contact: loads 10, 20 MPa → 0.01 GPa", "contact: pressure_unit MPa → GPa"];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_renamed_stage_is_compared_and_another_kind_is_another_stage() {
        let a = stage("light", Kind::Solve, &[&[("tolerance", "1e-6")]]);
        let b = stage("contact", Kind::Solve, &[&[("tolerance", "0.001")]]);
        assert_eq!(compared(&a, &b), ["light: tolerance 1e-6 → 0.001"]);
        let c = stage("light", Kind::Measure, &[&[]]);
        let expected = ["light: stage (solve) only in A", "light: stage (measure) only in B"];
        assert_eq!(compared(&a, &c), expected);
    }
}
