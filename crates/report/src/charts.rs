//! Drawings of curves as vectors, and of maps as pixels. This module is independent of studies
//! and files.
//!
//! A [`chart::Chart`] or a [`map_panel::MapPanel`] describes one panel. A [`Figure`] arranges
//! panels above a common legend and draws them as SVG, which [`svg`] converts to PNG and [`pdf`] to
//! PDF. For a page, [`interactive`] draws each panel separately. Equal data give equal bytes.

pub mod axis;
pub mod chart;
pub mod interactive;
pub mod map_panel;
pub mod pdf;
pub mod raster;
pub mod style;
pub mod svg;
pub mod text;

use kuva::plot::scatter::ScatterPlot;
use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor, render_multiple};

use crate::charts::chart::{Chart, Series};
use crate::charts::map_panel::{Frame, MapPanel, WORDS, words};
use crate::charts::style::{Colour, Style};
use crate::charts::svg::{Size, finished, shift};
use crate::charts::text::{lines_of, width_of};

/// DejaVu Sans, reduced to the glyphs that figures need; see `font/LICENSE`.
pub const FONT: &[u8] = include_bytes!("charts/font/DejaVuSans.ttf");

/// Font family of all texts; the font that is part of the program comes first.
pub const FONT_FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

/// Margin around the panels and the legend of a figure, in pixels.
const MARGIN: f64 = 8.0;
/// Space between panels, in pixels.
const GAP: f64 = 10.0;
/// Size of the letters of a title and height of its lines, in pixels.
const TITLE: u32 = 15;
const TITLE_LINE: f64 = 22.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title above the panels in files; empty for none. A page has titles of its own.
    pub title: String,
    pub rows: Vec<Vec<Panel>>,
    /// Width and height of one panel, in pixels.
    pub panel: [f64; 2],
    /// Scale of the colours of series, if they are too many for the legend.
    pub colours: Option<ColourScale>,
    /// Labels of the legend, or parts of them, in the order of their entries. Other entries follow.
    pub legend_order: Vec<String>,
    /// Family of the letters, if it is another one than that of the program.
    pub font_family: Option<String>,
    /// Width and height of the files in pixels, if they differ from those of the drawing.
    pub sheet: Option<[f64; 2]>,
}

/// Gradient of the colours of series between two numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourScale {
    pub label: String,
    pub lowest: String,
    pub highest: String,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    Chart(Box<Chart>),
    Map(MapPanel),
    /// An empty place between other panels.
    Blank,
}

impl Panel {
    fn map(&self) -> Option<&MapPanel> {
        match self {
            Panel::Map(map) => Some(map),
            Panel::Chart(_) | Panel::Blank => None,
        }
    }
}

impl Figure {
    pub fn from_chart(chart: Chart) -> Figure {
        Figure::from_charts(vec![vec![chart]], [600.0, 410.0])
    }

    pub fn from_charts(rows: Vec<Vec<Chart>>, panel: [f64; 2]) -> Figure {
        let panels =
            |row: Vec<Chart>| row.into_iter().map(|chart| Panel::Chart(Box::new(chart))).collect();
        Figure::from_panels(rows.into_iter().map(panels).collect(), panel)
    }

    pub fn from_panels(rows: Vec<Vec<Panel>>, panel: [f64; 2]) -> Figure {
        Figure {
            title: String::new(),
            rows,
            panel,
            colours: None,
            legend_order: Vec::new(),
            font_family: None,
            sheet: None,
        }
    }

