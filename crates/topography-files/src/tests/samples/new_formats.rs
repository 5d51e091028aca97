//! Small files of Nanonis, NanoFocus, TrueMap and Sensofar.

use super::{Fields, ROWS, Sample, packed, upside_down, with_last};

pub(crate) fn samples() -> Vec<Sample> {
    vec![
        Sample::with_missing("sxm", sxm()),
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
    packed(&[("index.xml", index.as_bytes().to_vec()), ("LAYER_0.raw", data)])
}
