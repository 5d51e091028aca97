//! Registers in plain arithmetic, for any processor.

use std::marker::PhantomData;

use super::Registers;

/// Arrays of so many numbers.
#[derive(Clone, Copy, Default)]
pub struct Plain<T, const LANES: usize>(PhantomData<T>);

macro_rules! plain {
    ($number:ty, $lanes:literal) => {
        impl Registers for Plain<$number, $lanes> {
            type Number = $number;
            type Lanes = [$number; $lanes];
            type Part = Self;

            #[inline(always)]
            fn part(self) -> Self {
                self
            }

            #[inline(always)]
            fn splat(self, value: $number) -> Self::Lanes {
                [value; $lanes]
            }

            #[inline(always)]
            fn add(self, mut a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                for i in 0..$lanes {
                    a[i] += b[i];
                }
                a
            }

            #[inline(always)]
            fn sub(self, mut a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                for i in 0..$lanes {
                    a[i] -= b[i];
                }
                a
            }

            #[inline(always)]
            fn mul(self, mut a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                for i in 0..$lanes {
                    a[i] *= b[i];
                }
                a
            }

            #[inline(always)]
            fn add_product(
                self,
                mut c: Self::Lanes,
                a: Self::Lanes,
                b: Self::Lanes,
            ) -> Self::Lanes {
                for i in 0..$lanes {
                    c[i] = a[i].mul_add(b[i], c[i]);
                }
                c
            }

            #[inline(always)]
            fn sub_product(
                self,
                mut c: Self::Lanes,
                a: Self::Lanes,
                b: Self::Lanes,
            ) -> Self::Lanes {
                for i in 0..$lanes {
                    c[i] = (-a[i]).mul_add(b[i], c[i]);
                }
                c
            }

            #[inline(always)]
            fn zip(self, a: Self::Lanes, b: Self::Lanes) -> [Self::Lanes; 2] {
                let mut zipped = [a; 2];
                let numbers = zipped.as_flattened_mut();
                for i in 0..$lanes {
                    (numbers[2 * i], numbers[2 * i + 1]) = (a[i], b[i]);
                }
                zipped
            }
        }
    };
}

plain!(f32, 16);
plain!(f64, 8);
