//! Units of the columns of an answer, which follow from the query.
//!
//! A column that is passed on keeps its description. Sums, means, extrema and quotients have the
//! unit of their operands where it is certain; all other columns have none. A product with a number
//! has none, because it may be a conversion.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::datatypes::{Field, Metadata, SchemaRef};
use sqlparser::ast::{
    BinaryOperator, Expr, FunctionArg, FunctionArgExpr, FunctionArguments, Query, Select,
    SelectItem, SelectItemQualifiedWildcardKind, SetExpr, TableAlias, TableFactor, UnaryOperator,
};

use crate::QueryError;
use crate::engine::on_query_thread;
use crate::statement::{name_of, parsed};
use asperity_tables::column::{Description, Role, described};

/// Functions whose value has the unit of their first argument.
const KEEP_UNIT: [&str; 21] = [
    "abs",
    "avg",
    "ceil",
    "coalesce",
    "first",
    "first_value",
    "floor",
    "lag",
    "last",
    "last_value",
    "lead",
    "max",
    "median",
    "min",
    "quantile_cont",
    "quantile_disc",
    "round",
    "stddev",
    "stddev_samp",
    "sum",
    "total",
];

/// Description of a column of a table or of an answer.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// Unit as a table declares it; `None` if it is unknown.
    unit: Option<String>,
    /// Column that is passed on without a change.
    field: Option<Arc<Field>>,
}

type Columns = Vec<(String, Origin)>;

/// Tables that a part of a query can name.
type Scope = BTreeMap<String, Columns>;

impl Origin {
    fn of_field(field: &Arc<Field>) -> Origin {
        let unit = Description::from(field.as_ref()).unit;
        let unit = Some(unit).filter(|unit| !unit.is_empty());
        Origin { unit, field: Some(field.clone()) }
    }

    fn computed(unit: Option<String>) -> Origin {
        Origin { unit, field: None }
    }

    /// Returns the metadata of a column with this origin.
    pub fn metadata(&self) -> Metadata {
        match &self.field {
            Some(field) => field.metadata().clone(),
            None => {
                let unit = self.unit.as_deref().unwrap_or_default();
                described(Role::Result, unit, "value computed by the query")
            }
        }
    }
}

/// Returns the origins of the columns of the answer to a query, by name.
///
/// # Errors
/// Returns an error if the query cannot be parsed or the thread cannot be started.
pub fn origins(
    query: &str,
    tables: &[(String, SchemaRef)],
) -> Result<BTreeMap<String, Origin>, QueryError> {
    let columns = |schema: &SchemaRef| -> Columns {
        let fields = schema.fields().iter();
        fields.map(|field| (field.name().clone(), Origin::of_field(field))).collect()
    };
    let scope = tables.iter().map(|(name, schema)| (name.clone(), columns(schema))).collect();
    on_query_thread(|| Ok(of_query(&parsed(query)?, &scope).into_iter().rev().collect()))
}

fn of_query(query: &Query, outside: &Scope) -> Columns {
    let Some(with) = &query.with else { return of_body(&query.body, outside) };
    let mut scope = outside.clone();
    for table in &with.cte_tables {
        let columns = renamed(of_query(&table.query, &scope), Some(&table.alias));
        scope.insert(table.alias.name.value.clone(), columns);
    }
    of_body(&query.body, &scope)
}

fn of_body(body: &SetExpr, scope: &Scope) -> Columns {
    match body {
        SetExpr::Select(select) => of_select(select, scope),
        SetExpr::Query(query) => of_query(query, scope),
        SetExpr::SetOperation { left, right, .. } => {
            let others = of_body(right, scope);
            let both = of_body(left, scope).into_iter().zip(others);
            let common = |((name, one), (_, other)): ((String, Origin), (String, Origin))| {
                let is_same = one.unit == other.unit;
                (name, if is_same { one } else { Origin::default() })
            };
            both.map(common).collect()
        }
        _ => Columns::new(),
    }
}

