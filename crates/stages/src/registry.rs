//! The registry of the kinds of stage: the variants, which determine the keys of a table, the
//! checked keys of a stage, and its work.
//!
//! A new kind is added here and to the enums of the crate root.

pub mod full_contact;

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::check_context::{
    CheckContext, FromKey, Property, Surfaces, distinct, distinct_values, spanning,
};
use crate::correct::CorrectTable;
use crate::fit::keys::{FitPoints, LawWord};
use crate::generate::method::SurfacePoints;
use crate::measure::keys::MeasureTable;
use crate::nominal_area::NominalArea;
use crate::solve::keys::SolveTable;
use crate::surface::Origin;
use crate::surface::labels::{self, PATH};
use crate::surface::method::Method;
use crate::surface::planned::PlannedSurfaces;
use crate::surface_files::SurfaceFiles;
use crate::{
    InputScope, Kind, Reads, Recipe, RowKind, StageError, aggregate, correct, generate, measure,
    solve,
};
use asperity_manifest::diagnostics::{Problem, Problems, Span, listed};
use asperity_manifest::keys::derived::{KnownNumber, Scope};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::validation::unknown_word;
use asperity_manifest::keys::{KeyTable, Layout, Section, Spanned, reader};
use asperity_tables::table::Table;

/// A kind of stage, with the method or law that determines its keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageVariant {
    Generate(Method),
    Solve,
    Measure,
    Correct,
    Fit(LawWord),
    Aggregate,
}

/// Parameter points of a stage, by kind of stage.
#[derive(Debug)]
pub enum StagePoints {
    Generate(SurfacePoints),
    Solve(Section<SolveTable>),
    Measure(Section<MeasureTable>),
    Correct(Section<CorrectTable>),
    Fit(FitPoints),
    Aggregate(Section<AggregateTable>),
}

/// Formats a kind of stage with its article: ``an `aggregate` stage``.
pub fn with_article(kind: Kind) -> String {
    let starts_with_vowel = kind.name().starts_with(['a', 'e', 'i', 'o', 'u']);
    let article = if starts_with_vowel { "an" } else { "a" };
    format!("{article} `{kind}` stage")
}

impl StageVariant {
    /// Returns all variants, in the order in which stages follow each other.
    pub fn all() -> impl Iterator<Item = StageVariant> {
        Kind::ALL.into_iter().flat_map(StageVariant::of_kind)
    }

    /// Returns the variants of a kind; the first one is the default.
    pub fn of_kind(kind: Kind) -> Vec<StageVariant> {
        match kind {
            Kind::Generate => Method::all().map(StageVariant::Generate).collect(),
            Kind::Solve => vec![StageVariant::Solve],
            Kind::Measure => vec![StageVariant::Measure],
            Kind::Correct => vec![StageVariant::Correct],
            Kind::Fit => LawWord::all().map(StageVariant::Fit).collect(),
            Kind::Aggregate => vec![StageVariant::Aggregate],
        }
    }

    /// Returns the kind of the stage.
    pub fn kind(self) -> Kind {
        match self {
            StageVariant::Generate(_) => Kind::Generate,
            StageVariant::Solve => Kind::Solve,
            StageVariant::Measure => Kind::Measure,
            StageVariant::Correct => Kind::Correct,
            StageVariant::Fit(_) => Kind::Fit,
            StageVariant::Aggregate => Kind::Aggregate,
        }
    }

    /// Returns whether the stage has a key `from`.
    pub fn from_key(self) -> FromKey {
        match self {
            StageVariant::Generate(method) => method.from_key(),
            _ => FromKey::of_kind(self.kind()),
        }
    }

    /// Returns the key and the value that select the variant, if its kind has several variants.
    pub fn selector(self) -> Option<(&'static str, &'static str)> {
        match self {
            StageVariant::Generate(method) => Some(("method", method.word())),
            StageVariant::Fit(law) => Some(("law", law.word())),
            _ => None,
        }
    }

