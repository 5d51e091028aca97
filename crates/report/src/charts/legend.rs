//! What the colours, markers and lines of a figure stand for.

use kuva::plot::scatter::ScatterPlot;
use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor, render_multiple};

use super::chart::Series;
use super::colour::Colour;
use super::style::Style;
use super::svg::shift;
use super::words::width_of;

/// Between the left ends of a sample and of its words.
const SAMPLE: f64 = 32.0;
/// Between two columns.
const GUTTER: f64 = 16.0;

/// An entry: how a series looks and what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    style: Style,
    label: String,
}

/// The named series, each name once, in order of appearance.
pub fn entries<'a>(series: impl Iterator<Item = &'a Series>) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for series in series {
        let Some(label) = &series.label else { continue };
        if entries.iter().all(|entry| entry.label != *label) {
            entries.push(Entry { style: series.style, label: label.clone() });
        }
    }
    entries
}

/// What has markers, and below it what has none, each laid out in columns that fit a width.
pub struct Legend {
    blocks: Vec<Block>,
    words: u32,
}

/// Entries in columns of one width.
struct Block {
    entries: Vec<Entry>,
    columns: usize,
    column: f64,
}

impl Block {
    /// As many columns as the longest entry allows, of rows as even as can be.
    fn new(entries: Vec<Entry>, width: f64, words: u32) -> Block {
        let longest = entries.iter().map(|entry| width_of(&entry.label, words));
        let column = SAMPLE + longest.fold(0.0, f64::max) + GUTTER;
        let most = (((width + GUTTER) / column) as usize).max(1);
        let rows = entries.len().div_ceil(most).max(1);
        Block { columns: entries.len().div_ceil(rows).max(1), entries, column }
    }

    fn rows(&self) -> usize {
        self.entries.len().div_ceil(self.columns)
    }

    fn width(&self) -> f64 {
        self.column * self.columns as f64 - GUTTER
    }
}

impl Legend {
    /// Lays the entries out.
    pub fn new(entries: Vec<Entry>, width: f64, words: u32) -> Legend {
        let has_marker = |entry: &Entry| entry.style.marker.is_some();
        let (data, curves) = entries.into_iter().partition(has_marker);
        let blocks = [data, curves].map(|entries| Block::new(entries, width, words));
        Legend { blocks: blocks.into(), words }
    }

    fn row(&self) -> f64 {
        f64::from(self.words) * 1.6
    }

    /// In pixels.
    pub fn height(&self) -> f64 {
        let rows: usize = self.blocks.iter().map(Block::rows).sum();
        self.row() * rows as f64
    }

    /// Draws it centred below `top`, down the columns.
    pub fn draw(&self, scene: &mut Scene, top: f64, width: f64) {
        let widest = self.blocks.iter().map(Block::width).fold(0.0, f64::max);
        let left = (width - widest).max(0.0) / 2.0;
        let mut top = top;
        for block in &self.blocks {
            let rows = block.rows();
            for (place, entry) in block.entries.iter().enumerate() {
                let x = left + block.column * (place / rows) as f64;
                let y = top + self.row() * (0.5 + (place % rows) as f64);
                self.draw_entry(scene, entry, x, y);
            }
            top += self.row() * rows as f64;
        }
    }

    fn draw_entry(&self, scene: &mut Scene, entry: &Entry, x: f64, y: f64) {
        let Style { colour, line, marker } = entry.style;
        if let Some(line) = line {
            scene.add(Primitive::Line {
                x1: x,
                y1: y,
                x2: x + SAMPLE - 8.0,
                y2: y,
                stroke: colour.css().into(),
                stroke_width: line.width,
                stroke_dasharray: line.dash.array(),
            });
        }
        if let Some(marker) = marker {
            let centre = (x + (SAMPLE - 8.0) / 2.0, y);
            let sample = ScatterPlot::new()
                .with_data([(0.5, 0.5)])
                .with_color(colour.css())
                .with_marker(marker.shape())
                .with_size(f64::from(self.words) * 0.27);
            scene.elements.extend(alone(sample, centre));
        }
        scene.add(Primitive::Text {
            x: x + SAMPLE,
            y: y + f64::from(self.words) * 0.36,
            content: entry.label.clone(),
            size: self.words,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: Some(Colour::Text.css().into()),
        });
    }
}

/// A single marker at a place of the figure: the middle of a chart whose axes are left out.
fn alone(sample: ScatterPlot, (x, y): (f64, f64)) -> Vec<Primitive> {
    let layout = Layout::new((0.0, 1.0), (0.0, 1.0)).with_width(100.0).with_height(100.0);
    let computed = ComputedLayout::from_layout(&layout);
    let (from_x, from_y) = (computed.map_x(0.5), computed.map_y(0.5));
    let scene = render_multiple(vec![Plot::Scatter(sample)], layout);
    let mut inside = false;
    let mut kept = vec![shift(x - from_x, y - from_y)];
    for element in scene.elements {
        match element {
            Primitive::ClipStart { .. } => inside = true,
            Primitive::ClipEnd => inside = false,
            drawn if inside => kept.push(drawn),
            _ => {}
        }
    }
    kept.push(Primitive::GroupEnd);
    kept
}