    /// Sets the size of the files of the figure in pixels, and the size `font` of their letters. If
    /// no width is given, the width stays the same. If no height is given, it follows from the
    /// width. Panels that would be too narrow beside each other are placed below each other.
    ///
    /// # Errors
    /// Returns the smallest height at which the panels hold the labels of their axes, beside title
    /// and legend.
    pub fn fit(&mut self, [width, height]: [Option<f64>; 2], font: f64) -> Result<(), f64> {
        /// Smallest width of panels that stand beside each other, in pixels of the drawing.
        const NARROWEST: f64 = 250.0;
        /// Smallest ratio of the height of a panel to its width.
        const FLATTEST: f64 = 0.25;
        // The drawing has letters of a fixed size, and the files are scaled.
        let scale = font / f64::from(WORDS);
        let outer_width = width.unwrap_or_else(|| self.width());
        let panel_width = |columns: f64| (outer_width / scale - 2.0 * MARGIN + GAP) / columns - GAP;
        let mut columns = self.columns();
        while columns > 1.0 && panel_width(columns) < NARROWEST {
            columns -= 1.0;
        }
        if columns < self.columns() {
            let panels = std::mem::take(&mut self.rows).into_iter().flatten().collect();
            self.rows = in_rows(columns as usize, panels);
        }
        let panel = panel_width(columns);
        let least = self.least_height(panel).max(FLATTEST * panel);
        self.panel = [panel, (panel * self.panel[1] / self.panel[0]).max(least)];
        let rows = self.rows.len() as f64;
        let around = self.height(&self.legend()) - rows * self.panel[1];
        if let Some(height) = height {
            self.panel[1] = (height / scale - around) / rows;
            if self.panel[1] < least {
                return Err(scale * (around + rows * least));
            }
        }
        self.sheet = Some([outer_width, scale * (around + rows * self.panel[1])]);
        Ok(())
    }

    /// Returns the smallest height of panels of this width that holds the labels of all axes, in
    /// pixels of the drawing.
    fn least_height(&self, width: f64) -> f64 {
        self.charts().map(|chart| chart.least_height(width, WORDS)).fold(0.0, f64::max)
    }

    fn columns(&self) -> f64 {
        self.rows.iter().map(Vec::len).max().unwrap_or(0) as f64
    }

    /// Returns the width of the drawing in pixels.
    fn width(&self) -> f64 {
        (self.columns() * (self.panel[0] + GAP) - GAP + 2.0 * MARGIN).ceil()
    }

    /// Returns the height of the drawing with its legend in pixels.
    fn height(&self, legend: &Legend) -> f64 {
        (self.below_panels() + self.height_of_colours() + legend.height() + MARGIN).ceil()
    }

    fn below_panels(&self) -> f64 {
        self.below_title() + self.rows.len() as f64 * (self.panel[1] + GAP)
    }

    fn below_title(&self) -> f64 {
        MARGIN + self.title_lines().len() as f64 * TITLE_LINE
    }

    fn title_lines(&self) -> Vec<String> {
        lines_of(&self.title, self.width() - 2.0 * MARGIN, TITLE)
    }

    fn height_of_colours(&self) -> f64 {
        self.colours.as_ref().map_or(0.0, |colours| colours.height(self.width()))
    }

    fn legend(&self) -> Legend {
        Legend::new(self.entries(), self.width() - 2.0 * MARGIN, WORDS - 1)
    }

    /// Returns the figure as SVG with the colour variables of [`style`]. `name` makes its
    /// identifiers unique on a page.
    pub fn to_svg(&self, name: &str) -> String {
        let [panel_width, panel_height] = self.panel;
        let (width, legend) = (self.width(), self.legend());
        let below = self.below_panels();
        let mut scene = Scene::new(width, self.height(&legend));
        scene.background_color = None;
        scene.text_color = Some(Colour::Text.css());
        // A name with a digit or a quotation mark needs quotes.
        let own = self.font_family.iter().map(|name| format!("'{}'", name.replace('\'', "\\'")));
        let families = own.chain([FONT_FAMILY.to_owned()]);
        scene.font_family = Some(families.collect::<Vec<_>>().join(", "));
        let mut pictures = String::new();
        for (line, content) in self.title_lines().into_iter().enumerate() {
            let y = MARGIN + (line as f64 + 0.75) * TITLE_LINE;
            scene.add(words(content, [width / 2.0, y], TITLE, TextAnchor::Middle));
        }
        let maps = self.rows.iter().flatten().filter_map(Panel::map);
        let frame = Frame::new(maps, panel_width);
        for (row, panels) in self.rows.iter().enumerate() {
            for (column, panel) in panels.iter().enumerate() {
                let x = MARGIN + column as f64 * (panel_width + GAP);
                let y = self.below_title() + row as f64 * (panel_height + GAP);
                match panel {
                    Panel::Chart(chart) => {
                        add_shifted(&mut scene, chart.draw(self.panel, WORDS), [x, y])
                    }
                    Panel::Map(map) => {
                        map.draw(self.panel, &frame, [x, y], &mut scene, &mut pictures);
                    }
                    Panel::Blank => {}
                }
            }
        }
        if let Some(colours) = &self.colours {
            colours.draw(&mut scene, below, width);
        }
        legend.draw(&mut scene, below + self.height_of_colours(), width);
        finished(scene, &pictures, name, self.sheet.map_or(Size::Page(1.4), Size::Sheet))
    }

