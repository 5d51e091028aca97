//! Labels, ranges and number formats of axes.

use std::ops::Range;
use std::sync::Arc;

use kuva::TickFormat;
use kuva::render::render_utils::{compute_tick_step, generate_ticks_log};

#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub label: String,
    pub spacing: Spacing,
    /// Ends of the axis, or `None` to extend the axis a little beyond the data.
    pub range: Option<[f64; 2]>,
    /// Ends that the manifest declares; they take the place of those of the data or the range.
    pub limits: [Option<f64>; 2],
    /// Ticks that the manifest declares; empty for those of the drawing crate.
    pub ticks: Vec<f64>,
}

/// Mapping of numbers to positions along an axis: linear, logarithmic or by octaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    Linear,
    Logarithmic,
    /// Logarithmic, with ticks at powers of two.
    Octaves,
}

impl Axis {
    pub fn linear(label: impl Into<String>) -> Axis {
        Axis::new(label, Spacing::Linear)
    }

    pub fn logarithmic(label: impl Into<String>) -> Axis {
        Axis::new(label, Spacing::Logarithmic)
    }

    fn new(label: impl Into<String>, spacing: Spacing) -> Axis {
        Axis { label: label.into(), spacing, range: None, limits: [None; 2], ticks: Vec::new() }
    }

    pub fn within(self, from: f64, to: f64) -> Axis {
        Axis { range: Some([from, to]), ..self }
    }

    /// Converts the range of the axis to another unit.
    pub(super) fn convert(&mut self, factor: f64, label: String) {
        self.range = self.range.map(|ends| ends.map(|end| factor * end));
        self.limits = self.limits.map(|end| end.map(|end| factor * end));
        self.ticks.iter_mut().for_each(|tick| *tick *= factor);
        self.label = label;
    }

    /// Returns true if the axis can show a number: any finite number on a linear axis, any finite
    /// positive number on other axes. The range of the axis is not considered.
    pub fn can_show(&self, value: f64) -> bool {
        value.is_finite() && (self.spacing == Spacing::Linear || value > 0.0)
    }

    /// Returns the ends of the axis: its `range` or, without it, the ends of the data with some
    /// room. They are clamped to a range in which the drawing crate finds tick marks.
    pub fn ends(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        /// Largest end of an axis. Sums of larger numbers overflow in the drawing crate.
        const FARTHEST: f64 = 1e60;
        /// Largest ratio of the ends of a logarithmic axis. The drawing crate lists every power of
        /// ten between them.
        const RATIO: f64 = 1e60;
        /// Smallest distance of the ends of a linear axis, relative to the ends. The drawing crate
        /// needs distinct numbers between them.
        const DISTANCE: f64 = 1e-12;
        /// Extent of an axis beyond the data, relative to its end.
        const ROOM: f64 = 0.1;
        let [from, to] = self.unbounded_ends(values);
        let [from, to] = [self.limits[0].unwrap_or(from), self.limits[1].unwrap_or(to)]
            .map(|end| if end.is_nan() { 0.0 } else { end.clamp(-FARTHEST, FARTHEST) });
        // All data are beyond the only declared end.
        let [from, to] = match self.limits {
            [Some(_), None] if from >= to => [from, from + ROOM * from.abs()],
            [None, Some(_)] if from >= to => [to - ROOM * to.abs(), to],
            _ => [from, to],
        };
        match self.spacing {
            Spacing::Linear => {
                let room = DISTANCE * from.abs().max(to.abs()).max(1e-280);
                [from, to.max(from + room)]
            }
            Spacing::Logarithmic | Spacing::Octaves => {
                let highest = to.max(1.0 / FARTHEST);
                [from.max(highest / RATIO).min(highest / 1.01), highest]
            }
        }
    }

    /// Returns the range around the data in which guides are shown: a quarter of the extent of the
    /// data beyond each end. Returns `None` without data.
    pub fn reach(&self, data: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
        const BEYOND: f64 = 0.25;
        let [least, most] = self.extremes(data);
        (least <= most).then(|| match self.spacing {
            Spacing::Linear => {
                let room = BEYOND * if most > least { most - least } else { most.abs() };
                [least - room, most + room]
            }
            Spacing::Logarithmic | Spacing::Octaves => {
                let room = if most > least { (most / least).powf(BEYOND) } else { 2.0 };
                [least / room, most * room]
            }
        })
    }

