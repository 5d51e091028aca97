//! Points of a declared or automatic figure: rows of a table, or means over the rows of the
//! surfaces, with their error bars.
//!
//! The coordinates of the table decide which rows are one point. Rows that agree in every parameter
//! and load are the surfaces of one point. Points belong to one series if they agree in all
//! coordinates that x does not determine: a series with two points at one x would mix parameter
//! points.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use arrow::array::Array;
use arrow::datatypes::{DataType, Schema};
use arrow::util::display::array_value_to_string;

use asperity_manifest::expression::Expression;
use asperity_pipeline::study::figures::{
    BarSource, ErrorBars, FigureSpec, PanelSpec, Quantity, Value as Selected, has_surfaces,
};
use asperity_stages::columns::{LOAD, MEAN_GAP, PRESSURE, STEP, STOP, SURFACE};
use asperity_stages::ensemble::{self, grouped};
use asperity_stages::solve::is_unconverged;
use asperity_statistics::intervals::two_sided_quantile;
use asperity_tables::column::{Column, ColumnKind, Role, Value, optional_reals};
use asperity_tables::table::{Table, TableError};

use crate::points::{distinct, rank};

/// Level of the intervals of means.
const LEVEL: f64 = 0.95;

/// Points of one quantity.
#[derive(Debug)]
pub struct Points {
    pub points: Vec<Point>,
    /// Column of the colours: that of the figure, or the first column in which points with the same
    /// x differ.
    pub colour: Option<String>,
    /// Further columns in which points with the same x differ.
    pub others: Vec<String>,
    /// True if points of a series may be joined by a line.
    pub is_curve: bool,
    /// True if the points are states along a path.
    pub is_path: bool,
    /// Number of rows whose load did not converge.
    pub unconverged: usize,
    /// Table of the rows, in which `Point::row` is an index.
    pub table: Table,
}

#[derive(Debug, Clone, Default)]
pub struct Point {
    pub x: f64,
    pub y: f64,
    pub bar: Option<[f64; 2]>,
    /// Number of surfaces, if known.
    pub surfaces: Option<usize>,
    /// Values of the columns of panels.
    pub facet: Vec<Option<Value>>,
    pub colour: Option<Value>,
    pub dash: Option<Value>,
    pub others: Vec<Option<Value>>,
    /// Index of the first table row of the point.
    pub row: usize,
    /// Number by which the points of a series are sorted: x or, along a path, the state.
    pub order: f64,
}

impl Points {
    /// Collects the points of a quantity of a panel from the table of its stage.
    pub fn from_table(
        table: &Table,
        figure: &FigureSpec,
        panel: &PanelSpec,
        quantity: &Quantity,
    ) -> Result<Points, TableError> {
        let of_surfaces = has_surfaces(table);
        let table = in_states(table);
        let table = if of_surfaces { ensemble::without_repeated_rows(&table)? } else { table };
        let is_shown = |&row: &usize| {
            [&figure.selection, &panel.selection]
                .iter()
                .all(|selection| is_selected(&table, row, selection))
        };
        let selected: Vec<usize> = (0..table.rows()).filter(is_shown).collect();
        let mut table = with_values(&table.pick(&selected), &panel.x)?;
        if !of_surfaces {
            table = with_values(&table, &quantity.column)?;
        }
        let keys = Keys::new(&table, figure, &panel.x);
        let curves = if of_surfaces {
            complete(&table, &keys)
        } else {
            vec![(0..table.rows()).map(|row| vec![row]).collect()]
        };
        let expression = quantity.expression.as_ref().filter(|_| of_surfaces);
        let mut points = Vec::new();
        if let Some(expression) = expression {
            for curve in curves {
                points.extend(points_of_expression(&table, panel, (quantity, expression), curve)?);
            }
        } else {
            let numbers = Numbers::new(&table, panel, quantity)?;
            for rows in curves.into_iter().flatten() {
                points.extend(numbers.point(&rows).map(|point| (point, rows[0])));
            }
        }
        let mut others = keys.split(&table, points.iter().map(|(_, row)| *row).collect());
        let colour = match &figure.colour {
            Some(declared) => Some(declared.clone()),
            None => (!others.is_empty()).then(|| others.remove(0)),
        };
        let cell = |name: &str, row: usize| {
            let column = table.batch().column_by_name(name)?;
            value(column.as_ref(), row)
        };
        let steps = table.optional(STEP.name, Table::integers)?;
        let coloured = points.into_iter().map(|(mut point, row)| {
            point.order = steps.map_or(point.x, |steps| steps.value(row) as f64);
            point.facet = figure.facet.iter().map(|name| cell(name, row)).collect();
            point.dash = figure.dash.as_deref().and_then(|name| cell(name, row));
            point.colour = colour.as_deref().and_then(|name| cell(name, row));
            point.others = others.iter().map(|name| cell(name, row)).collect();
            point
        });
        Ok(Points {
            points: coloured.collect(),
            colour,
            is_curve: (keys.has_x || keys.path.is_some()) && !figure.is_apart,
            is_path: steps.is_some(),
            unconverged: unconverged(&table),
            others,
            table,
        })
    }
}

