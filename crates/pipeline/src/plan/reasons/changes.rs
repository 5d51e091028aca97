//! Causes that make tasks run, and the comparison of a stage with its record that finds them.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fmt;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::plan::reasons::record::{PointRecord, StageRecord};
use asperity_manifest::keys::quantity;
use asperity_stages::aggregate::Statistic;
use asperity_stages::units::unit_of_parameter;
use asperity_stages::version::{PartVersion, VersionChange};

/// Cause that makes tasks run, and the stage in which it arose.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cause {
    /// Index of the stage in the plan.
    pub stage: usize,
    pub why: Why,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
pub enum Why {
    /// The study has no record of an earlier run.
    FirstRun,
    NewStage,
    /// A parameter point or a realization is new.
    New {
        /// Parameters that distinguish the new point or realization from all earlier ones.
        fields: Vec<Field>,
    },
    Changed {
        fields: Vec<Change>,
    },
    /// The program has another version of the stage's computation, or of a part of it.
    Version(VersionChange),
    /// The stage reads a stage that it did not read before.
    ReadsMore {
        name: String,
    },
    /// The stage no longer reads a stage that it read before.
    ReadsLess {
        name: String,
    },
    /// A parameter point or a realization that was pooled before no longer exists.
    Fewer {
        /// Parameters of the removed point or realization.
        fields: Vec<Field>,
    },
    /// The order of the pooled tables has changed.
    Reordered,
    /// The task was planned before, but the last run ended before the task was computed.
    Unfinished,
    /// All tasks of the stage were finished, but the file of this task is missing.
    Missing,
    /// The file was damaged and is in quarantine.
    Damaged,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct Field {
    pub field: String,
    pub value: Shown,
}

/// Parameter with its old and new values; `None` means that it had no value.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct Change {
    pub field: String,
    pub old: Option<Shown>,
    pub new: Option<Shown>,
}

/// Value of a parameter as a text that fits on a line.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(transparent)]
pub struct Shown(pub String);

impl Shown {
    /// Maximum length in characters of a value that is neither a list nor a number.
    const MAX_LENGTH: usize = 60;

    /// Formats the value of a parameter, given as JSON, and shortens it if necessary.
    pub fn from_json(json: &str) -> Shown {
        let value = serde_json::from_str(json);
        Shown(value.map_or_else(|_| json.to_owned(), |value| short(&value, json)))
    }
}

fn short(value: &Value, json: &str) -> String {
    match value {
        Value::String(text) => cut(text),
        Value::Array(list) => listed(list),
        Value::Object(object) => match object.get("name").and_then(Value::as_str) {
            Some(name) => cut(name),
            None => statistic(object).unwrap_or_else(|| {
                let parts = object
                    .iter()
                    .map(|(name, value)| format!("{name} {}", cut(&value.to_string())));
                parts.collect::<Vec<_>>().join(", ")
            }),
        },
        // The text is used as it is, because parsing a number may round its last digit.
        _ => cut(json),
    }
}

/// Returns the name that manifests use for a quantile or a confidence interval.
fn statistic(object: &Map<String, Value>) -> Option<String> {
    let share = |name: &str| object.get(name).and_then(Value::as_f64);
    let quantile = share("quantile").map(Statistic::Quantile);
    let statistic = quantile.or_else(|| share("confidence").map(Statistic::Confidence))?;
    (object.len() == 1).then(|| statistic.suffix())
}

/// Formats a list: in full if it is short, otherwise as its length, first value and last value.
fn listed(list: &[Value]) -> String {
    const SHORT: usize = 6;
    match list {
        [first, .., last] if list.len() > SHORT => {
            format!("{} values, {} … {}", list.len(), rounded(first), rounded(last))
        }
        _ => list.iter().map(|item| short(item, &item.to_string())).collect::<Vec<_>>().join(", "),
    }
}

/// Formats a number with five digits, which are enough to recognise a load.
fn rounded(value: &Value) -> String {
    let number = value.as_f64().and_then(|number| format!("{number:.4e}").parse::<f64>().ok());
    number.map_or_else(|| cut(&value.to_string()), |number| number.to_string())
}

