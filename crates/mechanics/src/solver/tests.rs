//! Helpers for the tests of the solver, and contacts that independent code has solved to rounding:
//! on rectangles, with free boundaries, and of materials that yield.

use super::*;
use crate::elasticity::{self, Factor, PeriodicHalfSpace};
use crate::fft::Transform;
use crate::grid::Grid;
use crate::grid::samples::{rectangle, square};
use crate::reduced::samples::on;
use crate::topography::moments::Moments;
use crate::topography::surface::Surface;

mod closed_forms;
mod hardness;
mod invariants;
mod layers;
mod loads;
mod prescribed;
mod stiffness;

/// Accuracy of double precision on the meshes used here.
const TIGHT: Settings = Settings { tolerance: 1e-12, pair_limit: 4000 };

fn map(nodes: usize, height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let place = |index: usize| index as f64 / nodes as f64;
    (0..nodes * nodes).map(|node| height(place(node / nodes), place(node % nodes))).collect()
}

/// Returns the solver of a square surface on a periodic half-space.
pub(crate) fn solver(nodes: usize, heights: &[f64]) -> Solver {
    Solver::new(PeriodicHalfSpace::new(square(nodes, 1.0)), &on(square(nodes, 1.0), heights))
}

fn press(solver: &mut Solver, load: f64, settings: &Settings) -> Outcome {
    solver.press(load, settings, &|| false)
}

