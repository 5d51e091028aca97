//! One power spectrum from several scans of a surface, of different size.
//!
//! One task reads all surfaces of its stages. Each surface is trusted in a band of wavelengths. The
//! band begins at two mesh steps, the reliable wavelength or three times the low-pass cutoff,
//! whichever is longest. It ends at a fraction of the shorter side, or at the side of a periodic
//! surface.

use std::f64::consts::TAU;

use super::statistics::independent_fraction;
use super::{common_unit, joint_name, of_each, unit_of};
use crate::columns::*;
use crate::stage::{distinct, number, stacked};
use crate::surface::Origin;
use crate::{Context, Input, StageError, surface};
use asperity_manifest::diagnostics::counted;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::power_spectrum::rings;
use asperity_mechanics::topography::preparation::{FoundCutoff, LowPass};
use asperity_mechanics::topography::stitched::{Overlap, ScanSpectrum, mean_overlap, stitched};
use asperity_tables::column::{Column, integers, optional_reals, reals, texts};
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// Default number of bins per decade of wavenumbers.
pub const DEFAULT_BINS: u32 = 10;
/// Default of the longest trusted wavelength, as a fraction of the shorter side of a scan.
///
/// The Hann window mixes neighbouring rings of wavenumbers. On a spectrum ∝ q^(−3.6) this raises
/// the density of ring 4, the first that is trusted, by 20 %, and that of ring 8 by 5 %.
pub const DEFAULT_FRACTION: f64 = 0.25;
/// Ratio of a trusted wavelength to the cutoff of a Gaussian filter, above which at least 86 % of
/// the power passes.
const PASSES: f64 = 3.0;
/// Ratio of the densities of two scans above which they disagree.
const DISAGREEMENT: f64 = 2.0;

/// Columns of a stitched spectrum, besides the unit of length.
const COLUMNS: [Column; 8] = [
    SURFACE,
    WAVENUMBER,
    MODES,
    DEGREES_OF_FREEDOM,
    SPECTRAL_DENSITY,
    SCANS,
    OVERLAP_RATIO,
    OVERLAP_SCATTER,
];

/// Stitches the spectra of the surfaces.
///
/// # Errors
/// If a surface cannot be read, or if no surface has a trusted wavelength.
pub fn measure(
    inputs: &[Input],
    bins_per_decade: u32,
    trusted_fraction: f64,
    context: &Context,
) -> Result<Table, StageError> {
    let spectra = of_each(inputs, context, |params, table, surface| {
        let origin = &params.origin;
        let boundary = if origin.is_open() { Boundary::Free } else { Boundary::Periodic };
        Ok(ScanSpectrum {
            rings: rings(&surface, boundary),
            longer_side: surface.grid().cell().longer_side(),
            independent: independent_fraction(origin),
            band: band(params, table, surface.grid(), trusted_fraction)?.map(|length| TAU / length),
        })
    })?;
    let bins = stitched(&spectra, bins_per_decade);
    if bins.len() < 2 {
        let reason = "the trusted wavelengths of the scans fill fewer than two bins; increase \
                      `trusted_fraction` or `bins`, or use scans with a smaller \
                      `reliable_wavelength`";
        return Err(StageError::Unsuitable(reason.to_owned()));
    }
    let name = joint_name(inputs)?;
    let overlaps = || bins.iter().map(|bin| bin.overlap);
    let columns = vec![
        (SURFACE, texts(bins.iter().map(|_| &name))),
        (WAVENUMBER, reals(bins.iter().map(|bin| bin.wavenumber))),
        (MODES, integers(bins.iter().map(|bin| bin.modes as i64))),
        (DEGREES_OF_FREEDOM, reals(bins.iter().map(|bin| bin.freedom))),
        (SPECTRAL_DENSITY, reals(bins.iter().map(|bin| bin.density))),
        (SCANS, integers(bins.iter().map(|bin| i64::from(bin.scans)))),
        (OVERLAP_RATIO, optional_reals(overlaps().map(|one| one.map(|one| one.ratio)))),
        (OVERLAP_SCATTER, optional_reals(overlaps().map(|one| one.map(|one| one.scatter)))),
    ];
    Ok(common_unit(inputs, bins.len())?.with(columns))
}

/// Returns the table without rows, from the names and the empty tables of the inputs.
///
/// # Errors
/// If the inputs have columns of the same name with different types.
pub fn empty_table(inputs: &[(String, Table)]) -> Result<Table, StageError> {
    Ok(unit_of(&stacked(inputs)?).beside(&Table::empty(&COLUMNS)))
}

/// Returns the longest and the shortest trusted wavelength of a surface, in the order of their
/// wavenumbers. The longest can be below the shortest; the surface then does not contribute.
fn band(
    params: &surface::Params,
    table: &Table,
    grid: Grid,
    trusted_fraction: f64,
) -> Result<[f64; 2], StageError> {
    let [step_x, step_y] = grid.spacing();
    let mut shortest = 2.0 * step_x.max(step_y);
    let [side_x, side_y] = grid.cell().size();
    let mut longest = grid.cell().longer_side();
    let scanned = match &params.origin {
        Origin::Yielded(yielded) => &yielded.body.origin,
        origin => origin,
    };
    if let Origin::File(file) = scanned {
        longest = match file.edges {
            Edges::Periodic => longest,
            Edges::Open | Edges::Taper { .. } => trusted_fraction * side_x.min(side_y),
            // The cell has twice the sides of the map.
            Edges::Mirror => 0.5 * trusted_fraction * side_x.min(side_y),
        };
        if let Some(cutoff) = file.preparation.high_pass {
            longest = longest.min(cutoff / PASSES);
        }
        let reliable = if table.has(RELIABLE_WAVELENGTH.name) {
            table.reals(RELIABLE_WAVELENGTH.name)?.iter().flatten().next()
        } else {
            None
        };
        let cutoff = match file.preparation.low_pass {
            Some(LowPass::Wavelength(cutoff)) => Some(cutoff),
            Some(LowPass::Found(FoundCutoff::Reliable)) => reliable,
            None => None,
        };
        let filter = cutoff.map(|cutoff| PASSES * cutoff);
        shortest = [reliable, filter].into_iter().flatten().fold(shortest, f64::max);
    }
    Ok([longest, shortest])
}

/// Summarises a stitched spectrum: its scans, and whether they agree where they overlap. Returns
/// `None` for other tables.
///
/// # Errors
/// If the table is damaged.
pub fn summary(source: &TableSource) -> Result<Option<String>, StageError> {
    if !source.names().iter().any(|name| name == SCANS.name) {
        return Ok(None);
    }
    let table = source.table().map_err(StageError::Store)?;
    let scans = distinct(source, SURFACE.name)?.first().map_or(0, |name| name.split('+').count());
    let ratios = table.reals(OVERLAP_RATIO.name)?.iter();
    let scatters = table.reals(OVERLAP_SCATTER.name)?.iter();
    let overlaps = ratios.zip(scatters).filter_map(|(ratio, scatter)| {
        let (ratio, scatter) = ratio.zip(scatter)?;
        Some(Overlap { ratio, scatter })
    });
    let overlap = match mean_overlap(overlaps) {
        None if scans < 2 => String::new(),
        None => ", without an overlap".to_owned(),
        Some(ratio) if ratio.max(1.0 / ratio) > DISAGREEMENT => format!(
            ", which disagree where they overlap: the smaller scans have {} times the density",
            number(ratio)
        ),
        Some(ratio) => format!(", ratio of the densities in their overlap {}", number(ratio)),
    };
    Ok(Some(format!("{}{overlap}", counted(scans, "scan"))))
}
