//! Figures for a page: one drawing for each panel, so that panels stack on a narrow screen, and a
//! legend outside of the drawings.
//!
//! Each series of a chart is a group with the attributes `data-entry`, the index of its legend
//! entry, and `data-points`, its values. The group of a chart has the attributes `data-box`, the
//! area between its axes in pixels, and `data-x` and `data-y`, the ends and spacings of its axes.
//! A script of the page reads them to show values and to hide series. Without it, the drawings and
//! the legend are complete.

use std::fmt::Write;

use kuva::backend::svg::SvgBackend;
use kuva::render::layout::ComputedLayout;
use kuva::render::render::{Primitive, Scene, render_multiple};
use minijinja::{Value, context};

use crate::charts::axis::Spacing;
use crate::charts::chart::{Chart, Frame, Series};
use crate::charts::map_panel::{Frame as MapFrame, WORDS};
use crate::charts::style::Colour;
use crate::charts::svg::{Size, escaped, finished};
use crate::charts::{Entry, Figure, Legend, Panel, SAMPLE, add_shifted};
use asperity_manifest::decimal;

/// Largest width of a chart in pixels. On a screen of 390 pixels, its texts are then at least 10
/// pixels high.
const WIDEST: f64 = 400.0;
/// Largest factor by which a panel grows on a wide screen.
const GROW: f64 = 1.25;
/// Margin around a panel in pixels.
const MARGIN: f64 = 2.0;
/// Largest number of values of a curve without markers in the attributes of its group. More values
/// would be closer together than a pointer can tell.
const MOST_VALUES: usize = 60;

impl Figure {
    /// Returns the figure for the template of a page: rows of `panels` in a number of `columns`
    /// that is the same for all, the scale of `colours`, and the entries of the `legend`, each with
    /// `label` and `sample`. Drawings are SVG; `name` makes their identifiers unique.
    pub fn for_page(&self, name: &str) -> Value {
        let legend = self.entries();
        let maps = self.rows.iter().flatten().filter_map(Panel::map);
        let frame = MapFrame::new(maps, self.panel[0]);
        let columns = self.columns() as usize;
        let mut panels = 0;
        let mut draw = |panel: &Panel| {
            panels += 1;
            self.draw_panel(panel, &frame, &legend, &format!("{name}-{panels}"))
        };
        let mut rows = Vec::new();
        for row in &self.rows {
            let panels: Vec<String> = row.iter().map(&mut draw).collect();
            rows.push(context! { columns, panels });
        }
        let colours = self.colours.as_ref().map(|scale| {
            let mut scene = empty_scene([WIDEST, scale.height(WIDEST)]);
            let width = scene.width;
            scale.draw(&mut scene, MARGIN, width);
            finished(scene, "", &format!("{name}-colours"), Size::Page(1.0))
        });
        let entries = legend.iter().map(|entry| {
            context! { label => entry.label.as_str(), sample => sample(entry) }
        });
        context! { rows, colours, legend => entries.collect::<Vec<_>>() }
    }

    fn draw_panel(&self, panel: &Panel, frame: &MapFrame, legend: &[Entry], name: &str) -> String {
        let [width, height] = self.panel;
        let mut pictures = String::new();
        match panel {
            Panel::Chart(chart) => {
                let scale = (WIDEST / width).min(1.0);
                // Flat charts need room for the numbers and labels of their axes.
                let width = scale * width;
                let height = (1.08 * scale * height).min(height);
                let size = [width, height.max(chart.least_height(width, WORDS))];
                let mut scene = empty_scene(size);
                add_shifted(&mut scene, chart.draw_in_groups(size, legend), [MARGIN; 2]);
                finished(scene, &pictures, name, Size::Page(GROW))
            }
            Panel::Map(map) => {
                let mut scene = empty_scene(self.panel);
                map.draw(self.panel, frame, [MARGIN; 2], &mut scene, &mut pictures);
                finished(scene, &pictures, name, Size::Page(GROW))
            }
            Panel::Blank => String::new(),
        }
    }
}

fn empty_scene([width, height]: [f64; 2]) -> Scene {
    let mut scene = Scene::new((width + 2.0 * MARGIN).ceil(), (height + 2.0 * MARGIN).ceil());
    scene.background_color = None;
    scene.text_color = Some(Colour::Text.css());
    scene.font_family = Some(crate::charts::FONT_FAMILY.to_owned());
    scene
}

