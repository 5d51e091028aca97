//! The registry of the kinds of stage: the variants, which determine the keys of a table, and what
//! the stages above learn from their work.
//!
//! A new kind is added here and to the enums of the crate root.

use std::sync::LazyLock;

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::check_context::{FromKey, Property, Surfaces, distinct, distinct_values, spanning};
use crate::correct::CorrectTable;
use crate::measure::keys::MeasureTable;
use crate::nominal_area::NominalArea;
use crate::solve::keys::SolveTable;
use crate::stage_points::Work;
use crate::surface::Origin;
use crate::surface::labels::{self, PATH};
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Recipe, StageError, fit, generate, solve};
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
        &self,
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
        let surfaces = match work {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(recipes) => return Surfaces::pressed_by(stage, recipes),
        };
        let params = || surfaces.iter().map(|surfaces| &surfaces.params);
        let origins = || params().map(|params| &params.origin);
        let grids = || params().filter_map(|params| params.grid().ok());
        let steps = grids().flat_map(|grid| grid.spacing());
        let non_square = grids().find(|grid| !grid.has_square_cells());
        let samples = surfaces.iter().filter(|surfaces| surfaces.sample.is_some());
        let mut grids_of_samples = samples.filter_map(|surfaces| surfaces.params.grid().ok());
        let first = grids_of_samples.next();
        let slopes = origins().filter_map(|origin| Some([origin.given_rms_slope()?; 2]));
        let heights = origins().filter_map(|origin| Some([origin.given_rms_height()?; 2]));
        let treatments = origins().filter_map(|origin| match origin {
            Origin::File(file) => Some(file.treatment()),
            _ => None,
        });
        let properties = [
            (Property::Open, origins().any(Origin::is_open)),
            (Property::Filled, origins().any(Origin::has_filled_points)),
            (Property::Yielded, origins().any(Origin::has_yielded)),
            (Property::NotRedrawable, origins().any(Origin::reads_stage)),
            (Property::UnequalSamples, grids_of_samples.any(|grid| Some(grid) != first)),
            (Property::UnlikeScans, distinct_values(treatments).len() > 1),
            (Property::WithoutSlope, origins().any(|origin| origin.given_rms_slope().is_none())),
            (Property::WithoutHeight, origins().any(|origin| origin.given_rms_height().is_none())),
        ];
        Surfaces {
            properties: properties_of(stage, properties),
            coarsest: steps.reduce(f64::max).map(|step| (stage.to_owned(), step)),
            slopes: slopes.reduce(spanning),
            heights: heights.reduce(spanning),
            length_units: distinct(origins().map(|origin| origin.unit().to_owned())),
            areas: distinct_values(params().filter_map(NominalArea::of)),
            non_square: non_square.map(|grid| {
                let [step_x, step_y] = grid.spacing();
                (stage.to_owned(), step_x / step_y)
            }),
            ..Surfaces::default()
        }
    }

    /// Returns the properties of the contacts of a `solve` stage. Pressures or gaps are uncounted
    /// if one of its blocks does not count them.
    fn pressed_by(stage: &str, recipes: &[Recipe]) -> Surfaces {
        let any = |is_meant: &dyn Fn(&Recipe) -> bool| recipes.iter().any(is_meant);
        let without_adhesion = recipes.iter().filter_map(|recipe| match recipe {
            Recipe::Solve(params) => Some(params.as_ref()),
            _ => None,
        });
        let blocks: Vec<&solve::Params> = without_adhesion.collect();
        let lacks = |index: usize| {
            any(&|recipe| recipe.kind() == Kind::Solve && recipe.bins()[index].is_none())
        };
        let has_images =
            |block: &&solve::Params| !block.stiffness.is_none() && block.boundary.is_periodic();
        let properties = [
            (Property::WithoutAdhesion, !blocks.is_empty()),
            (Property::WithAdhesion, any(&|recipe| matches!(recipe, Recipe::Adhesion(_)))),
            (Property::WithoutGivenLoads, blocks.iter().any(|block| !block.control.is_load())),
            (Property::WithImages, blocks.iter().any(has_images)),
            (Property::WithLayer, blocks.iter().any(|block| block.layer.is_some())),
            (Property::PressuresUncounted, lacks(0)),
            (Property::GapsUncounted, lacks(1)),
        ];
        let physics = recipes.iter().find_map(|recipe| match recipe {
            Recipe::Adhesion(_) => Some("`adhesion`"),
            Recipe::Solve(params) if !params.control.is_load() => Some("no prescribed loads"),
            Recipe::Solve(params) if params.layer.is_some() => Some("a `layer`"),
            Recipe::Solve(params) if params.hardness.is_some() => Some("a `hardness`"),
            Recipe::Solve(params) if params.asperities.is_some() => {
                Some("`method = \"asperities\"`")
            }
            _ => None,
        });
        let listed = blocks
            .iter()
            .map(|block| (stage.to_owned(), block.given_loads(), block.unit_of_given_loads()));
        let mut loads: Vec<_> = listed.collect();
        loads.dedup();
        let conduction = blocks.iter().map(|block| (stage.to_owned(), block.bodies.conduction));
        Surfaces {
            properties: properties_of(stage, properties),
            conduction: conduction.take(1).collect(),
            not_superposable: physics.map(|physics| (stage.to_owned(), physics)),
            loads,
            ..Surfaces::default()
        }
    }
}

/// Returns the properties that a stage has, each with the name of the stage.
fn properties_of<const N: usize>(
    stage: &str,
    properties: [(Property, bool); N],
) -> Vec<(Property, String)> {
    let own = properties.into_iter().filter(|(_, has)| *has);
    own.map(|(property, _)| (property, stage.to_owned())).collect()
}
