//! A digest of a file within it, where readers of Parquet never look.

use bytes::Bytes;

use super::ParquetError;

/// Bytes of the digest before the footer.
const DIGEST: usize = blake3::OUT_LEN;
/// Bytes of the footer's length and the closing mark.
const TAIL: usize = 8;

/// Puts a digest of a Parquet file before its footer; nothing if it has none.
pub fn seal(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let footer = footer_start(&bytes)?;
    let digest = blake3::hash(&bytes);
    bytes.splice(footer..footer, *digest.as_bytes());
    Some(bytes)
}

/// The bytes of a file, if they are those that were written.
///
/// # Errors
/// When they are not.
pub fn verified(bytes: Bytes) -> Result<Bytes, ParquetError> {
    let footer = footer_start(&bytes).ok_or(ParquetError::Digest)?;
    let start = footer.checked_sub(DIGEST).ok_or(ParquetError::Digest)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..start]).update(&bytes[footer..]);
    match hasher.finalize().as_bytes() == &bytes[start..footer] {
        true => Ok(bytes),
        false => Err(ParquetError::Digest),
    }
}

/// Where the footer begins; its length stands before the closing mark.
fn footer_start(bytes: &[u8]) -> Option<usize> {
    let tail = bytes.len().checked_sub(TAIL)?;
    let length = bytes[tail..].first_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    tail.checked_sub(length)
}

#[cfg(test)]
mod tests {
    use super::super::{Columns, Metadata, decode_bytes, encode};
    use super::*;
    use crate::store::column::{Column, ColumnKind, optional_reals};
    use crate::store::table::Table;

    const GAP: Column = Column::result("gap", ColumnKind::Real, "1", "gap");

    /// A file without its digest, as a forger has it.
    fn opened() -> Vec<u8> {
        let gaps = (0..100).map(|row| (row % 3 > 0).then_some(f64::from(row)));
        let table = Table::new(100, vec![(GAP, optional_reals(gaps))]);
        let mut bytes = encode(&table, &Metadata::default());
        let footer = footer_start(&bytes).unwrap();
        bytes.drain(footer - DIGEST..footer);
        bytes
    }

    /// The reader of Parquet panics at some of them.
    #[test]
    fn a_forged_file_with_the_right_digest_is_a_table_or_an_error() {
        let opened = opened();
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
