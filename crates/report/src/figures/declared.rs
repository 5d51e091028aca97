//! Figures of the tables of stages: those that the study declares, and automatic ones.

mod caption;
mod legend;
mod series_key;

use std::collections::BTreeSet;

use asperity_pipeline::study::figures::{
    FacetPlace, FigureSize, FigureSpec, PanelSpec, Quantity, Scales, Value as Selected,
};
use asperity_stages::columns::{K_LOWER, K_ROLLOFF, K_UPPER, LOAD};
use asperity_tables::column::{Role, Value};
use asperity_tables::table::Table;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, DataPoint, Series};
use crate::charts::map_panel::WORDS;
use crate::charts::style::{Colour, Dash, Line, Style};
use crate::charts::{ColourScale, Figure, in_rows, transposed};
use crate::figure_data::FigureData;
use crate::figures::Drawn;
use crate::figures::curves::{Curves, DataSeries};
use crate::figures::declared::series_key::{DASHES, SeriesKey};
use crate::finished::FinishedStage;
use crate::plotted::{Point, Points};
use crate::points::{self, number};
use crate::styles::Styles;
use crate::symbols::{self, Labels};
use crate::units::{Scaled, digits};

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
    draw_from(data, figure, stage, None)
}

/// Looks of the parameter points of a figure of every report.
#[derive(Clone, Copy)]
pub struct Looks<'a> {
    pub styles: &'a Styles,
    /// Parameters that do not influence the look: that of the panels, and those along a series.
    pub hidden: &'a [&'a str],
    /// Whether each panel has axes of its own, because densities differ by orders of magnitude.
    pub has_own_axes: bool,
}

/// Draws a figure from the table of a stage. Without `looks`, series look as the legend says.
pub fn draw_from(
    data: &FigureData,
    figure: &FigureSpec,
    stage: &FinishedStage,
    looks: Option<Looks>,
) -> Result<Drawn, ReportError> {
    let mut drawings = Vec::new();
    for panel in &figure.panels {
        for quantity in &panel.y {
            let points = Points::from_table(&stage.table, figure, panel, quantity)?;
            drawings.push(Drawing { panel, quantity, points });
        }
    }
    let labels = Labels::new(&data.units, &stage.table, &stage.units)?;
    Plot { data, figure, stage, labels, drawings, looks }.draw()
}

/// Returns the title of a figure: that of the manifest, or the quantities.
pub fn title(figure: &FigureSpec) -> String {
    if let Some(title) = &figure.title {
        return title.clone();
    }
    let mut names: Vec<String> = Vec::new();
    for quantity in figure.panels.iter().flat_map(|panel| &panel.y) {
        let name = label(figure, quantity.base());
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let quantities = match names.as_slice() {
        [one] => one.clone(),
        [one, other] => format!("{one} and {other}"),
        _ => format!("results of `{}`", figure.from),
    };
    let x = figure.panels.first().map_or("", |panel| panel.x.as_str());
    let text = format!("{quantities} against {}", label(figure, x));
    // Symbols such as β stay as they are.
    match text.chars().next() {
        Some(first) if first.is_ascii() => {
            first.to_uppercase().chain(text.chars().skip(1)).collect()
        }
        _ => text,
    }
}

/// Returns the label of the axis of a column or an expression.
fn label(figure: &FigureSpec, column: &str) -> String {
    figure.labels.get(column).cloned().unwrap_or_else(|| symbols::name(column))
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
    drawings: Vec<Drawing<'a>>,
    /// Looks of parameter points, or `None` for those of the values in the legend.
    looks: Option<Looks<'a>>,
}

/// A quantity with its points.
struct Drawing<'a> {
    panel: &'a PanelSpec,
    quantity: &'a Quantity,
    points: Points,
}

/// A series of a panel.
struct Group<'a> {
    style: Style,
    label: Option<String>,
    points: Vec<&'a Point>,
}

/// Properties that distinguish series besides the colour: values of further columns, and the column
/// of the quantity if its panel has several.
type Further = (Vec<(String, Option<Value>)>, Option<String>);

