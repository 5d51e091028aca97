//! What every kind of stage is asked, what it is given and what it tells: its definition, its
//! parameters and what follows from them, its work in a study, its errors.

use std::borrow::Cow;

use bytesize::ByteSize;

use crate::aggregate::sql::QueryError;
use crate::generate::growth::PlannedSurfaces;
use crate::generate::map_file::MapFileError;
use crate::surface_files::{SurfaceFileError, SurfaceFiles};
use crate::{Kind, Recipe, Rows, generate};
use asperity_contact::asperities::NoSummits;
use asperity_contact::morphology::map::MapError;
use asperity_contact::solver::HardnessError;
use asperity_contact::threads::Threads;
use asperity_contact::topography::preparation::PreparationError;
use asperity_contact::topography::spectral_density::SpectralDensityError;
use asperity_contact::topography::surface::SurfaceError;
use asperity_tables::column::{Column, Value};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::store::StoreError;
use asperity_tables::store::checkpoints::Checkpoints;
use asperity_tables::table::{Table, TableError};

/// What is known of a kind of stage without its parameters.
pub struct Definition {
    /// The word used in manifests, tables and recipes.
    pub name: &'static str,
    /// The version of its numbers: raised whenever they change.
    pub version: u32,
    pub reads: Reads,
    /// What its rows are about, given those that it reads; `None` where that cannot be told.
    pub makes: fn(Option<Rows>) -> Option<Rows>,
    /// Every column that it may add to the coordinates that it carries on.
    pub columns: fn() -> Vec<Column>,
    /// What its table has found, in a few words each.
    pub summary: fn(&TableSource) -> Result<Vec<String>, StageError>,
}

/// What a stage can read; each alone, never one beside the other.
#[derive(Debug, Clone)]
pub struct Reads {
    /// What the rows may be about.
    pub rows: &'static [Rows],
    /// Which stages give them, for messages.
    pub from: Cow<'static, str>,
}

/// One stage's parameters for one task, defaults filled in, and what follows from them.
pub trait Stage {
    /// The kind of stage that has these parameters.
    fn kind(&self) -> Kind;

    /// Computes the task's table.
    ///
    /// # Errors
    /// When an input lacks a column, a file has changed, a query is wrong, or on interruption.
    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError>;

    /// The stage's table without rows, given those of the stages that it reads and their names.
    ///
    /// # Errors
    /// When a query cannot be answered, or a column is missing.
    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError>;

    /// Whether the columns of its table depend on its parameters: those of a stage may differ then
    /// from point to point of its grid.
    fn has_columns_of_its_own(&self) -> bool {
        false
    }

    /// What the task is expected to cost. Nothing but forecasts depends on it.
    fn effort(&self, extent: Extent) -> Effort;

    /// How much one task reads.
    fn reach(&self) -> Reach {
        Reach::Single
    }

    /// Which columns of its inputs it reads: heights and contact maps are large.
    fn columns_read(&self) -> Columns {
        Columns::Light
    }

    /// Reduces an input table to the columns that the stage needs, where these are known.
    fn needed(&self, table: Table) -> Table {
        table
    }

    /// The coordinates that the task adds to those of what it reads, where they are known before
    /// it has run.
    fn coordinates(&self) -> Vec<(Column, Value)> {
        Vec::new()
    }

    /// What the task needs of memory for each node of its mesh.
    fn footprint(&self) -> Footprint {
        Footprint::NONE
    }

    /// Rows about one surface in the task's table, or in those that it pools; `read` are those in
    /// the table that it reads.
    fn rows(&self, read: usize) -> usize {
        read
    }

    /// Nodes along x and y of the mesh, where the task makes one.
    fn mesh(&self) -> Option<[usize; 2]> {
        None
    }

    /// The query, where it is one: it looks at each of its inputs as a table of its own.
    fn query(&self) -> Option<&str> {
        None
    }

    /// The recipe for inputs with these names, each of so many tables, where that is a part of it.
    fn over(&self, _inputs: Vec<(String, usize)>) -> Option<Recipe> {
        None
    }

    /// The recipe that later keys are built on, if it is another one: this one without what only
    /// adds columns that no later stage reads.
    fn identity_recipe(&self) -> Option<Recipe> {
        None
    }
}

