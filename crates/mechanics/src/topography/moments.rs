//! Spectral moments of a periodic surface, and closed forms for a continuous spectrum.
//!
//! [`Moments`] are sums over the modes of a surface. [`Continuum`] gives Nayak's parameter and the
//! density of summits of a self-affine spectrum over continuous wavenumbers.

use std::f64::consts::{PI, TAU};

use rustfft::num_complex::Complex;

use super::surface::Surface;
use crate::fft::Transform;
use crate::grid::{Cell, Grid};

/// Spectral moments m_pq = Σ q_x^p q_y^q |ĥ(q)|², in units of length^(2 − p − q).
///
/// The sum is over all modes q = 2π (k_x/L_x, k_y/L_y) except the mean. Derivatives are those of
/// the trigonometric interpolant, so m20 + m02 is the mean square gradient without the bias of
/// finite differences. The exponents p and q are even, so that the sign of the Nyquist wavenumber
/// does not matter.
///
/// ```
/// use std::f64::consts::PI;
///
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::topography::moments::Moments;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // One wave of amplitude Δ: ⟨h²⟩ = Δ²/2, rms slope √2 π Δ/λ, α = 2.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 1 };
/// let moments = Moments::from_surface(&wave.draw(Grid::square(16, 1.0)?));
/// assert!((moments.m00 - 0.005).abs() < 1e-15);
/// assert!((moments.rms_slope() - 0.1 * PI * 2_f64.sqrt()).abs() < 1e-14);
/// assert!((moments.nayak().unwrap() - 2.0).abs() < 1e-12);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Mean square height ⟨h²⟩ about the mean.
    pub m00: f64,
    /// Mean square slope along x.
    pub m20: f64,
    /// Mean square slope along y.
    pub m02: f64,
    /// Mean square of the mixed second derivative, ⟨h_xy²⟩.
    pub m22: f64,
    /// Mean square second derivative along x.
    pub m40: f64,
    /// Mean square second derivative along y.
    pub m04: f64,
    /// Σ P_j² over pairs of modes ±k, in length⁴. The power P_j is the sum of |ĥ|² of both modes.
    pub squared_pair_power: f64,
}

impl Moments {
    /// Computes the moments of a surface from its discrete Fourier transform.
    pub fn from_surface(surface: &Surface) -> Self {
        let spectrum = Transform::new(surface.grid().nodes()).spectrum(surface.heights());
        Self::from_half_spectrum(&spectrum, surface.grid())
    }

    /// Computes the moments of a map from its half spectrum, which is not normalised.
    pub(super) fn from_half_spectrum(spectrum: &[Complex<f64>], grid: Grid) -> Self {
        let [nodes_x, nodes_y] = grid.nodes();
        let normalisation = 1.0 / (grid.count() as f64).powi(2);
        let mut sum = MomentSum::new(grid.cell());
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

    /// Returns the root mean square height about the mean, √m00.
    pub fn rms_height(&self) -> f64 {
        self.m00.sqrt()
    }

    /// Returns the rms slope √⟨|∇h|²⟩ = √(m20 + m02).
    pub fn rms_slope(&self) -> f64 {
        (self.m20 + self.m02).sqrt()
    }

    /// Returns m2 = (m20 + m02)/2, the mean square slope of a profile.
    pub fn second(&self) -> f64 {
        (self.m20 + self.m02) / 2.0
    }

    /// Returns m4 = (m40 + m04)/2, the mean square second derivative of a profile.
    pub fn fourth(&self) -> f64 {
        (self.m40 + self.m04) / 2.0
    }

    /// Returns Nayak's parameter α = m00 m4 / m2² (Nayak 1971), or `None` for a flat surface.
    pub fn nayak(&self) -> Option<f64> {
        let second = self.second();
        (second > 0.0).then(|| self.m00 * (self.fourth() / second) / second)
    }

    /// Returns the density of summits of an isotropic Gaussian surface, √3/(18π) m4/m2 (Nayak
    /// 1971).
    ///
    /// The unit is 1/length². The density of a flat surface is zero.
    pub fn summit_density(&self) -> f64 {
        let second = self.second();
        if second > 0.0 { 3_f64.sqrt() / (18.0 * PI) * self.fourth() / second } else { 0.0 }
    }

    /// Returns [`summit_density`](Self::summit_density) × (L/2π)², where L is the longer side of
    /// the cell.
    ///
    /// This is the density for integer wavenumbers, which Yastrebov, Anciaux & Molinari 2015
    /// tabulate.
    pub fn summit_density_integer(&self, cell: Cell) -> f64 {
        self.summit_density() * (cell.longer_side() / TAU).powi(2)
    }

    /// Returns the effective number of independent modes, (Σ P_j)²/Σ P_j², where P_j is the power
    /// of a pair of modes ±k.
    ///
    /// A sum of n waves of equal amplitude has n effective modes, a flat surface none. The larger
    /// the number, the better one surface represents its ensemble.
    pub fn effective_modes(&self) -> f64 {
        if self.squared_pair_power > 0.0 {
            self.m00 * (self.m00 / self.squared_pair_power)
        } else {
            0.0
        }
    }
}

/// Sums from which [`Moments`] are computed, over pairs of modes ±k with wavenumbers in units of
/// 2π/L.
#[derive(Debug, Clone, Copy)]
pub(super) struct MomentSum {
    cell: Cell,
    sums: Moments,
}

impl MomentSum {
    pub fn new(cell: Cell) -> Self {
        Self { cell, sums: Moments::default() }
    }

