//! Units of length and pressure of the tables of stages.

use crate::manifest::{OutputUnitsTable, StudyTable};
use crate::study::{EmptyTables, Stage, Study, Work};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, listed};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::quantity::{Dimension, Unit};
use asperity_manifest::keys::{Key, Section, Spanned};
use asperity_mechanics::grid::Boundary;
use asperity_stages::absolute::{AbsoluteColumns, StageUnits};
use asperity_stages::output_units::Conversion;
use asperity_stages::reduced_units::PressureUnit;
use asperity_stages::surface::Origin;
use asperity_stages::units::{TableUnits, shared};
use asperity_stages::{ContactLoads, Kind, Recipe, StageError};
use asperity_tables::column::Description;
use asperity_tables::table::Table;

impl Study {
    /// Returns the units of length and pressure of the table of each stage. A stage has the units
    /// of the stages that it reads, if they agree, and surfaces the unit of pressure of their
    /// contacts. Units of output take the place of those of the store.
    pub fn units(&self) -> Vec<TableUnits> {
        let stored = of_stages(&self.stages).into_iter();
        stored.map(|units| units.names.in_output(&self.output_units)).collect()
    }

    /// Returns the units of the table of the stage with the name `stage`.
    pub fn units_of(&self, stage: &str) -> TableUnits {
        self.stored_units(stage).names.in_output(&self.output_units)
    }

    /// Returns the units that the table of the stage with the name `stage` has in the store.
    pub fn stored_units(&self, stage: &str) -> StageUnits {
        let mut all = self.stages.iter().zip(of_stages(&self.stages));
        let own = all.find(|(known, _)| known.name == stage);
        own.map(|(_, units)| units).unwrap_or_default()
    }

    /// Returns the conversion of the table of a stage from the units of the store to those of
    /// output.
    pub fn conversion(&self, stage: &str) -> Conversion {
        Conversion { from: self.stored_units(stage).names, to: self.output_units.clone() }
    }

    /// Returns the columns with absolute numbers that the published table of a stage has, and the
    /// unit of the observable whose limit the stage fits.
    ///
    /// # Errors
    /// Returns an error if an SQL query of the study cannot be evaluated.
    pub fn absolute_columns(
        &self,
        tables: &EmptyTables,
        stage: &str,
    ) -> Result<(AbsoluteColumns, Option<String>), StageError> {
        let stored = self.stored_units(stage);
        let Stage { inputs, work, .. } = self.stage(stage);
        let read = inputs.iter().filter_map(|&input| tables.of(self, input).ok());
        let quantity = unit_of_quantity(work, read).filter(|_| stored.names.has_any());
        let units = StageUnits { quantity: quantity.clone(), ..stored };
        Ok((AbsoluteColumns::new(tables.named(self, stage)?, &units), quantity))
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
        let [pairs, bodies] = [stage, surfaces].map(|index| self.stages[index].work.surfaces());
        pairs.iter().any(|pair| match &pair.params.origin {
            Origin::Pair(pair) => bodies.iter().any(|body| pair.has_body(&body.params)),
            _ => false,
        })
    }
}

/// Returns the units of the table of each stage in the store; see [`Study::units`].
pub fn of_stages(stages: &[Stage]) -> Vec<StageUnits> {
    let mut units: Vec<StageUnits> = Vec::with_capacity(stages.len());
    let mut are_pressed: Vec<bool> = Vec::with_capacity(stages.len());
    for (index, stage) in stages.iter().enumerate() {
        let read = || stage.inputs.iter().map(|&input| &units[input].names);
        let length = match &stage.work {
            Work::Generate(surfaces) if stage.inputs.is_empty() => {
                shared(surfaces.iter().map(|surfaces| Some(surfaces.params.origin.unit())))
            }
            _ => shared(read().map(|units| units.length.as_deref())),
        };
        let own = stage.work.recipes().iter().find_map(|recipe| modulus(recipe)?.1);
        let pressed = || stage.inputs.iter().filter(|&&input| are_pressed[input]);
        let inherited = || shared(pressed().map(|&input| units[input].names.pressure.as_deref()));
        let contacts = match stage.work.kind() {
            Kind::Generate => modulus_of_contacts(stages, index),
            _ => None,
        };
        let of_contacts = || contacts?.1.map(str::to_owned);
        let pressure = own.map(str::to_owned).or_else(inherited).or_else(of_contacts);
        let has_unit = |(_, unit): &Modulus| unit.is_some() && *unit == pressure.as_deref();
        let modulus = contacts.filter(has_unit).map(|(modulus, _)| modulus);
        are_pressed.push(stage.work.kind() == Kind::Solve || pressed().next().is_some());
        let names = TableUnits { length, pressure };
        units.push(StageUnits { names, modulus, quantity: None });
    }
    units
}

