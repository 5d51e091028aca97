//! Keys and recipes of random surfaces with a given spectrum.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::f64::consts::TAU;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::growth::{self, PlannedSurfaces, Realizations};
use super::mesh::{self, MAX_NODES, MIN_NODES, Mesh};
use super::method::surfaces;
use super::{Heights, Origin, Params, random};
use crate::columns::{SCANS, SPECTRAL_DENSITY, WAVENUMBER};
use crate::grids::Grids;
use crate::spectrum_files::{self, SpectrumTable as Spectrum};
use crate::surface_files::{ContentHash, SurfaceFileError, SurfaceFiles};
use crate::{CheckContext, StageError};
use asperity_contact::grid::Grid;
use asperity_contact::threads::Threads;
use asperity_contact::topography::spectral_density::{SpectralDensity, TabulatedSurface, occupies};
use asperity_contact::topography::surface::Surface;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length, pair, required, swept, unit_of_lengths};
use asperity_manifest::keys::{Key, OnAxes, Section, Spanned, table};
use asperity_tables::table::Table;

/// Gaussian random surfaces with a given isotropic power spectral density C(q), normalised so that
/// ∫ C d²q/(2π)² is their mean square height.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpectrumTable {
    /// CSV or Parquet file with the spectrum, relative to the manifest. Its columns are
    /// `wavenumber` (angular, 2π/λ) and `density` or `spectral_density`. The density is a power law
    /// between two rows, and zero beyond the first and the last row. A CSV header may have units:
    /// `wavenumber [1/µm]`, `density [µm^4]`. To use the spectrum that a `measure` stage computes,
    /// omit this key and name the stage in `from`; each mode then has the density of its ring of
    /// wavenumbers. With `what = "stitched-spectrum"`, the spectrum comes from several scans.
    #[schemars(transform = swept)]
    pub path: Key<String>,
    /// Number of nodes per side of the cell; for a rectangle a pair along x and y, such as
    /// `[1024, 512]`, together with a pair for `side`. Waves shorter than two nodes are left out.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES))]
    #[schemars(transform = pair, transform = swept, transform = required)]
    pub nodes: Key<OnAxes<u32>>,
    /// Side length of the periodic cell, in `unit` or, with `from`, in the unit of the measured
    /// surface; for a rectangle a pair along x and y. Waves longer than the cell are left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = pair, transform = swept, transform = required, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Root mean square slope to which each surface is scaled. By default surfaces are not scaled,
    /// and the spectrum determines their height and slope.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept)]
    pub rms_slope: Key<f64>,
    /// Root mean square height to which each surface is scaled, in the unit of `side`, instead of
    /// `rms_slope`.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub rms_height: Key<f64>,
    /// Seed of the random numbers. The default is the `seed` of `[study]`.
    #[schemars(transform = swept)]
    pub seed: Key<u64>,
    /// Name of the unit of length of `side`. If the file has another unit, the spectrum is
    /// converted. The default is the unit that is written at `side`, or else the unit of the file.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Number of surfaces for each combination of swept values, or `{ at_least, at_most, until }`
    /// to draw surfaces until a condition holds. Drawing more surfaces does not change the earlier
    /// ones.
    #[schemars(extend("default" = 1))]
    pub realizations: Key<Realizations>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed. With `from` they must be stored.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(SpectrumTable);

/// A random surface with a given power spectral density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "spectrum")]
pub struct SpectrumSurface {
    /// Source of the spectral density.
    #[serde(flatten)]
    pub source: Source,
    /// √⟨|∇h|²⟩ to which the surface is scaled. If it is `None`, the density determines the slope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_slope: Option<f64>,
    /// √⟨h²⟩ about the mean to which the surface is scaled, instead of a rms slope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_height: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of the realization among the surfaces with the same parameters.
    pub realization: u32,
}

/// The source of a power spectral density: a file or another stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Source {
    /// A file with a table of wavenumbers and densities.
    File {
        /// Hash of the content of the file; the path is not part of the recipe.
        content: ContentHash,
        /// Unit of length of the surface; empty for the unit of the table.
        unit: String,
    },
    /// A measured spectrum, which is in the table of another task.
    Stage {
        /// Name of the measured surface; `None` until the table has been read.
        spectrum_of: Option<String>,
    },
}

impl Source {
    /// Returns whether the density is in the table of another task.
    pub fn is_stage(&self) -> bool {
        matches!(self, Source::Stage { .. })
    }

    /// Returns whether the density is in a table that has not been read yet.
    pub fn is_unread(&self) -> bool {
        matches!(self, Source::Stage { spectrum_of: None })
    }
}

