//! What a manifest may say of a stage of each kind: which keys, and what they come to.

use toml::de::DeTable;

use super::aggregate::keys::AggregateTable;
use super::correct::keys::CorrectTable;
use super::fit::checks::{FitPoints, LawWord};
use super::generate::method::{Method, SurfacePoints};
use super::measure::keys::MeasureTable;
use super::solve::keys::SolveTable;
use super::{Given, Kind, Reads, Rows, StageError, Work, aggregate, correct, measure, solve};
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::written::advice;
use asperity_manifest::written::advice::Wanted;
use asperity_manifest::written::{Layout, Section, Table, reader};
use asperity_tables::table::Table as StoredTable;

/// Which keys a stage has: those of its kind and, where that comes in several, of its method or law.
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

    /// Reads a stage's table, from which the keys that all stages have, and the form's word, have been
    /// taken.
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
            Points::Solve(section) => solve::checks::recipes(section, given),
            Points::Measure(section) => measure::keys::recipes(section, given),
            Points::Correct(section) => correct::keys::recipes(section, given),
            Points::Fit(points) => points.recipes(given),
            Points::Aggregate(section) => aggregate::checks::recipes(section, given),
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
            Points::Aggregate(section) => aggregate::checks::is_query(section),
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
                aggregate::checks::validate_answer(section, answer, inputs, problems)
            }
            _ => answer.ok(),
        }
    }
}
