//! Residuals of the contact evolution law, with the parameters that are free in each kind of fit.

use super::{EvolutionProblem, Quantity};
use crate::least_squares::Residuals;
use asperity_contact::theory::law::ContactEvolution;

/// Residuals of a law against a mean curve, and their derivatives by (ln β, ln μ, ln κ).
#[derive(Clone, Copy)]
pub struct Model<'a> {
    pub problem: &'a EvolutionProblem,
    pub mean: &'a [f64],
}

impl Model<'_> {
    pub fn residuals(self, law: &ContactEvolution, into: &mut [f64]) {
        let loads = &self.problem.data.loads;
        for (i, residual) in into.iter_mut().enumerate() {
            *residual =
                self.problem.scales[i] * (self.problem.predict(law, loads[i]) - self.mean[i]);
        }
    }

    pub fn gradient(self, law: &ContactEvolution, datum: usize) -> [f64; 3] {
        let load = self.problem.data.loads[datum];
        let gradient = match self.problem.quantity {
            Quantity::Area => law.area_gradient(load),
            Quantity::Slope => law.slope_gradient(load),
        };
        gradient.map(|derivative| self.problem.scales[datum] * derivative)
    }
}

/// β and μ fitted, κ kept.
pub struct GivenKappa<'a>(pub Model<'a>, pub f64);

impl GivenKappa<'_> {
    pub fn law(&self, [ln_beta, ln_mu]: [f64; 2]) -> ContactEvolution {
        ContactEvolution { kappa: self.1, beta: ln_beta.exp(), mu: ln_mu.exp() }
    }
}

impl Residuals<2> for GivenKappa<'_> {
    fn count(&self) -> usize {
        self.0.mean.len()
    }

    fn residuals(&self, parameters: [f64; 2], into: &mut [f64]) {
        self.0.residuals(&self.law(parameters), into);
    }

    fn gradients(&self, parameters: [f64; 2], into: &mut [[f64; 2]]) {
        let law = self.law(parameters);
        for (datum, gradient) in into.iter_mut().enumerate() {
            let [by_beta, by_mu, _] = self.0.gradient(&law, datum);
            *gradient = [by_beta, by_mu];
        }
    }
}

/// β, μ and κ fitted.
pub struct FreeKappa<'a>(pub Model<'a>);

impl FreeKappa<'_> {
    pub fn law([ln_beta, ln_mu, ln_kappa]: [f64; 3]) -> ContactEvolution {
        ContactEvolution { kappa: ln_kappa.exp(), beta: ln_beta.exp(), mu: ln_mu.exp() }
    }
}

impl Residuals<3> for FreeKappa<'_> {
    fn count(&self) -> usize {
        self.0.mean.len()
    }

    fn residuals(&self, parameters: [f64; 3], into: &mut [f64]) {
        self.0.residuals(&Self::law(parameters), into);
    }

    fn gradients(&self, parameters: [f64; 3], into: &mut [[f64; 3]]) {
        let law = Self::law(parameters);
        for (datum, gradient) in into.iter_mut().enumerate() {
            *gradient = self.0.gradient(&law, datum);
        }
    }
}

/// The law with μ = 1, a = Y/(1 + βY): β is its one parameter.
pub struct Hyperbola<'a>(pub Model<'a>, pub f64);

impl Hyperbola<'_> {
    pub fn law(&self, [ln_beta]: [f64; 1]) -> ContactEvolution {
        ContactEvolution { kappa: self.1, beta: ln_beta.exp(), mu: 1.0 }
    }
}

impl Residuals<1> for Hyperbola<'_> {
    fn count(&self) -> usize {
        self.0.mean.len()
    }

    fn residuals(&self, parameters: [f64; 1], into: &mut [f64]) {
        self.0.residuals(&self.law(parameters), into);
    }

    fn gradients(&self, parameters: [f64; 1], into: &mut [[f64; 1]]) {
        let law = self.law(parameters);
        for (datum, gradient) in into.iter_mut().enumerate() {
            *gradient = [self.0.gradient(&law, datum)[0]];
        }
    }
}
