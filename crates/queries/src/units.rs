//! Units of the columns of an answer, which follow from the query.
//!
//! A column that is passed on keeps its description. Sums, means, extrema, quotients and `case`
//! have the unit of their operands where it is certain; all other columns have none. A product
//! with a number has none, because it may be a conversion.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::datatypes::{Field, Metadata, SchemaRef};
use sqlparser::ast::{
    BinaryOperator, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments, Query,
    RenameSelectItem, Select, SelectItem, SelectItemQualifiedWildcardKind, SetExpr, TableAlias,
    TableFactor, UnaryOperator, Value, WildcardAdditionalOptions,
};

use crate::QueryError;
use crate::engine::on_query_thread;
use crate::statement::{column_name, name_of, parsed};
use asperity_tables::column::{Description, Role, described};

/// Functions whose value has the unit of their first argument.
const KEEP_UNIT: &str = "\
    abs avg ceil first first_value floor lag last last_value lead max median min quantile_cont \
    quantile_disc round stddev stddev_samp sum total";

/// Unit of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Unit {
    /// Unit as a table declares it: `length`.
    declared: String,
    /// Unit that the table names: `µm`. Columns of two stages may differ in it.
    named: String,
}

/// Description of a column of a table or of an answer.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// Unit of the values; `None` if it is unknown.
    unit: Option<Unit>,
    /// Column that is passed on without a change.
    field: Option<Arc<Field>>,
}

type Columns = Vec<(String, Origin)>;

/// Tables that a part of a query can name.
type Scope = BTreeMap<String, Columns>;

impl Origin {
    fn of_field(field: &Arc<Field>) -> Origin {
        let unit = Unit {
            declared: Description::from(field.as_ref()).unit,
            named: Description::in_units(field).unit,
        };
        let unit = Some(unit).filter(|unit| !unit.declared.is_empty());
        Origin { unit, field: Some(field.clone()) }
    }

    /// Returns whether the query computes the values, and does not pass a column on.
    pub fn is_computed(&self) -> bool {
        self.field.is_none()
    }

    /// Returns the unit of the values, as a table declares it; empty if it is unknown.
    pub fn unit(&self) -> &str {
        self.unit.as_ref().map_or("", |unit| &unit.declared)
    }

    /// Returns the metadata of a column with this origin.
    pub fn metadata(&self) -> Metadata {
        match &self.field {
            Some(field) => field.metadata().clone(),
            None => described(Role::Result, self.unit(), "value computed by the query"),
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
                columns.push((column_name(expression), of_expression(expression, &relations)));
            }
            SelectItem::ExprWithAlias { expr, alias } => {
                columns.push((alias.value.clone(), of_expression(expr, &relations)));
            }
            SelectItem::Wildcard(options) => {
                let all = relations.iter().flat_map(|(_, columns)| columns.clone());
                columns.extend(modified(all, options, &relations));
            }
            SelectItem::QualifiedWildcard(
                SelectItemQualifiedWildcardKind::ObjectName(of),
                options,
            ) => {
                let named = relations.iter().filter(|(name, _)| Some(name) == name_of(of).as_ref());
                let all = named.flat_map(|(_, columns)| columns.clone());
                columns.extend(modified(all, options, &relations));
            }
            _ => {}
        }
    }
    columns
}

/// Returns the columns of a wildcard with `replace` and `rename`.
fn modified(
    columns: impl Iterator<Item = (String, Origin)>,
    options: &WildcardAdditionalOptions,
    relations: &[(String, Columns)],
) -> Columns {
    let renames = match &options.opt_rename {
        Some(RenameSelectItem::Single(one)) => std::slice::from_ref(one),
        Some(RenameSelectItem::Multiple(all)) => all.as_slice(),
        None => &[],
    };
    let replaced = |name: &str| {
        let mut items = options.opt_replace.iter().flat_map(|replace| &replace.items);
        let item = items.find(|item| item.column_name.value == name)?;
        Some(of_expression(&item.expr, relations))
    };
    let column = |(name, origin): (String, Origin)| {
        let rename = renames.iter().find(|rename| rename.ident.value == name);
        let called = rename.map_or_else(|| name.clone(), |rename| rename.alias.value.clone());
        let replacement = replaced(&name).or_else(|| replaced(&called));
        (called, replacement.unwrap_or(origin))
    };
    columns.map(column).collect()
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
    let column = |table: Option<&str>, name: &str| {
        let meant = relations.iter().filter(|(known, _)| table.is_none_or(|table| table == known));
        let found = meant.flat_map(|(_, columns)| columns).find(|(known, _)| known == name);
        found.map(|(_, origin)| origin.clone()).unwrap_or_default()
    };
    match expression {
        Expr::Identifier(name) => column(None, &name.value),
        Expr::CompoundIdentifier(parts) => match parts.as_slice() {
            [table, name] => column(Some(&table.value), &name.value),
            _ => Origin::default(),
        },
        Expr::Nested(inner) => of_expression(inner, relations),
        computed => Origin { unit: computed_unit(computed, relations), field: None },
    }
}