fn cut(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(Shown::MAX_LENGTH) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl Why {
    /// Returns the cause without the reasons of a version, for stages that read the one in which it
    /// arose.
    pub fn brief(&self) -> String {
        match self {
            Why::Version(VersionChange { of, new, .. }) => format!("{of} version {new}"),
            why => why.to_string(),
        }
    }
}

impl fmt::Display for Why {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Why::FirstRun => write!(formatter, "no record of an earlier run"),
            Why::NewStage => write!(formatter, "new stage"),
            Why::New { fields } => write!(formatter, "new {}", joined(fields)),
            Why::Changed { fields } => write!(formatter, "{}", joined(fields)),
            Why::Version(change) => write!(formatter, "{change}"),
            Why::ReadsMore { name } => write!(formatter, "now reads `{name}`"),
            Why::ReadsLess { name } => write!(formatter, "no longer reads `{name}`"),
            Why::Fewer { fields } => write!(formatter, "{} removed", joined(fields)),
            Why::Reordered => write!(formatter, "order changed"),
            Why::Unfinished => write!(formatter, "not computed yet"),
            Why::Missing => write!(formatter, "file missing"),
            Why::Damaged => write!(formatter, "damaged file set aside"),
        }
    }
}

fn joined(parts: &[impl fmt::Display]) -> String {
    let words: Vec<String> = parts.iter().map(ToString::to_string).collect();
    words.join(", ")
}

impl fmt::Display for Field {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} = {}", self.field, self.value)
    }
}

impl fmt::Display for Change {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let or_none =
            |value: &Option<Shown>| value.as_ref().map_or("–".to_owned(), Shown::to_string);
        write!(formatter, "{} {} → {}", self.field, or_none(&self.old), or_none(&self.new))
    }
}

/// Maximum number of removed points with which a new point is compared, so that large grids are not
/// compared pairwise. The old version of an edited point is usually among the first of them.
const CANDIDATES: usize = 64;

/// Changes of a stage since the last run.
#[derive(Debug, Default)]
pub struct StageChanges {
    /// Changes that affect all tasks of the stage.
    pub to_all: Vec<Why>,
    /// Change of each present parameter point, in the order of the points.
    pub points: Vec<PointChange>,
    /// Points that no longer exist, and stages that are no longer read. They affect only tasks that
    /// pool several tables.
    pub removed: Vec<Why>,
    /// Names of the stages that this stage did not read before.
    pub reads_more: Vec<String>,
    /// True if the order of the points, or of the stages that this stage reads, has changed.
    pub is_reordered: bool,
}

/// Changes of a parameter point since the last run.
#[derive(Debug, Default)]
pub struct PointChange {
    /// Causes of the change; empty if the point existed before.
    pub why: Vec<Why>,
    /// True if the identity of the point is unchanged, so that later stages are not affected.
    pub keeps_identity: bool,
    /// Number of surfaces at this point in the last run, or `None` if the point is new or edited.
    pub realizations_before: Option<u32>,
}

