//! Compressed parts of files.

use std::io::Read;

use super::error::FormatError;

/// No deflated byte makes more than this many.
const MOST_TIMES: usize = 1032;

/// Decompresses exactly `expected` bytes of the part of this name, of which `compressed` bytes are
/// in the file.
pub fn inflate(
    part: &str,
    reader: impl Read,
    compressed: usize,
    expected: usize,
) -> Result<Vec<u8>, FormatError> {
    let reason = |found: usize| format!("it holds {found} bytes, {expected} are needed");
    // What cannot be there is not made room for.
    let most = compressed.saturating_mul(MOST_TIMES);
    if expected > most {
        let reason = format!("{compressed} bytes cannot hold the {expected} that are needed");
        return Err(FormatError::damaged(part, reason));
    }
    let mut bytes = Vec::with_capacity(expected);
    let mut limited = reader.take(expected as u64);
    let read = limited.read_to_end(&mut bytes);
    read.map_err(|error| FormatError::damaged(part, error))?;
    match bytes.len() == expected {
        true => Ok(bytes),
        false => Err(FormatError::damaged(part, reason(bytes.len()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_made_room_for_than_can_be_there() {
        let error = inflate("data", [0; 4].as_slice(), 4, usize::MAX).unwrap_err();
        assert!(error.to_string().contains("4 bytes cannot hold"), "{error}");
    }

    #[test]
    fn too_few_bytes_are_an_error() {
        let read = |expected| inflate("data", [7; 4].as_slice(), 4, expected);
        assert_eq!(read(3), Ok(vec![7; 3]));
        assert!(read(5).is_err());
    }
}
