//! A manifest to start from, with a comment to each of its keys.

/// The file of the schema that the first line of the manifest names, beside it.
pub const SCHEMA: &str = "asperity.schema.json";

/// What stands in the template for the study's name.
const NAME: &str = "STUDY";

/// The text of a manifest whose study has this name, which is a plain one.
pub fn template(name: &str) -> String {
    include_str!("template.toml").replace(NAME, name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;
    use crate::study::Study;
    use std::path::Path;

    #[test]
    fn the_template_makes_sense_as_it_is() {
        let text = template("first");
        let study =
            Study::parse(&text, "first.toml", Path::new("."), crate::study::no_claims).unwrap();
        assert_eq!(study.name, "first");
        assert!(study.warnings().is_empty());
        assert_eq!(Plan::of(&study).stages.len(), 5);
        assert!(!text.contains(NAME), "{text}");
    }

    #[test]
    fn editors_find_the_schema_on_the_first_line() {
        let first = template("first").lines().next().map(str::to_owned);
        assert_eq!(first, Some(format!("#:schema ./{SCHEMA}")));
    }
}
