//! The footer of a Parquet file, whose reading costs no more than a multiple of its length.
//!
//! A footer may be damaged, or made to break the program that reads it. Before the `parquet` crate
//! sees a footer, it is walked over: no list claims more than it holds ([`thrift`](super::thrift)),
//! and the tree of its columns is one. Version 60 of the crate makes room for as many columns as a
//! group states (a file of 42 bytes asks for 16 GiB, and the process ends where there is less), calls
//! itself for each level (10,000 levels overflow a stack of 8 MiB), and writes out the names of all
//! groups around a column (a file of 1 MB takes 10 GB).
//!
//! The constants are the structures of
//! [parquet.thrift](https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift),
//! field by field; enumerations are whole numbers, unions structures with one field. Fields that
//! the crate skips by their type alone need not be in them, and those that it reads must be.

use bytes::Bytes;
use parquet::errors::ParquetError as ReaderError;
use parquet::file::metadata::{FooterTail, ParquetMetaData, ParquetMetaDataReader};

use super::ParquetError;
use super::digest::{TAIL, footer_start};
use super::thrift::{Claim, MAX_DEPTH, Kind, Shape, Walk};

/// Bytes of names that are written out for each byte of a footer.
const NAME_BYTES_PER_FOOTER_BYTE: usize = 64;
/// What a name takes apart from its letters.
const NAME_OVERHEAD: usize = 32;

const UNKNOWN: Shape = Shape::Unknown;
const BOOL: Shape = Shape::Plain(Kind::Bool);
const BYTE: Shape = Shape::Plain(Kind::Byte);
const SHORT: Shape = Shape::Plain(Kind::Short);
const INT: Shape = Shape::Plain(Kind::Int);
const LONG: Shape = Shape::Plain(Kind::Long);
const DOUBLE: Shape = Shape::Plain(Kind::Double);
const BYTES: Shape = Shape::Plain(Kind::Bytes);
const INTS: Shape = Shape::List(&INT);
const LONGS: Shape = Shape::List(&LONG);
const TEXTS: Shape = Shape::List(&BYTES);
const EMPTY: Shape = Shape::Struct(&[]);

/// `FileMetaData`, the footer.
const FOOTER: &[Shape] =
    &[INT, SCHEMA, LONG, ROW_GROUPS, KEY_VALUES, BYTES, ORDERS, UNKNOWN, BYTES];
/// The tree of columns, from the root down, each group before what is in it.
const SCHEMA: Shape = Shape::List(&Shape::Struct(COLUMN));
/// `SchemaElement`, a column or a group of them.
const COLUMN: &[Shape] = &[INT, INT, INT, BYTES, INT, INT, INT, INT, INT, LOGICAL_TYPE];
const LOGICAL_TYPE: Shape = Shape::Struct(&[
    EMPTY, EMPTY, EMPTY, EMPTY, DECIMAL, EMPTY, TIME, TIME, UNKNOWN, INTEGER, EMPTY, EMPTY, EMPTY,
    EMPTY, EMPTY, VARIANT, GEOMETRY, GEOGRAPHY, EMPTY,
]);
const DECIMAL: Shape = Shape::Struct(&[INT, INT]);
const TIME: Shape = Shape::Struct(&[BOOL, Shape::Struct(&[EMPTY, EMPTY, EMPTY])]);
const INTEGER: Shape = Shape::Struct(&[BYTE, BOOL]);
const VARIANT: Shape = Shape::Struct(&[BYTE]);
const GEOMETRY: Shape = Shape::Struct(&[BYTES]);
const GEOGRAPHY: Shape = Shape::Struct(&[BYTES, INT]);

const ROW_GROUPS: Shape =
    Shape::List(&Shape::Struct(&[CHUNKS, LONG, LONG, SORTING, LONG, LONG, SHORT]));
const SORTING: Shape = Shape::List(&Shape::Struct(&[INT, BOOL, BOOL]));
const ORDERS: Shape = Shape::List(&Shape::Struct(&[EMPTY, EMPTY, EMPTY]));
const KEY_VALUES: Shape = Shape::List(&Shape::Struct(&[BYTES, BYTES]));

/// `ColumnChunk` and its `ColumnMetaData`.
const CHUNKS: Shape =
    Shape::List(&Shape::Struct(&[BYTES, LONG, CHUNK, LONG, INT, LONG, INT, UNKNOWN, BYTES]));
