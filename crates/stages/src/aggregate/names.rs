//! Columns of a table of groups, by their names.

use super::Statistic;
use asperity_tables::column::{Column, ColumnKind};

pub const COUNT: Column = Column::result("count", ColumnKind::Integer, "1", "rows in the group");
pub const SURFACES: Column = Column::result(
    "surfaces",
    ColumnKind::Integer,
    "1",
    "surfaces in the group, told apart by seed and realization or by their region of a file: one \
     surface may have several rows, at several parameter points",
);
pub const UNCONVERGED: Column = Column::result(
    "unconverged",
    ColumnKind::Integer,
    "1",
    "rows in the group whose load did not converge; they count all the same",
);
pub const UNFITTED: Column = Column::result(
    "unfitted",
    ColumnKind::Integer,
    "1",
    "fits in the group that failed; they are in `count`, and in no statistic",
);
pub const LOAD_MIDPOINT: Column = Column::result(
    "load_midpoint",
    ColumnKind::Real,
    "E* × rms slope",
    "load half way from the one before, where slopes belong",
);

/// Column with the reduced load of a group, from which slopes, secants and theories are computed.
pub const LOAD_OF_GROUP: &str = "load of group";

/// The name under which the mean waits for slopes and secants; no user's column has it.
pub fn mean_of(name: &str) -> String {
    format!("{name} mean")
}

pub fn named(name: &str, statistic: Statistic) -> String {
    format!("{name}_{}", statistic.suffix())
}

/// What is said of every group, whatever is reduced.
pub const OWN: [Column; 5] = [COUNT, SURFACES, UNCONVERGED, UNFITTED, LOAD_MIDPOINT];
