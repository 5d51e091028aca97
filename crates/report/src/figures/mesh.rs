//! What the mesh adds to the area, and which correction takes it off again; beyond the paper.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::colour::Colour;
use crate::charts::figure::{Figure, in_pairs};
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::{EnsembleCurves, Point};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{FigureData, LIGHT, LOAD_LABEL};
use crate::styles::Styles;
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_stages::columns::{AREA_CORRECTED, K_UPPER, LOAD};
use asperity_stages::correct::AS_COUNTED;
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition =
    Definition { name: "mesh-convergence", title: "Convergence with the mesh", draw };

/// The coefficient of one parameter point under one load, pooled over surfaces.
struct Coefficient {
    point: Point,
    load: f64,
    value: f64,
    interval: Option<[f64; 2]>,
    area_limit: f64,
}

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut coefficients = Vec::new();
    for stage in data.finished.with(&["mesh_coefficient", "pooled", "area_limit", LOAD.name]) {
        coefficients.extend(pooled(&stage.table)?);
    }
    if coefficients.is_empty() {
        let lines = data.lines_of_meshes();
        return Ok(Drawn::missing("the same surfaces on at least two meshes", lines));
    }
    let points = coefficients.iter().map(|coefficient| &coefficient.point);
    let styles = Styles::of(points, &data.files);
    let mut charts = vec![coefficient_chart(&coefficients, &styles)];
    let names = [AS_COUNTED].into_iter().chain(data.corrections());
    for name in names.take(3) {
        let ensembles: Vec<&EnsembleCurves> = data.under(name).collect();
        if !ensembles.is_empty() {
            charts.push(error_chart(name, &ensembles, &coefficients, &styles)?);
        }
    }
    let caption = format!(
        "Coefficient c of A_N = A* + c S_d Δx for each load, over all meshes and surfaces, with \
         bootstrap intervals; and the deviation of the area from A* on each mesh under the load \
         nearest to {LIGHT}, as counted and corrected. S_d is the Manhattan perimeter, Δx the mesh \
         step; from {}.",
        sample(&data.sample()),
    );
    Ok(Drawn::figure(Figure::of_charts(in_pairs(charts), [430.0, 310.0]), caption))
}

fn coefficient_chart(coefficients: &[Coefficient], styles: &Styles) -> Chart {
    let mut chart =
        Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear("coefficient c").within(0.0, 0.45));
    chart.title = "what the mesh adds".to_owned();
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
        let place =
            DataPoint { x: coefficient.load, y: coefficient.value, bar: coefficient.interval };
        chart.series.push(Series {
            points: vec![place],
            style: styles.markers(&coefficient.point),
            label: Some(
                styles.label(&coefficient.point).unwrap_or_else(|| "the surfaces".to_owned()),
            ),
        });
    }
    chart
}

/// Deviation from A* against the nodes of the shortest wave.
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
    let mut chart = Chart::new(
        Axis::logarithmic("nodes per shortest wavelength"),
        Axis::linear("area over A* − 1, %"),
    );
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

/// The coefficients under the load nearest to the heaviest light one.
fn at_light_load(coefficients: &[Coefficient]) -> impl Iterator<Item = &Coefficient> {
    let distance = |load: f64| (load / LIGHT).ln().abs();
    let nearest = coefficients
        .iter()
        .map(|one| one.load)
        .min_by(|one, other| distance(*one).total_cmp(&distance(*other)));
    coefficients.iter().filter(move |one| Some(one.load) == nearest)
}

/// Whether an ensemble belongs to a point in which meshes are not told apart.
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
    let coefficient = |row: usize| {
        let known = lower.is_valid(row) && upper.is_valid(row);
        Coefficient {
            point: ensembles::point(table, row),
            load: loads.value(row),
            value: values.value(row),
            interval: known.then(|| [lower.value(row), upper.value(row)]),
            area_limit: limits.value(row),
        }
    };
    Ok((0..table.rows()).filter(is_shown).map(coefficient).collect())
}