/// Returns the unit of a computed value.
fn computed_unit(expression: &Expr, relations: &[(String, Columns)]) -> Option<Unit> {
    let unit = |expression: &Expr| of_expression(expression, relations).unit;
    match expression {
        // Only real numbers are converted to units of output.
        Expr::Cast { expr, data_type, .. } => {
            let name = data_type.to_string().to_lowercase();
            let is_real = ["double", "float", "real"].iter().any(|real| name.starts_with(real));
            unit(expr).filter(|_| is_real)
        }
        Expr::UnaryOp { op: UnaryOperator::Minus | UnaryOperator::Plus, expr }
        | Expr::Ceil { expr, .. }
        | Expr::Floor { expr, .. } => unit(expr),
        Expr::BinaryOp { left, op: BinaryOperator::Plus | BinaryOperator::Minus, right } => {
            unit(left).filter(|left| unit(right).as_ref() == Some(left))
        }
        Expr::BinaryOp { left, op: BinaryOperator::Divide, right } => {
            unit(left)?.over(&unit(right)?)
        }
        Expr::Case { conditions, else_result, .. } => {
            let results = conditions.iter().map(|when| &when.result);
            shared_unit(results.chain(else_result.as_deref()), unit)
        }
        Expr::Function(Function { name, args: FunctionArguments::List(list), .. }) => {
            let name = name_of(name)?.to_lowercase();
            let mut values = list.args.iter().filter_map(|one| match one {
                FunctionArg::Unnamed(FunctionArgExpr::Expr(value)) => Some(value),
                _ => None,
            });
            if name == "coalesce" {
                return shared_unit(values, unit);
            }
            values.next().filter(|_| KEEP_UNIT.split(' ').any(|known| known == name)).and_then(unit)
        }
        _ => None,
    }
}

/// Returns the unit that all values have. Null and zero have any unit.
fn shared_unit<'e>(
    values: impl Iterator<Item = &'e Expr>,
    unit: impl Fn(&Expr) -> Option<Unit>,
) -> Option<Unit> {
    let has_any = |value: &Expr| match value {
        Expr::Value(value) => match &value.value {
            Value::Null => true,
            Value::Number(number, _) => number.parse() == Ok(0.0),
            _ => false,
        },
        _ => false,
    };
    let mut units = values.filter(|value| !has_any(value)).map(unit);
    units.next()?.filter(|first| units.all(|unit| unit.as_ref() == Some(first)))
}

impl Unit {
    /// Returns the unit of a quotient. Two units of one dimension, such as µm and mm, have none.
    fn over(&self, below: &Unit) -> Option<Unit> {
        let is_conversion = self.declared == below.declared && self != below;
        (!is_conversion).then(|| Unit {
            declared: quotient(&self.declared, &below.declared),
            named: quotient(&self.named, &below.named),
        })
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
        let in_unit = |unit: &str| {
            let table = Table::empty(&[real("side", "length"), real("pressure", "pressure")]);
            let named = |declared: &str| match declared {
                "length" => unit.to_owned(),
                _ => "MPa".to_owned(),
            };
            table.with_named_units(named).batch().schema()
        };
        let tables = [
            ("contact".to_owned(), contact.batch().schema()),
            ("fine".to_owned(), in_unit("µm")),
            ("coarse".to_owned(), in_unit("mm")),
        ];
        let found = origins(query, &tables).unwrap();
        let unit = |(name, origin): (&String, &Origin)| {
            let unit = origin.unit.as_ref().map(|unit| unit.declared.as_str());
            format!("{name}: {}", unit.unwrap_or("-"))
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
    fn columns_in_different_units_are_not_combined() {
        for (query, expected) in [
            ("select side from fine union all select side from coarse", "side: -"),
            ("select side from fine union all select side from fine", "side: length"),
            (
                "select f.side - c.side as a, f.side / c.side as b, f.side + f.side as c, \
                 f.side / f.side as d, f.pressure / c.pressure as e, c.pressure / f.side as f, \
                 coalesce(f.side, c.side) as g, max(f.side) - max(c.side) as h \
                 from fine f, coarse c",
                "a: -, b: -, c: length, d: 1, e: 1, f: pressure/length, g: -, h: -",
            ),
        ] {
            assert_eq!(units(query), expected, "{query}");
        }
    }

    #[test]
    fn choices_between_values_of_one_unit_have_it() {
        let text = "select case when area > 0 then pressure end as a, \
                    case when area > 0 then pressure else 2 * pressure end as b, \
                    case area when 0 then mean_gap when 1 then -mean_gap else 0 end as c, \
                    case when area > 0 then pressure else mean_gap end as d, \
                    coalesce(pressure, 0.0) as e, coalesce(pressure, 1) as f from contact";
        assert_eq!(units(text), "a: pressure, b: -, c: length, d: -, e: pressure, f: -");
    }

    #[test]
    fn casts_to_real_numbers_alone_keep_the_unit() {
        let text = "select cast(mean_gap as double) as a, cast(mean_gap as int) as b, \
                    mean_gap::float as c, cast(pressure as varchar) as d from contact";
        assert_eq!(units(text), "a: length, b: -, c: length, d: -");
    }

    #[test]
    fn wildcards_may_replace_and_rename_columns() {
        let replaced = "select * replace (1000 * mean_gap as mean_gap, -load as load) from contact";
        let expected = "area: 1, load: E* × rms slope, mean_gap: -, pressure: pressure";
        assert_eq!(units(replaced), expected);
        let renamed = "select c.* rename (mean_gap as pressure, pressure as p) from contact c";
        let expected = "area: 1, load: E* × rms slope, p: pressure, pressure: length";
        assert_eq!(units(renamed), expected);
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
