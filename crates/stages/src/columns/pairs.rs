//! Columns of surfaces that are made of other surfaces: pairs that are pressed against each other,
//! and surfaces that have yielded.

use super::{RMS_HEIGHT, codes, columns, parameter, parameter_text};
use asperity_tables::column::{Column, Role};

columns! {
    /// Columns that only pairs of surfaces and their contacts have.
    pub const PAIR_COORDINATES = [
        /// root mean square gradient to which the surface of the stage in `from` is scaled, before
        /// another surface is added or the surface yields; `rms_slope` is that of the result
        pub const FROM_RMS_SLOPE: Column = parameter("from_rms_slope", "1");
        /// root mean square height to which the surface of the stage in `from` is scaled, before
        /// another surface is added or the surface yields; `rms_height` is that of the result
        pub const FROM_RMS_HEIGHT: Column =
            Column { name: "from_rms_height", ..RMS_HEIGHT.with_role(Role::Parameter) };
        /// name of the surface of the stage in `from` in the table of this stage; `surface` names
        /// the pair
        pub const FROM_SURFACE: Column = parameter_text("from_surface").with_role(Role::Surface);
        /// first digits of the name of the first surface of the stage in `against`; the slope,
        /// height, Nayak's parameter, summit density and load of full contact of the row are those
        /// of the sum of both surfaces, and `seed` and `realization` identify the pair
        pub const AGAINST: Column = parameter_text("against");
        /// name of the surface of the stage in `against` in the table of this stage
        pub const AGAINST_SURFACE: Column =
            parameter_text("against_surface").with_role(Role::Surface);
        /// lateral shift of the surface of `against` along x, as a fraction of the side
        pub const SHIFT_X: Column = parameter("shift_x", "1");
        /// lateral shift of the surface of `against` along y, as a fraction of the side
        pub const SHIFT_Y: Column = parameter("shift_y", "1");
        /// axis along which the map of `against` is reversed; null where both maps have common axes
        pub const MIRROR: Column = parameter_text("mirror").with_codes(codes![
            /// turned over about the y axis
            "x",
            /// turned over about the x axis
            "y",
        ]);
    ];
}

columns! {
    /// Columns that only surfaces that have yielded and their contacts have.
    pub const YIELDED_COORDINATES = [
        /// name of the original surface in the tables of its stage; `surface` names the surface
        /// that has yielded
        pub const ORIGINAL_SURFACE: Column =
            parameter_text("original_surface").with_role(Role::Surface);
        /// largest load of the contact in which the surface yielded, in units of E* × rms slope of
        /// the original surface
        pub const YIELDED_LOAD: Column = parameter("yielded_load", "E* × rms slope");
        /// largest mean pressure of the contact in which the surface yielded
        pub const YIELDED_PRESSURE: Column =
            Column { name: "yielded_pressure", unit: "pressure", ..YIELDED_LOAD };
        /// hardness of the material in the contact in which the surface yielded
        pub const YIELDED_HARDNESS: Column = parameter("yielded_hardness", "pressure");
        /// hardness of the material in the contact in which the surface yielded
        pub const YIELDED_HARDNESS_REDUCED: Column =
            Column { name: "yielded_hardness_reduced", unit: "E* × rms slope", ..YIELDED_HARDNESS };
    ];
}

/// Names of the columns that are set only where the surface of a row does not have the spectrum
/// that the other columns describe.
pub const ALTERATIONS: [&str; 3] = [AGAINST.name, YIELDED_LOAD.name, YIELDED_PRESSURE.name];
