//! The vector instructions of the processor, and which of them are used.
//!
//! All that the solver sums is summed in the same order, whatever the instructions: over sixteen
//! numbers of single precision or eight of double precision at a time, products added with one
//! rounding. So the widest instructions are a question of speed alone, and a study computed with
//! AVX-512 has the bytes of one computed with AVX2.
//!
//! [`Instructions::Portable`] does the same without any: the way of processors that have neither.
//! There rustfft, which draws surfaces and transforms meshes of other factors than 2, 3 and 5, has
//! instructions of its own choice and rounds otherwise: heights agree to rounding, not to the bit.
//! Where the processor has no fused multiply-add at all, as on x86-64 before 2013, it is slow.

use std::fmt;
use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

/// A set of vector instructions that this processor has.
#[derive(Debug, Clone, Copy)]
pub enum Instructions {
    /// 512 bits a register.
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
    /// 256 bits a register, and fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    /// Whatever the compiler makes of plain arithmetic.
    Portable,
}

static CHOSEN: OnceLock<Instructions> = OnceLock::new();

impl Instructions {
    /// All that the processor has, the widest first.
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

    /// Those in use in this process: the widest, unless others were chosen before.
    pub fn in_use() -> Self {
        *CHOSEN.get_or_init(|| Self::all()[0])
    }

    /// Uses the set of that name from now on.
    ///
    /// # Errors
    /// The names there are, if this is none of them; and when others are in use already.
    pub fn choose(name: &str) -> Result<(), NotChosen> {
        let all = Self::all();
        let Some(chosen) = all.iter().find(|one| one.name() == name) else {
            let names = all.iter().map(|one| one.name()).collect();
            return Err(NotChosen::Unknown { name: name.to_owned(), names });
        };
        let in_use = CHOSEN.get_or_init(|| *chosen).name();
        if in_use == name { Ok(()) } else { Err(NotChosen::InUse { in_use }) }
    }

    /// What it is called: `avx512`, `avx2` or `portable`.
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

/// Why instructions cannot be chosen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum NotChosen {
    #[error("no instructions `{name}`: this processor has {}", Names(names))]
    Unknown { name: String, names: Vec<&'static str> },
    #[error("instructions are chosen before the first transform; `{in_use}` are in use")]
    InUse { in_use: &'static str },
}

struct Names<'a>(&'a [&'static str]);

impl fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let quoted: Vec<String> = self.0.iter().map(|name| format!("`{name}`")).collect();
        f.write_str(&quoted.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_processor_has_portable_instructions_as_the_last_resort() {
        assert_eq!(Instructions::all().last().unwrap().name(), "portable");
    }

    #[test]
    fn unknown_instructions_are_refused_with_the_names_of_those_there_are() {
        let message = Instructions::choose("mmx").unwrap_err().to_string();
        assert!(message.starts_with("no instructions `mmx`: this processor has `"));
        assert!(message.ends_with("`portable`"), "{message}");
    }

    #[test]
    fn what_is_in_use_stays_so() {
        let in_use = Instructions::in_use().name();
        assert_eq!(Instructions::choose(in_use), Ok(()));
        for other in Instructions::all() {
            if other.name() != in_use {
                let error = Instructions::choose(other.name());
                assert_eq!(error, Err(NotChosen::InUse { in_use }));
            }
        }
    }
}
