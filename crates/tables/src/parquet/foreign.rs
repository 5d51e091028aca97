//! Columns of numbers from anybody's Parquet file, whose reading costs no more than what a file of as
//! many bytes and rows can hold.
//!
//! Each page begins with a header, which is walked over like the footer before the `parquet` crate
//! reads it ([`thrift`](super::thrift)). The header states how long the page is once it is unpacked,
//! and how many numbers a dictionary has; the crate makes room for both at once.

use std::sync::Arc;

use arrow::array::{Array, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};

use super::ParquetError;
use super::decode::{leaf, unless_it_panics};
use super::footer::{self, DICTIONARY, PAGE};
use super::thrift::{Claim, Walk};

/// Bytes that a number takes with its index in a dictionary and its levels; a decimal one has 32.
const BYTES_PER_VALUE: usize = 64;
/// Bytes that pages take however few numbers they hold.
const BASE_BYTES: usize = 1 << 20;

/// The columns of numbers in a file, of which some may be read.
pub struct NumberColumns {
    bytes: Bytes,
    file: ArrowReaderMetadata,
    /// Where they are among all columns.
    indices: Vec<usize>,
}

impl NumberColumns {
    /// Those of a file of these bytes.
    ///
    /// # Errors
    /// When the bytes are no Parquet, or are damaged.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<NumberColumns, ParquetError> {
        unless_it_panics(|| {
            let bytes = Bytes::from(bytes);
            let footer = Arc::new(footer::read(&bytes)?);
            // What a file says in Arrow's words of its columns is not bounded by its length.
            let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
            let file = ArrowReaderMetadata::try_new(footer, options)?;
            let fields = file.schema().fields().iter().enumerate();
            let numbers = fields.filter(|(_, field)| field.data_type().is_numeric());
            let indices = numbers.map(|(index, _)| index).collect();
            Ok(NumberColumns { bytes, file, indices })
        })
    }

    pub fn names(&self) -> Vec<&str> {
        let indices = self.indices.iter();
        indices.map(|&index| self.field(index).name().as_str()).collect()
    }

    /// How many rows the file says that it has.
    pub fn rows(&self) -> usize {
        usize::try_from(self.footer().file_metadata().num_rows()).unwrap_or(usize::MAX)
    }

    /// The numbers of one of them; a row where it is null holds none.
    ///
    /// # Errors
    /// When the column is damaged, or has not as many rows as the file says.
    pub fn read(&self, column: usize) -> Result<Vec<f64>, ParquetError> {
        let index = self.indices[column];
        unless_it_panics(|| self.read_at(index))
    }

    /// Only this one is decoded: the others may be large, or made to take for ever.
    fn read_at(&self, index: usize) -> Result<Vec<f64>, ParquetError> {
        let leaf = leaf(self.footer(), index).ok_or(ParquetError::Malformed)?;
        let groups = self.footer().row_groups().iter();
        let chunks = groups.map(|group| group.column(leaf));
        check_chunks(&self.bytes, chunks, self.rows())?;

        let file = self.file.clone();
        let file = ParquetRecordBatchReaderBuilder::new_with_metadata(self.bytes.clone(), file);
        let mask = ProjectionMask::roots(file.parquet_schema(), [index]);
        let mut numbers = Vec::new();
        for batch in file.with_projection(mask).build()? {
            let column = cast(batch?.column(0), &DataType::Float64)?;
            let values = column.as_primitive::<Float64Type>();
            let values = (0..values.len())
                .map(|row| values.is_valid(row).then(|| values.value(row)))
                .map(|value| value.unwrap_or(f64::NAN));
            numbers.extend(values);
            if numbers.len() > self.rows() {
                break;
            }
        }
        if numbers.len() == self.rows() { Ok(numbers) } else { Err(ParquetError::Malformed) }
    }

    fn footer(&self) -> &ParquetMetaData {
        self.file.metadata()
    }

    fn field(&self, index: usize) -> &Field {
        self.file.schema().field(index)
    }
}

