//! Keys of `aggregate` stages, and checks of their values.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::aggregate::{
    Groups, Meaning, Model, Multilevel, Params, SPECTRUM_COLUMNS, SQL_VERSION, Sql, Statistic,
    multilevel,
};
use crate::check_context::{Property, StageChecks, exclude};
use crate::columns::ALTERATIONS;
use crate::error::QueryError;
use crate::stage_points::{StagePoints, Work};
use crate::surface::labels::with_paths;
use crate::surface_files::SurfaceFiles;
use crate::{CheckContext, Recipe, StageError};
use asperity_manifest::diagnostics::{Problem, Problems, Span, chain, listed, suggestion};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::list;
use asperity_manifest::keys::{Key, Section, Spanned, table};
use asperity_tables::table::Table;

/// Statistics of the rows of other stages.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AggregateTable {
    /// SQL query over the stages in `from`, each of which is a table. It replaces all other keys
    /// except `columns`. Rows that no `order by` sorts keep the order of the rows from which they
    /// are computed.
    pub sql: Key<String>,
    /// Descriptions of the columns of the result of `sql`, by name:
    /// `{ unit = "…", meaning = "…" }`. Columns without a description here have that of the column
    /// with the same name that the stage reads.
    pub columns: Key<BTreeMap<String, Spanned<Meaning>>>,
    /// Estimator of the means over surfaces. By default it is the mean of the rows of each group.
    #[schemars(extend("default" = "plain"))]
    pub estimator: Key<Estimator>,
    /// Columns whose values define a group. By default they are all coordinates except surface,
    /// seed and realization.
    #[schemars(length(min = 1), transform = list)]
    pub group_by: Key<Vec<Spanned<String>>>,
    /// Columns whose statistics are computed; required without `sql`.
    #[schemars(length(min = 1), transform = list)]
    pub over: Key<Vec<Spanned<String>>>,
    /// Statistics of each column in `over`: `"mean"`, `"sd"`, `"sem"`, `"min"`, `"max"`,
    /// `"median"`, quantiles such as `"q05"`, and confidence intervals of the mean such as `"ci95"`
    /// (Student's t). For `"sem"` and intervals, rows with the same seed and realization are one
    /// sample. Statistics with respect to `load` are the `"slope"` of the mean, the `"secant"`, and
    /// the `"approach"` of an area a to full contact, −ln[(1 − a) y √(2π)]. Groups with several
    /// loads can have `"regr_slope"` and `"regr_intercept"`, of the least-squares line over `load`.
    /// Multilevel means have `"mean"`, `"sem"` and intervals, by default with `"ci95"`.
    #[schemars(length(min = 1), extend("default" = ["mean", "sd", "sem"]), transform = list)]
    pub statistics: Key<Vec<Spanned<String>>>,
    /// Theories whose predictions are added to the rows. Each theory adds a column `area_MODEL`
    /// with its area under the load of the row, and columns of its slope, secant or approach to
    /// full contact if `statistics` contain these. Asperity models use Nayak's parameter α of the
    /// modes of the cell, as in the column `nayak_lattice`. By default there are none.
    #[schemars(transform = list)]
    pub models: Key<Vec<Spanned<Model>>>,
}

table!(AggregateTable);

/// The estimator of a mean over surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Estimator {
    /// The mean of the rows of each group.
    Plain,
    /// The mean on the coarsest mesh of each parameter point, plus the mean differences of equal
    /// surfaces on neighbouring meshes. Coarser meshes have more surfaces:
    /// `cases = [{ nodes = 128, realizations = 400 }, { nodes = 256, realizations = 60 }]`.
    Multilevel,
}

