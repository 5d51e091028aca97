//! Contact of one surface, which is solved under single loads.

use crate::bodies::LayerConduction;
use crate::columns::RMS_SLOPE;
use crate::reduced_units::{Scales, SurfaceHardness};
use crate::solve::parallel::LoadTask;
use crate::solve::parts::{self, AddedParts, LoadParts, StoredLoads, counted};
use crate::solve::rows::{self, SolvedLoad, contact_map};
use crate::solve::{Control, Params, WORK_BYTES_PER_NODE};
use crate::unloading::{self, Branch};
use crate::{Context, StageError};
use asperity_mechanics::conduction::LayeredConductor;
use asperity_mechanics::flow;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::solver::{
    Body, Conductor, ContactStiffness, Elastic, Prescribed, Solver, Stop, Watch,
};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::table::Table;

/// Contact of one surface. Any of its solvers can solve any load, and the result is the same.
///
/// A solver works with dimensionless numbers: it receives heights in units of side × rms slope and
/// returns pressures in units of E* × rms slope.
pub struct Contact {
    params: Params,
    grid: Grid,
    scales: Scales,
    hardness: Option<SurfaceHardness>,
    /// Displacement of each node under unit pressure, if displacements are absolute.
    under_unit_pressure: Option<Vec<f64>>,
    /// Compliance of a layer on a rigid base under a uniform pressure, and the height of the
    /// highest node above the mean plane, in the solver's units.
    uniform: Option<UniformCompression>,
    /// Conduction through a layer, if its conductance is computed.
    conductor: Option<Conductor>,
    /// Root mean square height of the surface before it yielded, in the solver's unit of length. It
    /// is 1 for a flat surface, and if no gaps are counted.
    rms_height: f64,
    /// Plastic depth that the surface keeps from a larger load.
    kept: Option<KeptDepth>,
}

/// Plastic depth that a surface keeps from its largest load.
#[derive(Debug, Clone, Copy)]
struct KeptDepth {
    /// Mean depth in the unit of the solver.
    mean: f64,
    /// True if the largest load converged.
    is_solved: bool,
}

/// Data from which the uniform compression of a layer and the approach of the bodies follow.
#[derive(Debug, Clone, Copy)]
struct UniformCompression {
    compliance: f64,
    highest: f64,
}

impl Contact {
    /// Prepares the contact of a surface with this rms slope, and its first solver. On the branch
    /// of unloading, the largest load is solved for the depth that the surface keeps.
    ///
    /// # Errors
    /// Returns an error if the heaviest load exceeds the hardness of the material, or on
    /// interruption.
    pub fn new(
        params: &Params,
        surface: Surface,
        rms_slope: f64,
        threads: Threads,
        watch: &dyn Watch,
    ) -> Result<(Contact, Solver), StageError> {
        let grid = surface.grid();
        let (heights, scales) = Scales::reduce(surface, rms_slope, params.effective_modulus)?;
        let hardness = params.hardness.map(|given| scales.hardness(given)).transpose()?;
        let bound = hardness.map(|hardness| hardness.reduced);
        let heaviest = params.loads.last().filter(|_| params.control.is_load());
        if let (Some(bound), Some(&heaviest)) = (bound, heaviest) {
            bound.check_load(scales.reduced_pressure(heaviest, params.load_unit))?;
        }
        let rms_height = params.gap_bins.map_or(1.0, |_| rms(heights.as_slice()));
        let layer = params.layer.map(|layer| layer.below(grid.cell().longer_side())).transpose()?;
        let elastic = layer.map_or(params.boundary.into(), Elastic::Layer);
        let compliance = layer.and_then(|layer| layer.uniform_compliance());
        let uniform = compliance.map(|compliance| UniformCompression {
            compliance,
            highest: highest_above_mean(heights.as_slice()),
        });
        let conductor = match (layer, params.layer_conduction) {
            (Some(layer), Some(LayerConduction { to_substrate, to_counter_body })) => {
                let thickness = layer.thickness();
                let layer = LayeredConductor::new(thickness, to_substrate, to_counter_body)?;
                Some(Conductor::new(&threads, grid, layer))
            }
            _ => None,
        };
        let body = Body { elastic, hardness: bound };
        let mut solver = body.solver_with_threads(threads.clone(), &heights);
        let mut kept = None;
        if let (Some(Branch::Unloading(largest)), Some(bound)) = (params.branch, bound) {
            let largest = scales.reduced_pressure(largest, params.load_unit);
            let settings = params.settings();
            let depth = unloading::plastic_depth(&mut solver, bound, largest, &settings, watch)?;
            let lowered = heights.lowered(&depth.depths).map_err(StageError::Heights)?;
            solver = body.solver_with_threads(threads, &lowered);
            kept = Some(KeptDepth { mean: depth.mean(), is_solved: depth.is_solved });
        }
        let contact = Contact {
            params: params.clone(),
            grid,
            scales,
            hardness,
            under_unit_pressure: solver.displacement_under_unit_pressure(),
            uniform,
            conductor,
            rms_height,
            kept,
        };
        Ok((contact, solver))
    }

    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns all loads in the unit of the manifest.
    pub fn loads(&self) -> &[f64] {
        &self.params.loads
    }

