//! Declarations of columns. Each column has a name, a role, a type, a unit, a meaning and codes.
//!
//! The name, the role and the type decide how later stages use a column. The file of a task stores
//! them. The unit, the meaning and the codes are called wording. The wording is added when a table
//! is published or described, so it can be changed without changing any stored table.

use std::cmp::Ordering;
use std::fmt;
use std::sync::Arc;

use arrow::array::{
    Array, ArrayRef, AsArray, BooleanArray, Float64Array, Int64Array, LargeBinaryArray,
    LargeListArray, StringArray,
};
use arrow::buffer::{NullBuffer, OffsetBuffer};
use arrow::datatypes::{DataType, Field, FieldRef, Float64Type, Int64Type, Metadata, Schema};
use serde::{Deserialize, Serialize};

/// Declaration of a column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    pub name: &'static str,
    pub role: Role,
    pub kind: ColumnKind,
    /// Unit of the values; `1` for dimensionless numbers, empty for text and flags.
    pub unit: &'static str,
    /// Meaning of the values in one phrase.
    pub meaning: &'static str,
    /// Possible codes of a categorical column, with their meanings; empty for other columns.
    pub codes: &'static [Code],
}

/// Possible value of a categorical column, with its meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Code {
    #[serde(rename = "code")]
    pub word: &'static str,
    pub meaning: &'static str,
}

/// Role of a column in a study. Columns of the first four roles identify the rows, and later stages
/// copy these columns into their tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Parameter that is the same for all surfaces of a statistical ensemble.
    Parameter,
    /// Column that distinguishes the surfaces of an ensemble, such as the seed.
    Surface,
    /// Column that distinguishes the states of one surface, such as the load.
    Load,
    /// Value that follows from an identifying column, for example the same load in another unit.
    Derived,
    Result,
    /// Large result, such as a map, which stays in the store and is not published.
    Heavy,
}

/// Type of the values of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    Real,
    Integer,
    Flag,
    Text,
    Bytes,
    /// Lists of 64-bit floating-point numbers.
    Reals,
}

impl Column {
    /// Declares a column whose values are the same for all surfaces of an ensemble.
    pub const fn parameter(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        meaning: &'static str,
    ) -> Column {
        Column { name, role: Role::Parameter, kind, unit, meaning, codes: &[] }
    }

    /// Returns this column as a categorical column with the given possible codes.
    pub const fn with_codes(self, codes: &'static [Code]) -> Column {
        Column { codes, ..self }
    }

    pub const fn with_meaning(self, meaning: &'static str) -> Column {
        Column { meaning, ..self }
    }

    pub const fn with_role(self, role: Role) -> Column {
        Column { role, ..self }
    }

    /// Declares a column of computed values.
    pub const fn result(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        meaning: &'static str,
    ) -> Column {
        Column { name, role: Role::Result, kind, unit, meaning, codes: &[] }
    }

    /// Converts the declaration to an Arrow field, with role, unit, meaning and codes as metadata.
    pub fn field(&self) -> Field {
        let mut metadata = described(self.role, self.unit, self.meaning);
        if !self.codes.is_empty() {
            let codes = serde_json::to_string(self.codes).expect("codes are plain text");
            metadata = metadata.with(CODES, codes);
        }
        Field::new(self.name, self.kind.data_type(), true).with_metadata(metadata)
    }
}

/// Metadata key for the role of a column. Task files store only this entry and omit those in
/// [`WORDING`].
pub(crate) const ROLE: &str = "role";
pub(crate) const CODES: &str = "codes";
/// Metadata key for the declared unit of a column whose `unit` names those of the study:
/// `pressure` beside `MPa`.
pub(crate) const DIMENSION: &str = "dimension";
/// Metadata key for the name of the column whose reduced numbers a column repeats in the units of
/// the study. Only published tables have such columns.
pub const REDUCED: &str = "reduced";
/// Metadata keys of the unit, the meaning and the codes of a column. Task files omit these entries,
/// so that a change of wording does not change stored results.
pub(crate) const WORDING: [&str; 4] = ["unit", DIMENSION, "meaning", CODES];

/// Metadata key of a column that the table of a stage has and the tables of its tasks lack, such as
/// a label of a measured surface.
pub const ADDED: &str = "added";
/// Metadata key for the role of a column in the tables of the tasks, if it has another role in the
/// table of the stage.
const ROLE_OF_TASKS: &str = "role_of_tasks";

/// Returns the field of a column with another role.
pub fn with_role(field: Field, role: Role) -> Field {
    let metadata = field.metadata().clone();
    field.with_metadata(metadata.with(ROLE, role.name()))
}

/// Returns the field of a published column with another role than in the tables of the tasks.
pub fn with_published_role(field: Field, role: Role) -> Field {
    let Some(own) = Role::from_field(&field) else { return field };
    let metadata = field.metadata().clone().with(ROLE_OF_TASKS, own.name());
    with_role(field.with_metadata(metadata), role)
}

