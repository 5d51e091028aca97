//! Small files of every format, all of which contain the map [`EXPECTED`].

pub(crate) mod new_formats;
pub(crate) mod tiff_files;
pub(crate) mod vendors;

use std::io::{Cursor, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Heights `[x, y]` at three nodes along x and two along y, in nanometres. If a format can mark
/// missing points, the last point is marked as missing.
pub(crate) const EXPECTED: [f64; 6] = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
/// The heights of [`EXPECTED`] as lines along x; the first line has y = 0.
const ROWS: [[i16; 3]; 2] = [[1, 2, 3], [4, 5, 6]];
/// Sides of the map in metres; some files have others.
const SIDES: [f64; 2] = [3e-6, 4e-6];

/// Sample file with its expected properties.
pub(crate) struct Sample {
    pub(crate) format: &'static str,
    pub(crate) bytes: Vec<u8>,
    /// True if the last point is marked as missing.
    pub(crate) lacks_last_point: bool,
    /// Sides in metres; `None` if the format has no units.
    pub(crate) sides: Option<[f64; 2]>,
}

impl Sample {
    fn new(format: &'static str, bytes: Vec<u8>) -> Sample {
        Sample { format, bytes, lacks_last_point: false, sides: Some(SIDES) }
    }

    fn with_missing(format: &'static str, bytes: Vec<u8>) -> Sample {
        Sample { lacks_last_point: true, ..Sample::new(format, bytes) }
    }

    fn unitless(self) -> Sample {
        Sample { sides: None, ..self }
    }

    /// Sets the sides of a map with square pixels.
    fn square(self) -> Sample {
        Sample { sides: Some([3e-6, 2e-6]), ..self }
    }
}

/// Returns at least one file of each format.
pub(crate) fn samples() -> Vec<Sample> {
    let mut samples = vec![
        Sample::with_missing("x3p", x3p(&Archive::default())),
        Sample::with_missing("sur", sur()),
        Sample::with_missing("sur", deflated_sur()),
        Sample::with_missing("sdf", sdf()),
        Sample::with_missing("opd", opd()),
        Sample::with_missing("al3d", al3d()),
        Sample::with_missing("metropro", metropro()).square(),
        Sample::new("wsxm", wsxm()),
        Sample::with_missing("frt", frt()),
        Sample::with_missing("plu", plu()),
        Sample::new("nanoscope", nanoscope()),
        Sample::new("ibw", igor()),
        Sample::new("mi", mi()),
        Sample::with_missing("bcrf", bcrf()),
        Sample::with_missing("bcrf", bcrf_of_wide_letters()),
        Sample::with_missing("gsf", gsf()),
    ];
    samples.extend(texts());
    samples.extend(grids());
    samples.extend(written());
    samples.extend(tiff_files::samples());
    samples.extend(vendors::samples());
    samples.extend(new_formats::samples());
    samples
}

/// Returns files that `samples/write.py` wrote with gwyfile, h5py and netCDF4.
fn written() -> Vec<Sample> {
    vec![
        Sample::with_missing("gwy", include_bytes!("samples/masked.gwy").to_vec()),
        Sample::with_missing("datx", include_bytes!("samples/nanometers.datx").to_vec()),
        Sample::with_missing("datx", include_bytes!("samples/fringes.datx").to_vec()),
        Sample::with_missing("netcdf", include_bytes!("samples/classic.nc").to_vec()),
        Sample::with_missing("netcdf4", include_bytes!("samples/surface.nc").to_vec()),
        Sample::with_missing("netcdf4", include_bytes!("samples/transposed.nc").to_vec()),
        Sample::new("h5-jpk", include_bytes!("samples/frames.h5-jpk").to_vec()),
        Sample::new("hdf5", include_bytes!("samples/chunks.h5").to_vec()).unitless(),
        Sample::new("hdf5", include_bytes!("samples/nested.h5").to_vec()).unitless(),
        Sample::new("hdf5", include_bytes!("samples/topostats.h5").to_vec()).square(),
    ]
}

fn texts() -> Vec<Sample> {
    let gwyddion = "# Channel: Height\n# Width: 3 µm\n# Height: 4 µm\n# Value units: nm\n\
                    1 2 3\n4 5 nan\n";
    let latin1: Vec<u8> = gwyddion.chars().map(|c| c as u8).collect();
    let wide = gwyddion.encode_utf16().flat_map(u16::to_le_bytes);
    let wide: Vec<u8> = [0xff, 0xfe].into_iter().chain(wide).collect();
    let factor = "h=2 w=3\nx-length = 3e-006 m\ny-length = 4e-006 m\ndata unit=rad\n\
                  height conversion factor (-> m)=1e-009\n1\t2\t3\t\n4\t5\tbad\t\n";
    let sdf = "aISO-1.0\nNumPoints = 3\nNumProfiles = 2\nXscale = 1e-6\nYscale = 2e-6\n\
               Zscale = 1e-9\nDataType = 7\n*\n1 2 3\n4 5 BAD\n*\n";
    let triplets = "# Lateral units: µm\n# Value units: nm\n1,5;0,5;2\n0,5;0,5;1\n2,5;0,5;3\n\
                    0,5;2,5;4\n1,5;2,5;5\n";
    vec![
        Sample::with_missing("text", gwyddion.as_bytes().to_vec()),
        Sample::with_missing("text", latin1),
        Sample::with_missing("text", wide),
        Sample::with_missing("text", triplets.as_bytes().to_vec()),
        Sample::with_missing("sdf", sdf.as_bytes().to_vec()),
        Sample::with_missing("text", factor.as_bytes().to_vec()),
        Sample::new("npy", npy()).unitless(),
    ]
}

/// Returns grids of geographic programs, and other formats with a text header.
fn grids() -> Vec<Sample> {
    let esri = "NCOLS 3\nNROWS 2\nXLLCENTER 0\nYLLCENTER 0\nCELLSIZE 1\nNODATA_value -1\n\
                4 5 -1\n1 2 3\n";
    // The first line of the text has the largest y, so that the last point is in it.
    let surfer = "DSAA\n3 2\n0 2\n0 1\n1 5\n1 2 3\n4 5 1.70141e+038\n";
    let six = Fields::default().text("DSBB", 4).u16(3).u16(2);
    let six =
        [0.0, 2.0, 0.0, 1.0, 1.0, 5.0].into_iter().fold(six, Fields::f64).rows(ROWS, single).0;
    let seven =
        Fields::default().text("DSRB", 4).i32(4).i32(2).text("GRID", 4).i32(72).i32(2).i32(3);
    let header = [0.0, 0.0, 1.0, 1.0, 1.0, 5.0, 0.0, 9e9].into_iter().fold(seven, Fields::f64);
    let seven = header.text("DATA", 4).i32(48).rows(ROWS, |h| f64::from(h).to_le_bytes()).0;
    let nrrd = "NRRD0004\n# A comment\ntype: short\ndimension: 2\nsizes: 3 2\nspacings: 1 2\n\
                units: \"µm\" \"µm\"\nsampleunits: nm\nencoding: raw\nendian: big\n\n";
    let nrrd = Fields::default().bytes(nrrd.as_bytes()).rows(ROWS, i16::to_be_bytes).0;
    vec![
        Sample::with_missing("esri-asc", esri.as_bytes().to_vec()).unitless(),
        Sample::with_missing("surfer", surfer.as_bytes().to_vec()).unitless(),
        Sample::with_missing("surfer", with_last(six, &1.70141e38_f32.to_le_bytes())).unitless(),
        Sample::with_missing("surfer", with_last(seven, &9e9_f64.to_le_bytes())).unitless(),
        Sample::new("nrrd", nrrd),
        Sample::with_missing("iso28600", iso28600().into_bytes()),
        Sample::new("npz", packed(&[("heights.npy", npy())])).unitless(),
    ]
}

fn iso28600() -> String {
    let mut lines = vec![""; 120];
    lines[0] = "ISO/TC 201 SPM data transfer format";
    lines[7] = "MAP_SC";
    lines[16] = "REGULAR MAPPING";
    lines[23..29].copy_from_slice(&["3", "2", "um", "um", "3", "4"]);
    lines[68..70].copy_from_slice(&["Height", "nm"]);
    lines[119] = "end of header";
    lines.extend(["1", "2", "3", "4", "5", "nan", "end of experiment"]);
    lines.join("\r\n")
}

/// Writes a zip archive of files with these names.
pub(crate) fn packed(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// Builder for the bytes of a file.
#[derive(Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn bytes(mut self, bytes: &[u8]) -> Fields {
        self.0.extend(bytes);
        self
    }

    /// Appends text, padded with zeros to `length` bytes.
    fn text(self, text: &str, length: usize) -> Fields {
        let zeros = length - text.len();
        self.bytes(text.as_bytes()).zeros(zeros)
    }

    fn zeros(self, count: usize) -> Fields {
        self.bytes(&vec![0; count])
    }

    /// Appends zeros up to a position in the file.
    fn to(self, offset: usize) -> Fields {
        let zeros = offset - self.0.len();
        self.zeros(zeros)
    }

    fn u16(self, number: u16) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn i32(self, number: i32) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn f32(self, number: f32) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    fn f64(self, number: f64) -> Fields {
        self.bytes(&number.to_le_bytes())
    }

    /// Appends the numbers of all rows; `number` converts a number to bytes.
    fn rows<const N: usize>(self, rows: [[i16; 3]; 2], number: fn(i16) -> [u8; N]) -> Fields {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|&h| number(h)).collect();
        self.bytes(&bytes)
    }
}

