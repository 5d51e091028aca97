//! The pages of columns of numbers, which cost their reader no more than what a file of as many bytes
//! and rows can hold.
//!
//! Each page begins with a header, which its reader passes over as it does the footer: here it is
//! walked over before ([`thrift`](super::thrift)). It says how long the page is once it is unpacked,
//! and how many numbers a dictionary has; the reader makes room for both at once.

use parquet::file::metadata::ColumnChunkMetaData;

use super::ParquetError;
use super::claim::Claim;
use super::shapes::{DICTIONARY, PAGE, dictionary, page};
use super::thrift::Walk;

/// Bytes that a number takes with its place in a dictionary and its levels; a decimal one has 32.
const OF_A_NUMBER: usize = 64;
/// Bytes that pages take however few numbers they hold.
const AT_LEAST: usize = 1 << 20;

/// Refuses the chunks of a column of so many rows whose pages cannot all be read in a time and a
/// memory in proportion to these rows and the bytes of the file.
pub fn check<'a>(
    file: &[u8],
    chunks: impl Iterator<Item = &'a ColumnChunkMetaData>,
    rows: usize,
) -> Result<(), ParquetError> {
    let mut read = 0;
    let mut left = rows.saturating_mul(OF_A_NUMBER).saturating_add(AT_LEAST);
    for chunk in chunks {
        let refused = |claim| ParquetError::Page { column: chunk.column_path().string(), claim };
        let (start, length) = chunk.byte_range();
        let start = usize::try_from(start).ok().and_then(|start| file.get(start..));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let pages = start.and_then(|bytes| bytes.get(..length));
        let pages = pages.ok_or_else(|| refused(Claim::Bytes))?;
        // Chunks may all be the same bytes.
        read += pages.len();
        if read > file.len() {
            return Err(refused(Claim::Bytes));
        }
        check_pages(pages, &mut left).map_err(refused)?;
    }
    Ok(())
}

/// Refuses pages that take more than so many bytes once they are unpacked; takes what they take.
fn check_pages(mut pages: &[u8], left: &mut usize) -> Result<(), Claim> {
    while !pages.is_empty() {
        let (after, header) = Header::read(pages)?;
        let rest = &pages[after..];
        let unpacked = usize::try_from(header.unpacked).ok();
        let unpacked = unpacked.filter(|bytes| bytes <= left);
        let unpacked = unpacked.ok_or(Claim::Unpacked(header.unpacked))?;
        *left -= unpacked;
        // Each takes a byte or more.
        if !usize::try_from(header.values).is_ok_and(|values| values <= unpacked) {
            return Err(Claim::Values(header.values));
        }
        let length = usize::try_from(header.length).map_err(|_| Claim::Bytes)?;
        pages = rest.get(length..).ok_or(Claim::Bytes)?;
    }
    Ok(())
}

/// What the header of a page says.
#[derive(Debug, Default)]
struct Header {
    /// Bytes of the page after it.
    length: i64,
    /// Bytes of the page once it is unpacked.
    unpacked: i64,
    /// Values, if the page is a dictionary.
    values: i64,
}

impl Header {
    /// The header at the start of these bytes, and where it ends.
    fn read(bytes: &[u8]) -> Result<(usize, Header), Claim> {
        let mut header = Header::default();
        let mut walk = Walk::over(bytes);
        walk.fields(PAGE, |walk, field, shape| {
            match field {
                page::UNCOMPRESSED_SIZE => header.unpacked = walk.number()?,
                page::SIZE => header.length = walk.number()?,
                page::DICTIONARY => {
                    walk.fields(DICTIONARY, |walk, field, shape| match field {
                        dictionary::VALUES => {
                            header.values = walk.number()?;
                            Ok(())
                        }
                        _ => walk.known(shape),
                    })?;
                }
                _ => walk.known(shape)?,
            }
            Ok(())
        })?;
        Ok((walk.place(), header))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page with these sizes and nothing else, zigzag numbers as they are written.
    fn page(unpacked: &[u8], size: &[u8], more: &[u8], bytes: usize) -> Vec<u8> {
        let header = [&[0x15, 0, 0x15], unpacked, &[0x15], size, more, &[0]].concat();
        [header, vec![7; bytes]].concat()
    }

    fn passed(pages: &[u8], mut left: usize) -> Result<usize, Claim> {
        check_pages(pages, &mut left).map(|()| left)
    }

    #[test]
    fn pages_follow_each_other_to_the_end_of_their_chunk() {
        // Three bytes, of five once they are unpacked; and none.
        let pages = [page(&[10], &[6], &[], 3), page(&[0], &[0], &[], 0)].concat();
        assert_eq!(passed(&pages, 8), Ok(3));
        assert_eq!(passed(&pages, 4), Err(Claim::Unpacked(5)));
        assert_eq!(passed(&pages[..pages.len() - 1], 8), Err(Claim::Bytes));
        assert_eq!(passed(&page(&[10], &[8], &[], 3), 8), Err(Claim::Bytes));
        assert_eq!(passed(&page(&[1], &[6], &[], 3), 8), Err(Claim::Unpacked(-1)));
    }

    #[test]
    fn a_dictionary_has_bytes_for_its_values() {
        // 7: its values, in the encoding 0.
        let of = |values| page(&[10], &[6], &[0x4c, 0x15, values, 0x15, 0, 0], 3);
        assert_eq!(passed(&of(10), 8), Ok(3));
        assert_eq!(passed(&of(12), 8), Err(Claim::Values(6)));
    }

    /// The reader gives truth values no bytes, and at the end of a file doubles none, either.
    #[test]
    fn headers_hold_no_lists_without_a_byte_for_each_element() {
        const MANY: usize = 0x7fff_ffff;
        let list = |kind: u8| [0xf0 | kind, 0xff, 0xff, 0xff, 0xff, 0x07];
        // In the header of the data, and beside it.
        let inside = |kind| [&[0x2c, 0x99][..], &list(kind), &[0]].concat();
        let beside = |kind| [&[0x99][..], &list(kind)].concat();
        for more in [&inside as &dyn Fn(u8) -> Vec<u8>, &beside] {
            let claim = |kind| passed(&page(&[10], &[6], &more(kind), 3), 8);
            assert_eq!(claim(1), Err(Claim::Truths(MANY)));
            assert_eq!(claim(7), Err(Claim::Elements(MANY)));
        }
    }
}
