//! Published table of a stage, from which the rows of single tasks are read.

use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use crate::results::{CONVERTED, TASK};
use asperity_stages::columns::CONTENT;
use asperity_stages::output_units::Conversion;
use asperity_stages::surface::labels::{PATH, without_labels};
use asperity_stages::units::TableUnits;
use asperity_tables::column::REDUCED;
use asperity_tables::key::KeyMap;
use asperity_tables::parallel::locked;
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use asperity_tables::store::series::TableRef;
use asperity_tables::table::{Stacking, Table};

/// Name of the metadata entry that has the kind of a published stage.
pub const KIND: &str = "kind";
/// Name of the metadata entry that has the [`MissingColumns`] of a published table.
pub const MISSING_COLUMNS: &str = "lacking";

/// Name of the metadata entry that has the [`light_parts`] of the tables of a published table.
pub const PARTS: &str = "parts";

/// Returns the names of those parts of the rows of a table whose columns published tables have.
pub fn light_parts(table: &TableRef) -> String {
    let parts = table.series.iter().flat_map(|series| &series.parts);
    let light = parts.filter(|of| !of.part.is_heavy).map(|of| of.part.name.as_str());
    light.collect::<Vec<_>>().join(" ")
}

/// Maximum number of rows of a table that is read as a whole. Larger tables are read one row group
/// at a time.
const READ_AT_ONCE: usize = 1 << 18;

/// Ranges of rows in a published table, by the key of their task.
type TaskRows = KeyMap<Vec<Range<usize>>>;

/// Published table of a stage. The rows of each task are consecutive. If a stage reads several
/// stages with rows of the same series, the rows of the series are in several ranges.
#[derive(Debug)]
pub struct PublishedStage {
    pub kind: String,
    source: TableSource,
    /// Indices of all columns except those that publishing adds.
    own: Vec<usize>,
    /// Units of the store, if the numbers of the table have been converted from them.
    stored: TableUnits,
    /// Row group that was read last, with the index of its first row.
    last: Mutex<Option<(usize, Table)>>,
    rows: TaskRows,
    /// True if the tables of all tasks have all columns.
    is_uniform: bool,
    /// Names of the parts whose columns the rows have.
    parts: String,
}

/// Columns that the tables of some tasks lack, each with the row ranges of these tasks. In these
/// rows of the published table, the column is null; it may be null in other rows too.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MissingColumns(Vec<(String, Vec<Range<usize>>)>);

impl MissingColumns {
    /// Finds the columns that are missing in some of the tables. Each table is given by the index
    /// of its layout in `stacking` and by its number of rows.
    pub fn new(stacking: &Stacking, tables: &[(usize, usize)]) -> MissingColumns {
        let missing = stacking.names().enumerate().filter_map(|(column, name)| {
            let mut ranges: Vec<Range<usize>> = Vec::new();
            let mut start = 0;
            for &(layout, rows) in tables {
                let end = start + rows;
                match ranges.last_mut() {
                    _ if stacking.index_in(layout, column).is_some() || rows == 0 => {}
                    Some(last) if last.end == start => last.end = end,
                    _ => ranges.push(start..end),
                }
                start = end;
            }
            (!ranges.is_empty()).then(|| (name.to_owned(), ranges))
        });
        MissingColumns(missing.collect())
    }
}

impl PublishedStage {
    /// Reads a stage's table, or returns `None` if its rows do not belong to tasks.
    pub fn read(path: &Path) -> Result<Option<PublishedStage>, StoreError> {
        let (source, metadata) = TableSource::open(path)?;
        let source = if source.rows() <= READ_AT_ONCE { source.table()?.into() } else { source };
        PublishedStage::from_source(source, &metadata)
    }

    fn from_source(
        source: TableSource,
        metadata: &Metadata,
    ) -> Result<Option<PublishedStage>, StoreError> {
        let names = source.names();
        let task = names.iter().position(|name| name == TASK.name);
        let (Some(kind), Some(task)) = (metadata.get(KIND), task) else {
            return Ok(None);
        };
        let Some(rows) = rows(&source, task)? else {
            return Ok(None);
        };
        let names_of_units =
            metadata.get(CONVERTED).and_then(|units| serde_json::from_str(units).ok());
        let stored = names_of_units.map(|(length, pressure)| TableUnits { length, pressure });
        let schema = source.schema();
        // Otherwise a query has selected the column.
        let has_files = names.iter().any(|name| name == CONTENT.name);
        let is_own = |&column: &usize| {
            let is_repetition = schema.field(column).metadata().contains_key(REDUCED);
            let is_path = names[column] == PATH.name && has_files;
            !is_repetition && !is_path && names[column] != TASK.name
        };
        Ok(Some(PublishedStage {
            kind: kind.to_owned(),
            own: (0..names.len()).filter(is_own).collect(),
            source,
            last: Mutex::default(),
            // Converted numbers differ from those that the tasks computed.
            rows: if stored.is_some() { TaskRows::default() } else { rows },
            stored: stored.unwrap_or_default(),
            is_uniform: metadata.get(MISSING_COLUMNS) == Some("[]"),
            parts: metadata.get(PARTS).unwrap_or_default().to_owned(),
        }))
    }

