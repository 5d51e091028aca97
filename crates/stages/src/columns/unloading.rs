//! Columns of loads on a path that goes down again, with a hardness.

use super::{BRANCH, codes, columns, parameter, real};
use asperity_tables::column::Column;

columns! {
    /// part of the path to which the load belongs; null if the stage has no `path`
    pub const LOADING_BRANCH: Column = BRANCH.with_codes(codes![
        /// no load before it was larger
        "loading",
        /// a load before it was larger, `maximum_load`; loading again up to this maximum returns
        /// through the same states
        "unloading",
    ]);
    /// largest load before this one, under which the material yielded; null while loading
    pub const MAXIMUM_LOAD: Column = parameter("maximum_load", "E* × rms slope");
    /// largest mean pressure before this one, under which the material yielded; null while loading
    pub const MAXIMUM_PRESSURE: Column = Column { unit: "pressure", ..MAXIMUM_LOAD };
    /// mean plastic depth of the surface, which remains without a load
    pub const RESIDUAL_DEPTH: Column = real("residual_depth", "length");
    /// plastic work per nominal area up to the largest load so far: hardness × residual depth
    pub const PLASTIC_WORK: Column = real("plastic_work", "pressure × length");
}
