//! One power spectral density from several scans of a surface.
//!
//! A small scan shows short waves, and a large scan long ones. Each is trusted in a band of
//! wavelengths: above the resolution of its instrument, and below a fraction of its size. In bins
//! of wavenumbers with equal ratios, the densities of all scans are averaged with weights. The
//! weight of a ring is its number of independent modes, because the relative variance of its
//! density is two over this number. Where scans overlap, their ratio shows whether they agree.

use super::power_spectrum::Ring;

/// Power spectral density of one scan, with the band in which it is trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanSpectrum {
    /// Rings of the scan.
    pub rings: Vec<Ring>,
    /// Longer side of the cell of the rings.
    pub longer_side: f64,
    /// Number of independent real amplitudes per mode.
    pub independent: f64,
    /// Smallest and largest angular wavenumber at which the scan is trusted.
    pub band: [f64; 2],
}

/// Bin of a stitched spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StitchedBin {
    /// Mean wavenumber of the rings in the bin: the exponential of the weighted mean of ln q.
    pub wavenumber: f64,
    /// Weighted mean of C(q) over the rings of all scans, in length⁴.
    pub density: f64,
    /// Number of modes in the rings of all scans.
    pub modes: u64,
    /// Number of independent real amplitudes in these rings.
    pub freedom: f64,
    /// Number of scans with rings in the bin.
    pub scans: u32,
    /// Ratio of the densities of the scan with the shortest and of the one with the longest cell;
    /// `None` if only one scan has rings in the bin.
    pub overlap: Option<Overlap>,
}

/// Comparison of two scans in one bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Density of the smaller scan divided by that of the larger one.
    pub ratio: f64,
    /// Relative standard deviation of the ratio for Gaussian surfaces.
    pub scatter: f64,
}

/// Part of a bin that comes from one scan.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Number of the bin, in ascending order of wavenumbers.
    bin: i64,
    /// Side of the scan.
    side: f64,
    /// Weighted mean of ln q over the rings.
    log_wavenumber: f64,
    /// Density at this wavenumber.
    density: f64,
    /// d ln C/d ln q of the scan at this wavenumber.
    exponent: f64,
    freedom: f64,
    modes: u64,
}

impl Part {
    /// Returns the density at another wavenumber of the bin.
    fn density_at(&self, log_wavenumber: f64) -> f64 {
        self.density * libm::exp(self.exponent * (log_wavenumber - self.log_wavenumber))
    }
}

/// Averages the spectra of several scans, in bins of which `bins_per_decade` make a factor of ten.
///
/// Within a bin, the density of a scan is assumed to be a power law, whose exponent follows from
/// its densities in the neighbouring bins. A power law is therefore reproduced for any width of
/// the bins. The bins are in ascending order of wavenumbers. Bins without a ring are left out.
///
/// ```
/// use std::f64::consts::TAU;
///
/// use asperity_mechanics::topography::power_spectrum::Ring;
/// use asperity_mechanics::topography::stitched::{ScanSpectrum, mean_overlap, stitched};
///
/// // Scans of the sides 1 and 10 of a surface with C = q^(−3).
/// let scan = |side: f64| ScanSpectrum {
///     rings: (1..100)
///         .map(|waves| Ring {
///             waves,
///             modes: 6 * waves,
///             density: (TAU * f64::from(waves) / side).powi(-3),
///         })
///         .collect(),
///     longer_side: side,
///     independent: 1.0,
///     band: [TAU * 4.0 / side, TAU * 99.0 / side],
/// };
/// let bins = stitched(&[scan(1.0), scan(10.0)], 10);
/// for bin in &bins {
///     assert!((bin.density * bin.wavenumber.powi(3) - 1.0).abs() < 0.01);
/// }
/// let overlaps = bins.iter().filter_map(|bin| bin.overlap);
/// assert!((mean_overlap(overlaps).unwrap() - 1.0).abs() < 0.01);
/// ```
pub fn stitched(scans: &[ScanSpectrum], bins_per_decade: u32) -> Vec<StitchedBin> {
    let mut parts: Vec<Part> =
        scans.iter().flat_map(|scan| parts_of(scan, bins_per_decade)).collect();
    // The sort is stable, so that the order of sums follows from the order of the scans.
    parts.sort_by_key(|part| part.bin);
    parts.chunk_by(|one, other| one.bin == other.bin).map(combined).collect()
}

