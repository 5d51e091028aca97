//! Reading of some columns or row groups of a table in a file. Only what is read is verified.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::sync::Arc;

use arrow::datatypes::{Schema, SchemaRef};
use bytes::{Buf, Bytes};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError as ReaderError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{ChunkReader, Length};

use super::decode::{
    self, FileColumns, catch_panics, collected, columns_of, has_chunk_digests, leaf, read_footer,
    read_metadata,
};
use super::digest::{ChunkDigests, MARK};
use super::{Metadata, ParquetError};
use crate::parallel;
use crate::table::Table;

/// Minimum size in bytes of the values for which columns are read on several threads.
const WORTH_THREADS: i64 = 1 << 20;

/// Number of bytes at the end of a file that are read first. If the footer is longer, a second read
/// follows.
const TAIL_READ: u64 = 1 << 16;

/// Open file of a table, from which parts are read.
///
/// Opening the file verifies the footer. Reading a part verifies its column chunks.
#[derive(Debug)]
pub struct TableFile {
    bytes: Source,
    known: FileColumns,
    metadata: Metadata,
}

/// Source of the column chunks of a [`TableFile`].
#[derive(Debug)]
enum Source {
    /// A file, and the digests of its chunks.
    File(File, ChunkDigests),
    /// All bytes of a file with a single digest, which have been verified.
    Memory(Bytes),
}

impl TableFile {
    /// Opens a file and verifies its footer. If the file has a single digest, all bytes are
    /// verified.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not Parquet, or is damaged where it is
    /// verified.
    pub fn open(file: File) -> Result<TableFile, ParquetError> {
        let length = file.metadata()?.len();
        let footer = catch_panics(|| footer(&file, length)).map_err(damaged)?;
        let (bytes, footer) = if has_chunk_digests(&footer) {
            let whole = usize::try_from(length).map_err(|_| ParquetError::Malformed)?;
            let read = |start| end_of(&file, length, length - start as u64);
            let digests = catch_panics(|| ChunkDigests::read(&footer, whole, read));
            (Source::File(file, digests.map_err(damaged)?), footer)
        } else {
            let bytes = decode::read(file)?;
            let footer = decode::verified(&bytes)?;
            (Source::Memory(bytes), footer)
        };
        let metadata = read_metadata(&footer);
        let known = catch_panics(|| columns_of(footer))?;
        Ok(TableFile { bytes, known, metadata })
    }

    /// Verifies all bytes of the file and returns its metadata. Only one column chunk is in memory
    /// at a time.
    ///
    /// # Errors
    /// Returns an error if the file is damaged.
    pub(crate) fn verified(self) -> Result<Metadata, ParquetError> {
        if let Source::File(file, digests) = &self.bytes {
            let mut bytes = vec![0; MARK.len()];
            file.read_exact_at(&mut bytes, 0)?;
            let mut are_whole = bytes == MARK;
            for (chunk, range) in digests.ranges.iter().enumerate() {
                bytes.resize(range.len(), 0);
                file.read_exact_at(&mut bytes, range.start as u64)?;
                are_whole &= digests.matches(chunk, &bytes);
            }
            if !are_whole {
                return Err(ParquetError::Digest);
            }
        }
        Ok(self.metadata)
    }

    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    pub fn schema(&self) -> &SchemaRef {
        &self.known.schema
    }

    pub fn rows(&self) -> usize {
        let rows = self.footer().file_metadata().num_rows();
        usize::try_from(rows).unwrap_or(0)
    }

    fn footer(&self) -> &ParquetMetaData {
        self.known.arrow.metadata()
    }

    /// Reads the first `rows` rows of the columns with the given indices, in the order of the
    /// indices.
    ///
    /// # Errors
    /// Returns an error if a part that is read is damaged.
    pub fn first(&self, columns: &[usize], rows: usize) -> Result<Table, ParquetError> {
        let rows = rows.min(self.rows());
        let mut left = rows;
        let groups = (0..self.groups()).take_while(|&group| {
            let is_needed = left > 0;
            left = left.saturating_sub(self.rows_of(group));
            is_needed
        });
        self.read(columns, &groups.collect::<Vec<_>>(), rows)
    }

    /// Reads some columns of one row group.
    ///
    /// # Errors
    /// Returns an error if these columns are damaged.
    pub fn group(&self, columns: &[usize], group: usize) -> Result<Table, ParquetError> {
        self.read(columns, &[group], self.rows_of(group))
    }

