//! Origin of a surface: a spectrum, a file, a shape or other surfaces.

use serde::{Deserialize, Serialize};

use crate::StageError;
use crate::grids::grid;
use crate::map_file::{ChannelRead, MapChoice, MapFile, MapFileError, Reader};
use crate::per_axis::PerAxis;
use crate::surface::labels::Labels;
use crate::surface::pair::{Pair, Yielded};
use crate::surface::spectrum::{PrescribedHeights, Source, SpectrumSurface};
use crate::surface_files::{ContentHash, SurfaceFiles};
use crate::version::Version;
use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::{Preparation, Prepared, Removed};
use asperity_mechanics::topography::prescribed_heights::HeightDistribution;
use asperity_mechanics::topography::random::RandomSurface;
use asperity_mechanics::topography::reliability::Reliability;
use asperity_mechanics::topography::shapes::Shape;
use asperity_mechanics::topography::surface::{Scan, Surface};
use asperity_topography_files::SuspectNumber;

/// The origin of a surface: a spectrum, a file, a shape or other surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// A random self-affine surface.
    Random {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Parameters of the spectrum, slope, seed and realization.
        #[serde(flatten)]
        surface: RandomSurface,
        /// True if the manifest gives the anisotropy ratio 1, which then has a parameter column.
        /// Omitted from recipes if false, so that existing keys stay valid.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        has_unit_ratio: bool,
        /// Rms height to which each surface is scaled, instead of a rms slope. `surface` then has
        /// the rms slope of the expected spectrum with this rms height. Omitted from recipes if
        /// absent, so that existing keys stay valid.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rms_height: Option<f64>,
        /// Height distribution of a surface that is not Gaussian.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        height_distribution: Option<PrescribedHeights>,
        /// Name of the unit of length, which is only a label; empty if the manifest names none.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        unit: String,
    },
    /// A measured surface from a file.
    File(Box<MeasuredSurface>),
    /// A random surface with a given power spectral density.
    Spectrum {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// Source of the spectrum, slope, seed and realization.
        #[serde(flatten)]
        surface: SpectrumSurface,
        /// Height distribution of a surface that is not Gaussian.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        height_distribution: Option<PrescribedHeights>,
    },
    /// A shape with a closed-form contact solution.
    Shape {
        /// Nodes along x and y.
        nodes: PerAxis<u32>,
        /// The shape with its dimensions.
        #[serde(flatten)]
        shape: Shape,
        /// Name of the unit of length, which is only a label; empty if the manifest names none.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        unit: String,
    },
    /// The summed heights of two surfaces that are pressed against each other.
    Pair(Box<Pair>),
    /// A surface that has yielded in a contact.
    Yielded(Box<Yielded>),
}

/// Version of the numbers of the tip on periodic maps.
pub const PERIODIC_TIP_VERSION: Version =
    Version::new(1, &["`tip_wavelength` of periodic maps compares peaks across the edges, too"]);

/// The recipe of a measured surface: a height map in a file, and its preparation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "file")]
pub struct MeasuredSurface {
    /// Hash of the content of the file. The path is not part of the recipe.
    pub content: ContentHash,
    /// Name of the unit of length, which is only a label.
    pub unit: String,
    /// Factor that converts the values of the file to heights in the unit of length.
    pub height_scale: f64,
    /// Treatment of the edges of the map: none, mirroring or tapering.
    #[serde(flatten)]
    pub edges: Edges,
    /// Reader of the file format; `None` for a NumPy array.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reader: Option<Reader>,
    /// Map to read, and its missing points.
    #[serde(flatten)]
    pub choice: MapChoice,
    /// Crop, repairs, levelling, filling, filters and resampling, all applied before the treatment
    /// of the edges.
    #[serde(flatten)]
    pub preparation: Preparation,
    /// Version of the cutoff of the tip. Only the recipe of a periodic map with a `tip_radius` has
    /// it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_version: Option<u32>,
    /// Properties of the map found when the manifest was checked, for forecasts and messages only.
    #[serde(skip)]
    pub seen: InspectedMap,
    /// Labels of the surface, which no recipe contains.
    #[serde(skip)]
    pub labels: Labels,
}

