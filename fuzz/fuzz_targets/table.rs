//! Any bytes as a file of the store: a table, or refused.
//!
//! The reader refuses whatever does not match its digest, so the right digest is put in first:
//! what is fuzzed is what a forger with the right digest could do.
#![no_main]

use asperity::tables::parquet::digest::seal;
use asperity::tables::parquet::{Columns, decode_bytes};
use asperity::tables::store::key::Provenance;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: {
    // By default any panic ends the fuzzer, even one that is caught and becomes an error.
    std::panic::set_hook(Box::new(|_| {}));
}, |bytes: &[u8]| {
    let bytes = seal(bytes.to_vec()).unwrap_or_default();
    for columns in [Columns::All, Columns::Light] {
        if let Ok((table, metadata)) = decode_bytes(bytes.clone().into(), columns) {
            assert_eq!(table.names().len(), table.batch().num_columns());
            // Whatever it tells of itself, a key can be worked out or not.
            Provenance::from_metadata(&metadata).map(|told| told.key());
        }
    }
});
