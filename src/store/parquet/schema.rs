//! What the file of a task's table says of its columns.
//!
//! Arrow's own schema takes nine kilobytes of a file that may hold one row of numbers, and half of
//! the time that a small task takes. All types but two survive without it, and what else it says
//! fits one line of JSON. Tables of results carry Arrow's schema, for other programs to read.

use std::sync::Arc;

use arrow::datatypes::{DataType, Field, Metadata, Schema};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::file::metadata::ParquetMetaData;
use serde::{Deserialize, Serialize};

use super::ParquetError;
use crate::store::column::ColumnKind;

/// Role, unit and meaning of a column, as far as they are known.
#[derive(Serialize, Deserialize)]
struct Told([Option<String>; 3]);

const KEYS: [&str; 3] = ["role", "unit", "meaning"];

/// The columns in a line of JSON: role, unit and meaning of each, in order.
pub fn told(schema: &Schema) -> String {
    let column = |field: &Arc<Field>| Told(KEYS.map(|key| field.metadata().get(key).cloned()));
    let columns: Vec<Told> = schema.fields().iter().map(column).collect();
    serde_json::to_string(&columns).expect("three texts are plain data")
}

/// The columns as they were written: a task's file says so itself, others leave it to Arrow.
///
/// # Errors
/// When the columns in the file are not those that were told of.
pub fn read(
    footer: Arc<ParquetMetaData>,
    told: Option<&str>,
) -> Result<ArrowReaderMetadata, ParquetError> {
    let options = ArrowReaderOptions::new();
    let Some(told) = told else {
        return Ok(ArrowReaderMetadata::try_new(footer, options)?);
    };
    let plain = options.clone().with_skip_arrow_metadata(true);
    let plain = ArrowReaderMetadata::try_new(footer.clone(), plain)?;
    let schema = restored(plain.schema(), told).ok_or(ParquetError::Columns)?;
    let options = options.with_schema(Arc::new(schema));
    Ok(ArrowReaderMetadata::try_new(footer, options)?)
}

/// The schema of a table again, from what Parquet knows of its types and what was told; `None` if
/// the two do not fit.
fn restored(parquet: &Schema, told: &str) -> Option<Schema> {
    let columns: Vec<Told> = serde_json::from_str(told).ok()?;
    if columns.len() != parquet.fields().len() {
        return None;
    }
    let fields = parquet.fields().iter().zip(columns);
    let field = |(field, Told(values)): (&Arc<Field>, Told)| {
        let known = KEYS.into_iter().zip(values);
        let known = known.filter_map(|(key, value)| Some((key, value?)));
        let metadata = known.fold(Metadata::new(), |all, (key, value)| all.with(key, value));
        let kind = our_type(field.data_type());
        Field::new(field.name(), kind, true).with_metadata(metadata)
    };
    Some(Schema::new(fields.map(field).collect::<Vec<_>>()))
}

/// Parquet does not know how long the offsets of lists and bytes are.
fn our_type(found: &DataType) -> DataType {
    match found {
        DataType::Binary => ColumnKind::Bytes.data_type(),
        DataType::List(_) => ColumnKind::Reals.data_type(),
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{self as parquet, Columns, Metadata};
    use super::*;
    use crate::store::column::Column;
    use crate::store::provenance::Provenance;
    use crate::store::table::Table;

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
            read_as: vec![],
        };
        provenance.metadata()
    }

    fn read(bytes: &[u8]) -> Result<Table, ParquetError> {
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, bytes).unwrap();
        std::io::Seek::rewind(&mut file).unwrap();
        parquet::decode(file, Columns::All).map(|(table, _)| table)
    }

    #[test]
    fn columns_of_every_kind_come_back_with_unit_and_meaning() {
        let empty = schema();
        let arrays = ColumnKind::ALL.map(|kind| arrow::array::new_null_array(&kind.data_type(), 2));
        let table = Table::of(2, empty, arrays.to_vec());
        assert_eq!(read(&parquet::encode(&table, &a_task())).unwrap(), table);
    }

    #[test]
    fn what_is_told_of_other_columns_is_refused() {
        let told = told(&schema());
        assert_eq!(restored(&schema(), &told), Some(schema()));
        let fewer = Schema::new(schema().fields()[1..].to_vec());
        assert_eq!(restored(&fewer, &told), None);
        assert_eq!(restored(&schema(), "nonsense"), None);
    }
}
