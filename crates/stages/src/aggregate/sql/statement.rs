//! Analysis of a query before polars executes it: the tables that it reads, and limits on its size
//! and depth.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use sqlparser::ast::{
    Expr, Function, GroupByExpr, ObjectName, Query, Select, SelectItem, Statement as Parsed,
    TableFactor, Visit, Visitor,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::{Parser, ParserError, ParserOptions};
use sqlparser::tokenizer::{Token, Tokenizer};

use super::QueryError;

/// Maximum length of a query in bytes. The syntax tree of any such query fits on the stack.
const MAX_LENGTH: usize = 64 << 10;

/// Maximum nesting depth of operations, and maximum number of `select`s, in a query. The run time
/// of polars grows at least with the square of the depth, and the stack by about 80 kB for each
/// level.
const MAX_DEPTH: usize = 500;

/// Query that polars can execute.
#[derive(Debug, Default)]
pub struct Statement {
    /// Text of the query, adapted to the parser of polars.
    pub text: String,
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
        if let ControlFlow::Break(reason) = parsed(query)?.visit(&mut reader) {
            return Err(QueryError::Refused(reason));
        }
        let tables = reader.named.difference(&reader.defines);
        Ok(Statement {
            text: with_points(query)?,
            tables: tables.cloned().collect(),
            defines: reader.defines,
            aliases: reader.aliases,
        })
    }
}

fn parsed(query: &str) -> Result<Parsed, QueryError> {
    // Use the same options as polars.
    let options = ParserOptions::new().with_trailing_commas(true);
    let parser = Parser::new(&GenericDialect {}).with_options(options);
    let statements = parser.try_with_sql(query).and_then(|mut parser| parser.parse_statements());
    let mut statements = statements.map_err(|error| QueryError::Refused(message(error)))?;
    let refused = |reason: String| Err(QueryError::Refused(reason));
    match (statements.pop(), statements.len()) {
        (None, _) => refused("there is no query".to_owned()),
        (Some(query @ Parsed::Query(_)), 0) => Ok(query),
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

    fn pre_visit_select(&mut self, select: &Select) -> ControlFlow<String> {
        self.selects += 1;
        if self.selects > MAX_DEPTH {
            let message = format!("the query contains `select` more than {MAX_DEPTH} times");
            return ControlFlow::Break(message);
        }
        match ungrouped(select) {
            Some(reason) => ControlFlow::Break(reason),
            None => ControlFlow::Continue(()),
        }
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

fn name_of(relation: &ObjectName) -> Option<String> {
    let name = relation.0.last()?.as_ident()?;
    Some(name.value.clone())
}

/// Adds a decimal point to numbers with an exponent: `1e-3` becomes `1.0e-3`, because polars reads
/// numbers without a point as integers.
fn with_points(query: &str) -> Result<String, QueryError> {
    let tokens = Tokenizer::new(&GenericDialect {}, query).with_unescape(false).tokenize();
    let tokens = tokens.map_err(|error| QueryError::Refused(message(error.into())))?;
    let with_point = |token: Token| {
        let mut text = token.to_string();
        if matches!(token, Token::Number(..))
            && !text.contains('.')
            && let Some(exponent) = text.find(['e', 'E'])
        {
            text.insert_str(exponent, ".0");
        }
        text
    };
    Ok(tokens.into_iter().map(with_point).collect())
}

/// Functions of polars that compute one value from all rows.
const AGGREGATES: &str = "\
    array_agg avg corr count covar covar_pop covar_samp first group_concat last listagg max median \
    min quantile_cont quantile_disc stddev stddev_samp stdev stdev_samp string_agg sum total var \
    var_samp variance";

/// Returns the error message for a `select` without `group by` that mixes columns and aggregates.
/// This is invalid in SQL, but polars would repeat the aggregate in every row.
fn ungrouped(select: &Select) -> Option<String> {
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
    Some(if bare == "*" {
        format!("`*` cannot be combined with `{aggregate}`: list the columns and add a `group by`")
    } else {
        format!(
            "`{bare}` cannot be combined with `{aggregate}`, because it is neither aggregated nor \
             in `group by`: write `group by {bare}` for one row per value, or `first({bare})`"
        )
    })
}

/// Visitor that finds the first column outside aggregates and the first aggregate.
#[derive(Default)]
struct Parts {
    bare: Option<String>,
    aggregate: Option<String>,
    /// Number of enclosing aggregates and subqueries.
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

/// Returns whether a function aggregates rows. With `over` it computes one value per row.
fn is_aggregate(function: &Function) -> bool {
    let name = function.name.to_string().to_lowercase();
    function.over.is_none() && AGGREGATES.split(' ').any(|known| known == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(query: &str) -> Statement {
        Statement::read(query).unwrap()
    }

    fn refused(query: &str) -> String {
        Statement::read(query).unwrap_err().to_string()
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
    fn numbers_with_an_exponent_get_a_point_and_nothing_else_changes() {
        let query = "-- 1e-3 is µ\nselect 'é 1e-3', 2E5, load1e5, -- 1e4\n 1.5e2 + 1e-3 from \"1e2\" -- 7e7";
        let pointed = query.replace("2E5", "2.0E5").replace("+ 1e-3", "+ 1.0e-3");
        assert_eq!(read(query).text, pointed);
    }

    #[test]
    fn a_column_with_an_aggregate_must_be_grouped() {
        for query in [
            "select load, avg(area) from t",
            "select avg(area) + load from t",
            "select *, count(*) from t",
            "select * from (select t.load, max(area) as most from t) as u",
        ] {
            assert!(refused(query).contains("`group by"), "{query}");
        }
        for query in [
            "select load, avg(area) from t group by load",
            "select avg(area), min(load + 1) from t",
            "select load, avg(area) over (partition by load) from t",
            "select load, (select avg(area) from t) as mean from t",
            "select 1, count(*) from t",
        ] {
            read(query);
        }
    }

    #[test]
    fn depth_is_counted_along_one_branch() {
        let sum = |terms: usize| vec!["a"; terms].join("+");
        let side_by_side = vec![sum(MAX_DEPTH / 2); 9].join(",");
        read(&format!("select {side_by_side} from t"));
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
            let read = crate::aggregate::sql::engine::on_query_thread(|| Statement::read(&query));
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
