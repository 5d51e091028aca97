//! Text, and arrays without units.

use super::{Fields, Sample};

pub fn samples() -> Vec<Sample> {
    let unitless = |format, bytes: Vec<u8>| Sample { sides: None, ..Sample::new(format, bytes) };
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
        Sample::holed("text", gwyddion.as_bytes().to_vec()),
        Sample::holed("text", latin1),
        Sample::holed("text", wide),
        Sample::holed("text", triplets.as_bytes().to_vec()),
        Sample::holed("sdf", sdf.as_bytes().to_vec()),
        Sample::holed("text", factor.as_bytes().to_vec()),
        unitless("npy", npy()),
    ]
}

fn npy() -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }\n";
    let fields = Fields::default()
        .bytes(b"\x93NUMPY\x01\0")
        .u16(header.len() as u16)
        .bytes(header.as_bytes());
    [1.0, 4.0, 2.0, 5.0, 3.0, 6.0].into_iter().fold(fields, Fields::f64).0
}
