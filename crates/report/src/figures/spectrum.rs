//! Power spectral density: of random surfaces in units of their cell (fig. 2), of measured surfaces and
//! of whatever a `measure` stage has found in units of length.

use super::measured_spectrum;
use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::figure::{Definition, Drawn};
use crate::figure_data::FigureData;
use crate::measured::{FILE_IS_GONE, MeasuredMaps};
use crate::samples;

pub const FIGURE: Definition =
    Definition { name: "spectrum", title: "Power spectral density", draw };

/// Points of one spectrum, evenly by the logarithm of the wavenumber.
const POINTS: f64 = 40.0;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let drawn = of_random_surfaces(data)?;
    let measured = measured_spectrum::chart(data)?;
    let mut found: Vec<(Chart, String)> = measured.into_iter().chain(drawn).collect();
    if found.is_empty() {
        let lines = data.lines_of_surfaces();
        return Ok(match data.maps {
            MeasuredMaps::Gone => Drawn::gone(FILE_IS_GONE),
            MeasuredMaps::There(_) => Drawn::missing("random or measured surfaces", lines),
        });
    }
    if let [_] = found.as_slice() {
        let (chart, caption) = found.remove(0);
        return Ok(Drawn::figure(Figure::of(chart), caption));
    }
    let (charts, captions): (Vec<Chart>, Vec<String>) = found.into_iter().unzip();
    let figure = Figure::of_charts(vec![charts], [430.0, 340.0]);
    Ok(Drawn::figure(figure, captions.join(" To the right: ")))
}

/// The densities that random surfaces are drawn from, and what is drawn.
fn of_random_surfaces(data: &FigureData) -> Result<Option<(Chart, String)>, ReportError> {
    let samples = samples::of(data.finished)?;
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
        let label = data.styles.label(&sample.point);
        let label = label.unwrap_or_else(|| "the first surface".to_owned());
        let line = Style::line(data.styles.colour(&sample.point), Dash::Solid, 1.4);
        let mean = rings.iter().map(|ring| (f64::from(ring.wavenumber), ring.mean_power / unit));
        let mut shown = 0;
        let drawn = rings.iter().filter(|ring| {
            let place = (f64::from(ring.wavenumber).ln() * POINTS / 6.0).floor() as i64 + 1;
            std::mem::replace(&mut shown, place) != place
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
        "Power spectral density of {} of the study's spectra: points are means over rings of one \
         integer wavenumber, of the first surface of each; lines are the densities that they are \
         drawn from, scaled to the same rms slope h′. L is the side of the periodic cell.",
        chart.series.len() / 2,
    );
    Ok(Some((chart, caption)))
}
