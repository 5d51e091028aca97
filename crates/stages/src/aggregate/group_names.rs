//! Columns that name groups, and columns that tell groups apart.
//!
//! A derived column (see [`Role::Derived`]) is a coordinate in another unit: under pressures in
//! pascals the reduced load differs from surface to surface, so that it must not split groups. The
//! coordinate that it is derived from tells groups apart in its place.

use polars::prelude::{DataFrame, Expr, col, lit, when};

use super::super::StageError;
use super::super::columns::{HARDNESS, HARDNESS_REDUCED, LOAD, PRESSURE};
use super::Groups;
use super::frame::polars_error;
use super::names::LOAD_OF_GROUP;
use crate::ensemble;
use asperity_manifest::decimal;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Coordinates that exist in two units, of which a manifest gives one.
const IN_TWO_UNITS: [[&str; 2]; 2] =
    [[LOAD.name, PRESSURE.name], [HARDNESS.name, HARDNESS_REDUCED.name]];

/// The columns that name the groups of a reduction.
pub struct GroupNames {
    /// Columns of the reduced table that name a group, in order.
    pub shown: Vec<String>,
    /// Columns whose values tell groups apart.
    pub keys: Vec<String>,
    /// Shown columns that are derived from a shown key. Their values within a group may differ.
    derived: Vec<String>,
    /// Shown columns that are derived from a key that is not shown, with that key. Their values
    /// within a group must not differ.
    stand_ins: Vec<(String, String)>,
    /// The key that is a load, if there is one.
    pub load: Option<String>,
}

impl GroupNames {
    /// Resolves `group_by`, which defaults to every coordinate that does not tell surfaces apart.
    pub fn of(table: &Table, groups: &Groups) -> GroupNames {
        let given = || table.coordinates().not_in_role(Role::Surface);
        let default = || given().names().into_iter().map(str::to_owned).collect();
        let shown: Vec<String> = groups.group_by.clone().unwrap_or_else(default);
        let load = ensemble::load_column(table);
        let derived = table.in_role(Role::Derived);
        // Stacked tables of both kinds have both columns in the role of a load.
        let is_derived = |name: &str| derived.has(name) || (is_of_a_load(name) && name != load);
        let (mut keys, mut stand_ins) = (Vec::new(), Vec::new());
        for name in &shown {
            let coordinate = coordinate_of(table, name).filter(|_| is_derived(name));
            match coordinate {
                None => keys.push(name.clone()),
                Some(coordinate) if shown.iter().any(|other| other == coordinate) => {}
                Some(coordinate) => {
                    keys.push(coordinate.to_owned());
                    stand_ins.push((name.clone(), coordinate.to_owned()));
                }
            }
        }
        let derived = shown.iter().filter(|&name| !keys.contains(name)).cloned();
        let is_load = |name: &&String| IN_TWO_UNITS[0].contains(&name.as_str());
        GroupNames {
            derived: derived.collect(),
            load: keys.iter().find(is_load).cloned().filter(|_| table.has(LOAD.name)),
            shown,
            keys,
            stand_ins,
        }
    }

    /// Returns the keys that tell curves apart: all but the load.
    pub fn keys_of_a_curve(&self) -> Vec<Expr> {
        let keys = self.keys.iter().filter(|name| !is_of_a_load(name));
        keys.map(|name| col(name.as_str())).collect()
    }

    /// Returns the shown columns that tell curves apart.
    pub fn curve(&self) -> Vec<String> {
        let stands_in = |name: &String| self.stand_ins.iter().any(|(own, _)| own == name);
        let shown = self.shown.iter().filter(|name| !is_of_a_load(name));
        shown.filter(|name| self.keys.contains(name) || stands_in(name)).cloned().collect()
    }

    /// Returns the values of derived columns in each group: the common value, or else the mean.
    pub fn within_groups(&self) -> Vec<Expr> {
        let mut expressions: Vec<Expr> = self.derived.iter().map(|name| common(name)).collect();
        let differs = self.stand_ins.iter();
        expressions.extend(differs.map(|(name, _)| is_mixed(name).alias(mixed(name))));
        if self.load.is_some() {
            expressions.push(common(LOAD.name).alias(LOAD_OF_GROUP));
        }
        expressions
    }

    /// Refuses a derived column that names groups and differs within one of them.
    pub fn check_stand_ins(&self, reduced: &DataFrame) -> Result<(), StageError> {
        for (name, coordinate) in &self.stand_ins {
            let flags = reduced.column(&mixed(name)).map_err(polars_error)?;
            if flags.bool().map_err(polars_error)?.any() {
                let reason = format!(
                    "cannot group by `{name}`, which follows from `{coordinate}` and differs between \
                     surfaces: group by `{coordinate}`"
                );
                return Err(StageError::Aggregate { reason });
            }
        }
        Ok(())
    }
}

/// Returns the column from which a derived column is computed.
fn coordinate_of(table: &Table, derived: &str) -> Option<&'static str> {
    let pair = IN_TWO_UNITS.iter().find(|pair| pair.contains(&derived))?;
    pair.iter().copied().find(|&name| name != derived && table.has(name))
}

fn is_of_a_load(name: &str) -> bool {
    IN_TWO_UNITS[0].contains(&name)
}

/// The value that all rows of a group share, or else their mean. Rounding counts for nothing.
fn common(name: &str) -> Expr {
    when(is_mixed(name))
        .then(col(name).mean())
        .otherwise(col(name).drop_nulls().first())
        .alias(name)
}

fn is_mixed(name: &str) -> Expr {
    let (least, most) = (col(name).min(), col(name).max());
    let spread = most.clone() - least;
    spread.gt(most * lit(decimal::RESOLUTION))
}

/// Name of the flag for a column that differs within a group; no user's column has a space in its
/// name.
fn mixed(name: &str) -> String {
    format!("{name} differs")
}
