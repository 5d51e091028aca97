//! The keys of a stage at its parameter points, whose check gives the work of the stage.

use std::fmt;

use toml::de::DeTable;

use crate::check_context::{CheckContext, FromKey, NamedSurfaces};
use crate::surface::planned::{Growing, PlannedSurfaces};
use crate::{InputScope, Kind, Reads, Recipe, RowKind, StageError};
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::{KeyTable, Layout, Section, Spanned, reader};
use asperity_tables::table::Table;

/// A way to write a stage: its kind, and the method or law if the kind has several.
pub struct StageVariant {
    pub kind: Kind,
    /// Key and value that select the variant, if its kind has several.
    pub selector: Option<(&'static str, &'static str)>,
    /// Description of the method or law, for editors and the guide.
    pub about: Option<&'static str>,
    pub from_key: FromKey,
    /// Declarations of the keys.
    pub layout: &'static Layout,
    /// Rewrites the table of a stage before it is read.
    pub prepare: fn(DeTable<'_>) -> DeTable<'_>,
    pub read: Box<ReadPoints>,
}

type ReadPoints =
    dyn Fn(DeTable, Span, &ExpectedKeys, &mut Problems) -> Box<dyn StagePoints> + Send + Sync;

/// The keys of a stage at its parameter points.
pub trait StagePoints: fmt::Debug {
    /// Checks the points and returns the tasks of the stage, or `None` after reporting problems.
    fn work(&self, context: &mut CheckContext) -> Option<Work>;

    /// Returns the kinds of rows that the stage can read, or `None` if all stages of its kind read
    /// the same ones.
    fn reads(&self) -> Option<Reads> {
        None
    }

    /// Returns the kind of rows that the stage makes, or `None` for the default of its kind of
    /// stage.
    fn row_kind(&self) -> Option<RowKind> {
        None
    }

    /// Returns the name of the stage whose surfaces are pressed against those of `from`, if there
    /// is one.
    fn against(&self) -> Option<&Spanned<String>> {
        None
    }

    /// Returns the pairs of surfaces of a stage that presses surfaces against each other, or `None`
    /// after reporting problems.
    fn pairs(
        &self,
        _from: &[NamedSurfaces],
        _against: NamedSurfaces,
        _problems: &mut Problems,
    ) -> Option<Vec<PlannedSurfaces>> {
        None
    }

    /// Returns the name of the stage whose height distribution the surfaces have, if there is one.
    fn heights_of(&self) -> Option<&Spanned<String>> {
        None
    }

    /// Returns the condition on the number of surfaces, if it is not fixed.
    fn growing(&self) -> Option<&Growing> {
        None
    }

    /// Returns whether the stage is a query, for which each input is a separate table.
    fn is_query(&self) -> bool {
        false
    }

    /// Returns the position of the key that asks for multilevel means, if there is one.
    fn multilevel(&self) -> Option<&Span> {
        None
    }

    /// Checks `answer`, the empty table that the stage computes from the empty tables `inputs`.
    /// Returns this table, or `None` after reporting problems.
    fn validate_answer(
        &self,
        answer: Result<Table, StageError>,
        _inputs: &[(String, Table)],
        _problems: &mut Problems,
    ) -> Option<Table> {
        answer.ok()
    }
}

impl StageVariant {
    /// Creates the only variant of a kind. `points` completes the keys with the choice that makes
    /// the variant.
    pub fn new<T: KeyTable, P: StagePoints + 'static>(
        kind: Kind,
        points: impl Fn(Section<T>) -> P + Send + Sync + 'static,
    ) -> StageVariant {
        StageVariant {
            kind,
            selector: None,
            about: None,
            from_key: FromKey::of_kind(kind),
            layout: T::layout(),
            prepare: |table| table,
            read: Box::new(move |table, span, expected, problems| {
                Box::new(points(reader::read(table, span, expected, problems)))
            }),
        }
    }

    /// Makes the variant one of several, which the value `word` of a key selects.
    pub fn selected_by(self, key: &'static str, word: &'static str, about: &'static str) -> Self {
        StageVariant { selector: Some((key, word)), about: Some(about), ..self }
    }
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
    /// Returns the work of checked recipes, or `None` if there are none.
    pub fn evaluate(recipes: Option<Vec<Recipe>>) -> Option<Work> {
        recipes.filter(|recipes| !recipes.is_empty()).map(Work::Evaluate)
    }

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
}
