//! The structures of Parquet's footer and of the headers of its pages, field by field as its reader
//! reads them.
//!
//! From [parquet.thrift](https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift);
//! enumerations are whole numbers, unions structures with one field. What version 60 of the `parquet`
//! crate passes over by its type alone need not be here, and what it reads must be.

use super::kind::Kind;
use super::thrift::{Field, Shape};

const TRUTH: Shape = Shape::Plain(Kind::Truth);
const BYTE: Shape = Shape::Plain(Kind::Byte);
const SHORT: Shape = Shape::Plain(Kind::Short);
const INT: Shape = Shape::Plain(Kind::Int);
const LONG: Shape = Shape::Plain(Kind::Long);
const DOUBLE: Shape = Shape::Plain(Kind::Double);
const BYTES: Shape = Shape::Plain(Kind::Bytes);
const EMPTY: Shape = Shape::Struct(&[]);

/// `FileMetaData`, the footer.
pub const FOOTER: &[Field] = &[
    (1, INT),
    (footer::SCHEMA, Shape::List(&Shape::Struct(SCHEMA_ELEMENT))),
    (3, LONG),
    (4, Shape::List(&Shape::Struct(ROW_GROUP))),
    (5, KEY_VALUES),
    (6, BYTES),
    (7, Shape::List(&Shape::Struct(COLUMN_ORDER))),
    (9, BYTES),
];

/// Numbers of fields of the footer.
pub mod footer {
    /// The tree of columns, from the root down, each group before what is in it.
    pub const SCHEMA: i16 = 2;
}

/// A column, or a group of them.
pub const SCHEMA_ELEMENT: &[Field] = &[
    (1, INT),
    (2, INT),
    (3, INT),
    (schema_element::NAME, BYTES),
    (schema_element::CHILDREN, INT),
    (6, INT),
    (7, INT),
    (8, INT),
    (9, INT),
    (10, Shape::Struct(LOGICAL_TYPE)),
];

/// Numbers of fields of a column.
pub mod schema_element {
    /// Its name.
    pub const NAME: i16 = 4;
    /// How many there are in a group.
    pub const CHILDREN: i16 = 5;
}

const LOGICAL_TYPE: &[Field] = &[
    (1, EMPTY),
    (2, EMPTY),
    (3, EMPTY),
    (4, EMPTY),
    (5, Shape::Struct(&[(1, INT), (2, INT)])),
    (6, EMPTY),
    (7, Shape::Struct(TIME)),
    (8, Shape::Struct(TIME)),
    (10, Shape::Struct(&[(1, BYTE), (2, TRUTH)])),
    (11, EMPTY),
    (12, EMPTY),
    (13, EMPTY),
    (14, EMPTY),
    (15, EMPTY),
    (16, Shape::Struct(&[(1, BYTE)])),
    (17, Shape::Struct(&[(1, BYTES)])),
    (18, Shape::Struct(&[(1, BYTES), (2, INT)])),
    (19, EMPTY),
];
const TIME: &[Field] = &[(1, TRUTH), (2, Shape::Struct(TIME_UNIT))];
const TIME_UNIT: &[Field] = &[(1, EMPTY), (2, EMPTY), (3, EMPTY)];

const ROW_GROUP: &[Field] = &[
    (1, Shape::List(&Shape::Struct(COLUMN_CHUNK))),
    (2, LONG),
    (3, LONG),
    (4, Shape::List(&Shape::Struct(SORTING_COLUMN))),
    (5, LONG),
    (6, LONG),
    (7, SHORT),
];
const SORTING_COLUMN: &[Field] = &[(1, INT), (2, TRUTH), (3, TRUTH)];
const COLUMN_ORDER: &[Field] = &[(1, EMPTY), (2, EMPTY), (3, EMPTY)];
const KEY_VALUES: Shape = Shape::List(&Shape::Struct(&[(1, BYTES), (2, BYTES)]));

const COLUMN_CHUNK: &[Field] = &[
    (1, BYTES),
    (2, LONG),
    (3, Shape::Struct(COLUMN_META_DATA)),
    (4, LONG),
    (5, INT),
    (6, LONG),
    (7, INT),
    (9, BYTES),
];
const COLUMN_META_DATA: &[Field] = &[
    (1, INT),
    (2, Shape::List(&INT)),
    (3, Shape::List(&BYTES)),
    (4, INT),
    (5, LONG),
    (6, LONG),
    (7, LONG),
    (8, KEY_VALUES),
    (9, LONG),
    (10, LONG),
    (11, LONG),
    (12, Shape::Struct(STATISTICS)),
    (13, Shape::List(&Shape::Struct(&[(1, INT), (2, INT), (3, INT)]))),
    (14, LONG),
    (15, INT),
    (16, Shape::Struct(SIZE_STATISTICS)),
    (17, Shape::Struct(&[(1, Shape::Struct(BOX)), (2, Shape::List(&INT))])),
];
const STATISTICS: &[Field] = &[
    (1, BYTES),
    (2, BYTES),
    (3, LONG),
    (4, LONG),
    (5, BYTES),
    (6, BYTES),
    (7, TRUTH),
    (8, TRUTH),
    (9, LONG),
];
const SIZE_STATISTICS: &[Field] = &[(1, LONG), (2, Shape::List(&LONG)), (3, Shape::List(&LONG))];
const BOX: &[Field] = &[
    (1, DOUBLE),
    (2, DOUBLE),
    (3, DOUBLE),
    (4, DOUBLE),
    (5, DOUBLE),
    (6, DOUBLE),
    (7, DOUBLE),
    (8, DOUBLE),
];

/// `PageHeader`.
pub const PAGE: &[Field] = &[
    (1, INT),
    (page::UNCOMPRESSED_SIZE, INT),
    (page::SIZE, INT),
    (4, INT),
    (5, Shape::Struct(&[(1, INT), (2, INT), (3, INT), (4, INT), (5, Shape::Struct(STATISTICS))])),
    (6, EMPTY),
    (page::DICTIONARY, Shape::Struct(DICTIONARY)),
    (8, Shape::Struct(DATA_PAGE_2)),
];

/// Numbers of fields of the header of a page.
pub mod page {
    /// Bytes of the page once it is unpacked.
    pub const UNCOMPRESSED_SIZE: i16 = 2;
    /// Bytes of the page after its header.
    pub const SIZE: i16 = 3;
    /// About a dictionary, if it is one.
    pub const DICTIONARY: i16 = 7;
}

/// `DictionaryPageHeader`.
pub const DICTIONARY: &[Field] = &[(dictionary::VALUES, INT), (2, INT), (3, TRUTH)];

/// Numbers of fields of the header of a dictionary.
pub mod dictionary {
    /// How many values it has.
    pub const VALUES: i16 = 1;
}

const DATA_PAGE_2: &[Field] = &[
    (1, INT),
    (2, INT),
    (3, INT),
    (4, INT),
    (5, INT),
    (6, INT),
    (7, TRUTH),
    (8, Shape::Struct(STATISTICS)),
];
