//! Units as files write them.

/// The prefixes of the SI that lengths, voltages and their like are written with, and how many of
/// such units are one without prefix: powers of ten that are whole numbers are exact.
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

/// What a unit is of.
#[derive(Debug, Clone, PartialEq)]
pub enum Unit {
    /// None is given.
    None,
    /// A length, by how many of it are a metre.
    Length(f64),
    /// Anything else, as the file writes it.
    Other(String),
}

impl Unit {
    /// The unit that is written so. The ångström is `Å`: a lone `A` is the ampere.
    pub fn of(text: &str) -> Unit {
        let text = normal(text);
        if text.is_empty() {
            return Unit::None;
        }
        match length(&text) {
            Some(per_metre) => Unit::Length(per_metre),
            None => Unit::Other(text),
        }
    }

    /// How many of a length are a metre.
    pub fn per_metre(&self) -> Option<f64> {
        match self {
            Unit::Length(per_metre) => Some(*per_metre),
            Unit::None | Unit::Other(_) => None,
        }
    }
}

/// Whether the metre may be written so.
pub fn is_metre(text: &str) -> bool {
    Unit::of(text) == Unit::Length(1.0)
}

/// What a number in the first unit is to be multiplied with to be one in the second.
pub fn ratio(from: &str, to: &str) -> Option<f64> {
    let (from, to) = (normal(from), normal(to));
    if from == to {
        return Some(1.0);
    }
    if let (Some(from), Some(to)) = (length(&from), length(&to)) {
        return Some(to / from);
    }
    // Two prefixes of one unit, such as mV and V.
    PREFIXES.iter().find_map(|(prefix, count)| {
        let base = from.strip_prefix(prefix).filter(|base| !base.is_empty())?;
        let other = PREFIXES.iter().find(|(prefix, _)| to.strip_prefix(prefix) == Some(base))?;
        Some(other.1 / count)
    })
}

/// What a number in the first unit of length is to be multiplied with to be one in the second.
pub fn length_ratio(from: &str, to: &str) -> Option<f64> {
    let [from, to] = [from, to].map(|unit| Unit::of(unit).per_metre());
    Some(to? / from?)
}

/// One spelling of the many that µ has.
fn normal(text: &str) -> String {
    let text = text.trim().trim_matches(['[', ']', '(', ')', '"']).trim();
    // The Greek letter in place of the sign; a file of MS-DOS; Nanoscope.
    let text = text.replace('μ', "µ");
    match text.as_str() {
        "æm" | "~m" => "µm".to_owned(),
        _ => text,
    }
}

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
            assert_eq!(Unit::of(text), Unit::Length(1e6), "{text}");
        }
    }

    #[test]
    fn what_is_no_length_keeps_its_name() {
        assert_eq!(Unit::of("mV"), Unit::Other("mV".to_owned()));
        assert_eq!(Unit::of("A"), Unit::Other("A".to_owned()));
        assert_eq!(Unit::of(" "), Unit::None);
        assert!(is_metre("m") && is_metre(" metre ") && !is_metre("mm") && !is_metre(""));
        assert_eq!(Unit::of("Å"), Unit::Length(1e10));
    }

    #[test]
    fn prefixes_of_one_unit_have_a_ratio() {
        assert_eq!(ratio("mV", "V"), Some(1e-3));
        assert_eq!(ratio("V", "V"), Some(1.0));
        assert_eq!(ratio("nm", "pm"), Some(1e3));
        assert_eq!(ratio("V", "nm"), None);
    }
}
