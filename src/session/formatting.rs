//! Formatting of numbers, durations and lists for users.

use std::time::{Duration, SystemTime};

use crate::share::utc;
use asperity_manifest::decimal::written;
pub(crate) use asperity_manifest::diagnostics::{chain, counted, listed, shell_word, wrapped};
pub(crate) use asperity_tables::cells::{cells, whole_cells};

/// Formats a number with six significant digits, without trailing zeros.
pub(crate) fn short(number: f64) -> String {
    significant(number, 6)
}

/// Formats a number with at most this number of significant digits, without trailing zeros.
pub(crate) fn significant(number: f64, digits: usize) -> String {
    let rounded = format!("{number:.*e}", digits - 1).parse();
    written(rounded.unwrap_or(number))
}

/// Formats a duration in its two largest units.
pub(crate) fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (hours, minutes, _) => format!("{hours} h {minutes} min"),
    }
}

/// Formats a moment as date and time in UTC, to the minute.
pub(crate) fn minute(moment: SystemTime) -> String {
    utc(moment).format("%Y-%m-%d %H:%M UTC").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_printed_in_their_two_largest_units() {
        let text = |seconds| duration(Duration::from_secs(seconds));
        assert_eq!(text(59), "59 s");
        assert_eq!(text(61), "1 min 1 s");
        assert_eq!(text(3 * 3600 + 62), "3 h 1 min");
    }

    #[test]
    fn numbers_are_shown_with_six_digits_and_no_tail() {
        let shown = [0.0, 0.5, 1234.0, 0.123456789, 1.5e-7, 2.5e9].map(short);
        assert_eq!(shown, ["0", "0.5", "1234", "0.123457", "1.5e-7", "2.5e9"]);
    }
}
