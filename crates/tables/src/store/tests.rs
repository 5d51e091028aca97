//! Tables come back as they were stored, or not at all.

use std::fs;

use super::*;
use crate::column::{Column, ColumnKind, reals};

const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

fn provenance(recipe: &str) -> Provenance {
    Provenance {
        stage: "test".to_owned(),
        version: 1,
        recipe: recipe.to_owned(),
        inputs: vec![],
        input_identities: vec![],
    }
}

/// A store with one table in it.
fn fixture() -> (tempfile::TempDir, Store, TaskKey, Table) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(&folder.path().join("store")).unwrap();
    let made = provenance("{}");
    let table = Table::new(2, vec![(AREA, reals([0.25, 0.5]))]);
    assert!(!store.has(made.key()));
    store.publish(&made, &table).unwrap();
    (folder, store, made.key(), table)
}

fn is_damaged(store: &Store, key: TaskKey) -> bool {
    let read = store.read(key, Columns::All);
    matches!(read, Err(StoreError::Damaged { .. }))
}

#[test]
fn a_published_table_is_read_back() {
    let (_folder, store, key, table) = fixture();
    assert!(store.has(key));
    assert_eq!(store.read(key, Columns::All).unwrap(), table);
}

#[test]
fn many_keys_looked_for_at_once_are_those_looked_for_one_by_one() {
    let (_folder, store, key, _) = fixture();
    let shares_its_folder = |number: u32| {
        let other = provenance(&number.to_string()).key();
        (other.first_byte() == key.first_byte()).then_some(other)
    };
    let absent: Vec<TaskKey> = (0..20_000).filter_map(shares_its_folder).collect();
    assert!(absent.len() > 30, "enough for the folder to be listed");
    let keys = [&absent[..9], &[key], &absent[9..]].concat();
    let one_by_one: Vec<bool> = keys.iter().map(|&key| store.has(key)).collect();
    assert_eq!(store.have(&keys), one_by_one);
    assert_eq!(store.have(&absent), vec![false; absent.len()]);
    assert!(store.have(&keys)[9]);
}

#[test]
fn a_published_table_is_never_rewritten() {
    let (_folder, store, key, table) = fixture();
    let other = Table::new(1, vec![(AREA, reals([9.0]))]);
    store.publish(&provenance("{}"), &other).unwrap();
    assert_eq!(store.read(key, Columns::All).unwrap(), table);
}

#[test]
fn publishing_leaves_nothing_else_behind() {
    let (_folder, store, key, table) = fixture();
    store.publish(&provenance("{}"), &table).unwrap();
    let folder = store.path(key).parent().unwrap().to_owned();
    assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
    assert_eq!(fs::read_dir(store.workshop()).unwrap().count(), 0);
}

#[test]
fn a_truncated_an_empty_and_a_foreign_file_are_damaged() {
    let (_folder, store, key, table) = fixture();
    let path = store.path(key);
    let whole = fs::read(&path).unwrap();
    for length in [0, 1, whole.len() / 2, whole.len() - 7] {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(is_damaged(&store, key), "{length} bytes");
    }
    let other = provenance("[]");
    store.publish(&other, &table).unwrap();
    fs::write(store.path(other.key()), &whole).unwrap();
    assert!(is_damaged(&store, other.key()));
}

#[test]
fn a_table_under_a_key_that_does_not_follow_from_its_recipe_is_damaged() {
    let (_folder, store, key, table) = fixture();
    let mut metadata = provenance("another recipe").metadata();
    metadata.key = Some(key);
    fs::write(store.path(key), parquet::encode(&table, &metadata)).unwrap();
    assert!(is_damaged(&store, key));
}

#[test]
fn every_flipped_bit_is_found() {
    let (_folder, store, key, _) = fixture();
    let path = store.path(key);
    let whole = fs::read(&path).unwrap();
    for position in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[position] ^= 1 << (position % 8);
        fs::write(&path, &flipped).unwrap();
        assert!(is_damaged(&store, key), "byte {position}");
    }
}

#[test]
fn a_quarantined_file_makes_room_for_a_sound_one() {
    let (_folder, store, key, table) = fixture();
    for number in ["", "-2"] {
        fs::write(store.path(key), "not a table").unwrap();
        let quarantined = store.quarantine(key).unwrap().unwrap();
        let name = format!("{key}.parquet.damaged{number}");
        assert_eq!(quarantined.file_name().unwrap().to_str(), Some(name.as_str()));
        assert_eq!(fs::read(quarantined).unwrap(), b"not a table");
        assert!(!store.has(key));
        store.publish(&provenance("{}"), &table).unwrap();
    }
    assert_eq!(store.read(key, Columns::All).unwrap(), table);
}

#[test]
fn a_sound_file_is_not_quarantined() {
    let (_folder, store, key, table) = fixture();
    assert_eq!(store.quarantine(key).unwrap(), None);
    assert_eq!(store.read(key, Columns::All).unwrap(), table);
}

#[test]
fn a_folder_in_place_of_a_table_is_an_error() {
    let (_folder, store, _, table) = fixture();
    let other = provenance("[]");
    fs::create_dir_all(store.path(other.key())).unwrap();
    assert!(store.publish(&other, &table).is_err());
}

#[test]
fn equal_tables_give_equal_bytes() {
    let (_folder, _store, _key, table) = fixture();
    let metadata = provenance("{}").metadata();
    assert_eq!(parquet::encode(&table, &metadata), parquet::encode(&table, &metadata));
}
