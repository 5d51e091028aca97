//! What the checks of the keys of a stage know about the study.

use std::ops::{Deref, DerefMut};

use crate::bodies::Conduction;
use crate::columns::needed_key;
use crate::nominal_area::NominalArea;
use crate::surface::planned::PlannedSurfaces;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Recipe, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_manifest::keys::{GridPoint, KeyTable, Section, Spanned};
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

/// Property of the surfaces or contacts of a stage that later stages depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    /// Measured maps that are not periodic.
    Open,
    /// Measured maps whose missing points were filled.
    Filled,
    /// Surfaces that have yielded.
    Yielded,
    /// Random surfaces that cannot be drawn again, because their spectra are in the tables of other
    /// stages.
    NotRedrawable,
    /// Samples of one ensemble that differ in sides or steps.
    UnequalSamples,
    /// Measured surfaces that differ in labels or in their preparation, but for the region.
    UnlikeScans,
    /// Surfaces that are not scaled to a given rms slope.
    WithoutSlope,
    /// Surfaces that are not scaled to a given rms height.
    WithoutHeight,
    /// Contacts without `pressure_bins`.
    PressuresUncounted,
    /// Contacts without `gap_bins`.
    GapsUncounted,
    WithAdhesion,
    WithoutAdhesion,
    WithLayer,
    /// Contacts that prescribe mean gaps or displacements, whose loads differ between surfaces.
    WithoutGivenLoads,
    /// Periodic contacts with a stiffness, whose spots have images.
    WithImages,
}

/// Properties of the surfaces and contacts that a stage reads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Properties, each with the name of a stage that has it.
    pub properties: Vec<(Property, String)>,
    /// A stage with cells that are not square, and the ratio Δx/Δy of these cells.
    pub non_square: Option<(String, f64)>,
    /// Largest mesh step of the surfaces, and the stage that has it.
    pub coarsest: Option<(String, f64)>,
    /// A `solve` stage whose contacts are not those of elastic half-spaces without adhesion, and
    /// the physics that it has.
    pub not_superposable: Option<(String, &'static str)>,
    /// The `solve` stages and the loads of their parameter points, with the unit of the loads.
    pub loads: Vec<(String, Vec<f64>, Option<&'static str>)>,
    /// The `solve` stages and the conductivities of their bodies.
    pub conduction: Vec<(String, Option<Conduction>)>,
    /// Units of length of the surfaces, each once; empty texts for unknown units.
    pub length_units: Vec<String>,
    /// Smallest and largest rms slope to which surfaces are scaled.
    pub slopes: Option<[f64; 2]>,
    /// Smallest and largest rms height to which surfaces are scaled.
    pub heights: Option<[f64; 2]>,
    /// Distinct nominal areas of the surfaces.
    pub areas: Vec<NominalArea>,
}

impl Surfaces {
    /// Returns the name of the first stage that has a property.
    pub fn stage_with(&self, property: Property) -> Option<&str> {
        let mut properties = self.properties.iter();
        properties.find(|(own, _)| *own == property).map(|(_, stage)| stage.as_str())
    }

    /// Returns the rms slope of all surfaces, if all are scaled to the same one.
    pub fn common_slope(&self) -> Option<f64> {
        self.common(self.slopes, Property::WithoutSlope)
    }

    /// Returns the rms height of all surfaces, if all are scaled to the same one.
    pub fn common_height(&self) -> Option<f64> {
        self.common(self.heights, Property::WithoutHeight)
    }

    fn common(&self, range: Option<[f64; 2]>, unscaled: Property) -> Option<f64> {
        let [lowest, highest] = range.filter(|_| self.stage_with(unscaled).is_none())?;
        (lowest == highest).then_some(lowest)
    }

    /// Combines the properties of two sets of surfaces. If two stages have a property, the first
    /// one comes first.
    pub fn and(self, other: &Surfaces) -> Surfaces {
        let spanning =
            |one: [f64; 2], other: [f64; 2]| [one[0].min(other[0]), one[1].max(other[1])];
        let steps = self.coarsest.into_iter().chain(other.coarsest.clone());
        Surfaces {
            properties: union(self.properties, &other.properties),
            coarsest: steps.reduce(|one, next| if next.1 > one.1 { next } else { one }),
            slopes: self.slopes.into_iter().chain(other.slopes).reduce(spanning),
            heights: self.heights.into_iter().chain(other.heights).reduce(spanning),
            length_units: union(self.length_units, &other.length_units),
            not_superposable: self.not_superposable.or_else(|| other.not_superposable.clone()),
            loads: union(self.loads, &other.loads),
            conduction: union(self.conduction, &other.conduction),
            non_square: self.non_square.or_else(|| other.non_square.clone()),
            areas: union(self.areas, &other.areas),
        }
    }
}

/// Adds the values that a list lacks.
pub fn union<T: PartialEq + Clone>(mut own: Vec<T>, more: &[T]) -> Vec<T> {
    for value in more {
        if !own.contains(value) {
            own.push(value.clone());
        }
    }
    own
}

/// The surfaces of a stage, by parameter point.
#[derive(Debug, Clone, Copy)]
pub struct NamedSurfaces<'a> {
    /// Name of the stage, where another stage names it.
    pub name: &'a Spanned<String>,
    pub surfaces: &'a [PlannedSurfaces],
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
    /// Surfaces of the stage in `height_distribution`, by parameter point.
    pub heights_of: Option<&'a [PlannedSurfaces]>,
    /// Problems of the manifest. Checks add the problems that they find.
    pub problems: &'a mut Problems,
}

