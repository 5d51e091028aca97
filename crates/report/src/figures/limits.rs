//! Mesh error of the area and its corrections, and quantities in the limits of large cells and fine
//! meshes. The paper shows none of these figures.

use std::collections::BTreeSet;

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{self, Colour, Dash, Style};
use crate::charts::{Figure, in_pairs};
use crate::ensembles::{self, EnsembleCurves, Point};
use crate::figure_data::{FigureData, LIGHT, interval, texts_if_any};
use crate::figures::{Definition, Drawn, area, sample};
use crate::loads::LOAD_LABEL;
use crate::styles::Styles;
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_stages::columns::{AREA_CORRECTED, CORRECTION, K_UPPER, LOAD};
use asperity_stages::correct::AS_COUNTED;
use asperity_stages::fit::FITTED;
use asperity_tables::table::{Table, TableError};

pub const MESH: Definition =
    Definition { name: "mesh-convergence", title: "Convergence with the mesh", draw: draw_mesh };

/// Coefficient c of the mesh error A_N − A* = c S_d Δx for one parameter point at one load, pooled
/// over surfaces.
struct Coefficient {
    point: Point,
    load: f64,
    value: f64,
    interval: Option<[f64; 2]>,
    area_limit: f64,
}

fn draw_mesh(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut coefficients = Vec::new();
    for stage in data.finished.with(&["mesh_coefficient", "pooled", "area_limit", LOAD.name]) {
        coefficients.extend(pooled(&stage.table)?);
    }
    if coefficients.is_empty() {
        let meshes = data.measured.iter().filter_map(|one| ensembles::grid(&one.point));
        let meshes: BTreeSet<[usize; 2]> = meshes.map(|grid| grid.nodes()).collect();
        let needs = if meshes.len() > 1 {
            "a fit with `law = \"mesh-convergence\"`"
        } else {
            "the same surfaces on two or more meshes, and a fit with `law = \"mesh-convergence\"`"
        };
        return Ok(Drawn::missing(needs, data.lines_of_meshes()));
    }
    let points = coefficients.iter().map(|coefficient| &coefficient.point);
    let styles = Styles::new(points, &data.files);
    let mut charts = vec![coefficient_chart(&coefficients, &styles)];
    let names = [AS_COUNTED].into_iter().chain(data.corrections());
    for name in names.take(3) {
        let ensembles: Vec<&EnsembleCurves> = data.under(name).collect();
        if !ensembles.is_empty() {
            charts.push(error_chart(name, &ensembles, &coefficients, &styles)?);
        }
    }
    let caption = format!(
        "Coefficient c of A_N = A* + c S_d Δx at each load, from all meshes and surfaces, with \
         bootstrap intervals. Other panels: deviation of the counted and the corrected area from \
         A* on each mesh, at the load nearest to {LIGHT}. A_N is the area on a mesh, A* its limit \
         for fine meshes, S_d the Manhattan perimeter, Δx the mesh step. From {}.",
        sample(&data.sample()),
    );
    Ok(Drawn::figure(Figure::from_charts(in_pairs(charts), [430.0, 310.0]), caption))
}

fn coefficient_chart(coefficients: &[Coefficient], styles: &Styles) -> Chart {
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("coefficient c"));
    // The axis also holds the constants of both corrections, even if they are far from the data.
    let values = coefficients.iter().flat_map(|one| one.interval.unwrap_or([one.value; 2]));
    let [from, to] = chart.y.ends(values.chain([PI_OVER_EIGHT, YASTREBOV_2017]));
    chart.y = chart.y.within(from, to);
    chart.title = "coefficient of the error".to_owned();
    let mut loads: Vec<f64> = coefficients.iter().map(|one| one.load).collect();
    loads.sort_by(f64::total_cmp);
    let range = [0.8 * loads[0], 1.25 * loads[loads.len() - 1]];
    chart.x = chart.x.within(range[0], range[1]);
    for (value, label, dash) in [
        (PI_OVER_EIGHT, "π/8 (2015)", Dash::Dashed),
        (YASTREBOV_2017, "(π − 1 + ln 2)/24 (2017)", Dash::Solid),
    ] {
        let style = Style::line(Colour::Text, dash, 1.5);
        let line = Series::curve(|_| value, range, Spacing::Logarithmic, style);
        chart.series.push(line.named(label));
    }
    for coefficient in coefficients {
        let point =
            DataPoint { x: coefficient.load, y: coefficient.value, bar: coefficient.interval };
        chart.series.push(Series {
            points: vec![point],
            style: styles.markers(&coefficient.point),
            label: Some(styles.name(&coefficient.point, "the surfaces")),
        });
    }
    chart
}

