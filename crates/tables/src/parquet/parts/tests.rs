use std::io::{Read, Seek, Write};

use super::super::{Columns, GROUP, Metadata, decode_bytes, encode, write_parts};
use super::*;
use crate::column::{Column, ColumnKind, flags, integers, optional_reals, optional_texts, reals};

/// More rows than one row group has.
const ROWS: usize = 150_000;

const KINDS: [(&str, ColumnKind); 5] = [
    ("count", ColumnKind::Integer),
    ("area", ColumnKind::Real),
    ("gap", ColumnKind::Real),
    ("stop", ColumnKind::Text),
    ("percolates", ColumnKind::Flag),
];

fn table(rows: usize) -> Table {
    let number = |row: usize| row as f64;
    let gap = |row: usize| (!row.is_multiple_of(7)).then_some(number(row % 1000));
    let stop = |row: usize| (!row.is_multiple_of(5)).then(|| format!("word {}", row % 3));
    let arrays = [
        integers((0..rows).map(|_| 3)),
        reals((0..rows).map(|row| number(row).sqrt())),
        optional_reals((0..rows).map(gap)),
        optional_texts((0..rows).map(stop)),
        flags((0..rows).map(|row| row % 2 == 0)),
    ];
    let column = |(name, kind)| Column::result(name, kind, "1", name);
    Table::new(rows, KINDS.map(column).into_iter().zip(arrays).collect())
}

fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    file
}

fn bytes(table: &Table) -> Vec<u8> {
    encode(table, &Metadata::default())
}

fn open(table: &Table) -> TableFile {
    TableFile::open(file(&bytes(table))).unwrap()
}

#[test]
fn parts_are_those_of_the_whole() {
    let whole = table(ROWS);
    let file = open(&whole);
    assert_eq!(file.rows(), ROWS);
    assert_eq!(file.groups(), 3);
    for (columns, rows) in
        [(vec![3, 0], 5), (vec![2], ROWS), (vec![4, 1], (1 << 16) + 1), (vec![], 7), (vec![1], 0)]
    {
        let part = file.first(&columns, rows).unwrap();
        assert_eq!(part, whole.project(&columns).slice(0..rows), "{columns:?}, {rows}");
    }
    let groups = (0..3).map(|group| file.group(&[2, 3], group).unwrap());
    let stacked = Table::stack(&groups.collect::<Vec<_>>()).unwrap();
    assert_eq!(stacked, whole.project(&[2, 3]));
}

#[test]
fn a_table_that_is_written_in_parts_has_the_bytes_of_the_whole() {
    for rows in [0, 10, GROUP, GROUP + 1, ROWS] {
        let whole = table(rows);
        let starts = (0..rows.max(1)).step_by(GROUP);
        let parts = starts.map(|start| whole.slice(start..rows.min(start + GROUP)));
        let mut file = tempfile::tempfile().unwrap();
        write_parts(&mut file, rows, &Metadata::default(), parts).unwrap();
        let mut written = Vec::new();
        file.rewind().unwrap();
        file.read_to_end(&mut written).unwrap();
        assert!(written == bytes(&whole), "{rows} rows");
    }
}

#[test]
fn a_flipped_bit_anywhere_is_found_with_one_chunk_in_memory_after_the_other() {
    let whole = bytes(&table(100));
    let verified = |bytes: &[u8]| TableFile::open(file(bytes)).and_then(TableFile::verified);
    assert!(verified(&whole).is_ok());
    for position in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[position] ^= 1 << (position % 8);
        let found = verified(&flipped);
        assert!(matches!(found, Err(ParquetError::Digest)), "{position}");
    }
}

#[test]
fn a_table_without_rows_has_parts_without_rows() {
    let none = table(0);
    assert_eq!(open(&none).first(&[0, 3], 10).unwrap(), none.project(&[0, 3]));
}

