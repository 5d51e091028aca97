//! Stages that compute statistics of groups of rows or answer SQL queries.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use bytesize::ByteSize;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::columns::STOP;
use super::fit::status::STATUS;
use super::{
    Context, Definition, Effort, Extent, Input, InputScope, Kind, Reads, Recipe, RowKind, Stage,
    StageError, stacked,
};
use crate::version::{PartVersion, Version};
use asperity_manifest::diagnostics::counted;
use asperity_tables::column::{Column, Role};
use asperity_tables::table::Table;

mod groups;
pub mod keys;
mod multilevel;
pub mod sql;
mod statistics;
mod theory;

pub use groups::reduce as grouped;
pub(crate) use multilevel::numbers;
pub use multilevel::{FinestMean, Multilevel, finest_means, reduce as multilevel_means};
pub use statistics::Statistic;
pub use theory::{Model, SPECTRUM_COLUMNS, nayak_parameters};

/// Version of the computed numbers, part of the key of every stored result. Raise it whenever the
/// numbers change.
pub const VERSION: Version = Version::new(6, &[]);

/// Definition of the kind of stage `aggregate`.
pub const STAGE: Definition = Definition {
    name: "aggregate",
    version: VERSION,
    reads: Reads {
        rows: RowKind::ALL,
        from: Cow::Borrowed("stages of any one kind, or with `sql` any stages"),
    },
    row_kind: |_| Some(RowKind::Statistics),
    columns,
    summary: |table, _| {
        let columns = table.schema().fields().len();
        Ok(vec![counted(table.rows(), "row"), counted(columns, "column")])
    },
};

/// Version of the answers to queries, part of the key of every stored answer.
pub const SQL_VERSION: Version = Version::new(
    1,
    &[
        "`sum(1)`, windows with `order by`, `%`, `round` and `cast` are computed as in DuckDB",
        "columns of stages with `sql` have the units that follow from the query",
    ],
);

/// Statistics that a task computes, or query that it answers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Params {
    /// Statistics of columns within groups.
    Groups(Groups),
    /// Means from surfaces on several meshes.
    Multilevel(Multilevel),
    Sql(Sql),
}

/// Statistics of columns within groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Groups {
    /// Columns whose values define a group; `None` for all columns that identify rows, except
    /// surface, seed and realization.
    pub group_by: Option<Vec<String>>,
    /// Columns whose statistics are computed.
    pub over: Vec<String>,
    pub statistics: Vec<Statistic>,
    /// Theories whose predicted areas are added.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<Model>,
}

impl Groups {
    /// Returns whether the statistics include standard errors or intervals.
    fn needs_errors(&self) -> bool {
        self.statistics.contains(&Statistic::Sem) || !self.levels().is_empty()
    }

