//! The table of a stage as it has been published, by tasks.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::{PATH, TASK};
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::stacking::Stacking;
use asperity_tables::store::StoreError;
use asperity_tables::store::key::TaskKey;
use asperity_tables::table::Table;

/// The entries of its file that say what its rows alone do not.
pub const KIND: &str = "kind";
/// See [`Lacking`].
pub const LACKING: &str = "lacking";

/// Most rows of a table that is read whole; larger tables are read as their rows are asked for.
const READ_AT_ONCE: usize = 1 << 18;

/// The rows of a stage's tasks, one task after the other.
#[derive(Debug)]
pub struct Published {
    /// The kind of the stage.
    pub kind: String,
    source: TableSource,
    /// Columns without those that publishing adds.
    own: Vec<usize>,
    /// The row group that was read last from a larger table, with the number of its first row.
    last: Mutex<Option<(usize, Table)>>,
    rows: HashMap<TaskKey, Range<usize>>,
    /// Nothing in a table that does not tell.
    lacking: Option<Lacking>,
}

/// Columns that tables of some tasks have not got, and the rows of those tasks: there the columns
/// are null, which they may be elsewhere, too.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lacking(Vec<(String, Vec<Range<usize>>)>);

impl Lacking {
    /// Finds the columns that tables lack; each table is given by its layout and its number of
    /// rows.
    pub fn of(stacking: &Stacking, tables: &[(usize, usize)]) -> Lacking {
        let lacking = stacking.names().enumerate().filter_map(|(column, name)| {
            let mut ranges: Vec<Range<usize>> = Vec::new();
            let mut start = 0;
            for &(layout, rows) in tables {
                let end = start + rows;
                match ranges.last_mut() {
                    _ if stacking.place(layout, column).is_some() || rows == 0 => {}
                    Some(last) if last.end == start => last.end = end,
                    _ => ranges.push(start..end),
                }
                start = end;
            }
            (!ranges.is_empty()).then(|| (name.to_owned(), ranges))
        });
        Lacking(lacking.collect())
    }

    /// The columns that a task lacks whose rows begin with this one.
    fn from(&self, row: usize) -> Vec<&str> {
        let columns = self.0.iter().filter(|(_, ranges)| lacks(ranges, row));
        columns.map(|(name, _)| name.as_str()).collect()
    }

    /// Where, after a row, other columns are lacking than in it.
    fn end_from(&self, row: usize) -> usize {
        let ends = self.0.iter().map(|(_, ranges)| {
            let next = ranges.partition_point(|range| range.end <= row);
            ranges.get(next).map_or(usize::MAX, |range| match range.start > row {
                true => range.start,
                false => range.end,
            })
        });
        ends.min().unwrap_or(usize::MAX)
    }
}

impl Published {
    /// Reads a stage's table; nothing if it is one whose rows are of no task.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read(path: &Path) -> Result<Option<Published>, StoreError> {
        let (source, metadata) = TableSource::open(path)?;
        let source = match source.rows() <= READ_AT_ONCE {
            true => source.table()?.into(),
            false => source,
        };
        Published::of(source, &metadata)
    }

    fn of(source: TableSource, metadata: &Metadata) -> Result<Option<Published>, StoreError> {
        let names = source.names();
        let task = names.iter().position(|name| name == TASK.name);
        let (Some(kind), Some(task)) = (metadata.get(KIND), task) else {
            return Ok(None);
        };
        let Some(rows) = rows(&source, task)? else {
            return Ok(None);
        };
        let is_own = |column: &usize| ![TASK.name, PATH.name].contains(&names[*column].as_str());
        let lacking = metadata.get(LACKING);
        Ok(Some(Published {
            kind: kind.to_owned(),
            own: (0..names.len()).filter(is_own).collect(),
            source,
            last: Mutex::default(),
            rows,
            lacking: lacking.and_then(|words| serde_json::from_str(words).ok()),
        }))
    }

    /// The table as it was published.
    ///
    /// # Errors
    /// When it is damaged.
    pub fn table(&self) -> Result<Table, StoreError> {
        self.source.table()
    }

    /// Its tasks.
    pub fn tasks(&self) -> impl Iterator<Item = TaskKey> {
        self.rows.keys().copied()
    }

    /// Whether it has rows of a task.
    pub fn has(&self, key: TaskKey) -> bool {
        self.rows.contains_key(&key)
    }

    /// The rows of a task; columns that its own table has not got may be there, and null.
    pub fn rows_of(&self, key: TaskKey) -> Option<Table> {
        self.own(self.rows.get(&key)?.clone())
    }

    /// The table of a task without its maps, as the store has it; nothing if that cannot be told.
    pub fn table_of(&self, key: TaskKey) -> Option<Table> {
        let lacking = self.lacking.as_ref()?;
        let rows = self.rows.get(&key)?;
        self.slice(rows.clone(), lacking)
    }

    /// The same of as many of these tasks, from the first one on, as lie under each other in the
    /// table and have the same columns, and as are read at once: how many rows each of them has,
    /// and all their rows.
    pub fn table_of_first(
        &self,
        keys: impl Iterator<Item = TaskKey>,
    ) -> Option<(Vec<usize>, Table)> {
        let lacking = self.lacking.as_ref()?;
        let mut keys = keys.map_while(|key| self.rows.get(&key));
        let first = keys.next()?;
        let end = lacking.end_from(first.start);
        let mut rows = vec![first.len()];
        let mut all = first.clone();
        for next in keys {
            let is_much = next.end - all.start > READ_AT_ONCE;
            if next.start != all.end || next.end > end || is_much {
                break;
            }
            rows.push(next.len());
            all.end = next.end;
        }
        Some((rows, self.slice(all, lacking)?))
    }

    /// Rows of tasks that have the same columns, without those that they lack.
    fn slice(&self, rows: Range<usize>, lacking: &Lacking) -> Option<Table> {
        let lacking = lacking.from(rows.start);
        let table = self.own(rows)?;
        Some(match lacking.is_empty() {
            true => table,
            false => table.without(&lacking),
        })
    }

    /// Returns some rows without the columns that publishing adds, or `None` if they are damaged.
    fn own(&self, rows: Range<usize>) -> Option<Table> {
        let mut last = self.last.lock().expect("no panic happens while it is held");
        let mut parts = Vec::new();
        let mut start = 0;
        for part in 0..self.source.count() {
            let end = start + self.source.rows_of(part);
            let wanted = rows.start.max(start)..rows.end.min(end);
            if wanted.start < wanted.end {
                let table = match last.take().filter(|(first, _)| *first == start) {
                    Some((_, table)) => table,
                    None => self.source.part(&self.own, part).ok()?,
                };
                parts.push(table.slice(wanted.start - start..wanted.end - start));
                *last = Some((start, table));
            }
            start = end;
        }
        match parts.is_empty() {
            true => self.source.first(&self.own, 0).ok(),
            false => Table::stack(&parts).ok(),
        }
    }
}

