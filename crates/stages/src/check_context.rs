//! What the checks of the keys of a stage know about the study.

use std::collections::BTreeSet;

use crate::bodies::Conduction;
use crate::columns::needed_key;
use crate::surface::planned::PlannedSurfaces;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Recipe, RowKind};
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::Spanned;
use asperity_tables::table::Table;

/// The presence of the key `from` in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromKey {
    /// The stage has no key `from`.
    Absent,
    /// The stage may have a key `from`.
    Optional,
    /// The stage must have a key `from`.
    Required,
}

impl FromKey {
    /// Returns whether stages of a kind have a key `from`, without regard to their method.
    pub fn of_kind(kind: Kind) -> FromKey {
        match kind {
            Kind::Generate => FromKey::Absent,
            _ => FromKey::Required,
        }
    }
}

/// Properties of surfaces and contacts that later stages depend on, each with the name of a stage
/// that has the property.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// A stage with measured maps that are not periodic.
    pub open: Option<String>,
    /// A stage with measured maps whose missing points were filled.
    pub filled: Option<String>,
    /// A stage with random surfaces that cannot be drawn again, because their spectra are in the
    /// tables of other stages.
    pub not_redrawable: Option<String>,
    /// A stage with cells that are not square, and the ratio Δx/Δy of these cells.
    pub non_square: Option<(String, f64)>,
    /// A `solve` stage without `pressure_bins`.
    pub pressures_uncounted: Option<String>,
    /// A `solve` stage without `gap_bins`.
    pub gaps_uncounted: Option<String>,
    /// Largest mesh step of the surfaces, and the stage that has it.
    pub coarsest: Option<(String, f64)>,
    /// A `solve` stage without adhesion.
    pub without_adhesion: Option<String>,
    /// A `solve` stage with adhesion.
    pub with_adhesion: Option<String>,
    /// A `solve` stage whose contacts are not those of elastic half-spaces without adhesion, and
    /// the physics that it has.
    pub not_superposable: Option<(String, &'static str)>,
    /// The `solve` stages and the loads of their parameter points, with the unit of the loads.
    pub loads: Vec<(String, Vec<f64>, Option<&'static str>)>,
    /// The `solve` stages and the conductivities of their bodies.
    pub conduction: Vec<(String, Option<Conduction>)>,
    /// A periodic `solve` stage with a stiffness, whose spots have images.
    pub with_images: Option<String>,
    /// A `solve` stage with a layer.
    pub with_layer: Option<String>,
    /// Units of length of the surfaces, each once; empty texts for unknown units.
    pub length_units: Vec<String>,
    /// Smallest and largest rms slope to which surfaces are scaled.
    pub slopes: Option<[f64; 2]>,
    /// A stage with surfaces that are not scaled to a given rms slope.
    pub without_slope: Option<String>,
}

impl Surfaces {
    /// Returns the rms slope of all surfaces, if all are scaled to the same one.
    pub fn common_slope(&self) -> Option<f64> {
        let [lowest, highest] = self.slopes.filter(|_| self.without_slope.is_none())?;
        (lowest == highest).then_some(lowest)
    }

    /// Combines the properties of two sets of surfaces. If two stages have a property, the first
    /// one is named.
    pub fn and(self, other: &Surfaces) -> Surfaces {
        let slopes = self.slopes.into_iter().chain(other.slopes);
        let steps = self.coarsest.into_iter().chain(other.coarsest.clone());
        Surfaces {
            coarsest: steps.reduce(|one, next| if next.1 > one.1 { next } else { one }),
            slopes: slopes.reduce(spanning),
            without_slope: self.without_slope.or_else(|| other.without_slope.clone()),
            open: self.open.or_else(|| other.open.clone()),
            filled: self.filled.or_else(|| other.filled.clone()),
            not_redrawable: self.not_redrawable.or_else(|| other.not_redrawable.clone()),
            pressures_uncounted: self
                .pressures_uncounted
                .or_else(|| other.pressures_uncounted.clone()),
            without_adhesion: self.without_adhesion.or_else(|| other.without_adhesion.clone()),
            with_adhesion: self.with_adhesion.or_else(|| other.with_adhesion.clone()),
            with_images: self.with_images.or_else(|| other.with_images.clone()),
            with_layer: self.with_layer.or_else(|| other.with_layer.clone()),
            length_units: distinct(
                self.length_units.into_iter().chain(other.length_units.iter().cloned()),
            ),
            gaps_uncounted: self.gaps_uncounted.or_else(|| other.gaps_uncounted.clone()),
            not_superposable: self.not_superposable.or_else(|| other.not_superposable.clone()),
            loads: [self.loads, other.loads.clone()].concat(),
            conduction: [self.conduction, other.conduction.clone()].concat(),
            non_square: self.non_square.or_else(|| other.non_square.clone()),
        }
    }
}

/// Returns the distinct texts among these, sorted.
pub fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.collect::<BTreeSet<_>>().into_iter().collect()
}

/// Returns the smallest range that contains two ranges.
pub fn spanning(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// A `solve` stage with the surfaces that it presses.
#[derive(Debug)]
pub struct PressedStage<'a> {
    /// Name of the stage, where `from` names it.
    pub name: &'a Spanned<String>,
    /// Surfaces that the stage presses, by parameter point.
    pub surfaces: Vec<&'a PlannedSurfaces>,
    /// Recipes of the contacts.
    pub recipes: &'a [Recipe],
}

/// Data outside a stage that the checks of its keys need.
pub struct CheckContext<'a> {
    /// Seed of the study, used by stages without a key `seed`.
    pub seed: u64,
    /// Files of measured surfaces and of spectra.
    pub sources: &'a mut SurfaceFiles,
    /// True if the stage has a key `from`.
    pub reads_stages: bool,
    /// Kind of the rows that the stage reads, if it is known.
    pub read: Option<RowKind>,
    /// Empty table with the columns that the stage reads, if they are known.
    pub input: Option<&'a Table>,
    /// Names and empty tables of the stages on which the inputs depend, the nearest first.
    pub earlier: &'a [(&'a str, &'a Table)],
    /// Properties of the surfaces and contacts that the stage reads.
    pub surfaces: Surfaces,
    /// `solve` stages that the stage reads.
    pub pressed: Vec<PressedStage<'a>>,
    /// Problems of the manifest. Checks add the problems that they find.
    pub problems: &'a mut Problems,
}

/// Returns the problem of a column that the stages in `from` do not have. `names` are the columns
/// that they have, and `earlier` is that of the [`CheckContext`].
pub fn unknown_column(
    name: &str,
    span: &Span,
    names: &[&str],
    earlier: &[(&str, &Table)],
) -> Problem {
    let message = format!("the stages in `from` have no column {name:?}");
    let problem = |label| Problem::new(message, span.clone(), label);
    let is_known = |column: &str| {
        names.contains(&column) || earlier.iter().any(|(_, table)| table.has(column))
    };
    let names = || names.iter().copied();
    if let Some((stage, _)) = earlier.iter().find(|(_, table)| table.has(name)) {
        let help = format!("read that stage, by `from = \"{stage}\"` here or in another stage");
        problem(format!("the stage `{stage}` has this column")).help(help)
    } else if let Some(label) = needed_key(name, is_known) {
        problem(label)
    } else if let Some(meant) = did_you_mean(name, names()) {
        problem(format!("did you mean \"{meant}\"?"))
    } else {
        let help = format!("their columns are {}", listed(names(), "and"));
        problem("unknown column".to_owned()).help(help)
    }
}