/// Returns a table of states along a path with the role of loads for their numbers, because a path
/// can reach a load or a mean gap several times.
fn in_states(table: &Table) -> Table {
    if !table.has(STEP.name) {
        return table.clone();
    }
    let roles = [
        (STEP, Role::Load),
        (LOAD, Role::Result),
        (PRESSURE, Role::Result),
        (MEAN_GAP, Role::Result),
    ];
    let columns = roles.into_iter().filter_map(|(column, role)| {
        Some((column.with_role(role), table.batch().column_by_name(column.name)?.clone()))
    });
    table.without(&roles.map(|(column, _)| column.name)).with(columns.collect())
}

/// Returns the value of a cell; flags become texts.
fn value(column: &dyn Array, row: usize) -> Option<Value> {
    Value::from_array(column, row).or_else(|| {
        let is_flag = column.data_type() == &DataType::Boolean && column.is_valid(row);
        is_flag.then(|| Value::Text(array_value_to_string(column, row).unwrap_or_default()))
    })
}

/// Adds the values of an expression to a table that has no column of its name. They are a parameter
/// if they follow from parameters.
fn with_values(table: &Table, name: &str) -> Result<Table, TableError> {
    let Some(expression) = Expression::parse(name).ok().filter(|_| !table.has(name)) else {
        return Ok(table.clone());
    };
    let parameters = table.in_role(Role::Parameter);
    let is_parameter = expression.columns().iter().all(|name| parameters.has(name));
    let role = if is_parameter { Role::Parameter } else { Role::Result };
    let mut columns = BTreeMap::new();
    for column in expression.columns() {
        columns.insert(column, reals(table, column)?);
    }
    let value = |row: usize| {
        let value = expression.value(&|column: &str| columns[column][row].unwrap_or(f64::NAN));
        value.is_finite().then_some(value)
    };
    let values = optional_reals((0..table.rows()).map(value));
    let column = Column::result("value", ColumnKind::Real, "1", "value of an expression");
    let field = column.with_role(role).field().with_name(name);
    Ok(table.beside(&Table::from_arrays(table.rows(), Schema::new(vec![field]), vec![values])))
}

