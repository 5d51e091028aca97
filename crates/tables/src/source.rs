//! Tables in files or in memory, from which only the needed columns and rows are read.

use std::path::{Path, PathBuf};

use arrow::datatypes::SchemaRef;

use crate::parquet::{Metadata, TableFile};
use crate::store::StoreError;
use crate::store::files::open_table;
use crate::table::Table;

/// Table in a file or in memory.
#[derive(Debug)]
pub struct TableSource(Backing);

#[derive(Debug)]
enum Backing {
    Memory(Table),
    File(PathBuf, TableFile),
}

impl From<Table> for TableSource {
    fn from(table: Table) -> TableSource {
        TableSource(Backing::Memory(table))
    }
}

impl TableSource {
    /// Opens the table in a file. Returns it with the metadata of the file.
    ///
    /// # Errors
    /// Returns an error if the file is missing, unreadable or not a table of this program.
    pub fn open(path: &Path) -> Result<(TableSource, Metadata), StoreError> {
        let file = open_table(path)?;
        let metadata = file.metadata().clone();
        let backing = Backing::File(path.to_owned(), file);
        Ok((TableSource(backing), metadata))
    }

    pub fn schema(&self) -> SchemaRef {
        match &self.0 {
            Backing::Memory(table) => table.batch().schema(),
            Backing::File(_, file) => file.schema().clone(),
        }
    }

    pub fn names(&self) -> Vec<String> {
        let schema = self.schema();
        let fields = schema.fields().iter();
        fields.map(|field| field.name().clone()).collect()
    }

    pub fn rows(&self) -> usize {
        match &self.0 {
            Backing::Memory(table) => table.rows(),
            Backing::File(_, file) => file.rows(),
        }
    }

    /// Reads all columns and rows of the table.
    ///
    /// # Errors
    /// Returns an error if the file is damaged.
    pub fn table(&self) -> Result<Table, StoreError> {
        let all: Vec<usize> = (0..self.schema().fields().len()).collect();
        self.first(&all, self.rows())
    }

    /// Reads the first `rows` rows of the columns with the given indices, in the order of the
    /// indices.
    ///
    /// # Errors
    /// Returns an error if a part that is read is damaged.
    pub fn first(&self, columns: &[usize], rows: usize) -> Result<Table, StoreError> {
        match &self.0 {
            Backing::Memory(table) => Ok(table.project(columns).slice(0..rows.min(table.rows()))),
            Backing::File(path, file) => {
                file.first(columns, rows).map_err(|error| StoreError::in_file(path, error))
            }
        }
    }

    /// Reads some columns as consecutive parts, from the first row to the last. Each part fits into
    /// memory.
    pub fn parts<'a>(
        &'a self,
        columns: &'a [usize],
    ) -> impl Iterator<Item = Result<Table, StoreError>> + 'a {
        (0..self.count()).map(move |part| self.part(columns, part))
    }

    pub fn count(&self) -> usize {
        match &self.0 {
            Backing::Memory(_) => 1,
            Backing::File(_, file) => file.groups(),
        }
    }

    pub fn rows_of(&self, part: usize) -> usize {
        match &self.0 {
            Backing::Memory(table) => table.rows(),
            Backing::File(_, file) => file.rows_of(part),
        }
    }

    /// Reads some columns of one part.
    ///
    /// # Errors
    /// Returns an error if these columns are damaged.
    pub fn part(&self, columns: &[usize], part: usize) -> Result<Table, StoreError> {
        match &self.0 {
            Backing::Memory(table) => Ok(table.project(columns)),
            Backing::File(path, file) => {
                file.group(columns, part).map_err(|error| StoreError::in_file(path, error))
            }
        }
    }

    /// Returns true if a column has the same value in all rows.
    ///
    /// # Errors
    /// Returns an error if the column is damaged.
    pub fn is_constant(&self, column: usize) -> Result<bool, StoreError> {
        let mut last = None;
        for part in self.parts(&[column]) {
            let values = part?.batch().column(0).to_data();
            let Some(pairs) = values.len().checked_sub(1) else { continue };
            // Compare each row with the next one, and the first row with the part before.
            let first = values.slice(0, 1);
            if values.slice(0, pairs) != values.slice(1, pairs)
                || last.replace(first.clone()).is_some_and(|last| last != first)
            {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{Column, ColumnKind, reals};

    fn is_constant(values: &[f64]) -> bool {
        let area = Column::result("area", ColumnKind::Real, "1", "area");
        let values = reals(values.iter().copied());
        let source = TableSource::from(Table::new(values.len(), vec![(area, values)]));
        source.is_constant(0).unwrap()
    }

    #[test]
    fn a_column_is_constant_if_neighbouring_rows_are_equal() {
        assert!(is_constant(&[]));
        assert!(is_constant(&[2.0]));
        assert!(is_constant(&[2.0, 2.0, 2.0]));
        assert!(!is_constant(&[2.0, 2.0, 3.0]));
        assert!(!is_constant(&[2.0, f64::NAN]));
    }
}
