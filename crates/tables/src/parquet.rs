//! Reading and writing of tables as Parquet files. Equal tables give equal bytes.

mod decode;
/// This module is public only for fuzz tests, which must write valid digests.
#[doc(hidden)]
pub mod digest;
mod foreign;
mod parts;

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

use self::digest::{CHUNKS, seal, seal_chunks, seal_chunks_in};
use crate::key::TaskKey;
use crate::table::Table;

pub use decode::{decode, decode_bytes};
pub use foreign::NumberColumns;
pub use parts::TableFile;

/// Prefix of the names of this program's entries in the metadata of a file.
const PREFIX: &str = "asperity.";
// Names of the entries that are not in `Metadata::entries`.
const KEY: &str = "key";
const FIELDS: &str = "fields";
const DIGESTED: &str = "digested";

/// Maximum size in bytes of a column that is stored without compression: a block of most disks.
const SMALL: usize = 4096;
/// Number of rows of a row group, the smallest number of rows that can be read.
pub const GROUP: usize = 1 << 16;

/// Metadata of a file about the whole table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metadata {
    /// Key of the task, or `None` for a published table, which has rows of many tasks.
    pub key: Option<TaskKey>,
    /// Other entries as names and values, such as recipe, versions and inputs.
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
    /// All columns except maps, which have the role [`Heavy`](crate::column::Role::Heavy).
    Light,
}

/// Error of reading a Parquet file.
#[derive(Debug, thiserror::Error)]
pub enum ParquetError {
    /// The file is not a Parquet file, or it is damaged.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
    /// A column cannot be decoded.
    #[error(transparent)]
    Arrow(#[from] arrow::error::ArrowError),
    /// The operating system cannot read the file.
    #[error(transparent)]
    Read(#[from] io::Error),
    #[error("the content does not match the digest in the file")]
    Digest,
    #[error("the rows or columns of the file do not match its footer; create the file again")]
    Malformed,
    /// A column has a type that no table of this program has.
    #[error("column `{name}` has the unsupported type {found}")]
    Schema { name: String, found: DataType },
    #[error("the columns of the file differ from those in its metadata")]
    Columns,
    /// The file contains the table of another task or stage.
    #[error("the file contains the table of another task or stage; expected {owner}")]
    Foreign {
        /// Task or stage whose table was requested.
        owner: String,
    },
}

/// Verifies all bytes of a file and returns its metadata.
///
/// # Errors
/// Returns an error if the file is not Parquet, is damaged, or has columns of unsupported types.
pub fn verify(file: File) -> Result<Metadata, ParquetError> {
    TableFile::open(file)?.verified()
}

/// Encodes a table as the bytes of a Parquet file.
///
/// The bytes depend neither on the time nor on the machine. `created_by` is a constant, because its
/// default contains the version of the `parquet` crate. Digests of all other bytes are stored
/// between the pages and the footer, where other Parquet readers ignore them. They reveal a single
/// flipped bit.
pub fn encode(table: &Table, metadata: &Metadata) -> Vec<u8> {
    let batch = table.batch();
    let is_small = batch.columns().iter().map(is_small);
    let properties = properties(batch.schema_ref(), metadata, &is_small.collect::<Vec<_>>());
    let mut bytes = Vec::new();
    let mut writer = writer(&mut bytes, batch.schema(), properties, metadata);
    writer.write(batch).expect("writing to memory cannot fail");
    let written = writer.close().expect("writing to memory cannot fail");
    // The table of a task is read as a whole, and a published table in parts.
    let sealed = match metadata.key {
        Some(_) => seal(bytes),
        None => seal_chunks(bytes, &written).ok(),
    };
    sealed.expect("a finished file has a footer, and column chunks before it")
}

/// Writes a table of `rows` rows that is given in consecutive parts, so that only one part is in
/// memory at a time.
///
/// All parts except the last must have [`GROUP`] rows. The bytes are the same as from [`encode`].
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
    // No column is small: even a row group of booleans exceeds `SMALL`.
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
        .expect("all column types have Parquet equivalents")
}

fn properties(schema: &SchemaRef, metadata: &Metadata, is_small: &[bool]) -> WriterProperties {
    let entry = |name: &str, value: String| KeyValue::new(format!("{PREFIX}{name}"), value);
    let fields = || decode::roles_as_json(schema);
    let own = match metadata.key {
        Some(key) => vec![entry(KEY, key.to_string()), entry(FIELDS, fields())],
        None => vec![entry(DIGESTED, CHUNKS.to_owned())],
    };
    let others = metadata.entries.iter().map(|(name, value)| entry(name, value.clone()));
    let level = ZstdLevel::try_new(3).expect("3 is a level of zstd");
    let mut builder = WriterProperties::builder()
        .set_created_by("asperity".to_owned())
        .set_compression(Compression::ZSTD(level))
        .set_key_value_metadata(Some(own.into_iter().chain(others).collect()));
    if metadata.key.is_none() {
        builder = builder.set_max_row_group_row_count(Some(GROUP));
    }
    if is_small.iter().all(|is_small| *is_small) {
        // An offset index is useless if each column has only one page.
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

/// Returns true if a column is so small that it is stored without compression, dictionary and
/// statistics.
///
/// A study has tens of thousands of tables with one row. Setting up compression, dictionaries and
/// statistics for them would take longer than everything else.
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

/// Returns the Parquet path of the values of a column. The values of a list are two levels deeper.
fn column_path(field: &Field) -> ColumnPath {
    let mut parts = vec![field.name().clone()];
    if let DataType::LargeList(_) = field.data_type() {
        parts.extend(["list".to_owned(), "element".to_owned()]);
    }
    ColumnPath::new(parts)
}

/// Sets the encoding of a column. Maps compress best with byte-stream split and without dictionary.
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