/// Returns the points of an expression in means over surfaces along one curve, each with its first
/// row. The error is computed by the delete-one jackknife, because an expression of means is no
/// mean.
fn points_of_expression(
    table: &Table,
    panel: &PanelSpec,
    (quantity, expression): (&Quantity, &Expression),
    mut curve: Vec<Vec<usize>>,
) -> Result<Vec<(Point, usize)>, TableError> {
    let loads = if table.has(LOAD.name) { reals(table, LOAD.name)? } else { Vec::new() };
    let load = |rows: &[usize]| {
        let known: Vec<f64> = rows.iter().filter_map(|&row| *loads.get(row)?).collect();
        if known.is_empty() { f64::NAN } else { mean(&known) }
    };
    curve.sort_by(|one, other| load(one).total_cmp(&load(other)));
    let names = table.texts(SURFACE.name)?;
    curve.iter_mut().for_each(|rows| rows.sort_by_key(|&row| names.value(row)));
    let ordinates: Vec<f64> = curve.iter().map(|rows| load(rows)).collect();
    let mut columns = BTreeMap::new();
    for column in expression.columns() {
        columns.insert(column, reals(table, column)?);
    }
    // Values from the means over all surfaces, or all but one.
    let values = |without: Option<usize>| {
        let means = |column: &str| -> Vec<f64> {
            let of_point = |rows: &Vec<usize>| {
                let kept = rows.iter().enumerate().filter(|(index, _)| Some(*index) != without);
                let values = kept.map(|(_, &row)| columns[column][row].unwrap_or(f64::NAN));
                mean(&values.collect::<Vec<_>>())
            };
            curve.iter().map(of_point).collect()
        };
        expression.values(&means, &ordinates)
    };
    let all = values(None);
    let surfaces = curve.first().map_or(0, Vec::len);
    let left_out: Vec<Vec<f64>> = if surfaces > 1 {
        (0..surfaces).map(|one| values(Some(one))).collect()
    } else {
        Vec::new()
    };
    let x = reals(table, &panel.x)?;
    let kind = match quantity.bars {
        BarSource::Surfaces(kind) => kind,
        _ => ErrorBars::None,
    };
    let points = curve.iter().enumerate().filter_map(|(at, rows)| {
        let xs: Option<Vec<f64>> = rows.iter().map(|&row| x[row]).collect();
        let y = all[at];
        // The deviation of the n leave-one-out values, times n − 1, is that of single values.
        let without: Vec<f64> = left_out.iter().map(|values| values[at]).collect();
        let scatter = deviation(&without).map(|scatter| (surfaces as f64 - 1.0) * scatter);
        let half = scatter.and_then(|scatter| half_bar(scatter, surfaces, kind));
        let bar = half.and_then(|half| around(y, half));
        let (surfaces, row) = (Some(surfaces), rows[0]);
        let point = Point { x: mean(&xs?), y, bar, surfaces, row, ..Point::default() };
        y.is_finite().then_some((point, rows[0]))
    });
    Ok(points.collect())
}

/// Returns whether a row has the selected values.
pub fn is_selected(table: &Table, row: usize, selection: &BTreeMap<String, Vec<Selected>>) -> bool {
    selection.iter().all(|(name, wanted)| {
        let column = table.batch().column_by_name(name);
        let found = column.and_then(|column| value(column.as_ref(), row));
        found.is_some_and(|found| wanted.iter().any(|wanted| wanted.is_same(&found)))
    })
}

fn unconverged(table: &Table) -> usize {
    if let Ok(stops) = table.texts(STOP.name) {
        return stops.iter().filter(|stop| stop.is_some_and(is_unconverged)).count();
    }
    let counts = table.integers("unconverged").ok();
    counts.map_or(0, |counts| counts.iter().flatten().sum::<i64>() as usize)
}

/// Columns that distinguish points.
struct Keys {
    /// Parameters and loads, and the columns of colours and panels.
    columns: Vec<String>,
    /// Columns of which a series has one value by declaration, and x if it is a coordinate.
    fixed: Vec<String>,
    has_x: bool,
    /// Coordinate that varies along a series, if x is not a coordinate.
    path: Option<String>,
}

impl Keys {
    fn new(table: &Table, figure: &FigureSpec, x: &str) -> Keys {
        let is_key = |role: Role| matches!(role, Role::Parameter | Role::Load);
        let coordinates = table.keep(|_, role| role.is_some_and(is_key));
        let mut columns: Vec<String> = coordinates.names().into_iter().map(str::to_owned).collect();
        // The name of a spectrum comes first, and what often follows from other parameters last.
        columns.sort_by_key(|name| rank(name));
        let declared = figure.facet.iter().chain(&figure.colour).chain(&figure.dash);
        let mut fixed: Vec<String> = declared.cloned().collect();
        let further: Vec<String> =
            fixed.iter().filter(|name| !columns.contains(name)).cloned().collect();
        columns.extend(further);
        // Without any coordinates, as in results of queries, x alone distinguishes points.
        let has_x = columns.iter().any(|name| name == x) || coordinates.names().is_empty();
        let loads = table.in_role(Role::Load);
        let free = columns.iter().filter(|name| !fixed.contains(name));
        let varying = free.filter(|name| distinct(table, name) > 1);
        let path = match has_x {
            true => None,
            false => varying.min_by_key(|name| Reverse(loads.has(name))).cloned(),
        };
        fixed.extend(has_x.then(|| x.to_owned()));
        fixed.extend(path.clone());
        Keys { columns, fixed, has_x, path }
    }