    /// Returns the smallest and the largest number that the axis can show, or [∞, −∞] for none.
    fn extremes(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        let shown = values.filter(|&value| self.can_show(value));
        shown.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| {
            [least.min(value), most.max(value)]
        })
    }

    fn unbounded_ends(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        if let Some(range) = self.range {
            return range;
        }
        let [least, most] = self.extremes(values);
        if least > most {
            return [0.1, 1.0];
        }
        match self.spacing {
            Spacing::Linear => {
                let room = 0.05 * if most > least { most - least } else { most.abs().max(1.0) };
                // Most quantities are not negative, so an axis that begins near zero begins at
                // zero.
                let from = if least >= 0.0 && least < 0.35 * most { 0.0 } else { least - room };
                [from, most + room]
            }
            Spacing::Logarithmic | Spacing::Octaves => {
                let room = if most > least { (most / least).powf(0.04) } else { 2.0 };
                [least / room, most * room]
            }
        }
    }

    /// Returns the spacing between these ends. A logarithmic axis over less than a factor of 5 is
    /// drawn as linear, because it has too few of the ticks 1, 2, 5, 10 …
    pub fn spacing_between(&self, [from, to]: [f64; 2]) -> Spacing {
        match self.spacing {
            Spacing::Logarithmic if to < 5.0 * from => Spacing::Linear,
            spacing => spacing,
        }
    }
}

impl Spacing {
    /// Returns the power of ten by which the numbers of a logarithmic axis are multiplied, because
    /// the drawing crate treats tiny numbers as zero. Distances on the axis stay the same. Returns
    /// 1 if no number is tiny.
    pub(super) fn lift(self, [from, _]: [f64; 2]) -> f64 {
        /// Smallest end that needs no lift. The drawing crate draws all numbers below a tenth of it
        /// at the same position.
        const LEAST: f64 = 1e-9;
        match self {
            Spacing::Logarithmic if from < LEAST => 10f64.powi(-from.log10().floor() as i32),
            _ => 1.0,
        }
    }

    /// Returns the number that is passed to the drawing crate: log₂ `value` on an axis of octaves,
    /// which the crate does not have, otherwise `value` × `lift`.
    pub(super) fn drawn_number(self, value: f64, lift: f64) -> f64 {
        match self {
            Spacing::Octaves => value.log2(),
            Spacing::Linear | Spacing::Logarithmic => value * lift,
        }
    }

    /// Returns the format of the numbers that [`Spacing::drawn_number`] returns, on an axis with
    /// these ends. `ticks` are those that the manifest declares. All numbers of an axis have the
    /// same notation.
    pub(super) fn ticks(self, lift: f64, [from, to]: [f64; 2], ticks: &[f64]) -> TickFormat {
        /// Largest number of powers of ten that all have a number.
        const MOST_POWERS: f64 = 8.0;
        match self {
            Spacing::Linear => {
                let exponent = common_exponent([from, to]);
                TickFormat::Custom(Arc::new(move |value| match exponent {
                    Some(exponent) => with_exponent(value, exponent),
                    None => plain(value),
                }))
            }
            Spacing::Octaves => TickFormat::Custom(Arc::new(|value| plain(value.exp2()))),
            Spacing::Logarithmic => {
                // Of many powers of ten, only multiples of a step have a number.
                let step = ((to / from).log10() / MOST_POWERS).ceil().max(1.0);
                let is_declared = !ticks.is_empty();
                let is_written = move |value: f64| {
                    is_declared || step <= 1.0 || (value.log10().round() % step).abs() < 0.5
                };
                let drawn = generate_ticks_log(from * lift, to * lift).into_iter();
                let own = drawn.map(|value| value / lift).filter(|tick| is_written(*tick));
                let seen = ticks.iter().copied().filter(|tick| (from..=to).contains(tick));
                let all: Vec<f64> = if is_declared { seen.collect() } else { own.collect() };
                let is_plain = !all.is_empty() && all.iter().all(|tick| PLAIN.contains(tick));
                TickFormat::Custom(Arc::new(move |value| {
                    let value = value / lift;
                    match is_written(value) {
                        true if is_plain => plain(value),
                        true => scientific(value),
                        false => String::new(),
                    }
                }))
            }
        }
    }
}

