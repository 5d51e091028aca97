//! Reading of numeric columns from Parquet files of other programs, in bounded time and memory.
//!
//! Time and memory are at most proportional to the bytes and rows of the file. Each page begins
//! with a header, which is validated like the footer before the `parquet` crate reads it
//! ([`thrift`](super::thrift)). The crate allocates memory for the uncompressed size of the page
//! and for the number of values in a dictionary, as given in the header. Its decoders of gzip and
//! Brotli unpack whatever a page contains, so such pages are unpacked once without keeping their
//! bytes. The other decoders stop at the size in the header, or have a bounded ratio (LZ4).

use std::io::{self, Read};
use std::sync::Arc;

use arrow::array::{Array, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::basic::Compression;
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};

use super::ParquetError;
use super::decode::{catch_panics, leaf};
use super::footer::{self, DATA_PAGE, DICTIONARY, PAGE};
use super::thrift::{InvalidThrift, Walk};

/// Maximum number of uncompressed bytes per row. The largest type, a decimal, has 32 bytes; in
/// addition, there can be a dictionary index and levels.
const BYTES_PER_VALUE: usize = 64;
/// Number of uncompressed bytes that a column may have in addition, independent of its rows.
const BASE_BYTES: usize = 1 << 20;

/// Numeric columns of a Parquet file. Each column is decoded only when it is read.
pub struct NumberColumns {
    bytes: Bytes,
    file: ArrowReaderMetadata,
    /// Indices of the numeric columns among all columns.
    indices: Vec<usize>,
}

