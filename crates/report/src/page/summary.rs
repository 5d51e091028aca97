//! Summary at the beginning of a page: what was varied, the numbers of surfaces and loads, and the
//! main results with 95 % intervals.

use std::collections::{BTreeMap, BTreeSet};

use arrow::array::Array;
use minijinja::value::Serde;
use minijinja::{Value, context};

use super::ShownColumn;
use crate::Subject;
use crate::charts::axis::superscript;
use crate::figure_data::{FigureData, LIGHT};
use crate::figures::sample;
use crate::finished::{FinishedStage, FinishedStages};
use crate::loads::Loads;
use crate::plotted::reals;
use crate::points::{self, distinct, independent};
use crate::samples::spread;
use crate::symbols::{self, Labels};
use crate::units::{digits, length_in_words};
use asperity_manifest::keys::quantity;
use asperity_pipeline::study::figures::{ErrorBars, Quantity};
use asperity_stages::aggregate::{self, Groups, Multilevel, Statistic};
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, BRANCH, CONTENT, LOAD, MEAN_GAP, PRESSURE, PULL_OFF_LOAD, STEP,
    STOP, SURFACE,
};
use asperity_stages::ensemble::{self, ParameterPoint};
use asperity_stages::solve::is_unconverged;
use asperity_stages::units::TableUnits;
use asperity_stages::{Kind, Recipe, Work};
use asperity_tables::cells::cells;
use asperity_tables::column::{Description, Role, absolute_column};
use asperity_tables::table::Table;

/// Largest numbers of tables, of their rows and of the results of a row.
const TABLES: usize = 3;
const ROWS: usize = 10;
const RESULTS: usize = 4;
/// Largest number of values of a parameter that are listed.
const VALUES: usize = 10;
/// Coordinates of rows that are points of a curve, which a summary does not show.
const ALONG_CURVES: [&str; 6] = ["bin", "wavenumber", "lag", "distance", "bearing_level", "along"];

/// Returns the lines of the summary, each with a name such as `varied`, and small tables of
/// results.
pub fn summary(subject: &Subject, data: &FigureData) -> Value {
    let finished = data.finished;
    let line = |name: &str, text: String, is_alarming: bool| context! { name, text, is_alarming };
    let mut lines = vec![line("varied", varied(finished, data), false)];
    lines.extend(surfaces(finished).map(|text| line("surfaces", text, false)));
    lines.extend(loads(finished, &data.loads).map(|text| line("loads", text, false)));
    for stage in finished.with(&[STEP.name, "pairs"]) {
        lines.extend(path(&stage.table, data).map(|text| line("path", text, false)));
    }
    lines.extend(convergence(finished).map(|(text, failed)| line("solver", text, failed)));
    let (done, planned) = subject.tasks();
    let state = if done == planned {
        format!("complete: all {planned} tasks are done")
    } else {
        format!(
            "unfinished: {done} of {planned} tasks are done; figures and tables show their results"
        )
    };
    lines.push(line("state", state, done < planned));
    context! { lines, results => results(subject, data) }
}

