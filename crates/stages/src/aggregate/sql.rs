//! Any query over the tables of a study.

pub mod engine;
mod statement;

pub use engine::silence_panics;

use std::collections::{BTreeMap, BTreeSet};

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Metadata, Schema, SchemaRef};
use bytesize::ByteSize;
use polars::prelude::{DataFrame, PolarsError};
use polars::sql::SQLContext;

use statement::Statement;

use super::frame::{self, Damage};
use super::{Meaning, Sql};
use crate::StageError;
use asperity_tables::column::{Role, described};
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// The answer to a query; `tables` are those of the input stages, one stage after the other.
///
/// # Errors
/// As [`ask`].
pub fn query(tables: &[Table], sql: &Sql, room: ByteSize) -> Result<Table, StageError> {
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
    ask(&sql.query, read, &names, &sql.columns, room)
}

/// The answer to a query of these tables; `names` are those of all that there are, and `meanings`
/// what columns of the answer mean that no table has.
///
/// Of the tables, the columns are read that the query needs. Groups come in the order of their
/// first rows, joined rows in that of the left table, and rows that sort alike as they were; the
/// last digits do not depend on how many cores there are.
///
/// # Errors
/// When the query does not parse, names what does not exist, answers with other than numbers, truth
/// values and text, or takes more memory than `room`; when a table is damaged.
pub fn ask(
    query: &str,
    tables: Vec<(String, TableSource)>,
    names: &[String],
    meanings: &BTreeMap<String, Meaning>,
    room: ByteSize,
) -> Result<Table, StageError> {
    let schemas: Vec<SchemaRef> = tables.iter().map(|(_, table)| table.schema()).collect();
    let answer = engine::apart(|| answer(query, tables, names, room))?;
    let columns = frame::columns(&answer)?;
    let field = |(name, array): &(String, ArrayRef)| {
        let field = Field::new(name, array.data_type().clone(), true);
        let metadata = meaning(&field, meanings, &schemas);
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
    engine::apart(|| Ok(Statement::read(query)?.tables))
}

fn answer(
    query: &str,
    tables: Vec<(String, TableSource)>,
    names: &[String],
    room: ByteSize,
) -> Result<DataFrame, StageError> {
    let statement = Statement::read(query)?;
    check_names(&statement, names)?;
    let columns: Vec<(String, Vec<String>)> =
        tables.iter().map(|(name, table)| (name.clone(), table.names())).collect();
    let damage = Damage::default();
    let mut context = SQLContext::new();
    for (name, table) in tables {
        context.register(&name, frame::lazy(table, &damage)?);
    }
    let answer = context.execute(&statement.text);
    let answer = answer.and_then(|frame| engine::collected(frame, room));
    answer.map_err(|error| match damage.take() {
        Some(error) => StageError::Store(error),
        None => QueryError::of_polars(&error, &statement, &columns).into(),
    })
}

/// Every table is there, and means what it says: polars would pass over one that `with` makes
/// under the name of another.
fn check_names(statement: &Statement, names: &[String]) -> Result<(), QueryError> {
    let known = || names.iter().map(String::as_str);
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
fn meaning(field: &Field, meanings: &BTreeMap<String, Meaning>, tables: &[SchemaRef]) -> Metadata {
    if let Some(Meaning { unit, meaning }) = meanings.get(field.name()) {
        return described(Role::Result, unit, meaning);
    }
    let read = tables.iter().find_map(|schema| {
        let read = schema.field_with_name(field.name()).ok()?;
        (read.data_type() == field.data_type()).then(|| read.metadata().clone())
    });
    read.unwrap_or_else(|| described(Role::Result, "", "as the query computes it"))
}

/// Why a query has no answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// It is no query, or asks for what cannot be done.
    #[error("{0}")]
    Refused(String),
    /// It names a table or a column that is not there.
    #[error("{message}")]
    Unknown {
        message: String,
        name: String,
        /// Names that would do.
        known: Vec<String>,
    },
}

impl QueryError {
    /// A table that is not among those that can be asked.
    pub fn no_table<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> QueryError {
        QueryError::Unknown {
            message: format!("there is no table `{name}`"),
            name: name.to_owned(),
            known: known.into_iter().map(str::to_owned).collect(),
        }
    }

    /// What polars says, told of the tables that the query names.
    fn of_polars(
        error: &PolarsError,
        statement: &Statement,
        tables: &[(String, Vec<String>)],
    ) -> QueryError {
        let text = error.to_string();
        let reason = text.lines().map(str::trim).find(|line| !line.is_empty());
        let reason = reason.unwrap_or("polars gives no reason");
        unknown_of_a_table(reason, statement, tables)
            .or_else(|| unknown_anywhere(reason))
            .unwrap_or_else(|| QueryError::Refused(shortened(reason)))
    }
}

/// Polars prints whole syntax trees of what it does not know.
fn shortened(reason: &str) -> String {
    const LONGEST: usize = 200;
    match reason.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &reason[..end]),
        None => reason.to_owned(),
    }
}

