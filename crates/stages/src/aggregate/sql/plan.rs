//! Execution of a query in steps, each of which polars computes rightly.
//!
//! Polars leaves a literal at length one inside an aggregate, names an aggregate like its column,
//! and resolves names of grouped and joined tables in unusual ways. A `select` is therefore split:
//! the arguments of its aggregates become columns, then groups are reduced, then groups are
//! filtered (`having`), then window functions are added, and the last step computes the columns of
//! the answer and sorts them. Each step is a query on one table of named columns.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::Arc;

use bytesize::ByteSize;
use polars::prelude::{DataType, IntoLazy, LazyFrame, PolarsError, UnionArgs, col, concat, lit};
use polars::sql::SQLContext;
use sqlparser::ast::{
    BinaryOperator, Distinct, DuplicateTreatment, ExcludeSelectItem, Expr, Fetch, Function,
    FunctionArg, FunctionArgExpr, FunctionArgumentClause, FunctionArguments, GroupByExpr, Ident,
    JoinConstraint, JoinOperator, LimitClause, NamedWindowDefinition, NamedWindowExpr, ObjectName,
    OrderBy, OrderByExpr, OrderByKind, Query, Select, SelectItem, SetExpr, SetOperator,
    SetQuantifier, TableAlias, TableFactor, TableWithJoins, Value, Visit, VisitMut, VisitorMut,
    WindowFrameBound, WindowFrameUnits, WindowSpec, WindowType, visit_expressions,
};

use super::QueryError;
use super::engine;
use super::functions::Functions;
use super::statement::{parsed, with_point};
use super::window::{Bound, Direction, Window, WindowFunction};

/// Number of steps of a plan above which the plan is computed, because a table that a query uses
/// twice is planned twice, and plans of tables that build on each other double each time.
const MAX_STEPS: usize = 64;

/// Functions that compute one value from all rows of a group.
pub const AGGREGATES: &[&str] = &[
    "avg",
    "corr",
    "count",
    "covar",
    "covar_pop",
    "covar_samp",
    "first",
    "group_concat",
    "last",
    "listagg",
    "max",
    "median",
    "min",
    "quantile_cont",
    "quantile_disc",
    "stddev",
    "stddev_samp",
    "stdev",
    "stdev_samp",
    "string_agg",
    "sum",
    "total",
    "var",
    "var_samp",
    "variance",
];

/// Steps of a query, each a table that the next steps read.
pub struct Planner<'a> {
    tables: BTreeMap<String, Planned>,
    /// Number of tables that the planner has named.
    names: usize,
    memory: ByteSize,
    /// Converts an error of polars.
    error: &'a dyn Fn(&PolarsError) -> QueryError,
}

/// Table of a query with the number of steps that compute it.
#[derive(Clone)]
struct Planned {
    frame: LazyFrame,
    steps: usize,
}

type Result<T> = std::result::Result<T, QueryError>;

fn refused<T>(reason: impl Into<String>) -> Result<T> {
    Err(QueryError::Refused(reason.into()))
}

