//! Power spectral density of a self-affine surface, isotropic or anisotropic, and its modes.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::{Range, RangeInclusive};

use serde::{Deserialize, Serialize};

use super::moments::{Continuum, MomentSum, Moments};
use crate::grid::Cell;

/// Power spectral density of a self-affine surface, the equation "PSD" of Yastrebov, Anciaux &
/// Molinari 2015.
///
/// The density is constant for `k_lower ≤ |k| < k_rolloff`, proportional to `|k|^(−2(1 + hurst))`
/// for `k_rolloff ≤ |k| ≤ k_upper`, and zero elsewhere. Modes at both cutoffs belong to the
/// spectrum. This choice reproduces the Nayak parameters that the paper tabulates. Wavenumbers are
/// in units of 2π/L, where L is the longer side of the cell, and `1 ≤ k_lower ≤ k_rolloff ≤
/// k_upper`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spectrum {
    /// Hurst exponent, between 0 and 1.
    pub hurst: f64,
    /// Lower cutoff, in units of 2π/L.
    pub k_lower: u32,
    /// Roll-off wavenumber at the end of the plateau, in units of 2π/L. It is equal to `k_lower`
    /// without a plateau.
    pub k_rolloff: u32,
    /// Upper cutoff, in units of 2π/L.
    pub k_upper: u32,
    /// Anisotropy of the surface, or `None` for an isotropic surface.
    ///
    /// For an anisotropic surface, `k_lower`, `k_rolloff` and `k_upper` are wavenumbers across the
    /// grain.
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    pub anisotropy: Option<Anisotropy>,
}

/// Cache of [`Spectrum::density`] for integer values of |k|².
///
/// A mesh has many more modes than values of |k|², and `pow` takes longer than drawing a mode.
#[derive(Debug, Clone)]
pub struct Densities {
    spectrum: Spectrum,
    /// Densities, indexed by |k|². NaN stands for a density that is not computed yet.
    cached: Vec<f64>,
}

/// Largest |k|² in the cache. It limits the cache to 8 MiB.
const MAX_CACHED: u32 = 1 << 20;

impl Densities {
    /// Returns [`Spectrum::density`] at |k|² = `k_squared`, and stores it in the cache if |k|² is
    /// an integer.
    pub fn at(&mut self, k_squared: f64) -> f64 {
        let whole = (k_squared.fract() == 0.0).then_some(k_squared as usize);
        let Some(cached) = whole.and_then(|whole| self.cached.get_mut(whole)) else {
            return self.spectrum.density(k_squared);
        };
        if cached.is_nan() {
            *cached = self.spectrum.density(k_squared);
        }
        *cached
    }
}

/// Modes with one `k_x` and consecutive `k_y`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeRow {
    /// Signed number of periods of the modes along x.
    pub k_x: i32,
    /// Range of the numbers of periods of the modes along y.
    pub k_y: RangeInclusive<u32>,
}

impl Spectrum {
    /// Returns the density at `|k|² = k_squared`, in units of the density of the plateau.
    ///
    /// `k_squared` must be from `k_lower²` to `k_upper²`.
    pub fn density(&self, k_squared: f64) -> f64 {
        let rolloff_squared = square(self.k_rolloff);
        if k_squared < rolloff_squared {
            return 1.0;
        }
        let ratio = k_squared / rolloff_squared;
        libm::pow(ratio, -(1.0 + self.hurst))
    }

    /// Returns an empty cache for [`density`](Self::density).
    pub fn densities(&self) -> Densities {
        let lengths = square(self.k_upper).min(MAX_CACHED as f64) as usize + 1;
        Densities { spectrum: *self, cached: vec![f64::NAN; lengths] }
    }

    /// Returns the quadratic form |k′|² of wavevectors k. The spectral density at k is
    /// [`density`](Self::density)(|k′|²).
    pub(super) fn square_length(&self) -> SquareLength {
        let stretched = self.anisotropy.map(|grain| grain.square_length());
        stretched.unwrap_or(SquareLength::ISOTROPIC)
    }

