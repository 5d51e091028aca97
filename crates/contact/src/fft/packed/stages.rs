//! Transforms of many columns at once, down to blocks and back.
//!
//! Forward, each stage cuts blocks in as many parts as its radix, by decimation in frequency; the
//! inverse joins them again, by decimation in time. What is in between sits where it falls, in an
//! order that [`Stages::places`] tells, and nothing is ever reordered.

use std::f64::consts::TAU;

use pulp::bytemuck;

use super::super::Real;
use super::super::aligned::Aligned;
use super::super::registers::{PartOf, Registers};
use super::butterflies::{Complex, fourier, times};

/// The stages of a transform of `length` numbers, from the whole down to blocks of the registers'
/// lanes.
///
/// Numbers of one transform either sit in registers one after another, all lanes of a register
/// belonging to one transform (`ALONG`), or one to a register, each lane belonging to another
/// transform.
pub struct Stages<T, const ALONG: bool> {
    stages: Vec<Stage<T>>,
    places: Vec<usize>,
}

struct Stage<T> {
    radix: usize,
    /// Registers in a block that is cut by this stage.
    block: usize,
    /// exp(−2πi jq/length) for each j of a part and each part q from 1: real, imaginary, each one
    /// register long if `ALONG`, else one number.
    twiddles: Aligned<T>,
}

impl<T: Real, const ALONG: bool> Stages<T, ALONG> {
    /// None if there is no way from `length` to `lanes` by factors of 2, 3 and 5.
    pub fn new(length: usize, lanes: usize) -> Option<Self> {
        let radices = radices(length / lanes)?;
        let width = if ALONG { lanes } else { 1 };
        let mut stages = Vec::new();
        let mut places = vec![0];
        let mut block = length;
        for radix in radices {
            let part = block / radix;
            // A frequency's lowest digit is the part that it falls in.
            places = (0..radix)
                .flat_map(|q| places.iter().map(move |place| place + q * part / lanes))
                .collect();
            stages.push(Stage {
                radix,
                block: block / width,
                twiddles: twiddles(block, radix, width),
            });
            block = part;
        }
        Some(Self { stages, places })
    }

    /// The place of the block with the frequencies k, k + K, k + 2K, … for each k < K, K being the
    /// number of blocks.
    pub fn places(&self) -> &[usize] {
        &self.places
    }

    #[inline(always)]
    pub fn forward<R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        for stage in &self.stages {
            match stage.radix {
                2 => stage.cut::<2, ALONG, R>(r, re, im),
                3 => stage.cut::<3, ALONG, R>(r, re, im),
                4 => stage.cut::<4, ALONG, R>(r, re, im),
                5 => stage.cut::<5, ALONG, R>(r, re, im),
                _ => stage.cut::<8, ALONG, R>(r, re, im),
            }
        }
    }

    /// Undoes [`Stages::forward`], times the number of blocks.
    #[inline(always)]
    pub fn inverse<R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        // With real and imaginary parts exchanged, forward turns into inverse.
        for stage in self.stages.iter().rev() {
            match stage.radix {
                2 => stage.join::<2, ALONG, R>(r, im, re),
                3 => stage.join::<3, ALONG, R>(r, im, re),
                4 => stage.join::<4, ALONG, R>(r, im, re),
                5 => stage.join::<5, ALONG, R>(r, im, re),
                _ => stage.join::<8, ALONG, R>(r, im, re),
            }
        }
    }
}

