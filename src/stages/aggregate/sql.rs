//! Any query over the tables of a study.

use std::collections::BTreeSet;
use std::sync::Arc;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Metadata, Schema};
use polars::prelude::{DataFrame, DslPlan, IntoLazy, LazyFrame, UniqueKeepStrategy};
use polars::sql::SQLContext;

use super::super::StageError;
use super::{Meaning, Sql, frame};
use crate::store::column::{Role, described};
use crate::store::table::Table;

mod refusal;
mod statement;

pub use refusal::QueryError;
use statement::Statement;

/// The answer to a query; `tables` are those of the input stages, one stage after the other.
///
/// # Errors
/// When the query does not parse, names what does not exist, or answers with other than numbers,
/// truth values and text.
pub fn query(tables: &[Table], sql: &Sql) -> Result<Table, StageError> {
    let answer = answer(tables, sql)?;
    let columns = frame::columns(&answer)?;
    let field = |(name, array): &(String, ArrayRef)| {
        let field = Field::new(name, array.data_type().clone(), true);
        let metadata = meaning(&field, sql, tables);
        field.with_metadata(metadata)
    };
    let fields: Vec<Field> = columns.iter().map(field).collect();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    Ok(Table::of(answer.height(), Schema::new(fields), arrays))
}

/// The tables that a query reads, without those that it makes itself.
///
/// # Errors
/// When the query does not parse.
pub fn tables_of(query: &str) -> Result<BTreeSet<String>, QueryError> {
    Ok(Statement::read(query)?.tables)
}

fn answer(tables: &[Table], sql: &Sql) -> Result<DataFrame, StageError> {
    let statement = Statement::read(&sql.query)?;
    check_names(&statement, sql)?;
    let mut read = Vec::new();
    let mut rest = tables;
    for (name, count) in &sql.tables {
        let (own, others) = rest.split_at(*count);
        rest = others;
        if statement.tables.contains(name) {
            read.push((name.as_str(), Table::stack(own)?));
        }
    }
    let mut context = SQLContext::new();
    for (name, table) in &read {
        context.register(name, frame::of(table)?.lazy());
    }
    let answer = context.execute(&statement.text);
    let answer = answer.and_then(|frame| LazyFrame::from(ordered(frame.logical_plan)).collect());
    Ok(answer.map_err(|error| QueryError::of_polars(&error, &statement, &read))?)
}

/// Every table is there, and means what it says: polars would pass over one that `with` makes
/// under the name of another.
fn check_names(statement: &Statement, sql: &Sql) -> Result<(), QueryError> {
    let known = || sql.tables.iter().map(|(name, _)| name.as_str());
    let is_known = |name: &&String| known().any(|known| known == *name);
    if let Some(hidden) = statement.makes.iter().find(is_known) {
        return Err(QueryError::Refused(format!(
            "`with {hidden}` has the name of a stage; any other name would do"
        )));
    }
    match statement.tables.iter().find(|name| !is_known(name)) {
        Some(name) => Err(QueryError::no_table(name, known())),
        None => Ok(()),
    }
}

/// What a column of an answer means: what the manifest says of it, or else what it means in the
/// tables that the query reads.
fn meaning(field: &Field, sql: &Sql, tables: &[Table]) -> Metadata {
    if let Some(Meaning { unit, meaning }) = sql.columns.get(field.name()) {
        return described(Role::Result, unit, meaning);
    }
    let read = tables.iter().find_map(|table| {
        let schema = table.batch().schema_ref();
        let read = schema.field_with_name(field.name()).ok()?;
        (read.data_type() == field.data_type()).then(|| read.metadata().clone())
    });
    read.unwrap_or_else(|| described(Role::Result, "", "as the query computes it"))
}