    /// Returns the factors between the units of the solver and of the user.
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// Returns the prescribed mean gap or displacement `given` in the units of the solver; `None`
    /// if loads are prescribed.
    fn prescribed(&self, given: f64) -> Option<Prescribed> {
        let reduced = given / self.scales.length();
        match self.params.control {
            Control::Load => None,
            Control::Gap => Some(Prescribed::MeanGap(reduced)),
            Control::Displacement => Some(Prescribed::Approach {
                approach: reduced,
                uniform_compliance: self.uniform.map_or(0.0, |uniform| uniform.compliance),
            }),
        }
    }

    /// Solves the load, the mean gap or the displacement `given`, in the unit of the manifest.
    ///
    /// # Errors
    /// Returns an error on interruption. The load may then be solved again.
    pub fn solve(
        &self,
        solver: &mut Solver,
        given: f64,
        watch: &dyn Watch,
    ) -> Result<SolvedLoad, StageError> {
        let settings = self.params.settings();
        let (load, mut outcome) = match self.prescribed(given) {
            Some(prescribed) => solver.press_to(prescribed, &settings, watch),
            None => {
                let load = self.scales.reduced_pressure(given, self.params.load_unit);
                (load, solver.press(load, &settings, watch))
            }
        };
        if outcome.stop == Stop::Interrupted {
            return Err(StageError::Interrupted);
        }
        if let Some(kept) = self.kept {
            outcome.yielded_depth += kept.mean;
            if !kept.is_solved {
                outcome.stop = Stop::PairLimit;
            }
        }
        let pressures = solver.pressure();
        let contact = contact_map(solver.threads(), self.scales.nodes, pressures);
        // By reciprocity, ⟨u⟩ = ⟨u₁ p⟩, where u₁ is the displacement under unit pressure.
        let displacement = self.under_unit_pressure.as_ref().map(|displacement| {
            let sum: f64 = displacement.iter().zip(pressures).map(|(u, p)| u * p).sum();
            sum / pressures.len() as f64
        });
        let compression = self.uniform.map(|UniformCompression { compliance, highest }| {
            let compression = compliance * load;
            // The solver leaves the uniform compression out.
            outcome.energy += 0.5 * load * compression;
            let approach = compression + highest - outcome.mean_gap + outcome.yielded_depth;
            [compression, approach]
        });
        let keep = self.params.keeps_pressures_at(given);
        let parts = if keep || self.params.reads_pressures() {
            let stored = pressures.iter().map(|p| p * self.scales.pressure()).collect();
            self.parts(solver, stored, outcome.mean_gap, keep, watch)?
        } else {
            LoadParts::default()
        };
        Ok(SolvedLoad {
            given,
            load,
            outcome,
            contact,
            displacement,
            compression,
            asperities: None,
            parts,
        })
    }

    /// Computes the parts of a load from its stored pressures, without solving it. `row` is the row
    /// of the load among the stored ones.
    ///
    /// # Errors
    /// Returns an error on interruption.
    pub fn add_parts(
        &self,
        solver: &mut Solver,
        stored: &StoredLoads,
        row: usize,
        watch: &dyn Watch,
    ) -> Result<AddedParts, StageError> {
        let mean_gap = stored.mean_gap(row);
        let reduced_gap = mean_gap / self.scales.length();
        let parts = self.parts(solver, stored.pressures(row), reduced_gap, false, watch)?;
        Ok(AddedParts { load: self.params.loads[row], mean_gap, parts })
    }

