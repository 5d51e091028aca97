//! Pressures, gaps and displacements of every node, computed again for single loads.
//!
//! Tables contain the contact map of every load, and other maps only on request. The result of a
//! load depends on nothing but the surface, the load and the settings, so its maps can be computed
//! again, bit for bit.

use crate::StageError;
use crate::columns::*;
use crate::ensemble::load_column;
use crate::reduced_units::{GivenHardness, PressureUnit, Scales};
use crate::solve::{Contact, Control, GivenLayer, Params, boundary_of, max_pairs};
use crate::stage::first_real;
use crate::unloading::Branch;
use asperity_mechanics::asperities::{Asperities, Interaction};
use asperity_mechanics::solver::{Solver, Watch};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// Contact of one surface, whose loads are solved again for their maps.
///
/// Pressures are in the unit of the moduli, and lengths in the unit of the surface. Maps are
/// row-major.
pub struct ContactFields {
    params: Params,
    model: Model,
}

enum Model {
    EveryNode { contact: Box<Contact>, solver: Box<Solver> },
    Asperities { asperities: Box<Asperities>, scales: Scales },
}

impl ContactFields {
    /// Prepares a surface with the settings of its solved table, which has at least one row.
    ///
    /// # Errors
    /// Returns an error if the table lacks columns of solved loads.
    pub fn new(
        solved: &Table,
        surface: Surface,
        rms_slope: f64,
        threads: Threads,
    ) -> Result<ContactFields, StageError> {
        let params = Params::of_solved(solved)?;
        let model = match params.asperities {
            None => {
                let (contact, solver) =
                    Contact::new(&params, surface, rms_slope, threads, &|| false)?;
                Model::EveryNode { contact: Box::new(contact), solver: Box::new(solver) }
            }
            Some(interaction) => {
                let (heights, scales) =
                    Scales::reduce(surface, rms_slope, params.effective_modulus)?;
                let asperities = Box::new(Asperities::new(&heights, interaction)?);
                Model::Asperities { asperities, scales }
            }
        };
        Ok(ContactFields { params, model })
    }

    /// Returns the pressures under a load in the unit of the manifest, zero outside contact.
    ///
    /// # Errors
    /// Returns an error on interruption.
    pub fn pressures(&mut self, load: f64, watch: &dyn Watch) -> Result<Vec<f64>, StageError> {
        match &mut self.model {
            Model::EveryNode { contact, solver } => {
                contact.solve(solver, load, watch)?;
                let unit = contact.scales().pressure();
                Ok(solver.pressure().iter().map(|pressure| pressure * unit).collect())
            }
            Model::Asperities { asperities, scales } => {
                let load = scales.reduced_pressure(load, self.params.load_unit);
                asperities.press(load, &self.params.settings());
                let unit = scales.pressure();
                Ok(asperities.pressure().iter().map(|pressure| pressure * unit).collect())
            }
        }
    }

    /// Returns the gaps under the pressures of a load with this mean gap, as defined by
    /// [`Solver::gap_under`]. Returns `None` for asperity models, in which the surfaces are not
    /// solved at every node.
    pub fn gap(&mut self, pressures: Vec<f64>, mean_gap: f64) -> Option<Vec<f64>> {
        match &mut self.model {
            Model::EveryNode { contact, solver } => Some(contact.gap(solver, pressures, mean_gap)),
            Model::Asperities { .. } => None,
        }
    }

    /// Returns the displacements of the elastic body under the pressures of a load, as defined by
    /// [`Solver::displacement_under`]. Returns `None` for asperity models.
    pub fn displacement(&mut self, pressures: Vec<f64>) -> Option<Vec<f64>> {
        match &mut self.model {
            Model::EveryNode { contact, solver } => Some(contact.displacement(solver, pressures)),
            Model::Asperities { .. } => None,
        }
    }
}

impl Params {
    /// Returns the settings with which the rows of a task were solved, without loads and parts.
    fn of_solved(table: &Table) -> Result<Params, TableError> {
        let interaction = table.optional(INTERACTION.name, Table::texts)?;
        let word = interaction.and_then(|words| words.iter().next().flatten());
        let is_named = |interaction: &Interaction| word == Some(interaction.name());
        Ok(Params {
            effective_modulus: table.reals(EFFECTIVE_MODULUS.name)?.value(0),
            control: match load_column(table) {
                name if name == PRESCRIBED_GAP.name => Control::Gap,
                name if name == PRESCRIBED_DISPLACEMENT.name => Control::Displacement,
                _ => Control::Load,
            },
            load_unit: PressureUnit::of_solved(table),
            tolerance: table.reals(TOLERANCE.name)?.value(0),
            max_pairs: max_pairs(table)?,
            boundary: boundary_of(table),
            layer: GivenLayer::of_solved(table)?,
            hardness: given_hardness(table)?,
            branch: branch(table)?,
            asperities: Interaction::ALL.into_iter().find(is_named),
            ..Params::default()
        })
    }
}