impl<'a> Planner<'a> {
    pub fn new(
        tables: Vec<(String, LazyFrame)>,
        memory: ByteSize,
        error: &'a dyn Fn(&PolarsError) -> QueryError,
    ) -> Planner<'a> {
        let planned = |(name, frame)| (name, Planned { frame, steps: 1 });
        Planner { tables: tables.into_iter().map(planned).collect(), names: 0, memory, error }
    }

    /// Returns the frame that answers a query.
    ///
    /// # Errors
    /// Returns an error if polars refuses a part of the query, or if the query is not supported.
    pub fn answer(&mut self, query: Query) -> Result<LazyFrame> {
        Ok(self.query(query)?.frame)
    }

    fn query(&mut self, query: Query) -> Result<Planned> {
        let outside = self.tables.clone();
        if let Some(with) = query.with {
            if with.recursive {
                return refused("`with recursive` is not supported");
            }
            for table in with.cte_tables {
                let planned = self.query(*table.query)?;
                let planned = self.with_names(planned, &table.alias)?;
                self.tables.insert(table.alias.name.value, planned);
            }
        }
        let has_other_clauses = query.for_clause.is_some()
            || query.settings.is_some()
            || query.format_clause.is_some()
            || !query.locks.is_empty()
            || !query.pipe_operators.is_empty();
        if has_other_clauses {
            return refused("only `order by`, `limit` and `offset` can follow a `select`");
        }
        let ends = Ends { order_by: query.order_by, limit: query.limit_clause, fetch: query.fetch };
        let planned = self.body(*query.body, ends);
        self.tables = outside;
        planned
    }

    fn body(&mut self, body: SetExpr, ends: Ends) -> Result<Planned> {
        match body {
            SetExpr::Select(select) => self.select(*select, ends),
            SetExpr::Query(query) => {
                let planned = self.query(*query)?;
                self.end(planned, ends)
            }
            SetExpr::SetOperation { op, set_quantifier, left, right } => {
                let left = self.body(*left, Ends::default())?;
                let right = self.body(*right, Ends::default())?;
                let planned = self.combine(op, set_quantifier, left, right)?;
                self.end(planned, ends)
            }
            SetExpr::Values(_) => {
                let planned = self.step(&body.to_string(), &[])?;
                self.end(planned, ends)
            }
            other => refused(format!("`{other}` is not supported")),
        }
    }

    /// Sorts and limits a table.
    fn end(&mut self, planned: Planned, ends: Ends) -> Result<Planned> {
        let tail = ends.text();
        if tail.is_empty() {
            return Ok(planned);
        }
        let name = self.name();
        self.step(&format!("select * from \"{name}\"{tail}"), &[(name, planned)])
    }

    fn combine(
        &mut self,
        operator: SetOperator,
        quantifier: SetQuantifier,
        mut left: Planned,
        mut right: Planned,
    ) -> Result<Planned> {
        let names = self.columns(&mut left)?;
        let others = self.columns(&mut right)?;
        if names.len() != others.len() {
            return refused(format!(
                "`{operator}` needs equal numbers of columns, but the left side has {} and the \
                 right side {}",
                names.len(),
                others.len()
            ));
        }
        let all = match quantifier {
            SetQuantifier::All => true,
            SetQuantifier::None | SetQuantifier::Distinct => false,
            other => return refused(format!("`{operator} {other}` is not supported")),
        };
        let renamed = right.frame.rename(&others, &names, true);
        let sides = [left.frame, renamed].into_iter().enumerate();
        let is_union = matches!(operator, SetOperator::Union);
        let sides = sides.map(|(side, frame)| {
            if is_union { frame } else { frame.with_column(lit(side as i64).alias(SIDE)) }
        });
        let arguments =
            UnionArgs { to_supertypes: true, maintain_order: true, ..UnionArgs::default() };
        let both =
            concat(sides.collect::<Vec<_>>(), arguments).map_err(|error| self.convert(&error))?;
        let both = Planned { frame: both, steps: left.steps + right.steps + 1 };
        let name = self.name();
        match (operator, all) {
            (SetOperator::Union, true) => Ok(both),
            (SetOperator::Union, false) => {
                self.step(&format!("select distinct * from \"{name}\""), &[(name, both)])
            }
            (SetOperator::Intersect | SetOperator::Except, false) => {
                let columns: Vec<_> = names.iter().map(|name| col(name.as_str())).collect();
                let sides = [col(SIDE).min().alias("__first"), col(SIDE).max().alias("__last")];
                let grouped = Planned { frame: both.frame.group_by(columns).agg(sides), ..both };
                let last = i64::from(matches!(operator, SetOperator::Intersect));
                let text = format!(
                    "select {} from \"{name}\" where __first = 0 and __last = {last}",
                    quoted(&names)
                );
                self.step(&text, &[(name, grouped)])
            }
            _ => refused(format!("`{operator} all` is not supported")),
        }
    }

    /// Executes a query on one or more tables, without the further steps of this module.
    fn step(&mut self, text: &str, tables: &[(String, Planned)]) -> Result<Planned> {
        let mut context = SQLContext::new().with_function_registry(Arc::new(Functions));
        for (name, table) in tables {
            context.register(name, table.frame.clone());
        }
        let frame = context.execute(text).map_err(|error| self.convert(&error))?;
        let steps = 1 + tables.iter().map(|(_, table)| table.steps).sum::<usize>();
        let planned = Planned { frame, steps };
        if steps <= MAX_STEPS {
            return Ok(planned);
        }
        Ok(Planned { frame: self.collect(planned)?.lazy(), steps: 1 })
    }

    fn collect(&self, planned: Planned) -> Result<polars::prelude::DataFrame> {
        engine::collect(planned.frame, self.memory).map_err(|error| self.convert(&error))
    }

    fn convert(&self, error: &PolarsError) -> QueryError {
        (self.error)(error)
    }

    /// Returns a new name for a table.
    fn name(&mut self) -> String {
        self.names += 1;
        format!("__{}", self.names)
    }

    fn columns(&self, planned: &mut Planned) -> Result<Vec<String>> {
        let schema = planned.frame.collect_schema().map_err(|error| self.convert(&error))?;
        Ok(schema.iter_names().map(|name| name.to_string()).collect())
    }

    /// Renames the columns as an alias such as `m(load, area)` says.
    fn with_names(&self, mut planned: Planned, alias: &TableAlias) -> Result<Planned> {
        if alias.columns.is_empty() {
            return Ok(planned);
        }
        let names = self.columns(&mut planned)?;
        let new: Vec<&str> =
            alias.columns.iter().map(|column| column.name.value.as_str()).collect();
        if names.len() != new.len() {
            return refused(format!(
                "`{alias}` names {} columns, but the query has {}",
                new.len(),
                names.len()
            ));
        }
        Ok(Planned { frame: planned.frame.rename(&names, &new, true), ..planned })
    }

    /// Plans the tables of `from`, and replaces each by the name under which the next step finds
    /// it.
    fn from(&mut self, from: &mut [TableWithJoins]) -> Result<Vec<(String, Planned)>> {
        let mut tables = Vec::new();
        for part in from {
            self.relation(&mut part.relation, &mut tables)?;
            for join in &mut part.joins {
                self.relation(&mut join.relation, &mut tables)?;
                check_join(&join.join_operator)?;
            }
        }
        Ok(tables)
    }

    fn relation(
        &mut self,
        relation: &mut TableFactor,
        tables: &mut Vec<(String, Planned)>,
    ) -> Result<()> {
        let (planned, alias, name) = match relation {
            TableFactor::Table { name, alias, args: None, .. } => {
                let Some(known) = name.0.last().and_then(|part| part.as_ident()) else {
                    return refused(format!("`{name}` is not a table"));
                };
                let known = known.value.clone();
                let Some(planned) = self.tables.get(&known).cloned() else {
                    return Err(QueryError::no_table(
                        &known,
                        self.tables.keys().map(String::as_str),
                    ));
                };
                (planned, alias.take(), known)
            }
            TableFactor::Derived { lateral: false, subquery, alias, sample: None } => {
                let planned = self.query((**subquery).clone())?;
                (planned, alias.take(), self.name())
            }
            TableFactor::NestedJoin { table_with_joins, alias: None } => {
                tables.extend(self.from(std::slice::from_mut(table_with_joins))?);
                return Ok(());
            }
            other => return refused(format!("`{other}` is not supported in `from`")),
        };
        let planned = match &alias {
            Some(alias) => self.with_names(planned, alias)?,
            None => planned,
        };
        let name = alias.map_or(name, |alias| alias.name.value);
        if tables.iter().any(|(known, _)| *known == name) {
            return refused(format!(
                "`from` has two tables `{name}`; give one of them another name: `{name} as other`"
            ));
        }
        *relation = table(&name);
        tables.push((name, planned));
        Ok(())
    }

    /// Computes the subqueries in expressions.
    fn subqueries<T: VisitMut>(
        &mut self,
        node: &mut T,
        tables: &mut Vec<(String, Planned)>,
    ) -> Result<()> {
        let mut subqueries = Subqueries { planner: self, tables };
        each_expression(node, |expression| subqueries.replace(expression))
    }

    fn subquery(&mut self, query: Query) -> Result<Value> {
        let text = query.to_string();
        let planned = self.query(query)?;
        let answer = self.collect(planned)?;
        if answer.width() != 1 || answer.height() > 1 {
            return refused(format!(
                "`({text})` has {} rows of {} columns, but a single value is needed",
                answer.height(),
                answer.width()
            ));
        }
        let column = &answer.columns()[0];
        let value = match column.get(0) {
            Err(_) => return Ok(Value::Null),
            Ok(value) if value.is_null() => return Ok(Value::Null),
            Ok(value) => value,
        };
        Ok(match column.dtype() {
            DataType::String => Value::SingleQuotedString(value.str_value().into_owned()),
            DataType::Boolean => Value::Boolean(value.str_value() == "true"),
            kind if kind.is_float() => match value.extract::<f64>() {
                Some(number) => Value::Number(with_point(&format!("{number:e}")), false),
                None => Value::Null,
            },
            _ => Value::Number(value.str_value().into_owned(), false),
        })
    }
}

