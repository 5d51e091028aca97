//! Kinds of stage of a study. Each kind declares and checks its keys in a manifest and computes
//! tables from tables.
//!
//! A table depends only on the `VERSION` of the stage, its parameters and its input tables. It does
//! not depend on the clock, the environment or the number of threads.
//!
//! | module | content |
//! |---|---|
//! | [`registry`] | lists the kinds: the keys that each has, and its work at all parameter points |
//! | [`generate`] | draws random surfaces, creates shapes, reads measured surfaces |
//! | [`solve`] | solves the contact of surfaces under loads |
//! | [`measure`] | measures contact maps and surfaces |
//! | [`correct`] | corrects contact areas for the mesh |
//! | [`fit`] | fits laws to single parameter points, and limits of observables to all points |
//! | [`aggregate`] | computes statistics of groups of rows, and answers SQL queries |
//! | [`error_budget`] | errors of means: sampling, mesh, cell and solver |
//! | [`departures`] | finds surfaces that are not isotropic Gaussian roughness |
//! | `stage`, [`error`] | interface of all stages: [`Definition`], [`Stage`], [`StageError`] |
//! | [`check_context`] | what checks of keys know about the study |
//! | [`nominal_area`] | pressures under loads that are forces |
//! | [`stage_points`] | parameter points of a stage, variants of its keys, and its work |
//! | [`surface`] | recipe of a surface, from which any stage draws it again |
//! | [`reduced_units`], [`unloading`], [`bodies`] | units of the solver; yielding; the two bodies |
//! | [`columns`], `table_columns` | all columns; the columns of a table with their values |
//! | [`grids`], [`per_axis`] | grids of surfaces; values along x and y |
//! | [`ensemble`] | grouping of rows by parameter point, surface and load |
//! | [`units`], [`absolute`] | names of the units of a table; reduced numbers in these units |
//! | [`version`] | versions of numbers, with the reasons for which they were raised |
//! | [`output_units`] | conversion of tables to other units for output |
//! | [`map_file`], [`surface_files`], [`spectrum_files`] | files of measured surfaces and spectra |
//!
//! No modules use each other in a circle: the kinds use the modules below them in this table, and
//! only [`registry`] and this file list all kinds of this crate. A new kind of stage has its own
//! file and folder, and is added to these two files.

// Tests compare with tolerances.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod absolute;
pub mod aggregate;
pub mod bodies;
pub mod check_context;
pub mod columns;
pub mod correct;
pub mod departures;
pub mod ensemble;
pub mod error;
pub mod error_budget;
pub mod fit;
pub mod generate;
pub mod grids;
pub mod map_file;
pub mod measure;
pub mod nominal_area;
pub mod output_units;
pub mod per_axis;
pub mod reduced_units;
pub mod registry;
pub mod solve;
pub mod spectrum_files;
mod stage;
pub mod stage_points;
pub mod surface;
pub mod surface_files;
mod table_columns;
pub mod units;
pub mod unloading;
pub mod version;

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use asperity_mechanics::distribution::EqualBins;
use asperity_tables::column::Column;

pub use check_context::CheckContext;
pub use error::StageError;
pub use stage::{
    ContactLoads, Context, Definition, Effort, Extent, FinishedRows, Footprint, Input, InputScope,
    Reads, Series, Stage, beside_coordinates, stacked, table_beside_coordinates,
};
pub use stage_points::Work;

/// Kind of a stage, as given by `kind =` in a manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    Generate,
    Solve,
    Measure,
    Correct,
    Fit,
    Aggregate,
}

impl Kind {
    /// All kinds, in the order in which a study uses them.
    pub const ALL: [Kind; Kind::Aggregate as usize + 1] =
        [Kind::Generate, Kind::Solve, Kind::Measure, Kind::Correct, Kind::Fit, Kind::Aggregate];

    /// Returns the properties of the kind that do not depend on parameters.
    pub fn definition(self) -> &'static Definition {
        match self {
            Kind::Generate => &generate::STAGE,
            Kind::Solve => &solve::STAGE,
            Kind::Measure => &measure::STAGE,
            Kind::Correct => &correct::STAGE,
            Kind::Fit => &fit::STAGE,
            Kind::Aggregate => &aggregate::STAGE,
        }
    }

    /// Returns the name of the kind in manifests, tables and recipes.
    pub fn name(self) -> &'static str {
        self.definition().name
    }

    /// Returns whether a task makes one surface or describes a single one, and does not compute
    /// from the rows of several.
    pub fn depends_on_one_surface(self) -> bool {
        match self {
            Kind::Generate | Kind::Solve | Kind::Measure | Kind::Correct => true,
            Kind::Fit | Kind::Aggregate => false,
        }
    }

    /// Returns the version of the numbers that the stage computes.
    pub fn version(self) -> u32 {
        self.definition().version.number()
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// Returns all columns that stages of a kind may add to the parameter columns of their inputs.
pub fn columns_of(kind: Kind) -> Vec<Column> {
    (kind.definition().columns)()
}

/// Declares the kinds of rows with their names.
macro_rules! row_kinds {
    ($($kind:ident = $name:literal,)+) => {
        /// Kind of rows in the table of a stage.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum RowKind {
            $($kind),+
        }

        impl RowKind {
            /// All kinds of rows.
            pub const ALL: &[RowKind] = &[$(RowKind::$kind),+];

            /// Returns the name of the rows in messages.
            pub fn name(self) -> &'static str {
                match self {
                    $(RowKind::$kind => $name),+
                }
            }
        }
    };
}