/// Returns the field of a column with its role in the tables of the tasks, which
/// [`with_published_role`] may have changed.
pub fn with_role_of_tasks(field: Field) -> Field {
    let mut metadata = field.metadata().clone();
    let Some(own) = metadata.get(ROLE_OF_TASKS).cloned() else { return field };
    metadata.retain(|entry, _| entry != ROLE_OF_TASKS);
    field.with_metadata(metadata.with(ROLE, own))
}

/// Returns the metadata of the Arrow field of a column with this role, unit and meaning.
pub fn described(role: Role, unit: &str, meaning: &str) -> Metadata {
    Metadata::new().with(ROLE, role.name()).with("unit", unit).with("meaning", meaning)
}

/// Returns the name of the column that repeats the reduced numbers of the column `name` in the
/// units of the study, or `name` if there is none.
pub fn absolute_column<'a>(schema: &'a Schema, name: &'a str) -> &'a str {
    let mut fields = schema.fields().iter();
    let repeats = |field: &&FieldRef| field.metadata().get(REDUCED).is_some_and(|of| of == name);
    fields.find(repeats).map_or(name, |field| field.name())
}

/// Description of a column for users of a table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Description {
    pub name: String,
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// `parameter`, `surface`, `load`, `derived`, `result` or `heavy`.
    pub role: String,
    /// Unit as it was declared: `pressure`, also where the field names the unit of the study.
    pub unit: String,
    /// Meaning of the values in one phrase.
    pub meaning: String,
    /// Possible codes of a categorical column, with their meanings; empty for other columns.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub codes: Vec<ExplainedCode>,
}

/// A [`Code`] that was read from the metadata of a field.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExplainedCode {
    pub code: String,
    pub meaning: String,
}

impl Description {
    /// Describes a column with the unit that the study has named, `MPa` in place of `pressure`.
    pub fn in_units(field: &Field) -> Description {
        let unit = field.metadata().get("unit").cloned().unwrap_or_default();
        Description { unit, ..Description::from(field) }
    }

    /// Returns the meaning, followed by the codes with their explanations.
    pub fn explained(&self) -> String {
        let codes: Vec<String> =
            self.codes.iter().map(|one| format!("`{}`: {}", one.code, one.meaning)).collect();
        match codes.as_slice() {
            [] => self.meaning.clone(),
            _ => format!("{}. {}", self.meaning, codes.join(". ")),
        }
    }
}

impl From<&Field> for Description {
    fn from(field: &Field) -> Description {
        let entry = |name: &str| field.metadata().get(name).cloned().unwrap_or_default();
        let dimension = field.metadata().get(DIMENSION).cloned();
        Description {
            name: field.name().clone(),
            kind: match field.data_type() {
                DataType::Float64 => "real",
                DataType::Int64 => "integer",
                DataType::Boolean => "flag",
                DataType::Utf8 => "text",
                DataType::LargeBinary => "bytes",
                _ => "reals",
            },
            role: entry("role"),
            unit: dimension.unwrap_or_else(|| entry("unit")),
            meaning: entry("meaning"),
            codes: serde_json::from_str(&entry(CODES)).unwrap_or_default(),
        }
    }
}

impl Role {
    const ALL: [Role; 6] =
        [Role::Parameter, Role::Surface, Role::Load, Role::Derived, Role::Result, Role::Heavy];

    /// Returns the name of the role in the metadata of a field.
    pub fn name(self) -> &'static str {
        match self {
            Role::Parameter => "parameter",
            Role::Surface => "surface",
            Role::Load => "load",
            Role::Derived => "derived",
            Role::Result => "result",
            Role::Heavy => "heavy",
        }
    }

    /// Reads the role from the metadata of a field. Returns `None` for columns of other programs.
    pub fn from_field(field: &Field) -> Option<Role> {
        let name = field.metadata().get(ROLE)?;
        Role::ALL.into_iter().find(|role| role.name() == name)
    }

    /// Returns whether columns of this role identify rows.
    pub fn is_coordinate(self) -> bool {
        matches!(self, Role::Parameter | Role::Surface | Role::Load | Role::Derived)
    }

    /// Returns whether a column of stacked tables gets this role, and not `other`, if it has this
    /// role in one table and `other` in another.
    ///
    /// `Surface` prevails over `Parameter`, and all other identifying roles prevail over `Derived`.
    pub(crate) fn prevails_over(self, other: Role) -> bool {
        match other {
            Role::Parameter => self == Role::Surface,
            Role::Derived => self != Role::Derived && self.is_coordinate(),
            _ => false,
        }
    }
}

/// Value of an identifying column in one row.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Value {
    Real(f64),
    Integer(i64),
    Text(String),
}

