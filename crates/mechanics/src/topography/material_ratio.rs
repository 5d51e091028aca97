//! Areal material ratio curve (Abbott–Firestone curve) and the functional parameters of ISO
//! 25178-2 that follow from it.
//!
//! The curve z(t) is the height above the mean that the fraction t of the surface reaches or
//! exceeds. With the heights z₁ ≥ z₂ ≥ … ≥ z_n of the nodes in descending order, it is the polygon
//! through the points ((k − 1/2)/n, z_k), and constant before the first and after the last point.
//! No bins are needed: the curve contains every height.
//!
//! Numbers in parentheses are definitions of ISO 25178-2:2021:
//!
//! - Smr(c) (4.5.1) is the fraction of the nodes at or above the height c;
//! - Smc(mr) (4.5.2) is z(mr), the inverse of Smr(c);
//! - Sk, Spk, Svk, Smr1 and Smr2 (4.5.4) describe core, peaks and dales, see [`Stratified`];
//! - Vmp and Vmc (4.5.6), Vvc and Vvv (4.5.7) are volumes per area, see [`Volumes`].

use super::descriptors::deviations;
use super::surface::Surface;

/// Fraction of the surface in the central region, to which the equivalent straight line is fitted.
const CENTRAL_REGION: f64 = 0.4;

/// Material ratio curve of a surface.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::material_ratio::MaterialRatioCurve;
/// use asperity_mechanics::topography::surface::Surface;
///
/// // An inclined plane between −1 and 1: a quarter of it lies above 1/2.
/// let grid = Grid::new([1000, 1], Cell::new([1.0, 1.0])?)?;
/// let heights = (0..1000).map(|i| (f64::from(i) - 499.5) / 500.0).collect();
/// let curve = MaterialRatioCurve::from_surface(&Surface::new(grid, heights)?);
/// assert_eq!(curve.ratio_at(0.5), 0.25);
/// assert!((curve.height_at(0.25) - 0.5).abs() < 1e-15);
/// // The whole plane is core, without peaks and dales.
/// let found = curve.stratified();
/// assert!((found.sk - 2.0).abs() < 1e-14);
/// assert_eq!([found.spk, found.svk], [0.0, 0.0]);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialRatioCurve {
    /// Heights above the mean in descending order, at least one.
    heights: Vec<f64>,
}

/// Parameters of a stratified surface: heights of core, peaks and dales, and their material ratios.
///
/// The equivalent straight line is fitted by least squares of heights in the central region. This
/// is the region of 40 % of the nodes in which the material ratio curve falls least from its first
/// to its last point; the first one if several fall equally (ISO 25178-2 annex B, ISO 13565-2).
/// The heights of the line at the ratios 0 and 1 are the upper and the lower limit of the core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stratified {
    /// Core height Sk: difference between upper and lower limit of the core.
    pub sk: f64,
    /// Reduced peak height Spk: height of a triangle with the base Smr1 and the area between the
    /// curve and the upper limit of the core. Zero if no node is above this limit.
    pub spk: f64,
    /// Reduced dale height Svk: height of a triangle with the base 1 − Smr2 and the area between
    /// the lower limit of the core and the curve. Zero if no node is below this limit.
    pub svk: f64,
    /// Fraction Smr1 of the nodes above the core. The edition of 2021 calls it Smrk1.
    pub smr1: f64,
    /// Fraction Smr2 of the nodes in or above the core. The edition of 2021 calls it Smrk2.
    pub smr2: f64,
}

/// Volumes of material and of voids per area of the surface, in the unit of the heights.
///
/// They follow from the integrals Vm(t) = ∫₀ᵗ (z(u) − z(t)) du and Vv(t) = ∫ₜ¹ (z(t) − z(u)) du of
/// the curve z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volumes {
    /// Peak material volume Vmp = Vm(p).
    pub vmp: f64,
    /// Core material volume Vmc = Vm(q) − Vm(p).
    pub vmc: f64,
    /// Core void volume Vvc = Vv(p) − Vv(q).
    pub vvc: f64,
    /// Dale void volume Vvv = Vv(q).
    pub vvv: f64,
}

impl MaterialRatioCurve {
    /// Creates the curve of the heights of all nodes about their mean.
    pub fn from_surface(surface: &Surface) -> Self {
        let mut heights = deviations(surface.heights());
        heights.sort_unstable_by(|one, other| other.total_cmp(one));
        Self { heights }
    }

