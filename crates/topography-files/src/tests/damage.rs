//! Files that are cut off, damaged, or written to do harm.

use proptest::prelude::*;

use crate::samples::{deflated_sur, igor, samples, sur, with_checksum};
use crate::{Statistics, read};

/// What is read from any bytes is a map, or an error with words.
fn holds(bytes: &[u8]) {
    match read(bytes) {
        Ok(file) => {
            for channel in file.channels() {
                let map = channel.map();
                let [x, y] = map.nodes();
                assert_eq!(map.heights().len(), x * y);
                let statistics = Statistics::of(&map);
                assert_eq!(statistics.heights.is_none(), statistics.missing == x * y);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[test]
fn every_truncation_is_read_to_its_end_or_refused() {
    for sample in samples() {
        for length in 0..sample.bytes.len() {
            holds(&sample.bytes[..length]);
        }
    }
}

#[test]
fn no_height_is_made_up_for_a_binary_file_that_is_cut_off() {
    // What follows the heights may lack: text, the end of a wave, the extremes of a layer.
    let ends = ["text", "sdf", "ibw", "plu", "netcdf"];
    let binary = samples().into_iter().filter(|sample| !ends.contains(&sample.format));
    for sample in binary {
        let cut = &sample.bytes[..sample.bytes.len() - 1];
        assert!(read(cut).is_err(), "{}", sample.format);
    }
}

#[test]
fn a_huge_claim_allocates_nothing() {
    for bytes in [sur(), deflated_sur()] {
        let mut huge = bytes;
        // 32768 × 32768 nodes, and then more than can be counted.
        for side in [[0, 0x80, 0, 0], [0xff, 0xff, 0xff, 0x7f]] {
            huge[108..112].copy_from_slice(&side);
            huge[112..116].copy_from_slice(&side);
            assert!(read(&huge).is_err());
        }
    }
    let text = b"0 0 1\n1 0 1\n0 1000000000 1\n0.001 1 1\n5 2 1\n7 7 7\n";
    assert!(read(text).is_err());
}

proptest! {
    #[test]
    fn damage_does_no_harm(
        damage in proptest::collection::vec((any::<u16>(), any::<u8>()), 1..6),
    ) {
        for sample in samples() {
            let mut bytes = sample.bytes;
            for (place, byte) in &damage {
                let place = usize::from(*place) % bytes.len();
                bytes[place] ^= byte;
            }
            holds(&bytes);
        }
    }

    #[test]
    fn damage_of_a_wave_that_adds_up_does_no_harm(place in 0_usize..384, byte: u8) {
        let mut wave = igor();
        wave[place] = byte;
        holds(&with_checksum(wave));
    }

    #[test]
    fn any_text_does_no_harm(text in "[-0-9.,;e \t\n#=:a]{0,60}") {
        holds(text.as_bytes());
    }
}
