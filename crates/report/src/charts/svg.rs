//! Drawings as text: on a page, or alone in a file.

use std::fmt::Write;

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Primitive, Scene};

use super::colour::{self, Colour};

/// The scene as SVG with its maps behind, scaling with the page.
pub(super) fn finished(scene: &Scene, maps: &str, name: &str) -> String {
    let svg = SvgBackend::new().render_scene(scene);
    let svg = with_own_numbers(&svg, name);
    let head = svg.find('>').expect("a drawing begins with its tag");
    let (width, height) = (scene.width, scene.height);
    // On a wide page it grows, but not so far that its words outgrow those around it.
    let size =
        format!("viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{:.0}px\"", 1.4 * width);
    let (tag, rest) = svg.split_at(head);
    format!("{tag} {size}>{maps}{}", &rest[1..])
}

/// Clip paths are numbered over the whole process; here over the drawing.
fn with_own_numbers(svg: &str, name: &str) -> String {
    const MARK: &str = "kuva-clip-";
    let mut known: Vec<&str> = Vec::new();
    let mut parts = svg.split(MARK);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (number, rest) = part.split_at(end);
        let place = known.iter().position(|&seen| seen == number);
        let place = place.unwrap_or_else(|| {
            known.push(number);
            known.len() - 1
        });
        let _ = write!(text, "{name}-clip-{place}{rest}");
    }
    text
}

/// A drawing that needs no page around it: with its own light paper and colours.
pub fn alone(svg: &str) -> String {
    let head = svg.find('>').expect("a drawing begins with its tag") + 1;
    let (tag, rest) = svg.split_at(head);
    let paper = Colour::Background.css();
    let figure = format!("{tag}<rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>{rest}");
    colour::written_in(&figure)
}

/// Opens a group that is moved.
pub(super) fn shift(x: f64, y: f64) -> Primitive {
    Primitive::GroupStart {
        transform: Some(format!("translate({x:.1},{y:.1})")),
        title: None,
        extra_attrs: None,
    }
}