    /// Iterates over one mode of each pair ±k of the spectrum in a cell.
    ///
    /// These are the modes with k_y > 0, and those with k_y = 0 and k_x > 0. They are in ascending
    /// order of k_x, then of k_y.
    pub fn rows(&self, cell: Cell) -> impl Iterator<Item = ModeRow> + use<> {
        let (lower, upper) = (square(self.k_lower), square(self.k_upper));
        let [max_x, max_y] = self.max_waves(cell);
        // On a square this is exact: wavenumbers are integers, and their squares far below 2⁵³.
        let square_length = self.square_length();
        let k_squared =
            move |k_x: i32, k_y: u32| square_length.at(cell.wavevector([k_x.into(), k_y.into()]));
        let has_grain = self.anisotropy.is_some();
        (-(max_x as i32)..=max_x as i32).flat_map(move |k_x| {
            let k_y = u32::from(k_x <= 0)..max_y + 1;
            let rows = if has_grain {
                // |k′|² may decrease with k_y, and a row may cross the annulus of modes twice.
                runs(k_y, |k_y| (lower..=upper).contains(&k_squared(k_x, k_y)))
            } else {
                let first = partition_point(k_y.clone(), |k_y| k_squared(k_x, k_y) < lower);
                let rest = first..k_y.end;
                let end = partition_point(rest, |k_y| k_squared(k_x, k_y) <= upper);
                Vec::from_iter((first < end).then(|| first..=end - 1))
            };
            rows.into_iter().map(move |k_y| ModeRow { k_x, k_y })
        })
    }

    /// Returns the maximum numbers of waves along x and y over all modes of a cell.
    pub fn max_waves(&self, cell: Cell) -> [u32; 2] {
        // The numbers are at most `k_upper`, because `aspect` is at least one.
        let aspect = cell.aspect();
        let Some(_) = self.anisotropy else {
            return aspect.map(|aspect| (f64::from(self.k_upper) / aspect) as u32);
        };
        let most = self.square_length().unit_extents();
        // The margin keeps modes on the cutoff if rounding makes the product too small.
        let waves = |axis: usize| f64::from(self.k_upper) * most[axis] / aspect[axis];
        [waves(0), waves(1)].map(|waves| (waves * (1.0 + 1e-12)) as u32)
    }

    /// Returns the spectral moments over the modes of a cell, up to a common factor.
    ///
    /// Each mode has its expected power. Nayak's parameter differs from the value of
    /// [`Spectrum::continuum`], because a cell has few modes near `k_lower`. With `k_lower = 1` it
    /// is larger by about a half.
    ///
    /// ```
    /// use asperity_mechanics::grid::Cell;
    /// use asperity_mechanics::topography::spectrum::Spectrum;
    ///
    /// let (hurst, k_lower, k_upper) = (0.8, 1, 32);
    /// let spectrum = Spectrum { hurst, k_lower, k_rolloff: 1, k_upper, anisotropy: None };
    /// let nayak = spectrum.moments(Cell::square(1.0)?).nayak().unwrap();
    /// assert!((nayak - 43.91).abs() < 0.005);
    /// assert!((spectrum.continuum().nayak() - 28.33).abs() < 0.005);
    /// # Ok::<(), asperity_mechanics::grid::GridError>(())
    /// ```
    pub fn moments(&self, cell: Cell) -> Moments {
        let mut densities = self.densities();
        let square_length = self.square_length();
        let mut sum = MomentSum::new(cell);
        for row in self.rows(cell) {
            for k_y in row.k_y {
                let waves = [row.k_x.into(), k_y.into()];
                let density = densities.at(square_length.at(cell.wavevector(waves)));
                sum.add_pair(waves, 2.0 * density);
            }
        }
        sum.finish(1.0)
    }

    /// Returns the spectrum over continuous wavenumbers, without anisotropy. Its moments have
    /// closed forms.
    pub fn continuum(&self) -> Continuum {
        let rolloff = f64::from(self.k_rolloff);
        Continuum {
            hurst: self.hurst,
            plateau: f64::from(self.k_lower) / rolloff,
            magnification: f64::from(self.k_upper) / rolloff,
        }
    }
}