impl SpectrumSurface {
    /// Returns the rms height and the rms slope of the expected spectrum of unscaled surfaces on a
    /// grid: C(q)/(L_x L_y) summed over the modes of the grid.
    pub fn expected_roughness(density: &SpectralDensity, grid: Grid) -> [f64; 2] {
        let cell = grid.cell();
        let step = TAU / cell.longer_side();
        // Wavenumbers of one quadrant, with the number of modes ±k along each axis.
        let along = |axis: usize| {
            let nodes = grid.nodes()[axis];
            let is_single = move |waves: usize| waves == 0 || 2 * waves == nodes;
            (0..=nodes / 2).map(move |waves| (waves, if is_single(waves) { 1.0 } else { 2.0 }))
        };
        let [mut square_height, mut square_slope] = [0.0; 2];
        for (waves_x, modes_x) in along(0) {
            for (waves_y, modes_y) in along(1) {
                let q = step * cell.wavenumber([waves_x as f64, waves_y as f64]);
                if q > 0.0 {
                    let power = modes_x * modes_y * density.at(q) / cell.area();
                    square_height += power;
                    square_slope += q * q * power;
                }
            }
        }
        [square_height, square_slope].map(f64::sqrt)
    }

    /// Draws the surface on a grid.
    ///
    /// # Errors
    /// If no mode of the grid has a density.
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
        let drawn = surface.draw_on(threads, grid);
        Ok(match self.rms_height {
            Some(rms_height) => scaled_to(rms_height, drawn),
            None => drawn,
        })
    }

    /// Reads the density from its file, in the unit of length of the surface.
    ///
    /// # Errors
    /// If the file is missing, has changed or has no density, or if the density is in the table of
    /// another task.
    pub fn density_from_file(&self, sources: &SurfaceFiles) -> Result<SpectralDensity, StageError> {
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
            return Err(unusable(format!("cannot be converted to the unit {unit:?}")));
        };
        let density = SpectralDensity::from_points(table.points);
        let density = density.map_err(|error| unusable(error.to_string()))?;
        Ok(density.in_unit(factor))
    }

    /// Returns the density of a measured spectrum, constant on each ring of wavenumbers. The
    /// density of a spectrum that is stitched from several scans is a power law between its bins.
    ///
    /// # Errors
    /// If the table has no spectrum, or the spectrum of a flat surface.
    pub fn density_from_spectrum(table: &Table) -> Result<SpectralDensity, StageError> {
        if table.has(SCANS.name) {
            let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
            let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
            let points = wavenumbers.zip(densities).map(|(q, density)| [*q, *density]);
            let density = SpectralDensity::from_points(points.collect());
            return density.map_err(StageError::SpectralDensity);
        }
        let longer_side = Grids::new(table)?.grid(0)?.cell().longer_side();
        let step = TAU / longer_side;
        let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
        let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
        let rings = wavenumbers.map(|wavenumber| (wavenumber / step).round() as u32);
        let density = SpectralDensity::from_rings(step, rings.zip(densities.copied()));
        density.map_err(StageError::SpectralDensity)
    }
}

/// Scales the heights about their mean to a root mean square. A flat surface stays flat.
fn scaled_to(rms_height: f64, surface: Surface) -> Surface {
    let grid = surface.grid();
    let mut heights = surface.into_heights();
    let nodes = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / nodes;
    let squares: f64 = heights.iter().map(|height| (height - mean).powi(2)).sum();
    let factor = if squares > 0.0 { rms_height / (squares / nodes).sqrt() } else { 1.0 };
    heights.iter_mut().for_each(|height| *height *= factor);
    Surface::new(grid, heights).expect("finite heights stay finite")
}

/// Returns the surfaces of a stage with `method = "spectrum"`, or `None` after reporting problems.
pub fn spectra(
    section: &Section<SpectrumTable>,
    context: &mut CheckContext,
) -> Option<Vec<PlannedSurfaces>> {
    let (study_seed, reads_stages) = (context.seed, context.reads_stages);
    random::check_scaling(section, |table| &table.rms_height, context.problems)?;
    let sources = &mut *context.sources;
    surfaces(section, context.problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let rms_slope = checks.optional_number("rms_slope", &table.rms_slope);
        let rms_height = random::rms_height(&table.rms_slope, &table.rms_height, checks);
        let seed = checks.value_or("seed", &table.seed, study_seed);
        let realizations = growth::realizations(&table.realizations, checks);
        let heights = checks.value("heights", &table.heights);
        let source = if reads_stages {
            stage_source(table, checks)
        } else {
            file_source(table, mesh.as_ref(), sources, checks)
        };
        let (mesh, (realizations, growth)) = (mesh?, realizations?);
        let surface = SpectrumSurface {
            source: source?,
            rms_slope: rms_slope?,
            rms_height: rms_height?,
            seed: seed?,
            realization: 0,
        };
        Some(PlannedSurfaces {
            params: Params {
                heights: heights?,
                side: Some(mesh.side),
                origin: Origin::Spectrum { nodes: mesh.nodes, surface },
            },
            realizations,
            growth,
            may_be_swept: section.may_be_swept,
        })
    })
}