impl MeasuredSurface {
    /// Returns all that makes the surface another parameter point, but for its file, region and
    /// channel: labels, scale of heights and preparation.
    pub fn treatment(&self) -> impl PartialEq + use<> {
        let preparation = Preparation { crop: None, ..self.preparation.clone() };
        (self.labels.values.clone(), self.height_scale, self.edges, preparation)
    }

    /// Returns the version of the cutoff of the tip for such a map.
    pub fn version_of_tip(edges: Edges, preparation: &Preparation) -> Option<u32> {
        let compares = edges == Edges::Periodic && preparation.tip_radius.is_some();
        compares.then(|| PERIODIC_TIP_VERSION.number())
    }
}

/// Properties of a measured map, found when the manifest was checked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InspectedMap {
    /// Number of nodes of the prepared map along x and y.
    pub nodes: PerAxis<u32>,
    /// Sides of the prepared map along x and y.
    pub side: PerAxis<f64>,
    /// Name and number of the map in the file; `None` if the file could not be read.
    pub channel: Option<ChannelRead>,
    /// Number in the file that probably marks missing points.
    pub suspect: Option<SuspectNumber>,
    /// What the reader of the file guessed, and which parts of the file it did not use.
    pub notes: Vec<String>,
    /// Number of points of the cropped map that were not measured or were removed.
    pub missing: usize,
    /// Numbers of points that the preparation removed, which are among the missing ones.
    pub removed: Removed,
    /// True if missing points are filled, also if the file could not be read and an earlier run
    /// filled them.
    pub is_filled: bool,
    /// Number of all points of the cropped map.
    pub points: usize,
    /// Grid of the map in the file; `None` if the file could not be read.
    pub file: Option<Grid>,
    /// Shortest wavelength that the instrument resolved, if the manifest asks for it.
    pub reliability: Option<Reliability>,
    /// Rms step between opposite edges over the rms step between neighbouring nodes, for a map that
    /// the manifest declares periodic; otherwise 0.
    pub edge_step_ratio: f64,
    /// Rms slope of the levelled map, from differences between neighbouring points; `None` if the
    /// file could not be read.
    pub rms_slope: Option<f64>,
    /// Difference between the highest and the lowest point of the levelled map.
    pub height_span: f64,
}

impl InspectedMap {
    /// Returns the additional memory for reading a file whose map is larger than the prepared map,
    /// in bytes per node of the prepared map.
    pub fn extra_bytes_per_node(&self) -> f64 {
        let PerAxis([nodes_x, nodes_y]) = self.nodes;
        let prepared = f64::from(nodes_x) * f64::from(nodes_y);
        let more = self.file.map_or(0.0, |grid| grid.count() as f64) - prepared;
        (24.0 * more / prepared.max(1.0)).max(0.0)
    }
}

/// A measured surface after its preparation, with the name and number of the map in the file.
pub struct ReadSurface {
    /// The surface after its preparation.
    pub prepared: Prepared,
    /// Name and number of the map in the file.
    pub channel: ChannelRead,
}

