//! The points of fits that take κ = A/(A₀ y) to its limits.

use std::collections::BTreeSet;

use super::super::setting::Setting;
use asperity_manifest::expression::Expression;
use asperity_stages::columns::*;
use asperity_stages::correct::OF_2017;
use asperity_stages::ensemble::Point;
use asperity_stages::fit::limits::{LimitChoices, groups};
use asperity_statistics::Window;
use asperity_statistics::intervals::Weights;
use asperity_statistics::limits::{LimitPoint, Observed, TermForm};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// A fit of limits that a study has, and the rows that it reads.
#[derive(Debug, Clone)]
pub struct LimitsFit {
    /// What is taken to which limits.
    pub choices: LimitChoices,
    /// The loads that count.
    pub window: Window,
    /// The rows.
    pub table: Table,
}

/// κ of the area corrected as in 2017, on many spectra and meshes under one load.
#[derive(Debug, Clone)]
pub struct KappaPoints {
    /// What tells it from others: `load 0.01`.
    pub label: String,
    /// The load.
    pub load: f64,
    /// κ of every surface, and the small numbers.
    points: Vec<LimitPoint>,
    /// The forms that each term may take.
    pub forms: Vec<Vec<TermForm>>,
    /// The term of `k_lower / k_upper`.
    pub bandwidth: usize,
    /// The term of `1 / k_lower`.
    pub cell: usize,
    /// The term of `k_upper / nodes`.
    pub mesh: usize,
}

impl KappaPoints {
    /// The points with the surfaces that count.
    pub fn points(&self, weights: &Weights) -> Vec<LimitPoint> {
        let points = self.points.iter().map(|point| LimitPoint {
            small: point.small.clone(),
            observed: match &point.observed {
                Observed::Surfaces { values, .. } => {
                    Observed::of_realizations(weights.values(values).collect())
                }
                estimate => estimate.clone(),
            },
        });
        points.collect()
    }

    /// How many surfaces its points have.
    pub fn surfaces(&self) -> Vec<usize> {
        let counts = self.points.iter().map(|point| point.observed.surfaces());
        counts.collect()
    }

    /// ln(k_lower/k_upper) of the widest and of the narrowest spectrum.
    pub fn bandwidths(&self) -> [f64; 2] {
        let all = self.points.iter().map(|point| libm::log(point.small[self.bandwidth]));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], one| {
            [least.min(one), most.max(one)]
        })
    }
}

/// The points of every fit that has κ = `area_corrected / load` and the three small numbers.
pub fn all(fits: &[LimitsFit], setting: &Setting) -> Result<Vec<KappaPoints>, TableError> {
    let kappa = Expression::parse("area_corrected / load").expect("this is an expression");
    let mut all: Vec<KappaPoints> = Vec::new();
    for fit in fits {
        let LimitsFit { choices, window, table } = fit;
        let is_meant = choices.of == kappa && choices.error.is_none();
        let Some([cell, bandwidth, mesh]) = small_numbers(choices).filter(|_| is_meant) else {
            continue;
        };
        let Some(table) = corrected(table, setting)? else {
            continue;
        };
        let groups = groups(&table, choices, *window)?;
        for group in &groups {
            let place = Point::of_row(&table.in_role(Role::Parameter), group.row);
            let place = place.only(&[HURST.name]);
            for load in group.loads.iter().flatten().copied() {
                let label = match groups.len() {
                    1 => format!("load {load}"),
                    _ => format!("{place}, load {load}"),
                };
                let points = KappaPoints {
                    points: group.points_under(Some(load)),
                    label,
                    load,
                    forms: forms(choices),
                    bandwidth,
                    cell,
                    mesh,
                };
                // Two stages may look at the same rows.
                let is_new = all.iter().all(|known| known.label != points.label);
                all.extend(Some(points).filter(|points| is_new && !points.points.is_empty()));
            }
        }
    }
    Ok(all)
}

/// The rows of a table that the correction of 2017 has made, within the setting.
fn corrected(table: &Table, setting: &Setting) -> Result<Option<Table>, TableError> {
    if !table.has(CORRECTION.name) {
        return Ok(None);
    }
    let table = setting.rows(table);
    let corrections = table.texts(CORRECTION.name)?;
    let own = (0..table.rows()).filter(|&row| corrections.value(row) == OF_2017);
    let own: Vec<usize> = own.collect();
    Ok((!own.is_empty()).then(|| table.pick(&own)))
}

/// The terms of the cell, the bandwidth and the mesh, where there is one of each and no other.
fn small_numbers(choices: &LimitChoices) -> Option<[usize; 3]> {
    let of = |columns: &[&str]| {
        let columns: BTreeSet<&str> = columns.iter().copied().collect();
        let mut terms = choices.terms.iter();
        terms.position(|term| term.of.columns().into_iter().collect::<BTreeSet<_>>() == columns)
    };
    let all = [
        of(&[K_LOWER.name])?,
        of(&[K_LOWER.name, K_UPPER.name])?,
        of(&[K_UPPER.name, NODES.name])?,
    ];
    (choices.terms.len() == all.len()).then_some(all)
}

fn forms(choices: &LimitChoices) -> Vec<Vec<TermForm>> {
    let terms = choices.terms.iter();
    terms.map(|term| term.forms.iter().map(|form| form.numeric()).collect()).collect()
}
