//! What can make a task run, and how it is told.

use std::fmt;

use serde::Serialize;
use serde_json::Value;

/// One thing that makes tasks run, and the stage where it happened.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cause {
    /// The position of the stage in the plan.
    pub stage: usize,
    /// What happened there.
    pub why: Why,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
pub enum Why {
    /// No run of the study is on record.
    FirstRun,
    /// The study had no such stage.
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
        /// Its version now.
        new: u32,
    },
    /// A stage is read that was not.
    ReadsMore {
        /// Its name.
        name: String,
    },
    /// A stage is no longer read.
    ReadsLess {
        /// Its name.
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
    /// The parameter.
    pub field: String,
    /// Its value.
    pub value: Shown,
}

/// A parameter and its values before and now; `None` where there was none.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct Change {
    /// The parameter.
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
