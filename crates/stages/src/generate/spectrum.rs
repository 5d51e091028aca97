//! Random surfaces with a given spectrum: their keys, the checks of these, and what recipes hold.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::f64::consts::TAU;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::growth::{self, PlannedSurfaces, Realizations};
use super::mesh::{self, FEWEST_NODES, MOST_NODES, Mesh};
use super::method::{KeptHeights, surfaces};
use super::{Heights, Origin, Params};
use crate::columns::{SPECTRAL_DENSITY, WAVENUMBER};
use crate::grids::Grids;
use crate::spectrum_files::{self, SpectrumTable as Spectrum};
use crate::surface_files::{ContentHash, SurfaceFileError, SurfaceFiles};
use crate::{Given, StageError};
use asperity_contact::grid::Grid;
use asperity_contact::threads::Threads;
use asperity_contact::topography::spectral_density::{SpectralDensity, TabulatedSurface, occupies};
use asperity_contact::topography::surface::Surface;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, Section, Written, table};
use asperity_tables::table::Table;

/// Gaussian random surfaces with a given isotropic power spectral density C(q), normalised so that
/// ∫ C d²q/(2π)² is their mean square height: an ensemble for one measurement.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpectrumTable {
    /// A CSV or Parquet file with columns `wavenumber` (angular, 2π/λ) and `density` or
    /// `spectral_density`, relative to the manifest; between them the density is a power law from each
    /// to the next, beyond them zero. Headers of a CSV file may name units: `wavenumber [1/µm]`,
    /// `density [µm^4]`. Where the spectrum has been measured, `from` names the stage instead, and
    /// modes have the densities of their rings.
    pub path: Key<String>,
    /// Name of the unit of length of `side`; when left out that of the file, which is converted where
    /// it names another.
    #[schemars(extend("default" = ""))]
    pub unit: Key<String>,
    /// Nodes per side of the mesh; of a rectangle those along x and along y, `[1024, 512]`, beside
    /// a pair for `side`. Waves of fewer than two nodes are left out.
    #[schemars(required, range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in `unit` or, with `from`, in that of the measured surface; of a
    /// rectangle those along x and along y. Waves that are longer are left out.
    #[schemars(required, extend("exclusiveMinimum" = 0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Root mean square slope that each surface is scaled to; when left out nothing is scaled, and
    /// height and slope follow from the spectrum.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rms_slope: Key<f64>,
    /// Seed of the draws; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
    /// Number of surfaces drawn for each point of the grid, or until when more are drawn:
    /// `{ at_least, at_most, until }`. More of them change none before.
    #[schemars(extend("default" = 1))]
    pub realizations: Key<Realizations>,
    /// Whether heights are stored or drawn again when needed; with `from` they are stored.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<KeptHeights>,
}

table!(
    SpectrumTable,
    swept: ["path", "nodes", "side", "rms_slope", "seed"],
    lists: [],
    pairs: ["nodes", "side"]
);

/// A random surface with a given power spectral density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "spectrum")]
pub struct SpectrumSurface {
    /// Where the density comes from.
    #[serde(flatten)]
    pub source: Source,
    /// √⟨|∇h|²⟩ that each surface is scaled to; where it is none, the density decides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_slope: Option<f64>,
    /// Names a family of draws.
    pub seed: u64,
    /// Names one member of the family.
    pub realization: u32,
}

/// Where a power spectral density comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Source {
    /// A table of wavenumbers and densities.
    File {
        /// Hash of the file's content; its path decides nothing.
        content: ContentHash,
        /// Unit of length of the surface; empty, where it is that of the table.
        unit: String,
    },
    /// The measured spectrum that the task reads.
    Stage {
        /// Name of the surface that it was measured of, once it has been read.
        spectrum_of: Option<String>,
    },
}

impl Source {
    /// Whether a task must read it from another's table.
    pub fn is_stage(&self) -> bool {
        matches!(self, Source::Stage { .. })
    }

