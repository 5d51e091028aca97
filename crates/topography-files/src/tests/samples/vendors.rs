//! Small files of single instruments and programs: Keyence, Nanosurf, NMM, Vision64, WSxM and
//! the text exports with a header of their own. All contain the map of the other samples.

use super::{Fields, ROWS, Sample, packed, single, upside_down, with_last};

/// Returns at least one file of each format of this module.
pub(crate) fn samples() -> Vec<Sample> {
    vec![
        Sample::new("vk", vk(b"VK4_")),
        Sample::new("vk", vk(b"VK3_")),
        Sample::new("vk", vk6()),
        Sample::with_missing("opdx", opdx()),
        Sample::new("nid", nid()),
        Sample::new("nmm", nmm()),
        Sample::with_missing("gxyzf", gxyzf()),
        Sample::with_missing("wyko-asc", WYKO.as_bytes().to_vec()),
        Sample::with_missing("zygo-asc", zygo_xyz().into_bytes()).square(),
        Sample::with_missing("zygo-asc", zygo_ascii().into_bytes()).square(),
        Sample::with_missing("keyence-csv", KEYENCE.as_bytes().to_vec()).square(),
        Sample::with_missing("text", WSXM_TEXT.as_bytes().to_vec()),
    ]
}

/// Writes a VK3 or VK4 file. The table of a VK4 file has one more position.
pub(crate) fn vk(signature: &[u8; 4]) -> Vec<u8> {
    let positions = if signature == b"VK4_" { 18 } else { 17 };
    let conditions = 12 + 4 * positions;
    let heights = conditions + 304;
    let start = Fields::default().bytes(signature).to(12).i32(conditions as i32);
    let begin = start.to(12 + 4 * 6).i32(heights as i32);
    // Texts after the heights, which are empty.
    let texts = heights + 7 * 4 + 768 + 12;
    let fields = begin.to(12 + 4 * 16).i32(texts as i32);
    // Length of the conditions, and a date.
    let fields = [304, 2024, 12, 3].into_iter().fold(fields.to(conditions), Fields::i32);
    // Picometres per pixel along x and y, and per digit.
    let fields = fields.to(conditions + 4 * 42).i32(1_000_000).i32(2_000_000).i32(1000);
    let fields = fields.to(heights).i32(3).i32(2).i32(16).i32(0).i32(12).i32(0).i32(6);
    fields.zeros(768).rows(ROWS, i16::to_le_bytes).zeros(8).0
}

/// Writes a VK6 file: a VK4 file in an archive after a preview.
fn vk6() -> Vec<u8> {
    let mut bytes = b"VK6\0preview".to_vec();
    bytes.extend(packed(&[("Vk4File", vk(b"VK4_"))]));
    bytes
}

fn opdx() -> Vec<u8> {
    let name = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let item = |key: &str, kind: u8, content: &[u8]| [&name(key), &[kind][..], content].concat();
    // The length of the content has one or two bytes.
    let structured = |content: &[u8]| match content.len() {
        length @ 0..256 => [&[1, length as u8][..], content].concat(),
        length => [&[2, length as u8, (length >> 8) as u8][..], content].concat(),
    };
    let end = || item("", 0x7f, &[0xff, 0xff]);
    let container = |key: &str, kind: u8, items: &[Vec<u8>]| {
        item(key, kind, &structured(&[items.concat(), end()].concat()))
    };
    let quantity = |key: &str, value: f64, unit: &str, symbol: &str| {
        let content = [&value.to_le_bytes()[..], &name(unit), &name(symbol)].concat();
        item(key, 0x13, &structured(&content))
    };
    let heights = Fields::default().i32(2).i32(3).rows(ROWS, single).0;
    let heights = structured(&with_last(heights, &f32::NAN.to_le_bytes()));
    let matrix = [name("Matrix<float>"), vec![0; 4], name("float"), heights].concat();
    let raw = [
        item("Matrix", 0x00, &matrix),
        item("Dimension1Points", 0x07, &2_u32.to_le_bytes()),
        item("Dimension2Points", 0x07, &3_u32.to_le_bytes()),
        // The extents are the distances between the first and the last point.
        quantity("Dimension1Extent", 2e-3, "Millimeter", "mm"),
        quantity("Dimension2Extent", 2.0, "Micrometer", "µm"),
        quantity("DataScale", 1.0, "Nanometer", "nm"),
        item("DataKind", 0x12, &structured(b"Height")),
    ];
    let heights = [name("StringList"), structured(&name("Raw"))].concat();
    let metadata = [
        item("DataKind", 0x12, &structured(b"Surface Height")),
        item("PrimaryData2D", 0x12, &structured(b"Raw")),
        container("2D_Channels", 0x7d, &[item("Height", 0x42, &heights)]),
        item("Time", 0x15, &[0; 9]),
    ];
    [
        b"VCA DATA\x01\x00\x00\x55".to_vec(),
        container("2D_Data", 0x7d, &[container("Raw", 0x47, &raw)]),
        container("MetaData", 0x7d, &metadata),
        end(),
    ]
    .concat()
}

