//! `correct` stages, which correct the contact area for the mesh.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::check_context::{Property, StageChecks};
use crate::columns::*;
use crate::grids::Meshes;
use crate::stage::distinct;
use crate::stage_points::{StagePoints, Work};
use crate::table_columns::Values::{OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column};
use crate::version::Version;
use crate::{
    CheckContext, Context, Definition, Effort, Extent, Input, Kind, Reads, Recipe, RowKind, Stage,
    StageError, stacked, table_beside_coordinates,
};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span, counted};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::list;
use asperity_manifest::keys::{Key, Section, Spanned, deserialize_either, table};
use asperity_mechanics::morphology::area::{CountedArea, PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_tables::column::Column;
use asperity_tables::table::Table;

/// Version of the results, which is part of every key. It is raised whenever numbers change.
pub const VERSION: Version = Version::new(3, &[]);

/// The kind of stage that corrects the contact area for the mesh.
pub const STAGE: Definition = Definition {
    name: "correct",
    version: VERSION,
    reads: Reads {
        rows: &[RowKind::Contacts],
        from: Cow::Borrowed("`measure` stages that read `solve` stages"),
    },
    row_kind: |_| Some(RowKind::Corrections),
    columns: || [&columns().all()[..], &COPIED[..4]].concat(),
    summary: |table, _| {
        let corrections = distinct(table, CORRECTION.name)?;
        Ok(vec![counted(table.rows(), "row"), corrections.join(", ")])
    },
};

/// Correction of the contact area for the mesh.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CorrectTable {
    /// Estimator of the contact area, or a list of estimators: a name, a coefficient, or
    /// `{ name = "…", coefficient = … }`. Each estimator has its own rows.
    #[schemars(length(min = 1), extend("default" = "2017"), transform = list)]
    pub correction: Key<Vec<Spanned<WrittenCorrection>>>,
}

table!(CorrectTable);

/// An estimator of the contact area in a manifest.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenCorrection {
    /// The name of a published estimator.
    Word(CorrectionWord),
    /// A coefficient, which also names the estimator.
    Coefficient(#[schemars(range(min = 0), extend("exclusiveMaximum" = 10))] f64),
    /// A coefficient with another name.
    Named(NamedCorrection),
}

/// A published estimator of the contact area.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
pub enum CorrectionWord {
    /// Area fraction of the nodes in contact, without a correction.
    #[serde(rename = "none")]
    None,
    /// Coefficient π/8 of Yastrebov, Anciaux & Molinari 2015: midway between counting all edge
    /// nodes and counting none of them.
    #[serde(rename = "pi/8")]
    PiOver8,
    /// Coefficient (π − 1 + ln 2)/24 of Yastrebov, Anciaux & Molinari 2017.
    #[serde(rename = "2017")]
    Of2017,
}

/// Keys of an estimator with a name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedCorrection {
    /// Name of the estimator in the column `correction`.
    pub name: Spanned<String>,
    /// Coefficient c of the corrected area A − c S_d Δx, with the Manhattan perimeter S_d and the
    /// mesh step Δx.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 10))]
    pub coefficient: f64,
}

deserialize_either!(WrittenCorrection { number => Coefficient, word => Word, table => Named });

/// Name, in the column `correction`, of the area without a correction.
pub const AS_COUNTED: &str = "none";
/// Name of the estimator of the 2015 paper, which has error bounds.
pub const OF_2015: &str = "pi/8";
/// Name of the estimator of the 2017 paper, which is accurate to 15 %.
pub const OF_2017: &str = "2017";

/// The recipe of a `correct` stage: estimators with unique names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// The estimators in the order of the manifest.
    pub corrections: Vec<Correction>,
}

/// A named estimator of the contact area, A − c S_d Δx.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correction {
    /// Name of the estimator in the column `correction`.
    pub name: String,
    /// Coefficient c of Manhattan perimeter × mesh step, S_d Δx.
    pub coefficient: f64,
}

impl Correction {
    /// Returns whether the estimator has error bounds. Only the coefficient π/8 of the 2015 paper
    /// has them.
    fn has_bounds(&self) -> bool {
        self.coefficient == PI_OVER_EIGHT
    }
}

