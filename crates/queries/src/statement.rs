//! Analysis of a query before polars executes it: the tables that it reads, and limits on its size
//! and depth.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use sqlparser::ast::{
    BinaryOperator, CastKind, DataType as SqlType, Expr, Function, FunctionArguments, Ident,
    ObjectName, Query, Select, SelectItem, Statement as Parsed, TableFactor, Value, ValueWithSpan,
    Visit, VisitMut, Visitor, VisitorMut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::{Parser, ParserError, ParserOptions};

use super::functions::{INTEGER, QUOTIENT, REMAINDER, ROUND};
use crate::QueryError;

/// Maximum length of a query in bytes. The syntax tree of any such query fits on the stack.
const MAX_LENGTH: usize = 64 << 10;

/// Maximum nesting depth of operations, and maximum number of `select`s, in a query. The run time
/// of polars grows at least with the square of the depth, and the stack by about 80 kB for each
/// level.
const MAX_DEPTH: usize = 500;

/// Parsed query.
#[derive(Debug)]
pub struct Statement {
    /// The query with functions that polars computes rightly.
    pub query: Query,
    /// Tables that the query reads.
    pub tables: BTreeSet<String>,
    /// Tables that the query defines by `with`.
    pub defines: BTreeSet<String>,
    /// Names of tables by their aliases in the query.
    pub aliases: BTreeMap<String, String>,
}

impl Statement {
    /// Parses and checks a query.
    ///
    /// # Errors
    /// Returns an error if the text is not a query, or if it is too long or too deep.
    pub fn read(query: &str) -> Result<Statement, QueryError> {
        if query.len() > MAX_LENGTH {
            return Err(QueryError::Refused(format!(
                "the query has {} bytes; the limit is {MAX_LENGTH}",
                query.len()
            )));
        }
        let mut reader = Reader::default();
        let mut query = parsed(query)?;
        if let ControlFlow::Break(reason) = Visit::visit(&query, &mut reader) {
            return Err(QueryError::Refused(reason));
        }
        if let ControlFlow::Break(error) = VisitMut::visit(&mut query, &mut Dialect) {
            return Err(error);
        }
        let tables = reader.named.difference(&reader.defines);
        Ok(Statement {
            query,
            tables: tables.cloned().collect(),
            defines: reader.defines,
            aliases: reader.aliases,
        })
    }
}

/// Parses a query.
pub fn parsed(query: &str) -> Result<Query, QueryError> {
    // Use the same options as polars.
    let options = ParserOptions::new().with_trailing_commas(true);
    let parser = Parser::new(&GenericDialect {}).with_options(options);
    let read = parser.try_with_sql(query).and_then(|mut parser| parser.parse_statements());
    let mut statements = read.map_err(|error| QueryError::Refused(message(error)))?;
    let refused = |reason: String| Err(QueryError::Refused(reason));
    match (statements.pop(), statements.len()) {
        (None, _) => refused("there is no query".to_owned()),
        (Some(Parsed::Query(query)), 0) => Ok(*query),
        (Some(_), 0) => {
            let first = query.split_whitespace().next().unwrap_or_default();
            refused(format!("a query starts with `select` or `with`, not with `{first}`"))
        }
        (Some(_), more) => refused(format!("there are {} queries instead of one", more + 1)),
    }
}

fn message(error: ParserError) -> String {
    match error {
        ParserError::RecursionLimitExceeded => {
            "the query nests too many parentheses or queries; compute parts of it in `with NAME as \
             (select …)`"
                .to_owned()
        }
        ParserError::TokenizerError(reason) | ParserError::ParserError(reason) => {
            if reason.contains("found: -") {
                format!("{reason}; put a name with `-` in double quotes, like \"mean-gap\"")
            } else {
                reason
            }
        }
    }
}

/// Visitor that collects the fields of a [`Statement`] and stops if a query is too deep.
#[derive(Default)]
struct Reader {
    named: BTreeSet<String>,
    defines: BTreeSet<String>,
    aliases: BTreeMap<String, String>,
    depth: usize,
    selects: usize,
}

impl Visitor for Reader {
    type Break = String;

