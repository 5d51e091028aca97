//! The numbers of a map as a file stores them, and how they become a map.

use std::borrow::Cow;

use super::FormatError;

/// The largest map that is read: a file may claim any.
const MOST_NODES: u64 = 1 << 30;

/// The type of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// Which end of a number comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    Little,
    Big,
}

/// Which stored numbers stand for points that were not measured. What is not finite always does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Missing {
    /// No number.
    None,
    /// This one.
    Value(f64),
    /// Those that a float of single precision cannot tell from this one.
    Around(f64),
    /// This one and larger ones.
    From(f64),
}

/// Stored numbers, line by line, of a map.
///
/// Holding one means: there is a number for every node.
#[derive(Debug, Clone)]
pub struct Raster<'a> {
    nodes: [usize; 2],
    samples: Samples<'a>,
    /// Whether a stored line is all x of one y, or all y of one x.
    lines_along_x: bool,
    /// Whether the first stored line, or number of a line, has the largest y.
    upside_down: bool,
    /// Whether the first number has the largest x.
    mirrored: bool,
    scale: f64,
    offset: f64,
    per_metre: f64,
    missing: Missing,
    mask: Option<Box<Raster<'a>>>,
}

#[derive(Debug, Clone)]
enum Samples<'a> {
    Bytes {
        bytes: Cow<'a, [u8]>,
        element: Element,
        order: ByteOrder,
        /// Bytes from the start of one line to that of the next.
        stride: usize,
    },
    Numbers(Vec<f64>),
}

impl Element {
    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Element::I8 | Element::U8 => 1,
            Element::I16 | Element::U16 => 2,
            Element::I32 | Element::U32 | Element::F32 => 4,
            Element::F64 => 8,
        }
    }
}

/// Numbers of nodes that a file gives, if there are any and not too many.
pub fn checked_nodes(nodes: [i64; 2]) -> Result<[usize; 2], FormatError> {
    if let Some(count) = nodes.into_iter().find(|&count| count < 1) {
        return Err(FormatError::value("number of nodes", count, "positive"));
    }
    let sides = nodes.map(i64::unsigned_abs);
    match sides[0].checked_mul(sides[1]) {
        Some(count) if count <= MOST_NODES => Ok(sides.map(|side| side as usize)),
        _ => Err(FormatError::TooMany { nodes }),
    }
}

/// Bytes that so many numbers take.
pub fn bytes_of(nodes: [usize; 2], element: Element) -> usize {
    nodes[0] * nodes[1] * element.size()
}

impl<'a> Raster<'a> {
    /// Lines along x: the first `nodes[0]` numbers have one y. More bytes than needed are left
    /// alone.
    pub fn rows(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        let stride = nodes[0] * element.size();
        Raster::padded_rows(nodes, element, order, stride, bytes)
    }

    /// Lines along x that start every `stride` bytes.
    pub fn padded_rows(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        stride: usize,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        let bytes = bytes.into();
        let [along, lines] = nodes;
        // The padding of the last line may lack.
        let needed = stride as u128 * (lines - 1) as u128 + (along * element.size()) as u128;
        if needed > bytes.len() as u128 {
            return Err(FormatError::Heights {
                nodes,
                element: element.size(),
                needed,
                found: bytes.len(),
            });
        }
        let samples = Samples::Bytes { bytes, element, order, stride };
        Ok(Raster::of(nodes, samples, true))
    }

    /// Lines along y: the first `nodes[1]` numbers have one x.
    pub fn columns(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        let turned = Raster::rows([nodes[1], nodes[0]], element, order, bytes)?;
        Ok(Raster { nodes, lines_along_x: false, ..turned })
    }