    /// Returns the areal material ratio Smr(c): the fraction of the nodes at or above a height,
    /// which is measured from the mean.
    pub fn ratio_at(&self, height: f64) -> f64 {
        self.count(|other| other >= height) / self.nodes()
    }

    /// Returns the inverse areal material ratio Smc(mr): the height above the mean that the
    /// fraction `ratio` of the surface reaches or exceeds.
    pub fn height_at(&self, ratio: f64) -> f64 {
        let (index, fraction) = self.position(ratio);
        match self.heights[index..] {
            [height, next, ..] => height + fraction * (next - height),
            _ => self.heights[index],
        }
    }

    /// Computes the volumes above and below the material ratios p and q, by default 0.1 and 0.8.
    pub fn volumes(&self, [p, q]: [f64; 2]) -> Volumes {
        let (vmp, vvv) = (self.material_volume(p), self.void_volume(q));
        Volumes { vmp, vmc: self.material_volume(q) - vmp, vvc: self.void_volume(p) - vvv, vvv }
    }

    /// Computes the heights of core, peaks and dales.
    pub fn stratified(&self) -> Stratified {
        let [upper, lower] = self.core_limits();
        let above = self.count(|height| height > upper);
        let in_core = self.count(|height| height >= lower);
        let below = self.nodes() - in_core;
        let peaks: f64 = self.heights[..above as usize].iter().map(|height| height - upper).sum();
        let dales: f64 = self.heights[in_core as usize..].iter().map(|height| lower - height).sum();
        Stratified {
            sk: upper - lower,
            spk: if above > 0.0 { 2.0 * peaks / above } else { 0.0 },
            svk: if below > 0.0 { 2.0 * dales / below } else { 0.0 },
            smr1: above / self.nodes(),
            smr2: in_core / self.nodes(),
        }
    }

    /// Returns the heights of the equivalent straight line at the material ratios 0 and 1.
    fn core_limits(&self) -> [f64; 2] {
        let nodes = self.heights.len();
        let intervals = ((CENTRAL_REGION * nodes as f64).round() as usize).clamp(1, nodes);
        let fall = |first: usize| self.heights[first] - self.heights[first + intervals];
        let mut first = 0;
        for other in 1..nodes.saturating_sub(intervals) {
            if fall(other) < fall(first) {
                first = other;
            }
        }
        // Heights relative to the first one give a line that is exactly level on a plateau.
        let region = &self.heights[first..(first + intervals + 1).min(nodes)];
        let reference = region[0];
        let center = (region.len() - 1) as f64 / 2.0;
        let mean =
            region.iter().map(|height| height - reference).sum::<f64>() / region.len() as f64;
        let [mut product, mut square] = [0.0; 2];
        for (index, height) in region.iter().enumerate() {
            let offset = index as f64 - center;
            product += offset * (height - reference);
            square += offset * offset;
        }
        let slope = if square > 0.0 { product / square } else { 0.0 };
        // The node with the index k has the ratio (k + 1/2)/n, so that ratio 0 is at k = −1/2.
        let line = |index: f64| reference + (mean + slope * (index - first as f64 - center));
        [line(-0.5), line(self.nodes() - 0.5)]
    }

    /// Returns Vm(t), the volume of material per area above the height z(t).
    fn material_volume(&self, ratio: f64) -> f64 {
        let (index, fraction) = self.position(ratio);
        let plane = self.height_at(ratio);
        let above = |height: &f64| height - plane;
        let whole: f64 = self.heights[..index].iter().map(above).sum();
        (whole + 0.5 * (1.0 + fraction) * above(&self.heights[index])) / self.nodes()
    }

    /// Returns Vv(t), the volume of voids per area below the height z(t).
    fn void_volume(&self, ratio: f64) -> f64 {
        let (index, fraction) = self.position(ratio);
        let plane = self.height_at(ratio);
        let below = |height: &f64| plane - height;
        let Some((next, rest)) = self.heights[index + 1..].split_first() else {
            return 0.0;
        };
        let whole: f64 = rest.iter().map(below).sum();
        (whole + 0.5 * (2.0 - fraction) * below(next)) / self.nodes()
    }

