//! Densities of pressures, gaps and clusters under a load, as `measure` counts them: bin by bin the
//! mean over the surfaces of a parameter point.

use super::ReportError;
use super::ensembles::{self, Point};
use super::figure_data::FigureData;
use super::units::digits;
use crate::charts::axis::Spacing;
use crate::charts::chart::{Chart, DataPoint, Series};
use asperity_manifest::decimal;
use asperity_stages::columns::{LOAD, SURFACE};
use asperity_tables::column::Column;

/// Loads that stand side by side.
const LOADS: usize = 3;
/// Markers along a curve.
const MARKERS: usize = 24;

/// The densities of one parameter point.
pub struct Distribution {
    /// Where its surfaces stand, without the bin.
    pub point: Point,
    /// How many they are.
    pub surfaces: usize,
    /// Ascending loads, each with its density at ascending bins.
    pub loads: Vec<(f64, Vec<DataPoint>)>,
}

impl Distribution {
    /// Its density under a load.
    pub fn under(&self, load: f64) -> Option<&[DataPoint]> {
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

/// The distributions of a study over a bin's coordinate, in order of appearance.
///
/// # Errors
/// When a table that has both columns has no numbers in them.
pub fn of(
    data: &FigureData,
    [bin, density]: [Column; 2],
) -> Result<Vec<Distribution>, ReportError> {
    let mut found: Vec<Distribution> = Vec::new();
    let wanted = [SURFACE.name, LOAD.name, bin.name, density.name];
    for stage in data.finished.with(&wanted) {
        for ensemble in ensembles::of(&stage.table, data.bars)? {
            let mut point = ensemble.point.clone();
            let Some(x) = point.remove(bin.name).and_then(|x| x.parse().ok()) else {
                continue;
            };
            let place = found.iter().position(|known| known.point == point);
            let place = place.unwrap_or_else(|| {
                found.push(Distribution { point, surfaces: ensemble.surfaces, loads: Vec::new() });
                found.len() - 1
            });
            for mean in ensemble.mean(density.name)? {
                let (y, bar) = (mean.mean, mean.bar());
                found[place].add(mean.load, DataPoint { x, y, bar });
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

/// The lightest, the middle and the heaviest of the loads of these distributions.
pub fn shown_loads(distributions: &[Distribution]) -> Vec<f64> {
    let loads = distributions.iter().flat_map(|one| &one.loads);
    let mut loads: Vec<f64> = loads.map(|(load, _)| *load).collect();
    loads.sort_by(f64::total_cmp);
    loads.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    match loads.len() {
        0..=LOADS => loads,
        count => [0, count / 2, count - 1].map(|place| loads[place]).into(),
    }
}

/// How many surfaces each of them is of.
pub fn surfaces(distributions: &[Distribution]) -> Vec<usize> {
    distributions.iter().map(|one| one.surfaces).collect()
}

/// The distributions under one load: a line through all bins of each, markers with bars at some.
pub fn chart(data: &FigureData, distributions: &[Distribution], load: f64, empty: &Chart) -> Chart {
    let mut chart = empty.clone().titled(format!("load {}", digits(load, 4)));
    for distribution in distributions {
        let Some(points) = distribution.under(load) else {
            continue;
        };
        let [line, markers] = data.styles.both(&distribution.point);
        // No line crosses bins that have nothing in them, where an axis of logarithms has no place for it.
        for run in points.split(|point| !chart.y.can_show(point.y)) {
            let all = run.iter().map(|point| (point.x, point.y));
            chart.series.push(Series::new(all, line));
        }
        let some = some(points, &chart);
        let label = data.styles.label(&distribution.point);
        chart.series.push(Series {
            points: some,
            style: markers,
            label: Some(label.unwrap_or_else(|| "mean of the surfaces".to_owned())),
        });
    }
    chart
}

/// Some of the points, evenly along the axis as it is shown; all, where they are few.
fn some(points: &[DataPoint], chart: &Chart) -> Vec<DataPoint> {
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
        let place = along(point.x);
        let is_apart = place >= next;
        if is_apart {
            next = place + step;
        }
        is_apart
    });
    apart.copied().collect()
}

/// The largest density of any under a load, and the last bin where one exceeds a share of it: what an
/// axis has to show.
pub fn extent(distributions: &[Distribution], load: f64, share: f64) -> Option<[f64; 2]> {
    let [_, highest] = range(distributions, load)?;
    let under = distributions.iter().filter_map(|one| one.under(load));
    let seen = under.flatten().filter(|point| point.y > share * highest);
    let last = seen.fold(0.0_f64, |most, point| most.max(point.x));
    Some([last, highest])
}

/// The least and the largest of the densities under a load that are not zero.
pub fn range(distributions: &[Distribution], load: f64) -> Option<[f64; 2]> {
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
