//! The variants of stages, which decide the keys of their tables, and the checked keys.

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::correct::CorrectTable;
use crate::fit::keys::{FitPoints, LawWord};
use crate::generate::Origin;
use crate::generate::method::{Method, SurfacePoints};
use crate::measure::keys::MeasureTable;
use crate::solve::keys::SolveTable;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Reads, Recipe, RowKind, StageError, Work, aggregate, correct, measure, solve};
use asperity_contact::distribution::EqualBins;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::validation::unknown_word;
use asperity_manifest::keys::{KeyTable, Layout, Section, reader};
use asperity_tables::table::Table;

/// A kind of stage, with the method or law that decides its keys.
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
pub enum Reading {
    /// It has none.
    Nothing,
    /// It may have it.
    Optional,
    /// It must have it.
    Required,
}

impl Reading {
    /// Returns whether stages of a kind have it, as far as the kind decides it.
    pub fn of_kind(kind: Kind) -> Reading {
        match kind {
            Kind::Generate => Reading::Nothing,
            _ => Reading::Required,
        }
    }
}

/// The points of the grid of a stage.
#[derive(Debug)]
pub enum Points {
    Generate(SurfacePoints),
    Solve(Section<SolveTable>),
    Measure(Section<MeasureTable>),
    Correct(Section<CorrectTable>),
    Fit(FitPoints),
    Aggregate(Section<AggregateTable>),
}

/// Returns a kind of stage with its article: `an `aggregate` stage`.
pub fn a_stage(kind: Kind) -> String {
    let starts_with_vowel = kind.name().starts_with(['a', 'e', 'i', 'o', 'u']);
    let article = if starts_with_vowel { "an" } else { "a" };
    format!("{article} `{kind}` stage")
}

impl StageVariant {
    /// Returns all variants in the order of a study.
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

    /// Returns the kind of stage.
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

    /// Returns whether it reads other stages.
    pub fn reading(self) -> Reading {
        match self {
            StageVariant::Generate(method) if method.may_read() => Reading::Optional,
            _ => Reading::of_kind(self.kind()),
        }
    }

    /// Returns the key and the word that select the variant, if its kind has several.
    pub fn selector(self) -> Option<(&'static str, &'static str)> {
        match self {
            StageVariant::Generate(method) => Some(("method", method.word())),
            StageVariant::Fit(law) => Some(("law", law.word())),
            _ => None,
        }
    }

    /// Returns a sentence about that word.
    pub fn about(self) -> Option<&'static str> {
        match self {
            StageVariant::Generate(method) => Some(method.about()),
            StageVariant::Fit(law) => Some(law.about()),
            _ => None,
        }
    }

    /// Returns its name in messages: `a `generate` stage with `method = "file"``.
    pub fn describe(self) -> String {
        match self.selector() {
            Some((key, word)) => format!("{} with `{key} = \"{word}\"`", a_stage(self.kind())),
            None => a_stage(self.kind()),
        }
    }

    /// Returns whether it is the default of its kind.
    pub fn is_default(self) -> bool {
        StageVariant::of_kind(self.kind()).first() == Some(&self)
    }

    /// Removes the word that selects the variant from the table of a stage, and returns the
    /// variant.
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

    /// Returns its keys, for messages about other ones.
    fn expected_keys(self) -> ExpectedKeys {
        ExpectedKeys {
            table: self.describe(),
            common: self.common_keys(),
            owner: Box::new(move |key| self.owner(key).map(StageVariant::describe)),
        }
    }

    /// Returns another variant with a key, preferably of the same kind.
    fn owner(self, key: &str) -> Option<StageVariant> {
        let has = |variant: &StageVariant| {
            variant.layout().has(key) || variant.common_keys().contains(&key)
        };
        let same_kind = StageVariant::of_kind(self.kind()).into_iter().find(has);
        same_kind.or_else(|| StageVariant::all().find(has))
    }

    /// Returns the keys of a stage that are read before those of its variant.
    fn common_keys(self) -> Vec<&'static str> {
        let mut common = vec!["kind"];
        common.extend(self.selector().map(|(key, _)| key));
        if self.reading() != Reading::Nothing {
            common.push("from");
        }
        if !self.layout().swept.is_empty() {
            common.push("cases");
        }
        common
    }

    /// Returns the keys of its table.
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

    /// Reads the table of a stage, from which the keys that all stages have, and the word that
    /// selects the variant, have been removed.
    pub fn read(self, table: DeTable, span: Span, problems: &mut Problems) -> Points {
        let expected = &self.expected_keys();
        match self {
            StageVariant::Generate(method) => {
                Points::Generate(method.read(table, span, expected, problems))
            }
            StageVariant::Solve => Points::Solve(reader::read(table, span, expected, problems)),
            StageVariant::Measure => Points::Measure(reader::read(table, span, expected, problems)),
            StageVariant::Correct => Points::Correct(reader::read(table, span, expected, problems)),
            StageVariant::Fit(law) => Points::Fit(law.read(table, span, expected, problems)),
            StageVariant::Aggregate => {
                Points::Aggregate(reader::read(table, span, expected, problems))
            }
        }
    }
}

impl Points {
    /// Checks the points and returns the tasks of the stage; mistakes are reported.
    pub fn work(&self, context: &mut CheckContext) -> Option<Work> {
        let recipes = match self {
            Points::Generate(points) => return points.surfaces(context).map(Work::Generate),
            Points::Solve(section) => solve::keys::recipes(section, context),
            Points::Measure(section) => measure::keys::recipes(section, context),
            Points::Correct(section) => correct::recipes(section, context),
            Points::Fit(points) => points.recipes(context),
            Points::Aggregate(section) => aggregate::keys::recipes(section, context),
        };
        recipes.filter(|recipes| !recipes.is_empty()).map(Work::Evaluate)
    }

