//! LZF compression, the filter 32000 of HDF5 files that h5py writes with `compression="lzf"`.

use hdf5_reader::FilterRegistry;
use hdf5_reader::error::Error;

/// Returns the filters of `hdf5-reader` and LZF.
pub fn filters() -> FilterRegistry {
    let mut registry = FilterRegistry::new();
    let decode = |stored: &[u8]| {
        decode(stored).ok_or_else(|| Error::InvalidData("damaged LZF chunk".to_owned()))
    };
    registry.register(32000, Box::new(move |_, stored, _| decode(stored)));
    registry
}

/// Returns `None` if the data are damaged.
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
