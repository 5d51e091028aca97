//! What can make a task run and how it is told, and what an edit did to one stage: its points now
//! against those on record.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Serialize;
use serde_json::Value;

use crate::plan::reasons::record::{PointRecord, StageRecord};

/// One thing that makes tasks run, and the stage where it happened.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cause {
    /// The position of the stage in the plan.
    pub stage: usize,
    pub why: Why,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
pub enum Why {
    /// No run of the study is on record.
    FirstRun,
    NewStage,
    /// A point of the grid or a realization was not there before: the coordinates that say which.
    New {
        /// As few as tell it from all before.
        fields: Vec<Field>,
    },
    /// Parameters have other values.
    Changed {
        /// Which ones.
        fields: Vec<Change>,
    },
    /// The program computes other numbers now.
    Version {
        /// The version of the stage on record.
        old: u32,
        new: u32,
    },
    /// A stage is read that was not.
    ReadsMore {
        name: String,
    },
    /// A stage is no longer read.
    ReadsLess {
        name: String,
    },
    /// What was pooled before is no longer there.
    Fewer {
        /// The coordinates of what is left out.
        fields: Vec<Field>,
    },
    /// What is pooled comes in another order.
    Reordered,
    /// It was planned before, and the run did not come to its end.
    Unfinished,
    /// All tasks of the stage were finished, and the file of this one is gone.
    Missing,
    /// Its file was damaged and is in quarantine.
    Damaged,
}

/// A coordinate and its value.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct Field {
    pub field: String,
    pub value: Shown,
}

/// A parameter and its values before and now; `None` where there was none.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct Change {
    pub field: String,
    /// On record.
    pub old: Option<Shown>,
    /// In the manifest.
    pub new: Option<Shown>,
}

/// A value, short enough for a line.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(transparent)]
pub struct Shown(pub String);

impl Shown {
    /// Letters of a value that is neither a list nor a number.
    const LONGEST: usize = 60;

    /// A parameter's value, written as JSON.
    pub fn of(json: &str) -> Shown {
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
            None => {
                let parts = object
                    .iter()
                    .map(|(name, value)| format!("{name} {}", cut(&value.to_string())));
                parts.collect::<Vec<_>>().join(", ")
            }
        },
        // The text as it stands: reading a number may round its last digit.
        _ => cut(json),
    }
}

/// A short list whole, of a long one its ends.
fn listed(list: &[Value]) -> String {
    const SHORT: usize = 6;
    let items = |list: &[Value]| -> Vec<String> {
        let item = |item: &Value| short(item, &item.to_string());
        list.iter().map(item).collect()
    };
    match list {
        [first, .., last] if list.len() > SHORT => {
            let [first, last] = [first, last].map(rounded);
            format!("{} values, {first} … {last}", list.len())
        }
        _ => items(list).join(", "),
    }
}

/// Enough digits to recognise a load.
fn rounded(value: &Value) -> String {
    match value.as_f64() {
        Some(number) => format!("{:.4e}", number)
            .parse::<f64>()
            .map_or_else(|_| value.to_string(), |number| number.to_string()),
        None => cut(&value.to_string()),
    }
}

fn cut(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(Shown::LONGEST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl fmt::Display for Why {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Why::FirstRun => write!(formatter, "first run"),
            Why::NewStage => write!(formatter, "new stage"),
            Why::New { fields } => write!(formatter, "new {}", joined(fields)),
            Why::Changed { fields } => write!(formatter, "{}", joined(fields)),
            Why::Version { old, new } => write!(formatter, "stage version {old} → {new}"),
            Why::ReadsMore { name } => write!(formatter, "now reads `{name}`"),
            Why::ReadsLess { name } => write!(formatter, "no longer reads `{name}`"),
            Why::Fewer { fields } => write!(formatter, "without {}", joined(fields)),
            Why::Reordered => write!(formatter, "other order"),
            Why::Unfinished => write!(formatter, "not computed yet"),
            Why::Missing => write!(formatter, "file missing"),
            Why::Damaged => write!(formatter, "file damaged and set aside"),
        }
    }
}

