//! Tables and joins of a `select`.

use std::collections::BTreeSet;

use sqlparser::ast::{
    BinaryOperator, ExcludeSelectItem, Expr, Ident, JoinConstraint, JoinOperator, ObjectName,
    Select, SelectItem, TableAlias, TableFactor, TableWithJoins,
};

use super::expressions::visit_each;
use super::{Planned, Planner, Result, refused};
use crate::QueryError;
use crate::statement::parsed_table;

impl Planner<'_> {
    /// Renames the columns as an alias such as `m(load, area)` says.
    pub(super) fn with_names(&self, mut planned: Planned, alias: &TableAlias) -> Result<Planned> {
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
    pub(super) fn from(&mut self, from: &mut [TableWithJoins]) -> Result<Vec<(String, Planned)>> {
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
                let Some(part) = name.0.last().and_then(|part| part.as_ident()) else {
                    return refused(format!("`{name}` is not a table"));
                };
                let known = part.value.clone();
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
        *relation = parsed_table(&name)?;
        tables.push((name, planned));
        Ok(())
    }
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
pub(super) fn move_conditions(select: &mut Select) -> Result<()> {
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
pub(super) fn hide_joined_keys(select: &mut Select) {
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
        let given = match options.opt_exclude.take() {
            None => Vec::new(),
            Some(ExcludeSelectItem::Single(name)) => vec![name],
            Some(ExcludeSelectItem::Multiple(names)) => names,
        };
        let more = hidden.iter().map(|name| ObjectName::from(vec![name.clone()]));
        let excluded: Vec<ObjectName> = given.into_iter().chain(more).collect();
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
pub(super) fn qualifiers(expression: &Expr) -> BTreeSet<String> {
    let mut tables = BTreeSet::new();
    visit_each(expression, &mut |part| {
        match part {
            Expr::Identifier(name) => tables.insert(name.value.clone()),
            Expr::CompoundIdentifier(parts) => tables.insert(parts[0].value.clone()),
            _ => false,
        };
    });
    tables
}
