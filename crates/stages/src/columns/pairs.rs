//! Columns of surfaces that are made of other surfaces: pairs that are pressed against each other,
//! and surfaces that have yielded.

use super::{RMS_HEIGHT, parameter, parameter_text};
use asperity_tables::column::{Code, Column, Role};

pub const FROM_RMS_SLOPE: Column = parameter(
    "from_rms_slope",
    "1",
    "root mean square gradient to which the surface of the stage in `from` is scaled, before \
     another surface is added or the surface yields; `rms_slope` is that of the result",
);
pub const FROM_RMS_HEIGHT: Column = Column {
    name: "from_rms_height",
    meaning: "root mean square height to which the surface of the stage in `from` is scaled, \
              before another surface is added or the surface yields; `rms_height` is that of the \
              result",
    ..RMS_HEIGHT.with_role(Role::Parameter)
};
pub const FROM_SURFACE: Column = parameter_text(
    "from_surface",
    "name of the surface of the stage in `from` in the table of this stage; `surface` names the \
     pair",
)
.with_role(Role::Surface);
pub const AGAINST: Column = parameter_text(
    "against",
    "first digits of the name of the first surface of the stage in `against`; the slope, height, Nayak's parameter, \
     summit density and load of full contact of the row are those of the sum of both surfaces, and \
     `seed` and `realization` identify the pair",
);
pub const AGAINST_SURFACE: Column = parameter_text(
    "against_surface",
    "name of the surface of the stage in `against` in the table of this stage",
)
.with_role(Role::Surface);
pub const SHIFT_X: Column = parameter(
    "shift_x",
    "1",
    "lateral shift of the surface of `against` along x, as a fraction of the side",
);
pub const SHIFT_Y: Column = parameter(
    "shift_y",
    "1",
    "lateral shift of the surface of `against` along y, as a fraction of the side",
);
pub const MIRROR: Column = parameter_text(
    "mirror",
    "axis along which the map of `against` is reversed; null where both maps have common axes",
)
.with_codes(&[
    Code { word: "x", meaning: "turned over about the y axis" },
    Code { word: "y", meaning: "turned over about the x axis" },
]);

/// Columns that only pairs of surfaces and their contacts have.
pub const PAIR_COORDINATES: [Column; 8] = [
    FROM_RMS_SLOPE,
    FROM_RMS_HEIGHT,
    FROM_SURFACE,
    AGAINST,
    AGAINST_SURFACE,
    SHIFT_X,
    SHIFT_Y,
    MIRROR,
];

pub const ORIGINAL_SURFACE: Column = parameter_text(
    "original_surface",
    "name of the original surface in the tables of its stage; `surface` names the surface that \
     has yielded",
)
.with_role(Role::Surface);
pub const YIELDED_LOAD: Column = parameter(
    "yielded_load",
    "E* × rms slope",
    "largest load of the contact in which the surface yielded, in units of E* × rms slope of the \
     original surface",
);
pub const YIELDED_PRESSURE: Column = Column {
    name: "yielded_pressure",
    unit: "pressure",
    meaning: "largest mean pressure of the contact in which the surface yielded",
    ..YIELDED_LOAD
};
pub const YIELDED_HARDNESS: Column = parameter(
    "yielded_hardness",
    "pressure",
    "hardness of the material in the contact in which the surface yielded",
);
pub const YIELDED_HARDNESS_REDUCED: Column =
    Column { name: "yielded_hardness_reduced", unit: "E* × rms slope", ..YIELDED_HARDNESS };

/// Columns that only surfaces that have yielded and their contacts have.
pub const YIELDED_COORDINATES: [Column; 5] =
    [ORIGINAL_SURFACE, YIELDED_LOAD, YIELDED_PRESSURE, YIELDED_HARDNESS, YIELDED_HARDNESS_REDUCED];

/// Names of the columns that are set only where the surface of a row does not have the spectrum
/// that the other columns describe.
pub const ALTERATIONS: [&str; 3] = [AGAINST.name, YIELDED_LOAD.name, YIELDED_PRESSURE.name];