/// The same query with every row order settled by the order of the input.
///
/// SQL leaves the order of groups, and of rows that sort alike, to the engine, and this engine
/// decides it by random hashes: the same study would give other bytes on each run.
fn ordered(plan: DslPlan) -> DslPlan {
    let inner = |input: Arc<DslPlan>| Arc::new(ordered(Arc::unwrap_or_clone(input)));
    match plan {
        DslPlan::GroupBy {
            input,
            keys,
            predicates,
            aggs,
            apply,
            options,
            ..
        } => DslPlan::GroupBy {
            input: inner(input),
            keys,
            predicates,
            aggs,
            apply,
            options,
            maintain_order: true,
        },
        DslPlan::Distinct { input, mut options } => {
            options.maintain_order = true;
            if options.keep_strategy == UniqueKeepStrategy::Any {
                options.keep_strategy = UniqueKeepStrategy::First;
            }
            let input = inner(input);
            DslPlan::Distinct { input, options }
        }
        DslPlan::Sort {
            input,
            by_column,
            slice,
            mut sort_options,
        } => {
            sort_options.maintain_order = true;
            let input = inner(input);
            DslPlan::Sort {
                input,
                by_column,
                slice,
                sort_options,
            }
        }
        DslPlan::Select {
            expr,
            input,
            options,
        } => {
            let input = inner(input);
            DslPlan::Select {
                expr,
                input,
                options,
            }
        }
        DslPlan::Filter { input, predicate } => {
            let input = inner(input);
            DslPlan::Filter { input, predicate }
        }
        DslPlan::HStack {
            input,
            exprs,
            options,
        } => {
            let input = inner(input);
            DslPlan::HStack {
                input,
                exprs,
                options,
            }
        }
        DslPlan::Slice { input, offset, len } => {
            let input = inner(input);
            DslPlan::Slice { input, offset, len }
        }
        DslPlan::MapFunction { input, function } => {
            let input = inner(input);
            DslPlan::MapFunction { input, function }
        }
        DslPlan::Join {
            input_left,
            input_right,
            left_on,
            right_on,
            predicates,
            options,
        } => DslPlan::Join {
            input_left: inner(input_left),
            input_right: inner(input_right),
            left_on,
            right_on,
            predicates,
            options,
        },
        DslPlan::Union { inputs, args } => {
            let inputs = inputs.into_iter().map(ordered).collect();
            DslPlan::Union { inputs, args }
        }
        DslPlan::IR { dsl, .. } => ordered(Arc::unwrap_or_clone(dsl)),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::chain;
    use crate::store::column::{Column, ColumnKind, integers, reals};

    const POINT: Column = Column::coordinate("point", ColumnKind::Integer, "", "point");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    const TOTAL: Meaning = Meaning {
        unit: String::new(),
        meaning: String::new(),
    };

    fn table(points: std::ops::Range<i64>) -> Table {
        let areas: Vec<f64> = points.clone().map(|point| point as f64 / 10.0).collect();
        let rows = areas.len();
        Table::new(rows, vec![(POINT, integers(points)), (AREA, reals(areas))])
    }

    fn ask(query_text: &str) -> Result<Table, StageError> {
        let sql = Sql {
            query: query_text.to_owned(),
            tables: vec![("light".to_owned(), 2), ("heavy".to_owned(), 1)],
            columns: [("total".to_owned(), TOTAL)].into(),
        };
        query(&[table(0..3), table(3..500), table(0..4)], &sql)
    }

    #[test]
    fn a_query_sees_each_stage_as_one_table() {
        let answer = ask("select count(*) as n from light").unwrap();
        assert_eq!(answer.integers("n").unwrap().values(), &[500]);
    }

    #[test]
    fn stages_can_be_joined() {
        let text =
            "select l.point, l.area + h.area as total from light l join heavy h using (point)";
        let answer = ask(text).unwrap();
        assert_eq!(
            answer.reals("total").unwrap().values(),
            &[0.0, 0.2, 0.4, 0.6]
        );
    }

    #[test]
    fn groups_come_in_the_order_of_their_first_rows() {
        let text = "select point % 250 as p, sum(area) as a from light group by point % 250";
        let answer = ask(text).unwrap();
        let expected: Vec<i64> = (0..250).collect();
        assert_eq!(answer.integers("p").unwrap().values(), &expected[..]);
    }

    #[test]
    fn rows_that_sort_alike_keep_their_order() {
        let text = "select point from light order by point % 2";
        let answer = ask(text).unwrap();
        let expected: Vec<i64> = (0..500).step_by(2).chain((1..500).step_by(2)).collect();
        assert_eq!(answer.integers("point").unwrap().values(), &expected[..]);
    }

    #[test]
    fn thousands_of_terms_are_refused() {
        let terms = vec!["area"; 3000].join(" + ");
        let refused = ask(&format!("select {terms} as total from heavy")).unwrap_err();
        assert!(
            chain(&refused).contains("within one another"),
            "{refused:?}"
        );
    }

    #[test]
    fn numbers_may_have_an_exponent() {
        let answer = ask("select 1e-3 as a, 25E1 as b, '1e-3' as c from heavy").unwrap();
        assert_eq!(answer.reals("a").unwrap().value(0), 1e-3);
        assert_eq!(answer.reals("b").unwrap().value(0), 250.0);
        assert_eq!(answer.texts("c").unwrap().value(0), "1e-3");
    }

    fn unknown(query: &str) -> (String, Vec<String>) {
        match ask(query).unwrap_err() {
            StageError::Query(QueryError::Unknown { message, known, .. }) => (message, known),
            other => panic!("{query}: {other:?}"),
        }
    }

    #[test]
    fn a_name_that_is_not_there_is_told_with_those_that_are_in_its_place() {
        let told = |message: &str, known: &[&str]| {
            (
                message.to_owned(),
                known.iter().map(|name| name.to_string()).collect(),
            )
        };
        assert_eq!(
            unknown("select a.pint from light a, (select 1 as one) b"),
            told("`a` has no column `pint`", &["point", "area"])
        );
        assert_eq!(
            unknown("select pint from light join heavy using (point)"),
            told("there is no column `pint`", &["point", "area"])
        );
        assert_eq!(
            unknown("select area from (select point as p from light) where area > 1"),
            told("there is no column `area`", &["p"])
        );
        assert_eq!(
            unknown("select * from lihgt"),
            told("there is no table `lihgt`", &["light", "heavy"])
        );
    }

    #[test]
    fn no_stage_hides_behind_a_table_of_the_query() {
        let count =
            "with few as (select * from light where point < 7) select count(*) as n from few";
        assert_eq!(ask(count).unwrap().integers("n").unwrap().values(), &[7]);
        let error = ask(&count.replace("few", "heavy")).unwrap_err();
        assert!(chain(&error).contains("`with heavy` has the name of a stage"));
    }

    #[test]
    fn a_query_cannot_reach_files() {
        assert!(ask("select * from read_parquet('/etc/passwd')").is_err());
        assert!(ask("select * from read_csv('/etc/passwd')").is_err());
    }

    #[test]
    fn only_queries_are_carried_out() {
        for text in ["drop table light", "selec 1", "", "truncate table light"] {
            assert!(ask(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_wrong_query_is_an_error_with_a_reason() {
        let error = ask("select nothing from light").unwrap_err();
        assert!(chain(&error).contains("nothing"), "{error}");
    }
}