    /// Reads the table, in the units of the store up to rounding.
    pub fn table(&self) -> Result<Table, StoreError> {
        let back = Conversion { from: TableUnits::default(), to: self.stored.clone() };
        Ok(back.table(&self.source.table()?))
    }

    /// Returns whether the published table has all rows of a table.
    pub fn has(&self, table: &TableRef) -> bool {
        match table.series {
            None => self.rows.contains_key(&table.key),
            Some(_) => self.rows_of(table).is_some(),
        }
    }

    /// Returns the rows of a table, or `None` if the published table lacks some of them or they are
    /// damaged.
    ///
    /// The published table can also have columns of other tasks, which are null in these rows.
    pub fn rows_of(&self, table: &TableRef) -> Option<Table> {
        let ranges = self.rows.get(&table.key)?;
        let Some(series) = &table.series else {
            return self.own(ranges.first()?.clone());
        };
        if light_parts(table) != self.parts {
            return None;
        }
        let found = ranges.iter().map(|range| series.among(&self.own(range.clone())?));
        let parts = found.collect::<Option<Vec<Table>>>()?;
        let rows = Table::stack(&parts).ok()?;
        let sorted = if parts.len() > 1 { series.sorted(&rows)? } else { rows };
        series.is_whole(&sorted).then_some(sorted)
    }

    /// Returns a table with the columns that it has in the store, without maps. Returns `None` if
    /// the published table lacks some of its rows, or if the tables of its tasks have different
    /// columns.
    pub fn table_of(&self, table: &TableRef) -> Option<Table> {
        self.rows_of(table).filter(|_| self.is_uniform)
    }

    /// Reads the first of the tables `tables` together: as many as are consecutive in this table
    /// and have few enough rows for one read. Returns the number of rows of each, and one table
    /// with all these rows. Returns `None` in the same cases as [`PublishedStage::table_of`].
    pub fn leading_tables<'a>(
        &self,
        tables: impl Iterator<Item = &'a TableRef>,
    ) -> Option<(Vec<usize>, Table)> {
        let range = |table: &TableRef| match self.rows.get(&table.key)?.as_slice() {
            [range] if self.is_uniform => Some(range.clone()),
            _ => None,
        };
        let is_whole = |table: &TableRef, part: &Table| {
            table.series.as_deref().is_none_or(|series| {
                light_parts(table) == self.parts
                    && series.is_whole(part)
                    && series.among(part).is_some_and(|own| own.rows() == part.rows())
            })
        };
        let mut located = tables.map_while(|table| Some((table, range(table)?)));
        let (first, mut all) = located.next()?;
        // If the first table has other rows now, the others mostly have, too: they are not read.
        if !is_whole(first, &self.own(all.clone())?) {
            return None;
        }
        let mut found = vec![(first, all.len())];
        for (table, next) in located {
            if next.start != all.end || next.end - all.start > READ_AT_ONCE {
                break;
            }
            found.push((table, next.len()));
            all.end = next.end;
        }
        let whole = self.own(all)?;
        let mut rows = Vec::new();
        let mut start = 0;
        for (table, count) in found {
            if !is_whole(table, &whole.slice(start..start + count)) {
                break;
            }
            rows.push(count);
            start += count;
        }
        Some((rows, whole.slice(0..start)))
    }

    /// Returns the rows `rows`, without the columns that publishing adds. Returns `None` if they
    /// are damaged.
    fn own(&self, rows: Range<usize>) -> Option<Table> {
        let mut last = locked(&self.last);
        let mut parts = Vec::new();
        let mut start = 0;
        for part in 0..self.source.count() {
            let end = start + self.source.rows_of(part);
            let wanted = rows.start.max(start)..rows.end.min(end);
            if wanted.start < wanted.end {
                let table = match last.take().filter(|(first, _)| *first == start) {
                    Some((_, table)) => table,
                    None => without_labels(&self.source.part(&self.own, part).ok()?),
                };
                parts.push(table.slice(wanted.start - start..wanted.end - start));
                *last = Some((start, table));
            }
            start = end;
        }
        if parts.is_empty() {
            Some(without_labels(&self.source.first(&self.own, 0).ok()?))
        } else {
            Table::stack(&parts).ok()
        }
    }
}

