//! Common interface of all kinds of stage: definition, parameters, work in a study, and errors.

use std::borrow::Cow;

use bytesize::ByteSize;

use crate::surface_files::SurfaceFiles;
use crate::units::TableUnits;
use crate::version::{PartVersion, Version};
use crate::{Kind, Recipe, RowKind, StageError, surface};
use asperity_mechanics::threads::Threads;
use asperity_tables::column::{Column, Value, absolute_column};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use asperity_tables::store::series::{Part, SeriesRows};
use asperity_tables::table::{Table, TableError};

/// Properties of a kind of stage that do not depend on parameters.
pub struct Definition {
    /// Name of the kind in manifests, tables and recipes.
    pub name: &'static str,
    /// Version of the numbers that the stage computes, which is raised whenever they change.
    pub version: Version,
    pub reads: Reads,
    /// Returns the kind of the stage's rows, given the kind of the rows that it reads; `None` if it
    /// depends on parameters.
    pub row_kind: fn(Option<RowKind>) -> Option<RowKind>,
    /// Returns all columns that the stage may add to the parameter columns of its inputs.
    pub columns: fn() -> Vec<Column>,
    /// Returns short statements that summarize a table of the stage. The second argument describes
    /// the loads of the contacts of its surfaces.
    pub summary: fn(&TableSource, &ContactLoads) -> Result<Vec<String>, StageError>,
}

/// Loads of all contacts of the surfaces of a stage. The summary of the surfaces gives the load of
/// full contact in the same form: reduced, as a pressure, or not at all.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactLoads {
    /// Loads in units of E* × rms slope. Pressures count as reduced, too, if the contacts have
    /// different moduli or units.
    Reduced,
    /// Mean pressures of contacts with the same modulus and unit.
    Absolute {
        /// Effective modulus E* of all contacts, in `unit`.
        effective_modulus: f64,
        /// Unit that the manifest names.
        unit: Option<&'static str>,
    },
    /// A contact has a layer, a free boundary or adhesion, to which the load of full contact of a
    /// periodic half-space does not apply.
    NotHalfSpace,
}

/// Inputs that a stage accepts. All inputs of one stage must have the same kind of rows.
#[derive(Debug, Clone)]
pub struct Reads {
    /// Accepted kinds of rows.
    pub rows: &'static [RowKind],
    /// Description, for messages, of the stages that make such rows.
    pub from: Cow<'static, str>,
}

/// Parameters of a stage for one task, with defaults filled in.
pub trait Stage {
    /// Returns the kind of stage that has these parameters.
    fn kind(&self) -> Kind;

    /// Returns the versions that the recipe contains of parts of its numbers, beside the version of
    /// the stage.
    fn part_versions(&self) -> Vec<PartVersion> {
        Vec::new()
    }

    /// Computes the table of the task.
    ///
    /// # Errors
    /// Returns an error if an input lacks a column, a file has changed, a query cannot be answered,
    /// or the task is interrupted.
    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError>;

    /// Returns the table of the stage without rows, given the names and the empty tables of its
    /// inputs.
    ///
    /// # Errors
    /// Returns an error if a query cannot be answered or a column is missing.
    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError>;

    /// Returns whether the columns of the table depend on the parameters. If so, they may differ
    /// between the parameter points of the stage.
    fn columns_depend_on_params(&self) -> bool {
        false
    }

    /// Returns the expected cost of the task, which is used only by forecasts.
    fn effort(&self, extent: Extent) -> Effort;

    /// Returns which tables one task reads.
    fn input_scope(&self) -> InputScope {
        InputScope::Single
    }

    /// Returns whether the stage has a task that reads the table of `input`, one of its inputs.
    fn reads_input(&self, _input: &Recipe) -> bool {
        true
    }

    /// Returns which columns of its inputs the task reads: all, or only the light ones, without
    /// heights, maps and other large columns.
    fn columns_read(&self) -> Columns {
        Columns::Light
    }

