//! Corrects the contact area for the mesh.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Bound;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::columns::*;
use crate::form::Surfaces;
use crate::grids::Meshes;
use crate::stage::distinct;
use crate::{
    Context, Definition, Effort, Extent, Given, Input, Kind, Reads, Recipe, Rows, Stage,
    StageError, beside_coordinates,
};
use asperity_contact::morphology::area::{CountedArea, PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_manifest::diagnostics::{Problem, counted};
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Section, Written, deserialize_either, table};
use asperity_tables::column::{optional_reals, reals, texts};
use asperity_tables::table::Table;

/// Version of the numbers, part of every key: raised whenever they change.
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

/// Corrects the contact area for the mesh.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CorrectTable {
    /// The estimator, or several, each giving its own rows.
    #[schemars(extend("default" = "2017"))]
    pub correction: Key<Vec<Written<WrittenCorrection>>>,
}

table!(CorrectTable, swept: [], lists: ["correction"]);

/// An estimator of the contact area.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenCorrection {
    /// A known one.
    Word(CorrectionWord),
    /// Its coefficient, which is its name too.
    Coefficient(#[schemars(range(min = 0), extend("exclusiveMaximum" = 10))] f64),
    /// A coefficient with a name.
    Named(NamedCorrection),
}

/// A known estimator.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
pub enum CorrectionWord {
    /// The counted area.
    #[serde(rename = "none")]
    None,
    /// Half way between counting edge nodes and not: coefficient π/8.
    #[serde(rename = "pi/8")]
    PiOver8,
    /// Yastrebov, Anciaux & Molinari 2017: coefficient (π − 1 + ln 2)/24.
    #[serde(rename = "2017")]
    Of2017,
}

/// A coefficient with a name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedCorrection {
    /// What the column `correction` says.
    pub name: Written<String>,
    /// Share of Manhattan perimeter × mesh step taken off the counted area.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 10))]
    pub coefficient: Written<f64>,
}

deserialize_either! {
    'de, WrittenCorrection,
    "`\"none\"`, `\"pi/8\"`, `\"2017\"`, a coefficient or a table `{ name, coefficient }`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<WrittenCorrection, E> {
        Ok(WrittenCorrection::Coefficient(number as f64))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<WrittenCorrection, E> {
        Ok(WrittenCorrection::Coefficient(number))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<WrittenCorrection, E> {
        CorrectionWord::deserialize(StrDeserializer::new(word)).map(WrittenCorrection::Word)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<WrittenCorrection, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(WrittenCorrection::Named)
    }
}

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

/// The estimators of a correct stage.
pub fn recipes(section: &Section<CorrectTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, given.problems);
    let corrections = corrections(&point.table, checks)?;
    check_cells(&corrections, section, &given.surfaces, checks)?;
    let params = Params { corrections };
    Some(vec![Recipe::Correct(Arc::new(params))])
}

/// Coefficients are those of square cells: how much of a cell the true edge cuts off depends on its
/// shape and on the directions in which edges run.
fn check_cells(
    corrections: &[Correction],
    section: &Section<CorrectTable>,
    surfaces: &Surfaces,
    checks: &mut Checks,
) -> Option<()> {
    let corrects = corrections.iter().find(|correction| correction.coefficient > 0.0);
    let (Some(correction), Some((stage, ratio))) = (corrects, &surfaces.oblong) else {
        return Some(());
    };
    let message = format!(
        "the correction {:?} is of square cells, and those of stage `{stage}` have Δx/Δy = {ratio:.4}",
        correction.name
    );
    let label = "corrects areas that were counted on them";
    let problem = Problem::new(message, section.place.clone(), label);
    checks.reject(problem.help(
        "`nodes` in the ratio of the sides make cells square; `correction = \"none\"` leaves areas as \
         they were counted; a `fit` with `law = \"mesh-convergence\"` finds what a mesh of any cells \
         adds",
    ))
}

fn corrections(table: &CorrectTable, checks: &mut Checks) -> Option<Vec<Correction>> {
    let Some(written) = table.correction.written() else {
        return Some(vec![known(CorrectionWord::Of2017)]);
    };
    if written.value.is_empty() {
        let label = "must name at least one estimator";
        return checks.refuse("correction", "`correction` is empty", &written.span, label);
    }
    let corrections: Vec<_> = written.value.iter().map(|entry| correction(entry, checks)).collect();
    let mut seen = BTreeMap::new();
    for (correction, written) in corrections.iter().zip(&written.value) {
        let Some(correction) = correction else {
            continue;
        };
        if let Some(before) = seen.insert(&correction.name, &written.span) {
            let message = format!("two corrections are called {:?}", correction.name);
            let problem = Problem::new(message, written.span.clone(), "here again")
                .and(before.clone(), "first here");
            checks.problems.push(problem.help("`{ name = \"…\", coefficient = … }` gives a name"));
        }
    }
    corrections.into_iter().collect()
}

fn correction(written: &Written<WrittenCorrection>, checks: &mut Checks) -> Option<Correction> {
    let coefficients = (Bound::Included(0.0), Bound::Excluded(10.0));
    match &written.value {
        WrittenCorrection::Word(word) => Some(known(*word)),
        WrittenCorrection::Coefficient(value) => {
            let value = Written { value: *value, span: written.span.clone() };
            let coefficient = checks.holds("correction", &value, coefficients)?;
            let name = coefficient.to_string();
            Some(Correction { name, coefficient })
        }
        WrittenCorrection::Named(named) => {
            let coefficient = checks.is_in("coefficient", &named.coefficient, coefficients);
            let name = &named.name.value;
            let words = [CorrectionWord::None, CorrectionWord::PiOver8, CorrectionWord::Of2017];
            let label = match words.map(known).iter().find(|known| known.name == *name) {
                Some(_) => "this name is taken by a known estimator",
                None if name.trim().is_empty() => "a name must not be empty",
                None if name.len() > asperity_manifest::names::LONGEST => "too long",
                None => {
                    let name = name.clone();
                    return Some(Correction { name, coefficient: coefficient? });
                }
            };
            let message = format!("a correction cannot be called {name:?}");
            checks.reject(Problem::new(message, named.name.span.clone(), label))
        }
    }
}

fn known(word: CorrectionWord) -> Correction {
    let (name, coefficient) = match word {
        CorrectionWord::None => (AS_COUNTED, 0.0),
        CorrectionWord::PiOver8 => (OF_2015, PI_OVER_EIGHT),
        CorrectionWord::Of2017 => (OF_2017, YASTREBOV_2017),
    };
    Correction { name: name.to_owned(), coefficient }
}
