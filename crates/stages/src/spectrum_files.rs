//! Files of power spectral densities: tables of wavenumbers and densities, as CSV or Parquet.
//!
//! The column `wavenumber` holds angular wavenumbers. The column `spectral_density`, or else
//! `density`, holds the density C(q) with ∫ C d²q/(2π)² = h_rms². Other columns are ignored.
//! In a CSV file a name may be followed by its unit in brackets: `wavenumber [1/µm]`, `density
//! [µm^4]`. Fields are separated by commas, semicolons, tabs or spaces, and lines that begin with
//! `#` are comments. The published table of a `measure` stage is such a file.

use thiserror::Error;

use asperity_tables::parquet::{NumberColumns, ParquetError};
use asperity_topography_files::length_ratio;

/// Maximum number of rows of a file. The spectrum of the largest mesh has fewer rows (one per ring
/// of wavevectors).
const MAX_ROWS: usize = 1 << 20;

/// Names of the column of densities, in order of preference.
const DENSITIES: [&str; 2] = ["spectral_density", "density"];
const WAVENUMBER: &str = "wavenumber";

/// Power spectral density that was read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumTable {
    /// Angular wavenumber and density of each row.
    pub points: Vec<[f64; 2]>,
    /// Unit of length of both columns, if the file names one.
    pub unit: Option<String>,
}

impl SpectrumTable {
    /// Returns the ratio of the table's unit of length to `unit`. Returns 1 if one of the two units
    /// is not named, and `None` if one of them is not a length.
    pub fn length_scale(&self, unit: &str) -> Option<f64> {
        match &self.unit {
            Some(own) if !unit.is_empty() => length_ratio(own, unit),
            _ => Some(1.0),
        }
    }
}

/// Reason why a file is not a spectrum. Each message continues a sentence that begins with the path
/// of the file.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum SpectrumFileError {
    #[error("is neither Parquet nor text")]
    Unknown,
    #[error("cannot be read as Parquet: {0}")]
    Parquet(ParquetError),
    #[error("has no column `{wanted}`; its columns are {found}")]
    Missing { wanted: &'static str, found: String },
    #[error("has several columns `{name}`; remove or rename all but one")]
    Repeated { name: &'static str },
    #[error("has {found:?} in line {line} instead of a number")]
    Number { line: usize, found: String },
    #[error("has more than {MAX_ROWS} rows")]
    TooLong,
    #[error("has the unit {found:?} for `{column}`; write it like {wanted}")]
    Unit { column: &'static str, found: String, wanted: &'static str },
    #[error("has a unit for one of its two columns; add the other unit")]
    OneUnit,
}

/// Reads a table of wavenumbers and densities from CSV or Parquet.
///
/// # Errors
/// Returns an error if the bytes are not such a table.
pub fn read(bytes: &[u8]) -> Result<SpectrumTable, SpectrumFileError> {
    if bytes.starts_with(b"PAR1") {
        return read_parquet(bytes);
    }
    let text = std::str::from_utf8(bytes).map_err(|_| SpectrumFileError::Unknown)?;
    read_text(text.trim_start_matches('\u{feff}'))
}

fn read_parquet(bytes: &[u8]) -> Result<SpectrumTable, SpectrumFileError> {
    let columns = NumberColumns::from_bytes(bytes.to_vec()).map_err(SpectrumFileError::Parquet)?;
    if columns.rows() > MAX_ROWS {
        return Err(SpectrumFileError::TooLong);
    }
    let read = |column| columns.read(column).map_err(SpectrumFileError::Parquet);
    let [wavenumbers, densities] = find_columns(&columns.names())?;
    let points = read(wavenumbers)?.into_iter().zip(read(densities)?);
    Ok(SpectrumTable { points: points.map(|(q, density)| [q, density]).collect(), unit: None })
}

fn read_text(text: &str) -> Result<SpectrumTable, SpectrumFileError> {
    let is_row = |line: &str| !(line.trim().is_empty() || line.trim_start().starts_with('#'));
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| is_row(line));
    let header = lines.next().map_or("", |(_, line)| line);
    let separator = [';', '\t', ','].into_iter().find(|&mark| header.contains(mark));
    let fields = |line: &str| -> Vec<String> {
        let field = |field: &str| field.trim().trim_matches('"').trim().to_owned();
        match separator {
            Some(separator) => line.split(separator).map(field).collect(),
            None => line.split_whitespace().map(field).collect(),
        }
    };
    let words = fields(header);
    let titles: Vec<(&str, Option<&str>)> = words.iter().map(|title| split(title)).collect();
    let names: Vec<&str> = titles.iter().map(|(name, _)| *name).collect();
    let columns = find_columns(&names)?;
    let unit = unit_of(columns.map(|column| titles[column].1))?;
    let mut points = Vec::new();
    for (line, row) in lines {
        let row = fields(row);
        let number = |column: usize| {
            let text = row.get(column).map_or("", String::as_str);
            text.parse::<f64>()
                .map_err(|_| SpectrumFileError::Number { line, found: text.to_owned() })
        };
        points.push([number(columns[0])?, number(columns[1])?]);
        if points.len() > MAX_ROWS {
            return Err(SpectrumFileError::TooLong);
        }
    }
    let (unit, factor) = unit.map_or((None, 1.0), |(unit, factor)| (Some(unit), factor));
    points.iter_mut().for_each(|[_, density]| *density *= factor);
    Ok(SpectrumTable { points, unit })
}

