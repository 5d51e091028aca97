//! Tests with small files of every format and with damaged files.

pub(crate) mod samples;

use std::io::Write;

use proptest::prelude::*;

use self::samples::{
    Archive, EXPECTED, Sample, deflated_sur, igor, samples, sur, with_checksum, x3p,
};
use super::raster::Raster;
use super::unit::Unit;
use super::{
    Channel, HeightMap, Quantity, Size, Statistics, SuspectNumber, TopographyFile,
    TopographyFileError, formats, read, read_profile,
};

#[track_caller]
fn first_map(bytes: &[u8]) -> HeightMap {
    read(bytes).unwrap().channels()[0].map()
}

#[test]
fn every_format_has_a_small_file() {
    let samples = samples();
    for format in formats() {
        let has_sample = samples.iter().any(|sample| sample.format == format.name());
        assert!(has_sample, "{}", format.name());
    }
}

#[test]
fn small_files_of_all_formats_show_one_map() {
    for sample in samples() {
        shows_the_map(&sample);
    }
}

fn shows_the_map(sample: &Sample) {
    let Sample { format, bytes, .. } = sample;
    let file = read(bytes).unwrap_or_else(|error| panic!("{format}: {error:?}"));
    assert_eq!(file.format().name(), *format);
    assert_eq!(file.default_channel().unwrap().index, 0, "{format}");
    let channel = &file.channels()[0];
    let (quantity, unit) =
        if sample.sides.is_some() { (Quantity::Height, 1e-9) } else { (Quantity::Unitless, 1.0) };
    assert_eq!(channel.quantity(), &quantity, "{format}");
    let map = channel.map();
    assert_eq!(map.nodes(), [3, 2], "{format}");
    match (sample.sides, map.size()) {
        (Some(expected), Size::Metres(sides)) => {
            let agree = |axis: usize| (sides[axis] / expected[axis] - 1.0).abs() < 1e-6;
            assert!(agree(0) && agree(1), "{format}: {sides:?}");
        }
        (expected, size) => {
            assert!(expected.is_none() && !matches!(size, Size::Metres(_)), "{format}");
        }
    }
    for (node, expected) in EXPECTED.iter().enumerate() {
        let height = map.heights()[node];
        assert_eq!(map.missing()[node], height.is_nan(), "{format}");
        if sample.lacks_last_point && node == 5 {
            assert!(height.is_nan(), "{format}: the last point is {height}");
        } else {
            // Single precision holds seven digits.
            assert!((height / unit - expected).abs() < 1e-5, "{format}: {height}");
        }
    }
}

#[test]
fn nodes_outside_of_a_map_have_no_height() {
    let map = first_map(b"1 2 3 4\n5 6 7 8\n");
    assert_eq!((map.nodes(), map.get(2, 1)), ([4, 2], Some(7.0)));
    for (i, j) in [(4, 0), (0, 2), (usize::MAX, 1), (1, usize::MAX)] {
        assert_eq!(map.get(i, j), None);
    }
}

#[test]
fn channels_of_other_quantities_are_listed_with_their_unit() {
    let wave = igor();
    let file = read(&wave).unwrap();
    let listed: Vec<_> = file.channels().iter().map(|c| (c.name(), c.unit())).collect();
    assert_eq!(listed, [("HeightTrace", Some("m")), ("PhaseTrace", Some("deg"))]);
    assert!(!file.channels()[1].may_be_heights());
    assert_eq!(file.channels()[1].map().steps(), None);
}

/// Returns a file of channels with these names and units.
fn file_of(names: &[(&str, &str)]) -> TopographyFile<'static> {
    let raster = Raster::from_rows([2, 2], vec![0.0; 4]);
    let channel = |(name, unit): &(&str, &str)| {
        Channel::new(*name, Unit::parse(unit), Size::Unknown, raster.clone())
    };
    let channels: Vec<_> = names.iter().map(channel).collect();
    TopographyFile { format: &formats()[0], channels }
}

/// Returns the name of the channel that is read if none is chosen.
fn chosen(names: &[(&str, &str)]) -> String {
    let file = file_of(names);
    file.channels[file.default_channel().unwrap().index].name.clone()
}

