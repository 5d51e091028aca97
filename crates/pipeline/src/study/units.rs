//! Units of length and pressure of the tables of stages.

use crate::study::{Stage, Study, Work};
use asperity_contact::grid::Boundary;
use asperity_stages::reduced_units::PressureUnit;
use asperity_stages::surface::Origin;
use asperity_stages::units::TableUnits;
use asperity_stages::{ContactLoads, Kind, Recipe};

impl Study {
    /// Returns the units of length and pressure of the table of each stage. A stage has the units
    /// of the stages that it reads, if they agree. Surfaces that were not pressed have no
    /// pressures.
    pub fn units(&self) -> Vec<TableUnits> {
        of_stages(&self.stages)
    }

    /// Returns the units of the table of the stage with the name `stage`.
    pub fn units_of(&self, stage: &str) -> TableUnits {
        let named = self.stages.iter().zip(self.units()).find(|(known, _)| known.name == stage);
        named.map(|(_, units)| units).unwrap_or_default()
    }

    /// Returns the loads of all contacts of the surfaces of a stage. The surfaces can also be
    /// bodies of the pairs that a contact reads (`against`).
    pub fn contact_loads(&self, surfaces: usize) -> ContactLoads {
        let has_them = |&read: &usize| read == surfaces || self.has_pairs_of(read, surfaces);
        let readers = self.stages.iter().filter(|stage| stage.inputs.iter().any(has_them));
        let recipes = readers.flat_map(|stage| stage.work.recipes());
        let loads: Vec<ContactLoads> = recipes.filter_map(loads_of).collect();
        match loads.split_first() {
            _ if loads.contains(&ContactLoads::NotHalfSpace) => ContactLoads::NotHalfSpace,
            Some((first, others)) if others.iter().all(|other| other == first) => first.clone(),
            _ => ContactLoads::Reduced,
        }
    }

    /// Returns whether a stage makes pairs with a surface of the stage `surfaces`.
    fn has_pairs_of(&self, stage: usize, surfaces: usize) -> bool {
        let [Work::Generate(pairs), Work::Generate(bodies)] =
            [stage, surfaces].map(|index| &self.stages[index].work)
        else {
            return false;
        };
        let mut origins = pairs.iter().filter_map(|pair| match &pair.params.origin {
            Origin::Pair(pair) => Some(pair),
            _ => None,
        });
        origins.any(|pair| bodies.iter().any(|body| pair.has_body(&body.params)))
    }
}

/// Returns the units of length and pressure of the table of each stage; see [`Study::units`].
pub fn of_stages(stages: &[Stage]) -> Vec<TableUnits> {
    let mut units: Vec<TableUnits> = Vec::with_capacity(stages.len());
    let mut are_pressed: Vec<bool> = Vec::with_capacity(stages.len());
    for stage in stages {
        let read = || stage.inputs.iter().map(|&input| &units[input]);
        let length = match &stage.work {
            Work::Generate(surfaces) if stage.inputs.is_empty() => {
                common(surfaces.iter().map(|surfaces| Some(surfaces.params.origin.unit())))
            }
            _ => common(read().map(|units| units.length.as_deref())),
        };
        let own = stage.work.recipes().iter().find_map(|recipe| match recipe {
            Recipe::Solve(params) => params.pressure_unit,
            Recipe::Adhesion(params) => params.pressure_unit,
            _ => None,
        });
        let pressed = || stage.inputs.iter().filter(|&&input| are_pressed[input]);
        let inherited = || common(pressed().map(|&input| units[input].pressure.as_deref()));
        let pressure = own.map(str::to_owned).or_else(inherited);
        are_pressed.push(stage.work.kind() == Kind::Solve || pressed().next().is_some());
        units.push(TableUnits { length, pressure });
    }
    units
}

/// Returns the loads of a contact; `None` for other tasks.
fn loads_of(recipe: &Recipe) -> Option<ContactLoads> {
    let params = match recipe {
        Recipe::Solve(params) => params,
        Recipe::Adhesion(_) => return Some(ContactLoads::NotHalfSpace),
        _ => return None,
    };
    if params.layer.is_some() || params.boundary == Boundary::Free {
        return Some(ContactLoads::NotHalfSpace);
    }
    let (unit, effective_modulus) = (params.pressure_unit, params.effective_modulus);
    Some(match params.load_unit {
        PressureUnit::Absolute => ContactLoads::Absolute { effective_modulus, unit },
        PressureUnit::Relative => ContactLoads::Reduced,
    })
}

/// Returns the unit that all have, if it is not empty.
fn common<'a>(units: impl Iterator<Item = Option<&'a str>>) -> Option<String> {
    let mut named = units.map(|unit| unit.filter(|unit| !unit.is_empty()));
    let first = named.next().flatten()?;
    named.all(|other| other == Some(first)).then(|| first.to_owned())
}
