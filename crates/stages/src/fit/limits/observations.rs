//! An observable of every surface under every load, sorted into groups and their points.
//!
//! A point is one ensemble: rows that agree in every parameter. A group is the points that agree in
//! every parameter but those that vary among the points of a fit.

use std::collections::BTreeSet;

use super::LimitChoices;
use super::points::{Known, Reader};
use crate::columns::{K_LOWER, K_ROLLOFF};
use crate::ensemble::{Member, Point};
use asperity_manifest::decimal;
use asperity_statistics::Window;
use asperity_statistics::limits::{LimitPoint, Observed};
use asperity_tables::column::Value;
use asperity_tables::table::{Table, TableError};

/// The points of one fit.
#[derive(Debug, Clone)]
pub struct Group {
    /// A row of the table that stands for what the points share.
    pub row: usize,
    /// The same multiple of `k_lower` at which the plateaus of all points end, where cutoffs vary.
    pub rolloff_ratio: Option<f64>,
    /// Where fits are made: the loads, or once where rows have none.
    pub loads: Vec<Option<f64>>,
    points: Vec<Observations>,
    /// The surfaces of all points, each once.
    members: BTreeSet<Member>,
}

/// The observable at one point.
#[derive(Debug, Clone)]
struct Observations {
    /// The parameters that vary among the points of a fit.
    place: Point,
    small: Vec<f64>,
    known: Known,
    /// Loads that did not converge, one entry a surface.
    given_up: Vec<f64>,
}

impl Group {
    /// The points that have the observable of all their surfaces under a load. A surface has no rows
    /// beyond its first load in full contact, and a mean over those that are left would be biased.
    pub fn points_under(&self, load: Option<f64>) -> Vec<LimitPoint> {
        let points = self.points.iter();
        let members = &self.members();
        points.filter_map(|point| point.under(load, members)).collect()
    }

    /// The same with the parameters of each that vary among them.
    pub fn placed_under(&self, load: Option<f64>) -> Vec<(Point, LimitPoint)> {
        let points = self.points.iter();
        let members = &self.members();
        let placed =
            |point: &Observations| Some((point.place.clone(), point.under(load, members)?));
        points.filter_map(placed).collect()
    }

    /// The surfaces in the order of their numbers.
    fn members(&self) -> Vec<Member> {
        self.members.iter().copied().collect()
    }

    /// Rows under a load that did not converge.
    pub fn unconverged(&self, load: Option<f64>) -> usize {
        let loads = self.points.iter().flat_map(|point| &point.given_up);
        let here =
            loads.filter(|given_up| load.is_none_or(|load| decimal::is_same(load, **given_up)));
        here.count()
    }
}

impl Observations {
    fn under(&self, load: Option<f64>, numbered: &[Member]) -> Option<LimitPoint> {
        let is_here = |other: Option<f64>| match (load, other) {
            (Some(load), Some(other)) => decimal::is_same(load, other),
            (None, None) => true,
            _ => false,
        };
        let observed = match &self.known {
            Known::Surfaces { members, states } => {
                let (_, values) = states.iter().find(|(other, _)| is_here(*other))?;
                let is_complete = values.iter().all(|value| value.is_finite());
                let number = |member| numbered.partition_point(|other| other < member);
                is_complete.then(|| Observed::Surfaces {
                    units: members.iter().map(number).collect(),
                    values: values.clone(),
                })?
            }
            Known::Estimates(states) => {
                let (_, estimate) = states.iter().find(|(other, _)| is_here(*other))?;
                estimate.clone()
            }
        };
        Some(LimitPoint { small: self.small.clone(), observed })
    }

    fn loads(&self) -> Vec<Option<f64>> {
        match &self.known {
            Known::Surfaces { states, .. } => states.iter().map(|(load, _)| *load).collect(),
            Known::Estimates(states) => states.iter().map(|(load, _)| *load).collect(),
        }
    }
}

/// The groups of a table, in the order of their first rows.
///
/// # Errors
/// When a column is missing.
pub fn groups(
    table: &Table,
    choices: &LimitChoices,
    window: Window,
) -> Result<Vec<Group>, TableError> {
    let reader = Reader::new(table, choices)?;
    let mut order: Vec<(Point, Option<Value>)> = Vec::new();
    let mut groups: Vec<Group> = Vec::new();
    for (row, point, known, given_up) in reader.points()? {
        let over: Vec<&str> = choices.over.iter().map(String::as_str).collect();
        let mut shared = point.clone().without(&over);
        let ratio = rolloff_ratio(&point, choices);
        if ratio.is_some() {
            shared = shared.without(&[K_ROLLOFF.name]);
        }
        let key = (shared, ratio.map(Value::Real));
        let at = order.iter().position(|other| *other == key);
        let at = at.unwrap_or_else(|| {
            order.push(key);
            groups.push(Group {
                row,
                rolloff_ratio: ratio,
                loads: Vec::new(),
                points: Vec::new(),
                members: BTreeSet::new(),
            });
            groups.len() - 1
        });
        if let Known::Surfaces { members, .. } = &known {
            groups[at].members.extend(members);
        }
        groups[at].points.push(Observations {
            place: point.only(&over),
            small: reader.small(row),
            known,
            given_up,
        });
    }
    for group in &mut groups {
        group.loads = loads(&group.points, choices, window);
    }
    Ok(groups)
}

/// k_rolloff/k_lower, where `k_lower` varies and the end of the plateau is not said to.
fn rolloff_ratio(point: &Point, choices: &LimitChoices) -> Option<f64> {
    let varies = |name: &str| choices.over.contains(name);
    if !varies(K_LOWER.name) || varies(K_ROLLOFF.name) {
        return None;
    }
    let number = |name: &str| point.get(name).and_then(number_of);
    Some(decimal::nearest(number(K_ROLLOFF.name)? / number(K_LOWER.name)?))
}

fn number_of(value: &Value) -> Option<f64> {
    match value {
        Value::Real(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        Value::Text(_) => None,
    }
}

fn loads(points: &[Observations], choices: &LimitChoices, window: Window) -> Vec<Option<f64>> {
    let mut all: Vec<f64> = points.iter().flat_map(Observations::loads).flatten().collect();
    if all.is_empty() {
        return vec![None];
    }
    if !choices.loads.is_empty() {
        return choices.loads.iter().copied().map(Some).collect();
    }
    all.retain(|&load| window.contains(load));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    all.into_iter().map(Some).collect()
}
