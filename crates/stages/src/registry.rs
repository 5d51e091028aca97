//! The registry of the kinds of stage: the variants, which determine the keys of a table, and what
//! the stages above learn from their work.
//!
//! A new kind is added here and to the enums of the crate root.

use std::sync::LazyLock;

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::check_context::{FromKey, Property, Surfaces};
use crate::correct::CorrectTable;
use crate::measure::keys::MeasureTable;
use crate::nominal_area::NominalArea;
use crate::solve::keys::SolveTable;
use crate::stage_points::Work;
use crate::surface::Origin;
use crate::surface::labels::{self, PATH};
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Recipe, StageError, fit, generate, surface};
use asperity_manifest::diagnostics::{Problems, Span, listed};
use asperity_manifest::keys::Section;
use asperity_manifest::keys::derived::Scope;
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::validation::unknown_word;
use asperity_tables::table::Table;

pub use crate::stage_points::{StagePoints, StageVariant};

/// All variants, in the order in which stages follow each other. The first one of a kind is its
/// default.
static VARIANTS: LazyLock<Vec<StageVariant>> = LazyLock::new(|| {
    let mut variants = generate::method::variants();
    variants.extend([
        StageVariant::new(Kind::Solve, |keys: Section<SolveTable>| keys),
        StageVariant::new(Kind::Measure, |keys: Section<MeasureTable>| keys),
        StageVariant::new(Kind::Correct, |keys: Section<CorrectTable>| keys),
    ]);
    variants.extend(fit::keys::variants());
    variants.push(StageVariant::new(Kind::Aggregate, |keys: Section<AggregateTable>| keys));
    variants
});

/// Formats a kind of stage with its article: ``an `aggregate` stage``.
pub fn with_article(kind: Kind) -> String {
    let starts_with_vowel = kind.name().starts_with(['a', 'e', 'i', 'o', 'u']);
    let article = if starts_with_vowel { "an" } else { "a" };
    format!("{article} `{kind}` stage")
}

impl StageVariant {
    /// Returns all variants, in the order in which stages follow each other.
    pub fn all() -> impl Iterator<Item = &'static StageVariant> {
        VARIANTS.iter()
    }

    /// Returns the variants of a kind; the first one is the default.
    fn of_kind(kind: Kind) -> impl Iterator<Item = &'static StageVariant> {
        VARIANTS.iter().filter(move |variant| variant.kind == kind)
    }

    /// Returns the name of the variant in messages: ``a `generate` stage with `method = "file"` ``.
    pub fn describe(&self) -> String {
        match self.selector {
            Some((key, word)) => format!("{} with `{key} = \"{word}\"`", with_article(self.kind)),
            None => with_article(self.kind),
        }
    }

    /// Returns whether the variant is the default of its kind.
    pub fn is_default(&self) -> bool {
        let default = StageVariant::of_kind(self.kind).next();
        default.is_some_and(|default| default.selector == self.selector)
    }

    /// Returns the variant that the table of a stage selects, and removes the selecting key from
    /// the table. Reports an unknown value of this key.
    pub fn select(
        kind: Kind,
        table: &mut DeTable,
        problems: &mut Problems,
    ) -> Option<&'static StageVariant> {
        let default = StageVariant::of_kind(kind).next()?;
        let Some((key, value)) =
            default.selector.and_then(|(key, _)| Some((key, table.remove(key)?)))
        else {
            return Some(default);
        };
        let selected = |word: &str| {
            StageVariant::of_kind(kind).find(|variant| variant.selector == Some((key, word)))
        };
        let found = value.get_ref().as_str().and_then(selected);
        if found.is_none() {
            let selectors = StageVariant::of_kind(kind).filter_map(|variant| variant.selector);
            let words: Vec<_> = selectors.map(|(_, word)| word).collect();
            problems.push(unknown_word(key, &value, &words));
        }
        found
    }

    /// Returns another variant that has a key, preferably one of the same kind.
    fn owner(&self, key: &str) -> Option<&'static StageVariant> {
        let has = |variant: &&StageVariant| {
            variant.layout.has(key) || variant.common_keys().contains(&key)
        };
        StageVariant::of_kind(self.kind).find(has).or_else(|| StageVariant::all().find(has))
    }

    /// Returns the keys of a stage that are not in the table of its variant.
    fn common_keys(&self) -> Vec<&'static str> {
        let mut common = vec!["kind"];
        common.extend(self.selector.map(|(key, _)| key));
        if self.from_key != FromKey::Absent {
            common.push("from");
        }
        if !self.layout.swept.is_empty() {
            common.push("cases");
        }
        common
    }

    /// Reads the table of a stage. The keys `kind`, `from` and the selecting key must have been
    /// removed from the table. `scope` has the names that expressions can use besides keys.
    pub fn read(
        &'static self,
        table: DeTable,
        span: Span,
        scope: &Scope<'_>,
        problems: &mut Problems,
    ) -> Box<dyn StagePoints> {
        let expected = ExpectedKeys {
            table: self.describe(),
            common: self.common_keys(),
            owner: Box::new(|key| self.owner(key).map(StageVariant::describe)),
            scope: Some(scope),
        };
        (self.read)((self.prepare)(table), span, &expected, problems)
    }
}

