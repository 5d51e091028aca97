//! What a manifest may say of a stage of each kind: which keys, what they are checked against, and
//! what they come to.

use toml::de::DeTable;

use crate::aggregate::keys::AggregateTable;
use crate::correct::CorrectTable;
use crate::fit::keys::{FitPoints, LawWord};
use crate::generate::Origin;
use crate::generate::method::{Method, SurfacePoints};
use crate::measure::keys::MeasureTable;
use crate::solve::keys::SolveTable;
use crate::surface_files::SurfaceFiles;
use crate::{Kind, Reads, Recipe, Rows, StageError, Work, aggregate, correct, measure, solve};
use asperity_contact::distribution::EqualBins;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::written::advice::{self, Wanted};
use asperity_manifest::written::{Layout, Section, Table, reader};
use asperity_tables::table::Table as StoredTable;

/// Which keys a stage has: those of its kind and, where that comes in several, of its method or
/// law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    Generate(Method),
    Solve,
    Measure,
    Correct,
    Fit(LawWord),
    Aggregate,
}

/// Whether a stage reads others, which `from` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// It has no `from`.
    Nothing,
    /// It may have.
    Perhaps,
    /// It must have.
    Stages,
}

impl Reading {
    /// What stages of a kind read, as far as it tells.
    pub fn of(kind: Kind) -> Reading {
        match kind {
            Kind::Generate => Reading::Nothing,
            _ => Reading::Stages,
        }
    }
}

/// The points of a stage's grid, by what they say.
#[derive(Debug)]
pub enum Points {
    Generate(SurfacePoints),
    Solve(Section<SolveTable>),
    Measure(Section<MeasureTable>),
    Correct(Section<CorrectTable>),
    Fit(FitPoints),
    Aggregate(Section<AggregateTable>),
}

/// `an `aggregate` stage`.
pub fn a_stage(kind: Kind) -> String {
    let starts_with_vowel = kind.name().starts_with(['a', 'e', 'i', 'o', 'u']);
    let article = if starts_with_vowel { "an" } else { "a" };
    format!("{article} `{kind}` stage")
}

impl Form {
    /// Every form, in the order of a study.
    pub fn all() -> impl Iterator<Item = Form> {
        Kind::ALL.into_iter().flat_map(Form::of)
    }

    /// The forms of a kind; the first is the one meant when nothing is said.
    pub fn of(kind: Kind) -> Vec<Form> {
        match kind {
            Kind::Generate => Method::ALL.map(Form::Generate).into(),
            Kind::Solve => vec![Form::Solve],
            Kind::Measure => vec![Form::Measure],
            Kind::Correct => vec![Form::Correct],
            Kind::Fit => LawWord::all().map(Form::Fit).collect(),
            Kind::Aggregate => vec![Form::Aggregate],
        }
    }

    /// The kind of stage that has this form.
    pub fn kind(self) -> Kind {
        match self {
            Form::Generate(_) => Kind::Generate,
            Form::Solve => Kind::Solve,
            Form::Measure => Kind::Measure,
            Form::Correct => Kind::Correct,
            Form::Fit(_) => Kind::Fit,
            Form::Aggregate => Kind::Aggregate,
        }
    }

    /// Whether it reads other stages.
    pub fn reading(self) -> Reading {
        match self {
            Form::Generate(method) if method.may_read() => Reading::Perhaps,
            _ => Reading::of(self.kind()),
        }
    }

    /// The key and the word that tell the form from others of its kind, if there are any.
    pub fn selector(self) -> Option<(&'static str, &'static str)> {
        match self {
            Form::Generate(method) => Some(("method", method.word())),
            Form::Fit(law) => Some(("law", law.word())),
            _ => None,
        }
    }

