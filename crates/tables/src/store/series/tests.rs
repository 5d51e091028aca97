//! Tests of rows that are stored in several files.

use super::*;
use crate::column::{Column, ColumnKind, reals};
use crate::key::Digest;
use crate::parquet::Columns;
use crate::store::provenance::Provenance;
use crate::store::{Store, StoreError, verify};

const LOAD: Column = Column::result("load", ColumnKind::Real, "1", "load");
const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");
const FLOW: Column = Column::result("flow", ColumnKind::Real, "1", "flow");

fn provenance() -> Provenance {
    Provenance {
        stage: "test".to_owned(),
        version: 1,
        recipe: "{}".to_owned(),
        inputs: vec![],
        input_identities: vec![],
    }
}

fn flow() -> Part {
    Part { name: "flow".to_owned(), columns: vec!["flow"], is_heavy: false }
}

fn table(values: &[f64], with_flow: &[f64]) -> TableRef {
    let parts = vec![PartRows { part: flow(), values: with_flow.to_vec() }];
    let parts = if with_flow.is_empty() { vec![] } else { parts };
    let series = SeriesRows { column: "load", values: values.to_vec(), parts };
    TableRef { key: provenance().key(), series: Some(series.into()) }
}

/// Stores rows whose area is twice the load. The row of the load 0.5 is there twice.
fn publish(store: &Store, values: &[f64]) {
    let rows = values.iter().flat_map(|value| vec![*value; 1 + usize::from(*value == 0.5)]);
    let rows: Vec<f64> = rows.collect();
    let areas = rows.iter().map(|value| 2.0 * value);
    let table =
        Table::new(rows.len(), vec![(LOAD, reals(rows.iter().copied())), (AREA, reals(areas))]);
    store.publish_rows(&provenance(), "load", values, None, &table).unwrap();
}

fn publish_flow(store: &Store, values: &[f64]) {
    let flows = values.iter().map(|value| 3.0 * value);
    let table =
        Table::new(values.len(), vec![(LOAD, reals(values.iter().copied())), (FLOW, reals(flows))]);
    store.publish_rows(&provenance(), "load", values, Some(&flow()), &table).unwrap();
}

fn store() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("store")).unwrap();
    (folder, store)
}

#[test]
fn rows_of_several_files_equal_those_of_one_file() {
    let all = [0.1, 0.2, 0.3, 0.5, 0.7];
    let (_one, whole) = store();
    publish(&whole, &all);
    let (_other, parts) = store();
    publish(&parts, &[0.2, 0.5]);
    publish(&parts, &[0.1, 0.3, 0.5]);
    assert!(!parts.has(&table(&all, &[])));
    assert_eq!(parts.missing_rows(&table(&all, &[])).unwrap().values, [0.7]);
    publish(&parts, &[0.7]);
    for wanted in [&all[..], &[0.1, 0.5], &[0.3, 0.7], &[0.5]] {
        let wanted = table(wanted, &[]);
        assert!(parts.has(&wanted) && whole.has(&wanted));
        let [one, other] = [&whole, &parts].map(|store| store.read(&wanted, Columns::All).unwrap());
        assert_eq!(one, other);
    }
}

#[test]
fn parts_are_null_in_rows_that_are_not_requested_with_them() {
    let (_folder, store) = store();
    let wanted = table(&[0.1, 0.2, 0.3], &[0.1, 0.3]);
    publish(&store, &[0.1, 0.2, 0.3]);
    publish_flow(&store, &[0.1]);
    let missing = store.missing_rows(&wanted).unwrap();
    assert_eq!((missing.values.len(), &missing.parts[..]), (0, &[vec![0.3]][..]));
    publish_flow(&store, &[0.3]);
    let read = store.read(&wanted, Columns::All).unwrap();
    assert_eq!(read.names(), ["load", "area", "flow"]);
    let flows: Vec<_> = read.reals("flow").unwrap().iter().collect();
    assert_eq!(flows, [Some(3.0 * 0.1), None, Some(3.0 * 0.3)]);
    let all = store.read_with_provenance(provenance().key()).unwrap().0;
    assert_eq!(all, read);
    let without = store.read(&wanted.with_parts(|_| false), Columns::All).unwrap();
    assert_eq!(without.names(), ["load", "area"]);
}

#[test]
fn a_file_whose_name_does_not_follow_from_its_rows_is_damaged() {
    let (_folder, store) = store();
    publish(&store, &[0.1, 0.2]);
    let [name] = &store.files_of(provenance().key()).unwrap()[..] else { panic!("one file") };
    assert!(verify(&store.path_of(name), name).is_ok());
    let rows = Some(RowsName::new(None, &[0.1]));
    let other = FileName { key: name.key, rows };
    std::fs::rename(store.path_of(name), store.path_of(&other)).unwrap();
    assert!(matches!(verify(&store.path_of(&other), &other), Err(StoreError::Damaged { .. })));
    assert!(!store.has(&table(&[0.2], &[])));
    assert!(store.read(&table(&[0.1], &[]), Columns::All).is_err());
}

#[test]
fn names_of_files_are_parsed() {
    let key = TaskKey::new("test", 1, Digest::from_params(&()), &[]);
    let rows = |part: Option<&str>| Some(RowsName::new(part, &[0.1]));
    for rows in [None, rows(None), rows(Some("flow"))] {
        let name = FileName { key, rows };
        assert_eq!(name.to_string().parse(), Ok(name));
    }
    for word in ["", "table.parquet", "a-b.parquet", ".parquet"] {
        assert_eq!(word.parse::<FileName>(), Err(()), "{word}");
    }
}

#[test]
fn a_reference_is_restricted_to_rows_and_parts() {
    let whole = table(&[0.1, 0.2, 0.3], &[0.2, 0.3]);
    assert_eq!(whole.restricted(&[0.1, 0.2]), table(&[0.1, 0.2], &[0.2]));
    assert_eq!(whole.with_parts(|_| false), table(&[0.1, 0.2, 0.3], &[]));
    let table_alone = TableRef::from(whole.key);
    assert_eq!(table_alone.restricted(&[0.1]), table_alone);
}
