//! Fuzz target that reads any bytes as a surface topography file of any format.
//!
//! With `FORMAT=sur` in the environment, only inputs that reach the reader `sur` are kept, so that
//! each format can be fuzzed separately.
#![no_main]

use std::sync::LazyLock;

use asperity::topography_files::{Statistics, TopographyFileError, formats, read};
use libfuzzer_sys::{Corpus, fuzz_target};

/// Length of the headers of an Igor wave in bytes, whose two-byte integers add up to zero.
const WAVE_HEADER: usize = 384;

/// Name of the format to fuzz, or `None` for all formats.
static FORMAT: LazyLock<Option<String>> = LazyLock::new(|| {
    let format = std::env::var("FORMAT").ok()?;
    assert!(formats().iter().any(|known| known.name() == format));
    Some(format)
});

fuzz_target!(|bytes: &[u8]| -> Corpus {
    let mut bytes = bytes.to_vec();
    if bytes.len() >= WAVE_HEADER && bytes.starts_with(&[5, 0]) {
        // Correct the checksum, which the fuzzer would not find.
        bytes[2..4].fill(0);
        let (numbers, _) = bytes[..WAVE_HEADER].as_chunks::<2>();
        let numbers = numbers.iter().map(|bytes| i16::from_le_bytes(*bytes));
        let sum = numbers.fold(0, i16::wrapping_add);
        bytes[2..4].copy_from_slice(&sum.wrapping_neg().to_le_bytes());
    }
    let found = read(&bytes);
    let is_of_interest = match (FORMAT.as_deref(), &found) {
        (None, _) => true,
        (Some(format), Ok(file)) => file.format().name() == format,
        (Some(format), Err(TopographyFileError::Damaged { name, .. })) => *name == format,
        (Some(format), Err(TopographyFileError::Unknown { tried, .. })) => {
            tried.iter().any(|(name, _)| *name == format)
        }
        (Some(_), Err(_)) => false,
    };
    match found {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(file) => {
            assert!(!file.channels().is_empty());
            for channel in file.channels().iter().take(4) {
                let map = channel.map();
                let [x, y] = map.nodes();
                assert_eq!(map.heights().len(), x * y);
                let is_sound = |(height, missing): (&f64, &bool)| height.is_finite() != *missing;
                assert!(map.heights().iter().zip(map.missing()).all(is_sound));
                assert!(Statistics::new(&map).missing <= x * y);
            }
        }
    }
    match is_of_interest {
        true => Corpus::Keep,
        false => Corpus::Reject,
    }
});
