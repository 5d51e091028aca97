//! Nayak's parameter and the summit density, compared with the tables of the 2015 paper.

use std::fs;
use std::path::Path;

use asperity_mechanics::grid::Grid;
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;

use crate::bench::Bench;

/// Cell of a table of the paper: spectrum, mean over 200 surfaces, and value of the closed form.
struct Cell {
    spectrum: Spectrum,
    numerical: f64,
    analytic: f64,
}

fn table(name: &str) -> Vec<Cell> {
    let path = format!("manifests/claims/yastrebov-2015-{name}.csv");
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("hurst,k_lower,k_upper,numerical,analytic"));
    let cell = |line: &str| {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let [hurst, k_lower, k_upper, numerical, analytic] = fields[..] else { panic!("{line}") };
        Cell {
            spectrum: Spectrum {
                hurst,
                k_lower: k_lower as u32,
                k_rolloff: k_lower as u32,
                k_upper: k_upper as u32,
                anisotropy: None,
            },
            numerical,
            analytic,
        }
    };
    lines.map(cell).collect()
}

fn assert_as_printed(found: f64, printed: f64) {
    // Half a unit of the second decimal, plus the rounding of this difference.
    assert!((found - printed).abs() <= 0.005 + 1e-9, "{found} {printed}");
}

#[test]
fn every_analytic_cell_is_reproduced_to_the_printed_digit() {
    let (nayak, density) = (table("nayak"), table("summit-density"));
    assert_eq!((nayak.len(), density.len()), (66, 66));
    for cell in nayak {
        assert_as_printed(cell.spectrum.continuum().nayak(), cell.analytic);
    }
    for cell in density {
        let k_rolloff = f64::from(cell.spectrum.k_rolloff);
        let found = cell.spectrum.continuum().summit_density(k_rolloff);
        assert_as_printed(found, cell.analytic);
    }
}

/// Computes α and D of the first realizations of `manifests/nayak.toml`.
fn realizations(spectrum: Spectrum, count: u32) -> Vec<[f64; 2]> {
    let drawn = (0..count).map(|realization| {
        let surface = RandomSurface {
            spectrum,
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 2015,
            realization,
        };
        let cell = Grid::square(1, 1.0).unwrap().cell();
        let moments = surface.moments(cell);
        let nayak = moments.nayak().unwrap();
        [nayak, moments.summit_density_integer(cell)]
    });
    drawn.collect()
}

/// Returns the difference of two means in units of its standard error. The mean of the paper is
/// over 200 surfaces with the same scatter and rounded to two decimals.
fn z(ours: &[f64], theirs: f64) -> f64 {
    let count = ours.len() as f64;
    let mean = ours.iter().sum::<f64>() / count;
    let squares = ours.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    let variance = squares / (count - 1.0);
    (mean - theirs) / (variance / 200.0 + variance / count + 0.01_f64.powi(2) / 12.0).sqrt()
}

#[test]
fn the_shipped_study_has_a_row_for_each_cell_of_the_tables() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("manifests/nayak.toml");
    let manifest = fs::read_to_string(path).unwrap();
    let bench = Bench::new();
    let two = manifest.replace("realizations = 1000", "realizations = 2");
    assert_eq!(bench.run(&two)["surfaces"].computed, 132);
    let found = bench.table("nayak", "table");
    let (nayak, density) = (table("nayak"), table("summit-density"));
    assert_eq!(found.rows(), 66);
    let value = |name: &str, row: usize| found.reals(name).unwrap().value(row);
    let whole = |name: &str, row: usize| found.integers(name).unwrap().value(row) as u32;
    for (row, (nayak, density)) in nayak.iter().zip(&density).enumerate() {
        assert_eq!(value("hurst", row), nayak.spectrum.hurst);
        assert_eq!(whole("k_lower", row), nayak.spectrum.k_lower);
        assert_eq!(whole("k_upper", row), nayak.spectrum.k_upper);
        assert_as_printed(value("nayak_continuum", row), nayak.analytic);
        assert_as_printed(value("summit_density_continuum", row), density.analytic);
        let mean = realizations(nayak.spectrum, 2);
        let mean = (mean[0][0] + mean[1][0]) / 2.0;
        assert!((value("nayak_mean", row) / mean - 1.0).abs() < 1e-14);
    }
}

#[test]
fn numerical_cells_are_means_of_the_same_ensemble() {
    let (nayak, density) = (table("nayak"), table("summit-density"));
    let mut squares = [0.0; 2];
    for (nayak, density) in nayak.iter().zip(&density) {
        assert_eq!(nayak.spectrum, density.spectrum);
        // The number of surfaces gives similar numbers of modes; the manifest draws 200 surfaces
        // each.
        let count = match nayak.spectrum.k_upper {
            512.. => 10,
            256.. => 40,
            _ => 200,
        };
        let drawn = realizations(nayak.spectrum, count);
        for (index, printed) in [nayak.numerical, density.numerical].into_iter().enumerate() {
            let ours: Vec<f64> = drawn.iter().map(|values| values[index]).collect();
            let z = z(&ours, printed);
            // With normal errors, one of 132 cells exceeds this bound with probability 1/16.
            assert!(z.abs() < 3.5, "{:?}: {z}", nayak.spectrum);
            squares[index] += z * z;
        }
    }
    // The cells of a row share their surfaces, so there are far fewer than 66 degrees of freedom.
    for square in squares {
        let rms = (square / 66.0_f64).sqrt();
        assert!((0.6..1.4).contains(&rms), "{rms}");
    }
}
