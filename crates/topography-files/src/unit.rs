//! Units in files: parsing of their spellings, and conversion.

use super::FormatError;

/// SI prefixes with the number of prefixed units in one unit without a prefix, such as 1000 for
/// milli.
///
/// This number is a positive power of ten for all small units, so that it is exact.
const PREFIXES: [(&str, f64); 11] = [
    ("G", 1e-9),
    ("M", 1e-6),
    ("k", 1e-3),
    ("c", 1e2),
    ("m", 1e3),
    ("µ", 1e6),
    ("u", 1e6),
    ("n", 1e9),
    ("p", 1e12),
    ("f", 1e15),
    ("", 1.0),
];

/// Unit of the numbers or sides of a map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Unit {
    /// The file gives no unit.
    None,
    /// A unit of length, with the number of such units in a metre.
    Length(f64),
    /// A unit of another quantity, with its spelling in the file.
    Other(String),
}

impl Unit {
    /// Parses the spelling of a unit. `Å` is the ångström, but `A` is the ampere.
    pub(crate) fn parse(text: &str) -> Unit {
        let text = normal(text);
        if text.is_empty() {
            return Unit::None;
        }
        match length(&text) {
            Some(per_metre) => Unit::Length(per_metre),
            None => Unit::Other(text),
        }
    }

    /// Parses the unit of heights that always have one; without a spelling it is `1`.
    pub(crate) fn of_heights(text: &str) -> Unit {
        let unit = Some(Unit::parse(text)).filter(|unit| *unit != Unit::None);
        unit.unwrap_or_else(|| Unit::Other("1".to_owned()))
    }

    /// Returns a name of the unit, if there is one.
    pub(crate) fn name(&self) -> Option<String> {
        match self {
            Unit::None => None,
            Unit::Other(name) => Some(name.clone()),
            Unit::Length(per_metre) => {
                let prefix = PREFIXES.iter().find(|(_, count)| count == per_metre);
                Some(match prefix {
                    Some((prefix, _)) => format!("{prefix}m"),
                    None => format!("units of {:e} m", 1.0 / per_metre),
                })
            }
        }
    }

    /// Returns the number of such units in a metre, or `None` if this is not a unit of length.
    pub(crate) fn per_metre(&self) -> Option<f64> {
        match self {
            Unit::Length(per_metre) => Some(*per_metre),
            Unit::None | Unit::Other(_) => None,
        }
    }
}

/// Returns true if `text` is a spelling of the metre.
pub fn is_metre(text: &str) -> bool {
    Unit::parse(text) == Unit::Length(1.0)
}

/// Returns the factor that converts numbers in the unit `from` to numbers in the unit `to`. Returns
/// `None` unless the units are equal, both are units of length, or they differ only by an SI
/// prefix.
pub(crate) fn ratio(from: &str, to: &str) -> Option<f64> {
    let (from, to) = (normal(from), normal(to));
    if from == to {
        return Some(1.0);
    }
    if let (Some(from), Some(to)) = (length(&from), length(&to)) {
        return Some(to / from);
    }
    // The units differ only by a prefix, such as mV and V.
    PREFIXES.iter().find_map(|(prefix, count)| {
        let base = from.strip_prefix(prefix).filter(|base| !base.is_empty())?;
        let other = PREFIXES.iter().find(|(prefix, _)| to.strip_prefix(prefix) == Some(base))?;
        Some(other.1 / count)
    })
}

/// Returns the factor that converts lengths along y to the unit of lengths along x.
pub(crate) fn y_ratio(unit_y: &str, unit_x: &str) -> Result<f64, FormatError> {
    let allowed = || format!("a unit like that of x, `{unit_x}`");
    ratio(unit_y, unit_x).ok_or_else(|| FormatError::value("unit of y", unit_y, &allowed()))
}

/// Returns the factor that converts lengths in the unit `from` to lengths in the unit `to`.
///
/// Returns `None` if one of the two is not a unit of length.
pub fn length_ratio(from: &str, to: &str) -> Option<f64> {
    let [from, to] = [from, to].map(|unit| Unit::parse(unit).per_metre());
    Some(to? / from?)
}

/// Units of other quantities than lengths, to which a prefix of `PREFIXES` may be added.
const OTHERS: [&str; 40] = [
    "V", "A", "W", "N", "J", "K", "s", "Hz", "g", "Pa", "T", "F", "H", "C", "Ω", "ohm", "Ohm",
    "rad", "deg", "degree", "degrees", "°", "°C", "%", "1", "dB", "lm", "lx", "cd", "mol", "L",
    "eV", "bit", "bits", "px", "pixel", "pixels", "pt", "sr", "min",
];
/// Words for numbers without a unit, in lower case.
const ARBITRARY: [&str; 9] =
    ["a.u.", "au", "arb", "arb.", "arb. units", "counts", "count", "grey", "gray"];

/// Returns true if a unit is one of a known quantity other than a length, such as `mV` or `N/m`.
pub(crate) fn is_of_other_quantity(unit: &str) -> bool {
    let is_base = |part: &str| OTHERS.contains(&part);
    let is_known = |part: &str| {
        let part = part.trim().trim_end_matches(|letter: char| "0123456789^-²³⁻¹".contains(letter));
        let prefixed =
            || PREFIXES.iter().any(|(prefix, _)| part.strip_prefix(prefix).is_some_and(is_base));
        part.is_empty() || length(part).is_some() || prefixed()
    };
    ARBITRARY.contains(&unit.to_lowercase().as_str())
        || unit.split(['/', '*', '·', ' ']).all(is_known)
}

