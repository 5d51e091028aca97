//! Load, mean gap and areas along paths with adhesion, on the approach and on the separation. The
//! paper does not show these quantities.
//!
//! A load can occur several times along a path. Curves therefore follow the states in the order of
//! the path, and not in the order of their loads.

use std::collections::BTreeMap;

use arrow::array::{Array, Float64Array};

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::axis::Axis;
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{self, Colour, Dash, Line, Style};
use crate::ensembles::{self, Point, ends, mean_and_half_bar};
use crate::figure_data::{FigureData, lengths};
use crate::figures::{Definition, Drawn, sample};
use crate::finished::FinishedStage;
use crate::loads::LOAD_LABEL;
use crate::styles::Styles;
use crate::units::{LengthUnit, Scaled};
use asperity_stages::Kind;
use asperity_stages::columns::{
    BRANCH, CONTACT_FRACTION, LOAD, MEAN_GAP, PULL_OFF_LOAD, REPULSIVE_FRACTION, STEP, SURFACE,
};
use asperity_tables::table::{Table, TableError};

/// Largest number of surfaces of which each has a curve of its own, instead of their mean.
const FEW: usize = 3;

/// Path of the surfaces of one parameter point.
pub struct EnsemblePath<'a> {
    table: &'a Table,
    /// Parameters of all states.
    pub point: Point,
    pub surfaces: usize,
    /// States in the order of the path.
    states: Vec<State>,
}

/// A state with its table row for each surface, in the order of the surfaces.
struct State {
    branch: String,
    rows: Vec<usize>,
}

/// Returns the paths of all `solve` stages with adhesion, in the order of the stages.
pub fn paths<'a>(data: &'a FigureData) -> Result<Vec<EnsemblePath<'a>>, TableError> {
    let mut paths = Vec::new();
    for FinishedStage { kind, table, .. } in &data.finished.stages {
        if *kind == Kind::Solve && table.has(STEP.name) {
            paths.extend(paths_of(table)?);
        }
    }
    Ok(paths)
}

fn paths_of(table: &Table) -> Result<Vec<EnsemblePath<'_>>, TableError> {
    let (steps, branches) = (table.integers(STEP.name)?, table.texts(BRANCH.name)?);
    let names = table.texts(SURFACE.name)?;
    let mut points: Vec<(Point, BTreeMap<i64, State>, Vec<&str>)> = Vec::new();
    for row in 0..table.rows() {
        let mut point = ensembles::point(table, row);
        point.remove(BRANCH.name);
        let known = points.iter().position(|(known, ..)| *known == point);
        let index = known.unwrap_or_else(|| {
            points.push((point, BTreeMap::new(), Vec::new()));
            points.len() - 1
        });
        let (_, states, surfaces) = &mut points[index];
        let state = states.entry(steps.value(row));
        let branch = || branches.value(row).to_owned();
        state.or_insert_with(|| State { branch: branch(), rows: Vec::new() }).rows.push(row);
        if !surfaces.contains(&names.value(row)) {
            surfaces.push(names.value(row));
        }
    }
    Ok(points
        .into_iter()
        .map(|(point, states, surfaces)| EnsemblePath {
            table,
            point,
            surfaces: surfaces.len(),
            states: states.into_values().collect(),
        })
        .collect())
}

/// Part of a curve between two turns of a path.
struct Stretch {
    separates: bool,
    points: Vec<DataPoint>,
}