/// Refuses the chunks of a column of so many rows whose pages cannot all be read in a time and a
/// memory in proportion to these rows and the bytes of the file.
fn check_chunks<'a>(
    file: &[u8],
    chunks: impl Iterator<Item = &'a ColumnChunkMetaData>,
    rows: usize,
) -> Result<(), ParquetError> {
    let mut read = 0;
    let mut left = rows.saturating_mul(BYTES_PER_VALUE).saturating_add(BASE_BYTES);
    for chunk in chunks {
        let refused = |claim| ParquetError::Page { column: chunk.column_path().string(), claim };
        let (start, length) = chunk.byte_range();
        let start = usize::try_from(start).ok().and_then(|start| file.get(start..));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let pages = start.and_then(|bytes| bytes.get(..length));
        let pages = pages.ok_or_else(|| refused(Claim::Bytes))?;
        // Chunks may all be the same bytes.
        read += pages.len();
        if read > file.len() {
            return Err(refused(Claim::Bytes));
        }
        check_pages(pages, &mut left).map_err(refused)?;
    }
    Ok(())
}

/// Refuses pages that take more than so many bytes once they are unpacked; takes what they take.
fn check_pages(mut pages: &[u8], left: &mut usize) -> Result<(), Claim> {
    while !pages.is_empty() {
        let (after, header) = Header::read(pages)?;
        let rest = &pages[after..];
        let unpacked = usize::try_from(header.unpacked).ok();
        let unpacked = unpacked.filter(|bytes| bytes <= left);
        let unpacked = unpacked.ok_or(Claim::Unpacked(header.unpacked))?;
        *left -= unpacked;
        // Each takes a byte or more.
        if !usize::try_from(header.values).is_ok_and(|values| values <= unpacked) {
            return Err(Claim::Values(header.values));
        }
        let length = usize::try_from(header.length).map_err(|_| Claim::Bytes)?;
        pages = rest.get(length..).ok_or(Claim::Bytes)?;
    }
    Ok(())
}

/// What the header of a page says.
#[derive(Debug, Default)]
struct Header {
    /// Bytes of the page after it.
    length: i64,
    /// Bytes of the page once it is unpacked.
    unpacked: i64,
    /// Values, if the page is a dictionary.
    values: i64,
}

