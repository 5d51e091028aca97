//! Area under light load with the theories, its secant (fig. 5) and its slope (fig. 6). Also
//! asperity models compared with the boundary-element solution, which the paper does not show.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, EnsembleCurves, Mean};
use crate::figure_data::{
    COUNTED_AREA, FigureData, LIGHT, series, spaced, spaced_by, texts_if_any, up_to,
};
use crate::figures::{Definition, Drawn, sample};
use crate::loads::LOAD_LABEL;
use crate::symbols::AREA_LABEL;
use asperity_contact::theory::law::{ContactEvolution, KAPPA_BGT};
use asperity_contact::theory::models::Asperities;
use asperity_contact::theory::models::AsperityModel;
use asperity_contact::theory::persson;
use asperity_stages::columns::{
    AREA_CORRECTED, ASPERITY_AREA_FRACTION, CORRECTION, INTERACTION, LOAD, SURFACE,
};
use asperity_stages::correct::AS_COUNTED;
use asperity_tables::table::{Table, TableError};

pub const AREA_LIGHT: Definition =
    Definition { name: "area-light", title: "Contact area under light load", draw: draw_area };

/// Smallest load of the chart of secants. At lighter loads few nodes are in contact, so the secants
/// scatter widely.
const SECANT_FROM: f64 = LIGHT / 100.0;
/// Smallest ratio of the loads of neighbouring markers on the chart of secants.
const FACTOR: f64 = 1.25;

fn draw_area(data: &FigureData) -> Result<Drawn, ReportError> {
    let heaviest = data.heaviest_light_load()?;
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * heaviest);
    let mut chart = Chart::new(axis.clone(), Axis::linear(AREA_LABEL));
    let mut secants = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("secant A/(A₀ y)"));
    for ensemble in &data.measured {
        let means = up_to(LIGHT, ensemble.mean(COUNTED_AREA)?);
        let seen = means.iter().filter(|mean| mean.load >= SECANT_FROM);
        let secant: Vec<Mean> = seen.map(Mean::secant).collect();
        data.add_curve(&mut chart, ensemble, &means, &spaced(heaviest / 20.0, &means));
        data.add_curve(&mut secants, ensemble, &secant, &spaced_by(FACTOR, &secant));
    }
    if !chart.has_curves() {
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        let needs = format!("measured contacts at two or more loads up to {}", data.light());
        return Ok(Drawn::missing(needs, lines));
    }
    let lightest = secants.series.iter().flat_map(|series| &series.points);
    let lightest = lightest.fold(heaviest, |least, point| least.min(point.x));
    for (chart, quantity, from) in
        [(&mut chart, AREA, heaviest * 1e-3), (&mut secants, SECANT, lightest)]
    {
        let range = [from, heaviest];
        chart.series.push(persson_curve(quantity, range));
        chart.series.push(asymptote(quantity, range));
        chart.series.extend(asperity_curves(quantity, range));
    }
    let caption = format!(
        "Counted contact area fraction against load (left), and its secant at loads from {} (right), \
         from {}. Lines are means over the surfaces; points with bars show \
         some of them, and bars are {}. {}{}",
        data.loads.text_of_reduced(rounded(lightest)),
        sample(&data.sample()),
        data.bars,
        data.share_of_mesh()?,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::side_by_side(chart, secants), caption))
}

/// Rounds a load to two significant digits.
fn rounded(load: f64) -> f64 {
    format!("{load:.1e}").parse().unwrap_or(load)
}

pub const SLOPE: Definition = Definition {
    name: "slope",
    title: "Slope of the contact area under light load",
    draw: draw_slope,
};