/// Panel of a chart: the values of the facet, the axes, and the label of the vertical axis.
struct PanelOf<'a> {
    facet: Vec<Option<Value>>,
    spec: &'a PanelSpec,
    label: String,
}

impl Plot<'_> {
    fn draw(&self) -> Result<Drawn, ReportError> {
        if self.points().next().is_none() {
            return Ok(lacking(match self.figure.selection.is_empty() {
                true => format!("values in the table of the stage `{}`", self.stage.name),
                false => "rows with the values in `where`".to_owned(),
            }));
        }
        let is_hidden = |one: &Drawing, point: &Point| !can_show(one.panel, point);
        let hidden_of =
            |one: &Drawing| one.points.points.iter().filter(|point| is_hidden(one, point)).count();
        let hidden = self.drawings.iter().map(hidden_of).sum();
        if hidden == self.points().count() {
            let needs =
                "values above zero, because its axis is logarithmic; set `scale = \"linear\"`";
            return Ok(lacking(needs.to_owned()));
        }
        let key = self.key();
        let panels = self.panels();
        let has_many = self.looks.is_none() && key.colours.len() * key.further.len() > MOST_SERIES;
        if has_many || panels.len() > MOST_PANELS {
            return Ok(lacking(format!(
                "fewer series or panels, since at most {MOST_SERIES} and {MOST_PANELS} can be told \
                 apart; select values of parameters with `where`"
            )));
        }
        let mut charts = Vec::new();
        for panel in &panels {
            charts.push(self.chart(panel, &key)?);
        }
        // The axes of a declared figure hold its theories, even if they are far from the data.
        if let Some(looks) = self.looks {
            if !looks.has_own_axes {
                share_axes(&mut charts, false);
            }
        } else if charts.len() > 1 || self.has_curves() {
            share_axes(&mut charts, true);
        }
        let colours = self.colour_scale(&key).filter(|_| self.looks.is_none());
        let mut unshown = Vec::new();
        if self.looks.is_none() {
            self.add_entries(&mut charts, &key);
            if colours.is_none() {
                unshown = self.unshown_names(&charts);
            }
        }
        let mut figure = if charts.len() == 1 {
            Figure::from_charts(vec![charts], [600.0, 410.0])
        } else {
            // The quantities of a facet are in one row, if the texts stay large enough.
            let quantities = panels.iter().filter(|panel| panel.facet == panels[0].facet).count();
            let has_rows = self.looks.is_none() || panels.len() > quantities;
            let facets = panels.len() / quantities;
            let rows = if self.figure.facet_in == FacetPlace::Column && (2..=3).contains(&facets) {
                transposed(in_rows(quantities, charts))
            } else {
                in_rows(if quantities == 3 && has_rows { 3 } else { 2 }, charts)
            };
            let size = if rows[0].len() == 3 { [340.0, 290.0] } else { [430.0, 320.0] };
            Figure::from_charts(rows, size)
        };
        figure.colours = colours;
        figure.legend_order = self.legend_order(&key);
        figure.font_family = self.figure.font_family.clone();
        figure.title =
            self.figure.title.clone().filter(|_| self.looks.is_none()).unwrap_or_default();
        if let Err(least) = fit(&mut figure, &self.figure.size) {
            let needs = format!("a `height` of at least {least} mm for its title, axes and legend");
            return Ok(lacking(needs));
        }
        Ok(Drawn::figure(figure, self.caption(hidden, unshown)))
    }

    fn points(&self) -> impl Iterator<Item = &Point> {
        self.drawings.iter().flat_map(|one| &one.points.points)
    }

    /// Returns whether the figure has curves.
    fn has_curves(&self) -> bool {
        self.figure.panels.iter().any(|panel| !panel.curves.is_empty())
    }

    /// Returns the panels, by facets and then by vertical axes.
    fn panels(&self) -> Vec<PanelOf<'_>> {
        let mut facets = first_seen(self.points().map(|point| &point.facet));
        let order = |at: usize| in_order(facets.iter().map(|facet| &facet[at]));
        let orders: Vec<_> = (0..self.figure.facet.len()).map(order).collect();
        facets.sort_by_key(|facet| -> Vec<Option<usize>> {
            let values = facet.iter().zip(&orders);
            values.map(|(value, order)| order.iter().position(|own| *own == value)).collect()
        });
        let loads = self.stage.table.in_role(Role::Load);
        let is_of_loads = matches!(&*self.figure.facet, [facet] if loads.has(facet));
        let shown = match facets.len() {
            // Figures of every report show the lightest, the middle and the heaviest load.
            count @ 4.. if self.looks.is_some() && is_of_loads => {
                [0, count / 2, count - 1].map(|index| facets[index]).to_vec()
            }
            _ => facets,
        };
        let mut panels: Vec<PanelOf> = Vec::new();
        for facet in shown {
            for one in &self.drawings {
                let label = label(self.figure, one.quantity.base());
                let is_same = |panel: &PanelOf| {
                    panel.facet == *facet
                        && std::ptr::eq(panel.spec, one.panel)
                        && panel.label == label
                };
                if !panels.iter().any(is_same) {
                    panels.push(PanelOf { facet: facet.clone(), spec: one.panel, label });
                }
            }
        }
        panels
    }

    /// Returns what distinguishes the series of the figure.
    fn key(&self) -> SeriesKey {
        let colours = self.points().map(|point| point.colour.clone());
        let colours: Vec<Option<Value>> = colours.collect::<BTreeSet<_>>().into_iter().collect();
        let mut further: Vec<Further> = Vec::new();
        for one in &self.drawings {
            let mut own: Vec<Further> =
                one.points.points.iter().map(|point| self.further(one, point)).collect();
            own.sort();
            own.dedup();
            further
                .extend(own.into_iter().filter(|one| !further.contains(one)).collect::<Vec<_>>());
        }
        let numbers: Option<Vec<f64>> =
            colours.iter().map(|colour| number(colour.as_ref()?)).collect();
        SeriesKey { numbers: numbers.filter(|all| all.len() > 1), colours, further }
    }

    fn further(&self, one: &Drawing, point: &Point) -> Further {
        let own = label(self.figure, one.quantity.base());
        let is_beside = |other: &&Drawing| std::ptr::eq(other.panel, one.panel);
        let mut others = self.drawings.iter().filter(is_beside);
        let is_shared = others.any(|other| {
            other.quantity != one.quantity && label(self.figure, other.quantity.base()) == own
        });
        let values = one.points.others.iter().cloned().zip(point.others.iter().cloned());
        (values.collect(), is_shared.then(|| one.quantity.base().to_owned()))
    }

    fn chart(&self, panel: &PanelOf, key: &SeriesKey) -> Result<Chart, ReportError> {
        let is_shown = |one: &&Drawing| {
            std::ptr::eq(one.panel, panel.spec)
                && label(self.figure, one.quantity.base()) == panel.label
        };
        let shown = || self.drawings.iter().filter(is_shown);
        let all = || shown().flat_map(|one| &one.points.points);
        let column = shown().next().map_or("", |one| one.quantity.column.as_str());
        let x = &panel.spec.x;
        let x_unit = self.labels.unit(x, all().map(|point| point.x));
        let y_unit = self.labels.unit(column, all().map(|point| point.y));
        let [x_spacing, y_spacing] = spacings(panel.spec);
        let mut chart = Chart::new(
            Axis { spacing: x_spacing, ..Axis::linear(x_unit.label(&label(self.figure, x))) },
            Axis { spacing: y_spacing, ..Axis::linear(y_unit.label(&panel.label)) },
        );
        let mut titles = Vec::new();
        for (name, value) in self.figure.facet.iter().zip(&panel.facet) {
            match value {
                Some(value) if self.labels.is_unit(column, name) => {
                    chart.y.label = format!("{} of {value}", panel.label);
                }
                None if self.figure.facet.len() > 1 => {}
                _ => titles.push(self.title_of(name, value.as_ref())),
            }
        }
        chart.title = titles.join(" · ");
        let dashes = self.dashes();
        let mut series = Vec::new();
        for (index, one) in shown().enumerate() {
            for mut group in self.groups(one, panel, key) {
                group.points.retain(|point| can_show(panel.spec, point));
                group.points.sort_by(|one, other| one.order.total_cmp(&other.order));
                if self.looks.is_some_and(|looks| looks.has_own_axes) {
                    // Bins beyond the last one with a value are empty.
                    let last = group.points.iter().rposition(|point| point.y != 0.0);
                    group.points.truncate(last.map_or(0, |last| last + 1));
                }
                // Fitted curves, or another quantity, take the place of lines through the points.
                let is_line = self.looks.is_some() && index > 0;
                let has_lines = panel.spec.curves.iter().any(|curve| curve.is_fit_along(x))
                    || (self.looks.is_some() && shown().count() > 1);
                let is_curve = is_line || (one.points.is_curve && !has_lines);
                let mut added = Vec::new();
                let is_path = one.points.is_path;
                for (at, (style, points)) in
                    stretches(&group, is_path, &dashes).into_iter().enumerate()
                {
                    let mut placed = self.placed(&points, [&x_unit, &y_unit], y_spacing);
                    if is_path && at > 0 {
                        placed[0].bar = None;
                    }
                    added.extend(drawn(placed, style, is_curve, x_spacing));
                }
                added.retain(|one| !is_line || one.style.marker.is_none());
                if let Some(last) = added.last_mut() {
                    last.label = group.label.filter(|_| !is_line);
                }
                chart.series.extend(added);
                if index == 0 || one.quantity.is_of_areas() {
                    let points = group.points.iter().map(|point| (point.x, point.row)).collect();
                    let colour = group.style.colour;
                    series.push(DataSeries {
                        points,
                        data: &one.points,
                        quantity: one.quantity,
                        colour,
                    });
                }
            }
        }
        if self.figure.is_apart {
            spread(&mut chart.series, x_spacing);
        }
        for (index, value) in dashes.iter().enumerate() {
            let line = dashed(Style::line(Colour::Text, Dash::Solid, 1.0), index);
            let name =
                self.title_of(self.figure.dash.as_deref().unwrap_or_default(), value.as_ref());
            chart.series.push(Series::new([], line).named(name));
        }
        for one in shown().skip(1).filter(|_| self.looks.is_some()) {
            let entry = Series::new([], Style::line(Colour::Text, Dash::Solid, 1.0));
            let named = self.figure.legend.get(one.quantity.base());
            chart.series.extend(named.map(|name| entry.named(name.clone())));
        }
        if let (Some(from), Spacing::Linear) = (self.start(panel.spec), x_spacing) {
            let xs = series.iter().flat_map(|one| one.points.iter().map(|point| point.0));
            let [_, to] = chart.x.ends(xs.map(|x| x_unit.factor * x));
            chart.x = chart.x.within(x_unit.factor * from, to);
        }
        let y = shown().next().map_or("", |one| one.quantity.base());
        let axes = [(&mut chart.x, x.as_str(), &x_unit), (&mut chart.y, y, &y_unit)];
        for (axis, name, unit) in axes {
            let in_unit = |number: &f64| unit.factor * number;
            let limits = self.figure.limits.get(name).copied().unwrap_or_default();
            axis.limits = limits.map(|end| end.as_ref().map(in_unit));
            axis.ticks = self.figure.ticks.get(name).into_iter().flatten().map(in_unit).collect();
        }
        let curves = Curves {
            panel: panel.spec,
            spacing: x_spacing,
            factors: [x_unit.factor, y_unit.factor],
            tables: &|from| self.tables(from),
            colour: &|table, row| self.colour_of(table, row, &series),
            name: &|model| self.name_of_theory(model),
        };
        chart.series.extend(curves.beside(&series)?);
        Ok(chart)
    }

    /// Returns the values that lines distinguish.
    fn dashes(&self) -> Vec<&Option<Value>> {
        let values = in_order(self.points().map(|point| &point.dash));
        if self.figure.dash.is_some() { values } else { Vec::new() }
    }

    /// Returns the text of a value for titles, where no axis explains symbols: the text of the
    /// legend, with the word `load` in place of y.
    fn title_of(&self, column: &str, value: Option<&Value>) -> String {
        let told = self.told(column, value);
        let load = told.strip_prefix("y = ").filter(|_| column == LOAD.name);
        load.map_or_else(|| told.clone(), |load| format!("load {load}"))
    }

    /// Converts points to the units of the axes.
    fn placed(&self, points: &[&Point], [x, y]: [&Scaled; 2], spacing: Spacing) -> Vec<DataPoint> {
        let is_clipped = self.looks.is_some() && spacing == Spacing::Logarithmic;
        let place = |point: &&Point| {
            // Bars that reach zero have no end on a logarithmic axis.
            let lowest = if is_clipped { point.y / 10.0 } else { f64::NEG_INFINITY };
            let bar = point.bar.map(|[low, high]| [low.max(lowest), high]);
            DataPoint {
                x: x.factor * point.x,
                y: y.factor * point.y,
                bar: bar.map(|bar| bar.map(|end| y.factor * end)),
            }
        };
        points.iter().map(place).collect()
    }

    /// Returns the number at which the horizontal axis starts, if a range of x is selected.
    fn start(&self, panel: &PanelSpec) -> Option<f64> {
        let selected =
            panel.selection.get(&panel.x).or_else(|| self.figure.selection.get(&panel.x));
        match selected?.as_slice() {
            [Selected::Range(range)] => Some(range.from).filter(|from| from.is_finite()),
            _ => None,
        }
    }

    /// Returns the series of a quantity in a panel.
    fn groups<'p>(&self, one: &'p Drawing, panel: &PanelOf, key: &SeriesKey) -> Vec<Group<'p>> {
        let mut groups: Vec<Group> = Vec::new();
        let points_of_panel =
            || one.points.points.iter().filter(|point| point.facet == panel.facet);
        if let Some(Looks { styles, hidden, .. }) = self.looks {
            for point in points_of_panel() {
                let own = points::at_row(&one.points.table, point.row).without(hidden);
                let alone =
                    if point.surfaces == Some(1) { "the surface" } else { "mean of the surfaces" };
                let style = styles.markers(&own).joined();
                let label = Some(styles.name(&own, alone));
                let is_same = |group: &&mut Group| group.style == style && group.label == label;
                match groups.iter_mut().find(is_same) {
                    Some(group) => group.points.push(point),
                    None => groups.push(Group { style, label, points: vec![point] }),
                }
            }
            return groups;
        }
        for (colour, look) in key.colours.iter().enumerate() {
            for (index, further) in key.further.iter().enumerate() {
                let is_own =
                    |point: &&Point| point.colour == *look && self.further(one, point) == *further;
                let points = points_of_panel().filter(is_own).collect();
                groups.push(Group { style: key.style(colour, index), label: None, points });
            }
        }
        groups.retain(|group| !group.points.is_empty());
        groups
    }

    /// Returns the tables of a stage or, for figures of the program, of a kind of stage.
    fn tables(&self, from: &str) -> Vec<&Table> {
        let is_meant = |stage: &&FinishedStage| match self.looks {
            Some(_) => stage.kind.name() == from,
            None => stage.name == from,
        };
        self.data.finished.stages.iter().filter(is_meant).map(|stage| &stage.table).collect()
    }

    /// Returns the colour of the curve of a row of another stage: that of its parameter point, or
    /// of the series with the same value.
    fn colour_of(&self, table: &Table, row: usize, series: &[DataSeries]) -> Colour {
        if let Some(looks) = self.looks {
            return looks.styles.colour(&points::at_row(table, row).without(looks.hidden));
        }
        let cell = |name: &str, table: &Table, row| {
            Value::from_array(table.batch().column_by_name(name)?.as_ref(), row)
        };
        let is_same = |one: &&DataSeries| {
            let Some(name) = one.data.colour.as_deref() else { return true };
            let first = one.points.first();
            let own = first.and_then(|&(_, row)| cell(name, &one.data.table, row));
            own.is_some() && own == cell(name, table, row)
        };
        series.iter().find(is_same).map_or(Colour::Muted, |one| one.colour)
    }

    fn colour_scale(&self, key: &SeriesKey) -> Option<ColourScale> {
        let numbers = key.numbers.as_ref().filter(|numbers| numbers.len() > MOST_ENTRIES)?;
        let name = self.drawings[0].points.colour.as_deref()?;
        let unit = self.labels.unit(name, numbers.iter().copied());
        let [lowest, highest] =
            [numbers.first()?, numbers.last()?].map(|number| digits(unit.factor * number, 4));
        Some(ColourScale { label: unit.label(&symbols::name(name)), lowest, highest })
    }
}

