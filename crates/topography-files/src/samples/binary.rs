//! Containers and profilometers.

use std::io::{Cursor, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::{Fields, ROWS, Sample, upside_down, with_last};

pub fn samples() -> Vec<Sample> {
    vec![
        Sample::holed("x3p", x3p(&Archive::default())),
        Sample::holed("sur", sur()),
        Sample::holed("sur", deflated_sur()),
        Sample::holed("gwy", gwy()),
        Sample::holed("sdf", sdf()),
        Sample::holed("opd", opd()),
        Sample::holed("al3d", al3d()),
        Sample {
            // Its pixels are square.
            sides: Some([3e-6, 2e-6]),
            ..Sample::holed("metropro", metropro())
        },
        Sample::holed("netcdf", netcdf()),
        Sample::holed("frt", frt()),
        Sample::holed("plu", plu()),
    ]
}

/// What goes into an X3P.
pub struct Archive {
    pub folder: &'static str,
    pub description: String,
    pub data: Vec<u8>,
    /// A bit for each point.
    pub valid: Option<u8>,
}

impl Default for Archive {
    fn default() -> Archive {
        let description = "<?xml version=\"1.0\"?>
<p:ISO5436_2 xmlns:p=\"http://www.opengps.eu/2008/ISO5436_2\"><Record1>
  <Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType>
  <Axes><CX><AxisType>I</AxisType><Increment>1e-6</Increment></CX>
    <CY><AxisType>I</AxisType><Increment>2e-6</Increment></CY>
    <CZ><AxisType>A</AxisType><DataType>I</DataType><Increment>1e-9</Increment>
      <Offset>3e-9</Offset></CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>3</SizeX><SizeY>2</SizeY><SizeZ>1</SizeZ></MatrixDimension>
  <DataLink><PointDataLink>bindata/data.bin</PointDataLink>
    <ValidPointsLink>bindata/valid.bin</ValidPointsLink></DataLink></Record3></p:ISO5436_2>";
        let data = Fields::default().rows(ROWS, |height| (height - 3).to_le_bytes());
        Archive {
            folder: "",
            description: description.to_owned(),
            data: data.0,
            valid: Some(0b01_1111),
        }
    }
}

/// An archive of a description and a matrix.
pub fn x3p(archive: &Archive) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |name: &str, bytes: &[u8]| {
        let name = format!("{}{name}", archive.folder);
        let options = SimpleFileOptions::default();
        writer.start_file(name, options).unwrap();
        writer.write_all(bytes).unwrap();
    };
    add("main.xml", archive.description.as_bytes());
    add("bindata/data.bin", &archive.data);
    if let Some(valid) = archive.valid {
        add("bindata/valid.bin", &[valid]);
    }
    writer.finish().unwrap().into_inner()
}

fn sur_header(signature: &str) -> Fields {
    let units = |fields: Fields| fields.text("um", 16).text("um", 16).text("nm", 16);
    let fields = Fields::default()
        .text(signature, 12)
        .to(18)
        .u16(2)
        .to(86)
        .u16(1)
        .to(98)
        .u16(16)
        .i32(1)
        .i32(6)
        .i32(3)
        .i32(2)
        .i32(6)
        .f32(1.0)
        .f32(2.0)
        .f32(1.0)
        .to(180);
    // A comment of four bytes, a private zone of two.
    units(units(fields)).to(334).u16(4).u16(2).to(518)
}

/// With the lowest height less two in place of the last.
pub fn sur() -> Vec<u8> {
    let bytes = sur_header("DIGITAL SURF").rows(ROWS, i16::to_le_bytes).0;
    with_last(bytes, &(-1_i16).to_le_bytes())
}