impl EnsemblePath<'_> {
    /// Returns the curves of y against x: one of the means over the surfaces or, for few surfaces,
    /// one for each. States that a surface does not have, or in which the surfaces are apart, are
    /// left out.
    fn curves(
        &self,
        data: &FigureData,
        [x, y]: [&dyn Fn(usize) -> Option<f64>; 2],
    ) -> Vec<Vec<Stretch>> {
        if self.surfaces <= FEW {
            let of_surface = |surface: usize| {
                self.stretches(|state| {
                    let row = *state.rows.get(surface)?;
                    Some(DataPoint { x: x(row)?, y: y(row)?, bar: None })
                })
            };
            return (0..self.surfaces).map(of_surface).collect();
        }
        vec![self.stretches(|state| {
            if state.rows.len() < self.surfaces {
                return None;
            }
            let all = |of: &dyn Fn(usize) -> Option<f64>| -> Option<Vec<f64>> {
                state.rows.iter().map(|&row| of(row)).collect()
            };
            let (x, _) = mean_and_half_bar(&all(x)?, data.bars);
            let (y, half) = mean_and_half_bar(&all(y)?, data.bars);
            // A prescribed quantity has no scatter.
            Some(DataPoint { x, y, bar: ends(y, half.filter(|half| *half > 0.0)) })
        })]
    }

    /// Splits the points of the states where the path turns. Each stretch begins with the last
    /// point of the one before, so that the curve has no gap.
    fn stretches(&self, point: impl Fn(&State) -> Option<DataPoint>) -> Vec<Stretch> {
        let mut stretches: Vec<Stretch> = Vec::new();
        for state in &self.states {
            let Some(point) = point(state) else { continue };
            let separates = state.branch.starts_with("separation");
            match stretches.last_mut() {
                Some(last) if last.separates == separates => last.points.push(point),
                before => {
                    let turn = before.and_then(|before| before.points.last().copied());
                    let turn = turn.map(|turn| DataPoint { bar: None, ..turn });
                    let points = turn.into_iter().chain([point]).collect();
                    stretches.push(Stretch { separates, points });
                }
            }
        }
        stretches
    }

    /// Returns the values of a column in all rows that have one.
    fn known(&self, column: &str) -> Result<Vec<f64>, TableError> {
        let values = self.table.reals(column)?;
        let rows = self.states.iter().flat_map(|state| &state.rows);
        Ok(rows.filter_map(|&row| value(values, row)).collect())
    }
}

fn value(column: &Float64Array, row: usize) -> Option<f64> {
    column.is_valid(row).then(|| column.value(row))
}

/// Colours, dashes and labels of the curves of several paths.
struct Looks {
    styles: Styles,
    is_single: bool,
}

impl Looks {
    fn new(data: &FigureData, paths: &[EnsemblePath]) -> Looks {
        let points: Vec<Point> = paths.iter().map(|path| path.point.clone()).collect();
        let lengths = lengths(data.finished, &data.units, &points);
        let styles = Styles::new(&points, &data.files).with_lengths(lengths);
        Looks { styles, is_single: paths.len() == 1 }
    }

    /// Returns the style of a stretch. The branches of a single path have different colours, those
    /// of several paths only different lines. The approach is wider, so that it is seen below a
    /// separation with the same states.
    fn style(&self, path: &EnsemblePath, separates: bool) -> Style {
        let branch = usize::from(separates);
        let line = [(Dash::Solid, 2.6), (Dash::Dashed, 1.4)][branch];
        let line = Line { dash: line.0, width: line.1 };
        let markers = if self.is_single {
            Style::marker(Colour::Series(branch), style::marker(branch))
        } else {
            self.styles.markers(&path.point)
        };
        Style { line: Some(line), ..markers }
    }

    /// Adds the curves of a path to a chart.
    fn add(&self, chart: &mut Chart, path: &EnsemblePath, curves: Vec<Vec<Stretch>>) {
        for Stretch { separates, points } in curves.into_iter().flatten() {
            let label = match (self.is_single, separates) {
                (true, false) => Some("approach".to_owned()),
                (true, true) => Some("separation".to_owned()),
                (false, false) => Some(self.styles.name(&path.point, "the surfaces")),
                (false, true) => None,
            };
            chart.series.push(Series { points, style: self.style(path, separates), label });
        }
    }

    /// Adds the entries of the legend that explain the lines of several paths.
    fn explain(&self, chart: &mut Chart) {
        let entries = [("approach", Dash::Solid), ("separation", Dash::Dashed)];
        let entries = entries.map(|(label, dash)| {
            Series::new([], Style::line(Colour::Text, dash, 1.4)).named(label)
        });
        chart.series.extend(entries.into_iter().filter(|_| !self.is_single));
    }
}

