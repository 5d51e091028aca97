//! A measured height map, read from a NumPy file that nobody has checked.
//!
//! Only the plain kind is read: one array of little-endian floats, rows by columns. Its header is a Python
//! dictionary with three entries in a fixed notation; taken at its word, one could claim sizes
//! that overflow or exhaust memory, so every claim is held against the bytes at hand.

use thiserror::Error;

use super::surface::{Surface, SurfaceError, check_range};
use crate::grid::{Cell, Grid};

/// Why a file is not a height map.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum MeasuredError {
    #[error("not a NumPy file: it does not start with `\\x93NUMPY`")]
    Magic,
    #[error("NumPy format version {0} is unknown, 1 to 3 can be read")]
    Version(u8),
    #[error("the file ends within its header")]
    CutOff,
    #[error("the header `{header}` lacks a readable `{entry}`")]
    Entry { entry: &'static str, header: String },
    #[error("elements are of type `{found}`, heights must be `<f8` or `<f4`")]
    Type { found: String },
    #[error("the array has shape {found:?}, a height map has rows and columns, like [256, 256]")]
    Shape { found: Vec<u64> },
    #[error("shape {shape:?} of type `{element}` needs {needed} bytes of data, {found} are there")]
    Length { shape: Vec<u64>, element: &'static str, needed: u128, found: usize },
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

/// Reads the bytes of a `.npy` file as a surface that fills the cell.
///
/// Heights keep their unit, which must be that of the cell's sides; element `[i, j]` of the array is
/// the node at x = iΔx, y = jΔy.
///
/// # Errors
/// When the bytes are not such a file, or hold other numbers than heights.
///
/// ```
/// use asperity_contact::grid::Cell;
/// use asperity_contact::topography::measured::{MeasuredError, read_npy};
///
/// // As `numpy.save` writes `[[0, 1, 2], [3, 4, 5]]`.
/// let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";
/// let mut file = b"\x93NUMPY\x01\x00".to_vec();
/// file.extend((header.len() as u16).to_le_bytes());
/// file.extend(header.bytes());
/// file.extend((0..6).flat_map(|height| f64::from(height).to_le_bytes()));
///
/// let surface = read_npy(&file, Cell::new([20e-6, 30e-6]).unwrap())?;
/// assert_eq!(surface.grid().nodes(), [2, 3]);
/// assert_eq!(surface.heights(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
/// assert_eq!(read_npy(b"GIF89a", surface.grid().cell()), Err(MeasuredError::Magic));
/// # Ok::<(), MeasuredError>(())
/// ```
pub fn read_npy(bytes: &[u8], cell: Cell) -> Result<Surface, MeasuredError> {
    let (nodes, heights) = npy_array(bytes)?;
    let grid = Grid::new(nodes, cell).map_err(SurfaceError::from)?;
    check_range(grid, &heights)?;
    Ok(Surface::new(grid, heights)?)
}

/// Rows, columns and numbers of a `.npy` file, row by row; the numbers need not be finite.
///
/// # Errors
/// When the bytes are not such a file, or hold other numbers than heights.
pub fn npy_array(bytes: &[u8]) -> Result<([usize; 2], Vec<f64>), MeasuredError> {
    let (header, data) = split(bytes)?;
    let element = Element::of(header)?;
    let columns_first = fortran_order(header)?;
    let shape = shape(header)?;
    let [rows, columns] = match shape[..] {
        [rows, columns] => [rows, columns],
        _ => return Err(MeasuredError::Shape { found: shape }),
    };
    let needed = u128::from(rows)
        .checked_mul(u128::from(columns))
        .and_then(|count| count.checked_mul(element.size() as u128));
    if needed != Some(data.len() as u128) {
        return Err(MeasuredError::Length {
            shape,
            element: element.name(),
            needed: needed.unwrap_or(u128::MAX),
            found: data.len(),
        });
    }
    let nodes = [rows as usize, columns as usize];
    let heights = element.decode(data);
    // Of no columns there can be any number of rows.
    match columns_first && !heights.is_empty() {
        true => Ok((nodes, transposed(&heights, nodes))),
        false => Ok((nodes, heights)),
    }
}

#[derive(Debug, Clone, Copy)]
enum Element {
    Single,
    Double,
}

impl Element {
    fn of(header: &str) -> Result<Self, MeasuredError> {
        let text = value(header, "descr")?;
        match quoted(text) {
            Some("<f8") => Ok(Self::Double),
            Some("<f4") => Ok(Self::Single),
            found => Err(MeasuredError::Type {
                // A structured type is a list of its own, of which the start tells enough.
                found: found.map_or_else(|| text.chars().take(40).collect(), str::to_owned),
            }),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Single => "<f4",
            Self::Double => "<f8",
        }
    }

    fn size(self) -> usize {
        match self {
            Self::Single => 4,
            Self::Double => 8,
        }
    }

    fn decode(self, data: &[u8]) -> Vec<f64> {
        match self {
            Self::Single => decode(data, |bytes| f32::from_le_bytes(bytes).into()),
            Self::Double => decode(data, f64::from_le_bytes),
        }
    }
}

fn decode<const SIZE: usize>(data: &[u8], value: impl Fn([u8; SIZE]) -> f64) -> Vec<f64> {
    data.as_chunks().0.iter().map(|bytes| value(*bytes)).collect()
}

/// Header and data of a NumPy file.
fn split(bytes: &[u8]) -> Result<(&str, &[u8]), MeasuredError> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or(MeasuredError::Magic)?;
    let (claimed, rest) = match *rest {
        [1, _, a, b, ref rest @ ..] => (u16::from_le_bytes([a, b]).into(), rest),
        [2 | 3, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]) as usize, rest),
        [version @ (0 | 4..), ..] => return Err(MeasuredError::Version(version)),
        _ => return Err(MeasuredError::CutOff),
    };
    let (header, data) = rest.split_at_checked(claimed).ok_or(MeasuredError::CutOff)?;
    let header = str::from_utf8(header)
        .map_err(|_| unreadable(&String::from_utf8_lossy(header), "dictionary"))?;
    Ok((header.trim(), data))
}

