//! A map with a title above, and a scale bar and a colour bar below.

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine};
use kuva::render::render::{Primitive, Scene, TextAnchor};

use crate::charts::raster::Raster;
use crate::charts::style::Colour;
use crate::charts::text::width_of;

/// Font size of all texts, in pixels.
pub const WORDS: u32 = 13;
/// Height of a line of the title, in pixels.
const HEAD: f64 = 24.0;
/// Height of a bar below a map, in pixels.
const FOOT: f64 = 22.0;
/// Height of the tick labels and of the label below a colour bar with an axis, in pixels.
const AXIS: f64 = 38.0;
/// Length of a tick of a colour bar, in pixels.
const TICK: f64 = 4.0;
/// Distance between a bar and its label, in pixels.
const SPACE: f64 = 6.0;
/// Smallest width of a colour bar with its labels, in pixels.
const LEAST_BAR: f64 = 180.0;

/// A map with its title and bars.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPanel {
    pub title: String,
    pub raster: Raster,
    /// Sides of the map along x (right) and y (up), in any unit.
    pub size: [f64; 2],
    pub scale_bar: Option<ScaleBar>,
    pub colour_bar: Option<Box<ColourBar>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct ScaleBar {
    /// Length in the unit of the map's sides.
    pub length: f64,
    /// Length with its unit, as text.
    pub label: String,
}

/// Colours of a map with their numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourBar {
    pub colours: Raster,
    pub numbers: BarNumbers,
}

/// Numbers of a colour bar.
#[derive(Debug, Clone, PartialEq)]
pub enum BarNumbers {
    /// The lowest and the highest number with their unit, beside the bar.
    Ends([String; 2]),
    /// Ticks and a label below the bar. A tick has a position from 0 to 1.
    Axis { ticks: Vec<(f64, String)>, label: String },
}

/// Layout that all maps of a figure share, so that the maps in a row have the same size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Largest ratio of the height of a map to its longer side.
    tallest: f64,
    /// Largest number of lines of a title.
    lines: usize,
    /// Largest height of the bars below a map, in pixels.
    foot: f64,
}

impl Frame {
    /// Computes the layout of maps in panels of this width.
    pub(super) fn new<'a>(maps: impl Iterator<Item = &'a MapPanel>, width: f64) -> Frame {
        let none = Frame { tallest: 0.0, lines: 0, foot: 0.0 };
        let frame = maps.fold(none, |frame, map| {
            let [size_x, size_y] = map.size;
            Frame {
                tallest: frame.tallest.max(size_y / size_x.max(size_y)),
                lines: frame.lines.max(wrapped(&map.title, width).len()),
                foot: frame.foot.max(map.foot()),
            }
        });
        if frame.tallest > 0.0 { frame } else { Frame { tallest: 1.0, ..frame } }
    }

    /// Returns the height of a panel of this width that holds each of the maps.
    pub(super) fn height(&self, width: f64) -> f64 {
        width * self.tallest + HEAD * self.lines as f64 + self.foot
    }
}

impl MapPanel {
    pub fn new(title: impl Into<String>, raster: Raster, size: [f64; 2]) -> MapPanel {
        MapPanel { title: title.into(), raster, size, scale_bar: None, colour_bar: None }
    }

    /// Returns the height of the bars below the map.
    fn foot(&self) -> f64 {
        let scale = if self.scale_bar.is_some() { FOOT } else { 0.0 };
        scale + self.colour_bar.as_ref().map_or(0.0, |bar| bar.height())
    }

    /// Draws the map into a panel. Pixels go to `pictures`, which lies behind the scene.
    pub(super) fn draw(
        &self,
        [width, height]: [f64; 2],
        frame: &Frame,
        [x, y]: [f64; 2],
        scene: &mut Scene,
        pictures: &mut String,
    ) {
        let side = width.min((height - HEAD - frame.foot) / frame.tallest);
        let longer = self.size[0].max(self.size[1]);
        let map = self.size.map(|length| side * (length / longer));
        let left = x + (width - map[0]) / 2.0;
        let top = y + height - side * frame.tallest - frame.foot;
        let line = f64::from(WORDS) * 1.4;
        for (from_last, text) in wrapped(&self.title, width).iter().rev().enumerate() {
            let position = [x + width / 2.0, top - 5.0 - from_last as f64 * line];
            scene.add(words(text.clone(), position, WORDS, TextAnchor::Middle));
        }
        scene.add(box_of([left, top], map));
        picture(&self.raster, [left, top], map, pictures);
        let mut below = top + map[1] + FOOT / 2.0;
        if let Some(bar) = &self.scale_bar {
            bar.draw(left, below, map[0] / self.size[0], scene);
            below += FOOT;
        }
        if let Some(bar) = &self.colour_bar {
            let room = map[0].max(LEAST_BAR).min(width);
            let from = x + (width - room) / 2.0;
            bar.draw([from, from + room], below, scene, pictures);
        }
    }
}

