//! Output of commands, in which no text can steer the terminal.
//!
//! Names, units and titles come from manifests and from instruments' files. A control character in
//! one of them could clear the screen, set the window's title or hide what follows. Everything that
//! the command prints goes through this file, which writes such characters as JSON does: `\u001b`.

use std::borrow::Cow;
use std::io::{self, IsTerminal, StdoutLock, Write};

/// Returns the text with each control character but line ends and tabs written as `\u001b`.
pub fn escaped(text: &str) -> Cow<'_, str> {
    let steers = |letter: char| letter.is_control() && letter != '\n' && letter != '\t';
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len());
    for letter in text.chars() {
        if steers(letter) {
            plain += &format!("\\u{:04x}", u32::from(letter));
        } else {
            plain.push(letter);
        }
    }
    Cow::Owned(plain)
}

/// Standard output, with control characters escaped.
pub struct Output(StdoutLock<'static>);

/// Locks and returns the standard output.
pub fn stdout() -> Output {
    Output(io::stdout().lock())
}

impl Output {
    /// Clears the screen, if the output is a terminal.
    pub fn clear(&mut self) -> io::Result<()> {
        if self.0.is_terminal() {
            self.0.write_all(b"\x1b[H\x1b[2J")?;
        }
        Ok(())
    }

    /// Writes data that programs read: exact to the byte, unless they go to a terminal.
    pub fn write_data(&mut self, data: &[u8]) -> io::Result<()> {
        if self.0.is_terminal() { self.write_all(data) } else { self.0.write_all(data) }
    }
}

impl Write for Output {
    /// Expects whole characters, as `write!` passes them.
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
    }

    #[test]
    fn an_escaped_string_of_json_is_the_same_string() {
        let written = serde_json::to_string("\u{1b}\u{9b}\u{7f}µ").unwrap();
        let read: String = serde_json::from_str(&escaped(&written)).unwrap();
        assert_eq!(read, "\u{1b}\u{9b}\u{7f}µ");
    }
}
