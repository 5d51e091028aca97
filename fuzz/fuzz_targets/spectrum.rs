//! Any bytes as a file of a power spectral density, CSV or Parquet: one with positive wavenumbers that
//! ascend and finite densities, or refused.
//!
//! Parquet is reached only by what begins like it: the corpus has such files.
#![no_main]

use asperity::contact::topography::spectral_density::SpectralDensity;
use asperity::stages::spectrum_files::read;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: {
    // By default any panic ends the fuzzer, even one that is caught and becomes an error.
    std::panic::set_hook(Box::new(|_| {}));
}, |bytes: &[u8]| {
    match read(bytes) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(table) => {
            if let Some(factor) = table.length_scale("m") {
                assert!(factor > 0.0);
            }
            if let Ok(density) = SpectralDensity::through(table.points) {
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
