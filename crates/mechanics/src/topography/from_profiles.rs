//! Spectrum of an isotropic surface from the spectra of its profiles.
//!
//! A straight profile of an isotropic surface has the density
//!
//! C₁(q) = (1/π) ∫_q^∞ C(k) k dk/√(k² − q²) = (1/π) ∫₀^∞ C(√(q² + t²)) dt,
//!
//! with the conventions of [`power_spectrum`](super::power_spectrum). The direct inverse of this
//! Abel transform differentiates C₁ and amplifies its scatter. Here C is a power law between nodes
//! that are evenly spaced on a logarithmic axis, so it is positive, and zero beyond the last node.
//! The logarithms u of the densities at the nodes minimise
//!
//! Σ n (ln C₁(u) + D/C₁(u)) + (λ/2) Σ (u_{j−1} − 2 u_j + u_{j+1})².
//!
//! The first sum is the negative log-likelihood of the measured densities D, each the mean of n
//! independent modes of Gaussian profiles (Whittle 1953). The second sum prefers power laws. Its
//! factor λ is that of a random walk of the exponent with the variance [`EXPONENT_VARIANCE`] per
//! unit of ln q, so results depend little on the number of nodes.
//!
//! The scatter between profiles gives standard errors by the delete-one jackknife.

use std::f64::consts::{PI, TAU};

use super::cholesky::Cholesky;

/// Variance of the exponent of the power law per unit of ln q in the prior of the fit.
///
/// An exponent that changes by 1.3 within a decade is one standard deviation away from a constant
/// exponent. The bend at the roll-off, 3.6 within a decade, is three of them, and a few hundred
/// modes determine it against the prior.
pub const EXPONENT_VARIANCE: f64 = 4.0;

/// Number of bins per decade in which the modes of the profiles are averaged. Within a bin, a
/// density ∝ q⁻³ differs from that in the middle by 6 %, and its mean by 0.1 %.
const DATA_BINS: f64 = 40.0;

/// Fraction of the largest q³ C₁ below which the densities at the end of the spectrum carry no
/// waves: the profiles are filtered or band-limited there, and only rounding is left.
const NO_POWER: f64 = 1e-6;

/// Maximum number of groups of profiles of the jackknife.
const MAX_GROUPS: usize = 50;

const MAX_ITERATIONS: usize = 200;
const TOLERANCE: f64 = 1e-9;

/// Abscissae and weights of Gauss–Legendre quadrature with six points on (0, 1).
const QUADRATURE: [(f64, f64); 6] = [
    (0.033765242898423975, 0.08566224618958516),
    (0.16939530676686776, 0.1803807865240693),
    (0.38069040695840156, 0.23395696728634552),
    (0.6193095930415984, 0.23395696728634552),
    (0.8306046932331322, 0.1803807865240693),
    (0.966234757101576, 0.08566224618958516),
];

/// Power of the modes of one profile, or of parallel profiles with the same modes.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileModes {
    /// Angular wavenumber 2π/L of the longest wave of a profile of length L.
    pub step: f64,
    /// Densities C₁ at the wavenumbers n × `step`, n = 1, 2, …
    pub densities: Vec<f64>,
    /// Smallest n whose density is used.
    pub first: usize,
    /// Number of independent modes per mode: less than 1 under a window.
    pub independent: f64,
}

/// Spectrum of an isotropic surface, a power law between its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct IsotropicSpectrum {
    /// Nodes in ascending order of their wavenumbers, at least three.
    pub nodes: Vec<SpectrumNode>,
    /// Rms slope √⟨|∇h|²⟩ of the waves between the first and the last node.
    pub rms_slope: f64,
    /// Standard error of ln `rms_slope`; `None` for a single profile.
    pub slope_error: Option<f64>,
    /// Rms slope of the profiles, from their modes in the same band.
    pub profile_slope: f64,
    /// Number of groups of profiles of the jackknife.
    pub groups: usize,
}

/// Density at a wavenumber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumNode {
    /// Angular wavenumber.
    pub wavenumber: f64,
    /// Density C, in length⁴.
    pub density: f64,
    /// Standard error of ln C; `None` for a single profile.
    pub error: Option<f64>,
    /// Number of independent modes of the profiles that are nearer to this node than to others.
    pub modes: f64,
}

/// Sums over the modes of profiles in a bin of wavenumbers.
#[derive(Clone, Copy, Default)]
struct Bin {
    power: f64,
    modes: f64,
    /// Number of independent modes.
    independent: f64,
}