    /// Returns the description of the method or law, for editors and the guide.
    pub fn about(self) -> Option<&'static str> {
        match self {
            StageVariant::Generate(method) => Some(method.about()),
            StageVariant::Fit(law) => Some(law.about()),
            _ => None,
        }
    }

    /// Returns the name of the variant in messages: ``a `generate` stage with `method = "file"` ``.
    pub fn describe(self) -> String {
        match self.selector() {
            Some((key, word)) => format!("{} with `{key} = \"{word}\"`", with_article(self.kind())),
            None => with_article(self.kind()),
        }
    }

    /// Returns whether the variant is the default of its kind.
    pub fn is_default(self) -> bool {
        StageVariant::of_kind(self.kind()).first() == Some(&self)
    }

    /// Returns the variant that the table of a stage selects, and removes the selecting key from
    /// the table. Reports an unknown value of this key.
    pub fn select(
        kind: Kind,
        table: &mut DeTable,
        problems: &mut Problems,
    ) -> Option<StageVariant> {
        let variants = StageVariant::of_kind(kind);
        let default = variants.first().copied();
        let Some((key, _)) = default.and_then(StageVariant::selector) else {
            return default;
        };
        let Some(value) = table.remove(key) else {
            return default;
        };
        let selectors = variants.iter().filter_map(|variant| variant.selector());
        let words: Vec<_> = selectors.map(|(_, word)| word).collect();
        let written = value.get_ref().as_str();
        let index = words.iter().position(|word| Some(*word) == written);
        if index.is_none() {
            problems.push(unknown_word(key, &value, &words));
        }
        index.map(|index| variants[index])
    }

    /// Returns the keys that the stage can have, for messages about unknown keys.
    fn expected_keys<'a>(self, scope: &'a Scope<'a>) -> ExpectedKeys<'a> {
        ExpectedKeys {
            table: self.describe(),
            common: self.common_keys(),
            owner: Box::new(move |key| self.owner(key).map(StageVariant::describe)),
            scope: Some(scope),
        }
    }

    /// Returns another variant that has a key, preferably one of the same kind.
    fn owner(self, key: &str) -> Option<StageVariant> {
        let has = |variant: &StageVariant| {
            variant.layout().has(key) || variant.common_keys().contains(&key)
        };
        let same_kind = StageVariant::of_kind(self.kind()).into_iter().find(has);
        same_kind.or_else(|| StageVariant::all().find(has))
    }

    /// Returns the keys of a stage that are not in the table of its variant.
    fn common_keys(self) -> Vec<&'static str> {
        let mut common = vec!["kind"];
        common.extend(self.selector().map(|(key, _)| key));
        if self.from_key() != FromKey::Absent {
            common.push("from");
        }
        if !self.layout().swept.is_empty() {
            common.push("cases");
        }
        common
    }

    /// Returns the declarations of the keys of the variant.
    pub fn layout(self) -> &'static Layout {
        match self {
            StageVariant::Generate(method) => method.layout(),
            StageVariant::Solve => SolveTable::layout(),
            StageVariant::Measure => MeasureTable::layout(),
            StageVariant::Correct => CorrectTable::layout(),
            StageVariant::Fit(law) => law.layout(),
            StageVariant::Aggregate => AggregateTable::layout(),
        }
    }

    /// Returns the load of full contact, which expressions of a stage can use. `inputs` are the
    /// names of the stages that the stage reads, with the points of those that generate surfaces.
    pub fn full_contact<'a>(
        self,
        inputs: Vec<(&'a str, Option<&'a SurfacePoints>)>,
    ) -> KnownNumber<'a> {
        KnownNumber {
            name: full_contact::NAME,
            unit_of: full_contact::UNIT_OF,
            is_pure: full_contact::is_relative,
            value: Box::new(move |key, point| match self {
                StageVariant::Solve => full_contact::load(&inputs, key, point),
                _ => Err(format!(
                    "`{}` can be used only in the loads of a `solve` stage",
                    full_contact::NAME
                )),
            }),
        }
    }

    /// Reads the table of a stage. The keys `kind`, `from` and the selecting key must have been
    /// removed from the table. `scope` has the names that expressions can use besides keys.
    pub fn read(
        self,
        table: DeTable,
        span: Span,
        scope: &Scope<'_>,
        problems: &mut Problems,
    ) -> StagePoints {
        let expected = &self.expected_keys(scope);
        match self {
            StageVariant::Generate(method) => {
                StagePoints::Generate(method.read(table, span, expected, problems))
            }
            StageVariant::Solve => {
                StagePoints::Solve(reader::read(table, span, expected, problems))
            }
            StageVariant::Measure => {
                StagePoints::Measure(reader::read(table, span, expected, problems))
            }
            StageVariant::Correct => {
                StagePoints::Correct(reader::read(table, span, expected, problems))
            }
            StageVariant::Fit(law) => StagePoints::Fit(law.read(table, span, expected, problems)),
            StageVariant::Aggregate => {
                StagePoints::Aggregate(reader::read(table, span, expected, problems))
            }
        }
    }
}

impl StagePoints {
    /// Checks the points and returns the tasks of the stage, or `None` after reporting problems.
    pub fn work(&self, context: &mut CheckContext) -> Option<Work> {
        let recipes = match self {
            StagePoints::Generate(points) => {
                let surfaces = points.surfaces(context)?;
                check_labels(points, &surfaces, context.problems)?;
                return Some(Work::Generate(surfaces));
            }
            StagePoints::Solve(section) => solve::keys::recipes(section, context),
            StagePoints::Measure(section) => measure::keys::recipes(section, context),
            StagePoints::Correct(section) => correct::recipes(section, context),
            StagePoints::Fit(points) => points.recipes(context),
            StagePoints::Aggregate(section) => aggregate::keys::recipes(section, context),
        };
        recipes.filter(|recipes| !recipes.is_empty()).map(Work::Evaluate)
    }