impl Origin {
    /// Returns the number of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        let PerAxis(nodes) = match self {
            Origin::Random { nodes, .. }
            | Origin::Spectrum { nodes, .. }
            | Origin::Shape { nodes, .. } => *nodes,
            Origin::File(file) => file.seen.nodes,
            Origin::Pair(pair) => return pair.body.nodes(),
            Origin::Yielded(yielded) => return yielded.body.nodes(),
        };
        nodes.map(|nodes| nodes as usize)
    }

    /// Returns the random self-affine surface with its rms slope, or `None` for other origins. If
    /// the surface is scaled to a rms height, its rms slope follows from the modes of the
    /// realization.
    pub fn random_surface(&self, cell: Cell) -> Option<RandomSurface> {
        let Origin::Random { surface, rms_height, .. } = self else {
            return None;
        };
        let Some(rms_height) = rms_height else {
            return Some(*surface);
        };
        let unscaled = RandomSurface { rms_slope: 1.0, ..*surface };
        let of_unscaled = unscaled.moments(cell).rms_height();
        let rms_slope = if of_unscaled > 0.0 { rms_height / of_unscaled } else { 0.0 };
        Some(RandomSurface { rms_slope, ..*surface })
    }

    /// Returns the rms slope to which every surface is scaled, if it is scaled to one.
    pub fn given_rms_slope(&self) -> Option<f64> {
        match self {
            Origin::Random { surface, rms_height: None, .. } => Some(surface.rms_slope),
            Origin::Spectrum { surface, .. } => surface.rms_slope,
            _ => None,
        }
    }

    /// Returns the seed and the realization of a random surface; `None` for other surfaces.
    pub fn random_numbers(&self) -> Option<(u64, u32)> {
        match self {
            Origin::Random { surface, .. } => Some((surface.seed, surface.realization)),
            Origin::Spectrum { surface, .. } => Some((surface.seed, surface.realization)),
            Origin::Yielded(yielded) => yielded.body.origin.random_numbers(),
            _ => None,
        }
    }

    /// Returns the rms height to which every surface is scaled, if it is scaled to one.
    pub fn given_rms_height(&self) -> Option<f64> {
        match self {
            Origin::Random { rms_height, .. } => *rms_height,
            Origin::Spectrum { surface, .. } => surface.rms_height,
            _ => None,
        }
    }

    /// Returns the prescribed height distribution of a random surface, or `None` for Gaussian and
    /// other surfaces.
    pub fn prescribed_heights(&self) -> Option<&PrescribedHeights> {
        match self {
            Origin::Random { height_distribution, .. }
            | Origin::Spectrum { height_distribution, .. } => height_distribution.as_ref(),
            _ => None,
        }
    }

    /// Computes the prescribed height distribution, if there is one.
    ///
    /// # Errors
    /// As [`PrescribedHeights::distribution`].
    pub fn height_distribution(
        &self,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<Option<HeightDistribution>, StageError> {
        let prescribed = self.prescribed_heights();
        prescribed.map(|heights| heights.distribution(sources, threads)).transpose()
    }

    /// Returns the name of the unit of length; empty if it is unknown.
    pub fn unit(&self) -> &str {
        match self {
            Origin::Random { unit, .. } | Origin::Shape { unit, .. } => unit,
            Origin::Spectrum { surface, .. } => match &surface.source {
                Source::File { unit, .. } => unit,
                Source::Stage { .. } => "",
            },
            Origin::File(file) => &file.unit,
            Origin::Pair(pair) => pair.body.origin.unit(),
            Origin::Yielded(yielded) => yielded.body.origin.unit(),
        }
    }

    /// Returns the origins of the surfaces of which the surface is made, that in `from` first.
    fn parts(&self) -> Vec<&Origin> {
        match self {
            Origin::Pair(pair) => vec![&pair.body.origin, &pair.against.origin],
            Origin::Yielded(yielded) => vec![&yielded.body.origin],
            _ => Vec::new(),
        }
    }

    /// Returns the labels of a measured surface, or of the one in `from` of which the surface is
    /// made. Returns `None` if there are none.
    pub fn labels(&self) -> Option<&Labels> {
        match self {
            Origin::File(file) => Some(&file.labels).filter(|labels| !labels.is_empty()),
            _ => self.parts().first()?.labels(),
        }
    }

    /// Returns the content of the file of a measured surface, or of the one in `from` of which the
    /// surface is made.
    pub fn content(&self) -> Option<&ContentHash> {
        match self {
            Origin::File(file) => Some(&file.content),
            _ => self.parts().first()?.content(),
        }
    }

    /// Returns whether the surface is a measured map that is not periodic, or contains one.
    pub fn is_open(&self) -> bool {
        matches!(self, Origin::File(file) if file.edges == Edges::Open)
            || self.parts().into_iter().any(Origin::is_open)
    }

    /// Returns whether the surface is a profile: one line of heights along x.
    pub fn is_profile(&self) -> bool {
        matches!(self, Origin::File(file) if file.choice.profile)
    }

    /// Returns whether the surface is a measured map with filled points, or contains one.
    pub fn has_filled_points(&self) -> bool {
        matches!(self, Origin::File(file) if file.seen.is_filled)
            || self.parts().into_iter().any(Origin::has_filled_points)
    }

    /// Returns whether the spectrum of the surface is in the table of another task.
    pub fn reads_stage(&self) -> bool {
        matches!(self, Origin::Spectrum { surface, .. } if surface.source.is_stage())
    }

    /// Returns whether the surface has yielded, or is made of one that has.
    pub fn has_yielded(&self) -> bool {
        matches!(self, Origin::Yielded(_)) || self.parts().into_iter().any(Origin::has_yielded)
    }

    /// Draws the surface, or reads it from its file. `side` gives the sides along x and y; for a
    /// file they are optional.
    ///
    /// # Errors
    /// If the file is missing, has changed or cannot be read, or if the spectrum is in the table of
    /// another task. It also fails if the contact in which the surface yields cannot be solved.
    pub fn draw(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        let heights = self.height_distribution(sources, threads)?;
        self.draw_with(heights.as_ref(), side, sources, threads)
    }

    /// Draws the surface as [`Origin::draw`], with its prescribed height distribution.
    ///
    /// # Errors
    /// As [`Origin::draw`].
    pub fn draw_with(
        &self,
        heights: Option<&HeightDistribution>,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        let grid = || grid(self.nodes(), side.unwrap_or_default());
        match self {
            Origin::Random { .. } => {
                let grid = grid()?;
                let surface = self.random_surface(grid.cell()).expect("the origin is random");
                Ok(surface.draw_on(threads, grid, heights))
            }
            Origin::Shape { shape, .. } => Ok(shape.draw(grid()?)),
            Origin::Spectrum { surface, .. } => {
                let density = surface.density_from_file(sources)?;
                surface.draw(&density, heights, grid()?, threads)
            }
            Origin::File(file) => Ok(file.read(side, sources)?.prepared.surface),
            Origin::Pair(pair) => pair.draw(sources, threads),
            Origin::Yielded(yielded) => yielded.draw(sources, threads, &|| false),
        }
    }
}