row_kinds! {
    Surfaces = "surfaces",
    Spectra = "surfaces without heights",
    Profiles = "profiles",
    Loads = "solved loads",
    Contacts = "measured contacts",
    PressureDistributions = "distributions of pressures",
    GapDistributions = "distributions of gaps",
    ClusterDistributions = "distributions of clusters",
    PartialSlip = "partial slip",
    Heights = "measured heights",
    PowerSpectra = "power spectra",
    ProfileSpectra = "power spectra of profiles",
    Autocorrelations = "autocorrelations",
    Scales = "slopes and curvatures by scale",
    BearingCurves = "bearing curves",
    Roughness = "roughness parameters",
    Corrections = "corrected areas",
    Fits = "fits",
    Statistics = "statistics",
}

/// Parameters of one task. Together with the input tables they determine the table of the task.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Recipe {
    /// Parameters for drawing or reading one surface.
    Generate(surface::Params),
    /// Parameters for solving the contact of one surface under loads.
    Solve(Arc<solve::Params>),
    /// Parameters for solving the contact of one surface with adhesion, along a path.
    Adhesion(Arc<solve::adhesion::Params>),
    /// Parameters for measuring one surface under its loads, one surface, or all surfaces of a
    /// point.
    Measure(measure::Params),
    /// Parameters for correcting the areas of one surface under its loads.
    Correct(Arc<correct::Params>),
    /// Parameters for fitting one parameter point, or all points together.
    Fit(Arc<fit::Params>),
    /// Parameters for reducing all input tables to statistics, or for querying them.
    Aggregate(Arc<aggregate::Params>),
}

impl Deref for Recipe {
    type Target = dyn Stage;

    fn deref(&self) -> &(dyn Stage + 'static) {
        match self {
            Recipe::Generate(params) => params,
            Recipe::Solve(params) => params.as_ref(),
            Recipe::Adhesion(params) => params.as_ref(),
            Recipe::Measure(params) => params,
            Recipe::Correct(params) => params.as_ref(),
            Recipe::Fit(params) => params.as_ref(),
            Recipe::Aggregate(params) => params.as_ref(),
        }
    }
}

impl Recipe {
    /// Returns the recipe from which the keys of later stages are computed.
    ///
    /// It omits parameters that only add columns which no later stage reads. Later stages are
    /// therefore not recomputed if a study stores more columns.
    pub fn identity(&self) -> Cow<'_, Recipe> {
        match self.identity_recipe() {
            Some(recipe) => Cow::Owned(recipe),
            None => Cow::Borrowed(self),
        }
    }

    /// Returns the bins in which a contact counts its pressures and its gaps, if it counts them.
    pub fn bins(&self) -> [Option<EqualBins>; 2] {
        match self {
            Recipe::Solve(params) => [params.pressure_bins, params.gap_bins],
            Recipe::Adhesion(params) => [params.pressure_bins, params.gap_bins],
            _ => [None; 2],
        }
    }

    /// Returns whether only the concatenation of the inputs matters, so that consecutive tables can
    /// be given as one.
    pub fn stacks_inputs(&self) -> bool {
        !self.kind().depends_on_one_surface() && self.query().is_none()
    }

    /// Returns whether the recipe fits the limit of an observable.
    pub fn is_fit_of_limits(&self) -> bool {
        matches!(self, Recipe::Fit(params) if matches!(params.law, fit::laws::Law::Limits(_)))
    }

    /// Returns whether the recipe computes multilevel means.
    pub fn is_multilevel(&self) -> bool {
        let is_multilevel =
            |params: &aggregate::Params| matches!(params, aggregate::Params::Multilevel(_));
        matches!(self, Recipe::Aggregate(params) if is_multilevel(params))
    }

    /// Returns whether one task draws all surfaces of a parameter point.
    pub fn pools_surfaces(&self) -> bool {
        self.input_scope() == InputScope::ParameterPoint && self.footprint() != Footprint::NONE
    }
}