impl StagePoints for Section<AggregateTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        Work::evaluate(recipes(self, context))
    }

    fn is_query(&self) -> bool {
        self.points.iter().any(|point| point.table.sql.written().is_some())
    }

    fn multilevel(&self) -> Option<&Span> {
        let written = self.points.first()?.table.estimator.written()?;
        (written.value == Estimator::Multilevel).then_some(&written.span)
    }

    fn validate_answer(
        &self,
        answer: Result<Table, StageError>,
        tables: &[(String, Table)],
        problems: &mut Problems,
    ) -> Option<Table> {
        let written = &self.points.first()?.table;
        let Some(query) = written.sql.written() else {
            return answer.ok();
        };
        let answer =
            answer.map_err(|error| problems.push(no_answer(&error, query, tables))).ok()?;
        for (name, column) in written.columns.written().iter().flat_map(|all| &all.value) {
            if !answer.has(name) {
                let message = format!("the result of the query has no column {name:?}");
                let label = suggestion('"', name, answer.names(), "unknown column");
                let help = format!("its columns are {}", listed(answer.names(), "and"));
                problems.push(Problem::new(message, column.span.clone(), label).help(help));
            }
        }
        Some(answer)
    }
}

/// Returns the task of a stage, or `None` after reporting problems.
fn recipes(section: &Section<AggregateTable>, context: &mut CheckContext) -> Option<Vec<Recipe>> {
    let point = section.points.first()?;
    // Groups may be formed by paths of files, which tables of tasks do not contain.
    let input = context.input.map(|table| with_paths(table.clone(), &SurfaceFiles::default()));
    let mut checks = StageChecks::new(section, point, context);
    checks.input = input.as_ref();
    let params = params(&point.table, &mut checks);
    check_loads(&point.table, &mut checks)?;
    Some(vec![Recipe::Aggregate(Arc::new(params?))])
}

/// Refuses statistics against the load of contacts with adhesion, or whose loads are results.
fn check_loads(table: &AggregateTable, checks: &mut StageChecks) -> Option<()> {
    let adhesive = checks.surfaces.stage_with(Property::WithAdhesion);
    let without_loads = checks.surfaces.stage_with(Property::WithoutGivenLoads);
    let mut clear = Some(());
    let written = table.statistics.written();
    for Spanned { value, span } in written.iter().flat_map(|list| &list.value) {
        if !Statistic::named(value).is_some_and(Statistic::is_against_load) {
            continue;
        }
        let (message, label, help) = match (adhesive, without_loads) {
            (Some(stage), _) => (
                format!(
                    "{value:?} is for contacts whose area vanishes with the load, but stage \
                     `{stage}` has `adhesion`"
                ),
                "not defined with adhesion",
                "group by `branch` and `load` and compare the means, or take differences with `sql`",
            ),
            (None, Some(stage)) => (
                format!(
                    "{value:?} needs common loads, but the loads of stage `{stage}` are results"
                ),
                "not defined for prescribed lengths",
                "press the surfaces under `loads`, or take differences with `sql`",
            ),
            (None, None) => continue,
        };
        clear = checks.reject(Problem::new(message, span.clone(), label).help(help));
    }
    clear
}

fn params(table: &AggregateTable, checks: &mut StageChecks) -> Option<Params> {
    if let Some(sql) = table.sql.written() {
        return query(table, sql, checks);
    }
    exclude! { table, checks, true => columns: "needs the key `sql`"; }?;
    if checks.value("estimator", &table.estimator)? == Estimator::Multilevel {
        return multilevel_means(table, checks);
    }
    let group_by = match checks.optional("group_by", &table.group_by)? {
        None => Some(None),
        Some(written) => named_columns("group_by", written, checks).map(Some),
    };
    let over = over(table, checks);
    let named = group_by.as_ref().and_then(|names| names.as_deref());
    let statistics = statistics(&table.statistics, named, checks);
    let models = models(table, checks);
    let groups =
        Groups { group_by: group_by?, over: over?, statistics: statistics?, models: models? };
    check_outputs(table, &groups, checks)?;
    Some(Params::Groups(groups))
}

/// Returns the columns whose statistics are computed.
fn over(table: &AggregateTable, checks: &mut StageChecks) -> Option<Vec<String>> {
    let written = checks.required("over", &table.over)?;
    let over = named_columns("over", written, checks)?;
    check_numbers(written, checks).map(|()| over)
}