/// Returns the spacings of the axes of a panel. Cutoffs are spaced by octaves.
fn spacings(panel: &PanelSpec) -> [Spacing; 2] {
    use Spacing::{Linear, Logarithmic, Octaves};
    let is_cutoff = [K_LOWER, K_ROLLOFF, K_UPPER].iter().any(|cutoff| cutoff.name == panel.x);
    let along_x = if is_cutoff { Octaves } else { Logarithmic };
    match panel.scales {
        Scales::Linear => [Linear, Linear],
        Scales::LogX => [along_x, Linear],
        Scales::LogY => [Linear, Logarithmic],
        Scales::Log => [along_x, Logarithmic],
    }
}

/// Returns whether both axes of a panel can show a point.
fn can_show(panel: &PanelSpec, point: &Point) -> bool {
    let [x, y] = spacings(panel).map(|spacing| Axis { spacing, ..Axis::linear("") });
    x.can_show(point.x) && y.can_show(point.y)
}

/// Returns different values: numbers ascending, others in order of appearance.
fn in_order<'v>(values: impl Iterator<Item = &'v Option<Value>>) -> Vec<&'v Option<Value>> {
    let mut found = first_seen(values);
    if found.iter().all(|value| value.as_ref().is_none_or(|own| number(own).is_some())) {
        found.sort();
    }
    found
}