    /// Returns the rows that the stage can read, if they differ from those of other variants of its
    /// kind.
    pub fn reads(&self) -> Option<Reads> {
        match self {
            Points::Generate(points) => points.reads(),
            Points::Fit(points) => points.reads(),
            _ => None,
        }
    }

    /// Returns the rows that the stage makes, if they differ from those of other variants of its
    /// kind.
    pub fn makes(&self) -> Option<RowKind> {
        match self {
            Points::Generate(points) if points.lack_heights() => Some(RowKind::Spectra),
            Points::Measure(section) => measure::keys::makes(section),
            _ => None,
        }
    }

    /// Returns whether the stage is a query, to which each of its inputs is a separate table.
    pub fn is_query(&self) -> bool {
        match self {
            Points::Aggregate(section) => aggregate::keys::is_query(section),
            _ => false,
        }
    }

    /// Checks the empty table that the stage computes from the empty tables of its inputs.
    pub fn validate_answer(
        &self,
        answer: Result<Table, StageError>,
        inputs: &[(String, Table)],
        problems: &mut Problems,
    ) -> Option<Table> {
        match self {
            Points::Aggregate(section) => {
                aggregate::keys::validate_answer(section, answer, inputs, problems)
            }
            _ => answer.ok(),
        }
    }
}

/// Properties of the surfaces that a stage depends on, each with the name of the stage that has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// The stage with measured maps that are not periodic and have not been made so.
    pub open: Option<String>,
    /// The stage with random surfaces that cannot be drawn again, because their spectra are in
    /// tables.
    pub kept_alone: Option<String>,
    /// The stage whose cells are not square, and their Δx/Δy.
    pub oblong: Option<(String, f64)>,
    /// A `solve` stage without a histogram of pressures.
    pub pressures_uncounted: Option<String>,
    /// A `solve` stage without a histogram of gaps.
    pub gaps_uncounted: Option<String>,
    /// The smallest and the largest rms slope to which surfaces are scaled.
    pub slopes: Option<[f64; 2]>,
}

impl Surfaces {
    /// Returns the properties of the surfaces that a stage makes or presses.
    pub fn made_by(stage: &str, work: &Work) -> Surfaces {
        let surfaces = match work {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(recipes) => return Surfaces::pressed_by(stage, recipes),
        };
        let params = || surfaces.iter().map(|surfaces| &surfaces.params);
        let is_open = params().any(|params| params.origin.is_open());
        let mut grids = params().filter_map(|params| params.grid().ok());
        let oblong = grids.find(|grid| !grid.has_square_cells());
        let slopes = params().filter_map(|params| match &params.origin {
            Origin::Random { surface, .. } => Some([surface.rms_slope; 2]),
            Origin::Spectrum { surface, .. } => surface.rms_slope.map(|slope| [slope; 2]),
            Origin::File(_) | Origin::Shape { .. } => None,
        });
        Surfaces {
            slopes: slopes.reduce(spanning),
            open: is_open.then(|| stage.to_owned()),
            pressures_uncounted: None,
            gaps_uncounted: None,
            kept_alone: params()
                .any(|params| params.origin.reads_stage())
                .then(|| stage.to_owned()),
            oblong: oblong.map(|grid| {
                let [step_x, step_y] = grid.spacing();
                (stage.to_owned(), step_x / step_y)
            }),
        }
    }

    /// Returns what a `solve` stage does not count.
    fn pressed_by(stage: &str, recipes: &[Recipe]) -> Surfaces {
        let lacks = |bins: fn(&solve::Params) -> Option<EqualBins>| {
            let lacks = |recipe: &Recipe| match recipe {
                Recipe::Solve(block) => bins(block).is_none(),
                _ => false,
            };
            recipes.iter().any(lacks).then(|| stage.to_owned())
        };
        Surfaces {
            pressures_uncounted: lacks(|block| block.pressure_bins),
            gaps_uncounted: lacks(|block| block.gap_bins),
            ..Surfaces::default()
        }
    }

    /// Combines the properties of two sets of surfaces; one stage stands for all with a property.
    pub fn and(self, other: &Surfaces) -> Surfaces {
        let slopes = self.slopes.into_iter().chain(other.slopes);
        Surfaces {
            slopes: slopes.reduce(spanning),
            open: self.open.or_else(|| other.open.clone()),
            kept_alone: self.kept_alone.or_else(|| other.kept_alone.clone()),
            pressures_uncounted: self
                .pressures_uncounted
                .or_else(|| other.pressures_uncounted.clone()),
            gaps_uncounted: self.gaps_uncounted.or_else(|| other.gaps_uncounted.clone()),
            oblong: self.oblong.or_else(|| other.oblong.clone()),
        }
    }
}

/// Returns the smallest range that contains both.
fn spanning(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// The surroundings of a stage that the checks of its keys need.
pub struct CheckContext<'a> {
    /// The seed of the study.
    pub seed: u64,
    pub sources: &'a mut SurfaceFiles,
    /// True if the stage reads other stages.
    pub reads_stages: bool,
    /// The kind of rows that the stage reads, if known.
    pub read: Option<RowKind>,
    /// The empty table that the stage reads, if known.
    pub input: Option<&'a Table>,
    pub surfaces: Surfaces,
    /// Receives the problems.
    pub problems: &'a mut Problems,
}