impl StageChanges {
    /// Compares a stage (`now`) with its earlier version on record (`before`).
    pub fn between(before: Option<&StageRecord>, now: &StageRecord) -> StageChanges {
        let Some(before) = before else {
            return StageChanges {
                to_all: vec![Why::NewStage],
                points: now.points.iter().map(|_| PointChange::default()).collect(),
                ..StageChanges::default()
            };
        };
        let matches = matches(&before.points, &now.points);
        let is_taken: HashSet<usize> = matches.iter().flatten().map(|(old, _)| *old).collect();
        let (kept, gone): (Vec<_>, Vec<_>) =
            before.points.iter().enumerate().partition(|(old, _)| is_taken.contains(old));
        let (seen, kept) = (
            KnownValues::among(&before.points),
            KnownValues::among(kept.into_iter().map(|(_, point)| point)),
        );
        let stays = |name: &&String| now.reads.contains(name) && before.reads.contains(name);
        let unread = before.reads.iter().filter(|name| !stays(name));
        let less = unread.map(|name| Why::ReadsLess { name: name.clone() });
        let fewer = gone.iter().map(|(_, point)| Why::Fewer { fields: kept.coordinates(point) });
        let reads = |stage: &StageRecord| stage.reads.iter().filter(stays).cloned().collect();
        let [reads_before, reads_now]: [Vec<String>; 2] = [before, now].map(reads);
        let change = |(point, matched): (&PointRecord, Option<(usize, bool)>)| match matched {
            Some((old, true)) => PointChange {
                realizations_before: Some(before.points[old].realizations),
                ..PointChange::default()
            },
            Some((old, false)) => PointChange {
                why: causes(&before.points[old], point),
                keeps_identity: before.points[old].identity == point.identity,
                realizations_before: None,
            },
            None => PointChange {
                why: vec![Why::New { fields: seen.coordinates(point) }],
                ..PointChange::default()
            },
        };
        StageChanges {
            to_all: version_change(before, now).map(Why::Version).into_iter().collect(),
            removed: less.chain(fewer).collect(),
            is_reordered: reads_before != reads_now
                || !matches.iter().flatten().map(|(old, _)| old).is_sorted(),
            reads_more: now.reads.iter().filter(|name| !stays(name)).cloned().collect(),
            points: now.points.iter().zip(matches).map(change).collect(),
        }
    }
}

/// Returns, for each present point, the index of its earlier version among the points on record,
/// and whether the two are identical.
fn matches(before: &[PointRecord], now: &[PointRecord]) -> Vec<Option<(usize, bool)>> {
    let indices = before.iter().enumerate();
    let known: HashMap<_, usize> = indices.map(|(index, point)| (&point.fields, index)).collect();
    let same = now.iter().map(|point| Some((*known.get(&point.fields)?, true)));
    let mut matches: Vec<Option<(usize, bool)>> = same.collect();
    let taken: HashSet<usize> = matches.iter().flatten().map(|(old, _)| *old).collect();
    let mut left: Vec<usize> = (0..before.len()).filter(|old| !taken.contains(old)).collect();
    for (point, matched) in now.iter().zip(&mut matches).filter(|(_, matched)| matched.is_none()) {
        let candidates = left.iter().take(CANDIDATES).enumerate();
        let nearest = candidates.min_by_key(|(_, old)| changes(&before[**old], point).len());
        *matched = nearest.map(|(at, _)| at).map(|at| (left.remove(at), false));
    }
    matches
}

/// For each parameter, by name, the values that it has at the points of a set.
struct KnownValues<'a>(BTreeMap<&'a str, BTreeSet<&'a str>>);