/// Averages the parts of a bin.
fn combined(parts: &[Part]) -> StitchedBin {
    let freedom: f64 = parts.iter().map(|part| part.freedom).sum();
    let mean = |value: &dyn Fn(&Part) -> f64| {
        parts.iter().map(|part| part.freedom * value(part)).sum::<f64>() / freedom
    };
    let log_wavenumber = mean(&|part| part.log_wavenumber);
    let by_side = |one: &&Part, other: &&Part| one.side.total_cmp(&other.side);
    let ends = parts.iter().min_by(by_side).zip(parts.iter().max_by(by_side));
    StitchedBin {
        wavenumber: libm::exp(log_wavenumber),
        density: mean(&|part| part.density_at(log_wavenumber)),
        modes: parts.iter().map(|part| part.modes).sum(),
        freedom,
        scans: parts.len() as u32,
        overlap: ends.filter(|_| parts.len() > 1).map(|(small, large)| Overlap {
            ratio: small.density_at(log_wavenumber) / large.density_at(log_wavenumber),
            scatter: (2.0 / small.freedom + 2.0 / large.freedom).sqrt(),
        }),
    }
}

/// Returns the densities of a scan in the bins of its trusted rings.
fn parts_of(scan: &ScanSpectrum, bins_per_decade: u32) -> Vec<Part> {
    let [least, most] = scan.band;
    let wavenumber = |ring: &Ring| ring.wavenumber(scan.longer_side);
    let trusted: Vec<Ring> = scan
        .rings
        .iter()
        .filter(|ring| {
            let within = least * (1.0 - 1e-9)..=most * (1.0 + 1e-9);
            within.contains(&wavenumber(ring)) && ring.density > 0.0
        })
        .copied()
        .collect();
    let bin = |ring: &Ring| {
        (f64::from(bins_per_decade) * libm::log10(wavenumber(ring)) + 1e-9).floor() as i64
    };
    let log_wavenumber = |ring: &Ring| libm::log(wavenumber(ring));
    let mean = |rings: &[Ring], value: &dyn Fn(&Ring) -> f64| {
        let modes: f64 = rings.iter().map(|ring| f64::from(ring.modes)).sum();
        rings.iter().map(|ring| f64::from(ring.modes) * value(ring)).sum::<f64>() / modes
    };
    let bins: Vec<&[Ring]> = trusted.chunk_by(|one, other| bin(one) == bin(other)).collect();
    let rough = |rings: &&[Ring]| {
        [mean(rings, &log_wavenumber), libm::log(mean(rings, &|ring| ring.density))]
    };
    let rough: Vec<[f64; 2]> = bins.iter().map(rough).collect();
    let part = |(index, rings): (usize, &&[Ring])| {
        let [middle, _] = rough[index];
        let exponent = local_exponent(&rough, index);
        let modes: u64 = rings.iter().map(|ring| u64::from(ring.modes)).sum();
        let density =
            |ring: &Ring| ring.density * libm::exp(exponent * (middle - log_wavenumber(ring)));
        Part {
            bin: bin(&rings[0]),
            side: scan.longer_side,
            log_wavenumber: middle,
            density: mean(rings, &density),
            exponent,
            freedom: scan.independent * modes as f64,
            modes,
        }
    };
    bins.iter().enumerate().map(part).collect()
}

/// Returns the geometric mean of the ratios in the overlap of the scans, weighted with the inverse
/// of their variances, or `None` if there is no overlap.
pub fn mean_overlap(overlaps: impl IntoIterator<Item = Overlap>) -> Option<f64> {
    let (mut weights, mut sum) = (0.0, 0.0);
    for Overlap { ratio, scatter } in overlaps {
        let weight = 1.0 / (scatter * scatter);
        weights += weight;
        sum += weight * libm::log(ratio);
    }
    (weights > 0.0).then(|| libm::exp(sum / weights))
}

