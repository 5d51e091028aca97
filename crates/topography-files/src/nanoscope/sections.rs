//! The text header: sections `\*Name` of entries `\Name: value`.

use crate::cursor::latin1;
use crate::entries::Entries;
use crate::error::FormatError;

/// A section; all names are in small letters.
pub struct Section {
    name: String,
    entries: Entries,
}

/// A value such as `V [Sens. Zsens] (0.006713867 V/LSB) 2.910461 V`.
pub struct Scale {
    /// What stands in brackets: the name of another entry.
    pub soft: Option<String>,
    /// What stands behind: a number and its unit.
    pub value: String,
}

/// The sections of a file, up to `\*File list end`.
pub fn parse(bytes: &[u8]) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    for line in bytes.split(|&byte| byte == b'\n') {
        let line = latin1(line);
        let Some(line) = line.trim().strip_prefix('\\') else {
            break;
        };
        if let Some(name) = line.strip_prefix('*') {
            let name = name.to_lowercase();
            if name == "file list end" {
                break;
            }
            let entries = Entries::default();
            sections.push(Section { name, entries });
        } else if let (Some(section), Some((key, value))) =
            (sections.last_mut(), line.split_once(": "))
        {
            section.entries.insert(&key.to_lowercase(), value);
        }
    }
    sections
}

/// A number and its unit, such as `2.910461 V`.
pub fn quantity(name: &str, text: &str) -> Result<(f64, String), FormatError> {
    let text = text.trim();
    let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
    let number = number.parse();
    let number = number.map_err(|_| FormatError::value(name, text, "a number, and its unit"))?;
    Ok((number, unit.trim().to_owned()))
}

impl Section {
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it describes a map; older programs have other names for such sections.
    pub fn is_image(&self) -> bool {
        let names = [
            "ciao image list",
            "afm image list",
            "stm image list",
            "ncafm image list",
            "image list",
        ];
        names.contains(&&*self.name)
    }

    pub fn get(&self, key: &str) -> Option<&str> {
        self.entries.get(key)
    }

    pub fn whole(&self, key: &str) -> Result<i64, FormatError> {
        self.entries.whole(key)
    }

    /// What the map is of: `Height`, for instance.
    pub fn image_name(&self) -> String {
        let keys = ["@2:image data", "@3:image data", "@4:image data"];
        let scale = keys.iter().find_map(|key| self.get(key));
        let scale = scale.and_then(|text| Scale::parse("image data", text).ok());
        let name = match scale {
            Some(scale) => scale.soft.unwrap_or(scale.value),
            None => self.get("image data").unwrap_or("heights").to_owned(),
        };
        name.trim_matches('"').to_owned()
    }

    /// Sides of the scan and their unit; square scans of old files have one.
    pub fn scan_size(&self) -> Result<(f64, f64, String), FormatError> {
        let text = self.entries.text("scan size")?;
        let (x, rest) = quantity("scan size", text)?;
        let (y, unit) = quantity("scan size", &rest).unwrap_or((x, rest));
        Ok((x, y, unit))
    }

    /// Whether its nodes are as far apart along y as along x.
    pub fn is_square(&self) -> bool {
        let ratio = self.get("aspect ratio").unwrap_or("1:1");
        let first = ratio.split(':').next().and_then(|first| first.parse().ok());
        first.is_none_or(|first: f64| first == 1.0)
    }
}

impl Scale {
    /// # Errors
    /// When a bracket is not closed.
    pub fn parse(name: &str, text: &str) -> Result<Scale, FormatError> {
        let open = || FormatError::value(name, text, "closed where a bracket is open");
        // The letter in front says whether it is a value, a scale or a choice.
        let mut rest = text.trim();
        rest = rest.strip_prefix(char::is_alphabetic).unwrap_or(rest);
        let mut soft = None;
        rest = rest.trim_start();
        if let Some(inside) = rest.strip_prefix('[') {
            let (name, behind) = inside.split_once(']').ok_or_else(open)?;
            soft = Some(name.trim().to_owned()).filter(|name| !name.is_empty());
            rest = behind.trim_start();
        }
        if rest.starts_with('(') {
            // Units such as log(Arb) have parentheses of their own.
            let mut depth = 0;
            let end = rest.char_indices().find_map(|(index, letter)| {
                depth += i32::from(letter == '(') - i32::from(letter == ')');
                (depth == 0).then_some(index)
            });
            rest = &rest[end.ok_or_else(open)? + 1..];
        }
        let value = rest.trim().to_owned();
        Ok(Scale { soft, value })
    }
}