fn of_select(select: &Select, scope: &Scope) -> Columns {
    let mut relations: Vec<(String, Columns)> = Vec::new();
    for table in &select.from {
        let joined = table.joins.iter().map(|join| &join.relation);
        for factor in std::iter::once(&table.relation).chain(joined) {
            add_relation(factor, scope, &mut relations);
        }
    }
    let mut columns = Columns::new();
    for item in &select.projection {
        match item {
            SelectItem::UnnamedExpr(expression) => {
                let name = match expression {
                    Expr::Identifier(name) => name.value.clone(),
                    Expr::CompoundIdentifier(parts) => {
                        parts.last().map_or_else(String::new, |name| name.value.clone())
                    }
                    other => other.to_string(),
                };
                columns.push((name, of_expression(expression, &relations)));
            }
            SelectItem::ExprWithAlias { expr, alias } => {
                columns.push((alias.value.clone(), of_expression(expr, &relations)));
            }
            SelectItem::Wildcard(_) => {
                columns.extend(relations.iter().flat_map(|(_, columns)| columns.clone()));
            }
            SelectItem::QualifiedWildcard(SelectItemQualifiedWildcardKind::ObjectName(of), _) => {
                let named = relations.iter().filter(|(name, _)| Some(name) == name_of(of).as_ref());
                columns.extend(named.flat_map(|(_, columns)| columns.clone()));
            }
            _ => {}
        }
    }
    columns
}

fn add_relation(factor: &TableFactor, scope: &Scope, relations: &mut Vec<(String, Columns)>) {
    match factor {
        TableFactor::Table { name, alias, .. } => {
            let name = name_of(name).unwrap_or_default();
            let columns = scope.get(&name).cloned().unwrap_or_default();
            let called = alias.as_ref().map_or(name, |alias| alias.name.value.clone());
            relations.push((called, renamed(columns, alias.as_ref())));
        }
        TableFactor::Derived { subquery, alias, .. } => {
            let called = alias.as_ref().map_or_else(String::new, |alias| alias.name.value.clone());
            relations.push((called, renamed(of_query(subquery, scope), alias.as_ref())));
        }
        TableFactor::NestedJoin { table_with_joins, .. } => {
            add_relation(&table_with_joins.relation, scope, relations);
            for join in &table_with_joins.joins {
                add_relation(&join.relation, scope, relations);
            }
        }
        _ => {}
    }
}

/// Gives columns the names after the alias of their table, as in `t(a, b)`.
fn renamed(mut columns: Columns, alias: Option<&TableAlias>) -> Columns {
    let names = alias.into_iter().flat_map(|alias| &alias.columns);
    for (column, named) in columns.iter_mut().zip(names) {
        column.0.clone_from(&named.name.value);
    }
    columns
}

fn of_expression(expression: &Expr, relations: &[(String, Columns)]) -> Origin {
    let unit = |expression: &Expr| of_expression(expression, relations).unit;
    match expression {
        Expr::Identifier(name) => {
            let mut all = relations.iter().flat_map(|(_, columns)| columns);
            let found = all.find(|(known, _)| *known == name.value);
            found.map(|(_, origin)| origin.clone()).unwrap_or_default()
        }
        Expr::CompoundIdentifier(parts) => {
            let [table, name] = parts.as_slice() else { return Origin::default() };
            let relation = relations.iter().find(|(known, _)| *known == table.value);
            let mut columns = relation.iter().flat_map(|(_, columns)| columns);
            let found = columns.find(|(known, _)| *known == name.value);
            found.map(|(_, origin)| origin.clone()).unwrap_or_default()
        }
        Expr::Nested(inner) => of_expression(inner, relations),
        Expr::Cast { expr, .. }
        | Expr::UnaryOp { op: UnaryOperator::Minus | UnaryOperator::Plus, expr } => {
            Origin::computed(unit(expr))
        }
        Expr::Ceil { expr, .. } | Expr::Floor { expr, .. } => Origin::computed(unit(expr)),
        Expr::BinaryOp { left, op: BinaryOperator::Plus | BinaryOperator::Minus, right } => {
            Origin::computed(unit(left).filter(|left| unit(right).as_ref() == Some(left)))
        }
        Expr::BinaryOp { left, op: BinaryOperator::Divide, right } => Origin::computed(
            unit(left).zip(unit(right)).map(|(left, right)| quotient(&left, &right)),
        ),
        Expr::Function(function) => {
            let name = name_of(&function.name).unwrap_or_default().to_lowercase();
            let FunctionArguments::List(list) = &function.args else { return Origin::default() };
            match list.args.first() {
                Some(FunctionArg::Unnamed(FunctionArgExpr::Expr(of)))
                    if KEEP_UNIT.contains(&name.as_str()) =>
                {
                    Origin::computed(unit(of))
                }
                _ => Origin::default(),
            }
        }
        _ => Origin::default(),
    }
}

