//! Spectrum of an isotropic surface from its profiles.
//!
//! One task reads all profiles of its stages, or lines of all maps. A profile is trusted up to a
//! fraction of its length, because the Hann window mixes its longest waves; a periodic one up to
//! its length.

use std::f64::consts::{SQRT_2, TAU};

use super::statistics::independent_fraction;
use super::{common_unit, joint_name, of_each, unit_of};
use crate::columns::*;
use crate::stage::{number, stacked};
use crate::surface::Origin;
use crate::surface_files::ContentHash;
use crate::version::Version;
use crate::{Context, Input, StageError};
use asperity_manifest::diagnostics::counted;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::from_profiles::{ProfileModes, invert};
use asperity_mechanics::topography::power_spectrum::line_spectra;
use asperity_mechanics::topography::surface::{Axis, Surface};
use asperity_statistics::intervals::two_sided_quantile;
use asperity_tables::column::{Column, integers, optional_reals, reals, texts};
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// Version of the numbers, which is part of the keys of these spectra only.
pub const VERSION: Version = Version::new(1, &[]);

/// Greatest deviation of the logarithm of the surface's rms slope from that of √2 times the
/// profiles' at which the fit holds. The deviation is below 0.05 for spectra without peaks, from
/// five profiles on; a ring of waves in an isotropic surface gives 0.08, turned surfaces 0.4.
const MOST_DEVIATION: f64 = 0.075;

/// Level of the intervals.
const LEVEL: f64 = 0.95;

/// Ratio of the number of independent modes of a line to that of its modes under the Hann window,
/// whose equivalent noise bandwidth is 3/2 modes (Harris 1978).
const INDEPENDENT_OF_LINE: f64 = 2.0 / 3.0;

/// Columns of the spectrum, besides the unit of length and the number of lines.
const COLUMNS: [Column; 11] = [
    SURFACE,
    WAVENUMBER,
    DEGREES_OF_FREEDOM,
    SPECTRAL_DENSITY,
    SPECTRAL_DENSITY_LOWER,
    SPECTRAL_DENSITY_UPPER,
    PROFILES,
    PROFILE_SLOPE,
    SURFACE_SLOPE,
    SURFACE_SLOPE_LOWER,
    SURFACE_SLOPE_UPPER,
];

/// Returns the columns that other measurements do not have.
pub fn own_columns() -> Vec<Column> {
    let shared = [SURFACE, WAVENUMBER, DEGREES_OF_FREEDOM, SPECTRAL_DENSITY];
    let own = COLUMNS.into_iter().filter(|column| !shared.contains(column));
    [LINES].into_iter().chain(own).collect()
}

/// Computes the spectrum of the surface from the lines along x of all inputs, at most `lines` of
/// each.
///
/// # Errors
/// If a surface cannot be read, or if the profiles have too few trusted waves.
pub fn measure(
    inputs: &[Input],
    bins_per_decade: u32,
    trusted_fraction: f64,
    lines: Option<u32>,
    context: &Context,
) -> Result<Table, StageError> {
    let of_each: Vec<Vec<ProfileModes>> = of_each(inputs, context, |params, _, surface| {
        Ok(modes(&params.origin, &surface, trusted_fraction, lines).collect())
    })?;
    let profiles = of_each.concat();
    let Some(found) = invert(&profiles, bins_per_decade) else {
        let reason = "the profiles have trusted waves in fewer than four bins; increase \
                      `trusted_fraction`, or use longer profiles";
        return Err(StageError::Unsuitable(reason.to_owned()));
    };
    let (surface, expected) = (found.rms_slope, SQRT_2 * found.profile_slope);
    if libm::log(surface / expected).abs() > MOST_DEVIATION {
        return Err(StageError::Unsuitable(format!(
            "the spectrum gives the surface an rms slope of {surface:.3}, but √2 times that of its \
             profiles is {expected:.3}: the fit does not resolve a peak of their spectrum, as \
             turned and ground surfaces have it along the feed, and these surfaces are not \
             isotropic"
        )));
    }
    // Spectra of the same surfaces by other settings are other spectra.
    let settings =
        joint_name(inputs)? + &format!(" {bins_per_decade} {trusted_fraction} {lines:?}");
    let name = ContentHash::new(settings.as_bytes()).to_string();
    let quantile = two_sided_quantile(LEVEL, found.groups.saturating_sub(1).max(1) as u32);
    // The scatter of two profiles says next to nothing.
    let end = |value: f64, error: Option<f64>, sign: f64| {
        error.filter(|_| found.groups > 2).map(|error| value * libm::exp(sign * quantile * error))
    };
    let (nodes, count) = (|| found.nodes.iter(), found.nodes.len());
    let same = |value: f64| reals(vec![value; count]);
    let slope_end =
        |sign: f64| optional_reals(vec![end(found.rms_slope, found.slope_error, sign); count]);
    let density_end =
        |sign: f64| optional_reals(nodes().map(|node| end(node.density, node.error, sign)));
    let columns = vec![
        (SURFACE, texts(vec![&name; count])),
        (WAVENUMBER, reals(nodes().map(|node| node.wavenumber))),
        (DEGREES_OF_FREEDOM, reals(nodes().map(|node| 2.0 * node.modes))),
        (SPECTRAL_DENSITY, reals(nodes().map(|node| node.density))),
        (SPECTRAL_DENSITY_LOWER, density_end(-1.0)),
        (SPECTRAL_DENSITY_UPPER, density_end(1.0)),
        (PROFILES, integers(vec![profiles.len() as i64; count])),
        (PROFILE_SLOPE, same(found.profile_slope)),
        (SURFACE_SLOPE, same(found.rms_slope)),
        (SURFACE_SLOPE_LOWER, slope_end(-1.0)),
        (SURFACE_SLOPE_UPPER, slope_end(1.0)),
    ];
    let given = lines.map(|lines| (LINES, integers(vec![i64::from(lines); count])));
    let unit = common_unit(inputs, count)?;
    Ok(unit.with(given.into_iter().chain(columns).collect()))
}