    /// Returns the entries of the legend: each name once, in the declared order, and others in
    /// order of appearance.
    fn entries(&self) -> Vec<Entry> {
        let mut entries = entries(self.series());
        let place = |part: &str| self.legend_order.iter().position(|label| label == part);
        // Labels of several parameters are parts with a point between them.
        entries.sort_by_key(|Entry { label, .. }| {
            let parts = label.split(" · ").filter_map(place).min();
            place(label).or(parts).unwrap_or(usize::MAX)
        });
        entries
    }

    /// Returns true if all panels are maps.
    pub fn is_of_maps(&self) -> bool {
        self.rows.iter().flatten().all(|panel| panel.map().is_some())
    }

    /// Removes charts that would show their data at one place only, and guides that are not seen.
    /// Other charts keep their row and, if it is not empty, their column.
    ///
    /// # Errors
    /// If no panel is left, returns the label of the horizontal axis of the last one.
    pub fn keep_courses(&mut self) -> Result<(), String> {
        let mut label = String::new();
        for panel in self.rows.iter_mut().flatten() {
            if let Panel::Chart(chart) = panel {
                chart.remove_unseen_guides();
                label.clone_from(&chart.x.label);
                if !chart.shows_a_course() {
                    *panel = Panel::Blank;
                }
            }
        }
        let columns = self.columns() as usize;
        let is_shown = |panel: Option<&Panel>| panel.is_some_and(|panel| *panel != Panel::Blank);
        let kept: Vec<usize> =
            (0..columns).filter(|&at| self.rows.iter().any(|row| is_shown(row.get(at)))).collect();
        for row in &mut self.rows {
            let end = row.iter().rposition(|panel| is_shown(Some(panel)));
            row.truncate(end.map_or(0, |end| end + 1));
            let mut places = 0..;
            row.retain(|_| places.next().is_some_and(|place| kept.contains(&place)));
        }
        self.rows.retain(|row| !row.is_empty());
        if self.rows.is_empty() { Err(label) } else { Ok(()) }
    }

    fn charts(&self) -> impl Iterator<Item = &Chart> {
        self.rows.iter().flatten().filter_map(|panel| match panel {
            Panel::Chart(chart) => Some(&**chart),
            Panel::Map(_) | Panel::Blank => None,
        })
    }

    fn series(&self) -> impl Iterator<Item = &Series> {
        self.charts().flat_map(|chart| &chart.series)
    }
}

impl ColourScale {
    const SPACE: f64 = 8.0;
    /// Height of the scale and of each line of a label above it, in pixels.
    const ROW: [f64; 2] = [24.0, 18.0];

    /// Returns the text before the bar, and the lines of the label above it if the label is too
    /// long for its place before the bar.
    fn texts(&self, width: f64) -> (String, Vec<String>) {
        let before = format!("{}   {}", self.label, self.lowest);
        let least = 0.25 * width;
        let texts = [&before, &self.highest].map(|text| width_of(text, WORDS - 1));
        if texts[0] + texts[1] + 2.0 * Self::SPACE + least <= width {
            return (before, Vec::new());
        }
        (self.lowest.clone(), lines_of(&self.label, width - 2.0 * MARGIN, WORDS - 1))
    }

    /// Returns the height of the scale with its label, in pixels.
    fn height(&self, width: f64) -> f64 {
        Self::ROW[0] + Self::ROW[1] * self.texts(width).1.len() as f64
    }