fn draw_slope(data: &FigureData) -> Result<Drawn, ReportError> {
    let heaviest = data.heaviest_light_load()?;
    let axis = Axis::linear(LOAD_LABEL).within(0.0, 1.05 * heaviest);
    let mut chart = Chart::new(axis, Axis::linear("slope d(A/A₀)/dy"));
    let mut kappas: Vec<String> = Vec::new();
    for ensemble in &data.measured {
        let mut slopes = ensemble.slope(COUNTED_AREA)?;
        slopes.retain(|slope| slope.x <= LIGHT);
        chart.series.push(data.markers(ensemble, slopes));
    }
    if !chart.has_curves() {
        let lines = data.lines_of_loads("{ to = 0.06, steps = 50 }");
        let needs = format!("measured contacts at two or more loads up to {}", data.light());
        return Ok(Drawn::missing(needs, lines));
    }
    for stage in data.finished.with(&["law", "kappa", "beta", "mu", "fitted_to"]) {
        for fit in fits(&stage.table)? {
            let style = Style::line(data.styles.colour(&fit.point), Dash::Solid, 2.0);
            let range = [heaviest * 1e-3, heaviest];
            let curve = Series::curve(|load| fit.law.slope(load), range, Spacing::Linear, style);
            chart.series.push(curve);
            let kappa = format!("κ = {:.3} √(2π)", fit.law.kappa / KAPPA_BGT);
            if !kappas.contains(&kappa) {
                kappas.push(kappa);
            }
        }
    }
    let persson = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let range = [0.0, heaviest];
    chart
        .series
        .push(Series::curve(persson::slope, range, Spacing::Linear, persson).named("Persson 2001"));
    let fits = if kappas.is_empty() {
        "The study does not fit the contact evolution law with a given κ to the counted area."
            .to_owned()
    } else {
        let kappas = kappas.join(", ");
        format!("Lines are least-squares fits of the contact evolution law with {kappas}.")
    };
    let caption = format!(
        "Slope of the mean counted area between neighbouring loads, from {}. Bars are {}. {fits}{}",
        sample(&data.sample()),
        data.bars,
        data.caveat,
    );
    Ok(Drawn::figure(Figure::from_chart(chart), caption))
}

struct Fit {
    point: ensembles::Point,
    law: ContactEvolution,
}

/// Returns the fits to the counted area with a given κ.
fn fits(table: &Table) -> Result<Vec<Fit>, TableError> {
    let texts = |name: &str| table.texts(name);
    let (laws, kappas) = (texts("law")?, texts("kappa_is")?);
    let corrections = texts_if_any(table, CORRECTION.name)?;
    let [kappa, beta, mu] = ["kappa", "beta", "mu"].map(|name| table.reals(name));
    let (kappa, beta, mu) = (kappa?, beta?, mu?);
    let is_shown = |&row: &usize| {
        let counted = corrections.is_none_or(|column| column.value(row) == AS_COUNTED);
        let is_known = beta.is_valid(row) && mu.is_valid(row) && kappa.is_valid(row);
        counted
            && is_known
            && laws.value(row) == "contact-evolution"
            && kappas.value(row) == "given"
    };
    let fit = |row: usize| Fit {
        point: ensembles::point(table, row),
        law: ContactEvolution { kappa: kappa.value(row), beta: beta.value(row), mu: mu.value(row) },
    };
    Ok((0..table.rows()).filter(is_shown).map(fit).collect())
}

pub const ASPERITIES: Definition = Definition {
    name: "asperities",
    title: "Asperity models beside the solution",
    draw: draw_asperities,
};

/// Values of `interaction`, from the simplest to the most detailed, with the titles of their
/// charts.
const INTERACTIONS: [(&str, &str); 3] = [
    ("none", "no interaction"),
    ("mean-field", "mean field"),
    ("explicit", "explicit interaction"),
];

fn draw_asperities(data: &FigureData) -> Result<Drawn, ReportError> {
    let wanted = [SURFACE.name, LOAD.name, INTERACTION.name, ASPERITY_AREA_FRACTION.name];
    let mut models = Vec::new();
    for stage in data.finished.with(&wanted) {
        models.extend(ensembles::from_table(&stage.table, data.bars)?);
    }
    let correction = data.corrections().first().copied();
    let solved: Vec<&EnsembleCurves> = match correction {
        Some(correction) => data.under(correction).collect(),
        None => data.measured.iter().collect(),
    };
    let column = match correction {
        Some(_) => AREA_CORRECTED.name,
        None => COUNTED_AREA,
    };
    let mut charts = Vec::new();
    let mut surfaces = Vec::new();
    for (word, title) in INTERACTIONS {
        let models = models.iter().filter(|model| interaction(model) == Some(word));
        let beside = models.filter_map(|model| {
            let solved = solved.iter().find(|solved| is_of(solved, model))?;
            Some((model, *solved))
        });
        let mut ratios = Vec::new();
        for (model, solved) in beside {
            let means = model.ratio(ASPERITY_AREA_FRACTION.name, solved, column)?;
            ratios.push((solved, means));
        }
        if !ratios.is_empty() {
            surfaces = ratios.iter().map(|(solved, _)| solved.surfaces).collect();
            charts.push(chart(data, title, &ratios));
        }
    }
    if charts.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    share_the_axis(&mut charts);
    let caption = format!(
        "Ratio of the area of asperity models (Hertzian ellipses at the summits) to the area of \
         the boundary-element solution, {}, from {}. The ratio is computed for each surface. \
         Panels: without interaction, with the displacement by the mean pressure (mean field), and \
         with each summit displaced by the forces on all others. Points are means over the surfaces, bars are {}. The models \
         count the common area of overlapping ellipses twice.",
        match correction {
            Some(correction) => format!("corrected as in `{correction}`"),
            None => "as counted on the mesh".to_owned(),
        },
        sample(&surfaces),
        data.bars,
    );
    let figure = Figure::from_charts(vec![charts], [300.0, 270.0]);
    Ok(Drawn::figure(figure, caption))
}