fn first_seen<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// Returns the style of the lines with this index among the values that lines distinguish. The
/// first line is wide, so that it is seen below others at the same points.
fn dashed(style: Style, index: usize) -> Style {
    let width = if index == 0 { 2.4 } else { 1.4 };
    Style { line: Some(Line { dash: DASHES[index % DASHES.len()], width }), ..style }
}

/// Splits the points of a series by the values that lines distinguish. Along a path, a stretch
/// begins with the last point of the one before.
fn stretches<'p>(
    group: &Group<'p>,
    is_path: bool,
    dashes: &[&Option<Value>],
) -> Vec<(Style, Vec<&'p Point>)> {
    if dashes.is_empty() || group.points.is_empty() {
        return vec![(group.style, group.points.clone())];
    }
    let index_of = |point: &Point| dashes.iter().position(|value| **value == point.dash);
    let mut points = group.points.clone();
    if !is_path {
        points.sort_by_key(|point| index_of(point));
    }
    let mut turn = None;
    let stretches = points.chunk_by(|one, other| one.dash == other.dash).map(|stretch| {
        let first = turn.filter(|_| is_path);
        turn = stretch.last().copied();
        let style = dashed(group.style, index_of(stretch[0]).unwrap_or(0));
        (style, first.into_iter().chain(stretch.iter().copied()).collect())
    });
    stretches.collect()
}