#[test]
fn the_default_channel_has_a_reason_that_lists_its_equals() {
    let reason = |names: &[(&str, &str)]| file_of(names).default_channel().unwrap().reason;
    let only = "the only one that may be heights";
    assert_eq!(reason(&[("Topography", "nm"), ("Phase", "deg")]), only);
    assert_eq!(reason(&[("Phase", "nm"), ("Height", "nm")]), "because of its name");
    assert_eq!(reason(&[("b", ""), ("a", "nm")]), "because of its unit");
    let forwards = "because it was recorded forwards";
    assert_eq!(reason(&[("Height Retrace", "nm"), ("Height", "nm")]), forwards);
    let two = [("Phase", "deg"), ("Height", "nm"), ("Height Sensor", "nm")];
    assert_eq!(
        reason(&two),
        "the first of the file; channel 3 (`Height Sensor`) may be the heights as well"
    );
    assert!(file_of(&two).default_channel().unwrap().is_ambiguous);
    assert_eq!(
        reason(&[("a", ""); 7]),
        "the first of the file; channels 2 (`a`), 3 (`a`), 4 (`a`), 5 (`a`) and 2 more may be the \
         heights as well"
    );
}

#[test]
fn heights_are_chosen_by_name_before_unit() {
    assert_eq!(chosen(&[("Deflection Error", "nm"), ("Height", "nm")]), "Height");
    assert_eq!(chosen(&[("contact", ""), ("heights", ""), ("pressure", "")]), "heights");
    assert_eq!(chosen(&[("Amplitude", "V"), ("Phase", "nm"), ("ZSensor", "nm")]), "ZSensor");
    assert_eq!(chosen(&[("Height Error", "nm"), ("Height (measured)", "nm")]), "Height (measured)");
    assert_eq!(chosen(&[("Height (retrace)", "nm"), ("Height", "nm")]), "Height");
    assert_eq!(chosen(&[("image", "nm"), ("image_original", "nm")]), "image_original");
    assert_eq!(chosen(&[("b", ""), ("a", "nm"), ("c", "nm")]), "a");
    assert_eq!(chosen(&[("deflection", "nm")]), "deflection");
}

#[test]
fn channels_of_jpk_name_their_direction_and_their_frame() {
    let names = |format| {
        let sample = samples().into_iter().find(|sample| sample.format == format).unwrap();
        let file = read(&sample.bytes).unwrap();
        file.channels().iter().map(|channel| channel.name().to_owned()).collect::<Vec<_>>()
    };
    let name = "Height (measured, retrace)";
    assert_eq!(names("jpk"), [name]);
    assert_eq!(names("h5-jpk"), [1, 2].map(|frame| format!("{name}, frame {frame}")));
}

#[test]
fn maps_in_groups_of_an_hdf5_file_have_the_path_as_their_name() {
    let nested = include_bytes!("tests/samples/nested.h5");
    assert_eq!(read(nested).unwrap().channels()[0].name(), "scan/heights");
    let chunks = include_bytes!("tests/samples/chunks.h5");
    let file = read(chunks).unwrap();
    let names: Vec<&str> = file.channels().iter().map(|channel| channel.name()).collect();
    // The other dataset has one dimension.
    assert_eq!(names, ["surface"]);
}

#[test]
fn the_folder_that_an_archive_is_packed_in_does_not_matter() {
    let archive = Archive { folder: "scan 1/", ..Archive::default() };
    let bytes = x3p(&archive);
    assert_eq!(first_map(&bytes).get(1, 1), Some(5e-9));
}

#[test]
fn an_archive_without_prefix_and_without_marks_is_read() {
    let mut archive = Archive { valid: None, ..Archive::default() };
    let link = "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>";
    let description = archive.description.replace("p:", "").replace(link, "");
    archive.description = description.replace("xmlns:p=", "xmlns=");
    let bytes = x3p(&archive);
    assert_eq!(Statistics::new(&first_map(&bytes)).missing, 0);
}

/// The first line of the map of the samples, which is no map.
#[track_caller]
fn assert_is_first_line(bytes: &[u8]) {
    let file = read(bytes).unwrap();
    let channel = &file.channels()[0];
    assert!(channel.is_profile());
    let map = channel.map();
    assert_eq!(map.nodes(), [3, 1]);
    for (found, exact) in map.heights().iter().zip([1e-9, 2e-9, 3e-9]) {
        assert!((found - exact).abs() < 1e-20, "{found}");
    }
    let [side, step] = map.size().sides().unwrap();
    assert!((side - 3e-6).abs() < 1e-18 && (step - 1e-6).abs() < 1e-18);
    let statistics = Statistics::new(&map).heights.unwrap();
    assert!((statistics.rms_slope.unwrap() - 1e-3).abs() < 1e-12);
}

