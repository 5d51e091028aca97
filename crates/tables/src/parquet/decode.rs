//! Tables from the bytes of Parquet files.

use std::fs::File;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use arrow::array::RecordBatchOptions;
use arrow::compute::concat_batches;
use arrow::datatypes::SchemaRef;
use arrow::record_batch::RecordBatch;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};
use parquet::file::metadata::{KeyValue, ParquetMetaData};

use super::digest::{self, Digested};
use super::{Columns, DIGESTED, FIELDS, KEY, Metadata, PREFIX, ParquetError, footer, schema};
use crate::table::Table;

/// Rows read at a time; a file that claims more than it holds gets no more memory than these need.
const BATCH: usize = 1 << 16;

/// A table and what its file says of itself.
///
/// # Errors
/// When the file is no Parquet, is damaged, or holds types that are not ours.
pub fn decode(file: File, columns: Columns) -> Result<(Table, Metadata), ParquetError> {
    decode_bytes(read(file)?, columns)
}

/// A table and what its file says of itself, from the bytes of the file.
///
/// # Errors
/// As [`decode`].
pub fn decode_bytes(bytes: Bytes, columns: Columns) -> Result<(Table, Metadata), ParquetError> {
    let footer = verified(&bytes)?;
    unless_it_panics(|| decode_verified(bytes, footer, columns))
}

/// All bytes of a file.
pub(super) fn read(mut file: File) -> Result<Bytes, ParquetError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes.into())
}

/// The footer of a file whose bytes are all as they were written.
pub(super) fn verified(bytes: &Bytes) -> Result<ParquetMetaData, ParquetError> {
    let verified = || {
        let footer = footer::read(bytes)?;
        match digest::holds(bytes, &footer, digested(&footer)) {
            true => Ok(footer),
            false => Err(ParquetError::Digest),
        }
    };
    // Whatever the reader makes of bytes that nobody has written says nothing.
    unless_it_panics(verified).map_err(|_| ParquetError::Digest)
}

/// The reader of Parquet panics at some files that were made to break it, with the right digest.
pub(super) fn unless_it_panics<T>(
    read: impl FnOnce() -> Result<T, ParquetError>,
) -> Result<T, ParquetError> {
    // Nothing that it has touched is used again.
    catch_unwind(AssertUnwindSafe(read)).unwrap_or(Err(ParquetError::Malformed))
}

fn decode_verified(
    bytes: Bytes,
    footer: ParquetMetaData,
    columns: Columns,
) -> Result<(Table, Metadata), ParquetError> {
    let metadata = read_metadata(&footer);
    let known = columns_of(footer)?;
    let rows = known.arrow.metadata().file_metadata().num_rows();
    let rows = usize::try_from(rows).unwrap_or(0);
    let (chosen, schema) = match columns {
        Columns::Light => known.light,
        Columns::All => known.all(),
    };
    let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(bytes, known.arrow);
    let mask = ProjectionMask::roots(builder.parquet_schema(), chosen.iter().copied());
    let reader = builder.with_projection(mask).with_batch_size(rows.clamp(1, BATCH)).build()?;
    Ok((collected(reader, schema)?, metadata))
}

/// The columns of a file.
pub(super) fn columns_of(footer: ParquetMetaData) -> Result<schema::Known, ParquetError> {
    let told = entry(&footer, FIELDS).map(str::to_owned);
    schema::read(Arc::new(footer), told.as_deref())
}

/// All rows, under these columns.
pub(super) fn collected(
    reader: ParquetRecordBatchReader,
    schema: SchemaRef,
) -> Result<Table, ParquetError> {
    let mut batches = reader.collect::<Result<Vec<_>, _>>()?;
    let batch = match batches.len() {
        1 => batches.remove(0),
        _ => concat_batches(&schema, &batches)?,
    };
    let options = RecordBatchOptions::new().with_row_count(Some(batch.num_rows()));
    let columns = batch.columns().to_vec();
    let batch = RecordBatch::try_new_with_options(schema, columns, &options)?;
    Ok(Table::from(batch))
}

pub(super) fn read_metadata(footer: &ParquetMetaData) -> Metadata {
    let mut metadata = Metadata::default();
    for entry in entries(footer) {
        let Some(name) = entry.key.strip_prefix(PREFIX) else {
            continue;
        };
        let value = entry.value.clone().unwrap_or_default();
        match name {
            KEY => metadata.key = value.parse().ok(),
            FIELDS | DIGESTED => {}
            _ => metadata.entries.push((name.to_owned(), value)),
        }
    }
    metadata
}

/// How a file was digested; before version 2 of the tables of results, all were as a whole.
pub(super) fn digested(footer: &ParquetMetaData) -> Digested {
    match entry(footer, DIGESTED) == Some(Digested::Chunks.name()) {
        true => Digested::Chunks,
        false => Digested::Whole,
    }
}

fn entry<'a>(footer: &'a ParquetMetaData, name: &str) -> Option<&'a str> {
    let mut entries = entries(footer);
    let found = entries.find(|entry| entry.key.strip_prefix(PREFIX) == Some(name))?;
    found.value.as_deref()
}

fn entries(footer: &ParquetMetaData) -> impl Iterator<Item = &KeyValue> {
    let entries = footer.file_metadata().key_value_metadata();
    entries.into_iter().flatten()
}