/// Returns the parameters of surfaces and contacts that have several values, with their values.
fn varied(finished: &FinishedStages, data: &FigureData) -> String {
    let mut parameters: Vec<(String, Vec<String>)> = Vec::new();
    for stage in &finished.stages {
        if !matches!(stage.kind, Kind::Generate | Kind::Solve) {
            continue;
        }
        let swept = independent(&stage.table, &data.derived);
        let names: Vec<&str> = swept.iter().map(|(name, _)| name.as_str()).collect();
        let table = stage.table.only(&names);
        let Ok(labels) = Labels::new(&data.units, &stage.table, &stage.units) else { continue };
        for description in table.descriptions() {
            // The branch of a state belongs to its path.
            if description.name == BRANCH.name && stage.table.has(STEP.name) {
                continue;
            }
            let column = column_cells(&stage.table, &description, &labels);
            let known = parameters.iter().position(|(name, _)| *name == description.name);
            let index = known.unwrap_or_else(|| {
                parameters.push((description.name.clone(), Vec::new()));
                parameters.len() - 1
            });
            let values = &mut parameters[index].1;
            for value in column.into_iter().collect::<BTreeSet<_>>() {
                if !values.contains(&value) {
                    values.push(value);
                }
            }
        }
    }
    parameters.retain(|(_, values)| values.len() > 1);
    let in_words = |(name, mut values): (String, Vec<String>)| {
        let is_file = name == CONTENT.name;
        if is_file {
            let file = |content: &String| data.files.get(content).unwrap_or(content).clone();
            values = values.iter().map(file).collect();
        }
        values.sort_by(|one, other| ascending(one, other));
        format!("`{}` = {}", if is_file { "file" } else { &name }, listed(&values))
    };
    let texts: Vec<String> = parameters.into_iter().map(in_words).collect();
    let has_path = finished.with(&[STEP.name]).next().is_some();
    let has_loads = finished.stages.iter().any(|stage| {
        stage.kind == Kind::Solve && distinct(&stage.table, ensemble::load_column(&stage.table)) > 1
    });
    match texts.as_slice() {
        [] if has_path => "only the state along the path".to_owned(),
        [] if has_loads => "only the load".to_owned(),
        [] => "nothing".to_owned(),
        _ => texts.join("; "),
    }
}

/// Lists values; of many values, the first and the last.
fn listed(values: &[String]) -> String {
    if values.len() <= VALUES {
        return values.join(", ");
    }
    let first = values[..VALUES - 2].join(", ");
    format!("{first}, … {} ({} values)", values[values.len() - 1], values.len())
}

/// Returns the numbers of surfaces of the stages that generate or read them.
fn surfaces(finished: &FinishedStages) -> Option<String> {
    let mut by_point: BTreeMap<ParameterPoint, usize> = BTreeMap::new();
    for stage in finished.stages.iter().filter(|stage| stage.kind == Kind::Generate) {
        for row in 0..stage.table.rows() {
            *by_point.entry(ParameterPoint::from_row(&stage.table, row)).or_default() += 1;
        }
    }
    let counts: Vec<usize> = by_point.into_values().collect();
    let total: usize = counts.iter().sum();
    let text = sample(&counts);
    match counts.len() {
        0 => None,
        1 => Some(text),
        _ => Some(format!("{text}, {total} in total")),
    }
}

/// Returns the number of distinct loads with their range.
fn loads(finished: &FinishedStages, unit: &Loads) -> Option<String> {
    let mut loads: Vec<(f64, f64)> = Vec::new();
    let solved = finished.with(&[LOAD.name, PRESSURE.name, "pairs"]);
    for stage in solved.filter(|stage| !stage.table.has(STEP.name)) {
        let reduced = stage.table.reals(LOAD.name).ok()?;
        let pressures = stage.table.reals(PRESSURE.name).ok()?;
        loads.extend(reduced.values().iter().copied().zip(pressures.values().iter().copied()));
    }
    let given = |load: &(f64, f64)| match unit {
        Loads::Reduced => load.0,
        Loads::Pressures { .. } => load.1,
    };
    loads.sort_by(|one, other| given(one).total_cmp(&given(other)));
    loads.dedup_by(|one, other| given(one) == given(other));
    let (first, last) = (loads.first()?, loads.last()?);
    let text = |load: &(f64, f64)| unit.text(load.0, load.1);
    let meaning = match unit {
        Loads::Reduced => " (mean pressure in units of E* × rms slope)",
        Loads::Pressures { .. } => " (mean pressure)",
    };
    Some(match loads.len() {
        1 => format!("1 load, {}{meaning}", text(first)),
        count => format!("{count} loads from {} to {}{meaning}", text(first), text(last)),
    })
}

/// Compares numbers by size, and other texts alphabetically.
fn ascending(one: &str, other: &str) -> std::cmp::Ordering {
    match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) => one.total_cmp(&other),
        _ => one.cmp(other),
    }
}

