//! Titles of the columns of a text, and the part that each column has.

use crate::FormatError;
use crate::direction::Direction;
use crate::number;
use crate::unit::{Unit, is_of_other_quantity};

/// Title of a column, with the unit that it names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Title {
    pub(crate) name: String,
    pub(crate) unit: Option<String>,
}

/// Part of a column in a list of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    X,
    Y,
    Height,
    /// One for a measured point, zero for a missing one.
    Valid,
    /// Number of the line.
    Index,
    Other,
}

impl Title {
    /// Parses `x [µm]`, `Height(um)`, `X_(microns)`, `x in µm`, `X / µm`, `X, µm`, `x_um` or `x
    /// µm`.
    ///
    /// The part after an underscore or a space is a unit only if it is a unit of length: it may as
    /// well be a part of the name.
    pub(crate) fn parse(text: &str) -> Title {
        let text = text.trim().trim_matches('"').trim_start_matches(['#', '%']).trim();
        let new = |name: &str, unit: &str| Title {
            name: name.trim_end_matches([' ', '_', ':', '.', '-']).trim().to_owned(),
            unit: Some(unit.trim().to_owned()).filter(|unit| !unit.is_empty()),
        };
        let bracket = ['[', '(', '{', '<'].into_iter().filter_map(|open| text.find(open)).min();
        if let Some(open) = bracket
            && text.ends_with([']', ')', '}', '>'])
        {
            return new(&text[..open], &text[open + 1..text.len() - 1]);
        }
        for between in [" in ", " / ", ", "] {
            if let Some((name, unit)) = text.split_once(between) {
                return new(name, unit);
            }
        }
        // R writes `x..um.` for `x (um)`.
        let plain = text.trim_end_matches('.');
        for between in ['/', '_', ' ', ':', '.'] {
            if let Some((name, unit)) = plain.rsplit_once(between)
                && Unit::parse(unit).per_metre().is_some()
            {
                return new(name, unit);
            }
        }
        new(text, "")
    }

    /// Refuses a unit that is none of a known quantity.
    pub(crate) fn check_unit(&self) -> Result<(), FormatError> {
        match &self.unit {
            Some(unit) if !is_unit(unit) => {
                let entry = format!("unit of column {}", self.name);
                Err(FormatError::value(&entry, unit, "a known unit, such as µm"))
            }
            _ => Ok(()),
        }
    }

    /// Returns the unit, or degrees for longitude and latitude without one.
    pub(crate) fn unit_or_degrees(&self) -> Option<&str> {
        let degrees = Direction::is_of_globe(&self.name).then_some("degrees");
        self.unit.as_deref().or(degrees)
    }

    /// Returns the part of a column, as its name says.
    pub(crate) fn role(&self) -> Role {
        let name = self.name.to_lowercase();
        let words = || name.split(|letter: char| !letter.is_alphanumeric());
        let has = |known: &[&str]| words().any(|word| known.contains(&word));
        match () {
            () if name.is_empty() || has(&["index", "idx", "no", "nr", "id"]) => Role::Index,
            () if has(&["valid", "isvalid"]) => Role::Valid,
            () => match Direction::of_name(&name) {
                Some(Direction::X) => Role::X,
                Some(Direction::Y) => Role::Y,
                Some(Direction::Z) => Role::Height,
                None if has(&["height", "heights", "topography", "elevation"]) => Role::Height,
                None => Role::Other,
            },
        }
    }
}