    /// Returns the index of the last point of the polygon at or before a ratio, and the fraction of
    /// the way to the next point. Ratios before the first or after the last point give this point.
    fn position(&self, ratio: f64) -> (usize, f64) {
        let last = self.heights.len() - 1;
        let position = (ratio * self.nodes() - 0.5).clamp(0.0, last as f64);
        let index = position as usize;
        (index, position - index as f64)
    }

    /// Returns the number of leading heights, from the highest, that fulfil a condition.
    fn count(&self, is_counted: impl Fn(f64) -> bool) -> f64 {
        self.heights.partition_point(|height| is_counted(*height)) as f64
    }

    fn nodes(&self) -> f64 {
        self.heights.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, SQRT_2, TAU};

    use super::*;
    use crate::grid::samples::square;
    use crate::topography::shapes::Shape;

    /// Nodes along each side of the surfaces.
    const NODES: usize = 100;

    /// Returns the curve of a surface whose nodes have the quantiles `height(t)` of a distribution,
    /// in an order in which neighbours are far apart.
    fn curve(height: impl Fn(f64) -> f64) -> MaterialRatioCurve {
        let count = NODES * NODES;
        let ratio = |node: usize| ((node * 3_001 % count) as f64 + 0.5) / count as f64;
        let heights = (0..count).map(|node| height(ratio(node))).collect();
        MaterialRatioCurve::from_surface(&Surface::new(square(NODES, 1.0), heights).unwrap())
    }

    /// Returns the fraction of a standard normal distribution above a height.
    fn above(height: f64) -> f64 {
        libm::erfc(height / SQRT_2) / 2.0
    }

    fn density(height: f64) -> f64 {
        libm::exp(-height * height / 2.0) / TAU.sqrt()
    }