/// Whether a row is in one of these ranges, which ascend.
fn lacks(ranges: &[Range<usize>], row: usize) -> bool {
    let next = ranges.partition_point(|range| range.end <= row);
    ranges.get(next).is_some_and(|range| range.contains(&row))
}

/// Returns the rows of each task by the column of keys, or `None` if the rows of a task do not
/// follow each other: then the table was not published by this program.
fn rows(
    source: &TableSource,
    column: usize,
) -> Result<Option<HashMap<TaskKey, Range<usize>>>, StoreError> {
    let mut rows: HashMap<TaskKey, Range<usize>> = HashMap::new();
    let mut last = String::new();
    let (mut start, mut end) = (0, 0);
    let add = |rows: &mut HashMap<_, _>, task: &str, range: Range<usize>| {
        let key = task.parse().ok();
        range.is_empty() || key.is_some_and(|key: TaskKey| rows.insert(key, range).is_none())
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
    use super::*;
    use asperity_tables::column::{Column, ColumnKind, optional_reals, reals, texts};

    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
    const GAP: Column = Column::result("gap", ColumnKind::Real, "1", "gap");

    fn key(digit: char) -> String {
        digit.to_string().repeat(32)
    }

    /// Two rows of a task without gaps, and one of a task whose gap is null.
    fn pieces() -> [Table; 2] {
        [
            Table::new(2, vec![(AREA, reals([0.1, 0.2]))]),
            Table::new(1, vec![(AREA, reals([0.3])), (GAP, optional_reals([None]))]),
        ]
    }

    fn lacking(tables: &[Table]) -> String {
        let mut stacking = Stacking::default();
        let parts = tables.iter().map(|table| (stacking.add(table), table.rows()));
        let parts: Vec<_> = parts.collect();
        serde_json::to_string(&Lacking::of(&stacking, &parts)).unwrap()
    }

    fn published(is_told: bool) -> Published {
        let stacked = Table::stack(&pieces()).unwrap();
        let told = lacking(&pieces());
        let keys = texts([key('a'), key('a'), key('b')]);
        let mut entries = vec![(KIND.to_owned(), "measure".to_owned())];
        entries.extend(is_told.then(|| (LACKING.to_owned(), told)));
        let metadata = Metadata { key: None, entries };
        let table = stacked.with(vec![(TASK, keys)]);
        Published::of(table.into(), &metadata).unwrap().unwrap()
    }

    #[test]
    fn tables_of_tasks_come_back_with_the_columns_that_they_had() {
        let published = published(true);
        for (digit, piece) in ['a', 'b'].into_iter().zip(pieces()) {
            let table = published.table_of(key(digit).parse().unwrap());
            assert_eq!(table, Some(piece));
        }
        assert_eq!(published.table_of(key('c').parse().unwrap()), None);
    }

    #[test]
    fn tasks_with_the_same_columns_are_taken_out_together() {
        let [two, one] = pieces();
        let stacked = Table::stack(&[two.clone(), two, one]).unwrap();
        let pieces = [stacked.slice(0..2), stacked.slice(2..4)];
        let pieces =
            [pieces[0].without(&["gap"]), pieces[1].without(&["gap"]), stacked.slice(4..5)];
        let told = lacking(&pieces);
        let keys = texts(['a', 'a', 'b', 'b', 'c'].map(key));
        let entries = vec![(KIND.to_owned(), "measure".to_owned()), (LACKING.to_owned(), told)];
        let metadata = Metadata { key: None, entries };
        let table = stacked.clone().with(vec![(TASK, keys)]);
        let published = Published::of(table.into(), &metadata).unwrap().unwrap();
        let first = |digits: &[char]| {
            let keys = digits.iter().map(|&digit| key(digit).parse().unwrap());
            published.table_of_first(keys)
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
        let key = key('a').parse().unwrap();
        assert_eq!(published.table_of(key), None);
        assert_eq!(published.rows_of(key).unwrap().names(), ["area", "gap"]);
    }

    #[test]
    fn a_table_whose_tasks_are_mixed_is_none_of_ours() {
        let mixed = Table::new(3, vec![(TASK, texts([key('a'), key('b'), key('a')]))]);
        assert_eq!(rows(&mixed.into(), 0).unwrap(), None);
        let unknown = Table::new(1, vec![(TASK, texts(["a"]))]);
        assert_eq!(rows(&unknown.into(), 0).unwrap(), None);
    }
}
