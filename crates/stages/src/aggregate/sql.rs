//! SQL queries over the tables of a study.

use std::collections::BTreeMap;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Metadata, Schema, SchemaRef};
use bytesize::ByteSize;

use super::{Meaning, Sql};
use crate::StageError;
use asperity_queries::{Origin, answer, frame, origins, tables_of};
use asperity_tables::column::{Description, Role, described};
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// Answers the query of a stage. `tables` are the tables of its inputs, in the order of
/// `sql.tables`.
///
/// # Errors
/// Returns an error under the conditions of [`ask`].
pub fn query(tables: &[Table], sql: &Sql, memory: ByteSize) -> Result<Table, StageError> {
    let named = tables_of(&sql.query)?;
    let mut read = Vec::new();
    let mut rest = tables;
    for (name, count) in &sql.tables {
        let (own, others) = rest.split_at(*count);
        rest = others;
        if named.contains(name) {
            read.push((name.clone(), Table::stack(own)?.into()));
        }
    }
    let names: Vec<String> = sql.tables.iter().map(|(name, _)| name.clone()).collect();
    ask(&sql.query, read, &names, &sql.columns, memory)
}

/// Answers a query over tables. `names` are the names of all existing tables, and `meanings`
/// describes columns of the answer that no table has. Other columns have the units that follow from
/// the query. [`answer`] tells the order of the rows.
///
/// # Errors
/// Returns an error under the conditions of [`answer`], or if the answer holds anything but
/// numbers, flags and text.
pub fn ask(
    query: &str,
    tables: Vec<(String, TableSource)>,
    names: &[String],
    meanings: &BTreeMap<String, Meaning>,
    memory: ByteSize,
) -> Result<Table, StageError> {
    let schemas: Vec<(String, SchemaRef)> =
        tables.iter().map(|(name, table)| (name.clone(), table.schema())).collect();
    let answer = answer(query, tables, names, memory)?;
    let origins = origins(query, &schemas)?;
    let unknown = Origin::default();
    let columns = frame::columns(&answer)?;
    let field = |(name, array): &(String, ArrayRef)| {
        let field = Field::new(name, array.data_type().clone(), true);
        let metadata = match meanings.get(name) {
            Some(Meaning { unit, meaning }) => described(Role::Result, unit, meaning),
            None => inferred(&field, origins.get(name).unwrap_or(&unknown), &schemas),
        };
        field.with_metadata(metadata)
    };
    let fields: Vec<Field> = columns.iter().map(field).collect();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    Ok(Table::from_arrays(answer.height(), Schema::new(fields), arrays))
}

