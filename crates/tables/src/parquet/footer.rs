//! Reading of Parquet footers in time and memory proportional to their length.
//!
//! A footer may be damaged or malicious. It is therefore validated before the `parquet` crate reads
//! it. Lists must have as many elements as they declare ([`thrift`](super::thrift)), and the
//! columns must form a tree. Version 60 of the crate does not limit the following:
//!
//! - It allocates as many columns as a group declares. A file of 42 bytes can request 16 GiB, which
//!   ends the process if there is less memory.
//! - It recurses into groups. 10,000 levels overflow a stack of 8 MiB.
//! - It stores the full path of every column. A file of 1 MB can take 10 GB of memory.
//!
//! The constants describe the structures of [parquet.thrift][spec] field by field. Enumerations are
//! integers; unions are structures with one field. The constants must contain all fields that the
//! crate reads. They may omit fields that the crate skips.
//!
//! [spec]: https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift

use bytes::Bytes;
use parquet::errors::ParquetError as ReaderError;
use parquet::file::metadata::{FooterTail, ParquetMetaData, ParquetMetaDataReader};

use super::ParquetError;
use super::digest::{TAIL, footer_start};
use super::thrift::{InvalidThrift, Kind, MAX_DEPTH, Shape, Walk};

/// Maximum number of bytes of column paths per byte of the footer.
const PATH_BYTES_PER_BYTE: usize = 64;
/// Memory in bytes that a name in a path takes in addition to its letters.
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

/// Fields of `FileMetaData`, which is the footer.
const FOOTER: &[Shape] =
    &[INT, SCHEMA, LONG, ROW_GROUPS, KEY_VALUES, BYTES, ORDERS, UNKNOWN, BYTES];
/// List of the columns and groups of columns. Each group precedes its children.
const SCHEMA: Shape = Shape::List(&Shape::Struct(COLUMN));
/// Fields of `SchemaElement`, a column or a group of columns.
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

/// List of `ColumnChunk`, each with its `ColumnMetaData`.
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

/// Fields of `PageHeader`, the header of each page of a column.
pub const PAGE: &[Shape] = &[
    INT,
    INT,
    INT,
    INT,
    Shape::Struct(&[INT, INT, INT, INT, STATISTICS]),
    EMPTY,
    Shape::Struct(DICTIONARY),
    Shape::Struct(DATA_PAGE),
];
/// Fields of `DataPageHeaderV2`, which is part of `PageHeader`.
pub const DATA_PAGE: &[Shape] = &[INT, INT, INT, INT, INT, INT, BOOL, STATISTICS];
/// Fields of `DictionaryPageHeader`, which is part of `PageHeader`.
pub const DICTIONARY: &[Shape] = &[INT, INT, BOOL];

/// Reads the footer of a file. `end` are the last bytes of the file.
///
/// # Errors
/// Returns an error if the footer is damaged, or if `end` does not contain the whole footer.
pub fn read(end: &Bytes) -> Result<ParquetMetaData, ParquetError> {
    let tail = end.last_chunk::<TAIL>().ok_or(InvalidThrift::Bytes)?;
    if FooterTail::try_new(tail)?.is_encrypted_footer() {
        return Err(ReaderError::NYI("encrypted footers".to_owned()).into());
    }
    let start = footer_start(end).ok_or(InvalidThrift::Bytes)?;
    let footer = end.slice(start..end.len() - TAIL);
    check(&footer)?;
    Ok(ParquetMetaDataReader::decode_metadata(&footer)?)
}

/// Checks that the `parquet` crate can read a footer in time and memory proportional to its length.
fn check(bytes: &[u8]) -> Result<(), InvalidThrift> {
    let most = PATH_BYTES_PER_BYTE * bytes.len();
    Walk::new(bytes).fields(FOOTER, |walk, field, kind, shape| match field {
        2 => {
            let mut columns = Vec::new();
            walk.elements(Shape::Struct(COLUMN), |walk, _| {
                columns.push(Element::read(walk)?);
                Ok(())
            })?;
            check_tree(&columns, most)
        }
        _ => walk.skip(kind, shape),
    })
}

/// A column, or a group of columns with `children`.
#[derive(Debug, Clone, Copy, Default)]
struct Element {
    /// Length of the name in bytes.
    name: usize,
    children: i64,
}

impl Element {
    fn read(walk: &mut Walk<'_>) -> Result<Element, InvalidThrift> {
        let mut element = Element::default();
        walk.fields(COLUMN, |walk, field, kind, shape| {
            match field {
                4 => element.name = walk.bytes()?.len(),
                5 => element.children = walk.number()?,
                _ => walk.skip(kind, shape)?,
            }
            Ok(())
        })?;
        Ok(element)
    }
}

