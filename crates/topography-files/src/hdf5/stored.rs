//! Types of stored numbers, and the values of attributes.

use hdf5_reader::{
    Dataset, Datatype, Hdf5File, RawAttribute, StringPadding, StringSize, VarLenKind,
};

use super::super::FormatError;
use super::super::input::{Cursor, decode_text};
use super::super::labelled::{Attributes, Value};
use super::super::raster::{ByteOrder, Element};

/// Maximum number of texts of an attribute that are read.
const MAX_TEXTS: usize = 1 << 10;

/// Type of stored numbers.
///
/// Integers may have fewer bits than their bytes, as cameras with 12 or 14 bits write them. The
/// crate `hdf5-reader` 0.12.1 skips the place and the number of these bits, so that they are read
/// from the description of the type.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stored {
    pub(crate) element: Element,
    pub(crate) order: ByteOrder,
    /// Lowest bit and number of bits of an integer that does not fill its bytes.
    bits: Option<(u32, u32)>,
}

impl Stored {
    pub(crate) fn of_dataset(dataset: &Dataset) -> Result<Stored, FormatError> {
        let raw = dataset.raw_datatype();
        let part = format!("type of dataset `{}`", dataset.name());
        let description = raw.map_err(|error| FormatError::damaged(&part, error))?;
        Stored::parse(&description).ok_or_else(|| {
            let found = format!("{:?}", dataset.dtype());
            FormatError::value(&part, found, "integers, or floats of 16, 32 or 64 bits")
        })
    }

    /// Parses the description of a type. Returns `None` if it is not one of numbers, or if its
    /// numbers are not those of IEEE 754.
    pub(crate) fn parse(description: &[u8]) -> Option<Stored> {
        let mut cursor = Cursor::new(description);
        let [class, flags, second, _] = cursor.array().ok()?;
        let size = cursor.u32().ok()?;
        let [start, count] = [cursor.u16().ok()?, cursor.u16().ok()?].map(u32::from);
        let order = ByteOrder::new(flags & 1 == 1);
        let is_signed = flags & 8 != 0;
        let whole = 8 * size;
        let element = match (class & 15, size) {
            (0, 1..=8) => Element::integer(whole.into(), is_signed)?,
            (1, 2 | 4 | 8) => {
                let layout = (cursor.array::<4>().ok()?, cursor.u32().ok()?, second);
                let float = match layout {
                    ([10, 5, 0, 10], 15, 15) => Element::F16,
                    ([23, 8, 0, 23], 127, 31) => Element::F32,
                    ([52, 11, 0, 52], 1023, 63) => Element::F64,
                    _ => return None,
                };
                // The order of VAX has bit 6.
                let is_whole = start == 0 && count == 8 * size && flags & 64 == 0;
                return is_whole.then_some(Stored { element: float, order, bits: None });
            }
            _ => return None,
        };
        if count == 0 || start.checked_add(count)? > whole {
            return None;
        }
        let bits = (count < whole).then_some((start, count));
        Some(Stored { element, order, bits })
    }

    /// Expands integers of fewer bits to all bits of their bytes.
    pub(crate) fn normal(self, mut bytes: Vec<u8>) -> Vec<u8> {
        let Some((start, count)) = self.bits else { return bytes };
        let is_signed = self.element.unsigned() != self.element;
        let unused = 64 - count;
        for number in bytes.chunks_exact_mut(self.element.size()) {
            let shifted = self.order.integer(number) >> start << unused;
            let expanded =
                if is_signed { (shifted as i64 >> unused) as u64 } else { shifted >> unused };
            self.order.store(expanded, number);
        }
        bytes
    }
}

/// Decodes attributes.
pub(crate) fn attributes(file: &Hdf5File, raw: Vec<RawAttribute>) -> Attributes {
    let decoded = raw.into_iter().map(|raw| {
        let value = value(file, &raw);
        (raw.name().to_owned(), value)
    });
    Attributes(decoded.collect())
}

fn value(file: &Hdf5File, raw: &RawAttribute) -> Value {
    let message = raw.message();
    match &message.datatype {
        Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. } => {
            match Stored::parse(raw.raw_datatype()) {
                Some(stored) => {
                    let bytes = stored.normal(message.raw_data.clone());
                    Value::Numbers(stored.element.numbers(stored.order, &bytes))
                }
                None => Value::Unreadable("its numbers have an unknown type".to_owned()),
            }
        }
        Datatype::String { size: StringSize::Fixed(size), padding, .. } => {
            let texts = message.raw_data.chunks((*size).max(1) as usize).take(MAX_TEXTS);
            Value::Texts(texts.map(|bytes| fixed_text(bytes, *padding)).collect())
        }
        Datatype::String { size: StringSize::Variable, .. }
        | Datatype::VarLen { kind: VarLenKind::String, .. } => {
            let size = 8 + usize::from(file.superblock().offset_size);
            let references = message.raw_data.chunks_exact(size).take(MAX_TEXTS);
            let texts: Option<Vec<String>> =
                references.map(|bytes| heap_text(file, bytes)).collect();
            let unreadable = || Value::Unreadable("its text cannot be found".to_owned());
            texts.map_or_else(unreadable, Value::Texts)
        }
        _ => Value::Other,
    }
}

fn fixed_text(bytes: &[u8], padding: StringPadding) -> String {
    let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
    let text = decode_text(text);
    match padding {
        StringPadding::SpacePad => text.trim_end().to_owned(),
        _ => text,
    }
}

/// Reads a text of variable length from the heap to which `reference` points.
fn heap_text(file: &Hdf5File, reference: &[u8]) -> Option<String> {
    let bytes = heap_bytes(file, reference, 1)?;
    Some(decode_text(bytes.split(|&byte| byte == 0).next().unwrap_or_default()))
}

/// Reads a sequence of variable length from the heap to which `reference` points. `element` is the
/// size of an element in bytes.
///
/// The headers of a heap and its objects are padded to multiples of eight bytes, which matters for
/// lengths of four bytes (`H5Pset_sizes(4, 4)`). `hdf5-reader` 0.12.1 does not skip this padding.
pub(crate) fn heap_bytes(file: &Hdf5File, reference: &[u8], element: usize) -> Option<Vec<u8>> {
    let sizes = [file.superblock().offset_size, file.superblock().length_size].map(usize::from);
    let whole = |bytes: &[u8]| usize::try_from(ByteOrder::Little.integer(bytes)).ok();
    let length = whole(reference.get(..4)?)?.saturating_mul(element);
    let address = whole(reference.get(4..4 + sizes[0])?)? as u64;
    let wanted = whole(reference.get(4 + sizes[0]..8 + sizes[0])?)?;
    if length == 0 || wanted == 0 {
        return Some(vec![]);
    }
    let header = (8 + sizes[1]).next_multiple_of(8);
    let storage = file.storage();
    let head = storage.read_range(address, header).ok()?;
    let size = whole(head.as_ref().get(8..8 + sizes[1])?)?;
    if !head.as_ref().starts_with(b"GCOL") {
        return None;
    }
    let heap = storage.read_range(address, size).ok()?;
    let mut at = header;
    loop {
        let object = heap.as_ref().get(at..)?;
        let index = whole(object.get(..2)?)?;
        let size = whole(object.get(8..8 + sizes[1])?)?;
        if index == wanted {
            return Some(object.get(header..)?.get(..length.min(size))?.to_vec());
        }
        if index == 0 {
            return None;
        }
        at = at.checked_add(header)?.checked_add(size.checked_next_multiple_of(8)?)?;
    }
}
