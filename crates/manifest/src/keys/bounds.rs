//! Bounds of numbers in a manifest, and messages about numbers beyond them.

use std::ops::{Bound, RangeBounds};

use serde_json::Value;
use toml::de::DeValue;

use crate::decimal;
use crate::keys::schema::is_type;

/// Maximum of numbers in a manifest. The fourth power of such a number, and products of several of
/// them, are finite.
const LARGEST: f64 = 1e30;

/// Bounds of lengths, slopes, pressures and other positive quantities. Their fourth powers, and
/// products of several of them, are neither zero nor infinite.
pub const QUANTITY: (Bound<f64>, Bound<f64>) = (Bound::Included(1e-30), Bound::Included(LARGEST));

/// Returns the requirement on a number if the number violates it.
///
/// A number without a declared maximum must be at most 1e30. If the number must also be positive,
/// it must be within [`QUANTITY`].
pub(super) fn out_of_bounds(value: &DeValue<'_>, schema: &Value) -> Option<String> {
    let limit = |rule: &str| schema.get(rule).and_then(Value::as_f64);
    let bound = |included, excluded| match (limit(included), limit(excluded)) {
        (_, Some(limit)) => Bound::Excluded(limit),
        (Some(limit), None) => Bound::Included(limit),
        (None, None) => Bound::Unbounded,
    };
    let lower = bound("minimum", "exclusiveMinimum");
    let upper = bound("maximum", "exclusiveMaximum");
    let number = number(value);
    if let (DeValue::Integer(_), None) = (value, whole(value)) {
        return Some(if is_type(schema, "integer") {
            format!("must be at most {}", i64::MAX)
        } else {
            "must have an exponent, as in 1e20".to_owned()
        });
    }
    if is_type(schema, "integer") {
        return (!(lower, upper).contains(&number)).then(|| described_whole(lower, upper));
    }
    let rounded = decimal::nearest(number);
    let bounds = match (lower, upper) {
        (Bound::Excluded(0.0), Bound::Unbounded) => QUANTITY,
        (Bound::Unbounded, Bound::Unbounded) => {
            (Bound::Included(-LARGEST), Bound::Included(LARGEST))
        }
        (lower, Bound::Unbounded) => (lower, Bound::Included(LARGEST)),
        both => both,
    };
    let is_within = rounded.is_finite() && bounds.contains(&rounded);
    (!is_within).then(|| format!("must be {}", described(bounds, number)))
}

/// Returns a number as floating point, or infinity if the value is not a number.
pub fn number(value: &DeValue<'_>) -> f64 {
    match value {
        DeValue::Integer(number) => match i128::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) => number as f64,
            Err(_) => f64::INFINITY,
        },
        DeValue::Float(number) => number.as_str().parse().unwrap_or(f64::INFINITY),
        _ => f64::INFINITY,
    }
}

fn whole(value: &DeValue<'_>) -> Option<i64> {
    let number = value.as_integer()?;
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

fn described_whole(lower: Bound<f64>, upper: Bound<f64>) -> String {
    match (lower, upper) {
        (Bound::Included(lower), Bound::Included(upper)) => {
            format!("must be from {lower} to {upper}")
        }
        (Bound::Included(lower), _) => format!("must be at least {lower}"),
        _ => "out of range".to_owned(),
    }
}

/// Describes bounds for a message about the value: `above 0 and at most 1`. Omits the implied
/// bounds ±1e30 that the value does not violate.
fn described((lower, upper): (Bound<f64>, Bound<f64>), value: f64) -> String {
    if (lower, upper) == QUANTITY && value > 0.0 && value.is_finite() {
        return "from 1e-30 to 1e30; another unit may help".to_owned();
    }
    let lower = match lower {
        Bound::Included(1e-30) => Some("above 0".to_owned()),
        Bound::Included(lower) if lower == -LARGEST => {
            (value < lower && value.is_finite()).then(|| format!("at least {lower:e}"))
        }
        Bound::Included(lower) => Some(format!("at least {lower}")),
        Bound::Excluded(lower) => Some(format!("above {lower}")),
        Bound::Unbounded => None,
    };
    let upper = match upper {
        Bound::Included(LARGEST) if !value.is_finite() => Some("finite".to_owned()),
        Bound::Included(LARGEST) if value <= LARGEST => None,
        Bound::Included(LARGEST) => Some(format!("at most {LARGEST:e}")),
        Bound::Included(upper) => Some(format!("at most {upper}")),
        Bound::Excluded(upper) => Some(format!("below {upper}")),
        Bound::Unbounded => None,
    };
    let parts: Vec<_> = lower.into_iter().chain(upper).collect();
    parts.join(" and ")
}
