//! Small files of Nanonis, Park, GeoTIFF, NanoFocus, TrueMap and Sensofar.

use std::io::{Cursor, Write};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::{Fields, ROWS, Sample, single, upside_down, with_last};

pub(crate) fn samples() -> Vec<Sample> {
    vec![
        Sample::with_missing("sxm", sxm()),
        Sample::new("park", park()),
        Sample { sides: None, ..Sample::with_missing("tiff", elevation(&[])) },
        Sample::new("nms", nms()),
        Sample::with_missing("tmd", tmd()),
        Sample::with_missing("plux", plux()),
        Sample::with_missing("nhf", include_bytes!("scan.nhf").to_vec()),
    ]
}

fn big(fields: Fields, rows: [[i16; 3]; 2]) -> Fields {
    fields.rows(rows, |height| (f32::from(height) * 1e-9).to_be_bytes())
}

/// Writes a scan from above, whose channel has both directions.
fn sxm() -> Vec<u8> {
    let header = ":NANONIS_VERSION:\n2\n:SCAN_PIXELS:\n       3       2\n:SCAN_RANGE:\n  3.0E-6  \
                  4.0E-6\n:SCAN_DIR:\ndown\n:DATA_INFO:\n\tChannel\tName\tUnit\tDirection\t\
                  Calibration\tOffset\n\t14\tZ\tm\tboth\t1\t0\n\n:SCANIT_END:\n\n\n";
    let fields = Fields::default().bytes(header.as_bytes()).bytes(b"\x1a\x04");
    let mut bytes = big(fields, upside_down()).0;
    // The last number of the first line is the point at the ends of x and y.
    let end = bytes.len() - 3 * 4;
    bytes[end - 4..end].copy_from_slice(&f32::NAN.to_be_bytes());
    big(Fields::default().bytes(&bytes), upside_down().map(|[a, b, c]| [c, b, a])).0
}

/// Writes a little-endian TIFF file of one directory, whose values follow it.
fn tiff(entries: &[(u16, u16, Vec<u8>)]) -> Vec<u8> {
    let sizes: [usize; 13] = [1, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8];
    let mut values: Vec<u8> = Vec::new();
    let start = 8 + 2 + 12 * entries.len() + 4;
    let mut fields = Fields::default().bytes(b"II*\0").i32(8).u16(entries.len() as u16);
    for (tag, kind, bytes) in entries {
        let count = bytes.len() / sizes[usize::from(*kind)];
        fields = fields.u16(*tag).u16(*kind).i32(count as i32);
        if bytes.len() <= 4 {
            fields = fields.bytes(bytes).zeros(4 - bytes.len());
        } else {
            fields = fields.i32((start + values.len()) as i32);
            values.extend(bytes);
        }
    }
    fields.i32(0).bytes(&values).0
}

fn short(tag: u16, value: u16) -> (u16, u16, Vec<u8>) {
    (tag, 3, value.to_le_bytes().to_vec())
}

fn long(tag: u16, value: u32) -> (u16, u16, Vec<u8>) {
    (tag, 4, value.to_le_bytes().to_vec())
}

/// Writes floats, which the header scales to micrometres.
fn park() -> Vec<u8> {
    let wide = |fields: Fields, text: &str, letters: usize| {
        let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let zeros = 2 * letters - units.len();
        fields.bytes(&units).zeros(zeros)
    };
    let start = wide(Fields::default().i32(0), "Height", 32).zeros(16 + 16);
    let begin = start.i32(3).i32(2).zeros(8 + 4 + 8 + 12).f64(3.0).f64(4.0);
    // A gain of 1e-3, a scale of 2 and an offset of -2 steps.
    let header = begin.zeros(4 * 8 + 16 + 16).f64(1e-3).f64(2.0).f64(-2.0);
    let header = wide(header, "um", 8).zeros(6 * 4).0;
    let number = |height| (f32::from(height) / 2.0 + 1.0).to_le_bytes();
    let data = Fields::default().rows(upside_down(), number);
    let header = Fields::default().bytes(&header).zeros(2 * 8 + 3 * 16).i32(2).zeros(8 + 16 + 32).0;
    tiff(&[
        short(256, 3),
        short(257, 2),
        long(50432, 0x0e03_1301),
        long(50433, 0x0100_0002),
        (50434, 7, data.0),
        (50435, 7, header),
    ])
}

/// Writes a GeoTIFF without a unit, whose first line is the northernmost, with further entries of
/// the tags 33001 to 42112.
pub(crate) fn elevation(more: &[(u16, u16, Vec<u8>)]) -> Vec<u8> {
    let mut data = Fields::default().rows(upside_down(), single).0;
    data[8..12].copy_from_slice(&(-9999_f32).to_le_bytes());
    let pixels = 8 + 2 + 12 * (9 + more.len() as u32) + 4;
    let mut entries = vec![
        short(256, 3),
        short(257, 2),
        short(258, 32),
        // The values of entries follow the directory in their order; those of 33000 come first.
        long(273, pixels),
        short(278, 2),
        long(279, 24),
        short(339, 3),
        (33000, 7, data),
    ];
    entries.extend_from_slice(more);
    entries.push((42113, 2, b"-9999\0".to_vec()));
    tiff(&entries)
}

fn nms() -> Vec<u8> {
    // The numbers 0 to 65534 have steps of a nanometre.
    let begin = Fields::default().to(16).f64(-31.767).f64(33.767).to(1368);
    let header = begin.i32(3).i32(2).f64(1000.0).f64(2000.0).to(3468);
    header.rows(ROWS, |height| (31767 + height.cast_unsigned()).to_le_bytes()).0
}

fn tmd() -> Vec<u8> {
    let start = Fields::default().text("Binary TrueMap Data File v2.0\r\n", 32);
    let fields = start.text("a comment\r\n", 24).i32(3).i32(2).f32(3e-3).f32(4e-3).zeros(8);
    let bytes = fields.rows(ROWS, |height| (f32::from(height) * 1e-6).to_le_bytes()).0;
    with_last(bytes, &f32::NAN.to_le_bytes())
}

fn plux() -> Vec<u8> {
    let index = "<?xml version=\"1.0\"?><xml><GENERAL><IMAGE_SIZE_X>3</IMAGE_SIZE_X>\
                 <IMAGE_SIZE_Y>2</IMAGE_SIZE_Y><FOV_X>1.0</FOV_X><FOV_Y>2.0</FOV_Y></GENERAL>\
                 <LAYER_0><FILENAME_Z>LAYER_0.raw</FILENAME_Z></LAYER_0></xml>";
    let data = Fields::default().rows(ROWS, |height| (f32::from(height) * 1e-3).to_le_bytes()).0;
    let data = with_last(data, &f32::NAN.to_le_bytes());
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in [("index.xml", index.as_bytes()), ("LAYER_0.raw", &data)] {
        writer.start_file(name, SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}
