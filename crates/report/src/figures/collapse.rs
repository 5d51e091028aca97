//! Collapse of corrected areas on the bandwidth or, if Hurst exponents or plateaus differ, on
//! Nayak's parameter. The paper does not show this collapse (compare section 5.2.2).

use std::collections::BTreeSet;

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::charts::{Figure, in_pairs};
use crate::ensembles::{EnsembleCurves, Mean, Point};
use crate::figure_data::{COUNTED_AREA, FigureData};
use crate::figures::{Definition, Drawn, sample};
use asperity_contact::topography::spectrum;
use asperity_stages::columns::{ALTERATIONS, AREA_CORRECTED, HURST, K_LOWER, K_ROLLOFF, K_UPPER};
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::line;

pub const COLLAPSE: Definition = Definition {
    name: "collapse",
    title: "Collapse of the corrected area on the bandwidth",
    draw: draw_collapse,
};

/// Loads at which the collapse is drawn. They range from light contact to a third of the area,
/// where the secants of the spectra differ clearly.
const LOADS: [f64; 3] = [0.024, 0.06, 0.14];
/// Largest relative distance of a study's load from one of [`LOADS`].
const NEAR: f64 = 0.1;
/// Smallest number of spectra for which a chart is drawn.
const FEWEST_SPECTRA: usize = 3;
/// Corrections, with the titles of their charts.
const CORRECTIONS: [(&str, &str); 3] =
    [(AS_COUNTED, "as counted"), (OF_2015, "corrected by π/8"), (OF_2017, "corrected as in 2017")];

/// Secants of one spectrum at all of [`LOADS`].
struct Spectrum<'a> {
    ensemble: &'a EnsembleCurves<'a>,
    abscissa: f64,
    means: Vec<Mean>,
}

/// Quantity on the horizontal axis of the collapse.
#[derive(Clone, Copy)]
enum Abscissa {
    /// ζ = k_upper/k_lower, for spectra that differ only in their cutoffs.
    Bandwidth,
    /// Nayak's parameter α over the modes of the cell.
    Nayak,
}

impl Abscissa {
    fn select(data: &FigureData) -> Abscissa {
        let corrected = data.under(OF_2017).filter_map(|one| spectrum(&one.point));
        let mut spectra: Vec<spectrum::Spectrum> = corrected.collect();
        if spectra.is_empty() {
            spectra.extend(data.measured.iter().filter_map(|one| spectrum(&one.point)));
        }
        let is_alike = |one: &spectrum::Spectrum| {
            one.k_rolloff == one.k_lower && one.hurst == spectra[0].hurst
        };
        if spectra.iter().all(is_alike) { Abscissa::Bandwidth } else { Abscissa::Nayak }
    }

    fn label(self) -> &'static str {
        match self {
            Abscissa::Bandwidth => "bandwidth ζ = k_upper/k_lower",
            Abscissa::Nayak => "Nayak's parameter α",
        }
    }

    fn meaning(self) -> (&'static str, &'static str) {
        match self {
            Abscissa::Bandwidth => ("the bandwidth ζ = k_upper/k_lower", "ζ"),
            Abscissa::Nayak => {
                ("Nayak's parameter α of the spectrum over the modes of the cell", "α")
            }
        }
    }

    fn value(self, spectrum: &spectrum::Spectrum) -> Option<f64> {
        match self {
            Abscissa::Bandwidth => Some(f64::from(spectrum.k_upper) / f64::from(spectrum.k_lower)),
            Abscissa::Nayak => spectrum.nayak_on_a_square(),
        }
    }
}

fn draw_collapse(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut charts = Vec::new();
    let mut surfaces = Vec::new();
    let abscissa = Abscissa::select(data);
    for (correction, title) in CORRECTIONS {
        let spectra = spectra(data, correction, abscissa)?;
        if spectra.len() < FEWEST_SPECTRA {
            continue;
        }
        surfaces = spectra.iter().map(|one| one.ensemble.surfaces).collect();
        charts.push(chart(data, &spectra, abscissa.label()).titled(title));
    }
    let is_corrected = data.under(OF_2017).any(|_| true);
    if !is_corrected || charts.is_empty() {
        return lacking(data, is_corrected, abscissa);
    }
    let (meaning, symbol) = abscissa.meaning();
    let caption = format!(
        "Secants A/(A₀ y) against {meaning}, at the loads next to the curves, from {}; bars are \
         {}. Lines are least-squares power laws in {symbol}. At equal {symbol}, counted areas grow \
         with k_lower, because the error of the mesh is larger for short wavelengths; areas \
         corrected by π/8 fall with k_lower.",
        sample(&surfaces),
        data.bars,
    );
    Ok(Drawn::figure(Figure::from_charts(in_pairs(charts), [430.0, 320.0]), caption))
}

