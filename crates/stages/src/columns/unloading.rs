//! Columns of loads on a path that goes down again, with a hardness.

use super::{BRANCH, parameter, real};
use asperity_tables::column::{Code, Column};

pub const LOADING_BRANCH: Column = Column {
    meaning: "part of the path to which the load belongs; null if the stage has no `path`",
    ..BRANCH
}
.with_codes(&[
    Code { word: "loading", meaning: "no load before it was larger" },
    Code {
        word: "unloading",
        meaning: "a load before it was larger, `maximum_load`; loading again up to this maximum \
                  returns through the same states",
    },
]);
pub const MAXIMUM_LOAD: Column = parameter(
    "maximum_load",
    "E* × rms slope",
    "largest load before this one, under which the material yielded; null while loading",
);
pub const MAXIMUM_PRESSURE: Column = Column {
    unit: "pressure",
    meaning: "largest mean pressure before this one, under which the material yielded; null while \
              loading",
    ..MAXIMUM_LOAD
};
pub const RESIDUAL_DEPTH: Column = real(
    "residual_depth",
    "length",
    "mean plastic depth of the surface, which remains without a load",
);
pub const PLASTIC_WORK: Column = real(
    "plastic_work",
    "pressure × length",
    "plastic work per nominal area up to the largest load so far: hardness × residual depth",
);
