//! Tables as Parquet, byte for byte the same every time.

/// For fuzzing, which gets no further than a wrong digest without it.
#[doc(hidden)]
pub mod digest;
mod schema;

use std::fs::File;
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use arrow::array::{Array, ArrayRef};
use arrow::datatypes::{DataType, Field};
use bytes::Bytes;
use digest::{seal, verified};
use parquet::arrow::ArrowWriter;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::metadata::{KeyValue, ParquetMetaData, ParquetMetaDataReader};
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use parquet::schema::types::ColumnPath;

use crate::store::column::{ColumnKind, Role};
use crate::store::key::TaskKey;
use crate::store::table::Table;

/// Prefix of our entries in a file's metadata.
const PREFIX: &str = "asperity.";
/// Rows read at a time; a file that claims more than it holds gets no more memory than these need.
const BATCH: usize = 1 << 16;
/// Our entries that no caller hears of as such.
const KEY: &str = "key";
const FIELDS: &str = "fields";
/// Bytes of a block of most disks.
const SMALL: usize = 4096;

/// What a file says of itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metadata {
    /// The task's key; a study's table of many tasks has none.
    pub key: Option<TaskKey>,
    /// Anything else, by name: recipe, versions, inputs.
    pub entries: Vec<(String, String)>,
}

impl Metadata {
    /// An entry by name.
    pub fn get(&self, name: &str) -> Option<&str> {
        let found = self.entries.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// Which columns to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// All.
    All,
    /// All but those that fill disks.
    Light,
}

/// A file is no table of ours.
#[derive(Debug, thiserror::Error)]
pub enum ParquetError {
    /// It is no Parquet, or a damaged one.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
    /// Its columns cannot be decoded.
    #[error(transparent)]
    Arrow(#[from] arrow::error::ArrowError),
    /// It cannot be read to its end.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// Its bytes are not those that were written.
    #[error("its content does not match its digest")]
    Digest,
    /// Its parts contradict each other.
    #[error("its parts contradict each other")]
    Malformed,
    /// A column holds something that no table of ours holds.
    #[error("its column `{name}` holds {found}")]
    Schema {
        /// The column.
        name: String,
        /// Its type.
        found: DataType,
    },
    /// What it says of its columns is not true of them.
    #[error("it does not hold the columns that it names")]
    Columns,
    /// It is another task's table, or another stage's.
    #[error("it does not hold the table of {owner}")]
    Foreign {
        /// Whose table was asked for.
        owner: String,
    },
}

/// A table as the bytes of a Parquet file.
///
/// Nothing in it depends on time or machine: `created_by` is fixed because its default names the
/// version of the writing crate. A digest of all other bytes lies between the pages and the
/// footer, where readers of Parquet never look: a single flipped bit is found on reading.
pub(crate) fn encode(table: &Table, metadata: &Metadata) -> Vec<u8> {
    let batch = table.batch();
    let properties = properties(table, metadata);
    let mut bytes = Vec::new();
    let options = ArrowWriterOptions::new()
        .with_properties(properties)
        .with_skip_arrow_metadata(metadata.key.is_some());
    let mut writer = ArrowWriter::try_new_with_options(&mut bytes, batch.schema(), options)
        .expect("our column types have Parquet equivalents");
    writer.write(batch).expect("writing to memory cannot fail");
    writer.close().expect("writing to memory cannot fail");
    seal(bytes).expect("a finished file has a footer")
}

fn read(mut file: File) -> Result<Bytes, ParquetError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes.into())
}

fn properties(table: &Table, metadata: &Metadata) -> WriterProperties {
    let entry = |name: &str, value: String| KeyValue::new(format!("{PREFIX}{name}"), value);
    let fields = || schema::told(table.batch().schema_ref());
    let key = metadata.key.map(|key| {
        let key = entry(KEY, key.to_string());
        [key, entry(FIELDS, fields())]
    });
    let others = metadata
        .entries
        .iter()
        .map(|(name, value)| entry(name, value.clone()));
    let level = ZstdLevel::try_new(3).expect("3 is a level of zstd");
    let mut builder = WriterProperties::builder()
        .set_created_by("asperity".to_owned())
        .set_compression(Compression::ZSTD(level))
        .set_key_value_metadata(Some(key.into_iter().flatten().chain(others).collect()));
    let batch = table.batch();
    if batch.columns().iter().all(is_small) {
        // Where the pages of a column begin, of which there is one.
        builder = builder.set_offset_index_disabled(true);
    }
    for (field, array) in batch.schema_ref().fields().iter().zip(batch.columns()) {
        builder = if is_small(array) {
            plain(builder, column_path(field))
        } else {
            encoding(builder, column_path(field), field.data_type())
        };
    }
    builder.build()
}

