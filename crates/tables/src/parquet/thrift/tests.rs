//! What is passed over, and what is refused.

use super::*;

const KNOWN: &[Field] = &[
    (1, Shape::Plain(Kind::Int)),
    (2, Shape::List(&Shape::Struct(&[(1, Shape::Plain(Kind::Bytes))]))),
];

fn passed(bytes: &[u8]) -> Result<usize, Claim> {
    let mut walk = Walk::over(bytes);
    walk.known(Shape::Struct(KNOWN))?;
    Ok(walk.place())
}

#[test]
fn a_structure_is_passed_to_its_end_and_no_further() {
    // 1: 300; 2: [{1: "ab"}, {}]; 9, unknown: 1.5; the end; more.
    let bytes = [
        0x15, 0xd8, 0x04, 0x19, 0x2c, 0x18, 2, b'a', b'b', 0, 0, 0x77, 0, 0, 0, 0, 0, 0, 0xf8,
        0x3f, 0, 0xff,
    ];
    assert_eq!(passed(&bytes), Ok(bytes.len() - 1));
    for length in 0..bytes.len() - 1 {
        assert!(passed(&bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn numbers_are_zigzag_of_seven_bits_a_byte() {
    let number = |bytes: &[u8]| Walk::over(bytes).number();
    assert_eq!(number(&[0x01]), Ok(-1));
    assert_eq!(number(&[0xd8, 0x04]), Ok(300));
    let least = [&[0xff; 9][..], &[0x01]].concat();
    assert_eq!(number(&least), Ok(i64::MIN));
    assert_eq!(number(&[0xff; 11]), Err(Claim::Number));
}

/// 2³¹ − 1 as a list has its size.
const MANY: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x07];
const SIZE: usize = 0x7fff_ffff;

#[test]
fn lists_without_a_byte_for_each_element_are_refused_at_once() {
    let list = |header: u8| [&[0x39, header][..], &MANY, &[0, 0]].concat();
    // Of an unknown field 3: truth values by both of their types, and structures.
    assert_eq!(passed(&list(0xf1)), Err(Claim::Truths(SIZE)));
    assert_eq!(passed(&list(0xf2)), Err(Claim::Truths(SIZE)));
    assert_eq!(passed(&list(0xfc)), Err(Claim::Elements(SIZE)));
    // Few of them would shift what comes after, as the reader sees it.
    assert_eq!(passed(&[0x39, 0x21, 1, 1, 0]), Err(Claim::Truths(2)));
    assert_eq!(passed(&[0x39, 0x01, 0]), Ok(3));
    let map = [&[0x3b][..], &MANY, &[0x12, 0]].concat();
    assert_eq!(passed(&map), Err(Claim::Truths(SIZE)));
}

#[test]
fn a_known_field_of_another_type_is_refused() {
    let refused = Claim::Another { found: Kind::Bytes, known: Kind::Int };
    assert_eq!(passed(&[0x18, 1, b'a', 0]), Err(refused));
    let refused = Claim::Another { found: Kind::Int, known: Kind::Struct };
    assert_eq!(passed(&[0x29, 0x15, 0, 0]), Err(refused));
}

#[test]
fn structures_within_each_other_end_where_the_reader_would() {
    // Field 3 of each holds the next.
    let nested = |levels: usize| [vec![0x3c; levels], vec![0; levels + 1]].concat();
    assert_eq!(passed(&nested(63)), Ok(127));
    assert_eq!(passed(&nested(64)), Err(Claim::Deep));
    assert_eq!(passed(&nested(1 << 20)), Err(Claim::Deep));
}