/// Combines the sums of bins one by one.
fn combined(all: &[Bin], group: &[Bin], combine: fn(f64, f64) -> f64) -> Vec<Bin> {
    let bin = |(one, other): (&Bin, &Bin)| Bin {
        power: combine(one.power, other.power),
        modes: combine(one.modes, other.modes),
        independent: combine(one.independent, other.independent),
    };
    all.iter().zip(group).map(bin).collect()
}

/// Computes the spectrum of an isotropic surface from its profiles.
///
/// `bins_per_decade` is the least number of nodes per decade of wavenumbers. Returns `None` if the
/// profiles have power in less than four bins.
///
/// ```
/// use asperity_mechanics::topography::from_profiles::{ProfileModes, invert};
///
/// // C = k⁻⁴ up to k = 100: C₁ = (1/π) ∫ C(√(q² + t²)) dt in closed form.
/// let density = |n: usize| {
///     let (q, end) = (n as f64, 100.5_f64);
///     let t = (end * end - q * q).sqrt();
///     (t / (2.0 * q * q * end * end) + (t / q).atan() / (2.0 * q.powi(3))) / std::f64::consts::PI
/// };
/// let profile = ProfileModes {
///     step: 1.0,
///     densities: (1..=100).map(density).collect(),
///     first: 1,
///     independent: 1.0,
/// };
/// let found = invert(&[profile], 10).unwrap();
/// for node in &found.nodes {
///     assert!((node.density * node.wavenumber.powi(4) - 1.0).abs() < 0.05);
/// }
/// ```
pub fn invert(profiles: &[ProfileModes], bins_per_decade: u32) -> Option<IsotropicSpectrum> {
    let lowest = profiles.iter().map(|one| one.first as f64 * one.step).fold(f64::MAX, f64::min);
    let highest = profiles.iter().map(|one| one.densities.len() as f64 * one.step);
    let bin = |q: f64| (DATA_BINS * libm::log10(q / lowest)).round().max(0.0) as usize;
    let count = bin(highest.fold(lowest, f64::max)) + 1;
    let group_count = profiles.len().min(MAX_GROUPS);
    let mut groups = vec![vec![Bin::default(); count]; group_count];
    let mut logarithms = vec![0.0; count];
    let mut last = vec![0.0_f64; count];
    for (index, profile) in profiles.iter().enumerate() {
        let group = &mut groups[index * group_count / profiles.len()];
        for n in profile.first..=profile.densities.len() {
            let q = n as f64 * profile.step;
            let bin = bin(q);
            group[bin].power += profile.densities[n - 1];
            group[bin].modes += 1.0;
            group[bin].independent += profile.independent;
            logarithms[bin] += libm::log(q);
            last[bin] = last[bin].max(q + 0.5 * profile.step);
        }
    }
    let empty = vec![Bin::default(); count];
    let all = groups.iter().fold(empty, |all, group| combined(&all, group, |a, b| a + b));
    let center = |bin: usize| libm::exp(logarithms[bin] / all[bin].modes);
    let weighted = |bin: usize| center(bin).powi(3) * all[bin].power / all[bin].modes;
    let filled: Vec<usize> = (0..count).filter(|bin| all[*bin].modes > 0.0).collect();
    let most = filled.iter().map(|bin| weighted(*bin)).fold(0.0, f64::max);
    let end = filled.iter().rposition(|bin| weighted(*bin) > NO_POWER * most)?;
    let used = &filled[..=end];
    if used.len() < 4 {
        return None;
    }
    let centers: Vec<f64> = used.iter().map(|bin| center(*bin)).collect();
    let shortest = used.iter().map(|bin| last[*bin]).fold(0.0, f64::max);
    // Rounding must not leave the longest wave out.
    let kernel = Kernel::new(&centers, [lowest * (1.0 - 1e-9), shortest], bins_per_decade);
    let fit = |bins: &[Bin], start: Option<&[f64]>| kernel.fit(bins, used, start);
    let logarithms = fit(&all, None);
    let rms_slope = kernel.rms_slope(&logarithms);
    // Rounding must not leave negative powers.
    let without = |all: f64, own: f64| (all - own).max(0.0);
    let jackknife = (group_count > 1).then(|| {
        let fits: Vec<Vec<f64>> = groups
            .iter()
            .map(|group| {
                let mut left_out = fit(&combined(&all, group, without), Some(&logarithms));
                left_out.push(libm::log(kernel.rms_slope(&left_out)));
                left_out
            })
            .collect();
        standard_errors(&fits)
    });
    let mut modes = vec![0.0; kernel.nodes.len()];
    for (q, bin) in centers.iter().zip(used) {
        let nearest = (libm::log(q / kernel.nodes[0]) / kernel.spacing).round() as usize;
        modes[nearest.min(kernel.nodes.len() - 1)] += all[*bin].independent;
    }
    let node = |(index, wavenumber): (usize, &f64)| SpectrumNode {
        wavenumber: *wavenumber,
        density: libm::exp(logarithms[index]),
        error: jackknife.as_ref().map(|errors| errors[index]),
        modes: modes[index],
    };
    Some(IsotropicSpectrum {
        nodes: kernel.nodes.iter().enumerate().map(node).collect(),
        rms_slope,
        slope_error: jackknife.as_ref().and_then(|errors| errors.last().copied()),
        profile_slope: profile_slope(profiles, shortest),
        groups: group_count,
    })
}

