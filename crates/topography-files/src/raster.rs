//! Conversion of stored numbers to a height map.

use std::borrow::Cow;

use half::f16;

use super::FormatError;

/// Maximum number of nodes of a map. A damaged header may give any number.
const MAX_NODES: u64 = 1 << 30;

/// Type of the stored numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Element {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

/// Byte order of the stored numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

/// Stored numbers that mark missing points. Points whose number is not finite are always missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Missing {
    /// The format has no marker.
    None,
    /// Exactly this number marks missing points.
    Value(f64),
    /// All numbers that equal this one to single precision mark missing points.
    Around(f64),
    /// This number and all larger ones mark missing points.
    From(f64),
    /// This number and all smaller ones mark missing points.
    UpTo(f64),
}

/// Stored numbers of a map with one number for each node, and their conversion to heights.
#[derive(Debug, Clone)]
pub(crate) struct Raster<'a> {
    nodes: [usize; 2],
    bytes: Cow<'a, [u8]>,
    element: Element,
    order: ByteOrder,
    /// Distance between the starts of two lines, in bytes.
    stride: usize,
    /// True if the numbers of a stored line have the same y, false if they have the same x.
    lines_along_x: bool,
    /// True if the first stored number has the largest y.
    upside_down: bool,
    /// True if the first stored number has the largest x.
    mirrored: bool,
    scale: f64,
    offset: f64,
    /// Divisor that converts scaled numbers to metres.
    per_metre: f64,
    missing: Missing,
    mask: Option<Box<Raster<'a>>>,
}

impl ByteOrder {
    pub(crate) fn new(is_big: bool) -> ByteOrder {
        if is_big { ByteOrder::Big } else { ByteOrder::Little }
    }

    /// Reads an unsigned integer of up to eight bytes.
    pub(crate) fn integer(self, stored: &[u8]) -> u64 {
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        match self {
            ByteOrder::Little => stored.iter().rev().fold(0, add),
            ByteOrder::Big => stored.iter().fold(0, add),
        }
    }

    /// Writes the lowest bytes of an integer.
    pub(crate) fn store(self, number: u64, stored: &mut [u8]) {
        stored.copy_from_slice(&number.to_le_bytes()[..stored.len()]);
        if self == ByteOrder::Big {
            stored.reverse();
        }
    }
}

impl Element {
    /// Returns the type of integers of 8, 16, 32 or 64 bits.
    pub(crate) fn integer(bits: i64, is_signed: bool) -> Option<Element> {
        let signed = match bits {
            8 => Element::I8,
            16 => Element::I16,
            32 => Element::I32,
            64 => Element::I64,
            _ => return None,
        };
        Some(if is_signed { signed } else { signed.unsigned() })
    }

    /// Returns the type of floats of 16, 32 or 64 bits.
    pub(crate) fn float(bits: i64) -> Option<Element> {
        match bits {
            16 => Some(Element::F16),
            32 => Some(Element::F32),
            64 => Some(Element::F64),
            _ => None,
        }
    }

    /// Returns the size of one number in bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Element::I8 | Element::U8 => 1,
            Element::I16 | Element::U16 | Element::F16 => 2,
            Element::I32 | Element::U32 | Element::F32 => 4,
            Element::I64 | Element::U64 | Element::F64 => 8,
        }
    }

    /// Returns the smallest and the largest number of a type of integers.
    pub(crate) fn limits(self) -> Option<[f64; 2]> {
        let bits = 8 * self.size() as i32;
        match self {
            Element::F16 | Element::F32 | Element::F64 => None,
            _ if self.unsigned() == self => Some([0.0, 2_f64.powi(bits) - 1.0]),
            _ => Some([-2_f64.powi(bits - 1), 2_f64.powi(bits - 1) - 1.0]),
        }
    }

    /// Returns the unsigned type of the same size.
    pub(crate) fn unsigned(self) -> Element {
        match self {
            Element::I8 => Element::U8,
            Element::I16 => Element::U16,
            Element::I32 => Element::U32,
            Element::I64 => Element::U64,
            other => other,
        }
    }

    /// Rounds a number to the precision of the type. Unsigned types wrap negative numbers, because
    /// netCDF stores the fill of unsigned integers as a signed number.
    pub(crate) fn rounded(self, number: f64) -> f64 {
        match self {
            Element::F32 => f64::from(number as f32),
            Element::U8 | Element::U16 | Element::U32 if number < 0.0 => {
                number + 2_f64.powi(8 * self.size() as i32)
            }
            _ => number,
        }
    }

    /// Decodes all numbers of `bytes`.
    pub(crate) fn numbers(self, order: ByteOrder, bytes: &[u8]) -> Vec<f64> {
        let count = bytes.len() / self.size();
        let raster = Raster::rows([count, 1], self, order, bytes);
        raster.expect("the bytes are those of the numbers").converted(|number| number)
    }
}

