//! Images of TIFF files, in which several instruments store maps and their own tags.
//!
//! A file is a chain of directories, one for each image. [`directories`] reads their entries, and
//! [`Directory::image`] decodes an image with one sample per pixel: strips or tiles, uncompressed
//! or compressed with LZW, deflate, Zstandard or `PackBits`. Damaged offsets and counts are errors.
//! A `BigTIFF` differs in its 64-bit offsets and counts.
//!
//! The crate `tiff` 0.11.3 reads all files of the tests as well, but not the stored numbers of
//! every file. It inverts images whose photometric interpretation is `WhiteIsZero`: a height h of
//! an unsigned 16-bit file of tifffile becomes 65535 − h, a float 1 − h, and signed integers are
//! refused (“unknown photometric interpretation”). GDAL, Gwyddion and tifffile do not invert. It
//! also refuses tiles of LZW that imagecodecs writes (“no lzw end code found”).

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use flate2::read::ZlibDecoder;
use ruzstd::decoding::StreamingDecoder;
use weezl::BitOrder;

use super::FormatError;
use super::input::{decode_text, inflate, meaning};
use super::raster::{ByteOrder, Element, Raster, checked_nodes};

// Tags of the TIFF specification.
const WIDTH: u16 = 256;
const LENGTH: u16 = 257;
const BITS: u16 = 258;
const COMPRESSION: u16 = 259;
const STRIP_OFFSETS: u16 = 273;
const SAMPLES: u16 = 277;
const ROWS_PER_STRIP: u16 = 278;
const STRIP_BYTES: u16 = 279;
const PREDICTOR: u16 = 317;
const TILE_WIDTH: u16 = 322;
const TILE_LENGTH: u16 = 323;
const TILE_OFFSETS: u16 = 324;
const TILE_BYTES: u16 = 325;
const SAMPLE_FORMAT: u16 = 339;
/// Compression of GDAL and libtiff.
const ZSTANDARD: i64 = 50000;

/// Layout of the directories of a file.
#[derive(Debug, Clone, Copy)]
struct Layout {
    order: ByteOrder,
    /// True if offsets and counts have 64 bits.
    is_big: bool,
}

impl Layout {
    /// Returns the length of an offset, which is also the length of the values inside an entry.
    fn offset_bytes(self) -> usize {
        if self.is_big { 8 } else { 4 }
    }

    /// Returns the length of an entry: its tag, its type, a count and an offset.
    fn entry_bytes(self) -> usize {
        4 + 2 * self.offset_bytes()
    }

    fn offset(self, file: &[u8], start: usize) -> Result<usize, FormatError> {
        let stored = slice(file, start, self.offset_bytes())?;
        Ok(usize::try_from(self.order.integer(stored)).unwrap_or(usize::MAX))
    }
}

/// Directory of a file: the entries of one image, by their tags.
#[derive(Debug, Clone)]
pub(crate) struct Directory<'a> {
    file: &'a [u8],
    layout: Layout,
    entries: BTreeMap<u16, Entry<'a>>,
}

/// Values of one entry, which are text or numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry<'a> {
    kind: u16,
    order: ByteOrder,
    bytes: &'a [u8],
}

/// Reads the directory of the first image, which tells formats apart.
pub(crate) fn first_directory(file: &[u8]) -> Result<Directory<'_>, FormatError> {
    let (layout, offset) = header(file)?;
    Ok(Directory::read(file, layout, offset)?.0)
}

/// Reads the directories of all images. There is at least one.
pub(crate) fn directories(file: &[u8]) -> Result<Vec<Directory<'_>>, FormatError> {
    let mut directories = Vec::new();
    let mut visited = BTreeSet::new();
    let mut entries = 0;
    let (layout, mut next) = header(file)?;
    while next != 0 {
        // A chain that returns to an earlier directory would never end.
        if !visited.insert(next) {
            return Err(FormatError::damaged("the chain of TIFF directories", "it is a loop"));
        }
        let (directory, after) = Directory::read(file, layout, next)?;
        // Directories do not overlap, which bounds the number of entries.
        entries += directory.entries.len();
        if entries * layout.entry_bytes() > file.len() {
            return Err(FormatError::damaged("the chain of TIFF directories", "they overlap"));
        }
        directories.push(directory);
        next = after;
    }
    if directories.is_empty() {
        Err(FormatError::missing("TIFF directory"))
    } else {
        Ok(directories)
    }
}