impl NumberColumns {
    /// Reads the footer of a file and lists its numeric columns.
    ///
    /// # Errors
    /// Returns an error if the bytes are not a Parquet file or the footer is damaged.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<NumberColumns, ParquetError> {
        catch_panics(|| {
            let bytes = Bytes::from(bytes);
            let footer = Arc::new(footer::read(&bytes)?);
            // Ignore the Arrow schema in the file: its decoding is not bounded by its length.
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

    /// Returns the number of rows according to the footer.
    pub fn rows(&self) -> usize {
        usize::try_from(self.footer().file_metadata().num_rows()).unwrap_or(usize::MAX)
    }

    /// Reads the numeric column with a given index in [`names`](Self::names). Nulls become NaN.
    ///
    /// # Errors
    /// Returns an error if the column is damaged or does not have the number of rows of the footer.
    pub fn read(&self, column: usize) -> Result<Vec<f64>, ParquetError> {
        let index = self.indices[column];
        catch_panics(|| self.read_at(index))
    }

    /// Decodes one column without reading others, which may be large or damaged.
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

/// Checks that the chunks of a column can be decoded in time and memory proportional to the number
/// of rows and the length of the file.
fn check_chunks<'a>(
    file: &[u8],
    chunks: impl Iterator<Item = &'a ColumnChunkMetaData>,
    rows: usize,
) -> Result<(), ParquetError> {
    let mut read = 0;
    let mut left = rows.saturating_mul(BYTES_PER_VALUE).saturating_add(BASE_BYTES);
    for chunk in chunks {
        let refused =
            |problem| ParquetError::Page { column: chunk.column_path().string(), problem };
        let (start, length) = chunk.byte_range();
        let rest = usize::try_from(start).ok().and_then(|start| file.get(start..));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let found = rest.and_then(|rest| rest.get(..length));
        let pages = found.ok_or_else(|| refused(InvalidThrift::Bytes))?;
        // This check prevents many chunks from sharing the same bytes.
        read += pages.len();
        if read > file.len() {
            return Err(refused(InvalidThrift::Bytes));
        }
        check_pages(pages, chunk.compression(), &mut left).map_err(refused)?;
    }
    Ok(())
}

/// Subtracts the uncompressed sizes of the pages from `left`, the number of uncompressed bytes that
/// the column may still have. Returns an error if `left` would become negative, or if the header of
/// a page is invalid.
fn check_pages(
    mut pages: &[u8],
    codec: Compression,
    left: &mut usize,
) -> Result<(), InvalidThrift> {
    while !pages.is_empty() {
        let (after, header) = Header::read(pages)?;
        let rest = &pages[after..];
        let allowed = usize::try_from(header.unpacked).ok().filter(|bytes| bytes <= left);
        let unpacked = allowed.ok_or(InvalidThrift::Unpacked(header.unpacked))?;
        *left -= unpacked;
        // Each value has at least one byte.
        if !usize::try_from(header.values).is_ok_and(|values| values <= unpacked) {
            return Err(InvalidThrift::Values(header.values));
        }
        let length = usize::try_from(header.length).map_err(|_| InvalidThrift::Bytes)?;
        let page = rest.get(..length).ok_or(InvalidThrift::Bytes)?;
        let levels = usize::try_from(header.levels).map_err(|_| InvalidThrift::Bytes)?;
        let values = page.get(levels..).ok_or(InvalidThrift::Bytes)?;
        if !fits(values, codec, unpacked.saturating_sub(levels) as u64) {
            return Err(InvalidThrift::Unpacked(header.unpacked));
        }
        pages = &rest[length..];
    }
    Ok(())
}

/// Returns whether the decoder of a codec stops at `size` bytes. Damaged bytes are left to it.
fn fits(packed: &[u8], codec: Compression, size: u64) -> bool {
    let unpacked = |decoder: &mut dyn Read| io::copy(&mut decoder.take(size + 1), &mut io::sink());
    let unpacked = match codec {
        Compression::GZIP(_) => unpacked(&mut MultiGzDecoder::new(packed)),
        Compression::BROTLI(_) => unpacked(&mut brotli::Decompressor::new(packed, 4096)),
        _ => return true,
    };
    !unpacked.is_ok_and(|bytes| bytes > size)
}

/// Fields of a page header that [`check_pages`] checks.
#[derive(Debug, Default)]
struct Header {
    /// Compressed length of the page after the header, in bytes.
    length: i64,
    /// Uncompressed length of the page, in bytes.
    unpacked: i64,
    /// Number of values of a dictionary page; zero for other pages.
    values: i64,
    /// Length of the levels, which are not compressed in data pages of version 2, in bytes.
    levels: i64,
}

impl Header {
    /// Reads the header at the start of `bytes`. Returns its length and the header.
    fn read(bytes: &[u8]) -> Result<(usize, Header), InvalidThrift> {
        let mut header = Header::default();
        let mut walk = Walk::new(bytes);
        walk.fields(PAGE, |walk, field, kind, shape| {
            match field {
                2 => header.unpacked = walk.number()?,
                3 => header.length = walk.number()?,
                7 => walk.fields(DICTIONARY, |walk, field, kind, shape| match field {
                    1 => walk.number().map(|values| header.values = values),
                    _ => walk.skip(kind, shape),
                })?,
                8 => walk.fields(DATA_PAGE, |walk, field, kind, shape| {
                    match field {
                        5 | 6 => header.levels = header.levels.saturating_add(walk.number()?),
                        _ => walk.skip(kind, shape)?,
                    }
                    Ok(())
                })?,
                _ => walk.skip(kind, shape)?,
            }
            Ok(())
        })?;
        Ok((walk.position(), header))
    }
}

#[cfg(test)]
mod tests {
    use parquet::basic::{BrotliLevel, GzipLevel};

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
    fn numeric_columns_are_read_and_text_is_skipped() {
        let columns = NumberColumns::from_bytes(table_of_a_word_and_two_numbers()).unwrap();
        assert_eq!((columns.names(), columns.rows()), (vec!["one", "other"], 2));
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
        assert_eq!(columns.read(1).unwrap(), [3.0, 4.0]);
        assert!(NumberColumns::from_bytes(b"PAR1PAR1".to_vec()).is_err());
    }

    #[test]
    fn damage_in_other_columns_is_ignored() {
        let mut bytes = table_of_a_word_and_two_numbers();
        let file = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes.clone())).unwrap();
        let (start, length) = file.metadata().row_group(0).column(0).byte_range();
        let words = usize::try_from(start).unwrap()..usize::try_from(start + length).unwrap();
        bytes[words].fill(0xff);
        let columns = NumberColumns::from_bytes(bytes).unwrap();
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
    }

    /// Files of other programs with columns of many types, nested columns and statistics.
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

    /// Files with 40 rows of two columns, as each program writes them with this codec or by
    /// default: pandas with snappy, polars with zstd, DuckDB with snappy.
    const CODECS: [&[u8]; 9] = [
        include_bytes!("samples/pandas.parquet"),
        include_bytes!("samples/polars-default.parquet"),
        include_bytes!("samples/duckdb-default.parquet"),
        include_bytes!("samples/pyarrow-zstd.parquet"),
        include_bytes!("samples/pyarrow-gzip.parquet"),
        include_bytes!("samples/pyarrow-gzip-v2.parquet"),
        include_bytes!("samples/pyarrow-lz4.parquet"),
        include_bytes!("samples/pyarrow-brotli.parquet"),
        include_bytes!("samples/pyarrow-brotli-v2.parquet"),
    ];