/// Statistics of multilevel means without the key `statistics`.
const OF_MULTILEVEL: [Statistic; 3] =
    [Statistic::Mean, Statistic::Sem, Statistic::Confidence(0.95)];

/// Returns the multilevel means of a stage. The study checks that the surfaces have meshes.
fn multilevel_means(table: &AggregateTable, checks: &mut StageChecks) -> Option<Params> {
    let clear = exclude! { table, checks,
        true => group_by, models: "cannot be combined with `estimator = \"multilevel\"`";
    };
    let over = over(table, checks);
    let written = table.statistics.written();
    let statistics = match written {
        None => Some(OF_MULTILEVEL.to_vec()),
        Some(_) => statistics(&table.statistics, None, checks),
    };
    for Spanned { value, span } in written.iter().flat_map(|list| &list.value) {
        if Statistic::named(value).is_some_and(|statistic| !multilevel::has(statistic)) {
            let message = format!("a multilevel mean has no {value:?}");
            let problem = Problem::new(message, span.clone(), "is not a mean over surfaces");
            return checks
                .reject(problem.help(
                    "multilevel means have \"mean\", \"sem\" and intervals such as \"ci95\"",
                ));
        }
    }
    let (over, statistics) = (over?, statistics?);
    clear.map(|()| {
        Params::Multilevel(Multilevel { over, statistics, version: multilevel::VERSION.number() })
    })
}

/// Returns the query of a stage with `sql`, and refuses keys that `sql` replaces.
fn query(table: &AggregateTable, sql: &Spanned<String>, checks: &mut Checks) -> Option<Params> {
    let clear = exclude! { table, checks,
        true => estimator, group_by, over, statistics, models: "cannot be combined with `sql`";
    };
    let columns = meanings(table, checks);
    if sql.value.trim().is_empty() {
        return checks.refuse("sql", "`sql` is empty", &sql.span, "must be a query");
    }
    let columns = columns?;
    let (query, tables, version) = (sql.value.clone(), Vec::new(), SQL_VERSION.number());
    clear.map(|()| Params::Sql(Sql { query, tables, columns, version }))
}

/// Returns the descriptions of the columns of the result of a query.
fn meanings(table: &AggregateTable, checks: &mut Checks) -> Option<BTreeMap<String, Meaning>> {
    let mut clear = Some(());
    let mut meanings = BTreeMap::new();
    let written = table.columns.written();
    for (name, Spanned { value, span }) in written.iter().flat_map(|columns| &columns.value) {
        if value.meaning.trim().is_empty() {
            let message = format!("the `meaning` of {name:?} is empty");
            clear = checks.refuse("columns", message, span, "must be a phrase");
        }
        meanings.insert(name.clone(), value.clone());
    }
    clear.map(|()| meanings)
}

/// Columns that every `aggregate` stage without `sql` adds to its rows.
const COUNTS: [&str; 3] = ["count", "surfaces", "unconverged"];

/// Returns the columns that a key names. Refuses repeated names, and columns that the input does
/// not have.
fn named_columns(
    key: &str,
    written: &Spanned<Vec<Spanned<String>>>,
    checks: &mut StageChecks,
) -> Option<Vec<String>> {
    let mut seen = BTreeMap::new();
    let mut clear = Some(());
    for Spanned { value, span } in &written.value {
        if let Some(before) = seen.insert(value.as_str(), span) {
            let message = format!("`{key}` names {value:?} twice");
            let problem = Problem::new(message, span.clone(), "here again");
            clear = checks.reject(problem.and(before.clone(), "first here"));
        }
        if let Some(input) = checks.input.filter(|input| !input.has(value)) {
            let problem = checks.unknown_column(value, span, &input.names());
            clear = checks.reject(problem);
        }
    }
    clear.map(|()| written.value.iter().map(|column| column.value.clone()).collect())
}