impl ScaleBar {
    fn draw(&self, left: f64, middle: f64, pixels_per_length: f64, scene: &mut Scene) {
        let right = left + self.length * pixels_per_length;
        scene.add(line([left, middle], [right, middle], Colour::Text, 3.0));
        let position = [right + SPACE, middle + 4.5];
        scene.add(words(self.label.clone(), position, WORDS, TextAnchor::Start));
    }
}

impl ColourBar {
    fn height(&self) -> f64 {
        match self.numbers {
            BarNumbers::Ends(_) => FOOT,
            BarNumbers::Axis { .. } => FOOT + AXIS,
        }
    }

    fn draw(&self, [from, to]: [f64; 2], middle: f64, scene: &mut Scene, pictures: &mut String) {
        const HEIGHT: f64 = 10.0;
        let top = middle - HEIGHT / 2.0;
        let [left, right] = match &self.numbers {
            BarNumbers::Ends([lowest, highest]) => {
                let below = middle + 4.5;
                scene.add(words(lowest.clone(), [from, below], WORDS, TextAnchor::Start));
                scene.add(words(highest.clone(), [to, below], WORDS, TextAnchor::End));
                [from + width_of(lowest, WORDS) + SPACE, to - width_of(highest, WORDS) - SPACE]
            }
            BarNumbers::Axis { ticks, label } => {
                let bottom = top + HEIGHT;
                for (share, number) in ticks {
                    let x = from + share * (to - from);
                    scene.add(line([x, bottom], [x, bottom + TICK], Colour::Muted, 1.0));
                    scene.add(tick_label(number, x, [from, to], bottom + TICK + 13.0));
                }
                let centre = [(from + to) / 2.0, bottom + TICK + 31.0];
                scene.add(words(label.clone(), centre, WORDS, TextAnchor::Middle));
                [from, to]
            }
        };
        let size = [(right - left).max(1.0), HEIGHT];
        scene.add(box_of([left, top], size));
        picture(&self.colours, [left, top], size, pictures);
    }
}

/// Returns the number of a tick, shifted such that it does not reach beyond the bar.
fn tick_label(number: &str, x: f64, [from, to]: [f64; 2], y: f64) -> Primitive {
    let half = width_of(number, WORDS) / 2.0;
    let inside = x.max(from + half).min(to - half);
    words(number.to_owned(), [inside, y], WORDS, TextAnchor::Middle)
}

fn line([x1, y1]: [f64; 2], [x2, y2]: [f64; 2], colour: Colour, width: f64) -> Primitive {
    Primitive::Line {
        x1,
        y1,
        x2,
        y2,
        stroke: colour.css().into(),
        stroke_width: width,
        stroke_dasharray: None,
    }
}

/// Returns a text in the colour of texts, whose baseline is at the point (x, y).
pub fn words(content: String, [x, y]: [f64; 2], size: u32, anchor: TextAnchor) -> Primitive {
    Primitive::Text {
        x,
        y,
        content,
        size,
        anchor,
        rotate: None,
        bold: false,
        color: Some(Colour::Text.css().into()),
    }
}