const CHUNK: Shape = Shape::Struct(&[
    INT, INTS, TEXTS, INT, LONG, LONG, LONG, KEY_VALUES, LONG, LONG, LONG, STATISTICS, ENCODINGS,
    LONG, INT, SIZES, GEOSPATIAL,
]);
const STATISTICS: Shape =
    Shape::Struct(&[BYTES, BYTES, LONG, LONG, BYTES, BYTES, BOOL, BOOL, LONG]);
const ENCODINGS: Shape = Shape::List(&Shape::Struct(&[INT, INT, INT]));
const SIZES: Shape = Shape::Struct(&[LONG, LONGS, LONGS]);
const GEOSPATIAL: Shape = Shape::Struct(&[Shape::Struct(&[DOUBLE; 8]), INTS]);

/// `PageHeader`, which stands before each page of a column.
pub const PAGE: &[Shape] = &[
    INT,
    INT,
    INT,
    INT,
    Shape::Struct(&[INT, INT, INT, INT, STATISTICS]),
    EMPTY,
    Shape::Struct(DICTIONARY),
    Shape::Struct(&[INT, INT, INT, INT, INT, INT, BOOL, STATISTICS]),
];
/// `DictionaryPageHeader`.
pub const DICTIONARY: &[Shape] = &[INT, INT, BOOL];

/// The footer of a file that ends with these bytes.
///
/// # Errors
/// When it is none, is not within these bytes, or claims what it does not hold.
pub fn read(end: &Bytes) -> Result<ParquetMetaData, ParquetError> {
    let tail = end.last_chunk::<TAIL>().ok_or(Claim::Bytes)?;
    if FooterTail::try_new(tail)?.is_encrypted_footer() {
        return Err(ReaderError::NYI("its footer is encrypted".to_owned()).into());
    }
    let start = footer_start(end).ok_or(Claim::Bytes)?;
    let footer = end.slice(start..end.len() - TAIL);
    check(&footer)?;
    Ok(ParquetMetaDataReader::decode_metadata(&footer)?)
}

/// Refuses a footer that takes its reader more than a time and a memory in proportion to its length.
fn check(bytes: &[u8]) -> Result<(), Claim> {
    let most = NAME_BYTES_PER_FOOTER_BYTE * bytes.len();
    Walk::new(bytes).fields(FOOTER, |walk, field, kind, shape| match field {
        2 => {
            let mut columns = Vec::new();
            walk.elements(Shape::Struct(COLUMN), |walk, _| {
                columns.push(Element::read(walk)?);
                Ok(())
            })?;
            check_tree(&columns, most)
        }
        _ => walk.pass(kind, shape),
    })
}

/// A column, or a group of `children`.
#[derive(Debug, Clone, Copy, Default)]
struct Element {
    /// Bytes of its name.
    name: usize,
    children: i64,
}

impl Element {
    fn read(walk: &mut Walk<'_>) -> Result<Element, Claim> {
        let mut element = Element::default();
        walk.fields(COLUMN, |walk, field, kind, shape| {
            match field {
                4 => element.name = walk.bytes()?.len(),
                5 => element.children = walk.number()?,
                _ => walk.pass(kind, shape)?,
            }
            Ok(())
        })?;
        Ok(element)
    }
}

