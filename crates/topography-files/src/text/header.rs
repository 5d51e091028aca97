//! Header of a text file: the lines above the numbers.

use crate::FormatError;
use crate::unit::{Unit, y_ratio};

// Names of each entry, in lower case. Gwyddion writes them in the language of its interface.
const CHANNEL: &[&str] =
    &["channel", "kanál", "kanal", "canal", "canale", "チャネル", "채널", "канал"];
const WIDTH: &[&str] = &[
    "width",
    "x length",
    "x size",
    "x range",
    "size x",
    "scan size x",
    "scan width",
    "xreal",
    "šířka",
    "breite",
    "anchura",
    "largeur",
    "larghezza",
    "幅",
    "폭",
    "largura",
    "ширина",
];
const HEIGHT: &[&str] = &[
    "height",
    "y length",
    "y size",
    "y range",
    "size y",
    "scan size y",
    "scan height",
    "yreal",
    "výška",
    "höhe",
    "altura",
    "hauteur",
    "altezza",
    "高さ",
    "높이",
    "высота",
];
const VALUE_UNIT: &[&str] = &[
    "value units",
    "z unit",
    "z units",
    "height unit",
    "height units",
    "unit data",
    "jednotky hodnot",
    "einheiten",
    "unités",
    "unità valore",
    "値の単位",
    "값 단위",
    "unidades de valor",
    "единицы измерения",
    "unit",
    "units",
];
const UNIT_X: &[&str] =
    &["x unit", "unit x", "xy unit", "xy units", "lateral unit", "lateral units", "unit", "units"];
const UNIT_Y: &[&str] =
    &["y unit", "unit y", "xy unit", "xy units", "lateral unit", "lateral units", "unit", "units"];
const NODES_X: &[&str] = &["x pixels", "w", "nx"];
const NODES_Y: &[&str] = &["y pixels", "h", "ny"];
const STEP_X: &[&str] = &["pixel size", "scale x", "dx", "x step", "pixel size x"];
const STEP_Y: &[&str] =
    &["scale y", "dy", "y step", "pixel size y", "pixel size", "scale x", "dx", "x step"];
/// Names of pairs, such as `Scan size: 10 µm x 5 µm`, with the names of the two parts.
const PAIRS: [(&str, [&str; 2]); 5] = [
    ("scan size", ["width", "height"]),
    ("image size", ["width", "height"]),
    ("size", ["width", "height"]),
    ("pixel size", ["dx", "dy"]),
    ("step", ["dx", "dy"]),
];
/// Name of the factor that converts numbers to nanometres in files of SPIP.
const NANOMETRES: &[&str] = &["bit2nm"];
/// Name of the factor that converts numbers to heights; a unit stands between the two parts.
const FACTOR: [&str; 2] = ["height conversion factor (->", ")"];

/// Entries of a header: pairs of a name in lower case and a value.
#[derive(Debug, Clone, Default)]
pub(crate) struct Header {
    entries: Vec<(String, String)>,
}

/// Properties of a map as given by its header.
#[derive(Debug, Clone)]
pub(crate) struct Description {
    pub(crate) name: Option<String>,
    pub(crate) lateral: Unit,
    pub(crate) height: Unit,
    /// Factor that converts numbers to heights in the unit `height`.
    pub(crate) factor: f64,
    /// Side lengths along x and y in the unit `lateral`.
    pub(crate) sides: Option<[f64; 2]>,
    /// Factor that converts lengths along y to the unit `lateral`.
    pub(crate) y_ratio: f64,
}

impl Header {
    /// Adds the entries of a line `name: value`, `name = value` or `name=value name=value …`, or
    /// the units of column titles such as `X [µm]  Y [µm]  Z [nm]`.
    pub(crate) fn add(&mut self, line: &str) {
        if let [Some(x), Some(y), Some(z)] = ['x', 'y', 'z'].map(|axis| unit_of_title(line, axis)) {
            let names = ["x unit", "y unit", "z unit"].map(str::to_owned);
            self.entries.extend(names.into_iter().zip([x, y, z]));
            return;
        }
        let line = line.trim_start_matches(['#', '%', ' ', '\t']);
        let words = || line.split_whitespace();
        if words().count() > 1 && words().all(|word| word.contains('=')) {
            words().for_each(|word| self.add_entry(word));
        } else {
            // `width = 3 µm; height = 2 µm`
            let is_list =
                |between: &char| line.split(*between).all(|part| part.contains(['=', ':']));
            match [';', ','].iter().find(|between| line.contains(**between) && is_list(between)) {
                Some(between) => line.split(*between).for_each(|part| self.add_entry(part)),
                None => self.add_entry(line),
            }
        }
    }