impl Header {
    /// The header at the start of these bytes, and where it ends.
    fn read(bytes: &[u8]) -> Result<(usize, Header), Claim> {
        let mut header = Header::default();
        let mut walk = Walk::new(bytes);
        walk.fields(PAGE, |walk, field, kind, shape| {
            match field {
                2 => header.unpacked = walk.number()?,
                3 => header.length = walk.number()?,
                7 => walk.fields(DICTIONARY, |walk, field, kind, shape| match field {
                    1 => walk.number().map(|values| header.values = values),
                    _ => walk.pass(kind, shape),
                })?,
                _ => walk.pass(kind, shape)?,
            }
            Ok(())
        })?;
        Ok((walk.position(), header))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{Column, ColumnKind, reals, texts};
    use crate::parquet::{Metadata, encode};
    use crate::table::Table;

    fn table_of_a_word_and_two_numbers() -> Vec<u8> {
        let column = |name| Column::result(name, ColumnKind::Real, "1", "");
        let text = Column::result("word", ColumnKind::Text, "", "");
        let table = Table::new(
            2,
            vec![
                (text, texts(["a", "b"])),
                (column("one"), reals([1.0, 2.0])),
                (column("other"), reals([3.0, 4.0])),
            ],
        );
        encode(&table, &Metadata::default())
    }

    #[test]
    fn numbers_are_read_and_text_is_passed_over() {
        let columns = NumberColumns::from_bytes(table_of_a_word_and_two_numbers()).unwrap();
        assert_eq!((columns.names(), columns.rows()), (vec!["one", "other"], 2));
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
        assert_eq!(columns.read(1).unwrap(), [3.0, 4.0]);
        assert!(NumberColumns::from_bytes(b"PAR1PAR1".to_vec()).is_err());
    }

    #[test]
    fn damage_in_columns_that_are_no_numbers_is_not_met() {
        let mut bytes = table_of_a_word_and_two_numbers();
        let file = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes.clone())).unwrap();
        let (start, length) = file.metadata().row_group(0).column(0).byte_range();
        let words = usize::try_from(start).unwrap()..usize::try_from(start + length).unwrap();
        bytes[words].fill(0xff);
        let columns = NumberColumns::from_bytes(bytes).unwrap();
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
    }

    /// Columns of every kind, nested ones among them, with statistics, as others write them.
    const SAMPLES: [&[u8]; 3] = [
        include_bytes!("samples/duckdb.parquet"),
        include_bytes!("samples/polars.parquet"),
        include_bytes!("samples/pyarrow.parquet"),
    ];

    #[test]
    fn files_of_other_programs_are_read() {
        for sample in SAMPLES {
            let columns = NumberColumns::from_bytes(sample.to_vec()).unwrap();
            assert_eq!(columns.names(), ["wavenumber", "price", "small", "density"]);
            let read = |column| columns.read(column).unwrap();
            assert_eq!(read(0), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
            assert_eq!(read(1), [1.25; 6]);
            assert_eq!(read(2), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
            assert_eq!(read(3), [0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625]);
        }
    }

    #[test]
    fn any_damaged_byte_of_them_does_no_harm() {
        for sample in SAMPLES {
            for index in 0..sample.len() {
                let mut damaged = sample.to_vec();
                damaged[index] ^= 1 << (index % 8);
                if let Ok(columns) = NumberColumns::from_bytes(damaged) {
                    let _ = (0..columns.names().len()).all(|column| columns.read(column).is_ok());
                }
            }
        }
    }

    /// A page with these sizes and nothing else, zigzag numbers as they are written.
    fn page(unpacked: &[u8], size: &[u8], more: &[u8], bytes: usize) -> Vec<u8> {
        let header = [&[0x15, 0, 0x15], unpacked, &[0x15], size, more, &[0]].concat();
        [header, vec![7; bytes]].concat()
    }

    fn passed(pages: &[u8], mut left: usize) -> Result<usize, Claim> {
        check_pages(pages, &mut left).map(|()| left)
    }

    #[test]
    fn pages_follow_each_other_to_the_end_of_their_chunk() {
        // Three bytes, of five once they are unpacked; and none.
        let pages = [page(&[10], &[6], &[], 3), page(&[0], &[0], &[], 0)].concat();
        assert_eq!(passed(&pages, 8), Ok(3));
        assert_eq!(passed(&pages, 4), Err(Claim::Unpacked(5)));
        assert_eq!(passed(&pages[..pages.len() - 1], 8), Err(Claim::Bytes));
        assert_eq!(passed(&page(&[10], &[8], &[], 3), 8), Err(Claim::Bytes));
        assert_eq!(passed(&page(&[1], &[6], &[], 3), 8), Err(Claim::Unpacked(-1)));
    }

    #[test]
    fn a_dictionary_has_bytes_for_its_values() {
        // 7: its values, in the encoding 0.
        let of = |values| page(&[10], &[6], &[0x4c, 0x15, values, 0x15, 0, 0], 3);
        assert_eq!(passed(&of(10), 8), Ok(3));
        assert_eq!(passed(&of(12), 8), Err(Claim::Values(6)));
    }

    /// The reader gives truth values no bytes, and at the end of a file doubles none, either.
    #[test]
    fn headers_hold_no_lists_without_a_byte_for_each_element() {
        const MANY: usize = 0x7fff_ffff;
        let list = |kind: u8| [0xf0 | kind, 0xff, 0xff, 0xff, 0xff, 0x07];
        // In the header of the data, and beside it.
        let inside = |kind| [&[0x2c, 0x99][..], &list(kind), &[0]].concat();
        let beside = |kind| [&[0x99][..], &list(kind)].concat();
        for more in [&inside as &dyn Fn(u8) -> Vec<u8>, &beside] {
            let claim = |kind| passed(&page(&[10], &[6], &more(kind), 3), 8);
            assert_eq!(claim(1), Err(Claim::Booleans(MANY)));
            assert_eq!(claim(7), Err(Claim::Elements(MANY)));
        }
    }
}