/// Returns the chart of A/A* − 1 in per cent against the nodes per shortest wavelength, for areas A
/// with one correction and the area A* on an infinitely fine mesh.
fn error_chart(
    correction: &str,
    ensembles: &[&EnsembleCurves],
    coefficients: &[Coefficient],
    styles: &Styles,
) -> Result<Chart, TableError> {
    let title = match correction {
        AS_COUNTED => "as counted".to_owned(),
        _ => format!("correction {correction}"),
    };
    let mut chart =
        Chart::new(Axis::logarithmic("nodes per shortest wavelength"), Axis::linear("A/A* − 1, %"));
    chart.title = title;
    for coefficient in at_light_load(coefficients) {
        let of_point = ensembles.iter().filter(|one| is_at(&one.point, &coefficient.point));
        let mut points = Vec::new();
        for ensemble in of_point {
            let k_upper = ensemble.point.get(K_UPPER.name);
            let k_upper = k_upper.and_then(|k_upper| k_upper.parse::<f64>().ok());
            let (Some(grid), Some(k_upper)) = (ensembles::grid(&ensemble.point), k_upper) else {
                continue;
            };
            let nodes = grid.larger_steps();
            let means = ensemble.mean(AREA_CORRECTED.name)?;
            let mean = means.iter().find(|mean| mean.load == coefficient.load);
            let deviation = mean.map(|mean| 100.0 * (mean.mean / coefficient.area_limit - 1.0));
            points.extend(deviation.map(|deviation| (nodes / k_upper, deviation)));
        }
        points.sort_by(|one, other| one.0.total_cmp(&other.0));
        let style = styles.markers(&coefficient.point).joined();
        chart.series.push(Series::new(points, style));
    }
    Ok(chart)
}

/// Returns the coefficients at the load nearest to [`LIGHT`].
fn at_light_load(coefficients: &[Coefficient]) -> impl Iterator<Item = &Coefficient> {
    let distance = |load: f64| (load / LIGHT).ln().abs();
    let nearest = coefficients
        .iter()
        .map(|one| one.load)
        .min_by(|one, other| distance(*one).total_cmp(&distance(*other)));
    coefficients.iter().filter(move |one| Some(one.load) == nearest)
}

/// Returns true if the parameter point `ensemble` (one mesh) agrees with `point` (all meshes) in
/// the spectrum.
fn is_at(ensemble: &Point, point: &Point) -> bool {
    let spectrum = [
        "method",
        "side",
        "side_x",
        "side_y",
        "rms_slope",
        "hurst",
        "k_lower",
        "k_rolloff",
        "k_upper",
    ];
    spectrum.iter().all(|name| ensemble.get(*name) == point.get(*name))
}

fn pooled(table: &Table) -> Result<Vec<Coefficient>, TableError> {
    let (pooled, loads) = (table.texts("pooled")?, table.reals(LOAD.name)?);
    let real = |name: &str| table.reals(name);
    let (values, limits) = (real("mesh_coefficient")?, real("area_limit")?);
    let (lower, upper) = (real("mesh_coefficient_lower")?, real("mesh_coefficient_upper")?);
    let is_shown = |&row: &usize| {
        pooled.value(row) == "surfaces" && values.is_valid(row) && limits.is_valid(row)
    };
    let coefficient = |row: usize| Coefficient {
        point: ensembles::point(table, row),
        load: loads.value(row),
        value: values.value(row),
        interval: interval(lower, upper, row),
        area_limit: limits.value(row),
    };
    Ok((0..table.rows()).filter(is_shown).map(coefficient).collect())
}

pub const LIMITS: Definition = Definition {
    name: "limits",
    title: "Limits of large cells, fine roughness and fine meshes",
    draw: draw_limits,
};

/// Quantities that are secants of the area, for which theories are drawn.
const SECANTS: [&str; 2] = ["area_corrected / load", "area_fraction / load"];
/// Largest number of charts of the figure.
const MOST: usize = 8;

/// A fitted limit at one load.
struct Limit {
    /// Fitted quantity, followed by the correction of the area.
    of: String,
    is_secant: bool,
    /// Functional forms of the terms of the fit, such as `1 / k_lower: power 2`. Only terms whose
    /// form differs between rows are listed.
    forms: String,
    point: DataPoint,
}