    fn add_entry(&mut self, text: &str) {
        let Some((name, value)) = text.split_once([':', '=', '：']) else { return };
        let (name, value) = (name.trim().to_lowercase(), value.trim());
        if name.starts_with(FACTOR[0]) {
            self.entries.push((name, value.to_owned()));
            return;
        }
        let name = name.replace(['_', '-'], " ");
        // `Width (µm): 3`
        let bracket = name.trim_end_matches([')', ']']).rsplit_once(['(', '[']);
        match bracket.filter(|(_, unit)| Unit::parse(unit).per_metre().is_some()) {
            Some((name, unit)) => {
                self.entries.push((name.trim().to_owned(), format!("{value} {unit}")));
            }
            None => match pair(&name, value) {
                Some(pair) => self.entries.extend(pair),
                None => self.entries.push((name, value.to_owned())),
            },
        }
    }

    /// Returns true if the line starts the header of another map.
    pub(crate) fn starts_with(line: &str) -> bool {
        let mut header = Header::default();
        header.add(line);
        [CHANNEL, WIDTH].iter().any(|names| header.get(names).is_some())
    }

    /// Returns true if the header gives sides or numbers of nodes, so that the file is a matrix.
    pub(crate) fn is_of_matrix(&self) -> bool {
        let known = [WIDTH, HEIGHT, NODES_X, NODES_Y, STEP_X];
        known.iter().any(|names| self.get(names).is_some())
    }

    /// Returns true if the header gives this number of lines.
    pub(crate) fn states_lines(&self, lines: usize) -> bool {
        self.get(NODES_Y).is_some_and(|text| text.parse() == Ok(lines))
    }

    /// Interprets the entries for a matrix with these numbers of columns and lines.
    ///
    /// # Errors
    /// Returns an error if a number is invalid or contradicts the matrix.
    pub(crate) fn describe(&self, nodes: [usize; 2]) -> Result<Description, FormatError> {
        self.agrees(NODES_X, nodes[0])?;
        self.agrees(NODES_Y, nodes[1])?;
        let (height, factor) = self.height()?;
        let x = self.side(WIDTH, STEP_X, nodes[0])?;
        let y = self.side(HEIGHT, STEP_Y, nodes[1])?;
        // A side has its own unit, that of an entry, or that of the heights.
        let unit = |side: &Option<(f64, Option<String>)>, names: &[&str]| {
            let own = side.as_ref().and_then(|(_, unit)| unit.clone());
            let of_format = || self.get(&["file format"]).map(|_| "nm".to_owned());
            own.or_else(|| self.get(names).map(str::to_owned)).or_else(of_format)
        };
        let unit_x = unit(&x, UNIT_X).or(height.clone()).unwrap_or_default();
        let unit_y = unit(&y, UNIT_Y).unwrap_or_else(|| unit_x.clone());
        let y_ratio = y_ratio(&unit_y, &unit_x)?;
        Ok(Description {
            name: self.get(CHANNEL).map(str::to_owned),
            lateral: Unit::parse(&unit_x),
            height: Unit::parse(&height.unwrap_or_default()),
            factor,
            sides: x.zip(y).map(|((x, _), (y, _))| [x, y * y_ratio]),
            y_ratio,
        })
    }

    /// Returns the value of the first of `names` that occurs in the header. If that name is
    /// repeated, its last value counts.
    fn get(&self, names: &[&str]) -> Option<&str> {
        let of = |wanted: &&str| {
            let mut entries = self.entries.iter().rev();
            entries.find(|(name, _)| name == wanted)
        };
        names.iter().find_map(of).map(|(_, value)| value.as_str())
    }

    /// Checks that the number of nodes that the header gives under one of `names`, if any, is
    /// `found`, the number of nodes of the matrix.
    fn agrees(&self, names: &[&str], found: usize) -> Result<(), FormatError> {
        match self.get(names) {
            Some(text) if text.parse() != Ok(found) => {
                let allowed = format!("{found}, the number in the matrix");
                Err(FormatError::value(names[0], text, &allowed))
            }
            _ => Ok(()),
        }
    }

