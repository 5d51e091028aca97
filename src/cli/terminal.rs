//! Output of commands: text in columns, with control characters escaped.
//!
//! Names, units and titles come from manifests and files of instruments. A control character in
//! them could clear the screen, change the title of the window or hide the text after it, and a
//! mark of the direction of writing could reverse it. All output of the commands passes through
//! this file, which escapes such characters as in JSON: `\u001b`.

use std::borrow::Cow;
use std::io::{self, IsTerminal, StdoutLock, Write};
use std::ops::RangeInclusive;

use comfy_table::{CellAlignment, Row, Table, presets};

/// Separators of lines and paragraphs, and marks of the direction of writing.
const FORMATS: [RangeInclusive<char>; 4] = [
    '\u{61c}'..='\u{61c}',
    '\u{200e}'..='\u{200f}',
    '\u{2028}'..='\u{202e}',
    '\u{2066}'..='\u{2069}',
];

/// Escapes control characters and the marks of direction as in JSON, such as `\u001b`, except line
/// ends and tabs.
pub fn escaped(text: &str) -> Cow<'_, str> {
    let is_escaped = |letter: char| {
        let is_control = letter.is_control() && letter != '\n' && letter != '\t';
        is_control || FORMATS.iter().any(|range| range.contains(&letter))
    };
    if !text.contains(is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len());
    for letter in text.chars() {
        if is_escaped(letter) {
            plain += &format!("\\u{:04x}", u32::from(letter));
        } else {
            plain.push(letter);
        }
    }
    Cow::Owned(plain)
}

/// Number of spaces between two columns.
pub(crate) const GAP: usize = 2;

/// Formats rows below a header. Columns with the indices for which `is_right` is true are aligned
/// right.
pub(crate) fn in_columns(
    header: impl Into<Row>,
    rows: impl IntoIterator<Item = impl Into<Row>>,
    is_right: impl Fn(usize) -> bool,
) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header).add_rows(rows);
    for (index, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, GAP as u16));
        if is_right(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt()
}

/// Standard output, with control characters escaped.
pub(crate) struct Output(StdoutLock<'static>);

/// Locks and returns the standard output.
pub(crate) fn stdout() -> Output {
    Output(io::stdout().lock())
}

impl Output {
    /// Clears the screen, if the output is a terminal.
    pub(crate) fn clear(&mut self) -> io::Result<()> {
        if self.0.is_terminal() {
            self.0.write_all(b"\x1b[H\x1b[2J")?;
        }
        Ok(())
    }

    /// Writes data for other programs: unchanged, or escaped if the output is a terminal.
    pub(crate) fn write_data(&mut self, data: &[u8]) -> io::Result<()> {
        if self.0.is_terminal() { self.write_all(data) } else { self.0.write_all(data) }
    }
}

impl Write for Output {
    /// Writes a text, which must not end within a UTF-8 character; `write!` satisfies this.
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        let plain = String::from_utf8_lossy(text);
        self.0.write_all(escaped(&plain).as_bytes())?;
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_other_letters_stay() {
        assert_eq!(escaped("µm\t1\n"), "µm\t1\n");
        assert_eq!(escaped("\u{1b}]0;x\u{7}"), "\\u001b]0;x\\u0007");
        assert_eq!(escaped("a\rb\u{9b}2J\u{7f}"), "a\\u000db\\u009b2J\\u007f");
        assert_eq!(escaped("scan\u{202e}gpj.exe\u{2069}"), "scan\\u202egpj.exe\\u2069");
    }

    #[test]
    fn an_escaped_string_of_json_is_the_same_string() {
        let written = serde_json::to_string("\u{1b}\u{9b}\u{7f}µ").unwrap();
        let read: String = serde_json::from_str(&escaped(&written)).unwrap();
        assert_eq!(read, "\u{1b}\u{9b}\u{7f}µ");
    }
}