/// Checks of the keys at one parameter point, with what the stage reads.
pub struct StageChecks<'a> {
    checks: Checks<'a>,
    /// Properties of the surfaces and contacts that the stage reads.
    pub surfaces: &'a Surfaces,
    /// Empty table with the columns that the stage reads, if they are known.
    pub input: Option<&'a Table>,
    /// Kind of the rows that the stage reads, if it is known.
    pub read: Option<RowKind>,
    earlier: &'a [(&'a str, &'a Table)],
}

impl<'a> StageChecks<'a> {
    /// Creates the checks of one point of a section.
    pub fn new<T: KeyTable>(
        section: &'a Section<T>,
        point: &'a GridPoint<T>,
        context: &'a mut CheckContext,
    ) -> StageChecks<'a> {
        let &mut CheckContext { ref surfaces, input, read, earlier, ref mut problems, .. } =
            context;
        StageChecks {
            checks: Checks::new(section, point, problems),
            surfaces,
            input,
            read,
            earlier,
        }
    }

    /// Returns the problem of a column that the stages in `from` do not have. `names` are the
    /// columns that they have.
    pub fn unknown_column(&self, name: &str, span: &Span, names: &[&str]) -> Problem {
        let message = format!("the stages in `from` have no column {name:?}");
        let problem = |label| Problem::new(message, span.clone(), label);
        let mut earlier = self.earlier.iter();
        let is_known = |column: &str| {
            names.contains(&column) || self.earlier.iter().any(|(_, table)| table.has(column))
        };
        let names = || names.iter().copied();
        if let Some((stage, _)) = earlier.find(|(_, table)| table.has(name)) {
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
}

impl<'a> Deref for StageChecks<'a> {
    type Target = Checks<'a>;

    fn deref(&self) -> &Checks<'a> {
        &self.checks
    }
}

impl<'a> DerefMut for StageChecks<'a> {
    fn deref_mut(&mut self) -> &mut Checks<'a> {
        &mut self.checks
    }
}

/// Refuses the keys of a table that a condition excludes:
/// `exclude! { table, checks, condition => key, other_key: "reason"; … }`. All excluded keys are
/// reported. The result is `None` if there is one.
macro_rules! exclude {
    ($table:expr, $checks:expr, $($condition:expr => $($key:ident),+ : $why:expr;)+) => {{
        let mut clear = Some(());
        $($(if $condition {
            clear = $checks.forbidden(stringify!($key), &$table.$key, $why).and(clear);
        })+)+
        clear
    }};
}
pub(crate) use exclude;

/// Multiplies a number by a power of ten and rounds it to twelve digits.
pub fn converted(number: f64, power: i32) -> f64 {
    decimal::nearest(decimal::shifted(&decimal::written(number), power))
}

/// Converts a length to the unit of the lengths of the surfaces. A number without a unit has this
/// unit.
pub fn in_unit_of_surfaces(length: &Spanned<f64>, checks: &mut StageChecks) -> Option<f64> {
    let named = checks.units.length.as_ref().map(|named| named.unit);
    let Some(unit) = named.filter(|_| checks.units.is_quantity(&length.span)) else {
        return Some(decimal::nearest(length.value));
    };
    let of_surfaces = unit_of(&length.span, checks)?;
    Some(converted(length.value, unit.power - of_surfaces.power))
}

/// Returns the unit of the lengths of the surfaces. Refuses surfaces without a common unit to which
/// the length at `span` could be converted.
pub fn unit_of(span: &Span, checks: &mut StageChecks) -> Option<&'static Unit> {
    let mut names = checks.surfaces.length_units.iter().map(String::as_str);
    let (first, others) = (names.next().unwrap_or(""), names.count());
    let known = Unit::find(first).filter(|unit| unit.dimension == Dimension::Length);
    if let (Some(unit), 0) = (known, others) {
        return Some(unit);
    }
    let message = match (first, others) {
        ("", 0) => "a length has a unit, but the lengths of the surfaces have none".to_owned(),
        (name, 0) => {
            format!("a length has a unit, but the surfaces are in the unknown unit `{name}`")
        }
        _ => {
            let names = checks.surfaces.length_units.iter().map(|name| match name.as_str() {
                "" => "no unit",
                name => name,
            });
            format!("a length has a unit, but the surfaces have several: {}", listed(names, "and"))
        }
    };
    let problem = Problem::new(message, span.clone(), "has a unit");
    checks.reject(problem.help(
        "give the side of all surfaces in one unit, such as `side = \"100 um\"`, or write lengths \
         here as plain numbers in the unit of the side",
    ))
}
