//! Decoding of tables from Parquet files.
//!
//! The file of a task does not contain the Arrow schema, which would take nine kilobytes and half
//! of the run time of a small task. Instead, the types of the columns are derived from their
//! Parquet types, and the roles are stored as JSON in the metadata entry `fields`. Published tables
//! contain the Arrow schema for other programs.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use arrow::array::RecordBatchOptions;
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, Field, Metadata as FieldMetadata, Schema, SchemaRef};
use arrow::record_batch::RecordBatch;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};
use parquet::file::metadata::{KeyValue, ParquetMetaData, ParquetMetaDataReader};
use parquet::schema::types::SchemaDescriptor;
use serde::Deserialize;

use super::digest;
use super::{Columns, DIGESTED, FIELDS, KEY, Metadata, PREFIX, ParquetError};
use crate::column::{ColumnKind, ROLE, Role};
use crate::parallel::locked;
use crate::table::Table;

/// Maximum number of rows per batch. It bounds the memory for a file that declares too many rows.
const BATCH: usize = 1 << 16;

/// Reads a table and the metadata of its file.
///
/// # Errors
/// Returns an error if the file is not Parquet, is damaged, or has columns of unsupported types.
pub fn decode(file: File, columns: Columns) -> Result<(Table, Metadata), ParquetError> {
    decode_bytes(read(file)?, columns)
}

/// Decodes a table and its metadata from the bytes of a file.
///
/// # Errors
/// Returns the same errors as [`decode`].
pub fn decode_bytes(bytes: Bytes, columns: Columns) -> Result<(Table, Metadata), ParquetError> {
    let footer = verified(&bytes)?;
    catch_panics(|| decode_verified(bytes, footer, columns))
}

pub(super) fn read(mut file: File) -> Result<Bytes, ParquetError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes.into())
}

/// Reads the footer of a file of `length` bytes, of which `end` are the last ones. If these do not
/// contain the whole footer, the error `NeedMoreData` has its length.
pub(super) fn read_footer(end: &Bytes, length: u64) -> Result<ParquetMetaData, ParquetError> {
    let mut reader = ParquetMetaDataReader::new();
    reader.try_parse_sized(end, length)?;
    Ok(reader.finish()?)
}

/// Verifies all bytes of a file and returns its footer.
pub(super) fn verified(bytes: &Bytes) -> Result<ParquetMetaData, ParquetError> {
    let verified = || {
        let footer = read_footer(bytes, bytes.len() as u64)?;
        if digest::is_intact(bytes, &footer, has_chunk_digests(&footer)) {
            Ok(footer)
        } else {
            Err(ParquetError::Digest)
        }
    };
    // Any error or panic of the `parquet` crate means that the bytes are damaged.
    catch_panics(verified).map_err(|_| ParquetError::Digest)
}