/// Returns the titles of `columns` columns that are separated by `separator`, like the numbers.
///
/// Words that are separated in another way are titles only if they name x and y, or units: a
/// comment may have any number of words. `write.table` of R has no title above the names of the
/// lines, but quotes around all others, or titles such as `V1`. Returns `None` if the line has no
/// titles.
pub(crate) fn titles(line: &str, separator: Option<char>, columns: usize) -> Option<Vec<Title>> {
    let text = line.trim_start().trim_start_matches(['#', '%']);
    let parsed = |cells: Vec<&str>| -> Option<Vec<Title>> {
        let is_named = cells.iter().any(|cell| cell.chars().any(char::is_alphabetic));
        let is_one_each = cells.len() == columns && is_named;
        is_one_each.then(|| cells.into_iter().map(Title::parse).collect())
    };
    let between = |separator: char| {
        let mut cells = split(text, separator);
        if cells.len() == columns + 1 && cells.last().is_some_and(|cell| cell.trim().is_empty()) {
            cells.pop();
        }
        parsed(cells)
    };
    if let Some(titles) = separator.and_then(between) {
        return Some(titles);
    }
    let cells = separator.map_or_else(|| text.split_whitespace().collect(), |one| split(text, one));
    let is_quoted = |cell: &&str| cell.len() > 1 && cell.starts_with('"') && cell.ends_with('"');
    if cells.len() + 1 == columns {
        let is_numbered =
            |cell: &&str| cell.starts_with('V') && number::parse(&cell[1..]).is_some();
        if cells.iter().all(is_quoted) || cells.iter().all(is_numbered) {
            return Some([""].into_iter().chain(cells).map(Title::parse).collect());
        }
    }
    let is_certain = |titles: &Vec<Title>| {
        let has = |role| titles.iter().any(|title| title.role() == role);
        let has_units = || titles.iter().all(|title| title.unit.as_deref().is_some_and(is_unit));
        (has(Role::X) && has(Role::Y))
            || has_units()
            || titles.iter().all(|title| is_unit(&title.name))
    };
    let others = [';', '\t', ','].into_iter().find_map(between);
    if let Some(titles) = others.filter(is_certain) {
        return Some(titles);
    }
    // `X [µm]  Y [µm]` or `x in µm y in µm`.
    let wide: Vec<&str> = text.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect();
    let wide = parsed(wide).filter(is_certain);
    wide.or_else(|| parsed(merged(text).iter().map(String::as_str).collect()).filter(is_certain))
}

/// Splits titles at spaces, but not before their units.
fn merged(text: &str) -> Vec<String> {
    let mut cells: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let continues = |cell: &String| {
            word.starts_with(['[', '(', '{', '<', '/'])
                || word == "in"
                || cell.ends_with(" in")
                || cell.ends_with(['/', ','])
        };
        match cells.last_mut() {
            Some(cell) if continues(cell) => *cell = format!("{cell} {word}"),
            _ => cells.push(word.to_owned()),
        }
    }
    cells
}

/// Adds the units of a second line of titles, such as `[mm];[mm];[µm]`, to the titles.
///
/// Returns false if a cell of the line is no unit.
pub(crate) fn add_units(titles: &mut [Title], units: &[Title]) -> bool {
    let unit = |title: &Title| match (&title.unit, title.name.as_str()) {
        (Some(unit), "") => Some(unit.clone()),
        (None, "") => Some(String::new()),
        (None, name) if is_unit(name) => Some(name.to_owned()),
        _ => None,
    };
    let found: Option<Vec<String>> = units.iter().map(unit).collect();
    let Some(found) = found.filter(|found| found.iter().any(|unit| !unit.is_empty())) else {
        return false;
    };
    for (title, unit) in titles.iter_mut().zip(found) {
        title.unit = title.unit.take().or(Some(unit).filter(|unit| !unit.is_empty()));
    }
    true
}

/// Returns true if a word is a unit of a length or of another known quantity.
pub(crate) fn is_unit(word: &str) -> bool {
    match Unit::parse(word) {
        Unit::Length(_) => true,
        Unit::Other(unit) => is_of_other_quantity(&unit),
        Unit::None => false,
    }
}

/// Splits a line at a separator, except within quotes.
pub(crate) fn split(line: &str, separator: char) -> Vec<&str> {
    let mut is_quoted = false;
    line.split(move |letter: char| {
        is_quoted ^= letter == '"';
        letter == separator && !is_quoted
    })
    .collect()
}

/// Returns true if titles name different quantities, and not the columns of a matrix.
///
/// A line with an empty cell or a number is no line of titles, but of a header that a spreadsheet
/// has filled up with separators.
pub(crate) fn is_table(titles: &[Title]) -> bool {
    let rest = match titles {
        [first, rest @ ..] if first.role() == Role::Index => rest,
        all => all,
    };
    let is_no_title = |title: &Title| title.name.is_empty() || number::parse(&title.name).is_some();
    let is_of_other = |title: &Title| {
        title.unit.as_deref().is_some_and(|unit| Unit::parse(unit).per_metre().is_none())
    };
    let may_be_table = rest.len() > 3 || rest.iter().take(2).any(is_of_other);
    may_be_table && !rest.iter().any(is_no_title) && !are_labels(rest)
}

/// Returns true if titles are labels of the columns of a matrix, such as `y1, y2, y3`, `p, q, r`
/// or `col_0_um, col_1_um`: names that differ only by a number or a letter.
fn are_labels(titles: &[Title]) -> bool {
    let stem = |title: &Title| {
        title.name.replace(|letter: char| letter.is_ascii_digit() || ".-+".contains(letter), "")
    };
    let stems: Vec<String> = titles.iter().map(stem).collect();
    let is_numbered = stems.windows(2).all(|pair| pair[0] == pair[1]);
    let units_agree = titles.windows(2).all(|pair| pair[0].unit == pair[1].unit);
    let is_letter = |title: &Title| title.name.chars().count() == 1;
    units_agree && (is_numbered || titles.iter().all(is_letter) || are_letters(titles))
}