/// Describes the prescribed loads or mean gaps of a path, in their order, and counts the surfaces
/// that pulled off.
fn path(table: &Table, data: &FigureData) -> Option<String> {
    let steps = table.integers(STEP.name).ok()?;
    let states = steps.iter().flatten().max()?;
    let column = ensemble::load_column(table);
    let given = table.reals(column).ok()?;
    let unit = data.units.at(&points::at_row(table, 0)).map(str::to_owned);
    let text = |row: usize| {
        let of = |column: &str| table.reals(column).map_or(f64::NAN, |all| all.value(row));
        match column == MEAN_GAP.name {
            true => length_in_words(given.value(row), unit.as_deref()),
            false => data.loads.text(of(LOAD.name), of(PRESSURE.name)),
        }
    };
    // The states of the first path.
    let rows = (1..=states).filter_map(|step| steps.iter().position(|own| own == Some(step)));
    let order = |&one: &usize, &other: &usize| given.value(one).total_cmp(&given.value(other));
    let (least, most) = (text(rows.clone().min_by(order)?), text(rows.max_by(order)?));
    let name = if column == MEAN_GAP.name { "mean gaps" } else { data.loads.name() };
    let pulled = table.reals(PULL_OFF_LOAD.name).map_or(0, |loads| loads.iter().flatten().count());
    let pulled = match pulled {
        0 => String::new(),
        count => format!("; {count} pulled off"),
    };
    let surfaces: BTreeSet<_> = table.texts(SURFACE.name).ok()?.iter().collect();
    let each = if surfaces.len() == 1 { "" } else { " on each surface" };
    let plural = if states == 1 { "" } else { "s" };
    Some(format!("{states} state{plural}{each}, {name} from {least} to {most}{pulled}"))
}

/// Returns the text on the convergence of the solver, and whether loads did not converge, if loads
/// were solved.
fn convergence(finished: &FinishedStages) -> Option<(String, bool)> {
    let solved = || finished.with(&["pairs", STOP.name]);
    let are_states = solved().all(|stage| stage.table.has(STEP.name));
    let word = if are_states { "states" } else { "loads" };
    let stops = solved().filter_map(|stage| stage.table.texts(STOP.name).ok());
    let (loads, given_up) = stops.fold((0, 0), |(loads, given_up), stops| {
        let failed = stops.iter().filter(|stop| stop.is_some_and(is_unconverged)).count();
        (loads + stops.len(), given_up + failed)
    });
    let text = match given_up {
        0 => format!("all {loads} {word} converged"),
        _ => format!("{given_up} of {loads} {word} did not converge"),
    };
    (loads > 0).then_some((text, given_up > 0))
}

/// Returns the tables of the main results: aggregates and fits, or else the means of the areas.
fn results(subject: &Subject, data: &FigureData) -> Vec<Value> {
    let stages = &subject.study.stages;
    let finished = |name: &str| data.finished.stages.iter().find(|stage| stage.name == name);
    let (mut aggregates, mut fits) = (Vec::new(), Vec::new());
    for stage in stages {
        let Some(own) = finished(&stage.name) else { continue };
        let Work::Evaluate(recipes) = &stage.work else { continue };
        match recipes.first() {
            Some(Recipe::Aggregate(params)) => {
                let read = stage.inputs.iter().filter_map(|&input| finished(&stages[input].name));
                let inputs: Vec<Table> = read.map(|stage| stage.table.clone()).collect();
                aggregates.extend(means(own, &inputs, params, data));
            }
            Some(Recipe::Fit(fit)) => fits.extend(fitted(own, fit.level, data)),
            _ => {}
        }
    }
    if aggregates.is_empty() {
        aggregates.extend(areas(data));
    }
    aggregates.extend(fits);
    aggregates.truncate(TABLES);
    aggregates
}

/// Returns the means of the contact areas in the last table that has any.
fn areas(data: &FigureData) -> Option<Value> {
    let has_areas = |stage: &&FinishedStage| [Kind::Measure, Kind::Correct].contains(&stage.kind);
    let columns = [AREA_CORRECTED.name, AREA_FRACTION.name];
    let mut last_first = data.finished.stages.iter().rev().filter(has_areas);
    let (stage, area) = last_first.find_map(|stage| {
        columns.into_iter().find(|name| stage.table.has(name)).map(|name| (stage, name))
    })?;
    let over = vec![area.to_owned()];
    let groups = Groups { group_by: None, over, statistics: Vec::new(), models: Vec::new() };
    means(stage, std::slice::from_ref(&stage.table), &aggregate::Params::Groups(groups), data)
}

