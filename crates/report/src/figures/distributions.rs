//! Distributions of contact pressures (with Persson's theory), gaps and clusters, from the counts
//! of `measure` stages. Curves are means over the surfaces of a parameter point in each bin. The
//! paper does not show these distributions.

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::ensembles::{self, Point};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn, sample};
use crate::loads::Loads;
use crate::units::digits;
use asperity_manifest::decimal;
use asperity_stages::columns::{
    CLUSTER_AREA, CLUSTER_AREA_SHARE, CLUSTER_COMPACTNESS, CLUSTER_DENSITY, CONTACT_PRESSURE, GAP,
    GAP_DENSITY, LOAD, PRESSURE_DENSITY, PRESSURE_DENSITY_PERSSON, SURFACE, WORK_OF_ADHESION,
};
use asperity_tables::column::Column;

pub const CONTACT_PRESSURES: Definition = Definition {
    name: "contact-pressures",
    title: "Distribution of contact pressures",
    draw: draw_pressures,
};

const PRESSURE_LABEL: &str = "pressure p/(E* h′)";
/// Smallest density on a logarithmic axis, relative to the largest.
const SHARE: f64 = 1e-4;

fn draw_pressures(data: &FigureData) -> Result<Drawn, ReportError> {
    let measured = repulsive(distributions(data, [CONTACT_PRESSURE, PRESSURE_DENSITY])?);
    if measured.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let theory = distributions(data, [CONTACT_PRESSURE, PRESSURE_DENSITY_PERSSON])?;
    let loads = shown_loads(&measured);
    let row = |share: f64, densities: fn(f64) -> Axis| -> Vec<Chart> {
        let charts = loads.iter().filter_map(|&load| {
            let [last, highest] = extent(&measured, load, share)?;
            let empty =
                Chart::new(Axis::linear(PRESSURE_LABEL).within(0.0, last), densities(highest));
            let mut chart = chart(data, &measured, load, &empty);
            chart.series.extend(persson(theory.first()?, load));
            Some(chart)
        });
        charts.collect()
    };
    let linear = row(0.01, |highest| Axis::linear("density").within(0.0, 1.1 * highest));
    let logarithmic =
        row(SHARE, |highest| Axis::logarithmic("density").within(SHARE * highest, 2.0 * highest));
    let counted = match measured.iter().all(Distribution::is_adhesive) {
        true => {
            "Attractive pressures are not shown, so the integral of a curve is the repulsive \
                 area fraction."
        }
        false => {
            "Only nodes in contact are counted, so the integral of a curve is the area \
                  fraction."
        }
    };
    let caption = format!(
        "Probability density of the contact pressure over the nominal area, linear and \
         logarithmic, from {}. Markers are means over the surfaces for some of the bins, bars are \
         {}; lines join all bins. {counted} Nodes at the edges of contact have pressures near \
         zero, so the density there depends on the mesh.",
        sample(&surfaces(&measured)),
        data.bars,
    );
    let figure = Figure::from_charts(vec![linear, logarithmic], [300.0, 240.0]);
    Ok(Drawn::figure(figure, caption))
}

/// Removes attractive pressures and, if a study has contacts with and without adhesion, those with
/// adhesion. All open nodes are attracted under adhesion, which gives large densities near zero.
fn repulsive(mut measured: Vec<Distribution>) -> Vec<Distribution> {
    let has_adhesion = measured.iter().all(Distribution::is_adhesive);
    measured.retain(|one| has_adhesion || !one.is_adhesive());
    for (_, points) in measured.iter_mut().flat_map(|one| &mut one.loads) {
        points.retain(|point| point.x > 0.0);
    }
    measured
}

/// Returns Persson's density at a load, averaged over each bin of `theory`. At a given reduced load
/// this density is the same for all spectra.
fn persson(theory: &Distribution, load: f64) -> Option<Series> {
    let style = Style::line(Colour::Text, Dash::Dashed, 1.6);
    let points = theory.under(load)?;
    let points = points.iter().map(|point| (point.x, point.y));
    Some(Series::new(points, style).named("Persson 2001"))
}