/// Returns the metadata of a column of an answer from the columns that it is computed from.
///
/// A computed column has the role and the meaning of a column of the same name and type in a table
/// that the query reads: a rounded load is still the load of a row.
fn inferred(field: &Field, origin: &Origin, tables: &[(String, SchemaRef)]) -> Metadata {
    let namesake = tables.iter().find_map(|(_, schema)| {
        let read = schema.field_with_name(field.name()).ok()?;
        Some((Role::from_field(read)?, read)).filter(|_| read.data_type() == field.data_type())
    });
    match namesake {
        Some((role, read)) if origin.is_computed() => {
            described(role, origin.unit(), &Description::from(read).meaning)
        }
        _ => origin.metadata(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aggregate::SQL_VERSION;
    use crate::error::QueryError;
    use arrow::array::AsArray;
    use asperity_manifest::diagnostics::chain;
    use asperity_tables::column::{Column, ColumnKind, integers, reals};

    const POINT: Column = Column::parameter("point", ColumnKind::Integer, "", "point");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    const TOTAL: Meaning = Meaning { unit: String::new(), meaning: String::new() };

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
            version: SQL_VERSION.number(),
        };
        query(&[table(0..3), table(3..500), table(0..4)], &sql, ByteSize::mb(1))
    }

    #[test]
    fn a_query_sees_each_stage_as_one_table() {
        let answer = ask("select count(*) as n from light").unwrap();
        assert_eq!(answer.integers("n").unwrap().values(), &[500]);
    }

    #[test]
    fn a_query_that_takes_too_much_memory_is_refused() {
        let cross = "select l.point, r.area from light l cross join light r";
        let message = chain(&ask(cross).unwrap_err());
        let expected = "it combines 250000 rows of 2 columns, which take 4.0 MB of memory (limit \
                        1.0 MB): select rows and columns first, join on equal columns, or raise \
                        the limit";
        assert!(message.ends_with(expected), "{message}");
        let keyed = |rows: i64, key: i64| {
            let keys = integers((0..rows).map(|row| row % key));
            Table::new(rows as usize, vec![(POINT, keys)])
        };
        let joined = |key: i64| {
            let sql = Sql {
                query: "select l.point from light l join heavy r using (point)".to_owned(),
                tables: vec![("light".to_owned(), 1), ("heavy".to_owned(), 1)],
                columns: BTreeMap::new(),
                version: SQL_VERSION.number(),
            };
            query(&[keyed(500, key), keyed(1000, key)], &sql, ByteSize::mb(1))
        };
        assert_eq!(joined(500).unwrap().rows(), 1000);
        let message = chain(&joined(1).unwrap_err());
        assert!(message.contains("it combines 501000 rows of 1 column"), "{message}");
        for fits in [
            format!("{cross} limit 10"),
            "select l.point, r.area from light l join light r using (point)".to_owned(),
            "select l.point, r.area from heavy l cross join light r".to_owned(),
        ] {
            ask(&fits).unwrap();
        }
    }

    #[test]
    fn stages_can_be_joined() {
        let text =
            "select l.point, l.area + h.area as total from light l join heavy h using (point)";
        let answer = ask(text).unwrap();
        assert_eq!(answer.reals("total").unwrap().values(), &[0.0, 0.2, 0.4, 0.6]);
    }

    #[test]
    fn groups_come_in_the_order_of_their_first_rows() {
        let text = "select point % 250 as p, sum(area) as a from light group by point % 250";
        let answer = ask(text).unwrap();
        let expected: Vec<i64> = (0..250).collect();
        assert_eq!(answer.integers("p").unwrap().values(), &expected[..]);
    }

    #[test]
    fn rows_that_compare_equal_keep_their_order() {
        let text = "select point from light order by point % 2";
        let answer = ask(text).unwrap();
        let expected: Vec<i64> = (0..500).step_by(2).chain((1..500).step_by(2)).collect();
        assert_eq!(answer.integers("point").unwrap().values(), &expected[..]);
    }

    #[test]
    fn rows_that_compare_equal_keep_their_order_under_a_limit() {
        let answer = ask("select point from light order by point % 2 limit 300").unwrap();
        let expected: Vec<i64> = (0..500).step_by(2).chain((1..100).step_by(2)).collect();
        assert_eq!(answer.integers("point").unwrap().values(), &expected[..]);
    }

    #[test]
    fn joined_rows_come_in_the_order_of_the_left_table() {
        let text =
            "select h.point as p, l.point as q from heavy h join light l on l.point % 4 = h.point";
        let answer = ask(text).unwrap();
        let left: Vec<i64> = (0..4).flat_map(|point| [point; 125]).collect();
        assert_eq!(answer.integers("p").unwrap().values(), &left[..]);
        let right: Vec<i64> = (0..4).flat_map(|point| (point..500).step_by(4)).collect();
        assert_eq!(answer.integers("q").unwrap().values(), &right[..]);
    }

    #[test]
    fn equal_queries_have_bitwise_equal_answers() {
        for text in [
            // The last digit of the mean of means depends on the order of the groups.
            "select avg(m) as a from (select avg(sqrt(area)) as m from light group by point % 97)",
            "select sum(sqrt(area)) as a from light where point % 7 > 1",
            "select l.area as a, h.area as b from light l full join heavy h on l.point = h.point + 495",
            "select distinct point % 97 as p from light",
            "select point % 97 as p from light union select point % 89 as p from light",
        ] {
            let first = ask(text).unwrap();
            for _ in 0..20 {
                assert_eq!(ask(text).unwrap().batch(), first.batch(), "{text}");
            }
        }
    }

    #[test]
    fn a_sum_may_have_hundreds_of_terms_but_not_thousands() {
        let sum = |terms: usize| {
            let terms = vec!["area"; terms].join(" + ");
            ask(&format!("select {terms} as total from heavy"))
        };
        let total = sum(300).unwrap().reals("total").unwrap().value(1);
        assert!((total - 30.0).abs() < 1e-12, "{total}");
        let refused = sum(3000).unwrap_err();
        assert!(chain(&refused).contains("nests more than"), "{refused:?}");
    }

    #[test]
    fn numbers_may_have_an_exponent() {
        let answer = ask("select 1e-3 as a, 25E1 as b, '1e-3' as c from heavy").unwrap();
        assert_eq!(answer.reals("a").unwrap().value(0), 1e-3);
        assert_eq!(answer.reals("b").unwrap().value(0), 250.0);
        assert_eq!(answer.texts("c").unwrap().value(0), "1e-3");
    }

    #[test]
    fn columns_without_a_name_have_that_of_their_expression() {
        let names = |text: &str| ask(text).unwrap().names().join(", ");
        assert_eq!(
            names("select min(point), max(point), count(*), point from light group by point"),
            "min(point), max(point), count(*), point"
        );
        assert_eq!(
            names("select round(l.area * 2, 1), l.area from light l"),
            "round(l.area * 2, 1), area"
        );
        let answer = ask("select max(point) from light").unwrap();
        assert_eq!(answer.descriptions()[0].meaning, "value computed by the query");
    }

    #[test]
    fn errors_say_what_to_write() {
        for (text, expected) in [
            ("select point, avg(area) from light", "write `group by point` for one row per value"),
            ("select *, count(*) from light", "list the columns and add a `group by`"),
            (
                "select point, area from light group by point",
                "add it to `group by`, or write `first",
            ),
            ("select area as a, point as a from light", "two columns of the answer are named `a`"),
            ("select stdev_pop(area) from light", "there is no function `stdev_pop`"),
            ("select sum(max(area)) from light", "compute the inner one in a subquery"),
            ("select sum(distinct area) from light", "(select distinct …)"),
            ("select log(2, area) from light", "`ln(x) / ln(base)`"),
            ("select * from light l right join heavy h using (point)", "`on a.load = b.load`"),
            (
                "select * from light l left join heavy h on l.point = h.point and h.area > 1",
                "put other conditions into a subquery",
            ),
            ("select * from light l join light l using (point)", "`l as other`"),
            (
                "select sum(area) over (order by area range between 1 preceding and current row) \
                 from light",
                "write `rows between …`",
            ),
            ("select ntile(0) over (order by point) from light", "needs a positive integer"),
            ("select nth_value(area, 0) over (order by point) from light", "a positive integer"),
            ("select lag(area, 1.5) over (order by point) from light", "needs a number of rows"),
            ("select lag(point, 1, 0.5) over (order by point) from light", "need an integer"),
            ("select quantile_cont(area, 50) over () from light", "a number from 0 to 1"),
            (
                "select row_number() filter (where area > 1) over (order by point) from light",
                "`row_number` with `filter` and `over` is not supported",
            ),
            ("select covar_pop(area, point) over () from light", "`covar_pop` with `over`"),
            ("select var_pop(distinct area) from light", "var_pop"),
            ("select * replace (1 as area), count(*) over () from light", "list all"),
            ("select count(*) from light group by rollup (point)", "is not supported"),
            (
                "select 1 as one from light l join heavy h on l.point < h.point \
                 full join light m on m.point = l.point",
                "join these tables in a subquery",
            ),
            (
                "select area from light where point = (select point from heavy)",
                "4 rows of 1 columns",
            ),
        ] {
            let message = chain(&ask(text).unwrap_err());
            assert!(message.contains(expected), "{text}\n{message}");
        }
    }

    #[test]
    fn nan_is_larger_than_all_numbers_in_windows() {
        let text = "select row_number() over (order by area / point) as place, \
                    max(area / point) over () > 1 as is_greatest from light where point < 3";
        let answer = ask(text).unwrap();
        // Row 0 has 0 / 0.
        assert_eq!(answer.integers("place").unwrap().values(), &[3, 1, 2]);
        let greatest = answer.batch().column(1).as_boolean().clone();
        assert!(greatest.iter().all(|greatest| greatest == Some(true)));
    }

    #[test]
    fn tables_that_are_used_twice_do_not_double_the_time() {
        let mut query = "with t0 as (select point, area from light)".to_owned();
        for level in 1..40 {
            let below = format!("t{}", level - 1);
            query += &format!(
                ", t{level} as (select a.point, b.area from {below} a join {below} b using (point))"
            );
        }
        let answer = ask(&format!("{query} select count(*) as n from t39")).unwrap();
        assert_eq!(answer.integers("n").unwrap().values(), &[500]);
    }

    #[test]
    fn joins_of_subqueries_are_counted() {
        let join = |key: &str| {
            format!(
                "with l as (select point % {key} as k, area from light where point >= 0) \
                 select a.area, b.area as other from l a join l b on a.k = b.k"
            )
        };
        assert_eq!(ask(&join("250")).unwrap().rows(), 1000);
        let message = chain(&ask(&join("2")).unwrap_err());
        assert!(message.contains("it combines 125500 rows of"), "{message}");
        let range = "select l.area, r.area as other from light l join light r on l.area < r.area";
        assert!(chain(&ask(range).unwrap_err()).contains("it combines 250000 rows"));
    }

    fn unknown(query: &str) -> (String, Vec<String>) {
        match ask(query).unwrap_err() {
            StageError::Query(QueryError::Unknown { message, known, .. }) => (message, known),
            other => panic!("{query}: {other:?}"),
        }
    }

    #[test]
    fn an_unknown_name_is_reported_with_the_known_names() {
        let expected = |message: &str, known: &[&str]| {
            (message.to_owned(), known.iter().map(|name| name.to_string()).collect())
        };
        assert_eq!(
            unknown("select a.pint from light a, (select 1 as one) b"),
            expected("`a` has no column `pint`", &["point", "area"])
        );
        assert_eq!(
            unknown("select pint from light join heavy using (point)"),
            expected("there is no column `pint`", &["point", "area"])
        );
        assert_eq!(
            unknown("select area from (select point as p from light) where area > 1"),
            expected("there is no column `area`", &["p"])
        );
        assert_eq!(
            unknown("select * from lihgt"),
            expected("there is no table `lihgt`", &["light", "heavy"])
        );
    }

    #[test]
    fn a_query_cannot_define_a_table_with_the_name_of_a_stage() {
        let count =
            "with few as (select * from light where point < 7) select count(*) as n from few";
        assert_eq!(ask(count).unwrap().integers("n").unwrap().values(), &[7]);
        let error = ask(&count.replace("few", "heavy")).unwrap_err();
        assert!(chain(&error).contains("`with heavy` uses the name of a stage"));
    }

    #[test]
    fn a_query_cannot_reach_files() {
        assert!(ask("select * from read_parquet('/etc/passwd')").is_err());
        assert!(ask("select * from read_csv('/etc/passwd')").is_err());
    }

    #[test]
    fn other_statements_are_refused() {
        for text in ["drop table light", "selec 1", "", "truncate table light"] {
            assert!(ask(text).is_err(), "{text}");
        }
    }
}