/// Returns the means of the columns of an `aggregate` stage with 95 % intervals, or `None` for a
/// query.
fn means(
    stage: &FinishedStage,
    inputs: &[Table],
    params: &aggregate::Params,
    data: &FigureData,
) -> Option<Value> {
    let input = Table::stack(inputs).ok()?;
    let statistics = vec![Statistic::Mean, Statistic::Confidence(0.95)];
    let (over, table) = match params {
        aggregate::Params::Groups(groups) => {
            let schema = input.batch().schema();
            let name = |name: &String| absolute_column(&schema, name).to_owned();
            let over: Vec<String> = groups.over.iter().map(name).collect();
            let models = Vec::new();
            let wanted = Groups { over: over.clone(), statistics, models, ..groups.clone() };
            (over, aggregate::grouped(&input, &wanted))
        }
        aggregate::Params::Multilevel(levels) => {
            let wanted = Multilevel { statistics, ..levels.clone() };
            (levels.over.clone(), aggregate::multilevel_means(&input, &wanted))
        }
        aggregate::Params::Sql(_) => return None,
    };
    let table = table.ok()?;
    let mean = |name: &String| Quantity::find(&table, name, Some(ErrorBars::Ci95)).ok();
    shown(stage, 0.95, &table, false, over.iter().filter_map(mean).collect(), data)
}

/// Returns the parameters of a fit with their intervals.
fn fitted(stage: &FinishedStage, level: f64, data: &FigureData) -> Option<Value> {
    let table = &stage.table;
    let schema = table.batch().schema();
    let all = table.names().into_iter().filter(|name| absolute_column(&schema, name) == *name);
    let parameters = all.filter_map(|name| Quantity::find(table, name, None).ok());
    let with_interval = parameters.filter(|parameter| parameter.ends().is_some());
    shown(stage, level, table, true, with_interval.collect(), data)
}

