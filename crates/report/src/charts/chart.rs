//! Series of points over two axes.

use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::layout::{AxisLabelOverlap, ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor, render_multiple};
use kuva::{AxisLine, Theme, TickAlign};

use crate::charts::axis::{Axis, Spacing};
use crate::charts::map_panel::words;
use crate::charts::style::{Colour, Style};
use crate::charts::text::{letters_in_line, widest_line, width_in_two_lines, width_of};

/// Width in pixels below which a chart has fewer ticks.
const NARROW: f64 = 330.0;
/// Distance of a label from the edge of the panel, in pixels.
const EDGE: f64 = 2.0;
/// Smallest height of the area between the axes, in pixels.
const LOWEST: f64 = 80.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Short text above the chart; empty for none.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
}

/// Points with a common style and label.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Points, ascending in x if a line joins them.
    pub points: Vec<DataPoint>,
    pub style: Style,
    /// Label in the legend, where series with the same label share one entry.
    pub label: Option<String>,
    /// Whether the axes hold all points, even of a line that is drawn for comparison.
    pub is_held: bool,
}

/// A point with an optional error bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataPoint {
    pub x: f64,
    pub y: f64,
    /// Ends of the error bar.
    pub bar: Option<[f64; 2]>,
}

impl Series {
    /// Creates a series of points without error bars.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>, style: Style) -> Series {
        Series {
            points: points.into_iter().map(|(x, y)| DataPoint { x, y, bar: None }).collect(),
            style,
            label: None,
            is_held: false,
        }
    }

    /// Creates a smooth curve of the function `of` over a range, with points evenly spaced on an
    /// axis with the spacing `on`.
    pub fn curve(
        of: impl Fn(f64) -> f64,
        [from, to]: [f64; 2],
        on: Spacing,
        style: Style,
    ) -> Series {
        const STEPS: u32 = 160;
        let at = |step: u32| {
            let share = f64::from(step) / f64::from(STEPS);
            match on {
                Spacing::Linear => from + share * (to - from),
                Spacing::Logarithmic | Spacing::Octaves => from * (to / from).powf(share),
            }
        };
        Series::new((0..=STEPS).map(|step| (at(step), of(at(step)))), style)
    }

    /// Returns true for a theory, an asymptote or another line that is drawn for comparison.
    pub fn is_guide(&self) -> bool {
        let is_plain = matches!(self.style.colour, Colour::Text | Colour::Muted);
        is_plain && self.style.marker.is_none() && !self.is_held
    }

    pub fn without_bars(mut self) -> Series {
        self.points.iter_mut().for_each(|point| point.bar = None);
        self
    }

    pub fn named(self, label: impl Into<String>) -> Series {
        Series { label: Some(label.into()), ..self }
    }
}

impl Chart {
    /// Creates a chart without series.
    pub fn new(x: Axis, y: Axis) -> Chart {
        Chart { title: String::new(), x, y, series: Vec::new() }
    }

    /// Returns true if the data have at least two distinct values of x. The data are the series
    /// with markers or, without any, all series but guides or, without these, all series.
    pub fn shows_a_course(&self) -> bool {
        let has_marker = |series: &&Series| series.style.marker.is_some();
        let is_data = |series: &&Series| !series.is_guide();
        let all = || self.series.iter().filter(|series| !series.points.is_empty());
        let data: Vec<&Series> = if all().any(|series| has_marker(&series)) {
            all().filter(has_marker).collect()
        } else if all().any(|series| is_data(&series)) {
            all().filter(is_data).collect()
        } else {
            all().collect()
        };
        let mut shown = data.into_iter().flat_map(|series| self.placed(series));
        let first = shown.next();
        first.is_some_and(|first| shown.any(|point| point.x != first.x))
    }

    /// Removes the guides of which no part lies between the axes.
    pub fn remove_unseen_guides(&mut self) {
        let frame = Frame::new(self);
        let is_seen = |series: &Series| series.points.iter().any(|point| frame.holds(point));
        self.series.retain(|series| {
            // A series without points is the entry of a legend.
            !series.is_guide() || series.points.is_empty() || is_seen(series)
        });
    }

