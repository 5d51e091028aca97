//! Checks of the stages that draw surfaces with a given spectrum, and of their files.

use std::f64::consts::TAU;
use std::path::Path;

use super::checks::surfaces;
use super::growth::{self, PlannedSurfaces};
use super::keys;
use super::mesh::{self, Mesh};
use super::spectrum::{Source, SpectrumSurface};
use super::spectrum_keys::SpectrumTable;
use super::{Heights, Origin, Params};
use crate::Given;
use crate::spectrum_files::{self, SpectrumTable as Spectrum};
use crate::surface_files::{SurfaceFileError, SurfaceFiles};
use asperity_contact::grid::Grid;
use asperity_contact::topography::spectral_density::{SpectralDensity, occupies};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{Section, Written};

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
        let heights = match table.heights.written().map(|heights| heights.value) {
            Some(keys::Heights::Redraw) => Heights::Redraw,
            Some(keys::Heights::Keep) | None => Heights::Keep,
        };
        let surface =
            SpectrumSurface { source: source?, rms_slope: rms_slope?, seed: seed?, realization: 0 };
        Some(PlannedSurfaces {
            params: Params {
                heights,
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
    if let Some(written) = heights.filter(|heights| heights.value == keys::Heights::Redraw) {
        let message = "these heights cannot be drawn again when needed";
        let label = "must be `\"keep\"`: their spectrum is in another stage's table";
        checks.report("heights", Problem::new(message, written.span.clone(), label));
        return None;
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
    let refuse = |reason: String, label: &str, checks: &mut Checks| {
        let message = format!("{:?} {reason}", path.value);
        checks.report("path", Problem::new(message, path.span.clone(), label));
    };
    let (content, bytes) = match sources.add(Path::new(&path.value)) {
        Ok(found) => found,
        Err(SurfaceFileError::Read { source, .. }) => {
            if let Some(recalled) = sources.recall(Path::new(&path.value)) {
                let (content, unit) = (recalled.content, written_unit(table));
                return Some(Source::File { content, unit });
            }
            let reason = format!("cannot be read: {source}");
            refuse(reason, "relative to the manifest", checks);
            return None;
        }
        Err(error) => {
            refuse(format!("cannot be read: {error}"), "this file", checks);
            return None;
        }
    };
    let spectrum = match spectrum_files::read(&bytes) {
        Ok(spectrum) => spectrum,
        Err(error) => {
            refuse(error.to_string(), "this file", checks);
            return None;
        }
    };
    let length_scale = length_scale(table, path, &spectrum, checks)?;
    let density = match SpectralDensity::through(spectrum.points) {
        Ok(density) => density.in_unit(length_scale),
        Err(error) => {
            let reason = format!("holds no power spectral density: {error}");
            refuse(reason, "this file", checks);
            return None;
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
    checks.problems.push(problem.help(
        "wavenumbers are angular, 2π over the wavelength, and in the inverse of the unit of `side`",
    ));
    None
}