/// Returns the table that a reader sees: the coordinates that differ between its rows, and the
/// estimates.
fn shown(
    stage: &FinishedStage,
    level: f64,
    table: &Table,
    is_fit: bool,
    mut estimates: Vec<Quantity>,
    data: &FigureData,
) -> Option<Value> {
    if ALONG_CURVES.iter().any(|name| table.has(name)) || table.rows() == 0 {
        return None;
    }
    let has_values = |name: &String| {
        let values = table.reals(name);
        values.is_ok_and(|values| values.null_count() < values.len())
    };
    let has_interval =
        |estimate: &Quantity| estimate.ends().is_some_and(|[end, _]| has_values(end));
    estimates.retain(|estimate| {
        // A parameter that is given has no interval. A single surface has none either.
        has_values(&estimate.column) && (!is_fit || has_interval(estimate))
    });
    estimates.truncate(RESULTS);
    if estimates.is_empty() {
        return None;
    }
    let is_known = |row: &usize| {
        let mut columns = estimates.iter().filter_map(|one| table.reals(&one.column).ok());
        columns.any(|values| values.is_valid(*row))
    };
    let known = table.pick(&(0..table.rows()).filter(is_known).collect::<Vec<_>>());
    let Selection { rows, note, points } = Selection::new(&known, &data.loads);
    let picked = known.pick(&rows);
    let labels = Labels::new(&data.units, &picked, &stage.units).ok()?;
    let mut columns = Vec::new();
    let mut by_column: Vec<Vec<String>> = Vec::new();
    let varied = independent(&picked, &data.derived);
    let coordinates = picked.coordinates().not_in_role(Role::Surface);
    let schema = picked.batch().schema();
    let field = |name: &str| schema.field_with_name(name).expect("the table has the column");
    for description in coordinates.descriptions() {
        let name = &description.name;
        let is_other_unit = [LOAD.name, PRESSURE.name].contains(&name.as_str())
            && description.role != Role::Load.name();
        let cells = column_cells(&picked, &description, &labels);
        let is_constant = cells.iter().all(|cell| *cell == cells[0]);
        let is_dependent = description.role == Role::Parameter.name()
            && !varied.iter().any(|(varied, _)| varied == name);
        // Rows of a yielding material have the hardness in two units, which may be equal.
        if is_constant || is_other_unit || is_dependent || by_column.contains(&cells) {
            continue;
        }
        let column = ShownColumn::new(field(name), &stage.units);
        columns.push(ShownColumn { name: symbols::symbol(name), ..column });
        by_column.push(cells);
    }
    for estimate in &estimates {
        let [lower, upper] = estimate.ends()?.each_ref().map(|name| reals(&picked, name).ok());
        let values = reals(&picked, &estimate.column).ok()?;
        let unit = labels.unit(&estimate.column, values.iter().copied().flatten());
        let cells = values.iter().enumerate().map(|(row, value)| {
            let end = |ends: &Option<Vec<Option<f64>>>| Some(unit.factor * ends.as_ref()?[row]?);
            let ends = end(&lower).zip(end(&upper));
            value.map_or_else(|| "–".to_owned(), |value| with_interval(unit.factor * value, ends))
        });
        by_column.push(cells.collect());
        let label = symbols::name(estimate.base());
        let labels = estimates.iter().map(|other| symbols::name(other.base()));
        let is_unique = labels.filter(|other| *other == label).count() == 1;
        let name = unit.label(if is_unique { &label } else { estimate.base() });
        let column = ShownColumn::new(field(&estimate.column), &stage.units);
        columns.push(ShownColumn { name, numeric: true, ..column });
    }
    let row = |row: usize| by_column.iter().map(|column| column[row].clone()).collect();
    let cells: Vec<Vec<String>> = (0..picked.rows()).map(row).collect();
    let what = if is_fit { "fitted parameters" } else { "means over the surfaces" };
    // A single surface has no interval.
    let intervals = if estimates.iter().any(has_interval) {
        format!(" with {} % intervals", digits(100.0 * level, 3))
    } else {
        String::new()
    };
    let mut caption = format!("{what}{intervals}{note}");
    if points > rows.len() {
        caption += &format!("; {} of {points} rows", rows.len());
    }
    Some(context! { stage => stage.name.as_str(), caption, columns => Serde(columns), cells })
}

/// Rows of a table that the summary shows.
struct Selection {
    rows: Vec<usize>,
    /// Text on the load of the rows, if only one load is shown.
    note: String,
    /// Number of rows from which the shown ones were taken.
    points: usize,
}

impl Selection {
    /// Selects up to [`ROWS`] rows. Of several parameter points with several loads, the rows at the
    /// load nearest to [`LIGHT`] are shown.
    fn new(table: &Table, loads: &Loads) -> Selection {
        let mut rows: Vec<usize> = (0..table.rows()).collect();
        let mut note = String::new();
        let column = table.reals(ensemble::load_column(table)).ok();
        let reduced = table.reals(LOAD.name).ok();
        if let (Some(given), Some(reduced)) = (column, reduced) {
            let points: BTreeSet<ParameterPoint> =
                rows.iter().map(|&row| ParameterPoint::from_row(table, row)).collect();
            let distance = |row: &usize| (reduced.value(*row) / LIGHT).ln().abs();
            let known = rows.iter().copied().filter(|&row| given.is_valid(row));
            let nearest = known.min_by(|one, other| distance(one).total_cmp(&distance(other)));
            if let (Some(nearest), true) = (nearest, points.len() > 1) {
                rows.retain(|&row| given.value(row) == given.value(nearest));
                note = match ensemble::prescribed_length(ensemble::load_column(table)) {
                    Some(length) => {
                        let unit = TableUnits::from_table(table).length;
                        let written = quantity::written(given.value(nearest), unit.as_deref());
                        format!(", at the {length} {written}")
                    }
                    None => {
                        let least = reduced.value(nearest);
                        let load = match table.reals(PRESSURE.name) {
                            Ok(pressures) => loads.text(least, pressures.value(nearest)),
                            Err(_) => loads.text_of_reduced(least),
                        };
                        format!(", at the {} = {load}", loads.name())
                    }
                };
            }
        }
        let points = rows.len();
        let rows = spread(points, ROWS).map(|index| rows[index]).collect();
        Selection { rows, note, points }
    }
}