    /// Returns the columns, besides the fixed ones, that are needed to distinguish the points in
    /// these rows.
    fn split(&self, table: &Table, rows: Vec<usize>) -> Vec<String> {
        let shown = table.pick(&rows);
        let mut known: Vec<&str> = self.fixed.iter().map(String::as_str).collect();
        let mut split = Vec::new();
        for name in self.columns.iter().filter(|name| !self.fixed.contains(name)) {
            let groups = grouped(&shown.only(&known));
            let differs = |rows: &Vec<usize>| distinct(&shown.pick(rows), name) > 1;
            if groups.iter().any(differs) {
                known.push(name);
                split.push(name.clone());
            }
        }
        split
    }
}

/// Returns the rows of each point of each curve: rows that agree in every coordinate. Points at
/// loads at which a surface of the parameter point has no row are left out, because the mean over
/// the other surfaces belongs to another ensemble.
fn complete(table: &Table, keys: &Keys) -> Vec<Vec<Vec<usize>>> {
    let names: Vec<&str> = keys.columns.iter().map(String::as_str).collect();
    let loads = table.in_role(Role::Load);
    let parameters: Vec<&str> = names.iter().copied().filter(|name| !loads.has(name)).collect();
    let mut curve_of_row = vec![0; table.rows()];
    for (curve, rows) in grouped(&table.only(&parameters)).into_iter().enumerate() {
        rows.into_iter().for_each(|row| curve_of_row[row] = curve);
    }
    let groups = grouped(&table.only(&names));
    let mut fullest: BTreeMap<usize, usize> = BTreeMap::new();
    for rows in &groups {
        let most = fullest.entry(curve_of_row[rows[0]]).or_insert(0);
        *most = (*most).max(rows.len());
    }
    let mut curves: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
    for rows in groups {
        let curve = curve_of_row[rows[0]];
        if rows.len() == fullest[&curve] {
            curves.entry(curve).or_default().push(rows);
        }
    }
    curves.into_values().collect()
}

/// Ends of an error bar, from the first row of a point, its mean, and the values of its rows.
type Bar = Box<dyn Fn(usize, f64, &[f64]) -> Option<[f64; 2]>>;

/// Numbers of the columns that a figure draws.
struct Numbers {
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    bar: Bar,
    /// Numbers of surfaces of means over surfaces.
    surfaces: Option<Vec<Option<f64>>>,
    /// Sampling units of rows of surfaces.
    units: Option<Vec<i64>>,
}

impl Numbers {
    fn new(table: &Table, panel: &PanelSpec, quantity: &Quantity) -> Result<Numbers, TableError> {
        let of = |name: &str| reals(table, name);
        let bar: Bar = match &quantity.bars {
            BarSource::None => Box::new(|_, _, _| None),
            BarSource::Surfaces(kind) => {
                let kind = *kind;
                Box::new(move |_, y, values| {
                    around(y, half_bar(deviation(values)?, values.len(), kind)?)
                })
            }
            BarSource::Ends { ends, .. } => {
                let [lower, upper] = [of(&ends[0])?, of(&ends[1])?];
                Box::new(move |row, _, _| Some([lower[row]?, upper[row]?]))
            }
            BarSource::Half { column, .. } => {
                let half = of(column)?;
                Box::new(move |row, y, _| around(y, half[row]?))
            }
            BarSource::Student { error, surfaces } => {
                let (errors, counts) = (of(error)?, of(surfaces)?);
                Box::new(move |row, y, _| {
                    let count = counts[row].filter(|count| *count >= 2.0)?;
                    around(y, student(count as usize) * errors[row]?)
                })
            }
        };
        let has_counts = !has_surfaces(table) && table.has("surfaces");
        let is_of_surfaces = matches!(quantity.bars, BarSource::Surfaces(_));
        Ok(Numbers {
            x: of(&panel.x)?,
            y: of(&quantity.column)?,
            bar,
            surfaces: has_counts.then(|| of("surfaces")).transpose()?,
            units: is_of_surfaces.then(|| ensemble::sampling_units(table)).transpose()?,
        })
    }