/// Returns the rms slope of profiles, from their modes up to a wavenumber.
fn profile_slope(profiles: &[ProfileModes], highest: f64) -> f64 {
    let square_slope = |profile: &ProfileModes| {
        let modes = profile.first..=profile.densities.len();
        let wavenumbers = modes.map(|n| (n, n as f64 * profile.step));
        let own = wavenumbers.filter(|(_, q)| *q <= highest);
        own.map(|(n, q)| q * q * profile.densities[n - 1]).sum::<f64>() * profile.step / PI
    };
    (profiles.iter().map(square_slope).sum::<f64>() / profiles.len() as f64).sqrt()
}

/// Returns the standard error of each entry of a list, from lists that each leave one group out.
fn standard_errors(fits: &[Vec<f64>]) -> Vec<f64> {
    let count = fits.len() as f64;
    let error = |index: usize| {
        let mean = fits.iter().map(|fit| fit[index]).sum::<f64>() / count;
        let squares: f64 = fits.iter().map(|fit| (fit[index] - mean).powi(2)).sum();
        (squares * (count - 1.0) / count).sqrt()
    };
    (0..fits[0].len()).map(error).collect()
}

/// Contribution of a point of the quadrature to C₁: `weight` times the density at the fraction
/// `fraction` of the logarithmic distance from node `node` to the next one.
struct Contribution {
    node: usize,
    fraction: f64,
    weight: f64,
}

/// Discretised Abel transform.
struct Kernel {
    /// Wavenumbers of the nodes.
    nodes: Vec<f64>,
    /// Logarithm of the ratio of neighbouring wavenumbers.
    spacing: f64,
    /// Wavenumbers of the data.
    wavenumbers: Vec<f64>,
    /// Contributions to the density C₁ at each wavenumber of the data.
    rows: Vec<Vec<Contribution>>,
}

impl Kernel {
    fn new(wavenumbers: &[f64], [first, last]: [f64; 2], bins_per_decade: u32) -> Kernel {
        let decades = libm::log10(last / first);
        let intervals = (decades * f64::from(bins_per_decade)).ceil().max(2.0);
        let spacing = libm::log(last / first) / intervals;
        let mut nodes: Vec<f64> = (0..=intervals as usize)
            .map(|index| first * libm::exp(spacing * index as f64))
            .collect();
        *nodes.last_mut().expect("there are three nodes") = last;
        let row = |&q: &f64| {
            let distance = |k: f64| (k * k - q * q).max(0.0).sqrt();
            let mut row = Vec::new();
            for (node, ends) in nodes.windows(2).enumerate() {
                let [from, to] = [distance(ends[0]), distance(ends[1])];
                for (abscissa, weight) in QUADRATURE {
                    let t = from + abscissa * (to - from);
                    let fraction = libm::log(libm::sqrt(q * q + t * t) / ends[0]) / spacing;
                    let weight = weight * (to - from) / PI;
                    if weight > 0.0 {
                        row.push(Contribution { node, fraction, weight });
                    }
                }
            }
            row
        };
        let rows = wavenumbers.iter().map(row).collect();
        Kernel { nodes, spacing, wavenumbers: wavenumbers.to_vec(), rows }
    }

