//! Displacement and gap under a given pressure.

use super::Solver;

impl Solver {
    /// Returns the displacement u of the elastic body under `pressure`, with one pressure per node.
    ///
    /// The pressure is in units of E* × rms slope, the displacement in units of rms slope × longer
    /// side and positive into the body. The mean displacement is zero for a body that a uniform
    /// pressure does not displace.
    ///
    /// # Panics
    ///
    /// Panics if the number of pressures differs from the number of nodes.
    ///
    /// ```
    /// use std::f64::consts::PI;
    ///
    /// use asperity_contact::elasticity::PeriodicHalfSpace;
    /// use asperity_contact::grid::Grid;
    /// use asperity_contact::solver::Solver;
    ///
    /// // A pressure wave of wavelength λ causes a displacement of λ/(π E*) times the pressure.
    /// let grid = Grid::square(32, 1.0)?;
    /// let cosine = |node: usize| (2.0 * PI * grid.indices(node)[0] as f64 / 32.0).cos();
    /// let pressure: Vec<f64> = (0..grid.count()).map(cosine).collect();
    /// let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &vec![0.0; grid.count()]);
    /// let displacement = solver.displacement_under(&pressure);
    /// for (u, p) in displacement.iter().zip(&pressure) {
    ///     assert!((u - p / PI).abs() < 1e-15);
    /// }
    /// # Ok::<(), asperity_contact::grid::GridError>(())
    /// ```
    pub fn displacement_under(&mut self, pressure: &[f64]) -> Vec<f64> {
        assert_eq!(pressure.len(), self.pressure.len(), "one pressure per node");
        let mut displacement = vec![0.0; pressure.len()];
        let scratch = &mut self.double_scratch;
        self.problem.transform.convolve(
            &self.problem.displacement,
            pressure,
            &mut displacement,
            scratch,
        );
        displacement
    }

    /// Returns the gap between the bodies under a pressure that solves the contact.
    ///
    /// The gap is u − h minus its mean in elastic contact, in the units of
    /// [`Solver::displacement_under`]. At nodes in elastic contact it is set to zero; the solution
    /// deviates from zero there by at most the residual. At saturated nodes the gap is negative, by
    /// the yielded depth. Elsewhere it is positive, except for the residual. If no node is in
    /// elastic contact, the mean is over all nodes with pressure.
    ///
    /// # Panics
    ///
    /// Panics if the number of pressures differs from the number of nodes.
    pub fn gap_under(&mut self, pressure: &[f64]) -> Vec<f64> {
        let hardness = self.problem.hardness.map_or(f64::INFINITY, |bound| bound.pressure());
        let mut gap = self.displacement_under(pressure);
        for (gap, height) in gap.iter_mut().zip(&self.problem.heights) {
            *gap -= height;
        }
        let is_elastic = |pressure: f64| pressure > 0.0 && pressure < hardness;
        let mean = mean_where(&gap, pressure, is_elastic);
        let offset = mean.or_else(|| mean_where(&gap, pressure, |pressure| pressure > 0.0));
        let offset = offset.unwrap_or_default();
        for (gap, &pressure) in gap.iter_mut().zip(pressure) {
            *gap = if is_elastic(pressure) { 0.0 } else { *gap - offset };
        }
        gap
    }
}

/// Returns the mean of `values` over the nodes whose pressure satisfies `is_so`, or `None` if there
/// are no such nodes.
fn mean_where(values: &[f64], pressure: &[f64], is_so: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (value, _) in values.iter().zip(pressure).filter(|(_, p)| is_so(**p)) {
        sum += value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use crate::grid::{Boundary, Grid};
    use crate::solver::{HalfSpace, Hardness, Settings, Solver, Stop};
    use crate::topography::random::samples;

    fn solver_of(body: HalfSpace) -> Solver {
        let surface = samples::random(1, 16, 3);
        let grid = Grid::square(64, 1.0).unwrap();
        body.solver(grid, surface.draw(grid).heights())
    }

    fn body(boundary: Boundary, hardness: Option<f64>) -> HalfSpace {
        let hardness = hardness.map(|pressure| Hardness::new(pressure).unwrap());
        HalfSpace { boundary, hardness }
    }

    #[test]
    fn the_mean_gap_is_that_of_the_outcome() {
        for boundary in [Boundary::Periodic, Boundary::Free] {
            let mut solver = solver_of(body(boundary, None));
            let outcome = solver.press(0.05, &Settings::default(), &|| false);
            assert_eq!(outcome.stop, Stop::Converged);
            let pressure = solver.pressure().to_vec();
            let gap = solver.gap_under(&pressure);
            let mean = gap.iter().sum::<f64>() / gap.len() as f64;
            assert!((mean - outcome.mean_gap).abs() < 1e-6 * outcome.mean_gap);
            let penetration = gap.iter().fold(0.0, |least: f64, gap| least.min(*gap));
            assert!(-penetration * 64.0 <= 1.01 * outcome.residual, "{penetration}");
            let product: f64 = gap.iter().zip(&pressure).map(|(g, p)| g * p).sum();
            assert_eq!(product, 0.0);
        }
    }

    #[test]
    fn the_gap_of_yielded_material_is_minus_the_depth_of_the_outcome() {
        let mut solver = solver_of(body(Boundary::Periodic, Some(0.3)));
        let outcome = solver.press(0.1, &Settings::default(), &|| false);
        let pressure = solver.pressure().to_vec();
        let gap = solver.gap_under(&pressure);
        let saturated = gap.iter().zip(&pressure).filter(|(_, p)| **p >= 0.3);
        let depth: f64 = saturated.map(|(gap, _)| -gap).sum::<f64>() / gap.len() as f64;
        assert!(outcome.saturated_nodes > 0);
        assert!((depth - outcome.yielded_depth).abs() < 1e-4 * outcome.yielded_depth);
    }
}
