//! Power spectral density (fig. 2).

use crate::figures::axis::Axis;
use crate::figures::chart::{Chart, Series};
use crate::figures::figure::Figure;
use crate::figures::style::{Dash, Style};
use crate::report::ReportError;
use crate::report::figure::{Definition, Drawn};
use crate::report::figure_data::FigureData;
use crate::report::samples;

pub const FIGURE: Definition = Definition {
    name: "spectrum",
    title: "Power spectral density",
    draw,
};

/// Points of one spectrum, evenly by the logarithm of the wavenumber.
const POINTS: f64 = 40.0;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let samples = samples::of(data)?;
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
        let mean = rings
            .iter()
            .map(|ring| (f64::from(ring.wavenumber), ring.mean_power / unit));
        let mut shown = 0;
        let drawn = rings.iter().filter(|ring| {
            let place = (f64::from(ring.wavenumber).ln() * POINTS / 6.0).floor() as i64 + 1;
            std::mem::replace(&mut shown, place) != place
        });
        let drawn = drawn.map(|ring| (f64::from(ring.wavenumber), ring.power / unit));
        let markers = data.styles.markers(&sample.point);
        chart.series.push(Series::new(mean, line));
        chart
            .series
            .push(Series::new(drawn.collect::<Vec<_>>(), markers).named(label));
    }
    if chart.series.is_empty() {
        let lines = data.lines_of_surfaces();
        return Ok(Drawn::missing("random surfaces", lines));
    }
    let caption = format!(
        "Power spectral density of {} of the study's spectra: points are means over rings of one \
         integer wavenumber, of the first surface of each; lines are the densities that they are \
         drawn from, scaled to the same rms slope h′. L is the side of the periodic cell.",
        chart.series.len() / 2,
    );
    Ok(Drawn::figure(Figure::of(chart), caption))
}