    /// Multiplies all values along x by a factor and gives the axis another label.
    pub fn convert_x(&mut self, factor: f64, label: String) {
        self.x.convert(factor, label);
        self.series.iter_mut().flat_map(|one| &mut one.points).for_each(|point| point.x *= factor);
    }

    /// Multiplies all values along y by a factor and gives the axis another label.
    pub fn convert_y(&mut self, factor: f64, label: String) {
        self.y.convert(factor, label);
        for point in self.series.iter_mut().flat_map(|one| &mut one.points) {
            point.y *= factor;
            point.bar = point.bar.map(|ends| ends.map(|end| factor * end));
        }
    }

    /// Draws the chart with `size` = [width, height] in pixels and the font size `words`.
    pub(super) fn draw(&self, size: [f64; 2], words: u32) -> Scene {
        let frame = Frame::new(self);
        let layout = self.layout(&frame, size, words);
        let computed = ComputedLayout::from_layout(&layout);
        let series = || self.series.iter();
        let plots = series().flat_map(|series| self.plots(series, &frame, words));
        let mut scene = render_multiple(plots.collect(), layout);
        self.replace_ticks(&mut scene.elements, &frame, &computed);
        let bars = series().filter_map(|series| self.bars(series, &frame, &computed));
        // Draw error bars below the points: after the axes, before the clipped elements.
        let mut elements = scene.elements.iter();
        let first = elements.position(|element| matches!(element, Primitive::ClipStart { .. }));
        let at = first.unwrap_or(scene.elements.len());
        scene.elements.splice(at..at, bars.collect::<Vec<_>>());
        scene
    }