    fn pre_visit_query(&mut self, query: &Query) -> ControlFlow<String> {
        let defined = query.with.iter().flat_map(|with| &with.cte_tables);
        self.defines.extend(defined.map(|table| table.alias.name.value.clone()));
        ControlFlow::Continue(())
    }

    fn pre_visit_select(&mut self, _: &Select) -> ControlFlow<String> {
        self.selects += 1;
        if self.selects > MAX_DEPTH {
            let message = format!("the query contains `select` more than {MAX_DEPTH} times");
            return ControlFlow::Break(message);
        }
        ControlFlow::Continue(())
    }

    fn pre_visit_relation(&mut self, relation: &ObjectName) -> ControlFlow<String> {
        self.named.extend(name_of(relation));
        ControlFlow::Continue(())
    }

    fn pre_visit_table_factor(&mut self, table: &TableFactor) -> ControlFlow<String> {
        if let TableFactor::Table { name, alias, .. } = table
            && let (Some(name), Some(alias)) = (name_of(name), alias)
        {
            self.aliases.insert(alias.name.value.clone(), name);
        }
        ControlFlow::Continue(())
    }

    fn pre_visit_expr(&mut self, expression: &Expr) -> ControlFlow<String> {
        self.depth += levels(expression);
        if self.depth <= MAX_DEPTH {
            return ControlFlow::Continue(());
        }
        ControlFlow::Break(format!(
            "the query nests more than {MAX_DEPTH} operations, as a sum of so many terms does; \
             compute parts of it in `with NAME as (select …)`"
        ))
    }

    fn post_visit_expr(&mut self, expression: &Expr) -> ControlFlow<String> {
        self.depth -= levels(expression);
        ControlFlow::Continue(())
    }
}

/// Returns the number of nesting levels that an expression adds. A `case` adds one for each
/// condition, because each condition contains the following ones.
fn levels(expression: &Expr) -> usize {
    match expression {
        Expr::Case { conditions, .. } => conditions.len(),
        _ => 1,
    }
}

/// Returns the name of a table or function without the names before it.
pub fn name_of(relation: &ObjectName) -> Option<String> {
    let name = relation.0.last()?.as_ident()?;
    Some(name.value.clone())
}

/// Returns the name of the column of an expression without `as`.
pub fn column_name(expression: &Expr) -> String {
    match expression {
        Expr::Identifier(name) => name.value.clone(),
        Expr::CompoundIdentifier(parts) => {
            parts.last().map_or_else(String::new, |name| name.value.clone())
        }
        other => other.to_string(),
    }
}

/// Visitor that names the columns of a query, and replaces functions that polars computes otherwise
/// than most SQL databases.
struct Dialect;

impl VisitorMut for Dialect {
    type Break = QueryError;

    fn pre_visit_select(&mut self, select: &mut Select) -> ControlFlow<QueryError> {
        let mut names = BTreeSet::new();
        for item in &mut select.projection {
            let name = match item {
                SelectItem::UnnamedExpr(expression) => {
                    let name = column_name(expression);
                    if !matches!(expression, Expr::Identifier(_) | Expr::CompoundIdentifier(_)) {
                        let alias = Ident::with_quote('"', &name);
                        *item = SelectItem::ExprWithAlias { expr: expression.clone(), alias };
                    }
                    name
                }
                SelectItem::ExprWithAlias { alias, .. } => alias.value.clone(),
                _ => continue,
            };
            if !names.insert(name.clone()) {
                return ControlFlow::Break(QueryError::Refused(format!(
                    "two columns of the answer are named `{name}`; give one of them another name: \
                     `{item} as other`"
                )));
            }
        }
        ControlFlow::Continue(())
    }

    fn post_visit_expr(&mut self, expression: &mut Expr) -> ControlFlow<QueryError> {
        if let Expr::InList { list, .. } = expression
            && list.iter().any(|item| item.to_string().contains('.'))
        {
            list.iter_mut().for_each(make_real);
        }
        match replaced(expression) {
            Ok(None) => ControlFlow::Continue(()),
            Ok(Some(other)) => {
                *expression = other;
                ControlFlow::Continue(())
            }
            Err(error) => ControlFlow::Break(error),
        }
    }

