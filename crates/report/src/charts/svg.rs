//! Drawings as SVG, on a page or alone in a file, and as PNG.
//!
//! Words are set in the font that travels with the program, so that a figure is the same on every
//! machine, whatever fonts it has.

use std::fmt::Write;
use std::sync::{Arc, LazyLock};

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Primitive, Scene};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

use crate::charts::style::{self, Colour};

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
    style::written_in(&figure)
}

/// Opens a group that is moved.
pub(super) fn shift(x: f64, y: f64) -> Primitive {
    Primitive::GroupStart {
        transform: Some(format!("translate({x:.1},{y:.1})")),
        title: None,
        extra_attrs: None,
    }
}

/// DejaVu Sans, as far as figures need it; see `font/LICENSE`.
pub const FONT: &[u8] = include_bytes!("font/DejaVuSans.ttf");

/// A drawing cannot be turned into pixels.
#[derive(Debug, thiserror::Error)]
pub enum PixelsError {
    #[error("the drawing is not valid SVG")]
    Svg(#[from] resvg::usvg::Error),
    #[error("cannot create an image of {width} × {height} pixels")]
    Size { width: u32, height: u32 },
    #[error("cannot encode the image as PNG: {reason}")]
    Encode { reason: String },
}

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

/// An SVG drawing as PNG, `scale` pixels to each of its units.
pub fn to_png(svg: &str, scale: f32) -> Result<Vec<u8>, PixelsError> {
    let options = Options { fontdb: FONTS.clone(), ..Options::default() };
    let tree = Tree::from_str(svg, &options)?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|side| (side * scale).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(PixelsError::Size { width, height })?;
    let transform = Transform::from_scale(scale, scale);
    resvg::render(&tree, transform, &mut pixels.as_mut());
    let encode = |error: png::EncodingError| PixelsError::Encode { reason: error.to_string() };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    // Where drawings stand alone they have paper: nothing shines through.
    let colours: Vec<u8> = pixels
        .pixels()
        .iter()
        .flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()])
        .collect();
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&colours))
        .map_err(encode)?;
    Ok(bytes)
}

/// In pixels, of words of this size; a letter that the font lacks counts as a square.
pub fn width_of(text: &str, size: u32) -> f64 {
    let font = FontRef::new(FONT).expect("the font is part of the program");
    let letters = font.charmap();
    let glyphs = font.glyph_metrics(Size::new(size as f32), LocationRef::default());
    let width = |letter| {
        let glyph = letters.map(letter);
        let advance = glyph.and_then(|glyph| glyphs.advance_width(glyph));
        advance.unwrap_or(size as f32)
    };
    text.chars().map(|letter| f64::from(width(letter))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_goes_with_size_and_adds_up() {
        assert!((width_of("load", 26) - 2.0 * width_of("load", 13)).abs() < 1e-3);
        assert!((width_of("load y", 13) - width_of("load", 13) - width_of(" y", 13)).abs() < 1e-4);
        assert!(width_of("mm", 13) > 2.0 * width_of("ii", 13));
    }
}