    /// Draws the ticks that the manifest declares in the place of those of the drawing crate.
    fn replace_ticks(&self, elements: &mut Vec<Primitive>, frame: &Frame, layout: &ComputedLayout) {
        let [left, top] = [layout.margin_left, layout.margin_top];
        let [right, bottom] =
            [layout.width - layout.margin_right, layout.height - layout.margin_bottom];
        let major = layout.tick_mark_major;
        let size = f64::from(layout.tick_size);
        let axes =
            [(&self.x, frame.x, &layout.x_tick_format), (&self.y, frame.y, &layout.y_tick_format)];
        for (along, (axis, [from, to], format)) in axes.into_iter().enumerate() {
            if axis.ticks.is_empty() {
                continue;
            }
            let data = elements.iter().position(|one| matches!(one, Primitive::ClipStart { .. }));
            let rest = elements.split_off(data.unwrap_or(elements.len()));
            let is_tick = |x1: f64, y1: f64, x2: f64, y2: f64| match along {
                0 => x1 == x2 && ((y2 - y1).abs() <= major || (x1 != left && x1 != right)),
                _ => y1 == y2 && ((x2 - x1).abs() <= major || (y1 != top && y1 != bottom)),
            };
            elements.retain(|element| match *element {
                Primitive::Line { x1, y1, x2, y2, .. } => !is_tick(x1, y1, x2, y2),
                Primitive::Text { size, anchor: TextAnchor::Middle, .. } => {
                    along == 1 || size != layout.tick_size
                }
                Primitive::Text { size, anchor: TextAnchor::End, .. } => {
                    along == 0 || size != layout.tick_size
                }
                _ => true,
            });
            let line = |[x1, y1, x2, y2]: [f64; 4], colour: Colour, stroke_width: f64| {
                let stroke = colour.css().into();
                Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray: None }
            };
            for &tick in axis.ticks.iter().filter(|tick| (from..=to).contains(*tick)) {
                let drawn = frame.spacing[along].drawn_number(tick, frame.lift[along]);
                let content = format.format(drawn);
                // The letters of a number along y are centred at its tick.
                let (grid, mark, at, anchor) = if along == 0 {
                    let x = layout.map_x(drawn);
                    let at = [x, bottom + major + 0.93 * size];
                    ([x, top, x, bottom], [x, bottom - major, x, bottom], at, TextAnchor::Middle)
                } else {
                    let y = layout.map_y(drawn);
                    let at = [left - layout.tick_label_margin, y + 0.365 * size];
                    ([left, y, right, y], [left, y, left + major, y], at, TextAnchor::End)
                };
                if tick != from && tick != to {
                    elements.push(line(grid, Colour::Grid, layout.grid_stroke_width));
                }
                elements.push(line(mark, Colour::Text, layout.tick_stroke_width));
                elements.push(words(content, at, layout.tick_size, anchor));
            }
            elements.extend(rest);
        }
    }

    pub(super) fn layout(&self, frame: &Frame, [width, height]: [f64; 2], words: u32) -> Layout {
        let (x_from, y_from) = frame.placed(frame.x[0], frame.y[0]);
        let (x_to, y_to) = frame.placed(frame.x[1], frame.y[1]);
        let mut layout = Layout::new((x_from, x_to), (y_from, y_to))
            .with_width(width)
            .with_height(height)
            .with_x_axis_min(x_from)
            .with_x_axis_max(x_to)
            .with_y_axis_min(y_from)
            .with_y_axis_max(y_to)
            .with_x_label(self.x.label.clone())
            .with_y_label(self.y.label.clone())
            .with_x_tick_format(frame.spacing[0].ticks(frame.lift[0], frame.x, &self.x.ticks))
            .with_y_tick_format(frame.spacing[1].ticks(frame.lift[1], frame.y, &self.y.ticks))
            .with_axis_line(AxisLine::Box)
            .with_tick_align(TickAlign::Inside)
            .with_ticks(if width < NARROW { 3 } else { 5 })
            .with_x_label_overlap(AxisLabelOverlap::Thin)
            .with_label_size(words)
            .with_tick_size(words - 1)
            .with_title_size(words)
            .with_body_size(words)
            .with_theme(theme());
        if !self.title.is_empty() {
            layout = layout.with_title(self.title.clone());
        }
        layout = match frame.spacing[0] {
            Spacing::Linear => layout,
            Spacing::Logarithmic => layout.with_log_x(),
            Spacing::Octaves => layout.with_x_tick_step(1.0),
        };
        layout = match frame.spacing[1] {
            Spacing::Linear => layout,
            Spacing::Logarithmic => layout.with_log_y(),
            Spacing::Octaves => layout.with_y_tick_step(1.0),
        };
        // Half of the last number of the axis is in the margin. The crate assumes that it has as
        // many digits as the end of the axis, and less room in a narrow panel.
        let last = match frame.spacing[0] {
            Spacing::Linear => rounded(x_to, 3),
            Spacing::Logarithmic => rounded(x_to, 1),
            Spacing::Octaves => x_to.floor(),
        };
        let half = width_of(&layout.x_tick_format.format(last), words - 1) / 2.0;
        layout.force_margin_right = Some(half.max(f64::from(words)));
        // The margin holds the numbers of the crate's own ticks along y.
        if !self.y.ticks.is_empty() {
            let drawn = |tick: &f64| frame.spacing[1].drawn_number(*tick, frame.lift[1]);
            let texts = self.y.ticks.iter().map(|tick| layout.y_tick_format.format(drawn(tick)));
            let widest = texts.map(|text| width_of(&text, words - 1)).fold(0.0, f64::max);
            let computed = ComputedLayout::from_layout(&layout);
            let more = widest - computed.y_tick_label_px;
            layout.force_margin_left = Some(computed.margin_left + more.max(0.0));
        }
        self.with_fitting_labels(layout, [width, height], words)
    }

    /// Breaks the labels of the axes and the title into lines that fit into the panel, and shifts a
    /// label that would reach beyond its edge.
    fn with_fitting_labels(&self, mut layout: Layout, [w, h]: [f64; 2], words: u32) -> Layout {
        // The number of lines of one label changes the place of the others.
        for _ in 0..3 {
            let computed = ComputedLayout::from_layout(&layout);
            let y_end =
                computed.margin_left - computed.y_tick_label_px - computed.tick_label_margin;
            let inner = [
                computed.margin_left + computed.plot_width() / 2.0,
                computed.margin_top + computed.plot_height() / 2.0,
            ];
            let (letters, shift) = fitted(&self.y.label, inner[1], [EDGE, h - EDGE], words);
            layout = layout.with_y_label_wrap(letters).with_y_label_offset(0.0, shift);
            let (letters, shift) = fitted(&self.x.label, inner[0], [y_end, w - EDGE], words);
            layout = layout.with_x_label_wrap(letters).with_x_label_offset(shift, 0.0);
            let room = 2.0 * (inner[0] - EDGE).min(w - EDGE - inner[0]);
            layout = layout.with_title_wrap(letters_in_line(&self.title, room, words));
        }
        layout
    }

    /// Returns the smallest height of a panel of this width that holds the labels of its axes, in
    /// pixels.
    pub(super) fn least_height(&self, width: f64, words: u32) -> f64 {
        let any_height = [width, 1000.0];
        let computed =
            ComputedLayout::from_layout(&self.layout(&Frame::new(self), any_height, words));
        let between = computed.margin_top + LOWEST + computed.margin_bottom;
        between.max(width_in_two_lines(&self.y.label, words) + 2.0 * EDGE)
    }

    pub(super) fn plots(&self, series: &Series, frame: &Frame, words: u32) -> Vec<Plot> {
        let to_place = |point: &DataPoint| frame.placed(point.x, point.y);
        let colour = series.style.colour.css();
        let mut plots = Vec::new();
        if let Some(line) = series.style.line {
            let drawn = LinePlot::new()
                .with_data(self.placed(series).map(to_place).collect::<Vec<_>>())
                .with_color(colour.clone())
                .with_stroke_width(line.width)
                .with_line_style(line.dash.pattern());
            plots.push(Plot::Line(drawn));
        }
        if let Some(marker) = series.style.marker {
            let seen = self.placed(series).filter(|point| frame.holds(point));
            let drawn = ScatterPlot::new()
                .with_data(seen.map(to_place).collect::<Vec<_>>())
                .with_color(colour)
                .with_marker(marker)
                .with_size(f64::from(words) * 0.23);
            plots.push(Plot::Scatter(drawn));
        }
        plots
    }

    pub(super) fn bars(
        &self,
        series: &Series,
        frame: &Frame,
        layout: &ComputedLayout,
    ) -> Option<Primitive> {
        let mut path = String::new();
        let seen = self.placed(series).filter(|point| frame.holds(point));
        for (point, bar) in seen.filter_map(|point| Some((point, point.bar?))) {
            let pixel = |end: f64| {
                let (x, y) = frame.placed(point.x, end.clamp(frame.y[0], frame.y[1]));
                [layout.map_x(x), layout.map_y(y)]
            };
            let ([x, low], [_, high]) = (pixel(bar[0]), pixel(bar[1]));
            path += &format!("M{x:.1} {low:.1}V{high:.1}");
        }
        (!path.is_empty()).then(|| {
            Primitive::Path(Box::new(PathData {
                d: path,
                fill: None,
                stroke: series.style.colour.css().into(),
                stroke_width: 1.0,
                opacity: Some(0.55),
                stroke_dasharray: None,
            }))
        })
    }

    /// Returns the points of a series that the axes can show.
    pub(super) fn placed<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = &'a DataPoint> {
        let has_place = |point: &&DataPoint| self.x.can_show(point.x) && self.y.can_show(point.y);
        series.points.iter().filter(has_place)
    }
}