/// Shifts series sideways by parts of the axis, so that error bars stand beside each other.
fn spread(series: &mut [Series], spacing: Spacing) {
    const ASIDE: f64 = 0.025;
    let is_linear = spacing == Spacing::Linear;
    let along = |x: f64| if is_linear { x } else { x.ln() };
    let places = series.iter().flat_map(|one| &one.points).map(|point| along(point.x));
    let least = places.clone().fold(f64::INFINITY, f64::min);
    let most = places.fold(f64::NEG_INFINITY, f64::max);
    let reach = match (most > least, is_linear) {
        (true, _) => most - least,
        (false, true) => most.abs(),
        (false, false) => 1.0,
    };
    let middle = (series.len() as f64 - 1.0) / 2.0;
    for (index, one) in series.iter_mut().enumerate() {
        let aside = ASIDE * reach * (index as f64 - middle);
        let shifted = |x: f64| if is_linear { x + aside } else { x * aside.exp() };
        one.points.iter_mut().for_each(|point| point.x = shifted(point.x));
    }
}

/// Returns the series of points: separate markers or, for a curve, a line through all points and
/// markers at some of them, evenly spaced along the axis.
fn drawn(points: Vec<DataPoint>, style: Style, is_curve: bool, spacing: Spacing) -> Vec<Series> {
    let series = |points, style| Series { points, ..Series::new([], style) };
    let line = series(points.clone(), Style { marker: None, ..style });
    let has_course = points.iter().any(|point| point.x != points[0].x);
    let line = (is_curve && has_course).then(|| line.without_bars());
    let marked = if is_curve { spaced(points, spacing) } else { points };
    let markers = series(marked, Style { line: None, ..style });
    line.into_iter().chain([markers]).collect()
}

