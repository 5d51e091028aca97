//! Aggregates and `group by`: replacement by columns of a reduced table.

use std::collections::{BTreeMap, BTreeSet};

use sqlparser::ast::{
    DuplicateTreatment, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArgumentClause,
    FunctionArguments, GroupByExpr, Ident,
};

use super::expressions::{Calls, Columns, Item, is_aggregate, is_planned, name_of};
use super::{Result, each_expression, refused};
use crate::QueryError;

/// Replacement of aggregates and columns of `group by` by columns of the reduced table.
pub(super) struct GroupedSelect {
    pub(super) keys: Vec<(Expr, String)>,
    /// Columns of `group by` and arguments of aggregates.
    pub(super) inputs: Columns,
    pub(super) aggregates: Columns,
    /// Expressions of the answer by their names, for conditions and `order by`.
    pub(super) aliases: BTreeMap<String, Expr>,
}

impl GroupedSelect {
    pub(super) fn lower(&mut self, expression: &mut Expr) -> Result<()> {
        each_expression(expression, &mut |part| self.replace(part))
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

/// Returns the expressions of `group by`. Numbers and names of the answer stand for its
/// expressions, unless `from` has a column of the same name.
pub(super) fn keys(
    group_by: &GroupByExpr,
    items: &[Item],
    columns: &BTreeSet<String>,
) -> Result<Vec<Expr>> {
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

fn is_literal(expression: &Expr) -> bool {
    match expression {
        Expr::Value(_) => true,
        Expr::UnaryOp { expr, .. } => is_literal(expr),
        _ => false,
    }
}
