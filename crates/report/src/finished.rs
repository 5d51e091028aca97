//! The stages of a study with finished tasks, and the units of their tables.

use std::path::PathBuf;

use crate::Subject;
use asperity_pipeline::plan::{Plan, Task};
use asperity_pipeline::results::reader::ResultReader;
use asperity_stages::Kind;
use asperity_stages::columns::{EFFECTIVE_MODULUS, PRESSURE_UNIT};
use asperity_stages::output_units::Conversion;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::units::{TableUnits, pressure_unit};
use asperity_tables::parquet::Columns;
use asperity_tables::store::StoreError;
use asperity_tables::table::Table;

/// A stage with at least one finished task.
#[derive(Debug)]
pub struct FinishedStage {
    pub name: String,
    pub kind: Kind,
    pub table: Table,
    /// Units of length and pressure of the table. The manifest names them where the table does not,
    /// as that of an `aggregate` stage.
    pub units: TableUnits,
    /// Path of the published table, or `None` if it does not contain exactly these rows.
    pub path: Option<PathBuf>,
}

pub struct FinishedStages<'a> {
    /// Stages in the order of the plan.
    pub stages: Vec<FinishedStage>,
    pub plan: &'a Plan,
    /// Reader of tables and maps.
    pub archive: &'a ResultReader,
    pub sources: &'a SurfaceFiles,
    /// Unit of pressure of all tables that could be converted to it.
    pressure: Option<String>,
    /// Units of output, where they differ from those of the store.
    pub output_units: &'a TableUnits,
}

impl<'a> FinishedStages<'a> {
    /// Collects the finished stages of a study.
    pub fn new(subject: &Subject<'a>) -> FinishedStages<'a> {
        let units = units_of_stages(subject);
        // Figures show rows of several stages on one axis of pressures.
        let shared = units.iter().find_map(|units| units.pressure.clone());
        let all = subject.plan.stages.iter().zip(subject.rows).zip(units);
        let stages = all.filter_map(|((stage, rows), units)| {
            let (table, units) = in_pressure_unit(rows.table.as_ref()?, units, shared.as_deref());
            Some(FinishedStage {
                name: stage.name.clone(),
                kind: stage.kind,
                table,
                units,
                path: rows.is_published.then(|| rows.path.clone()),
            })
        });
        FinishedStages {
            stages: stages.collect(),
            plan: subject.plan,
            archive: subject.archive,
            sources: &subject.study.sources,
            pressure: shared,
            output_units: &subject.study.output_units,
        }
    }

    /// Converts a table of the store to the units of output.
    pub fn shown(&self, table: Table, kind: Kind) -> Table {
        if *self.output_units == TableUnits::default() {
            return table;
        }
        let from = TableUnits::from_table(&table);
        Conversion { from, to: self.output_units.clone() }.stored_table(&table, kind)
    }

    /// Reads the stored table of a contact, with its maps, in the units of the finished stages.
    pub fn stored(&self, task: &Task) -> Result<Table, StoreError> {
        let stored = self.archive.store().read(&task.table, Columns::All)?;
        let mut to = self.output_units.clone();
        // Moduli without a unit are in pascals or plain numbers.
        if stored.has(PRESSURE_UNIT.name) {
            to.pressure = to.pressure.or_else(|| self.pressure.clone());
        }
        let from = TableUnits::from_table(&stored);
        Ok(Conversion { from, to }.stored_table(&stored, Kind::Solve))
    }

    /// Returns the stages whose tables have all of these columns.
    pub fn with<'b>(&'b self, columns: &'b [&str]) -> impl Iterator<Item = &'b FinishedStage> {
        let has_all = |stage: &&FinishedStage| columns.iter().all(|column| stage.table.has(column));
        self.stages.iter().filter(has_all)
    }

    /// Returns the name of a stage of this kind, finished or not, for proposed lines.
    pub fn name_of(&self, kind: Kind) -> Option<&str> {
        let mut stages = self.plan.stages.iter();
        let found = stages.find(|stage| stage.kind == kind)?;
        Some(&found.name)
    }
}

/// Returns a table with its pressures in the unit `wanted`, and its units, if it can be converted.
fn in_pressure_unit(table: &Table, units: TableUnits, wanted: Option<&str>) -> (Table, TableUnits) {
    // The unit of a modulus without a name is assumed from its size.
    if table.has(EFFECTIVE_MODULUS.name) && !table.has(PRESSURE_UNIT.name) {
        return (table.clone(), units);
    }
    let to = TableUnits { pressure: wanted.map(str::to_owned), ..TableUnits::default() };
    let converted = Conversion { from: units.clone(), to: to.clone() }.table(table);
    (converted, units.in_output(&to))
}

/// Returns the units of the table of each stage. If the manifest names no unit of pressure, the
/// unit is the one that is assumed for the moduli of the stage or of the stages that it reads.
fn units_of_stages(subject: &Subject) -> Vec<TableUnits> {
    let mut units = subject.study.units();
    for (index, (stage, rows)) in subject.study.stages.iter().zip(subject.rows).enumerate() {
        if units[index].pressure.is_none() {
            let own = rows.table.as_ref().and_then(pressure_unit);
            let read = TableUnits::common(stage.inputs.iter().map(|&input| &units[input]));
            units[index].pressure = own.or(read.pressure);
        }
    }
    units
}
