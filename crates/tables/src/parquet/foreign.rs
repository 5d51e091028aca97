//! Reading of numeric columns from Parquet files of other programs.

use std::sync::Arc;

use arrow::array::AsArray;
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};

use super::ParquetError;
use super::decode::{catch_panics, read_footer};

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
            let footer = Arc::new(read_footer(&bytes, bytes.len() as u64)?);
            // Types of Arrow in the file, such as dictionaries, would hide numbers.
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
        usize::try_from(self.file.metadata().file_metadata().num_rows()).unwrap_or(usize::MAX)
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
        let file = self.file.clone();
        let file = ParquetRecordBatchReaderBuilder::new_with_metadata(self.bytes.clone(), file);
        let mask = ProjectionMask::roots(file.parquet_schema(), [index]);
        let mut numbers = Vec::new();
        for batch in file.with_projection(mask).build()? {
            let column = cast(batch?.column(0), &DataType::Float64)?;
            let values = column.as_primitive::<Float64Type>().iter();
            numbers.extend(values.map(|value| value.unwrap_or(f64::NAN)));
            if numbers.len() > self.rows() {
                break;
            }
        }
        if numbers.len() == self.rows() { Ok(numbers) } else { Err(ParquetError::Malformed) }
    }

    fn field(&self, index: usize) -> &Field {
        self.file.schema().field(index)
    }
}

#[cfg(test)]
mod tests {
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
}
