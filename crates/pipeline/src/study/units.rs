//! Units of length and pressure of the tables of stages.

use crate::study::{Study, Work};
use asperity_stages::solve::PressureUnit;
use asperity_stages::units::TableUnits;
use asperity_stages::{AbsoluteLoads, Recipe};

impl Study {
    /// Returns the units of length and pressure of the table of each stage. A stage has the units
    /// of the stages that it reads, if they agree.
    pub fn units(&self) -> Vec<TableUnits> {
        let mut units: Vec<TableUnits> = Vec::with_capacity(self.stages.len());
        for stage in &self.stages {
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
            let inherited = || common(read().map(|units| units.pressure.as_deref()));
            let pressure = own.map(str::to_owned).or_else(inherited);
            units.push(TableUnits { length, pressure });
        }
        units
    }

    /// Returns the loads of the contacts of the surfaces of a stage, if all of them are pressures
    /// with the same modulus and unit.
    pub fn absolute_loads_on(&self, surfaces: usize) -> Option<AbsoluteLoads> {
        let readers = self.stages.iter().filter(|stage| stage.inputs.contains(&surfaces));
        let mut loads = readers.flat_map(|stage| stage.work.recipes()).filter_map(|recipe| {
            let Recipe::Solve(params) = recipe else { return None };
            let (unit, effective_modulus) = (params.pressure_unit, params.effective_modulus);
            let is_absolute = params.load_unit == PressureUnit::Absolute;
            Some(is_absolute.then_some(AbsoluteLoads { effective_modulus, unit }))
        });
        let first = loads.next()??;
        loads.all(|other| other.as_ref() == Some(&first)).then_some(first)
    }
}

/// Returns the unit that all have, if it is not empty.
fn common<'a>(units: impl Iterator<Item = Option<&'a str>>) -> Option<String> {
    let mut units = units.map(|unit| unit.filter(|unit| !unit.is_empty()));
    let first = units.next().flatten()?;
    units.all(|other| other == Some(first)).then(|| first.to_owned())
}