/// Share of the mean square slope from unreliable waves above which users are warned.
pub const MUCH_UNRELIABLE: f64 = 0.5;

impl MeasuredSurface {
    /// Reads and prepares the map. `side` is needed for files without the sides of their map.
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
        let map = MapFile::read(&bytes, &self.choice).map_err(unusable)?;
        let channel = map.channel.clone();
        let scan = map.scan(side, self.height_scale).map_err(unusable)?;
        Ok((scan, channel))
    }

    /// Prepares a map that has been read.
    ///
    /// # Errors
    /// If a step of the preparation fails.
    pub fn prepare(&self, scan: Scan, sources: &SurfaceFiles) -> Result<Prepared, StageError> {
        let prepared = self.preparation.prepare(scan, self.edges);
        prepared.map_err(|source| StageError::Preparation { path: self.path(sources), source })
    }

    /// Returns the reliability of the map if most of its mean square slope comes from waves that
    /// the instrument did not resolve, and that no filter removes.
    pub fn unreliable_slope(&self) -> Option<Reliability> {
        let found = self.seen.reliability?;
        let is_kept = !self.preparation.removes_unreliable(&found);
        (is_kept && found.unreliable_share > MUCH_UNRELIABLE).then_some(found)
    }

    /// Reads the map again and returns a map on the nodes of the prepared surface: 1 at filled
    /// nodes, 0 at all others. Returns `None` if no node was filled.
    ///
    /// # Errors
    /// As [`MeasuredSurface::read`].
    pub fn filled_nodes(
        &self,
        side: Option<[f64; 2]>,
        sources: &SurfaceFiles,
    ) -> Result<Option<Surface>, StageError> {
        if self.preparation.fill.unwrap_or_default() == Fill::Error {
            return Ok(None);
        }
        let (scan, _) = self.scan(side, sources)?;
        let nodes = self.preparation.filled_nodes(scan, self.edges);
        let filled =
            nodes.map_err(|source| StageError::Preparation { path: self.path(sources), source })?;
        Ok(filled.heights().contains(&1.0).then_some(filled))
    }

    /// Returns the additional memory for the search of spikes and islands and for the alignment of
    /// lines, in bytes per node.
    pub fn repair_bytes_per_node(&self) -> f64 {
        let Preparation { spikes, islands, align, .. } = &self.preparation;
        match (spikes, islands, align) {
            (Some(_), _, _) => 48.0,
            (None, None, None) => 0.0,
            _ => 24.0,
        }
    }

    /// Returns the path of the file for messages; empty if it is unknown.
    fn path(&self, sources: &SurfaceFiles) -> String {
        let path = sources.path_of(&self.content);
        path.map(|path| path.display().to_string()).unwrap_or_default()
    }
}
