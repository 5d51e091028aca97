//! A small file of each format, written by hand: the map of [`EXPECTED`].

mod binary;
mod microscopes;
mod texts;

pub use binary::{Archive, deflated_sur, sur, x3p};
pub use microscopes::{igor, with_checksum};

/// Three nodes along x, two along y, in nanometres: the heights, [x, y]. Formats that can mark a
/// point as missing mark the last.
pub const EXPECTED: [f64; 6] = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
/// The same as rows of x, the first of which has y = 0.
const ROWS: [[i16; 3]; 2] = [[1, 2, 3], [4, 5, 6]];
/// Sides of most of them, in metres.
const SIDES: [f64; 2] = [3e-6, 4e-6];

/// A file, and what is known of it.
pub struct Sample {
    pub format: &'static str,
    pub bytes: Vec<u8>,
    /// Whether its last point is missing.
    pub is_holed: bool,
    /// Sides in metres; none of a file without units.
    pub sides: Option<[f64; 2]>,
}

impl Sample {
    fn new(format: &'static str, bytes: Vec<u8>) -> Sample {
        Sample { format, bytes, is_holed: false, sides: Some(SIDES) }
    }

    fn holed(format: &'static str, bytes: Vec<u8>) -> Sample {
        Sample { is_holed: true, ..Sample::new(format, bytes) }
    }
}

/// One of each format at least.
pub fn samples() -> Vec<Sample> {
    let parts = [binary::samples(), microscopes::samples(), texts::samples()];
    parts.into_iter().flatten().collect()
}

/// Bytes that are put together from fields.
#[derive(Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn bytes(mut self, bytes: &[u8]) -> Fields {
        self.0.extend(bytes);
        self
    }

    /// Text, filled up with zeros.
    fn text(self, text: &str, length: usize) -> Fields {
        let zeros = length - text.len();
        self.bytes(text.as_bytes()).zeros(zeros)
    }

    fn zeros(self, count: usize) -> Fields {
        self.bytes(&vec![0; count])
    }

    /// Zeros up to a place.
    fn to(self, place: usize) -> Fields {
        let zeros = place - self.0.len();
        self.zeros(zeros)
    }

    fn u16(self, number: u16) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn i32(self, number: i32) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn f32(self, number: f32) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn f64(self, number: f64) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    /// Every number of the rows in turn, as these bytes.
    fn rows<const N: usize>(self, rows: [[i16; 3]; 2], number: fn(i16) -> [u8; N]) -> Fields {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|&h| number(h)).collect();
        self.bytes(&bytes)
    }
}

/// The rows as a file has them whose first one has the largest y.
fn upside_down() -> [[i16; 3]; 2] {
    [ROWS[1], ROWS[0]]
}

fn single(number: i16) -> [u8; 4] {
    f32::from(number).to_le_bytes()
}

/// The last of the numbers, 6, in place of which another marks the point as missing.
fn with_last(mut bytes: Vec<u8>, marker: &[u8]) -> Vec<u8> {
    let end = bytes.len() - marker.len();
    bytes[end..].copy_from_slice(marker);
    bytes
}
