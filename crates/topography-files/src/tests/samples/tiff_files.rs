//! Small TIFF files: GeoTIFF, JPK, LEXT and Park.

use super::{Fields, ROWS, Sample, upside_down};

/// Entry of a directory: its tag, its type and its values.
pub(crate) type Entry = (u16, u16, Vec<u8>);

pub(crate) fn samples() -> Vec<Sample> {
    vec![
        Sample::new("jpk", jpk()),
        Sample::with_missing("lext", lext()),
        Sample::new("park", park()),
        Sample::with_missing("tiff", elevation(&[])).unitless(),
    ]
}

fn short(tag: u16, value: u16) -> Entry {
    (tag, 3, value.to_be_bytes().to_vec())
}

fn long(tag: u16, value: u32) -> Entry {
    (tag, 4, value.to_be_bytes().to_vec())
}

fn double(tag: u16, value: f64) -> Entry {
    (tag, 12, value.to_be_bytes().to_vec())
}

fn text(tag: u16, text: &str) -> Entry {
    (tag, 2, format!("{text}\0").into_bytes())
}

/// Writes a big-endian file of `data`, which starts at byte 8, and a directory for each image.
fn tiff(data: &[u8], images: &[Vec<Entry>]) -> Vec<u8> {
    let start = 8 + data.len();
    let mut file = [b"MM\0*", &(start as u32).to_be_bytes()[..], data].concat();
    for (index, entries) in images.iter().enumerate() {
        file.extend(directory(file.len(), entries, index + 1 == images.len()));
    }
    file
}

/// Writes a directory at a position of a file. Its values and the next directory, if there is one,
/// follow it.
fn directory(start: usize, entries: &[Entry], is_last: bool) -> Vec<u8> {
    let sizes: [usize; 13] = [1, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8];
    let mut values = Vec::new();
    let mut directory = (entries.len() as u16).to_be_bytes().to_vec();
    let values_start = start + 2 + 12 * entries.len() + 4;
    for (tag, kind, bytes) in entries {
        let count = (bytes.len() / sizes[usize::from(*kind)]) as u32;
        directory.extend([tag.to_be_bytes(), kind.to_be_bytes()].concat());
        directory.extend(count.to_be_bytes());
        if bytes.len() <= 4 {
            directory.extend([bytes.as_slice(), &vec![0; 4 - bytes.len()]].concat());
        } else {
            directory.extend(((values_start + values.len()) as u32).to_be_bytes());
            values.extend(bytes);
        }
    }
    let next = if is_last { 0 } else { values_start + values.len() };
    [directory, (next as u32).to_be_bytes().to_vec(), values].concat()
}

/// Writes a file with a thumbnail of one pixel and the map, in two strips.
fn jpk() -> Vec<u8> {
    // The lines of the map are 10 × height − 20.
    let number = |height| (10 * i32::from(height) - 20_i32).to_be_bytes();
    let lines = Fields::default().rows(upside_down(), number).0;
    let thumbnail = vec![
        short(256, 1),
        short(257, 1),
        short(258, 8),
        long(273, 8),
        long(279, 1),
        text(0x8000, "2.0"),
        double(0x8042, 3e-6),
        double(0x8043, 4e-6),
        text(0x8050, "thumbnail"),
    ];
    let map = vec![
        short(256, 3),
        short(257, 2),
        short(258, 32),
        (273, 4, [8_u32, 20].map(u32::to_be_bytes).concat()),
        short(278, 1),
        (279, 4, [12_u32, 12].map(u32::to_be_bytes).concat()),
        short(339, 2),
        text(0x8050, "height"),
        short(0x8051, 1),
        text(0x8052, "Height (measured)"),
        short(0x8080, 2),
        text(0x8081, "nominal"),
        text(0x8090, "raw"),
        text(0x80a3, "NullScaling"),
        text(0x80c0, "nominal"),
        text(0x80d2, "m"),
        text(0x80d3, "LinearScaling"),
        double(0x80d4, 1e-10),
        double(0x80d5, 2e-9),
    ];
    tiff(&lines, &[thumbnail, map])
}

/// Writes a LEXT file: an overview with the description, the heights and a mask with one bit per
/// pixel.
fn lext() -> Vec<u8> {
    let elements = |name: &str, numbers: [u32; 3]| {
        let axes = ["X", "Y", "Z"].into_iter().zip(numbers);
        axes.map(|(axis, number)| format!("<{name}{axis}>{number}</{name}{axis}>")).collect()
    };
    // The calibration of x halves its scale.
    let scales: String = elements("HeightDataPerPixel", [2_000_000, 2_000_000, 1000]);
    let factors: String = elements("MakerCalibrationValue", [500_000, 1_000_000, 1_000_000]);
    let settings = text(0xa40b, &format!("<ExifTagDescData>{factors}</ExifTagDescData>"));
    // The overview has six pixels; the last pixel of the second line of the heights is missing.
    let begin = Fields::default().zeros(6).rows(ROWS, i16::to_be_bytes).bytes(&[0, 0b0010_0000]);
    let exif = directory(8 + begin.0.len(), &[settings], true);
    let image = |description: &str, bits: u16, start: u32, bytes: u32| {
        vec![
            short(256, 3),
            short(257, 2),
            short(258, bits),
            text(270, description),
            long(273, start),
            long(279, bytes),
        ]
    };
    let description = format!("<?xml version=\"1.0\"?><TiffTagDescData>{scales}</TiffTagDescData>");
    let mut overview = image(&description, 8, 8, 6);
    overview.push(long(0x8769, 8 + begin.0.len() as u32));
    let images = [overview, image("HEIGHT", 16, 14, 12), image("INVALID", 1, 26, 2)];
    tiff(&begin.bytes(&exif).0, &images)
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
    let header = wide(header, "um", 8).zeros(6 * 4 + 2 * 8 + 3 * 16).i32(2).zeros(8 + 16 + 32).0;
    let number = |height| (f32::from(height) / 2.0 + 1.0).to_le_bytes();
    let entries = vec![
        short(256, 3),
        short(257, 2),
        long(50432, 0x0e03_1301),
        long(50433, 0x0100_0002),
        (50434, 7, Fields::default().rows(upside_down(), number).0),
        (50435, 7, header),
    ];
    tiff(&[], &[entries])
}

/// Writes a GeoTIFF without a unit, whose first line is the northernmost, with further entries of
/// the tags 33001 to 42112.
pub(crate) fn elevation(more: &[Entry]) -> Vec<u8> {
    let number = |height| f32::from(height).to_be_bytes();
    let mut data = Fields::default().rows(upside_down(), number).0;
    data[8..12].copy_from_slice(&(-9999_f32).to_be_bytes());
    let image = [short(256, 3), short(257, 2), short(258, 32), long(273, 8), long(279, 24)];
    let entries = [&image[..], &[short(339, 3)], more, &[text(42113, "-9999")]].concat();
    tiff(&data, &[entries])
}
