//! Keys of the stages that correct, and what they come to.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Bound;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::super::Given;
use super::super::Recipe;
use super::{AS_COUNTED, Correction, OF_2015, OF_2017, Params};
use crate::form::Surfaces;
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Key, Section, Written, deserialize_either, table};

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
    checks.problems.push(problem.help(
        "`nodes` in the ratio of the sides make cells square; `correction = \"none\"` leaves areas as \
         they were counted; a `fit` with `law = \"mesh-convergence\"` finds what a mesh of any cells \
         adds",
    ));
    None
}

fn corrections(table: &CorrectTable, checks: &mut Checks) -> Option<Vec<Correction>> {
    let Some(written) = table.correction.written() else {
        return Some(vec![known(CorrectionWord::Of2017)]);
    };
    if written.value.is_empty() {
        let label = "must name at least one estimator";
        let problem = Problem::new("`correction` is empty", written.span.clone(), label);
        checks.report("correction", problem);
        return None;
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
            checks.problems.push(Problem::new(message, named.name.span.clone(), label));
            None
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
