//! Charts and maps side by side above one legend, as SVG.

use kuva::render::render::{Primitive, Scene};

use super::chart::{Chart, Series};
use super::colour::Colour;
use super::legend::{self, Legend};
use super::map_panel::{Frame, MapPanel, WORDS};
use super::svg::{finished, shift};

/// The family of all words: the font that travels with the program comes first.
pub const FONT_FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

/// Space around everything, in pixels.
const MARGIN: f64 = 8.0;
/// Space between panels, in pixels.
const GAP: f64 = 10.0;

/// One figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Rows of panels.
    pub rows: Vec<Vec<Panel>>,
    /// Width and height of one panel, in pixels.
    pub panel: [f64; 2],
}

/// One part of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// Series over axes.
    Chart(Box<Chart>),
    /// A map of a surface.
    Map(MapPanel),
}

impl Panel {
    fn map(&self) -> Option<&MapPanel> {
        match self {
            Panel::Map(map) => Some(map),
            Panel::Chart(_) => None,
        }
    }
}

impl Figure {
    /// One chart.
    pub fn of(chart: Chart) -> Figure {
        Figure::of_charts(vec![vec![chart]], [600.0, 410.0])
    }

    /// Two charts side by side: nothing of one lies over the other.
    pub fn of_two(left: Chart, right: Chart) -> Figure {
        Figure::of_charts(vec![vec![left, right]], [430.0, 340.0])
    }

    /// Rows of charts.
    pub fn of_charts(rows: Vec<Vec<Chart>>, panel: [f64; 2]) -> Figure {
        let panels = |row: Vec<Chart>| row.into_iter().map(|c| Panel::Chart(Box::new(c)));
        Figure { rows: rows.into_iter().map(|row| panels(row).collect()).collect(), panel }
    }

    /// The figure as SVG in the variables of [`super::colour`]; `name` keeps its parts apart from
    /// those of other figures on a page.
    pub fn to_svg(&self, name: &str) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0) as f64;
        let [panel_width, panel_height] = self.panel;
        let width = (columns * (panel_width + GAP) - GAP + 2.0 * MARGIN).ceil();
        let legend = Legend::new(legend::entries(self.series()), width - 2.0 * MARGIN, WORDS - 1);
        let top = MARGIN + self.rows.len() as f64 * (panel_height + GAP);
        let mut scene = Scene::new(width, (top + legend.height() + MARGIN).ceil());
        scene.background_color = None;
        scene.text_color = Some(Colour::Text.css());
        scene.font_family = Some(FONT_FAMILY.to_owned());
        let mut pictures = String::new();
        let maps = self.rows.iter().flatten().filter_map(Panel::map);
        let frame = Frame::of(maps, panel_width);
        for (row, panels) in self.rows.iter().enumerate() {
            for (column, panel) in panels.iter().enumerate() {
                let x = MARGIN + column as f64 * (panel_width + GAP);
                let y = MARGIN + row as f64 * (panel_height + GAP);
                match panel {
                    Panel::Chart(chart) => place(&mut scene, chart.draw(self.panel, WORDS), [x, y]),
                    Panel::Map(map) => {
                        map.draw(self.panel, &frame, [x, y], &mut scene, &mut pictures);
                    }
                }
            }
        }
        legend.draw(&mut scene, top, width);
        finished(&scene, &pictures, name)
    }

    fn series(&self) -> impl Iterator<Item = &Series> {
        let panels = self.rows.iter().flatten();
        panels
            .filter_map(|panel| match panel {
                Panel::Chart(chart) => Some(chart),
                Panel::Map(_) => None,
            })
            .flat_map(|chart| &chart.series)
    }
}

/// Rows of two charts: on a page, words of more would be small.
pub fn in_pairs(charts: Vec<Chart>) -> Vec<Vec<Chart>> {
    in_rows(2, charts)
}

/// Rows of so many, the last of what is left.
pub fn in_rows<T>(columns: usize, mut all: Vec<T>) -> Vec<Vec<T>> {
    let mut rows = Vec::new();
    while !all.is_empty() {
        let rest = all.split_off(all.len().min(columns.max(1)));
        rows.push(std::mem::replace(&mut all, rest));
    }
    rows
}