pub const GAPS: Definition =
    Definition { name: "gap-distribution", title: "Distribution of gaps", draw: draw_gaps };

const GAP_LABEL: &str = "gap/rms height";

fn draw_gaps(data: &FigureData) -> Result<Drawn, ReportError> {
    let measured = distributions(data, [GAP, GAP_DENSITY])?;
    if measured.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let loads = shown_loads(&measured);
    let charts = loads.iter().filter_map(|&load| {
        let [last, highest] = extent(&measured, load, SHARE)?;
        let x = Axis::linear(GAP_LABEL).within(0.0, 1.02 * last);
        let y = Axis::logarithmic("density").within(SHARE * highest, 2.0 * highest);
        let empty = Chart::new(x, y);
        Some(chart(data, &measured, load, &empty))
    });
    let charts: Vec<Chart> = charts.collect();
    let caption = format!(
        "Probability density of the gap over the nominal area, from {}. Markers are means over the \
         surfaces for some of the bins, bars are {}; lines join all bins. Only nodes out of \
         contact are counted, so the integral of a curve is the open fraction of the area.",
        sample(&surfaces(&measured)),
        data.bars,
    );
    let figure = Figure::from_charts(vec![charts], [300.0, 260.0]);
    Ok(Drawn::figure(figure, caption))
}

pub const CLUSTERS: Definition =
    Definition { name: "clusters", title: "Clusters of contact", draw: draw_clusters };

const CLUSTER_LABEL: &str = "area of a cluster/A₀";

fn draw_clusters(data: &FigureData) -> Result<Drawn, ReportError> {
    let numbers = distributions(data, [CLUSTER_AREA, CLUSTER_DENSITY])?;
    if numbers.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let loads = shown_loads(&numbers);
    let areas = numbers.iter().flat_map(|one| &one.loads);
    let areas = areas.flat_map(|(_, points)| points.iter().map(|point| point.x));
    let x = Axis::logarithmic(CLUSTER_LABEL);
    let [from, to] = x.ends(areas);
    let x = x.within(from, to);
    let row = |of: Column, y: &dyn Fn([f64; 2]) -> Axis| -> Result<Vec<Chart>, ReportError> {
        let found = distributions(data, [CLUSTER_AREA, of])?;
        let charts = loads.iter().filter_map(|&load| {
            let empty = Chart::new(x.clone(), y(range(&found, load)?));
            Some(chart(data, &found, load, &empty))
        });
        Ok(charts.collect())
    };
    let rows = vec![
        row(CLUSTER_DENSITY, &|[least, most]| {
            Axis::logarithmic("clusters per ln(area)").within(0.5 * least, 2.0 * most)
        })?,
        row(CLUSTER_AREA_SHARE, &|_| Axis::linear("covered fraction of A₀"))?,
        row(CLUSTER_COMPACTNESS, &|_| Axis::linear("4π area/perimeter²"))?,
    ];
    let caption = format!(
        "Clusters of contact nodes connected along the axes (four neighbours), against the area \
         of a cluster, from {}: their number, the fraction of the nominal area that they cover \
         together, and their compactness (1 for a disc). Markers are means over the surfaces, bars \
         are {}. The compactness is only shown for areas at which every surface has clusters.",
        sample(&surfaces(&numbers)),
        data.bars,
    );
    Ok(Drawn::figure(Figure::from_charts(rows, [300.0, 230.0]), caption))
}

/// Number of charts side by side, one for each load.
const LOADS: usize = 3;
/// Largest number of markers along a curve, approximately.
const MARKERS: usize = 24;

/// The densities of one parameter point.
struct Distribution {
    /// Parameter point, without the coordinate `bin`.
    point: Point,
    surfaces: usize,
    /// Ascending loads, each with the densities at ascending bins.
    loads: Vec<(f64, Vec<DataPoint>)>,
}

impl Distribution {
    fn is_adhesive(&self) -> bool {
        self.point.contains_key(WORK_OF_ADHESION.name)
    }

