//! Drawings as SVG, on a page or in a separate file, and as PNG.
//!
//! Texts use a font that is part of the program, so a figure is the same on every machine.

use std::fmt::Write;
use std::sync::{Arc, LazyLock};

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Primitive, Scene};
use resvg::tiny_skia::{self, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use crate::charts::FONT;
use crate::charts::raster::Raster;
use crate::charts::style::{self, Colour};
use crate::charts::text::with_subscripts;

/// Returns the scene as SVG that scales with the page up to the factor `grow`. `maps` are drawn
/// behind it.
pub(super) fn finished(scene: &Scene, maps: &str, name: &str, grow: f64) -> String {
    let svg = SvgBackend::new().render_scene(scene);
    let svg = with_subscripts(&with_own_numbers(&svg, name));
    let head = svg.find('>').expect("a drawing begins with its tag");
    let (width, height) = (scene.width, scene.height);
    // The figure grows on a wide page, but its texts stay similar to those around it.
    let widest = grow * width;
    let size = format!("viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{widest:.0}px\"");
    let (tag, rest) = svg.split_at(head);
    format!("{tag} {size}>{maps}{}", &rest[1..])
}

/// Gives a drawing another width and height in pixels. Its content is scaled.
pub(super) fn resized(svg: &str, [width, height]: [f64; 2]) -> String {
    let head = svg.find('>').expect("a drawing begins with its tag");
    let (tag, rest) = svg.split_at(head);
    let attributes = tag.split_inclusive('"').collect::<Vec<_>>();
    let mut resized = String::new();
    for pair in attributes.chunks(2) {
        let size = match pair[0].trim() {
            "width=\"" | "<svg width=\"" => Some(width),
            "height=\"" => Some(height),
            // The page limits the width of its drawings.
            "style=\"" => continue,
            _ => None,
        };
        match (size, pair) {
            (Some(size), [name, _]) => {
                let _ = write!(resized, "{name}{size:.2}\"");
            }
            _ => resized.extend(pair.iter().copied()),
        }
    }
    resized + rest
}

/// Renumbers the clip paths of a drawing from zero. The drawing crate numbers clip paths per
/// process, so that equal figures would differ.
fn with_own_numbers(svg: &str, name: &str) -> String {
    const MARK: &str = "kuva-clip-";
    let mut known: Vec<&str> = Vec::new();
    let mut parts = svg.split(MARK);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (number, rest) = part.split_at(end);
        let before = known.iter().position(|&seen| seen == number);
        let index = before.unwrap_or_else(|| {
            known.push(number);
            known.len() - 1
        });
        let _ = write!(text, "{name}-clip-{index}{rest}");
    }
    text
}

/// Returns a drawing for a separate file, with light background and colours.
pub fn alone(svg: &str) -> String {
    let head = svg.find('>').expect("a drawing begins with its tag") + 1;
    let (tag, rest) = svg.split_at(head);
    let paper = Colour::Background.css();
    let figure = format!("{tag}<rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>{rest}");
    style::with_light_colours(&figure)
}

/// Opens a group shifted by (x, y).
pub(super) fn shift(x: f64, y: f64) -> Primitive {
    Primitive::GroupStart {
        transform: Some(format!("translate({x:.1},{y:.1})")),
        title: None,
        extra_attrs: None,
    }
}

/// Error in converting a drawing to PNG or PDF.
#[derive(Debug, thiserror::Error)]
pub enum PixelsError {
    #[error("the drawing is not valid SVG")]
    Svg(#[from] resvg::usvg::Error),
    #[error("cannot create an image of {width} × {height} pixels")]
    Size { width: u32, height: u32 },
    #[error("cannot encode the image: {reason}")]
    Encode { reason: String },
}

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

/// Parses a drawing and lays out its texts.
pub fn tree(svg: &str) -> Result<Tree, PixelsError> {
    let options = Options { fontdb: FONTS.clone(), ..Options::default() };
    Ok(Tree::from_str(svg, &options)?)
}

/// Converts an SVG drawing to PNG, with `scale` pixels per unit.
pub fn to_png(svg: &str, scale: f32) -> Result<Vec<u8>, PixelsError> {
    let pixels = to_raster(svg, scale)?;
    let encode = |error: png::EncodingError| PixelsError::Encode { reason: error.to_string() };
    let [width, height] = pixels.size().map(|side| side as u32);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(pixels.as_slice().as_flattened()))
        .map_err(encode)?;
    Ok(bytes)
}

/// Draws an SVG drawing with a background as pixels, with `scale` pixels per unit.
pub fn to_raster(svg: &str, scale: f32) -> Result<Raster, PixelsError> {
    let tree = tree(svg)?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|side| (side * scale).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(PixelsError::Size { width, height })?;
    // The background covers the edges that a fraction of a pixel leaves free.
    pixels.fill(tiny_skia::Color::WHITE);
    let transform = Transform::from_scale(scale, scale);
    resvg::render(&tree, transform, &mut pixels.as_mut());
    // Separate drawings have a background, so no pixel is transparent.
    let colours = pixels.pixels().iter().map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]);
    Ok(Raster::from_pixels([width as usize, height as usize], colours.collect()))
}

/// Escapes a text for HTML and for attributes of SVG.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resized_drawing_keeps_its_content_and_every_other_attribute() {
        let svg = "<svg xmlns=\"x\" width=\"616\" height=\"400\" viewBox=\"0 0 616 400\">a</svg>";
        let expected =
            "<svg xmlns=\"x\" width=\"325.04\" height=\"200.00\" viewBox=\"0 0 616 400\">a</svg>";
        assert_eq!(resized(svg, [325.04, 200.0]), expected);
    }
}