fn draw_limits(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut limits = Vec::new();
    for stage in data.finished.with(&["quantity", "limit", "term_1", LOAD.name]) {
        limits.extend(fitted(&stage.table)?);
    }
    if limits.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let mut quantities: Vec<&str> = limits.iter().map(|limit| limit.of.as_str()).collect();
    let mut seen = BTreeSet::new();
    quantities.retain(|of| seen.insert(*of));
    let forms: BTreeSet<&str> = limits.iter().map(|limit| limit.forms.as_str()).collect();
    let forms: Vec<&str> = forms.into_iter().collect();
    let charts = quantities.iter().take(MOST);
    let charts = charts.map(|of| chart(of, &limits, &forms));
    let charts: Vec<Chart> = charts.collect();
    let left_out = match quantities.len().saturating_sub(MOST) {
        0 => String::new(),
        count => format!(" {count} more quantities are in the table."),
    };
    let caption = format!(
        "Fitted limits at each load, with one marker for each combination of the forms of the \
         terms. Bars are intervals from resampling whole surfaces; markers of the same load are \
         shifted sideways. A logarithmic term has no limit, so the marker shows the value at which \
         this term vanishes. The column akaike_weight shows which forms the data prefer.{left_out}",
    );
    let figure = Figure::from_charts(in_pairs(charts), [430.0, 310.0]);
    Ok(Drawn::figure(figure, caption))
}

/// Returns the limits of a table for which the fit succeeded.
fn fitted(table: &Table) -> Result<Vec<Limit>, TableError> {
    let column = |name: &str| table.reals(name);
    let (loads, value) = (column(LOAD.name)?, column("limit")?);
    let (lower, upper) = (column("limit_lower")?, column("limit_upper")?);
    let quantity = table.texts("quantity")?;
    let corrections = texts_if_any(table, CORRECTION.name)?;
    let forms = forms(table)?;
    let status = table.texts("status")?;
    let is_fitted = |&row: &usize| {
        value.is_valid(row) && loads.is_valid(row) && status.value(row) == FITTED.word
    };
    let limits = (0..table.rows()).filter(is_fitted).map(|row| {
        let correction = corrections.filter(|all| all.is_valid(row));
        let correction = correction.map(|all| format!(" · correction {}", all.value(row)));
        Limit {
            of: quantity.value(row).to_owned() + &correction.unwrap_or_default(),
            is_secant: SECANTS.contains(&quantity.value(row)),
            forms: forms[row].clone(),
            point: DataPoint {
                x: loads.value(row),
                y: value.value(row),
                bar: interval(lower, upper, row),
            },
        }
    });
    Ok(limits.collect())
}

/// Returns the text of [`Limit::forms`] for each row of a table of fits.
fn forms(table: &Table) -> Result<Vec<String>, TableError> {
    let mut texts = vec![Vec::new(); table.rows()];
    for term in (1..).take_while(|term| table.has(&format!("term_{term}"))) {
        let name = |of: &str| format!("{of}_{term}");
        let (numbers, forms) = (table.texts(&name("term"))?, table.texts(&name("form"))?);
        let word = |row: usize| {
            if forms.is_valid(row) { forms.value(row).to_owned() } else { String::new() }
        };
        let words: Vec<String> = (0..table.rows()).map(word).collect();
        if words.iter().any(|word| *word != words[0]) {
            for (row, word) in words.iter().enumerate() {
                texts[row].push(format!("{}: {word}", numbers.value(row)));
            }
        }
    }
    Ok(texts.into_iter().map(|parts| parts.join(" · ")).collect())
}

/// Returns the chart of the limit of the quantity `of` against the load, with one marker for each
/// combination of forms of the terms.
fn chart(of: &str, limits: &[Limit], forms: &[&str]) -> Chart {
    let own: Vec<&Limit> = limits.iter().filter(|limit| limit.of == of).collect();
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("limit")).titled(of);
    if own.iter().any(|limit| limit.is_secant) {
        let loads = || own.iter().map(|limit| limit.point.x);
        let least = loads().fold(f64::INFINITY, f64::min);
        let range = [0.8 * least, 1.25 * loads().fold(0.0, f64::max)];
        let theories =
            [area::persson_curve(area::SECANT, range), area::asymptote(area::SECANT, range)];
        chart.series.extend(theories);
    }
    let has = |forms: &&str| own.iter().any(|limit| limit.forms == **forms);
    let shown = forms.iter().enumerate().filter(|(_, forms)| has(forms));
    let shown: Vec<(usize, &&str)> = shown.collect();
    for (beside, (index, forms)) in shown.iter().enumerate() {
        let of_forms = own.iter().filter(|limit| limit.forms == ***forms);
        // Shift markers sideways, so bars do not overlap.
        let aside = 1.04_f64.powf(beside as f64 - (shown.len() - 1) as f64 / 2.0);
        let points = of_forms.map(|limit| DataPoint { x: aside * limit.point.x, ..limit.point });
        chart.series.push(Series {
            points: points.collect(),
            style: Style::marker(Colour::Series(*index), style::marker(*index)),
            label: (!forms.is_empty()).then(|| (**forms).to_owned()),
        });
    }
    chart
}