/// Returns d ln C/d ln q at a bin, between its neighbours; zero if there is only one bin.
fn local_exponent(bins: &[[f64; 2]], index: usize) -> f64 {
    let before = bins[index.saturating_sub(1)];
    let after = bins[(index + 1).min(bins.len() - 1)];
    let width = after[0] - before[0];
    if width > 0.0 { (after[1] - before[1]) / width } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::Boundary;
    use crate::grid::samples::square;
    use crate::topography::power_spectrum::{INDEPENDENT_FRACTION, rings};
    use crate::topography::spectral_density::{SpectralDensity, TabulatedSurface};
    use crate::topography::surface::{Scan, Window};

    #[test]
    fn two_scans_of_one_surface_stitch_to_its_spectrum() {
        // A surface of 1024² nodes with a roll-off. One scan shows all of it on a mesh of 128²
        // nodes, the other a part of 128² nodes.
        let exact = |k: f64| 1e-6 * if k < 12.0 { 1.0 } else { (k / 12.0).powf(-3.4) };
        let points = [1.0, 12.0, 500.0].map(|k| [TAU * k, exact(k)]);
        let density = SpectralDensity::from_points(points.to_vec()).unwrap();
        let surface =
            TabulatedSurface { density: &density, rms_slope: None, seed: 3, realization: 0 };
        let whole = surface.draw(square(1024, 1.0));
        // The coarse scan has no waves beyond its mesh.
        let coarse = surface.draw(square(128, 1.0));
        let part = Window { first: [300, 500], nodes: [128, 128] };
        let fine = Scan::from(whole).cropped(part).into_surface().unwrap();
        let spectra = [
            ScanSpectrum {
                rings: rings(&coarse, Boundary::Periodic),
                longer_side: 1.0,
                independent: 1.0,
                band: [TAU, TAU * 60.0],
            },
            ScanSpectrum {
                rings: rings(&fine, Boundary::Free),
                longer_side: 0.125,
                independent: INDEPENDENT_FRACTION,
                band: [TAU * 4.0 / 0.125, TAU * 60.0 / 0.125],
            },
        ];
        let bins = stitched(&spectra, 10);
        assert!(bins[0].wavenumber < TAU * 1.3 && bins[bins.len() - 1].wavenumber > TAU * 400.0);
        let overlapping: Vec<&StitchedBin> = bins.iter().filter(|bin| bin.scans == 2).collect();
        assert!((2..=4).contains(&overlapping.len()), "{}", overlapping.len());
        for bin in &bins {
            let ratio = bin.density / exact(bin.wavenumber / TAU);
            // The bin at the kink of the density is not a power law, and the window of the small
            // scan mixes neighbouring rings, which raises its first rings by a tenth.
            let tolerance = 4.0 * (2.0 / bin.freedom).sqrt() + 0.12;
            assert!(
                (ratio - 1.0).abs() < tolerance,
                "{} {ratio} {tolerance}",
                bin.wavenumber / TAU
            );
        }
        let overlap =
            |bins: &[StitchedBin]| mean_overlap(bins.iter().filter_map(|bin| bin.overlap));
        let mean = overlap(&bins).unwrap();
        assert!((mean - 1.0).abs() < 0.35, "{mean}");
        // A wrong height scale of one scan shows in the overlap.
        let mut wrong = spectra.clone();
        wrong[1].rings.iter_mut().for_each(|ring| ring.density *= 9.0);
        let nine_times = overlap(&stitched(&wrong, 10)).unwrap();
        assert!((nine_times / mean / 9.0 - 1.0).abs() < 0.05, "{nine_times}");
        let reversed: Vec<ScanSpectrum> = spectra.iter().rev().cloned().collect();
        for (one, other) in bins.iter().zip(stitched(&reversed, 10)) {
            assert!((one.density / other.density - 1.0).abs() < 1e-12);
            assert_eq!(one.overlap.is_some(), other.overlap.is_some());
        }
    }

    #[test]
    fn scans_without_common_wavenumbers_have_no_overlap() {
        let scan = |side: f64, band: [f64; 2]| ScanSpectrum {
            rings: (1..40).map(|waves| Ring { waves, modes: 4, density: 1.0 }).collect(),
            longer_side: side,
            independent: 1.0,
            band,
        };
        let bins = stitched(&[scan(1.0, [90.0, 240.0]), scan(9.0, [1.0, 20.0])], 8);
        assert!(bins.iter().all(|bin| bin.scans == 1 && bin.overlap.is_none()));
        assert_eq!(mean_overlap(bins.iter().filter_map(|bin| bin.overlap)), None);
        assert!(stitched(&[], 10).is_empty());
    }
}