/// Returns the unit of the observable whose limit a stage fits, if it is a column of one of the
/// tables that the stage reads.
fn unit_of_quantity<'t>(work: &Work, read: impl IntoIterator<Item = &'t Table>) -> Option<String> {
    let mut quantities = work.recipes().iter().filter_map(|recipe| match recipe {
        Recipe::Fit(params) => params.law.observable(),
        _ => None,
    });
    let first = quantities.next()?;
    let Expression::Column(name) = first else { return None };
    if quantities.any(|other| other != first) {
        return None;
    }
    let mut schemas = read.into_iter().map(|table| table.batch().schema());
    schemas.find_map(|schema| Some(Description::from(schema.field_with_name(name).ok()?).unit))
}

/// Effective modulus of a contact with its unit, if it has one.
type Modulus = (f64, Option<&'static str>);

/// Returns the effective modulus of the contacts that read a stage of surfaces, if all have the
/// same one.
fn modulus_of_contacts(stages: &[Stage], surfaces: usize) -> Option<Modulus> {
    let readers = stages.iter().filter(|stage| stage.inputs.contains(&surfaces));
    let mut moduli = readers.flat_map(|stage| stage.work.recipes()).filter_map(modulus);
    let first = moduli.next()?;
    moduli.all(|other| is_same_modulus(other, first)).then_some(first)
}

fn is_same_modulus((modulus, unit): Modulus, (first, first_unit): Modulus) -> bool {
    let factor = unit.zip(first_unit).and_then(|(from, to)| Unit::factor(from, to));
    match factor {
        Some(factor) => decimal::is_same(modulus * factor, first),
        None => unit == first_unit && modulus == first,
    }
}

/// Returns the effective modulus of a contact with its unit; `None` for other tasks.
pub fn modulus(recipe: &Recipe) -> Option<Modulus> {
    match recipe {
        Recipe::Solve(params) => Some((params.effective_modulus, params.pressure_unit)),
        Recipe::Adhesion(params) => Some((params.effective_modulus, params.pressure_unit)),
        _ => None,
    }
}

/// Returns the units of output. Reports units of other quantities, and a unit to which no table can
/// be converted. `stored` are the units of the tables of the stages, if they are known.
pub fn output(
    section: &Section<StudyTable>,
    stored: Option<&Vec<StageUnits>>,
    problems: &mut Problems,
) -> TableUnits {
    let written = section.points.first().and_then(|point| point.table.output_units.written());
    let Some(OutputUnitsTable { length, pressure }) = written.map(|written| &written.value) else {
        return TableUnits::default();
    };
    let mut read = |key: &Key<String>, dimension: Dimension| {
        let Spanned { value, span } = key.written()?;
        let find = |name: &str| Unit::find(name).filter(|unit| unit.dimension == dimension);
        let Some(unit) = find(value) else {
            let message = format!("`{value}` is not a unit of {dimension}");
            let label = match dimension.did_you_mean(value) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("must be a unit of {dimension}"),
            };
            let help = format!("units of {dimension} are {}", listed(dimension.names(), "and"));
            problems.push(Problem::new(message, span.clone(), label).help(help));
            return None;
        };
        let can_be_converted = |StageUnits { names, .. }: &StageUnits| {
            [&names.length, &names.pressure].into_iter().flatten().any(|name| find(name).is_some())
        };
        if stored.is_some_and(|stored| !stored.iter().any(can_be_converted)) {
            let message = format!("no table of the study has a unit of {dimension}");
            let problem = Problem::new(message, span.clone(), "nothing can be converted");
            problems.push(problem.help(match dimension {
                Dimension::Length => "give the side of the surfaces with its unit: `\"100 um\"`",
                _ => "give the moduli with their unit: `youngs_modulus = \"210 GPa\"`",
            }));
        }
        Some(unit.symbol.to_owned())
    };
    TableUnits {
        length: read(length, Dimension::Length),
        pressure: read(pressure, Dimension::Pressure),
    }
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