    /// Reduces an input table to the columns that the stage needs, if these are known.
    fn needed(&self, table: Table) -> Table {
        table
    }

    /// Returns the parameter columns, with their values, that the task adds to those of its inputs,
    /// as far as they are known before the task runs.
    fn coordinates(&self) -> Vec<(Column, Value)> {
        Vec::new()
    }

    /// Returns the memory that the task needs per node of its mesh.
    fn footprint(&self) -> Footprint {
        Footprint::NONE
    }

    /// Returns the number of rows per surface in the task's table, given the number `read` of rows
    /// per surface in the table that it reads.
    fn rows(&self, read: usize) -> usize {
        read
    }

    /// Returns the numbers of nodes along x and y and the longer side of the cell, if the task
    /// creates a mesh.
    fn mesh(&self) -> Option<([usize; 2], f64)> {
        None
    }

    /// Returns the SQL query if the task answers one. A query reads each input as a separate table.
    fn query(&self) -> Option<&str> {
        None
    }

    /// Returns whether the task uses the column `name` of its inputs because the manifest names it
    /// in a query or as a column of groups.
    fn uses_column(&self, _name: &str) -> bool {
        false
    }

    /// Returns the recipe with `inputs` filled in: the name of each input stage and the number of
    /// its tables. Returns `None` if the recipe does not contain them.
    fn for_inputs(&self, _inputs: Vec<(String, usize)>) -> Option<Recipe> {
        None
    }

    /// Returns the recipe from which the keys of later stages are computed, if it differs from this
    /// recipe (see [`Recipe::identity`]).
    fn identity_recipe(&self) -> Option<Recipe> {
        None
    }

    /// Returns the series of the table: its rows, and the recipe that these rows share. The store
    /// then keeps single rows, and a table with further rows computes only these. Returns `None` if
    /// the rows depend on each other; the whole table is then stored under one key.
    ///
    /// `input` has the rows of the input, if there is a single input whose rows are independent.
    fn series(&self, _input: Option<&SeriesRows>) -> Option<Series> {
        None
    }

    /// Returns the recipe that computes only the rows with these values, and of the parts only
    /// those that `wanted` accepts. Only called if [`Stage::series`] returns rows.
    fn restricted(&self, _values: &[f64], _wanted: &dyn Fn(&Part) -> bool) -> Option<Recipe> {
        None
    }

    /// Returns the part from which the other parts can be computed, so that stored rows with this
    /// part need not be computed again for another part.
    fn source_part(&self) -> Option<Part> {
        None
    }

    /// Returns the recipe of the first rows of this table, with at least one row, if each row
    /// depends on the rows before it. If the store holds such a shorter table, the task continues
    /// from its last row. Returns `None` if the table has no more rows than this, or if its rows do
    /// not depend on each other.
    fn beginning(&self, _rows: usize) -> Option<Recipe> {
        None
    }

    /// Returns whether the task reads a part of the rows of its inputs. Parts that a task does not
    /// read are not part of its key.
    fn reads_part(&self, part: &Part) -> bool {
        self.columns_read() == Columns::All || !part.is_heavy
    }
}

/// Rows that do not depend on each other.
#[derive(Debug, Clone)]
pub struct Series {
    /// Recipe without the values of the rows and without parts. The key of the rows is computed
    /// from it.
    pub recipe: Recipe,
    pub rows: SeriesRows,
}

/// Receiver of the finished rows of a running task, so that they are kept if the process ends.
pub trait FinishedRows: Sync {
    /// Returns whether it is time to store the finished rows.
    fn are_due(&self) -> bool;

    /// Stores all finished rows: a table with the rows of these values, in ascending order.
    ///
    /// # Errors
    /// Returns an error if the disk is full or the folder is not writable.
    fn keep(&self, values: &[f64], rows: &Table) -> Result<(), StoreError>;
}

