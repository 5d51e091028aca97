//! Fuzz target that reads any text as the description of an X3P file.
//!
//! The input up to the first zero byte is `main.xml`, the rest is both the matrix and the mask of
//! valid points. The target writes the zip archive, whose checksums the fuzzer would not find.
#![no_main]

use std::io::{Cursor, Write};

use asperity::topography_files::{Statistics, read};
use libfuzzer_sys::fuzz_target;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

fuzz_target!(|bytes: &[u8]| {
    let end = bytes.iter().position(|&byte| byte == 0);
    let (description, data) = bytes.split_at(end.unwrap_or(bytes.len()));
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, bytes) in [("main.xml", description), ("d", data), ("v", data)] {
        writer.start_file(name, options).expect("a new name");
        writer.write_all(bytes).expect("room");
    }
    let archive = writer.finish().expect("an archive").into_inner();
    match read(&archive) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(file) => {
            let map = file.channels()[0].map();
            let [x, y] = map.nodes();
            assert!(Statistics::new(&map).missing <= x * y);
        }
    }
});