/// Tables of results were digested as a whole once.
#[test]
fn a_file_with_one_digest_is_read_in_parts_too() {
    let whole = table(10);
    let key = crate::store::key::TaskKey::of("test", 1, crate::store::key::Digest::of(&()), &[]);
    let metadata = Metadata { key: Some(key), entries: Vec::new() };
    let file = TableFile::open(file(&encode(&whole, &metadata))).unwrap();
    assert_eq!(file.metadata(), &metadata);
    assert_eq!(file.first(&[1, 3], 4).unwrap(), whole.project(&[1, 3]).slice(0..4));
}

#[test]
fn damage_is_found_in_the_column_that_has_it_and_read_around() {
    let whole = table(ROWS);
    let sound = bytes(&whole);
    let opened = open(&whole);
    let Source::File(_, digests) = &opened.bytes else {
        panic!("results are digested by column chunk");
    };
    // The second row group of `area`.
    let chunk = digests.ranges[KINDS.len() + 1].clone();
    let mut flipped = sound;
    flipped[chunk.start + chunk.len() / 2] ^= 8;
    let damaged = TableFile::open(file(&flipped)).unwrap();
    assert_eq!(damaged.first(&[0, 2, 3, 4], ROWS).unwrap(), whole.project(&[0, 2, 3, 4]));
    assert_eq!(damaged.first(&[1], 100).unwrap(), whole.project(&[1]).slice(0..100));
    let found = damaged.first(&[1], ROWS);
    assert!(matches!(found, Err(ParquetError::Digest)), "{found:?}");
    let whole = decode_bytes(flipped.into(), Columns::All);
    assert!(matches!(whole, Err(ParquetError::Digest)));
}

#[test]
fn a_damaged_end_is_found_on_opening() {
    let sound = bytes(&table(100));
    let chunks_end = {
        let file = TableFile::open(file(&sound)).unwrap();
        let Source::File(_, digests) = &file.bytes else {
            panic!("results are digested by column chunk");
        };
        digests.ranges.last().unwrap().end
    };
    for position in chunks_end..sound.len() {
        let mut flipped = sound.clone();
        flipped[position] ^= 1 << (position % 8);
        let opened = TableFile::open(file(&flipped)).map(|_| ());
        assert!(matches!(opened, Err(ParquetError::Digest)), "{position}");
    }
    for length in 0..sound.len() {
        let cut = TableFile::open(file(&sound[..length])).map(|_| ());
        assert!(matches!(cut, Err(ParquetError::Digest)), "{length}");
    }
}

/// As many columns as no first read of the end of a file has room for.
#[test]
fn a_long_footer_is_read_to_its_beginning() {
    let names: Vec<&'static str> =
        (0..700).map(|number| &*Box::leak(format!("column {number}").into_boxed_str())).collect();
    let column = |name| Column::result(name, ColumnKind::Real, "1", "one of very many columns");
    let values = (0..2000).map(f64::from).collect::<Vec<_>>();
    let columns = names.iter().map(|name| (column(name), reals(values.clone())));
    let wide = Table::new(2000, columns.collect());
    assert!(bytes(&wide).len() > END);
    assert_eq!(open(&wide).first(&[699], 2000).unwrap(), wide.project(&[699]));
}

#[test]
fn a_column_is_constant_if_no_row_differs() {
    let value =
        |rows: usize, odd: f64| (0..rows).map(move |row| if row == 70_000 { odd } else { 1.0 });
    let constant = |odd: f64| {
        let area = Column::result("area", ColumnKind::Real, "1", "area");
        open(&Table::new(ROWS, vec![(area, reals(value(ROWS, odd)))])).is_constant(0)
    };
    assert_eq!(constant(2.0), Some(false));
    // The smallest and the largest value do not tell.
    assert_eq!(constant(f64::NAN), None);
    assert_eq!(constant(1.0), None);
    let file = open(&table(ROWS));
    assert_eq!(file.is_constant(0), Some(true));
    assert_eq!(file.is_constant(1), Some(false));
}
