//! What a manifest says about measured surfaces beside how they are read: labels, such as the
//! specimen, and whether the surfaces are samples of one ensemble.
//!
//! Nothing of this is part of a recipe, so that a label can be changed without computing a surface
//! or a contact again. The tables of the tasks of single surfaces therefore lack it.
//! [`SurfaceLabels`] adds it by the name of the surface, when such a table is published and when a
//! task reads the tables of several surfaces. The keys of such tasks cover the labels that they
//! read.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;

use arrow::array::{Array, ArrayRef, StringArray};
use arrow::datatypes::{Field, Schema};
use serde::Serialize;

use super::{Origin, Params};
use crate::columns::*;
use crate::surface_files::SurfaceFiles;
use asperity_tables::column::{
    ADDED, Column, ColumnKind, Role, Value, optional_integers, optional_reals, optional_texts,
    with_published_role, with_role, with_role_of_tasks,
};
use asperity_tables::parallel::locked;
use asperity_tables::table::Table;

/// Path of a measured surface. Only published tables have the column, and queries that name it,
/// because the same file can be moved.
pub const PATH: Column = Column::result(
    "path",
    ColumnKind::Text,
    "",
    "file of the measured surface, as the manifest names it",
);

/// Labels of a measured surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Labels {
    /// Value of each label, by name.
    pub values: BTreeMap<String, Value>,
    /// True if the surface is a sample of an ensemble: surfaces that differ only in their file and
    /// in the region of the map are then one parameter point.
    pub is_sample: bool,
}

/// Columns that tell the samples of an ensemble apart: the map that is read, and what follows from
/// it.
const OF_SAMPLES: [Column; 16] = [
    NODES,
    SIDE,
    NODES_X,
    NODES_Y,
    SIDE_X,
    SIDE_Y,
    RMS_SLOPE,
    CONTENT,
    HEIGHT_SCALE,
    CHANNEL,
    MISSING,
    MASK,
    CROP_FROM_X,
    CROP_FROM_Y,
    CROP_SIZE_X,
    CROP_SIZE_Y,
];

/// Returns the column of a label. A label with the name of a parameter of random surfaces, such as
/// `hurst`, has the column of this parameter.
pub fn column(name: &str, kind: ColumnKind) -> Column {
    let known = parameter_of_random_surfaces(name);
    known.unwrap_or_else(|| Column::parameter(interned(name), kind, "", "label of the surface"))
}

/// Returns the parameter of random surfaces that has this name.
pub fn parameter_of_random_surfaces(name: &str) -> Option<Column> {
    let mut columns = RANDOM_SURFACE_COORDINATES.into_iter();
    columns.find(|column| column.role == Role::Parameter && column.name == name)
}

/// Returns the name as text that lives as long as the program, as the names of all columns do. A
/// name is kept only once, and a study has few labels.
fn interned(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeMap<String, &'static str>> = Mutex::new(BTreeMap::new());
    let mut names = locked(&NAMES);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = name.to_owned().leak();
    names.insert(name.to_owned(), kept);
    kept
}

fn is_of_samples(name: &str) -> bool {
    OF_SAMPLES.iter().any(|column| column.name == name)
}

impl Labels {
    /// Returns whether the manifest says nothing about the surface.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty() && !self.is_sample
    }

    /// Returns the columns of the labels with their values.
    pub fn cells(&self) -> impl Iterator<Item = (Column, Value)> {
        self.values.iter().map(|(name, value)| {
            let kind = match value {
                Value::Real(_) => ColumnKind::Real,
                Value::Integer(_) => ColumnKind::Integer,
                Value::Text(_) => ColumnKind::Text,
            };
            (column(name, kind), value.clone())
        })
    }

    /// Returns the coordinates of a surface with its labels, and with the roles of those of a
    /// sample.
    pub fn added_to(&self, mut coordinates: Vec<(Column, Value)>) -> Vec<(Column, Value)> {
        coordinates.extend(self.cells());
        if self.is_sample {
            let own = coordinates.iter_mut().map(|(column, _)| column);
            own.filter(|column| is_of_samples(column.name))
                .for_each(|column| *column = column.with_role(Role::Surface));
        }
        coordinates
    }
}

/// Returns a table of samples with the roles of their columns.
pub fn of_samples(table: &Table) -> Table {
    table.with_fields(|field| as_sample(field, with_role))
}

/// Changes the role of a field that tells samples apart by `change`.
fn as_sample(field: Field, change: fn(Field, Role) -> Field) -> Field {
    let is_parameter = Role::from_field(&field) == Some(Role::Parameter);
    if is_parameter && is_of_samples(field.name()) { change(field, Role::Surface) } else { field }
}

/// Labels of the surfaces of a study, by the names of the surfaces.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SurfaceLabels(BTreeMap<String, Labels>);

