//! Where a surface comes from.

use serde::{Deserialize, Serialize};

use crate::contact::grid::Grid;
use crate::contact::topography::measured;
use crate::contact::topography::periodic::Edges;
use crate::contact::topography::random::RandomSurface;
use crate::contact::topography::shapes::Shape;
use crate::contact::topography::surface::Surface;
use crate::stages::StageError;
use crate::surface_files::{ContentHash, SurfaceFiles};

/// Where a surface comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// A random self-affine surface.
    Random {
        /// Nodes per side.
        nodes: u32,
        /// Spectrum, draw and scale.
        #[serde(flatten)]
        surface: RandomSurface,
    },
    /// A measured surface.
    File(MeasuredSurface),
    /// A shape with a closed-form solution.
    Shape {
        /// Nodes per side.
        nodes: u32,
        /// Which one.
        #[serde(flatten)]
        shape: Shape,
    },
}

/// A map of heights in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "file")]
pub struct MeasuredSurface {
    /// Hash of the file's content; its path decides nothing.
    pub content: ContentHash,
    /// Unit of length, a label.
    pub unit: String,
    /// Factor that turns the file's numbers into lengths.
    pub height_scale: f64,
    /// How the map's edges are made to meet.
    #[serde(flatten)]
    pub edges: Edges,
    /// Nodes per side once its edges meet, as the content has them: for forecasts alone.
    #[serde(skip)]
    pub nodes: u32,
}

impl Origin {
    /// Nodes per side.
    pub fn nodes(&self) -> usize {
        match self {
            Origin::Random { nodes, .. } | Origin::Shape { nodes, .. } => *nodes as usize,
            Origin::File(file) => file.nodes as usize,
        }
    }

    /// Draws the surface, or reads it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or is no map of heights.
    pub fn draw(&self, side: f64, sources: &SurfaceFiles) -> Result<Surface, StageError> {
        match self {
            Origin::Random { surface, .. } => Ok(surface.draw(grid(self.nodes(), side)?)),
            Origin::Shape { shape, .. } => Ok(shape.draw(grid(self.nodes(), side)?)),
            Origin::File(file) => {
                let bytes = sources.read(&file.content)?;
                let cell = grid(1, side)?.cell();
                let map = measured::read_npy(&bytes, cell).map_err(|source| {
                    let path = sources.path_of(&file.content);
                    StageError::Measured {
                        path: path
                            .map(|path| path.display().to_string())
                            .unwrap_or_default(),
                        source,
                    }
                })?;
                let map = map.scaled(file.height_scale).map_err(StageError::Heights)?;
                Ok(file.edges.close(map))
            }
        }
    }
}

/// So many nodes on a square cell.
///
/// # Errors
/// When there is no node, or no cell.
pub fn grid(nodes: usize, side: f64) -> Result<Grid, StageError> {
    Grid::square(nodes, side).map_err(|error| StageError::Heights(error.into()))
}