    /// Returns the kinds of rows that the stage can read, or `None` if all stages of its kind read
    /// the same ones.
    pub fn reads(&self) -> Option<Reads> {
        match self {
            StagePoints::Generate(points) => points.reads(),
            StagePoints::Fit(points) => points.reads(),
            _ => None,
        }
    }

    /// Returns the kind of rows that the stage makes, or `None` for the default of its kind of
    /// stage.
    pub fn row_kind(&self) -> Option<RowKind> {
        match self {
            StagePoints::Generate(points) if points.lack_heights() => Some(RowKind::Spectra),
            StagePoints::Generate(points) if points.are_profiles() => Some(RowKind::Profiles),
            StagePoints::Measure(section) => measure::keys::row_kind(section),
            _ => None,
        }
    }

    /// Returns the name of the stage whose surfaces are pressed against those of `from`, if there
    /// is one.
    pub fn against(&self) -> Option<&Spanned<String>> {
        match self {
            StagePoints::Solve(section) => solve::keys::against::stage(section),
            _ => None,
        }
    }

    /// Returns the name of the stage whose height distribution the surfaces have, if there is one.
    pub fn heights_of(&self) -> Option<&Spanned<String>> {
        match self {
            StagePoints::Generate(points) => points.heights_of(),
            _ => None,
        }
    }

    /// Returns whether the stage is a query, for which each input is a separate table.
    pub fn is_query(&self) -> bool {
        match self {
            StagePoints::Aggregate(section) => aggregate::keys::is_query(section),
            _ => false,
        }
    }

    /// Returns the position of the key that asks for multilevel means, if there is one.
    pub fn multilevel(&self) -> Option<&Span> {
        match self {
            StagePoints::Aggregate(section) => aggregate::keys::multilevel_key(section),
            _ => None,
        }
    }

    /// Checks `answer`, the empty table that the stage computes from the empty tables `inputs`.
    /// Returns this table, or `None` after reporting problems.
    pub fn validate_answer(
        &self,
        answer: Result<Table, StageError>,
        inputs: &[(String, Table)],
        problems: &mut Problems,
    ) -> Option<Table> {
        match self {
            StagePoints::Aggregate(section) => {
                aggregate::keys::validate_answer(section, answer, inputs, problems)
            }
            _ => answer.ok(),
        }
    }
}

/// Refuses labels with the names of columns, because two columns of a table cannot have one name.
fn check_labels(
    points: &SurfacePoints,
    surfaces: &[PlannedSurfaces],
    problems: &mut Problems,
) -> Option<()> {
    let mut labels = surfaces.iter().filter_map(|one| one.params.origin.labels());
    let columns = || Kind::ALL.into_iter().flat_map(|kind| (kind.definition().columns)());
    let own = ["path", "task"];
    let is_taken = |name: &str| {
        labels::parameter_of_random_surfaces(name).is_none()
            && (own.contains(&name) || columns().any(|column| column.name == name))
    };
    let taken = labels.find_map(|labels| labels.values.keys().find(|name| is_taken(name)));
    let Some(taken) = taken else { return Some(()) };
    let span = points.span_of_label(taken).cloned().unwrap_or_default();
    let message = format!("a label cannot be called `{taken}`");
    let label = "name of another column of the tables";
    problems.push(Problem::new(message, span, label).help("choose another word"));
    None
}

/// Work of a stage at all its parameter points, in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    Generate(Vec<PlannedSurfaces>),
    /// Recipes that are applied to the tables of other stages. There is at least one, and all are
    /// of the same kind.
    Evaluate(Vec<Recipe>),
}

impl Work {
    /// Returns the kind of stage that does the work.
    pub fn kind(&self) -> Kind {
        match self {
            Work::Generate(_) => Kind::Generate,
            Work::Evaluate(recipes) => recipes.first().expect("a grid has a point").kind(),
        }
    }

    /// Returns the surfaces that the stage makes, by parameter point.
    pub fn surfaces(&self) -> &[PlannedSurfaces] {
        match self {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(_) => &[],
        }
    }

    /// Returns the recipes that are applied to the tables of other stages.
    pub fn recipes(&self) -> &[Recipe] {
        match self {
            Work::Generate(_) => &[],
            Work::Evaluate(recipes) => recipes,
        }
    }

    /// Returns an upper bound on the number of tasks for a number of input tables.
    pub fn tasks(&self, inputs: usize) -> usize {
        match self {
            Work::Generate(surfaces) => {
                let tasks = surfaces.iter().map(|surfaces| {
                    let spectra = if surfaces.params.origin.reads_stage() { inputs } else { 1 };
                    spectra.saturating_mul(surfaces.at_most() as usize)
                });
                tasks.fold(0, usize::saturating_add)
            }
            Work::Evaluate(recipes) => {
                let tasks = recipes.iter().map(|recipe| match recipe.input_scope() {
                    InputScope::Single | InputScope::ParameterPoint => inputs,
                    InputScope::All => 1,
                });
                tasks.fold(0, usize::saturating_add)
            }
        }
    }

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
