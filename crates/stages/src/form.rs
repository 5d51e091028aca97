//! The variants of stages, which determine the keys of their tables, and the checked keys of a
//! stage.

use std::collections::BTreeSet;

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::columns::needed_key;
use crate::correct::CorrectTable;
use crate::fit::keys::{FitPoints, LawWord};
use crate::generate::growth::PlannedSurfaces;
use crate::generate::method::{Method, SurfacePoints};
use crate::measure::keys::MeasureTable;
use crate::solve::Conduction;
use crate::solve::keys::SolveTable;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Reads, Recipe, RowKind, StageError, Work, aggregate, correct, measure, solve};
use asperity_contact::distribution::EqualBins;
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
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
            Kind::Generate => Method::ALL.map(StageVariant::Generate).into(),
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
            name: solve::full_contact::NAME,
            value: Box::new(move |key, point| match self {
                StageVariant::Solve => solve::full_contact::load(&inputs, key, point),
                _ => Err(format!(
                    "`{}` can be used only in the loads of a `solve` stage",
                    solve::full_contact::NAME
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
            StagePoints::Generate(points) => return points.surfaces(context).map(Work::Generate),
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
            StagePoints::Measure(section) => measure::keys::row_kind(section),
            _ => None,
        }
    }

    /// Returns the name of the stage whose surfaces are pressed against those of `from`, if there
    /// is one.
    pub fn against(&self) -> Option<&Spanned<String>> {
        match self {
            StagePoints::Solve(section) => solve::against::stage(section),
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
    /// Returns the properties of the surfaces of a `generate` stage, or of the contacts of another
    /// stage.
    pub fn made_by(stage: &str, work: &Work) -> Surfaces {
        let surfaces = match work {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(recipes) => return Surfaces::pressed_by(stage, recipes),
        };
        let params = || surfaces.iter().map(|surfaces| &surfaces.params);
        let is_open = params().any(|params| params.origin.is_open());
        let is_filled = params().any(|params| params.origin.has_filled_points());
        let steps = params().filter_map(|params| Some(params.grid().ok()?.spacing()));
        let coarsest = steps.flatten().reduce(f64::max).map(|step| (stage.to_owned(), step));
        let mut grids = params().filter_map(|params| params.grid().ok());
        let non_square = grids.find(|grid| !grid.has_square_cells());
        let slopes = params().filter_map(|params| Some([params.origin.given_rms_slope()?; 2]));
        let lacks_slope = params().any(|params| params.origin.given_rms_slope().is_none());
        Surfaces {
            coarsest,
            without_slope: lacks_slope.then(|| stage.to_owned()),
            slopes: slopes.reduce(spanning),
            open: is_open.then(|| stage.to_owned()),
            filled: is_filled.then(|| stage.to_owned()),
            pressures_uncounted: None,
            gaps_uncounted: None,
            without_adhesion: None,
            with_adhesion: None,
            not_superposable: None,
            loads: Vec::new(),
            conduction: Vec::new(),
            with_images: None,
            with_layer: None,
            length_units: distinct(params().map(|params| params.origin.unit().to_owned())),
            not_redrawable: params()
                .any(|params| params.origin.reads_stage())
                .then(|| stage.to_owned()),
            non_square: non_square.map(|grid| {
                let [step_x, step_y] = grid.spacing();
                (stage.to_owned(), step_x / step_y)
            }),
        }
    }

    /// Returns the properties of the contacts of a `solve` stage: names `stage` in
    /// `pressures_uncounted` or `gaps_uncounted` if one of its blocks does not count these values.
    fn pressed_by(stage: &str, recipes: &[Recipe]) -> Surfaces {
        let lacks = |bins: fn(&Recipe) -> Option<EqualBins>| {
            let mut contacts = recipes.iter().filter(|recipe| recipe.kind() == Kind::Solve);
            contacts.any(|recipe| bins(recipe).is_none()).then(|| stage.to_owned())
        };
        let named =
            |is_meant: fn(&Recipe) -> bool| recipes.iter().any(is_meant).then(|| stage.to_owned());
        let physics = recipes.iter().find_map(|recipe| match recipe {
            Recipe::Adhesion(_) => Some("`adhesion`"),
            Recipe::Solve(params) if params.layer.is_some() => Some("a `layer`"),
            Recipe::Solve(params) if params.hardness.is_some() => Some("a `hardness`"),
            Recipe::Solve(params) if params.asperities.is_some() => {
                Some("`method = \"asperities\"`")
            }
            _ => None,
        });
        let listed = recipes.iter().filter_map(|recipe| match recipe {
            Recipe::Solve(params) => {
                Some((stage.to_owned(), params.loads.clone(), params.unit_of_loads()))
            }
            _ => None,
        });
        let mut loads: Vec<_> = listed.collect();
        loads.dedup();
        let conduction = recipes.iter().filter_map(|recipe| match recipe {
            Recipe::Solve(params) => Some((stage.to_owned(), params.bodies.conduction)),
            _ => None,
        });
        Surfaces {
            conduction: conduction.take(1).collect(),
            not_superposable: physics.map(|physics| (stage.to_owned(), physics)),
            loads,
            without_adhesion: named(|recipe| matches!(recipe, Recipe::Solve(_))),
            with_adhesion: named(|recipe| matches!(recipe, Recipe::Adhesion(_))),
            with_images: named(|recipe| {
                matches!(recipe, Recipe::Solve(block)
                    if !block.stiffness.is_none() && block.boundary.is_periodic())
            }),
            with_layer: named(
                |recipe| matches!(recipe, Recipe::Solve(block) if block.layer.is_some()),
            ),
            pressures_uncounted: lacks(Recipe::pressure_bins),
            gaps_uncounted: lacks(Recipe::gap_bins),
            ..Surfaces::default()
        }
    }

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
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.collect::<BTreeSet<_>>().into_iter().collect()
}

/// Returns the smallest range that contains two ranges.
fn spanning(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
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