/// Returns the layout of a file and the offset of its first directory.
fn header(file: &[u8]) -> Result<(Layout, usize), FormatError> {
    let (order, version) = match file {
        [b'I', b'I', version @ (42 | 43), 0, ..] => (ByteOrder::Little, version),
        [b'M', b'M', 0, version @ (42 | 43), ..] => (ByteOrder::Big, version),
        _ => return Err(FormatError::Signature),
    };
    let layout = Layout { order, is_big: *version == 43 };
    // A BigTIFF has the length of its offsets, 8, before the offset.
    Ok((layout, layout.offset(file, layout.offset_bytes())?))
}

impl<'a> Directory<'a> {
    /// Reads the directory at an offset, and the offset of the next directory.
    fn read(
        file: &'a [u8],
        layout: Layout,
        offset: usize,
    ) -> Result<(Directory<'a>, usize), FormatError> {
        let Layout { order, is_big } = layout;
        let (count, first) = if is_big {
            (layout.offset(file, offset)?, offset.saturating_add(8))
        } else {
            (usize::from(u16_at(file, offset, order)?), offset.saturating_add(2))
        };
        let end = count.saturating_mul(layout.entry_bytes()).saturating_add(first);
        // A damaged count would keep the loop busy.
        let next = layout.offset(file, end)?;
        let mut entries = BTreeMap::new();
        for start in (first..end).step_by(layout.entry_bytes()) {
            let [tag, kind] = [u16_at(file, start, order)?, u16_at(file, start + 2, order)?];
            let count = layout.offset(file, start + 4)?;
            // The specification tells readers to skip entries of unknown types.
            let Some(size) = value_size(kind) else { continue };
            let length = count.saturating_mul(size);
            let value = start + 4 + layout.offset_bytes();
            let is_inside = length <= layout.offset_bytes();
            let at = if is_inside { value } else { layout.offset(file, value)? };
            entries.insert(tag, Entry { kind, order, bytes: slice(file, at, length)? });
        }
        Ok((Directory { file, layout, entries }, next))
    }