fn box_of([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Primitive {
    Primitive::Rect {
        x,
        y,
        width,
        height,
        fill: "none".into(),
        stroke: Some(Colour::Muted.css().into()),
        stroke_width: Some(1.0),
        opacity: None,
    }
}

fn picture(raster: &Raster, [x, y]: [f64; 2], [width, height]: [f64; 2], pictures: &mut String) {
    let data = BASE64_STANDARD.encode(raster.to_png());
    let _ = write!(
        pictures,
        "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
         preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" \
         href=\"data:image/png;base64,{data}\"/>",
    );
}

/// Breaks a title at its separators `·` into lines that fit a width.
fn wrapped(text: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in text.split(" · ") {
        let joined = lines.last().map(|line| format!("{line} · {part}"));
        match joined {
            Some(line) if width_of(&line, WORDS) <= width => {
                lines.pop();
                lines.push(line);
            }
            _ => lines.push(part.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{Figure, Panel, panel_of_map};

    fn map(size: [f64; 2]) -> MapPanel {
        let raster = Raster::from_heights([2, 2], &[0.0, 1.0, 2.0, 3.0]);
        MapPanel::new("heights", raster, size)
    }

    fn drawn(maps: Vec<MapPanel>) -> String {
        let rows = vec![maps.into_iter().map(Panel::Map).collect::<Vec<_>>()];
        let panel = panel_of_map(rows[0].iter(), 200.0);
        Figure::from_panels(rows, panel).to_svg("maps")
    }

    /// Returns all values of an attribute.
    fn numbers_of(svg: &str, attribute: &str) -> Vec<f64> {
        let opening = format!(" {attribute}=\"");
        let told = svg.split(&opening).skip(1);
        let number = |told: &str| told.split('"').next().and_then(|told| told.parse().ok());
        told.filter_map(number).collect()
    }

    #[test]
    fn a_scale_bar_has_its_share_of_the_side_along_x() {
        for (size, pixels) in [([8.0, 8.0], 200.0), ([4.0, 8.0], 100.0)] {
            let scale_bar = Some(ScaleBar { length: 1.0, label: "1 µm".to_owned() });
            let svg = drawn(vec![MapPanel { scale_bar, ..map(size) }]);
            let length = numbers_of(&svg, "x2")[0] - numbers_of(&svg, "x1")[0];
            assert!((length - pixels / size[0]).abs() < 0.1, "{length}");
            assert!(svg.contains(">1 µm</text>"));
        }
    }

    #[test]
    fn a_colour_bar_lies_between_its_numbers() {
        let colours = Raster::from_heights([2, 1], &[0.0, 1.0]);
        let numbers = BarNumbers::Ends(["−3 nm", "12 nm"].map(str::to_owned));
        let colour_bar = Some(Box::new(ColourBar { colours, numbers }));
        let svg = drawn(vec![MapPanel { colour_bar, ..map([1.0, 1.0]) }]);
        assert_eq!(svg.matches("<image ").count(), 2);
        let bar = svg.split("<image ").last().unwrap();
        let [left, width] = ["x", "width"].map(|name| numbers_of(&format!(" {bar}"), name)[0]);
        let room = 200.0 - width_of("−3 nm", WORDS) - width_of("12 nm", WORDS) - 2.0 * SPACE;
        assert!((width - room).abs() < 0.2, "{width} of {room}");
        assert!((left - 8.0 - width_of("−3 nm", WORDS) - SPACE).abs() < 0.2);
    }

    #[test]
    fn ticks_of_a_colour_bar_lie_at_their_share_of_its_width() {
        let colours = Raster::from_heights([2, 1], &[0.0, 1.0]);
        let ticks = [(0.0, "0"), (0.25, "5"), (1.0, "20")];
        let numbers = BarNumbers::Axis {
            ticks: ticks.map(|(share, number)| (share, number.to_owned())).to_vec(),
            label: "pressure p (MPa)".to_owned(),
        };
        let colour_bar = Some(Box::new(ColourBar { colours, numbers }));
        let svg = drawn(vec![MapPanel { colour_bar, ..map([1.0, 1.0]) }]);
        assert_eq!(numbers_of(&svg, "x1"), [8.0, 58.0, 208.0]);
        assert!(svg.contains(">pressure p (MPa)</text>"));
    }

    #[test]
    fn maps_beside_each_other_are_of_one_size_whatever_is_below_them() {
        let scale_bar = Some(ScaleBar { length: 0.2, label: "2 mm".to_owned() });
        let barred = MapPanel { scale_bar, ..map([1.0, 1.0]) };
        let svg = drawn(vec![map([1.0, 1.0]), barred]);
        let images: Vec<&str> = svg.split("<image ").skip(1).collect();
        let places =
            |name| images.iter().map(move |image| numbers_of(&format!(" {image}"), name)[0]);
        assert_eq!(places("y").collect::<Vec<_>>(), [32.0, 32.0]);
        assert_eq!(places("height").collect::<Vec<_>>(), [200.0, 200.0]);
    }
}