    /// Returns the unit of the heights, if any, and the factor that converts the numbers of the
    /// matrix to this unit.
    fn height(&self) -> Result<(Option<String>, f64), FormatError> {
        let conversion = self.entries.iter().find_map(|(name, value)| {
            let unit = name.strip_prefix(FACTOR[0])?.strip_suffix(FACTOR[1])?;
            Some((unit.trim().to_owned(), value))
        });
        if let Some((unit, value)) = conversion {
            let (factor, _) = quantity("height conversion factor", value)?;
            return Ok((Some(unit), factor));
        }
        let unit = self.get(VALUE_UNIT).filter(|unit| !unit.is_empty());
        match (unit, self.get(NANOMETRES)) {
            (None, Some(value)) => {
                let (factor, _) = quantity("bit2nm", value)?;
                Ok((Some("nm".to_owned()), factor))
            }
            (unit, _) => Ok((unit.map(str::to_owned), 1.0)),
        }
    }

    /// Returns a side length of the map and its unit, or `None` if the header gives neither the
    /// side nor the pixel size. `side` and `step` are the possible names of the side and of the
    /// pixel size. A pixel size is multiplied by `nodes`.
    fn side(
        &self,
        side: &[&str],
        step: &[&str],
        nodes: usize,
    ) -> Result<Option<(f64, Option<String>)>, FormatError> {
        let (name, value, times) = match (self.get(side), self.get(step)) {
            (Some(value), _) => (side[0], value, 1.0),
            (None, Some(value)) => (step[0], value, nodes as f64),
            (None, None) => return Ok(None),
        };
        let (number, unit) = quantity(name, value)?;
        Ok(Some((number * times, unit)))
    }
}

impl Description {
    /// Replaces the units by those of titles, of axes or of the heights.
    ///
    /// # Errors
    /// Returns an error if the units of x and y are of different quantities.
    pub(crate) fn set_units(
        &mut self,
        x: Option<&str>,
        y: Option<&str>,
        height: Option<&str>,
    ) -> Result<(), FormatError> {
        if let Some(x) = x.or(y) {
            let y = y.unwrap_or(x);
            self.y_ratio = y_ratio(y, x)?;
            self.lateral = Unit::parse(x);
        }
        if let Some(height) = height {
            self.height = Unit::parse(height);
        }
        Ok(())
    }
}

/// Returns the unit in the title of a column, such as `X [µm]` or `x (µm)`, if the line has a title
/// for this axis.
fn unit_of_title(line: &str, axis: char) -> Option<String> {
    let mut titles = line.char_indices().filter(|(_, letter)| letter.eq_ignore_ascii_case(&axis));
    titles.find_map(|(start, _)| {
        let is_in_word = line[..start].ends_with(char::is_alphanumeric);
        let unit = line[start + 1..].trim_start().strip_prefix(['[', '('])?;
        let (unit, _) = unit.split_once([']', ')'])?;
        (!is_in_word).then(|| unit.trim().to_owned())
    })
}

/// Splits an entry such as `scan size: 10 µm x 5 µm` or `scan size: 10 x 5 µm` into those of x and
/// y. Pairs without a unit of length are numbers of nodes.
fn pair(name: &str, value: &str) -> Option<[(String, String); 2]> {
    let (_, names) = PAIRS.iter().find(|(known, _)| *known == name)?;
    let (x, y) = [" x ", "×", " by ", "*"].iter().find_map(|between| value.split_once(between))?;
    let (_, unit) = quantity(name, y.trim()).ok()?;
    let unit = unit.filter(|unit| Unit::parse(unit).per_metre().is_some())?;
    let x = match quantity(name, x.trim()).ok()? {
        (_, Some(_)) => x.trim().to_owned(),
        (_, None) => format!("{} {unit}", x.trim()),
    };
    Some([(names[0].to_owned(), x), (names[1].to_owned(), y.trim().to_owned())])
}

/// Parses a number with an optional unit, as in `10 µm`. `name` names the entry in errors.
fn quantity(name: &str, text: &str) -> Result<(f64, Option<String>), FormatError> {
    let end = text.find(|letter: char| !letter.is_ascii_digit() && !"+-.,eE".contains(letter));
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let parsed = number.replacen(',', ".", 1).parse::<f64>();
    let number = parsed.map_err(|_| FormatError::value(name, text, "a number and its unit"))?;
    Ok((number, Some(unit.trim().to_owned()).filter(|unit| !unit.is_empty())))
}