/// Width and height of panels that hold each of these maps, in pixels.
pub fn panel_of_map<'a>(panels: impl Iterator<Item = &'a Panel>, width: f64) -> [f64; 2] {
    let frame = Frame::of(panels.filter_map(Panel::map), width);
    [width, frame.height(width)]
}

/// Adds a drawing to another, moved.
fn place(scene: &mut Scene, drawn: Scene, [x, y]: [f64; 2]) {
    scene.add(shift(x, y));
    scene.elements.extend(drawn.elements);
    scene.add(Primitive::GroupEnd);
    scene.defs.extend(drawn.defs);
}

#[cfg(test)]
mod tests {
    use super::super::axis::Axis;
    use super::super::chart::DataPoint;
    use super::super::pixels;
    use super::super::raster::Raster;
    use super::super::style::{Dash, Marker, Style};
    use super::super::svg::alone;
    use super::*;

    fn heights() -> Raster {
        Raster::of_heights([2, 2], &[0.0, 1.0, 2.0, 3.0])
    }

    fn figure() -> Figure {
        let mut chart = Chart::new(Axis::linear("load y"), Axis::logarithmic("area"));
        let point = |x: f64| DataPoint { x, y: x * x, bar: Some([0.5 * x * x, 2.0 * x * x]) };
        chart.series.push(Series {
            points: [0.0, 0.5, 1.0, f64::NAN].map(point).to_vec(),
            style: Style::marker(Colour::Series(0), Marker::Triangle),
            label: Some("k_lower 4".to_owned()),
        });
        let line = Style::line(Colour::Text, Dash::Dashed, 1.5);
        chart.series.push(Series::new([(0.1, 0.1), (1.0, 1.0)], line).named("a & b < c"));
        let map = Panel::Map(MapPanel::new("heights", heights(), [1.0, 1.0]));
        Figure { rows: vec![vec![Panel::Chart(Box::new(chart)), map]], panel: [300.0, 200.0] }
    }

    #[test]
    fn equal_sheets_are_equal_bytes_however_many_were_drawn_before() {
        let first = figure().to_svg("area");
        Figure::of(Chart::new(Axis::linear("x"), Axis::linear("y"))).to_svg("other");
        assert_eq!(first, figure().to_svg("area"));
    }

    #[test]
    fn a_map_of_a_rectangle_has_its_sides() {
        let drawn = |size: [f64; 2]| {
            let rows = vec![vec![Panel::Map(MapPanel::new("", heights(), size))]];
            let panel = panel_of_map(rows[0].iter(), 200.0);
            Figure { rows, panel }.to_svg("map")
        };
        assert!(drawn([3.0, 3.0]).contains("width=\"200.0\" height=\"200.0\" preserve"));
        assert!(drawn([2.0, 1.0]).contains("width=\"200.0\" height=\"100.0\" preserve"));
        assert!(drawn([1.0, 4.0]).contains("width=\"50.0\" height=\"200.0\" preserve"));
    }

    #[test]
    fn charts_of_a_sheet_stand_beside_each_other() {
        let chart = || Chart::new(Axis::linear("x"), Axis::linear("y"));
        let svg = Figure::of_two(chart(), chart()).to_svg("two");
        // Each in its own group, the second one the width of a panel and a gap to the right.
        let groups: Vec<&str> = svg.split("translate(").skip(1).collect();
        assert!(groups[0].starts_with("8.0,8.0)"), "{}", &groups[0][..20]);
        assert!(groups[1].starts_with("448.0,8.0)"), "{}", &groups[1][..20]);
        assert_eq!(groups.len(), 2);
    }

    #[test]
    fn words_stay_words_and_each_name_has_one_entry() {
        let svg = figure().to_svg("area");
        assert_eq!(svg.matches(">k_lower 4</text>").count(), 1);
        assert_eq!(svg.matches(">a &amp; b &lt; c</text>").count(), 1);
        assert!(svg.contains(">load y</text>") && !svg.contains("NaN"));
    }

    #[test]
    fn a_sheet_alone_is_a_drawing_of_its_size_without_variables() {
        let alone = alone(&figure().to_svg("area"));
        assert!(!alone.contains("var(") && alone.contains("viewBox"));
        let png = pixels::to_png(&alone, 2.0).unwrap();
        let decoder = png::Decoder::new(std::io::Cursor::new(&png));
        let reader = decoder.read_info().unwrap();
        assert_eq!(reader.info().width, 1252, "two panels, the gap between them and the margins");
    }
}