    /// Returns the densities at a load.
    fn under(&self, load: f64) -> Option<&[DataPoint]> {
        let mut loads = self.loads.iter();
        let found = loads.find(|(known, _)| decimal::is_same(*known, load));
        found.map(|(_, points)| points.as_slice())
    }

    fn add(&mut self, load: f64, point: DataPoint) {
        let mut known = self.loads.iter_mut();
        let known = known.find(|(known, _)| *known == load);
        match known {
            Some((_, points)) => points.push(point),
            None => self.loads.push((load, vec![point])),
        }
    }
}

/// Returns the distributions of a study over the column `bin`, in order of appearance.
fn distributions(
    data: &FigureData,
    [bin, density]: [Column; 2],
) -> Result<Vec<Distribution>, ReportError> {
    let mut found: Vec<Distribution> = Vec::new();
    let wanted = [SURFACE.name, LOAD.name, bin.name, density.name];
    for stage in data.finished.with(&wanted) {
        for ensemble in ensembles::from_table(&stage.table, data.bars)? {
            let mut point = ensemble.point.clone();
            let Some(x) = point.remove(bin.name).and_then(|x| x.parse().ok()) else {
                continue;
            };
            let index = found.iter().position(|known| known.point == point);
            let index = index.unwrap_or_else(|| {
                found.push(Distribution { point, surfaces: ensemble.surfaces, loads: Vec::new() });
                found.len() - 1
            });
            for mean in ensemble.mean(density.name)? {
                let (y, bar) = (mean.mean, mean.bar());
                found[index].add(mean.load, DataPoint { x, y, bar });
            }
        }
    }
    for distribution in &mut found {
        let loads = &mut distribution.loads;
        loads.sort_by(|one, other| one.0.total_cmp(&other.0));
        for (_, points) in loads {
            points.sort_by(|one, other| one.x.total_cmp(&other.x));
        }
    }
    Ok(found)
}

/// Returns the lightest, the middle and the heaviest load of these distributions.
fn shown_loads(distributions: &[Distribution]) -> Vec<f64> {
    let loads = distributions.iter().flat_map(|one| &one.loads);
    let mut loads: Vec<f64> = loads.map(|(load, _)| *load).collect();
    loads.sort_by(f64::total_cmp);
    loads.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    match loads.len() {
        0..=LOADS => loads,
        count => [0, count / 2, count - 1].map(|index| loads[index]).into(),
    }
}

/// Returns the number of surfaces of each distribution.
fn surfaces(distributions: &[Distribution]) -> Vec<usize> {
    distributions.iter().map(|one| one.surfaces).collect()
}

/// Adds the distributions at one load to a copy of the chart `empty`: for each distribution a line
/// through all bins, and markers with error bars at some of them.
fn chart(data: &FigureData, distributions: &[Distribution], load: f64, empty: &Chart) -> Chart {
    let title = match &data.loads {
        Loads::Reduced => format!("load {}", digits(load, 4)),
        pressures => format!("load {}", pressures.text_of_reduced(load)),
    };
    let mut chart = empty.clone().titled(title);
    for distribution in distributions {
        let Some(points) = distribution.under(load) else {
            continue;
        };
        let styles = &data.styles;
        let line = styles.joins(&distribution.point);
        // Interrupt lines at empty bins, which a logarithmic axis cannot show.
        for run in points.split(|point| !chart.y.can_show(point.y)) {
            let all = run.iter().map(|point| (point.x, point.y));
            chart.series.push(Series::new(all, line));
        }
        let markers = select_markers(points, &chart);
        chart.series.push(Series {
            points: markers,
            style: styles.markers(&distribution.point),
            label: Some(data.styles.name(&distribution.point, "mean of the surfaces")),
        });
    }
    chart
}

