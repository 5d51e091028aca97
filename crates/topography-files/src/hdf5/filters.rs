//! Filters of chunks: those of `hdf5-reader`, LZF, Zstandard and bzip2.

use std::io::Read;

use bzip2::read::BzDecoder;
use hdf5_reader::FilterRegistry;
use hdf5_reader::error::Error;
use ruzstd::decoding::StreamingDecoder;

// Registered numbers of filters.
const BZIP2: u16 = 307;
const LZF: u16 = 32000;
const ZSTD: u16 = 32015;
/// Filters that the crate `hdf5-reader` decodes: deflate, shuffle, Fletcher32, SZIP, N-bit,
/// scale-offset and LZ4.
const BUILT_IN: [u16; 7] = [1, 2, 3, 4, 5, 6, 32004];
/// Returns all filters. A chunk may expand to at most `limit` bytes.
pub(crate) fn filters(limit: usize) -> FilterRegistry {
    let mut registry = FilterRegistry::new();
    let damaged = |name: &str| Error::InvalidData(format!("damaged {name} chunk"));
    registry
        .register(LZF, Box::new(move |_, stored, _| decode(stored).ok_or_else(|| damaged("LZF"))));
    let zstd = move |_: &_, stored: &[u8], _| {
        let decoded =
            StreamingDecoder::new(stored).ok().and_then(|decoder| limited(decoder, limit));
        decoded.ok_or_else(|| damaged("Zstandard"))
    };
    registry.register(ZSTD, Box::new(zstd));
    let bzip2 = move |_: &_, stored: &[u8], _| {
        limited(BzDecoder::new(stored), limit).ok_or_else(|| damaged("bzip2"))
    };
    registry.register(BZIP2, Box::new(bzip2));
    registry
}

/// Reads all bytes of a decoder. Returns `None` if the data are damaged or more than `limit` bytes.
fn limited(decoder: impl Read, limit: usize) -> Option<Vec<u8>> {
    let mut decoded = Vec::new();
    let read = decoder.take(limit as u64 + 1).read_to_end(&mut decoded).ok()?;
    (read <= limit).then_some(decoded)
}

/// Returns the number and the name of a filter that this crate does not decode, or `None` if it
/// does. `stored` is the name in the file.
pub(crate) fn unknown(number: u16, stored: Option<&str>) -> Option<String> {
    if BUILT_IN.contains(&number) || [BZIP2, LZF, ZSTD].contains(&number) {
        return None;
    }
    let name = stored.map(|name| name.trim_end_matches('\0')).filter(|name| !name.is_empty());
    Some(match name {
        Some(name) => format!("{number} ({name})"),
        None => number.to_string(),
    })
}

/// Decodes LZF, the filter of h5py's `compression="lzf"`. Returns `None` if the data are damaged.
fn decode(mut stored: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::new();
    while let [control, rest @ ..] = stored {
        let control = usize::from(*control);
        if control < 32 {
            // A run of bytes that are stored as they are.
            let (literal, after) = rest.split_at_checked(control + 1)?;
            decoded.extend(literal);
            stored = after;
            continue;
        }
        // A copy of earlier bytes, which may overlap the bytes that it produces.
        let (length, rest) = match control >> 5 {
            7 => (7 + usize::from(*rest.first()?), &rest[1..]),
            short => (short, rest),
        };
        let distance = ((control & 31) << 8) + usize::from(*rest.first()?) + 1;
        let start = decoded.len().checked_sub(distance)?;
        for index in start..start + length + 2 {
            decoded.push(decoded[index]);
        }
        stored = &rest[1..];
    }
    Some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_may_overlap_and_be_long() {
        assert_eq!(decode(&[1, 7, 8, 0x40, 1]), Some(vec![7, 8, 7, 8, 7, 8]));
        assert_eq!(decode(&[0, 7, 0xe0, 3, 0]), Some(vec![7; 13]));
    }

    #[test]
    fn damaged_data_are_refused() {
        for damaged in [&[5, 1, 2][..], &[0, 7, 0x20, 1], &[0, 7, 0xe0], &[0, 7, 0x20]] {
            assert_eq!(decode(damaged), None);
        }
    }
}
