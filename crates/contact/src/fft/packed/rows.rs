//! Complex rows between a batch and the tiles: transformed forward there and backwards from there, or as
//! they are.

use std::ops::Deref;

use pulp::bytemuck;

use super::super::Real;
use super::super::registers::{Registers, Work};
use super::stages::Stages;
use super::{BATCH, Shares};

/// Takes a batch of complex rows to the tiles.
pub struct Store<'a, 'b, T> {
    /// Of the transform that comes before, if any does.
    pub stages: Option<&'a Stages<T, true>>,
    pub row_nodes: usize,
    /// The first complex row, of those at hand.
    pub first: usize,
    pub batch: &'a mut [T],
    pub tiles: &'a mut Shares<'b, T>,
}

impl<T: Real> Work<T> for Store<'_, '_, T> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.row_nodes / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        if let Some(stages) = self.stages {
            for row in batch.chunks_exact_mut(2 * registers) {
                let (re, im) = row.split_at_mut(registers);
                stages.forward(r, re, im);
            }
        }
        let start = self.first * R::LANES;
        for (j, [re, im]) in self.tiles.iter_mut().enumerate() {
            let re = &mut re[start..][..BATCH * R::LANES];
            let im = &mut im[start..][..BATCH * R::LANES];
            let re: &mut [R::Lanes] = bytemuck::cast_slice_mut(re);
            let im: &mut [R::Lanes] = bytemuck::cast_slice_mut(im);
            for k in 0..BATCH {
                re[k] = batch[2 * k * registers + j];
                im[k] = batch[(2 * k + 1) * registers + j];
            }
        }
    }
}

/// Brings so many complex rows back from the tiles.
pub struct Fetch<'a, const ROWS: usize, T, B> {
    /// Of the transform that comes after, if any does.
    pub stages: Option<&'a Stages<T, true>>,
    pub row_nodes: usize,
    pub first: usize,
    pub batch: &'a mut [T],
    pub tiles: &'a [[B; 2]],
}

impl<const ROWS: usize, T: Real, B: Deref<Target = [T]>> Work<T> for Fetch<'_, ROWS, T, B> {
    #[inline(always)]
    fn run<R: Registers<Number = T>>(self, r: R) {
        let registers = self.row_nodes / R::LANES;
        let batch: &mut [R::Lanes] = bytemuck::cast_slice_mut(self.batch);
        let start = self.first * R::LANES;
        for (j, [re, im]) in self.tiles.iter().enumerate() {
            let re: &[R::Lanes] = bytemuck::cast_slice(&re[start..][..ROWS * R::LANES]);
            let im: &[R::Lanes] = bytemuck::cast_slice(&im[start..][..ROWS * R::LANES]);
            for k in 0..ROWS {
                batch[2 * k * registers + j] = re[k];
                batch[(2 * k + 1) * registers + j] = im[k];
            }
        }
        if let Some(stages) = self.stages {
            for row in batch.chunks_exact_mut(2 * registers) {
                let (re, im) = row.split_at_mut(registers);
                stages.inverse(r, re, im);
            }
        }
    }
}