/// What follows `'name':` in the header.
fn value<'a>(header: &'a str, name: &'static str) -> Result<&'a str, MeasuredError> {
    let missing = || unreadable(header, name);
    let (_, rest) = header.split_once(name).ok_or_else(missing)?;
    let rest = rest.strip_prefix(['\'', '"']).ok_or_else(missing)?;
    let rest = rest.trim_start().strip_prefix(':').ok_or_else(missing)?;
    Ok(rest.trim_start())
}

fn quoted(text: &str) -> Option<&str> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split(quote).next()
}

fn fortran_order(header: &str) -> Result<bool, MeasuredError> {
    let text = value(header, "fortran_order")?;
    if text.starts_with("True") {
        Ok(true)
    } else if text.starts_with("False") {
        Ok(false)
    } else {
        Err(unreadable(header, "fortran_order"))
    }
}

fn shape(header: &str) -> Result<Vec<u64>, MeasuredError> {
    let numbers = value(header, "shape")?
        .strip_prefix('(')
        .and_then(|text| text.split_once(')'))
        .map(|(numbers, _)| numbers.split(',').map(str::trim).filter(|n| !n.is_empty()));
    numbers
        .and_then(|numbers| numbers.map(|n| n.parse().ok()).collect())
        .ok_or_else(|| unreadable(header, "shape"))
}

fn unreadable(header: &str, entry: &'static str) -> MeasuredError {
    let header = header.chars().take(200).collect();
    MeasuredError::Entry { entry, header }
}

