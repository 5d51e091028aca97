//! Which nodes that penetrate when a search begins are free.

use pulp::Simd;

use super::super::lanes::{Lanes, REST, split, split_mut};
use super::nearing::Nearing;

/// Nodes that are expected in contact. Of others it is not shown that they penetrate.
#[derive(Clone, Copy, Default)]
pub enum Expected {
    /// All that penetrate.
    #[default]
    All,
    /// Those that are near, going on from the last load.
    Near(Nearing),
    /// Those of this height, or higher ones.
    AsHighAs(f32),
}

/// A row of gaps as a search begins with them.
#[derive(Clone)]
pub struct ShownGap(Vec<f32>);

impl ShownGap {
    pub fn new(row_nodes: usize) -> Self {
        Self(vec![0.0; row_nodes])
    }

    /// Holds nodes that are not near above `level`, given their gaps under the last load and the one before.
    #[inline(always)]
    pub fn hold_far<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        level: f32,
        nearing: Nearing,
        gap: &[f32],
        earlier: &[f32],
    ) {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (gap, last_gap) = split::<S, R>(gap);
        let (earlier, last_earlier) = split::<S, R>(earlier);
        hold_far(simd, level, nearing, held, gap, earlier);
        hold_far(REST, level, nearing, last_held, last_gap, last_earlier);
    }

    /// Holds nodes above `level` that are lower than the lowest.
    #[inline(always)]
    pub fn hold_low<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        level: f32,
        lowest: f32,
        heights: &[f32],
    ) {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (heights, last_heights) = split::<S, R>(heights);
        hold_low(simd, level, lowest, held, heights);
        hold_low(REST, level, lowest, last_held, last_heights);
    }

    /// The gap, and of nodes that are held as much as they are held at.
    #[inline(always)]
    pub fn of<S: Simd, const R: usize>(&mut self, simd: S, gap: &[f32]) -> &[f32] {
        let (held, last_held) = split_mut::<S, R>(&mut self.0);
        let (gap, last_gap) = split::<S, R>(gap);
        raise(simd, held, gap);
        raise(REST, last_held, last_gap);
        &self.0
    }
}

#[inline(always)]
fn hold_far<S: Simd, const R: usize>(
    simd: S,
    level: f32,
    nearing: Nearing,
    held: &mut [[S::f32s; R]],
    gap: &[[S::f32s; R]],
    earlier: &[[S::f32s; R]],
) {
    let level = Lanes::all(simd, level);
    for ((held, gap), earlier) in held.iter_mut().zip(gap).zip(earlier) {
        let near = nearing.is_near(Lanes::of(simd, *gap), Lanes::of(simd, *earlier));
        *held = near.choose(Lanes::all(simd, f32::MIN), level).numbers();
    }
}

#[inline(always)]
fn hold_low<S: Simd, const R: usize>(
    simd: S,
    level: f32,
    lowest: f32,
    held: &mut [[S::f32s; R]],
    heights: &[[S::f32s; R]],
) {
    let level = Lanes::all(simd, level);
    for (held, height) in held.iter_mut().zip(heights) {
        let low = Lanes::of(simd, *height).is_below(Lanes::all(simd, lowest));
        *held = low.choose(level, Lanes::all(simd, f32::MIN)).numbers();
    }
}

#[inline(always)]
fn raise<S: Simd, const R: usize>(simd: S, held: &mut [[S::f32s; R]], gap: &[[S::f32s; R]]) {
    for (held, gap) in held.iter_mut().zip(gap) {
        let gap = Lanes::of(simd, *gap);
        *held = Lanes::of(simd, *held).max(gap).numbers();
    }
}