    /// Returns C₁ of a row and adds its derivatives with respect to the logarithms.
    fn density(row: &[Contribution], logarithms: &[f64], derivatives: &mut [f64]) -> f64 {
        let mut density = 0.0;
        for &Contribution { node, fraction, weight } in row {
            let [this, next] = [logarithms[node], logarithms[node + 1]];
            let part = weight * libm::exp(this + fraction * (next - this));
            derivatives[node] += (1.0 - fraction) * part;
            derivatives[node + 1] += fraction * part;
            density += part;
        }
        density
    }

    /// Returns the logarithms of the densities at the nodes. `used` are the bins of the rows.
    fn fit(&self, bins: &[Bin], used: &[usize], start: Option<&[f64]>) -> Vec<f64> {
        let means: Vec<[f64; 2]> = used
            .iter()
            .map(|&bin| {
                let Bin { power, modes, independent } = bins[bin];
                let mean = if modes > 0.0 { power / modes } else { 0.0 };
                [mean, independent]
            })
            .collect();
        let mut logarithms = start.map_or_else(|| self.start(&means), <[f64]>::to_vec);
        let count = logarithms.len();
        let mut current = self.objective(&means, &logarithms);
        for _ in 0..MAX_ITERATIONS {
            let (mut step, hessian) = self.derivatives(&means, &logarithms);
            let cholesky = Cholesky::new(hessian, count, 0.0);
            if !cholesky.is_definite() {
                break;
            }
            cholesky.solve(&mut step);
            let longest = step.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
            // A step of 2 changes a density by a factor of 7, beyond which the model is not local.
            let mut factor = (2.0 / longest).min(1.0);
            step.iter_mut().for_each(|one| *one = -*one);
            let is_better = loop {
                let trial: Vec<f64> =
                    (0..count).map(|j| logarithms[j] + factor * step[j]).collect();
                let value = self.objective(&means, &trial);
                if value <= current {
                    (logarithms, current) = (trial, value);
                    break true;
                }
                factor *= 0.5;
                if factor * longest < TOLERANCE {
                    break false;
                }
            };
            if !is_better || factor * longest < TOLERANCE {
                break;
            }
        }
        logarithms
    }