fn nid() -> Vec<u8> {
    let channel = |number: u8, name: &str, range: f64, lowest: f64| {
        format!(
            "[DataSet-0:{number}]\nPoints=3\nLines=2\nFrame=Scan forward\nDim0Unit=m\n\
             Dim0Range=3e-06\nDim1Unit=m\nDim1Range=4e-06\nDim2Name={name}\nDim2Unit=m\n\
             Dim2Range={range}\nDim2Min={lowest}\nSaveMode=Binary\nSaveBits=16\nSaveSign=Signed\n\
             SaveOrder=Intel\n"
        )
    };
    let header = "[DataSet]\nVersion=2\nGroupCount=1\nGr0-Count=4\nGr0-Ch0=DataSet-0:0\n\
                  Gr0-Ch2=DataSet-0:2\n[DataSet-Info]\n-- Scan --=--------\nDate=03-11-2022\n\
                  Time=11:46:25\n";
    let deflection = channel(0, "Deflection", 1e-5, -5e-6);
    let header = format!("{header}{deflection}{}#!", channel(2, "Z-Axis", 6.5536e-5, -3.2768e-5));
    let fields = Fields::default().bytes(header.replace('\n', "\r\n").as_bytes());
    fields.rows(ROWS, i16::to_le_bytes).rows(upside_down(), i16::to_le_bytes).0
}

pub(crate) fn nmm() -> Vec<u8> {
    let rule = "------------------------------------------\r\n";
    let scan = format!(
        "{rule}Scan procedure description file\r\nCreation time     :03-Dec-2024 08:11:04\r\n{rule}\
         3. Scan field\r\n\r\n   Scan line length : 2. [um]\r\n   Scan field width : 2. [um]\r\n\
         \u{20}  Number of lines  : 2\r\n   Number of scans  : 1\r\n\
         \u{20}  Distance beetween points  : 1. [um]\r\n   Distance beetween lines   : 2. [um]\r\n\
         {rule}"
    );
    let mut files = vec![("test.dsc", scan.into_bytes())];
    let line = format!(
        "{rule}0 : 03-Dec-2024 08:11:24 : Lx : 3 : X length (LX)\r\n\
         1 : 03-Dec-2024 08:11:24 : -Lz+Az : 3 : Surface height (-LZ+AZ)\r\n{rule}"
    );
    let names = [["test_1_1.dsc", "test_1_1.dat"], ["test_1_2.dsc", "test_1_2.dat"]];
    for (row, [description, data]) in ROWS.iter().zip(names) {
        let row = row.iter().map(|height| format!(" 0.0E+0000 {height}.0E-0009\r\n"));
        files.push((description, line.clone().into_bytes()));
        files.push((data, row.collect::<String>().into_bytes()));
    }
    packed(&files)
}

fn gxyzf() -> Vec<u8> {
    let header = "Gwyddion XYZ Field 1.0\nNChannels = 1\nNPoints = 5\nXYUnits = m\n\
                  ZUnits1 = nm\nTitle1 = Height\n";
    let padded = (header.len() + 1).next_multiple_of(8);
    let fields = Fields::default().bytes(header.as_bytes()).to(padded);
    let points = [(1, 0, 2.0), (0, 0, 1.0), (2, 0, 3.0), (0, 1, 4.0), (1, 1, 5.0)];
    let add = |fields: Fields, (x, y, height): (u8, u8, f64)| {
        let [x, y] = [(f64::from(x) + 0.5) * 1e-6, (f64::from(y) + 0.5) * 2e-6];
        fields.f64(x).f64(y).f64(height)
    };
    points.into_iter().fold(fields, add).0
}

pub(crate) const WYKO: &str = "Wyko ASCII Data File Format 0\t0\t1\r\nX Size\t3\r\nY Size\t2\r\n\
Block Name\tType\tLength\tValue\r\nWavelength\t7\t4\t500\r\nMult\t6\t2\t500\r\n\
Pixel_size\t7\t4\t0.001\r\nAspect\t7\t4\t2\r\nIntensity\t3\t12\t\r\n7\t8\r\n7\t8\r\n7\t8\r\n\
RAW_DATA\t3\t24\t\r\n4\t1\r\n5\t2\r\nBad\t3\r\n";

pub(crate) const KEYENCE: &str = "\"Measured date\",\"2024-12-03 08:11:04\"\r\n\"Model\",\"VK-X1000 Series\"\r\n\
\"Data type\n\",\"ImageDataCsv\"\r\n\"XY Calibration\",\"1000\",\"nm\"\r\n\
\"Output image data\",\"Height\"\r\n\"Horizontal\",\"3\"\r\n\"Vertical\",\"2\"\r\n\
\"Unit\",\"um\"\r\n\"Reference data name\",\"\"\r\n\r\n\"Height\"\r\n\
\"0.001\",\"0.002\",\"0,003\"\r\n\"0.004\",\"0.005\",\"\"\r\n";

const WSXM_TEXT: &str = "WSxM file copyright UAM\r\nWSxM ASCII XYZ file\r\n\
X[nm]\tY[µm]\tZ[nm]\r\n\r\n0\t0\t1\r\n1000\t0\t2\r\n2000\t0\t3\r\n0\t2\t4\r\n1000\t2\t5\r\n";

/// Writes the header that the text exports of Zygo share.
fn zygo(title: &str) -> String {
    format!(
        "{title}\n0 0 0 0 \"Fri Mar 10 16:35:59 2023\"\n0 0 0 0 0 0\n7 5 3 2\n\"comment\"\n\"\"\n\
         \"\"\n0 1 4.096e-06 0 1 0 1e-06 1678466159\n640 480 0 0 0 0 \"objective\"\n\
         0 0 0 0 0 0 0 0 0 0\n0 1 20 2 0 0 0 0 0\n0 \"\"\n1 0\n"
    )
}

pub(crate) fn zygo_xyz() -> String {
    let header = zygo("Zygo XYZ Data File - Format 1");
    format!("{header}#\n7 5 0.001\n8 5 0.002\n9 5 0.003\n7 6 0.004\n8 6 0.005\n9 6 No Data\n#\n")
}

pub(crate) fn zygo_ascii() -> String {
    let header = zygo("Zygo ASCII Data File - Format 2");
    format!("{header}\"zoom\"\n#\n#\n1 2 3 4 \n5 2147483640\n#\n")
}
