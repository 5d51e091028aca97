//! The closed set of stages: what each may compute, and the only `match` on it.
//!
//! A stage has four things: a `VERSION` (raised whenever its numbers change), `Params` (what it
//! reads of the manifest, defaults filled in), a `columns` list, and `run`, a function of its
//! parameters and input tables and of nothing else: no clock, no environment, no thread number.

pub mod aggregate;
#[expect(missing_docs, reason = "each column says what it means")]
pub mod columns;
pub mod correct;
pub mod fit;
pub mod generate;
pub mod measure;
pub mod solve;

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use aggregate::sql::QueryError;

use crate::contact::morphology::map::MapError;
use crate::contact::topography::measured::MeasuredError;
use crate::contact::topography::surface::SurfaceError;
use crate::store::column::{Column, Value};
use crate::store::parquet::Columns;
use crate::store::table::{Table, TableError};
use crate::surface_files::{SurfaceFileError, SurfaceFiles};

/// What kind of work a stage does; the word after `kind =` in a manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Draws surfaces or reads measured ones.
    Generate,
    /// Presses surfaces, load after load.
    Solve,
    /// Counts contacts, or heights.
    Measure,
    /// Corrects the contact area for the mesh.
    Correct,
    /// Fits laws to the pooled surfaces of one parameter point.
    Fit,
    /// Reduces tables to statistics.
    Aggregate,
}

impl Kind {
    /// Every kind, in the order of a study.
    pub const ALL: [Kind; 6] = [
        Kind::Generate,
        Kind::Solve,
        Kind::Measure,
        Kind::Correct,
        Kind::Fit,
        Kind::Aggregate,
    ];

    /// The word used in manifests, tables and recipes.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Generate => "generate",
            Kind::Solve => "solve",
            Kind::Measure => "measure",
            Kind::Correct => "correct",
            Kind::Fit => "fit",
            Kind::Aggregate => "aggregate",
        }
    }

    /// The version of the stage's numbers.
    pub fn version(self) -> u32 {
        match self {
            Kind::Generate => generate::VERSION,
            Kind::Solve => solve::VERSION,
            Kind::Measure => measure::VERSION,
            Kind::Correct => correct::VERSION,
            Kind::Fit => fit::VERSION,
            Kind::Aggregate => aggregate::VERSION,
        }
    }
}

/// Every column that stages of a kind may add to the coordinates that they carry on.
pub fn columns_of(kind: Kind) -> Vec<Column> {
    use columns::*;
    let lists: &[&[Column]] = match kind {
        Kind::Generate => &[
            &[SURFACE, METHOD, NODES, SIDE, RMS_SLOPE],
            &OF_RANDOM_SURFACES,
            &OF_MEASURED_SURFACES,
            &OF_SHAPES,
            &DESCRIPTORS,
            &REFERENCES,
            &[HEIGHTS],
        ],
        Kind::Solve => &[&SOLVED, &[CONTACT, PRESSURES]],
        Kind::Measure => &[&CONTACT_MEASURES, &HEIGHT_MEASURES, &POOLED_HEIGHTS[1..]],
        Kind::Correct => &[&CORRECTED],
        Kind::Fit => return fit::columns(),
        Kind::Aggregate => return aggregate::columns(),
    };
    lists.concat()
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// Everything that a task reads of its manifest: enough to compute it again from its inputs.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Recipe {
    /// Draw or read one surface.
    Generate(generate::Params),
    /// Press one surface through one block of loads.
    Solve(Arc<solve::Params>),
    /// Measure one solved block, or one surface.
    Measure(measure::Params),
    /// Correct one measured block.
    Correct(Arc<correct::Params>),
    /// Fit one parameter point, or all points together.
    Fit(Arc<fit::Params>),
    /// Reduce whole tables.
    Aggregate(Arc<aggregate::Params>),
}

/// One input of a task: its table and the recipe that made it.
pub struct Input<'a> {
    /// How the table was made; a surface whose heights were not kept is drawn again from it.
    pub recipe: &'a Recipe,
    /// What was computed.
    pub table: Table,
}

/// What a running task may reach besides its inputs. Nothing in it decides a number.
pub struct Context<'a> {
    /// Where the files of measured surfaces lie, by the hash of their content.
    pub sources: &'a SurfaceFiles,
    /// Whether the user asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Hears which share of the task is done, from 0 to 1.
    pub advance: &'a (dyn Fn(f64) + Sync),
}

impl Recipe {
    /// The kind of stage that this recipe belongs to.
    pub fn kind(&self) -> Kind {
        match self {
            Recipe::Generate(_) => Kind::Generate,
            Recipe::Solve(_) => Kind::Solve,
            Recipe::Measure(_) => Kind::Measure,
            Recipe::Correct(_) => Kind::Correct,
            Recipe::Fit(_) => Kind::Fit,
            Recipe::Aggregate(_) => Kind::Aggregate,
        }
    }