/// Refuses columns whose groups claim more of them than there are, are too many within each other,
/// or whose names, written out with those of all groups around them, take more than `most` bytes.
fn check_tree(elements: &[Element], most: usize) -> Result<(), Claim> {
    // Of the groups that are not yet complete: what is missing of each, and the names down to it.
    let mut groups: Vec<(i64, usize)> = Vec::new();
    let mut names = 0;
    for (index, element) in elements.iter().enumerate() {
        let around = groups.last().map_or(0, |(_, around)| *around);
        let path = around + element.name + NAME_OVERHEAD;
        if let Some((missing, _)) = groups.last_mut() {
            *missing -= 1;
        }
        match usize::try_from(element.children) {
            Ok(0) => {
                names += path;
                if names > most {
                    return Err(Claim::Names(most));
                }
            }
            Ok(children) if children < elements.len() - index => {
                groups.push((element.children, path));
            }
            _ => return Err(Claim::Columns(element.children)),
        }
        if groups.len() > MAX_DEPTH {
            return Err(Claim::TooDeep);
        }
        while groups.last().is_some_and(|(missing, _)| *missing == 0) {
            groups.pop();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{Column, ColumnKind, reals};
    use crate::parquet::{Metadata, encode};
    use crate::table::Table;

    fn file() -> Vec<u8> {
        let column = Column::result("gap", ColumnKind::Real, "1", "");
        let table = Table::new(1, vec![(column, reals([1.0]))]);
        encode(&table, &Metadata::default())
    }

    /// The file with more fields at the end of its footer.
    fn with(fields: &[u8]) -> Bytes {
        let mut bytes = file();
        let start = footer_start(&bytes).unwrap();
        let end = bytes.len() - TAIL;
        // A structure ends with a zero.
        bytes.splice(end - 1..end - 1, fields.iter().copied());
        let length = u32::try_from(bytes.len() - TAIL - start).unwrap();
        let tail = bytes.len() - TAIL;
        bytes[tail..tail + 4].copy_from_slice(&length.to_le_bytes());
        bytes.into()
    }

    fn claim(bytes: &Bytes) -> Claim {
        match read(bytes) {
            Err(ParquetError::Footer(claim)) => claim,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn fields_that_nobody_knows_are_passed_over() {
        assert_eq!(read(&file().into()).unwrap().file_metadata().num_rows(), 1);
        // 100: the lists [[1, 2]], {1: 2}.
        let unknown = [0x09, 0xc8, 0x01, 0x19, 0x25, 2, 4, 0x1b, 1, 0x55, 2, 4];
        assert_eq!(read(&with(&unknown)).unwrap().file_metadata().num_rows(), 1);
    }

    /// It takes the reader minutes: a list of a thousand lists of 2³¹ − 1 truth values.
    #[test]
    fn lists_of_truth_values_are_refused_at_once() {
        let list = [0xf1, 0xff, 0xff, 0xff, 0xff, 0x07];
        let lists = [&[0x09, 0xc8, 0x01, 0xf9, 0xe8, 0x07][..], &list.repeat(1000)].concat();
        let error = read(&with(&lists)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "its footer claims a list of 2147483647 truth values, which Parquet has none of"
        );
    }

    /// The reader would take what these bytes hold for fields of the footer.
    #[test]
    fn a_list_is_not_hidden_in_what_is_said_to_be_text() {
        // 3, the number of rows, again, as text of four bytes.
        let hidden = [0x08, 0x06, 4, 0x19, 0xf1, 0xff, 0x07];
        let (found, known) = (Kind::Bytes, Kind::Long);
        assert_eq!(claim(&with(&hidden)), Claim::WrongType { found, known });
    }

    #[test]
    fn a_footer_longer_than_its_file_is_refused() {
        let mut bytes = file();
        let tail = bytes.len() - TAIL;
        let length = u32::try_from(tail + 1).unwrap();
        bytes[tail..tail + 4].copy_from_slice(&length.to_le_bytes());
        assert_eq!(claim(&bytes.into()), Claim::Bytes);
        assert_eq!(claim(&Bytes::from_static(b"PAR1")), Claim::Bytes);
    }

    fn columns(children: impl IntoIterator<Item = i64>) -> Vec<Element> {
        let element = |children| Element { name: 10, children };
        children.into_iter().map(element).collect()
    }

    #[test]
    fn a_group_has_as_many_columns_as_it_claims() {
        let most = usize::MAX;
        // The root, of a group of two and another column.
        assert_eq!(check_tree(&columns([2, 2, 0, 0, 0]), most), Ok(()));
        let root = Claim::Columns(1 << 31);
        assert_eq!(check_tree(&columns([1 << 31, 0]), most), Err(root));
        let group = Claim::Columns(2);
        assert_eq!(check_tree(&columns([2, 2, 0]), most), Err(group));
        let group = Claim::Columns(-1);
        assert_eq!(check_tree(&columns([1, -1]), most), Err(group));
    }

    /// The reader calls itself for each group, which ends the program where the stack ends.
    #[test]
    fn groups_are_not_endlessly_within_each_other() {
        let nested = |groups: usize| columns([vec![1; groups], vec![0]].concat());
        assert_eq!(check_tree(&nested(MAX_DEPTH), usize::MAX), Ok(()));
        let deep = check_tree(&nested(MAX_DEPTH + 1), usize::MAX);
        assert_eq!(deep, Err(Claim::TooDeep));
    }

    /// A group of a million letters with a thousand columns would be a gigabyte of names.
    #[test]
    fn names_are_not_written_out_endlessly() {
        let mut elements = columns([1, 1000].into_iter().chain([0; 1000]));
        elements[1].name = 1_000_000;
        let most = NAME_BYTES_PER_FOOTER_BYTE * 1_020_000;
        assert_eq!(check_tree(&elements, most), Err(Claim::Names(most)));
        elements[1].name = 50;
        let most = NAME_BYTES_PER_FOOTER_BYTE * 20_000;
        assert_eq!(check_tree(&elements, most), Ok(()));
    }
}