    /// Returns the height above which lies the fraction `ratio` of a standard normal distribution.
    fn quantile(ratio: f64) -> f64 {
        let [mut low, mut high] = [-10.0, 10.0];
        for _ in 0..80 {
            let middle = (low + high) / 2.0;
            if above(middle) > ratio {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    fn assert_within(found: f64, exact: f64, tolerance: f64) {
        assert!((found - exact).abs() < tolerance, "{found} should be {exact}");
    }

    #[test]
    fn heights_of_a_plane_are_all_core() {
        // z(t) = a (1/2 − t).
        let side = 3.0;
        let curve = curve(|ratio| side * (0.5 - ratio));
        let found = curve.stratified();
        assert_within(found.sk, side, 1e-13);
        assert_eq!([found.spk, found.svk, found.smr1, found.smr2], [0.0, 0.0, 0.0, 1.0]);
        // Vm(t) = a t²/2 and Vv(t) = a (1 − t)²/2, but for half a node of 10⁴ at each end.
        for [p, q] in [[0.1, 0.8], [0.25, 0.5]] {
            let volumes = curve.volumes([p, q]);
            assert_within(volumes.vmp, side * p * p / 2.0, 1e-8);
            assert_within(volumes.vmc, side * (q * q - p * p) / 2.0, 1e-8);
            assert_within(volumes.vvv, side * (1.0 - q) * (1.0 - q) / 2.0, 1e-8);
            let vvc = side * ((1.0 - p) * (1.0 - p) - (1.0 - q) * (1.0 - q)) / 2.0;
            assert_within(volumes.vvc, vvc, 1e-8);
        }
        for ratio in [0.1, 0.3, 0.8] {
            assert_within(curve.height_at(ratio), side * (0.5 - ratio), 1e-13);
            assert_within(curve.ratio_at(side * (0.5 - ratio) - 1e-9), ratio, 1e-13);
        }
    }

    #[test]
    fn gaussian_heights_have_the_parameters_of_the_normal_distribution() {
        let curve = curve(quantile);
        // The slope of the line over the ratios 0.3 … 0.7 is 12/0.4³ ∫ (t − 1/2) z dt. With
        // t = Φ(x), partial integration gives erf(a)/(2√π) − 0.4 φ(a), where Φ(a) = 0.7.
        let a = quantile(0.3);
        let integral = libm::erf(a) / (2.0 * PI.sqrt()) - 0.4 * density(a);
        let sk = 12.0 / 0.4_f64.powi(3) * integral;
        assert_within(sk, 2.574, 5e-4);
        let (limit, peaks) = (sk / 2.0, above(sk / 2.0));
        let spk = 2.0 * (density(limit) - limit * peaks) / peaks;
        let found = curve.stratified();
        // The central region can lie one node aside, and ratios are multiples of 1e-4.
        assert_within(found.sk, sk, 1e-4);
        assert_within(found.spk, spk, 1.5e-3);
        assert_within(found.svk, spk, 1.5e-3);
        assert_within(found.smr1, peaks, 1.5e-4);
        assert_within(found.smr2, 1.0 - peaks, 1.5e-4);
        // Vm(t) = φ(z) − z t at z = z(t), and Vv(t) = Vm(t) + z.
        let material = |ratio: f64| density(quantile(ratio)) - quantile(ratio) * ratio;
        let void = |ratio: f64| material(ratio) + quantile(ratio);
        let volumes = curve.volumes([0.1, 0.8]);
        // Quantiles at the middle of the nodes lose part of the tails.
        assert_within(volumes.vmp, material(0.1), 1e-4);
        assert_within(volumes.vmc, material(0.8) - material(0.1), 1e-4);
        assert_within(volumes.vvc, void(0.1) - void(0.8), 1e-4);
        assert_within(volumes.vvv, void(0.8), 1e-4);
        assert_within(curve.height_at(0.1), quantile(0.1), 1e-4);
        assert_within(curve.ratio_at(1.0), above(1.0), 1.5e-4);
    }

    #[test]
    fn a_wave_has_the_material_ratio_of_an_arc_cosine() {
        // Smr(c) = arccos(c/Δ)/π, and Vm(t) = Δ (sin(πt)/π − t cos(πt)).
        let curve = curve(|ratio| 0.2 * libm::cos(PI * ratio));
        assert_within(curve.ratio_at(0.1), 1.0 / 3.0, 1e-4);
        assert_within(curve.height_at(0.25), 0.1 * SQRT_2, 1e-8);
        let volume = 0.2 * (libm::sin(0.1 * PI) / PI - 0.1 * libm::cos(0.1 * PI));
        assert_within(curve.volumes([0.1, 0.8]).vmp, volume, 1e-8);
    }

    #[test]
    fn a_plateau_with_dales_has_a_level_core() {
        // The plateau of a punch covers 78 % of the cell and is therefore the central region.
        let surface = Shape::Punch { radius: 0.5, depth: 2.0 }.draw(square(64, 1.0));
        let share = surface.heights().iter().filter(|&&h| h == 0.0).count() as f64 / 4096.0;
        let found = MaterialRatioCurve::from_surface(&surface).stratified();
        assert_eq!([found.sk, found.spk, found.smr1], [0.0; 3]);
        assert_eq!(found.smr2, share);
        assert_within(found.svk, 4.0, 1e-13);
    }

    #[test]
    fn turning_a_surface_over_exchanges_peaks_and_dales() {
        let heights = |ratio: f64| (3.0 * ratio).powi(3);
        let (upright, turned) = (curve(heights), curve(|ratio| -heights(ratio)));
        let (one, other) = (upright.stratified(), turned.stratified());
        assert_within(one.sk, other.sk, 1e-12);
        assert_within(one.spk, other.svk, 1e-12);
        assert_within(one.smr1, 1.0 - other.smr2, 1e-12);
        let (one, other) = (upright.volumes([0.1, 0.8]), turned.volumes([0.2, 0.9]));
        assert_within(one.vmp, other.vvv, 1e-12);
        assert_within(one.vmc, other.vvc, 1e-12);
        assert_within(one.vvv, other.vmp, 1e-12);
    }

    #[test]
    fn small_and_flat_maps_have_no_peaks() {
        for nodes in 1..4 {
            let flat = Surface::new(square(nodes, 1.0), vec![0.1; nodes * nodes]).unwrap();
            let curve = MaterialRatioCurve::from_surface(&flat);
            let none = Stratified { sk: 0.0, spk: 0.0, svk: 0.0, smr1: 0.0, smr2: 1.0 };
            assert_eq!(curve.stratified(), none);
            let none = Volumes { vmp: 0.0, vmc: 0.0, vvc: 0.0, vvv: 0.0 };
            assert_eq!(curve.volumes([0.1, 0.8]), none);
        }
    }
}
