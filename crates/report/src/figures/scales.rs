//! Scale-dependent slope: what `measure` stages have found and, of measured surfaces that none has looked
//! at, of the map as it is pressed (Sanner et al. 2022, doi:10.1016/j.apsadv.2021.100190).

use crate::ReportError;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, Series};
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::figure::{Definition, Drawn};
use crate::figure_data::FigureData;
use crate::measured::{FILE_IS_GONE, MeasuredMaps};
use crate::surface_curves;
use crate::surface_curves::SurfaceCurve;
use crate::units::LengthUnit;
use asperity_contact::topography::surface;
use asperity_stages::columns::{ALONG, DISTANCE, SLOPE_AT_SCALE};
use asperity_tables::table::TableError;

pub const FIGURE: Definition = Definition { name: "slope-at-scale", title: "Slope by scale", draw };

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let curves = curves(data)?;
    if curves.is_empty() {
        return Ok(match data.maps {
            MeasuredMaps::Gone => Drawn::gone(FILE_IS_GONE),
            MeasuredMaps::There(_) => {
                let lines = data.lines_of_scales();
                Drawn::missing("measured surfaces, or slopes by scale", lines)
            }
        });
    }
    let shared = LengthUnit::common(curves.iter().map(|curve| data.units.at(&curve.point)));
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
        let label = data.styles.label(&curve.point);
        let label = label.unwrap_or_else(|| "the surface".to_owned());
        let along = curve.along.as_deref().unwrap_or_default();
        let dash = match along == surface::Axis::Y.name() {
            true => Dash::Dashed,
            false => Dash::Solid,
        };
        let style = Style::line(data.styles.colour(&curve.point), dash, 1.5);
        let points = points.into_iter().map(|(x, y)| (scaled.factor * x, y));
        let series = Series::new(points, style);
        chart.series.push(series.named(format!("{label}, along {along}")));
    }
    let caption = "Slope of the straight lines between points a distance ℓ apart, root mean square \
                   over all pairs of nodes, along x and, dashed, along y. It grows towards small \
                   scales as far as the instrument resolves the roughness.";
    Ok(Drawn::figure(Figure::of(chart), caption))
}

/// Those of the study's tables, and of measured surfaces that no table tells of.
fn curves(data: &FigureData) -> Result<Vec<SurfaceCurve>, TableError> {
    let columns = [DISTANCE, SLOPE_AT_SCALE];
    let names = [ALONG.name, DISTANCE.name, SLOPE_AT_SCALE.name];
    let mut curves: Vec<SurfaceCurve> = Vec::new();
    for stage in data.finished.with(&names) {
        let known = curves.clone();
        let is_new = |curve: &SurfaceCurve| known.iter().all(|one| one.point != curve.point);
        let found = surface_curves::of(&stage.table, columns, None)?;
        curves.extend(found.into_iter().filter(is_new));
    }
    let told = curves.clone();
    for map in data.maps.there() {
        if told.iter().any(|curve| curve.is_of(&map.point)) {
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
