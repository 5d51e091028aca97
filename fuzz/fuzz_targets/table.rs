//! Fuzz target that reads any bytes as a file of the store.
//!
//! The reader refuses bytes that do not match their digest. The target therefore inserts the right
//! digest, as somebody who forges a file could do.
#![no_main]

use asperity::tables::parquet::digest::seal;
use asperity::tables::parquet::{Columns, decode_bytes};
use asperity::tables::store::provenance::Provenance;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: {
    // The default hook aborts the fuzzer on any panic, even on one that the reader catches.
    std::panic::set_hook(Box::new(|_| {}));
}, |bytes: &[u8]| {
    let bytes = seal(bytes.to_vec()).unwrap_or_default();
    for columns in [Columns::All, Columns::Light] {
        if let Ok((table, metadata)) = decode_bytes(bytes.clone().into(), columns) {
            assert_eq!(table.names().len(), table.batch().num_columns());
            // Computing the key must not panic for any metadata.
            Provenance::from_metadata(&metadata).map(|provenance| provenance.key());
        }
    }
});
