//! AVX-512 registers, and pairs of AVX2 registers with fused multiply-add.

use std::arch::x86_64::{__m256, __m256d, __m512, __m512d};

use pulp::NullaryFnOnce;
use pulp::bytemuck::{Pod, cast};
use pulp::x86::{V3, V4};

use super::{Registers, Work};

#[derive(Clone, Copy)]
struct Single<S>(S);

#[derive(Clone, Copy)]
struct Double<S>(S);

#[derive(Clone, Copy)]
struct Pair<R>(R);

/// Implements `Registers` with the named intrinsics.
macro_rules! registers {
    (
        $registers:ty: $lanes:ty as $number:ty,
        $set:ident { $splat:ident, $add:ident, $sub:ident, $mul:ident },
        $fused:ident { $add_product:ident, $sub_product:ident },
        $zip:ident
    ) => {
        impl Registers for $registers {
            type Number = $number;
            type Lanes = $lanes;
            const LANES: usize = size_of::<$lanes>() / size_of::<$number>();
            type Part = Self;

            #[inline(always)]
            fn part(self) -> Self {
                self
            }

            #[inline(always)]
            fn splat(self, value: $number) -> $lanes {
                self.0.$set.$splat(value)
            }

            #[inline(always)]
            fn add(self, a: $lanes, b: $lanes) -> $lanes {
                self.0.$set.$add(a, b)
            }

            #[inline(always)]
            fn sub(self, a: $lanes, b: $lanes) -> $lanes {
                self.0.$set.$sub(a, b)
            }

            #[inline(always)]
            fn mul(self, a: $lanes, b: $lanes) -> $lanes {
                self.0.$set.$mul(a, b)
            }

            #[inline(always)]
            fn add_product(self, c: $lanes, a: $lanes, b: $lanes) -> $lanes {
                self.0.$fused.$add_product(a, b, c)
            }

            #[inline(always)]
            fn sub_product(self, c: $lanes, a: $lanes, b: $lanes) -> $lanes {
                self.0.$fused.$sub_product(a, b, c)
            }

            #[inline(always)]
            fn zip(self, a: $lanes, b: $lanes) -> [$lanes; 2] {
                $zip(self.0, a, b)
            }
        }
    };
}

registers!(
    Single<V4>: __m512 as f32,
    avx512f { _mm512_set1_ps, _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps },
    avx512f { _mm512_fmadd_ps, _mm512_fnmadd_ps },
    zip_16
);
registers!(
    Double<V4>: __m512d as f64,
    avx512f { _mm512_set1_pd, _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd },
    avx512f { _mm512_fmadd_pd, _mm512_fnmadd_pd },
    zip_8_wide
);
registers!(
    Single<V3>: __m256 as f32,
    avx { _mm256_set1_ps, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps },
    fma { _mm256_fmadd_ps, _mm256_fnmadd_ps },
    zip_8
);
registers!(
    Double<V3>: __m256d as f64,
    avx { _mm256_set1_pd, _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd },
    fma { _mm256_fmadd_pd, _mm256_fnmadd_pd },
    zip_4
);

impl<R> Registers for Pair<R>
where
    R: Registers,
    [R::Lanes; 2]: Pod,
{
    type Number = R::Number;
    type Lanes = [R::Lanes; 2];
    type Part = R;

    #[inline(always)]
    fn part(self) -> R {
        self.0
    }

    #[inline(always)]
    fn splat(self, value: R::Number) -> [R::Lanes; 2] {
        [self.0.splat(value); 2]
    }

    #[inline(always)]
    fn add(self, a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [R::Lanes; 2] {
        [self.0.add(a[0], b[0]), self.0.add(a[1], b[1])]
    }

    #[inline(always)]
    fn sub(self, a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [R::Lanes; 2] {
        [self.0.sub(a[0], b[0]), self.0.sub(a[1], b[1])]
    }

    #[inline(always)]
    fn mul(self, a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [R::Lanes; 2] {
        [self.0.mul(a[0], b[0]), self.0.mul(a[1], b[1])]
    }

    #[inline(always)]
    fn add_product(self, c: [R::Lanes; 2], a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [R::Lanes; 2] {
        [self.0.add_product(c[0], a[0], b[0]), self.0.add_product(c[1], a[1], b[1])]
    }

    #[inline(always)]
    fn sub_product(self, c: [R::Lanes; 2], a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [R::Lanes; 2] {
        [self.0.sub_product(c[0], a[0], b[0]), self.0.sub_product(c[1], a[1], b[1])]
    }

    #[inline(always)]
    fn zip(self, a: [R::Lanes; 2], b: [R::Lanes; 2]) -> [[R::Lanes; 2]; 2] {
        [self.0.zip(a[0], b[0]), self.0.zip(a[1], b[1])]
    }
}

#[inline(always)]
fn zip_16(v: V4, a: __m512, b: __m512) -> [__m512; 2] {
    const LOW: [i32; 16] = [0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23];
    const HIGH: [i32; 16] = [8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31];
    [
        v.avx512f._mm512_permutex2var_ps(a, cast(LOW), b),
        v.avx512f._mm512_permutex2var_ps(a, cast(HIGH), b),
    ]
}

#[inline(always)]
fn zip_8_wide(v: V4, a: __m512d, b: __m512d) -> [__m512d; 2] {
    const LOW: [i64; 8] = [0, 8, 1, 9, 2, 10, 3, 11];
    const HIGH: [i64; 8] = [4, 12, 5, 13, 6, 14, 7, 15];
    [
        v.avx512f._mm512_permutex2var_pd(a, cast(LOW), b),
        v.avx512f._mm512_permutex2var_pd(a, cast(HIGH), b),
    ]
}

#[inline(always)]
fn zip_8(v: V3, a: __m256, b: __m256) -> [__m256; 2] {
    let even = v.avx._mm256_unpacklo_ps(a, b);
    let odd = v.avx._mm256_unpackhi_ps(a, b);
    [
        v.avx._mm256_permute2f128_ps::<0x20>(even, odd),
        v.avx._mm256_permute2f128_ps::<0x31>(even, odd),
    ]
}

#[inline(always)]
fn zip_4(v: V3, a: __m256d, b: __m256d) -> [__m256d; 2] {
    let even = v.avx._mm256_unpacklo_pd(a, b);
    let odd = v.avx._mm256_unpackhi_pd(a, b);
    [
        v.avx._mm256_permute2f128_pd::<0x20>(even, odd),
        v.avx._mm256_permute2f128_pd::<0x31>(even, odd),
    ]
}

/// Computation with the registers on which it runs, for pulp's dispatch to an instruction set.
struct Run<W, R>(W, R);

impl<R: Registers, W: Work<R::Number>> NullaryFnOnce for Run<W, R> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.run(self.1);
    }
}

pub fn single_512(v: V4, work: impl Work<f32>) {
    v.vectorize(Run(work, Single(v)));
}

pub fn single_256(v: V3, work: impl Work<f32>) {
    v.vectorize(Run(work, Pair(Single(v))));
}

pub fn double_512(v: V4, work: impl Work<f64>) {
    v.vectorize(Run(work, Double(v)));
}

pub fn double_256(v: V3, work: impl Work<f64>) {
    v.vectorize(Run(work, Pair(Double(v))));
}