    /// What that word means, in a sentence.
    pub fn about(self) -> Option<&'static str> {
        match self {
            Form::Generate(method) => Some(method.about()),
            Form::Fit(law) => Some(law.about()),
            _ => None,
        }
    }

    /// `a `generate` stage with `method = "file"``.
    pub fn describe(self) -> String {
        match self.selector() {
            Some((key, word)) => format!("{} with `{key} = \"{word}\"`", a_stage(self.kind())),
            None => a_stage(self.kind()),
        }
    }

    /// Whether it is the one meant when nothing is said.
    pub fn is_default(self) -> bool {
        Form::of(self.kind()).first() == Some(&self)
    }

    /// Takes the word that selects the form out of a stage's table.
    pub fn select(kind: Kind, table: &mut DeTable, problems: &mut Problems) -> Option<Form> {
        let forms = Form::of(kind);
        let default = forms.first().copied();
        let Some((key, _)) = default.and_then(Form::selector) else {
            return default;
        };
        let Some(value) = table.remove(key) else {
            return default;
        };
        let words: Vec<_> = forms.iter().filter_map(|form| form.selector()).collect();
        let words: Vec<_> = words.into_iter().map(|(_, word)| word).collect();
        let written = value.get_ref().as_str();
        let place = words.iter().position(|word| Some(*word) == written);
        if place.is_none() {
            problems.push(advice::no_such_word(key, &value, &words));
        }
        place.map(|place| forms[place])
    }

    /// Its table, for messages about its keys.
    fn wanted(self) -> Wanted {
        Wanted {
            place: self.describe(),
            common: self.common_keys(),
            owner: Box::new(move |key| self.owner(key).map(Form::describe)),
        }
    }

    /// Another form that has a key, first one of the same kind.
    fn owner(self, key: &str) -> Option<Form> {
        let has = |form: &Form| form.layout().has(key) || form.common_keys().contains(&key);
        let same_kind = Form::of(self.kind()).into_iter().find(has);
        same_kind.or_else(|| Form::all().find(has))
    }

    /// The keys of a stage besides those of its form.
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

    /// The keys of the form's table.
    pub fn layout(self) -> &'static Layout {
        match self {
            Form::Generate(method) => method.layout(),
            Form::Solve => SolveTable::layout(),
            Form::Measure => MeasureTable::layout(),
            Form::Correct => CorrectTable::layout(),
            Form::Fit(law) => law.layout(),
            Form::Aggregate => AggregateTable::layout(),
        }
    }

    /// Reads a stage's table, from which the keys that all stages have, and the form's word, have
    /// been taken.
    pub fn read(self, table: DeTable, place: Span, problems: &mut Problems) -> Points {
        let wanted = &self.wanted();
        match self {
            Form::Generate(method) => Points::Generate(method.read(table, place, wanted, problems)),
            Form::Solve => Points::Solve(reader::read(table, place, wanted, problems)),
            Form::Measure => Points::Measure(reader::read(table, place, wanted, problems)),
            Form::Correct => Points::Correct(reader::read(table, place, wanted, problems)),
            Form::Fit(law) => Points::Fit(law.read(table, place, wanted, problems)),
            Form::Aggregate => Points::Aggregate(reader::read(table, place, wanted, problems)),
        }
    }
}

impl Points {
    /// What the points of the grid come to; whatever is wrong is reported.
    pub fn work(&self, given: &mut Given) -> Option<Work> {
        let recipes = match self {
            Points::Generate(points) => return points.surfaces(given).map(Work::Generate),
            Points::Solve(section) => solve::keys::recipes(section, given),
            Points::Measure(section) => measure::keys::recipes(section, given),
            Points::Correct(section) => correct::recipes(section, given),
            Points::Fit(points) => points.recipes(given),
            Points::Aggregate(section) => aggregate::keys::recipes(section, given),
        };
        recipes.filter(|recipes| !recipes.is_empty()).map(Work::Evaluate)
    }

    /// What such a stage can read, if not what others of its kind can.
    pub fn reads(&self) -> Option<Reads> {
        match self {
            Points::Generate(points) => points.reads(),
            Points::Fit(points) => points.reads(),
            _ => None,
        }
    }

    /// What its rows are about, if not the same as those of others of its kind.
    pub fn makes(&self) -> Option<Rows> {
        match self {
            Points::Generate(points) if points.lack_heights() => Some(Rows::Spectra),
            Points::Measure(section) => measure::keys::makes(section),
            _ => None,
        }
    }

    /// Whether it looks at each of its inputs as a table of its own.
    pub fn is_query(&self) -> bool {
        match self {
            Points::Aggregate(section) => aggregate::keys::is_query(section),
            _ => false,
        }
    }

    /// Its table without rows, found with those of its inputs; what is wrong with it shows before
    /// anything is computed.
    pub fn validate_answer(
        &self,
        answer: Result<StoredTable, StageError>,
        inputs: &[(String, StoredTable)],
        problems: &mut Problems,
    ) -> Option<StoredTable> {
        match self {
            Points::Aggregate(section) => {
                aggregate::keys::validate_answer(section, answer, inputs, problems)
            }
            _ => answer.ok(),
        }
    }
}

/// What must be known of the surfaces that a stage goes back to, with the stage that made them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Measured maps that are not periodic and have not been made so.
    pub open: Option<String>,
    /// Random surfaces that cannot be drawn again: their spectra are in tables.
    pub kept_alone: Option<String>,
    /// Surfaces whose nodes are not as far apart along x as along y, and Δx/Δy.
    pub oblong: Option<(String, f64)>,
    /// A stage that presses them and counts no pressures.
    pub pressures_uncounted: Option<String>,
    /// A stage that presses them and counts no gaps.
    pub gaps_uncounted: Option<String>,
    /// The smallest and the largest rms slope, of surfaces that are drawn to have one.
    pub slopes: Option<[f64; 2]>,
}

impl Surfaces {
    /// Those that a stage makes, and what it finds out of them.
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

    /// What a stage counts of them, if it presses them.
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

    /// These and others; of maps and meshes one stands for all.
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

/// The range that holds both.
fn spanning(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// What is known when a stage's keys are checked.
pub struct Given<'a> {
    pub seed: u64,
    pub sources: &'a mut SurfaceFiles,
    /// Whether it names stages that it reads.
    pub reads_stages: bool,
    /// What the rows that the stage reads are about, where that can be told.
    pub read: Option<Rows>,
    /// What it reads, without rows, where that is known.
    pub input: Option<&'a StoredTable>,
    /// What must be known of the surfaces that it goes back to.
    pub surfaces: Surfaces,
    /// Hears of whatever is wrong.
    pub problems: &'a mut Problems,
}