/// Column that says from which side of a set operation a row comes.
const SIDE: &str = "__side";

/// Replacement of subqueries by their values, or in `in (…)` by a table.
struct Subqueries<'a, 'b> {
    planner: &'a mut Planner<'b>,
    tables: &'a mut Vec<(String, Planned)>,
}

impl Subqueries<'_, '_> {
    fn replace(&mut self, expression: &mut Expr) -> Result<()> {
        match expression {
            Expr::Subquery(query) => {
                let value = self.planner.subquery((**query).clone())?;
                *expression = Expr::Nested(Box::new(Expr::value(value)));
            }
            Expr::Exists { subquery, negated } => {
                let planned = self.planner.query((**subquery).clone())?;
                let name = self.planner.name();
                let text = format!("select 1 as one from \"{name}\" limit 1");
                let first = self.planner.step(&text, &[(name, planned)])?;
                let exists = self.planner.collect(first)?.height() > 0;
                *expression = Expr::value(Value::Boolean(exists != *negated));
            }
            Expr::InSubquery { subquery, .. } => {
                let mut planned = self.planner.query((**subquery).clone())?;
                let names = self.planner.columns(&mut planned)?;
                let [column] = names.as_slice() else {
                    let columns = names.len();
                    return refused(format!(
                        "`in ({subquery})` has {columns} columns instead of one"
                    ));
                };
                let name = self.planner.name();
                // Names of the planner are not replaced by later steps.
                let frame = planned.frame.rename([column], ["__in"], true);
                **subquery = parsed(&format!("select __in from \"{name}\""))?;
                self.tables.push((name, Planned { frame, ..planned }));
            }
            _ => {}
        }
        Ok(())
    }
}

/// Clauses after a `select`.
#[derive(Default)]
struct Ends {
    order_by: Option<OrderBy>,
    limit: Option<LimitClause>,
    fetch: Option<Fetch>,
}

impl Ends {
    fn text(&self) -> String {
        let order_by = self.order_by.as_ref().map(ToString::to_string);
        let limit = self.limit.as_ref().map(ToString::to_string);
        let fetch = self.fetch.as_ref().map(ToString::to_string);
        [order_by, limit, fetch].into_iter().flatten().map(|clause| format!(" {clause}")).collect()
    }

    /// Returns the expressions of `order by`.
    fn order(&mut self) -> &mut [OrderByExpr] {
        match self.order_by.as_mut().map(|order_by| &mut order_by.kind) {
            Some(OrderByKind::Expressions(expressions)) => expressions,
            _ => &mut [],
        }
    }
}

/// Column of an answer in the making: its expression on the last step, and its name.
type Item = (Expr, String);