impl SurfaceLabels {
    /// Collects the labels of the measured surfaces among these.
    pub fn new<'a>(surfaces: impl IntoIterator<Item = &'a Params>) -> SurfaceLabels {
        let measured =
            surfaces.into_iter().filter(|params| matches!(params.origin, Origin::File(_)));
        let labelled = measured.filter_map(|params| {
            Some((params.surface_key().to_string(), params.origin.labels()?.clone()))
        });
        SurfaceLabels(labelled.collect())
    }

    /// Returns whether no surface has labels.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns a table of a task with the labels of the surfaces in its rows.
    pub fn added_to(&self, table: Table) -> Table {
        let Some(rows) = self.of_rows(&table) else { return table };
        let mut columns: BTreeMap<&str, Column> = BTreeMap::new();
        for labels in rows.iter().flatten() {
            let is_new = |name: &String| !columns.contains_key(name.as_str());
            if labels.values.keys().any(is_new) {
                columns.extend(labels.cells().map(|(column, _)| (column.name, column)));
            }
        }
        let fields = columns.values().map(Column::field).collect();
        let labelled = with_columns(&table, &rows, fields);
        let is_sampled = rows.iter().flatten().any(|labels| labels.is_sample);
        if is_sampled { of_samples(&labelled) } else { labelled }
    }

    /// Returns the rows of a published table with the labels of their surfaces. The columns and
    /// roles are those of `description`, so that all parts of a table have the same ones.
    pub fn published(&self, table: Table, description: &Table) -> Table {
        if self.is_empty() || !table.has(SURFACE.name) {
            return table;
        }
        let rows = self.of_rows(&table).unwrap_or_else(|| vec![None; table.rows()]);
        let schema = description.batch().schema();
        let names: BTreeSet<&String> =
            self.0.values().flat_map(|labels| labels.values.keys()).collect();
        let fields = names.into_iter().filter_map(|name| {
            let field = schema.field_with_name(name).ok()?.clone();
            let metadata = field.metadata().clone().with(ADDED, "label");
            Some(field.with_metadata(metadata))
        });
        let labelled = with_columns(&table, &rows, fields.collect());
        labelled.with_fields(|field| {
            let described = schema.field_with_name(field.name()).ok().and_then(Role::from_field);
            let is_changed = described == Some(Role::Surface);
            if is_changed { as_sample(field, with_published_role) } else { field }
        })
    }

    /// Returns the labels of the surface in each row, or `None` if no row has any.
    fn of_rows(&self, table: &Table) -> Option<Vec<Option<&Labels>>> {
        if self.is_empty() {
            return None;
        }
        // Pairs and surfaces that have yielded have the labels of the surface before.
        let columns: Vec<&StringArray> = [SURFACE, FROM_SURFACE, ORIGINAL_SURFACE]
            .into_iter()
            .filter_map(|column| table.texts(column.name).ok())
            .collect();
        let of_row = |row: usize| {
            let mut known = columns.iter().filter(|names| names.is_valid(row));
            known.find_map(|names| self.0.get(names.value(row)))
        };
        let rows: Vec<Option<&Labels>> = (0..table.rows()).map(of_row).collect();
        rows.iter().any(Option::is_some).then_some(rows)
    }
}

/// Inserts columns of labels after the coordinates of a table, except those that it has.
fn with_columns(table: &Table, rows: &[Option<&Labels>], labels: Vec<Field>) -> Table {
    let schema = table.batch().schema();
    let is_coordinate = |field: &Field| Role::from_field(field).is_some_and(Role::is_coordinate);
    let known = schema.fields().iter();
    let after = known.clone().rposition(|field| is_coordinate(field)).map_or(0, |last| last + 1);
    let mut fields: Vec<Field> = known.map(|field| field.as_ref().clone()).collect();
    let mut arrays: Vec<ArrayRef> = table.batch().columns().to_vec();
    let new = labels.into_iter().filter(|field| !table.has(field.name()));
    for (index, field) in new.enumerate() {
        arrays.insert(after + index, values(rows, &field));
        fields.insert(after + index, field);
    }
    Table::from_arrays(table.rows(), Schema::new(fields), arrays)
}

/// Returns the values of a label in the rows of a table.
fn values(rows: &[Option<&Labels>], field: &Field) -> ArrayRef {
    let of_rows = || rows.iter().map(|labels| labels.and_then(|all| all.values.get(field.name())));
    if *field.data_type() == ColumnKind::Real.data_type() {
        return optional_reals(of_rows().map(|value| value?.number()));
    }
    if *field.data_type() == ColumnKind::Integer.data_type() {
        return optional_integers(of_rows().map(|value| match value? {
            Value::Integer(number) => Some(*number),
            Value::Real(_) | Value::Text(_) => None,
        }));
    }
    optional_texts(of_rows().map(|value| value.map(ToString::to_string)))
}

/// Returns a published table without the columns and roles that [`SurfaceLabels::published`] adds.
pub fn without_labels(table: &Table) -> Table {
    let schema = table.batch().schema();
    let added = schema.fields().iter().filter(|field| field.metadata().contains_key(ADDED));
    let names: Vec<&str> = added.map(|field| field.name().as_str()).collect();
    let own = if names.is_empty() { table.clone() } else { table.without(&names) };
    own.with_fields(with_role_of_tasks)
}

/// Returns a table with the column of the paths of measured surfaces, if it has such surfaces.
pub fn with_paths(table: Table, sources: &SurfaceFiles) -> Table {
    let Ok(contents) = table.texts(CONTENT.name) else {
        return table;
    };
    if table.has(PATH.name) {
        return table;
    }
    let path = |content: Option<&str>| {
        let path = sources.path_of_hex(content?);
        Some(path.map_or_else(String::new, |path| path.display().to_string()))
    };
    let paths = optional_texts(contents.iter().map(path));
    table.with(vec![(PATH, paths)])
}
