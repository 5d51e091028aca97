//! Seeded normal random numbers for synthetic data.

use std::f64::consts::PI;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Generator of standard normal numbers by the method of Box & Muller (1958).
pub(crate) struct Normals(ChaCha8Rng);

impl Normals {
    pub fn new(key: [u8; 32], stream: u64) -> Normals {
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream(stream);
        Normals(random)
    }

    pub fn next(&mut self) -> f64 {
        // The numbers are odd multiples of 2⁻⁵⁴ and therefore never zero.
        let mut uniform = || ((self.0.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53);
        let radius = (-2.0 * libm::log(uniform())).sqrt();
        radius * libm::cos(2.0 * PI * uniform())
    }
}

/// Returns `count` standard normal numbers that depend only on the seed.
pub fn normal(seed: u64, count: usize) -> Vec<f64> {
    let mut normals = Normals::new([7; 32], seed);
    (0..count).map(|_| normals.next()).collect()
}

/// Synthetic curves for the tests of the fits.
#[cfg(test)]
pub(crate) mod curves {
    use asperity_mechanics::theory::law::ContactEvolution;
    use asperity_mechanics::theory::persson;

    use super::normal;
    use crate::Curves;

    /// Area fractions of the Bush-Gibson-Thomas model for Nayak parameter 2.
    ///
    /// The loads are `uniform(0.06, 50)`, 50 equidistant loads up to 0.06. Elliptic Hertz contacts
    /// are integrated over Nayak's joint density of summits.
    pub const BGT_ALPHA_2: [f64; 50] = [
        0.00286736, 0.00567541, 0.00844429, 0.01118041, 0.01388736, 0.01656753, 0.01922265,
        0.02185406, 0.02446286, 0.02704992, 0.02961602, 0.03216181, 0.03468788, 0.03719475,
        0.03968287, 0.04215269, 0.04460457, 0.04703889, 0.04945599, 0.05185617, 0.05423973,
        0.05660695, 0.05895810, 0.06129343, 0.06361318, 0.06591758, 0.06820686, 0.07048124,
        0.07274092, 0.07498610, 0.07721698, 0.07943376, 0.08163662, 0.08382573, 0.08600129,
        0.08816346, 0.09031242, 0.09244833, 0.09457136, 0.09668167, 0.09877942, 0.10086476,
        0.10293786, 0.10499886, 0.10704791, 0.10908516, 0.11111076, 0.11312486, 0.11512759,
        0.11711909,
    ];

    /// Area fractions of the Bush-Gibson-Thomas model for Nayak parameter 10, at the loads of
    /// [`BGT_ALPHA_2`].
    pub const BGT_ALPHA_10: [f64; 50] = [
        0.00233657, 0.00455908, 0.00672708, 0.00885607, 0.01095398, 0.01302575, 0.01507478,
        0.01710359, 0.01911410, 0.02110785, 0.02308611, 0.02504993, 0.02700021, 0.02893772,
        0.03086313, 0.03277704, 0.03467997, 0.03657239, 0.03845473, 0.04032737, 0.04219067,
        0.04404494, 0.04589048, 0.04772757, 0.04955645, 0.05137736, 0.05319052, 0.05499613,
        0.05679439, 0.05858547, 0.06036955, 0.06214678, 0.06391732, 0.06568131, 0.06743889,
        0.06919018, 0.07093531, 0.07267439, 0.07440754, 0.07613487, 0.07785647, 0.07957244,
        0.08128288, 0.08298788, 0.08468752, 0.08638189, 0.08807107, 0.08975513, 0.09143415,
        0.09310821,
    ];

    /// Returns the loads `to`/`steps`, 2 `to`/`steps`, …, `to`.
    pub fn uniform(to: f64, steps: u32) -> Vec<f64> {
        (1..=steps).map(|i| to * f64::from(i) / f64::from(steps)).collect()
    }

    /// Returns the curve of one surface with the given areas at 50 equidistant loads up to 0.06.
    pub fn single(areas: &[f64]) -> Curves {
        Curves::new(uniform(0.06, 50), vec![areas.to_vec()]).expect("well formed")
    }

    /// Returns the curve of one surface that follows Persson's theory.
    pub fn persson_curve(loads: Vec<f64>) -> Curves {
        let areas = loads.iter().map(|&load| persson::area(load)).collect();
        Curves::new(loads, vec![areas]).expect("well formed")
    }

    /// Returns curves of surfaces that follow `law` with random deviations.
    ///
    /// The loads of each surface are multiplied by a common random factor with the relative
    /// standard deviation `factor`. Each area has an independent relative error of standard
    /// deviation `noise`.
    pub fn scattered(
        law: ContactEvolution,
        loads: Vec<f64>,
        surfaces: usize,
        (factor, noise): (f64, f64),
        seed: u64,
    ) -> Curves {
        let draws = normal(seed, surfaces * (loads.len() + 1));
        let areas = draws
            .chunks(loads.len() + 1)
            .map(|draws| {
                let own = 1.0 + factor * draws[0];
                let noisy =
                    |(&load, draw): (&f64, &f64)| law.area(load * own) * (1.0 + noise * draw);
                loads.iter().zip(&draws[1..]).map(noisy).collect()
            })
            .collect();
        Curves::new(loads, areas).expect("well formed")
    }
}
