//! Corrects the contact area for the mesh.

use std::borrow::Cow;

pub mod keys;

use serde::Serialize;

use super::columns::*;
use super::grids::Meshes;
use super::stage::distinct;
use super::{
    Context, Definition, Effort, Extent, Input, Kind, Reads, Rows, Stage, StageError,
    beside_coordinates,
};
use asperity_contact::morphology::area::{CountedArea, PI_OVER_EIGHT};
use asperity_manifest::diagnostics::counted;
use asperity_tables::column::{optional_reals, reals, texts};
use asperity_tables::table::Table;

/// Raise it when the numbers change, or what columns say of themselves.
pub const VERSION: u32 = 3;

/// Corrects the contact area for the mesh.
pub const STAGE: Definition = Definition {
    name: "correct",
    version: VERSION,
    reads: Reads {
        rows: &[Rows::Contacts],
        from: Cow::Borrowed("`measure` stages that read contacts"),
    },
    makes: |_| Some(Rows::Corrections),
    columns: || CORRECTED.to_vec(),
    summary: |table| {
        let corrections = distinct(table, CORRECTION.name)?;
        Ok(vec![counted(table.rows(), "row"), corrections.join(", ")])
    },
};

/// What the `correction` column says of the area as it was counted.
pub const AS_COUNTED: &str = "none";
/// … corrected as in the 2015 paper, which comes with bounds.
pub const OF_2015: &str = "pi/8";
/// … and as in 2017, which is right to 15 %.
pub const OF_2017: &str = "2017";

/// The estimators to apply, each giving its own rows; names are unique.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// In the order of the manifest.
    pub corrections: Vec<Correction>,
}

/// A named estimator: `A − coefficient × S_d Δx`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correction {
    /// What the `correction` column says.
    pub name: String,
    /// Share of the Manhattan perimeter × mesh step taken off the counted area.
    pub coefficient: f64,
}

impl Correction {
    /// Whether it is the one of the 2015 paper, which comes with bounds.
    fn has_bounds(&self) -> bool {
        self.coefficient == PI_OVER_EIGHT
    }
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Correct
    }

    /// Applies every estimator to every row: all rows by the first one, then all by the next.
    fn run(&self, inputs: &[Input], _: &Context) -> Result<Table, StageError> {
        let [Input { table: measured, .. }] = inputs else {
            unreachable!("the plan corrects one table at a time")
        };
        let areas = counted_areas(measured)?;
        let corrections = self.corrections.iter();
        let tables = corrections.map(|correction| corrected(measured, &areas, correction));
        Ok(Table::stack(&tables.collect::<Vec<_>>())?)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(beside_coordinates(&CORRECTED, inputs)?)
    }

    fn rows(&self, read: usize) -> usize {
        read * self.corrections.len()
    }

    fn effort(&self, _: Extent) -> Effort {
        Effort::seconds(0.0)
    }
}

fn counted_areas(measured: &Table) -> Result<Vec<CountedArea>, StageError> {
    let meshes = Meshes::of(measured)?;
    let contact_nodes = measured.integers(CONTACT_NODES.name)?;
    let switches = measured.integers(SWITCHES.name)?;
    let counted = |row| CountedArea {
        nodes: meshes.nodes(row).into_iter().fold(1, usize::saturating_mul),
        contact_nodes: contact_nodes.value(row).unsigned_abs() as usize,
        switches: switches.value(row).unsigned_abs() as usize,
    };
    Ok((0..measured.rows()).map(counted).collect())
}

fn corrected(measured: &Table, areas: &[CountedArea], correction: &Correction) -> Table {
    let coefficient = correction.coefficient;
    let bounded = |value: &dyn Fn(&CountedArea) -> Option<f64>| {
        let known = |area: &CountedArea| value(area).filter(|_| correction.has_bounds());
        optional_reals(areas.iter().map(known))
    };
    let own = vec![
        (CORRECTION, texts(vec![&correction.name; areas.len()])),
        (COEFFICIENT, reals(vec![coefficient; areas.len()])),
    ];
    let estimates = vec![
        (AREA_CORRECTED, reals(areas.iter().map(|area| area.corrected(coefficient)))),
        (AREA_LOWER, bounded(&|area| Some(area.bounds()[0]))),
        (AREA_UPPER, bounded(&|area| Some(area.bounds()[1]))),
        (ERROR_ABSOLUTE, bounded(&|area| Some(area.absolute_error(coefficient)))),
        (ERROR_RELATIVE, bounded(&|area| area.relative_error(coefficient))),
    ];
    let counted =
        measured.only(&[AREA_FRACTION.name, SWITCHES.name, CONTACT_NODES.name, STOP.name]);
    measured.coordinates().with(own).with(estimates).beside(&counted)
}