/// Returns the unit of a quotient: `length` for `length` over `1`, `pressure/length`, or
/// `1/(E* × rms slope)`.
fn quotient(above: &str, below: &str) -> String {
    let factor = |unit: &str| {
        let is_compound = unit.contains([' ', '/']);
        if is_compound { format!("({unit})") } else { unit.to_owned() }
    };
    match (above, below) {
        _ if above == below => "1".to_owned(),
        (_, "1") => above.to_owned(),
        _ => format!("{}/{}", factor(above), factor(below)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_tables::column::{Column, ColumnKind};
    use asperity_tables::table::Table;

    /// Returns the units of the columns of an answer, `-` for a column without one.
    fn units(query: &str) -> String {
        let real = |name, unit| Column::result(name, ColumnKind::Real, unit, "");
        let contact = Table::empty(&[
            real("pressure", "pressure"),
            real("mean_gap", "length"),
            real("area", "1"),
            real("load", "E* × rms slope"),
        ]);
        let tables = [("contact".to_owned(), contact.batch().schema())];
        let found = origins(query, &tables).unwrap();
        let unit = |(name, origin): (&String, &Origin)| {
            format!("{name}: {}", origin.unit.as_deref().unwrap_or("-"))
        };
        found.iter().map(unit).collect::<Vec<_>>().join(", ")
    }

    #[test]
    fn columns_that_are_passed_on_keep_their_units() {
        assert_eq!(
            units("select pressure as p, c.mean_gap from contact c"),
            "mean_gap: length, p: pressure"
        );
        assert_eq!(
            units(
                "with t(a, b) as (select area, load from contact) select t.b, x.* from t join (select a from t) x using (a)"
            ),
            "a: 1, b: E* × rms slope"
        );
        let all = "area: 1, load: E* × rms slope, mean_gap: length, pressure: pressure";
        assert_eq!(units("select * from contact where area > 0"), all);
    }

    #[test]
    fn sums_means_extrema_and_quotients_have_units() {
        let text = "select max(pressure) as a, avg(-mean_gap) as b, pressure / mean_gap as c, \
                    area / load as d, sum(pressure) / sum(pressure) as e, pressure / area as f, \
                    pressure - min(pressure) over () as g from contact";
        let expected = "a: pressure, b: length, c: pressure/length, d: 1/(E* × rms slope), e: 1, \
                        f: pressure, g: pressure";
        assert_eq!(units(text), expected);
    }

    #[test]
    fn other_columns_have_no_unit() {
        let text = "select 1000 * mean_gap as mean_gap, pressure + mean_gap as a, count(*) as b, \
                    power(mean_gap, 2) as c, pressure * mean_gap as d from contact";
        assert_eq!(units(text), "a: -, b: -, c: -, d: -, mean_gap: -");
        let mixed = "select pressure as a from contact union select mean_gap from contact";
        assert_eq!(units(mixed), "a: -");
    }
}
