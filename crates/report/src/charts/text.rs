//! Texts of figures: widths, line breaks, and symbols with subscripts such as `h_c`.

use kuva::render::render_utils::wrap_text;
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

use crate::charts::FONT;

/// Size of the letters of a subscript, relative to those around it.
const SUBSCRIPT: f64 = 0.7;

/// Splits a text into parts, each with the flag whether it is a subscript.
///
/// A subscript follows a symbol of one letter and `_`: `h_c` and `k_upper`. Names with `_`, such as
/// those of files and columns, stay as they are.
fn parts(text: &str) -> Vec<(&str, bool)> {
    let mut parts = Vec::new();
    let mut from = 0;
    for (at, _) in text.match_indices('_').filter(|(at, _)| is_end_of_symbol(&text[..*at])) {
        let after = &text[at + 1..];
        let length = after.find(|letter: char| !letter.is_alphanumeric()).unwrap_or(after.len());
        if length > 0 && !continues_name(&after[length..]) {
            parts.extend([(&text[from..at], false), (&after[..length], true)]);
            from = at + 1 + length;
        }
    }
    parts.push((&text[from..], false));
    parts
}

/// Returns whether a text ends with a single letter.
fn is_end_of_symbol(text: &str) -> bool {
    let mut letters = text.chars().rev();
    let is_of_name = |letter: char| letter.is_alphanumeric() || "_-.".contains(letter);
    letters.next().is_some_and(char::is_alphabetic) && !letters.next().is_some_and(is_of_name)
}

/// Returns whether a text continues the name before it, as the ending of a file does.
fn continues_name(text: &str) -> bool {
    let mut letters = text.chars();
    match letters.next() {
        Some('.' | '-') => letters.next().is_some_and(char::is_alphanumeric),
        letter => letter == Some('_'),
    }
}

/// Writes the subscripts of a text that is escaped for HTML.
pub fn with_html_subscripts(escaped: &str) -> String {
    let parts = parts(escaped).into_iter();
    let written = parts.map(|(part, is_subscript)| match is_subscript {
        true => format!("<sub>{part}</sub>"),
        false => part.to_owned(),
    });
    written.collect()
}

/// Writes the subscripts in the texts of an SVG drawing.
pub fn with_subscripts(svg: &str) -> String {
    // Lowered by 0.2 of the size of the text; lengths in em refer to the size of the span.
    let (down, up) = (0.2 / SUBSCRIPT, -0.2);
    let typeset = |text: &str| -> String {
        let mut is_lowered = false;
        let written = parts(text).into_iter().map(|(part, is_subscript)| {
            let was_lowered = std::mem::replace(&mut is_lowered, is_subscript);
            match (is_subscript, was_lowered) {
                (true, _) => format!(
                    "<tspan dy=\"{down:.3}em\" font-size=\"{:.0}%\">{part}</tspan>",
                    100.0 * SUBSCRIPT
                ),
                (false, true) if !part.is_empty() => {
                    format!("<tspan dy=\"{up}em\">{part}</tspan>")
                }
                _ => part.to_owned(),
            }
        });
        written.collect()
    };
    let mut pieces = svg.split("<text ");
    let mut written = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        written += "<text ";
        let ends = piece.find('>').and_then(|start| Some((start + 1, piece.find("</text>")?)));
        match ends {
            Some((start, end)) if start <= end => {
                written += &piece[..start];
                written += &typeset(&piece[start..end]);
                written += &piece[end..];
            }
            _ => written += piece,
        }
    }
    written
}

/// Returns the width of a text of this size, in pixels. A character that is not in the font counts
/// as a square.
pub fn width_of(text: &str, size: u32) -> f64 {
    let font = FontRef::new(FONT).expect("the font is part of the program");
    let letters = font.charmap();
    let width = |part: &str, size: f32| -> f64 {
        let glyphs = font.glyph_metrics(Size::new(size), LocationRef::default());
        let width = |letter| {
            let glyph = letters.map(letter);
            let advance = glyph.and_then(|glyph| glyphs.advance_width(glyph));
            f64::from(advance.unwrap_or(size))
        };
        part.chars().map(width).sum()
    };
    let parts = parts(text).into_iter();
    let widths = parts.map(|(part, is_subscript)| {
        let size = if is_subscript { SUBSCRIPT * f64::from(size) } else { f64::from(size) };
        width(part, size as f32)
    });
    widths.sum()
}

/// Breaks a text into lines of at most this width, in pixels. Words that are wider are broken, too.
/// An empty text has no lines.
pub fn lines_of(text: &str, width: f64, size: u32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let joined = lines.last().map(|line| format!("{line} {word}"));
        match joined.filter(|line| width_of(line, size) <= width) {
            Some(line) => *lines.last_mut().expect("a line was joined") = line,
            None => lines.extend(pieces_of(word, width, size)),
        }
    }
    lines
}