    /// Draws the scale below `top`, centred in `width`: label, lowest number, colours, highest
    /// number.
    fn draw(&self, scene: &mut Scene, top: f64, width: f64) {
        const SPACE: f64 = ColourScale::SPACE;
        let (before, above) = self.texts(width);
        let mut top = top;
        let text = |x, y, content, anchor| words(content, [x, y], WORDS - 1, anchor);
        for line in above {
            scene.add(text(width / 2.0, top + 15.5, line, TextAnchor::Middle));
            top += Self::ROW[1];
        }
        let [left, right] = [&before, &self.highest].map(|text| width_of(text, WORDS - 1));
        let room = width - left - right - 2.0 * (SPACE + MARGIN);
        let step = (room / style::GRADIENT_STEPS as f64).clamp(0.1, 3.0);
        let bar = step * style::GRADIENT_STEPS as f64;
        let from = (width - left - bar - right - 2.0 * SPACE).max(0.0) / 2.0 + left + SPACE;
        for index in 0..style::GRADIENT_STEPS {
            scene.add(Primitive::Rect {
                x: from + step * index as f64,
                y: top + 5.0,
                // Neighbours overlap, so that no paper shines through between them.
                width: step + 0.5,
                height: 12.0,
                fill: Colour::Gradient(index).css().into(),
                stroke: None,
                stroke_width: None,
                opacity: None,
            });
        }
        let ends = [
            (from - SPACE, before, TextAnchor::End),
            (from + bar + SPACE, self.highest.clone(), TextAnchor::Start),
        ];
        for (x, content, anchor) in ends {
            scene.add(text(x, top + 15.5, content, anchor));
        }
    }
}

/// Arranges items in rows of `columns`; the last row may be shorter.
pub fn in_rows<T>(columns: usize, mut all: Vec<T>) -> Vec<Vec<T>> {
    let mut rows = Vec::new();
    while !all.is_empty() {
        let rest = all.split_off(all.len().min(columns.max(1)));
        rows.push(std::mem::replace(&mut all, rest));
    }
    rows
}

/// Turns rows of equal length into columns.
pub fn transposed<T>(rows: Vec<Vec<T>>) -> Vec<Vec<T>> {
    let mut columns: Vec<Vec<T>> = Vec::new();
    for row in rows {
        columns.resize_with(row.len(), Vec::new);
        columns.iter_mut().zip(row).for_each(|(column, item)| column.push(item));
    }
    columns
}

/// Returns the width and height of a panel that can hold each of these maps, in pixels.
pub fn panel_of_map<'a>(panels: impl Iterator<Item = &'a Panel>, width: f64) -> [f64; 2] {
    let frame = Frame::new(panels.filter_map(Panel::map), width);
    [width, frame.height(width)]
}

fn add_shifted(scene: &mut Scene, drawn: Scene, [x, y]: [f64; 2]) {
    scene.add(shift(x, y));
    scene.elements.extend(drawn.elements);
    scene.add(Primitive::GroupEnd);
    scene.defs.extend(drawn.defs);
}

/// Distance from the left end of the line of a legend entry to the left end of its label, in
/// pixels.
const SAMPLE: f64 = 32.0;
/// Distance between two columns of the legend, in pixels.
const GUTTER: f64 = 16.0;

/// Entry of a legend, with style and label of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    style: Style,
    label: String,
}

/// Returns the entries of named series, each name once, in order of appearance.
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

/// Legend with two blocks of columns: the entries with markers and, below them, the entries
/// without.
pub struct Legend {
    blocks: Vec<Block>,
    words: u32,
}

/// Entries in columns of equal width. Labels that are wider than the block are broken into lines;
/// they stand in a single column.
struct Block {
    entries: Vec<(Entry, Vec<String>)>,
    columns: usize,
    column: f64,
}

impl Block {
    /// Arranges entries in as many columns as the longest entry allows, with evenly filled rows.
    fn new(entries: Vec<Entry>, width: f64, words: u32) -> Block {
        let longest = entries.iter().map(|entry| width_of(&entry.label, words));
        let column = SAMPLE + longest.fold(0.0, f64::max) + GUTTER;
        let most = (((width + GUTTER) / column) as usize).max(1);
        let rows = entries.len().div_ceil(most).max(1);
        let columns = entries.len().div_ceil(rows).max(1);
        let with_lines = entries.into_iter().map(|entry| {
            let lines = match columns {
                1 if column > width + GUTTER => lines_of(&entry.label, width - SAMPLE, words),
                _ => vec![entry.label.clone()],
            };
            (entry, lines)
        });
        Block { entries: with_lines.collect(), columns, column: column.min(width + GUTTER) }
    }

    /// Returns the entries of each column.
    fn by_column(&self) -> impl Iterator<Item = &[(Entry, Vec<String>)]> {
        self.entries.chunks(self.entries.len().div_ceil(self.columns).max(1))
    }