impl Planner<'_> {
    fn select(&mut self, mut select: Select, mut ends: Ends) -> Result<Planned> {
        let mut tables = self.from(&mut select.from)?;
        move_conditions(&mut select)?;
        // Polars drops also the other columns of the answer whose names `* exclude (…)` has.
        let is_partial = |item: &SelectItem| is_wildcard(item) && !item.to_string().ends_with('*');
        let needs_names = select.projection.len() > 1 && select.projection.iter().any(is_partial);
        hide_joined_keys(&mut select);
        self.subqueries(&mut select, &mut tables)?;
        self.subqueries(&mut ends.order_by, &mut tables)?;
        resolve_windows(&mut select, &mut ends)?;
        let mut calls = Calls::of(&select.projection);
        calls.add(&select.having);
        calls.add(&select.qualify);
        calls.add(&ends.order_by);
        let is_grouped = match &select.group_by {
            GroupByExpr::All(_) => true,
            GroupByExpr::Expressions(keys, _) => !keys.is_empty() || select.having.is_some(),
        };
        let mut columns = BTreeSet::new();
        for (_, table) in &mut tables {
            columns.extend(self.columns(table)?);
        }
        if is_grouped || calls.aggregate.is_some() {
            self.grouped(select, ends, tables, &columns, &calls)
        } else if calls.has_window || needs_names || is_ambiguous(&select, &mut ends, &columns) {
            self.windowed(select, ends, tables, &columns)
        } else {
            self.step(&format!("{select}{}", ends.text()), &tables)
        }
    }

    /// Plans a `select` that reduces groups of rows.
    fn grouped(
        &mut self,
        mut select: Select,
        mut ends: Ends,
        mut tables: Vec<(String, Planned)>,
        columns: &BTreeSet<String>,
        calls: &Calls,
    ) -> Result<Planned> {
        let mut items = Vec::new();
        for item in std::mem::take(&mut select.projection) {
            let Some(item) = named(item) else {
                let with = calls.aggregate.as_deref().unwrap_or("group by");
                return refused(format!(
                    "`*` cannot be combined with `{with}`: list the columns and add a `group by`"
                ));
            };
            items.push(item);
        }
        let keys = keys(&select.group_by, &items, columns)?;
        let mut groups = Groups {
            keys: Vec::new(),
            inputs: Columns::with_prefix("a"),
            aggregates: Columns::with_prefix("g"),
            aliases: BTreeMap::new(),
        };
        for key in keys {
            let name = groups.inputs.name(&key);
            groups.keys.push((key, name));
        }
        for (expression, _) in &mut items {
            groups.lower(expression)?;
        }
        groups.aliases = items.iter().map(|(value, name)| (name.clone(), value.clone())).collect();
        let (mut having, mut qualify) = (select.having.take(), select.qualify.take());
        for condition in having.iter_mut().chain(&mut qualify) {
            groups.lower(condition)?;
        }
        for part in ends.order() {
            if !is_output(&part.expr, &items) {
                groups.lower(&mut part.expr)?;
            }
        }
        let Groups { keys, mut inputs, aggregates, .. } = groups;
        // Rows without a column would be lost.
        inputs.name(&1);
        let distinct = select.distinct.take();
        let source = self.inputs(select, &inputs, &tables)?;
        let name = self.name();
        let keys: Vec<&str> = keys.iter().map(|(_, name)| name.as_str()).collect();
        let reduced: Vec<String> =
            keys.iter().map(|key| (*key).to_owned()).chain(aggregates.items()).collect();
        let group_by =
            if keys.is_empty() { String::new() } else { format!(" group by {}", keys.join(", ")) };
        let reduced =
            if reduced.is_empty() { "count(*) as __rows".to_owned() } else { reduced.join(", ") };
        let text = format!("select {reduced} from \"{name}\"{group_by}");
        let mut reduced = self.step(&text, &[(name, source)])?;
        if let Some(having) = having {
            let name = self.name();
            let text = format!("select * from \"{name}\" where {having}");
            // The tables of `in (select …)` have names of the planner.
            tables.retain(|(known, _)| known.starts_with("__"));
            tables.push((name, reduced));
            reduced = self.step(&text, &tables)?;
        }
        let mut windows = Windows::new(None);
        windows.lower_all(&mut items, &mut qualify, &mut ends)?;
        if !windows.windows.is_empty() {
            let name = self.name();
            let items: String = windows.inputs.items().map(|item| format!(", {item}")).collect();
            let inputs =
                self.step(&format!("select *{items} from \"{name}\""), &[(name, reduced)])?;
            reduced = windows.add(inputs);
        }
        self.last(reduced, &items, distinct, qualify, &ends)
    }

    /// Plans a `select` with window functions, or whose names polars resolves otherwise.
    fn windowed(
        &mut self,
        mut select: Select,
        mut ends: Ends,
        mut tables: Vec<(String, Planned)>,
        columns: &BTreeSet<String>,
    ) -> Result<Planned> {
        let mut items: Vec<Item> = Vec::new();
        for item in std::mem::take(&mut select.projection) {
            if let Some(item) = named(item.clone()) {
                items.push(item);
                continue;
            }
            // `u.*` has columns of `u`; `*` has those of the first table that has the name.
            let qualifier = match &item {
                SelectItem::QualifiedWildcard(table, _) => Some(table.to_string().replace('"', "")),
                _ => None,
            };
            if let SelectItem::Wildcard(options) | SelectItem::QualifiedWildcard(_, options) = &item
                && (options.opt_replace.is_some() || options.opt_rename.is_some())
            {
                return refused(format!(
                    "`{item}` cannot be combined with other columns; list all"
                ));
            }
            let all = Select { projection: vec![item], ..bare(&select) };
            let mut all = self.step(&all.to_string(), &tables)?;
            for name in self.columns(&mut all)? {
                let owner = tables.iter_mut().find_map(|(table, planned)| {
                    let is_meant = qualifier.as_ref().is_none_or(|qualifier| qualifier == table);
                    let has = self.columns(planned).is_ok_and(|names| names.contains(&name));
                    (is_meant && has).then(|| table.clone())
                });
                let parts = owner.iter().chain([&name]).map(|part| Ident::with_quote('"', part));
                items.push((Expr::CompoundIdentifier(parts.collect()), name.clone()));
            }
        }
        let mut windows = Windows::new(Some(columns));
        windows.aliases = items.iter().map(|(value, name)| (name.clone(), value.clone())).collect();
        let mut qualify = select.qualify.take();
        windows.lower_all(&mut items, &mut qualify, &mut ends)?;
        let distinct = select.distinct.take();
        let source = self.inputs(select, &windows.inputs, &tables)?;
        self.last(windows.add(source), &items, distinct, qualify, &ends)
    }

    /// Executes the step that computes the inputs of the next one.
    fn inputs(
        &mut self,
        select: Select,
        inputs: &Columns,
        tables: &[(String, Planned)],
    ) -> Result<Planned> {
        let projection = vec![SelectItem::UnnamedExpr(Expr::Identifier(Ident::new("__inputs")))];
        let text = Select { projection, ..bare(&select) }.to_string();
        let items: Vec<String> = inputs.items().collect();
        self.step(&text.replacen("__inputs", &items.join(", "), 1), tables)
    }

    /// Executes the step that computes the columns of the answer.
    fn last(
        &mut self,
        planned: Planned,
        items: &[Item],
        distinct: Option<Distinct>,
        condition: Option<Expr>,
        ends: &Ends,
    ) -> Result<Planned> {
        let name = self.name();
        let distinct = distinct.map_or(String::new(), |distinct| format!("{distinct} "));
        let items = items.iter().map(|(value, name)| format!("{value} as {}", quoted(&[name])));
        let items = items.collect::<Vec<_>>().join(", ");
        let condition = condition.map_or(String::new(), |condition| format!(" where {condition}"));
        let text = format!("select {distinct}{items} from \"{name}\"{condition}{}", ends.text());
        self.step(&text, &[(name, planned)])
    }
}

/// Expressions that a step computes as columns, with the names of these columns.
struct Columns {
    prefix: &'static str,
    names: Vec<(String, String)>,
}

impl Columns {
    fn with_prefix(prefix: &'static str) -> Columns {
        Columns { prefix, names: Vec::new() }
    }

    /// Returns the name of the column with an expression, which is added if it is new.
    fn name(&mut self, expression: &impl ToString) -> String {
        let text = expression.to_string();
        if let Some((_, name)) = self.names.iter().find(|(known, _)| *known == text) {
            return name.clone();
        }
        let name = format!("__{}{}", self.prefix, self.names.len());
        self.names.push((text, name.clone()));
        name
    }

    fn column(&mut self, expression: &impl ToString) -> Expr {
        Expr::Identifier(Ident::new(self.name(expression)))
    }

    fn items(&self) -> impl Iterator<Item = String> {
        self.names.iter().map(|(value, name)| format!("{value} as {name}"))
    }
}

/// Replacement of aggregates and columns of `group by` by columns of the reduced table.
struct Groups {
    keys: Vec<(Expr, String)>,
    /// Columns of `group by` and arguments of aggregates.
    inputs: Columns,
    aggregates: Columns,
    /// Expressions of the answer by their names, for conditions and `order by`.
    aliases: BTreeMap<String, Expr>,
}

impl Groups {
    fn lower(&mut self, expression: &mut Expr) -> Result<()> {
        each_expression(expression, |part| self.replace(part))
    }

    fn replace(&mut self, expression: &mut Expr) -> Result<()> {
        if let Some((_, name)) = self.keys.iter().find(|(key, _)| is_same(key, expression)) {
            *expression = Expr::Identifier(Ident::new(name));
            return Ok(());
        }
        match expression {
            Expr::Function(function) if is_aggregate(function) => {
                let aggregate = self.aggregate(function)?;
                *expression = self.aggregates.column(&aggregate);
            }
            Expr::Identifier(name) if !is_planned(name) => match self.aliases.get(&name.value) {
                Some(value) => *expression = Expr::Nested(Box::new(value.clone())),
                None => return self.ungrouped(expression),
            },
            Expr::CompoundIdentifier(_) => return self.ungrouped(expression),
            _ => {}
        }
        Ok(())
    }