fn interaction<'a>(model: &'a EnsembleCurves) -> Option<&'a str> {
    model.point.get(INTERACTION.name).map(String::as_str)
}

/// Returns true if the boundary-element solution `solved` has the same surfaces as the asperity
/// model.
fn is_of(solved: &EnsembleCurves, model: &EnsembleCurves) -> bool {
    let own = model.point.iter();
    own.filter(|(name, _)| *name != INTERACTION.name)
        .all(|(name, value)| solved.point.get(name) == Some(value))
}

/// Gives all charts the same range of ratios.
fn share_the_axis(charts: &mut [Chart]) {
    let points = charts.iter().flat_map(|chart| &chart.series);
    let ratios = points.flat_map(|series| series.points.iter().map(|point| point.y));
    let [from, to] = charts[0].y.ends(ratios);
    for chart in charts {
        chart.y = chart.y.clone().within(from, to);
    }
}

fn chart(data: &FigureData, title: &str, ratios: &[(&EnsembleCurves, Vec<Mean>)]) -> Chart {
    let ratio = Axis::linear("area of the model/of the solution");
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), ratio).titled(title);
    for (ensemble, means) in ratios {
        let style = data.styles.markers(&ensemble.point).joined();
        chart.series.push(series(means, style).named(data.label(ensemble)));
    }
    let points = chart.series.iter().flat_map(|one| &one.points);
    let range = chart.x.ends(points.map(|point| point.x));
    let style = Style::line(Colour::Text, Dash::Dashed, 1.4);
    let line = Series::curve(|_| 1.0, range, Spacing::Logarithmic, style);
    chart.series.push(line.named("solution"));
    chart
}

/// Values of Nayak's parameter for which the paper draws asperity models.
const NAYAK: [(f64, Colour); 2] = [(2.0, Colour::Text), (10.0, Colour::Muted)];

/// Function that returns a plotted quantity from the area and the load.
pub type Quantity = fn(f64, f64) -> f64;

pub const AREA: Quantity = |area, _| area;
pub const SECANT: Quantity = |area, load| area / load;

/// Returns the spacing of the points of a curve over a range: logarithmic if the range does not
/// start at zero, because the curve may then be drawn on a logarithmic axis, where it needs closer
/// points at light loads.
fn steps([from, _]: [f64; 2]) -> Spacing {
    if from > 0.0 { Spacing::Logarithmic } else { Spacing::Linear }
}

pub fn persson_curve(quantity: Quantity, range: [f64; 2]) -> Series {
    let style = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let curve = |load| quantity(persson::area(load), load);
    Series::curve(curve, range, steps(range), style).named("Persson 2001")
}

/// Returns the curve of `quantity` for a = √(2π) y, the asymptote of asperity models at light load.
pub fn asymptote(quantity: Quantity, range: [f64; 2]) -> Series {
    let style = Style::line(Colour::Muted, Dash::Dotted, 1.6);
    let curve = |load| quantity(KAPPA_BGT * load, load);
    Series::curve(curve, range, steps(range), style).named("asymptote √(2π) y of BGT")
}

fn asperity_curves(quantity: Quantity, range: [f64; 2]) -> Vec<Series> {
    let models = [
        (AsperityModel::BushGibsonThomas, "BGT 1975", Dash::Solid),
        (AsperityModel::SimplifiedElliptic, "Greenwood 2006", Dash::DashDot),
    ];
    let curves = models.into_iter().flat_map(|(model, name, dash)| {
        NAYAK.map(|(nayak, colour)| {
            let asperities = Asperities::new(model, nayak).expect("both are above 3/2");
            let area = |load| asperities.at_load(load).map_or(f64::NAN, |contact| contact.area);
            let curve = |load| quantity(area(load), load);
            let style = Style::line(colour, dash, 1.4);
            let label = format!("{name}, α = {nayak}");
            Series::curve(curve, range, steps(range), style).named(label)
        })
    });
    curves.collect()
}