    #[test]
    fn files_of_the_usual_codecs_are_read() {
        for sample in CODECS {
            let columns = NumberColumns::from_bytes(sample.to_vec()).unwrap();
            assert_eq!(columns.names(), ["wavenumber", "density"]);
            let [wavenumbers, densities] = [0, 1].map(|column| columns.read(column).unwrap());
            assert_eq!(wavenumbers, (1..=40).map(f64::from).collect::<Vec<_>>());
            assert_eq!(densities, vec![0.5; 40]);
        }
    }

    #[test]
    fn pages_unpack_to_no_more_than_their_size() {
        let zeros = vec![0; 1 << 20];
        let mut gzip = Vec::new();
        let encoder = flate2::read::GzEncoder::new(&zeros[..], flate2::Compression::best());
        { encoder }.read_to_end(&mut gzip).unwrap();
        let mut packed = Vec::new();
        let parameters = brotli::enc::BrotliEncoderParams::default();
        brotli::BrotliCompress(&mut &zeros[..], &mut packed, &parameters).unwrap();
        let codecs = [
            (&gzip, Compression::GZIP(GzipLevel::default())),
            (&packed, Compression::BROTLI(BrotliLevel::default())),
        ];
        for (packed, codec) in codecs {
            assert!(fits(packed, codec, 1 << 20) && !fits(packed, codec, (1 << 20) - 1));
            assert!(fits(&packed[1..], codec, 1 << 20), "damaged bytes are left to the decoder");
        }
    }

    #[test]
    fn a_damaged_byte_in_a_foreign_file_does_no_harm() {
        for sample in SAMPLES.into_iter().chain(CODECS) {
            for index in 0..sample.len() {
                let mut damaged = sample.to_vec();
                damaged[index] ^= 1 << (index % 8);
                if let Ok(columns) = NumberColumns::from_bytes(damaged) {
                    let _ = (0..columns.names().len()).all(|column| columns.read(column).is_ok());
                }
            }
        }
    }

    /// Returns a page with the given zigzag-encoded sizes and additional header fields `more`.
    fn page(unpacked: &[u8], size: &[u8], more: &[u8], bytes: usize) -> Vec<u8> {
        let header = [&[0x15, 0, 0x15], unpacked, &[0x15], size, more, &[0]].concat();
        [header, vec![7; bytes]].concat()
    }

    fn passed(pages: &[u8], mut left: usize) -> Result<usize, InvalidThrift> {
        check_pages(pages, Compression::UNCOMPRESSED, &mut left).map(|()| left)
    }

    #[test]
    fn pages_fill_their_chunk() {
        // A page of three bytes, or five uncompressed bytes, and an empty page.
        let pages = [page(&[10], &[6], &[], 3), page(&[0], &[0], &[], 0)].concat();
        assert_eq!(passed(&pages, 8), Ok(3));
        assert_eq!(passed(&pages, 4), Err(InvalidThrift::Unpacked(5)));
        assert_eq!(passed(&pages[..pages.len() - 1], 8), Err(InvalidThrift::Bytes));
        assert_eq!(passed(&page(&[10], &[8], &[], 3), 8), Err(InvalidThrift::Bytes));
        assert_eq!(passed(&page(&[1], &[6], &[], 3), 8), Err(InvalidThrift::Unpacked(-1)));
    }

    #[test]
    fn a_dictionary_needs_a_byte_for_each_value() {
        // Field 7 is a dictionary header with the number of values and the encoding 0.
        let of = |values| page(&[10], &[6], &[0x4c, 0x15, values, 0x15, 0, 0], 3);
        assert_eq!(passed(&of(10), 8), Ok(3));
        assert_eq!(passed(&of(12), 8), Err(InvalidThrift::Values(6)));
    }

    // The `parquet` crate consumes no bytes for booleans, nor for doubles at the end of a file.
    #[test]
    fn page_headers_with_lists_longer_than_their_bytes_are_refused() {
        const MANY: usize = 0x7fff_ffff;
        let list = |kind: u8| [0xf0 | kind, 0xff, 0xff, 0xff, 0xff, 0x07];
        // The list is a field of the data page header, or a field next to that header.
        let inside = |kind| [&[0x2c, 0x99][..], &list(kind), &[0]].concat();
        let beside = |kind| [&[0x99][..], &list(kind)].concat();
        for more in [&inside as &dyn Fn(u8) -> Vec<u8>, &beside] {
            let refusal = |kind| passed(&page(&[10], &[6], &more(kind), 3), 8);
            assert_eq!(refusal(1), Err(InvalidThrift::Booleans(MANY)));
            assert_eq!(refusal(7), Err(InvalidThrift::Elements(MANY)));
        }
    }
}