    fn ungrouped(&self, column: &Expr) -> Result<()> {
        refused(if self.keys.is_empty() {
            format!(
                "`{column}` cannot be combined with an aggregate, because it is neither aggregated \
                 nor in `group by`: write `group by {column}` for one row per value, or \
                 `first({column})`"
            )
        } else {
            format!(
                "`{column}` is neither aggregated nor in `group by`: add it to `group by`, or \
                 write `first({column})`"
            )
        })
    }

    /// Returns an aggregate whose arguments are columns.
    fn aggregate(&mut self, function: &Function) -> Result<Function> {
        let mut aggregate = function.clone();
        let name = name_of(function);
        let filter = aggregate.filter.take();
        if filter.is_some() && ["first", "last"].contains(&name.as_str()) {
            return refused(format!("`{name}` with `filter` is not supported; use `min` or `max`"));
        }
        let FunctionArguments::List(list) = &mut aggregate.args else {
            return refused(format!("`{function}` needs arguments in parentheses"));
        };
        if list.duplicate_treatment == Some(DuplicateTreatment::Distinct) && name != "count" {
            return refused(format!(
                "`{function}` is not supported; take the values from `(select distinct …)`"
            ));
        }
        for (index, argument) in list.args.iter_mut().enumerate() {
            let value = match argument {
                FunctionArg::Unnamed(FunctionArgExpr::Wildcard) => "1".to_owned(),
                FunctionArg::Unnamed(FunctionArgExpr::Expr(value)) => {
                    if !Calls::of(value).is_empty() {
                        return refused(format!(
                            "`{function}` nests aggregates; compute the inner one in a subquery: \
                             `from (select … as name …)`"
                        ));
                    }
                    if index > 0 && is_literal(value) {
                        continue;
                    }
                    value.to_string()
                }
                _ => return refused(format!("`{argument}` is no argument of `{name}`")),
            };
            let value = match &filter {
                Some(condition) => format!("case when {condition} then {value} end"),
                None => value,
            };
            *argument = FunctionArg::Unnamed(FunctionArgExpr::Expr(self.inputs.column(&value)));
        }
        for clause in &mut list.clauses {
            if let FunctionArgumentClause::OrderBy(parts) = clause {
                for part in parts {
                    part.expr = self.inputs.column(&part.expr);
                }
            }
        }
        Ok(aggregate)
    }
}

/// Replacement of window functions by columns.
struct Windows<'a> {
    /// Arguments and keys of the window functions.
    inputs: Columns,
    windows: Vec<Window>,
    /// Columns of `from` if the step that computes the inputs reads them. All other columns of the
    /// answer then become inputs, too.
    carried: Option<&'a BTreeSet<String>>,
    /// Expressions of the answer by their names, for conditions and `order by`.
    aliases: BTreeMap<String, Expr>,
}