/// Numbers that a logarithmic axis shows without powers of ten, with some room for rounding.
const PLAIN: Range<f64> = 1e-2 * (1.0 - 1e-6)..1e3 * (1.0 + 1e-6);

/// Returns the power of ten that the numbers of a linear axis share if some of them are very large
/// or very small, and `None` if all can be written as plain numbers.
fn common_exponent([from, to]: [f64; 2]) -> Option<i32> {
    let largest = from.abs().max(to.abs());
    let step = compute_tick_step(from, to, 5);
    // Ticks are multiples of the step, and an axis on both sides of zero has one beside zero.
    let least = if from * to > 0.0 { from.abs().min(to.abs()).max(step) } else { step };
    let is_plain = least > 0.999e-4 && largest < 1e5;
    (!is_plain && largest > 0.0).then(|| largest.log10().floor() as i32)
}

/// Formats a number with a given power of ten: `0.5·10⁻⁴`.
fn with_exponent(value: f64, exponent: i32) -> String {
    let mantissa = plain(value / 10f64.powi(exponent));
    match mantissa.as_str() {
        "0" => mantissa,
        "1" => format!("10{}", superscript(exponent)),
        "−1" => format!("−10{}", superscript(exponent)),
        _ => format!("{mantissa}·10{}", superscript(exponent)),
    }
}

/// Formats a number without rounding errors.
fn plain(value: f64) -> String {
    // Ticks are multiples of round numbers, so ten decimals show them without rounding errors.
    let rounded = format!("{value:.10}");
    let text = rounded.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        _ => text.replace('-', "−"),
    }
}

/// Formats a number as `2.5·10⁷`, or as `10⁷` for a power of ten.
fn scientific(value: f64) -> String {
    // Take the exponent after rounding: 9.99…e6 is 10⁷.
    let written = format!("{value:.9e}");
    let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
    let exponent = superscript(exponent.parse().unwrap_or(0));
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    match mantissa {
        "1" => format!("10{exponent}"),
        "-1" => format!("−10{exponent}"),
        _ => format!("{}·10{exponent}", mantissa.replace('-', "−")),
    }
}