/// Returns what the study lacks of areas with the correction of 2017, spectra and loads.
fn lacking(
    data: &FigureData,
    is_corrected: bool,
    abscissa: Abscissa,
) -> Result<Drawn, ReportError> {
    let (mut needs, mut lines) = (Vec::new(), Vec::new());
    if !is_corrected {
        needs.push(format!("areas with the correction \"{OF_2017}\""));
        lines.push(data.lines_of_corrections());
    }
    let spectra = data.measured.iter().filter_map(|one| abscissa.value(&spectrum(&one.point)?));
    let spectra: BTreeSet<u64> = spectra.map(f64::to_bits).collect();
    if spectra.len() < FEWEST_SPECTRA {
        needs.push(format!("three or more values of `{}`", K_UPPER.name));
        lines.push(data.lines_of_spectra(K_UPPER.name));
    }
    let mut has_loads = false;
    for ensemble in &data.measured {
        has_loads |= at_loads(&ensemble.mean(COUNTED_AREA)?).is_some();
    }
    if !has_loads {
        let [light, moderate, heavy] = LOADS.map(|load| data.loads.text_of_reduced(load));
        needs.push(format!("loads near {light}, {moderate} and {heavy}"));
        lines.push(data.lines_of_loads(&format!("{LOADS:?}")));
    }
    if needs.is_empty() {
        needs.push("three or more of its spectra at the same loads".to_owned());
    }
    Ok(Drawn::missing(needs.join("; "), lines.join("\n\n")))
}

/// Returns the secants at all of [`LOADS`], if there are areas near each of them.
fn at_loads(means: &[Mean]) -> Option<Vec<Mean>> {
    let at = |load: f64| {
        let distance = |mean: &Mean| (mean.load / load - 1.0).abs();
        let nearest = means.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(nearest) < NEAR).then(|| nearest.secant())
    };
    LOADS.into_iter().map(at).collect()
}

/// Returns the spectra with areas at all of [`LOADS`].
fn spectra<'a>(
    data: &'a FigureData,
    correction: &str,
    abscissa: Abscissa,
) -> Result<Vec<Spectrum<'a>>, ReportError> {
    let mut spectra = Vec::new();
    for ensemble in data.under(correction) {
        let own = spectrum(&ensemble.point);
        let Some(abscissa) = own.and_then(|own| abscissa.value(&own)) else {
            continue;
        };
        let area = if correction == AS_COUNTED { COUNTED_AREA } else { AREA_CORRECTED.name };
        let means = at_loads(&ensemble.mean(area)?);
        spectra.extend(means.map(|means| Spectrum { ensemble, abscissa, means }));
    }
    Ok(spectra)
}

fn chart(data: &FigureData, spectra: &[Spectrum], label: &str) -> Chart {
    let mut chart = Chart::new(Axis::logarithmic(label), Axis::linear("secant A/(A₀ y)"));
    let abscissae = || spectra.iter().map(|one| one.abscissa);
    let [least, most] = [abscissae().fold(f64::MAX, f64::min), abscissae().fold(0.0, f64::max)];
    for load in 0..LOADS.len() {
        let logarithms: Vec<f64> = abscissae().map(f64::ln).collect();
        let secants: Vec<f64> = spectra.iter().map(|one| one.means[load].mean.ln()).collect();
        if let Some((slope, offset)) = line(&logarithms, &secants) {
            let style = Style::line(Colour::Muted, Dash::Dashed, 1.2);
            let secant = |x: f64| (offset + slope * x.ln()).exp();
            let ends = [least, most].map(|x| (x, secant(x)));
            chart.series.push(Series::new(ends, style));
            // Place the notes at the left ends, where the lines are farthest apart.
            let note = format!("y = {:.3}", spectra[0].means[load].load);
            chart.notes.push((least / 1.9, secant(least), note));
        }
    }
    chart.x = chart.x.within(least / 3.2, 1.3 * most);
    for spectrum in spectra {
        let secant =
            |mean: &Mean| DataPoint { x: spectrum.abscissa, y: mean.mean, bar: mean.bar() };
        let point = &spectrum.ensemble.point;
        let series = Series {
            points: spectrum.means.iter().map(secant).collect(),
            style: data.styles.markers(point),
            label: data.styles.label(point),
        };
        chart.series.push(series);
    }
    chart
}

/// Returns the spectrum of a point. Returns `None` if its surfaces are not drawn from a spectrum,
/// are pairs of surfaces or have yielded.
fn spectrum(point: &Point) -> Option<spectrum::Spectrum> {
    if ALTERATIONS.iter().any(|name| point.contains_key(*name)) {
        return None;
    }
    let whole = |name: &str| point.get(name)?.parse::<u32>().ok();
    let k_lower = whole(K_LOWER.name)?;
    Some(spectrum::Spectrum {
        hurst: point.get(HURST.name)?.parse().ok()?,
        k_lower,
        k_rolloff: whole(K_ROLLOFF.name).unwrap_or(k_lower),
        k_upper: whole(K_UPPER.name)?,
        anisotropy: None,
    })
}
