//! Columns of areas that are corrected for the mesh.

use super::{AREA_FRACTION, CONTACT_NODES, STOP, SWITCHES, parameter, parameter_text, real};
use asperity_tables::column::Column;

// What a correction does.
pub const CORRECTION: Column =
    parameter_text("correction", "name of the estimator of the true area");
pub const COEFFICIENT: Column =
    parameter("coefficient", "1", "share of the Manhattan perimeter × mesh step taken off");
pub const AREA_CORRECTED: Column =
    real("area_corrected", "1", "estimate of the true share of the area");
pub const AREA_LOWER: Column = real(
    "area_lower",
    "1",
    "lower bound on the true share of the area, A − π/4 S_d Δx or 0; for pi/8",
);
pub const AREA_UPPER: Column =
    real("area_upper", "1", "upper bound on the true share of the area, as counted; for pi/8");
pub const ERROR_ABSOLUTE: Column = real(
    "error_absolute",
    "1",
    "what the correction takes away, π/8 S_d Δx, a share of the cell: half the distance of the \
     bounds where the lower one is above 0; for pi/8",
);
pub const ERROR_RELATIVE: Column =
    real("error_relative", "1", "what the correction takes away over the counted area; for pi/8");

/// What is corrected, and what it is corrected from.
pub const CORRECTED: [Column; 11] = [
    CORRECTION,
    COEFFICIENT,
    AREA_CORRECTED,
    AREA_LOWER,
    AREA_UPPER,
    ERROR_ABSOLUTE,
    ERROR_RELATIVE,
    AREA_FRACTION,
    CONTACT_NODES,
    SWITCHES,
    STOP,
];