/// Returns true if titles are the letters of the columns of a spreadsheet: A, B, …, Z, AA, AB, …,
/// which may follow the title of an index.
pub(crate) fn are_letters(titles: &[Title]) -> bool {
    let rest = match titles {
        [first, rest @ ..] if first.name.is_empty() => rest,
        all => all,
    };
    let letters = |mut index: usize| {
        let mut letters = String::new();
        loop {
            letters.insert(0, char::from(b'a' + (index % 26) as u8));
            index = match (index / 26).checked_sub(1) {
                Some(index) => index,
                None => return letters,
            };
        }
    };
    rest.iter().enumerate().all(|(index, title)| title.name.to_lowercase() == letters(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn parses(text: &str, name: &str, unit: &str) {
        let unit = Some(unit.to_owned()).filter(|unit| !unit.is_empty());
        assert_eq!(Title::parse(text), Title { name: name.to_owned(), unit }, "{text}");
    }

    #[test]
    fn units_of_titles_have_many_spellings() {
        for text in
            ["x [µm]", "x(µm)", "x_(µm)", "x in µm", "x / µm", "x/µm", "x, µm", "x_µm", "x µm"]
        {
            parses(text, "x", "µm");
        }
        parses("\"Height(um)\"", "Height", "um");
        parses("# X_(microns)", "X", "microns");
        parses("x_pos", "x_pos", "");
        parses("z_raw", "z_raw", "");
        parses("Time (s)", "Time", "s");
        parses("x [furlong]", "x", "furlong");
    }

    #[test]
    fn names_tell_the_parts_of_columns() {
        let role = |text: &str| Title::parse(text).role();
        for text in ["x", "X [m]", "X-Axis", "xpos", "pos x", "X Coordinate (mm)"] {
            assert_eq!(role(text), Role::X, "{text}");
        }
        assert_eq!(
            (role("y_um"), role("Z"), role("Height [nm]")),
            (Role::Y, Role::Height, Role::Height)
        );
        assert_eq!(
            (role(""), role("index"), role("valid")),
            (Role::Index, Role::Index, Role::Valid)
        );
        assert_eq!((role("Force"), role("extend")), (Role::Other, Role::Other));
    }

    #[test]
    fn titles_are_separated_like_the_numbers_or_by_spaces() {
        let names = |line: &str, separator, columns| {
            let titles = titles(line, separator, columns)?;
            Some(titles.into_iter().map(|title| title.name).collect::<Vec<_>>().join("|"))
        };
        let names = |line, separator, columns| names(line, separator, columns).unwrap_or_default();
        assert_eq!(names("X, µm\tY, µm\tZ, nm", Some('\t'), 3), "X|Y|Z");
        assert_eq!(names("# X [µm] Y [µm] Z [nm]", None, 3), "X|Y|Z");
        assert_eq!(names("x in µm y in µm z in nm", None, 3), "x|y|z");
        assert_eq!(names("x,y,z", Some(','), 3), "x|y|z");
        assert_eq!(names("# Width: 3 µm", None, 3), "");
        assert_eq!(names("\"a,b\",c", Some(','), 2), "a,b|c");
    }

    #[test]
    fn labels_differ_only_by_a_number() {
        let labels = |line: &str, columns| are_labels(&titles(line, Some(','), columns).unwrap());
        assert!(labels("y0,y1,y2,y3", 4) && labels("A,B,C,D", 4) && labels("0 um,0.5 um", 2));
        assert!(labels("x0_left,x1_left", 2));
        assert!(!labels("Time,Force,Height", 3) && !labels("Z (nm),Z (V)", 2));
    }

    #[test]
    fn letters_of_a_spreadsheet_go_on_with_two_letters() {
        let letters = "A,B,C,D,E,F,G,H,I,J,K,L,M,N,O,P,Q,R,S,T,U,V,W,X,Y,Z,AA,AB";
        assert!(are_letters(&titles(letters, Some(','), 28).unwrap()));
        assert!(!are_letters(&titles("x,y,z", Some(','), 3).unwrap()));
    }

    #[test]
    fn a_header_filled_up_with_separators_is_no_table() {
        let is_table = |line: &str| is_table(&titles(line, Some(','), 4).unwrap());
        assert!(!is_table("Date,2024-01-05,,") && !is_table("Sample,steel,2020,a"));
        assert!(is_table("Time,Force,Height,Phase"));
    }
}