/// Checks the tree of columns.
///
/// Returns an error if a group declares more children than there are elements, if groups are nested
/// deeper than [`MAX_DEPTH`], or if the column paths have more than `most` bytes in total.
fn check_tree(elements: &[Element], most: usize) -> Result<(), InvalidThrift> {
    // For each open group: number of missing children, and bytes of the path to the group.
    let mut groups: Vec<(i64, usize)> = Vec::new();
    let mut names = 0;
    for (index, element) in elements.iter().enumerate() {
        let above = groups.last().map_or(0, |(_, above)| *above);
        let path = above + element.name + NAME_OVERHEAD;
        if let Some((missing, _)) = groups.last_mut() {
            *missing -= 1;
        }
        match usize::try_from(element.children) {
            Ok(0) => {
                names += path;
                if names > most {
                    return Err(InvalidThrift::Names(most));
                }
            }
            Ok(children) if children < elements.len() - index => {
                groups.push((element.children, path));
            }
            _ => return Err(InvalidThrift::Columns(element.children)),
        }
        if groups.len() > MAX_DEPTH {
            return Err(InvalidThrift::TooDeep);
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

    /// Returns a file with additional fields at the end of its footer.
    fn with(fields: &[u8]) -> Bytes {
        let mut bytes = file();
        let start = footer_start(&bytes).unwrap();
        let end = bytes.len() - TAIL;
        // The last byte of a structure is zero.
        bytes.splice(end - 1..end - 1, fields.iter().copied());
        let length = u32::try_from(bytes.len() - TAIL - start).unwrap();
        let tail = bytes.len() - TAIL;
        bytes[tail..tail + 4].copy_from_slice(&length.to_le_bytes());
        bytes.into()
    }

    fn problem(bytes: &Bytes) -> InvalidThrift {
        match read(bytes) {
            Err(ParquetError::Footer(problem)) => problem,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn unknown_fields_are_skipped() {
        assert_eq!(read(&file().into()).unwrap().file_metadata().num_rows(), 1);
        // Field 100 is the list [[1, 2]], the next field the map {1: 2}.
        let unknown = [0x09, 0xc8, 0x01, 0x19, 0x25, 2, 4, 0x1b, 1, 0x55, 2, 4];
        assert_eq!(read(&with(&unknown)).unwrap().file_metadata().num_rows(), 1);
    }

    // A list of a thousand lists of 2³¹ − 1 booleans would take the `parquet` crate minutes.
    #[test]
    fn lists_of_booleans_are_refused() {
        let list = [0xf1, 0xff, 0xff, 0xff, 0xff, 0x07];
        let lists = [&[0x09, 0xc8, 0x01, 0xf9, 0xe8, 0x07][..], &list.repeat(1000)].concat();
        let error = read(&with(&lists)).unwrap_err();
        assert_eq!(error.to_string(), "invalid Parquet metadata: a list of 2147483647 booleans");
    }

    // The `parquet` crate would read the content of this text as fields of the footer.
    #[test]
    fn a_list_cannot_be_hidden_in_a_text_field() {
        // Field 3, the number of rows, is repeated as a text of four bytes.
        let hidden = [0x08, 0x06, 4, 0x19, 0xf1, 0xff, 0x07];
        let (found, known) = (Kind::Bytes, Kind::Long);
        assert_eq!(problem(&with(&hidden)), InvalidThrift::WrongType { found, known });
    }

    #[test]
    fn a_footer_longer_than_its_file_is_refused() {
        let mut bytes = file();
        let tail = bytes.len() - TAIL;
        let length = u32::try_from(tail + 1).unwrap();
        bytes[tail..tail + 4].copy_from_slice(&length.to_le_bytes());
        assert_eq!(problem(&bytes.into()), InvalidThrift::Bytes);
        assert_eq!(problem(&Bytes::from_static(b"PAR1")), InvalidThrift::Bytes);
    }

    fn columns(children: impl IntoIterator<Item = i64>) -> Vec<Element> {
        let element = |children| Element { name: 10, children };
        children.into_iter().map(element).collect()
    }

    #[test]
    fn a_group_has_as_many_columns_as_it_claims() {
        let most = usize::MAX;
        // The root has two children: a group of two columns, and a column.
        assert_eq!(check_tree(&columns([2, 2, 0, 0, 0]), most), Ok(()));
        let root = InvalidThrift::Columns(1 << 31);
        assert_eq!(check_tree(&columns([1 << 31, 0]), most), Err(root));
        let group = InvalidThrift::Columns(2);
        assert_eq!(check_tree(&columns([2, 2, 0]), most), Err(group));
        let group = InvalidThrift::Columns(-1);
        assert_eq!(check_tree(&columns([1, -1]), most), Err(group));
    }

    // The `parquet` crate recurses into groups, which would overflow the stack.
    #[test]
    fn deeply_nested_groups_are_refused() {
        let nested = |groups: usize| columns([vec![1; groups], vec![0]].concat());
        assert_eq!(check_tree(&nested(MAX_DEPTH), usize::MAX), Ok(()));
        let deep = check_tree(&nested(MAX_DEPTH + 1), usize::MAX);
        assert_eq!(deep, Err(InvalidThrift::TooDeep));
    }

    // With a group name of a million letters, the paths of a thousand columns would take 1 GB.
    #[test]
    fn long_column_paths_are_refused() {
        let mut elements = columns([1, 1000].into_iter().chain([0; 1000]));
        elements[1].name = 1_000_000;
        let most = PATH_BYTES_PER_BYTE * 1_020_000;
        assert_eq!(check_tree(&elements, most), Err(InvalidThrift::Names(most)));
        elements[1].name = 50;
        let most = PATH_BYTES_PER_BYTE * 20_000;
        assert_eq!(check_tree(&elements, most), Ok(()));
    }
}