fn square(k: u32) -> f64 {
    f64::from(k).powi(2)
}

/// Returns the maximal ranges of consecutive `numbers` that satisfy `belongs`.
fn runs(numbers: Range<u32>, belongs: impl Fn(u32) -> bool) -> Vec<RangeInclusive<u32>> {
    let mut runs: Vec<RangeInclusive<u32>> = Vec::new();
    for number in numbers.filter(|&number| belongs(number)) {
        match runs.last_mut() {
            Some(run) if run.end() + 1 == number => *run = *run.start()..=number,
            _ => runs.push(number..=number),
        }
    }
    runs
}

/// Returns the first of ascending `numbers` that does not satisfy `before`, by bisection. All
/// numbers that satisfy `before` must precede those that do not.
fn partition_point(numbers: Range<u32>, before: impl Fn(u32) -> bool) -> u32 {
    let Range { mut start, mut end } = numbers;
    while start < end {
        let middle = start + (end - start) / 2;
        if before(middle) {
            start = middle + 1;
        } else {
            end = middle;
        }
    }
    end
}

/// Anisotropy of a surface that results from stretching an isotropic surface along one direction,
/// the grain.
///
/// The power spectral density at the wavevector k equals the isotropic density at
/// k′ = (ratio × k∥, k⊥). The component k∥ = k_x cos θ + k_y sin θ is along the grain, and
/// k⊥ = k_y cos θ − k_x sin θ is across it. The stretch multiplies wavelengths and correlation
/// lengths along the grain by `ratio`; lengths across the grain do not change. The mean square
/// slope along the grain is 1/ratio² of the mean square slope across it.
///
/// The ratio is greater than one, and the angle is in [0°, 180°).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anisotropy {
    #[serde(rename = "anisotropy_ratio")]
    ratio: f64,
    #[serde(rename = "anisotropy_angle")]
    angle: f64,
}

/// Quadratic form |k′|² = xx k_x² + 2 xy k_x k_y + yy k_y², with k′ of [`Anisotropy`].
#[derive(Debug, Clone, Copy)]
pub(super) struct SquareLength {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Anisotropy {
    /// Creates the anisotropy with a given ratio and a given angle of the grain to the x axis, in
    /// degrees.
    ///
    /// Returns `None` if the ratio is one, because the surface is then isotropic. A ratio below one
    /// is equivalent to its inverse with the grain rotated by 90°.
    ///
    /// ```
    /// use asperity_mechanics::topography::spectrum::Anisotropy;
    ///
    /// assert_eq!(Anisotropy::new(1.0, 30.0), None);
    /// assert_eq!(Anisotropy::new(0.5, 30.0), Anisotropy::new(2.0, 120.0));
    /// assert_eq!(Anisotropy::new(2.0, -60.0), Anisotropy::new(2.0, 120.0));
    /// ```
    pub fn new(ratio: f64, angle: f64) -> Option<Self> {
        let (ratio, angle) = if ratio < 1.0 { (1.0 / ratio, angle + 90.0) } else { (ratio, angle) };
        let angle = angle.rem_euclid(180.0);
        (ratio > 1.0).then_some(Self { ratio, angle })
    }

    /// Returns the ratio of the correlation lengths along and across the grain.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Returns the angle of the grain to the x axis, in degrees.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    pub(super) fn square_length(&self) -> SquareLength {
        let (sine, cosine) = match self.angle {
            // With exact values, modes on the cutoffs are not lost to rounding.
            45.0 => (FRAC_1_SQRT_2, FRAC_1_SQRT_2),
            90.0 => (1.0, 0.0),
            135.0 => (FRAC_1_SQRT_2, -FRAC_1_SQRT_2),
            angle => libm::sincos(angle.to_radians()),
        };
        let square = self.ratio * self.ratio;
        SquareLength {
            xx: square * cosine * cosine + sine * sine,
            xy: (square - 1.0) * cosine * sine,
            yy: square * sine * sine + cosine * cosine,
        }
    }
}

impl SquareLength {
    /// Quadratic form |k|² of an isotropic surface.
    pub const ISOTROPIC: Self = Self { xx: 1.0, xy: 0.0, yy: 1.0 };

