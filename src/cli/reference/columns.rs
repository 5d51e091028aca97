//! The page of all columns that tables may have.

use crate::session::DescribedColumns;
use asperity_tables::column::Description;

const HEAD: &str = "\
# Columns

<!-- Written by `asperity reference`; the source is the code. -->

All columns that tables may have, by the kind of stage that first has them: a table also has the
columns of the tables that its stage reads, as far as they tell its rows apart. `asperity columns
MANIFEST [STAGE]` says which ones a study has, and every table says it of itself, in the metadata of
its fields.

Unit `1` is a pure number; where there is none, a unit makes no sense. *Length* and *pressure* are in
the units that the manifest has chosen by `side` and by `effective_modulus` or `bodies`.
";

/// The text of the page.
pub fn page() -> String {
    let mut page = HEAD.to_owned();
    let mut known: Vec<Description> = Vec::new();
    for DescribedColumns { kind, columns, .. } in DescribedColumns::of_kinds() {
        let new: Vec<_> = columns.into_iter().filter(|column| !known.contains(column)).collect();
        page += &format!("\n## `{kind}`\n\n| column | unit | meaning |\n|---|---|---|\n");
        for column in &new {
            let Description { name, unit, meaning, .. } = column;
            page += &format!("| `{name}` | {} | {} |\n", cell(unit), cell(meaning));
        }
        known.extend(new);
    }
    page
}

/// A text within a table of Markdown.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('<', "&lt;")
}