    /// Adds the pair of modes ±k with `waves` periods along x and y. `power` is the sum of both
    /// modes' |ĥ|².
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

    /// Returns the mean square gradient m20 + m02 of the modes added so far.
    pub fn square_slope(&self) -> f64 {
        (self.sums.m20 + self.sums.m02) * self.square_unit()
    }

    fn square_unit(&self) -> f64 {
        (TAU / self.cell.longer_side()).powi(2)
    }

    /// Returns the moments after multiplication of all heights by `scale`.
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

/// Iterates over the modes of a half spectrum, with the signed numbers of their periods.
pub(super) fn modes_mut(
    spectrum: &mut [Complex<f64>],
    [nodes_x, nodes_y]: [usize; 2],
) -> impl Iterator<Item = ([f64; 2], &mut Complex<f64>)> {
    let rows = spectrum.chunks_exact_mut(nodes_y / 2 + 1).enumerate();
    rows.flat_map(move |(i, row)| {
        let k_x = signed_wavenumber(i, nodes_x);
        row.iter_mut().enumerate().map(move |(k_y, value)| ([k_x, k_y as f64], value))
    })
}

/// Returns the signed number of waves along x of row `i` of a half spectrum with `nodes` rows.
///
/// It is positive at the Nyquist wavenumber.
pub(super) fn signed_wavenumber(i: usize, nodes: usize) -> f64 {
    if 2 * i <= nodes { i as f64 } else { i as f64 - nodes as f64 }
}

/// Returns the number of modes of the full spectrum that entry (i, k_y) of a half spectrum
/// represents.
///
/// In general it is two: k and −k. It is one if k and −k coincide on the mesh. It is zero for the
/// mean, and for entries whose opposite entry represents both modes.
pub(super) fn multiplicity(i: usize, k_y: usize, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    let alone = |index: usize, nodes: usize| index == 0 || 2 * index == nodes;
    match (alone(k_y, nodes_y), alone(i, nodes_x)) {
        (true, true) if (i, k_y) == (0, 0) => 0.0,
        (true, true) => 1.0,
        (true, false) if 2 * i > nodes_x => 0.0,
        _ => 2.0,
    }
}

/// Isotropic self-affine spectrum over continuous wavenumbers.
///
/// The density has a plateau from k_lower to k_rolloff and a power law from there to k_upper.
/// Nayak's parameter and the density of summits depend on the ratios of the cutoffs and on the
/// Hurst exponent (appendix A of Yastrebov, Anciaux & Molinari 2015). For the discrete modes of a
/// periodic cell, both differ from these values, most for small k_lower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Continuum {
    /// Hurst exponent, from 0 to 1 inclusive.
    pub hurst: f64,
    /// Ratio ξ = k_lower / k_rolloff, from 0 to 1; it is 1 without a plateau.
    pub plateau: f64,
    /// Magnification ζ = k_upper / k_rolloff, at least 1.
    pub magnification: f64,
}

impl Continuum {
    /// Returns Nayak's parameter α = m0 m4 / m2², at least 3/2.
    pub fn nayak(&self) -> f64 {
        if self.is_ring() {
            return 1.5;
        }
        1.5 * self.moment(0.0) * self.moment(4.0) / self.moment(2.0).powi(2)
    }

