//! What the colours, markers and lines of a sheet stand for.

use kuva::plot::scatter::ScatterPlot;
use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor, render_multiple};

use super::chart::Series;
use super::ink::Ink;
use super::style::Style;

/// Between the left ends of a sample and of its words.
const SAMPLE: f64 = 34.0;
/// Between two columns.
const GUTTER: f64 = 18.0;

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
            entries.push(Entry {
                style: series.style,
                label: label.clone(),
            });
        }
    }
    entries
}

/// The entries laid out in columns that fit a width.
pub struct Legend {
    entries: Vec<Entry>,
    columns: usize,
    column: f64,
    words: u32,
}

impl Legend {
    /// As many columns as the longest entry allows.
    pub fn new(entries: Vec<Entry>, width: f64, words: u32) -> Legend {
        let longest = entries.iter().map(|entry| width_of(&entry.label, words));
        let column = SAMPLE + longest.fold(0.0, f64::max) + GUTTER;
        let most = ((width / column) as usize).clamp(1, entries.len().max(1));
        // Rows as even as can be.
        let rows = entries.len().div_ceil(most).max(1);
        Legend {
            columns: entries.len().div_ceil(rows),
            entries,
            column,
            words,
        }
    }

    fn row(&self) -> f64 {
        f64::from(self.words) * 1.6
    }

    /// In pixels.
    pub fn height(&self) -> f64 {
        let rows = self.entries.len().div_ceil(self.columns.max(1));
        self.row() * rows as f64
    }

    /// Draws it centred below `top`, down the columns.
    pub fn draw(&self, scene: &mut Scene, top: f64, width: f64) {
        let rows = self.entries.len().div_ceil(self.columns.max(1));
        let left = (width - self.column * self.columns as f64 + GUTTER).max(0.0) / 2.0;
        for (place, entry) in self.entries.iter().enumerate() {
            let x = left + self.column * (place / rows) as f64;
            let y = top + self.row() * (0.5 + (place % rows) as f64);
            self.draw_entry(scene, entry, x, y);
        }
    }

    fn draw_entry(&self, scene: &mut Scene, entry: &Entry, x: f64, y: f64) {
        let Style { ink, line, marker } = entry.style;
        if let Some(line) = line {
            scene.add(Primitive::Line {
                x1: x,
                y1: y,
                x2: x + SAMPLE - 8.0,
                y2: y,
                stroke: ink.css().into(),
                stroke_width: line.width,
                stroke_dasharray: line.dash.array(),
            });
        }
        if let Some(marker) = marker {
            let centre = (x + (SAMPLE - 8.0) / 2.0, y);
            let sample = ScatterPlot::new()
                .with_data([(0.5, 0.5)])
                .with_color(ink.css())
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
            color: Some(Ink::Text.css().into()),
        });
    }
}

/// A single marker at a place of the sheet: the middle of a chart whose axes are left out.
fn alone(sample: ScatterPlot, (x, y): (f64, f64)) -> Vec<Primitive> {
    let layout = Layout::new((0.0, 1.0), (0.0, 1.0))
        .with_width(100.0)
        .with_height(100.0);
    let computed = ComputedLayout::from_layout(&layout);
    let (from_x, from_y) = (computed.map_x(0.5), computed.map_y(0.5));
    let scene = render_multiple(vec![Plot::Scatter(sample)], layout);
    let mut inside = false;
    let mut kept = vec![super::sheet::shift(x - from_x, y - from_y)];
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

/// Roughly how wide words are, in pixels: no narrower than they will be.
pub fn width_of(text: &str, words: u32) -> f64 {
    let share = |letter: char| match letter {
        'i' | 'j' | 'l' | '.' | ',' | '\'' | '|' | 'ₗ' | ' ' | 'f' | 't' | '(' | ')' => 0.36,
        'm' | 'w' | 'M' | 'W' | '—' | '–' => 0.98,
        'A'..='Z' | '=' | '+' | '√' | '±' | '<' | '>' | '−' | '…' => 0.8,
        _ => 0.635,
    };
    f64::from(words) * text.chars().map(share).sum::<f64>()
}