impl<'a> Windows<'a> {
    fn new(carried: Option<&'a BTreeSet<String>>) -> Windows<'a> {
        Windows {
            inputs: Columns::with_prefix("i"),
            windows: Vec::new(),
            carried,
            aliases: BTreeMap::new(),
        }
    }

    /// Lowers the columns of an answer, its condition, and its order.
    fn lower_all(
        &mut self,
        items: &mut [Item],
        condition: &mut Option<Expr>,
        ends: &mut Ends,
    ) -> Result<()> {
        let mut expressions: Vec<&mut Expr> = condition.iter_mut().collect();
        for part in ends.order() {
            if !is_output(&part.expr, items) {
                expressions.push(&mut part.expr);
            }
        }
        expressions.extend(items.iter_mut().map(|(value, _)| value));
        for expression in expressions {
            each_expression(expression, |part| self.replace(part))?;
        }
        // A table without columns has no rows.
        if self.inputs.names.is_empty() {
            self.inputs.name(&1);
        }
        Ok(())
    }

    fn replace(&mut self, expression: &mut Expr) -> Result<()> {
        match expression {
            Expr::Function(function) if function.over.is_some() => {
                let window = self.window(function)?;
                let known = self.windows.iter().position(|known| *known == window);
                let index = known.unwrap_or(self.windows.len());
                if known.is_none() {
                    self.windows.push(window);
                }
                *expression = Expr::Identifier(Ident::new(format!("__w{index}")));
            }
            Expr::Identifier(name) if !is_planned(name) => {
                let is_column = self.carried.is_some_and(|columns| columns.contains(&name.value));
                match self.aliases.get(&name.value).filter(|_| !is_column) {
                    Some(value) => *expression = Expr::Nested(Box::new(value.clone())),
                    None => *expression = self.inputs.column(&*expression),
                }
            }
            Expr::CompoundIdentifier(_) => *expression = self.inputs.column(&*expression),
            _ => {}
        }
        Ok(())
    }

    /// Adds the columns of the window functions to a table with their inputs.
    fn add(&self, inputs: Planned) -> Planned {
        let columns = self.windows.iter().enumerate();
        let columns =
            columns.map(|(index, window)| window.expression().alias(format!("__w{index}")));
        let frame = inputs.frame.with_columns(columns.collect::<Vec<_>>());
        Planned { frame, ..inputs }
    }

    fn window(&mut self, call: &Function) -> Result<Window> {
        let Some(WindowType::WindowSpec(spec)) = &call.over else {
            return refused(format!("`{call}` names a window that `window` does not define"));
        };
        let mut inner = Calls::of(&call.args);
        inner.add(spec);
        let is_plain = call.null_treatment.is_none() && call.within_group.is_empty();
        if inner.has_window || !is_plain || spec.window_name.is_some() {
            return refused(format!(
                "`{call}` is not supported; compute parts of it in a subquery"
            ));
        }
        let mut arguments = arguments(call)?;
        let function = window_function(call, &mut arguments)?;
        if let Some(condition) = &call.filter {
            let value = arguments.first().map_or("1", String::as_str);
            arguments = vec![format!("case when {condition} then {value} end")];
        }
        let order = spec.order_by.iter().map(|part| {
            let descending = part.options.asc == Some(false);
            let nulls_first = part.options.nulls_first.unwrap_or(descending);
            (self.inputs.name(&part.expr), Direction { descending, nulls_first })
        });
        let order: Vec<_> = order.collect();
        let frame = frame(spec)?;
        let mut names = |parts: &[String]| -> Vec<String> {
            parts.iter().map(|part| self.inputs.name(part)).collect()
        };
        let partition: Vec<String> = spec.partition_by.iter().map(ToString::to_string).collect();
        let window = Window {
            function,
            arguments: names(&arguments),
            partition: names(&partition),
            order,
            frame,
        };
        // Without an input, the number of rows would be unknown.
        let has_input =
            !(window.arguments.is_empty() && partition.is_empty() && window.order.is_empty());
        Ok(if has_input {
            window
        } else {
            Window { partition: names(&["1".to_owned()]), ..window }
        })
    }
}

/// Returns the window function of a call, and keeps only those arguments that are columns.
fn window_function(call: &Function, arguments: &mut Vec<String>) -> Result<WindowFunction> {
    use WindowFunction::*;
    let mut literal = |index: usize, default: &str| {
        let given = (arguments.len() > index).then(|| arguments.remove(index));
        given.unwrap_or_else(|| default.to_owned())
    };
    let needs = |what: &str, text: &str| {
        QueryError::Refused(format!("`{call}` needs {what}, not `{text}`"))
    };
    let offset = |text: String| text.parse::<isize>().map_err(|_| needs("a number of rows", &text));
    let positive = |text: String| {
        let number = text.parse().ok().filter(|&number: &usize| number > 0);
        number.ok_or_else(|| needs("a positive integer", &text))
    };
    let share = |text: String| {
        let number = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
        number.ok_or_else(|| needs("a number from 0 to 1", &text))
    };
    let name = name_of(call);
    let function = match name.as_str() {
        "row_number" => RowNumber,
        "rank" => Rank,
        "dense_rank" => DenseRank,
        "percent_rank" => PercentRank,
        "cume_dist" => CumeDist,
        "ntile" => Ntile(positive(literal(0, ""))?),
        "lag" => Offset(-offset(literal(1, "1"))?),
        "lead" => Offset(offset(literal(1, "1"))?),
        "first_value" | "first" => First,
        "last_value" | "last" => Last,
        "nth_value" => Nth(positive(literal(1, ""))?),
        "count" => Count,
        "sum" | "total" => Sum,
        "avg" => Average,
        "min" => Minimum,
        "max" => Maximum,
        "var" | "var_samp" | "variance" => Variance(1),
        "var_pop" => Variance(0),
        "stddev" | "stddev_samp" | "stdev" | "stdev_samp" => StandardDeviation(1),
        "stddev_pop" => StandardDeviation(0),
        "median" => Quantile(0.5),
        "quantile_cont" => Quantile(share(literal(1, ""))?),
        "quantile_disc" => DiscreteQuantile(share(literal(1, ""))?),
        _ => return refused(format!("`{name}` with `over` is not supported")),
    };
    let expected = match function {
        RowNumber | Rank | DenseRank | PercentRank | CumeDist | Ntile(_) => 0..=0,
        Offset(_) => 1..=2,
        Count => 0..=1,
        _ => 1..=1,
    };
    if !expected.contains(&arguments.len()) {
        return refused(format!("`{call}` has a wrong number of arguments"));
    }
    if call.filter.is_some() && !AGGREGATES.contains(&name.as_str()) {
        return refused(format!("`{name}` with `filter` and `over` is not supported"));
    }
    Ok(function)
}

/// Returns the bounds of a frame. Without bounds, the frame ends with the rows that are equal to
/// the current one in `order by`.
fn frame(spec: &WindowSpec) -> Result<(Bound, Bound)> {
    let Some(frame) = &spec.window_frame else {
        let is_sorted = !spec.order_by.is_empty();
        return Ok((Bound::Unbounded, if is_sorted { Bound::Peers } else { Bound::Unbounded }));
    };
    let by_rows = frame.units == WindowFrameUnits::Rows;
    let bound = |bound: &WindowFrameBound, is_start: bool| {
        let offset = match bound {
            WindowFrameBound::CurrentRow if by_rows => return Some(Bound::Rows(0)),
            WindowFrameBound::CurrentRow => return Some(Bound::Peers),
            WindowFrameBound::Preceding(None) => return is_start.then_some(Bound::Unbounded),
            WindowFrameBound::Following(None) => return (!is_start).then_some(Bound::Unbounded),
            WindowFrameBound::Preceding(Some(rows)) => format!("-{rows}"),
            WindowFrameBound::Following(Some(rows)) => rows.to_string(),
        };
        by_rows.then(|| offset.parse().ok().map(Bound::Rows)).flatten()
    };
    let end = frame.end_bound.as_ref().unwrap_or(&WindowFrameBound::CurrentRow);
    let is_known = frame.units != WindowFrameUnits::Groups;
    let bounds = bound(&frame.start_bound, true).zip(bound(end, false)).filter(|_| is_known);
    bounds.ok_or_else(|| {
        QueryError::Refused(format!(
            "the frame of `over ({spec})` is not supported; write `rows between …` with numbers of \
             rows, or `range between unbounded preceding and current row`"
        ))
    })
}

/// Returns the arguments of a call as texts; `*` is none.
fn arguments(call: &Function) -> Result<Vec<String>> {
    let FunctionArguments::List(list) = &call.args else {
        return Ok(Vec::new());
    };
    if list.duplicate_treatment == Some(DuplicateTreatment::Distinct) || !list.clauses.is_empty() {
        return refused(format!("`{call}` is not supported"));
    }
    let values = list.args.iter().filter_map(|argument| match argument {
        FunctionArg::Unnamed(FunctionArgExpr::Wildcard) => None,
        other => Some(other.to_string()),
    });
    Ok(values.collect())
}

/// Aggregates and window functions in expressions.
#[derive(Default)]
struct Calls {
    /// First aggregate.
    aggregate: Option<String>,
    has_window: bool,
}

impl Calls {
    fn add(&mut self, node: &impl Visit) {
        let _ = visit_expressions(node, |expression| {
            if let Expr::Function(function) = expression {
                self.has_window |= function.over.is_some();
                if is_aggregate(function) && self.aggregate.is_none() {
                    self.aggregate = Some(function.to_string());
                }
            }
            ControlFlow::<()>::Continue(())
        });
    }

    fn of(node: &impl Visit) -> Calls {
        let mut calls = Calls::default();
        calls.add(node);
        calls
    }

    fn is_empty(&self) -> bool {
        self.aggregate.is_none() && !self.has_window
    }
}

/// Calls `replace` for each expression of a node, the outer ones first.
fn each_expression<T: VisitMut>(
    node: &mut T,
    replace: impl FnMut(&mut Expr) -> Result<()>,
) -> Result<()> {
    struct OuterFirst<F>(F);
    impl<F: FnMut(&mut Expr) -> Result<()>> VisitorMut for OuterFirst<F> {
        type Break = QueryError;

        fn pre_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<QueryError> {
            match (self.0)(expression) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => ControlFlow::Break(error),
            }
        }
    }
    match node.visit(&mut OuterFirst(replace)) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(error) => Err(error),
    }
}