/// Selects about [`MOST_MARKERS`] points along the axis, or all if there are few.
fn spaced(points: Vec<DataPoint>, spacing: Spacing) -> Vec<DataPoint> {
    let along = |point: &DataPoint| match spacing {
        Spacing::Linear => point.x,
        Spacing::Logarithmic | Spacing::Octaves => point.x.ln(),
    };
    if points.len() <= MOST_MARKERS {
        return points;
    }
    let positions = points.iter().map(along);
    let least = positions.clone().fold(f64::INFINITY, f64::min);
    let most = positions.fold(f64::NEG_INFINITY, f64::max);
    let step = (most - least) / MOST_MARKERS as f64;
    let mut last = f64::NEG_INFINITY;
    let mut kept = points;
    kept.retain(|point| {
        let is_kept = (along(point) - last).abs() >= step;
        if is_kept {
            last = along(point);
        }
        is_kept
    });
    kept
}

/// Gives the panels of a figure the same axis where they show the same quantity. Without
/// `with_curves`, a common axis holds only the data, and that of a single panel stays as it is.
fn share_axes(charts: &mut [Chart], with_curves: bool) {
    type Of = fn(&Chart) -> &Axis;
    let xs = |point: &DataPoint| vec![point.x];
    let ys =
        |point: &DataPoint| point.bar.map_or(vec![point.y], |[low, high]| vec![low, point.y, high]);
    let all = charts.to_vec();
    let shared = |axis: &Axis, of: Of, values: &dyn Fn(&DataPoint) -> Vec<f64>| -> Axis {
        let is_alike =
            |chart: &&Chart| of(chart).label == axis.label && of(chart).spacing == axis.spacing;
        let alike = || all.iter().filter(is_alike);
        if axis.range.is_some() || (alike().count() < 2 && !with_curves) {
            return axis.clone();
        }
        let series = alike().flat_map(|chart| &chart.series);
        let shown = series.filter(|series| with_curves || !series.is_guide());
        let points: Vec<f64> = shown.flat_map(|one| &one.points).flat_map(values).collect();
        let [from, to] = axis.ends(points.into_iter());
        axis.clone().within(from, to)
    };
    for chart in charts {
        chart.x = shared(&chart.x, |chart| &chart.x, &xs);
        chart.y = shared(&chart.y, |chart| &chart.y, &ys);
    }
}
