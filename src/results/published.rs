//! The table of a stage as it has been published, by tasks.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{PATH, TASK};
use crate::store::StoreError;
use crate::store::files::read_whole;
use crate::store::key::TaskKey;
use crate::store::parquet::{Columns, Metadata};
use crate::store::table::Table;

/// The entries of its file that say what its rows alone do not.
pub const KIND: &str = "kind";
/// See [`Lacking`].
pub const LACKING: &str = "lacking";

/// The rows of a stage's tasks, one task after the other.
#[derive(Debug)]
pub struct Published {
    /// The kind of the stage.
    pub kind: String,
    /// As it was published.
    pub table: Table,
    /// Without the columns that publishing adds.
    own: Table,
    rows: HashMap<TaskKey, Range<usize>>,
    /// Nothing in a table that does not tell.
    lacking: Option<Lacking>,
}

/// Columns that tables of some tasks have not got, and the rows of those tasks: there the columns
/// are null, which they may be elsewhere, too.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lacking(Vec<(String, Vec<Range<usize>>)>);

impl Lacking {
    /// What each of these tables lacks of the columns of all, once they are stacked.
    pub fn of(pieces: &[Table], stacked: &Table) -> Lacking {
        let lacking = stacked.names().into_iter().filter_map(|name| {
            let mut ranges: Vec<Range<usize>> = Vec::new();
            let mut start = 0;
            for piece in pieces {
                let end = start + piece.rows();
                match ranges.last_mut() {
                    _ if piece.has(name) || start == end => {}
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
            ranges
                .get(next)
                .map_or(usize::MAX, |range| match range.start > row {
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
        let (table, metadata) = read_whole(path, Columns::Light)?;
        Ok(Published::of(table, &metadata))
    }

    fn of(table: Table, metadata: &Metadata) -> Option<Published> {
        let kind = metadata.get(KIND)?.to_owned();
        let rows = rows(&table)?;
        let lacking = metadata.get(LACKING);
        Some(Published {
            kind,
            own: table.without(&[TASK.name, PATH.name]),
            table,
            rows,
            lacking: lacking.and_then(|words| serde_json::from_str(words).ok()),
        })
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
        let rows = self.rows.get(&key)?;
        Some(self.own.slice(rows.clone()))
    }

    /// The table of a task without its maps, as the store has it; nothing if that cannot be told.
    pub fn table_of(&self, key: TaskKey) -> Option<Table> {
        let lacking = self.lacking.as_ref()?;
        let rows = self.rows.get(&key)?;
        Some(self.slice(rows.clone(), lacking))
    }

    /// The same of as many of these tasks, from the first one on, as lie under each other in the
    /// table and have the same columns: how many rows each of them has, and all their rows.
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
            if next.start != all.end || next.end > end {
                break;
            }
            rows.push(next.len());
            all.end = next.end;
        }
        Some((rows, self.slice(all, lacking)))
    }

    /// Rows of tasks that have the same columns, without those that they lack.
    fn slice(&self, rows: Range<usize>, lacking: &Lacking) -> Table {
        let lacking = lacking.from(rows.start);
        let table = self.own.slice(rows);
        match lacking.is_empty() {
            true => table,
            false => table.without(&lacking),
        }
    }
}

/// Whether a row is in one of these ranges, which ascend.
fn lacks(ranges: &[Range<usize>], row: usize) -> bool {
    let next = ranges.partition_point(|range| range.end <= row);
    ranges.get(next).is_some_and(|range| range.contains(&row))
}

/// The rows of each task: they follow one another, or else nobody has published the table.
fn rows(table: &Table) -> Option<HashMap<TaskKey, Range<usize>>> {
    let tasks = table.texts(TASK.name).ok()?;
    let mut rows = HashMap::new();
    let mut start = 0;
    for end in 1..=table.rows() {
        let task = tasks.value(start);
        if end == table.rows() || tasks.value(end) != task {
            let known = rows.insert(task.parse().ok()?, start..end);
            if known.is_some() {
                return None;
            }
            start = end;
        }
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::column::{Column, ColumnKind, optional_reals, reals, texts};

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

    fn published(lacking: bool) -> Published {
        let stacked = Table::stack(&pieces()).unwrap();
        let told = serde_json::to_string(&Lacking::of(&pieces(), &stacked)).unwrap();
        let keys = texts([key('a'), key('a'), key('b')]);
        let mut entries = vec![(KIND.to_owned(), "measure".to_owned())];
        entries.extend(lacking.then(|| (LACKING.to_owned(), told)));
        let metadata = Metadata { key: None, entries };
        Published::of(stacked.with(vec![(TASK, keys)]), &metadata).unwrap()
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
        let pieces = [
            pieces[0].without(&["gap"]),
            pieces[1].without(&["gap"]),
            stacked.slice(4..5),
        ];
        let told = serde_json::to_string(&Lacking::of(&pieces, &stacked)).unwrap();
        let keys = texts(['a', 'a', 'b', 'b', 'c'].map(key));
        let entries = vec![
            (KIND.to_owned(), "measure".to_owned()),
            (LACKING.to_owned(), told),
        ];
        let metadata = Metadata { key: None, entries };
        let published = Published::of(stacked.clone().with(vec![(TASK, keys)]), &metadata).unwrap();
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
        assert_eq!(rows(&mixed), None);
        assert_eq!(rows(&Table::new(1, vec![(TASK, texts(["a"]))])), None);
    }
}
