//! Power spectral densities (fig. 2) and slopes by scale (Sanner et al. 2022,
//! doi:10.1016/j.apsadv.2021.100190) from `measure` stages. For measured surfaces without such a
//! stage, they are computed from the map for which the contact is solved.

use arrow::array::Array;

use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn};
use crate::points::{self, holds};
use crate::surface_curves::{self, CurvePoint, SurfaceCurve, thinned};
use crate::units::{Unit, digits};
use crate::{ReportError, samples};
use asperity_mechanics::topography::surface;
use asperity_stages::columns::{
    ALONG, DISTANCE, MODES, SCANS, SLOPE_AT_SCALE, SPECTRAL_DENSITY, WAVENUMBER,
};
use asperity_tables::table::{Table, TableError};

pub const SPECTRUM: Definition =
    Definition { name: "spectrum", title: "Power spectral density", draw: draw_spectra };

/// Number of points of a spectrum per factor e⁶ of the wavenumber, evenly spaced in its logarithm.
const POINTS: f64 = 40.0;

fn draw_spectra(data: &FigureData) -> Result<Drawn, ReportError> {
    let drawn = of_random_surfaces(data)?;
    let measured = in_units_of_length(data)?;
    let mut found: Vec<(Chart, String)> = measured.into_iter().chain(drawn).collect();
    if found.is_empty() {
        return Ok(Drawn::missing_surfaces(data));
    }
    if let [_] = found.as_slice() {
        let (chart, caption) = found.remove(0);
        return Ok(Drawn::figure(Figure::from_chart(chart), caption));
    }
    let (charts, captions): (Vec<Chart>, Vec<String>) = found.into_iter().unzip();
    let figure = Figure::from_charts(vec![charts], [430.0, 340.0]);
    Ok(Drawn::figure(figure, captions.join("  Right:  ")))
}

/// Returns the chart of random surfaces: the densities from which they are drawn, and those of the
/// drawn surfaces.
fn of_random_surfaces(data: &FigureData) -> Result<Option<(Chart, String)>, ReportError> {
    let samples = samples::first_surfaces(data.finished)?;
    let mut chart = Chart::new(
        Axis::logarithmic("wavenumber k = L/λ"),
        Axis::logarithmic("power of a mode |ĥ(k)|²/(h′ L)²"),
    );
    for sample in &samples {
        let Some(surface) = sample.random() else {
            continue;
        };
        let cell = sample.params.grid().map_err(ReportError::Surface)?.cell();
        let unit = (surface.rms_slope * cell.longer_side()).powi(2);
        let rings = surface.rings(cell);
        let label = data.styles.name(&sample.point, "the first surface");
        let line = Style::line(data.styles.colour(&sample.point), Dash::Solid, 1.4);
        let mean = rings.iter().map(|ring| (f64::from(ring.wavenumber), ring.mean_power / unit));
        let mut shown = 0;
        let drawn = rings.iter().filter(|ring| {
            let bin = (f64::from(ring.wavenumber).ln() * POINTS / 6.0).floor() as i64 + 1;
            std::mem::replace(&mut shown, bin) != bin
        });
        let drawn = drawn.map(|ring| (f64::from(ring.wavenumber), ring.power / unit));
        let markers = data.styles.markers(&sample.point);
        chart.series.push(Series::new(mean, line));
        chart.series.push(Series::new(drawn.collect::<Vec<_>>(), markers).named(label));
    }
    if chart.series.is_empty() {
        return Ok(None);
    }
    let caption = format!(
        "Power spectral density of {} of the study's spectra. Points are means over rings of one \
         integer wavenumber, for the first surface of each spectrum; lines are the densities from \
         which surfaces are drawn, for the same rms slope h′. L is the side of the periodic \
         cell.",
        chart.series.len() / 2,
    );
    Ok(Some((chart, caption)))
}

/// Largest number of fitted laws in a caption.
const MOST_LAWS: usize = 4;
/// Density, relative to the largest, below which a value beyond a cutoff is a rounding error.
const ROUNDING: f64 = 1e-20;