    /// Returns a start: C = π C₁/q at the wavenumber of the data nearest to each node.
    fn start(&self, means: &[[f64; 2]]) -> Vec<f64> {
        let data: Vec<[f64; 2]> = self
            .wavenumbers
            .iter()
            .zip(means)
            .filter(|(_, [mean, _])| *mean > 0.0)
            .map(|(&q, [mean, _])| [libm::log(q), libm::log(PI * mean / q)])
            .collect();
        let nearest = |node: &f64| {
            let at = libm::log(*node);
            let distance = |point: &&[f64; 2]| (point[0] - at).abs();
            data.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)))
        };
        self.nodes.iter().map(|node| nearest(node).map_or(0.0, |point| point[1])).collect()
    }

    /// Returns λ.
    fn stiffness(&self) -> f64 {
        1.0 / (EXPONENT_VARIANCE * self.spacing.powi(3))
    }

    fn objective(&self, means: &[[f64; 2]], logarithms: &[f64]) -> f64 {
        let mut unused = vec![0.0; logarithms.len()];
        let mut sum = 0.0;
        for (row, [mean, modes]) in self.rows.iter().zip(means) {
            let density = Kernel::density(row, logarithms, &mut unused);
            sum += modes * (libm::log(density) + mean / density);
        }
        let bends = logarithms.windows(3).map(|u| (u[0] - 2.0 * u[1] + u[2]).powi(2));
        sum + 0.5 * self.stiffness() * bends.sum::<f64>()
    }

    /// Returns the gradient of the objective, and its expected second derivatives, row-major.
    fn derivatives(&self, means: &[[f64; 2]], logarithms: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let count = logarithms.len();
        let mut gradient = vec![0.0; count];
        let mut hessian = vec![0.0; count * count];
        for (row, [mean, modes]) in self.rows.iter().zip(means) {
            let mut own = vec![0.0; count];
            let density = Kernel::density(row, logarithms, &mut own);
            own.iter_mut().for_each(|one| *one /= density);
            let excess = modes * (1.0 - mean / density);
            for (i, one) in own.iter().enumerate() {
                gradient[i] += excess * one;
                for (j, other) in own[..=i].iter().enumerate() {
                    hessian[i * count + j] += modes * one * other;
                }
            }
        }
        let stiffness = self.stiffness();
        for middle in 1..count - 1 {
            let bend = logarithms[middle - 1] - 2.0 * logarithms[middle] + logarithms[middle + 1];
            let parts = [(middle - 1, 1.0), (middle, -2.0), (middle + 1, 1.0)];
            for (i, one) in parts {
                gradient[i] += stiffness * bend * one;
                for (j, other) in parts.into_iter().filter(|(j, _)| *j <= i) {
                    hessian[i * count + j] += stiffness * one * other;
                }
            }
        }
        (gradient, hessian)
    }

    /// Returns the rms slope, √((1/2π) ∫ C k³ dk).
    fn rms_slope(&self, logarithms: &[f64]) -> f64 {
        let intervals = self.nodes.windows(2).zip(logarithms.windows(2));
        let integral: f64 = intervals
            .map(|(k, u)| {
                // C k⁴ is exponential in ln k.
                let exponent = u[1] - u[0] + 4.0 * self.spacing;
                let start = libm::exp(u[0]) * k[0].powi(4) * self.spacing;
                let mean =
                    if exponent.abs() < 1e-9 { 1.0 } else { libm::expm1(exponent) / exponent };
                start * mean
            })
            .sum();
        (integral / TAU).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Boundary;
    use crate::grid::samples::square;
    use crate::topography::moments::Moments;
    use crate::topography::power_spectrum::line_spectra;
    use crate::topography::random::samples;
    use crate::topography::surface::Axis;

    /// Modes of profiles of C ∝ k⁻⁴ with a cutoff, in closed form.
    fn power_law(end: usize) -> ProfileModes {
        let last = end as f64 + 0.5;
        let density = |n: usize| {
            let q = n as f64;
            let t = (last * last - q * q).sqrt();
            (t / (2.0 * q * q * last * last) + (t / q).atan() / (2.0 * q.powi(3))) / PI
        };
        let densities = (1..=end).map(density).collect();
        ProfileModes { step: 1.0, densities, first: 1, independent: 1.0 }
    }

    #[test]
    fn a_power_law_is_found_again() {
        let found = invert(&[power_law(300)], 10).unwrap();
        for node in &found.nodes {
            let ratio = node.density * node.wavenumber.powi(4);
            assert!((ratio - 1.0).abs() < 0.05, "{} at {}", ratio, node.wavenumber);
        }
        assert_eq!((found.slope_error, found.groups), (None, 1));
        // ∫ k⁻¹ dk/2π over the band, of which the profiles have half.
        let exact = (libm::log(300.5) / TAU).sqrt();
        assert!((found.rms_slope / exact - 1.0).abs() < 0.01, "{}", found.rms_slope);
        assert!((found.rms_slope / found.profile_slope / 2_f64.sqrt() - 1.0).abs() < 0.1);
    }

    #[test]
    fn equal_profiles_have_no_scatter_and_the_spectrum_of_one() {
        let one = invert(&[power_law(60)], 10).unwrap();
        let three = invert(&[power_law(60), power_law(60), power_law(60)], 10).unwrap();
        assert!(three.slope_error.unwrap() < 1e-6);
        assert!((three.rms_slope / one.rms_slope - 1.0).abs() < 0.01);
    }

    #[test]
    fn profiles_of_a_random_surface_give_its_slope_within_the_error() {
        let surface = samples::random(4, 64, 5).draw(square(256, 1.0));
        let lines = line_spectra(&surface, Axis::X, Boundary::Periodic, 32);
        let profile = |densities: &Vec<f64>| ProfileModes {
            step: TAU,
            densities: densities[..densities.len() - 1].to_vec(),
            first: 1,
            independent: 1.0,
        };
        let found = invert(&lines.iter().map(profile).collect::<Vec<_>>(), 10).unwrap();
        let exact = Moments::from_surface(&surface).rms_slope();
        let error = found.slope_error.unwrap();
        assert!(error < 0.05, "{error}");
        assert!(libm::log(found.rms_slope / exact).abs() < 3.0 * error.max(0.01));
        // The spectrum ends with the waves of the surface.
        let last = found.nodes.last().unwrap().wavenumber / TAU;
        assert!((last - 64.5).abs() < 1.0, "{last}");
    }

    #[test]
    fn flat_and_short_profiles_have_no_spectrum() {
        assert_eq!(invert(&[power_law(2)], 10), None);
        let flat = ProfileModes { densities: vec![0.0; 50], ..power_law(50) };
        assert_eq!(invert(&[flat], 10), None);
    }
}
