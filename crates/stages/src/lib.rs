//! The kinds of stage of a study: which keys each has, how they are checked, and how a task of each
//! computes its table.
//!
//! A table is a function of the stage's `VERSION`, its parameters and its input tables, and of
//! nothing else: no clock, no environment, no thread number.
//!
//! | module | holds |
//! |---|---|
//! | [`generate`] | draws random surfaces, makes shapes, reads measured surfaces |
//! | [`solve`] | presses surfaces, load after load |
//! | [`measure`] | measures contact maps and surfaces |
//! | [`correct`] | corrects contact areas for the mesh |
//! | [`fit`] | fits laws to the surfaces of a parameter point, and limits to all points |
//! | [`aggregate`] | reduces tables to statistics within groups, and answers queries in SQL |
//! | `stage` | what every stage answers: [`Definition`], [`Stage`], [`Work`], [`StageError`] |
//! | [`form`] | which keys a stage has, and what they are checked against |
//! | [`columns`], [`grids`] | every column; how tables hold the mesh of a surface |
//! | [`ensemble`] | which rows are about one parameter point, one surface, one load |
//! | [`surface_files`], [`spectrum_files`] | files of measured surfaces and spectra |
//! | [`caveats`] | surfaces that are not what theories of rough contact assume |
//!
//! Everything about a kind of stage is in its own file and folder. A new kind is added to the
//! matches in this file and in [`form`].

pub mod aggregate;
pub mod caveats;
pub mod columns;
pub mod correct;
pub mod ensemble;
pub mod fit;
pub mod form;
pub mod generate;
pub mod grids;
pub mod measure;
pub mod solve;
pub mod spectrum_files;
mod stage;
pub mod surface_files;

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use asperity_tables::column::Column;

pub use form::Given;
pub use stage::{
    Context, Definition, Effort, Extent, Footprint, Input, Reach, Reads, Stage, StageError, Work,
    beside_coordinates, stacked,
};

/// What kind of work a stage does; the word after `kind =` in a manifest.
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
    /// Every kind, in the order of a study.
    pub const ALL: [Kind; 6] =
        [Kind::Generate, Kind::Solve, Kind::Measure, Kind::Correct, Kind::Fit, Kind::Aggregate];

    /// What is known of a kind without its parameters.
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

    /// The word used in manifests, tables and recipes.
    pub fn name(self) -> &'static str {
        self.definition().name
    }

    /// The version of the stage's numbers.
    pub fn version(self) -> u32 {
        self.definition().version
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// Every column that stages of a kind may add to the coordinates that they carry on.
pub fn columns_of(kind: Kind) -> Vec<Column> {
    (kind.definition().columns)()
}

/// What the rows of a stage's table are about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    Surfaces,
    Spectra,
    Loads,
    Contacts,
    PressureDistributions,
    GapDistributions,
    ClusterDistributions,
    Heights,
    PowerSpectra,
    ProfileSpectra,
    Autocorrelations,
    Scales,
    BearingCurves,
    Roughness,
    Corrections,
    Fits,
    Statistics,
}

impl Rows {
    /// All of them.
    pub const ALL: [Rows; 17] = [
        Rows::Surfaces,
        Rows::Spectra,
        Rows::Loads,
        Rows::Contacts,
        Rows::PressureDistributions,
        Rows::GapDistributions,
        Rows::ClusterDistributions,
        Rows::Heights,
        Rows::PowerSpectra,
        Rows::ProfileSpectra,
        Rows::Autocorrelations,
        Rows::Scales,
        Rows::BearingCurves,
        Rows::Roughness,
        Rows::Corrections,
        Rows::Fits,
        Rows::Statistics,
    ];

    /// What messages call them.
    pub fn name(self) -> &'static str {
        match self {
            Rows::Surfaces => "surfaces",
            Rows::Spectra => "surfaces without heights",
            Rows::Loads => "solved loads",
            Rows::Contacts => "measured contacts",
            Rows::PressureDistributions => "distributions of pressures",
            Rows::GapDistributions => "distributions of gaps",
            Rows::ClusterDistributions => "distributions of clusters",
            Rows::Heights => "measured heights",
            Rows::PowerSpectra => "power spectra",
            Rows::ProfileSpectra => "power spectra of profiles",
            Rows::Autocorrelations => "autocorrelations",
            Rows::Scales => "slopes and curvatures by scale",
            Rows::BearingCurves => "bearing curves",
            Rows::Roughness => "roughness parameters",
            Rows::Corrections => "corrected areas",
            Rows::Fits => "fits",
            Rows::Statistics => "statistics",
        }
    }
}

/// Everything that a task reads of its manifest: enough to compute it again from its inputs.
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// What a stage can do, its recipe can.
impl Deref for Recipe {
    type Target = dyn Stage;

    fn deref(&self) -> &(dyn Stage + 'static) {
        match self {
            Recipe::Generate(params) => params,
            Recipe::Solve(params) => params.as_ref(),
            Recipe::Measure(params) => params,
            Recipe::Correct(params) => params.as_ref(),
            Recipe::Fit(params) => params.as_ref(),
            Recipe::Aggregate(params) => params.as_ref(),
        }
    }
}

impl Recipe {
    /// The recipe that later keys are built on: without what only adds columns that no later stage
    /// reads, so that keeping more never recomputes them.
    pub fn identity(&self) -> Cow<'_, Recipe> {
        match self.identity_recipe() {
            Some(recipe) => Cow::Owned(recipe),
            None => Cow::Borrowed(self),
        }
    }

    /// Whether one task draws all surfaces of a parameter point.
    pub fn pools_surfaces(&self) -> bool {
        self.reach() == Reach::Point && self.footprint() != Footprint::NONE
    }
}
