//! Tables as polars asks for them: the columns that a query needs, and no others.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use polars::prelude::{
    AnonymousScan, AnonymousScanArgs, DataFrame, LazyFrame, PolarsError, PolarsResult,
    ScanArgsAnonymous, SchemaRef,
};

use super::super::frame;
use crate::StageError;
use asperity_tables::column::Value;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;

/// A table that a query may read.
///
/// # Errors
/// When two of its columns have one name.
pub fn lazy(table: TableSource, damage: &Damage) -> Result<LazyFrame, StageError> {
    let none = table.first(&places(&table, None), 0);
    let schema = frame::of(&none.map_err(StageError::Store)?)?.schema().clone();
    let arguments = ScanArgsAnonymous {
        schema: Some(schema.clone()),
        name: "table of a stage",
        ..ScanArgsAnonymous::default()
    };
    let scan = Scan { table, schema, damage: damage.clone() };
    LazyFrame::anonymous_scan(Arc::new(scan), arguments).map_err(frame::polars_error)
}

/// Why a table could not be read: polars hands on words alone.
#[derive(Clone, Default)]
pub struct Damage(Arc<Mutex<Option<StoreError>>>);

impl Damage {
    /// What was wrong, if anything was.
    pub fn take(&self) -> Option<StoreError> {
        self.0.lock().expect("no panic happens while it is held").take()
    }

    fn note(&self, error: StoreError) -> PolarsError {
        let words = error.to_string();
        let mut known = self.0.lock().expect("no panic happens while it is held");
        known.get_or_insert(error);
        PolarsError::ComputeError(words.into())
    }
}

/// Returns the number of rows of a table that a query reads.
pub fn rows_of(table: &dyn AnonymousScan) -> usize {
    let known = table.as_any().downcast_ref::<Scan>();
    known.map_or(0, |scan| scan.table.rows())
}

/// Counts the rows of each combination of values in some columns, or returns `None` if a column is
/// missing or cannot be read. Rows with a null are left out, because no join matches them.
pub fn counts_of(table: &dyn AnonymousScan, names: &[&str]) -> Option<BTreeMap<Vec<Value>, usize>> {
    let table = &table.as_any().downcast_ref::<Scan>()?.table;
    let columns = places(table, Some(names));
    let read = (columns.len() == names.len()).then(|| table.first(&columns, table.rows()).ok());
    let read = read.flatten()?;
    let mut counts = BTreeMap::new();
    for row in 0..read.rows() {
        let columns = read.batch().columns().iter();
        let key = columns.map(|column| Value::of(column.as_ref(), row));
        if let Some(key) = key.collect::<Option<Vec<Value>>>() {
            *counts.entry(key).or_default() += 1;
        }
    }
    Some(counts)
}

struct Scan {
    table: TableSource,
    schema: SchemaRef,
    damage: Damage,
}

impl AnonymousScan for Scan {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn scan(&self, wanted: AnonymousScanArgs) -> PolarsResult<DataFrame> {
        let names = wanted.with_columns.as_deref();
        let names = names.map(|names| names.iter().map(|name| name.as_str()).collect::<Vec<_>>());
        let rows = wanted.n_rows.unwrap_or(usize::MAX);
        let table = self.table.first(&places(&self.table, names.as_deref()), rows);
        let table = table.map_err(|error| self.damage.note(error))?;
        frame::of(&table).map_err(|error| PolarsError::ComputeError(error.to_string().into()))
    }

    fn schema(&self, _: Option<usize>) -> PolarsResult<SchemaRef> {
        Ok(self.schema.clone())
    }

    fn allows_projection_pushdown(&self) -> bool {
        true
    }
}

/// The places of columns in a table; of all that queries can read if none is named.
fn places(table: &TableSource, names: Option<&[&str]>) -> Vec<usize> {
    let schema = table.schema();
    match names {
        Some(names) => names.iter().filter_map(|name| schema.index_of(name).ok()).collect(),
        None => (0..schema.fields().len()).collect(),
    }
}
