//! The likelihood of a power law beyond a plateau, and where it is largest.

use super::RingOfSurfaces;

/// Fewer rings before the roll-off are no plateau.
pub const LEAST_PLATEAU: usize = 2;
/// Densities that fall less do not fall.
pub const FLATTEST: f64 = 1e-6;
/// The steepest power law that is looked for.
pub const STEEPEST: f64 = 20.0;
/// Steps of the searches for the exponent and for the roll-off, each of which gains digits.
const NEWTON_STEPS: usize = 50;
const GOLDEN_STEPS: usize = 40;

/// Logarithms of wavenumbers, and mean densities with their weights.
pub struct Likelihood {
    pub logs: Vec<f64>,
    /// Half the degrees of freedom of the mean.
    weights: Vec<f64>,
    densities: Vec<f64>,
}

/// The best power law beyond a roll-off.
pub struct Power {
    /// 2(1 + H).
    pub exponent: f64,
    /// The density before it.
    pub plateau: f64,
    /// Minus the logarithm of the likelihood, but for a constant.
    cost: f64,
}

impl Likelihood {
    /// Of the mean over surfaces, each so many times.
    pub fn of(rings: &[RingOfSurfaces], times: &[u32]) -> Self {
        let surfaces: f64 = times.iter().copied().map(f64::from).sum();
        let mean = |ring: &RingOfSurfaces| {
            let densities = ring.densities.iter().zip(times);
            let sum: f64 = densities.map(|(density, &times)| density * f64::from(times)).sum();
            sum / surfaces
        };
        Self {
            logs: rings.iter().map(|ring| ring.wavenumber.ln()).collect(),
            weights: rings.iter().map(|ring| 0.5 * ring.freedom * surfaces).collect(),
            densities: rings.iter().map(mean).collect(),
        }
    }

    /// How many rings lie before the best roll-off, and its logarithm.
    pub fn rolloff(&self) -> (usize, f64) {
        let last = self.logs.len() - LEAST_PLATEAU;
        let cost = |rolloff: f64| self.power(rolloff).cost;
        let costs: Vec<f64> = self.logs[..last].iter().map(|&log| cost(log)).collect();
        let best = (0..last).min_by(|&one, &other| costs[one].total_cmp(&costs[other]));
        let best = best.unwrap_or(0);
        let (mut low, mut high) = (self.logs[best.saturating_sub(1)], self.logs[best + 1]);
        let golden = 0.5 * (5_f64.sqrt() - 1.0);
        let mut inner = [high - golden * (high - low), low + golden * (high - low)];
        let mut values = inner.map(cost);
        for _ in 0..GOLDEN_STEPS {
            if values[0] < values[1] {
                high = inner[1];
                inner = [high - golden * (high - low), inner[0]];
                values = [cost(inner[0]), values[0]];
            } else {
                low = inner[0];
                inner = [inner[1], low + golden * (high - low)];
                values = [values[1], cost(inner[1])];
            }
        }
        let rolloff = 0.5 * (low + high);
        let before = self.logs.iter().filter(|&&log| log < rolloff).count();
        (before, rolloff)
    }

    /// The best exponent and plateau for a roll-off: the root of the slope of a convex function.
    pub fn power(&self, rolloff: f64) -> Power {
        let beyond = || self.logs.iter().map(|log| (log - rolloff).max(0.0));
        let total: f64 = self.weights.iter().sum();
        let first: f64 = beyond().zip(&self.weights).map(|(x, weight)| x * weight).sum();
        let sums = |exponent: f64| {
            let mut sums = [0.0; 3];
            for ((x, weight), density) in beyond().zip(&self.weights).zip(&self.densities) {
                let part = weight * density * (exponent * x).exp();
                sums[0] += part;
                sums[1] += x * part;
                sums[2] += x * x * part;
            }
            sums
        };
        let (mut low, mut high) = (0.0, STEEPEST);
        let mut exponent = 3.0;
        for _ in 0..NEWTON_STEPS {
            let [zeroth, one, two] = sums(exponent);
            let mean = one / zeroth;
            let slope = total * mean - first;
            let bend = total * (two / zeroth - mean * mean);
            match slope < 0.0 {
                true => low = exponent,
                false => high = exponent,
            }
            let newton = exponent - slope / bend;
            let next = match newton > low && newton < high {
                true => newton,
                false => 0.5 * (low + high),
            };
            if (next - exponent).abs() < 1e-12 {
                break;
            }
            exponent = next;
        }
        let plateau = sums(exponent)[0] / total;
        Power { exponent, plateau, cost: total * plateau.ln() - exponent * first }
    }

    /// The weighted root mean square of ln P/C, and the mean of the squared deviations of P/C over
    /// their variances.
    pub fn residuals(&self, rolloff: f64, power: &Power) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for ((log, weight), density) in self.logs.iter().zip(&self.weights).zip(&self.densities) {
            let law = power.plateau * (-power.exponent * (log - rolloff).max(0.0)).exp();
            let ratio = density / law;
            sums[0] += weight * ratio.ln().powi(2);
            sums[1] += weight * (ratio - 1.0).powi(2);
            sums[2] += weight;
        }
        // The variance of the mean of n pairs of modes is 1/n.
        let freedom = self.logs.len() as f64 - 3.0;
        [(sums[0] / sums[2]).sqrt(), sums[1] / freedom]
    }
}