/// Returns whether a function aggregates rows. With `over` it computes one value per row.
fn is_aggregate(function: &Function) -> bool {
    function.over.is_none() && AGGREGATES.contains(&name_of(function).as_str())
}

fn name_of(function: &Function) -> String {
    function.name.to_string().to_lowercase()
}

/// Returns whether a name stands for a column of a step.
fn is_planned(name: &Ident) -> bool {
    name.value.starts_with("__")
}

fn is_literal(expression: &Expr) -> bool {
    match expression {
        Expr::Value(_) => true,
        Expr::UnaryOp { expr, .. } => is_literal(expr),
        _ => false,
    }
}

/// Returns whether two expressions are equal, or name the same column with and without its table.
fn is_same(a: &Expr, b: &Expr) -> bool {
    match (a, b) {
        (Expr::Nested(a), b) | (b, Expr::Nested(a)) => is_same(a, b),
        (Expr::Identifier(a), Expr::Identifier(b)) => a.value == b.value,
        (Expr::Identifier(name), Expr::CompoundIdentifier(parts))
        | (Expr::CompoundIdentifier(parts), Expr::Identifier(name)) => {
            parts.last().is_some_and(|last| last.value == name.value)
        }
        _ => a.to_string() == b.to_string(),
    }
}

/// Returns whether a part of `order by` is a column of the answer or its number.
fn is_output(expression: &Expr, items: &[Item]) -> bool {
    match expression {
        Expr::Identifier(name) => items.iter().any(|(_, known)| *known == name.value),
        Expr::Value(_) => true,
        _ => false,
    }
}

/// Returns the expressions of `group by`. Numbers and names of the answer stand for its
/// expressions, unless `from` has a column of the same name.
fn keys(group_by: &GroupByExpr, items: &[Item], columns: &BTreeSet<String>) -> Result<Vec<Expr>> {
    let keys = match group_by {
        GroupByExpr::All(modifiers) if modifiers.is_empty() => {
            let plain = items.iter().filter(|(value, _)| Calls::of(value).is_empty());
            return Ok(plain.map(|(value, _)| value.clone()).collect());
        }
        GroupByExpr::Expressions(keys, modifiers) if modifiers.is_empty() => keys,
        _ => return refused("`rollup`, `cube` and `totals` are not supported"),
    };
    let key = |key: &Expr| match key {
        Expr::Identifier(name) if !columns.contains(&name.value) => {
            let item = items.iter().find(|(_, known)| *known == name.value);
            Ok(item.map_or(key.clone(), |(value, _)| value.clone()))
        }
        Expr::Value(value) => {
            let index = value.to_string().parse::<usize>().ok();
            let item = index.and_then(|index| items.get(index.checked_sub(1)?));
            item.map(|(value, _)| value.clone()).ok_or_else(|| {
                QueryError::Refused(format!("`group by {value}` names no column of the answer"))
            })
        }
        Expr::Rollup(_) | Expr::Cube(_) | Expr::GroupingSets(_) => {
            refused(format!("`group by {key}` is not supported"))
        }
        other => Ok(other.clone()),
    };
    keys.iter().map(key).collect()
}

/// Replaces references to named windows by their definitions.
fn resolve_windows(select: &mut Select, ends: &mut Ends) -> Result<()> {
    let mut specs = BTreeMap::new();
    for NamedWindowDefinition(name, window) in std::mem::take(&mut select.named_window) {
        let NamedWindowExpr::WindowSpec(spec) = window else {
            return refused(format!("`window {name}` names another window"));
        };
        specs.insert(name.value, spec);
    }
    let mut resolve = |expression: &mut Expr| {
        if let Expr::Function(function) = expression
            && let Some(WindowType::NamedWindow(name)) = &function.over
            && let Some(spec) = specs.get(&name.value)
        {
            function.over = Some(WindowType::WindowSpec(spec.clone()));
        }
        Ok(())
    };
    each_expression(select, &mut resolve)?;
    each_expression(&mut ends.order_by, resolve)
}

/// Refuses joins that polars computes otherwise: it does not merge the columns of `using` in right
/// and full joins, and drops unmatched rows if outer joins have other conditions than equalities.
fn check_join(join: &JoinOperator) -> Result<()> {
    use JoinOperator::{FullOuter, Left, LeftOuter, Right, RightOuter};
    let (constraint, is_left) = match join {
        Left(constraint) | LeftOuter(constraint) => (constraint, true),
        Right(constraint) | RightOuter(constraint) | FullOuter(constraint) => (constraint, false),
        _ => return Ok(()),
    };
    match constraint {
        JoinConstraint::Using(_) | JoinConstraint::Natural if !is_left => refused(
            "right and full joins need `on`, such as `on a.load = b.load`; `coalesce(a.load, \
             b.load)` is the load of either table",
        ),
        JoinConstraint::On(condition) if !is_equality(condition) => refused(format!(
            "an outer join can only compare columns of both tables by `=`, not `{condition}`: put \
             other conditions into a subquery, such as `left join (select * from b where …) as b`"
        )),
        _ => Ok(()),
    }
}

/// Moves all conditions of inner joins into `where` that do not compare columns of both tables by
/// `=`. A join without such a comparison becomes a cross join.
///
/// Polars computes some of the other conditions wrongly: in `abs(a.x - b.x) < 1` it takes both
/// columns from the first table.
///
/// # Errors
/// Returns an error if a right or full join follows, because `where` would remove its rows, too.
fn move_conditions(select: &mut Select) -> Result<()> {
    use JoinOperator::{CrossJoin, FullOuter, Inner, Join, Right, RightOuter};
    let mut moved = Vec::new();
    for part in &mut select.from {
        let mut keeps_rows = false;
        for join in part.joins.iter_mut().rev() {
            let condition = match &join.join_operator {
                Join(JoinConstraint::On(condition)) | Inner(JoinConstraint::On(condition)) => {
                    condition
                }
                Right(_) | RightOuter(_) | FullOuter(_) => {
                    keeps_rows = true;
                    continue;
                }
                _ => continue,
            };
            if keeps_rows && !is_equality(condition) {
                return refused(format!(
                    "a join before a right or full join can only compare columns of both tables by \
                     `=`, not `{condition}`: join these tables in a subquery"
                ));
            }
            let (equalities, others): (Vec<Expr>, Vec<Expr>) =
                conjunction(condition).into_iter().partition(is_equality);
            join.join_operator = match all_of(equalities) {
                Some(equalities) => Join(JoinConstraint::On(equalities)),
                None => CrossJoin(JoinConstraint::None),
            };
            moved.extend(others);
        }
    }
    select.selection = all_of(select.selection.take().into_iter().chain(moved).collect());
    Ok(())
}