    /// Which columns of its inputs it reads: only solving and measuring look at heights and contact
    /// maps, of one surface at a time.
    pub fn columns_read(&self) -> Columns {
        match self.kind() {
            Kind::Measure if self.pools_surfaces() => Columns::Light,
            Kind::Generate | Kind::Solve | Kind::Measure => Columns::All,
            Kind::Correct | Kind::Fit | Kind::Aggregate => Columns::Light,
        }
    }

    /// The recipe without what only adds columns that no later stage reads: kept heights and
    /// kept pressures. Later keys are built on it, so keeping more never recomputes them.
    pub fn essence(&self) -> Cow<'_, Recipe> {
        match self {
            Recipe::Generate(params) if params.keeps_heights() => {
                Cow::Owned(Recipe::Generate(params.essence()))
            }
            Recipe::Solve(params) if params.keeps_pressures() => {
                Cow::Owned(Recipe::Solve(Arc::new(params.without_pressures())))
            }
            other => Cow::Borrowed(other),
        }
    }

    /// Computes the task's table.
    ///
    /// # Errors
    /// When an input lacks a column, a file has changed, a query is wrong, or on interruption.
    pub fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        match self {
            Recipe::Generate(params) => generate::run(params, context),
            Recipe::Solve(params) => solve::run(params, inputs, context),
            Recipe::Measure(params) => measure::run(params, inputs, context),
            Recipe::Correct(params) => correct::run(params, inputs),
            Recipe::Fit(params) => fit::run(params, inputs),
            Recipe::Aggregate(params) => aggregate::run(params, inputs),
        }
    }

    /// Whether one task reads all surfaces of a parameter point.
    pub fn pools_surfaces(&self) -> bool {
        matches!(self, Recipe::Measure(params) if params.pools_surfaces())
    }

    /// The coordinates that the task adds to those of what it reads, where they are known before
    /// it has run.
    pub fn coordinates(&self) -> Vec<(Column, Value)> {
        match self {
            Recipe::Generate(params) => params.coordinates(),
            Recipe::Solve(params) => params.coordinates(),
            _ => Vec::new(),
        }
    }

    /// What the task needs of memory for each node of its mesh.
    pub fn footprint(&self) -> Footprint {
        match self {
            Recipe::Generate(params) => params.footprint(),
            Recipe::Solve(params) => params.footprint(),
            Recipe::Measure(_) => measure::FOOTPRINT,
            Recipe::Correct(_) | Recipe::Fit(_) | Recipe::Aggregate(_) => Footprint::NONE,
        }
    }

    /// Rows about one surface in the task's table, or in those that it pools; `read` are those in
    /// the table that it reads.
    pub fn rows(&self, read: usize) -> usize {
        match self {
            Recipe::Generate(_) => 1,
            Recipe::Solve(params) => params.loads.len(),
            Recipe::Correct(params) => read * params.corrections.len(),
            Recipe::Measure(_) | Recipe::Fit(_) | Recipe::Aggregate(_) => read,
        }
    }

    /// What the task is expected to cost. Nothing but forecasts depends on it.
    pub fn effort(&self, extent: Extent) -> Effort {
        /// Seconds to read a table from the store.
        const READING: f64 = 4e-4;
        let effort = match self {
            Recipe::Generate(params) => params.effort(),
            Recipe::Solve(params) => params.effort(extent.nodes),
            Recipe::Measure(params) => params.effort(extent),
            Recipe::Correct(_) => Effort::seconds(0.0),
            Recipe::Fit(params) => params.effort(extent.rows),
            Recipe::Aggregate(params) => params.effort(extent.rows),
        };
        Effort {
            seconds: effort.seconds + READING * extent.tables as f64,
            ..effort
        }
    }
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
    pub const NONE: Footprint = Footprint {
        work: 0.0,
        table: 0.0,
    };
}

/// How much a task has at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Nodes per side of a surface.
    pub nodes: usize,
    /// Rows about it, see [`Recipe::rows`].
    pub rows: usize,
    /// Tables that are read.
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

impl Effort {
    /// A number of pairs, besides the handling.
    pub fn pairs(pairs: f64) -> Effort {
        Effort {
            pairs,
            seconds: HANDLING,
        }
    }

    /// No transforms; so many seconds besides the handling.
    pub fn seconds(seconds: f64) -> Effort {
        Effort {
            pairs: 0.0,
            seconds: HANDLING + seconds,
        }
    }
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
    /// A stored contact map does not fit its mesh.
    #[error("a stored contact map does not fit its mesh")]
    Map(#[source] MapError),
    /// The file of a measured surface is no map of heights.
    #[error("`{path}` is no usable surface")]
    Measured {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: MeasuredError,
    },
    /// A query has no answer.
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// An aggregation cannot be carried out.
    #[error("cannot aggregate: {reason}")]
    Aggregate {
        /// What polars, or a check before it, says.
        reason: String,
    },
}