/// Returns the cells of a column of coordinates as a person writes them.
fn column_cells(table: &Table, description: &Description, labels: &Labels) -> Vec<String> {
    let name = description.name.as_str();
    let Ok(values) = table.reals(name) else {
        let column = table.batch().column_by_name(name).expect("the table has described it");
        return cells(column.as_ref(), table.rows());
    };
    let text = |value: f64| {
        let number_of_digits = if description.unit == "1" { 6 } else { 4 };
        labels.unit(name, std::iter::once(value)).text(value, number_of_digits)
    };
    values.iter().map(|value| value.map_or_else(|| "–".to_owned(), text)).collect()
}

/// Formats a value with half of its interval, `0.1234 ± 0.0014`, or with the ends of the interval
/// if it is asymmetric. The interval has two significant digits. Very large and small numbers have
/// a common power of ten.
fn with_interval(value: f64, ends: Option<(f64, f64)>) -> String {
    // A quantity that is the same for all surfaces has an interval of rounding errors.
    let is_wide = |(lower, upper): &(f64, f64)| upper - lower > 1e-9 * value.abs();
    let Some((lower, upper)) = ends.filter(is_wide) else {
        return digits(value, 4);
    };
    let half = (upper - lower) / 2.0;
    let largest = half.max(value.abs());
    let exponent = if (1e-3..1e6).contains(&largest) { 0 } else { largest.log10().floor() as i32 };
    let power = 10f64.powi(exponent);
    // Decimals of the last digit shown; negative ones stand before the point.
    let decimals = 1 - (half / power).log10().floor() as i32;
    let unit = 10f64.powi(decimals);
    let text = |number: f64| {
        let rounded = (number / power * unit).round() / unit;
        format!("{rounded:.*}", decimals.clamp(0, 9) as usize).replace('-', "−")
    };
    let is_symmetric = (f64::midpoint(lower, upper) - value).abs() < 0.1 * half;
    let (numbers, brackets) = match is_symmetric {
        true => (format!("{} ± {}", text(value), text(half)), ["(", ")"]),
        false => (format!("{} ({} to {})", text(value), text(lower), text(upper)), ["", ""]),
    };
    match exponent {
        0 => numbers,
        _ => format!("{}{numbers}{}·10{}", brackets[0], brackets[1], superscript(exponent)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_has_two_digits_and_decides_those_of_its_value() {
        let cases = [
            (0.123456, Some((0.12206, 0.12485)), "0.1235 ± 0.0014"),
            (-2.0, Some((-2.25, -1.75)), "−2.00 ± 0.25"),
            (2.0, Some((1.9, 2.4)), "2.00 (1.90 to 2.40)"),
            (1234.4, Some((1200.0, 1268.8)), "1234 ± 34"),
            (1855.0, Some((1514.0, 2196.0)), "1860 ± 340"),
            (3.0e-6, Some((-1.5e-6, 7.5e-6)), "(3.0 ± 4.5)·10⁻⁶"),
            (-2.3456e7, Some((-2.3479e7, -2.3433e7)), "(−2.3456 ± 0.0023)·10⁷"),
            (2e-9, Some((1.9e-9, 2.4e-9)), "2.00 (1.90 to 2.40)·10⁻⁹"),
            (0.123456, None, "0.1235"),
            (0.5, Some((0.5, 0.5)), "0.5"),
            (1.785, Some((1.785 - 1e-15, 1.785 + 1e-15)), "1.785"),
        ];
        for (value, ends, expected) in cases {
            assert_eq!(with_interval(value, ends), expected);
        }
    }

    #[test]
    fn many_values_are_listed_by_the_first_and_the_last() {
        let values = |count: usize| (1..=count).map(|value| value.to_string()).collect::<Vec<_>>();
        assert_eq!(listed(&values(3)), "1, 2, 3");
        assert_eq!(listed(&values(20)), "1, 2, 3, 4, 5, 6, 7, 8, … 20 (20 values)");
    }
}