/// Finds the rows of each task in the column of keys. Returns `None` if the column holds anything
/// but keys, because the table was then written by another program.
fn rows(source: &TableSource, column: usize) -> Result<Option<TaskRows>, StoreError> {
    let mut rows = TaskRows::default();
    let mut row = 0;
    for part in source.parts(&[column]) {
        let part = part?;
        let Ok(tasks) = part.texts(TASK.name) else { return Ok(None) };
        for task in tasks.iter() {
            let Some(key) = task.and_then(|task| task.parse().ok()) else { return Ok(None) };
            let ranges: &mut Vec<Range<usize>> = rows.entry(key).or_default();
            match ranges.last_mut() {
                Some(last) if last.end == row => last.end += 1,
                _ => ranges.push(row..row + 1),
            }
            row += 1;
        }
    }
    Ok(Some(rows))
}
#[cfg(test)]
mod tests {
    use asperity_tables::column::{Column, ColumnKind, optional_reals, reals, texts};

    use super::*;
    use asperity_tables::key::TaskKey;
    use asperity_tables::store::series::SeriesRows;

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const GAP: Column = Column::result("gap", ColumnKind::Real, "1", "gap");

    fn key(digit: char) -> String {
        digit.to_string().repeat(32)
    }

    fn whole(digit: char) -> TableRef {
        key(digit).parse::<TaskKey>().unwrap().into()
    }

    fn published(table: &Table, digits: &[char], missing: &str) -> PublishedStage {
        let entries = [(KIND, "measure"), (MISSING_COLUMNS, missing)];
        let entries = entries.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
        let keys = texts(digits.iter().copied().map(key));
        let table = table.with(vec![(TASK, keys)]);
        let metadata = Metadata { key: None, entries };
        PublishedStage::from_source(table.into(), &metadata).unwrap().unwrap()
    }

    #[test]
    fn tables_of_consecutive_tasks_are_taken_out_together() {
        let table = Table::new(5, vec![(AREA, reals([0.1, 0.2, 0.3, 0.4, 0.5]))]);
        let published = published(&table, &['a', 'a', 'b', 'b', 'c'], "[]");
        let first = |digits: &[char]| {
            let tables: Vec<TableRef> = digits.iter().map(|&digit| whole(digit)).collect();
            published.leading_tables(tables.iter())
        };
        assert_eq!(first(&['a', 'b', 'd']), Some((vec![2, 2], table.slice(0..4))));
        assert_eq!(first(&['a', 'c']), Some((vec![2], table.slice(0..2))));
        assert_eq!(first(&['b', 'a']), Some((vec![2], table.slice(2..4))));
        assert_eq!(first(&['d', 'a']), None);
        assert_eq!(published.table_of(&whole('c')), Some(table.slice(4..5)));
        assert_eq!(published.table_of(&whole('d')), None);
    }

    #[test]
    fn tables_that_lack_columns_are_not_taken_out_of_a_table_with_them() {
        let pieces = [
            Table::new(1, vec![(AREA, reals([0.1]))]),
            Table::new(1, vec![(AREA, reals([0.3])), (GAP, optional_reals([None]))]),
        ];
        let mut stacking = Stacking::default();
        let parts: Vec<_> = pieces.iter().map(|table| (stacking.add(table), 1)).collect();
        let missing = serde_json::to_string(&MissingColumns::new(&stacking, &parts)).unwrap();
        let published = published(&Table::stack(&pieces).unwrap(), &['a', 'b'], &missing);
        assert_eq!(published.table_of(&whole('a')), None);
        assert!(published.leading_tables([&whole('a')].into_iter()).is_none());
        assert_eq!(published.rows_of(&whole('a')).unwrap().names(), ["area", "gap"]);
    }

    #[test]
    fn rows_of_a_series_are_found_by_their_values_in_several_ranges() {
        let table = Table::new(4, vec![(AREA, reals([0.3, 0.5, 9.0, 0.4]))]);
        let published = published(&table, &['a', 'a', 'b', 'a'], "[]");
        let areas = |values: &[f64]| {
            let series = SeriesRows { column: "area", values: values.to_vec(), parts: vec![] };
            let table = TableRef { series: Some(series.into()), ..whole('a') };
            Some(published.table_of(&table)?.reals("area").unwrap().values().to_vec())
        };
        assert_eq!(areas(&[0.3, 0.4]), Some(vec![0.3, 0.4]));
        assert_eq!(areas(&[0.3, 0.4, 0.5]), Some(vec![0.3, 0.4, 0.5]));
        assert_eq!(areas(&[0.3, 0.6]), None);
    }

    #[test]
    fn a_table_without_keys_is_none_of_ours() {
        let unknown = Table::new(1, vec![(TASK, texts(["a"]))]);
        assert_eq!(rows(&unknown.into(), 0).unwrap(), None);
    }
}
