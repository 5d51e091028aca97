//! Mesh error of the area and its corrections, which the paper does not show.

use std::collections::BTreeSet;

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::charts::{Figure, in_pairs};
use crate::ensembles::{self, EnsembleCurves, Point};
use crate::figure_data::{FigureData, LIGHT, interval};
use crate::figures::{Definition, Drawn, sample};
use crate::loads::LOAD_LABEL;
use crate::styles::Styles;
use asperity_contact::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};
use asperity_stages::columns::{AREA_CORRECTED, K_UPPER, LOAD};
use asperity_stages::correct::AS_COUNTED;
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