impl Work {
    /// Returns the table of the stage without rows, given the names and the empty tables of its
    /// inputs.
    ///
    /// # Errors
    /// Returns an error if a query cannot be answered or a column is missing.
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
            let with_paths: Vec<(String, Table)>;
            let inputs = if recipe.uses_column(PATH.name) {
                let none = SurfaceFiles::default();
                let named = inputs.iter();
                with_paths = named
                    .map(|(name, table)| (name.clone(), labels::with_paths(table.clone(), &none)))
                    .collect();
                with_paths.as_slice()
            } else {
                inputs
            };
            let table = recipe.empty_table(inputs).map_err(|error| match error {
                StageError::Table(source) => {
                    let names = inputs.iter().map(|(name, _)| name.as_str());
                    StageError::Inputs { stages: listed(names, "and"), source }
                }
                other => other,
            });
            tables.push(table?);
            if !recipe.columns_depend_on_params() {
                break;
            }
        }
        Ok(Table::stack(&tables)?)
    }
}

impl Surfaces {
    /// Returns the properties of the surfaces of a `generate` stage, or of the contacts of another
    /// stage.
    pub fn made_by(stage: &str, work: &Work) -> Surfaces {
        let and = |all: Surfaces, one: Surfaces| all.and(&one);
        let surfaces = match work {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(recipes) => {
                let contacts = recipes.iter().map(|recipe| contacts(stage, recipe));
                return contacts.fold(Surfaces::default(), and);
            }
        };
        let samples = surfaces.iter().filter(|surfaces| surfaces.sample.is_some());
        let grids = samples.filter_map(|surfaces| surfaces.params.grid().ok());
        let treatments = surfaces.iter().filter_map(|surfaces| match &surfaces.params.origin {
            Origin::File(file) => Some(file.treatment()),
            _ => None,
        });
        let properties = [
            (Property::UnequalSamples, differ(grids)),
            (Property::UnlikeScans, differ(treatments)),
        ];
        let differing =
            Surfaces { properties: properties_of(stage, properties), ..Surfaces::default() };
        surfaces.iter().map(|surfaces| drawn(stage, &surfaces.params)).fold(differing, and)
    }
}

fn differ<T: PartialEq>(mut values: impl Iterator<Item = T>) -> bool {
    let first = values.next();
    values.any(|value| Some(value) != first)
}

/// Returns the properties of the surfaces of a parameter point.
fn drawn(stage: &str, params: &surface::Params) -> Surfaces {
    let origin = &params.origin;
    let grid = params.grid().ok();
    let properties = [
        (Property::Open, origin.is_open()),
        (Property::Filled, origin.has_filled_points()),
        (Property::Yielded, origin.has_yielded()),
        (Property::NotRedrawable, origin.reads_stage()),
        (Property::WithoutSlope, origin.given_rms_slope().is_none()),
        (Property::WithoutHeight, origin.given_rms_height().is_none()),
    ];
    let non_square = grid.filter(|grid| !grid.has_square_cells()).map(|grid| grid.spacing());
    Surfaces {
        properties: properties_of(stage, properties),
        coarsest: grid.map(|grid| {
            let [step_x, step_y] = grid.spacing();
            (stage.to_owned(), step_x.max(step_y))
        }),
        slopes: origin.given_rms_slope().map(|slope| [slope; 2]),
        heights: origin.given_rms_height().map(|height| [height; 2]),
        length_units: vec![origin.unit().to_owned()],
        areas: NominalArea::of(params).into_iter().collect(),
        non_square: non_square.map(|[step_x, step_y]| (stage.to_owned(), step_x / step_y)),
        ..Surfaces::default()
    }
}

/// Returns the properties of the contacts of a recipe.
fn contacts(stage: &str, recipe: &Recipe) -> Surfaces {
    let counted = |index: usize| recipe.kind() != Kind::Solve || recipe.bins()[index].is_some();
    let Recipe::Solve(params) = recipe else {
        let adheres = matches!(recipe, Recipe::Adhesion(_));
        let properties = [
            (Property::WithAdhesion, adheres),
            (Property::PressuresUncounted, !counted(0)),
            (Property::GapsUncounted, !counted(1)),
        ];
        return Surfaces {
            properties: properties_of(stage, properties),
            not_superposable: adheres.then(|| (stage.to_owned(), "`adhesion`")),
            ..Surfaces::default()
        };
    };
    let has_images = !params.stiffness.is_none() && params.boundary.is_periodic();
    let properties = [
        (Property::WithoutAdhesion, true),
        (Property::WithoutGivenLoads, !params.control.is_load()),
        (Property::WithImages, has_images),
        (Property::WithLayer, params.layer.is_some()),
        (Property::PressuresUncounted, !counted(0)),
        (Property::GapsUncounted, !counted(1)),
    ];
    let physics = [
        (!params.control.is_load(), "no prescribed loads"),
        (params.layer.is_some(), "a `layer`"),
        (params.hardness.is_some(), "a `hardness`"),
        (params.asperities.is_some(), "`method = \"asperities\"`"),
    ];
    let other = physics.into_iter().find_map(|(has, physics)| has.then_some(physics));
    Surfaces {
        properties: properties_of(stage, properties),
        conduction: vec![(stage.to_owned(), params.bodies.conduction)],
        not_superposable: other.map(|physics| (stage.to_owned(), physics)),
        loads: vec![(stage.to_owned(), params.given_loads(), params.unit_of_given_loads())],
        ..Surfaces::default()
    }
}

fn properties_of<const N: usize>(
    stage: &str,
    properties: [(Property, bool); N],
) -> Vec<(Property, String)> {
    let own = properties.into_iter().filter(|(_, has)| *has);
    own.map(|(property, _)| (property, stage.to_owned())).collect()
}
