//! Fuzz target that reads the files of a scan of a nanomeasuring machine.
//!
//! The input is the description of the scan and, for two lines, the description and the data,
//! separated by zero bytes. They are packed into an archive, whose checksums the fuzzer would not
//! find.
#![no_main]

use std::io::{Cursor, Write};

use asperity::topography_files::{Statistics, read};
use libfuzzer_sys::fuzz_target;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const NAMES: [&str; 5] = ["a.dsc", "a_1_1.dsc", "a_1_1.dat", "a_1_2.dsc", "a_1_2.dat"];

fuzz_target!(|bytes: &[u8]| {
    let mut contents = bytes.splitn(NAMES.len(), |&byte| byte == 0);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for name in NAMES {
        archive.start_file(name, stored).unwrap();
        archive.write_all(contents.next().unwrap_or_default()).unwrap();
    }
    let archive = archive.finish().unwrap().into_inner();
    if let Ok(file) = read(&archive) {
        for channel in file.channels().iter().take(4) {
            let map = channel.map();
            let is_sound = |(height, missing): (&f64, &bool)| height.is_finite() != *missing;
            assert!(map.heights().iter().zip(map.missing()).all(is_sound));
            assert!(Statistics::new(&map).missing <= map.heights().len());
        }
    }
});
