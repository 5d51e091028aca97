//! Corrected areas of all spectra on one curve against Nayak's parameter, and what the mesh makes of
//! it: a finding of this program, beside section 5.2.2 of the paper.

use crate::contact::topography::nayak::Continuum;
use crate::figures::axis::Axis;
use crate::figures::chart::{Chart, DataPoint, Series};
use crate::figures::colour::Colour;
use crate::figures::figure::{Figure, in_pairs};
use crate::figures::style::{Dash, Style};
use crate::fitting::line;
use crate::report::ReportError;
use crate::report::ensembles::{EnsembleCurves, Mean, Point};
use crate::report::figure::{Definition, Drawn, sample};
use crate::report::figure_data::{COUNTED_AREA, FigureData};
use crate::stages::columns::{AREA_CORRECTED, HURST, K_LOWER, K_ROLLOFF, K_UPPER};
use crate::stages::correct::{AS_COUNTED, OF_2015, OF_2017};

pub const FIGURE: Definition = Definition {
    name: "collapse",
    title: "Collapse of the corrected area on Nayak's parameter",
    draw,
};

/// Loads whose secants lie apart: from light contact to a third of the area.
const LOADS: [f64; 3] = [0.024, 0.06, 0.14];
/// How far from these a study's loads may lie.
const NEAR: f64 = 0.1;
/// Values of α that tell a curve.
const FEWEST_SPECTRA: usize = 3;
/// The corrections, and the words above their charts.
const CORRECTIONS: [(&str, &str); 3] = [
    (AS_COUNTED, "as counted"),
    (OF_2015, "corrected by π/8"),
    (OF_2017, "corrected as in 2017"),
];

/// Secants of one spectrum.
struct Spectrum<'a> {
    ensemble: &'a EnsembleCurves<'a>,
    nayak: f64,
    means: Vec<Mean>,
}

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut charts = Vec::new();
    let mut surfaces = Vec::new();
    for (correction, title) in CORRECTIONS {
        let spectra = spectra(data, correction)?;
        if spectra.len() < FEWEST_SPECTRA {
            continue;
        }
        surfaces = spectra.iter().map(|one| one.ensemble.surfaces).collect();
        charts.push(chart(data, &spectra).titled(title));
    }
    if !data.under(OF_2017).any(|_| true) || charts.is_empty() {
        return Ok(Drawn::missing(
            "areas of three spectra or more, corrected as in 2017",
            data.lines_of_corrections(),
        ));
    }
    let caption = format!(
        "Secants A/(A₀ y) against Nayak's parameter α of the spectrum over continuous wavenumbers, at the \
         loads that stand beside them, with lines by least squares in ln α; from {}; bars are {}. \
         As counted, the areas of one α differ with k_lower, for the mesh adds more where \
         wavelengths are short; corrected by π/8 they differ the other way.",
        sample(&surfaces),
        data.bars,
    );
    Ok(Drawn::figure(
        Figure::of_charts(in_pairs(charts), [430.0, 320.0]),
        caption,
    ))
}

/// The spectra with a corrected area at one of the loads, or more.
fn spectra<'a>(data: &'a FigureData, correction: &str) -> Result<Vec<Spectrum<'a>>, ReportError> {
    let mut spectra = Vec::new();
    for ensemble in data.under(correction) {
        let Some(continuum) = continuum(&ensemble.point) else {
            continue;
        };
        let area = if correction == AS_COUNTED {
            COUNTED_AREA
        } else {
            AREA_CORRECTED.name
        };
        let means = ensemble.mean(area)?;
        let at = |load: f64| {
            let distance = |mean: &Mean| (mean.load / load - 1.0).abs();
            let nearest = means
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            (distance(nearest) < NEAR).then(|| nearest.secant())
        };
        let means: Option<Vec<Mean>> = LOADS.into_iter().map(at).collect();
        spectra.extend(means.map(|means| Spectrum {
            ensemble,
            nayak: continuum.nayak(),
            means,
        }));
    }
    Ok(spectra)
}

fn chart(data: &FigureData, spectra: &[Spectrum]) -> Chart {
    let mut chart = Chart::new(
        Axis::logarithmic("Nayak's parameter α"),
        Axis::linear("secant A/(A₀ y)"),
    );
    let alphas = || spectra.iter().map(|one| one.nayak);
    let [least, most] = [
        alphas().fold(f64::MAX, f64::min),
        alphas().fold(0.0, f64::max),
    ];
    for load in 0..LOADS.len() {
        let logarithms: Vec<f64> = alphas().map(f64::ln).collect();
        let secants: Vec<f64> = spectra
            .iter()
            .map(|one| one.means[load].mean.ln())
            .collect();
        if let Some((slope, offset)) = line(&logarithms, &secants) {
            let style = Style::line(Colour::Muted, Dash::Dashed, 1.2);
            let secant = |alpha: f64| (offset + slope * alpha.ln()).exp();
            let ends = [least, most].map(|alpha| (alpha, secant(alpha)));
            chart.series.push(Series::new(ends, style));
            // At the left ends, where lines are farthest apart.
            let note = format!("y = {:.3}", spectra[0].means[load].load);
            chart.notes.push((least / 1.9, secant(least), note));
        }
    }
    chart.x = chart.x.within(least / 3.2, 1.3 * most);
    for spectrum in spectra {
        let point = |mean: &Mean| DataPoint {
            x: spectrum.nayak,
            y: mean.mean,
            bar: mean.bar(),
        };
        let place = &spectrum.ensemble.point;
        let series = Series {
            points: spectrum.means.iter().map(point).collect(),
            style: data.styles.markers(place),
            label: data.styles.label(place),
        };
        chart.series.push(series);
    }
    chart
}

/// The spectrum of a point over continuous wavenumbers, if its surfaces are drawn from one.
fn continuum(point: &Point) -> Option<Continuum> {
    let number = |name: &str| point.get(name)?.parse::<f64>().ok();
    let [k_lower, k_upper] = [number(K_LOWER.name)?, number(K_UPPER.name)?];
    let k_rolloff = number(K_ROLLOFF.name).unwrap_or(k_lower);
    Some(Continuum {
        hurst: number(HURST.name)?,
        plateau: k_lower / k_rolloff,
        magnification: k_upper / k_rolloff,
    })
}
