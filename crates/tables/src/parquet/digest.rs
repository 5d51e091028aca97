//! Digests of a Parquet file, stored before its footer, where other readers ignore them.
//!
//! The file of a task has one digest of all other bytes. A published table has one digest of each
//! column chunk, and one of these digests and all bytes outside of chunks. A column can therefore
//! be verified without reading the others.

use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;

use bytes::Bytes;
use parquet::file::metadata::ParquetMetaData;

use super::ParquetError;

/// Length of the digest before the footer, in bytes.
const DIGEST: usize = blake3::OUT_LEN;
/// Length of the digest of a column chunk, in bytes.
const CHUNK_DIGEST: usize = 16;
/// Length in bytes of the end of a file: the length of the footer and the closing mark.
const TAIL: usize = 8;
/// First four bytes of every Parquet file.
pub(super) const MARK: &[u8] = b"PAR1";

/// Value of the metadata entry of files with a digest of each column chunk.
pub(super) const CHUNKS: &str = "column chunks";

/// Inserts the digest of a Parquet file before the footer. Returns `None` if the file has no
/// footer.
pub fn seal(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let footer = footer_start(&bytes)?;
    let digest = blake3::hash(&bytes);
    bytes.splice(footer..footer, *digest.as_bytes());
    Some(bytes)
}

/// Inserts the digests of the column chunks and of all other bytes before the footer of a file.
///
/// # Errors
/// Returns an error if `metadata` does not describe the file.
pub(super) fn seal_chunks(mut bytes: Vec<u8>, metadata: &ParquetMetaData) -> io::Result<Vec<u8>> {
    let (footer, digests) = digests(bytes.len(), metadata, |range| Ok(Cow::from(&bytes[range])))?;
    bytes.splice(footer..footer, digests);
    Ok(bytes)
}

/// Inserts the same digests as [`seal_chunks`] into a file on disk. Only one chunk is in memory at
/// a time.
///
/// # Errors
/// Returns an error if the file cannot be read or written.
pub(super) fn seal_chunks_in(file: &mut File, metadata: &ParquetMetaData) -> io::Result<()> {
    let length = usize::try_from(file.metadata()?.len()).map_err(io::Error::other)?;
    let read = |range: Range<usize>| {
        let mut bytes = vec![0; range.len()];
        file.read_exact_at(&mut bytes, range.start as u64)?;
        Ok(Cow::from(bytes))
    };
    let (footer, mut digests) = digests(length, metadata, read)?;
    digests.extend_from_slice(&read(footer..length)?);
    file.write_all_at(&digests, footer as u64)
}

/// Returns the offset of the footer in a file of `length` bytes, and the digests to insert there.
/// `read` returns the bytes of a range of the file.
fn digests<'a>(
    length: usize,
    metadata: &ParquetMetaData,
    read: impl Fn(Range<usize>) -> io::Result<Cow<'a, [u8]>>,
) -> io::Result<(usize, Vec<u8>)> {
    let malformed =
        || io::Error::other("a finished file has a footer, and column chunks before it");
    let chunks = chunk_ranges(metadata, length).ok_or_else(malformed)?;
    let mut digests = Vec::with_capacity(chunks.len() * CHUNK_DIGEST + DIGEST);
    for range in &chunks {
        digests.extend_from_slice(&chunk_digest(&read(range.clone())?));
    }
    let end_of_chunks = end_of(&chunks);
    let end = read(end_of_chunks..length)?;
    let footer = footer_start(&end).ok_or_else(malformed)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(MARK).update(&end[..footer]);
    hasher.update(&digests).update(&end[footer..]);
    digests.extend_from_slice(hasher.finalize().as_bytes());
    Ok((end_of_chunks + footer, digests))
}

/// Returns true if all bytes of a file agree with its digests, one or one of each column chunk.
pub(super) fn is_intact(bytes: &Bytes, metadata: &ParquetMetaData, has_chunks: bool) -> bool {
    if !has_chunks {
        return is_whole_intact(bytes);
    }
    let end = |start| Ok(bytes.slice(start..));
    bytes.starts_with(MARK)
        && ChunkDigests::read(metadata, bytes.len(), end).is_ok_and(|chunks| {
            let mut all = chunks.ranges.iter().enumerate();
            all.all(|(chunk, range)| chunks.matches(chunk, &bytes[range.clone()]))
        })
}

fn is_whole_intact(bytes: &Bytes) -> bool {
    let Some((footer, start)) =
        footer_start(bytes).and_then(|footer| Some((footer, footer.checked_sub(DIGEST)?)))
    else {
        return false;
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..start]).update(&bytes[footer..]);
    hasher.finalize().as_bytes() == &bytes[start..footer]
}

/// Returns the byte ranges of the column chunks of a file of `length` bytes, ordered by row group
/// and column. Returns `None` unless the first chunk follows the opening mark, and each other chunk
/// the previous one.
fn chunk_ranges(metadata: &ParquetMetaData, length: usize) -> Option<Vec<Range<usize>>> {
    let mut end = MARK.len();
    let chunks = metadata.row_groups().iter().flat_map(|group| group.columns());
    let ranges = chunks.map(|chunk| {
        let (start, length) = chunk.byte_range();
        let start = usize::try_from(start).ok().filter(|start| *start == end)?;
        end = start.checked_add(usize::try_from(length).ok()?)?;
        Some(start..end)
    });
    let ranges = ranges.collect::<Option<Vec<_>>>()?;
    (end_of(&ranges) <= length).then_some(ranges)
}

