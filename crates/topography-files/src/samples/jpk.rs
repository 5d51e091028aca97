//! A small file of JPK.

use super::upside_down;

/// Returns a file with a thumbnail of one pixel and the map, in two strips.
pub(crate) fn jpk() -> Vec<u8> {
    /// Writes a directory. Its next directory, if there is one, follows its values.
    fn directory(start: usize, tags: &[(u16, u16, Vec<u8>)], is_last: bool) -> Vec<u8> {
        let sizes: [usize; 13] = [1, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8];
        let mut values = Vec::new();
        let mut entries = (tags.len() as u16).to_be_bytes().to_vec();
        let values_start = start + 2 + 12 * tags.len() + 4;
        for (tag, kind, bytes) in tags {
            let count = (bytes.len() / sizes[usize::from(*kind)]) as u32;
            entries.extend([tag.to_be_bytes(), kind.to_be_bytes()].concat());
            entries.extend(count.to_be_bytes());
            if bytes.len() <= 4 {
                entries.extend([bytes.as_slice(), &vec![0; 4 - bytes.len()]].concat());
            } else {
                entries.extend(((values_start + values.len()) as u32).to_be_bytes());
                values.extend(bytes);
            }
        }
        let next = values_start + values.len();
        entries.extend(if is_last { 0 } else { next as u32 }.to_be_bytes());
        [entries, values].concat()
    }
    let short = |tag: u16, value: u16| (tag, 3, value.to_be_bytes().to_vec());
    let long = |tag: u16, value: u32| (tag, 4, value.to_be_bytes().to_vec());
    let double = |tag: u16, value: f64| (tag, 12, value.to_be_bytes().to_vec());
    let text = |tag: u16, text: &str| (tag, 2, format!("{text}\0").into_bytes());
    // The lines of the map follow the header. They are 10 × height − 20.
    let number = |height: &i16| (10 * i32::from(*height) - 20).to_be_bytes();
    let lines: Vec<u8> = upside_down().as_flattened().iter().flat_map(number).collect();
    let start = 8 + lines.len();
    let thumbnail = [
        vec![short(256, 1), short(257, 1), short(258, 8), long(273, 8), long(279, 1)],
        vec![text(0x8000, "2.0"), double(0x8042, 3e-6), double(0x8043, 4e-6)],
        vec![text(0x8050, "thumbnail")],
    ];
    let map = [
        vec![short(256, 3), short(257, 2), short(258, 32), short(278, 1), short(339, 2)],
        vec![
            (273, 4, [8_u32, 20].map(u32::to_be_bytes).concat()),
            (279, 4, [12_u32, 12].map(u32::to_be_bytes).concat()),
        ],
        vec![text(0x8050, "height"), short(0x8051, 1), text(0x8052, "Height (measured)")],
        vec![short(0x8080, 2), text(0x8081, "nominal")],
        vec![text(0x8090, "raw"), text(0x80a3, "NullScaling")],
        vec![text(0x80c0, "nominal"), text(0x80d2, "m"), text(0x80d3, "LinearScaling")],
        vec![double(0x80d4, 1e-10), double(0x80d5, 2e-9)],
    ];
    let thumbnail = directory(start, &thumbnail.concat(), false);
    let map = directory(start + thumbnail.len(), &map.concat(), true);
    let header = [b"MM\0*".as_slice(), &(start as u32).to_be_bytes()].concat();
    [header, lines, thumbnail, map].concat()
}
