//! Spectral moments of a periodic surface, and the statistics that are ratios of them.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Cell, Grid};

/// Moments of the power spectrum, m_pq = Σ q_x^p q_y^q |ĥ(q)|² over all modes
/// q = 2π (k_x/L_x, k_y/L_y) but the mean; m_pq has the unit of length^(2 − p − q).
///
/// Derivatives are those of the trigonometric interpolant: m20 + m02 is the mean square gradient
/// without the bias of finite differences. All moments here are even, so that the ambiguous sign
/// of the Nyquist wavenumber does not matter.
///
/// ```
/// use std::f64::consts::PI;
///
/// use asperity_contact::grid::Grid;
/// use asperity_contact::topography::moments::Moments;
/// use asperity_contact::topography::shapes::Shape;
///
/// // One wave of amplitude Δ: ⟨h²⟩ = Δ²/2, rms slope √2 π Δ/λ, α = 2.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 };
/// let moments = Moments::of(&wave.draw(Grid::square(16, 1.0)?));
/// assert!((moments.m00 - 0.005).abs() < 1e-15);
/// assert!((moments.rms_slope() - 0.1 * PI * 2_f64.sqrt()).abs() < 1e-14);
/// assert!((moments.nayak().unwrap() - 2.0).abs() < 1e-12);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Mean square height ⟨h²⟩ about the mean.
    pub m00: f64,
    /// Mean square slope along x.
    pub m20: f64,
    /// Mean square slope along y.
    pub m02: f64,
    /// Mean square of the mixed second derivative.
    pub m22: f64,
    /// Mean square second derivative along x.
    pub m40: f64,
    /// Mean square second derivative along y.
    pub m04: f64,
    /// Σ P_j² over pairs of modes ±k, P_j being the power of a pair; length⁴.
    pub squared_pair_power: f64,
}

impl Moments {
    /// Moments of the heights on their mesh, through their discrete Fourier transform.
    pub fn of(surface: &Surface) -> Self {
        let transform = Transform::new(surface.grid().nodes());
        let mut spectrum = vec![Complex::default(); transform.spectrum_len()];
        transform.forward(surface.heights(), &mut spectrum, &mut transform.scratch());
        Self::of_spectrum(&spectrum, surface.grid())
    }

    /// Moments of an unnormalised half spectrum.
    pub(super) fn of_spectrum(spectrum: &[Complex<f64>], grid: Grid) -> Self {
        let [nodes_x, nodes_y] = grid.nodes();
        let normalisation = 1.0 / (grid.count() as f64).powi(2);
        let mut sum = MomentSum::on(grid.cell());
        for (i, row) in spectrum.chunks_exact(nodes_y / 2 + 1).enumerate() {
            let k_x = signed_wavenumber(i, nodes_x);
            for (k_y, value) in row.iter().enumerate() {
                let multiplicity = multiplicity(i, k_y, grid.nodes());
                if multiplicity > 0.0 {
                    let power = multiplicity * value.norm_sqr() * normalisation;
                    sum.add_pair([k_x, k_y as f64], power);
                }
            }
        }
        sum.finish(1.0)
    }

    /// Root mean square height about the mean.
    pub fn rms_height(&self) -> f64 {
        self.m00.sqrt()
    }

    /// Root mean square gradient √⟨|∇h|²⟩ = √(m20 + m02).
    pub fn rms_slope(&self) -> f64 {
        (self.m20 + self.m02).sqrt()
    }

    /// m2 = (m20 + m02)/2, the mean square slope of an average profile.
    pub fn second(&self) -> f64 {
        (self.m20 + self.m02) / 2.0
    }

    /// m4 = (m40 + m04)/2, the mean square second derivative of an average profile.
    pub fn fourth(&self) -> f64 {
        (self.m40 + self.m04) / 2.0
    }

    /// Nayak's parameter α = m00 m4 / m2² (Nayak 1971); none for a flat surface.
    pub fn nayak(&self) -> Option<f64> {
        let second = self.second();
        (second > 0.0).then(|| self.m00 * (self.fourth() / second) / second)
    }

    /// Summits per unit area of an isotropic Gaussian surface, √3/(18π) m4/m2 (Nayak 1971); zero
    /// for a flat one.
    pub fn summit_density(&self) -> f64 {
        let second = self.second();
        if second > 0.0 { 3_f64.sqrt() / (18.0 * PI) * self.fourth() / second } else { 0.0 }
    }