/// Returns the part of the path from the columns of the branch.
fn branch(table: &Table) -> Result<Option<Branch>, TableError> {
    if !table.has(MAXIMUM_LOAD.name) {
        return Ok(None);
    }
    let name = table.texts(BRANCH.name)?.iter().next().flatten();
    let largest = first_real(table, MAXIMUM_LOAD)?;
    Ok(name.map(|_| largest.map_or(Branch::Loading, Branch::Unloading)))
}

/// Returns the hardness from the column that the manifest gives, which has the role of a parameter.
fn given_hardness(table: &Table) -> Result<Option<GivenHardness>, TableError> {
    let given = table.in_role(Role::Parameter);
    let absolute = first_real(&given, HARDNESS)?.map(|given| (given, PressureUnit::Absolute));
    let relative =
        first_real(&given, HARDNESS_REDUCED)?.map(|given| (given, PressureUnit::Relative));
    Ok(absolute.or(relative).map(|(pressure, unit)| GivenHardness { pressure, unit }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::Pressures;
    use crate::solve::parts::StoredLoads;
    use crate::solve::tests::{params, solved_on, surface};
    use asperity_mechanics::grid::Boundary;

    fn fields(solved: &Table) -> ContactFields {
        ContactFields::new(solved, surface(), 0.7, Threads::one()).unwrap()
    }

    fn solved(params: &Params) -> Table {
        solved_on(surface(), params, &Threads::one(), None)
    }

    #[test]
    fn pressures_that_are_computed_again_are_the_stored_ones() {
        let hardness = |pressure, unit| Some(GivenHardness { pressure, unit });
        let stored = Params { pressures: Pressures::All, ..params() };
        for params in [
            stored.clone(),
            Params { boundary: Boundary::Free, tolerance: 1e-6, ..stored.clone() },
            Params { load_unit: PressureUnit::Absolute, ..stored.clone() },
            Params { hardness: hardness(0.8, PressureUnit::Relative), ..stored.clone() },
            Params { hardness: hardness(1.7, PressureUnit::Absolute), ..stored.clone() },
            Params { asperities: Some(Interaction::MeanField), ..stored.clone() },
            Params { asperities: Some(Interaction::Explicit), ..stored.clone() },
        ] {
            let table = solved(&params);
            let kept = StoredLoads::new(&table).unwrap();
            let mut fields = fields(&table);
            for (row, load) in params.loads.iter().enumerate() {
                assert_eq!(fields.pressures(*load, &|| false).unwrap(), kept.pressures(row));
            }
        }
    }

    #[test]
    fn gap_and_pressure_are_never_both_positive_and_the_mean_gap_is_that_of_the_table() {
        let params = params();
        let table = solved(&params);
        let mut fields = fields(&table);
        let penetration = 0.7 * 2.0 / 32.0 * params.tolerance;
        for (row, load) in params.loads.iter().enumerate() {
            let pressures = fields.pressures(*load, &|| false).unwrap();
            let gap = fields.gap(pressures.clone(), 0.0).unwrap();
            for (gap, pressure) in gap.iter().zip(&pressures) {
                assert!(*pressure >= 0.0 && *gap >= -penetration && gap * pressure == 0.0);
            }
            let mean = gap.iter().sum::<f64>() / gap.len() as f64;
            let expected = table.reals(MEAN_GAP.name).unwrap().value(row);
            assert!((mean - expected).abs() < penetration, "{mean} instead of {expected}");
        }
    }

    #[test]
    fn the_gap_is_a_rigid_displacement_plus_the_elastic_one_minus_the_height() {
        let table = solved(&params());
        let mut fields = fields(&table);
        let pressures = fields.pressures(0.1, &|| false).unwrap();
        let gap = fields.gap(pressures.clone(), 0.0).unwrap();
        let displacement = fields.displacement(pressures.clone()).unwrap();
        let heights = surface().into_heights();
        let nodes = 0..heights.len();
        let rigid = nodes.map(|node| gap[node] - displacement[node] + heights[node]);
        let apart: Vec<f64> =
            rigid.zip(&pressures).filter(|(_, p)| **p == 0.0).map(|(rigid, _)| rigid).collect();
        assert!(apart.iter().all(|rigid| (rigid - apart[0]).abs() < 1e-12));
    }

    #[test]
    fn an_asperity_model_has_no_gap() {
        let params = Params { asperities: Some(Interaction::None), ..params() };
        let mut fields = fields(&solved(&params));
        let pressures = fields.pressures(0.1, &|| false).unwrap();
        assert!(fields.gap(pressures.clone(), 0.0).is_none());
        assert!(fields.displacement(pressures).is_none());
    }
}