    /// Returns the entry with a tag.
    pub(crate) fn entry(&self, tag: u16) -> Option<Entry<'a>> {
        self.entries.get(&tag).copied()
    }

    /// Returns the first value of a tag as an integer.
    pub(crate) fn whole(&self, tag: u16) -> Option<i64> {
        self.wholes(tag).first().copied()
    }

    /// Returns the first value of a tag as a number.
    pub(crate) fn number(&self, tag: u16) -> Option<f64> {
        self.numbers(tag).first().copied()
    }

    /// Returns the values of a tag; none if it is missing or its values are not integers.
    pub(crate) fn wholes(&self, tag: u16) -> Vec<i64> {
        let of_integers = self.entry(tag).filter(|entry| !matches!(entry.kind, 5 | 11 | 12));
        let numbers = of_integers.map(Entry::numbers).unwrap_or_default();
        numbers.into_iter().map(|number| number as i64).collect()
    }

    /// Returns the values of a tag; none if it is missing or its values are not numbers.
    pub(crate) fn numbers(&self, tag: u16) -> Vec<f64> {
        self.entry(tag).map(Entry::numbers).unwrap_or_default()
    }

    /// Returns the text of a tag up to its first zero byte, without outer spaces.
    pub(crate) fn text(&self, tag: u16) -> Option<String> {
        // Some programs store text as bytes without type.
        let bytes = self.entry(tag).filter(|entry| matches!(entry.kind, 2 | 7))?.bytes;
        let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
        Some(decode_text(text).trim().to_owned())
    }

    /// Returns the numbers of pixels along x and y.
    pub(crate) fn nodes(&self) -> Result<[usize; 2], FormatError> {
        checked_nodes([self.required(WIDTH)?, self.required(LENGTH)?])
    }

    /// Decodes the image into a raster whose first line is the first line of the image.
    pub(crate) fn image(&self) -> Result<Raster<'a>, FormatError> {
        meaning("samples per pixel", self.whole(SAMPLES).unwrap_or(1), "1", &[(1, ())])?;
        let nodes = self.nodes()?;
        let element = self.element()?;
        Raster::rows(nodes, element, self.layout.order, self.pixels(nodes, Some(element))?)
    }

    /// Returns the directory to which a tag points, such as the directory of the Exif entries.
    pub(crate) fn directory(&self, tag: u16) -> Result<Option<Directory<'a>>, FormatError> {
        let offset = self.whole(tag).map(|offset| usize::try_from(offset).unwrap_or(usize::MAX));
        let directory = offset.map(|offset| Directory::read(self.file, self.layout, offset));
        Ok(directory.transpose()?.map(|(directory, _)| directory))
    }

    /// Decodes a mask with one bit per pixel, or an image with more bits.
    pub(crate) fn bitmap(&self) -> Result<Raster<'a>, FormatError> {
        if self.whole(BITS).unwrap_or(1) != 1 {
            return self.image();
        }
        let nodes = self.nodes()?;
        let lines = self.pixels(nodes, None)?;
        let lines = lines.chunks_exact(nodes[0].div_ceil(8)).take(nodes[1]);
        // The first pixel is the most significant bit.
        let pixel = |bits: &[u8], x: usize| bits[x / 8] >> (7 - x % 8) & 1;
        let pixels = lines.flat_map(|bits| (0..nodes[0]).map(move |x| pixel(bits, x)));
        Raster::rows(nodes, Element::U8, self.layout.order, pixels.collect::<Vec<u8>>())
    }

    fn required(&self, tag: u16) -> Result<i64, FormatError> {
        self.whole(tag).ok_or_else(|| FormatError::missing(format!("TIFF tag {tag}")))
    }

    fn element(&self) -> Result<Element, FormatError> {
        let bits = self.whole(BITS).unwrap_or(1);
        // Unsigned integers are the default of the specification.
        let format = self.whole(SAMPLE_FORMAT).unwrap_or(1);
        let element = match format {
            1 | 2 => Element::integer(bits, format == 2),
            3 => Element::float(bits),
            _ => None,
        };
        element.ok_or_else(|| {
            let found = format!("format {format} of {bits} bits");
            let allowed = "integers of 8 to 64 bits, or floats of 16 to 64 bits";
            FormatError::value("TIFF sample", found, allowed)
        })
    }

    /// Returns the pixels of the image line by line; they are single bits without an `element`.
    fn pixels(
        &self,
        nodes: [usize; 2],
        element: Option<Element>,
    ) -> Result<Cow<'a, [u8]>, FormatError> {
        let [width, length] = nodes;
        let bits = element.map_or(1, |element| 8 * element.size());
        let bytes = |pixels: usize| (pixels * bits).div_ceil(8);
        let (block, places) = if self.entries.contains_key(&TILE_OFFSETS) {
            let size = [self.required(TILE_WIDTH)?, self.required(TILE_LENGTH)?];
            (checked_nodes(size)?, [TILE_OFFSETS, TILE_BYTES])
        } else {
            let rows = self.whole(ROWS_PER_STRIP).unwrap_or(i64::MAX).clamp(1, length as i64);
            ([width, rows as usize], [STRIP_OFFSETS, STRIP_BYTES])
        };
        let [across, down] = [width.div_ceil(block[0]), length.div_ceil(block[1])];
        if across > 1 && !(block[0] * bits).is_multiple_of(8) {
            let allowed = "a multiple of 16";
            return Err(FormatError::value("width of the TIFF tiles", block[0], allowed));
        }
        let stored = self.stored_blocks(places, across * down)?;
        let compression = self.whole(COMPRESSION).unwrap_or(1);
        if let [only] = stored[..]
            && compression == 1
            && self.whole(PREDICTOR).unwrap_or(1) == 1
            && block[0] == width
        {
            return Ok(Cow::Borrowed(only));
        }
        let [line, block_line] = [bytes(width), bytes(block[0])];
        let needed = line * length;
        // A damaged size must not allocate memory: one stored byte expands to so many.
        let max_expansion = if compression == 1 { 1 } else { 4096 };
        if needed > self.file.len().saturating_mul(max_expansion) {
            let (element, found) = (bytes(1), self.file.len());
            return Err(FormatError::Heights { nodes, element, needed: needed as u128, found });
        }
        let mut pixels = vec![0; needed];
        for (index, stored) in stored.into_iter().enumerate() {
            let [x, y] = [index % across * block[0], index / across * block[1]];
            // The last strip has fewer lines; tiles are always whole.
            let lines = (length - y).min(block[1]);
            let mut decoded = decompressed(compression, stored, lines * block_line)?;
            if let Some(element) = element {
                decoded = self.undo_prediction(decoded, block_line, element)?;
            }
            let copied = bytes((width - x).min(block[0]));
            for (index, from) in decoded.chunks_exact(block_line).take(lines).enumerate() {
                let start = (y + index) * line + bytes(x);
                pixels[start..start + copied].copy_from_slice(&from[..copied]);
            }
        }
        Ok(Cow::Owned(pixels))
    }

    /// Returns the stored bytes of all strips or tiles, of which two tags have offsets and lengths.
    fn stored_blocks(&self, places: [u16; 2], count: usize) -> Result<Vec<&'a [u8]>, FormatError> {
        let [offsets, lengths] = places.map(|tag| match self.wholes(tag) {
            wholes if wholes.is_empty() => Err(FormatError::missing(format!("TIFF tag {tag}"))),
            wholes => Ok(wholes),
        });
        let whole = |value| usize::try_from(value).unwrap_or(usize::MAX);
        let places = offsets?.into_iter().zip(lengths?).take(count);
        let stored: Vec<&[u8]> = places
            .map(|(offset, length)| slice(self.file, whole(offset), whole(length)))
            .collect::<Result<_, _>>()?;
        if stored.len() < count {
            let allowed = format!("{count}, as the size of the image requires");
            let entry = "number of TIFF strips or tiles";
            return Err(FormatError::value(entry, stored.len(), &allowed));
        }
        Ok(stored)
    }

    /// Undoes the prediction, which stores the differences between neighbours of a line.
    fn undo_prediction(
        &self,
        bytes: Cow<'a, [u8]>,
        line: usize,
        element: Element,
    ) -> Result<Cow<'a, [u8]>, FormatError> {
        match self.whole(PREDICTOR).unwrap_or(1) {
            1 => Ok(bytes),
            // GDAL also takes differences of floats as if they were integers.
            2 => {
                let (mut bytes, order) = (bytes.into_owned(), self.layout.order);
                for line in bytes.chunks_exact_mut(line) {
                    let mut sum = 0_u64;
                    for stored in line.chunks_exact_mut(element.size()) {
                        sum = sum.wrapping_add(order.integer(stored));
                        order.store(sum, stored);
                    }
                }
                Ok(Cow::Owned(bytes))
            }
            3 if element.limits().is_none() => {
                Ok(floats_of_differences(&bytes, line, element.size(), self.layout.order).into())
            }
            other => Err(FormatError::value("TIFF predictor", other, "1, 2, or 3 for floats")),
        }
    }
}