    /// Numbers that are decoded, lines along x.
    ///
    /// # Panics
    /// When there are fewer numbers than nodes.
    pub fn of_rows(nodes: [usize; 2], numbers: Vec<f64>) -> Raster<'a> {
        assert_eq!(numbers.len(), nodes[0] * nodes[1], "a number for each node");
        Raster::of(nodes, Samples::Numbers(numbers), true)
    }

    /// Numbers that are decoded, lines along y.
    ///
    /// # Panics
    /// When there are fewer numbers than nodes.
    pub fn of_columns(nodes: [usize; 2], numbers: Vec<f64>) -> Raster<'a> {
        assert_eq!(numbers.len(), nodes[0] * nodes[1], "a number for each node");
        Raster::of(nodes, Samples::Numbers(numbers), false)
    }

    fn of(nodes: [usize; 2], samples: Samples<'a>, lines_along_x: bool) -> Raster<'a> {
        Raster {
            nodes,
            samples,
            lines_along_x,
            upside_down: false,
            mirrored: false,
            scale: 1.0,
            offset: 0.0,
            per_metre: 1.0,
            missing: Missing::None,
            mask: None,
        }
    }

    /// Every number becomes `scale` × number + `offset`.
    pub fn scaled(self, scale: f64, offset: f64) -> Raster<'a> {
        Raster { scale, offset, ..self }
    }

    /// Numbers in a unit of which so many are a metre become metres. They are divided: ten
    /// micrometres are then 1e-5 and not 9.999999999999999e-6.
    pub fn in_metres(self, per_metre: f64) -> Raster<'a> {
        Raster { per_metre, ..self }
    }

    /// What is stored first has the largest y.
    pub fn upside_down(self) -> Raster<'a> {
        Raster { upside_down: !self.upside_down, ..self }
    }

    /// What is stored first has the largest x.
    pub fn mirrored(self) -> Raster<'a> {
        Raster { mirrored: !self.mirrored, ..self }
    }

    /// Which stored numbers, before they are scaled, are points that were not measured.
    pub fn missing(self, missing: Missing) -> Raster<'a> {
        Raster { missing, ..self }
    }

    /// Points where another map is above one half were not measured.
    pub fn masked(self, mask: Raster<'a>) -> Raster<'a> {
        Raster { mask: Some(Box::new(mask)), ..self }
    }

    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// The numbers of the nodes, x along the first axis; points that were not measured are NaN.
    pub fn decode(&self) -> Vec<f64> {
        let mut values = match &self.samples {
            Samples::Numbers(numbers) => {
                let length = self.nodes[usize::from(!self.lines_along_x)];
                self.gather(|line, place| numbers[line * length + place])
            }
            Samples::Bytes { element, .. } => match element {
                Element::I8 => self.stored(|byte: [u8; 1]| i8::from_le_bytes(byte).into()),
                Element::U8 => self.stored(|byte: [u8; 1]| byte[0].into()),
                Element::I16 => self.stored(|bytes| i16::from_le_bytes(bytes).into()),
                Element::U16 => self.stored(|bytes| u16::from_le_bytes(bytes).into()),
                Element::I32 => self.stored(|bytes| i32::from_le_bytes(bytes).into()),
                Element::U32 => self.stored(|bytes| u32::from_le_bytes(bytes).into()),
                Element::F32 => self.stored(|bytes| f32::from_le_bytes(bytes).into()),
                Element::F64 => self.stored(f64::from_le_bytes),
            },
        };
        if let Some(mask) = &self.mask {
            let is_missing = mask.decode();
            let marks = values.iter_mut().zip(is_missing);
            for (value, _) in marks.filter(|(_, mark)| *mark > 0.5) {
                *value = f64::NAN;
            }
        }
        values
    }

    fn stored<const N: usize>(&self, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let Samples::Bytes { bytes, order, stride, .. } = &self.samples else {
            return vec![];
        };
        self.gather(|line, place| {
            let start = line * stride + place * N;
            let stored = bytes[start..].first_chunk::<N>();
            let mut stored = *stored.expect("as many bytes as were checked");
            if *order == ByteOrder::Big {
                stored.reverse();
            }
            number(stored)
        })
    }

    /// The map, of the stored number at each place of each line.
    fn gather(&self, stored: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let [nodes_x, nodes_y] = self.nodes;
        let mut values = Vec::with_capacity(nodes_x * nodes_y);
        for i in 0..nodes_x {
            let x = if self.mirrored { nodes_x - 1 - i } else { i };
            values.extend((0..nodes_y).map(|j| {
                let y = if self.upside_down { nodes_y - 1 - j } else { j };
                self.value(match self.lines_along_x {
                    true => stored(y, x),
                    false => stored(x, y),
                })
            }));
        }
        values
    }

    fn value(&self, stored: f64) -> f64 {
        let is_missing = match self.missing {
            Missing::None => false,
            Missing::Value(marker) => stored == marker,
            // A float of single precision holds a little more than seven digits.
            Missing::Around(marker) => (stored - marker).abs() <= 1.5e-7 * marker.abs(),
            Missing::From(marker) => stored >= marker,
        };
        let value = (self.scale * stored + self.offset) / self.per_metre;
        match is_missing || !value.is_finite() {
            true => f64::NAN,
            false => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(nodes: [usize; 2]) -> Raster<'static> {
        Raster::rows(nodes, Element::U8, ByteOrder::Little, &[0, 1, 2, 3, 4, 5][..]).unwrap()
    }

    #[test]
    fn rows_of_a_file_run_along_x() {
        assert_eq!(bytes([3, 2]).decode(), [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
        let columns = [0, 1, 2, 3, 4, 5];
        let columns = Raster::columns([3, 2], Element::U8, ByteOrder::Little, &columns[..]);
        assert_eq!(columns.unwrap().decode(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn what_is_stored_first_may_have_the_largest_coordinate() {
        let turned = bytes([3, 2]).upside_down();
        assert_eq!(turned.decode(), [3.0, 0.0, 4.0, 1.0, 5.0, 2.0]);
        let mirrored = bytes([3, 2]).mirrored();
        assert_eq!(mirrored.decode(), [2.0, 5.0, 1.0, 4.0, 0.0, 3.0]);
    }

    #[test]
    fn markers_are_looked_for_before_heights_are_scaled() {
        let raster = bytes([6, 1]).scaled(2.0, 1.0).missing(Missing::From(4.0));
        assert_eq!(raster.decode()[..4], [1.0, 3.0, 5.0, 7.0]);
        assert!(raster.decode()[4..].iter().all(|height| height.is_nan()));
        let one = bytes([6, 1]).scaled(2.0, 0.0).missing(Missing::Value(2.0));
        assert!(one.decode()[2].is_nan() && one.decode()[1] == 2.0);
    }

    #[test]
    fn a_mask_lies_as_its_own_rows_do() {
        let mask = Raster::columns([3, 2], Element::U8, ByteOrder::Big, &[0, 1, 0, 0, 0, 0][..]);
        let masked = bytes([3, 2]).masked(mask.unwrap()).decode();
        assert!(masked[1].is_nan());
        assert_eq!(masked.iter().filter(|height| height.is_nan()).count(), 1);
    }

    #[test]
    fn both_ends_of_a_number_may_come_first() {
        let read =
            |order| Raster::rows([1, 1], Element::I16, order, &[0x01, 0x80][..]).unwrap().decode();
        assert_eq!(read(ByteOrder::Little), [f64::from(-0x7fff)]);
        assert_eq!(read(ByteOrder::Big), [f64::from(0x0180)]);
    }

    #[test]
    fn padding_of_lines_is_left_out() {
        let stored = [1, 2, 9, 9, 3, 4];
        let raster = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 4, &stored[..]);
        assert_eq!(raster.unwrap().decode(), [1.0, 3.0, 2.0, 4.0]);
        let short = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 5, &stored[..]);
        assert_eq!(
            short.unwrap_err().to_string(),
            "2 × 2 heights of 1 bytes need 7 bytes, 6 are there"
        );
    }

    #[test]
    fn sizes_that_no_file_can_have_are_refused() {
        assert!(checked_nodes([0, 4]).is_err());
        assert!(checked_nodes([-1, 4]).is_err());
        assert!(checked_nodes([i64::MAX, i64::MAX]).is_err());
        assert!(checked_nodes([1 << 16, 1 << 15]).is_err());
        assert_eq!(checked_nodes([1 << 15, 1 << 15]), Ok([1 << 15, 1 << 15]));
    }

    #[test]
    fn a_number_that_is_not_finite_was_not_measured() {
        let stored: Vec<u8> =
            [f32::NAN, f32::INFINITY, 1.0].iter().flat_map(|height| height.to_le_bytes()).collect();
        let raster = Raster::rows([3, 1], Element::F32, ByteOrder::Little, stored).unwrap();
        let heights = raster.decode();
        assert!(heights[0].is_nan() && heights[1].is_nan());
        assert_eq!(heights[2], 1.0);
    }
}
