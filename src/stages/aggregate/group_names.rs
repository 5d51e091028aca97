//! Which columns name groups, and which of them tell groups apart.
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
use crate::decimal;
use crate::ensemble;
use crate::store::column::Role;
use crate::store::table::Table;

/// A coordinate in two units, of which a study gives one.
const IN_TWO_UNITS: [[&str; 2]; 2] = [
    [LOAD.name, PRESSURE.name],
    [HARDNESS.name, HARDNESS_REDUCED.name],
];

/// The columns that name the groups of a reduction.
pub struct GroupNames {
    /// Those that stand in the reduced table, in order.
    pub shown: Vec<String>,
    /// Those whose values tell groups apart.
    pub keys: Vec<String>,
    /// Derived columns among the shown ones. Their values within a group may differ.
    derived: Vec<String>,
    /// Derived columns among the shown ones whose coordinate is not shown, and the coordinate that is
    /// a key in their place. Their values within a group must not differ.
    stand_ins: Vec<(String, String)>,
    /// The key that is a load, if there is one.
    pub load: Option<String>,
}

impl GroupNames {
    /// The columns that `group_by` names, or every coordinate but those that tell surfaces apart.
    pub fn of(table: &Table, groups: &Groups) -> GroupNames {
        let given = || table.coordinates().not_in_role(Role::Surface);
        let default = || given().names().into_iter().map(str::to_owned).collect();
        let shown: Vec<String> = groups.group_by.clone().unwrap_or_else(default);
        let load = ensemble::load_column(table);
        let derived = table.in_role(Role::Derived);
        // A stack of tables of both kinds has both columns as loads.
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
            load: keys
                .iter()
                .find(is_load)
                .cloned()
                .filter(|_| table.has(LOAD.name)),
            shown,
            keys,
            stand_ins,
        }
    }

    /// The keys that tell curves apart, and not the points of one.
    pub fn keys_of_a_curve(&self) -> Vec<Expr> {
        let keys = self.keys.iter().filter(|name| !is_of_a_load(name));
        keys.map(|name| col(name.as_str())).collect()
    }

    /// The shown columns that tell curves apart.
    pub fn curve(&self) -> Vec<String> {
        let stands_in = |name: &String| self.stand_ins.iter().any(|(own, _)| own == name);
        let shown = self.shown.iter().filter(|name| !is_of_a_load(name));
        shown
            .filter(|name| self.keys.contains(name) || stands_in(name))
            .cloned()
            .collect()
    }

    /// Values of derived columns in each group: the one that all rows have, or their mean.
    pub fn within_groups(&self) -> Vec<Expr> {
        let mut expressions: Vec<Expr> = self.derived.iter().map(|name| common(name)).collect();
        let differs = self.stand_ins.iter();
        expressions.extend(differs.map(|(name, _)| is_mixed(name).alias(mixed(name))));
        if self.load.is_some() {
            expressions.push(common(LOAD.name).alias(LOAD_OF_GROUP));
        }
        expressions
    }

    /// Refuses a derived column that was to name groups and differs within them.
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

/// The column of a table that a derived column is computed from.
fn coordinate_of(table: &Table, derived: &str) -> Option<&'static str> {
    let pair = IN_TWO_UNITS.iter().find(|pair| pair.contains(&derived))?;
    pair.iter()
        .copied()
        .find(|&name| name != derived && table.has(name))
}

fn is_of_a_load(name: &str) -> bool {
    IN_TWO_UNITS[0].contains(&name)
}

/// The value that all rows of a group have but for rounding, or else their mean.
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

/// The name of the flag that says that a column differs within a group; no user's column has a space.
fn mixed(name: &str) -> String {
    format!("{name} differs")
}