/// Returns the indices of the columns of wavenumbers and of densities.
fn find_columns(names: &[&str]) -> Result<[usize; 2], SpectrumFileError> {
    let index = |wanted: &[&'static str]| {
        let indices = |wanted: &str| -> Vec<usize> {
            let named =
                names.iter().enumerate().filter(|(_, name)| name.eq_ignore_ascii_case(wanted));
            named.map(|(index, _)| index).collect()
        };
        let found = wanted.iter().map(|name| (*name, indices(name)));
        match found.into_iter().find(|(_, indices)| !indices.is_empty()) {
            Some((_, indices)) if indices.len() == 1 => Ok(indices[0]),
            Some((name, _)) => Err(SpectrumFileError::Repeated { name }),
            None => Err(SpectrumFileError::Missing {
                wanted: wanted[wanted.len() - 1],
                found: match names {
                    [] => "none".to_owned(),
                    names => names.join(", "),
                },
            }),
        }
    };
    Ok([index(&[WAVENUMBER])?, index(&DENSITIES)?])
}

/// Splits a title such as `density [µm^4]` into name and unit.
fn split(title: &str) -> (&str, Option<&str>) {
    let unit = title
        .split_once('[')
        .and_then(|(name, rest)| Some((name.trim(), rest.trim_end().strip_suffix(']')?.trim())));
    unit.map_or((title, None), |(name, unit)| (name, Some(unit)))
}