/// Row by row what is stored column by column.
fn transposed(heights: &[f64], [rows, columns]: [usize; 2]) -> Vec<f64> {
    let places = (0..rows).flat_map(|i| (0..columns).map(move |j| j * rows + i));
    places.map(|place| heights[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridError;
    use crate::grid::samples::{cell, rectangle, square};

    fn npy(descr: &str, fortran_order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header = format!(
            "{{'descr': '{descr}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}\n"
        );
        let length = (header.len() as u16).to_le_bytes();
        let parts = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data];
        parts.concat()
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    fn valid() -> Vec<u8> {
        npy("<f8", "False", "(2, 2)", &doubles(&[1.0, 2.0, 3.0, 4.0]))
    }

    #[test]
    fn heights_whose_averages_overflow_are_refused() {
        let high = npy("<f8", "False", "(1, 2)", &doubles(&[1e308, 1e308]));
        let error = read_npy(&high, cell(3.0)).unwrap_err().to_string();
        assert!(error.contains("1e308, more than 1e100"), "{error}");
    }

    #[test]
    fn both_orders_of_storage_show_the_same_map() {
        let rows = read_npy(&valid(), cell(3.0)).unwrap();
        assert_eq!(rows.grid(), square(2, 3.0));
        assert_eq!(rows.heights(), [1.0, 2.0, 3.0, 4.0]);
        let data = doubles(&[1.0, 3.0, 2.0, 4.0]);
        let columns = read_npy(&npy("<f8", "True", "(2, 2)", &data), cell(3.0));
        assert_eq!(columns, Ok(rows));
    }

    #[test]
    fn a_rectangle_is_read_along_both_axes() {
        let grid = rectangle([2, 3], [1.0, 5.0]);
        let data = doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let rows = read_npy(&npy("<f8", "False", "(2, 3)", &data), grid.cell()).unwrap();
        assert_eq!(rows.grid(), grid);
        assert_eq!(rows.heights(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let data = doubles(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
        let columns = read_npy(&npy("<f8", "True", "(2, 3)", &data), grid.cell());
        assert_eq!(columns, Ok(rows));
    }

    #[test]
    fn single_precision_and_the_second_version_are_read_too() {
        let data: Vec<u8> =
            [0.5_f32, -2.0, 0.0, 8.0].iter().flat_map(|value| value.to_le_bytes()).collect();
        let single = read_npy(&npy("<f4", "False", "(2, 2)", &data), cell(1.0)).unwrap();
        assert_eq!(single.heights(), [0.5, -2.0, 0.0, 8.0]);
        let mut second = valid();
        second[6] = 2;
        second.splice(10..10, [0, 0]);
        assert_eq!(read_npy(&second, cell(1.0)), read_npy(&valid(), cell(1.0)));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = valid();
        for length in 0..bytes.len() {
            assert!(read_npy(&bytes[..length], cell(1.0)).is_err(), "{length} bytes");
        }
        let longer = [bytes, vec![0]].concat();
        assert_eq!(
            read_npy(&longer, cell(1.0)).unwrap_err().to_string(),
            "shape [2, 2] of type `<f8` needs 32 bytes of data, 33 are there"
        );
    }

    #[test]
    fn a_damaged_header_is_an_error_or_harmless() {
        let bytes = valid();
        let header = bytes.len() - 32;
        for position in 0..header {
            for damage in 0..=255 {
                let mut damaged = bytes.clone();
                damaged[position] = damage;
                if let Ok(surface) = read_npy(&damaged, cell(1.0)) {
                    assert!(surface.grid().count() <= 4);
                }
            }
        }
    }

    #[test]
    fn other_types_are_named() {
        for descr in [">f8", "<i4", "<c16", "|O"] {
            let found = descr.to_owned();
            let error = read_npy(&npy(descr, "False", "(2, 2)", &[0; 32]), cell(1.0));
            assert_eq!(error, Err(MeasuredError::Type { found }));
        }
    }

    #[test]
    fn what_has_no_rows_and_columns_is_refused_with_its_shape() {
        let shapes = [("(4,)", vec![4]), ("()", vec![]), ("(2, 2, 1)", vec![2, 2, 1])];
        for (shape, found) in shapes {
            let error = read_npy(&npy("<f8", "False", shape, &[0; 32]), cell(1.0));
            assert_eq!(error, Err(MeasuredError::Shape { found }));
        }
        for (order, shape) in [("False", "(0, 0)"), ("True", "(100000000000000001, 0)")] {
            let error = read_npy(&npy("<f8", order, shape, &[]), cell(1.0));
            assert_eq!(error, Err(MeasuredError::Surface(GridError::Empty.into())));
        }
    }

    #[test]
    fn a_huge_claim_allocates_nothing() {
        for side in [1_u64 << 20, 1 << 32, u64::MAX] {
            let bytes = npy("<f8", "False", &format!("({side}, {side})"), &[0; 32]);
            let error = read_npy(&bytes, cell(1.0)).unwrap_err();
            assert!(matches!(error, MeasuredError::Length { found: 32, .. }));
        }
        let beyond = npy("<f8", "False", &format!("({0}, {0})", u128::MAX), &[]);
        let error = read_npy(&beyond, cell(1.0)).unwrap_err();
        assert!(matches!(error, MeasuredError::Entry { entry: "shape", .. }));
        let mut header = valid();
        header[6] = 2;
        header[8..12].fill(0xff);
        assert_eq!(read_npy(&header, cell(1.0)), Err(MeasuredError::CutOff));
    }

    #[test]
    fn the_first_height_that_is_no_number_is_named() {
        let data = doubles(&[1.0, 2.0, f64::INFINITY, f64::NAN]);
        let error = read_npy(&npy("<f8", "False", "(2, 2)", &data), cell(1.0)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "height at row 1, column 0 is inf, every height must be finite"
        );
    }
}