#[test]
fn x3p_and_digital_surf_files_with_one_line_are_profiles() {
    let archive = Archive::default();
    let mut description = archive.description.replace("SUR", "PRF").replace("<SizeY>2", "<SizeY>1");
    // A profile may have no y axis.
    let start = description.find("<CY>").unwrap();
    let end = description.find("</CY>").unwrap() + "</CY>".len();
    description.replace_range(start..end, "");
    let data = archive.data[..6].to_vec();
    assert_is_first_line(&x3p(&Archive { description, data, valid: Some(0b111), ..archive }));

    let mut surf = sur();
    // Object type 1, and one line.
    surf[18..20].copy_from_slice(&1_u16.to_le_bytes());
    surf[112..116].copy_from_slice(&1_i32.to_le_bytes());
    surf[116..120].copy_from_slice(&3_i32.to_le_bytes());
    surf.truncate(518 + 6);
    assert_is_first_line(&surf);
}

#[test]
fn arrays_with_one_axis_are_profiles_if_the_user_says_so() {
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }\n";
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend([1.0_f64, 2.0, 4.0].into_iter().flat_map(f64::to_le_bytes));
    assert!(read(&file).is_err());
    let found = read_profile(&file).unwrap();
    assert_eq!(found.channels()[0].map().heights(), [1.0, 2.0, 4.0]);
    for file in compressed("profile.txt", b"0 1\n1 2\n2 4\n") {
        let found = read_profile(&file).unwrap();
        assert_eq!(found.channels()[0].map().heights(), [1.0, 2.0, 4.0]);
    }
    // Other files are read as before.
    assert!(!read_profile(&sur()).unwrap().channels()[0].is_profile());
}

#[test]
fn errors_name_the_entry_and_the_expected_value() {
    let described = |from: &str, to: &str| {
        let archive = Archive::default();
        let description = archive.description.replace(from, to);
        let archive = Archive { description, ..archive };
        match read(&x3p(&archive)).unwrap_err() {
            TopographyFileError::Damaged { source, .. } => source.to_string(),
            other => panic!("{other}"),
        }
    };
    assert_eq!(
        described("SUR", "PCL"),
        "`FeatureType` is PCL; expected SUR, a surface, or PRF, a profile"
    );
    assert_eq!(described("SUR", "PRF"), "`SizeY` is 2; expected 1, the single line of a profile");
    assert_eq!(
        described("<SizeX>3", "<SizeX>-3"),
        "`number of nodes` is -3; expected a positive number"
    );
    assert_eq!(
        described("<SizeX>3", "<SizeX>33"),
        "`bindata/data.bin` in the archive is damaged: it has 12 bytes, 132 are needed"
    );
    let huge = described("<SizeX>3", "<SizeX>100000000");
    assert!(huge.ends_with(" bytes cannot expand to the 400000000 that are needed"), "{huge}");
    assert_eq!(
        described("<DataType>I", "<DataType>X"),
        "`DataType of CZ` is X; expected D, F, I or L"
    );
}

#[test]
fn the_error_for_an_unknown_format_lists_all_readers() {
    let error = read(b"MAP89a\x01\x00").unwrap_err();
    let TopographyFileError::Unknown { others, .. } = &error else { panic!("{error}") };
    assert_eq!(others[..3], ["nmm", "plux", "npz"]);
    let error = error.to_string();
    assert!(
        error.starts_with("no known format matches the file, which starts with `MAP89a` ("),
        "{error}"
    );
    assert!(error.contains("as text: not a text file: it has the character \\u{1}"), "{error}");
    assert_eq!(read(b"").unwrap_err(), TopographyFileError::Empty);
}

#[test]
fn pictures_are_named() {
    assert_eq!(
        read(b"GIF89a\x01\x00").unwrap_err().to_string(),
        "the file is a GIF picture; its colours are no heights; export the heights as numbers"
    );
}

#[test]
fn slopes_leave_out_missing_neighbours() {
    let text = |middle: &str| {
        let header = "# Width: 3 m\n# Height: 3 m\n# Value units: m\n";
        format!("{header}0 1 2\n4 5 {middle}\n8 9 10\n")
    };
    let slope = |middle| {
        let text = text(middle);
        Statistics::new(&first_map(text.as_bytes())).heights.unwrap().rms_slope.unwrap()
    };
    // All differences along x are 1, all along y are 4.
    assert!((slope("6") - 17_f64.sqrt()).abs() < 1e-14);
    assert!((slope("nan") - 17_f64.sqrt()).abs() < 1e-14);
    // One of four differences along x is 3. Differences along y at the last x are not used.
    let expected: f64 = (1.0 + 1.0 + 1.0 + 9.0) / 4.0 + 16.0;
    assert!((slope("8") - expected.sqrt()).abs() < 1e-14);
}