/// `no column named 'laod' found in table 'a'`.
fn unknown_of_a_table(
    reason: &str,
    statement: &Statement,
    tables: &[(String, Vec<String>)],
) -> Option<QueryError> {
    let (name, rest) = quoted_after("no column named ", reason)?;
    let (alias, _) = quoted_after("found in table ", rest)?;
    let alias = alias.trim_matches('"');
    let table = statement.aliases.get(alias).map_or(alias, String::as_str);
    let table = tables.iter().find(|(known, _)| known == table);
    let known = table.map_or_else(Vec::new, |(_, columns)| columns.clone());
    Some(QueryError::Unknown {
        message: format!("`{alias}` has no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// `unable to find column "laod"; valid columns: ["load", "area", "load:other"]`, where the last
/// one is polars' own name for a column that two joined tables have.
fn unknown_anywhere(reason: &str) -> Option<QueryError> {
    let (name, mut rest) = quoted_after("unable to find column ", reason)?;
    let mut known = Vec::new();
    while let Some((column, after)) = quoted(rest) {
        known.push(column.to_owned());
        rest = after;
    }
    known.retain(|column| !column.contains(':'));
    Some(QueryError::Unknown {
        message: format!("there is no column `{name}`"),
        name: name.to_owned(),
        known,
    })
}

/// What stands in quotes after some words, and what follows.
fn quoted_after<'a>(words: &str, text: &'a str) -> Option<(&'a str, &'a str)> {
    let (_, rest) = text.split_once(words)?;
    quoted(rest)
}

/// What stands in the next quotes, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let start = text.find(['\'', '"'])?;
    let quote = text[start..].chars().next()?;
    text[start + 1..].split_once(quote)
}

#[cfg(test)]
mod tests {
    use super::*;
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
        };
        query(&[table(0..3), table(3..500), table(0..4)], &sql, ByteSize::mb(1))
    }

    #[test]
    fn a_query_sees_each_stage_as_one_table() {
        let answer = ask("select count(*) as n from light").unwrap();
        assert_eq!(answer.integers("n").unwrap().values(), &[500]);
    }

    #[test]
    fn a_query_that_takes_more_memory_than_there_is_is_refused_with_what_it_takes() {
        let cross = "select l.point, r.area from light l cross join light r";
        let told = chain(&ask(cross).unwrap_err());
        let expected = "it puts 250000 rows of 2 columns together, 4.0 MB of memory where 1.0 MB may \
                        be taken: select rows and columns first, join by equal columns, or allow more";
        assert!(told.ends_with(expected), "{told}");
        let keyed = |rows: i64, key: i64| {
            let keys = integers((0..rows).map(|row| row % key));
            Table::new(rows as usize, vec![(POINT, keys)])
        };
        let joined = |key: i64| {
            let sql = Sql {
                query: "select l.point from light l join heavy r using (point)".to_owned(),
                tables: vec![("light".to_owned(), 1), ("heavy".to_owned(), 1)],
                columns: BTreeMap::new(),
            };
            query(&[keyed(500, key), keyed(1000, key)], &sql, ByteSize::mb(1))
        };
        assert_eq!(joined(500).unwrap().rows(), 1000);
        let told = chain(&joined(1).unwrap_err());
        assert!(told.contains("it puts 501000 rows of 1 column together"), "{told}");
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
    fn rows_that_sort_alike_keep_their_order() {
        let text = "select point from light order by point % 2";
        let answer = ask(text).unwrap();
        let expected: Vec<i64> = (0..500).step_by(2).chain((1..500).step_by(2)).collect();
        assert_eq!(answer.integers("point").unwrap().values(), &expected[..]);
    }

    #[test]
    fn rows_that_sort_alike_keep_their_order_under_a_limit_too() {
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
    fn equal_questions_have_equal_answers_to_the_last_bit() {
        for text in [
            // Any other order of the groups adds their means up to another last digit.
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
    fn hundreds_of_terms_are_added_and_thousands_refused() {
        let sum = |terms: usize| {
            let terms = vec!["area"; terms].join(" + ");
            ask(&format!("select {terms} as total from heavy"))
        };
        let total = sum(300).unwrap().reals("total").unwrap().value(1);
        assert!((total - 30.0).abs() < 1e-12, "{total}");
        let refused = sum(3000).unwrap_err();
        assert!(chain(&refused).contains("within one another"), "{refused:?}");
    }

    #[test]
    fn numbers_may_have_an_exponent() {
        let answer = ask("select 1e-3 as a, 25E1 as b, '1e-3' as c from heavy").unwrap();
        assert_eq!(answer.reals("a").unwrap().value(0), 1e-3);
        assert_eq!(answer.reals("b").unwrap().value(0), 250.0);
        assert_eq!(answer.texts("c").unwrap().value(0), "1e-3");
    }

    #[test]
    fn what_polars_cannot_do_is_an_error_even_where_it_panics() {
        for text in [
            "select rank() over (order by area) as r from light",
            "select area, row_number() over (partition by area order by point) as r from light \
             group by area, point",
        ] {
            let error = ask(text).unwrap_err();
            assert!(matches!(error, StageError::Query(_)), "{error:?}");
        }
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
            (message.to_owned(), known.iter().map(|name| name.to_string()).collect())
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
}