impl Params {
    fn corrected(&self, measured: &Table) -> Result<Table, StageError> {
        let areas = counted_areas(measured)?;
        let corrections = self.corrections.iter();
        let tables = corrections.map(|correction| corrected(measured, &areas, correction));
        Ok(Table::stack(&tables.collect::<Vec<_>>())?)
    }
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Correct
    }

    /// Returns all rows with the first estimator, then all rows with the next one, and so on.
    fn run(&self, inputs: &[Input], _: &Context) -> Result<Table, StageError> {
        let [Input { table: measured, .. }] = inputs else {
            unreachable!("the plan corrects one table at a time")
        };
        self.corrected(measured)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let table = self.corrected(&stacked(inputs)?)?;
        Ok(table_beside_coordinates(&table, inputs)?)
    }

    fn rows(&self, read: usize) -> usize {
        read * self.corrections.len()
    }

    fn effort(&self, _: Extent) -> Effort {
        Effort::seconds(0.0)
    }
}

fn counted_areas(measured: &Table) -> Result<Vec<CountedArea>, StageError> {
    let meshes = Meshes::new(measured)?;
    let contact_nodes = measured.integers(CONTACT_NODES.name)?;
    let switches = measured.integers(SWITCHES.name)?;
    let counted = |row| CountedArea {
        nodes: meshes.nodes(row).into_iter().fold(1, usize::saturating_mul),
        contact_nodes: contact_nodes.value(row).unsigned_abs() as usize,
        switches: switches.value(row).unsigned_abs() as usize,
    };
    Ok((0..measured.rows()).map(counted).collect())
}

/// Counted area of one contact with an estimator of its true area.
struct Corrected<'a> {
    area: CountedArea,
    correction: &'a Correction,
}

impl Corrected<'_> {
    fn bounds(&self) -> Option<[f64; 2]> {
        self.correction.has_bounds().then(|| self.area.bounds())
    }

    fn absolute_error(&self) -> Option<f64> {
        let coefficient = self.correction.coefficient;
        self.correction.has_bounds().then(|| self.area.absolute_error(coefficient))
    }

    fn relative_error(&self) -> Option<f64> {
        self.bounds().and_then(|_| self.area.relative_error(self.correction.coefficient))
    }
}

/// Returns the columns of corrected areas.
fn columns<'a>() -> TableColumns<(), Corrected<'a>> {
    TableColumns::<(), Corrected>::new([
        column(CORRECTION, Text(|row| &row.correction.name)),
        column(COEFFICIENT, Real(|row| row.correction.coefficient)),
        column(AREA_CORRECTED, Real(|row| row.area.corrected(row.correction.coefficient))),
        column(AREA_LOWER, OptionalReal(|row| Some(row.bounds()?[0]))),
        column(AREA_UPPER, OptionalReal(|row| Some(row.bounds()?[1]))),
        column(ERROR_ABSOLUTE, OptionalReal(Corrected::absolute_error)),
        column(ERROR_RELATIVE, OptionalReal(Corrected::relative_error)),
    ])
}

/// Columns of measured contacts that are copied. The loads are results of paths that prescribe mean
/// gaps, and coordinates of all others.
const COPIED: [Column; 6] = [AREA_FRACTION, SWITCHES, CONTACT_NODES, STOP, LOAD, PRESSURE];

fn corrected(measured: &Table, areas: &[CountedArea], correction: &Correction) -> Table {
    let rows: Vec<Corrected> =
        areas.iter().map(|area| Corrected { area: *area, correction }).collect();
    let coordinates = measured.coordinates();
    let names = COPIED.iter().map(|column| column.name);
    let missing: Vec<&str> = names.filter(|name| !coordinates.has(name)).collect();
    coordinates.with(columns().filled(&(), &rows)).beside(&measured.only(&missing))
}

impl StagePoints for Section<CorrectTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        Work::evaluate(recipes(self, context))
    }
}

