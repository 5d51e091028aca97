//! Columns of numbers from anybody's Parquet file.

use std::sync::Arc;

use arrow::array::{Array, AsArray};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Field, Float64Type};
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::file::metadata::ParquetMetaData;

use super::decode::unless_it_panics;
use super::{ParquetError, footer, pages};

/// The columns of numbers in a file, of which some may be read.
pub struct NumberColumns {
    bytes: Bytes,
    file: ArrowReaderMetadata,
    /// Where they are among all columns.
    places: Vec<usize>,
}

impl NumberColumns {
    /// Those of a file of these bytes.
    ///
    /// # Errors
    /// When the bytes are no Parquet, or are damaged.
    pub fn of(bytes: Vec<u8>) -> Result<NumberColumns, ParquetError> {
        unless_it_panics(|| {
            let bytes = Bytes::from(bytes);
            let footer = Arc::new(footer::read(&bytes)?);
            // What a file says in Arrow's words of its columns is not bounded by its length.
            let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
            let file = ArrowReaderMetadata::try_new(footer, options)?;
            let fields = file.schema().fields().iter().enumerate();
            let numbers = fields.filter(|(_, field)| field.data_type().is_numeric());
            let places = numbers.map(|(place, _)| place).collect();
            Ok(NumberColumns { bytes, file, places })
        })
    }

    /// Their names, in order.
    pub fn names(&self) -> Vec<&str> {
        let places = self.places.iter();
        places.map(|&place| self.field(place).name().as_str()).collect()
    }

    /// How many rows the file says that it has.
    pub fn rows(&self) -> usize {
        usize::try_from(self.footer().file_metadata().num_rows()).unwrap_or(usize::MAX)
    }

    /// The numbers of one of them; a row where it is null holds none.
    ///
    /// # Errors
    /// When the column is damaged, or has not as many rows as the file says.
    pub fn read(&self, column: usize) -> Result<Vec<f64>, ParquetError> {
        let place = self.places[column];
        unless_it_panics(|| self.read_at(place))
    }

    /// Only this one is decoded: the others may be large, or made to take for ever.
    fn read_at(&self, place: usize) -> Result<Vec<f64>, ParquetError> {
        let columns = self.footer().file_metadata().schema_descr();
        let leaves = 0..columns.num_columns();
        let leaf = leaves.into_iter().find(|&leaf| columns.get_column_root_idx(leaf) == place);
        let leaf = leaf.ok_or(ParquetError::Malformed)?;
        let groups = self.footer().row_groups().iter();
        let chunks = groups.map(|group| group.column(leaf));
        pages::check(&self.bytes, chunks, self.rows())?;

        let file = self.file.clone();
        let file = ParquetRecordBatchReaderBuilder::new_with_metadata(self.bytes.clone(), file);
        let mask = ProjectionMask::roots(file.parquet_schema(), [place]);
        let mut numbers = Vec::new();
        for batch in file.with_projection(mask).build()? {
            let column = cast(batch?.column(0), &DataType::Float64)?;
            let values = column.as_primitive::<Float64Type>();
            let values = (0..values.len())
                .map(|row| values.is_valid(row).then(|| values.value(row)))
                .map(|value| value.unwrap_or(f64::NAN));
            numbers.extend(values);
            if numbers.len() > self.rows() {
                break;
            }
        }
        match numbers.len() == self.rows() {
            true => Ok(numbers),
            false => Err(ParquetError::Malformed),
        }
    }

    fn footer(&self) -> &ParquetMetaData {
        self.file.metadata()
    }

    fn field(&self, place: usize) -> &Field {
        self.file.schema().field(place)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Metadata, encode};
    use super::*;
    use crate::column::{Column, ColumnKind, reals, texts};
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
    fn numbers_are_read_and_text_is_passed_over() {
        let columns = NumberColumns::of(table_of_a_word_and_two_numbers()).unwrap();
        assert_eq!((columns.names(), columns.rows()), (vec!["one", "other"], 2));
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
        assert_eq!(columns.read(1).unwrap(), [3.0, 4.0]);
        assert!(NumberColumns::of(b"PAR1PAR1".to_vec()).is_err());
    }

    #[test]
    fn damage_in_columns_that_are_no_numbers_is_not_met() {
        let mut bytes = table_of_a_word_and_two_numbers();
        let file = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes.clone())).unwrap();
        let (start, length) = file.metadata().row_group(0).column(0).byte_range();
        let words = usize::try_from(start).unwrap()..usize::try_from(start + length).unwrap();
        bytes[words].fill(0xff);
        let columns = NumberColumns::of(bytes).unwrap();
        assert_eq!(columns.read(0).unwrap(), [1.0, 2.0]);
    }

    /// Columns of every kind, nested ones among them, with statistics, as others write them.
    const SAMPLES: [&[u8]; 3] = [
        include_bytes!("samples/duckdb.parquet"),
        include_bytes!("samples/polars.parquet"),
        include_bytes!("samples/pyarrow.parquet"),
    ];

    #[test]
    fn files_of_other_programs_are_read() {
        for sample in SAMPLES {
            let columns = NumberColumns::of(sample.to_vec()).unwrap();
            assert_eq!(columns.names(), ["wavenumber", "price", "small", "density"]);
            let read = |column| columns.read(column).unwrap();
            assert_eq!(read(0), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
            assert_eq!(read(1), [1.25; 6]);
            assert_eq!(read(2), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
            assert_eq!(read(3), [0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625]);
        }
    }

    #[test]
    fn any_damaged_byte_of_them_does_no_harm() {
        for sample in SAMPLES {
            for place in 0..sample.len() {
                let mut damaged = sample.to_vec();
                damaged[place] ^= 1 << (place % 8);
                if let Ok(columns) = NumberColumns::of(damaged) {
                    let _ = (0..columns.names().len()).all(|column| columns.read(column).is_ok());
                }
            }
        }
    }
}