    /// Returns the point of these rows, or `None` if they have no values.
    fn point(&self, rows: &[usize]) -> Option<Point> {
        let known = || rows.iter().filter(|&&row| self.x[row].is_some() && self.y[row].is_some());
        let row = *known().next()?;
        let values: Vec<f64> = known().filter_map(|&row| self.y[row]).collect();
        let xs: Vec<f64> = known().filter_map(|&row| self.x[row]).collect();
        let y = mean(&values);
        let surfaces = match &self.units {
            Some(units) => Some(known().map(|&row| units[row]).collect::<BTreeSet<i64>>().len()),
            None => self.surfaces.as_ref().and_then(|counts| Some(counts[row]? as usize)),
        };
        let bar = (self.bar)(row, y, &values);
        Some(Point { x: mean(&xs), y, bar, surfaces, row, ..Point::default() })
    }
}

/// Returns the ends of an error bar, if they are finite.
fn around(y: f64, half: f64) -> Option<[f64; 2]> {
    half.is_finite().then_some([y - half, y + half])
}

/// Returns the standard deviation with divisor n − 1, or `None` for fewer than two values.
fn deviation(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}

/// Returns half the length of the error bar of a mean over surfaces, from the standard deviation of
/// their values.
fn half_bar(deviation: f64, count: usize, kind: ErrorBars) -> Option<f64> {
    let error = deviation / (count as f64).sqrt();
    match kind {
        ErrorBars::Ci95 => Some(student(count) * error),
        ErrorBars::Sem => Some(error),
        ErrorBars::Sd => Some(deviation),
        ErrorBars::None => None,
    }
}

/// Returns the number of standard errors in half the 95 % interval of a mean of `count` values.
fn student(count: usize) -> f64 {
    two_sided_quantile(LEVEL, count.saturating_sub(1).max(1) as u32)
}