/// Returns the line and the marker of an entry as SVG.
fn sample(entry: &Entry) -> String {
    let (width, height) = (SAMPLE - 8.0, f64::from(WORDS));
    let mut scene = Scene::new(width, height);
    scene.background_color = None;
    let legend = Legend::new(Vec::new(), width, WORDS - 1);
    legend.draw_sample(&mut scene, entry, 0.0, height / 2.0);
    SvgBackend::new().render_scene(&scene)
}

impl Chart {
    /// Draws the chart with a group for each series.
    fn draw_in_groups(&self, size: [f64; 2], legend: &[Entry]) -> Scene {
        let frame = Frame::new(self);
        let layout = || self.layout(&frame, size, WORDS);
        let computed = ComputedLayout::from_layout(&layout());
        let mut scene = self.draw(size, WORDS);
        let is_clip = |element: &Primitive| matches!(element, Primitive::ClipStart { .. });
        let Some(from) = scene.elements.iter().position(is_clip) else { return scene };
        let mut groups = Vec::new();
        let mut drawn = 0;
        for (index, series) in self.series.iter().enumerate() {
            let entry = entry_attribute(entry_of(self, index, legend));
            groups.push(group(format!("{entry}{}", values(self, series, &frame))));
            let plots = self.plots(series, &frame, WORDS);
            let elements = inside(render_multiple(plots, layout()));
            drawn += elements.len();
            groups.extend(elements);
            groups.push(Primitive::GroupEnd);
        }
        // Notes follow after the series.
        scene.elements.splice(from + 1..=from + drawn, groups);
        // The error bars of all series stand before the clipped elements, in the order of series.
        let bars = self.series.iter().enumerate().filter_map(|(index, series)| {
            let bars = self.bars(series, &frame, &computed)?;
            let opening = group(entry_attribute(entry_of(self, index, legend)));
            Some([opening, bars, Primitive::GroupEnd])
        });
        let bars: Vec<Primitive> = bars.flatten().collect();
        scene.elements.splice(from - bars.len() / 3..from, bars);
        let axes = format!(
            "class=\"chart\" data-box=\"{:.1} {:.1} {:.1} {:.1}\"{}{}",
            computed.margin_left,
            computed.margin_top,
            computed.plot_width(),
            computed.plot_height(),
            axis_attribute("x", &self.x.label, frame.x, frame.spacing[0]),
            axis_attribute("y", &self.y.label, frame.y, frame.spacing[1]),
        );
        scene.elements.insert(0, group(axes));
        scene.elements.push(Primitive::GroupEnd);
        scene
    }
}

/// Opens a group with these attributes.
fn group(attributes: String) -> Primitive {
    Primitive::GroupStart { transform: None, title: None, extra_attrs: Some(attributes) }
}

/// Returns the index of the legend entry of a series. A series without a label belongs to the
/// nearest labelled series of the same colour, such as the line through the markers of a mean.
fn entry_of(chart: &Chart, index: usize, legend: &[Entry]) -> Option<usize> {
    let series = &chart.series[index];
    let is_alike = |other: &&Series| {
        other.label.is_some()
            && (std::ptr::eq(*other, series)
                || (series.label.is_none() && other.style.colour == series.style.colour))
    };
    let (before, after) = chart.series.split_at(index);
    let alike = after.iter().find(is_alike).or_else(|| before.iter().rev().find(is_alike));
    let label = alike?.label.as_ref()?;
    legend.iter().position(|entry| entry.label == *label)
}

fn entry_attribute(entry: Option<usize>) -> String {
    entry.map_or_else(
        || "class=\"series\"".to_owned(),
        |entry| format!("class=\"series\" data-entry=\"{entry}\""),
    )
}

fn axis_attribute(name: &str, label: &str, [from, to]: [f64; 2], spacing: Spacing) -> String {
    let scale = if spacing == Spacing::Linear { "linear" } else { "log" };
    let label = escaped(label);
    format!(" data-{name}=\"{from:e} {to:e} {scale}\" data-{name}-label=\"{label}\"")
}

/// Returns the attribute with the values of the points that a chart shows: `x,y` or, with an error
/// bar, `x,y,lower,upper`.
fn values(chart: &Chart, series: &Series, frame: &Frame) -> String {
    let shown: Vec<_> = chart.placed(series).filter(|point| frame.holds(point)).collect();
    let step = if series.style.marker.is_some() { 1 } else { shown.len().div_ceil(MOST_VALUES) };
    let mut written = String::new();
    for point in shown.into_iter().step_by(step.max(1)) {
        let space = if written.is_empty() { "" } else { " " };
        let _ = write!(written, "{space}{},{}", short(point.x), short(point.y));
        if let Some([lower, upper]) = point.bar {
            let _ = write!(written, ",{},{}", short(lower), short(upper));
        }
    }
    if written.is_empty() { written } else { format!(" data-points=\"{written}\"") }
}

