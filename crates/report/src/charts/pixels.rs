//! Drawings as PNG files.
//!
//! Words are set in the font that travels with the program, so that a figure is the same on every
//! machine, whatever fonts it has.

use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

/// DejaVu Sans, as far as figures need it; see `font/LICENSE`.
pub const FONT: &[u8] = include_bytes!("font/DejaVuSans.ttf");

/// A drawing cannot be turned into pixels.
#[derive(Debug, thiserror::Error)]
pub enum PixelsError {
    /// It is no SVG.
    #[error("the drawing is no SVG")]
    Svg(#[from] resvg::usvg::Error),
    /// It has no size, or a huge one.
    #[error("a drawing of {width} × {height} pixels cannot be made")]
    Size {
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
    /// It cannot be written.
    #[error("the pixels cannot be encoded: {reason}")]
    Encode {
        /// Why.
        reason: String,
    },
}

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

/// An SVG drawing as PNG, `scale` pixels to each of its units.
///
/// # Errors
/// When it is no SVG, or has no size.
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