impl Value {
    /// Returns the number, or `None` for a text.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Real(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            Value::Text(_) => None,
        }
    }

    /// Returns a column with this value in each of `rows` rows.
    pub fn repeated(&self, rows: usize) -> ArrayRef {
        match self {
            Value::Real(value) => reals(std::iter::repeat_n(*value, rows)),
            Value::Integer(value) => integers(std::iter::repeat_n(*value, rows)),
            Value::Text(value) => texts(std::iter::repeat_n(value, rows)),
        }
    }

    /// Reads the value of a row. Returns `None` if the value is null, or if no coordinate has the
    /// type of the array.
    pub fn from_array(array: &dyn Array, row: usize) -> Option<Value> {
        if array.is_null(row) {
            return None;
        }
        let real = array.as_primitive_opt::<Float64Type>();
        let integer = || array.as_primitive_opt::<Int64Type>();
        let text = || array.as_string_opt::<i32>();
        real.map(|values| Value::Real(values.value(row)))
            .or_else(|| integer().map(|values| Value::Integer(values.value(row))))
            .or_else(|| text().map(|values| Value::Text(values.value(row).to_owned())))
    }
}

impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Real(value) => write!(formatter, "{value}"),
            Value::Integer(value) => write!(formatter, "{value}"),
            Value::Text(value) => write!(formatter, "{value}"),
        }
    }
}

/// Total order: integers, then real numbers, then texts, each in ascending order.
impl Ord for Value {
    fn cmp(&self, other: &Value) -> Ordering {
        match (self, other) {
            (Value::Integer(one), Value::Integer(other)) => one.cmp(other),
            (Value::Real(one), Value::Real(other)) => one.total_cmp(other),
            (Value::Text(one), Value::Text(other)) => one.cmp(other),
            (Value::Integer(_), _) | (Value::Real(_), Value::Text(_)) => Ordering::Less,
            _ => Ordering::Greater,
        }
    }
}

impl PartialOrd for Value {
    fn partial_cmp(&self, other: &Value) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Value {
    fn eq(&self, other: &Value) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Value {}

impl ColumnKind {
    pub const ALL: [ColumnKind; 6] = [
        ColumnKind::Real,
        ColumnKind::Integer,
        ColumnKind::Flag,
        ColumnKind::Text,
        ColumnKind::Bytes,
        ColumnKind::Reals,
    ];

    /// Returns whether `found` is the Arrow type of some kind of column.
    pub fn holds(found: &DataType) -> bool {
        let is_found = |kind: ColumnKind| kind.data_type() == *found;
        ColumnKind::ALL.into_iter().any(is_found)
    }

    pub fn data_type(self) -> DataType {
        match self {
            ColumnKind::Real => DataType::Float64,
            ColumnKind::Integer => DataType::Int64,
            ColumnKind::Flag => DataType::Boolean,
            ColumnKind::Text => DataType::Utf8,
            ColumnKind::Bytes => DataType::LargeBinary,
            ColumnKind::Reals => DataType::LargeList(element()),
        }
    }
}

pub fn reals(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}

/// Returns a column of real numbers in which missing values are null.
pub fn optional_reals(values: impl IntoIterator<Item = Option<f64>>) -> ArrayRef {
    Arc::new(Float64Array::from_iter(values))
}

pub fn integers(values: impl IntoIterator<Item = i64>) -> ArrayRef {
    Arc::new(Int64Array::from_iter_values(values))
}

/// Returns a column of integers in which missing values are null.
pub fn optional_integers(values: impl IntoIterator<Item = Option<i64>>) -> ArrayRef {
    Arc::new(Int64Array::from_iter(values))
}

pub fn flags(values: impl IntoIterator<Item = bool>) -> ArrayRef {
    Arc::new(BooleanArray::from_iter(values.into_iter().map(Some)))
}

/// Returns a column of flags in which missing values are null.
pub fn optional_flags(values: impl IntoIterator<Item = Option<bool>>) -> ArrayRef {
    Arc::new(BooleanArray::from_iter(values))
}

pub fn texts<T: AsRef<str>>(values: impl IntoIterator<Item = T>) -> ArrayRef {
    Arc::new(StringArray::from_iter_values(values))
}

/// Returns a column of text in which missing values are null.
pub fn optional_texts(values: impl IntoIterator<Item = Option<String>>) -> ArrayRef {
    Arc::new(StringArray::from_iter(values))
}

pub fn bytes<T: AsRef<[u8]>>(values: impl IntoIterator<Item = T>) -> ArrayRef {
    Arc::new(LargeBinaryArray::from_iter_values(values))
}

/// Returns a column of lists. `values` has the elements of all lists in sequence, and `lengths` the
/// number of elements of each.
pub fn lists(values: Float64Array, lengths: impl IntoIterator<Item = usize>) -> ArrayRef {
    let offsets = OffsetBuffer::from_lengths(lengths);
    Arc::new(LargeListArray::new(element(), offsets, Arc::new(values), None))
}

/// Returns a column with one list, or with null.
pub fn optional_list(values: Option<&[f64]>) -> ArrayRef {
    let list = values.unwrap_or_default();
    let offsets = OffsetBuffer::from_lengths([list.len()]);
    let items = Arc::new(Float64Array::from(list.to_vec()));
    let is_known = NullBuffer::from_iter([values.is_some()]);
    Arc::new(LargeListArray::new(element(), offsets, items, Some(is_known)))
}

fn element() -> Arc<Field> {
    Arc::new(Field::new("element", DataType::Float64, true))
}