/// Describes what the curves show: means with bars, or single surfaces.
fn meaning(data: &FigureData, paths: &[EnsemblePath]) -> String {
    let counts: Vec<usize> = paths.iter().map(|path| path.surfaces).collect();
    let are_few = |count: &usize| *count <= FEW;
    let (from, bars) = (sample(&counts), data.bars);
    let shown = match (counts.iter().all(are_few), counts.iter().any(are_few)) {
        (true, _) if counts.iter().all(|count| *count == 1) => String::new(),
        (true, _) => " Each surface has its own curve.".to_owned(),
        (false, false) => format!(" Points are means over the surfaces, bars are {bars}."),
        (false, true) => format!(
            " Points are means over the surfaces, bars are {bars}; up to {FEW} surfaces have their \
             own curves."
        ),
    };
    format!("from {from}. Curves follow the states in the order of the path.{shown}")
}

pub const LOOP: Definition = Definition {
    name: "adhesion-path",
    title: "Load and mean gap along the path",
    draw: draw_loop,
};

fn draw_loop(data: &FigureData) -> Result<Drawn, ReportError> {
    let paths = paths(data)?;
    if paths.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let looks = Looks::new(data, &paths);
    let lengths = LengthUnit::common(paths.iter().map(|path| data.units.at(&path.point)));
    let mut largest = 0.0_f64;
    for path in &paths {
        let factor = lengths.factor(data.units.at(&path.point));
        largest =
            path.known(MEAN_GAP.name)?.iter().fold(largest, |most, gap| most.max(factor * gap));
    }
    let Scaled { factor: scale, unit } = lengths.scaled(largest);
    let x = Axis::linear(format!("mean gap, in {unit}"));
    let mut chart = Chart::new(x, Axis::linear(LOAD_LABEL));
    let mut pulled = Vec::new();
    for path in &paths {
        let (gaps, loads) = (path.table.reals(MEAN_GAP.name)?, path.table.reals(LOAD.name)?);
        let factor = scale * lengths.factor(data.units.at(&path.point));
        let gap = |row| Some(factor * value(gaps, row)?);
        let load = |row| value(loads, row);
        looks.add(&mut chart, path, path.curves(data, [&gap, &load]));
        pulled.push(path.known(PULL_OFF_LOAD.name)?);
    }
    looks.explain(&mut chart);
    let xs = chart.series.iter().flat_map(|series| &series.points).map(|point| point.x);
    let range = chart.x.ends(xs.collect::<Vec<_>>().into_iter());
    for (path, loads) in paths.iter().zip(&pulled).filter(|(_, loads)| !loads.is_empty()) {
        let (load, _) = mean_and_half_bar(loads, data.bars);
        let colour = match looks.is_single {
            true => Colour::Text,
            false => looks.styles.colour(&path.point),
        };
        let line =
            Series::new(range.map(|gap| (gap, load)), Style::line(colour, Dash::Dotted, 1.4));
        chart.series.push(if looks.is_single { line.named("pull-off") } else { line });
    }
    if !looks.is_single && pulled.iter().any(|loads| !loads.is_empty()) {
        let entry = Style::line(Colour::Text, Dash::Dotted, 1.4);
        chart.series.push(Series::new([], entry).named("pull-off"));
    }
    chart.x = chart.x.within(range[0], range[1]);
    let note = pull_off_note(data, &pulled.concat());
    let caption = format!(
        "Mean pressure against the mean gap, {} Tension is negative. Where the separation does not \
         follow the approach, energy is lost.{note}",
        meaning(data, &paths),
    );
    Ok(Drawn::figure(Figure::from_chart(chart), caption))
}