/// Returns the lines along x for a file whose first line has the largest y.
fn upside_down() -> [[i16; 3]; 2] {
    [ROWS[1], ROWS[0]]
}

fn single(number: i16) -> [u8; 4] {
    f32::from(number).to_le_bytes()
}

/// Replaces the last number by a marker of a missing point.
fn with_last(mut bytes: Vec<u8>, marker: &[u8]) -> Vec<u8> {
    let end = bytes.len() - marker.len();
    bytes[end..].copy_from_slice(marker);
    bytes
}

/// Variable parts of the content of an X3P file.
pub(crate) struct Archive {
    pub(crate) folder: &'static str,
    pub(crate) description: String,
    pub(crate) data: Vec<u8>,
    /// Mask of the valid points with one bit per point.
    pub(crate) valid: Option<u8>,
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

/// Writes an X3P file with this content.
pub(crate) fn x3p(archive: &Archive) -> Vec<u8> {
    let name = |name: &str| format!("{}{name}", archive.folder);
    let (index, data, valid) =
        (name("main.xml"), name("bindata/data.bin"), name("bindata/valid.bin"));
    let mut files =
        vec![(&*index, archive.description.clone().into_bytes()), (&*data, archive.data.clone())];
    files.extend(archive.valid.map(|bits| (&*valid, vec![bits])));
    packed(&files)
}

fn sur_header(signature: &str) -> Fields {
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
    // The comment has four bytes, the private zone two.
    let units = fields.text("um", 16).text("um", 16).text("nm", 16);
    units.to(334).u16(4).u16(2).to(518)
}

/// Writes a Digital Surf file whose last number, the lowest height minus 2, marks a missing point.
pub(crate) fn sur() -> Vec<u8> {
    let bytes = sur_header("DIGITAL SURF").rows(ROWS, i16::to_le_bytes).0;
    with_last(bytes, &(-1_i16).to_le_bytes())
}

/// Writes the same map as [`sur`], compressed as two streams.
pub(crate) fn deflated_sur() -> Vec<u8> {
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

fn sdf() -> Vec<u8> {
    let header =
        Fields::default().text("bISO-1.0", 42).u16(3).u16(2).f64(1e-6).f64(2e-6).f64(1e-9).f64(0.0);
    // No compression, integers of two bytes.
    let bytes = header.bytes(&[0, 5, 0]).rows(ROWS, i16::to_le_bytes).0;
    with_last(bytes, &i16::MIN.to_le_bytes())
}

fn opd() -> Vec<u8> {
    // Lines along y, which descends.
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
    // Lines of three floats start at multiples of 16 bytes.
    fields = fields.to(500);
    for height in [1e-9, 2e-9, 3e-9, 0.0, 4e-9, 5e-9, 1e10] {
        fields = fields.f32(height);
    }
    fields.0
}

fn metropro() -> Vec<u8> {
    let big = |fields: Fields, number: f32| fields.bytes(&number.to_be_bytes());
    let start = Fields::default().bytes(b"\x88\x1b\x03\x6f").to(60);
    // Four bytes of intensities, 3 × 2 nodes.
    let fields = start.bytes(&[0, 0, 0, 4]).to(68).bytes(&[0, 3, 0, 2]).to(164);
    // Steps of a nanometre.
    let fields = big(big(fields, 1.0), 4096e-9).to(176);
    let fields = big(big(fields, 1.0).to(184), 1e-6).to(838);
    let bytes = fields.rows(ROWS, |height| i32::from(height).to_be_bytes()).0;
    with_last(bytes, &2147483640_i32.to_be_bytes())
}

fn frt() -> Vec<u8> {
    let grid = Fields::default().i32(3).i32(2).i32(16).0;
    let sides = Fields::default().f64(3e-6).f64(4e-6).0;
    let scale = Fields::default().i32(0).f64(1e-10).0;
    // The number 1 marks missing points, so the heights are multiples of 10.
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
    let start = Fields::default().text("Fri Mar 10 16:35:59 2023", 128).to(388);
    let begin = start.i32(2).i32(3).zeros(8).f32(1.0).f32(2.0);
    // A topography of one layer without images.
    let fields = begin.to(428).i32(3).to(488).bytes(&[0, 1]).to(500).i32(2).i32(3);
    [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 1000001.0].into_iter().fold(fields, Fields::f32).zeros(8).0
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

/// Writes a wave with a channel of heights and one of phases, and a note with their units.
pub(crate) fn igor() -> Vec<u8> {
    let note = "PhaseUnit: deg\rScanSize: 3e-06\r";
    // One label for the dimension and one for each channel.
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
    let start = header.to(64 + 12).i32(12).u16(2).to(64 + 68).i32(3).i32(2).i32(2).i32(0);
    let wave = start.f64(1e-6).f64(2e-6).to(64 + 148).text("m", 4).text("m", 4);
    let mut begin = wave.to(384);
    for height in upside_down().as_flattened() {
        begin = begin.f32(f32::from(*height) * 1e-9);
    }
    let fields = begin.rows(ROWS, single).bytes(note.as_bytes());
    let fields = labels.into_iter().fold(fields, |fields, label| fields.text(label, 32));
    with_checksum(fields.0)
}

/// Sets the checksum of a wave such that the integers of its header add up to zero.
pub(crate) fn with_checksum(mut wave: Vec<u8>) -> Vec<u8> {
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

fn npy() -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }\n";
    let fields = Fields::default()
        .bytes(b"\x93NUMPY\x01\0")
        .u16(header.len() as u16)
        .bytes(header.as_bytes());
    [1.0, 4.0, 2.0, 5.0, 3.0, 6.0].into_iter().fold(fields, Fields::f64).0
}

fn wsxm() -> Vec<u8> {
    let text = "WSxM file copyright UAM\r\nSxM Image file\r\nImage header size: 260\r\n\
                  [Control]\r\n X Amplitude: 3 µm\r\n Y Amplitude: 4000 nm\r\n\
                  [General Info]\r\n Image Data Type: short\r\n Number of columns: 3\r\n \
                  Number of rows: 2\r\n Z Amplitude: 5 nm\r\n\
                  [Miscellaneous]\r\n Maximum: 60\r\n Minimum: 10\r\n[Header end]\r\n";
    let header: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let rows = upside_down().map(|row| [row[2], row[1], row[0]]);
    Fields::default().bytes(&header).rows(rows, |height| (10 * height).to_le_bytes()).0
}