/// Removes the columns of `using` of the right tables from `*`, where polars repeats them. Polars
/// names column `k` of the right table `u` `k:u`.
fn hide_joined_keys(select: &mut Select) {
    use JoinOperator::{Inner, Join, Left, LeftOuter};
    let mut hidden = Vec::new();
    for join in select.from.iter().flat_map(|part| &part.joins) {
        let (Join(constraint) | Inner(constraint) | Left(constraint) | LeftOuter(constraint)) =
            &join.join_operator
        else {
            continue;
        };
        if let JoinConstraint::Using(columns) = constraint
            && let TableFactor::Table { name, .. } = &join.relation
        {
            let last = |name: &ObjectName| Some(name.0.last()?.as_ident()?.value.clone());
            let pairs = columns.iter().filter_map(|column| Some((last(column)?, last(name)?)));
            hidden
                .extend(pairs.map(|(key, table)| Ident::with_quote('"', format!("{key}:{table}"))));
        }
    }
    for item in &mut select.projection {
        let SelectItem::Wildcard(options) = item else { continue };
        if let Some(except) = &mut options.opt_except {
            except.additional_elements.extend(hidden.iter().cloned());
            continue;
        }
        let excluded = match options.opt_exclude.take() {
            None => Vec::new(),
            Some(ExcludeSelectItem::Single(name)) => vec![name],
            Some(ExcludeSelectItem::Multiple(names)) => names,
        };
        let hidden = hidden.iter().map(|name| ObjectName::from(vec![name.clone()]));
        let excluded: Vec<ObjectName> = excluded.into_iter().chain(hidden).collect();
        if !excluded.is_empty() {
            options.opt_exclude = Some(ExcludeSelectItem::Multiple(excluded));
        }
    }
}

/// Returns the conditions that are combined by `and`.
fn conjunction(condition: &Expr) -> Vec<Expr> {
    match condition {
        Expr::Nested(inner) => conjunction(inner),
        Expr::BinaryOp { left, op: BinaryOperator::And, right } => {
            [conjunction(left), conjunction(right)].concat()
        }
        other => vec![other.clone()],
    }
}

/// Combines conditions by `and`; `None` if there are none.
fn all_of(conditions: Vec<Expr>) -> Option<Expr> {
    let nested = conditions.into_iter().map(|condition| match condition {
        Expr::BinaryOp { op: BinaryOperator::Or | BinaryOperator::Xor, .. } => {
            Expr::Nested(Box::new(condition))
        }
        other => other,
    });
    nested.reduce(|left, right| {
        let (left, right) = (Box::new(left), Box::new(right));
        Expr::BinaryOp { left, op: BinaryOperator::And, right }
    })
}

/// Returns whether a condition consists of equalities of columns of different tables.
fn is_equality(condition: &Expr) -> bool {
    match condition {
        Expr::Nested(inner) => is_equality(inner),
        Expr::BinaryOp { left, op: BinaryOperator::And, right } => {
            is_equality(left) && is_equality(right)
        }
        Expr::BinaryOp { left, op: BinaryOperator::Eq, right } => {
            let (left, right) = (qualifiers(left), qualifiers(right));
            !left.is_empty() && !right.is_empty() && left.is_disjoint(&right)
        }
        _ => false,
    }
}

/// Returns the tables of the columns in an expression; columns without a table are one by their
/// name.
fn qualifiers(expression: &Expr) -> BTreeSet<String> {
    let mut tables = BTreeSet::new();
    let _ = visit_expressions(expression, |part| {
        match part {
            Expr::Identifier(name) => tables.insert(name.value.clone()),
            Expr::CompoundIdentifier(parts) => tables.insert(parts[0].value.clone()),
            _ => false,
        };
        ControlFlow::<()>::Continue(())
    });
    tables
}

/// Returns whether an expression of `order by` has the name of a column of a table that a column of
/// the answer has, too. The table goes before; polars takes the column of the answer.
fn is_ambiguous(select: &Select, ends: &mut Ends, columns: &BTreeSet<String>) -> bool {
    let aliases = select.projection.iter().filter_map(|item| match item {
        SelectItem::ExprWithAlias { alias, .. } => Some(alias.value.clone()),
        _ => None,
    });
    let aliases: BTreeSet<String> = aliases.filter(|alias| columns.contains(alias)).collect();
    let is_expression = |part: &&OrderByExpr| !matches!(part.expr, Expr::Identifier(_));
    // The columns of `select distinct` cannot be sorted by others.
    select.distinct.is_none()
        && ends
            .order()
            .iter()
            .filter(is_expression)
            .any(|part| !qualifiers(&part.expr).is_disjoint(&aliases))
}

fn is_wildcard(item: &SelectItem) -> bool {
    matches!(item, SelectItem::Wildcard(_) | SelectItem::QualifiedWildcard(..))
}

/// Returns the expression and the name of a column of an answer; `None` for `*`.
fn named(item: SelectItem) -> Option<Item> {
    match item {
        SelectItem::ExprWithAlias { expr, alias } => Some((expr, alias.value)),
        SelectItem::UnnamedExpr(expression) => {
            let name = match &expression {
                Expr::Identifier(name) => name.value.clone(),
                Expr::CompoundIdentifier(parts) => parts.last()?.value.clone(),
                other => other.to_string(),
            };
            Some((expression, name))
        }
        _ => None,
    }
}

/// Returns a `select` with the tables and the condition of another one, and nothing else.
fn bare(select: &Select) -> Select {
    Select {
        distinct: None,
        projection: Vec::new(),
        group_by: GroupByExpr::Expressions(Vec::new(), Vec::new()),
        having: None,
        qualify: None,
        ..select.clone()
    }
}

fn table(name: &str) -> TableFactor {
    TableFactor::Table {
        name: ObjectName::from(vec![Ident::with_quote('"', name)]),
        alias: None,
        args: None,
        with_hints: Vec::new(),
        version: None,
        with_ordinality: false,
        partitions: Vec::new(),
        json_path: None,
        sample: None,
        index_hints: Vec::new(),
    }
}

fn quoted<T: AsRef<str>>(names: &[T]) -> String {
    let names = names.iter().map(|name| Ident::with_quote('"', name.as_ref()).to_string());
    names.collect::<Vec<_>>().join(", ")
}
