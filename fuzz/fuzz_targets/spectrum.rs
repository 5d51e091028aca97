//! Fuzz target that reads any bytes as a CSV or Parquet file with a power spectral density.
//!
//! A file that is accepted has finite densities at positive, ascending wavenumbers. The Parquet
//! reader is reached through files of the corpus that begin with the Parquet signature.
#![no_main]

use asperity_mechanics::topography::spectral_density::SpectralDensity;
use asperity::internal::spectrum_files::read;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: {
    // The default hook aborts the fuzzer on any panic, even on one that the reader catches.
    std::panic::set_hook(Box::new(|_| {}));
}, |bytes: &[u8]| {
    match read(bytes) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(table) => {
            if let Some(factor) = table.length_scale("m") {
                assert!(factor > 0.0);
            }
            if let Ok(density) = SpectralDensity::from_points(table.points) {
                let [from, to] = density.range();
                assert!(0.0 < from && from < to && to.is_finite());
                for share in [0.0, 0.3, 1.0] {
                    let at = density.at(from + share * (to - from));
                    assert!(at >= 0.0, "{at}");
                }
            }
        }
    }
});
