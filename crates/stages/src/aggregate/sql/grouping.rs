//! Columns that stand beside aggregates without a group. Polars would repeat the aggregate of all rows in each of
//! them, where SQL has no answer.

use std::ops::ControlFlow;

use sqlparser::ast::{Expr, Function, GroupByExpr, Query, Select, SelectItem, Visit, Visitor};

/// Functions of polars that make one value of all rows.
const AGGREGATES: [&str; 26] = [
    "array_agg",
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

/// What is wrong with a `select` that has both and does not group.
pub fn ungrouped(select: &Select) -> Option<String> {
    let is_grouped = match &select.group_by {
        GroupByExpr::All(_) => true,
        GroupByExpr::Expressions(columns, _) => !columns.is_empty(),
    };
    if is_grouped {
        return None;
    }
    let mut parts = Parts::default();
    for item in &select.projection {
        match item {
            SelectItem::UnnamedExpr(expression)
            | SelectItem::ExprWithAlias { expr: expression, .. } => {
                let _ = expression.visit(&mut parts);
            }
            _ => parts.bare = parts.bare.or_else(|| Some("*".to_owned())),
        }
    }
    let (bare, aggregate) = (parts.bare?, parts.aggregate?);
    Some(match bare == "*" {
        true => format!(
            "`*` stands beside `{aggregate}`: columns of single rows have to be in a `group by`"
        ),
        false => format!(
            "`{bare}` stands beside `{aggregate}` and is neither aggregated nor in `group by`: \
             `group by {bare}` gives a row for each, `first({bare})` one of all"
        ),
    })
}

/// The first column outside aggregates and the first aggregate.
#[derive(Default)]
struct Parts {
    bare: Option<String>,
    aggregate: Option<String>,
    /// Aggregates and queries around.
    inside: usize,
}

impl Visitor for Parts {
    type Break = ();

    fn pre_visit_query(&mut self, _: &Query) -> ControlFlow<()> {
        self.inside += 1;
        ControlFlow::Continue(())
    }

    fn post_visit_query(&mut self, _: &Query) -> ControlFlow<()> {
        self.inside -= 1;
        ControlFlow::Continue(())
    }

    fn pre_visit_expr(&mut self, expression: &Expr) -> ControlFlow<()> {
        let outside = self.inside == 0;
        match expression {
            Expr::Function(function) if is_aggregate(function) => {
                if outside && self.aggregate.is_none() {
                    self.aggregate = Some(function.to_string());
                }
                self.inside += 1;
            }
            Expr::Identifier(_) | Expr::CompoundIdentifier(_) if outside && self.bare.is_none() => {
                self.bare = Some(expression.to_string());
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }

    fn post_visit_expr(&mut self, expression: &Expr) -> ControlFlow<()> {
        if let Expr::Function(function) = expression
            && is_aggregate(function)
        {
            self.inside -= 1;
        }
        ControlFlow::Continue(())
    }
}

/// With `over` it is one value of each row.
fn is_aggregate(function: &Function) -> bool {
    let name = function.name.to_string().to_lowercase();
    function.over.is_none() && AGGREGATES.contains(&name.as_str())
}