/// Returns the chart and caption of spectra in units of length, or `None` without such spectra.
fn in_units_of_length(data: &FigureData) -> Result<Option<(Chart, String)>, TableError> {
    let (spectra, stitched) = (spectra(data)?, stitched(data)?);
    if spectra.is_empty() && stitched.is_empty() {
        return Ok(None);
    }
    let points = spectra.iter().chain(&stitched).map(|spectrum| &spectrum.point);
    let shared = Unit::of_lengths(points.map(|point| data.units.at(point)));
    let (per_length, fourth) = (shared.power("⁻¹"), shared.power("⁴"));
    let mut chart = Chart::new(
        Axis::logarithmic(format!("wavenumber q = 2π/λ, {per_length}")),
        Axis::logarithmic(format!("power spectral density C(q), {fourth}")),
    );
    let (mut descriptions, mut colours) = (Vec::new(), Vec::new());
    for spectrum in &spectra {
        let factor = shared.factor(data.units.at(&spectrum.point));
        let in_unit = |(q, density): (f64, f64)| (q / factor, density * factor.powi(4));
        let label = data.styles.name(&spectrum.point, "the surface");
        let colour = data.styles.colour(&spectrum.point);
        // Scans of one file share its colour.
        let before = colours.iter().filter(|known| **known == colour).count();
        colours.push(colour);
        let dash = [Dash::Solid, Dash::DashDot, Dash::Dotted][before.min(2)];
        let style = match spectrum.surfaces {
            1 => Style::line(colour, dash, 1.5),
            _ => data.styles.markers(&spectrum.point).joined(),
        };
        let points = thinned(&spectrum.points).into_iter().map(in_unit);
        let named = match spectrum.surfaces {
            1 => label.clone(),
            count => format!("{label}, mean of {count}"),
        };
        chart.series.push(Series::new(points, style).named(named));
        for law in laws(data, spectrum)? {
            let curve = law.curve(factor, colour).named("self-affine law, fitted");
            chart.series.push(curve);
            descriptions.push(law.description(&label, &shared, factor));
        }
    }
    for spectrum in &stitched {
        let factor = shared.factor(data.units.at(&spectrum.point));
        let in_unit = |point: &CurvePoint| (point.x / factor, point.y * factor.powi(4));
        let style = Style::line(Colour::Text, Dash::Solid, 2.2);
        chart
            .series
            .push(Series::new(spectrum.points.iter().map(in_unit), style).named("stitched"));
        for law in laws(data, spectrum)? {
            let curve = law.curve(factor, Colour::Muted);
            chart.series.push(curve.named("self-affine law of the stitched spectrum"));
            descriptions.push(law.description("the stitched spectrum", &shared, factor));
        }
    }
    let stitching = match stitched.len() {
        0 => "",
        _ => " The stitched spectrum is the weighted mean over the trusted waves of all scans.",
    };
    Ok(Some((chart, caption(&descriptions) + stitching)))
}

fn caption(laws: &[String]) -> String {
    let shown = laws.len().min(MOST_LAWS);
    let fits = match laws.len() {
        0 => "A fit with `law = \"self-affine\"` to a measured spectrum adds its law.".to_owned(),
        count if count > shown => format!(
            "Dashed: fitted self-affine laws: {}; and {} more.",
            laws[..shown].join("; "),
            count - shown
        ),
        _ => format!("Dashed: fitted self-affine laws: {}.", laws.join("; ")),
    };
    format!(
        "Power spectral density C(q), averaged over rings of wavevectors, where ∫ C d²q/(2π)² is \
         the mean square height. Maps that are not periodic are multiplied by a Hann window. Rings \
         that are close on the axis are averaged. {fits}"
    )
}

