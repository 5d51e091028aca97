//! Figures of the tables of stages: those that the study declares, and automatic ones.

mod caption;
mod legend;
mod series_key;

use std::collections::BTreeSet;

use asperity_manifest::diagnostics::listed;
use asperity_pipeline::study::figures::{FigureSize, FigureSpec, Quantity, Scales};
use asperity_tables::column::Value;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::map_panel::WORDS;
use crate::charts::style::Style;
use crate::charts::{ColourScale, Figure, in_rows};
use crate::figure_data::FigureData;
use crate::figures::Drawn;
use crate::figures::declared::series_key::{SeriesKey, number};
use crate::figures::theories::Theories;
use crate::finished::FinishedStage;
use crate::plotted::{Point, Points};
use crate::symbols::{self, AREA_LABEL, Labels};

/// Largest number of values of a parameter that the legend lists; a colour scale shows more.
const MOST_ENTRIES: usize = 12;
/// Largest number of series of a figure. More cannot be told apart.
const MOST_SERIES: usize = 150;
/// Largest number of panels of a figure.
const MOST_PANELS: usize = 30;
/// Largest number of markers of a series, which a line through all points joins.
const MOST_MARKERS: usize = 24;
/// Ratio of the largest to the smallest number above which a colour scale is logarithmic.
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
    let labels = Labels::new(&data.units, &stage.table, &stage.units)?;
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
    let quantities = match names.as_slice() {
        [one] => one.clone(),
        [one, other] => format!("{one} and {other}"),
        _ => format!("results of `{}`", figure.from),
    };
    let text = format!("{quantities} against {}", symbols::name(&figure.x));
    // Symbols such as β stay as they are.
    match text.chars().next() {
        Some(first) if first.is_ascii() => {
            first.to_uppercase().chain(text.chars().skip(1)).collect()
        }
        _ => text,
    }
}

fn lacking(needs: String) -> Drawn {
    Drawn::Missing { needs: needs.into(), lines: None }
}

/// Gives a figure the size of the manifest, in millimetres and points.
///
/// # Errors
/// Returns the smallest possible height, in millimetres.
fn fit(figure: &mut Figure, size: &FigureSize) -> Result<(), f64> {
    /// Pixels of a millimetre and of a point: 96 pixels, 25.4 mm and 72 points are an inch.
    const MILLIMETRE: f64 = 96.0 / 25.4;
    const POINT: f64 = 96.0 / 72.0;
    if *size == FigureSize::default() {
        return Ok(());
    }
    let sides = [size.width, size.height].map(|side| side.map(|side| MILLIMETRE * side));
    let font = size.font.map_or(f64::from(WORDS), |font| POINT * font);
    figure.fit(sides, font).map_err(|least| (least / MILLIMETRE).ceil())
}

struct Plot<'a> {
    data: &'a FigureData<'a>,
    figure: &'a FigureSpec,
    stage: &'a FinishedStage,
    labels: Labels,
    drawings: Vec<(&'a Quantity, Points)>,
}

/// Properties that distinguish series besides the colour: values of further columns, and the column
/// of the quantity if its panel has several.
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
        // The axes of a declared figure hold its theories, even if they are far from the data.
        if charts.len() > 1 || !self.figure.theories.is_empty() {
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
        figure.title = self.figure.title.clone().unwrap_or_default();
        if let Err(least) = fit(&mut figure, &self.figure.size) {
            let needs = format!("a `height` of at least {least} mm for its title, axes and legend");
            return Ok(lacking(needs));
        }
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
            chart = chart.titled(self.told(name, facet.as_ref()));
        }
        let name = |model| self.name_of_theory(model);
        let theories = Theories::new(&self.figure.theories, &self.figure.x, &name);
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

    fn colour_scale(&self, key: &SeriesKey) -> Option<ColourScale> {
        let numbers = key.numbers.as_ref().filter(|numbers| numbers.len() > MOST_ENTRIES)?;
        let name = self.drawings[0].1.colour.as_deref()?;
        let unit = self.labels.unit(name, numbers.iter().copied());
        let [lowest, highest] = [numbers.first()?, numbers.last()?]
            .map(|number| crate::units::digits(unit.factor * number, 4));
        Some(ColourScale { label: unit.label(&symbols::name(name)), lowest, highest })
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
