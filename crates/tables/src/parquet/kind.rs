//! Types of values in the compact protocol of Thrift.

/// What the bytes say that a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the types of Thrift")]
pub enum Kind {
    Truth,
    Byte,
    Short,
    Int,
    Long,
    Double,
    Bytes,
    List,
    Set,
    Map,
    Struct,
    Uuid,
}

impl Kind {
    /// The type that has this number, of a field and of elements of a list.
    pub fn of(word: u8) -> Option<Kind> {
        Some(match word {
            1 | 2 => Kind::Truth,
            3 => Kind::Byte,
            4 => Kind::Short,
            5 => Kind::Int,
            6 => Kind::Long,
            7 => Kind::Double,
            8 => Kind::Bytes,
            9 => Kind::List,
            10 => Kind::Set,
            11 => Kind::Map,
            12 => Kind::Struct,
            13 => Kind::Uuid,
            _ => return None,
        })
    }
}