/// Formats a number with five significant digits.
fn short(value: f64) -> String {
    format!("{value:.4e}").parse().map_or_else(|_| value.to_string(), decimal::written)
}

/// Returns the elements of a chart that lie between its axes.
fn inside(scene: Scene) -> Vec<Primitive> {
    let mut elements = scene.elements.into_iter();
    elements.find(|element| matches!(element, Primitive::ClipStart { .. }));
    elements.take_while(|element| !matches!(element, Primitive::ClipEnd)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::axis::Axis;
    use crate::charts::chart::DataPoint;
    use crate::charts::entries;
    use crate::charts::style::{self, Dash, Style};

    /// A mean with error bars, the line through it, and a theory.
    fn chart() -> Chart {
        let mut chart = Chart::new(Axis::linear("load y"), Axis::logarithmic("area < \"1\""));
        let line = Style::line(Colour::Series(0), Dash::Solid, 1.0);
        chart.series.push(Series::new([(0.5, 0.25), (1.0, 1.0)], line));
        let point = |x: f64| DataPoint { x, y: x * x, bar: Some([0.5 * x * x, 2.0 * x * x]) };
        chart.series.push(Series {
            points: [0.5, 1.0, f64::NAN].map(point).to_vec(),
            style: Style::marker(Colour::Series(0), style::marker(1)),
            label: Some("mean".to_owned()),
            is_held: false,
        });
        let theory = Style::line(Colour::Text, Dash::Dashed, 1.0);
        chart.series.push(Series::new([(0.5, 0.25), (1.0, 1.0)], theory).named("theory"));
        chart
    }

    fn attribute(of: &Value, name: &str) -> Vec<Value> {
        of.get_attr(name).unwrap().try_iter().unwrap().collect()
    }

    fn panels(figure: &Value) -> Vec<String> {
        let row = &attribute(figure, "rows")[0];
        attribute(row, "panels").iter().map(Value::to_string).collect()
    }

    fn panel() -> String {
        panels(&Figure::from_chart(chart()).for_page("area"))[0].clone()
    }

    #[test]
    fn each_series_has_its_values_and_the_entry_of_its_label() {
        let svg = panel();
        assert!(svg.contains("data-entry=\"0\" data-points=\"0.5,0.25,0.125,0.5 1,1,0.5,2\""));
        assert!(svg.contains("data-entry=\"1\" data-points=\"0.5,0.25 1,1\""));
        // The line through the means is hidden with them, and so are the error bars.
        assert_eq!(svg.matches("data-entry=\"0\"").count(), 3);
        assert!(svg.contains("data-x-label=\"load y\"") && !svg.contains("NaN"));
        assert!(svg.contains("data-y-label=\"area &lt; &quot;1&quot;\""), "{svg}");
    }

    #[test]
    fn groups_change_nothing_of_what_is_drawn() {
        let size = [400.0, 300.0];
        let legend = entries(chart().series.iter());
        let elements = |scene: Scene| {
            let drawn = scene.elements.into_iter();
            let is_group = |element: &Primitive| {
                matches!(element, Primitive::GroupStart { transform: None, .. })
                    || matches!(element, Primitive::GroupEnd)
            };
            let drawn = drawn.filter(|element| !is_group(element));
            drawn.map(|element| format!("{element:?}")).collect::<Vec<_>>()
        };
        let without_numbers = |all: Vec<String>| {
            let is_clip = |element: &&String| element.contains("ClipStart");
            all.iter().filter(|element| !is_clip(element)).cloned().collect::<Vec<_>>()
        };
        let plain = without_numbers(elements(chart().draw(size, WORDS)));
        assert_eq!(without_numbers(elements(chart().draw_in_groups(size, &legend))), plain);
    }

    #[test]
    fn panels_have_their_own_drawings_and_one_legend() {
        let figure =
            Figure::from_charts(vec![vec![chart(), chart()]], [430.0, 340.0]).for_page("two");
        let columns = attribute(&figure, "rows")[0].get_attr("columns").unwrap();
        assert_eq!(columns, Value::from(2));
        let [left, right] = &panels(&figure)[..] else { panic!("two panels") };
        assert!(left.contains("two-1-clip-0") && right.contains("two-2-clip-0"));
        let legend = attribute(&figure, "legend");
        let of = |name: &str| -> Vec<String> {
            legend.iter().map(|entry| entry.get_attr(name).unwrap().to_string()).collect()
        };
        assert_eq!(of("label"), ["mean", "theory"]);
        assert!(of("sample").iter().all(|sample| sample.starts_with("<svg")));
    }
}
