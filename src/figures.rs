//! Pictures: maps of a surface as pixels. They know no study and no file.

pub mod raster;
