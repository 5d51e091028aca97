//! Pictures: curves as vectors, maps of a surface as pixels. They know no study and no file.
//!
//! A [`chart::Chart`] is what to draw, a [`figure::Figure`] puts charts and maps side by side above
//! one legend and turns them into SVG, [`pixels`] turns that into PNG. Equal data give equal bytes.

pub mod axis;
pub mod chart;
pub mod colour;
pub mod figure;
pub mod height_map;
pub mod legend;
pub mod map_panel;
pub mod pixels;
pub mod raster;
pub mod style;
pub mod svg;
pub mod words;
