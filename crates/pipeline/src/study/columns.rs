//! Stages, columns and expressions that figures and claims name.

use std::collections::BTreeMap;

use arrow::datatypes::DataType;

use crate::manifest::figure::{Holds, Selected, SelectedValue};
use asperity_manifest::diagnostics::{Problem, Span, did_you_mean, listed, suggestion};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Key, Spanned};
use asperity_stages::aggregate::Statistic;
use asperity_stages::columns::needed_key;
use asperity_stages::units::TableUnits;
use asperity_tables::table::Table;

/// Columns that select rows, each with the values of which a row has one.
pub type Selection = BTreeMap<String, Vec<SelectedValue>>;

/// Published tables of a study, as far as the checks of its figures and claims need them.
#[derive(Clone, Copy)]
pub struct StageTables<'a, 't> {
    /// Names of the stages.
    pub stages: &'a [&'a str],
    /// Function that returns the table of a stage without rows, if its columns are known.
    pub table: &'a dyn Fn(&str) -> Option<&'t Table>,
    /// Function that returns the units of the table of a stage.
    pub units: &'a dyn Fn(&str) -> TableUnits,
}

impl StageTables<'static, 'static> {
    /// Tables of no study.
    pub const NONE: StageTables<'static, 'static> = StageTables {
        stages: &[],
        table: &|_| None,
        units: &|_| TableUnits { length: None, pressure: None },
    };
}

/// Checks of one table of a manifest that names stages and columns. A method that returns `None`
/// has reported a problem.
pub struct ColumnChecks<'a, 'c, 't> {
    pub tables: StageTables<'a, 't>,
    pub checks: &'a mut Checks<'c>,
}

impl<'t> ColumnChecks<'_, '_, 't> {
    pub fn refuse<T>(
        &mut self,
        message: impl Into<String>,
        span: &Span,
        label: impl Into<String>,
    ) -> Option<T> {
        self.checks.reject(Problem::new(message, span.clone(), label))
    }

    /// Refuses a stage that the study does not have.
    pub fn stage(&mut self, name: &Spanned<String>) -> Option<()> {
        let known = || self.tables.stages.iter().copied();
        if known().any(|stage| stage == name.value) {
            return Some(());
        }
        let message = format!("there is no stage {:?}", name.value);
        let label = suggestion('"', &name.value, known(), "unknown stage");
        let help = format!("the stages are {}", listed(known(), "and"));
        self.checks.reject(Problem::new(message, name.span.clone(), label).help(help))
    }

    /// Returns the table of a stage. If the stage has problems of its own, its columns are unknown.
    pub fn table(&self, stage: &str) -> Option<&'t Table> {
        (self.tables.table)(stage)
    }

    pub fn expression(&mut self, written: &Spanned<String>) -> Option<Expression> {
        match Expression::parse(&written.value) {
            Ok(expression) => Some(expression),
            Err(error) => {
                let span = error.span_in(&written.value, &written.span);
                let message = format!("{:?} is not an expression", written.value);
                self.refuse(message, &span, error.reason)
            }
        }
    }

    /// Refuses a column that a stage does not have or that holds no numbers.
    pub fn number(&mut self, stage: &str, column: &Spanned<String>) -> Option<()> {
        let table = self.table(stage)?;
        if !table.has(&column.value) {
            return self.unknown_column(stage, column, &numbers(table));
        }
        if is_number(table, &column.value) {
            return Some(());
        }
        let message = format!("the column {:?} holds no numbers", column.value);
        self.refuse(message, &column.span, "must be a column of numbers")
    }

    /// Refuses a column that a stage does not have; `known` are those that could be meant.
    pub fn unknown_column<T>(
        &mut self,
        stage: &str,
        column: &Spanned<String>,
        known: &[&str],
    ) -> Option<T> {
        let Spanned { value: name, span } = column;
        let message = format!("`{stage}` has no column {name:?}");
        let is_known = |column: &str| {
            let mut tables = self.tables.stages.iter().filter_map(|stage| self.table(stage));
            tables.any(|table| table.has(column))
        };
        if let Some(label) = needed_key(Statistic::Mean.base_of(name).unwrap_or(name), is_known) {
            return self.refuse(message, span, label);
        }
        let known = || known.iter().copied();
        let label = suggestion('"', name, known(), "unknown column");
        let problem = Problem::new(message, span.clone(), label);
        self.checks.reject(match did_you_mean(name, known()) {
            Some(_) => problem,
            None => problem.help(format!("its columns are {}", listed(known(), "and"))),
        })
    }

    /// Returns what a column of a stage holds.
    pub fn holds(&self, stage: &str, column: &str) -> Holds {
        match self.table(stage) {
            Some(table) if is_number(table, column) => {
                Holds::Numbers((self.tables.units)(stage).of_column(table, column))
            }
            _ => Holds::Others,
        }
    }

    /// Returns the selected values of columns of a stage. The columns of `None`, and those of a
    /// stage whose columns are unknown, are not checked.
    pub fn selection(
        &mut self,
        stage: Option<&str>,
        written: &Key<BTreeMap<String, Spanned<Selected>>>,
    ) -> Option<Selection> {
        let columns = written.written().into_iter().flat_map(|written| &written.value);
        all(columns.map(|(name, selected)| {
            let holds = match stage {
                Some(stage) if self.table(stage).is_some_and(|table| !table.has(name)) => {
                    let column = Spanned { value: name.clone(), span: selected.span.clone() };
                    let known = self.table(stage)?.names();
                    return self.unknown_column(stage, &column, &known);
                }
                Some(stage) => self.holds(stage, name),
                None => Holds::Others,
            };
            let values = self.checks.accept(selected.value.values(holds), &selected.span)?;
            Some((name.clone(), values))
        }))
    }
}

/// Collects values, or returns `None` if one is `None`. All are computed, so that all problems are
/// reported.
pub fn all<T, C: FromIterator<T>>(values: impl IntoIterator<Item = Option<T>>) -> Option<C> {
    let all: Vec<Option<T>> = values.into_iter().collect();
    all.into_iter().collect()
}

/// Returns the text that a part of an expression or of another text is, with its position.
pub fn part_of(text: &Spanned<String>, part: &str) -> Spanned<String> {
    let at = text.span.start + 1 + text.value.find(part).unwrap_or(0);
    let span = at.min(text.span.end)..(at + part.len()).min(text.span.end);
    Spanned { value: part.to_owned(), span }
}

/// Returns the names of columns of numbers. Means are also called by their quantity.
pub fn numbers(table: &Table) -> Vec<&str> {
    let names = table.names().into_iter().filter(|name| is_number(table, name));
    names.flat_map(|name| [Some(name), Statistic::Mean.base_of(name)]).flatten().collect()
}

/// Returns whether a column holds numbers.
pub fn is_number(table: &Table, column: &str) -> bool {
    let field = table.batch().schema_ref().field_with_name(column);
    field.is_ok_and(|field| matches!(field.data_type(), DataType::Float64 | DataType::Int64))
}
