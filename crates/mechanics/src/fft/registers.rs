//! Arithmetic on whole registers, written once and compiled for each instruction set.
//!
//! A register in this module holds sixteen numbers of single precision or eight of double
//! precision, in one or two registers of the processor. Transforms are therefore divided the same
//! way and rounded alike on all processors. pulp makes the intrinsics safe to call. Functions on
//! registers are `#[inline(always)]` and contain no closures, because only then are they compiled
//! with the instructions of their [`Work`]. [`Plain`] registers work on any processor.

use std::array::from_fn;
use std::marker::PhantomData;

use pulp::bytemuck;
use pulp::bytemuck::Pod;

use super::Real;
use crate::instructions::Instructions;

#[cfg(target_arch = "x86_64")]
mod x86;

/// Maximum number of values in a register.
pub const MAX_LANES: usize = 16;

/// Arithmetic on registers of `LANES` numbers of one precision, with one instruction set.
#[expect(unnameable_types, reason = "it seals `Real`")]
pub trait Registers: Copy {
    type Number: Real;
    type Lanes: Pod;
    const LANES: usize = <Self::Number as Vectorize>::LANES;
    /// Arithmetic on processor registers; [`Self::PARTS`] processor registers form one register of
    /// this module.
    ///
    /// Operations that do not mix lanes process one processor register after the other, so that
    /// fewer values are live at a time.
    type Part: Registers<Number = Self::Number>;
    /// Number of processor registers in one register.
    const PARTS: usize = size_of::<Self::Lanes>() / size_of::<<Self::Part as Registers>::Lanes>();

    fn part(self) -> Self::Part;
    fn splat(self, value: Self::Number) -> Self::Lanes;
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Returns c + a b, rounded once.
    fn add_product(self, c: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Returns c − a b, rounded once.
    fn sub_product(self, c: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Returns the numbers a₀, b₀, a₁, b₁, …, in two registers.
    fn zip(self, a: Self::Lanes, b: Self::Lanes) -> [Self::Lanes; 2];
}

/// Computation on registers that hold numbers of type `T`.
#[expect(unnameable_types, reason = "it seals `Real`")]
pub trait Work<T> {
    fn run<R: Registers<Number = T>>(self, registers: R);
}

/// Number type that registers can hold.
#[expect(unnameable_types, reason = "it seals `Real`")]
pub trait Vectorize: Pod {
    /// Number of values in a register: a power of two, at most [`MAX_LANES`].
    const LANES: usize;

    /// Runs `work` with the registers of the instruction set `instructions`.
    fn vectorize(instructions: Instructions, work: impl Work<Self>);
}

impl Vectorize for f32 {
    const LANES: usize = 16;

    fn vectorize(instructions: Instructions, work: impl Work<Self>) {
        match instructions {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(v) => x86::single_512(v, work),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(v) => x86::single_256(v, work),
            Instructions::Portable => work.run(Plain::<f32, 16>::default()),
        }
    }
}

impl Vectorize for f64 {
    const LANES: usize = 8;

    fn vectorize(instructions: Instructions, work: impl Work<Self>) {
        match instructions {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512(v) => x86::double_512(v, work),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2(v) => x86::double_256(v, work),
            Instructions::Portable => work.run(Plain::<f64, 8>::default()),
        }
    }
}

/// Content of a processor register; one or two processor registers form a register of `R`.
pub type PartOf<R> = <<R as Registers>::Part as Registers>::Lanes;

/// Transposes the square matrix in the first `LANES` registers, one row in each.
///
/// The matrix is divided into square blocks with the width of a processor register. Each block is
/// transposed, and blocks above the diagonal are exchanged with those below.
#[inline(always)]
pub fn transpose<R: Registers>(registers: R, rows: &mut [R::Lanes; MAX_LANES]) {
    let part = registers.part();
    let side = <R::Part as Registers>::LANES;
    let parts: &mut [PartOf<R>] = bytemuck::cast_slice_mut(rows);
    let zero = part.splat(R::Number::default());
    for above in 0..R::PARTS {
        for below in above..R::PARTS {
            let (mut right, mut left) = ([zero; MAX_LANES], [zero; MAX_LANES]);
            for i in 0..side {
                right[i] = parts[(above * side + i) * R::PARTS + below];
                left[i] = parts[(below * side + i) * R::PARTS + above];
            }
            transpose_square(part, &mut right);
            if above != below {
                transpose_square(part, &mut left);
                for i in 0..side {
                    parts[(above * side + i) * R::PARTS + below] = left[i];
                }
            }
            for i in 0..side {
                parts[(below * side + i) * R::PARTS + above] = right[i];
            }
        }
    }
}

/// Transposes the square matrix in the first `LANES` processor registers, one row in each.
///
/// Each of log₂ `LANES` rounds interleaves rows i and i + `LANES`/2. A round rotates the binary
/// digits of the index row × `LANES` + lane to the left by one digit.
#[inline(always)]
fn transpose_square<R: Registers>(registers: R, rows: &mut [R::Lanes; MAX_LANES]) {
    for _ in 0..R::LANES.ilog2() {
        let before = *rows;
        for i in 0..R::LANES / 2 {
            [rows[2 * i], rows[2 * i + 1]] = registers.zip(before[i], before[i + R::LANES / 2]);
        }
    }
}

/// Registers that are arrays of `LANES` numbers, for any processor.
#[derive(Clone, Copy, Default)]
struct Plain<T, const LANES: usize>(PhantomData<T>);

impl<T: Real, const LANES: usize> Registers for Plain<T, LANES>
where
    [T; LANES]: Pod,
{
    type Number = T;
    type Lanes = [T; LANES];
    type Part = Self;

    #[inline(always)]
    fn part(self) -> Self {
        self
    }

    #[inline(always)]
    fn splat(self, value: T) -> [T; LANES] {
        [value; LANES]
    }

    #[inline(always)]
    fn add(self, a: [T; LANES], b: [T; LANES]) -> [T; LANES] {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: [T; LANES], b: [T; LANES]) -> [T; LANES] {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: [T; LANES], b: [T; LANES]) -> [T; LANES] {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn add_product(self, c: [T; LANES], a: [T; LANES], b: [T; LANES]) -> [T; LANES] {
        from_fn(|i| c[i].plus_product(a[i], b[i]))
    }

    #[inline(always)]
    fn sub_product(self, c: [T; LANES], a: [T; LANES], b: [T; LANES]) -> [T; LANES] {
        from_fn(|i| c[i].plus_product(-a[i], b[i]))
    }

    #[inline(always)]
    fn zip(self, a: [T; LANES], b: [T; LANES]) -> [[T; LANES]; 2] {
        let both = [a, b];
        [0, LANES].map(|first| from_fn(|i| both[(first + i) % 2][(first + i) / 2]))
    }
}