/// Checks the numbers of nodes along x and y that a header gives.
pub(crate) fn checked_nodes<T: TryInto<i64>>(nodes: [T; 2]) -> Result<[usize; 2], FormatError> {
    let nodes: [i64; 2] = nodes.map(|count| count.try_into().unwrap_or(i64::MAX));
    if let Some(count) = nodes.into_iter().find(|&count| count < 1) {
        return Err(FormatError::value("number of nodes", count, "a positive number"));
    }
    let sides = nodes.map(i64::unsigned_abs);
    match sides[0].checked_mul(sides[1]) {
        Some(count) if count <= MAX_NODES => Ok(sides.map(|side| side as usize)),
        _ => Err(FormatError::TooMany { nodes }),
    }
}

/// Returns the size of a map in bytes.
pub(crate) fn map_bytes(nodes: [usize; 2], element: Element) -> usize {
    nodes[0] * nodes[1] * element.size()
}

impl<'a> Raster<'a> {
    /// Creates a raster whose lines run along x: the first `nodes[0]` numbers have the same y.
    ///
    /// Bytes after the last number are ignored.
    pub(crate) fn rows(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        let stride = nodes[0] * element.size();
        Raster::padded_rows(nodes, element, order, stride, bytes)
    }

    /// Creates a raster whose lines run along x and start at multiples of `stride` bytes.
    pub(crate) fn padded_rows(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        stride: usize,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        let bytes = bytes.into();
        let [along, lines] = nodes;
        // The padding of the last line may be missing.
        let needed = stride as u128 * (lines - 1) as u128 + (along * element.size()) as u128;
        if needed > bytes.len() as u128 {
            let (element, found) = (element.size(), bytes.len());
            return Err(FormatError::Heights { nodes, element, needed, found });
        }
        // Other maps may follow.
        let bytes = match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..needed as usize]),
            owned => owned,
        };
        Ok(Raster {
            nodes,
            bytes,
            element,
            order,
            stride,
            lines_along_x: true,
            upside_down: false,
            mirrored: false,
            scale: 1.0,
            offset: 0.0,
            per_metre: 1.0,
            missing: Missing::None,
            mask: None,
        })
    }

    /// Creates a raster whose lines run along y: the first `nodes[1]` numbers have the same x.
    pub(crate) fn columns(
        nodes: [usize; 2],
        element: Element,
        order: ByteOrder,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<Raster<'a>, FormatError> {
        Ok(Raster::rows([nodes[1], nodes[0]], element, order, bytes)?.turned())
    }

    /// Exchanges x and y.
    pub(crate) fn turned(self) -> Raster<'a> {
        let [x, y] = self.nodes;
        Raster { nodes: [y, x], lines_along_x: !self.lines_along_x, ..self }
    }

    /// Creates a raster of decoded numbers whose lines run along x.
    ///
    /// # Panics
    /// Panics if the length of `numbers` differs from the number of nodes.
    pub(crate) fn from_rows(nodes: [usize; 2], numbers: Vec<f64>) -> Raster<'a> {
        assert_eq!(numbers.len(), nodes[0] * nodes[1], "a number for each node");
        let bytes: Vec<[u8; 8]> = numbers.into_iter().map(f64::to_le_bytes).collect();
        let raster = Raster::rows(nodes, Element::F64, ByteOrder::Little, bytes.into_flattened());
        raster.expect("each number has its bytes")
    }

    /// Creates a raster of numbers of a text, in lines along x.
    ///
    /// # Errors
    /// Returns an error if there is not one number for each node.
    pub(crate) fn from_words(
        nodes: [usize; 2],
        numbers: Vec<f64>,
    ) -> Result<Raster<'a>, FormatError> {
        if numbers.len() != nodes[0] * nodes[1] {
            let allowed = format!("{} × {}", nodes[0], nodes[1]);
            return Err(FormatError::value("number of heights", numbers.len(), &allowed));
        }
        Ok(Raster::from_rows(nodes, numbers))
    }

    /// Creates a raster of decoded numbers whose lines run along y.
    ///
    /// # Panics
    /// Panics if the length of `numbers` differs from the number of nodes.
    pub(crate) fn from_columns(nodes: [usize; 2], numbers: Vec<f64>) -> Raster<'a> {
        Raster::from_rows([nodes[1], nodes[0]], numbers).turned()
    }

    /// Sets the conversion of stored numbers to heights: `scale` × number + `offset`.
    pub(crate) fn scaled(self, scale: f64, offset: f64) -> Raster<'a> {
        Raster { scale, offset, ..self }
    }

    /// Sets the divisor that converts the scaled numbers to metres.
    ///
    /// A multiplication would be less accurate: ten micrometres would become 9.999999999999999e-6.
    pub(crate) fn in_metres(self, per_metre: f64) -> Raster<'a> {
        Raster { per_metre, ..self }
    }

    /// Reverses the direction of y, also of the mask. Unless it was reversed before, the first
    /// stored number then has the largest y.
    pub(crate) fn upside_down(self) -> Raster<'a> {
        let mask = self.mask.map(|mask| Box::new(mask.upside_down()));
        Raster { upside_down: !self.upside_down, mask, ..self }
    }

    /// Reverses the direction of x, also of the mask. Unless it was reversed before, the first
    /// stored number then has the largest x.
    pub(crate) fn mirrored(self) -> Raster<'a> {
        let mask = self.mask.map(|mask| Box::new(mask.mirrored()));
        Raster { mirrored: !self.mirrored, mask, ..self }
    }

    /// Sets the marker of missing points. It is compared with the stored numbers before scaling.
    pub(crate) fn missing(self, missing: Missing) -> Raster<'a> {
        Raster { missing, ..self }
    }

    /// Returns the number of points that this map declares missing as a mask of another.
    pub(crate) fn count_masked(&self) -> usize {
        self.decode().into_iter().filter(|number| is_masked(*number)).count()
    }

    /// Declares points missing where the number in `mask`, if there is one, exceeds one half.
    pub(crate) fn masked(self, mask: Option<Raster<'a>>) -> Raster<'a> {
        Raster { mask: mask.map(Box::new), ..self }
    }

    /// Copies the bytes of the map if they are borrowed.
    pub(crate) fn into_owned(self) -> Raster<'static> {
        Raster {
            nodes: self.nodes,
            bytes: Cow::Owned(self.bytes.into_owned()),
            element: self.element,
            order: self.order,
            stride: self.stride,
            lines_along_x: self.lines_along_x,
            upside_down: self.upside_down,
            mirrored: self.mirrored,
            scale: self.scale,
            offset: self.offset,
            per_metre: self.per_metre,
            missing: self.missing,
            mask: self.mask.map(|mask| Box::new(mask.into_owned())),
        }
    }

    /// Returns the numbers of nodes along x and y.
    pub(crate) fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Decodes the map in row-major order with x along the first axis; missing points are NaN.
    pub(crate) fn decode(&self) -> Vec<f64> {
        self.decode_by(|stored| self.value(stored))
    }

    /// Decodes the map with another marker of missing points beside that of the format.
    pub(crate) fn decode_without(&self, marker: f64) -> Vec<f64> {
        self.decode_by(
            |stored| {
                if is_marker(stored, marker) { f64::NAN } else { self.value(stored) }
            },
        )
    }

    /// Returns the stored numbers before scaling; missing points are NaN.
    pub(crate) fn numbers_of_file(&self) -> Vec<f64> {
        self.decode_by(|stored| if self.value(stored).is_nan() { f64::NAN } else { stored })
    }

    fn decode_by(&self, value: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut values = self.converted(value);
        if let Some(mask) = &self.mask {
            let marks = values.iter_mut().zip(mask.decode());
            for (value, _) in marks.filter(|(_, mark)| is_masked(*mark)) {
                *value = f64::NAN;
            }
        }
        values
    }

    /// Returns the numbers in the order of [`Raster::decode`], converted by `value`.
    fn converted(&self, value: impl Fn(f64) -> f64) -> Vec<f64> {
        match self.element {
            Element::I8 => self.gather(|bytes| value(i8::from_le_bytes(bytes).into())),
            Element::U8 => self.gather(|bytes| value(u8::from_le_bytes(bytes).into())),
            Element::I16 => self.gather(|bytes| value(i16::from_le_bytes(bytes).into())),
            Element::U16 => self.gather(|bytes| value(u16::from_le_bytes(bytes).into())),
            Element::I32 => self.gather(|bytes| value(i32::from_le_bytes(bytes).into())),
            Element::U32 => self.gather(|bytes| value(u32::from_le_bytes(bytes).into())),
            Element::I64 => self.gather(|bytes| value(i64::from_le_bytes(bytes) as f64)),
            Element::U64 => self.gather(|bytes| value(u64::from_le_bytes(bytes) as f64)),
            Element::F16 => self.gather(|bytes| value(f16::from_le_bytes(bytes).into())),
            Element::F32 => self.gather(|bytes| value(f32::from_le_bytes(bytes).into())),
            Element::F64 => self.gather(|bytes| value(f64::from_le_bytes(bytes))),
        }
    }

    /// Returns the numbers of the map in row-major order with x along the first axis. `number`
    /// decodes the bytes of a number in little-endian order.
    fn gather<const N: usize>(&self, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let [nodes_x, nodes_y] = self.nodes;
        let mut values = Vec::with_capacity(nodes_x * nodes_y);
        for i in 0..nodes_x {
            let x = if self.mirrored { nodes_x - 1 - i } else { i };
            values.extend((0..nodes_y).map(|j| {
                let y = if self.upside_down { nodes_y - 1 - j } else { j };
                let (line, index) = if self.lines_along_x { (y, x) } else { (x, y) };
                let stored = self.bytes[line * self.stride + index * N..].first_chunk::<N>();
                let mut stored = *stored.expect("the constructor checked the length");
                if self.order == ByteOrder::Big {
                    stored.reverse();
                }
                number(stored)
            }));
        }
        values
    }

    fn value(&self, stored: f64) -> f64 {
        let is_missing = match self.missing {
            Missing::None => false,
            Missing::Value(marker) => stored == marker,
            Missing::Around(marker) => is_marker(stored, marker),
            Missing::From(marker) => stored >= marker,
            Missing::UpTo(marker) => stored <= marker,
        };
        let value = (self.scale * stored + self.offset) / self.per_metre;
        if is_missing || !value.is_finite() { f64::NAN } else { value }
    }
}

