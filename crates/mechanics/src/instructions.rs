//! Vector instruction sets of the processor, and the set in use.
//!
//! The solver adds numbers in the same order with all instruction sets: sixteen numbers of single
//! precision or eight of double precision at a time, with fused multiply-add. The sets therefore
//! differ in speed only: AVX-512 and AVX2 give the same bytes.
//!
//! [`Instructions::Portable`] does the same operations without vector instructions, for all other
//! processors. On these, rustfft chooses its own instructions to generate surfaces and for meshes
//! with factors other than 2, 3 and 5. Results then agree to rounding errors, not to the bit.
//! Without fused multiply-add, as on x86-64 processors before 2013, this set is slow.

use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// Set of vector instructions that the processor supports.
#[derive(Debug, Clone, Copy)]
pub enum Instructions {
    /// Registers of 512 bits (AVX-512).
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
    /// Registers of 256 bits and fused multiply-add (AVX2).
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    /// Scalar arithmetic, for any processor.
    Portable,
}

static CHOSEN: OnceLock<Instructions> = OnceLock::new();

impl Instructions {
    /// Returns all sets that this processor supports, the widest first.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(V4::try_new().map(Self::Avx512));
            all.extend(V3::try_new().map(Self::Avx2));
        }
        all.push(Self::Portable);
        all
    }

    /// Returns the set that this process uses: the one that [`choose`](Self::choose) has set,
    /// otherwise the widest.
    pub fn in_use() -> Self {
        *CHOSEN.get_or_init(|| Self::all()[0])
    }

    /// Chooses the instruction set with the given name for this process.
    ///
    /// # Errors
    ///
    /// Fails if the processor does not support a set with this name, or if another set is already
    /// in use.
    pub fn choose(name: &str) -> Result<(), ChooseError> {
        let all = Self::all();
        let Some(chosen) = all.iter().find(|one| one.name() == name) else {
            let known: Vec<&str> = all.iter().map(|one| one.name()).collect();
            let (name, names) = (name.to_owned(), known.join("`, `"));
            return Err(ChooseError::Unknown { name, names });
        };
        let in_use = CHOSEN.get_or_init(|| *chosen).name();
        if in_use == name { Ok(()) } else { Err(ChooseError::InUse { in_use }) }
    }

    /// Returns the name of the set: `avx512`, `avx2` or `portable`.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            Self::Portable => "portable",
        }
    }
}

/// Reason why [`Instructions::choose`] cannot use an instruction set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the error messages describe the variants")]
pub enum ChooseError {
    #[error("unknown instruction set `{name}`; available on this processor: `{names}`")]
    Unknown { name: String, names: String },
    #[error(
        "instruction set `{in_use}` is already in use; choose another one before the first transform"
    )]
    InUse { in_use: &'static str },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_processor_has_portable_instructions_as_the_last_resort() {
        assert_eq!(Instructions::all().last().unwrap().name(), "portable");
    }

    #[test]
    fn unknown_instructions_are_refused_with_the_known_names() {
        let message = Instructions::choose("mmx").unwrap_err().to_string();
        assert!(
            message.starts_with("unknown instruction set `mmx`; available on this processor: `")
        );
        assert!(message.ends_with("`portable`"), "{message}");
    }

    #[test]
    fn instructions_in_use_stay_in_use() {
        let in_use = Instructions::in_use().name();
        assert_eq!(Instructions::choose(in_use), Ok(()));
        for other in Instructions::all() {
            if other.name() != in_use {
                let error = Instructions::choose(other.name());
                assert_eq!(error, Err(ChooseError::InUse { in_use }));
            }
        }
    }
}