/// Returns the mean; equal values are their own mean, without rounding.
pub fn mean(values: &[f64]) -> f64 {
    let first = values[0];
    let is_same = values.iter().all(|value| *value == first);
    if is_same { first } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Returns a column of numbers, with `None` for missing values.
pub fn reals(table: &Table, name: &str) -> Result<Vec<Option<f64>>, TableError> {
    match table.integers(name) {
        Ok(integers) => Ok(integers.iter().map(|value| value.map(|value| value as f64)).collect()),
        Err(_) => Ok(table.reals(name)?.iter().collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::columns::{AREA_FRACTION, HURST, REALIZATION};
    use asperity_tables::column::{integers, reals, texts};

    const NODES: Column = Column::parameter("nodes", ColumnKind::Integer, "1", "nodes");

    /// Returns a table of areas of two surfaces for each of two Hurst exponents and two loads. The
    /// mesh follows from the exponent.
    fn table() -> Table {
        let mut rows = Vec::new();
        for (hurst, nodes, offset) in [(0.3, 64, 0.0), (0.8, 128, 0.1)] {
            for load in [0.1, 0.2] {
                for realization in [0, 1] {
                    let area = load + offset + 0.02 * realization as f64;
                    rows.push((hurst, nodes, load, realization, area));
                }
            }
        }
        let name = |row: &(f64, i64, f64, i64, f64)| format!("{}-{}", row.0, row.3);
        Table::new(
            rows.len(),
            vec![
                (SURFACE, texts(rows.iter().map(name))),
                (HURST, reals(rows.iter().map(|row| row.0))),
                (NODES, integers(rows.iter().map(|row| row.1))),
                (LOAD, reals(rows.iter().map(|row| row.2))),
                (REALIZATION, integers(rows.iter().map(|row| row.3))),
                (AREA_FRACTION, reals(rows.iter().map(|row| row.4))),
            ],
        )
    }

    fn points(table: &Table, x: &str, change: impl FnOnce(&mut FigureSpec)) -> Points {
        let quantity = Quantity::find(table, "area_fraction", None).unwrap();
        let mut figure = FigureSpec {
            name: "figure".to_owned(),
            from: "area".to_owned(),
            ..FigureSpec::default()
        };
        change(&mut figure);
        let panel = PanelSpec { x: x.to_owned(), ..PanelSpec::default() };
        Points::from_table(table, &figure, &panel, &quantity).unwrap()
    }

    #[test]
    fn points_are_means_over_surfaces_with_intervals_of_student() {
        let points = points(&table(), "hurst", |figure| {
            figure.selection.insert("load".to_owned(), vec![Selected::Number(0.1)]);
        });
        let told: Vec<(f64, f64)> = points.points.iter().map(|point| (point.x, point.y)).collect();
        assert_eq!(told.len(), 2);
        for ((x, y), expected) in told.into_iter().zip([(0.3, 0.11), (0.8, 0.21)]) {
            assert!(x == expected.0 && (y - expected.1).abs() < 1e-15);
        }
        // The standard error of two values is half their distance of 0.02, and the quantile of
        // Student's t for one degree of freedom is tan(0.95 π/2).
        let half = 0.01 * (0.95 * std::f64::consts::FRAC_PI_2).tan();
        let [low, high] = points.points[0].bar.unwrap();
        assert!((high - low - 2.0 * half).abs() < 1e-9);
        assert_eq!(points.points[0].surfaces, Some(2));
        assert!(points.colour.is_none() && points.is_curve);
    }

    #[test]
    fn what_follows_from_x_or_from_the_colour_makes_no_series() {
        let against_hurst = points(&table(), "hurst", |_| {});
        assert_eq!(against_hurst.colour.as_deref(), Some("load"), "the mesh follows from H");
        assert!(against_hurst.others.is_empty());
        let against_load = points(&table(), "load", |_| {});
        assert_eq!(against_load.colour.as_deref(), Some("hurst"));
        assert!(against_load.others.is_empty());
        let by_load = points(&table(), "load", |figure| figure.colour = Some("load".to_owned()));
        assert_eq!(by_load.others, ["hurst"], "points of two exponents are never mixed");
    }

    #[test]
    fn one_surface_has_no_interval() {
        let table = table().pick(&[0, 4]);
        let points = points(&table, "hurst", |_| {});
        assert!(points.points.iter().all(|point| point.bar.is_none()));
        assert_eq!(points.points.len(), 2);
    }

    #[test]
    fn a_load_that_a_surface_lacks_has_no_point() {
        let points = points(&table().pick(&[0, 1, 2]), "load", |_| {});
        let loads: Vec<f64> = points.points.iter().map(|point| point.x).collect();
        assert_eq!(loads, [0.1]);
    }

    #[test]
    fn points_against_a_result_follow_the_loads() {
        let table = table().with(vec![(
            Column::result("mean_gap", ColumnKind::Real, "1", "gap"),
            reals((0..8).map(|row| 2.0 - 0.1 * f64::from(row))),
        )]);
        let points = points(&table, "mean_gap", |_| {});
        assert_eq!(points.colour.as_deref(), Some("hurst"));
        assert_eq!(points.points.len(), 4);
        assert!(points.is_curve && (points.points[0].x - 1.95).abs() < 1e-15);
    }

    /// Returns the points of an expression, with standard errors.
    fn of_expression(table: &Table, y: &str) -> Points {
        let expression = Expression::parse(y).unwrap();
        let quantity = Quantity::of_expression(table, expression, Some(ErrorBars::Sem));
        let panel = PanelSpec { x: "load".to_owned(), ..PanelSpec::default() };
        Points::from_table(table, &FigureSpec::default(), &panel, &quantity).unwrap()
    }

    #[test]
    fn an_expression_is_that_of_the_means_with_the_error_of_a_jackknife() {
        let points = of_expression(&table(), "load / area_fraction").points;
        // The areas of the two surfaces are 0.1 and 0.12.
        assert!((points[0].y - 0.1 / 0.11).abs() < 1e-15);
        // For two surfaces, half the bar is half the distance of the values of single surfaces.
        let [low, high] = points[0].bar.unwrap();
        assert!((high - low - (0.1 / 0.1 - 0.1 / 0.12)).abs() < 1e-14);
    }

    #[test]
    fn slopes_scatter_as_those_of_single_surfaces_do() {
        let rows = |row: usize| (0.1 * (1 + row / 2) as f64, row % 2);
        let table = Table::new(
            6,
            vec![
                (SURFACE, texts((0..6).map(|row| format!("{}", row % 2)))),
                (LOAD, reals((0..6).map(|row| rows(row).0))),
                (REALIZATION, integers((0..6).map(|row| rows(row).1 as i64))),
                (AREA_FRACTION, reals((0..6).map(|row| 2.0 * rows(row).0 + rows(row).1 as f64))),
            ],
        );
        let slopes = of_expression(&table, "slope(area_fraction)").points;
        assert_eq!(slopes.len(), 3);
        for slope in slopes {
            let [low, high] = slope.bar.unwrap();
            assert!((slope.y - 2.0).abs() < 1e-13 && high - low < 1e-13, "both rise by 2");
        }
    }
}