/// Rounds a number to significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// Returns the number of letters in a line of a label that is centred at `centre`, and the distance
/// by which it has to be shifted to lie between `from` and `to`.
fn fitted(label: &str, centre: f64, [from, to]: [f64; 2], words: u32) -> (usize, f64) {
    let letters = letters_in_line(label, to - from, words);
    let half = widest_line(label, letters, words) / 2.0;
    let shift = (from - (centre - half)).max(0.0) + (to - (centre + half)).min(0.0);
    (letters, shift)
}

/// Ends of the two axes, and the conversion of points to the numbers that the drawing crate draws.
pub(super) struct Frame {
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
    pub(super) spacing: [Spacing; 2],
    lift: [f64; 2],
}

impl Frame {
    pub(super) fn new(chart: &Chart) -> Frame {
        let x = ends(&chart.x, &chart.series, |point| vec![point.x]);
        let heights = |point: &DataPoint| {
            let [low, high] = point.bar.unwrap_or([point.y; 2]);
            if (x[0]..=x[1]).contains(&point.x) { vec![point.y, low, high] } else { Vec::new() }
        };
        let y = ends(&chart.y, &chart.series, heights);
        let spacing = [chart.x.spacing_between(x), chart.y.spacing_between(y)];
        Frame { x, y, spacing, lift: [spacing[0].lift(x), spacing[1].lift(y)] }
    }