/// Returns the task of a `correct` stage, or `None` after reporting problems.
fn recipes(section: &Section<CorrectTable>, context: &mut CheckContext) -> Option<Vec<Recipe>> {
    let point = section.points.first()?;
    let checks = &mut StageChecks::new(section, point, context);
    let corrections = corrections(&point.table, checks)?;
    if let Some(correction) = corrections.iter().find(|correction| correction.coefficient > 0.0) {
        check_cells(correction, &section.span, checks)?;
        check_physics(correction, &section.span, checks)?;
    }
    let params = Params { corrections };
    Some(vec![Recipe::Correct(Arc::new(params))])
}

/// Refuses corrections of cells that are not square, because the coefficients depend on the shape
/// of the cells and on the directions of the edges.
fn check_cells(correction: &Correction, span: &Span, checks: &mut StageChecks) -> Option<()> {
    let Some((stage, ratio)) = &checks.surfaces.non_square else {
        return Some(());
    };
    let message = format!(
        "the correction {:?} needs square cells, but the cells of stage `{stage}` have Δx/Δy = \
         {ratio:.4}",
        correction.name
    );
    let label = "this stage corrects the areas of these cells";
    let problem = Problem::new(message, span.clone(), label);
    checks.reject(problem.help(
        "set `nodes` in the ratio of the sides to make cells square, set `correction = \"none\"` to keep the \
         counted areas, or fit `law = \"mesh-convergence\"`, which is valid for any cells",
    ))
}

/// Refuses corrections of contacts with adhesion or with a layer, for which the coefficients are
/// not measured.
fn check_physics(correction: &Correction, span: &Span, checks: &mut StageChecks) -> Option<()> {
    let adhesion = checks.surfaces.stage_with(Property::WithAdhesion).zip(Some("adhesion"));
    let layer = checks.surfaces.stage_with(Property::WithLayer).zip(Some("layer"));
    let Some((stage, key)) = adhesion.or(layer) else {
        return Some(());
    };
    let message = format!(
        "the correction {:?} is for contacts without adhesion and layers, but stage `{stage}` has \
         `{key}`",
        correction.name
    );
    let problem = Problem::new(message, span.clone(), "this stage corrects its areas");
    checks.reject(problem.help(
        "set `correction = \"none\"` to keep the counted areas, and compare meshes with `law = \
         \"mesh-convergence\"`",
    ))
}

fn corrections(table: &CorrectTable, checks: &mut Checks) -> Option<Vec<Correction>> {
    let Some(written) = checks.optional("correction", &table.correction)? else {
        return Some(vec![known(checks.default_of("correction"))]);
    };
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
            checks.problems.push(
                problem.help("give one of them another name: `{ name = \"…\", coefficient = … }`"),
            );
        }
    }
    corrections.into_iter().collect()
}

fn correction(written: &Spanned<WrittenCorrection>, checks: &mut Checks) -> Option<Correction> {
    let named = match &written.value {
        WrittenCorrection::Word(word) => return Some(known(*word)),
        WrittenCorrection::Coefficient(coefficient) => {
            let coefficient = decimal::nearest(*coefficient);
            return Some(Correction { name: coefficient.to_string(), coefficient });
        }
        WrittenCorrection::Named(named) => named,
    };
    let name = &named.name.value;
    let words = [CorrectionWord::None, CorrectionWord::PiOver8, CorrectionWord::Of2017];
    let label = if words.map(known).iter().any(|known| known.name == *name) {
        "this is the name of a published estimator"
    } else if name.trim().is_empty() {
        "must not be empty"
    } else if name.len() > asperity_manifest::names::MAX_LENGTH {
        "too long"
    } else {
        let coefficient = decimal::nearest(named.coefficient);
        return Some(Correction { name: name.clone(), coefficient });
    };
    let message = format!("a correction cannot be called {name:?}");
    checks.reject(Problem::new(message, named.name.span.clone(), label))
}

fn known(word: CorrectionWord) -> Correction {
    let (name, coefficient) = match word {
        CorrectionWord::None => (AS_COUNTED, 0.0),
        CorrectionWord::PiOver8 => (OF_2015, PI_OVER_EIGHT),
        CorrectionWord::Of2017 => (OF_2017, YASTREBOV_2017),
    };
    Correction { name: name.to_owned(), coefficient }
}