/// Refuses columns of texts, which have no statistics.
fn check_numbers(written: &Spanned<Vec<Spanned<String>>>, checks: &mut StageChecks) -> Option<()> {
    let mut clear = Some(());
    for Spanned { value, span } in &written.value {
        if checks.input.is_some_and(|input| input.texts(value).is_ok()) {
            let message = format!("the column {value:?} holds texts");
            let label = "must be a column of numbers";
            clear = checks.reject(Problem::new(message, span.clone(), label));
        }
    }
    clear
}

/// Refuses statistics whose columns would have the name of a column of `group_by`.
fn check_outputs(table: &AggregateTable, groups: &Groups, checks: &mut Checks) -> Option<()> {
    let written = |key: &Key<Vec<Spanned<String>>>, index: usize| {
        key.written().map(|list| list.value[index].span.clone())
    };
    let is_statistic = |name: &str| {
        groups.statistics.iter().any(|one| one.suffixes().iter().any(|suffix| suffix == name))
    };
    let mut clear = Some(());
    for (index, column) in groups.group_by.iter().flatten().enumerate() {
        let span = written(&table.group_by, index)?;
        if COUNTS.contains(&column.as_str()) {
            let message = format!("{column:?} is a column that the stage adds to its groups");
            clear = checks.reject(Problem::new(message, span, "cannot define groups"));
            continue;
        }
        for (reduced, over) in groups.over.iter().enumerate() {
            let suffix = column.strip_prefix(over.as_str()).and_then(|rest| rest.strip_prefix('_'));
            let (message, label) = if column == over {
                let message = format!("{column:?} is in `group_by` and in `over`");
                (message, "`group_by` keeps this column constant in each group")
            } else if suffix.is_some_and(is_statistic) {
                (format!("two columns would be called {column:?}"), "a column of the groups")
            } else {
                continue;
            };
            let label_of_over = "`over` reduces this column to statistics";
            let problem = Problem::new(message, span.clone(), label);
            clear = checks.reject(problem.and(written(&table.over, reduced)?, label_of_over));
        }
    }
    clear
}

/// Returns the statistics that the manifest names, and refuses repeated or unknown names.
fn statistics(
    key: &Key<Vec<Spanned<String>>>,
    group_by: Option<&[String]>,
    checks: &mut StageChecks,
) -> Option<Vec<Statistic>> {
    let Some(written) = checks.optional("statistics", key)? else {
        let default: Vec<String> = checks.default_of("statistics");
        return Some(default.iter().filter_map(|name| Statistic::named(name)).collect());
    };
    let mut statistics: Vec<Statistic> = Vec::new();
    let mut clear = Some(());
    for Spanned { value, span } in &written.value {
        let Some(statistic) = Statistic::named(value) else {
            clear = checks.reject(unknown_statistic(value, span.clone()));
            continue;
        };
        if let Some((message, label)) = misses_load(value, statistic, group_by, checks.input) {
            clear = checks.reject(Problem::new(message, span.clone(), label));
        }
        if statistics.contains(&statistic) {
            let message = format!("`statistics` asks for {value:?} twice");
            clear = checks.reject(Problem::new(message, span.clone(), "here again"));
        }
        statistics.push(statistic);
    }
    clear.map(|()| statistics)
}

/// Returns the message and the label of the problem if a statistic with respect to the load cannot
/// be computed, and `None` otherwise.
///
/// Slopes are computed from group to group, so that groups must differ by their load. Regression
/// lines are computed within a group, which must have several loads.
fn misses_load(
    word: &str,
    statistic: Statistic,
    group_by: Option<&[String]>,
    input: Option<&Table>,
) -> Option<(String, &'static str)> {
    let is_load = |name: &String| ["load", "pressure"].contains(&name.as_str());
    let has_load = group_by.is_none_or(|names| names.iter().any(is_load));
    let names_groups = statistic.is_against_load();
    let is_line = matches!(statistic, Statistic::RegressionSlope | Statistic::RegressionIntercept);
    if names_groups && !has_load {
        let message = format!("{word:?} needs `load` in `group_by`");
        return Some((message, "needs groups that differ by their load"));
    }
    if (names_groups || is_line) && input.is_some_and(|input| !input.has("load")) {
        let message = format!("{word:?} needs a column `load`, which the input does not have");
        return Some((message, "needs rows with a `load`"));
    }
    (is_line && has_load).then(|| {
        let message =
            format!("{word:?} needs groups with several loads, and `load` is in `group_by`");
        (message, "needs a `group_by` without `load`")
    })
}

