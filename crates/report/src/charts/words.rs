//! How wide words are in the font that travels with the program.

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

use super::pixels::FONT;

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