    /// Returns the levels of the requested confidence intervals.
    fn levels(&self) -> Vec<f64> {
        let level = |statistic: &Statistic| match statistic {
            Statistic::Confidence(level) => Some(*level),
            _ => None,
        };
        self.statistics.iter().filter_map(level).collect()
    }
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Aggregate
    }

    fn part_versions(&self) -> Vec<PartVersion> {
        match self {
            Params::Groups(_) => Vec::new(),
            Params::Multilevel(_) => {
                vec![PartVersion::new("version", "multilevel mean", multilevel::VERSION)]
            }
            Params::Sql(_) => vec![PartVersion::new("version", "query", SQL_VERSION)],
        }
    }

    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let tables: Vec<Table> = inputs.iter().map(|input| input.table.clone()).collect();
        match self {
            Params::Groups(groups) => groups::reduce(&Table::stack(&tables)?, groups),
            Params::Multilevel(means) => multilevel::reduce(&Table::stack(&tables)?, means),
            Params::Sql(sql) => sql::query(&tables, sql, context.memory),
        }
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        match self {
            Params::Groups(groups) => groups::reduce(&stacked(inputs)?, groups),
            Params::Multilevel(means) => multilevel::reduce(&stacked(inputs)?, means),
            Params::Sql(sql) => {
                let tables: Vec<Table> = inputs.iter().map(|(_, table)| table.clone()).collect();
                let named = inputs.iter().map(|(name, _)| (name.clone(), 1)).collect();
                sql::query(&tables, &sql.for_inputs(named), ByteSize(u64::MAX))
            }
        }
    }

    fn input_scope(&self) -> InputScope {
        InputScope::All
    }

    /// Returns the table with the columns that the task uses: the named columns and those that
    /// identify rows. For theories and queries, all columns are kept.
    fn needed(&self, table: Table) -> Table {
        let (over, group_by) = match self {
            Params::Groups(groups) if groups.models.is_empty() => (&groups.over, &groups.group_by),
            Params::Multilevel(means) => (&means.over, &None),
            Params::Groups(_) | Params::Sql(_) => return table,
        };
        let columns = over.iter().chain(group_by.iter().flatten());
        let named: Vec<&str> =
            columns.map(String::as_str).chain([STOP.name, STATUS.name]).collect();
        table.keep(|name, role| named.contains(&name) || role.is_some_and(Role::is_coordinate))
    }

    fn query(&self) -> Option<&str> {
        match self {
            Params::Groups(_) | Params::Multilevel(_) => None,
            Params::Sql(sql) => Some(&sql.query),
        }
    }

    /// A word of a query that only looks like the name of the column does no harm: the task then
    /// depends on a column that it does not read.
    fn uses_column(&self, name: &str) -> bool {
        match self {
            Params::Groups(groups) => groups.group_by.iter().flatten().any(|column| column == name),
            Params::Multilevel(_) => false,
            Params::Sql(sql) => {
                let is_in_word = |letter: char| letter.is_alphanumeric() || letter == '_';
                sql.query.split(|letter| !is_in_word(letter)).any(|word| word == name)
            }
        }
    }

    fn for_inputs(&self, inputs: Vec<(String, usize)>) -> Option<Recipe> {
        match self {
            Params::Groups(_) | Params::Multilevel(_) => None,
            Params::Sql(sql) => {
                Some(Recipe::Aggregate(Arc::new(Params::Sql(sql.for_inputs(inputs)))))
            }
        }
    }

    /// Estimates the time of the task: 5 ms per load for each theory that integrates over summits.
    fn effort(&self, extent: Extent) -> Effort {
        let slow_models = match self {
            Params::Groups(groups) => {
                let models = groups.models.iter();
                models.filter(|model| model.integrates_over_summits()).count()
            }
            Params::Multilevel(_) | Params::Sql(_) => 0,
        };
        Effort::seconds(0.02 + 5e-3 * (slow_models * extent.rows) as f64)
    }
}

/// SQL query over the tables of stages.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sql {
    pub query: String,
    /// Names of the inputs in the query, each with its number of tables; empty before the study is
    /// planned.
    pub tables: Vec<(String, usize)>,
    /// Units and meanings of result columns that no input has. They do not influence the result and
    /// are not part of the recipe.
    #[serde(skip)]
    pub columns: BTreeMap<String, Meaning>,
    /// [`SQL_VERSION`].
    pub version: u32,
}

impl Sql {
    /// Returns the query with the field `tables` set to the name and number of tables of each
    /// input.
    pub fn for_inputs(&self, tables: Vec<(String, usize)>) -> Sql {
        Sql { tables, ..self.clone() }
    }
}

/// The description of a column of the result of a query.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Meaning {
    /// Unit of the values of the column: `"1"` for pure numbers, empty (the default) for values
    /// without a unit.
    #[serde(default)]
    pub unit: String,
    /// Meaning of the column in one phrase.
    pub meaning: String,
}

/// Returns the columns that the stage may add, without the statistics of input columns such as
/// `area_fraction_mean`.
pub fn columns() -> Vec<Column> {
    let models = Model::ALL.into_iter().flat_map(Model::columns);
    statistics::GROUP_COLUMNS.into_iter().chain(models).collect()
}
