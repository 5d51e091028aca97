//! Directions that the names of axes, columns and coordinates tell.

/// Direction of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    X,
    Y,
    Z,
}

/// Letters and words of the directions.
const WORDS: [(Direction, &str, &[&str]); 3] = [
    (Direction::X, "x", &["x", "lon", "longitude", "easting"]),
    (Direction::Y, "y", &["y", "lat", "latitude", "northing"]),
    (Direction::Z, "z", &["z"]),
];
/// Parts of names before or after the letter of an axis, as in `xaxis`, `x_pos`, `nx` and `dim_y`.
const PARTS: [&str; 14] = [
    "",
    "axis",
    "c",
    "coord",
    "coordinate",
    "coordinates",
    "dim",
    "dimension",
    "n",
    "pixel",
    "pixels",
    "pos",
    "position",
    "positions",
];

impl Direction {
    /// Returns the direction that a name such as `x`, `X [µm]`, `x_pos`, `nx` or `longitude` tells.
    ///
    /// A name that contains words of several directions tells none.
    pub(crate) fn of_name(name: &str) -> Option<Direction> {
        let name = name.trim().to_lowercase();
        let is_part = |rest: &str| PARTS.contains(&rest.trim_matches(['-', '_', ' ']));
        let tells = |(_, letter, words): &&(Direction, &str, &[&str])| {
            let mut parts = name.split(|letter: char| !letter.is_alphanumeric());
            name.strip_prefix(letter).is_some_and(is_part)
                || name.strip_suffix(letter).is_some_and(is_part)
                || parts.any(|part| words.contains(&part))
        };
        let mut told = WORDS.iter().filter(tells);
        match (told.next(), told.next()) {
            (Some((direction, ..)), None) => Some(*direction),
            _ => None,
        }
    }

    /// Returns true for names of angles on the globe, whose coordinates are no lengths.
    pub(crate) fn is_of_globe(name: &str) -> bool {
        let name = name.trim().to_lowercase();
        ["lon", "longitude", "lat", "latitude"].contains(&name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::Direction::{self, X, Y, Z};

    #[test]
    fn names_of_axes_have_many_forms() {
        for name in ["x", "X [m]", "X-Axis", "xpos", "pos x", "nx", "dim_x", "xc", "longitude"] {
            assert_eq!(Direction::of_name(name), Some(X), "{name}");
        }
        for name in ["y_um", "yaxis", "projection_y_coordinate", "Y", "northing"] {
            assert_eq!(Direction::of_name(name), Some(Y), "{name}");
        }
        assert_eq!(Direction::of_name("Z-Axis"), Some(Z));
        for name in ["", "h", "xi", "dim_0", "energy", "max", "x and y"] {
            assert_eq!(Direction::of_name(name), None, "{name}");
        }
    }
}
