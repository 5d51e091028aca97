//! What a column holds: name, role, type, unit and meaning, said once and carried into every file.

use std::sync::Arc;

use arrow::array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, LargeBinaryArray, LargeListArray, StringArray,
};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Metadata};
use serde::Serialize;

/// What a column holds, said once and carried into every file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Its name, in whole words.
    pub name: &'static str,
    /// What it is for.
    pub role: Role,
    /// The type of its values.
    pub kind: ColumnKind,
    /// Unit of its values; `1` for pure numbers, empty where units make no sense.
    pub unit: &'static str,
    /// One phrase that says what it means.
    pub meaning: &'static str,
}

/// What a column is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It says where in the study a row belongs, and goes on into later stages.
    Coordinate,
    /// It was computed.
    Result,
    /// It was computed and fills disks: it stays in the store.
    Heavy,
}

/// The type of a column's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// 64-bit floating point.
    Real,
    /// 64-bit integer.
    Integer,
    /// True or false.
    Flag,
    /// UTF-8.
    Text,
    /// Bytes.
    Bytes,
    /// Lists of 64-bit floating-point numbers.
    Reals,
}

impl Column {
    /// A column whose values place a row in the study.
    pub const fn coordinate(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        meaning: &'static str,
    ) -> Column {
        Column {
            name,
            role: Role::Coordinate,
            kind,
            unit,
            meaning,
        }
    }

    /// A computed column.
    pub const fn result(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        meaning: &'static str,
    ) -> Column {
        Column {
            name,
            role: Role::Result,
            kind,
            unit,
            meaning,
        }
    }

    /// A computed column that stays in the store.
    pub const fn heavy(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        meaning: &'static str,
    ) -> Column {
        Column {
            name,
            role: Role::Heavy,
            kind,
            unit,
            meaning,
        }
    }

    /// The column as Arrow knows it; role, unit and meaning are its metadata.
    pub fn field(&self) -> Field {
        let metadata = described(self.role, self.unit, self.meaning);
        Field::new(self.name, self.kind.data_type(), true).with_metadata(metadata)
    }
}

/// What a column is for, its unit and its meaning, as files carry them.
pub fn described(role: Role, unit: &str, meaning: &str) -> Metadata {
    Metadata::new()
        .with("role", role.name())
        .with("unit", unit)
        .with("meaning", meaning)
}

/// What a file says of a column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Description {
    /// Its name.
    pub name: String,
    /// The type of its values.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// `coordinate`, `result` or `heavy`.
    pub role: String,
    /// Unit of its values.
    pub unit: String,
    /// One phrase that says what it means.
    pub meaning: String,
}

impl From<&Field> for Description {
    fn from(field: &Field) -> Description {
        let entry = |name: &str| field.metadata().get(name).cloned().unwrap_or_default();
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
            unit: entry("unit"),
            meaning: entry("meaning"),
        }
    }
}

impl Role {
    /// The word in a field's metadata.
    pub fn name(self) -> &'static str {
        match self {
            Role::Coordinate => "coordinate",
            Role::Result => "result",
            Role::Heavy => "heavy",
        }
    }
}

impl ColumnKind {
    /// Every kind.
    pub const ALL: [ColumnKind; 6] = [
        ColumnKind::Real,
        ColumnKind::Integer,
        ColumnKind::Flag,
        ColumnKind::Text,
        ColumnKind::Bytes,
        ColumnKind::Reals,
    ];

    /// Whether columns of our tables may be of this type.
    pub fn holds(found: &DataType) -> bool {
        let is_found = |kind: ColumnKind| kind.data_type() == *found;
        ColumnKind::ALL.into_iter().any(is_found)
    }

    /// Its type in Arrow.
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

/// A column of real numbers.
pub fn reals(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}

/// A column of real numbers, some of them not known.
pub fn optional_reals(values: impl IntoIterator<Item = Option<f64>>) -> ArrayRef {
    Arc::new(Float64Array::from_iter(values))
}

/// A column of integers.
pub fn integers(values: impl IntoIterator<Item = i64>) -> ArrayRef {
    Arc::new(Int64Array::from_iter_values(values))
}

/// A column of truth values.
pub fn flags(values: impl IntoIterator<Item = bool>) -> ArrayRef {
    Arc::new(BooleanArray::from_iter(values.into_iter().map(Some)))
}

/// A column of truth values, some of them not known.
pub fn optional_flags(values: impl IntoIterator<Item = Option<bool>>) -> ArrayRef {
    Arc::new(BooleanArray::from_iter(values))
}

/// A column of text.
pub fn texts<T: AsRef<str>>(values: impl IntoIterator<Item = T>) -> ArrayRef {
    Arc::new(StringArray::from_iter_values(values))
}

/// A column of bytes.
pub fn bytes<T: AsRef<[u8]>>(values: impl IntoIterator<Item = T>) -> ArrayRef {
    Arc::new(LargeBinaryArray::from_iter_values(values))
}

/// A column of lists: all values end to end, and how many belong to each row.
pub fn lists(values: Float64Array, lengths: impl IntoIterator<Item = usize>) -> ArrayRef {
    let offsets = OffsetBuffer::from_lengths(lengths);
    Arc::new(LargeListArray::new(
        element(),
        offsets,
        Arc::new(values),
        None,
    ))
}

fn element() -> Arc<Field> {
    Arc::new(Field::new("element", DataType::Float64, true))
}