/// Returns the spectra from the tables of the study, and computed spectra of the measured surfaces
/// that no table contains.
fn spectra(data: &FigureData) -> Result<Vec<SurfaceCurve>, TableError> {
    let columns = [WAVENUMBER, SPECTRAL_DENSITY];
    let names = [WAVENUMBER.name, SPECTRAL_DENSITY.name, MODES.name];
    let mut spectra: Vec<SurfaceCurve> = Vec::new();
    for stage in data.finished.with(&names).filter(|stage| !stage.table.has(SCANS.name)) {
        for spectrum in surface_curves::from_table(&stage.table, columns, Some(MODES))? {
            if spectra.iter().all(|known| known.point != spectrum.point) {
                spectra.push(spectrum);
            }
        }
    }
    for map in data.maps.iter().flatten() {
        if spectra.iter().all(|known| !holds(&map.point, &known.point)) {
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

/// Returns the spectra that are stitched from several scans.
fn stitched(data: &FigureData) -> Result<Vec<SurfaceCurve>, TableError> {
    let mut found = Vec::new();
    for stage in data.finished.with(&[SCANS.name, WAVENUMBER.name, SPECTRAL_DENSITY.name]) {
        let columns = [WAVENUMBER, SPECTRAL_DENSITY];
        found.extend(surface_curves::from_table(&stage.table, columns, Some(MODES))?);
    }
    Ok(found)
}

/// A fitted law in the unit of length of its surface.
struct FittedLaw {
    hurst: f64,
    interval: Option<[f64; 2]>,
    rolloff: Option<f64>,
    /// Density below the roll-off, or C₀ of C₀ q^(−2(1 + H)) for a law without a roll-off.
    plateau: f64,
    range: [f64; 2],
}

/// Returns the laws fitted to a spectrum.
fn laws(data: &FigureData, spectrum: &SurfaceCurve) -> Result<Vec<FittedLaw>, TableError> {
    let names = ["hurst_exponent", "rolloff_wavenumber", "wavenumber_lower"];
    let mut laws = Vec::new();
    for stage in data.finished.with(&names) {
        for row in 0..stage.table.rows() {
            if holds(&points::at_row(&stage.table, row), &spectrum.point) {
                laws.extend(FittedLaw::from_row(&stage.table, row, &spectrum.points)?);
            }
        }
    }
    Ok(laws)
}

impl FittedLaw {
    /// Reads a fitted law from a row. `points` are points of the spectrum; those in the window of
    /// the fit give the range and C₀ of the law. Returns `None` if the fit failed.
    fn from_row(
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
        // Maximum-likelihood C₀, which a row without a roll-off does not contain.
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

    /// Returns the curve of the law in a unit of length that is `factor` of that of its surface.
    fn curve(&self, factor: f64, colour: Colour) -> Series {
        let density = |q: f64| self.at(q * factor) * factor.powi(4);
        let ends = self.range.map(|q| q / factor);
        let style = Style::line(colour, Dash::Dashed, 1.8);
        Series::curve(density, ends, Spacing::Logarithmic, style)
    }

    /// Returns text such as `scan.x3p H = 0.82 (0.79 to 0.85), roll-off at a wavelength of 2.1 µm`.
    fn description(&self, label: &str, shared: &Unit, factor: f64) -> String {
        let mut text = format!("{label} H = {}", digits(self.hurst, 3));
        if let Some([lower, upper]) = self.interval {
            text += &format!(" ({} to {})", digits(lower, 3), digits(upper, 3));
        }
        if let Some(rolloff) = self.rolloff {
            let wavelength = factor * std::f64::consts::TAU / rolloff;
            let scaled = shared.scaled(wavelength);
            let wavelength = digits(scaled.factor * wavelength, 3);
            text += &format!(", roll-off at a wavelength of {wavelength} {}", scaled.unit);
        }
        text
    }
}

/// Returns q^(2(1 + H)). A self-affine density is C₀ divided by this power.
fn falls(wavenumber: f64, hurst: f64) -> f64 {
    wavenumber.powf(2.0 * (1.0 + hurst))
}

pub const SLOPE_BY_SCALE: Definition =
    Definition { name: "slope-at-scale", title: "Slope by scale", draw: draw_slopes };

fn draw_slopes(data: &FigureData) -> Result<Drawn, ReportError> {
    let curves = curves(data)?;
    if curves.is_empty() {
        return Ok(Drawn::missing_surfaces(data));
    }
    let shared = Unit::of_lengths(curves.iter().map(|curve| data.units.at(&curve.point)));
    let in_unit = |curve: &SurfaceCurve| -> Vec<(f64, f64)> {
        let factor = shared.factor(data.units.at(&curve.point));
        let points = curve.points.iter();
        points.map(|point| (factor * point.x, point.y)).collect()
    };
    let points: Vec<Vec<(f64, f64)>> = curves.iter().map(in_unit).collect();
    let longest = points.iter().flatten().fold(0.0_f64, |most, point| most.max(point.0));
    let scaled = shared.scaled(longest);
    let mut chart = Chart::new(
        Axis::logarithmic(format!("distance ℓ, {}", scaled.unit)),
        Axis::logarithmic("slope √⟨((h(x + ℓ) − h(x))/ℓ)²⟩"),
    );
    for (curve, points) in curves.iter().zip(points) {
        let label = data.styles.name(&curve.point, "the surface");
        let along = curve.along.as_deref().unwrap_or_default();
        let dash = if along == surface::Axis::Y.name() { Dash::Dashed } else { Dash::Solid };
        let style = Style::line(data.styles.colour(&curve.point), dash, 1.5);
        let points = points.into_iter().map(|(x, y)| (scaled.factor * x, y));
        let series = Series::new(points, style);
        chart.series.push(series.named(format!("{label}, along {along}")));
    }
    let caption = "Rms slope of the straight lines between nodes at the distance ℓ, along x \
                   (solid) and along y (dashed). The slope grows towards small distances as far as \
                   the instrument resolves the roughness.";
    Ok(Drawn::figure(Figure::from_chart(chart), caption))
}

/// Returns the slopes by scale from the tables of the study, and computed slopes of the measured
/// surfaces that no table contains.
fn curves(data: &FigureData) -> Result<Vec<SurfaceCurve>, TableError> {
    let columns = [DISTANCE, SLOPE_AT_SCALE];
    let names = [ALONG.name, DISTANCE.name, SLOPE_AT_SCALE.name];
    let mut curves: Vec<SurfaceCurve> = Vec::new();
    for stage in data.finished.with(&names) {
        let known = curves.clone();
        let is_new = |curve: &SurfaceCurve| known.iter().all(|one| one.point != curve.point);
        let found = surface_curves::from_table(&stage.table, columns, None)?;
        curves.extend(found.into_iter().filter(is_new));
    }
    let known = curves.clone();
    for map in data.maps.iter().flatten() {
        if known.iter().any(|curve| holds(&map.point, &curve.point)) {
            continue;
        }
        let both = surface::Axis::BOTH.into_iter().zip(&map.slopes);
        curves.extend(both.map(|(axis, points)| SurfaceCurve {
            point: map.point.clone(),
            along: Some(axis.name().to_owned()),
            surfaces: 1,
            points: points.clone(),
        }));
    }
    curves.retain(|curve| curve.points.len() > 1);
    Ok(curves)
}