    pub fn groups(&self) -> usize {
        self.footer().num_row_groups()
    }

    pub fn rows_of(&self, group: usize) -> usize {
        let rows = self.footer().row_group(group).num_rows();
        usize::try_from(rows).unwrap_or(0)
    }

    /// Reads the first `rows` rows of the given row groups; only the given columns are read.
    fn read(
        &self,
        columns: &[usize],
        groups: &[usize],
        rows: usize,
    ) -> Result<Table, ParquetError> {
        let read = |&column: &usize| {
            let part = self.part(column, groups)?;
            catch_panics(|| self.column(part, column, groups, rows))
        };
        let results = if self.size(columns, groups) < WORTH_THREADS {
            columns.iter().map(read).collect()
        } else {
            parallel::map(columns, read)
        };
        let tables = results.into_iter().collect::<Result<Vec<Table>, ParquetError>>()?;
        let fields = columns.iter().map(|&column| self.schema().fields()[column].clone());
        let schema = Schema::new(fields.collect::<Vec<_>>());
        let arrays = tables.iter().map(|table| table.batch().column(0).clone());
        Ok(Table::from_arrays(rows, schema, arrays.collect()))
    }

    /// Returns the uncompressed size in bytes of some columns in some row groups, according to the
    /// footer.
    fn size(&self, columns: &[usize], groups: &[usize]) -> i64 {
        let leaves: Vec<usize> =
            columns.iter().filter_map(|&column| leaf(self.footer(), column)).collect();
        let groups_read = groups.iter().map(|&group| self.footer().row_group(group));
        let sizes = groups_read
            .flat_map(|group| leaves.iter().map(|&leaf| group.column(leaf).uncompressed_size()));
        sizes.fold(0, i64::saturating_add)
    }

    /// Reads and verifies the bytes of a column in some row groups.
    fn part(&self, column: usize, groups: &[usize]) -> Result<Part, ParquetError> {
        let (file, digests) = match &self.bytes {
            Source::Memory(bytes) => return Ok(Part::whole(bytes.clone())),
            Source::File(file, digests) => (file, digests),
        };
        let footer = self.footer();
        let width = footer.file_metadata().schema_descr().num_columns();
        let leaf = leaf(footer, column).ok_or(ParquetError::Malformed)?;
        let chunks = groups.iter().map(|group| {
            let chunk = group * width + leaf;
            let range = digests.ranges.get(chunk).ok_or(ParquetError::Malformed)?;
            let mut bytes = vec![0; range.len()];
            file.read_exact_at(&mut bytes, range.start as u64)?;
            if digests.matches(chunk, &bytes) {
                Ok((range.start, Bytes::from(bytes)))
            } else {
                Err(ParquetError::Digest)
            }
        });
        Ok(Part(Arc::new(chunks.collect::<Result<_, _>>()?)))
    }

    fn column(
        &self,
        part: Part,
        column: usize,
        groups: &[usize],
        rows: usize,
    ) -> Result<Table, ParquetError> {
        let arrow = self.known.arrow.clone();
        let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(part, arrow);
        let mask = ProjectionMask::roots(builder.parquet_schema(), [column]);
        let reader = builder
            .with_projection(mask)
            .with_row_groups(groups.to_vec())
            .with_limit(rows)
            .with_batch_size(rows.max(1))
            .build()?;
        let field = self.schema().fields()[column].clone();
        let table = collected(reader, Arc::new(Schema::new(vec![field])))?;
        if table.rows() == rows { Ok(table) } else { Err(ParquetError::Malformed) }
    }
}

fn damaged(error: ParquetError) -> ParquetError {
    match error {
        ParquetError::Read(error) => ParquetError::Read(error),
        _ => ParquetError::Digest,
    }
}

/// Reads the last `wanted` bytes of a file of `length` bytes, or all if there are not so many.
fn end_of(file: &File, length: u64, wanted: u64) -> io::Result<Bytes> {
    let wanted = length.min(wanted);
    let mut bytes = vec![0; usize::try_from(wanted).map_err(io::Error::other)?];
    file.read_exact_at(&mut bytes, length - wanted)?;
    Ok(bytes.into())
}

/// Reads the footer of a file of `length` bytes without verifying it.
fn footer(file: &File, length: u64) -> Result<ParquetMetaData, ParquetError> {
    match read_footer(&end_of(file, length, TAIL_READ)?, length) {
        Err(ParquetError::Parquet(ReaderError::NeedMoreData(wanted))) => {
            read_footer(&end_of(file, length, wanted as u64)?, length)
        }
        read => read,
    }
}