/// Returns the end of the last chunk.
fn end_of(chunks: &[Range<usize>]) -> usize {
    chunks.last().map_or(MARK.len(), |last| last.end)
}

/// Verified digests of the column chunks of a file.
#[derive(Debug)]
pub(super) struct ChunkDigests {
    /// Byte range of each chunk, ordered by row group and column.
    pub ranges: Vec<Range<usize>>,
    digests: Bytes,
}

impl ChunkDigests {
    /// Reads the digests of the chunks of a file of `length` bytes and verifies the footer. `read`
    /// returns the bytes of the file from an offset to its end.
    ///
    /// # Errors
    /// Returns an error if the end of the file is damaged or cannot be read.
    pub fn read(
        metadata: &ParquetMetaData,
        length: usize,
        read: impl FnOnce(usize) -> io::Result<Bytes>,
    ) -> Result<ChunkDigests, ParquetError> {
        let ranges = chunk_ranges(metadata, length).ok_or(ParquetError::Digest)?;
        let end = read(end_of(&ranges))?;
        let digests = || {
            let footer = footer_start(&end)?;
            let top = footer.checked_sub(DIGEST)?;
            let digests = top.checked_sub(ranges.len().checked_mul(CHUNK_DIGEST)?)?;
            let mut hasher = blake3::Hasher::new();
            hasher.update(MARK).update(&end[..top]).update(&end[footer..]);
            (hasher.finalize().as_bytes() == &end[top..footer]).then(|| end.slice(digests..top))
        };
        let digests = digests().ok_or(ParquetError::Digest)?;
        Ok(ChunkDigests { ranges, digests })
    }

    /// Returns true if `bytes` have the digest of the chunk with index `chunk`.
    pub fn matches(&self, chunk: usize, bytes: &[u8]) -> bool {
        let start = chunk * CHUNK_DIGEST;
        self.digests[start..start + CHUNK_DIGEST] == chunk_digest(bytes)
    }
}

fn chunk_digest(bytes: &[u8]) -> [u8; CHUNK_DIGEST] {
    let mut digest = [0; CHUNK_DIGEST];
    digest.copy_from_slice(&blake3::hash(bytes).as_bytes()[..CHUNK_DIGEST]);
    digest
}

/// Returns the position of the footer in `bytes`, the last bytes of a file. It is computed from the
/// length of the footer, which precedes the closing mark.
fn footer_start(bytes: &[u8]) -> Option<usize> {
    let tail = bytes.len().checked_sub(TAIL)?;
    let length = bytes[tail..].first_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    tail.checked_sub(length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::column::{Column, ColumnKind, optional_reals, reals};
    use crate::key::{Digest, TaskKey};
    use crate::parquet::{Columns, Metadata, ParquetError, decode_bytes, encode};
    use crate::table::Table;

    const GAP: Column = Column::result("gap", ColumnKind::Real, "1", "gap");
    const AREA: Column = Column::result("area", ColumnKind::Real, "1", "area");

    fn table() -> Table {
        let gaps = (0..100).map(|row| (row % 3 > 0).then_some(f64::from(row)));
        let areas = (0..100).map(f64::from);
        Table::new(100, vec![(GAP, optional_reals(gaps)), (AREA, reals(areas))])
    }

    /// Returns the file of a task and a published file.
    fn files() -> [Vec<u8>; 2] {
        let of_task = Metadata {
            key: Some(TaskKey::new("test", 1, Digest::from_params(&()), &[])),
            entries: Vec::new(),
        };
        [of_task, Metadata::default()].map(|metadata| encode(&table(), &metadata))
    }

    #[test]
    fn no_bit_can_be_flipped() {
        for bytes in files() {
            decode_bytes(bytes.clone().into(), Columns::All).unwrap();
            for position in 0..bytes.len() {
                let mut flipped = bytes.clone();
                flipped[position] ^= 1 << (position % 8);
                let read = decode_bytes(flipped.into(), Columns::All);
                assert!(matches!(read, Err(ParquetError::Digest)), "{position}: {read:?}");
            }
        }
    }

    // The `parquet` crate panics on some of the forged files.
    #[test]
    fn a_forged_file_with_the_right_digest_is_a_table_or_an_error() {
        let [mut opened, _] = files();
        let footer = footer_start(&opened).unwrap();
        opened.drain(footer - DIGEST..footer);
        let mut malformed = 0;
        for position in 0..opened.len() {
            for bit in 0..8 {
                let mut forged = opened.clone();
                forged[position] ^= 1 << bit;
                let Some(forged) = seal(forged) else { continue };
                if let Err(ParquetError::Malformed) = decode_bytes(forged.into(), Columns::All) {
                    malformed += 1;
                }
            }
        }
        assert!(malformed > 0);
    }
}