impl<T: Real> Stage<T> {
    #[inline(always)]
    fn cut<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        let (r, block) = (r.part(), self.block * R::PARTS);
        let part = block / RADIX;
        let re: &mut [PartOf<R>] = bytemuck::cast_slice_mut(re);
        let im: &mut [PartOf<R>] = bytemuck::cast_slice_mut(im);
        for (re, im) in re.chunks_exact_mut(block).zip(im.chunks_exact_mut(block)) {
            let places = (0..part).step_by(R::PARTS);
            for (first, twiddles) in places.zip(self.twiddles_of::<RADIX, ALONG, R>()) {
                for lane in 0..R::PARTS {
                    let j = first + lane;
                    let mut x = [at(re, im, j); RADIX];
                    for q in 1..RADIX {
                        x[q] = at(re, im, j + q * part);
                    }
                    fourier(r, &mut x);
                    (re[j], im[j]) = (x[0].re, x[0].im);
                    for q in 1..RADIX {
                        let x = times(r, x[q], twiddle::<ALONG, R>(r, twiddles, q, lane));
                        (re[j + q * part], im[j + q * part]) = (x.re, x.im);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn join<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
        r: R,
        re: &mut [R::Lanes],
        im: &mut [R::Lanes],
    ) {
        let (r, block) = (r.part(), self.block * R::PARTS);
        let part = block / RADIX;
        let re: &mut [PartOf<R>] = bytemuck::cast_slice_mut(re);
        let im: &mut [PartOf<R>] = bytemuck::cast_slice_mut(im);
        for (re, im) in re.chunks_exact_mut(block).zip(im.chunks_exact_mut(block)) {
            let places = (0..part).step_by(R::PARTS);
            for (first, twiddles) in places.zip(self.twiddles_of::<RADIX, ALONG, R>()) {
                for lane in 0..R::PARTS {
                    let j = first + lane;
                    let mut x = [at(re, im, j); RADIX];
                    for q in 1..RADIX {
                        let turn = twiddle::<ALONG, R>(r, twiddles, q, lane);
                        x[q] = times(r, at(re, im, j + q * part), turn);
                    }
                    fourier(r, &mut x);
                    for q in 0..RADIX {
                        (re[j + q * part], im[j + q * part]) = (x[q].re, x[q].im);
                    }
                }
            }
        }
    }

    /// The twiddles of each j in turn.
    #[inline(always)]
    fn twiddles_of<const RADIX: usize, const ALONG: bool, R: Registers<Number = T>>(
        &self,
    ) -> impl Iterator<Item = &[T]> {
        let width = if ALONG { R::LANES } else { 1 };
        self.twiddles.chunks_exact(2 * (RADIX - 1) * width)
    }
}

#[inline(always)]
fn at<V: Copy>(re: &[V], im: &[V], index: usize) -> Complex<V> {
    Complex { re: re[index], im: im[index] }
}

/// The twiddle of part `q` among those of one j, for one part of a register.
#[inline(always)]
fn twiddle<const ALONG: bool, R: Registers>(
    part: R::Part,
    twiddles: &[R::Number],
    q: usize,
    lane: usize,
) -> Complex<PartOf<R>> {
    if ALONG {
        let registers: &[PartOf<R>] = bytemuck::cast_slice(twiddles);
        Complex {
            re: registers[2 * (q - 1) * R::PARTS + lane],
            im: registers[(2 * (q - 1) + 1) * R::PARTS + lane],
        }
    } else {
        Complex { re: part.splat(twiddles[2 * (q - 1)]), im: part.splat(twiddles[2 * (q - 1) + 1]) }
    }
}

fn twiddles<T: Real>(length: usize, radix: usize, width: usize) -> Aligned<T> {
    let mut twiddles = Vec::new();
    for first in (0..length / radix).step_by(width) {
        for q in 1..radix {
            let angles =
                (first..first + width).map(|j| -TAU * (j * q % length) as f64 / length as f64);
            twiddles.extend(angles.clone().map(|angle| T::nearest(libm::cos(angle))));
            twiddles.extend(angles.map(|angle| T::nearest(libm::sin(angle))));
        }
    }
    twiddles.into_iter().collect()
}

/// Factors of `n`, as many eights as possible without a stage of two.
fn radices(mut n: usize) -> Option<Vec<usize>> {
    let mut radices = Vec::new();
    for odd in [5, 3] {
        while n.is_multiple_of(odd) {
            radices.push(odd);
            n /= odd;
        }
    }
    while n > 1 {
        let radix = match n {
            2 => 2,
            4 | 16 => 4,
            _ if n.is_multiple_of(8) => 8,
            _ => return None,
        };
        radices.push(radix);
        n /= radix;
    }
    Some(radices)
}