/// Bytes of some column chunks, each with its offset in the file.
#[derive(Clone)]
struct Part(Arc<Vec<(usize, Bytes)>>);

impl Part {
    fn whole(bytes: Bytes) -> Part {
        Part(Arc::new(vec![(0, bytes)]))
    }

    /// Returns the bytes from the offset `start` in the file to the end of the chunk that contains
    /// this offset.
    fn suffix_at(&self, start: u64) -> Result<Bytes, ReaderError> {
        let found = self.0.iter().find_map(|(first, bytes)| {
            let offset = usize::try_from(start).ok()?.checked_sub(*first)?;
            (offset <= bytes.len()).then(|| bytes.slice(offset..))
        });
        found.ok_or_else(|| {
            ReaderError::General(format!("byte {start} is in no column that was read"))
        })
    }
}

impl Length for Part {
    fn len(&self) -> u64 {
        let ends = self.0.iter().map(|(first, bytes)| first + bytes.len());
        ends.max().unwrap_or(0) as u64
    }
}

impl ChunkReader for Part {
    type T = bytes::buf::Reader<Bytes>;

    fn get_read(&self, start: u64) -> Result<Self::T, ReaderError> {
        Ok(self.suffix_at(start)?.reader())
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ReaderError> {
        let bytes = self.suffix_at(start)?;
        if bytes.len() >= length {
            Ok(bytes.slice(..length))
        } else {
            Err(ReaderError::EOF(format!("{length} bytes from byte {start} on are not there")))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Seek, Write};

    use super::*;
    use crate::column::{
        Column, ColumnKind, flags, integers, optional_reals, optional_texts, reals,
    };
    use crate::parquet::{Columns, GROUP, Metadata, decode_bytes, encode, write_parts};

    /// Number of rows of the test table, which has several row groups.
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
        for (columns, rows) in [
            (vec![3, 0], 5),
            (vec![2], ROWS),
            (vec![4, 1], (1 << 16) + 1),
            (vec![], 7),
            (vec![1], 0),
        ] {
            let part = file.first(&columns, rows).unwrap();
            assert_eq!(part, whole.project(&columns).slice(0..rows), "{columns:?}, {rows}");
        }
        let groups = (0..3).map(|group| file.group(&[2, 3], group).unwrap());
        let stacked = Table::stack(&groups.collect::<Vec<_>>()).unwrap();
        assert_eq!(stacked, whole.project(&[2, 3]));
    }

    #[test]
    fn writing_in_parts_gives_the_same_bytes() {
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
    fn verification_by_chunks_finds_every_flipped_bit() {
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

    // Files of tasks have a single digest, and so do published tables of older versions.
    #[test]
    fn a_file_with_one_digest_is_read_in_parts_too() {
        let whole = table(10);
        let key = crate::key::TaskKey::new("test", 1, crate::key::Digest::from_params(&()), &[]);
        let metadata = Metadata { key: Some(key), entries: Vec::new() };
        let file = TableFile::open(file(&encode(&whole, &metadata))).unwrap();
        assert_eq!(file.metadata(), &metadata);
        assert_eq!(
            file.first(&[1, 3], 4).unwrap(),
            whole.project(&[1, 3]).slice(0..4).without_wording()
        );
    }

    #[test]
    fn damage_in_one_column_does_not_affect_others() {
        let whole = table(ROWS);
        let sound = bytes(&whole);
        let opened = open(&whole);
        let Source::File(_, digests) = &opened.bytes else {
            panic!("results are digested by column chunk");
        };
        // Damage the second row group of `area`.
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

    // The footer of so many columns is longer than the first read of the end of a file.
    #[test]
    fn a_long_footer_is_read_to_its_beginning() {
        let names: Vec<&'static str> = (0..700)
            .map(|number| &*Box::leak(format!("column {number}").into_boxed_str()))
            .collect();
        let column = |name| Column::result(name, ColumnKind::Real, "1", "one of very many columns");
        let values = (0..2000).map(f64::from).collect::<Vec<_>>();
        let columns = names.iter().map(|name| (column(name), reals(values.clone())));
        let wide = Table::new(2000, columns.collect());
        assert!(bytes(&wide).len() as u64 > TAIL_READ);
        assert_eq!(open(&wide).first(&[699], 2000).unwrap(), wide.project(&[699]));
    }
}