impl<'a> KnownValues<'a> {
    fn among(points: impl IntoIterator<Item = &'a PointRecord>) -> KnownValues<'a> {
        let mut seen = BTreeMap::<_, BTreeSet<_>>::new();
        for (name, value) in points.into_iter().flat_map(|point| &point.fields) {
            seen.entry(name.as_str()).or_default().insert(value.as_str());
        }
        KnownValues(seen)
    }

    /// Returns the parameters of `point` with a value that no point of the set has. If there is no
    /// such parameter, returns all parameters that vary in the set.
    fn coordinates(&self, point: &PointRecord) -> Vec<Field> {
        let values = |name: &str| self.0.get(name);
        let is_unseen = |(name, value): &(&String, &String)| {
            values(name).is_none_or(|known| !known.contains(value.as_str()))
        };
        let varies =
            |(name, _): &(&String, &String)| values(name).is_some_and(|known| known.len() > 1);
        let unseen: Vec<_> = point.fields.iter().filter(is_unseen).collect();
        let distinguishing =
            if unseen.is_empty() { point.fields.iter().filter(varies).collect() } else { unseen };
        let field = |(name, value): (&String, &String)| Field {
            field: name.clone(),
            value: shown(point, name, value),
        };
        distinguishing.into_iter().map(field).collect()
    }
}

/// Returns the unit of a parameter of a point, if the manifest names one.
pub(super) fn unit_of(point: &PointRecord, name: &str) -> Option<String> {
    unit_of_parameter(name, |name| serde_json::from_str(point.fields.get(name)?).ok())
}

/// Formats the value of a parameter of a point, with its unit if the manifest names one.
fn shown(point: &PointRecord, name: &str, json: &str) -> Shown {
    let Shown(value) = Shown::from_json(json);
    match (unit_of(point, name), json.parse::<f64>()) {
        (Some(unit), Ok(number)) => Shown(quantity::written(number, Some(&unit))),
        (Some(unit), Err(_)) if json.starts_with('[') => Shown(format!("{value} {unit}")),
        _ => Shown(value),
    }
}

/// Returns the change of the version of a stage.
pub(super) fn version_change(before: &StageRecord, now: &StageRecord) -> Option<VersionChange> {
    let version = now.kind.definition().version;
    version.change(format!("`{}`", now.kind), before.version, now.version)
}

/// Returns the causes for which a point differs from its earlier version.
fn causes(before: &PointRecord, now: &PointRecord) -> Vec<Why> {
    let value = |point: &PointRecord, name: &str| {
        point.fields.get(name).and_then(|json| serde_json::from_str(json).ok())
    };
    let changed_versions = now.versions.iter().filter_map(|part| {
        let [before, now] = [before, now].map(|point| value(point, part.parameter));
        Some((part.parameter, part_version_change(part, before, now)?))
    });
    let mut versions: Vec<(&str, VersionChange)> = changed_versions.collect();
    let mut fields = changes(before, now);
    fields.retain(|change| versions.iter().all(|(parameter, _)| change.field != *parameter));
    if !fields.is_empty() {
        // The part is new if its version was absent: an edit has added it.
        versions.retain(|(parameter, _)| before.fields.contains_key(*parameter));
    }
    let edited = (!fields.is_empty()).then_some(Why::Changed { fields });
    edited.into_iter().chain(versions.into_iter().map(|(_, change)| Why::Version(change))).collect()
}

/// Returns the change of the version of a part of the numbers, given the values of its parameter,
/// or `None` if the values differ in more than the version.
pub(super) fn part_version_change(
    part: &PartVersion,
    before: Option<Value>,
    now: Option<Value>,
) -> Option<VersionChange> {
    let (old, rest_before) = version_and_rest(part.parameter, before)?;
    let (new, rest) = version_and_rest(part.parameter, now)?;
    (rest_before == rest).then(|| part.version.change(part.of.as_str(), old, new))?
}

/// Returns the version in the value of a parameter, and the value without it. Returns `None` if the
/// point has no such parameter.
///
/// Values without a version are those of version 1: `true` was the value of a part that is computed
/// or not, `gap` that of `gap_2`, and a parameter that is nothing but a version was absent.
fn version_and_rest(parameter: &str, value: Option<Value>) -> Option<(u32, Value)> {
    let number = |value: &Value| value.as_u64().and_then(|version| version.try_into().ok());
    match value {
        None => parameter.ends_with("version").then_some((1, Value::Null)),
        Some(Value::Bool(true)) => Some((1, Value::Null)),
        Some(Value::Object(mut object)) => {
            let version = object.remove("version");
            Some((version.as_ref().map_or(Some(1), number)?, Value::Object(object)))
        }
        Some(Value::String(text)) => match text.rsplit_once('_') {
            Some((word, version)) => Some((version.parse().ok()?, word.into())),
            None => Some((1, text.into())),
        },
        Some(value) => Some((number(&value)?, Value::Null)),
    }
}

/// Returns the parameters in which two points differ.
fn changes(before: &PointRecord, now: &PointRecord) -> Vec<Change> {
    let names: BTreeSet<&String> = before.fields.keys().chain(now.fields.keys()).collect();
    let value =
        |point: &PointRecord, name: &String| point.fields.get(name).map(|v| shown(point, name, v));
    let differs = |name: &&String| before.fields.get(*name) != now.fields.get(*name);
    let change = |name: &String| Change {
        field: name.clone(),
        old: value(before, name),
        new: value(now, name),
    };
    names.into_iter().filter(differs).map(change).collect()
}

#[cfg(test)]
mod tests {
    use asperity_stages::version::Version;