    pub(super) fn holds(&self, point: &DataPoint) -> bool {
        let is_within = |[from, to]: [f64; 2], value| (from..=to).contains(&value);
        is_within(self.x, point.x) && is_within(self.y, point.y)
    }

    fn placed(&self, x: f64, y: f64) -> (f64, f64) {
        let [along_x, along_y] = self.spacing;
        (along_x.drawn_number(x, self.lift[0]), along_y.drawn_number(y, self.lift[1]))
    }
}

/// Returns the ends of an axis of a chart. They follow the data. Guides, such as theories, are in
/// sight where they are near the data.
fn ends(axis: &Axis, series: &[Series], values: impl Fn(&DataPoint) -> Vec<f64>) -> [f64; 2] {
    let of = |is_guide: bool| {
        let own = series.iter().filter(move |series| series.is_guide() == is_guide);
        own.flat_map(|series| &series.points).flat_map(&values)
    };
    let data: Vec<f64> = of(false).collect();
    let guides = of(true);
    match axis.reach(data.iter().copied()) {
        None => axis.ends(guides),
        Some([from, to]) => {
            let near = guides.filter(|value| (from..=to).contains(value));
            axis.ends(near.chain(data.iter().copied()))
        }
    }
}

fn theme() -> Theme {
    let text = Colour::Text.css();
    Theme {
        background: Colour::Background.css(),
        axis_color: text.clone(),
        grid_color: Colour::Grid.css(),
        tick_color: text.clone(),
        text_color: text,
        ..Theme::light()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::style::{self, Dash};

    fn chart(data: &[(f64, f64)], guide: &[(f64, f64)]) -> Chart {
        let mut chart = Chart::new(Axis::linear("x"), Axis::linear("y"));
        let markers = Style::marker(Colour::Series(0), style::marker(0));
        let line = Style::line(Colour::Text, Dash::Dashed, 1.0);
        chart.series.push(Series::new(data.iter().copied(), markers));
        chart.series.push(Series::new(guide.iter().copied(), line));
        chart
    }

    #[test]
    fn axes_follow_the_data_and_not_guides_far_from_them() {
        let data = [(1.0, 10.0), (2.0, 20.0)];
        let alone = Frame::new(&chart(&data, &[]));
        let far = Frame::new(&chart(&data, &[(0.0, 900.0), (1.5, 900.0), (7.0, 15.0)]));
        assert_eq!((alone.x, alone.y), (far.x, far.y));
        let near = Frame::new(&chart(&data, &[(0.9, 15.0), (1.5, 21.0)]));
        assert!(near.x[0] < 0.9 && near.y[1] > 21.0, "{:?} {:?}", near.x, near.y);
        let only_a_guide = Frame::new(&chart(&[], &[(0.0, 1.0), (7.0, 900.0)]));
        assert!(only_a_guide.y[1] > 900.0);
    }

    #[test]
    fn a_chart_of_one_place_shows_no_course() {
        let guide = [(0.0, 1.0), (1.0, 1.0)];
        assert!(!chart(&[(0.5, 1.0), (0.5, 2.0), (f64::NAN, 1.0)], &guide).shows_a_course());
        assert!(chart(&[(0.5, 1.0), (0.6, 2.0)], &[]).shows_a_course());
        assert!(chart(&[], &guide).shows_a_course());
    }

    #[test]
    fn a_guide_that_nobody_sees_is_no_entry_of_the_legend() {
        let data = [(1.0, 10.0), (2.0, 20.0)];
        let left = |guide: &[(f64, f64)]| {
            let mut chart = chart(&data, guide);
            chart.remove_unseen_guides();
            chart.series.len()
        };
        assert_eq!(left(&[(1.0, 900.0), (2.0, 900.0)]), 1);
        assert_eq!(left(&[(1.0, 900.0), (1.5, 15.0)]), 2);
        assert_eq!(left(&[]), 2);
    }
}