/// What a stage adds to the coordinates of the rows that it reads, without rows.
///
/// # Errors
/// When the inputs have columns of one name and different types.
pub fn beside_coordinates(own: &[Column], inputs: &[(String, Table)]) -> Result<Table, TableError> {
    let above = stacked(inputs)?.coordinates();
    let names = above.names();
    Ok(above.beside(&Table::empty(own).without(&names)))
}

/// The tables one under the other, as a stage reads them that is no query.
///
/// # Errors
/// When they have columns of one name and different types.
pub fn stacked(inputs: &[(String, Table)]) -> Result<Table, TableError> {
    let tables: Vec<Table> = inputs.iter().map(|(_, table)| table.clone()).collect();
    Table::stack(&tables)
}

/// How much one task reads of the stages before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// One table.
    Single,
    /// The tables of one parameter point.
    Point,
    /// All tables.
    All,
}

/// One input of a task: its table and the recipe that made it.
pub struct Input<'a> {
    /// How the table was made; a surface whose heights were not kept is drawn again from it.
    pub recipe: &'a Recipe,
    pub table: Table,
}

/// What a running task may reach besides its inputs. Nothing in it decides a number.
pub struct Context<'a> {
    /// Where the files of measured surfaces lie, by the hash of their content.
    pub sources: &'a SurfaceFiles,
    /// Memory that the task may take where its need is not known beforehand.
    pub memory: ByteSize,
    /// The threads that it may share its work among.
    pub threads: &'a Threads,
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Where a long task keeps how far it has come.
    pub checkpoints: &'a dyn Checkpoints,
    /// Hears which share of the task is done, from 0 to 1.
    pub advance: &'a (dyn Fn(f64) + Sync),
}

/// What a task needs of memory, for each node of its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Bytes while it computes.
    pub work: f64,
    /// Bytes of its table, with everything that is a map.
    pub table: f64,
}

impl Footprint {
    /// No maps.
    pub const NONE: Footprint = Footprint { work: 0.0, table: 0.0 };
}

/// How much a task has at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Nodes of a surface along x and y.
    pub nodes: [usize; 2],
    /// Rows about it, see [`Stage::rows`].
    pub rows: usize,
    pub tables: usize,
}

/// What a task is expected to cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Pairs of transforms on the task's mesh.
    pub pairs: f64,
    /// Seconds of anything else.
    pub seconds: f64,
}

/// Seconds for the handling of any task: key, Parquet, checksum, file. On meshes of 32² there is
/// hardly anything else.
const HANDLING: f64 = 2e-3;
/// Seconds to read a table from the store.
const READING: f64 = 4e-4;

impl Effort {
    /// A number of pairs, besides the handling.
    pub fn pairs(pairs: f64) -> Effort {
        Effort { pairs, seconds: HANDLING }
    }

    /// No transforms; so many seconds besides the handling.
    pub fn seconds(seconds: f64) -> Effort {
        Effort { pairs: 0.0, seconds: HANDLING + seconds }
    }

    /// The same, and so many tables are read before.
    pub fn and_reading(self, tables: usize) -> Effort {
        Effort { seconds: self.seconds + READING * tables as f64, ..self }
    }
}

/// What a stage does, the points of its grid in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    Generate(Vec<PlannedSurfaces>),
    /// Reads what other stages made, by each of these recipes; there is at least one, and all are
    /// of one kind.
    Evaluate(Vec<Recipe>),
}

impl Work {
    /// The kind of stage that does it.
    pub fn kind(&self) -> Kind {
        match self {
            Work::Generate(_) => Kind::Generate,
            Work::Evaluate(recipes) => recipes.first().expect("a grid has a point").kind(),
        }
    }

    /// The recipes by which it reads other stages.
    pub fn recipes(&self) -> &[Recipe] {
        match self {
            Work::Generate(_) => &[],
            Work::Evaluate(recipes) => recipes,
        }
    }

    /// An upper bound on the number of its tasks, given that of its inputs.
    pub fn tasks(&self, inputs: usize) -> usize {
        match self {
            Work::Generate(surfaces) => {
                let tasks = surfaces.iter().map(|surfaces| {
                    let spectra = match surfaces.params.origin.reads_stage() {
                        true => inputs,
                        false => 1,
                    };
                    spectra.saturating_mul(surfaces.at_most() as usize)
                });
                tasks.fold(0, usize::saturating_add)
            }
            Work::Evaluate(recipes) => {
                let tasks = recipes.iter().map(|recipe| match recipe.reach() {
                    Reach::Single | Reach::Point => inputs,
                    Reach::All => 1,
                });
                tasks.fold(0, usize::saturating_add)
            }
        }
    }

