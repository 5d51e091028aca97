//! The tables that a stage may have: one for each kind, method and law.

use toml::de::DeTable;

use super::advice::{self, Wanted};
use super::evaluate::{AggregateTable, CorrectTable, EvolutionTable, LawTable, MeasureTable};
use super::generate::{FileTable, ParaboloidTable, PunchTable, RandomTable, WaveTable};
use super::grid::Section;
use super::layout::{Layout, Table};
use super::reader;
use super::solve::SolveTable;
use crate::diagnostics::{Problems, Span};
use crate::stages::Kind;

/// Which keys a stage has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    Filter,
    RandomPhase,
    File,
    Paraboloid,
    Wave,
    WaveProduct,
    WaveSum,
    FlatPunch,
    Solve,
    Measure,
    Correct,
    ContactEvolution,
    MeanPressure,
    ScaledErf,
    LoadSeparation,
    MeshConvergence,
    Aggregate,
}

/// The points of a stage's grid, by what they say.
#[derive(Debug)]
pub enum Points {
    Random(Form, Section<RandomTable>),
    File(Section<FileTable>),
    Paraboloid(Section<ParaboloidTable>),
    Wave(Form, Section<WaveTable>),
    Punch(Section<PunchTable>),
    Solve(Section<SolveTable>),
    Measure(Section<MeasureTable>),
    Correct(Section<CorrectTable>),
    Evolution(Section<EvolutionTable>),
    Law(Form, Section<LawTable>),
    Aggregate(Section<AggregateTable>),
}

/// `an `aggregate` stage`.
pub fn a_stage(kind: Kind) -> String {
    let article = if kind == Kind::Aggregate { "an" } else { "a" };
    format!("{article} `{kind}` stage")
}

impl Form {
    /// Every form; of one kind, the first is the one meant when nothing is said.
    pub const ALL: [Form; 17] = [
        Form::Filter,
        Form::RandomPhase,
        Form::File,
        Form::Paraboloid,
        Form::Wave,
        Form::WaveProduct,
        Form::WaveSum,
        Form::FlatPunch,
        Form::Solve,
        Form::Measure,
        Form::Correct,
        Form::ContactEvolution,
        Form::MeanPressure,
        Form::ScaledErf,
        Form::LoadSeparation,
        Form::MeshConvergence,
        Form::Aggregate,
    ];

    /// The kind of stage that has this form.
    pub fn kind(self) -> Kind {
        match self {
            Form::Filter | Form::RandomPhase | Form::File => Kind::Generate,
            Form::Paraboloid | Form::Wave | Form::WaveProduct => Kind::Generate,
            Form::WaveSum | Form::FlatPunch => Kind::Generate,
            Form::Solve => Kind::Solve,
            Form::Measure => Kind::Measure,
            Form::Correct => Kind::Correct,
            Form::ContactEvolution | Form::MeanPressure => Kind::Fit,
            Form::ScaledErf | Form::LoadSeparation | Form::MeshConvergence => Kind::Fit,
            Form::Aggregate => Kind::Aggregate,
        }
    }