/// Returns true if two numbers are equal in single precision, whose relative spacing is at most
/// 1.2e-7. Infinite numbers are always missing and never equal.
pub fn is_marker(stored: f64, marker: f64) -> bool {
    (stored - marker).abs() <= 1.5e-7 * marker.abs()
}

/// Returns true if a number of a mask declares a point missing.
fn is_masked(mark: f64) -> bool {
    mark > 0.5
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
    fn stored_coordinates_may_descend() {
        let turned = bytes([3, 2]).upside_down();
        assert_eq!(turned.decode(), [3.0, 0.0, 4.0, 1.0, 5.0, 2.0]);
        let mirrored = bytes([3, 2]).mirrored();
        assert_eq!(mirrored.decode(), [2.0, 5.0, 1.0, 4.0, 0.0, 3.0]);
    }

    #[test]
    fn markers_are_compared_before_scaling() {
        let raster = bytes([6, 1]).scaled(2.0, 1.0).missing(Missing::From(4.0));
        assert_eq!(raster.decode()[..4], [1.0, 3.0, 5.0, 7.0]);
        assert!(raster.decode()[4..].iter().all(|height| height.is_nan()));
        let one = bytes([6, 1]).scaled(2.0, 0.0).missing(Missing::Value(2.0));
        assert!(one.decode()[2].is_nan() && one.decode()[1] == 2.0);
    }

    #[test]
    fn a_mask_may_have_another_line_order_than_its_map() {
        let mask = Raster::columns([3, 2], Element::U8, ByteOrder::Big, &[0, 1, 0, 0, 0, 0][..]);
        let masked = bytes([3, 2]).masked(mask.ok()).decode();
        assert!(masked[1].is_nan());
        assert_eq!(masked.iter().filter(|height| height.is_nan()).count(), 1);
    }

    #[test]
    fn numbers_may_have_either_byte_order() {
        let read =
            |order| Raster::rows([1, 1], Element::I16, order, &[0x01, 0x80][..]).unwrap().decode();
        assert_eq!(read(ByteOrder::Little), [f64::from(-0x7fff)]);
        assert_eq!(read(ByteOrder::Big), [f64::from(0x0180)]);
    }

    #[test]
    fn numbers_of_half_precision_have_eleven_bits() {
        let read = |bits: u16| Element::F16.numbers(ByteOrder::Big, &bits.to_be_bytes())[0];
        assert_eq!(
            [0x3c00, 0xc000, 0x7bff, 0x0001].map(read),
            [1.0, -2.0, 65504.0, 2_f64.powi(-24)]
        );
        assert!(read(0x7e00).is_nan() && read(0xfc00) == f64::NEG_INFINITY);
    }

    #[test]
    fn padding_of_lines_is_skipped() {
        let stored = [1, 2, 9, 9, 3, 4];
        let raster = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 4, &stored[..]);
        assert_eq!(raster.unwrap().decode(), [1.0, 3.0, 2.0, 4.0]);
        let short = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 5, &stored[..]);
        assert_eq!(
            short.unwrap_err().to_string(),
            "the map is cut off: 2 × 2 heights of 1 bytes need 7 bytes, but only 6 are left"
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
    fn numbers_that_are_not_finite_are_missing_points() {
        let stored: Vec<u8> =
            [f32::NAN, f32::INFINITY, 1.0].iter().flat_map(|height| height.to_le_bytes()).collect();
        let raster = Raster::rows([3, 1], Element::F32, ByteOrder::Little, stored).unwrap();
        let heights = raster.decode();
        assert!(heights[0].is_nan() && heights[1].is_nan());
        assert_eq!(heights[2], 1.0);
    }
}
