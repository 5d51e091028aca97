//! Intervals cover what they say, with few surfaces and many quantities.

use super::*;
use crate::examples::normal;

/// Values of surfaces, `[quantity][surface]`.
type Samples = Vec<Vec<f64>>;

/// Independent quantities.
fn independent(seed: u64, quantities: usize, surfaces: usize) -> Samples {
    let sample = |index: usize| normal(1000 * seed + index as u64, surfaces);
    (0..quantities).map(sample).collect()
}

/// Nine spectra under several loads each: the loads of a surface share most of its scatter.
fn structured(seed: u64, quantities: usize, surfaces: usize) -> Samples {
    let spectra = independent(2 * seed, 9, surfaces);
    let own = independent(2 * seed + 1, quantities, surfaces);
    let mixed = own.iter().enumerate().map(|(index, own)| {
        let shared = &spectra[index % 9];
        let values = own.iter().zip(shared);
        values.map(|(own, shared)| 0.6 * own + 0.8 * shared).collect()
    });
    mixed.collect()
}

/// How values of quantities scatter.
type Scatter = fn(u64, usize, usize) -> Samples;

/// The share of studies in which the intervals of ln of the mean contain ln of the truth, of all
/// quantities together.
fn coverage(
    samples: Scatter,
    quantities: usize,
    surfaces: usize,
    value: fn(f64) -> f64,
    truth: f64,
) -> f64 {
    const STUDIES: u64 = 300;
    let covers = |study: &u64| {
        let samples = samples(*study, quantities, surfaces);
        samples.iter().all(|sample| {
            let values: Vec<f64> = sample.iter().map(|&normal| value(normal)).collect();
            let bound =
                jackknife(String::new(), &[surfaces], |weights| Some(weights.mean(&values).ln()));
            let [lower, upper] = bound.unwrap().together(quantities);
            lower <= truth.ln() && truth.ln() <= upper
        })
    };
    (0..STUDIES).filter(covers).count() as f64 / STUDIES as f64
}

/// Numbers of quantities and of surfaces that claims have.
const CASES: [(usize, Scatter); 4] =
    [(1, independent), (9, independent), (36, structured), (72, independent)];
const SURFACES: [usize; 4] = [5, 10, 20, 50];

#[test]
fn intervals_cover_all_quantities_of_a_claim_together_however_few_the_surfaces() {
    for (quantities, samples) in CASES {
        for surfaces in SURFACES {
            let scattered = |normal: f64| 1.0 + 0.05 * normal;
            let found = coverage(samples, quantities, surfaces, scattered, 1.0);
            // Binomial: 0.013 over 300 studies; Bonferroni's bound is generous where loads share.
            assert!((0.91..=0.99).contains(&found), "{quantities} × {surfaces}: {found}");
        }
    }
}

#[test]
fn logarithms_of_skewed_areas_are_covered_as_well() {
    for (quantities, samples) in CASES {
        for surfaces in SURFACES {
            // Areas of single surfaces scatter by 0.01 to 0.1; this is lognormal with 0.25.
            let lognormal = |normal: f64| (0.25 * normal).exp();
            let truth = (0.25_f64 * 0.25 / 2.0).exp();
            let found = coverage(samples, quantities, surfaces, lognormal, truth);
            assert!((0.89..=0.99).contains(&found), "{quantities} × {surfaces}: {found}");
        }
    }
}

#[test]
fn the_jackknife_of_a_mean_is_its_standard_error() {
    let values = normal(1, 12);
    let bound = jackknife(String::new(), &[12], |weights| Some(weights.mean(&values))).unwrap();
    let expected = Weights::ALL.deviation(&values) / 12_f64.sqrt();
    assert!((bound.error / expected - 1.0).abs() < 1e-12);
}

#[test]
fn what_spectra_share_is_no_error_of_their_difference() {
    let shared = normal(2, 10);
    let [one, other] = [1.0, 1.3]
        .map(|factor| shared.iter().map(|x| factor * (0.1 * x).exp()).collect::<Vec<_>>());
    let bound = jackknife(String::new(), &[10, 10], |weights| {
        Some((weights.mean(&other) / weights.mean(&one)).ln())
    });
    assert!(bound.unwrap().error < 1e-12);
}

#[test]
fn ensembles_of_other_sizes_add_their_variances() {
    let (few, many) = (normal(3, 6), normal(4, 24));
    let error = |surfaces: &[usize], of: &dyn Fn(&Weights) -> f64| {
        jackknife(String::new(), surfaces, |weights| Some(of(weights))).unwrap().error
    };
    let alone =
        [error(&[6], &|weights| weights.mean(&few)), error(&[24], &|weights| weights.mean(&many))];
    let both = error(&[6, 24], &|weights| weights.mean(&few) - weights.mean(&many));
    assert!((both.powi(2) - alone[0].powi(2) - alone[1].powi(2)).abs() < 1e-12);
}

#[test]
fn fewer_surfaces_than_five_have_no_interval() {
    let values = normal(1, 4);
    assert_eq!(jackknife(String::new(), &[4], |weights| Some(weights.mean(&values))), None);
}