fn unknown_statistic(name: &str, span: Span) -> Problem {
    let words = Statistic::words;
    let label = match name {
        "ci" | "CI" | "confidence" => "did you mean \"ci95\"?".to_owned(),
        _ => suggestion('"', name, words(), "unknown statistic"),
    };
    let help = format!(
        "one of {}, a quantile such as `q05` (5 %) or `q975` (97.5 %), or a confidence interval of \
         the mean such as `ci95` (95 %)",
        listed(words(), "and")
    );
    Problem::new(format!("there is no statistic {name:?}"), span, label).help(help)
}

/// Returns the theories that the manifest names. Each theory needs rows with a load, and asperity
/// models need moments of the spectrum.
fn models(table: &AggregateTable, checks: &mut StageChecks) -> Option<Vec<Model>> {
    let Some(written) = checks.optional("models", &table.models)? else {
        return Some(Vec::new());
    };
    let input = checks.input;
    let is_read = |name: &str| input.is_none_or(|input| input.has(name));
    let is_altered = input.is_some_and(|input| ALTERATIONS.iter().any(|name| input.has(name)));
    let is_grouped = |name: &str| {
        let names = |column: &Spanned<String>| {
            column.value == name || (name == "load" && column.value == "pressure")
        };
        table.group_by.written().is_none_or(|list| list.value.iter().any(names))
    };
    let mut models = Vec::new();
    let mut clear = Some(());
    for Spanned { value: model, span } in &written.value {
        let of_spectrum = model.asperities().map_or(&[][..], |_| &SPECTRUM_COLUMNS);
        let needed = || of_spectrum.iter().copied().chain(["load"]);
        let unread: Vec<&str> = needed().filter(|name| !is_read(name)).collect();
        let ungrouped: Vec<&str> = needed().filter(|name| !is_grouped(name)).collect();
        let (message, label) = if models.contains(model) {
            ("`models` has the same model twice".to_owned(), "here again")
        } else if !unread.is_empty() {
            let missing = listed(unread, "and");
            let message = format!("the model needs {missing}, which the input does not have");
            (message, "needs loads on surfaces drawn from a spectrum")
        } else if !ungrouped.is_empty() {
            let missing = listed(ungrouped, "and");
            let message = format!("the model needs {missing} in `group_by`");
            (message, "needs groups with one value of each of these columns")
        } else if is_altered && model.asperities().is_some() {
            let message = "the model needs the spectrum of one surface, but the input has pairs of \
                           surfaces or surfaces that have yielded";
            let label = "applies to surfaces that are pressed against a smooth body for the first \
                         time";
            (message.to_owned(), label)
        } else {
            models.push(*model);
            continue;
        };
        clear = checks.reject(Problem::new(message, span.clone(), label));
    }
    clear.map(|()| models)
}

/// Creates the problem of a query that cannot be run.
fn no_answer(error: &StageError, query: &Spanned<String>, tables: &[(String, Table)]) -> Problem {
    let span = query.span.clone();
    if let StageError::Query(QueryError::Unknown { message, name, known }) = error {
        let known = || known.iter().map(String::as_str);
        let label = suggestion('`', name, known(), "this query");
        let help = format!("the known names are {}", listed(known(), "and"));
        return Problem::new(format!("the query cannot be run: {message}"), span, label).help(help);
    }
    let reason = match error {
        StageError::Query(error) => error.to_string(),
        other => chain(other),
    };
    let names = listed(tables.iter().map(|(name, _)| name.as_str()), "and");
    let help = format!(
        "the query can use the tables {names} in the SQL of polars; a name with `-` needs double \
         quotes"
    );
    Problem::new(format!("the query cannot be run: {reason}"), span, "this query").help(help)
}