    /// The word that tells the form from others of its kind.
    pub fn word(self) -> Option<&'static str> {
        match self {
            Form::Filter => Some("filter"),
            Form::RandomPhase => Some("random-phase"),
            Form::File => Some("file"),
            Form::Paraboloid => Some("paraboloid"),
            Form::Wave => Some("wave"),
            Form::WaveProduct => Some("wave-product"),
            Form::WaveSum => Some("wave-sum"),
            Form::FlatPunch => Some("flat-punch"),
            Form::ContactEvolution => Some("contact-evolution"),
            Form::MeanPressure => Some("mean-pressure"),
            Form::ScaledErf => Some("scaled-erf"),
            Form::LoadSeparation => Some("load-separation"),
            Form::MeshConvergence => Some("mesh-convergence"),
            Form::Solve | Form::Measure | Form::Correct | Form::Aggregate => None,
        }
    }

    /// The key that holds the word, for kinds that come in several forms.
    pub fn selector(kind: Kind) -> Option<&'static str> {
        match kind {
            Kind::Generate => Some("method"),
            Kind::Fit => Some("law"),
            Kind::Solve | Kind::Measure | Kind::Correct | Kind::Aggregate => None,
        }
    }

    /// The forms of a kind.
    pub fn of(kind: Kind) -> impl Iterator<Item = Form> {
        Form::ALL
            .into_iter()
            .filter(move |form| form.kind() == kind)
    }

    /// `a `generate` stage with `method = "file"``.
    pub fn describe(self) -> String {
        let kind = self.kind();
        match (Form::selector(kind), self.word()) {
            (Some(key), Some(word)) => format!("{} with `{key} = \"{word}\"`", a_stage(kind)),
            _ => a_stage(kind),
        }
    }

    /// The keys of the form's table.
    pub fn layout(self) -> &'static Layout {
        match self {
            Form::Filter | Form::RandomPhase => RandomTable::layout(),
            Form::File => FileTable::layout(),
            Form::Paraboloid => ParaboloidTable::layout(),
            Form::Wave | Form::WaveProduct | Form::WaveSum => WaveTable::layout(),
            Form::FlatPunch => PunchTable::layout(),
            Form::Solve => SolveTable::layout(),
            Form::Measure => MeasureTable::layout(),
            Form::Correct => CorrectTable::layout(),
            Form::ContactEvolution => EvolutionTable::layout(),
            Form::MeanPressure | Form::ScaledErf => LawTable::layout(),
            Form::LoadSeparation | Form::MeshConvergence => LawTable::layout(),
            Form::Aggregate => AggregateTable::layout(),
        }
    }

    /// Takes the word that selects the form out of a stage's table.
    pub(super) fn select(kind: Kind, table: &mut DeTable, problems: &mut Problems) -> Option<Form> {
        let default = Form::of(kind).next();
        let Some(key) = Form::selector(kind) else {
            return default;
        };
        let Some(value) = table.remove(key) else {
            return default;
        };
        let written = value.get_ref().as_str();
        let form = Form::of(kind).find(|form| form.word().is_some() && form.word() == written);
        if form.is_none() {
            let words: Vec<_> = Form::of(kind).filter_map(Form::word).collect();
            problems.push(advice::no_such_word(key, &value, &words));
        }
        form
    }

    /// Reads the rest of a stage's table.
    pub(super) fn read(self, table: DeTable, place: Span, problems: &mut Problems) -> Points {
        let wanted = Wanted::in_a(self);
        match self {
            Form::Filter | Form::RandomPhase => {
                Points::Random(self, reader::read(table, place, &wanted, problems))
            }
            Form::File => Points::File(reader::read(table, place, &wanted, problems)),
            Form::Paraboloid => Points::Paraboloid(reader::read(table, place, &wanted, problems)),
            Form::Wave | Form::WaveProduct | Form::WaveSum => {
                Points::Wave(self, reader::read(table, place, &wanted, problems))
            }
            Form::FlatPunch => Points::Punch(reader::read(table, place, &wanted, problems)),
            Form::Solve => Points::Solve(reader::read(table, place, &wanted, problems)),
            Form::Measure => Points::Measure(reader::read(table, place, &wanted, problems)),
            Form::Correct => Points::Correct(reader::read(table, place, &wanted, problems)),
            Form::ContactEvolution => {
                Points::Evolution(reader::read(table, place, &wanted, problems))
            }
            Form::MeanPressure | Form::ScaledErf | Form::LoadSeparation | Form::MeshConvergence => {
                Points::Law(self, reader::read(table, place, &wanted, problems))
            }
            Form::Aggregate => Points::Aggregate(reader::read(table, place, &wanted, problems)),
        }
    }
}