    /// Returns the number of lines of the longest column.
    fn rows(&self) -> usize {
        let lines = |entries: &[(Entry, Vec<String>)]| -> usize {
            entries.iter().map(|(_, lines)| lines.len()).sum()
        };
        self.by_column().map(lines).max().unwrap_or(0)
    }

    fn width(&self) -> f64 {
        self.column * self.columns as f64 - GUTTER
    }
}

impl Legend {
    pub fn new(entries: Vec<Entry>, width: f64, words: u32) -> Legend {
        let has_marker = |entry: &Entry| entry.style.marker.is_some();
        let (data, curves) = entries.into_iter().partition(has_marker);
        let blocks = [data, curves].map(|entries| Block::new(entries, width, words));
        Legend { blocks: blocks.into(), words }
    }

    fn row(&self) -> f64 {
        f64::from(self.words) * 1.6
    }

    pub fn height(&self) -> f64 {
        let rows: usize = self.blocks.iter().map(Block::rows).sum();
        self.row() * rows as f64
    }

    /// Draws the legend below `top`, centred in `width`. Entries fill one column after the other.
    pub fn draw(&self, scene: &mut Scene, top: f64, width: f64) {
        let widest = self.blocks.iter().map(Block::width).fold(0.0, f64::max);
        let left = (width - widest).max(0.0) / 2.0;
        let mut top = top;
        for block in &self.blocks {
            for (column, entries) in block.by_column().enumerate() {
                let x = left + block.column * column as f64;
                let mut y = top + 0.5 * self.row();
                for (entry, lines) in entries {
                    self.draw_sample(scene, entry, x, y);
                    for line in lines {
                        // The centre of the letters is at `y`.
                        let at = [x + SAMPLE, y + f64::from(self.words) * 0.36];
                        scene.add(words(line.clone(), at, self.words, TextAnchor::Start));
                        y += self.row();
                    }
                }
            }
            top += self.row() * block.rows() as f64;
        }
    }

    /// Draws the line and the marker of an entry from `x` on.
    fn draw_sample(&self, scene: &mut Scene, entry: &Entry, x: f64, y: f64) {
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
                .with_marker(marker)
                .with_size(f64::from(self.words) * 0.27);
            scene.elements.extend(marker_at(sample, centre));
        }
    }
}

