//! Execution of a query in steps, each of which polars computes rightly.
//!
//! Polars leaves a literal at length one inside an aggregate, names an aggregate like its column,
//! and resolves names of grouped and joined tables in unusual ways. A `select` is therefore split:
//! the arguments of its aggregates become columns, then groups are reduced, then groups are
//! filtered (`having`), then window functions are added, and the last step computes the columns of
//! the answer and sorts them. Each step is a query on one table of named columns.

mod expressions;
mod from;
mod groups;
mod select;
mod windows;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use bytesize::ByteSize;
use polars::prelude::{DataType, IntoLazy, LazyFrame, PolarsError};
use polars::sql::SQLContext;
use sqlparser::ast::{
    Expr, Fetch, Ident, LimitClause, OrderBy, OrderByExpr, OrderByKind, Query, SetExpr,
    SetOperator, SetQuantifier, Value, VisitMut, VisitorMut,
};

use super::engine;
use super::functions::Functions;
use super::statement::{parsed, with_point};
use crate::QueryError;

/// Number of steps of a plan above which the plan is computed, because a table that a query uses
/// twice is planned twice, and plans of tables that build on each other double each time.
const MAX_STEPS: usize = 64;

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
        right: Planned,
    ) -> Result<Planned> {
        let columns = quoted(&self.columns(&mut left)?);
        let sides = [(self.name(), left), (self.name(), right)];
        let [left, right] = [0, 1].map(|side: usize| format!("\"{}\"", sides[side].0));
        let text = match operator {
            SetOperator::Union => {
                format!("select * from {left} union {quantifier} select * from {right}")
            }
            SetOperator::Intersect | SetOperator::Except if quantifier != SetQuantifier::All => {
                let last = i32::from(operator == SetOperator::Intersect);
                format!(
                    "select {columns} from (select *, 0 as __side from {left} union all \
                     select *, 1 as __side from {right}) as __sides group by {columns} \
                     having min(__side) = 0 and max(__side) = {last}"
                )
            }
            _ => return refused(format!("`{operator} {quantifier}` is not supported")),
        };
        self.step(&text, &sides)
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

    /// Computes the subqueries in expressions.
    fn subqueries<T: VisitMut>(
        &mut self,
        node: &mut T,
        tables: &mut Vec<(String, Planned)>,
    ) -> Result<()> {
        each_expression(node, &mut |expression| self.without_subquery(expression, tables))
    }

    /// Replaces a subquery by its value, or in `in (…)` by a table.
    fn without_subquery(
        &mut self,
        expression: &mut Expr,
        tables: &mut Vec<(String, Planned)>,
    ) -> Result<()> {
        match expression {
            Expr::Subquery(query) => {
                let value = self.subquery((**query).clone())?;
                *expression = Expr::Nested(Box::new(Expr::value(value)));
            }
            Expr::Exists { subquery, negated } => {
                let planned = self.query((**subquery).clone())?;
                let name = self.name();
                let text = format!("select 1 as one from \"{name}\" limit 1");
                let first = self.step(&text, &[(name, planned)])?;
                let exists = self.collect(first)?.height() > 0;
                *expression = Expr::value(Value::Boolean(exists != *negated));
            }
            Expr::InSubquery { subquery, .. } => {
                let mut planned = self.query((**subquery).clone())?;
                let names = self.columns(&mut planned)?;
                let [column] = names.as_slice() else {
                    let columns = names.len();
                    return refused(format!(
                        "`in ({subquery})` has {columns} columns instead of one"
                    ));
                };
                let name = self.name();
                // Later steps do not replace names of the planner.
                let frame = planned.frame.rename([column], ["__in"], true);
                **subquery = parsed(&format!("select __in from \"{name}\""))?;
                tables.push((name, Planned { frame, ..planned }));
            }
            _ => {}
        }
        Ok(())
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

/// Calls `replace` for each expression of a node, the outer ones first.
fn each_expression(
    node: &mut impl VisitMut,
    replace: &mut dyn FnMut(&mut Expr) -> Result<()>,
) -> Result<()> {
    // One type of visitor: for each, the compiler writes half a megabyte that walks all of SQL.
    struct OuterFirst<'a>(&'a mut dyn FnMut(&mut Expr) -> Result<()>);
    impl VisitorMut for OuterFirst<'_> {
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

fn quoted<T: AsRef<str>>(names: &[T]) -> String {
    let words = names.iter().map(|name| Ident::with_quote('"', name.as_ref()).to_string());
    words.collect::<Vec<_>>().join(", ")
}