#[test]
fn sides_in_another_unit_than_a_length_are_unknown() {
    let file = b"# Width: 3 px\n# Height: 2 px\n# Value units: m\n1 2 4\n3 5 6\n";
    assert_eq!(read(file).unwrap().channels()[0].size(), Size::Unknown);
}

#[test]
fn a_map_of_missing_points_has_no_heights() {
    let map = first_map(b"nan nan nan nan\nnan nan nan nan\n");
    let statistics = Statistics::new(&map);
    assert_eq!((statistics.missing, statistics.heights), (8, None));
    assert_eq!(statistics.corners.last, None);
}

#[test]
fn heights_and_sides_in_different_units_have_no_slope() {
    let file = b"# Width: 3 um\n# Height: 2 um\n1 2 4\n3 5 6\n";
    let file = read(file).unwrap();
    let channel: &Channel<'_> = &file.channels()[0];
    assert_eq!(channel.unit(), None);
    assert_eq!(channel.size(), Size::Metres([3e-6, 2e-6]));
    assert_eq!(Statistics::new(&channel.map()).heights.unwrap().rms_slope, None);
}

#[test]
fn a_number_far_from_all_others_is_suspect_and_may_be_declared_missing() {
    let text = "12 15 -9999 13\n11 -9999 14 12\n";
    let file = read(text.as_bytes()).unwrap();
    let channel = &file.channels()[0];
    let suspect = channel.suspect_number().unwrap();
    assert_eq!((suspect.number, suspect.count), (-9999.0, 2));
    assert_eq!(Statistics::new(&channel.map_without(-9999.0)).missing, 2);
    let find = |numbers: &[f64]| SuspectNumber::find(numbers).map(|suspect| suspect.number);
    assert_eq!(find(&[1.0, 2.0, 3.0, 1e20]), Some(1e20));
    assert_eq!(find(&[1.0, 2.0, 3.0, f64::from(f32::MAX)]), Some(f64::from(f32::MAX)));
    assert_eq!(find(&[500.0, 501.0, 0.0, 0.0]), Some(0.0));
    // A single spike, two levels, and ordinary heights.
    assert_eq!(find(&[1.0, 2.0, 3.0, 50.0]), None);
    assert_eq!(find(&[0.0, 0.0, 1.0, 1.0]), None);
    assert_eq!(find(&[1.0, 4.0, 2.0, 5.0, 3.0]), None);
    assert_eq!(find(&[f64::NAN; 3]), None);
}

#[test]
fn an_unknown_unit_of_the_sides_is_named() {
    let file = b"# Width: 3 px\n# Height: 2 px\n# Value units: m\n1 2 4\n3 5 6\n";
    assert_eq!(read(file).unwrap().channels()[0].unknown_side_unit(), Some("px"));
}

fn compressed(name: &str, bytes: &[u8]) -> [Vec<u8>; 2] {
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(bytes).unwrap();
    [gzip.finish().unwrap(), zipped(&[(name, bytes), ("__MACOSX/._x", b"x")])]
}

fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

#[test]
fn a_compressed_file_is_read_like_the_file() {
    for sample in samples() {
        let plain = read(&sample.bytes).unwrap();
        for bytes in compressed("scan.dat", &sample.bytes) {
            let file = read(&bytes).unwrap_or_else(|error| panic!("{}: {error}", sample.format));
            assert_eq!(file.format(), plain.format());
            let maps = file.channels().iter().zip(plain.channels());
            for (one, other) in maps {
                let [one, other] = [one, other].map(|channel| channel.map());
                assert_eq!((one.nodes(), one.size()), (other.nodes(), other.size()));
                let bits =
                    |map: &HeightMap| map.heights().iter().map(|h| h.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&one), bits(&other), "{}", sample.format);
            }
        }
    }
}

#[test]
fn sides_of_an_archive_of_arrays_have_any_type_of_numbers() {
    let array = |kind: &str, shape: &str, bytes: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let length = (header.len() as u16).to_le_bytes();
        [b"\x93NUMPY\x01\0", &length[..], header.as_bytes(), bytes].concat()
    };
    let heights = array("|u1", "(3, 2)", &[1, 2, 3, 4, 5, 6]);
    let read_with = |side: Vec<u8>| {
        let bytes = zipped(&[("heights.npy", &heights), ("side.npy", &side)]);
        let file = read(&bytes).unwrap();
        (file.channels()[0].size(), file.channels()[0].notes())
    };
    let of_integers = array("|i1", "(2,)", &[3, 4]);
    assert_eq!(read_with(of_integers), (Size::Unitless([3.0, 4.0]), vec![]));
    let of_square = array("<f4", "()", &5_f32.to_le_bytes());
    assert_eq!(read_with(of_square), (Size::Unitless([5.0, 5.0]), vec![]));
    let of_three = array("|i1", "(3,)", &[3, 4, 5]);
    assert_eq!(
        read_with(of_three),
        (Size::Unknown, vec!["the arrays `side` are not used".to_owned()])
    );
}