/// Decompresses a strip or tile to at least `expected` bytes.
fn decompressed(
    compression: i64,
    stored: &[u8],
    expected: usize,
) -> Result<Cow<'_, [u8]>, FormatError> {
    let part = "a strip or tile of the TIFF image";
    let decoded = match compression {
        1 => Cow::Borrowed(stored),
        5 => {
            let mut decoded = Vec::new();
            let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
            // Some programs leave out the code that ends the data; the length is checked below.
            let _ = decoder.into_vec(&mut decoded).decode_all(stored).status;
            Cow::Owned(decoded)
        }
        8 | 32946 => Cow::Owned(inflate(part, ZlibDecoder::new(stored), stored.len(), expected)?),
        32773 => Cow::Owned(pack_bits(stored, expected)),
        ZSTANDARD => {
            let decoder = StreamingDecoder::new(stored);
            let reader = decoder.map_err(|error| FormatError::damaged(part, error))?;
            Cow::Owned(inflate(part, reader, stored.len(), expected)?)
        }
        other => {
            let allowed = "1 (none), 5 (LZW), 8 (deflate), 32773 (PackBits) or 50000 (Zstandard)";
            return Err(FormatError::value("TIFF compression", other, allowed));
        }
    };
    if decoded.len() < expected {
        let reason = format!("it has {} bytes, {expected} are needed", decoded.len());
        return Err(FormatError::damaged(part, reason));
    }
    Ok(decoded)
}

