//! Scanning microscopes.

use super::{Fields, ROWS, Sample, single, upside_down, with_last};

pub fn samples() -> Vec<Sample> {
    vec![
        Sample::new("nanoscope", nanoscope()),
        Sample::new("ibw", igor()),
        Sample::new("mi", mi()),
        Sample::holed("bcrf", bcrf()),
        Sample::holed("bcrf", bcrf_of_wide_letters()),
        Sample::holed("gsf", gsf()),
    ]
}

fn nanoscope() -> Vec<u8> {
    let header = "\\*File list
\\Version: 0x07200000
\\*Scanner list
\\@Sens. Zsens: V 2.000000 nm/V
\\*Ciao image list
\\Data offset: 600
\\Data length: 12
\\Bytes/pixel: 2
\\Samps/line: 3
\\Number of lines: 2
\\Scan Size: 3 4 ~m
\\@2:Image Data: S [Height] \"Height\"
\\@2:Z scale: V [Sens. Zsens] (0.5 V/LSB) 32768 V
\\*File list end
";
    let fields = Fields::default().text(&header.replace('\n', "\r\n"), 600);
    fields.rows(upside_down(), i16::to_le_bytes).0
}

/// A wave whose note says what its two channels are: heights, and phases.
pub fn igor() -> Vec<u8> {
    let note = "PhaseUnit: deg\rScanSize: 3e-06\r";
    // A wave has labels for its dimension and for each of its channels.
    let labels = ["", "HeightTrace", "PhaseTrace"];
    let data = 2 * 6 * 4;
    let header = Fields::default()
        .u16(5)
        .u16(0)
        .i32(320 + data)
        .i32(0)
        .i32(note.len() as i32)
        .to(36 + 2 * 4)
        .i32(32 * labels.len() as i32);
    let wave = header.to(64 + 12).i32(12).u16(2).to(64 + 68).i32(3).i32(2).i32(2).i32(0);
    let wave = wave.f64(1e-6).f64(2e-6).to(64 + 148).text("m", 4).text("m", 4);
    let mut fields = wave.to(384);
    for height in upside_down().as_flattened() {
        fields = fields.f32(f32::from(*height) * 1e-9);
    }
    let fields = fields.rows(ROWS, single).bytes(note.as_bytes());
    let fields = labels.into_iter().fold(fields, |fields, label| fields.text(label, 32));
    with_checksum(fields.0)
}

/// A wave whose header adds up to zero.
pub fn with_checksum(mut wave: Vec<u8>) -> Vec<u8> {
    wave[2..4].fill(0);
    let (numbers, _) = wave[..384].as_chunks::<2>();
    let numbers = numbers.iter().map(|bytes| i16::from_le_bytes(*bytes));
    let sum = numbers.fold(0, i16::wrapping_add);
    wave[2..4].copy_from_slice(&sum.wrapping_neg().to_le_bytes());
    wave
}

fn mi() -> Vec<u8> {
    let header = "fileType      Image
xPixels       3
yPixels       2
xLength       3e-6
yLength       4e-6
bufferLabel   Topography
bufferUnit    um
bufferRange   32.768
bufferLabel   Deflection
bufferUnit    V
bufferRange   1
data          BINARY
";
    // Steps of a nanometre.
    Fields::default()
        .bytes(header.as_bytes())
        .rows(upside_down(), i16::to_le_bytes)
        .rows(ROWS, i16::to_le_bytes)
        .0
}

fn bcr_header(format: &str) -> String {
    format!(
        "fileformat = {format}\nheadersize = 2048\nxpixels = 3\nypixels = 2\nxlength = 3000\n\
         ylength = 4000\nxunit = nm\nyunit = nm\nzunit = nm\nbit2nm = 1\n% a comment = none\n"
    )
}

fn bcrf() -> Vec<u8> {
    let fields = Fields::default().text(&bcr_header("bcrf"), 2048);
    with_last(fields.rows(ROWS, single).0, &f32::MAX.to_le_bytes())
}

fn bcrf_of_wide_letters() -> Vec<u8> {
    let letters = bcr_header("bcrstm_unicode");
    let wide = letters.encode_utf16().flat_map(u16::to_le_bytes);
    let fields = Fields::default().bytes(&wide.collect::<Vec<_>>()).to(4096);
    let bytes = fields.rows(ROWS, i16::to_le_bytes).0;
    with_last(bytes, &i16::MAX.to_le_bytes())
}

fn gsf() -> Vec<u8> {
    let header = "Gwyddion Simple Field 1.0\nXRes = 3\nYRes = 2\nXReal = 3e-6\nYReal = 4e-6\n\
                  XYUnits = m\nZUnits = nm\nTitle = Height\n";
    let fields = Fields::default().bytes(header.as_bytes());
    let padded = (header.len() + 1).next_multiple_of(4);
    let bytes = fields.to(padded).rows(ROWS, single).0;
    with_last(bytes, &f32::NAN.to_le_bytes())
}