/// Draws a single marker at the point (x, y) of the figure.
fn marker_at(sample: ScatterPlot, (x, y): (f64, f64)) -> Vec<Primitive> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::axis::Axis;
    use crate::charts::chart::DataPoint;
    use crate::charts::raster::Raster;
    use crate::charts::style::{self, Dash};
    use crate::charts::svg::{self, alone};

    fn heights() -> Raster {
        Raster::from_heights([2, 2], &[0.0, 1.0, 2.0, 3.0])
    }

    fn figure() -> Figure {
        let mut chart = Chart::new(Axis::linear("load y"), Axis::logarithmic("area"));
        let point = |x: f64| DataPoint { x, y: x * x, bar: Some([0.5 * x * x, 2.0 * x * x]) };
        chart.series.push(Series {
            points: [0.0, 0.5, 1.0, f64::NAN].map(point).to_vec(),
            style: Style::marker(Colour::Series(0), style::marker(1)),
            label: Some("k_lower 4".to_owned()),
            is_held: false,
        });
        let line = Style::line(Colour::Text, Dash::Dashed, 1.5);
        chart.series.push(Series::new([(0.1, 0.1), (1.0, 1.0)], line).named("a & b < c"));
        let map = Panel::Map(MapPanel::new("heights", heights(), [1.0, 1.0]));
        let rows = vec![vec![Panel::Chart(Box::new(chart)), map]];
        Figure::from_panels(rows, [300.0, 200.0])
    }

    #[test]
    fn a_figure_fits_a_column_with_its_panels_below_each_other() {
        let mut figure = figure();
        figure.fit([Some(325.0), None], 10.0).unwrap();
        assert_eq!(figure.rows.len(), 2);
        assert_eq!(figure.sheet.unwrap()[0], 325.0);
        let svg = figure.to_svg("column");
        assert!(svg.contains(" width=\"325\" "), "{svg}");
        // Letters of 13 pixels in a drawing of this width have 10 pixels in the file.
        let inner: f64 =
            svg.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((325.0 / inner * 13.0 - 10.0).abs() < 0.05, "{inner}");
        let least = figure.fit([Some(325.0), Some(100.0)], 10.0).unwrap_err();
        assert!(least > 100.0);
        figure.fit([Some(325.0), Some(least + 1.0)], 10.0).unwrap();
    }

    #[test]
    fn a_family_of_letters_is_named_in_the_drawing_and_changes_no_pixels() {
        let own = Figure { font_family: Some("Arial".to_owned()), ..figure() }.to_svg("area");
        assert!(own.contains("font-family=\"&apos;Arial&apos;, DejaVu Sans, "), "{own}");
        let pixels = |svg: &str| svg::to_png(&svg::alone(svg), 1.0).unwrap();
        assert_eq!(pixels(&own), pixels(&figure().to_svg("area")));
    }

    #[test]
    fn equal_sheets_are_equal_bytes_however_many_were_drawn_before() {
        let first = figure().to_svg("area");
        Figure::from_chart(Chart::new(Axis::linear("x"), Axis::linear("y"))).to_svg("other");
        assert_eq!(first, figure().to_svg("area"));
    }

    #[test]
    fn a_map_of_a_rectangle_has_its_sides() {
        let drawn = |size: [f64; 2]| {
            let rows = vec![vec![Panel::Map(MapPanel::new("", heights(), size))]];
            let panel = panel_of_map(rows[0].iter(), 200.0);
            Figure::from_panels(rows, panel).to_svg("map")
        };
        assert!(drawn([3.0, 3.0]).contains("width=\"200.0\" height=\"200.0\" preserve"));
        assert!(drawn([2.0, 1.0]).contains("width=\"200.0\" height=\"100.0\" preserve"));
        assert!(drawn([1.0, 4.0]).contains("width=\"50.0\" height=\"200.0\" preserve"));
    }

    #[test]
    fn charts_of_a_sheet_stand_beside_each_other() {
        let chart = || Chart::new(Axis::linear("x"), Axis::linear("y"));
        let svg = Figure::from_charts(vec![vec![chart(), chart()]], [430.0, 340.0]).to_svg("two");
        // Each chart is in its own group; the second is shifted by the width of a panel and a gap.
        let groups: Vec<&str> = svg.split("translate(").skip(1).collect();
        assert!(groups[0].starts_with("8.0,8.0)"), "{}", &groups[0][..20]);
        assert!(groups[1].starts_with("448.0,8.0)"), "{}", &groups[1][..20]);
        assert_eq!(groups.len(), 2);
    }

    #[test]
    fn a_chart_stays_in_its_column_if_another_one_beside_it_has_no_course() {
        let chart = |places: &[f64]| {
            let mut chart = Chart::new(Axis::linear("x"), Axis::linear("y"));
            let style = Style::marker(Colour::Series(0), style::marker(0));
            chart.series.push(Series::new(places.iter().map(|&x| (x, x)), style));
            chart
        };
        let (full, empty) = (|| chart(&[1.0, 2.0]), || chart(&[1.0]));
        let rows = vec![vec![full(), empty(), empty()], vec![empty(), empty(), full()]];
        let mut figure = Figure::from_charts(rows, [300.0, 200.0]);
        figure.keep_courses().unwrap();
        let is_blank = |row: &Vec<Panel>| row.iter().map(|one| *one == Panel::Blank).collect();
        let blank: Vec<Vec<bool>> = figure.rows.iter().map(is_blank).collect();
        assert_eq!(blank, [vec![false], vec![true, false]]);
    }

    #[test]
    fn words_stay_words_and_each_name_has_one_entry() {
        let svg = figure().to_svg("area");
        let name = ">lower</tspan><tspan dy=\"-0.2em\"> 4</tspan></text>";
        assert_eq!(svg.matches(name).count(), 1);
        assert_eq!(svg.matches(">a &amp; b &lt; c</text>").count(), 1);
        assert!(svg.contains(">load y</text>") && !svg.contains("NaN"));
    }

    #[test]
    fn a_sheet_alone_is_a_drawing_of_its_size_without_variables() {
        let alone = alone(&figure().to_svg("area"));
        assert!(!alone.contains("var(") && alone.contains("viewBox"));
        let png = svg::to_png(&alone, 2.0).unwrap();
        let decoder = png::Decoder::new(std::io::Cursor::new(&png));
        let reader = decoder.read_info().unwrap();
        assert_eq!(reader.info().width, 1252, "two panels, the gap between them and the margins");
    }
}
