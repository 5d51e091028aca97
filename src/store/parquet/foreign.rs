//! Columns of numbers from anybody's Parquet file.

use arrow::array::{Array, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float64Type};
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::ParquetError;
use super::decode::unless_it_panics;

/// The names of the columns that hold numbers, and these numbers; a row where one is null holds
/// none.
///
/// # Errors
/// When the bytes are no Parquet, are damaged, or hold more rows than `most`.
pub fn numbers(bytes: Vec<u8>, most: usize) -> Result<Vec<(String, Vec<f64>)>, ParquetError> {
    unless_it_panics(|| {
        let file = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes))?;
        let rows = usize::try_from(file.metadata().file_metadata().num_rows());
        if !rows.is_ok_and(|rows| rows <= most) {
            return Err(ParquetError::Malformed);
        }
        // Only these are decoded: the rest may be large, or made to take for ever.
        let fields = file.schema().fields().iter().enumerate();
        let numbers = fields.filter(|(_, field)| field.data_type().is_numeric());
        let wanted = ProjectionMask::roots(file.parquet_schema(), numbers.map(|(place, _)| place));
        let reader = file.with_projection(wanted).build()?;
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        let mut rows = 0;
        for batch in reader {
            let batch = batch?;
            rows += batch.num_rows();
            if rows > most {
                return Err(ParquetError::Malformed);
            }
            let fields = batch.schema();
            let numbers = fields.fields().iter().zip(batch.columns());
            for (field, column) in numbers {
                let column = cast(column, &DataType::Float64)?;
                let values = column.as_primitive::<Float64Type>();
                let values = (0..values.len())
                    .map(|row| values.is_valid(row).then(|| values.value(row)))
                    .map(|value| value.unwrap_or(f64::NAN));
                match columns.iter_mut().find(|(name, _)| name == field.name()) {
                    Some((_, known)) => known.extend(values),
                    None => columns.push((field.name().clone(), values.collect())),
                }
            }
        }
        Ok(columns)
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Metadata, encode};
    use super::*;
    use crate::store::column::{Column, ColumnKind, reals, texts};
    use crate::store::table::Table;

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
        let bytes = table_of_a_word_and_two_numbers();
        let found = numbers(bytes.clone(), 10).unwrap();
        let expected = [("one", vec![1.0, 2.0]), ("other", vec![3.0, 4.0])];
        assert_eq!(
            found,
            expected.map(|(name, values)| (name.to_owned(), values))
        );
        assert!(numbers(bytes, 1).is_err());
        assert!(numbers(b"PAR1PAR1".to_vec(), 10).is_err());
    }

    #[test]
    fn damage_in_columns_that_are_no_numbers_is_not_met() {
        let mut bytes = table_of_a_word_and_two_numbers();
        let file = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes.clone())).unwrap();
        let (start, length) = file.metadata().row_group(0).column(0).byte_range();
        let words = usize::try_from(start).unwrap()..usize::try_from(start + length).unwrap();
        bytes[words].fill(0xff);
        assert_eq!(numbers(bytes, 2).unwrap().len(), 2);
    }
}
