//! A setting of the command line, which overrides a key of the manifest:
//! `--set stage.surfaces.realizations=20`.

use std::fmt;
use std::str::FromStr;

use toml::de::{DeTable, DeValue};

/// A value for a key of the manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The setting in TOML: `stage.surfaces.realizations=20`.
    line: String,
}

/// A setting that is not of the form `KEY=VALUE`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// There is no `=`, or nothing on one side of it.
    #[error("must be `KEY=VALUE`, such as `stage.surfaces.realizations=20`")]
    Incomplete,
    /// The part before `=` is not a key.
    #[error("`{0}` is not a key, such as `stage.surfaces.realizations`")]
    Key(String),
    /// The text has a line end or another control character.
    #[error("must be on one line, without control characters")]
    ControlCharacter,
}

impl Setting {
    /// Returns the setting as a line of TOML.
    pub fn line(&self) -> &str {
        &self.line
    }

    /// Returns the option of the command line with a space before it, quoted for a shell.
    pub fn option(&self) -> String {
        let line = shlex::try_quote(&self.line).expect("settings have no control characters");
        format!(" --set {line}")
    }
}

/// Reads `KEY=VALUE`. The value is in TOML, or is a word without quotes.
impl FromStr for Setting {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Setting, SettingError> {
        let (key, value) = text.split_once('=').ok_or(SettingError::Incomplete)?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() {
            return Err(SettingError::Incomplete);
        }
        if text.contains(char::is_control) {
            return Err(SettingError::ControlCharacter);
        }
        // A comment would hide the end of the value.
        let is_key = DeTable::parse(&format!("{key}=0")).is_ok() && !key.contains('#');
        if !is_key {
            return Err(SettingError::Key(key.to_owned()));
        }
        let is_toml = DeValue::parse(value).is_ok() && !value.contains('#');
        let value = if is_toml { value.to_owned() } else { toml::Value::from(value).to_string() };
        Ok(Setting { line: format!("{key}={value}") })
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Result<String, SettingError> {
        text.parse::<Setting>().map(|setting| setting.line)
    }

    #[test]
    fn values_are_toml_or_words() {
        for (text, expected) in [
            ("stage.a.realizations=20", "stage.a.realizations=20"),
            ("stage.a.hurst = [0.3, 0.8]", "stage.a.hurst=[0.3, 0.8]"),
            ("stage.a.boundary=free", "stage.a.boundary=\"free\""),
            ("stage.a.nodes=8 * k", "stage.a.nodes=\"8 * k\""),
            ("stage.a.loads={ to = 0.1, steps = 2 }", "stage.a.loads={ to = 0.1, steps = 2 }"),
            ("stage.a.where=x = 1 # \"y\"", "stage.a.where='x = 1 # \"y\"'"),
        ] {
            assert_eq!(line(text).as_deref(), Ok(expected), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused() {
        assert_eq!(line("stage.a.nodes"), Err(SettingError::Incomplete));
        assert_eq!(line("=20"), Err(SettingError::Incomplete));
        assert_eq!(line("a b=20"), Err(SettingError::Key("a b".to_owned())));
        assert_eq!(line("a=1\nb=2"), Err(SettingError::ControlCharacter));
    }
}
