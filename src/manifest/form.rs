//! The tables that a stage may have: one for each kind, method and law.

use super::evaluate::{AggregateTable, CorrectTable, EvolutionTable, LawTable, MeasureTable};
use super::generate::{FileTable, ParaboloidTable, PunchTable, RandomTable, WaveTable};
use super::solve::SolveTable;
use crate::stages::Kind;
use crate::written::advice::Wanted;
use crate::written::{Layout, Table};

/// Which keys a stage has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "`word` and `kind` say it")]
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

    /// Its table, for messages about its keys.
    pub(super) fn wanted(self) -> Wanted {
        Wanted {
            place: self.describe(),
            common: self.common_keys(),
            owner: Box::new(move |key| self.owner(key).map(Form::describe)),
        }
    }

    /// Another form that has a key, first one of the same kind.
    fn owner(self, key: &str) -> Option<Form> {
        let has = |form: &Form| form.layout().has(key) || form.common_keys().contains(&key);
        let same_kind = Form::of(self.kind()).find(has);
        same_kind.or_else(|| Form::ALL.into_iter().find(has))
    }

    /// The keys of a stage besides those of its form.
    fn common_keys(self) -> Vec<&'static str> {
        let mut common = vec!["kind"];
        common.extend(Form::selector(self.kind()));
        if self.kind() != Kind::Generate {
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
}
