//! BCR-STM and BCRF, which many programs of scanning microscopes exchange: a text header of 2048
//! letters or as many as `headersize` says, of one byte or two each, and whole numbers or floats.
//!
//! Sides are those of the whole map. Lines run along x and the first has y = 0. Heights are in
//! `zunit`, whole numbers times `bit2nm`. Missing are the number 32767, and floats from 1.7e38 on.

use super::channel::{Channel, Size};
use super::cursor::{Cursor, latin1};
use super::entries::Entries;
use super::error::{FormatError, factor};
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::{Unit, ratio};

pub const FORMAT: Format =
    Format { name: "bcrf", title: "BCR-STM", version: 1, has_signature: true, read };

/// Letters of the header of files that do not give their number.
const LETTERS: usize = 2048;
const MAGIC: &str = "fileformat = bcr";

/// How the letters of the header are written.
#[derive(Clone, Copy)]
enum Encoding {
    Narrow,
    Wide(fn([u8; 2]) -> u16),
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let little = Encoding::Wide(u16::from_le_bytes);
    let encodings = [Encoding::Narrow, little, Encoding::Wide(u16::from_be_bytes)];
    let starts = |encoding: &Encoding| {
        let start = encoding.letters(bytes, MAGIC.len() + 1);
        start.trim_start_matches('\u{feff}').starts_with(MAGIC)
    };
    let encoding = encodings.into_iter().find(starts);
    let encoding = encoding.ok_or(FormatError::Signature)?;
    let first = entries(&encoding.letters(bytes, LETTERS));
    let letters = match first.get("headersize") {
        None => LETTERS,
        Some(_) => {
            let letters = first.whole("headersize")?;
            let size = usize::try_from(letters).ok().filter(|size| *size <= bytes.len());
            let allowed = "within the file";
            size.ok_or_else(|| FormatError::value("headersize", letters, allowed))?
        }
    };
    let header = entries(&encoding.letters(bytes, letters));
    let stored = Cursor::at(bytes, letters * encoding.bytes()).rest();
    Ok(vec![channel(&header, stored)?])
}

fn channel<'a>(header: &Entries, stored: &'a [u8]) -> Result<Channel<'a>, FormatError> {
    let nodes = checked_nodes([header.whole("xpixels")?, header.whole("ypixels")?])?;
    let order = match header.get("intelmode") {
        Some("0") => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let (element, missing, scale) = match header.text("fileformat")? {
        "bcrstm" | "bcrstm_unicode" => {
            let scale = header.optional_number("bit2nm")?.unwrap_or(1.0);
            (Element::I16, Missing::Value(32767.0), factor("bit2nm", scale)?)
        }
        "bcrf" | "bcrf_unicode" => (Element::F32, Missing::From(1.7e38), 1.0),
        other => {
            let allowed = "bcrstm or bcrf";
            return Err(FormatError::value("fileformat", other, allowed));
        }
    };
    let unit = |name| header.get(name).unwrap_or("nm");
    let y = ratio(unit("yunit"), unit("xunit"))
        .ok_or_else(|| FormatError::value("yunit", unit("yunit"), "a length"))?;
    let sides = [header.number("xlength")?, header.number("ylength")? * y];
    let size = Size::of(sides, &Unit::of(unit("xunit")))?;
    let raster = Raster::rows(nodes, element, order, stored)?;
    let raster = raster.missing(missing).scaled(scale, 0.0);
    Ok(Channel::new("heights", Unit::of(unit("zunit")), size, raster))
}

/// Lines `name = value`; others are comments.
fn entries(text: &str) -> Entries {
    let lines = text.lines().filter(|line| !line.starts_with(['%', '#']));
    let lines = lines.filter_map(|line| line.trim_start_matches('\u{feff}').split_once('='));
    lines.collect()
}

impl Encoding {
    /// Bytes of a letter.
    fn bytes(self) -> usize {
        match self {
            Encoding::Narrow => 1,
            Encoding::Wide(_) => 2,
        }
    }

    /// So many letters from the start of the file, or as many as there are.
    fn letters(self, bytes: &[u8], count: usize) -> String {
        let bytes = &bytes[..bytes.len().min(count.saturating_mul(self.bytes()))];
        match self {
            Encoding::Narrow => latin1(bytes),
            Encoding::Wide(number) => {
                let (letters, _) = bytes.as_chunks::<2>();
                let letters = letters.iter().map(|bytes| number(*bytes));
                char::decode_utf16(letters)
                    .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
                    .collect()
            }
        }
    }
}
