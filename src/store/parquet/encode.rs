//! Tables to the bytes of Parquet files.

use arrow::array::{Array, ArrayRef};
use arrow::datatypes::{DataType, Field};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use parquet::schema::types::ColumnPath;

use super::digest::{Digested, seal, seal_chunks};
use super::{DIGESTED, FIELDS, KEY, Metadata, PREFIX, schema};
use crate::store::table::Table;

/// Bytes of a block of most disks.
const SMALL: usize = 4096;
/// Rows of a row group: whoever looks at the first rows reads no more.
const GROUP: usize = 1 << 16;

/// A table as the bytes of a Parquet file.
///
/// Nothing in it depends on time or machine: `created_by` is fixed because its default names the
/// version of the writing crate. Digests of all other bytes lie between the pages and the footer,
/// where readers of Parquet never look: a single flipped bit is found on reading.
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
    let written = writer.close().expect("writing to memory cannot fail");
    let sealed = match digested(metadata) {
        Digested::Whole => seal(bytes),
        Digested::Chunks => seal_chunks(bytes, &written),
    };
    sealed.expect("a finished file has a footer, and column chunks before it")
}

/// A task's table is read whole, or almost; of a table of results, parts are.
fn digested(metadata: &Metadata) -> Digested {
    match metadata.key {
        Some(_) => Digested::Whole,
        None => Digested::Chunks,
    }
}

fn properties(table: &Table, metadata: &Metadata) -> WriterProperties {
    let entry = |name: &str, value: String| KeyValue::new(format!("{PREFIX}{name}"), value);
    let fields = || schema::told(table.batch().schema_ref());
    let own = match metadata.key {
        Some(key) => vec![entry(KEY, key.to_string()), entry(FIELDS, fields())],
        None => vec![entry(DIGESTED, digested(metadata).name().to_owned())],
    };
    let others = metadata
        .entries
        .iter()
        .map(|(name, value)| entry(name, value.clone()));
    let level = ZstdLevel::try_new(3).expect("3 is a level of zstd");
    let mut builder = WriterProperties::builder()
        .set_created_by("asperity".to_owned())
        .set_compression(Compression::ZSTD(level))
        .set_key_value_metadata(Some(own.into_iter().chain(others).collect()));
    if digested(metadata) == Digested::Chunks {
        builder = builder.set_max_row_group_row_count(Some(GROUP));
    }
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