fn solved(solver: &mut Solver, load: f64) -> Outcome {
    let outcome = press(solver, load, &TIGHT);
    assert_eq!(outcome.stop, Stop::Converged, "{outcome:?}");
    outcome
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns heights in units of rms slope × longer side.
fn reduced(surface: &Surface) -> Vec<f64> {
    let unit = Moments::from_surface(surface).rms_slope() * surface.grid().cell().longer_side();
    surface.heights().iter().map(|h| h / unit).collect()
}

/// Returns the heights of white noise, whose spectrum is flat up to the Nyquist wavenumber.
fn noise(nodes: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let slope = 2.0 * nodes as f64;
    (0..nodes * nodes).map(|_| (draw() + draw() + draw()) / slope).collect()
}

/// Returns white noise, convolved with the displacement kernel. This is a self-affine surface whose
/// longest wavelength is the side of the cell.
pub(crate) fn rough(nodes: usize, seed: u64) -> Vec<f64> {
    let transform = Transform::<f64>::new([nodes; 2]);
    let mut heights = vec![0.0; nodes * nodes];
    let kernel = elasticity::kernel(
        &Threads::one(),
        &PeriodicHalfSpace::new(square(nodes, 1.0)),
        Factor::Displacement,
    );
    transform.convolve(&kernel, &noise(nodes, seed), &mut heights, &mut transform.scratch());
    heights.iter().map(|height| height * nodes as f64).collect()
}

/// Computes displacement − height directly from the kernel, and subtracts its mean over the elastic
/// contact nodes or, if there are none, its maximum over the saturated nodes.
fn gap(solver: &Solver, heights: &[f64]) -> Vec<f64> {
    let transform = elasticity::transform::<f64>(&*solver.problem.body);
    let mut gap = vec![0.0; heights.len()];
    let kernel = elasticity::kernel(&Threads::one(), &*solver.problem.body, Factor::Displacement);
    transform.convolve(&kernel, solver.pressure(), &mut gap, &mut transform.scratch());
    gap.iter_mut().zip(heights).for_each(|(gap, height)| *gap -= height);
    let of = |chosen: &dyn Fn(f64) -> bool| -> Vec<f64> {
        let nodes = gap.iter().zip(solver.pressure());
        nodes.filter(|(_, p)| chosen(**p)).map(|(gap, _)| *gap).collect()
    };
    let elastic = of(&|p| p > 0.0 && p < solver.inner.ceiling());
    // Without elastic nodes, the highest saturated node must be below all others.
    let saturated = of(&|p| p >= solver.inner.ceiling());
    let offset = if elastic.is_empty() {
        saturated.into_iter().fold(f64::MIN, f64::max)
    } else {
        mean(&elastic)
    };
    gap.iter().map(|gap| gap - offset).collect()
}

fn assert_complementary(solver: &Solver, heights: &[f64], load: f64, tolerance: f64) {
    // Row by row, because equal terms in a long sum would all be rounded the same way.
    let rows = solver.pressure().chunks_exact(solver.inner.mesh.nodes[1]);
    let total: f64 = rows.map(|row| row.iter().sum::<f64>()).sum();
    assert!((total / solver.pressure().len() as f64 / load - 1.0).abs() < 1e-12);
    let violation = violation(solver, heights);
    assert!(violation <= tolerance, "{violation} > {tolerance}");
}

/// Computes the largest violation of the contact conditions by the stored pressures, in the units
/// of [`Outcome::residual`], with [`gap`].
fn violation(solver: &Solver, heights: &[f64]) -> f64 {
    let hardness = solver.inner.ceiling();
    let nodes = solver.pressure().iter().zip(gap(solver, heights));
    let violations = nodes.map(|(p, gap)| {
        assert!((0.0..=hardness).contains(p));
        match *p {
            0.0 => -gap,
            p if p == hardness => gap,
            _ => gap.abs(),
        }
    });
    solver.inner.mesh.steps_per_side * violations.fold(0.0, f64::max)
}

/// Solves the contact at the default tolerance, and checks the outcome against the stored
/// pressures.
fn assert_outcome(solver: &mut Solver, heights: &[f64], load: f64) -> Outcome {
    assert_outcome_at(&Settings::default(), solver, heights, load)
}

fn assert_outcome_at(
    settings: &Settings,
    solver: &mut Solver,
    heights: &[f64],
    load: f64,
) -> Outcome {
    let outcome = press(solver, load, settings);
    let range = heights.iter().fold(0.0_f64, |range, h| range.max(h.abs()));
    let rounding = 1e-13 * solver.inner.mesh.steps_per_side * range;
    let tolerance = match outcome.stop {
        Stop::Converged | Stop::FullContact => settings.tolerance,
        // Without convergence the outcome is known in single precision only.
        _ => outcome.residual + f64::from(f32::EPSILON) * solver.inner.mesh.steps_per_side * range,
    };
    assert_complementary(solver, heights, load, 1.02 * tolerance + rounding);
    let violation = violation(solver, heights);
    let error = (violation - outcome.residual).abs();
    assert!(error <= 0.02 * tolerance + rounding, "{violation}, {outcome:?}");
    outcome
}

/// Folder of surfaces in `tests/data`, and the table of their solutions.
struct Reference {
    folder: &'static str,
    table: &'static str,
}

const RECTANGULAR_AND_FREE: Reference =
    Reference { folder: "rectangular-and-free", table: "rectangular_and_free.csv" };

const HARDNESS: Reference = Reference { folder: "hardness", table: "hardness.csv" };

/// Row of the reference table, for one load on one surface.
struct Solved(Vec<String>);

impl Solved {
    pub fn number(&self, column: usize) -> f64 {
        self.0[column].parse().unwrap()
    }

    pub fn count(&self, column: usize) -> usize {
        self.0[column].parse().unwrap()
    }
}

impl Reference {
    fn file(&self, name: &str) -> Vec<u8> {
        let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
        std::fs::read(format!("{data}/{}/{name}", self.folder)).unwrap()
    }

    pub fn solved(&self, surface: &str) -> Vec<Solved> {
        let csv = String::from_utf8(self.file(self.table)).unwrap();
        let rows = csv.lines().map(|line| line.split(',').map(str::to_owned));
        let rows = rows.map(|row| Solved(row.collect()));
        rows.filter(|row| row.0[0] == surface).collect()
    }

    pub fn heights(&self, surface: &str, size: [f64; 2]) -> Surface {
        let (nodes, heights) = npy_array(&self.file(&format!("{surface}.npy")));
        Surface::new(rectangle(nodes, size), heights).unwrap()
    }

    /// Reads one map of booleans for each load from the file `{surface}_{ending}.npy`, in which
    /// NumPy packed them with the most significant bit first.
    pub fn maps(&self, surface: &str, ending: &str, grid: Grid) -> Vec<Vec<bool>> {
        let bytes = self.file(&format!("{surface}_{ending}.npy"));
        let bits = |byte: &u8| (0..8).rev().map(|bit| byte >> bit & 1 == 1).collect::<Vec<_>>();
        // The header of a small array fills 128 bytes.
        let maps = bytes[128..].chunks(grid.count().div_ceil(8));
        maps.map(|map| map.iter().flat_map(bits).collect()).collect()
    }
}

/// Reads a two-dimensional array of doubles from a NumPy file. Returns its shape, and its values
/// row by row.
pub(crate) fn npy_array(bytes: &[u8]) -> ([usize; 2], Vec<f64>) {
    let (header, data) = bytes.split_at(128);
    let header = String::from_utf8_lossy(&header[10..]);
    let shape = header.split(['(', ')']).nth(1).unwrap().split(", ");
    let shape: Vec<usize> = shape.map(|side| side.parse().unwrap()).collect();
    let numbers = data.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
    (shape.try_into().unwrap(), numbers.collect())
}
