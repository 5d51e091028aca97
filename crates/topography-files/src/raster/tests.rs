use super::*;

fn bytes(nodes: [usize; 2]) -> Raster<'static> {
    Raster::rows(nodes, Element::U8, ByteOrder::Little, &[0, 1, 2, 3, 4, 5][..]).unwrap()
}

#[test]
fn rows_of_a_file_run_along_x() {
    assert_eq!(bytes([3, 2]).decode(), [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
    let columns = [0, 1, 2, 3, 4, 5];
    let columns = Raster::columns([3, 2], Element::U8, ByteOrder::Little, &columns[..]);
    assert_eq!(columns.unwrap().decode(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn what_is_stored_first_may_have_the_largest_coordinate() {
    let turned = bytes([3, 2]).upside_down();
    assert_eq!(turned.decode(), [3.0, 0.0, 4.0, 1.0, 5.0, 2.0]);
    let mirrored = bytes([3, 2]).mirrored();
    assert_eq!(mirrored.decode(), [2.0, 5.0, 1.0, 4.0, 0.0, 3.0]);
}

#[test]
fn markers_are_looked_for_before_heights_are_scaled() {
    let raster = bytes([6, 1]).scaled(2.0, 1.0).missing(Missing::From(4.0));
    assert_eq!(raster.decode()[..4], [1.0, 3.0, 5.0, 7.0]);
    assert!(raster.decode()[4..].iter().all(|height| height.is_nan()));
    let one = bytes([6, 1]).scaled(2.0, 0.0).missing(Missing::Value(2.0));
    assert!(one.decode()[2].is_nan() && one.decode()[1] == 2.0);
}

#[test]
fn a_mask_lies_as_its_own_rows_do() {
    let mask = Raster::columns([3, 2], Element::U8, ByteOrder::Big, &[0, 1, 0, 0, 0, 0][..]);
    let masked = bytes([3, 2]).masked(mask.unwrap()).decode();
    assert!(masked[1].is_nan());
    assert_eq!(masked.iter().filter(|height| height.is_nan()).count(), 1);
}

#[test]
fn both_ends_of_a_number_may_come_first() {
    let read =
        |order| Raster::rows([1, 1], Element::I16, order, &[0x01, 0x80][..]).unwrap().decode();
    assert_eq!(read(ByteOrder::Little), [f64::from(-0x7fff)]);
    assert_eq!(read(ByteOrder::Big), [f64::from(0x0180)]);
}

#[test]
fn padding_of_lines_is_left_out() {
    let stored = [1, 2, 9, 9, 3, 4];
    let raster = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 4, &stored[..]);
    assert_eq!(raster.unwrap().decode(), [1.0, 3.0, 2.0, 4.0]);
    let short = Raster::padded_rows([2, 2], Element::I8, ByteOrder::Little, 5, &stored[..]);
    assert_eq!(
        short.unwrap_err().to_string(),
        "2 × 2 heights of 1 bytes need 7 bytes, 6 are there"
    );
}

#[test]
fn sizes_that_no_file_can_have_are_refused() {
    assert!(checked_nodes([0, 4]).is_err());
    assert!(checked_nodes([-1, 4]).is_err());
    assert!(checked_nodes([i64::MAX, i64::MAX]).is_err());
    assert!(checked_nodes([1 << 16, 1 << 15]).is_err());
    assert_eq!(checked_nodes([1 << 15, 1 << 15]), Ok([1 << 15, 1 << 15]));
}

#[test]
fn a_number_that_is_not_finite_was_not_measured() {
    let stored: Vec<u8> =
        [f32::NAN, f32::INFINITY, 1.0].iter().flat_map(|height| height.to_le_bytes()).collect();
    let raster = Raster::rows([3, 1], Element::F32, ByteOrder::Little, stored).unwrap();
    let heights = raster.decode();
    assert!(heights[0].is_nan() && heights[1].is_nan());
    assert_eq!(heights[2], 1.0);
}