/// Undoes the prediction of floats. A line has the first bytes of all numbers, which are the most
/// significant ones, then their second bytes, and so on, as differences between neighbouring bytes.
fn floats_of_differences(bytes: &[u8], line: usize, size: usize, order: ByteOrder) -> Vec<u8> {
    let mut floats = Vec::with_capacity(bytes.len());
    for line in bytes.chunks_exact(line) {
        let sums = line.iter().scan(0_u8, |sum, byte| {
            *sum = sum.wrapping_add(*byte);
            Some(*sum)
        });
        let planes: Vec<u8> = sums.collect();
        let count = line.len() / size;
        for number in 0..count {
            let stored = (0..size).map(|byte| match order {
                ByteOrder::Big => byte,
                ByteOrder::Little => size - 1 - byte,
            });
            floats.extend(stored.map(|byte| planes[byte * count + number]));
        }
    }
    floats
}

/// Decodes `PackBits`, a run-length code, up to `expected` bytes.
fn pack_bits(mut stored: &[u8], expected: usize) -> Vec<u8> {
    let mut decoded = Vec::new();
    while let [header, rest @ ..] = stored
        && decoded.len() < expected
    {
        let count = usize::from(*header);
        let used = match count {
            ..128 => {
                let literal = &rest[..rest.len().min(count + 1)];
                decoded.extend(literal);
                literal.len()
            }
            128 => 0,
            _ => {
                let repeated = rest.first().map(|&byte| vec![byte; 257 - count]);
                decoded.extend(repeated.unwrap_or_default());
                1
            }
        };
        stored = rest.get(used..).unwrap_or_default();
    }
    decoded
}

impl<'a> Entry<'a> {
    /// Returns the bytes of all values.
    pub(crate) fn bytes(self) -> &'a [u8] {
        self.bytes
    }

    /// Returns the values if they are numbers.
    fn numbers(self) -> Vec<f64> {
        let element = match self.kind {
            1 | 7 => Element::U8,
            3 => Element::U16,
            4 | 5 | 13 => Element::U32,
            6 => Element::I8,
            8 => Element::I16,
            9 => Element::I32,
            11 => Element::F32,
            12 => Element::F64,
            16 | 18 => Element::U64,
            17 => Element::I64,
            _ => return vec![],
        };
        let numbers = element.numbers(self.order, self.bytes);
        match self.kind {
            5 => numbers.as_chunks::<2>().0.iter().map(|[over, under]| over / under).collect(),
            _ => numbers,
        }
    }
}

/// Returns the size of one value in bytes, or `None` if the type of the entry is unknown.
fn value_size(kind: u16) -> Option<usize> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16..=18 => Some(8),
        _ => None,
    }
}

fn slice(file: &[u8], start: usize, length: usize) -> Result<&[u8], FormatError> {
    let end = start.saturating_add(length);
    file.get(start..end).ok_or(FormatError::CutOff { needed: end, found: file.len() })
}

