//! Columns of the reduced table in addition to those that define groups and the statistics.

use crate::columns::{columns, integer, real};
use asperity_tables::column::Column;

columns! {
    /// number of rows in the group
    pub const COUNT: Column = integer("count", "1");
    /// number of surfaces in the group, distinguished by seed and realization or by their region of
    /// a file; one surface may have several rows, at several parameter points
    pub const SURFACES: Column = integer("surfaces", "1");
    /// number of rows in the group whose load did not converge; the statistics include them
    pub const UNCONVERGED: Column = integer("unconverged", "1");
    /// number of failed fits in the group; `count` includes them, the statistics do not
    pub const UNFITTED: Column = integer("unfitted", "1");
    /// mean of this load and the previous load of the curve, at which slopes are evaluated
    pub const LOAD_MIDPOINT: Column = real("load_midpoint", "E* × rms slope");
}

/// All columns of the reduced table except group columns and statistics.
pub const GROUP_COLUMNS: [Column; 5] = [COUNT, SURFACES, UNCONVERGED, UNFITTED, LOAD_MIDPOINT];

/// Intermediate column with the reduced load of a group, for slopes, secants and theories.
pub const LOAD_OF_GROUP: &str = "load of group";

/// Returns the name of the intermediate column with the mean of a column.
pub fn mean_of(name: &str) -> String {
    format!("{name} mean")
}