    use super::*;

    #[test]
    fn loads_and_lengths_are_told_with_their_unit() {
        let fields = [
            ("loads", "[1,2,3,4,5,6,7]"),
            ("load_unit", "\"absolute\""),
            ("pressure_unit", "\"MPa\""),
            ("effective_modulus", "210000"),
            ("side", "100.0"),
            ("unit", "\"µm\""),
            ("tolerance", "1e-5"),
        ];
        let point = point(&fields, Vec::new());
        let told = |name: &str| shown(&point, name, &point.fields[name]).0;
        assert_eq!(told("loads"), "7 values, 1 … 7 MPa");
        assert_eq!(told("effective_modulus"), "210000 MPa");
        assert_eq!(told("side"), "100 µm");
        assert_eq!(told("tolerance"), "1e-5");
    }

    fn point(fields: &[(&str, &str)], versions: Vec<PartVersion>) -> PointRecord {
        let owned = fields.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        PointRecord { fields: owned.collect(), realizations: 1, identity: String::new(), versions }
    }

    /// Formats the causes for which a point with this version of its part differs from `before`.
    fn told(parameter: &'static str, before: &[(&str, &str)], now: &[(&str, &str)]) -> Vec<String> {
        let version = Version::new(1, &["rounded", "corrected"]);
        let now = point(now, vec![PartVersion::new(parameter, "part", version)]);
        causes(&point(before, Vec::new()), &now).iter().map(Why::to_string).collect()
    }

    #[test]
    fn a_raised_version_of_a_part_is_told_with_its_reasons() {
        let free = |version: &str| format!(r#"{{"beyond":"free","version":{version}}}"#);
        let (old, new) = (free("2"), free("3"));
        let corrected = ["part version 3: corrected"];
        assert_eq!(told("boundary", &[("boundary", &old)], &[("boundary", &new)]), corrected);
        let both = ["part version 3: rounded; corrected"];
        assert_eq!(told("flow", &[("flow", "true")], &[("flow", "3")]), both);
        let corrected_and_rounded =
            told("control", &[("control", "\"gap\"")], &[("control", "\"gap_3\"")]);
        assert_eq!(corrected_and_rounded, both);
        let of = ("of", "\"autocorrelation\"");
        assert_eq!(told("version", &[of], &[of, ("version", "3")]), both);
    }

    #[test]
    fn an_edit_that_adds_a_part_is_no_new_version() {
        let changed = ["flow – → 3"];
        assert_eq!(told("flow", &[], &[("flow", "3")]), changed);
        let (old, new) = ([("hurst", "0.7")], [("hurst", "0.8"), ("tip_version", "3")]);
        assert_eq!(told("tip_version", &old, &new), ["hurst 0.7 → 0.8"]);
        let periodic = [("boundary", r#"{"beyond":"mirror","version":3}"#)];
        let free = [("boundary", r#"{"beyond":"free","version":3}"#)];
        let changed = r#"boundary beyond "mirror", version 3 → beyond "free", version 3"#;
        assert_eq!(told("boundary", &periodic, &free), [changed]);
    }

    #[test]
    fn values_are_told_in_a_few_words() {
        let shown = |json: &str| Shown::from_json(json).0;
        assert_eq!(shown("0.1"), "0.1");
        assert_eq!(shown("\"keep\""), "keep");
        assert_eq!(shown("[0.0,0.2]"), "0.0, 0.2");
        assert_eq!(shown("[1,2,3,4,5,6,7]"), "7 values, 1 … 7");
        assert_eq!(shown(r#"{"given":2.5}"#), "given 2.5");
        assert_eq!(shown(r#"[{"name":"none","coefficient":0.0}]"#), "none");
        assert_eq!(shown(r#"["mean",{"confidence":0.95},{"quantile":0.05}]"#), "mean, ci95, q05");
        assert_eq!(shown(&format!("\"{}\"", "x".repeat(99))).chars().count(), 61);
    }
}
