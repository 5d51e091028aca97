//! One surface under one load after another, for a slider through the loads on the page.

use base64::prelude::{BASE64_STANDARD, Engine};
use serde::Serialize;

use super::units::LengthUnit;
use crate::charts::raster::Raster;

/// The most maps of one slider: each takes some kilobytes of the page.
const MOST: usize = 16;

/// A surface under its loads.
#[derive(Debug, Serialize)]
pub struct LoadSlider {
    /// What tells the surface from others on the page; empty where nothing does.
    pub label: String,
    /// Sides of what the maps show, along x and y, over the longer one.
    pub size: [f64; 2],
    /// A length of the maps, where its unit is known.
    pub scale: Option<SliderScale>,
    /// Maps under ascending loads, spread over all that there are.
    pub steps: Vec<Step>,
    /// How many loads there are.
    pub loads: usize,
}

/// A scale bar below maps.
#[derive(Debug, Serialize)]
pub struct SliderScale {
    /// Its share of their width, in per cent.
    pub percent: f64,
    /// Its length.
    pub label: String,
}

/// A map of contact, and what is told beside it.
#[derive(Debug, Serialize)]
pub struct Step {
    /// Reduced.
    pub load: String,
    /// In per cent.
    pub area: String,
    /// With its unit, where there is one.
    pub mean_gap: String,
    /// A PNG file in base 64.
    pub picture: String,
}

impl Step {
    /// Of contact on a share of the area, the mean gap in the unit of the surface.
    pub fn of(load: f64, area: f64, mean_gap: f64, unit: Option<&str>, picture: &Raster) -> Step {
        Step {
            load: short(load),
            area: format!("{} %", short(100.0 * area)),
            mean_gap: told(mean_gap, unit),
            picture: BASE64_STANDARD.encode(picture.to_png()),
        }
    }
}

/// As many of `count` loads as a slider has, spread over all, with the first and the last.
pub fn spread(count: usize) -> impl Iterator<Item = usize> {
    let steps = count.min(MOST);
    (0..steps).map(move |step| match steps {
        1 => 0,
        _ => step * (count - 1) / (steps - 1),
    })
}

/// A length with its unit: with a prefix where it is metres.
fn told(length: f64, unit: Option<&str>) -> String {
    let shared = LengthUnit::common([unit]);
    let length = shared.factor(unit) * length;
    match shared {
        LengthUnit::Unknown => short(length),
        LengthUnit::Metre | LengthUnit::Named(_) => {
            let scaled = shared.scaled(length);
            format!("{} {}", short(scaled.factor * length), scaled.unit)
        }
    }
}

/// Three significant digits.
fn short(value: f64) -> String {
    let exponential = format!("{value:.2e}");
    let rounded = exponential.parse().unwrap_or(value);
    match rounded == 0.0 || (1e-4..1e5).contains(&rounded.abs()) {
        true => format!("{rounded}"),
        false => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_load_are_shown_and_each_at_most_once() {
        for count in [1, 2, 15, 16, 17, 90] {
            let steps: Vec<usize> = spread(count).collect();
            assert_eq!(steps.len(), count.min(MOST));
            assert_eq!([steps[0], *steps.last().unwrap()], [0, count - 1]);
            assert!(steps.is_sorted_by(|one, next| one < next), "{steps:?}");
        }
        assert_eq!(spread(0).count(), 0);
    }

    #[test]
    fn lengths_are_told_in_their_unit_with_the_prefix_that_suits_them() {
        assert_eq!(told(1.234e-8, Some("m")), "12.3 nm");
        assert_eq!(told(0.25, Some("µm")), "250 nm");
        assert_eq!(told(0.25, Some("px")), "0.25 px");
        assert_eq!(told(0.25, None), "0.25");
    }

    #[test]
    fn numbers_have_three_digits_and_no_long_tails() {
        let shown = [0.0, 0.06, 1.0 / 3.0, 12.345, 2e9, 1.234567e-7].map(short);
        assert_eq!(shown, ["0", "0.06", "0.333", "12.3", "2e9", "1.23e-7"]);
    }
}