    /// Returns the density of summits D = √3/(18π) m4/m2.
    ///
    /// If `k_rolloff` is an angular wavenumber, D is the number of summits per unit area. If it is
    /// an integer wavenumber, D is the number of summits in the cell divided by (2π)², the value
    /// that Yastrebov, Anciaux & Molinari 2015 tabulate.
    pub fn summit_density(&self, k_rolloff: f64) -> f64 {
        let ratio = if self.is_ring() { 1.0 } else { self.moment(4.0) / self.moment(2.0) };
        3_f64.sqrt() / (24.0 * PI) * k_rolloff * k_rolloff * ratio
    }

    /// Returns whether the spectrum is a ring of a single wavenumber. All moments are then zero,
    /// but their ratios have limits.
    fn is_ring(&self) -> bool {
        self.plateau == 1.0 && self.magnification == 1.0
    }

    /// Returns ∫ Φ(k) k^(`order` + 1) dk, where Φ is the spectral density, 1 at the plateau, and k
    /// is in units of k_rolloff.
    fn moment(&self, order: f64) -> f64 {
        let plateau = -libm::expm1((order + 2.0) * libm::log(self.plateau)) / (order + 2.0);
        let log_magnification = libm::log(self.magnification);
        let exponent = (order - 2.0 * self.hurst) * log_magnification;
        // The integral is a logarithm for m0 at H = 0 and for m2 at H = 1.
        let decay = if exponent == 0.0 {
            log_magnification
        } else {
            log_magnification * libm::expm1(exponent) / exponent
        };
        plateau + decay
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{cell, rectangle, square};
    use crate::topography::shapes::Shape;

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
            let power = Moments::from_surface(&surface).m00;
            assert!((power - variance).abs() < 1e-15, "{nodes}: {power} {variance}");
        }
    }

