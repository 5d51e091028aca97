//! Contact without adhesion: loads that do not depend on each other, on the branches of a path.

use std::sync::Arc;

use super::{Solved, bits};
use asperity_mechanics::solver::Solver;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_stages::StageError;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::solve::{Contact, Params, SolvedLoad, gap_under};
use asperity_tables::table::Table;

/// Finished loads of a contact without adhesion.
pub struct Loads {
    /// Branches of the path; a single one without a path.
    branches: Vec<Branch>,
    /// Row of the surface, as in the table of a `generate` stage.
    row: Table,
    /// Pressures of the nodes in contact under each load, in units of E* × rms slope.
    pressures: Vec<Vec<f64>>,
}

/// Contact of one branch of a path, with its finished loads.
struct Branch {
    contact: Contact,
    solver: Solver,
    loads: Vec<SolvedLoad>,
}

impl Loads {
    /// Prepares a surface, whose row has its rms slope.
    pub fn new(
        params: &[Arc<Params>],
        surface: Surface,
        row: Table,
        threads: Threads,
    ) -> Result<Loads, StageError> {
        let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
        let prepared = params.iter().map(|params| {
            let (surface, threads) = (surface.clone(), threads.clone());
            let (contact, solver) = Contact::new(params, surface, rms_slope, threads, &|| false)?;
            Ok(Branch { contact, solver, loads: Vec::new() })
        });
        let branches = prepared.collect::<Result<_, StageError>>()?;
        Ok(Loads { branches, row, pressures: Vec::new() })
    }

    /// Returns the load of full contact in units of E* × rms slope, if it is known.
    pub fn full_contact_load(&self) -> Option<f64> {
        self.branches[0].solver.full_contact_load()
    }

    /// Returns the indices of the branch of a finished load and of the load in it.
    fn position(&self, mut load: usize) -> Option<(usize, usize)> {
        for (index, branch) in self.branches.iter().enumerate() {
            if load < branch.loads.len() {
                return Some((index, load));
            }
            load -= branch.loads.len();
        }
        None
    }

    /// Returns the index of the branch of a finished load, and its pressures in units of E* × rms
    /// slope, row-major.
    fn reduced_pressure(&self, load: usize) -> Option<(usize, Vec<f64>)> {
        let mut kept = self.pressures.get(load)?.iter();
        let contact = self.contact(load)?.into_iter();
        let pressure = contact.map(|touches| {
            if touches { *kept.next().expect("every node in contact has one") } else { 0.0 }
        });
        Some((self.position(load)?.0, pressure.collect()))
    }
}

impl Solved for Loads {
    fn set_threads(&mut self, threads: Threads) {
        for branch in &mut self.branches {
            branch.solver.set_threads(threads.clone());
        }
    }

    fn press(
        &mut self,
        keeps_fields: bool,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<bool, StageError> {
        let is_open = |branch: &&mut Branch| branch.loads.len() < branch.contact.loads().len();
        let Some(Branch { contact, solver, loads }) = self.branches.iter_mut().find(is_open) else {
            return Ok(false);
        };
        let solved = contact.solve(solver, contact.loads()[loads.len()], &interrupted)?;
        if keeps_fields {
            let pressure = solver.pressure().iter().copied();
            self.pressures.push(pressure.filter(|p| *p > 0.0).collect());
        }
        loads.push(solved);
        Ok(true)
    }

    fn count(&self) -> usize {
        self.branches.iter().map(|branch| branch.loads.len()).sum()
    }

    fn table(&self) -> Result<Table, StageError> {
        let branches = self.branches.iter();
        let tables = branches.map(|branch| branch.contact.table(&self.row, branch.loads.clone()));
        Ok(Table::stack(&tables.collect::<Vec<_>>())?)
    }

    fn contact(&self, load: usize) -> Option<Vec<bool>> {
        let (branch, index) = self.position(load)?;
        let Branch { contact, loads, .. } = &self.branches[branch];
        Some(bits(&loads[index].contact, contact.grid().count()))
    }

    /// Returns the contact map, because pressures are positive in contact.
    fn repulsive(&self, load: usize) -> Option<Vec<bool>> {
        self.contact(load)
    }

    fn pressure(&self, load: usize) -> Option<Vec<f64>> {
        let (branch, mut pressure) = self.reduced_pressure(load)?;
        let unit = self.branches[branch].contact.scales().pressure();
        pressure.iter_mut().for_each(|p| *p *= unit);
        Some(pressure)
    }

    fn displacement(&mut self, load: usize) -> Option<Vec<f64>> {
        let (branch, pressure) = self.reduced_pressure(load)?;
        let Branch { contact, solver, .. } = &mut self.branches[branch];
        Some(contact.in_length(solver.displacement_under(&pressure)))
    }

    fn gap(&mut self, load: usize) -> Option<Vec<f64>> {
        let (branch, pressure) = self.reduced_pressure(load)?;
        let (_, index) = self.position(load)?;
        let Branch { contact, solver, loads } = &mut self.branches[branch];
        let gap = gap_under(solver, &pressure, loads[index].outcome.mean_gap);
        Some(contact.in_length(gap))
    }
}
