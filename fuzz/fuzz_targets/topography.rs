//! Any bytes as a file of surface topography, of whichever format they start like.
#![no_main]

use asperity::topography_files::{Statistics, read};
use libfuzzer_sys::fuzz_target;

/// Bytes of an Igor wave that add up to zero.
const WAVE_HEADER: usize = 384;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    if bytes.len() >= WAVE_HEADER && bytes.starts_with(&[5, 0]) {
        // With the right checksum put in: chance would not find it.
        bytes[2..4].fill(0);
        let (numbers, _) = bytes[..WAVE_HEADER].as_chunks::<2>();
        let numbers = numbers.iter().map(|bytes| i16::from_le_bytes(*bytes));
        let sum = numbers.fold(0, i16::wrapping_add);
        bytes[2..4].copy_from_slice(&sum.wrapping_neg().to_le_bytes());
    }
    match read(&bytes) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(file) => {
            assert!(!file.channels().is_empty());
            for channel in file.channels().iter().take(4) {
                let map = channel.map();
                let [x, y] = map.nodes();
                assert_eq!(map.heights().len(), x * y);
                let is_sound = |(height, missing): (&f64, &bool)| height.is_finite() != *missing;
                assert!(map.heights().iter().zip(map.missing()).all(is_sound));
                assert!(Statistics::of(&map).missing <= x * y);
            }
        }
    }
});
