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

/// Size of a drawing.
pub(super) enum Size {
    /// Width and height of a file in pixels.
    Sheet([f64; 2]),
    /// The drawing scales with the page, up to this factor. Its texts stay similar to those around
    /// it.
    Page(f64),
}

/// Returns the scene as SVG. `maps` are drawn behind it.
pub(super) fn finished(mut scene: Scene, maps: &str, name: &str, size: Size) -> String {
    let mut attributes = format!("viewBox=\"0 0 {:.0} {:.0}\"", scene.width, scene.height);
    match size {
        Size::Sheet(sheet) => [scene.width, scene.height] = sheet,
        Size::Page(grow) => {
            let _ = write!(attributes, " style=\"max-width:{:.0}px\"", grow * scene.width);
        }
    }
    let svg = SvgBackend::new().render_scene(&scene);
    let svg = with_subscripts(&with_own_numbers(&svg, name));
    let (tag, rest) = svg.split_once('>').expect("a drawing begins with its tag");
    format!("{tag} {attributes}>{maps}{rest}")
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
    let (tag, rest) = svg.split_once('>').expect("a drawing begins with its tag");
    let paper = Colour::Background.css();
    let figure = format!("{tag}><rect width=\"100%\" height=\"100%\" fill=\"{paper}\"/>{rest}");
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
