//! Versions of computed numbers, with the reasons for which they were raised.

use std::fmt;

use serde::Serialize;

/// Version of the numbers of a kind of stage, or of a part of its numbers.
///
/// Keys of tables contain the version of their numbers, so that they are computed again when it is
/// raised. To raise it, add the reason: what changed, in which numbers. `plan`, `explain` and
/// `diff` show the reasons to users.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version {
    /// Number of the version before the first reason.
    first: u32,
    /// Reason of each later version.
    reasons: &'static [&'static str],
}

impl Version {
    /// Creates a version that was raised once from `first` for each reason.
    pub const fn new(first: u32, reasons: &'static [&'static str]) -> Version {
        Version { first, reasons }
    }

    /// Returns the present number of the version.
    pub const fn number(self) -> u32 {
        self.first + self.reasons.len() as u32
    }

    /// Returns the change from the number `old` to the number `new`, or `None` if they are equal.
    /// `of` names the numbers that have the version.
    pub fn change(self, of: impl Into<String>, old: u32, new: u32) -> Option<VersionChange> {
        let raises = (self.first + 1..).zip(self.reasons);
        let between = raises.filter(|(number, _)| (old + 1..=new).contains(number));
        let reasons = between.map(|(_, &reason)| reason).collect();
        (old != new).then(|| VersionChange { of: of.into(), old, new, reasons })
    }
}

/// Version of a part of the numbers of a stage, which only the recipes with this part contain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartVersion {
    /// Name of the parameter that is the version, or that contains it.
    pub parameter: &'static str,
    /// Name of the part in messages.
    pub of: String,
    pub version: Version,
}

impl PartVersion {
    pub fn new(parameter: &'static str, of: impl Into<String>, version: Version) -> PartVersion {
        PartVersion { parameter, of: of.into(), version }
    }
}

/// Difference of the versions of the same numbers in two programs.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct VersionChange {
    /// Numbers that have the version: a kind of stage, or a part of its numbers.
    pub of: String,
    pub old: u32,
    pub new: u32,
    /// Reasons of the versions after `old`, from the oldest. Versions before the first release have
    /// none.
    pub reasons: Vec<&'static str>,
}

impl fmt::Display for VersionChange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let VersionChange { of, old, new, reasons } = self;
        match reasons.as_slice() {
            [] => write!(formatter, "{of} version {old} → {new}"),
            reasons => write!(formatter, "{of} version {new}: {}", reasons.join("; ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAISED: Version = Version::new(2, &["rounded", "corrected"]);

    #[test]
    fn a_version_is_raised_by_a_reason() {
        assert_eq!(Version::new(2, &[]).number(), 2);
        assert_eq!(RAISED.number(), 4);
    }

    #[test]
    fn a_change_has_the_reasons_of_all_versions_between() {
        let text = |old, new| RAISED.change("numbers", old, new).map(|change| change.to_string());
        assert_eq!(text(4, 4), None);
        assert_eq!(text(3, 4).unwrap(), "numbers version 4: corrected");
        assert_eq!(text(2, 4).unwrap(), "numbers version 4: rounded; corrected");
        assert_eq!(text(2, 3).unwrap(), "numbers version 3: rounded");
        assert_eq!(text(1, 2).unwrap(), "numbers version 1 → 2");
        assert_eq!(text(4, 3).unwrap(), "numbers version 4 → 3");
    }
}