    #[test]
    fn moments_of_a_wave_are_powers_of_its_wavenumber() {
        // Eight waves are at the Nyquist wavenumber, where the cosine is ±1 on the nodes.
        for (waves, mean_square) in [(1, 0.5), (5, 0.5), (8, 1.0)] {
            let amplitude = 0.1;
            let moments =
                Moments::from_surface(&Shape::Wave { amplitude, waves }.draw(square(16, 2.0)));
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
            let moments =
                Moments::from_surface(&Shape::WaveProduct { amplitude, waves }.draw(grid));
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
        // cos·cos is the sum of waves along (1, 1) and (1, −1); cos + cos has waves along the axes.
        for shape in [Shape::WaveProduct { amplitude, waves }, Shape::WaveSum { amplitude, waves }]
        {
            let moments = Moments::from_surface(&shape.draw(square(16, 1.0)));
            assert_close(moments.effective_modes(), 2.0);
            // All modes have the same |q|: m2 is half the square slope. For waves along the axes,
            // m4 is half the square curvature, for waves along the diagonals a quarter.
            let diagonal = matches!(shape, Shape::WaveProduct { .. });
            assert_close(moments.nayak().unwrap(), if diagonal { 1.0 } else { 2.0 });
        }
    }

    #[test]
    fn transposing_the_heights_swaps_the_axes() {
        let surface = rough(9, 1.5);
        let transposed = (0..81).map(|node| surface.heights()[node % 9 * 9 + node / 9]);
        let swapped =
            Moments::from_surface(&Surface::new(square(9, 1.5), transposed.collect()).unwrap());
        let moments = Moments::from_surface(&surface);
        assert_close(moments.m20, swapped.m02);
        assert_close(moments.m40, swapped.m04);
        assert_close(moments.m22, swapped.m22);
        assert!((moments.m20 / moments.m02 - 1.0).abs() > 1e-3);
    }

    #[test]
    fn units_of_length_scale_moments_and_leave_ratios_alone() {
        let surface = rough(12, 1.0);
        let scaled = surface.heights().iter().map(|height| 3.0 * height).collect();
        let scaled = Moments::from_surface(&Surface::new(square(12, 3.0), scaled).unwrap());
        let moments = Moments::from_surface(&surface);
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

    fn self_affine(hurst: f64, magnification: f64) -> Continuum {
        Continuum { hurst, plateau: 1.0, magnification }
    }

    /// Returns the density of summits divided by the density for a ring of the single wavenumber
    /// k_rolloff.
    fn relative_density(continuum: Continuum) -> f64 {
        continuum.summit_density(1.0) / (3_f64.sqrt() / (24.0 * PI))
    }

    #[test]
    fn hurst_exponents_of_zero_one_half_and_one_have_closed_forms() {
        for z in [1.5, 8.0, 32.0, 512.0] {
            let (square, log) = (z * z, f64::ln(z));
            let zero = self_affine(0.0, z);
            assert_close(zero.nayak(), 1.5 * log * (square + 1.0) / (square - 1.0));
            assert_close(relative_density(zero), (square + 1.0) / 2.0);
            let half = self_affine(0.5, z);
            assert_close(half.nayak(), (square + z + 1.0) / (2.0 * z));
            assert_close(relative_density(half), (square + z + 1.0) / 3.0);
            let one = self_affine(1.0, z);
            let nayak = 0.375 * (square - 1.0).powi(2) / (square * log * log);
            assert_close(one.nayak(), nayak);
            assert_close(relative_density(one), (square - 1.0) / (2.0 * log));
        }
    }

    #[test]
    fn the_limits_in_the_hurst_exponent_are_continuous() {
        for limit in [0.0, 1.0] {
            let nearby = self_affine((limit - 1e-14_f64).abs(), 32.0);
            assert_close(nearby.nayak(), self_affine(limit, 32.0).nayak());
        }
    }

    #[test]
    fn a_single_wavelength_has_the_smallest_nayak_parameter() {
        let ring = self_affine(0.8, 1.0);
        assert_eq!(ring.nayak(), 1.5);
        assert_eq!(relative_density(ring), 1.0);
        // α − 3/2 = (ζ − 1)²/2 is below the rounding of one.
        let thin = self_affine(0.8, 1.0 + 1e-8);
        assert_close(thin.nayak(), 1.5);
        assert!((relative_density(thin) - 1.0).abs() < 1e-7);
        assert!((self_affine(0.8, 1.001).nayak() - 1.5 - 0.5e-6).abs() < 1e-9);
    }

    #[test]
    fn a_plateau_alone_goes_from_three_halves_to_two() {
        let disc = |plateau: f64| Continuum { hurst: 0.8, plateau, magnification: 1.0 };
        for x in [0.9, 0.5, 0.1] {
            let six = 1.0 - f64::powi(x, 6);
            let four = 1.0 - f64::powi(x, 4);
            assert_close(disc(x).nayak(), 2.0 * (1.0 - x * x) * six / (four * four));
            assert_close(relative_density(disc(x)), 2.0 / 3.0 * six / four);
        }
        assert_close(disc(0.0).nayak(), 2.0);
    }

    #[test]
    fn nayak_parameter_grows_as_the_magnification_to_twice_the_hurst_exponent() {
        let hurst: f64 = 0.3;
        let prefactor = 3.0 * (1.0 - hurst).powi(2) / (2.0 * hurst * (2.0 - hurst));
        let z: f64 = 1e30;
        let found = self_affine(hurst, z).nayak() / z.powf(2.0 * hurst);
        // Corrections are of relative order ζ^(−2H) = 1e-18.
        assert_close(found, prefactor);
    }

    #[test]
    fn published_table_is_reproduced_to_its_last_digit() {
        // (hurst, k_lower, k_upper, α, D) from the analytical tables of Yastrebov, Anciaux &
        // Molinari 2015.
        let cells = [
            (0.3, 1.0, 16.0, 6.43, 2.47),
            (0.3, 1.0, 512.0, 59.43, 2480.04),
            (0.3, 8.0, 64.0, 4.00, 40.94),
            (0.8, 1.0, 32.0, 28.33, 5.23),
            (0.8, 4.0, 64.0, 11.60, 23.37),
            (0.8, 1.0, 512.0, 1604.91, 1093.87),
            (0.8, 32.0, 64.0, 1.76, 52.49),
        ];
        for (hurst, k_lower, k_upper, nayak, density) in cells {
            let continuum = self_affine(hurst, k_upper / k_lower);
            assert!((continuum.nayak() - nayak).abs() < 0.00501);
            assert!((continuum.summit_density(k_lower) - density).abs() < 0.00501);
        }
    }
}
