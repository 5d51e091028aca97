//! What a solver knows between two loads, as bytes: everything that its guess at the next load, and
//! so that load's last bits, depend on.

use std::io::{self, Read, Write};

use super::Solver;
use super::steps::Steps;

impl Solver {
    /// Writes what the next load depends on: 24 bytes a node.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        let numbers = [
            self.search.load,
            self.earlier_load,
            self.search.reference,
            self.earlier_reference,
            self.offset,
            self.earlier_offset,
            self.search.height_reference,
            self.yields_from,
            self.contact_nodes,
            self.earlier_contact_nodes,
        ];
        let steps = [&self.search.steps, &self.search.nested_steps];
        let steps = steps.into_iter().flat_map(|steps| steps.all());
        for number in numbers.iter().chain(steps) {
            out.write_all(&number.to_le_bytes())?;
        }
        for pressure in &self.pressure {
            out.write_all(&pressure.to_le_bytes())?;
        }
        for field in
            [&self.earlier_pressure, &self.search.gap, &self.earlier_gap, &self.search.carry]
        {
            for value in field {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// Makes a new solver of the same surface, body and hardness go on where another one was.
    ///
    /// # Errors
    /// When there are fewer bytes than [`Solver::save`] has written; the solver is of no use then.
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
        self.search.steps = Steps::restored(|| double(from))?;
        self.search.nested_steps = Steps::restored(|| double(from))?;
        for pressure in &mut self.pressure {
            *pressure = double(from)?;
        }
        for field in [
            &mut self.earlier_pressure,
            &mut self.search.gap,
            &mut self.earlier_gap,
            &mut self.search.carry,
        ] {
            for value in field {
                let mut bytes = [0; 4];
                from.read_exact(&mut bytes)?;
                *value = f32::from_le_bytes(bytes);
            }
        }
        (self.search.load, self.earlier_load) = (load, earlier_load);
        (self.search.reference, self.earlier_reference) = (reference, earlier_reference);
        (self.offset, self.earlier_offset) = (offset, earlier_offset);
        self.count_heights_from(heights);
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
    use super::*;
    use crate::elasticity::PeriodicHalfSpace;
    use crate::grid::Grid;
    use crate::solver::{Hardness, Settings};
    use crate::topography::random::{Amplitude, RandomSurface};
    use crate::topography::spectrum::Spectrum;

    fn solver(seed: u64, hardness: Option<f64>) -> Solver {
        let grid = Grid::square(48, 1.0).unwrap();
        let spectrum =
            Spectrum { hurst: 0.8, k_lower: 1, k_rolloff: 1, k_upper: 12, anisotropy: None };
        let surface = RandomSurface {
            spectrum,
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed,
            realization: 0,
        };
        let hardness = hardness.map(|pressure| Hardness::new(pressure).unwrap());
        let body = PeriodicHalfSpace::new(grid);
        Solver::yielding(body, hardness, surface.draw(grid).heights())
    }

    fn press(solver: &mut Solver, load: f64, settings: &Settings) -> (String, Vec<u64>) {
        let outcome = solver.press(load, settings, &|| false);
        let bits = solver.pressure().iter().map(|p| p.to_bits()).collect();
        // Where there is no mean gap it is no number, which equals none.
        (format!("{outcome:?}"), bits)
    }

    /// From the lightest, where heights are the guess, to full contact, and back.
    const LOADS: [f64; 12] = [1e-9, 1e-5, 2e-5, 0.001, 0.01, 0.02, 0.03, 0.2, 0.5, 1.0, 4.0, 0.1];

    #[test]
    fn a_solver_goes_on_with_the_same_bits_from_any_load() {
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
