//! Units in files: parsing of their spellings, and conversion.

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
pub enum Unit {
    /// The file gives no unit.
    None,
    /// A unit of length, with the number of such units in a metre.
    Length(f64),
    /// A unit of another quantity, with its spelling in the file.
    Other(String),
}

impl Unit {
    /// Parses the spelling of a unit. `Å` is the ångström, but `A` is the ampere.
    pub fn parse(text: &str) -> Unit {
        let text = normal(text);
        if text.is_empty() {
            return Unit::None;
        }
        match length(&text) {
            Some(per_metre) => Unit::Length(per_metre),
            None => Unit::Other(text),
        }
    }

    /// Returns the number of such units in a metre, or `None` if this is not a unit of length.
    pub fn per_metre(&self) -> Option<f64> {
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
pub fn ratio(from: &str, to: &str) -> Option<f64> {
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

/// Returns the factor that converts lengths in the unit `from` to lengths in the unit `to`.
///
/// Returns `None` if one of the two is not a unit of length.
pub fn length_ratio(from: &str, to: &str) -> Option<f64> {
    let [from, to] = [from, to].map(|unit| Unit::parse(unit).per_metre());
    Some(to? / from?)
}

/// Normalizes the spelling of a unit: strips brackets and quotes, and replaces all variants of µ by
/// the micro sign.
fn normal(text: &str) -> String {
    let text = text.trim().trim_matches(['[', ']', '(', ')', '"']).trim();
    // Greek letter mu instead of the micro sign. Below: `æm` in files of MS-DOS, `~m` in Nanoscope.
    let text = text.replace('μ', "µ");
    match text.as_str() {
        "æm" | "~m" => "µm".to_owned(),
        _ => text,
    }
}

/// Returns the number of units `text` in a metre, or `None` if `text` is not a unit of length.
fn length(text: &str) -> Option<f64> {
    let named = match text.to_lowercase().as_str() {
        "meter" | "metre" | "meters" | "metres" => Some(1.0),
        "millimeter" | "millimetre" | "millimeters" | "millimetres" => Some(1e3),
        "micron" | "microns" | "micrometer" | "micrometre" | "micrometers" | "micrometres"
        | "µ" => Some(1e6),
        "nanometer" | "nanometre" | "nanometers" | "nanometres" => Some(1e9),
        "å" | "ångström" | "angstrom" | "ångstrom" => Some(1e10),
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
        for text in ["µm", "μm", "um", "~m", "æm", " [µm] ", "microns"] {
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
    fn prefixes_of_one_unit_have_a_ratio() {
        assert_eq!(ratio("mV", "V"), Some(1e-3));
        assert_eq!(ratio("V", "V"), Some(1.0));
        assert_eq!(ratio("nm", "pm"), Some(1e3));
        assert_eq!(ratio("V", "nm"), None);
    }
}
