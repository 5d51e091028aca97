//! Arithmetic on whole registers, written once and compiled for each instruction set.
//!
//! pulp finds out what the processor can do and keeps the intrinsics safe. All that runs on
//! registers is `#[inline(always)]` and free of closures: only so is it compiled with the
//! instructions of the [`Work`] that it belongs to.

use pulp::bytemuck::Pod;

use super::Real;

#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
pub use x86::InstructionSet;

/// The most numbers that any register holds.
pub const MOST_LANES: usize = 16;

/// Registers of one instruction set, filled with numbers of one precision.
pub trait Registers: Copy {
    type Number: Real;
    /// A register.
    type Lanes: Pod;
    /// Numbers in a register: a power of two from 4 to [`MOST_LANES`].
    const LANES: usize;

    fn splat(self, value: Self::Number) -> Self::Lanes;
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// c + a b, rounded once.
    fn add_product(self, c: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// c − a b, rounded once.
    fn sub_product(self, c: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a₀ b₀ a₁ b₁ …, in two registers.
    fn zip(self, a: Self::Lanes, b: Self::Lanes) -> [Self::Lanes; 2];
}

/// What is to run on registers of numbers `T`.
pub trait Work<T> {
    fn run<R: Registers<Number = T>>(self, registers: R);
}

/// A precision that fits into registers.
pub trait Vectorize: Pod {
    /// Runs `work` with the registers of `instructions`.
    fn vectorize(instructions: InstructionSet, work: impl Work<Self>);
    /// Numbers in a register of `instructions`.
    fn lanes(instructions: InstructionSet) -> usize;
}

/// Transposes the square whose rows are the first `LANES` registers.
///
/// Each round interleaves row i with row i + LANES/2: a row's number takes over one binary digit
/// of the lane's, and the lane's one of the row's.
#[inline(always)]
pub fn transpose<R: Registers>(registers: R, rows: &mut [R::Lanes; MOST_LANES]) {
    for _ in 0..R::LANES.ilog2() {
        let before = *rows;
        for i in 0..R::LANES / 2 {
            [rows[2 * i], rows[2 * i + 1]] = registers.zip(before[i], before[i + R::LANES / 2]);
        }
    }
}

/// No instruction set: other processors leave convolutions to rustfft.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Debug, Clone, Copy)]
pub enum InstructionSet {}

#[cfg(not(target_arch = "x86_64"))]
mod none {
    use super::{InstructionSet, Vectorize, Work};

    impl InstructionSet {
        pub fn all() -> impl Iterator<Item = Self> {
            std::iter::empty()
        }
    }

    impl Vectorize for f32 {
        fn vectorize(instructions: InstructionSet, _: impl Work<Self>) {
            match instructions {}
        }

        fn lanes(instructions: InstructionSet) -> usize {
            match instructions {}
        }
    }

    impl Vectorize for f64 {
        fn vectorize(instructions: InstructionSet, _: impl Work<Self>) {
            match instructions {}
        }

        fn lanes(instructions: InstructionSet) -> usize {
            match instructions {}
        }
    }
}
