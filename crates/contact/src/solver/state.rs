//! Displacement and gap under a given pressure, and the state of a solver between two loads.
//!
//! The state contains everything on which the next initial guess depends, and with it the last bits
//! of the next solution.

use std::io;
use std::io::{Read, Write};

use super::Solver;
use super::line_search::StepLengths;

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
        self.double.convolve(&self.displacement, pressure, &mut displacement, scratch);
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
        let hardness = self.hardness.map_or(f64::INFINITY, |bound| bound.pressure());
        let mut gap = self.displacement_under(pressure);
        for (gap, height) in gap.iter_mut().zip(&self.heights) {
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

impl Solver {
    /// Writes the state on which the solution of the next load depends, 24 bytes per node.
    ///
    /// # Errors
    ///
    /// Fails if writing fails.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        let numbers = [
            self.inner.load,
            self.earlier_load,
            self.inner.reference,
            self.earlier_reference,
            self.offset,
            self.earlier_offset,
            self.inner.height_reference,
            self.yields_from,
            self.contact_nodes,
            self.earlier_contact_nodes,
        ];
        let step_lengths = [&self.inner.step_lengths, &self.inner.nested_step_lengths];
        let step_lengths = step_lengths.into_iter().flat_map(|step_lengths| step_lengths.all());
        for number in numbers.iter().chain(step_lengths) {
            out.write_all(&number.to_le_bytes())?;
        }
        for pressure in &self.pressure {
            out.write_all(&pressure.to_le_bytes())?;
        }
        for field in
            [&self.earlier_pressure, &self.inner.gap, &self.earlier_gap, &self.inner.last_step]
        {
            for value in field {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// Restores the state that [`Solver::save`] wrote for a solver of the same surface, body and
    /// hardness.
    ///
    /// # Errors
    ///
    /// Fails if there are fewer bytes than [`Solver::save`] wrote; the solver must not be used
    /// then.
    pub fn restore(&mut self, from: &mut dyn Read) -> io::Result<()> {
        let mut numbers = [0.0; 10];
        for number in &mut numbers {
            *number = double(from)?;
        }
        let [
            load,
            earlier_load,
            reference,
            earlier_reference,
            offset,
            earlier_offset,
            heights,
            yields,
            contact_nodes,
            earlier_contact_nodes,
        ] = numbers;
        self.inner.step_lengths = StepLengths::restored(|| double(from))?;
        self.inner.nested_step_lengths = StepLengths::restored(|| double(from))?;
        for pressure in &mut self.pressure {
            *pressure = double(from)?;
        }
        for field in [
            &mut self.earlier_pressure,
            &mut self.inner.gap,
            &mut self.earlier_gap,
            &mut self.inner.last_step,
        ] {
            for value in field {
                let mut bytes = [0; 4];
                from.read_exact(&mut bytes)?;
                *value = f32::from_le_bytes(bytes);
            }
        }
        (self.inner.load, self.earlier_load) = (load, earlier_load);
        (self.inner.reference, self.earlier_reference) = (reference, earlier_reference);
        (self.offset, self.earlier_offset) = (offset, earlier_offset);
        self.set_height_reference(heights);
        self.yields_from = yields;
        (self.contact_nodes, self.earlier_contact_nodes) = (contact_nodes, earlier_contact_nodes);
        Ok(())
    }
}

fn double(from: &mut dyn Read) -> io::Result<f64> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(f64::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use crate::elasticity::PeriodicHalfSpace;
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

    fn solver(seed: u64, hardness: Option<f64>) -> Solver {
        let grid = Grid::square(48, 1.0).unwrap();
        let surface = samples::random(1, 12, seed);
        let hardness = hardness.map(|pressure| Hardness::new(pressure).unwrap());
        let body = PeriodicHalfSpace::new(grid);
        Solver::with_hardness(body, hardness, surface.draw(grid).heights())
    }

    fn press(solver: &mut Solver, load: f64, settings: &Settings) -> (String, Vec<u64>) {
        let outcome = solver.press(load, settings, &|| false);
        let bits = solver.pressure().iter().map(|p| p.to_bits()).collect();
        // A missing mean gap is NaN, which is not equal to itself.
        (format!("{outcome:?}"), bits)
    }

    /// Loads from a light one, whose guess comes from the heights, to full contact, and then a
    /// smaller one.
    const LOADS: [f64; 12] = [1e-9, 1e-5, 2e-5, 0.001, 0.01, 0.02, 0.03, 0.2, 0.5, 1.0, 4.0, 0.1];

    #[test]
    fn a_restored_solver_continues_with_the_same_bits_from_any_load() {
        for (seed, tolerance, hardness) in [(1, 6e-5, None), (2, 1e-8, None), (3, 6e-5, Some(5.0))]
        {
            let settings = Settings { tolerance, ..Settings::default() };
            let mut undisturbed = solver(seed, hardness);
            for begin in 0..LOADS.len() {
                let mut bytes = Vec::new();
                undisturbed.save(&mut bytes).unwrap();
                let mut restored = solver(seed, hardness);
                restored.restore(&mut bytes.as_slice()).unwrap();
                let mut expected = solver(seed, hardness);
                for &load in &LOADS[..begin] {
                    press(&mut expected, load, &settings);
                }
                for &load in &LOADS[begin..] {
                    let (one, other) = (
                        press(&mut restored, load, &settings),
                        press(&mut expected, load, &settings),
                    );
                    assert!(one == other, "from {begin}, at {load}: {} {}", one.0, other.0);
                }
                press(&mut undisturbed, LOADS[begin], &settings);
            }
        }
    }

    #[test]
    fn too_few_bytes_are_an_error() {
        let mut bytes = Vec::new();
        solver(1, None).save(&mut bytes).unwrap();
        assert!(solver(1, None).restore(&mut &bytes[1..]).is_err());
    }
}