    /// Whether no table has told yet whose spectrum it is.
    pub fn is_unread(&self) -> bool {
        matches!(self, Source::Stage { spectrum_of: None })
    }
}

impl SpectrumSurface {
    /// Draws the surface on a grid.
    ///
    /// # Errors
    /// When no mode of the grid has a density.
    pub fn draw(
        &self,
        density: &SpectralDensity,
        grid: Grid,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        if !occupies(density, grid) {
            let [from, to] = density.range();
            return Err(StageError::NoModes { from, to });
        }
        let surface = TabulatedSurface {
            density,
            rms_slope: self.rms_slope,
            seed: self.seed,
            realization: self.realization,
        };
        Ok(surface.draw_on(threads, grid))
    }

    /// The density that a file holds.
    ///
    /// # Errors
    /// When the file is gone, has changed, or holds none; and where the density is another task's.
    pub fn density_of_file(&self, sources: &SurfaceFiles) -> Result<SpectralDensity, StageError> {
        let Source::File { content, unit } = &self.source else {
            return Err(StageError::NotKept);
        };
        let unusable = |reason: String| {
            let path = sources.path_of(content);
            let path = path.map(|path| path.display().to_string());
            let path = path.unwrap_or_default();
            StageError::SpectrumFile { path, reason }
        };
        let bytes = sources.read(content)?;
        let table = spectrum_files::read(&bytes).map_err(|error| unusable(error.to_string()))?;
        let Some(factor) = table.length_scale(unit) else {
            return Err(unusable(format!("cannot be had in {unit:?}")));
        };
        let density = SpectralDensity::from_points(table.points);
        let density = density.map_err(|error| unusable(error.to_string()))?;
        Ok(density.in_unit(factor))
    }

    /// The density of a measured spectrum, ring by ring.
    ///
    /// # Errors
    /// When the table holds none, or that of a flat surface.
    pub fn density_measured(table: &Table) -> Result<SpectralDensity, StageError> {
        let longer_side = Grids::of(table)?.grid(0)?.cell().longer_side();
        let step = TAU / longer_side;
        let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
        let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
        let rings = wavenumbers.map(|wavenumber| (wavenumber / step).round() as u32);
        let density = SpectralDensity::from_rings(step, rings.zip(densities.copied()));
        density.map_err(StageError::SpectralDensity)
    }
}

/// Surfaces with a given spectrum.
pub fn spectra(
    section: &Section<SpectrumTable>,
    given: &mut Given,
) -> Option<Vec<PlannedSurfaces>> {
    let (study_seed, reads_stages) = (given.seed, given.reads_stages);
    let sources = &mut *given.sources;
    surfaces(section, given.problems, |table, checks| {
        let side = checks.required("side", &table.side);
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let rms_slope = match table.rms_slope.written() {
            Some(written) => checks.is_in("rms_slope", written, QUANTITY).map(Some),
            None => Some(None),
        };
        let seed = checks.whole_or("seed", &table.seed, 0..=i64::MAX as u64, study_seed);
        let realizations = growth::realizations(&table.realizations, checks);
        let source = match reads_stages {
            true => of_stage(table, checks),
            false => of_file(table, mesh.as_ref(), sources, checks),
        };
        let (_, mesh, (realizations, growth)) = (side?, mesh?, realizations?);
        let surface =
            SpectrumSurface { source: source?, rms_slope: rms_slope?, seed: seed?, realization: 0 };
        Some(PlannedSurfaces {
            params: Params {
                heights: table.heights.value().map_or(Heights::Keep, Heights::from),
                side: Some(mesh.side),
                origin: Origin::Spectrum { nodes: mesh.nodes, surface },
            },
            realizations,
            growth,
            may_be_swept: section.may_be_swept,
        })
    })
}

