//! Columns that the tables of all laws have.

use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::{Integer, Real, Text};

/// Which law.
pub const LAW: Column = Column::parameter("law", Text, "", "the law that is fitted");
/// How many surfaces.
pub const SURFACES: Column = Column::result("surfaces", Integer, "1", "surfaces pooled");
/// Rows of loads that were given up.
pub const UNCONVERGED: Column = Column::result(
    "unconverged",
    Integer,
    "1",
    "rows whose load did not converge; they are fitted all the same",
);
/// How many data.
pub const DATA: Column = Column::result("data", Integer, "1", "data fitted");
/// What a fit leaves.
pub const RMS_RESIDUAL: Column =
    Column::result("rms_residual", Real, "1", "root mean square residual");
/// What it leaves, over the scatter.
pub const CHI_SQUARE: Column = Column::result(
    "reduced_chi_square",
    Real,
    "1",
    "χ² over degrees of freedom, from the scatter between surfaces",
);
/// Resamplings.
pub const BOOTSTRAP: Column =
    Column::result("bootstrap", Integer, "1", "resamplings of whole surfaces");
/// Those that failed.
pub const BOOTSTRAP_FAILED: Column =
    Column::result("bootstrap_failed", Integer, "1", "resamplings that could not be fitted");
/// Whether there is a fit.
pub const STATUS: Column = Column::result("status", Text, "", "fitted, or why values are missing");