    /// Returns |k′|² of the wavevector k = (x, y).
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        // This order gives the same bits if x and y are exchanged.
        self.xx * (x * x) + self.yy * (y * y) + 2.0 * self.xy * (x * y)
    }

    /// Returns max |k_x| and max |k_y| over all wavevectors with |k′| ≤ 1.
    pub fn unit_extents(&self) -> [f64; 2] {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        [self.yy, self.xx].map(|other| (other / determinant).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{cell, rectangle};

    fn spectrum(k_lower: u32, k_rolloff: u32, k_upper: u32) -> Spectrum {
        Spectrum { hurst: 0.8, k_lower, k_rolloff, k_upper, anisotropy: None }
    }

    fn modes(spectrum: &Spectrum, cell: Cell) -> Vec<(i32, i32)> {
        let row = |row: ModeRow| row.k_y.map(move |k_y| (row.k_x, k_y as i32));
        spectrum.rows(cell).flat_map(row).collect()
    }

    #[test]
    fn modes_are_half_of_the_annulus_cutoffs_included() {
        let half_plane = |&(k_x, k_y): &(i32, i32)| k_y > 0 || (k_y == 0 && k_x > 0);
        for (k_lower, k_upper) in [(1, 1), (1, 8), (3, 5), (5, 5), (7, 13)] {
            let k = k_upper as i32;
            let expected: Vec<_> = (-k..=k)
                .flat_map(|k_x| (-k..=k).map(move |k_y| (k_x, k_y)))
                .filter(half_plane)
                .filter(|(k_x, k_y)| {
                    let squared = (k_x * k_x + k_y * k_y) as u32;
                    (k_lower * k_lower..=k_upper * k_upper).contains(&squared)
                })
                .collect();
            let spectrum = spectrum(k_lower, k_lower, k_upper);
            assert_eq!(modes(&spectrum, cell(0.3)), expected);
        }
    }

    #[test]
    fn nayak_parameters_over_the_modes_of_a_cell_are_those_of_an_independent_sum() {
        // The Hurst exponent is 0.8. docs/results.md lists more of these values.
        for (k_lower, k_upper, nayak) in [(1, 32, 43.91), (4, 64, 12.34), (16, 128, 5.264)] {
            let moments = spectrum(k_lower, k_lower, k_upper).moments(cell(0.3));
            let found = moments.nayak().unwrap();
            assert!((found - nayak).abs() < 0.005, "{k_lower} {k_upper}: {found}");
        }
    }

    #[test]
    fn a_single_ring_of_four_modes_has_a_nayak_parameter_of_two() {
        // The modes are (±1, 0) and (0, ±1): in integer wavenumbers, m4 = m2 and m0 = 2 m2.
        let nayak = spectrum(1, 1, 1).moments(cell(1.0)).nayak().unwrap();
        assert!((nayak - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_rectangle_has_the_modes_within_its_ellipses() {
        // Along a side of half the length, the wavenumber is twice the number of waves.
        for (size, [step_x, step_y]) in [([1.0, 2.0], [2, 1]), ([3.0, 1.0], [1, 3])] {
            let cell = rectangle([1, 1], size).cell();
            let expected: Vec<_> = (-9..=9)
                .flat_map(|k_x| (0..=9).map(move |k_y| (k_x, k_y)))
                .filter(|&(k_x, k_y)| k_y > 0 || k_x > 0)
                .filter(|(k_x, k_y): &(i32, i32)| {
                    let squared = (step_x * k_x).pow(2) + (step_y * k_y).pow(2);
                    (9..=81).contains(&squared)
                })
                .collect();
            assert_eq!(modes(&spectrum(3, 3, 9), cell), expected);
        }
    }

    #[test]
    fn a_grain_leaves_the_modes_of_a_turned_ellipse() {
        for angle in [0.0, 30.0, 90.0, 150.0] {
            let anisotropy = Anisotropy::new(2.0, angle);
            let spectrum = Spectrum { anisotropy, ..spectrum(4, 4, 12) };
            let square_length = spectrum.square_length();
            let expected: Vec<_> = (-12..=12)
                .flat_map(|k_x| (0..=12).map(move |k_y| (k_x, k_y)))
                .filter(|&(k_x, k_y): &(i32, i32)| k_y > 0 || k_x > 0)
                .filter(|&(k_x, k_y)| {
                    let squared = square_length.at([k_x.into(), k_y.into()]);
                    (16.0..=144.0).contains(&squared)
                })
                .collect();
            let found = modes(&spectrum, cell(1.0));
            assert_eq!(found, expected, "{angle}");
            let most = spectrum.max_waves(cell(1.0)).map(|waves| waves as i32);
            let reached = [
                found.iter().map(|mode| mode.0.abs()).max(),
                found.iter().map(|mode| mode.1).max(),
            ];
            let within = reached.into_iter().zip(most);
            assert!(within.into_iter().all(|(found, most)| found <= Some(most)));
        }
    }

    #[test]
    fn a_narrow_strip_has_waves_along_itself_alone() {
        let strip = rectangle([1, 1], [0.1, 1.0]).cell();
        assert_eq!(modes(&spectrum(2, 2, 5), strip), [2, 3, 4, 5].map(|k| (0, k)));
    }

    #[test]
    fn cached_densities_equal_computed_densities() {
        let spectrum = spectrum(2, 4, 8192);
        let mut densities = spectrum.densities();
        for _ in 0..2 {
            let squares = [4, 15, 16, 17, MAX_CACHED, MAX_CACHED + 1, 1 << 26].map(f64::from);
            for k_squared in squares.into_iter().chain([4.5, 1e6 / 3.0]) {
                assert_eq!(densities.at(k_squared), spectrum.density(k_squared));
            }
        }
    }

    #[test]
    fn cutoffs_out_of_order_leave_no_modes() {
        assert_eq!(modes(&spectrum(8, 8, 4), cell(1.0)), []);
    }

    #[test]
    fn density_is_flat_then_falls_with_the_hurst_exponent() {
        let spectrum = spectrum(2, 4, 64);
        assert_eq!(spectrum.density(4.0), 1.0);
        assert_eq!(spectrum.density(15.0), 1.0);
        assert_eq!(spectrum.density(16.0), 1.0);
        // At ten times the roll-off wavenumber, the density is 10^(−3.6).
        let fallen = spectrum.density(1600.0);
        assert!((fallen / 10_f64.powf(-3.6) - 1.0).abs() < 1e-15);
    }

    fn square_length(ratio: f64, angle: f64) -> SquareLength {
        Anisotropy::new(ratio, angle).unwrap().square_length()
    }

    #[test]
    fn wavenumbers_along_the_grain_are_multiplied_by_the_ratio() {
        for angle in [0.0, 20.0, 90.0, 135.0] {
            let length = square_length(3.0, angle);
            let (sine, cosine) = f64::to_radians(angle).sin_cos();
            assert!((length.at([cosine, sine]) - 9.0).abs() < 1e-14);
            assert!((length.at([-sine, cosine]) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn along_an_axis_lengths_are_exact() {
        assert_eq!(square_length(2.0, 0.0).at([3.0, 4.0]), 52.0);
        assert_eq!(square_length(2.0, 90.0).at([3.0, 4.0]), 73.0);
        assert_eq!(SquareLength::ISOTROPIC.at([3.0, 4.0]), 25.0);
    }

    #[test]
    fn no_wavevector_within_the_ellipse_goes_beyond_its_box() {
        for angle in [0.0, 30.0, 45.0, 90.0, 100.0] {
            let length = square_length(2.5, angle);
            let most = length.unit_extents();
            let mut reached = [0.0_f64; 2];
            for turn in 0..36000 {
                let (y, x) = f64::to_radians(f64::from(turn) / 100.0).sin_cos();
                let scale = length.at([x, y]).sqrt();
                reached = [reached[0].max(x / scale), reached[1].max(y / scale)];
            }
            for (reached, most) in reached.into_iter().zip(most) {
                assert!(reached <= most * (1.0 + 1e-12) && reached > most * 0.9999);
            }
        }
    }
}
