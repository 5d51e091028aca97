//! What a stage's table says, point by point of its grid.

use toml::de::DeTable;

use super::evaluate::{AggregateTable, CorrectTable, EvolutionTable, LawTable, MeasureTable};
use super::form::Form;
use super::generate::{FileTable, ParaboloidTable, PunchTable, RandomTable, WaveTable};
use super::solve::SolveTable;
use crate::diagnostics::{Problems, Span};
use crate::stages::Kind;
use crate::written::{Section, advice, reader};

/// The points of a stage's grid, by what they say.
#[derive(Debug)]
#[expect(missing_docs, reason = "the table of each says it")]
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

impl Form {
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
        let wanted = self.wanted();
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