/// Whether a column fits a block of the disk anyhow. A study has tens of thousands of tables with
/// one row: setting up compression, dictionaries and statistics would cost more than the rest.
fn is_small(array: &ArrayRef) -> bool {
    let size = array.to_data().get_slice_memory_size();
    size.is_ok_and(|bytes| bytes <= SMALL)
}

fn plain(builder: WriterPropertiesBuilder, path: ColumnPath) -> WriterPropertiesBuilder {
    builder
        .set_column_compression(path.clone(), Compression::UNCOMPRESSED)
        .set_column_dictionary_enabled(path.clone(), false)
        .set_column_statistics_enabled(path, EnabledStatistics::None)
}

/// Where the values of a column are; those of a list have a name of their own.
fn column_path(field: &Field) -> ColumnPath {
    let mut parts = vec![field.name().clone()];
    if let DataType::LargeList(_) = field.data_type() {
        parts.extend(["list".to_owned(), "element".to_owned()]);
    }
    ColumnPath::new(parts)
}

/// Floating-point fields compress best with their bytes regrouped and no dictionary.
fn encoding(
    builder: WriterPropertiesBuilder,
    path: ColumnPath,
    data_type: &DataType,
) -> WriterPropertiesBuilder {
    match data_type {
        DataType::LargeList(_) => builder
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, Encoding::BYTE_STREAM_SPLIT),
        DataType::LargeBinary => builder.set_column_dictionary_enabled(path, false),
        _ => builder,
    }
}

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
    let bytes = verified(bytes)?;
    unless_it_panics(|| decode_verified(bytes, columns))
}

/// The reader of Parquet panics at some files that were made to break it, with the right digest.
fn unless_it_panics<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    // Nothing that it has touched is used again.
    catch_unwind(AssertUnwindSafe(read)).unwrap_or(Err(ParquetError::Malformed))
}

fn decode_verified(bytes: Bytes, columns: Columns) -> Result<(Table, Metadata), ParquetError> {
    let footer = footer(&bytes)?;
    let metadata = read_metadata(&footer);
    let told = entries(&footer).find(|entry| entry.key.strip_prefix(PREFIX) == Some(FIELDS));
    let told = told.and_then(|entry| entry.value.clone());
    let arrow = schema::read(Arc::new(footer), told.as_deref())?;
    let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(bytes, arrow);
    let schema = builder.schema().clone();
    for field in schema.fields() {
        if !ColumnKind::holds(field.data_type()) {
            return Err(ParquetError::Schema {
                name: field.name().clone(),
                found: field.data_type().clone(),
            });
        }
    }
    let chosen = (0..schema.fields().len()).filter(|&index| {
        let role = schema.field(index).metadata().get("role");
        columns == Columns::All || role.map(String::as_str) != Some(Role::Heavy.name())
    });
    let mask = ProjectionMask::roots(builder.parquet_schema(), chosen);
    let rows = usize::try_from(builder.metadata().file_metadata().num_rows()).unwrap_or(0);
    let reader = builder
        .with_projection(mask)
        .with_batch_size(rows.clamp(1, BATCH))
        .build()?;
    let schema = reader_schema(&reader);
    let batches = reader.collect::<Result<Vec<_>, _>>()?;
    let batch = arrow::compute::concat_batches(&schema, &batches)?;
    Ok((Table::from(batch), metadata))
}

fn reader_schema(
    reader: &impl arrow::record_batch::RecordBatchReader,
) -> arrow::datatypes::SchemaRef {
    let schema = reader.schema();
    // The file's own metadata would otherwise travel with the table into others.
    Arc::new(
        schema
            .as_ref()
            .clone()
            .with_metadata(arrow::datatypes::Metadata::new()),
    )
}

fn read_metadata(footer: &ParquetMetaData) -> Metadata {
    let mut metadata = Metadata::default();
    for entry in entries(footer) {
        let Some(name) = entry.key.strip_prefix(PREFIX) else {
            continue;
        };
        let value = entry.value.clone().unwrap_or_default();
        match name {
            KEY => metadata.key = value.parse().ok(),
            FIELDS => {}
            _ => metadata.entries.push((name.to_owned(), value)),
        }
    }
    metadata
}

/// What a file says of itself.
///
/// # Errors
/// When the file is no Parquet, or a damaged one.
pub fn metadata(file: File) -> Result<Metadata, ParquetError> {
    let bytes = verified(read(file)?)?;
    unless_it_panics(|| Ok(read_metadata(&footer(&bytes)?)))
}

fn footer(bytes: &Bytes) -> Result<ParquetMetaData, ParquetError> {
    let reader = ParquetMetaDataReader::new();
    Ok(reader.parse_and_finish(bytes)?)
}

fn entries(footer: &ParquetMetaData) -> impl Iterator<Item = &KeyValue> {
    let entries = footer.file_metadata().key_value_metadata();
    entries.into_iter().flatten()
}