    /// Summit density in integer wavenumbers, as the paper tabulates it: summits per (L/2π)², L
    /// being the longer side of the cell.
    pub fn summit_density_integer(&self, cell: Cell) -> f64 {
        self.summit_density() * (cell.longer_side() / TAU).powi(2)
    }

    /// Effective number of independent modes, (Σ P_j)²/Σ P_j² over pairs ±k; zero for a flat
    /// surface.
    ///
    /// How far one surface represents its ensemble: a sum of n waves of equal amplitude has n.
    pub fn effective_modes(&self) -> f64 {
        if self.squared_pair_power > 0.0 {
            self.m00 * (self.m00 / self.squared_pair_power)
        } else {
            0.0
        }
    }
}

/// Running sums over pairs of modes ±k, in wavenumbers of the longer side.
#[derive(Debug, Clone, Copy)]
pub(super) struct MomentSum {
    cell: Cell,
    sums: Moments,
}

impl MomentSum {
    /// No mode so far.
    pub fn on(cell: Cell) -> Self {
        Self { cell, sums: Moments::default() }
    }

    /// Adds a pair of modes of ± so many waves along x and y; `power` is that of both together.
    pub fn add_pair(&mut self, waves: [f64; 2], power: f64) {
        let [x, y] = self.cell.wavevector(waves).map(|k| k * k);
        let sums = &mut self.sums;
        sums.m00 += power;
        sums.m20 += x * power;
        sums.m02 += y * power;
        sums.m22 += x * y * power;
        sums.m40 += x * x * power;
        sums.m04 += y * y * power;
        sums.squared_pair_power += power * power;
    }

    /// Mean square gradient so far.
    pub fn square_slope(&self) -> f64 {
        (self.sums.m20 + self.sums.m02) * self.square_unit()
    }

    fn square_unit(&self) -> f64 {
        (TAU / self.cell.longer_side()).powi(2)
    }

    /// The moments, heights multiplied by `scale`.
    pub fn finish(self, scale: f64) -> Moments {
        let square = self.square_unit();
        let power = scale * scale;
        let sums = self.sums;
        Moments {
            m00: power * sums.m00,
            m20: power * square * sums.m20,
            m02: power * square * sums.m02,
            m22: power * square * square * sums.m22,
            m40: power * square * square * sums.m40,
            m04: power * square * square * sums.m04,
            squared_pair_power: power * power * sums.squared_pair_power,
        }
    }
}

/// Wavenumber along x of row `i` of a half spectrum; positive at Nyquist.
pub(super) fn signed_wavenumber(i: usize, nodes: usize) -> f64 {
    if 2 * i <= nodes { i as f64 } else { i as f64 - nodes as f64 }
}