fn u16_at(file: &[u8], start: usize, order: ByteOrder) -> Result<u16, FormatError> {
    Ok(order.integer(slice(file, start, 2)?) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Builds a little-endian file of one directory after the stored image, which starts at byte 8.
    fn file(stored: &[u8], entries: &[(u16, u16, u32, u32)]) -> Vec<u8> {
        let directory = 8 + stored.len() as u32;
        let mut file = [b"II*\0".as_slice(), &directory.to_le_bytes(), stored].concat();
        file.extend((entries.len() as u16).to_le_bytes());
        for (tag, kind, count, value) in entries {
            file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            file.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        file.extend([0; 4]);
        file
    }

    /// Decodes an image of 3 × 2 bytes in one strip.
    fn decoded(stored: &[u8], compression: u32, predictor: u32) -> Result<Vec<f64>, FormatError> {
        let bytes = stored.len() as u32;
        let short = |tag, value| (tag, 3, 1, value);
        let entries = [
            [short(WIDTH, 3), short(LENGTH, 2), short(BITS, 8), short(PREDICTOR, predictor)],
            [
                short(COMPRESSION, compression),
                (STRIP_OFFSETS, 4, 1, 8),
                short(ROWS_PER_STRIP, 2),
                (STRIP_BYTES, 4, 1, bytes),
            ],
        ];
        let file = file(stored, &entries.concat());
        Ok(directories(&file)?[0].image()?.decode())
    }

    const EXPECTED: [f64; 6] = [1.0, 4.0, 1.0, 5.0, 1.0, 6.0];

    #[test]
    fn all_compressions_give_the_same_image() {
        assert_eq!(decoded(&[1, 1, 1, 4, 5, 6], 1, 1).unwrap(), EXPECTED);
        assert_eq!(decoded(&[254, 1, 2, 4, 5, 6], 32773, 1).unwrap(), EXPECTED);
        // The codes 256, 1, 258 (the string 1 1), 4, 5, 6 and 257 of nine bits each.
        let codes = [256_u64, 1, 258, 4, 5, 6, 257].iter().fold(0, |all, code| all << 9 | code);
        assert_eq!(decoded(&(codes << 1).to_be_bytes(), 5, 1).unwrap(), EXPECTED);
        let deflated = [0x78, 0x01, 1, 6, 0, 0xf9, 0xff, 1, 1, 1, 4, 5, 6, 0, 49, 0, 19];
        assert_eq!(decoded(&deflated, 8, 1).unwrap(), EXPECTED);
        assert_eq!(decoded(&[1, 0, 0, 4, 1, 1], 1, 2).unwrap(), EXPECTED);
    }

    #[test]
    fn damaged_images_are_refused() {
        for (stored, compression) in
            [(&[1, 1, 1, 4, 5][..], 1), (&[254, 1], 32773), (&[0x80, 0x7f, 0xff], 5), (&[1; 6], 7)]
        {
            assert!(decoded(stored, compression, 1).is_err(), "{compression}");
        }
        assert_eq!(directories(b"GIF89a").unwrap_err(), FormatError::Signature);
        // The next directory of the first directory is the first directory.
        let looped = b"II*\0\x08\0\0\0\0\0\x08\0\0\0";
        assert!(directories(looped).unwrap_err().to_string().contains("loop"));
    }

    #[test]
    fn offsets_of_a_big_tiff_have_64_bits() {
        let short = |tag: u16, value: u64| (tag, 3_u16, value);
        let entries = [short(WIDTH, 3), short(LENGTH, 2), short(BITS, 8), (STRIP_OFFSETS, 16, 16)];
        let entries = [entries.as_slice(), &[(STRIP_BYTES, 16, 6)]].concat();
        let mut file = [b"II+\0\x08\0\0\0".as_slice(), &22_u64.to_le_bytes()].concat();
        file.extend([1, 1, 1, 4, 5, 6]);
        file.extend((entries.len() as u64).to_le_bytes());
        for (tag, kind, value) in entries {
            file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            file.extend([1_u64, value].map(u64::to_le_bytes).concat());
        }
        file.extend([0; 8]);
        assert_eq!(directories(&file).unwrap()[0].image().unwrap().decode(), EXPECTED);
        for length in 0..file.len() {
            assert!(directories(&file[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn predicted_floats_are_stored_by_bytes() {
        // 1 is 3f800000 and 2 is 40000000; the bytes 3f 40, 80 00, 00 00 and 00 00 as differences.
        let stored = [0x3f, 0x01, 0x40, 0x80, 0, 0, 0, 0];
        let floats = floats_of_differences(&stored, 8, 4, ByteOrder::Big);
        assert_eq!(Element::F32.numbers(ByteOrder::Big, &floats), [1.0, 2.0]);
        let little = floats_of_differences(&stored, 8, 4, ByteOrder::Little);
        assert_eq!(Element::F32.numbers(ByteOrder::Little, &little), [1.0, 2.0]);
    }

    #[test]
    fn entries_are_numbers_or_text() {
        let entries =
            [(1, 9, 1, (-3_i32) as u32), (2, 11, 1, 0.5_f32.to_bits()), (3, 2, 3, 0x6d6e)];
        let file = file(&[], &entries);
        let directory = &directories(&file).unwrap()[0];
        assert_eq!(directory.whole(1), Some(-3));
        assert_eq!((directory.whole(2), directory.number(2)), (None, Some(0.5)));
        assert_eq!(directory.text(3).as_deref(), Some("nm"));
        assert_eq!(directory.text(1), None);
    }
}
