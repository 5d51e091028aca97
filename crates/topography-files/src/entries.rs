//! Named values of a text header.

use std::collections::BTreeMap;

use super::error::FormatError;

/// Values by their names, of which the last of each counts.
#[derive(Debug, Clone, Default)]
pub struct Entries {
    values: BTreeMap<String, String>,
}

impl Entries {
    /// Adds a value, in place of one of the same name.
    pub fn insert(&mut self, name: &str, value: &str) {
        let value = value.trim().to_owned();
        self.values.insert(name.trim().to_owned(), value);
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The value of a name, if there is one.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.values.get(name).map(String::as_str)
    }

    /// The value of a name that has to be there.
    pub fn text(&self, name: &str) -> Result<&str, FormatError> {
        self.get(name).ok_or_else(|| FormatError::missing(name))
    }

    /// A whole number.
    pub fn whole(&self, name: &str) -> Result<i64, FormatError> {
        let text = self.text(name)?;
        let number = text.parse();
        number.map_err(|_| FormatError::value(name, text, "a whole number"))
    }

    /// A number, finite or not.
    pub fn number(&self, name: &str) -> Result<f64, FormatError> {
        let text = self.text(name)?;
        let number = text.parse();
        number.map_err(|_| FormatError::value(name, text, "a number"))
    }

    /// A number, if the name is there.
    pub fn optional_number(&self, name: &str) -> Result<Option<f64>, FormatError> {
        self.get(name).map(|_| self.number(name)).transpose()
    }
}

impl<'a> FromIterator<(&'a str, &'a str)> for Entries {
    fn from_iter<T: IntoIterator<Item = (&'a str, &'a str)>>(pairs: T) -> Entries {
        let mut entries = Entries::default();
        for (name, value) in pairs {
            entries.insert(name, value);
        }
        entries
    }
}