/// Returns an empty table with the parameter columns of the inputs and the columns `own` of the
/// stage.
///
/// # Errors
/// Returns an error if the inputs have columns of the same name with different types.
pub fn beside_coordinates(own: &[Column], inputs: &[(String, Table)]) -> Result<Table, TableError> {
    table_beside_coordinates(&Table::empty(own), inputs)
}

/// Returns an empty table with the parameter columns of the inputs and the columns of the table
/// `own`, which has no rows.
///
/// # Errors
/// As [`beside_coordinates`].
pub fn table_beside_coordinates(
    own: &Table,
    inputs: &[(String, Table)],
) -> Result<Table, TableError> {
    let mut coordinates = stacked(inputs)?.coordinates();
    // Descriptors of surfaces are coordinates of pairs and of surfaces that have yielded only.
    for (_, table) in inputs {
        let more = table.coordinates().without(&coordinates.names());
        coordinates = coordinates.beside(&more);
    }
    let names = coordinates.names();
    Ok(coordinates.beside(&own.without(&names)))
}

/// Stacks the input tables, as all stages except queries read them.
///
/// # Errors
/// Returns an error if the inputs have columns of the same name with different types.
pub fn stacked(inputs: &[(String, Table)]) -> Result<Table, TableError> {
    let tables: Vec<Table> = inputs.iter().map(|(_, table)| table.clone()).collect();
    Table::stack(&tables)
}

/// Tables of earlier stages that one task reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputScope {
    /// One table of one stage.
    Single,
    /// The tables of one parameter point.
    ParameterPoint,
    /// All tables of all inputs.
    All,
}

/// One input of a task.
pub struct Input<'a> {
    /// Recipe of the table, from which a surface without stored heights is drawn again.
    pub recipe: &'a Recipe,
    /// Recipe of the surface on which the table depends; `None` if there are several surfaces.
    pub surface: Option<&'a surface::Params>,
    pub table: Table,
}

/// Resources of a running task, none of which influences its numbers.
pub struct Context<'a> {
    /// Paths of the files of measured surfaces, by the hash of their content.
    pub sources: &'a SurfaceFiles,
    /// Memory limit of a task whose memory cannot be predicted, such as a query.
    pub memory: ByteSize,
    /// Threads that the task may use.
    pub threads: &'a Threads,
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Receiver of finished rows while the task is running.
    pub finished: &'a dyn FinishedRows,
    /// Stored rows of the task: those with their [source part](Stage::source_part), if the task
    /// only adds other parts to them, or those of a [beginning](Stage::beginning) of its table.
    pub stored: Option<&'a Table>,
    /// Reserves memory, in bytes, for another worker on the same surface until the task ends.
    /// Returns false if the memory is not free.
    pub reserve: &'a (dyn Fn(u64) -> bool + Sync),
    /// Callback that receives the finished fraction of the task, from 0 to 1.
    pub advance: &'a (dyn Fn(f64) + Sync),
}

/// Memory that a task needs per node of its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Bytes per node during the computation of the table.
    pub work: f64,
    /// Bytes per node of the maps in the table of the task.
    pub table: f64,
}

impl Footprint {
    /// Footprint of a task without maps.
    pub const NONE: Footprint = Footprint { work: 0.0, table: 0.0 };
}

/// Size of the inputs of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Number of nodes of a surface along x and y.
    pub nodes: [usize; 2],
    /// Longer side of the cell, in the unit of the surface.
    pub longer_side: f64,
    /// Number of rows per surface, see [`Stage::rows`].
    pub rows: usize,
    pub tables: usize,
}

/// Expected cost of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Number of pairs of Fourier transforms on the task's mesh.
    pub pairs: f64,
    /// Time of all other work, in seconds.
    pub seconds: f64,
}