    /// Computes the parts of a load from its pressures in the unit of the moduli, and its mean gap
    /// in the unit of the solver.
    fn parts(
        &self,
        solver: &mut Solver,
        stored: Vec<f64>,
        mean_gap: f64,
        keep: bool,
        watch: &dyn Watch,
    ) -> Result<LoadParts, StageError> {
        if !self.params.reads_pressures() {
            return Ok(LoadParts { pressures: keep.then_some(stored), ..LoadParts::default() });
        }
        let kept = keep.then(|| stored.clone());
        let mut parts = LoadParts { pressures: kept, ..LoadParts::default() };
        let pressures = self.reduced_pressures(stored);
        parts.pressure_counts = self.params.pressure_bins.map(|bins| {
            let in_contact = pressures.iter().filter(|pressure| **pressure > 0.0);
            counted(bins, in_contact.copied())
        });
        let is_open = pressures.iter().all(|pressure| *pressure == 0.0);
        if !self.params.stiffness.is_none() && is_open {
            [parts.stiffness, parts.unloading_stiffness] = [Some(0.0); 2];
        } else if !self.params.stiffness.is_none() {
            let settings = self.params.settings();
            let found = solver.contact_stiffness(&pressures, &settings, watch);
            parts.stiffness = converged(found)?;
            parts.unloading_stiffness = match self.hardness {
                Some(hardness) if pressures.iter().any(|p| *p >= hardness.reduced.pressure()) => {
                    converged(solver.unloading_stiffness(&pressures, &settings, watch))?
                }
                // Where nothing yields, both are the same.
                _ => parts.stiffness,
            };
        }
        parts.conductance = match &self.conductor {
            Some(_) if is_open => Some(0.0),
            Some(conductor) => {
                let (threads, settings) = (solver.threads().clone(), self.params.settings());
                converged(conductor.conductance(threads, &pressures, &settings, watch))?
            }
            None => None,
        };
        if !self.params.reads_gap() {
            return Ok(parts);
        }
        let mut gap = gap_under(solver, &pressures, mean_gap);
        parts.gap_counts = self.params.gap_bins.map(|bins| {
            let apart = gap.iter().zip(&pressures).filter(|(_, pressure)| **pressure == 0.0);
            counted(bins, apart.map(|(gap, _)| gap.max(0.0) / self.rms_height))
        });
        if self.params.flow {
            // Nodes in contact are closed, even if their gap is positive within the tolerance.
            for (gap, pressure) in gap.iter_mut().zip(&pressures) {
                *gap = if *pressure > 0.0 { 0.0 } else { *gap };
            }
            drop(pressures);
            let is_interrupted = || watch.is_interrupted();
            let flow = flow::flow_through_interruptible(self.grid, &gap, &is_interrupted);
            parts.flow = Some(flow.ok_or(StageError::Interrupted)?);
        }
        Ok(parts)
    }

    /// Returns the gaps in the unit of the surface. `stored` are the pressures in the unit of the
    /// moduli, and `mean_gap` is the mean gap in the unit of the surface.
    pub fn gap(&self, solver: &mut Solver, stored: Vec<f64>, mean_gap: f64) -> Vec<f64> {
        let mean_gap = mean_gap / self.scales.length();
        self.in_length(gap_under(solver, &self.reduced_pressures(stored), mean_gap))
    }

    /// Returns the displacements of the elastic body in the unit of the surface. `stored` are the
    /// pressures in the unit of the moduli.
    pub fn displacement(&self, solver: &mut Solver, stored: Vec<f64>) -> Vec<f64> {
        self.in_length(solver.displacement_under(&self.reduced_pressures(stored)))
    }

    /// Converts lengths of the solver to the unit of the surface.
    pub fn in_length(&self, mut reduced: Vec<f64>) -> Vec<f64> {
        let unit = self.scales.length();
        reduced.iter_mut().for_each(|value| *value *= unit);
        reduced
    }

    /// Converts stored pressures to units of E* × rms slope. Saturated nodes get exactly the
    /// hardness, which rounding would miss.
    fn reduced_pressures(&self, mut stored: Vec<f64>) -> Vec<f64> {
        let unit = self.scales.pressure();
        let hardness = self.hardness.map_or(f64::INFINITY, |hardness| hardness.reduced.pressure());
        for pressure in &mut stored {
            let is_saturated = *pressure >= hardness * unit;
            *pressure = if is_saturated { hardness } else { *pressure / unit };
        }
        stored
    }

    /// Returns the table of solved loads. The parameters of the surface are taken from the one-row
    /// table `surface`.
    pub fn table(&self, surface: &Table, loads: Vec<SolvedLoad>) -> Table {
        rows::table(&self.params, &self.scales, self.hardness, surface, loads)
    }

    /// Returns a table with only the load and the parts of each row.
    pub fn table_of_parts(&self, rows: Vec<AddedParts>) -> Table {
        parts::table(&self.params, self.scales.length(), rows)
    }
}

