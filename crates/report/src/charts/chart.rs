//! Series of points over two axes.

use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::annotations::TextAnnotation;
use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{PathData, Primitive, Scene, render_multiple};
use kuva::{AxisLine, Theme, TickAlign};

use crate::charts::axis::{Axis, Spacing};
use crate::charts::style::{Colour, Style};

/// Width in pixels below which a chart has fewer ticks.
const NARROW: f64 = 330.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Short text above the chart; empty for none.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    /// Texts at points (x, y) of the chart.
    pub notes: Vec<(f64, f64, String)>,
}

/// Points with a common style and label.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Points, ascending in x if a line joins them.
    pub points: Vec<DataPoint>,
    pub style: Style,
    /// Label in the legend, where series with the same label share one entry.
    pub label: Option<String>,
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
        let points = points.into_iter();
        Series {
            points: points.map(|(x, y)| DataPoint { x, y, bar: None }).collect(),
            style,
            label: None,
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
        Chart { title: String::new(), x, y, series: Vec::new(), notes: Vec::new() }
    }

    /// Returns true if a series has at least two points.
    pub fn has_curves(&self) -> bool {
        self.series.iter().any(|series| series.points.len() > 1)
    }

    pub fn titled(self, title: impl Into<String>) -> Chart {
        Chart { title: title.into(), ..self }
    }

    /// Draws the chart with `size` = [width, height] in pixels and the font size `words`.
    pub(super) fn draw(&self, size: [f64; 2], words: u32) -> Scene {
        let frame = Frame::new(self);
        let layout = self.layout(&frame, size, words);
        let computed = ComputedLayout::from_layout(&layout);
        let series = || self.series.iter();
        let plots = series().flat_map(|series| self.plots(series, &frame, words));
        let mut scene = render_multiple(plots.collect(), layout);
        let bars = series().filter_map(|series| self.bars(series, &frame, &computed));
        // Draw error bars below the points: after the axes, before the clipped elements.
        let mut elements = scene.elements.iter();
        let at = elements.position(|element| matches!(element, Primitive::ClipStart { .. }));
        let at = at.unwrap_or(scene.elements.len());
        scene.elements.splice(at..at, bars.collect::<Vec<_>>());
        scene
    }

    fn layout(&self, frame: &Frame, [width, height]: [f64; 2], words: u32) -> Layout {
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
            .with_x_tick_format(frame.spacing[0].ticks(frame.lift[0]))
            .with_y_tick_format(frame.spacing[1].ticks(frame.lift[1]))
            .with_axis_line(AxisLine::Box)
            .with_tick_align(TickAlign::Inside)
            .with_ticks(if width < NARROW { 3 } else { 5 })
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
        for (x, y, text) in &self.notes {
            let (x, y) = frame.placed(*x, *y);
            let note = TextAnnotation::new(text.clone(), x, y)
                .with_color(Colour::Text.css())
                .with_font_size(words - 1);
            layout = layout.with_annotation(note);
        }
        layout
    }

    fn plots(&self, series: &Series, frame: &Frame, words: u32) -> Vec<Plot> {
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

    fn bars(&self, series: &Series, frame: &Frame, layout: &ComputedLayout) -> Option<Primitive> {
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

    fn placed<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = &'a DataPoint> {
        let has_place = |point: &&DataPoint| self.x.can_show(point.x) && self.y.can_show(point.y);
        series.points.iter().filter(has_place)
    }
}

/// Ends of the two axes, and the conversion of points to the numbers that the drawing crate draws.
struct Frame {
    x: [f64; 2],
    y: [f64; 2],
    spacing: [Spacing; 2],
    lift: [f64; 2],
}

impl Frame {
    fn new(chart: &Chart) -> Frame {
        let points = || chart.series.iter().flat_map(|series| &series.points);
        let x = chart.x.ends(points().map(|point| point.x));
        let in_sight = |point: &&DataPoint| (x[0]..=x[1]).contains(&point.x);
        let heights = |point: &DataPoint| {
            let [low, high] = point.bar.unwrap_or([point.y; 2]);
            [point.y, low, high]
        };
        let y = chart.y.ends(points().filter(in_sight).flat_map(heights));
        let spacing = [chart.x.spacing_between(x), chart.y.spacing_between(y)];
        Frame { x, y, spacing, lift: [spacing[0].lift(x), spacing[1].lift(y)] }
    }

    fn holds(&self, point: &DataPoint) -> bool {
        let is_within = |[from, to]: [f64; 2], value| (from..=to).contains(&value);
        is_within(self.x, point.x) && is_within(self.y, point.y)
    }

    fn placed(&self, x: f64, y: f64) -> (f64, f64) {
        let [along_x, along_y] = self.spacing;
        (along_x.drawn_number(x, self.lift[0]), along_y.drawn_number(y, self.lift[1]))
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
