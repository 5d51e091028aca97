//! Length of a step d of the gap at which the energy along it is lowest.
//!
//! With the force λ = dF/dg at the nodes, the elastic pressure S d of the step, and the attraction
//! a = (w/ρ) exp(−g/ρ), the derivative of the energy at g + αd is
//!
//! ```text
//! f(α) = Σ d λ + α Σ d S d + Σ d a (exp(−αd/ρ) − 1)
//! ```
//!
//! Where steps are short beside ρ, three terms of the series of the last sum are enough. They need
//! no further pass over the mesh.

use super::AdhesivePath;
use super::exponential::exponential;
use super::passes::visit;

/// Longest step, in units of the range ρ, for which the series is used.
const SERIES_REACH: f64 = 0.3;

/// Slope at the end of the search, as a fraction of the slope at the beginning.
const SLOPE_LEFT: f64 = 1e-3;

/// Maximum number of trials, far more than usual.
const TRIALS: u32 = 40;

/// Sums that describe the energy along a step, in the units of the solver times the nodes.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Σ d λ, negative for a step that lowers the energy.
    pub slope: f64,
    /// Σ d S d.
    pub stiffness: f64,
    /// Σ a d² / ρ, Σ a d³ / ρ² and Σ a d⁴ / ρ³.
    pub attraction: [f64; 3],
    /// First-order decrease of the energy by a clipped step down the gradient.
    pub gradient_gain: f64,
    /// Largest |d|/ρ where attraction matters.
    pub reach: f64,
    /// Largest α for which no gap is negative; at least one.
    pub longest: f64,
}

impl AdhesivePath {
    /// Returns the α > 0 of the first minimum of the energy that the search finds, and the α at
    /// which the derivative would vanish. The derivative is negative up to the first α. Both differ
    /// where a larger first α would not be feasible.
    pub(super) fn best(&self, line: &Line) -> [f64; 2] {
        let curvature = line.stiffness - line.attraction[0];
        let first = if curvature > 0.0 { -line.slope / curvature } else { 1.0 };
        let mut at = first.clamp(0.1, line.longest);
        let (mut below, mut above, mut wanted) = (0.0, f64::INFINITY, None);
        for _ in 0..TRIALS {
            let [slope, curvature] = self.derivatives(line, at);
            if slope.abs() < SLOPE_LEFT * -line.slope {
                break;
            }
            if slope < 0.0 {
                below = at;
                if at >= line.longest {
                    let newton = if curvature > 0.0 { at - slope / curvature } else { f64::MAX };
                    wanted = Some(newton.min(2.0 * at));
                    break;
                }
            } else {
                above = at;
            }
            let newton = if curvature > 0.0 { at - slope / curvature } else { f64::NAN };
            at = if newton > below && newton < above {
                newton.min(2.0 * at)
            } else if above.is_finite() {
                0.5 * (below + above)
            } else {
                2.0 * at
            };
            at = at.min(line.longest);
        }
        [at, wanted.unwrap_or(at)]
    }

    /// Returns f(α) and its derivative.
    fn derivatives(&self, line: &Line, at: f64) -> [f64; 2] {
        let [second, third, fourth] = line.attraction;
        let [of_slope, of_curvature] = if at * line.reach <= SERIES_REACH {
            [
                -at * (second - at * (third / 2.0 - at * fourth / 6.0)),
                -(second - at * (third - at * fourth / 2.0)),
            ]
        } else {
            let range = self.adhesion.range;
            let terms = move |[pull, step]: [f64; 2]| {
                let exponent = -at * step / range;
                let factor = exponential(exponent);
                [pull * step * (factor - 1.0), -pull * step * step * factor / range]
            };
            let (threads, domain) = (&self.threads, self.body.domain);
            let inputs = [&self.fields.pull[..], &self.fields.step[..]];
            visit(threads, domain, inputs, [], |_, x, []| ([], terms(x), [0.0; 0])).sums
        };
        [line.slope + at * line.stiffness + of_slope, line.stiffness + of_curvature]
    }
}