/// Time that every task takes for its key, Parquet encoding, checksum and file. On meshes of 32²
/// nodes this is nearly the whole cost.
const HANDLING_SECONDS: f64 = 2e-3;
/// Time to read one table from the store.
const READING_SECONDS: f64 = 4e-4;

impl Effort {
    /// Returns the cost of a task that computes this number of pairs of transforms.
    pub fn pairs(pairs: f64) -> Effort {
        Effort { pairs, seconds: HANDLING_SECONDS }
    }

    /// Returns the cost of a task that computes for this number of seconds.
    pub fn seconds(seconds: f64) -> Effort {
        Effort { pairs: 0.0, seconds: HANDLING_SECONDS + seconds }
    }

    /// Adds the cost of reading a number of tables.
    pub fn and_reading(self, tables: usize) -> Effort {
        Effort { seconds: self.seconds + READING_SECONDS * tables as f64, ..self }
    }
}

/// Returns the number in the first row of a column, if there is one.
pub fn first_real(table: &Table, column: Column) -> Result<Option<f64>, TableError> {
    let values = table.optional(column.name, Table::reals)?;
    Ok(values.and_then(|values| values.iter().next().flatten()))
}

/// Passes one column to `with` in parts, because a whole table may not fit into memory. Returns
/// whether the table has the column.
fn each_part(
    source: &TableSource,
    name: &str,
    mut with: impl FnMut(&Table) -> Result<(), StageError>,
) -> Result<bool, StageError> {
    let Some(column) = source.names().iter().position(|known| known == name) else {
        return Ok(false);
    };
    for part in source.parts(&[column]) {
        with(&part.map_err(StageError::Store)?)?;
    }
    Ok(true)
}

/// Formats the range of a column like `κ 2.5066 … 2.7500`, or `Sq 0.2000 µm` if the table names the
/// unit; `None` if it has no values.
///
/// # Errors
/// Returns an error if the column holds no numbers or is damaged.
pub fn range(source: &TableSource, name: &str, label: &str) -> Result<Option<String>, StageError> {
    let schema = source.schema();
    let column = absolute_column(&schema, name);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    each_part(source, column, |part| {
        let values = || Ok::<_, StageError>(part.reals(column)?.iter().flatten());
        least = values()?.fold(least, f64::min);
        most = values()?.fold(most, f64::max);
        Ok(())
    })?;
    if least > most {
        return Ok(None);
    }
    let units = TableUnits::from_source(source).map_err(StageError::Store)?;
    let shown = schema.field_with_name(column).ok().and_then(|field| units.shown_of(field));
    let unit = shown.map_or_else(String::new, |unit| format!(" {unit}"));
    Ok(Some(if least == most {
        format!("{label} {}{unit}", number(least))
    } else {
        format!("{label} {} … {}{unit}", number(least), number(most))
    }))
}

/// Returns the largest number in a column; `None` if it has no values or the table lacks it.
///
/// # Errors
/// Returns an error if the column holds no numbers or is damaged.
pub fn largest(source: &TableSource, name: &str) -> Result<Option<f64>, StageError> {
    let mut most: Option<f64> = None;
    each_part(source, name, |part| {
        let values = part.reals(name)?.iter().flatten();
        most = most.into_iter().chain(values).reduce(f64::max);
        Ok(())
    })?;
    Ok(most)
}

/// Formats a number with four decimals, or in scientific notation if it is smaller than 10⁻³.
pub fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:.4e}") } else { format!("{value:.4}") }
}

/// Returns the distinct texts of a column, in order of appearance.
///
/// # Errors
/// Returns an error if the column holds no texts or is damaged.
pub fn distinct(source: &TableSource, name: &str) -> Result<Vec<String>, StageError> {
    let mut found: Vec<String> = Vec::new();
    each_part(source, name, |part| {
        for text in part.texts(name)?.iter().flatten() {
            if !found.iter().any(|known| known == text) {
                found.push(text.to_owned());
            }
        }
        Ok(())
    })?;
    Ok(found)
}
