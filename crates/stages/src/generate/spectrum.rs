//! Keys of random surfaces with a given spectrum.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::f64::consts::TAU;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::exclude;
use crate::generate::mesh::{self, MAX_NODES, MIN_NODES, Mesh};
use crate::generate::random::{self, HeightKeys};
use crate::spectrum_files::{self, SpectrumTable as Spectrum};
use crate::stage_points::{StagePoints, Work};
use crate::surface::planned::{
    Growing, PlannedSurfaces, Realizations, growing, realizations, surfaces,
};
use crate::surface::spectrum::{Source, SpectrumSurface};
use crate::surface::{Heights, Origin, Params};
use crate::surface_files::{SurfaceFileError, SurfaceFiles};
use crate::{CheckContext, Reads, RowKind};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length, pair, required, swept, unit_of_lengths};
use asperity_manifest::keys::{Key, OnAxes, Section, Spanned, table};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::topography::johnson::{MAX_KURTOSIS, MAX_SKEWNESS};
use asperity_mechanics::topography::spectral_density::{SpectralDensity, occupies};

/// Random surfaces with a given isotropic power spectral density C(q), normalised so that
/// ∫ C d²q/(2π)² is their mean square height.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpectrumTable {
    /// CSV or Parquet file with the spectrum, relative to the manifest. Its columns are
    /// `wavenumber` (angular, 2π/λ) and `density` or `spectral_density`. The density is a power law
    /// between two rows, and zero beyond the first and the last row. A CSV header may have units:
    /// `wavenumber [1/µm]`, `density [µm^4]`. To use the spectrum that a `measure` stage computes,
    /// omit this key and name the stage in `from`; each mode then has the density of its ring of
    /// wavenumbers. With `what = "stitched-spectrum"`, the spectrum comes from several scans, and
    /// with `what = "spectrum-from-profiles"` from profiles.
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
    /// Skewness of the heights, Ssk of ISO 25178-2: negative for valleys below a plateau, positive
    /// for peaks. Needs `kurtosis`; with `kurtosis` alone, it is 0. Each mode has the same power as
    /// without these keys, but other phases, and the surface is again the same on any mesh. Its own
    /// values are in the columns `skewness` and `excess_kurtosis`.
    #[schemars(range(min = -MAX_SKEWNESS, max = MAX_SKEWNESS), transform = swept)]
    pub skewness: Key<f64>,
    /// Kurtosis of the heights, Sku of ISO 25178-2: 3 for a Gaussian surface, more for rare peaks
    /// or valleys, and always more than skewness² + 1. The column `excess_kurtosis` is the kurtosis
    /// minus 3. By default surfaces are Gaussian.
    #[schemars(range(max = MAX_KURTOSIS), extend("exclusiveMinimum" = 1), transform = swept)]
    pub kurtosis: Key<f64>,
    /// Name of a `generate` stage with one surface, such as a measured map, whose distribution of
    /// heights the surfaces have, in units of the rms height. Excludes `skewness` and `kurtosis`.
    pub height_distribution: Key<String>,
    /// Seed of the random numbers. The default is the `seed` of `[study]`.
    #[schemars(transform = swept)]
    pub seed: Key<u64>,
    /// Name of the unit of length of `side`. If the file has another unit, the spectrum is
    /// converted. The default is the unit that is written at `side`, or else the unit of the file.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Number of surfaces for each combination of swept values, or `{ at_least, at_most, until }`
    /// to draw surfaces until a condition holds. Drawing more surfaces does not change the earlier
    /// ones. `cases` can give each mesh its own number, for multilevel means.
    #[schemars(extend("default" = 1), transform = swept)]
    pub realizations: Key<Realizations>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed. With `from` they must be stored.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(SpectrumTable);

impl StagePoints for Section<SpectrumTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        spectra(self, context).map(Work::Generate)
    }

    fn reads(&self) -> Option<Reads> {
        Some(Reads {
            rows: &[RowKind::PowerSpectra],
            from: "`measure` stages with `what = \"spectrum\"`, `\"stitched-spectrum\"` or \
                   `\"spectrum-from-profiles\"`, where its method is `spectrum`"
                .into(),
        })
    }

    fn heights_of(&self) -> Option<&Spanned<String>> {
        self.points.first()?.table.height_distribution.written()
    }

    fn growing(&self) -> Option<&Growing> {
        growing(&self.points.first()?.table.realizations)
    }
}

/// Returns the surfaces of a stage with `method = "spectrum"`, or `None` after reporting problems.
fn spectra(
    section: &Section<SpectrumTable>,
    context: &mut CheckContext,
) -> Option<Vec<PlannedSurfaces>> {
    let (study_seed, reads_stages) = (context.seed, context.reads_stages);
    let others = context.heights_of;
    random::check_scaling(section, |table| &table.rms_height, context.problems)?;
    let sources = &mut *context.sources;
    surfaces(section, context.problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let rms_slope = checks.optional_number("rms_slope", &table.rms_slope);
        let rms_height = random::rms_height(&table.rms_slope, &table.rms_height, checks);
        let seed = checks.value_or("seed", &table.seed, study_seed);
        let realizations = realizations(&table.realizations, checks);
        let keys = HeightKeys {
            skewness: &table.skewness,
            kurtosis: &table.kurtosis,
            height_distribution: &table.height_distribution,
            heights: &table.heights,
        };
        let height_distribution = keys.read(others, checks);
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
                origin: Origin::Spectrum {
                    nodes: mesh.nodes,
                    surface,
                    height_distribution: height_distribution?,
                },
            },
            realizations,
            growth,
            sample: None,
            may_be_swept: section.may_be_swept,
        })
    })
}

/// Returns the source of a spectrum that another stage measures. Refuses keys that only apply to
/// files.
fn stage_source(table: &SpectrumTable, checks: &mut Checks) -> Option<Source> {
    let clear = exclude! { table, checks,
        true => path: "`from` names the stage with the spectrum";
        true => unit: "with `from` lengths are in the unit of the measured surface";
    };
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
    clear.map(|()| Source::Stage { spectrum_of: None })
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
    let grid = Grid::new(nodes, mesh.cell()).expect("nodes were checked");
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