fn joined(parts: &[impl fmt::Display]) -> String {
    let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
    parts.join(", ")
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

/// Points that left are offered to so many that came: one that was edited finds itself among the
/// nearest, and a grid of thousands is not compared with thousands.
const CANDIDATES: usize = 64;

/// What happened to a stage.
#[derive(Debug, Default)]
pub struct StageChanges {
    /// To all its tasks.
    pub to_all: Vec<Why>,
    /// To each point, in order.
    pub points: Vec<PointChange>,
    /// Points that nobody took the place of, and stages that are no longer read: only who pools
    /// them notices.
    pub gone: Vec<Why>,
    /// Stages that it did not read before.
    pub reads_more: Vec<String>,
    /// Whether points, or stages that it reads, changed places.
    pub is_reordered: bool,
}

/// What happened to a point.
#[derive(Debug, Default)]
pub struct PointChange {
    /// None if it was there before.
    pub why: Option<Why>,
    /// Whether its identity is what it was, so that later stages do not see that.
    pub keeps_identity: bool,
    /// Surfaces on record, if it was there before: more of them are new, and fewer are missed by
    /// who pools them.
    pub realizations_before: Option<u32>,
}

impl StageChanges {
    /// Compares a stage with what was in its place.
    pub fn between(before: Option<&StageRecord>, now: &StageRecord) -> StageChanges {
        let Some(before) = before else {
            return StageChanges {
                to_all: vec![Why::NewStage],
                points: now.points.iter().map(|_| PointChange::default()).collect(),
                ..StageChanges::default()
            };
        };
        let (old, new) = (before.version, now.version);
        let matched = Matched::of(&before.points, &now.points);
        let stays = |name: &&String| now.reads.contains(name) && before.reads.contains(name);
        let less = before.reads.iter().filter(|name| !stays(name));
        let less = less.map(|name| Why::ReadsLess { name: name.clone() });
        let more = now.reads.iter().filter(|name| !stays(name));
        let kept_reads = [before, now].map(|stage| stage.reads.iter().filter(stays));
        let [reads_before, reads_now] = kept_reads;
        StageChanges {
            to_all: Vec::from_iter((old != new).then_some(Why::Version { old, new })),
            gone: less.chain(matched.gone(&before.points)).collect(),
            is_reordered: !matched.is_in_order() || !reads_before.eq(reads_now),
            reads_more: more.cloned().collect(),
            points: matched.points(&before.points, &now.points),
        }
    }
}

/// Which point on record each point is, or has come from.
struct Matched {
    same: Vec<Option<usize>>,
    edited: Vec<Option<usize>>,
    is_taken: Vec<bool>,
}

impl Matched {
    fn of(before: &[PointRecord], now: &[PointRecord]) -> Matched {
        let known = before.iter().enumerate();
        let known: BTreeMap<_, _> = known.map(|(index, point)| (&point.fields, index)).collect();
        let same: Vec<Option<usize>> =
            now.iter().map(|point| known.get(&point.fields).copied()).collect();
        let mut is_taken = vec![false; before.len()];
        same.iter().flatten().for_each(|&index| is_taken[index] = true);
        let mut edited = vec![None; now.len()];
        let mut left: Vec<usize> = (0..before.len()).filter(|&old| !is_taken[old]).collect();
        for new in (0..now.len()).filter(|&new| same[new].is_none()) {
            let distance = |old: usize| changes(&before[old], &now[new]).len();
            let candidates = left.iter().take(CANDIDATES).enumerate();
            let nearest = candidates.min_by_key(|&(_, &old)| distance(old));
            if let Some((position, &old)) = nearest {
                left.remove(position);
                edited[new] = Some(old);
                is_taken[old] = true;
            }
        }
        Matched { same, edited, is_taken }
    }

    fn points(&self, before: &[PointRecord], now: &[PointRecord]) -> Vec<PointChange> {
        let seen = Seen::among(before);
        let point =
            |(index, point): (usize, &PointRecord)| match (self.same[index], self.edited[index]) {
                (Some(old), _) => PointChange {
                    realizations_before: Some(before[old].realizations),
                    ..PointChange::default()
                },
                (None, Some(old)) => PointChange {
                    why: Some(Why::Changed { fields: changes(&before[old], point) }),
                    keeps_identity: before[old].identity == point.identity,
                    realizations_before: None,
                },
                (None, None) => PointChange {
                    why: Some(Why::New { fields: seen.coordinates(point) }),
                    ..PointChange::default()
                },
            };
        now.iter().enumerate().map(point).collect()
    }

    fn gone(&self, before: &[PointRecord]) -> Vec<Why> {
        let stays = || (0..before.len()).filter(|&old| self.is_taken[old]);
        let seen = Seen::among(stays().map(|old| &before[old]));
        let left = (0..before.len()).filter(|&old| !self.is_taken[old]);
        let mut gone: Vec<Why> = Vec::new();
        for old in left {
            let why = Why::Fewer { fields: seen.coordinates(&before[old]) };
            if gone.last() != Some(&why) {
                gone.push(why);
            }
        }
        gone
    }

    fn is_in_order(&self) -> bool {
        let places = self.same.iter().zip(&self.edited);
        places.filter_map(|(same, edited)| same.or(*edited)).is_sorted()
    }
}

/// Values that parameters take among some points.
struct Seen<'a>(BTreeMap<&'a str, BTreeSet<&'a str>>);

impl<'a> Seen<'a> {
    fn among(points: impl IntoIterator<Item = &'a PointRecord>) -> Seen<'a> {
        let mut seen = BTreeMap::<_, BTreeSet<_>>::new();
        for (name, value) in points.into_iter().flat_map(|point| &point.fields) {
            seen.entry(name.as_str()).or_default().insert(value.as_str());
        }
        Seen(seen)
    }

    /// What tells a point from these: values that none of them has, or else all that vary.
    fn coordinates(&self, point: &PointRecord) -> Vec<Field> {
        let values = |name: &str| self.0.get(name);
        let is_unseen = |(name, value): &(&String, &String)| {
            values(name).is_none_or(|known| !known.contains(value.as_str()))
        };
        let varies =
            |(name, _): &(&String, &String)| values(name).is_some_and(|known| known.len() > 1);
        let unseen: Vec<_> = point.fields.iter().filter(is_unseen).collect();
        let told =
            if unseen.is_empty() { point.fields.iter().filter(varies).collect() } else { unseen };
        let field = |(name, value): (&String, &String)| Field {
            field: name.clone(),
            value: Shown::of(value),
        };
        told.into_iter().map(field).collect()
    }
}

/// The parameters in which two points differ.
fn changes(before: &PointRecord, now: &PointRecord) -> Vec<Change> {
    let names: BTreeSet<&String> = before.fields.keys().chain(now.fields.keys()).collect();
    let value = |point: &PointRecord, name: &String| point.fields.get(name).map(|v| Shown::of(v));
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

    use super::*;

    #[test]
    fn values_are_told_in_a_few_words() {
        let told = |json: &str| Shown::of(json).0;
        assert_eq!(told("0.1"), "0.1");
        assert_eq!(told("\"keep\""), "keep");
        assert_eq!(told("[0.0,0.2]"), "0.0, 0.2");
        assert_eq!(told("[1,2,3,4,5,6,7]"), "7 values, 1 … 7");
        assert_eq!(told(r#"{"given":2.5}"#), "given 2.5");
        assert_eq!(told(r#"[{"name":"none","coefficient":0.0}]"#), "none");
        assert_eq!(told(&format!("\"{}\"", "x".repeat(99))).chars().count(), 61);
    }
}
