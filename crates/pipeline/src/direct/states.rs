//! Contact with adhesion: states of a path, each of which starts from the one before.

use super::{Solved, bits};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_stages::StageError;
use asperity_stages::columns::{CONTACT, GAPS, MEAN_DISPLACEMENT, REPULSIVE};
use asperity_stages::solve::adhesion::{ContactPath, Params};
use asperity_tables::table::Table;

/// Finished states of a path.
pub struct States {
    path: ContactPath,
    /// Heights in the unit of the surface.
    heights: Vec<f64>,
    /// Maps of each state; empty if only contact maps are kept.
    maps: Vec<Maps>,
}

/// Maps of a state in the units of the modulus and of the surface.
struct Maps {
    pressure: Vec<f64>,
    /// Gaps, or `None` if the surfaces are apart.
    gap: Option<Vec<f64>>,
}

impl States {
    /// Prepares a path on a surface, whose row has its rms slope.
    pub fn new(
        params: &Params,
        surface: Surface,
        row: Table,
        threads: Threads,
    ) -> Result<States, StageError> {
        let heights = surface.heights().to_vec();
        let path = ContactPath::new(params, surface, &row, threads)?;
        Ok(States { path, heights, maps: Vec::new() })
    }

    /// Reads a map of bits of a state from the table.
    fn map(&self, state: usize, column: &str) -> Option<Vec<bool>> {
        let bytes = self.path.row(state)?.bytes(column).ok()?;
        Some(bits(bytes.value(0), self.heights.len()))
    }
}

impl Solved for States {
    fn set_threads(&mut self, threads: Threads) {
        self.path.set_threads(threads);
    }

    fn press(
        &mut self,
        keeps_fields: bool,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<bool, StageError> {
        let is_solved = self.path.step(interrupted)?;
        if is_solved && keeps_fields {
            self.maps.push(Maps { pressure: self.path.pressure(), gap: self.path.gap() });
        }
        Ok(is_solved)
    }

    fn count(&self) -> usize {
        self.path.count()
    }

    /// Returns the table without the gaps, from which a stored path would continue.
    fn table(&self) -> Result<Table, StageError> {
        Ok(self.path.table()?.without(&[GAPS.name]))
    }

    fn contact(&self, state: usize) -> Option<Vec<bool>> {
        self.map(state, CONTACT.name)
    }

    fn repulsive(&self, state: usize) -> Option<Vec<bool>> {
        self.map(state, REPULSIVE.name)
    }

    fn pressure(&self, state: usize) -> Option<Vec<f64>> {
        Some(self.maps.get(state)?.pressure.clone())
    }

    /// Returns the displacements u = g + h + δ. The offset δ follows from their mean. They are zero
    /// if the surfaces are apart.
    fn displacement(&mut self, state: usize) -> Option<Vec<f64>> {
        let Some(gap) = &self.maps.get(state)?.gap else {
            return Some(vec![0.0; self.heights.len()]);
        };
        let mean = match self.path.row(state)?.reals(MEAN_DISPLACEMENT.name) {
            Ok(displacement) => displacement.value(0),
            // A periodic body has no such column: a uniform pressure does not displace it.
            Err(_) => 0.0,
        };
        let mut displacement: Vec<f64> =
            gap.iter().zip(&self.heights).map(|(g, h)| g + h).collect();
        let found = displacement.iter().sum::<f64>() / displacement.len() as f64;
        displacement.iter_mut().for_each(|u| *u += mean - found);
        Some(displacement)
    }

    fn gap(&mut self, state: usize) -> Option<Vec<f64>> {
        let apart = || vec![f64::INFINITY; self.heights.len()];
        Some(self.maps.get(state)?.gap.clone().unwrap_or_else(apart))
    }
}