pub fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |letter: char| letter.to_digit(10).map_or('⁻', |d| DIGITS[d as usize]);
    exponent.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_without_rounding_and_with_a_true_minus() {
        let written = [0.1 + 0.2, -0.0, -2.5, 1500.0, 0.004].map(plain);
        assert_eq!(written, ["0.3", "0", "−2.5", "1500", "0.004"]);
    }

    fn written(spacing: Spacing, ends: [f64; 2], values: &[f64]) -> Vec<String> {
        let TickFormat::Custom(write) = spacing.ticks(1.0, ends, &[]) else {
            panic!("numbers are written by ourselves")
        };
        values.iter().map(|value| write(*value)).collect()
    }

    #[test]
    fn all_numbers_of_an_axis_have_the_same_notation() {
        let log = |ends: [f64; 2], values: &[f64]| written(Spacing::Logarithmic, ends, values);
        assert_eq!(log([5e-3, 2.0], &[0.01, 0.1, 1.0]), ["0.01", "0.1", "1"]);
        assert_eq!(log([1e-3, 2.0], &[1e-3, 0.01, 1.0]), ["10⁻³", "10⁻²", "10⁰"]);
        assert_eq!(log([0.5, 2e4], &[1.0, 1e3, 1e4]), ["10⁰", "10³", "10⁴"]);
        assert_eq!(log([2e-12, 8e-12], &[2e-12, 5e-12]), ["2·10⁻¹²", "5·10⁻¹²"]);
        let linear = |ends: [f64; 2], values: &[f64]| written(Spacing::Linear, ends, values);
        let values = [0.0, 5e-5, 1e-4, 1.5e-4];
        assert_eq!(linear([0.0, 1.7e-4], &values), ["0", "0.5·10⁻⁴", "10⁻⁴", "1.5·10⁻⁴"]);
        assert_eq!(linear([0.0, 1.2e5], &[5e4, 1e5]), ["0.5·10⁵", "10⁵"]);
        assert_eq!(linear([-1e-7, 1e-7], &[-1e-7, 0.0]), ["−10⁻⁷", "0"]);
        assert_eq!(linear([0.0, 0.01], &[0.002, 0.01]), ["0.002", "0.01"]);
        assert_eq!(linear([0.5, 0.5001], &[0.50002]), ["0.50002"]);
    }

    #[test]
    fn declared_limits_take_the_place_of_the_ends_of_the_data() {
        let axis = Axis { limits: [None, Some(40.0)], ..Axis::linear("") };
        assert_eq!(axis.ends([1.0, 9.0].into_iter()), [0.0, 40.0]);
        let axis = Axis { limits: [Some(2.0), Some(8.0)], ..Axis::linear("").within(0.0, 9.0) };
        assert_eq!(axis.ends([1.0, 9.0].into_iter()), [2.0, 8.0]);
    }

    #[test]
    fn numbers_far_below_one_are_lifted_by_a_power_of_ten_and_written_as_they_are() {
        let spacing = Spacing::Logarithmic;
        assert_eq!(spacing.lift([1e-3, 1.0]), 1.0);
        let lift = spacing.lift([3e-14, 1.0]);
        assert_eq!(lift, 1e14);
        let TickFormat::Custom(write) = spacing.ticks(lift, [3e-14, 1.0], &[]) else {
            panic!("numbers are written by ourselves")
        };
        assert_eq!(write(100.0), "10⁻¹²");
        assert_eq!(write(10.0), "", "of 14 powers, every second one has a number");
    }

    #[test]
    fn a_narrow_axis_has_its_numbers_in_proportion() {
        let axis = Axis::logarithmic("");
        assert_eq!(axis.spacing_between([5.0, 6.5]), Spacing::Linear);
        assert_eq!(axis.spacing_between([0.5, 6.5]), Spacing::Logarithmic);
    }

    #[test]
    fn ends_are_finite_and_their_ratio_bounded_whatever_the_data() {
        let odd = [0.0, 1e-320, 1.0, 1e300, f64::MAX, f64::INFINITY, f64::NAN, -1e305];
        for spacing in [Spacing::Linear, Spacing::Logarithmic, Spacing::Octaves] {
            let axis = Axis::new("", spacing);
            for (one, other) in odd.iter().flat_map(|one| odd.map(|other| (*one, other))) {
                for ends in [
                    axis.ends([one, other].into_iter()),
                    axis.clone().within(one, other).ends(std::iter::empty()),
                ] {
                    let [from, to] = ends;
                    assert!(from.is_finite() && to.is_finite() && from < to, "{ends:?}");
                    let is_bounded = axis.spacing == Spacing::Linear || to / from < 1e61;
                    assert!(is_bounded, "{ends:?}");
                }
            }
        }
        assert_eq!(Axis::linear("").within(0.2, 0.3).ends(std::iter::empty()), [0.2, 0.3]);
        let beyond = Axis { limits: [Some(10.0), None], ..Axis::linear("") };
        assert_eq!(beyond.ends([1.0, 2.0].into_iter()), [10.0, 11.0]);
    }

    #[test]
    fn guides_are_in_reach_up_to_a_quarter_of_the_extent_of_the_data() {
        let reach = |axis: Axis, data: &[f64]| axis.reach(data.iter().copied());
        assert_eq!(reach(Axis::linear(""), &[1.0, f64::NAN, 3.0]), Some([0.5, 3.5]));
        assert_eq!(reach(Axis::logarithmic(""), &[-1.0, 1.0, 16.0]), Some([0.5, 32.0]));
        assert_eq!(reach(Axis::logarithmic(""), &[0.0]), None);
    }

    #[test]
    fn an_axis_holds_its_data_and_one_of_logarithms_only_what_is_positive() {
        let axis = Axis::linear("");
        assert_eq!(axis.ends([1.0, 9.0].into_iter())[0], 0.0);
        assert!(axis.ends([2.0, 2.0].into_iter())[1] > 2.0);
        let axis = Axis::logarithmic("");
        let [from, to] = axis.ends([-1.0, 0.0, 0.1, 10.0].into_iter());
        assert!(0.05 < from && from < 0.1 && 10.0 < to && to < 20.0);
        assert!(axis.ends(std::iter::empty())[0] > 0.0);
    }
}