/// Returns a sentence on the loads at which surfaces pulled off, or an empty text.
fn pull_off_note(data: &FigureData, loads: &[f64]) -> String {
    let [Some(least), Some(most)] =
        [f64::min, f64::max].map(|end| loads.iter().copied().reduce(end))
    else {
        return String::new();
    };
    let [least, most] = [least, most].map(|load| data.loads.text_of_reduced(load));
    let range = if least == most { least } else { format!("{least} to {most}") };
    if loads.len() == 1 {
        return format!(" The dotted line is the load of pull-off, {range}.");
    }
    format!(
        " Dotted lines are mean loads of pull-off; the {} paths that pulled off have {range}.",
        loads.len()
    )
}

pub const AREAS: Definition = Definition {
    name: "adhesion-areas",
    title: "Nodes in contact and repulsive nodes along the path",
    draw: draw_areas,
};

fn draw_areas(data: &FigureData) -> Result<Drawn, ReportError> {
    let paths = paths(data)?;
    if paths.is_empty() {
        return Ok(Drawn::NotAsked);
    }
    let looks = Looks::new(data, &paths);
    let chart = |column: &str, label: &str| -> Result<Chart, TableError> {
        let mut chart = Chart::new(Axis::linear(LOAD_LABEL), Axis::linear(label));
        for path in &paths {
            let of = |name: &str| path.table.reals(name);
            let (gaps, loads, areas) = (of(MEAN_GAP.name)?, of(LOAD.name)?, of(column)?);
            // After pull-off the surfaces have no mean gap.
            let load = |row| value(gaps, row).and_then(|_| value(loads, row));
            let area = |row| value(areas, row);
            looks.add(&mut chart, path, path.curves(data, [&load, &area]));
        }
        looks.explain(&mut chart);
        Ok(chart)
    };
    let contact = chart(CONTACT_FRACTION.name, "contact fraction (gap zero)")?;
    let repulsive = chart(REPULSIVE_FRACTION.name, "repulsive fraction (pressure > 0)")?;
    let caption = format!(
        "Fraction of the nodes in contact (left) and of the nodes with positive pressure (right) \
         against load, as counted on the mesh, {} Nodes in contact that are not repulsive are \
         pulled.",
        meaning(data, &paths),
    );
    Ok(Drawn::figure(Figure::side_by_side(contact, repulsive), caption))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_tables::column::{integers, optional_reals, reals, texts};

    /// Returns the table of a path there and back of two surfaces, which pulls off in the last
    /// state. The rows of the second surface come first.
    fn table() -> Table {
        let surfaces = ["b", "a"].map(|surface| [surface; 4]).concat();
        let both = |values: [f64; 4]| [values, values].concat();
        let gaps = [Some(0.3), Some(0.2), Some(0.4), None];
        Table::new(
            8,
            vec![
                (SURFACE, texts(surfaces)),
                (BRANCH, texts([["approach"; 2], ["separation"; 2]].concat().repeat(2))),
                (STEP, integers([1, 2, 3, 4, 1, 2, 3, 4])),
                (LOAD, reals(both([0.0, 0.1, -0.1, -0.5]))),
                (MEAN_GAP, optional_reals([gaps, gaps].concat())),
            ],
        )
    }

    #[test]
    fn a_curve_follows_the_path_and_its_branches_meet_where_it_turns() {
        let table = table();
        let paths = paths_of(&table).unwrap();
        let [path] = paths.as_slice() else { panic!("{} paths", paths.len()) };
        assert_eq!((path.surfaces, path.states.len()), (2, 4));
        assert!(!path.point.contains_key(BRANCH.name));
        let (gaps, loads) = (table.reals("mean_gap").unwrap(), table.reals("load").unwrap());
        let stretches = path.stretches(|state| {
            let row = state.rows[0];
            Some(DataPoint { x: value(gaps, row)?, y: value(loads, row)?, bar: None })
        });
        let drawn: Vec<(bool, Vec<(f64, f64)>)> = stretches
            .iter()
            .map(|one| (one.separates, one.points.iter().map(|at| (at.x, at.y)).collect()))
            .collect();
        let expected = [
            (false, vec![(0.3, 0.0), (0.2, 0.1)]),
            // The state after pull-off has no mean gap.
            (true, vec![(0.2, 0.1), (0.4, -0.1)]),
        ];
        assert_eq!(drawn, expected);
    }
}
