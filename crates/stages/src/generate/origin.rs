//! The origin of a surface: its spectrum, its file or its shape.

use serde::{Deserialize, Serialize};

use super::map_file::{ChannelChoice, ChannelRead, MapFile, MapFileError, Reader};
use super::mesh::PerAxis;
use super::spectrum::SpectrumSurface;
use crate::StageError;
use crate::grids::grid;
use crate::surface_files::{ContentHash, SurfaceFiles};
use asperity_contact::grid::Grid;
use asperity_contact::threads::Threads;
use asperity_contact::topography::periodic::Edges;
use asperity_contact::topography::preparation::{Preparation, Prepared};
use asperity_contact::topography::random::RandomSurface;
use asperity_contact::topography::shapes::Shape;
use asperity_contact::topography::surface::{Scan, Surface};

/// The origin of a surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// A random self-affine surface.
    Random {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Spectrum, draw and scale.
        #[serde(flatten)]
        surface: RandomSurface,
        /// True if the manifest gives the anisotropy ratio 1, which is then a coordinate of the
        /// row. Omitted from recipes if false, so that existing keys stay valid.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        has_unit_ratio: bool,
    },
    /// A measured surface.
    File(Box<MeasuredSurface>),
    /// A random surface with a given spectrum.
    Spectrum {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Spectrum and draw.
        #[serde(flatten)]
        surface: SpectrumSurface,
    },
    /// A shape with a closed-form solution.
    Shape {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Shape and its dimensions.
        #[serde(flatten)]
        shape: Shape,
    },
}

/// A height map in a file, with its preparation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "file")]
pub struct MeasuredSurface {
    /// Hash of the content of the file; the path is not part of the recipe.
    pub content: ContentHash,
    /// Unit of length, which is only a label.
    pub unit: String,
    /// Factor that converts the numbers of the file to lengths.
    pub height_scale: f64,
    /// Treatment of the edges of the map.
    #[serde(flatten)]
    pub edges: Edges,
    /// Reader of the file; none for a NumPy array.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reader: Option<Reader>,
    /// The chosen map of the file; none for the first one with heights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<ChannelChoice>,
    /// Preparation of the map before the treatment of its edges.
    #[serde(flatten)]
    pub preparation: Preparation,
    /// Properties of the map when the study was read, for forecasts and messages only.
    #[serde(skip)]
    pub seen: SeenMap,
}

/// Properties of a measured map when the study was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SeenMap {
    /// Nodes along x and y of the prepared map.
    pub nodes: PerAxis<u32>,
    /// Sides of the prepared map along x and y.
    pub side: PerAxis<f64>,
    /// The map that was read; none if the file cannot be read.
    pub channel: Option<ChannelRead>,
    /// Number of points of the cropped map that were not measured.
    pub missing: usize,
    /// Number of points of the cropped map.
    pub points: usize,
    /// Grid of the map in the file.
    pub file: Option<Grid>,
}

impl SeenMap {
    /// Returns the memory in bytes that the map in the file takes for each node of the prepared
    /// map, in addition to that of a map without preparation.
    pub fn read_besides(&self) -> f64 {
        let PerAxis([nodes_x, nodes_y]) = self.nodes;
        let prepared = f64::from(nodes_x) * f64::from(nodes_y);
        let more = self.file.map_or(0.0, |grid| grid.count() as f64) - prepared;
        (24.0 * more / prepared.max(1.0)).max(0.0)
    }
}

/// A measured surface with the map that was read.
pub struct ReadSurface {
    /// The surface after its preparation.
    pub prepared: Prepared,
    /// The map of the file that was read.
    pub channel: ChannelRead,
}

impl Origin {
    /// Returns the nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        let PerAxis(nodes) = match self {
            Origin::Random { nodes, .. }
            | Origin::Spectrum { nodes, .. }
            | Origin::Shape { nodes, .. } => *nodes,
            Origin::File(file) => file.seen.nodes,
        };
        nodes.map(|nodes| nodes as usize)
    }

    /// Returns whether it is a measured map that is not periodic and has not been made so.
    pub fn is_open(&self) -> bool {
        matches!(self, Origin::File(file) if file.edges == Edges::Open)
    }

    /// Returns whether its spectrum is in the table of another task.
    pub fn reads_stage(&self) -> bool {
        matches!(self, Origin::Spectrum { surface, .. } if surface.source.is_stage())
    }

    /// Draws or reads the surface.
    ///
    /// # Errors If the file is missing, has changed, or cannot be read, or if the spectrum is in
    /// the table of another task.
    pub fn draw(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        let grid = || grid(self.nodes(), side.unwrap_or_default());
        match self {
            Origin::Random { surface, .. } => Ok(surface.draw_on(threads, grid()?)),
            Origin::Shape { shape, .. } => Ok(shape.draw(grid()?)),
            Origin::Spectrum { surface, .. } => {
                let density = surface.density_of_file(sources)?;
                surface.draw(&density, grid()?, threads)
            }
            Origin::File(file) => Ok(file.read(side, sources)?.prepared.surface),
        }
    }
}

impl MeasuredSurface {
    /// Reads and prepares the map; `side` is for files without the side of their map.
    ///
    /// # Errors
    /// If the file is missing, has changed or cannot be read, or the map cannot be prepared.
    pub fn read(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
    ) -> Result<ReadSurface, StageError> {
        let (scan, channel) = self.scan(side, sources)?;
        Ok(ReadSurface { prepared: self.prepare(scan, sources)?, channel })
    }

    /// Reads the map without preparing it.
    ///
    /// # Errors
    /// If the file is missing, has changed or has no such map.
    pub fn scan(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
    ) -> Result<(Scan, ChannelRead), StageError> {
        let bytes = sources.read(&self.content)?;
        let unusable = |source: MapFileError| StageError::Measured {
            path: self.path(sources),
            source: Box::new(source),
        };
        let map = MapFile::read(&bytes, self.channel.as_ref()).map_err(unusable)?;
        let channel = map.channel.clone();
        let scan = map.scan(side, self.height_scale).map_err(unusable)?;
        Ok((scan, channel))
    }

    /// Prepares a map that has been read.
    pub fn prepare(&self, scan: Scan, sources: &SurfaceFiles) -> Result<Prepared, StageError> {
        let prepared = self.preparation.prepare(scan, self.edges);
        prepared.map_err(|source| StageError::Preparation { path: self.path(sources), source })
    }

    /// Returns the path of the file for messages.
    fn path(&self, sources: &SurfaceFiles) -> String {
        let path = sources.path_of(&self.content);
        path.map(|path| path.display().to_string()).unwrap_or_default()
    }
}