/// Solves the contact of one surface under the loads, or only adds parts to stored rows of the
/// loads. `row` is the row of the surface in the table of its stage.
///
/// # Errors
/// Returns an error if the heaviest load exceeds the hardness of the material, or on interruption.
pub fn solve(
    params: &Params,
    surface: Surface,
    row: &Table,
    context: &Context,
) -> Result<Table, StageError> {
    let rms_slope = row.reals(RMS_SLOPE.name)?.value(0);
    let grid = surface.grid();
    let (count, longer_side) = (grid.count() as f64, grid.cell().longer_side());
    let is_interrupted = || (context.interrupted)();
    let (contact, mut solver) =
        Contact::new(params, surface, rms_slope, context.threads.clone(), &is_interrupted)?;
    let per_node = params.body(longer_side).sibling_bytes_per_node(params.tolerance)
        + params.part_bytes_per_node()
        + WORK_BYTES_PER_NODE;
    let sibling = |solver: &Solver| {
        (context.reserve)((per_node * count) as u64)
            .then(|| solver.sibling(context.threads.clone()))
    };
    if let Some(stored) = context.stored {
        let stored = StoredLoads::new(stored)?;
        let task = LoadTask::new(context, &params.loads, params.pairs_of_parts());
        return task.run(
            &mut solver,
            sibling,
            |solver, index, watch| contact.add_parts(solver, &stored, index, watch),
            |rows| contact.table_of_parts(rows),
        );
    }
    let task = LoadTask::new(context, &params.loads, params.pairs_per_load(longer_side));
    task.run(
        &mut solver,
        sibling,
        |solver, index, watch| contact.solve(solver, params.loads[index], watch),
        |loads| contact.table(row, loads),
    )
}

/// Returns the gaps under the pressures of a solved load. Without any pressure, the surfaces are
/// apart by the mean gap.
pub fn gap_under(solver: &mut Solver, pressures: &[f64], mean_gap: f64) -> Vec<f64> {
    let mut gap = solver.gap_under(pressures);
    if pressures.iter().all(|pressure| *pressure == 0.0) {
        gap.iter_mut().for_each(|gap| *gap += mean_gap);
    }
    gap
}

/// Returns a stiffness, or `None` if the pairs of transforms were not enough.
///
/// # Errors
/// Returns an error on interruption.
fn converged(found: ContactStiffness) -> Result<Option<f64>, StageError> {
    match found.stop {
        Stop::Interrupted => Err(StageError::Interrupted),
        Stop::PairLimit => Ok(None),
        Stop::Converged | Stop::FullContact | Stop::NoContact | Stop::NotReached => {
            Ok(Some(found.stiffness))
        }
    }
}

/// Returns the root mean square of the heights about their mean, or 1 for a flat surface.
pub fn rms(heights: &[f64]) -> f64 {
    let nodes = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / nodes;
    let squares: f64 = heights.iter().map(|height| (height - mean).powi(2)).sum();
    if squares > 0.0 { (squares / nodes).sqrt() } else { 1.0 }
}

/// Returns the height of the highest node above the mean plane.
fn highest_above_mean(heights: &[f64]) -> f64 {
    let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    highest - heights.iter().sum::<f64>() / heights.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduced_units::{GivenHardness, PressureUnit};
    use crate::solve::tests::{params, surface};

    #[test]
    fn saturated_nodes_have_exactly_the_hardness_after_they_were_stored() {
        let hardness = GivenHardness { pressure: 0.8, unit: PressureUnit::Relative };
        for effective_modulus in [1.0, 1.1, 3.0, 210e9, 1e-7] {
            let params = Params { effective_modulus, hardness: Some(hardness), ..params() };
            let (contact, mut solver) =
                Contact::new(&params, surface(), 0.7, Threads::one(), &|| false).unwrap();
            let solved = contact.solve(&mut solver, 0.3, &|| false).unwrap();
            let unit = contact.scales().pressure();
            let stored = solver.pressure().iter().map(|p| p * unit).collect();
            let reduced = contact.reduced_pressures(stored);
            let saturated = reduced.iter().filter(|pressure| **pressure == 0.8).count();
            assert_eq!(saturated, solved.outcome.saturated_nodes);
            assert!(saturated > 0);
            let pairs = reduced.iter().zip(solver.pressure());
            assert!(pairs.into_iter().all(|(one, p)| (one - p).abs() <= f64::EPSILON * p));
        }
    }
}
