//! Compressions of strips and tiles that other crates do not decode.

use super::super::FormatError;

/// Decodes LZW with codes of 9 to 12 bits, up to `expected` bytes.
pub(crate) fn lzw(stored: &[u8], expected: usize) -> Result<Vec<u8>, FormatError> {
    const CLEAR: usize = 256;
    const END: usize = 257;
    let damaged = || FormatError::damaged("a strip or tile of the TIFF image", "wrong LZW code");
    let mut decoded = Vec::new();
    // Start and length in `decoded` of the string of each code above `END`.
    let mut table: Vec<(usize, usize)> = Vec::new();
    let mut previous: Option<(usize, usize)> = None;
    let (mut position, mut width) = (0, 9);
    while decoded.len() < expected {
        let Some(code) = bits(stored, position, width) else { break };
        position += width;
        if code == END {
            break;
        }
        if code == CLEAR {
            (width, previous) = (9, None);
            table.clear();
            continue;
        }
        let start = decoded.len();
        // A new string is the previous one with the first byte of the current one.
        if let Some((start, length)) = previous
            && table.len() < 4096 - 258
        {
            table.push((start, length + 1));
        }
        if code < CLEAR {
            decoded.push(code as u8);
        } else {
            let &(from, length) = table.get(code - 258).ok_or_else(damaged)?;
            // The string may overlap the bytes that it produces.
            for index in from..from + length {
                let byte = decoded[index];
                decoded.push(byte);
            }
        }
        previous = Some((start, decoded.len() - start));
        // TIFF widens the codes one code early.
        width = match table.len() + 258 {
            ..511 => 9,
            511..1023 => 10,
            1023..2047 => 11,
            _ => 12,
        };
    }
    Ok(decoded)
}

/// Returns the `width` bits from a position, most significant bit first.
fn bits(stored: &[u8], position: usize, width: usize) -> Option<usize> {
    let bytes = stored.get(position / 8..(position + width).div_ceil(8))?;
    let all = bytes.iter().fold(0, |sum, &byte| sum << 8 | usize::from(byte));
    let unused = 8 * bytes.len() - width - position % 8;
    Some(all >> unused & ((1 << width) - 1))
}

/// Decodes `PackBits`, a run-length code, up to `expected` bytes.
pub(crate) fn pack_bits(mut stored: &[u8], expected: usize) -> Vec<u8> {
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