/// Selects about [`MARKERS`] points, evenly spaced along the x axis of the chart. Selects all
/// points if there are at most twice as many.
fn select_markers(points: &[DataPoint], chart: &Chart) -> Vec<DataPoint> {
    if points.len() <= 2 * MARKERS {
        return points.to_vec();
    }
    let along = |x: f64| match chart.x.spacing {
        Spacing::Linear => x,
        Spacing::Logarithmic | Spacing::Octaves => x.ln(),
    };
    let [from, to] = chart.x.ends(points.iter().map(|point| point.x));
    let step = (along(to) - along(from)) / MARKERS as f64;
    let mut next = f64::NEG_INFINITY;
    let apart = points.iter().filter(|point| {
        let position = along(point.x);
        let is_apart = position >= next;
        if is_apart {
            next = position + step;
        }
        is_apart
    });
    apart.copied().collect()
}

/// Returns [x, ρ], where ρ is the largest density of all distributions at the load and x is the
/// middle of the last bin in which a density exceeds `share` × ρ.
fn extent(distributions: &[Distribution], load: f64, share: f64) -> Option<[f64; 2]> {
    let [_, highest] = range(distributions, load)?;
    let under = distributions.iter().filter_map(|one| one.under(load));
    let seen = under.flatten().filter(|point| point.y > share * highest);
    let last = seen.fold(0.0_f64, |most, point| most.max(point.x));
    Some([last, highest])
}

/// Returns the smallest and the largest positive density at a load.
fn range(distributions: &[Distribution], load: f64) -> Option<[f64; 2]> {
    let under = distributions.iter().filter_map(|one| one.under(load));
    let densities = under.flatten().map(|point| point.y).filter(|&y| y > 0.0);
    let [least, most] =
        densities.fold([f64::INFINITY, 0.0], |[least, most], y| [y.min(least), y.max(most)]);
    (most > 0.0).then_some([least, most])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution(loads: &[f64]) -> Distribution {
        let point = |x: f64| DataPoint { x, y: (-x).exp(), bar: None };
        let points = || (0..100).map(|bin| point(0.1 * f64::from(bin) + 0.05));
        Distribution {
            point: Point::new(),
            surfaces: 3,
            loads: loads.iter().map(|&load| (load, points().collect())).collect(),
        }
    }

    #[test]
    fn pressures_with_adhesion_are_drawn_where_they_are_repulsive_and_alone() {
        let adhesive = || {
            let mut one = distribution(&[0.1]);
            one.point.insert(WORK_OF_ADHESION.name.to_owned(), "0.05".to_owned());
            one.add(0.1, DataPoint { x: -0.05, y: 40.0, bar: None });
            one
        };
        let alone = repulsive(vec![adhesive()]);
        assert!(alone[0].under(0.1).unwrap().iter().all(|point| point.x > 0.0));
        let with_others = repulsive(vec![adhesive(), distribution(&[0.1])]);
        assert_eq!(with_others.len(), 1);
        assert!(!with_others[0].is_adhesive());
    }

    #[test]
    fn of_many_loads_the_ends_and_the_middle_are_shown() {
        assert_eq!(shown_loads(&[distribution(&[0.1, 0.2])]), [0.1, 0.2]);
        let many = [distribution(&[0.1, 0.2, 0.3, 0.4]), distribution(&[0.1, 0.8])];
        assert_eq!(shown_loads(&many), [0.1, 0.3, 0.8]);
        assert!(shown_loads(&[]).is_empty());
    }

    #[test]
    fn an_axis_ends_where_a_density_has_fallen_to_its_share() {
        let [last, highest] = extent(&[distribution(&[0.1])], 0.1, 1e-3).unwrap();
        assert_eq!(highest, (-0.05f64).exp());
        assert!((last - 6.95).abs() < 0.11, "{last}: e⁻⁷ is a thousandth");
        let [least, most] = range(&[distribution(&[0.1])], 0.1).unwrap();
        assert_eq!(most, highest);
        assert!((least * 9.95f64.exp() - 1.0).abs() < 1e-12, "{least}");
        assert!(extent(&[distribution(&[0.1])], 0.2, 1e-3).is_none());
    }
}