/// Converts panics of the `parquet` crate to errors. Some forged files cause such panics.
pub(super) fn catch_panics<T>(
    read: impl FnOnce() -> Result<T, ParquetError>,
) -> Result<T, ParquetError> {
    // This is unwind safe, because no value that `read` has changed is used after a panic.
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

/// Reads all rows of `reader` into a table with the given schema.
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

/// Returns whether a file has a digest of each column chunk. Published tables before version 2 of
/// their format have a single digest, like the files of tasks.
pub(super) fn has_chunk_digests(footer: &ParquetMetaData) -> bool {
    entry(footer, DIGESTED) == Some(digest::CHUNKS)
}

/// Returns the index of the Parquet leaf column that contains the values of the column with index
/// `column`. Returns `None` if there is no such column.
pub(super) fn leaf(footer: &ParquetMetaData, column: usize) -> Option<usize> {
    let schema = footer.file_metadata().schema_descr();
    (0..schema.num_columns()).find(|&leaf| schema.get_column_root_idx(leaf) == column)
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

/// Description of a column in the metadata entry `fields` of a task's file.
#[derive(Deserialize)]
#[serde(untagged)]
enum StoredColumn {
    /// Role of the column, if it has one.
    Role(Option<String>),
    /// Role, unit and meaning, as in older files. Unit and meaning are ignored.
    Described([Option<String>; 3]),
}

/// Returns the roles of the columns as a JSON list, which is the metadata entry `fields`.
pub(super) fn roles_as_json(schema: &Schema) -> String {
    let roles = schema.fields().iter().map(|field| field.metadata().get(ROLE));
    serde_json::to_string(&roles.collect::<Vec<_>>()).expect("roles are plain text")
}

/// Selected columns of a file: their indices in the file, and a schema of only these columns.
type ColumnSelection = (Arc<[usize]>, SchemaRef);

/// Columns of a file and the Arrow metadata with which they are read.
#[derive(Debug)]
pub(super) struct FileColumns {
    pub arrow: ArrowReaderMetadata,
    pub schema: SchemaRef,
    /// All columns except maps.
    pub light: ColumnSelection,
}

impl FileColumns {
    pub fn all(&self) -> ColumnSelection {
        let indices = (0..self.schema.fields().len()).collect();
        (indices, self.schema.clone())
    }
}

/// Returns the columns of a file, from its metadata entry `fields` if there is one, otherwise from
/// the Arrow schema.
///
/// # Errors
/// Returns an error if the columns do not match the entry `fields` or have unsupported types.
pub(super) fn columns_of(footer: ParquetMetaData) -> Result<FileColumns, ParquetError> {
    let stored = entry(&footer, FIELDS).map(str::to_owned);
    let footer = Arc::new(footer);
    let options = ArrowReaderOptions::new();
    let Some(stored) = stored else {
        let arrow = ArrowReaderMetadata::try_new(footer, options)?;
        let schema = arrow.schema().as_ref().clone();
        // Remove the metadata of the file, which would otherwise be copied to other tables.
        let schema = Arc::new(schema.with_metadata(FieldMetadata::new()));
        check(&schema)?;
        let light = light(&schema);
        return Ok(FileColumns { arrow, schema, light });
    };
    let (schema, light) = restored_columns(&footer, stored)?;
    let arrow = ArrowReaderMetadata::try_new(footer, options.with_schema(schema.clone()))?;
    Ok(FileColumns { arrow, schema, light })
}

/// Parquet types and entry `fields` of a file, with the columns that were restored from them.
type RestoredColumns = (Arc<SchemaDescriptor>, String, (SchemaRef, ColumnSelection));

/// Cache of restored columns, most recent first, because thousands of files have the same columns.
static CACHE: Mutex<VecDeque<RestoredColumns>> = Mutex::new(VecDeque::new());
/// Maximum number of entries of the cache. A study has fewer kinds of tables.
const CACHE_SIZE: usize = 32;

/// Restores the columns of a file, and the selection without maps, from its entry `fields`.
fn restored_columns(
    footer: &Arc<ParquetMetaData>,
    fields: String,
) -> Result<(SchemaRef, ColumnSelection), ParquetError> {
    let parquet = footer.file_metadata().schema_descr_ptr();
    let mut cache = locked(&CACHE);
    let mut known = cache.iter();
    if let Some((_, _, columns)) = known.find(|(of, text, _)| *text == fields && *of == parquet) {
        return Ok(columns.clone());
    }
    let plain = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let plain = ArrowReaderMetadata::try_new(footer.clone(), plain)?;
    let schema = Arc::new(restored(plain.schema(), &fields).ok_or(ParquetError::Columns)?);
    check(&schema)?;
    let columns = (schema.clone(), light(&schema));
    cache.truncate(CACHE_SIZE - 1);
    cache.push_front((parquet, fields, columns.clone()));
    Ok(columns)
}

/// Checks that all columns have supported types.
fn check(schema: &Schema) -> Result<(), ParquetError> {
    let mut fields = schema.fields().iter();
    match fields.find(|field| !ColumnKind::holds(field.data_type())) {
        None => Ok(()),
        Some(field) => Err(ParquetError::Schema {
            name: field.name().clone(),
            found: field.data_type().clone(),
        }),
    }
}

fn light(schema: &Schema) -> ColumnSelection {
    let is_light = |&index: &usize| Role::from_field(schema.field(index)) != Some(Role::Heavy);
    let indices: Arc<[usize]> = (0..schema.fields().len()).filter(is_light).collect();
    let fields: Vec<_> = indices.iter().map(|&index| schema.fields()[index].clone()).collect();
    (indices, Arc::new(Schema::new(fields)))
}

/// Restores the schema of a table from its Parquet types and the stored roles. Returns `None` if
/// the numbers of columns differ or the roles are invalid.
fn restored(parquet: &Schema, roles: &str) -> Option<Schema> {
    let columns: Vec<StoredColumn> = serde_json::from_str(roles).ok()?;
    if columns.len() != parquet.fields().len() {
        return None;
    }
    let fields = parquet.fields().iter().zip(columns);
    let field = |(field, column): (&Arc<Field>, StoredColumn)| {
        let (StoredColumn::Role(role) | StoredColumn::Described([role, ..])) = column;
        let metadata =
            role.map_or_else(FieldMetadata::new, |role| FieldMetadata::new().with(ROLE, role));
        let kind = our_type(field.data_type());
        Field::new(field.name(), kind, true).with_metadata(metadata)
    };
    Some(Schema::new(fields.map(field).collect::<Vec<_>>()))
}

/// Converts the type that Arrow derives from the Parquet type of a column to the type that the
/// column has in a [`Table`]. Lists and bytes get 64-bit offsets, because Parquet does not store
/// the size of offsets.
fn our_type(found: &DataType) -> DataType {
    match found {
        DataType::Binary => ColumnKind::Bytes.data_type(),
        DataType::List(_) => ColumnKind::Reals.data_type(),
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::Column;
    use crate::parquet::encode;
    use crate::store::provenance::Provenance;
    use crate::table::Table;

    fn schema() -> Schema {
        let names = ["a", "b", "c", "d", "e", "f"];
        let column = |(name, kind)| Column::result(name, kind, "m", "a \"word\" on {it}");
        Schema::new(
            names
                .into_iter()
                .zip(ColumnKind::ALL)
                .map(|pair| column(pair).field())
                .collect::<Vec<_>>(),
        )
    }

    fn a_task() -> Metadata {
        let provenance = Provenance {
            stage: "test".to_owned(),
            version: 1,
            recipe: "{}".to_owned(),
            inputs: vec![],
            input_identities: vec![],
        };
        provenance.metadata()
    }

    fn read(bytes: &[u8]) -> Result<Table, ParquetError> {
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, bytes).unwrap();
        std::io::Seek::rewind(&mut file).unwrap();
        decode(file, Columns::All).map(|(table, _)| table)
    }

    fn rows_of_every_kind() -> Table {
        let arrays = ColumnKind::ALL.map(|kind| arrow::array::new_null_array(&kind.data_type(), 2));
        Table::from_arrays(2, schema(), arrays.to_vec())
    }

    #[test]
    fn columns_of_every_kind_are_read_with_their_role() {
        let table = rows_of_every_kind();
        let read = read(&encode(&table, &a_task())).unwrap();
        assert_eq!(read, table.without_wording());
        assert_eq!(read.in_role(Role::Result).names(), table.names());
        assert_eq!(read.described_by(&table), table);
    }

    #[test]
    fn the_file_of_a_task_does_not_depend_on_wording() {
        let table = rows_of_every_kind();
        let plain = table.without_wording();
        assert_eq!(encode(&table, &a_task()), encode(&plain, &a_task()));
    }

    #[test]
    fn files_that_hold_units_and_meanings_are_read_without_them() {
        let stored = r#"[["parameter","m","length"],[null,null,null]]"#;
        let parquet = Schema::new(schema().fields()[..2].to_vec());
        let restored = restored(&parquet, stored).unwrap();
        assert_eq!(restored.field(0).metadata().len(), 1);
        assert_eq!(Role::from_field(restored.field(0)), Some(Role::Parameter));
        assert_eq!(Role::from_field(restored.field(1)), None);
    }

    #[test]
    fn roles_of_other_columns_are_refused() {
        let roles = roles_as_json(&schema());
        let plain = rows_of_every_kind().without_wording();
        assert_eq!(restored(&schema(), &roles).as_ref(), Some(plain.batch().schema_ref().as_ref()));
        let fewer = Schema::new(schema().fields()[1..].to_vec());
        assert_eq!(restored(&fewer, &roles), None);
        assert_eq!(restored(&schema(), "nonsense"), None);
    }
}