/// Spellings of the micro sign in texts that were decoded in another encoding than they were
/// written: UTF-8 read as ISO-8859-1, Windows-1252 or Windows-1251, Shift-JIS and GBK read as
/// ISO-8859-1, ISO-8859-1 read as Shift-JIS, MS-DOS, and the replacement character.
const GARBLED_MICRO: [&str; 10] =
    ["Âµ", "Î¼", "Ој", "Вµ", "\u{83}Ê", "ƒÊ", "¦Ì", "ｵ", "æ", "\u{fffd}"];

/// Normalizes the spelling of a unit: strips brackets and quotes, and replaces all variants of µ by
/// the micro sign.
fn normal(text: &str) -> String {
    let text = text.trim().trim_matches(['[', ']', '(', ')', '"']).trim();
    // Greek letter mu instead of the micro sign.
    let text = text.replace('μ', "µ");
    let garbled = GARBLED_MICRO.iter().find_map(|garbled| text.strip_prefix(garbled));
    match (garbled, text.as_str()) {
        (Some("m"), _) => "µm".to_owned(),
        // Nanoscope.
        (_, "~m") => "µm".to_owned(),
        // The sign of the unit, and UTF-8 read as ISO-8859-1, whose second letter is a space, or as
        // Windows-1252.
        (_, "\u{212b}" | "Ã" | "Ã…") => "Å".to_owned(),
        _ => text,
    }
}

/// Returns the number of units `text` in a metre, or `None` if `text` is not a unit of length.
fn length(text: &str) -> Option<f64> {
    let name = text.to_lowercase().replace("metre", "meter").replace("meters", "meter");
    let named = match name.as_str() {
        "meter" => Some(1.0),
        "centimeter" => Some(1e2),
        "millimeter" => Some(1e3),
        "micron" | "microns" | "micrometer" | "µ" => Some(1e6),
        "nanometer" => Some(1e9),
        "picometer" => Some(1e12),
        "å" | "ångström" | "ångströms" | "ångstrom" | "ångstroms" | "angstrom" | "angstroms"
        | "ang" => Some(1e10),
        // An inch is 25.4 mm, a mil a thousandth of it, and a foot 12 inches.
        "in" | "inch" | "inches" => Some(1e4 / 254.0),
        "mil" | "mils" | "thou" => Some(1e7 / 254.0),
        "µin" | "uin" | "microinch" | "microinches" => Some(1e10 / 254.0),
        "ft" | "foot" | "feet" => Some(1e4 / 3048.0),
        _ => None,
    };
    let of_prefix = || {
        let prefix = text.strip_suffix('m')?;
        let of = PREFIXES.iter().find(|(known, _)| *known == prefix);
        of.map(|(_, count)| *count)
    };
    named.or_else(of_prefix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_micrometre_has_many_spellings() {
        for text in [
            "µm",
            "μm",
            "um",
            "~m",
            "æm",
            " [µm] ",
            "microns",
            "Âµm",
            "Î¼m",
            "¦Ìm",
            "\u{83}Êm",
            "ｵm",
            "\u{fffd}m",
        ] {
            assert_eq!(Unit::parse(text), Unit::Length(1e6), "{text}");
        }
    }

    #[test]
    fn units_of_other_quantities_keep_their_spelling() {
        assert_eq!(Unit::parse("mV"), Unit::Other("mV".to_owned()));
        assert_eq!(Unit::parse("A"), Unit::Other("A".to_owned()));
        assert_eq!(Unit::parse(" "), Unit::None);
        assert!(is_metre("m") && is_metre(" metre ") && !is_metre("mm") && !is_metre(""));
        assert_eq!(Unit::parse("Å"), Unit::Length(1e10));
    }

    #[test]
    fn imperial_units_and_angstroms_are_lengths() {
        let metres = |text: &str| 1.0 / Unit::parse(text).per_metre().unwrap();
        let agrees = |text: &str, expected: f64| {
            assert!((metres(text) / expected - 1.0).abs() < 1e-14, "{text}");
        };
        ["in", "inch", "inches"].into_iter().for_each(|text| agrees(text, 0.0254));
        ["mil", "mils", "thou"].into_iter().for_each(|text| agrees(text, 25.4e-6));
        for text in ["Å", "Angstroms", "angstrom", "Ångströms", "Ã\u{85}"] {
            agrees(text, 1e-10);
        }
        agrees("µin", 25.4e-9);
    }

    #[test]
    fn units_of_known_quantities_are_told_from_other_words() {
        for unit in ["V", "mV", "nA", "N/m", "m/s", "deg", "a.u.", "%", "m^2", "nN", "1/0"] {
            assert!(is_of_other_quantity(unit), "{unit}");
        }
        for unit in ["furlong", "foo", "xyz", "Vx", "scan"] {
            assert!(!is_of_other_quantity(unit), "{unit}");
        }
    }

    #[test]
    fn prefixes_of_one_unit_have_a_ratio() {
        assert_eq!(ratio("mV", "V"), Some(1e-3));
        assert_eq!(ratio("V", "V"), Some(1.0));
        assert_eq!(ratio("nm", "pm"), Some(1e3));
        assert_eq!(ratio("V", "nm"), None);
    }
}
