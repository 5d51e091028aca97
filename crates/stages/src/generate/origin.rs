//! Where a surface comes from.

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

/// Where a surface comes from.
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
        /// Whether the manifest gives the surface the anisotropy ratio 1, which its row then
        /// states. Recipes leave it out where it is false, so that their keys stay valid.
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
    /// What reads the file; nothing where that is a NumPy array.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reader: Option<Reader>,
    /// Which of its maps is asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<ChannelChoice>,
    /// What is done to it before its edges are made to meet.
    #[serde(flatten)]
    pub preparation: Preparation,
    /// What the content had when the study was read: for forecasts and messages alone.
    #[serde(skip)]
    pub seen: SeenMap,
}

/// A measured map as it was seen when the study was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SeenMap {
    /// Nodes along x and y once it is prepared.
    pub nodes: PerAxis<u32>,
    /// Sides of its cell then.
    pub side: PerAxis<f64>,
    /// Which map of the file it is; nothing where the file cannot be read.
    pub channel: Option<ChannelRead>,
    /// Points of its part that were not measured.
    pub missing: usize,
    /// Points of its part.
    pub points: usize,
    /// Where the nodes of the map in the file lie.
    pub file: Option<Grid>,
}

impl SeenMap {
    /// Bytes that the file's map takes for each node of the prepared one, beyond those of a map that
    /// is pressed as it is.
    pub fn read_besides(&self) -> f64 {
        let PerAxis([nodes_x, nodes_y]) = self.nodes;
        let prepared = f64::from(nodes_x) * f64::from(nodes_y);
        let more = self.file.map_or(0.0, |grid| grid.count() as f64) - prepared;
        (24.0 * more / prepared.max(1.0)).max(0.0)
    }
}

/// A measured surface, and what was found in its file.
pub struct ReadSurface {
    /// The prepared surface.
    pub prepared: Prepared,
    /// Which map of the file it is.
    pub channel: ChannelRead,
}

impl Origin {
    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        let PerAxis(nodes) = match self {
            Origin::Random { nodes, .. }
            | Origin::Spectrum { nodes, .. }
            | Origin::Shape { nodes, .. } => *nodes,
            Origin::File(file) => file.seen.nodes,
        };
        nodes.map(|nodes| nodes as usize)
    }

    /// Whether it is a measured map that is not periodic and has not been made so.
    pub fn is_open(&self) -> bool {
        matches!(self, Origin::File(file) if file.edges == Edges::Open)
    }

    /// Whether its spectrum is in the table of another task, which must be read to draw it.
    pub fn reads_stage(&self) -> bool {
        matches!(self, Origin::Spectrum { surface, .. } if surface.source.is_stage())
    }

    /// Draws the surface, or reads it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or is no map of heights or no spectrum; and where the
    /// spectrum is another task's.
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
    /// Reads the map, and prepares it; `side` is that of the map in the file, where that does not say
    /// it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or holds no map that can be prepared so.
    pub fn read(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
    ) -> Result<ReadSurface, StageError> {
        let (scan, channel) = self.scan(side, sources)?;
        Ok(ReadSurface { prepared: self.prepare(scan, sources)?, channel })
    }

    /// Reads the map as the file has it, and which of its maps that is.
    ///
    /// # Errors
    /// When the file is gone, has changed, or holds no such map.
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

    /// The map as it is to be pressed.
    pub fn prepare(&self, scan: Scan, sources: &SurfaceFiles) -> Result<Prepared, StageError> {
        let prepared = self.preparation.prepare(scan, self.edges);
        prepared.map_err(|source| StageError::Preparation { path: self.path(sources), source })
    }

    /// Where the file is, for messages.
    fn path(&self, sources: &SurfaceFiles) -> String {
        let path = sources.path_of(&self.content);
        path.map(|path| path.display().to_string()).unwrap_or_default()
    }
}