/// The spectrum that another stage has measured.
fn of_stage(table: &SpectrumTable, checks: &mut Checks) -> Option<Source> {
    let why = "the spectrum is that of the stage which `from` names";
    let path = checks.forbidden("path", &table.path, why);
    let why = "lengths are in the unit of the measured surface";
    let unit = checks.forbidden("unit", &table.unit, why);
    let heights = table.heights.written();
    if let Some(written) = heights.filter(|heights| heights.value == KeptHeights::Redraw) {
        let message = "these heights cannot be drawn again when needed";
        let label = "must be `\"keep\"`: their spectrum is in another stage's table";
        return checks.refuse("heights", message, &written.span, label);
    }
    path.and(unit).map(|()| Source::Stage { spectrum_of: None })
}

/// Reads the file once, to find now what would otherwise be found in the middle of a run.
fn of_file(
    table: &SpectrumTable,
    mesh: Option<&Mesh>,
    sources: &mut SurfaceFiles,
    checks: &mut Checks,
) -> Option<Source> {
    let path = checks.required("path", &table.path)?;
    let mut refuse = |reason: String, label: &str| {
        checks.refuse("path", format!("{:?} {reason}", path.value), &path.span, label)
    };
    let (content, bytes) = match sources.add(Path::new(&path.value)) {
        Ok(found) => found,
        Err(SurfaceFileError::Read { source, .. }) => {
            if let Some(recalled) = sources.recall(Path::new(&path.value)) {
                let (content, unit) = (recalled.content, written_unit(table));
                return Some(Source::File { content, unit });
            }
            return refuse(format!("cannot be read: {source}"), "relative to the manifest");
        }
        Err(error) => return refuse(format!("cannot be read: {error}"), "this file"),
    };
    let spectrum = match spectrum_files::read(&bytes) {
        Ok(spectrum) => spectrum,
        Err(error) => return refuse(error.to_string(), "this file"),
    };
    let length_scale = length_scale(table, path, &spectrum, checks)?;
    let density = match SpectralDensity::from_points(spectrum.points) {
        Ok(density) => density.in_unit(length_scale),
        Err(error) => {
            let message = format!("{:?} holds no power spectral density: {error}", path.value);
            return checks.refuse("path", message, &path.span, "this file");
        }
    };
    check_occupied(&density, path, mesh?, checks)?;
    let unit = written_unit(table);
    Some(Source::File { content, unit })
}

fn written_unit(table: &SpectrumTable) -> String {
    let unit = table.unit.written().map(|unit| unit.value.clone());
    unit.unwrap_or_default()
}

/// How many of the unit of length of the surface that of the file is.
fn length_scale(
    table: &SpectrumTable,
    path: &Written<String>,
    spectrum: &Spectrum,
    checks: &mut Checks,
) -> Option<f64> {
    let scale = spectrum.length_scale(&written_unit(table));
    if let (None, Some(written), Some(own)) = (scale, table.unit.written(), &spectrum.unit) {
        let message = format!("`unit = {:?}` is no unit for a file in {own:?}", written.value);
        let problem = Problem::new(message, written.span.clone(), "must be a unit of length")
            .and(path.span.clone(), "names its own unit");
        checks.report("unit", problem);
    }
    scale
}

/// Some mode of the mesh must have a density.
fn check_occupied(
    density: &SpectralDensity,
    path: &Written<String>,
    mesh: &Mesh,
    checks: &mut Checks,
) -> Option<()> {
    let nodes = mesh.nodes.0.map(|nodes| nodes as usize);
    let grid = Grid::new(nodes, mesh.cell());
    let grid = grid.expect("nodes were checked");
    if occupies(density, grid) {
        return Some(());
    }
    let [from, to] = density.range();
    let longest = TAU / mesh.cell().longer_side();
    let shortest = longest * grid.smaller_steps() / 2.0;
    let message = format!(
        "{:?} has no density for the waves of the mesh: it goes from {from:.4e} to {to:.4e}",
        path.value
    );
    let label =
        format!("the mesh has wavenumbers from {longest:.4e} to {shortest:.4e} along its axes");
    let problem = Problem::new(message, path.span.clone(), label);
    checks.reject(problem.help(
        "wavenumbers are angular, 2π over the wavelength, and in the inverse of the unit of `side`",
    ))
}
