//! A day of the calendar.

use std::fmt;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

use chrono::{DateTime, NaiveDate};

/// A day of the calendar, written as ISO 8601 has it: `2026-11-22`.
///
/// ```
/// use std::time::UNIX_EPOCH;
///
/// use asperity::session::Day;
///
/// assert_eq!(Day::of(UNIX_EPOCH).to_string(), "1970-01-01");
/// assert_eq!("2024-02-29".parse::<Day>()?.to_string(), "2024-02-29");
/// assert!("2025-02-29".parse::<Day>().is_err());
/// # Ok::<(), asperity::session::NoDay>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Day(NaiveDate);

/// A text is no day.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no day: year, month and day, as in 2026-11-22")]
pub struct NoDay(String);

impl Day {
    /// The day on which a moment lies, in universal time.
    pub fn of(moment: SystemTime) -> Day {
        let seconds = moment.duration_since(UNIX_EPOCH);
        let seconds = seconds.map_or(0, |since| since.as_secs().try_into().unwrap_or(0));
        Day(DateTime::from_timestamp(seconds, 0).unwrap_or_default().date_naive())
    }
}

impl FromStr for Day {
    type Err = NoDay;

    fn from_str(text: &str) -> Result<Day, NoDay> {
        let day = NaiveDate::parse_from_str(text, "%Y-%m-%d");
        day.map(Day).map_err(|_| NoDay(text.to_owned()))
    }
}

impl fmt::Display for Day {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0.format("%Y-%m-%d"))
    }
}
