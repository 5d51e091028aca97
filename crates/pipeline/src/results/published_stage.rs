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
    /// Columns that are missing in the tables of some tasks. `None` if the file does not list them.
    missing: Option<MissingColumns>,
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

    /// Returns the columns that are missing in the task to which the row `row` belongs.
    fn from(&self, row: usize) -> Vec<&str> {
        let columns = self.0.iter().filter(|(_, ranges)| lacks(ranges, row));
        columns.map(|(name, _)| name.as_str()).collect()
    }

    /// Returns the index of the first row after `row` at which the set of missing columns changes,
    /// or `usize::MAX` if it does not change.
    fn end_from(&self, row: usize) -> usize {
        let ends = self.0.iter().map(|(_, ranges)| {
            let next = ranges.partition_point(|range| range.end <= row);
            ranges
                .get(next)
                .map_or(usize::MAX, |range| if range.start > row { range.start } else { range.end })
        });
        ends.min().unwrap_or(usize::MAX)
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
        let missing = metadata.get(MISSING_COLUMNS);
        Ok(Some(PublishedStage {
            kind: kind.to_owned(),
            own: (0..names.len()).filter(is_own).collect(),
            source,
            last: Mutex::default(),
            // Converted numbers differ from those that the tasks computed.
            rows: if stored.is_some() { TaskRows::default() } else { rows },
            stored: stored.unwrap_or_default(),
            missing: missing.and_then(|words| serde_json::from_str(words).ok()),
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
        self.chosen(table, |rows| self.own(rows))
    }

    /// Returns a table with the columns that it has in the store, without maps. Returns `None` if
    /// the published table lacks some of its rows, or if these columns are unknown.
    pub fn table_of(&self, table: &TableRef) -> Option<Table> {
        let missing = self.missing.as_ref()?;
        self.chosen(table, |rows| self.slice(rows, missing))
    }

    /// Reads the ranges of a key with `read`, and chooses the rows that belong to `table`.
    fn chosen(
        &self,
        table: &TableRef,
        read: impl Fn(Range<usize>) -> Option<Table>,
    ) -> Option<Table> {
        let ranges = self.rows.get(&table.key)?;
        let Some(series) = &table.series else {
            return read(ranges.first()?.clone());
        };
        if light_parts(table) != self.parts {
            return None;
        }
        let found = ranges.iter().map(|range| series.among(&read(range.clone())?));
        let parts = found.collect::<Option<Vec<Table>>>()?;
        let rows = Table::stack(&parts).ok()?;
        let rows = if parts.len() > 1 { series.sorted(&rows)? } else { rows };
        series.is_whole(&rows).then_some(rows)
    }

    /// Reads the first of the tables `tables` together: as many as are consecutive in this table,
    /// have the same columns, and have few enough rows for one read. Returns the number of rows of
    /// each, and one table with all these rows.
    pub fn leading_tables<'a>(
        &self,
        tables: impl Iterator<Item = &'a TableRef>,
    ) -> Option<(Vec<usize>, Table)> {
        let missing = self.missing.as_ref()?;
        let range = |table: &TableRef| match self.rows.get(&table.key)?.as_slice() {
            [range] => Some(range.clone()),
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
        if !is_whole(first, &self.slice(all.clone(), missing)?) {
            return None;
        }
        let end = missing.end_from(all.start);
        let mut found = vec![(first, all.len())];
        for (table, next) in located {
            let is_much = next.end - all.start > READ_AT_ONCE;
            if next.start != all.end || next.end > end || is_much {
                break;
            }
            found.push((table, next.len()));
            all.end = next.end;
        }
        let whole = self.slice(all, missing)?;
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

    /// Returns the rows `rows`, whose tasks all lack the same columns, without these columns.
    fn slice(&self, rows: Range<usize>, missing: &MissingColumns) -> Option<Table> {
        let absent = missing.from(rows.start);
        let table = self.own(rows)?;
        Some(if absent.is_empty() { table } else { table.without(&absent) })
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

/// Returns whether `row` is in one of the ranges, which must be in ascending order.
fn lacks(ranges: &[Range<usize>], row: usize) -> bool {
    let next = ranges.partition_point(|range| range.end <= row);
    ranges.get(next).is_some_and(|range| range.contains(&row))
}

/// Finds the rows of each task in the column of keys. Returns `None` if the column holds anything
/// but keys, because the table was then written by another program.
fn rows(source: &TableSource, column: usize) -> Result<Option<TaskRows>, StoreError> {
    let mut rows = TaskRows::default();
    let mut last = String::new();
    let (mut start, mut end) = (0, 0);
    let add = |rows: &mut TaskRows, task: &str, range: Range<usize>| {
        let key = task.parse().ok();
        range.is_empty() || key.map(|key| rows.entry(key).or_default().push(range)).is_some()
    };
    for part in source.parts(&[column]) {
        let part = part?;
        let Ok(tasks) = part.texts(TASK.name) else {
            return Ok(None);
        };
        for row in 0..part.rows() {
            let task = tasks.value(row);
            if task != last {
                if !add(&mut rows, &last, start..end) {
                    return Ok(None);
                }
                task.clone_into(&mut last);
                start = end;
            }
            end += 1;
        }
    }
    Ok(add(&mut rows, &last, start..end).then_some(rows))
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

    /// Returns the tables of two tasks: two rows without a column `gap`, and one row whose `gap` is
    /// null.
    fn pieces() -> [Table; 2] {
        [
            Table::new(2, vec![(AREA, reals([0.1, 0.2]))]),
            Table::new(1, vec![(AREA, reals([0.3])), (GAP, optional_reals([None]))]),
        ]
    }

    fn missing(tables: &[Table]) -> String {
        let mut stacking = Stacking::default();
        let parts = tables.iter().map(|table| (stacking.add(table), table.rows()));
        let parts: Vec<_> = parts.collect();
        serde_json::to_string(&MissingColumns::new(&stacking, &parts)).unwrap()
    }

    fn published(is_told: bool) -> PublishedStage {
        let stacked = Table::stack(&pieces()).unwrap();
        let missing_columns = missing(&pieces());
        let keys = texts([key('a'), key('a'), key('b')]);
        let mut entries = vec![(KIND.to_owned(), "measure".to_owned())];
        entries.extend(is_told.then(|| (MISSING_COLUMNS.to_owned(), missing_columns)));
        let metadata = Metadata { key: None, entries };
        let table = stacked.with(vec![(TASK, keys)]);
        PublishedStage::from_source(table.into(), &metadata).unwrap().unwrap()
    }

    #[test]
    fn tables_of_tasks_come_back_with_the_columns_that_they_had() {
        let published = published(true);
        for (digit, piece) in ['a', 'b'].into_iter().zip(pieces()) {
            assert_eq!(published.table_of(&whole(digit)), Some(piece));
        }
        assert_eq!(published.table_of(&whole('c')), None);
    }

    #[test]
    fn tasks_with_the_same_columns_are_taken_out_together() {
        let [two, one] = pieces();
        let stacked = Table::stack(&[two.clone(), two, one]).unwrap();
        let pieces = [stacked.slice(0..2), stacked.slice(2..4)];
        let pieces =
            [pieces[0].without(&["gap"]), pieces[1].without(&["gap"]), stacked.slice(4..5)];
        let missing_columns = missing(&pieces);
        let keys = texts(['a', 'a', 'b', 'b', 'c'].map(key));
        let entries = vec![
            (KIND.to_owned(), "measure".to_owned()),
            (MISSING_COLUMNS.to_owned(), missing_columns),
        ];
        let metadata = Metadata { key: None, entries };
        let table = stacked.clone().with(vec![(TASK, keys)]);
        let published = PublishedStage::from_source(table.into(), &metadata).unwrap().unwrap();
        let first = |digits: &[char]| {
            let tables: Vec<TableRef> = digits.iter().map(|&digit| whole(digit)).collect();
            published.leading_tables(tables.iter())
        };
        let both = stacked.slice(0..4).without(&["gap"]);
        assert_eq!(first(&['a', 'b', 'c']), Some((vec![2, 2], both)));
        assert_eq!(first(&['a', 'c']), Some((vec![2], pieces[0].clone())));
        assert_eq!(first(&['b', 'a']), Some((vec![2], pieces[1].clone())));
        assert_eq!(first(&['c', 'd']), Some((vec![1], pieces[2].clone())));
        assert_eq!(first(&['d', 'a']), None);
    }

    #[test]
    fn a_table_that_does_not_tell_what_is_lacking_has_rows_alone() {
        let published = published(false);
        assert_eq!(published.table_of(&whole('a')), None);
        assert_eq!(published.rows_of(&whole('a')).unwrap().names(), ["area", "gap"]);
    }

    #[test]
    fn rows_of_a_series_are_found_by_their_values_in_several_ranges() {
        let tasks = texts(['a', 'a', 'b', 'a'].map(key));
        let area = reals([0.3, 0.5, 9.0, 0.4]);
        let table = Table::new(4, vec![(AREA, area), (TASK, tasks)]);
        let entries = vec![
            (KIND.to_owned(), "measure".to_owned()),
            (MISSING_COLUMNS.to_owned(), "[]".to_owned()),
        ];
        let metadata = Metadata { key: None, entries };
        let published = PublishedStage::from_source(table.into(), &metadata).unwrap().unwrap();
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