/// How many modes of the full spectrum entry (i, k_y) stands for: two, but one where k and −k
/// coincide on the mesh, and none for the mean and where −k has an entry of its own that counts.
pub(super) fn multiplicity(i: usize, k_y: usize, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    let alone = |index: usize, nodes: usize| index == 0 || 2 * index == nodes;
    match (alone(k_y, nodes_y), alone(i, nodes_x)) {
        (true, true) if (i, k_y) == (0, 0) => 0.0,
        (true, true) => 1.0,
        (true, false) if 2 * i > nodes_x => 0.0,
        _ => 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{cell, rectangle, square};
    use crate::topography::shapes::Shape;

    /// Heights without any symmetry.
    fn rough(nodes: usize, side: f64) -> Surface {
        let height = |node| libm::sin(7.0 + (node * node) as f64);
        Surface::new(square(nodes, side), (0..nodes * nodes).map(height).collect()).unwrap()
    }

    fn assert_close(found: f64, exact: f64) {
        assert!((found - exact).abs() < 1e-12 * exact.abs(), "{found} should be {exact}");
    }

    #[test]
    fn power_in_all_modes_is_the_variance_of_the_heights() {
        for nodes in [1, 2, 3, 8, 15] {
            let surface = rough(nodes, 1.0);
            let count = surface.heights().len() as f64;
            let mean = surface.heights().iter().sum::<f64>() / count;
            let square = |height: &f64| (height - mean).powi(2);
            let variance = surface.heights().iter().map(square).sum::<f64>() / count;
            let power = Moments::of(&surface).m00;
            assert!((power - variance).abs() < 1e-15, "{nodes}: {power} {variance}");
        }
    }

    #[test]
    fn moments_of_a_wave_are_powers_of_its_wavenumber() {
        // The last one is at the Nyquist wavenumber, where the cosine is ±1 on the nodes.
        for (waves, mean_square) in [(1, 0.5), (5, 0.5), (8, 1.0)] {
            let amplitude = 0.1;
            let moments = Moments::of(&Shape::Wave { amplitude, waves }.draw(square(16, 2.0)));
            let q = TAU * f64::from(waves) / 2.0;
            let power = mean_square * amplitude * amplitude;
            assert_close(moments.m00, power);
            assert_close(moments.m20, q.powi(2) * power);
            assert_close(moments.m40, q.powi(4) * power);
            assert_close(moments.effective_modes(), 1.0);
            assert!(moments.m02.max(moments.m04).max(moments.m22) < 1e-25);
        }
    }

    #[test]
    fn waves_of_a_rectangle_have_the_wavenumbers_of_its_sides() {
        for (nodes, size) in [([16, 10], [2.0, 0.5]), ([9, 32], [0.3, 4.0])] {
            let grid = rectangle(nodes, size);
            let (amplitude, waves) = (0.1, 3);
            let moments = Moments::of(&Shape::WaveProduct { amplitude, waves }.draw(grid));
            let [q_x, q_y] = size.map(|side| TAU * 3.0 / side);
            let power = amplitude * amplitude / 4.0;
            assert_close(moments.m20, q_x.powi(2) * power);
            assert_close(moments.m02, q_y.powi(2) * power);
            assert_close(moments.m40, q_x.powi(4) * power);
            assert_close(moments.m04, q_y.powi(4) * power);
            assert_close(moments.m22, (q_x * q_y).powi(2) * power);
        }
    }

    #[test]
    fn equal_waves_count_as_many_modes_as_there_are() {
        let (amplitude, waves) = (0.1, 3);
        // cos·cos is the sum of waves along (1, 1) and (1, −1), cos + cos along the axes.
        for shape in [Shape::WaveProduct { amplitude, waves }, Shape::WaveSum { amplitude, waves }]
        {
            let moments = Moments::of(&shape.draw(square(16, 1.0)));
            assert_close(moments.effective_modes(), 2.0);
            // All modes on one circle: m2 and m4 are half the square slope and, along the axes,
            // half the square curvature, along the diagonals a quarter.
            let diagonal = matches!(shape, Shape::WaveProduct { .. });
            assert_close(moments.nayak().unwrap(), if diagonal { 1.0 } else { 2.0 });
        }
    }

    #[test]
    fn transposing_the_heights_swaps_the_axes() {
        let surface = rough(9, 1.5);
        let transposed = (0..81).map(|node| surface.heights()[node % 9 * 9 + node / 9]);
        let swapped = Moments::of(&Surface::new(square(9, 1.5), transposed.collect()).unwrap());
        let moments = Moments::of(&surface);
        assert_close(moments.m20, swapped.m02);
        assert_close(moments.m40, swapped.m04);
        assert_close(moments.m22, swapped.m22);
        assert!((moments.m20 / moments.m02 - 1.0).abs() > 1e-3);
    }

    #[test]
    fn units_of_length_scale_moments_and_leave_ratios_alone() {
        let surface = rough(12, 1.0);
        let scaled = surface.heights().iter().map(|height| 3.0 * height).collect();
        let scaled = Moments::of(&Surface::new(square(12, 3.0), scaled).unwrap());
        let moments = Moments::of(&surface);
        assert_close(scaled.rms_height(), 3.0 * moments.rms_height());
        assert_close(scaled.rms_slope(), moments.rms_slope());
        assert_close(scaled.fourth(), moments.fourth() / 9.0);
        assert_close(scaled.nayak().unwrap(), moments.nayak().unwrap());
        assert_close(scaled.summit_density(), moments.summit_density() / 9.0);
        let integer = moments.summit_density_integer(cell(1.0));
        assert_close(scaled.summit_density_integer(cell(3.0)), integer);
        assert_close(moments.summit_density(), 4.0 * PI * PI * integer);
    }

    #[test]
    fn a_flat_surface_has_no_nayak_parameter_and_no_summits() {
        let flat = Moments::default();
        assert_eq!(flat.nayak(), None);
        assert_eq!(flat.summit_density(), 0.0);
        assert_eq!(flat.effective_modes(), 0.0);
    }
}