/// Returns the unit of length ℓ of the wavenumbers (1/ℓ), and the factor that converts densities to
/// ℓ⁴. `units` are the units of wavenumbers and densities.
fn unit_of(units: [Option<&str>; 2]) -> Result<Option<(String, f64)>, SpectrumFileError> {
    let [Some(wavenumber), Some(density)] = units else {
        return match units {
            [None, None] => Ok(None),
            _ => Err(SpectrumFileError::OneUnit),
        };
    };
    let refuse = |column, found: &str, wanted| SpectrumFileError::Unit {
        column,
        found: found.to_owned(),
        wanted,
    };
    let length = wavenumber
        .strip_prefix("1/")
        .or_else(|| wavenumber.strip_prefix("rad/"))
        .or_else(|| wavenumber.strip_suffix("^-1"))
        .or_else(|| wavenumber.strip_suffix("⁻¹"))
        .filter(|length| !length.is_empty())
        .ok_or_else(|| refuse(WAVENUMBER, wavenumber, "`1/µm`"))?;
    let of_density = ["⁴", "^4", "**4"]
        .iter()
        .find_map(|power| density.strip_suffix(power))
        .ok_or_else(|| refuse("density", density, "`µm^4`"))?;
    let factor =
        length_ratio(of_density, length).ok_or_else(|| refuse("density", density, "`µm^4`"))?;
    Ok(Some((length.to_owned(), factor.powi(4))))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_bytes_do_no_harm(
            is_parquet: bool,
            bytes in proptest::collection::vec(any::<u8>(), 0..200),
        ) {
            let start: &[u8] = if is_parquet { b"PAR1" } else { b"" };
            let _ = read(&[start, &bytes].concat());
        }

        #[test]
        fn rows_below_a_header_are_numbers_or_an_error(rows in "[0-9eE.,;#\\-+ \n]{0,100}") {
            let text = format!("wavenumber [1/m],density [m^4]\n{rows}");
            if let Ok(found) = read(text.as_bytes()) {
                prop_assert!(found.points.len() <= rows.lines().count());
            }
        }
    }

    #[test]
    fn inputs_of_the_fuzzer_are_tables_or_errors() {
        let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/corpus/spectrum");
        for file in fs::read_dir(corpus).unwrap() {
            let _ = read(&fs::read(file.unwrap().path()).unwrap());
        }
    }

    fn table(text: &str) -> Result<SpectrumTable, String> {
        read(text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_their_names_with_any_separator() {
        for text in [
            "wavenumber,density\n1,2e-3\n3,4\n",
            "# of a plate\n\ndensity;note;wavenumber\n2e-3;x;1\n4;y;3\n",
            "\u{feff}Wavenumber\tspectral_density\r\n1\t0.002\r\n3\t4.0\r\n",
            "\"wavenumber\", \"density\"\n1, 2e-3\n3, 4",
            "wavenumber density\n1 2e-3\n 3  4",
        ] {
            let found = table(text).unwrap();
            assert_eq!(found.points, [[1.0, 2e-3], [3.0, 4.0]], "{text}");
            assert_eq!(found.unit, None);
        }
    }

    #[test]
    fn densities_are_converted_to_the_unit_of_the_wavenumbers() {
        let found = table("wavenumber [1/µm], density [nm^4]\n1, 2e12\n").unwrap();
        assert_eq!(found.unit.as_deref(), Some("µm"));
        assert!((found.points[0][1] / 2.0 - 1.0).abs() < 1e-12);
        let same = table("wavenumber [m⁻¹]; density [m⁴]\n1; 2\n").unwrap();
        assert_eq!((same.unit.as_deref(), same.points[0][1]), (Some("m"), 2.0));
    }

    #[test]
    fn errors_say_why_a_file_is_not_a_spectrum() {
        let refused = |text: &str| table(text).unwrap_err();
        assert_eq!(refused("q,C\n1,2\n"), "has no column `wavenumber`; its columns are q, C");
        assert_eq!(
            refused("wavenumber,density\n1,2\n3\n"),
            "has \"\" in line 3 instead of a number"
        );
        assert_eq!(
            refused("wavenumber [1/µm],density\n1,2\n"),
            "has a unit for one of its two columns; add the other unit"
        );
        assert_eq!(
            refused("wavenumber [µm],density [µm^4]\n1,2\n"),
            "has the unit \"µm\" for `wavenumber`; write it like `1/µm`"
        );
        let twice = "has several columns `density`; remove or rename all but one";
        assert_eq!(refused("wavenumber,density,Density\n1,2,3\n"), twice);
        assert!(read(&[0xff, 0xfe, 0]).is_err());
        assert!(read(b"PAR1").is_err());
        assert!(table("").is_err());
    }
}
