//! Figures of the tables of stages: those that the study declares, and automatic ones.

use std::collections::BTreeSet;

use asperity_manifest::diagnostics::listed;
use asperity_pipeline::study::figures::{
    BarSource, EndsMeaning, ErrorBars, FigureSpec, Quantity, Scales, Value as Selected,
};
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_tables::column::Value;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::style::{self, Colour, Dash, GRADIENT_STEPS, Line, Style};
use crate::charts::{ColourScale, Figure, in_rows};
use crate::figure_data::{AREA_LABEL, FigureData, FinishedStage};
use crate::figures::Drawn;
use crate::figures::theories::Theories;
use crate::plotted::{Point, Points, distinct};
use crate::symbols::{self, Labels};

/// Largest number of values of a parameter that the legend lists; a colour scale shows more.
const MOST_ENTRIES: usize = 12;
/// Largest number of series of a figure. More cannot be told apart.
const MOST_SERIES: usize = 150;
/// Largest number of panels of a figure.
const MOST_PANELS: usize = 30;
/// Largest number of markers of a series, which a line through all points joins.
const MOST_MARKERS: usize = 24;
/// Smallest ratio of numbers whose colours are logarithmic on a colour scale.
const LOGARITHMIC: f64 = 20.0;

/// Draws a figure from the table of its stage.
pub fn draw(data: &FigureData, figure: &FigureSpec) -> Result<Drawn, ReportError> {
    let stage = data.finished.stages.iter().find(|stage| stage.name == figure.from);
    let Some(stage) = stage.filter(|stage| stage.table.rows() > 0) else {
        return Ok(lacking(format!("rows of the stage `{}`; run the study", figure.from)));
    };
    let mut drawings = Vec::new();
    for quantity in &figure.y {
        let points = Points::from_table(&stage.table, figure, quantity)?;
        drawings.push((quantity, points));
    }
    let labels = Labels::new(data, &stage.table)?;
    Plot { data, figure, stage, labels, drawings }.draw()
}

