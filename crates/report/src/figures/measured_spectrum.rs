//! Radial power spectral densities in units of length: those that `measure` stages have found, those of
//! measured surfaces that none has looked at, and the self-affine laws fitted to them.

use arrow::array::Array;

use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::Point;
use crate::figure_data::FigureData;
use crate::surface_curves;
use crate::surface_curves::{CurvePoint, SurfaceCurve, thinned};
use crate::units::{LengthUnit, digits};
use asperity_stages::columns::{MODES, SPECTRAL_DENSITY, WAVENUMBER};
use asperity_tables::table::{Table, TableError};

/// Captions tell of as many fitted laws.
const MOST_LAWS: usize = 4;
/// Densities below this share of the largest are rounding of a transform: beyond a cutoff.
const ROUNDING: f64 = 1e-20;

/// The chart and what is to be seen; nothing where there are no such spectra.
///
/// # Errors
/// When a table lacks a column of its stage.
pub fn chart(data: &FigureData) -> Result<Option<(Chart, String)>, TableError> {
    let spectra = spectra(data)?;
    if spectra.is_empty() {
        return Ok(None);
    }
    let points = spectra.iter().map(|spectrum| &spectrum.point);
    let shared = LengthUnit::common(points.map(|point| data.units.at(point)));
    let (per_length, fourth) = (shared.power("⁻¹"), shared.power("⁴"));
    let mut chart = Chart::new(
        Axis::logarithmic(format!("wavenumber q = 2π/λ, {per_length}")),
        Axis::logarithmic(format!("power spectral density C(q), {fourth}")),
    );
    let mut told = Vec::new();
    for spectrum in &spectra {
        let factor = shared.factor(data.units.at(&spectrum.point));
        let in_unit = |(q, density): (f64, f64)| (q / factor, density * factor.powi(4));
        let label = data.styles.label(&spectrum.point);
        let label = label.unwrap_or_else(|| "the surface".to_owned());
        let colour = data.styles.colour(&spectrum.point);
        let style = match spectrum.surfaces {
            1 => Style::line(colour, Dash::Solid, 1.5),
            _ => data.styles.markers(&spectrum.point).joined(),
        };
        let points = thinned(&spectrum.points).into_iter().map(in_unit);
        let named = match spectrum.surfaces {
            1 => label.clone(),
            count => format!("{label}, mean of {count}"),
        };
        chart.series.push(Series::new(points, style).named(named));
        for law in laws(data, spectrum)? {
            let ends = law.range.map(|q| q / factor);
            let curve = |q: f64| law.at(q * factor) * factor.powi(4);
            let dashes = Style::line(colour, Dash::Dashed, 1.8);
            let curve = Series::curve(curve, ends, Spacing::Logarithmic, dashes);
            chart.series.push(curve.named("self-affine law, fitted"));
            told.push(law.told(&label, &shared, factor));
        }
    }
    Ok(Some((chart, caption(&told))))
}

fn caption(laws: &[String]) -> String {
    let shown = laws.len().min(MOST_LAWS);
    let fits = match laws.len() {
        0 => "A fit with `law = \"self-affine\"` of a measured spectrum adds its law.".to_owned(),
        count if count > shown => format!(
            "Dashed the fitted self-affine laws: {}; and {} more.",
            laws[..shown].join("; "),
            count - shown
        ),
        _ => format!("Dashed the fitted self-affine laws: {}.", laws.join("; ")),
    };
    format!(
        "Power spectral density C(q) over rings of wavevectors, with ∫ C d²q/(2π)² the mean square \
         height; under Hann's window where a map is not periodic. Rings that are close on the axis \
         are joined. {fits}"
    )
}

/// Those of the study's tables, and of measured surfaces that no table tells of.
fn spectra(data: &FigureData) -> Result<Vec<SurfaceCurve>, TableError> {
    let columns = [WAVENUMBER, SPECTRAL_DENSITY];
    let names = [WAVENUMBER.name, SPECTRAL_DENSITY.name, MODES.name];
    let mut spectra: Vec<SurfaceCurve> = Vec::new();
    for stage in data.finished.with(&names) {
        for spectrum in surface_curves::of(&stage.table, columns, Some(MODES))? {
            if spectra.iter().all(|known| known.point != spectrum.point) {
                spectra.push(spectrum);
            }
        }
    }
    for map in data.maps.there() {
        if spectra.iter().all(|known| !known.is_of(&map.point)) {
            spectra.push(SurfaceCurve {
                point: map.point.clone(),
                along: None,
                surfaces: 1,
                points: map.spectrum.clone(),
            });
        }
    }
    for spectrum in &mut spectra {
        let most = spectrum.points.iter().map(|point| point.y).fold(0.0, f64::max);
        spectrum.points.retain(|point| point.y > ROUNDING * most);
    }
    spectra.retain(|spectrum| spectrum.points.len() > 1);
    Ok(spectra)
}