/// Breaks a word into pieces of at most this width.
fn pieces_of(word: &str, width: f64, size: u32) -> Vec<String> {
    let mut pieces = vec![String::new()];
    for letter in word.chars() {
        let last = pieces.last_mut().expect("there is a first piece");
        if !last.is_empty() && width_of(&format!("{last}{letter}"), size) > width {
            pieces.push(letter.to_string());
        } else {
            last.push(letter);
        }
    }
    pieces
}

/// Returns the number of letters after which the drawing crate breaks a label of an axis such that
/// its lines have at most this width, or the smallest number that keeps its words whole. The label
/// has as few lines as possible, and these are about equally long.
pub fn letters_in_line(label: &str, width: f64, size: u32) -> usize {
    let fits = |letters: &usize| widest_line(label, *letters, size) <= width;
    let longest = line_lengths(label).rev().find(fits).unwrap_or(longest_word(label));
    let lines = wrap_text(label, longest).len();
    let is_as_short = |letters: &usize| wrap_text(label, *letters).len() <= lines;
    line_lengths(label).find(is_as_short).unwrap_or(longest)
}

/// Returns the width of a label in the fewest pixels that two lines need.
pub fn width_in_two_lines(label: &str, size: u32) -> f64 {
    let in_two = line_lengths(label).filter(|letters| wrap_text(label, *letters).len() <= 2);
    in_two.map(|letters| widest_line(label, letters, size)).fold(f64::INFINITY, f64::min)
}

/// Returns the width of the widest line of a label that is broken after this number of letters.
pub fn widest_line(label: &str, letters: usize, size: u32) -> f64 {
    let lines = wrap_text(label, letters);
    lines.iter().map(|line| width_of(line, size)).fold(0.0, f64::max)
}

/// Returns the numbers of letters after which a label can be broken between its words.
fn line_lengths(label: &str) -> impl DoubleEndedIterator<Item = usize> {
    longest_word(label)..=label.chars().count().max(1)
}

fn longest_word(label: &str) -> usize {
    label.split_whitespace().map(|word| word.chars().count()).max().unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_of_one_letter_have_subscripts_and_names_have_none() {
        assert_eq!(
            parts("conductance h_c, in W"),
            [("conductance h", false), ("c", true), (", in W", false)]
        );
        let symbols = ["ζ = k_upper/k_lower", "K_t", "p_c exp(−ū/u₀)", "(ρ_s)"];
        let counts = symbols.map(|text| parts(text).len());
        assert_eq!(counts, [5, 3, 3, 3]);
        for name in
            ["area_fraction", "scan_1", "a_b.x3p", "x_y_z", "a-b_c", "2_a", "_a", "a_", "h_c-2"]
        {
            assert_eq!(parts(name), [(name, false)]);
        }
    }

    #[test]
    fn subscripts_are_smaller_and_lower_and_what_follows_stands_on_the_line_again() {
        let svg = "<svg><text x=\"1\">h_c, in W &lt; 1</text><text y=\"2\">R_c</text><g id=\"k_c\"/></svg>";
        let expected = "<svg><text x=\"1\">h<tspan dy=\"0.286em\" font-size=\"70%\">c</tspan>\
             <tspan dy=\"-0.2em\">, in W &lt; 1</tspan></text>\
             <text y=\"2\">R<tspan dy=\"0.286em\" font-size=\"70%\">c</tspan></text><g id=\"k_c\"/></svg>";
        assert_eq!(with_subscripts(svg), expected);
        assert_eq!(with_html_subscripts("h_c &lt; 1"), "h<sub>c</sub> &lt; 1");
        let parts = width_of("h", 10) + 0.7 * width_of("c", 10);
        assert!((width_of("h_c", 10) - parts).abs() < 1e-4);
    }

    #[test]
    fn a_text_is_broken_between_words_and_within_words_that_are_too_wide() {
        let width = width_of("one two", 15) + 1.0;
        assert_eq!(lines_of("one two three", width, 15), ["one two", "three"]);
        assert!(lines_of("", width, 15).is_empty());
        let lines = lines_of("a-very-long-name-of-a-file.x3p", width, 15);
        assert!(lines.len() > 2 && lines.iter().all(|line| width_of(line, 15) <= width));
        assert_eq!(lines.concat(), "a-very-long-name-of-a-file.x3p");
    }

    #[test]
    fn a_label_is_broken_into_lines_of_the_width() {
        let label = "thermal conductance h_c, in W/(m² K)";
        let half = width_in_two_lines(label, 13);
        assert!(half < 0.6 * width_of(label, 13), "{half}");
        let letters = letters_in_line(label, half, 13);
        assert_eq!(wrap_text(label, letters), ["thermal conductance", "h_c, in W/(m² K)"]);
        assert_eq!(letters_in_line(label, 1e3, 13), label.chars().count());
        assert_eq!(letters_in_line(label, 1.0, 13), "conductance".len());
    }

    #[test]
    fn width_goes_with_size_and_adds_up() {
        assert!((width_of("load", 26) - 2.0 * width_of("load", 13)).abs() < 1e-3);
        assert!((width_of("load y", 13) - width_of("load", 13) - width_of(" y", 13)).abs() < 1e-4);
        assert!(width_of("mm", 13) > 2.0 * width_of("ii", 13));
    }
}
