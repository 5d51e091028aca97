//! Tables as Parquet, byte for byte the same every time.

mod decode;
/// For fuzzing, which gets no further than a wrong digest without it.
#[doc(hidden)]
pub mod digest;
mod footer;
mod foreign;
mod parts;
mod thrift;

use std::fs::File;
use std::io::{self, Write};

use arrow::array::{Array, ArrayRef};
use arrow::datatypes::{DataType, Field, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError as WriterError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use parquet::schema::types::ColumnPath;

use self::digest::{Digested, seal, seal_chunks, seal_chunks_in};
use crate::store::key::TaskKey;
use crate::table::Table;

pub use decode::{decode, decode_bytes};
pub use foreign::NumberColumns;
pub use parts::TableFile;
pub use thrift::Claim;

/// Prefix of our entries in a file's metadata.
const PREFIX: &str = "asperity.";
/// Our entries that no caller hears of as such.
const KEY: &str = "key";
const FIELDS: &str = "fields";
const DIGESTED: &str = "digested";

/// Bytes of a block of most disks.
const SMALL: usize = 4096;
/// Rows of a row group: whoever looks at the first rows reads no more.
pub const GROUP: usize = 1 << 16;

/// What a file says of itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metadata {
    /// The task's key; a study's table of many tasks has none.
    pub key: Option<TaskKey>,
    /// Anything else, by name: recipe, versions, inputs.
    pub entries: Vec<(String, String)>,
}

impl Metadata {
    pub fn get(&self, name: &str) -> Option<&str> {
        let found = self.entries.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
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
    #[error("its content does not match its digest")]
    Digest,
    #[error("its footer claims {0}")]
    Footer(#[from] Claim),
    #[error("a page of column `{column}` claims {claim}")]
    Page { column: String, claim: Claim },
    #[error("its parts contradict each other")]
    Malformed,
    /// A column holds something that no table of ours holds.
    #[error("its column `{name}` holds {found}")]
    Schema { name: String, found: DataType },
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

/// Verifies all bytes of a file and returns its metadata.
///
/// # Errors
/// When the file is no Parquet, is damaged, or holds types that are not ours.
pub fn verify(file: File) -> Result<Metadata, ParquetError> {
    TableFile::open(file)?.verified()
}

/// A table as the bytes of a Parquet file.
///
/// Nothing in it depends on time or machine: `created_by` is fixed because its default names the
/// version of the writing crate. Digests of all other bytes lie between the pages and the footer,
/// where readers of Parquet never look: a single flipped bit is found on reading.
pub fn encode(table: &Table, metadata: &Metadata) -> Vec<u8> {
    let batch = table.batch();
    let is_small = batch.columns().iter().map(is_small);
    let properties = properties(batch.schema_ref(), metadata, &is_small.collect::<Vec<_>>());
    let mut bytes = Vec::new();
    let mut writer = writer(&mut bytes, batch.schema(), properties, metadata);
    writer.write(batch).expect("writing to memory cannot fail");
    let written = writer.close().expect("writing to memory cannot fail");
    let sealed = match digested(metadata) {
        Digested::Whole => seal(bytes),
        Digested::Chunks => seal_chunks(bytes, &written).ok(),
    };
    sealed.expect("a finished file has a footer, and column chunks before it")
}

/// Writes a table of `rows` rows from its parts, one of which is in memory at a time. Each part but
/// the last has the rows of one row group. The bytes are those of [`encode`].
pub fn write_parts(
    file: &mut File,
    rows: usize,
    metadata: &Metadata,
    mut parts: impl Iterator<Item = Table>,
) -> io::Result<()> {
    let Some(first) = parts.next() else {
        return Ok(());
    };
    if rows <= GROUP {
        return file.write_all(&encode(&first, metadata));
    }
    let schema = first.batch().schema();
    // Even a row group of truth values is larger than a block.
    let properties = properties(&schema, metadata, &vec![false; schema.fields().len()]);
    let mut writer = writer(&mut *file, schema, properties, metadata);
    for part in std::iter::once(first).chain(parts) {
        writer.write(part.batch()).map_err(unwritten)?;
    }
    let written = writer.close().map_err(unwritten)?;
    seal_chunks_in(file, &written)
}

fn unwritten(error: WriterError) -> io::Error {
    match error {
        WriterError::External(error) => match error.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(error) => io::Error::other(error),
        },
        error => io::Error::other(error),
    }
}

fn writer<W: Write + Send>(
    out: W,
    schema: SchemaRef,
    properties: WriterProperties,
    metadata: &Metadata,
) -> ArrowWriter<W> {
    let options = ArrowWriterOptions::new()
        .with_properties(properties)
        .with_skip_arrow_metadata(metadata.key.is_some());
    ArrowWriter::try_new_with_options(out, schema, options)
        .expect("our column types have Parquet equivalents")
}

/// A task's table is read whole, or almost; of a table of results, parts are.
fn digested(metadata: &Metadata) -> Digested {
    match metadata.key {
        Some(_) => Digested::Whole,
        None => Digested::Chunks,
    }
}

fn properties(schema: &SchemaRef, metadata: &Metadata, is_small: &[bool]) -> WriterProperties {
    let entry = |name: &str, value: String| KeyValue::new(format!("{PREFIX}{name}"), value);
    let fields = || decode::columns_as_json(schema);
    let own = match metadata.key {
        Some(key) => vec![entry(KEY, key.to_string()), entry(FIELDS, fields())],
        None => vec![entry(DIGESTED, digested(metadata).name().to_owned())],
    };
    let others = metadata.entries.iter().map(|(name, value)| entry(name, value.clone()));
    let level = ZstdLevel::try_new(3).expect("3 is a level of zstd");
    let mut builder = WriterProperties::builder()
        .set_created_by("asperity".to_owned())
        .set_compression(Compression::ZSTD(level))
        .set_key_value_metadata(Some(own.into_iter().chain(others).collect()));
    if digested(metadata) == Digested::Chunks {
        builder = builder.set_max_row_group_row_count(Some(GROUP));
    }
    if is_small.iter().all(|is_small| *is_small) {
        // Where the pages of a column begin, of which there is one.
        builder = builder.set_offset_index_disabled(true);
    }
    for (field, is_small) in schema.fields().iter().zip(is_small) {
        builder = if *is_small {
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