#[test]
fn other_containers_are_named() {
    let named = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    let excel = zipped(&[("xl/workbook.xml", b""), ("[Content_Types].xml", b"")]);
    assert_eq!(
        named(&excel),
        "the file is an Excel workbook; export the sheet with the heights as CSV"
    );
    let two = zipped(&[("a.txt", b"1 2 3"), ("b.txt", b"1 2 3")]);
    assert_eq!(
        named(&two),
        "the file is a zip archive of 2 files (a.txt, b.txt); unpack it and name one of its files"
    );
    assert_eq!(named(b"7z\xbc\xaf\x27\x1c rest"), "the file is a 7-Zip archive; unpack it first");
    let compound = [b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1".as_slice(), &[0; 504]].concat();
    assert!(named(&compound).starts_with("the file is a compound file of Microsoft"));
    let stream: Vec<u8> = "ScopedContents".bytes().flat_map(|letter| [letter, 0]).collect();
    assert_eq!(
        named(&[compound, stream].concat()),
        "the file is a MountainsMap document (`.mnt`); save its surface as a `.sur` file"
    );
    let matlab = "the file is a MATLAB file of version 5 to 7; save the map again with `-v7.3`";
    assert_eq!(named(b"MATLAB 5.0 MAT-file, Platform: posix"), matlab);
    let [gzip, _] = compressed("x", &[b'1'; 100]);
    assert!(named(&gzip[..gzip.len() - 12]).contains("a damaged gzip file"));
}

/// Checks that bytes are either read as consistent maps or refused with a message.
fn check_read(bytes: &[u8]) {
    match read(bytes) {
        Ok(file) => {
            for channel in file.channels() {
                let map = channel.map();
                let [x, y] = map.nodes();
                assert_eq!(map.heights().len(), x * y);
                let statistics = Statistics::new(&map);
                assert_eq!(statistics.heights.is_none(), statistics.missing == x * y);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[test]
fn every_truncated_file_is_read_or_refused() {
    for sample in samples() {
        for length in 0..sample.bytes.len() {
            check_read(&sample.bytes[..length]);
        }
    }
}

#[test]
fn a_truncated_binary_file_is_refused() {
    // Files of these formats can be valid even if they are cut off: text, and formats with optional
    // data after the heights.
    let ends = ["text", "sdf", "ibw", "plu", "netcdf", "lext", "vk", "opdx"];
    let texts = ["wyko-asc", "zygo-asc", "keyence-csv", "esri-asc", "surfer"];
    let ends = [&ends[..], &texts].concat();
    let binary = samples().into_iter().filter(|sample| !ends.contains(&sample.format));
    for sample in binary {
        let cut = &sample.bytes[..sample.bytes.len() - 1];
        assert!(read(cut).is_err(), "{}", sample.format);
    }
}

#[test]
fn a_huge_claim_allocates_nothing() {
    for bytes in [sur(), deflated_sur()] {
        let mut huge = bytes;
        // First 32768 × 32768 nodes, then more than the limit.
        for side in [[0, 0x80, 0, 0], [0xff, 0xff, 0xff, 0x7f]] {
            huge[108..112].copy_from_slice(&side);
            huge[112..116].copy_from_slice(&side);
            assert!(read(&huge).is_err());
        }
    }
    let text = b"0 0 1\n1 0 1\n0 1000000000 1\n0.001 1 1\n5 2 1\n7 7 7\n";
    assert!(read(text).is_err());
}

proptest! {
    #[test]
    fn damage_does_no_harm(
        damage in proptest::collection::vec((any::<u16>(), any::<u8>()), 1..6),
    ) {
        for sample in samples() {
            let mut bytes = sample.bytes;
            for (index, byte) in &damage {
                let index = usize::from(*index) % bytes.len();
                bytes[index] ^= byte;
            }
            check_read(&bytes);
        }
    }

    #[test]
    fn damage_of_a_wave_with_valid_checksum_does_no_harm(index in 0_usize..384, byte: u8) {
        let mut wave = igor();
        wave[index] = byte;
        check_read(&with_checksum(wave));
    }

    #[test]
    fn any_text_does_no_harm(text in "[-0-9.,;e \t\n#=:a]{0,60}") {
        check_read(text.as_bytes());
    }
}
