//! The tables of a study before it is run: every column, and no row.

use super::Study;
use asperity_stages::StageError;
use asperity_tables::table::Table;

impl Study {
    /// The table of each stage, without rows: names, types, units and meanings of its columns.
    ///
    /// # Errors
    /// When a query cannot be answered.
    pub fn empty_tables(&self) -> Result<Vec<Table>, StageError> {
        let mut tables: Vec<(String, Table)> = Vec::new();
        for stage in &self.stages {
            let inputs = stage.inputs.iter().map(|&input| tables[input].clone());
            let table = stage.work.empty_table(&inputs.collect::<Vec<_>>())?;
            tables.push((stage.name.clone(), table));
        }
        Ok(tables.into_iter().map(|(_, table)| table).collect())
    }
}