    /// Its stage's table without rows, given those of the stages that it reads and their names.
    ///
    /// # Errors
    /// When a query cannot be answered, or a column is missing that the work needs.
    pub fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let recipes = match self {
            Work::Generate(surfaces) => {
                let params = surfaces.iter().map(|surfaces| &surfaces.params);
                return Ok(generate::empty_table(params));
            }
            Work::Evaluate(recipes) => recipes,
        };
        let mut tables = Vec::new();
        for recipe in recipes {
            tables.push(recipe.empty_table(inputs)?);
            if !recipe.has_columns_of_its_own() {
                break;
            }
        }
        Ok(Table::stack(&tables)?)
    }
}

/// Passes one column to `with` part by part, for tables that do not fit into memory. Returns
/// whether there is such a column.
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

/// Smallest and largest value of a column, if there is one.
///
/// # Errors
/// When it holds no numbers, or is damaged.
pub fn range(source: &TableSource, name: &str, label: &str) -> Result<Option<String>, StageError> {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    each_part(source, name, |part| {
        let values = || Ok::<_, StageError>(part.reals(name)?.iter().flatten());
        least = values()?.fold(least, f64::min);
        most = values()?.fold(most, f64::max);
        Ok(())
    })?;
    Ok((least <= most).then(|| match least == most {
        true => format!("{label} {}", number(least)),
        false => format!("{label} {} … {}", number(least), number(most)),
    }))
}

/// Four decimals, and four digits behind the first where these would be none.
fn number(value: f64) -> String {
    match value != 0.0 && value.abs() < 1e-3 {
        true => format!("{value:.4e}"),
        false => format!("{value:.4}"),
    }
}

/// A column's texts, each once, in order of appearance.
///
/// # Errors
/// When it holds no texts, or is damaged.
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

/// Why a task has no table.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// An input table is not what the stage reads.
    #[error("cannot use an input table")]
    Table(#[from] TableError),
    /// The file of a measured surface is gone or has changed.
    #[error("cannot read a measured surface")]
    Source(#[from] SurfaceFileError),
    /// Heights, stored or scaled, are no surface.
    #[error("these heights are no surface")]
    Heights(#[source] SurfaceError),
    /// The material is pressed by more than it bears.
    #[error("the material does not bear the load, both in units of E* × rms slope")]
    Hardness(#[from] HardnessError),
    /// A surface has no asperities.
    #[error("asperities cannot be pressed")]
    NoSummits(#[from] NoSummits),
    /// A stored contact map does not fit its mesh.
    #[error("a stored contact map does not fit its mesh")]
    Map(#[source] MapError),
    /// The file of a measured surface is no map of heights.
    #[error("`{path}` is no usable surface")]
    Measured { path: String, source: Box<MapFileError> },
    /// A measured surface cannot be prepared as asked.
    #[error("`{path}` cannot be prepared as asked")]
    Preparation { path: String, source: PreparationError },
    /// A file holds no power spectral density.
    #[error("`{path}` {reason}")]
    SpectrumFile { path: String, reason: String },
    /// A measured spectrum is no power spectral density.
    #[error("a measured spectrum is no power spectral density")]
    SpectralDensity(#[source] SpectralDensityError),
    /// A mesh has no waves in the range of a spectrum.
    #[error(
        "no wave of the mesh has a density: the spectrum goes from wavenumber {from:.4e} to {to:.4e}"
    )]
    NoModes {
        /// The smallest wavenumber with a density.
        from: f64,
        /// The largest.
        to: f64,
    },
    /// Heights were to be drawn again whose spectrum is in another task's table.
    #[error("heights with the spectrum of another stage were not kept")]
    NotKept,
    /// A table that a query reads is damaged.
    #[error(transparent)]
    Store(StoreError),
    /// A query has no answer.
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// An aggregation cannot be carried out.
    #[error("cannot aggregate: {reason}")]
    Aggregate { reason: String },
}