    /// Adds a decimal point to numbers with an exponent: `1e-3` becomes `1.0e-3`, because polars
    /// reads numbers without a point as integers.
    fn pre_visit_value(&mut self, value: &mut ValueWithSpan) -> ControlFlow<QueryError> {
        if let Value::Number(number, _) = &mut value.value {
            *number = with_point(number);
        }
        ControlFlow::Continue(())
    }
}

/// Adds a decimal point to a number with an exponent that has none.
pub fn with_point(number: &str) -> String {
    match number.find(['e', 'E']) {
        Some(exponent) if !number.contains('.') => {
            format!("{}.0{}", &number[..exponent], &number[exponent..])
        }
        _ => number.to_owned(),
    }
}

/// Adds decimals to an integer, because polars refuses lists of integers and real numbers.
fn make_real(literal: &mut Expr) {
    match literal {
        Expr::UnaryOp { expr, .. } => make_real(expr),
        Expr::Value(ValueWithSpan { value: Value::Number(number, _), .. })
            if !number.contains('.') =>
        {
            number.push_str(".0");
        }
        _ => {}
    }
}

/// Returns the expression that takes the place of one that polars computes otherwise.
fn replaced(expression: &Expr) -> Result<Option<Expr>, QueryError> {
    let text = match expression {
        Expr::BinaryOp { left, op: BinaryOperator::Modulo, right } => {
            format!("{REMAINDER}({left}, {right})")
        }
        Expr::BinaryOp { left, op: BinaryOperator::DuckIntegerDivide, right } => {
            format!("{QUOTIENT}({left}, {right})")
        }
        Expr::Cast { kind: CastKind::Cast | CastKind::DoubleColon, expr, data_type, .. }
            if is_integer(data_type) =>
        {
            format!("{INTEGER}({expr})")
        }
        Expr::Position { expr, r#in } => position(&r#in.to_string(), &expr.to_string()),
        // Polars returns null where the condition is null.
        Expr::IsTrue(condition) => format!("coalesce({condition}, false)"),
        Expr::IsNotTrue(condition) => format!("not coalesce({condition}, false)"),
        Expr::IsFalse(condition) => format!("not coalesce({condition}, true)"),
        Expr::IsNotFalse(condition) => format!("coalesce({condition}, true)"),
        Expr::Function(function) => match replaced_call(function)? {
            Some(text) => text,
            None => return Ok(None),
        },
        _ => return Ok(None),
    };
    Ok(Some(parsed_expression(&text)?))
}

fn parsed_expression(text: &str) -> Result<Expr, QueryError> {
    parsed_part(text, Parser::parse_expr)
}

/// Returns the table of this name, as `from` names it.
pub fn parsed_table(name: &str) -> Result<TableFactor, QueryError> {
    parsed_part(&Ident::with_quote('"', name).to_string(), Parser::parse_table_factor)
}

fn parsed_part<T>(
    text: &str,
    parse: impl Fn(&mut Parser<'static>) -> Result<T, ParserError>,
) -> Result<T, QueryError> {
    let parser = Parser::new(&GenericDialect {}).try_with_sql(text);
    let part = parser.and_then(|mut parser| parse(&mut parser));
    part.map_err(|error| QueryError::Refused(message(error)))
}

fn is_integer(kind: &SqlType) -> bool {
    let name = kind.to_string().to_lowercase();
    ["int", "bigint", "smallint", "tinyint"].iter().any(|integer| name.starts_with(integer))
        && !name.starts_with("interval")
}

/// Functions that compute one value from all rows of a group.
const AGGREGATES: &str = "\
    avg corr count covar covar_pop covar_samp first group_concat last listagg max median min \
    quantile_cont quantile_disc stddev stddev_samp stdev stdev_samp string_agg sum total var \
    var_samp variance";

/// Returns whether a function computes one value from all rows of a group.
pub fn is_aggregate(name: &str) -> bool {
    AGGREGATES.split(' ').any(|known| known == name)
}

/// Functions of numbers, conditions and texts.
const SCALARS: &str = "\
    abs acos acosd asin asind atan atan2 atan2d atand bit_and bit_length bit_not bit_or bit_xor \
    cbrt ceil ceiling char_length character_length coalesce concat concat_ws cos cosd cot cotd \
    degrees div ends_with exp floor greatest if ifnull least left length ln log10 log1p log2 lower \
    lpad ltrim mod nullif octet_length pi pow power radians regexp_like replace reverse right \
    round rpad rtrim sign sin sind split_part sqrt starts_with strpos substr tan tand trunc \
    truncate upper";

/// Functions that are computed by others, and functions with `over`.
const OTHERS: &str = "\
    bool_and bool_or every mean percentile_cont percentile_disc stddev_pop var_pop cume_dist \
    dense_rank first_value lag last_value lead nth_value ntile percent_rank rank row_number";

/// Returns the text that takes the place of a call, if polars computes the call otherwise.
fn replaced_call(call: &Function) -> Result<Option<String>, QueryError> {
    let name = call.name.to_string().to_lowercase();
    let FunctionArguments::List(list) = &call.args else {
        return Ok(None);
    };
    let arguments: Vec<String> = list.args.iter().map(ToString::to_string).collect();
    let renamed = |name: &str| {
        let name = ObjectName::from(vec![Ident::new(name)]);
        Ok(Some(Function { name, ..call.clone() }.to_string()))
    };
    let filter =
        call.filter.as_ref().map_or(String::new(), |filter| format!(" filter (where {filter})"));
    let is_plain = call.over.is_none() && list.duplicate_treatment.is_none();
    match (name.as_str(), arguments.as_slice()) {
        ("mod", [a, b]) => Ok(Some(format!("{REMAINDER}({a}, {b})"))),
        ("div", [a, b]) => Ok(Some(format!("{QUOTIENT}({a}, {b})"))),
        ("round", [value]) => Ok(Some(format!("{ROUND}({value}, 0)"))),
        ("round", [value, digits]) if digits.parse::<i8>().is_ok() => {
            Ok(Some(format!("{ROUND}({value}, {digits})")))
        }
        ("var_pop" | "stddev_pop", [value]) if is_plain => {
            let function = if name == "var_pop" { "" } else { "sqrt" };
            Ok(Some(format!("{function}({})", covariance("covar_pop", 1, value, value, &filter))))
        }
        ("covar_pop", [a, b]) if is_plain => Ok(Some(covariance("covar_pop", 1, a, b, &filter))),
        ("covar_samp" | "covar", [a, b]) if is_plain => {
            Ok(Some(covariance("covar_samp", 2, a, b, &filter)))
        }
        // Polars returns integers, and has none for negative exponents.
        ("pow" | "power", [base, exponent]) => {
            Ok(Some(format!("pow(cast({base} as double), cast({exponent} as double))")))
        }
        ("strpos", [text, part]) => Ok(Some(position(text, part))),
        ("bool_and" | "every", _) => renamed("min"),
        ("bool_or", _) => renamed("max"),
        ("mean", _) => renamed("avg"),
        ("percentile_cont" | "percentile_disc", [share]) => percentile(call, &name, share, &filter),
        ("log", _) => Err(QueryError::Refused(format!(
            "`{call}` has another meaning in each database: write `ln(x)`, `log10(x)`, `log2(x)` or \
             `ln(x) / ln(base)`"
        ))),
        ("__round" | "__integer" | "__remainder" | "__quotient", _) => Ok(None),
        _ if call.within_group.is_empty() && is_known(&name) => Ok(None),
        _ if is_known(&name) => {
            Err(QueryError::Refused(format!("`{call}` is not supported with `within group`")))
        }
        _ => Err(QueryError::Unknown {
            message: format!("there is no function `{name}`"),
            name,
            known: functions().map(str::to_owned).collect(),
        }),
    }
}

/// Returns the covariance of two columns, which is null if there are fewer pairs of values than
/// `least`. Polars then returns zero.
fn covariance(function: &str, least: usize, a: &str, b: &str, filter: &str) -> String {
    let pairs = format!("count(case when ({a}) is not null and ({b}) is not null then 1 end)");
    format!("case when {pairs}{filter} >= {least} then {function}({a}, {b}){filter} end")
}

/// Returns the position of a text in another one. Polars returns zero for nulls.
fn position(text: &str, part: &str) -> String {
    format!("case when ({text}) is not null then strpos({text}, {part}) end")
}

fn functions() -> impl Iterator<Item = &'static str> {
    [SCALARS, OTHERS, AGGREGATES].into_iter().flat_map(|names| names.split(' '))
}

fn is_known(name: &str) -> bool {
    functions().any(|known| known == name)
}

/// Returns the quantile that `percentile_cont(share) within group (order by value)` is.
fn percentile(
    call: &Function,
    name: &str,
    share: &str,
    filter: &str,
) -> Result<Option<String>, QueryError> {
    let parsed = share.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    let ([order], Some(share), None) = (call.within_group.as_slice(), parsed, &call.over) else {
        return Err(QueryError::Refused(format!(
            "`{call}` is not supported; write `{name}(0.5) within group (order by value)`"
        )));
    };
    let quantile = if name == "percentile_cont" { "quantile_cont" } else { "quantile_disc" };
    let share = if order.options.asc == Some(false) { 1.0 - share } else { share };
    Ok(Some(format!("{quantile}({}, {share:?}){filter}", order.expr)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::on_query_thread;

    fn read(query: &str) -> Statement {
        on_query_thread(|| Statement::read(query)).unwrap()
    }

    fn refused(query: &str) -> String {
        on_query_thread(|| Statement::read(query)).unwrap_err().to_string()
    }

    #[test]
    fn tables_are_found_in_all_parts_of_a_query() {
        let statement = read(
            "with few as (select * from area a where load in (select load from \"light-load\")) \
             select f.area_fraction from few as f join law using (hurst)",
        );
        let tables: Vec<&str> = statement.tables.iter().map(String::as_str).collect();
        assert_eq!(tables, ["area", "law", "light-load"]);
        assert_eq!(statement.aliases["a"], "area");
        assert_eq!(statement.aliases["f"], "few");
    }

    #[test]
    fn depth_is_counted_along_one_branch() {
        let sum = |terms: usize| vec!["a"; terms].join("+");
        let half = sum(MAX_DEPTH / 2);
        read(&format!("select {half} as b, {half} as c, {half} as d from t"));
        read(&format!("select {} from t", sum(MAX_DEPTH)));
        assert!(refused(&format!("select {} from t", sum(MAX_DEPTH + 1))).contains("operations"));
        let cases = |cases: usize| format!("select case {} end", "when a then b ".repeat(cases));
        read(&cases(MAX_DEPTH - 1));
        assert!(refused(&cases(MAX_DEPTH + 1)).contains("operations"));
        let parts = vec!["select a from t"; MAX_DEPTH + 1].join(" union all ");
        assert!(refused(&parts).contains("`select` more than"));
    }

    #[test]
    fn no_query_overflows_the_stack() {
        let longest = |unit: &str| unit.repeat((MAX_LENGTH - 100) / unit.len());
        for query in [
            format!("select a{}", longest("+a")),
            format!("select a{}", longest("::int")),
            format!("select {}1", longest("- ")),
            format!("select {}a", longest("(")),
            format!("select case {} end", longest("when a then b ")),
            format!("select 1 {}", longest("union select 1 ")),
            format!("values (1) {}", longest("union values (1) ")),
            format!("select 1 from {}a", longest("(select 1 from ")),
            "+".repeat(MAX_LENGTH + 1),
        ] {
            let read = on_query_thread(|| Statement::read(&query));
            assert!(read.is_err() || query.starts_with("values"), "{}", &query[..40]);
        }
    }

    #[test]
    fn texts_that_are_not_queries_are_refused() {
        assert!(refused("drop table light").contains("not with `drop`"));
        assert!(refused("select 1; select 2").contains("2 queries"));
        assert!(refused(" ").contains("no query"));
        assert!(refused("select 1 +").contains("Expected"));
        assert!(refused("select a from mean-gap").contains("double quotes"));
    }
}