/// Returns the source of a spectrum that another stage measures. Refuses keys that only apply to
/// files.
fn stage_source(table: &SpectrumTable, checks: &mut Checks) -> Option<Source> {
    let why = "`from` names the stage with the spectrum";
    let path = checks.forbidden("path", &table.path, why);
    let why = "with `from` lengths are in the unit of the measured surface";
    let unit = checks.forbidden("unit", &table.unit, why);
    if let Some(named) = checks.units.length.as_ref().filter(|named| !named.by_key) {
        let message = "lengths cannot have units with `from`";
        let problem = Problem::new(message, named.span.clone(), "must be a number");
        return checks.reject(problem.help(
            "write lengths as plain numbers, in the unit of the surface whose spectrum is measured",
        ));
    }
    let heights = table.heights.written();
    if let Some(written) = heights.filter(|heights| heights.value == Heights::Redraw) {
        let message = "surfaces with a measured spectrum cannot be drawn again when needed";
        let label = "must be \"keep\": the spectrum is in the table of another stage";
        return checks.refuse("heights", message, &written.span, label);
    }
    path.and(unit).map(|()| Source::Stage { spectrum_of: None })
}

/// Returns the source of a spectrum in a file. The file is read here, so that its problems are
/// reported before a run.
fn file_source(
    table: &SpectrumTable,
    mesh: Option<&Mesh>,
    sources: &mut SurfaceFiles,
    checks: &mut Checks,
) -> Option<Source> {
    let path = checks.required("path", &table.path)?;
    let unit = written_unit(table, checks);
    let mut refuse = |reason: String, label: &str| {
        checks.refuse("path", format!("{:?} {reason}", path.value), &path.span, label)
    };
    let (content, bytes) = match sources.add(Path::new(&path.value)) {
        Ok(found) => found,
        Err(SurfaceFileError::Read { source, .. }) => {
            if let Some(recalled) = sources.recall(Path::new(&path.value)) {
                let content = recalled.content;
                return Some(Source::File { content, unit });
            }
            return refuse(
                format!("cannot be read: {source}"),
                "the path is relative to the manifest",
            );
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
    Some(Source::File { content, unit })
}

/// Returns the unit that the manifest names, or in which it writes lengths; empty if there is none.
fn written_unit(table: &SpectrumTable, checks: &Checks) -> String {
    let named = checks.units.length.as_ref();
    match table.unit.written() {
        Some(unit) => unit.value.clone(),
        None => named.map(|named| named.unit.symbol.to_owned()).unwrap_or_default(),
    }
}

/// Returns the unit of length of the file divided by the unit of length of the surface.
fn length_scale(
    table: &SpectrumTable,
    path: &Spanned<String>,
    spectrum: &Spectrum,
    checks: &mut Checks,
) -> Option<f64> {
    let scale = spectrum.length_scale(&written_unit(table, checks));
    if let (None, Some(written), Some(own)) = (scale, table.unit.written(), &spectrum.unit) {
        let message = format!(
            "cannot convert the spectrum from {own:?}, the unit of the file, to `unit = {:?}`",
            written.value
        );
        let problem = Problem::new(message, written.span.clone(), "must be a unit of length")
            .and(path.span.clone(), format!("has the unit {own:?}"));
        checks.report("unit", problem);
    }
    scale
}

/// Refuses a spectrum whose density is zero for all modes of the mesh.
fn check_occupied(
    density: &SpectralDensity,
    path: &Spanned<String>,
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
        "{:?} has no density for the waves of the mesh: its wavenumbers go from {from:.4e} to {to:.4e}",
        path.value
    );
    let label =
        format!("the mesh has wavenumbers from {longest:.4e} to {shortest:.4e} along its axes");
    let problem = Problem::new(message, path.span.clone(), label);
    checks.reject(problem.help(
        "wavenumbers are angular, 2π over the wavelength, and in the inverse of the unit of `side`",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_expected_roughness_of_a_spectrum_is_a_sum_over_the_modes_of_the_mesh() {
        let c = 1e-6;
        let near = |waves: f64| {
            let points = [waves - 0.1, waves + 0.1].map(|waves| [TAU * waves, c]);
            SpectralDensity::from_points(points.to_vec()).unwrap()
        };
        let roughness = |waves: f64, nodes: usize| {
            SpectrumSurface::expected_roughness(&near(waves), Grid::square(nodes, 1.0).unwrap())
        };
        // The waves ±1 along x and along y.
        let [height, slope] = roughness(1.0, 16);
        assert!((height * height / (4.0 * c) - 1.0).abs() < 1e-12);
        assert!((slope / height / TAU - 1.0).abs() < 1e-12);
        // On four nodes, the waves 2 and −2 are the same.
        let [height, _] = roughness(2.0, 4);
        assert!((height * height / (2.0 * c) - 1.0).abs() < 1e-12);
    }
}
