//! Contact without adhesion: loads that do not depend on each other.

use super::{Solved, bits};
use asperity_contact::solver::Solver;
use asperity_contact::threads::Threads;
use asperity_contact::topography::surface::Surface;
use asperity_stages::StageError;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::solve::{Contact, Params, SolvedLoad};
use asperity_tables::table::Table;

/// Finished loads of a contact without adhesion.
pub struct Loads {
    contact: Contact,
    solver: Solver,
    /// Row of the surface, as in the table of a `generate` stage.
    row: Table,
    loads: Vec<SolvedLoad>,
    /// Pressures of the nodes in contact under each load, in units of E* × rms slope.
    pressures: Vec<Vec<f64>>,
}

impl Loads {
    /// Prepares a surface, whose row has its rms slope.
    pub fn new(
        params: &Params,
        surface: Surface,
        row: Table,
        threads: Threads,
    ) -> Result<Loads, StageError> {
        let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
        let (contact, solver) = Contact::new(params, surface, rms_slope, threads, &|| false)?;
        Ok(Loads { contact, solver, row, loads: Vec::new(), pressures: Vec::new() })
    }

    /// Returns the pressures under a load in units of E* × rms slope, row-major.
    fn reduced_pressure(&self, load: usize) -> Option<Vec<f64>> {
        let mut kept = self.pressures.get(load)?.iter();
        let contact = self.contact(load)?.into_iter();
        let pressure = contact.map(|touches| {
            if touches { *kept.next().expect("every node in contact has one") } else { 0.0 }
        });
        Some(pressure.collect())
    }
}

impl Solved for Loads {
    fn set_threads(&mut self, threads: Threads) {
        self.solver.set_threads(threads);
    }

    fn press(
        &mut self,
        keeps_fields: bool,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<bool, StageError> {
        let Some(&load) = self.contact.loads().get(self.count()) else { return Ok(false) };
        let solved = self.contact.solve(&mut self.solver, load, &interrupted)?;
        if keeps_fields {
            let pressure = self.solver.pressure().iter().copied();
            self.pressures.push(pressure.filter(|p| *p > 0.0).collect());
        }
        self.loads.push(solved);
        Ok(true)
    }

    fn count(&self) -> usize {
        self.loads.len()
    }

    fn table(&self) -> Result<Table, StageError> {
        Ok(self.contact.table(&self.row, self.loads.clone()))
    }

    fn contact(&self, load: usize) -> Option<Vec<bool>> {
        Some(bits(&self.loads.get(load)?.contact, self.contact.grid().count()))
    }

    /// Returns the contact map, because pressures are positive in contact.
    fn repulsive(&self, load: usize) -> Option<Vec<bool>> {
        self.contact(load)
    }

    fn pressure(&self, load: usize) -> Option<Vec<f64>> {
        let unit = self.contact.scales().pressure();
        let mut pressure = self.reduced_pressure(load)?;
        pressure.iter_mut().for_each(|p| *p *= unit);
        Some(pressure)
    }

    fn displacement(&mut self, load: usize) -> Option<Vec<f64>> {
        let pressure = self.reduced_pressure(load)?;
        Some(self.contact.in_length(self.solver.displacement_under(&pressure)))
    }

    fn gap(&mut self, load: usize) -> Option<Vec<f64>> {
        let pressure = self.reduced_pressure(load)?;
        Some(self.contact.in_length(self.solver.gap_under(&pressure)))
    }
}