/// Returns the title of a figure: that of the manifest, or the quantities.
pub fn title(figure: &FigureSpec) -> String {
    if let Some(title) = &figure.title {
        return title.clone();
    }
    let mut names: Vec<String> = Vec::new();
    for quantity in &figure.y {
        let name = symbols::name(quantity.base());
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let text = format!("{} against {}", names.join(", "), symbols::name(&figure.x));
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn lacking(needs: String) -> Drawn {
    Drawn::Missing { needs: needs.into(), lines: None }
}

struct Plot<'a> {
    data: &'a FigureData<'a>,
    figure: &'a FigureSpec,
    stage: &'a FinishedStage,
    labels: Labels,
    drawings: Vec<(&'a Quantity, Points)>,
}

/// What distinguishes series besides the colour: values of further columns, and the column of the
/// quantity if its panel has several.
type Further = (Vec<(String, Option<Value>)>, Option<String>);

/// Panel: the value of the facet, and the label of the vertical axis.
type PanelOf = (Option<Value>, String);

impl Plot<'_> {
    fn draw(&self) -> Result<Drawn, ReportError> {
        if self.points().next().is_none() {
            return Ok(lacking(self.no_rows()));
        }
        let hidden = self.points().filter(|point| !self.can_show(point)).count();
        if hidden == self.points().count() {
            let needs =
                "values above zero, because its axis is logarithmic; set `scale = \"linear\"`";
            return Ok(lacking(needs.to_owned()));
        }
        let key = self.key();
        let panels = self.panels();
        if key.colours.len() * key.further.len() > MOST_SERIES || panels.len() > MOST_PANELS {
            return Ok(lacking(self.too_many()));
        }
        let mut charts = Vec::new();
        for panel in &panels {
            charts.push(self.chart(panel, &key)?);
        }
        if charts.len() > 1 {
            share_axes(&mut charts);
        }
        self.add_entries(&mut charts, &key);
        let mut figure = if charts.len() == 1 {
            Figure::from_charts(vec![charts], [600.0, 410.0])
        } else {
            // The quantities of a facet are in one row, if the texts stay large enough.
            let quantities = panels.iter().filter(|(facet, _)| *facet == panels[0].0).count();
            let (columns, size) =
                if quantities == 3 { (3, [340.0, 290.0]) } else { (2, [430.0, 320.0]) };
            Figure::from_charts(in_rows(columns, charts), size)
        };
        figure.colours = self.colour_scale(&key);
        Ok(Drawn::figure(figure, self.caption(hidden)))
    }

    fn points(&self) -> impl Iterator<Item = &Point> {
        self.drawings.iter().flat_map(|(_, points)| &points.points)
    }

    fn spacings(&self) -> [Spacing; 2] {
        use Spacing::{Linear, Logarithmic};
        match self.figure.scales {
            Scales::Linear => [Linear, Linear],
            Scales::LogX => [Logarithmic, Linear],
            Scales::LogY => [Linear, Logarithmic],
            Scales::Log => [Logarithmic, Logarithmic],
        }
    }

    /// Returns whether both axes can show a point.
    fn can_show(&self, point: &Point) -> bool {
        let [x, y] = self.spacings().map(|spacing| Axis { spacing, ..Axis::linear("") });
        x.can_show(point.x) && y.can_show(point.y)
    }

    fn no_rows(&self) -> String {
        let selected = self.figure.selection.keys().map(|name| {
            let known = self.labels.values(&self.stage.table, name);
            format!("`{name}` has the values {known}")
        });
        let selected: Vec<String> = selected.collect();
        match selected.as_slice() {
            [] => format!("values in the table of the stage `{}`", self.stage.name),
            _ => format!("rows with the values in `where`: {}", selected.join("; ")),
        }
    }

    fn too_many(&self) -> String {
        let (_, points) = &self.drawings[0];
        let columns = points.colour.iter().chain(&self.figure.facet).chain(&points.others);
        let columns = columns.map(String::as_str);
        format!(
            "fewer series or panels: at most {MOST_SERIES} and {MOST_PANELS} can be told apart. \
             Points differ in {}; select values of them with `where`",
            listed(columns, "and"),
        )
    }

    /// Returns the panels, by facets and then by vertical axes.
    fn panels(&self) -> Vec<PanelOf> {
        let facets: BTreeSet<&Option<Value>> = self.points().map(|point| &point.facet).collect();
        let mut labels: Vec<String> = Vec::new();
        for (quantity, _) in &self.drawings {
            let label = symbols::name(quantity.base());
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
        let panels = facets
            .into_iter()
            .flat_map(|facet| labels.iter().map(move |label| (facet.clone(), label.clone())));
        panels.collect()
    }

    /// Returns what distinguishes the series of the figure.
    fn key(&self) -> SeriesKey {
        let colours = self.points().map(|point| point.colour.clone());
        let colours: Vec<Option<Value>> = colours.collect::<BTreeSet<_>>().into_iter().collect();
        let mut further: Vec<Further> = Vec::new();
        for (quantity, points) in &self.drawings {
            let mut own: Vec<Further> =
                points.points.iter().map(|point| self.further(quantity, points, point)).collect();
            own.sort();
            own.dedup();
            further
                .extend(own.into_iter().filter(|one| !further.contains(one)).collect::<Vec<_>>());
        }
        let numbers: Option<Vec<f64>> =
            colours.iter().map(|colour| number(colour.as_ref()?)).collect();
        SeriesKey { numbers: numbers.filter(|all| all.len() > 1), colours, further }
    }

    fn further(&self, quantity: &Quantity, points: &Points, point: &Point) -> Further {
        let label = symbols::name(quantity.base());
        let mut others = self.drawings.iter();
        let is_shared =
            others.any(|(other, _)| *other != quantity && symbols::name(other.base()) == label);
        let values = points.others.iter().cloned().zip(point.others.iter().cloned());
        (values.collect(), is_shared.then(|| quantity.base().to_owned()))
    }

    fn chart(&self, (facet, label): &PanelOf, key: &SeriesKey) -> Result<Chart, ReportError> {
        let shown = || self.drawings.iter().filter(|(one, _)| symbols::name(one.base()) == *label);
        let all = || shown().flat_map(|(_, points)| &points.points);
        let column = shown().next().map_or("", |(quantity, _)| quantity.column.as_str());
        let x_unit = self.labels.unit(&self.figure.x, self.points().map(|point| point.x));
        let y_unit = self.labels.unit(column, all().map(|point| point.y));
        let [x_spacing, y_spacing] = self.spacings();
        let x_label = x_unit.label(&symbols::name(&self.figure.x));
        let mut chart = Chart::new(
            Axis { spacing: x_spacing, ..Axis::linear(x_label) },
            Axis { spacing: y_spacing, ..Axis::linear(y_unit.label(label)) },
        );
        if let (Some(name), Some(_)) = (&self.figure.facet, facet) {
            chart = chart.titled(self.labels.told(name, facet.as_ref(), self.data));
        }
        let theories = Theories::new(&self.figure.theories, &self.figure.x);
        let mut curves = Vec::new();
        for (quantity, points) in shown() {
            for (colour, look) in key.colours.iter().enumerate() {
                for (index, further) in key.further.iter().enumerate() {
                    let is_own = |point: &&Point| {
                        point.facet == *facet
                            && point.colour == *look
                            && self.further(quantity, points, point) == *further
                    };
                    let mut own: Vec<&Point> = points.points.iter().filter(is_own).collect();
                    own.retain(|point| self.can_show(point));
                    own.sort_by(|one, other| one.x.total_cmp(&other.x));
                    if own.is_empty() {
                        continue;
                    }
                    let place = |point: &&Point| DataPoint {
                        x: x_unit.factor * point.x,
                        y: y_unit.factor * point.y,
                        bar: point.bar.map(|bar| bar.map(|end| y_unit.factor * end)),
                    };
                    let style = key.style(colour, index);
                    let placed = own.iter().map(place).collect();
                    chart.series.extend(drawn(placed, style, points.is_curve));
                    if label == AREA_LABEL {
                        let own = own.iter().map(|point| (point.x, point.row));
                        curves.push((own.collect(), points, style.colour));
                    }
                }
            }
        }
        chart.series.extend(theories.curves(&curves, x_unit.factor, x_spacing)?);
        Ok(chart)
    }

    /// Adds the entries of the legend to the first chart, as series without points.
    fn add_entries(&self, charts: &mut [Chart], key: &SeriesKey) {
        let (_, points) = &self.drawings[0];
        let colour_name = points.colour.as_deref().unwrap_or_default();
        let told_colour = |index: usize| {
            let value = key.colours[index].as_ref();
            (!colour_name.is_empty()).then(|| self.labels.told(colour_name, value, self.data))
        };
        let told_further = |index: usize| {
            let (values, quantity) = &key.further[index];
            let values = values
                .iter()
                .map(|(name, value)| self.labels.told(name, value.as_ref(), self.data));
            values
                .chain(quantity.as_ref().map(|name| name.replace('_', " ")))
                .collect::<Vec<_>>()
                .join(" · ")
        };
        let mut entries = Vec::new();
        let (colours, further) = (key.colours.len(), key.further.len());
        let has_scale = self.colour_scale(key).is_some();
        if key.is_crossed() {
            for index in 0..if has_scale { 0 } else { colours } {
                let line = Style::line(key.style(index, 0).colour, Dash::Solid, 3.0);
                entries.push((line, told_colour(index).unwrap_or_default()));
            }
            for index in 0..further {
                let style = Style { colour: Colour::Muted, ..key.style(0, index) };
                entries.push((style, told_further(index)));
            }
        } else if colours * further > 1 && !has_scale {
            for colour in 0..colours {
                for index in 0..further {
                    let parts = [told_colour(colour), (further > 1).then(|| told_further(index))];
                    let label: Vec<String> =
                        parts.into_iter().flatten().filter(|part| !part.is_empty()).collect();
                    entries.push((key.style(colour, index), label.join(" · ")));
                }
            }
        } else if colours * further == 1 && !self.figure.theories.is_empty() {
            entries.push((key.style(0, 0), "this study".to_owned()));
        }
        let Some(chart) = charts.first_mut() else { return };
        let entries = entries.into_iter();
        chart.series.extend(entries.map(|(style, label)| Series::new([], style).named(label)));
    }

    fn colour_scale(&self, key: &SeriesKey) -> Option<ColourScale> {
        let numbers = key.numbers.as_ref().filter(|numbers| numbers.len() > MOST_ENTRIES)?;
        let name = self.drawings[0].1.colour.as_deref()?;
        let unit = self.labels.unit(name, numbers.iter().copied());
        let [lowest, highest] = [numbers.first()?, numbers.last()?]
            .map(|number| crate::units::digits(unit.factor * number, 4));
        Some(ColourScale { label: unit.label(&symbols::name(name)), lowest, highest })
    }

    fn caption(&self, hidden: usize) -> String {
        let mut sentences: Vec<String> = self.figure.caption.iter().cloned().collect();
        let counts = self.points().filter_map(|point| point.surfaces);
        let counts: BTreeSet<usize> = counts.collect();
        sentences.extend(match (counts.first(), counts.last()) {
            (Some(1), Some(1)) => Some("Each point is one surface, without an error.".to_owned()),
            (Some(least), Some(most)) if least == most => {
                Some(format!("Points are means over {most} surfaces."))
            }
            (Some(least), Some(most)) => {
                Some(format!("Points are means over {least} to {most} surfaces."))
            }
            _ => None,
        });
        let has_bars = self.points().any(|point| point.bar.is_some());
        sentences.extend(bars_of(self.drawings[0].0).filter(|_| has_bars));
        sentences.extend(self.conditions());
        if hidden > 0 {
            sentences.push(format!(
                "{hidden} points at or below zero are missing, because the axis is logarithmic."
            ));
        }
        let unconverged = self.drawings[0].1.unconverged;
        if unconverged > 0 {
            sentences.push(format!("{unconverged} rows are loads that did not converge."));
        }
        let text = sentences.join(" ");
        if self.figure.theories.is_empty() { text } else { text + &self.data.caveat }
    }

    /// Returns a sentence with the selected values, and with the load if there is only one.
    fn conditions(&self) -> Option<String> {
        let selection = self.figure.selection.iter().map(|(name, values)| {
            let values = values.iter().map(|value| match value {
                Selected::Number(number) => Value::Real(*number),
                Selected::Word(word) => Value::Text(word.clone()),
            });
            let told = values.map(|value| self.labels.told(name, Some(&value), self.data));
            told.collect::<Vec<_>>().join(" or ")
        });
        let mut parts: Vec<String> = selection.collect();
        let table = &self.drawings[0].1.table;
        for name in [LOAD.name, PRESSURE.name] {
            let is_told = self.figure.selection.contains_key(name) || self.figure.x == name;
            if table.has(name) && !is_told && distinct(table, name) == 1 {
                let column = table.batch().column_by_name(name)?;
                let value = Value::from_array(column.as_ref(), 0);
                parts.push(self.labels.told(name, value.as_ref(), self.data));
                break;
            }
        }
        (!parts.is_empty()).then(|| format!("At {}.", parts.join(", ")))
    }
}

/// Returns the series of points, with a line through all of them if they are a curve, and markers
/// at no more than [`MOST_MARKERS`] of them.
fn drawn(points: Vec<DataPoint>, style: Style, is_curve: bool) -> Vec<Series> {
    let step = points.len().div_ceil(MOST_MARKERS).max(1);
    let marked = points.iter().copied().step_by(step).collect();
    let markers = Series { points: marked, style: Style { line: None, ..style }, label: None };
    let line = Series { points, style: Style { marker: None, ..style }, label: None };
    let line = (is_curve && line.points.len() > 1).then(|| line.without_bars());
    line.into_iter().chain([markers]).collect()
}

/// Returns the sentence on the error bars of a quantity.
fn bars_of(quantity: &Quantity) -> Option<String> {
    let meaning = match &quantity.bars {
        BarSource::None => return None,
        BarSource::Surfaces(kind) | BarSource::Half { meaning: kind, .. } => match kind {
            ErrorBars::Ci95 => "95 % confidence intervals of the means (Student's t)",
            ErrorBars::Sem => "standard errors of the means",
            ErrorBars::Sd => "standard deviations over the surfaces",
            ErrorBars::None => return None,
        },
        BarSource::Ends { meaning: EndsMeaning::OfFit, .. } => "intervals of the fits",
        BarSource::Ends { .. } | BarSource::Student { .. } => {
            "95 % confidence intervals of the means (Student's t)"
        }
    };
    Some(format!("Bars are {meaning}."))
}

/// Gives the panels of a figure the same horizontal axis, and those of one quantity the same
/// vertical axis.
fn share_axes(charts: &mut [Chart]) {
    let ends = |charts: &[Chart], of: &dyn Fn(&Chart) -> Vec<f64>, axis: &Axis| {
        axis.ends(charts.iter().flat_map(of))
    };
    let xs = |chart: &Chart| {
        chart.series.iter().flat_map(|one| one.points.iter().map(|p| p.x)).collect()
    };
    let ys = |chart: &Chart| {
        let points = chart.series.iter().flat_map(|one| &one.points);
        points.flat_map(|p| p.bar.unwrap_or([p.y; 2]).into_iter().chain([p.y])).collect()
    };
    let x = ends(charts, &xs, &charts[0].x);
    let all = charts.to_vec();
    for chart in charts {
        let alike: Vec<Chart> =
            all.iter().filter(|one| one.y.label == chart.y.label).cloned().collect();
        let y = ends(&alike, &ys, &chart.y);
        chart.x = chart.x.clone().within(x[0], x[1]);
        chart.y = chart.y.clone().within(y[0], y[1]);
    }
}

/// What distinguishes the series of a figure: their colours, and markers or dashes.
struct SeriesKey {
    /// Values that have their own colour, in ascending order.
    colours: Vec<Option<Value>>,
    /// The same values, if there are several and all are numbers.
    numbers: Option<Vec<f64>>,
    further: Vec<Further>,
}

const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted];

impl SeriesKey {
    /// Returns whether colours stand for one parameter, and markers for everything else.
    fn is_crossed(&self) -> bool {
        let has_colours = self.numbers.is_some() || (2..=7).contains(&self.colours.len());
        has_colours && (2..=24).contains(&self.further.len())
    }

    /// Returns the style of a series. No two series of a figure look alike.
    fn style(&self, colour: usize, further: usize) -> Style {
        let look = |colour: Colour, marker: usize, dash: usize| Style {
            colour,
            line: Some(Line { dash: DASHES[dash % DASHES.len()], width: 1.2 }),
            marker: Some(style::marker(marker)),
        };
        // These pairs of marker and dash differ for 24 indices.
        let pair = [further / 4 * 5 + further % 4, further % 4];
        match &self.numbers {
            Some(numbers) if self.is_crossed() => {
                look(Colour::Gradient(step(numbers, colour)), pair[0], pair[1])
            }
            Some(numbers) if self.further.len() == 1 => {
                look(Colour::Gradient(step(numbers, colour)), colour, 0)
            }
            _ if self.is_crossed() => look(Colour::Series(colour), pair[0], pair[1]),
            _ => {
                // 7 colours and 6 markers give 42 pairs.
                let index = colour * self.further.len() + further;
                look(Colour::Series(index), index, index / 42)
            }
        }
    }
}

/// Returns the step of the gradient for a number. Few numbers have evenly spaced colours; many have
/// the colours of a linear or logarithmic scale.
fn step(numbers: &[f64], index: usize) -> usize {
    let last = (GRADIENT_STEPS - 1) as f64;
    let (least, most) = (numbers[0], numbers[numbers.len() - 1]);
    let share = if numbers.len() <= MOST_ENTRIES {
        index as f64 / (numbers.len() - 1) as f64
    } else if least > 0.0 && most > LOGARITHMIC * least {
        (numbers[index] / least).ln() / (most / least).ln()
    } else {
        (numbers[index] - least) / (most - least)
    };
    (last * share).round() as usize
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Real(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        Value::Text(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(colours: usize, further: usize, are_numbers: bool) -> SeriesKey {
        let value = |index: usize| match are_numbers {
            true => Value::Real(index as f64),
            false => Value::Text(format!("word {index}")),
        };
        let colours: Vec<Option<Value>> = (0..colours).map(|index| Some(value(index))).collect();
        let numbers: Option<Vec<f64>> =
            colours.iter().map(|colour| number(colour.as_ref()?)).collect();
        let further = (0..further)
            .map(|index| (vec![("k_upper".to_owned(), Some(Value::Integer(index as i64)))], None));
        let numbers = numbers.filter(|all| all.len() > 1);
        SeriesKey { colours, numbers, further: further.collect() }
    }

    #[test]
    fn no_two_series_look_alike() {
        for are_numbers in [true, false] {
            for (colours, further) in [(1, 1), (12, 1), (60, 1), (1, 24), (8, 3), (3, 20), (20, 7)]
            {
                let key = key(colours, further, are_numbers);
                let mut looks = Vec::new();
                for colour in 0..colours {
                    for index in 0..further {
                        let style = key.style(colour, index);
                        assert!(
                            !looks.contains(&style),
                            "{colour}, {index} of {colours} × {further}"
                        );
                        looks.push(style);
                    }
                }
            }
        }
    }

    #[test]
    fn ascending_numbers_have_ascending_colours_to_the_ends_of_the_gradient() {
        let steps = |numbers: &[f64]| -> Vec<usize> {
            (0..numbers.len()).map(|index| step(numbers, index)).collect()
        };
        assert_eq!(steps(&[0.1, 0.2, 100.0]), [0, 32, 63], "few numbers are evenly spaced");
        let powers: Vec<f64> = (0..19).map(|power| f64::from(power).exp2()).collect();
        let found = steps(&powers);
        assert_eq!((found[0], found[9], found[18]), (0, 32, 63), "a logarithmic scale");
    }
}