/// The same in two streams.
pub fn deflated_sur() -> Vec<u8> {
    let heights = &sur()[518..];
    let deflated = |bytes: &[u8]| {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let parts = [&heights[..8], &heights[8..]];
    let streams = parts.map(deflated);
    let mut fields = sur_header("DSCOMPRESSED").i32(2);
    for (part, stream) in parts.iter().zip(&streams) {
        fields = fields.i32(part.len() as i32).i32(stream.len() as i32);
    }
    fields.bytes(&streams.concat()).0
}

fn gwy() -> Vec<u8> {
    let component =
        |name: &str, kind: char, value: &[u8]| [name.as_bytes(), &[0, kind as u8], value].concat();
    let object = |name: &str, components: &[Vec<u8>]| {
        let components = components.concat();
        let length = (components.len() as u32).to_le_bytes();
        [name.as_bytes(), &[0], &length, &components].concat()
    };
    let unit = |unit: &[u8]| object("GwySIUnit", &[component("unitstr", 's', unit)]);
    let field = |heights: [f64; 6]| {
        let numbers: Vec<u8> = heights.iter().flat_map(|h| h.to_le_bytes()).collect();
        let data = [&6_u32.to_le_bytes()[..], &numbers].concat();
        let components = [
            component("xres", 'i', &3_i32.to_le_bytes()),
            component("yres", 'i', &2_i32.to_le_bytes()),
            component("xreal", 'd', &3e-6_f64.to_le_bytes()),
            // Gwyddion takes its magnitude.
            component("yreal", 'd', &(-4e-6_f64).to_le_bytes()),
            component("si_unit_xy", 'o', &unit(b"m\0")),
            component("si_unit_z", 'o', &unit(b"m\0")),
            component("data", 'D', &data),
        ];
        object("GwyDataField", &components)
    };
    let heights = [1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9];
    let components = [
        component("/filename", 's', b"a\0"),
        component("/5/data/title", 's', b"Height\0"),
        component("/5/data", 'o', &field(heights)),
        component("/5/mask", 'o', &field([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
        component("/5/select", 'S', b"\x01\0\0\0x\0"),
        component("/5/show", 'b', &[1]),
    ];
    [&b"GWYP"[..], &object("GwyContainer", &components)].concat()
}

fn sdf() -> Vec<u8> {
    let header = Fields::default().text("bISO-1.0", 42).u16(3).u16(2);
    let header = header.f64(1e-6).f64(2e-6).f64(1e-9).f64(0.0);
    // No compression, whole numbers of two bytes.
    let bytes = header.bytes(&[0, 5, 0]).rows(ROWS, i16::to_le_bytes).0;
    with_last(bytes, &i16::MIN.to_le_bytes())
}

fn opd() -> Vec<u8> {
    // Lines along y, from the largest on.
    let columns: [[i16; 2]; 3] = [[4, 1], [5, 2], [6, 3]];
    let mut numbers: Vec<f32> = columns.as_flattened().iter().map(|&h| h.into()).collect();
    numbers[4] = f32::MAX;
    let raster = numbers
        .into_iter()
        .fold(Fields::default().u16(3).u16(2).u16(4), |fields, number| fields.f32(number));
    let blocks = [
        ("Raw", 3, raster.0),
        ("Wavelength", 7, 500_f32.to_le_bytes().to_vec()),
        ("Mult", 6, 500_i16.to_le_bytes().to_vec()),
        ("Pixel_size", 7, 1e-3_f32.to_le_bytes().to_vec()),
        ("Aspect", 7, 2_f32.to_le_bytes().to_vec()),
    ];
    let entry = |fields: Fields, name: &str, kind: u16, length: usize| {
        fields.text(name, 16).u16(kind).i32(length as i32).u16(0)
    };
    let fields = Fields::default().bytes(&[1, 0]);
    let mut fields = entry(fields, "Directory", 1, 24 * (blocks.len() + 1));
    for (name, kind, bytes) in &blocks {
        fields = entry(fields, name, *kind, bytes.len());
    }
    for (_, _, bytes) in &blocks {
        fields = fields.bytes(bytes);
    }
    fields.0
}

fn al3d() -> Vec<u8> {
    let lines = [
        ("Version", "1"),
        ("TagCount", "6"),
        ("Cols", "3"),
        ("Rows", "2"),
        ("DepthImageOffset", "500"),
        ("PixelSizeXMeter", "1e-6"),
        ("PixelSizeYMeter", "2e-6"),
        ("InvalidPixelValue", "1e10"),
    ];
    let mut fields = Fields::default().bytes(b"AliconaImaging\0\r\n");
    for (name, value) in lines {
        fields = fields.text(name, 20).text(value, 30).bytes(b"\r\n");
    }
    // Lines of three floats start every sixteen bytes.
    fields = fields.to(500);
    for height in [1e-9, 2e-9, 3e-9, 0.0, 4e-9, 5e-9, 1e10] {
        fields = fields.f32(height);
    }
    fields.0
}

fn metropro() -> Vec<u8> {
    let big = |fields: Fields, number: f32| fields.bytes(&number.to_be_bytes());
    let fields = Fields::default().bytes(b"\x88\x1b\x03\x6f").to(60);
    // Four bytes of intensities, three times two nodes.
    let fields = fields.bytes(&[0, 0, 0, 4]).to(68).bytes(&[0, 3, 0, 2]).to(164);
    // Steps of a nanometre.
    let fields = big(big(fields, 1.0), 4096e-9).to(176);
    let fields = big(big(fields, 1.0).to(184), 1e-6).to(838);
    let bytes = fields.rows(ROWS, |height| i32::from(height).to_be_bytes()).0;
    with_last(bytes, &2147483640_i32.to_be_bytes())
}

/// `heights` over x and y, lines along y, and a mask.
fn netcdf() -> Vec<u8> {
    let start = netcdf_header(0).len() as u64;
    let heights = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
    let numbers = heights.iter().flat_map(|h: &f64| h.to_be_bytes());
    let mask = [0, 0, 0, 0, 0, 1];
    let fields = Fields::default().bytes(&netcdf_header(start));
    fields.bytes(&numbers.collect::<Vec<_>>()).bytes(&mask).0
}

/// The header of a file whose numbers start at a place.
fn netcdf_header(start: u64) -> Vec<u8> {
    const BYTE: u32 = 1;
    const DOUBLE: u32 = 6;
    let big = |fields: Fields, numbers: &[u32]| {
        let numbers = numbers.iter().flat_map(|number| number.to_be_bytes());
        fields.bytes(&numbers.collect::<Vec<_>>())
    };
    let name = |fields: Fields, name: &str| {
        let padded = name.len().next_multiple_of(4);
        big(fields, &[name.len() as u32]).text(name, padded)
    };
    let unit = |fields: Fields, unit: &str| big(name(fields, "unit"), &[2, 2]).text(unit, 4);
    let end =
        |fields: Fields, kind: u32, begin: u64| big(fields, &[kind, 0]).bytes(&begin.to_be_bytes());
    let axis = |fields: Fields, axis: &str, number: u32, length: f64| {
        let fields = big(name(fields, axis), &[1, number, 12, 2]);
        let fields = big(name(fields, "length"), &[DOUBLE, 1]).bytes(&length.to_be_bytes());
        end(unit(fields, "nm"), DOUBLE, start)
    };
    let fields = big(Fields::default().bytes(b"CDF\x02"), &[0, 10, 2]);
    let fields = big(name(fields, "x"), &[3]);
    let fields = big(name(fields, "y"), &[2]);
    let fields = big(fields, &[0, 0, 11, 4]);
    let fields = axis(axis(fields, "x", 0, 3e3), "y", 1, 4e3);
    let fields = big(name(fields, "heights"), &[2, 0, 1, 12, 1]);
    let fields = end(unit(fields, "nm"), DOUBLE, start);
    let fields = big(name(fields, "mask"), &[2, 0, 1, 0, 0]);
    end(fields, BYTE, start + 48).0
}

fn frt() -> Vec<u8> {
    let grid = Fields::default().i32(3).i32(2).i32(16).0;
    let sides = Fields::default().f64(3e-6).f64(4e-6).0;
    let scale = Fields::default().i32(0).f64(1e-10).0;
    // The number 1 is no height: 10 is.
    let rows = upside_down().map(|row| row.map(|height| 10 * height));
    let mut map = Fields::default().rows(rows, i16::to_le_bytes).0;
    map[4..6].copy_from_slice(&1_u16.to_le_bytes());
    let blocks = [(0x66, grid), (0x67, sides), (0x6c, scale), (0x0b, map)];
    let mut fields = Fields::default().text("FRTM_GLIDERV1.00", 16).u16(4);
    for (number, bytes) in blocks {
        fields = fields.u16(number).i32(bytes.len() as i32).bytes(&bytes);
    }
    fields.0
}

fn plu() -> Vec<u8> {
    let fields = Fields::default().text("Fri Mar 10 16:35:59 2023", 128).to(388);
    let fields = fields.i32(2).i32(3).zeros(8).f32(1.0).f32(2.0);
    // A topography, of one layer without pictures.
    let fields = fields.to(428).i32(3).to(488).bytes(&[0, 1]).to(500);
    let fields = fields.i32(2).i32(3);
    [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 1000001.0].into_iter().fold(fields, Fields::f32).zeros(8).0
}