/// Returns the modes of the lines along x of a surface, at most `lines` of them.
fn modes(
    origin: &Origin,
    surface: &Surface,
    trusted_fraction: f64,
    lines: Option<u32>,
) -> impl Iterator<Item = ProfileModes> {
    let is_open = origin.is_open();
    let boundary = if is_open { Boundary::Free } else { Boundary::Periodic };
    let nodes = surface.grid().nodes()[0];
    let step = TAU / surface.grid().cell().size()[0];
    // The longest trusted wave has the number 1/fraction, or 1 on a periodic profile.
    let first = if is_open { (1.0 / trusted_fraction).ceil() as usize } else { 1 };
    let independent = match origin {
        _ if is_open => INDEPENDENT_OF_LINE,
        // A mirrored line has real modes.
        _ if independent_fraction(origin) < 1.0 => 0.5,
        _ => 1.0,
    };
    let count = lines.map_or(usize::MAX, |lines| lines as usize);
    line_spectra(surface, Axis::X, boundary, count).into_iter().map(move |mut densities| {
        // The Nyquist mode has one real amplitude, and aliases.
        densities.truncate(nodes.saturating_sub(1) / 2);
        ProfileModes { step, densities, first, independent }
    })
}

/// Returns the table without rows, from the names and the empty tables of the inputs.
///
/// # Errors
/// If the inputs have columns of the same name with different types.
pub fn empty_table(lines: Option<u32>, inputs: &[(String, Table)]) -> Result<Table, StageError> {
    let given: Vec<Column> = lines.map(|_| LINES).into_iter().chain(COLUMNS).collect();
    Ok(unit_of(&stacked(inputs)?).beside(&Table::empty(&given)))
}

/// Summarises the number of profiles, and the slope of the surface with its interval. Returns
/// `None` for other tables.
///
/// # Errors
/// If the table is damaged.
pub fn summary(source: &TableSource) -> Result<Option<String>, StageError> {
    if !source.names().iter().any(|name| name == PROFILES.name) {
        return Ok(None);
    }
    let table = source.table().map_err(StageError::Store)?;
    if table.rows() == 0 {
        return Ok(None);
    }
    let last = table.rows() - 1;
    let profiles = table.integers(PROFILES.name)?.value(last);
    let real = |column: Column| {
        let values = table.reals(column.name)?;
        Ok::<_, StageError>(values.iter().nth(last).flatten().map(number))
    };
    let slope = real(SURFACE_SLOPE)?.unwrap_or_default();
    let interval = match (real(SURFACE_SLOPE_LOWER)?, real(SURFACE_SLOPE_UPPER)?) {
        (Some(lower), Some(upper)) => format!(" ({lower} to {upper})"),
        _ => String::new(),
    };
    let profiles = counted(usize::try_from(profiles).unwrap_or(0), "profile");
    Ok(Some(format!("{profiles}, rms slope of the surface {slope}{interval}")))
}