/// A fitted law, in the unit of its surface.
struct FittedLaw {
    hurst: f64,
    interval: Option<[f64; 2]>,
    rolloff: Option<f64>,
    /// Up to the roll-off; where there is none, C₀ of C₀ q^(−2(1 + H)).
    plateau: f64,
    range: [f64; 2],
}

/// The laws that were fitted to a spectrum.
fn laws(data: &FigureData, spectrum: &SurfaceCurve) -> Result<Vec<FittedLaw>, TableError> {
    let names = ["hurst_exponent", "rolloff_wavenumber", "wavenumber_lower"];
    let mut laws = Vec::new();
    for stage in data.finished.with(&names) {
        for row in 0..stage.table.rows() {
            if is_fit_of(&stage.table, row, &spectrum.point) {
                laws.extend(FittedLaw::of_row(&stage.table, row, &spectrum.points)?);
            }
        }
    }
    Ok(laws)
}

/// Whether a row of a fit stands where a spectrum does: they agree in all that both have.
fn is_fit_of(table: &Table, row: usize, spectrum: &Point) -> bool {
    let point = ensembles::point(table, row);
    spectrum.iter().all(|(name, value)| point.get(name) == Some(value))
}

impl FittedLaw {
    /// Of a row of a fit, over those of the points that lie in its window; nothing where the fit
    /// failed.
    fn of_row(
        table: &Table,
        row: usize,
        points: &[CurvePoint],
    ) -> Result<Option<FittedLaw>, TableError> {
        let number = |name: &str| {
            let column = table.reals(name)?;
            Ok::<_, TableError>(column.is_valid(row).then(|| column.value(row)))
        };
        let (from, to) = (number("wavenumber_lower")?, number("wavenumber_upper")?);
        let is_inside = |point: &&CurvePoint| {
            from.is_none_or(|from| from <= point.x) && to.is_none_or(|to| point.x <= to)
        };
        let inside: Vec<&CurvePoint> = points.iter().filter(is_inside).collect();
        let (Some(hurst), Some(first), Some(last)) =
            (number("hurst_exponent")?, inside.first(), inside.last())
        else {
            return Ok(None);
        };
        let ends = [number("hurst_exponent_lower")?, number("hurst_exponent_upper")?];
        let rolloff = number("rolloff_wavenumber")?;
        // The C₀ of the greatest likelihood, which a row without a roll-off does not hold.
        let weight: f64 = inside.iter().map(|point| point.weight).sum();
        let prefactor = inside.iter().map(|point| point.weight * point.y * falls(point.x, hurst));
        let prefactor = prefactor.sum::<f64>() / weight;
        Ok(Some(FittedLaw {
            hurst,
            interval: ends[0].zip(ends[1]).map(|(lower, upper)| [lower, upper]),
            rolloff,
            plateau: number("plateau_density")?.unwrap_or(prefactor),
            range: [first.x, last.x],
        }))
    }

    fn at(&self, wavenumber: f64) -> f64 {
        match self.rolloff {
            Some(rolloff) if wavenumber <= rolloff => self.plateau,
            Some(rolloff) => self.plateau / falls(wavenumber / rolloff, self.hurst),
            None => self.plateau / falls(wavenumber, self.hurst),
        }
    }

    /// In words: `scan.x3p H = 0.82 (0.79 to 0.85), roll-off at 2.1 µm`.
    fn told(&self, label: &str, shared: &LengthUnit, factor: f64) -> String {
        let mut told = format!("{label} H = {}", digits(self.hurst, 3));
        if let Some([lower, upper]) = self.interval {
            told += &format!(" ({} to {})", digits(lower, 3), digits(upper, 3));
        }
        if let Some(rolloff) = self.rolloff {
            let wavelength = factor * std::f64::consts::TAU / rolloff;
            let scaled = shared.scaled(wavelength);
            let wavelength = digits(scaled.factor * wavelength, 3);
            told += &format!(", roll-off at a wavelength of {wavelength} {}", scaled.unit);
        }
        told
    }
}

/// q^(2(1 + H)), by which the density falls.
fn falls(wavenumber: f64, hurst: f64) -> f64 {
    wavenumber.powf(2.0 * (1.0 + hurst))
}
