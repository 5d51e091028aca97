//! Elements of XML documents by their names. Namespaces are ignored.

use roxmltree::{Document, Node, ParsingOptions};

use super::FormatError;
use super::input::parsed;

/// Parses a document of at most `nodes` nodes. A byte order mark may precede it. `part` names the
/// document in errors.
pub(crate) fn document<'t>(
    part: &str,
    text: &'t str,
    nodes: u32,
) -> Result<Document<'t>, FormatError> {
    let options = ParsingOptions { nodes_limit: nodes, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text.trim_start_matches('\u{feff}'), options);
    document.map_err(|error| FormatError::damaged(part, error))
}

/// Returns the element at a path of names.
pub(crate) fn child<'a, 'input>(root: Node<'a, 'input>, path: &[&str]) -> Option<Node<'a, 'input>> {
    path.iter()
        .try_fold(root, |node, name| node.children().find(|child| child.tag_name().name() == *name))
}

/// Returns the first element of a document with a name.
pub(crate) fn first<'a, 'input>(
    document: &'a Document<'input>,
    name: &str,
) -> Option<Node<'a, 'input>> {
    document.descendants().find(|element| element.tag_name().name() == name)
}

/// Returns the text of an element if it is not empty.
pub(crate) fn text<'a>(element: Option<Node<'a, '_>>) -> Option<&'a str> {
    element?.text().map(str::trim).filter(|text| !text.is_empty())
}

/// Returns the text of the element at a path of names.
pub(crate) fn text_at<'a>(root: Node<'a, '_>, path: &[&str]) -> Result<&'a str, FormatError> {
    text(child(root, path)).ok_or_else(|| FormatError::missing(path.join("/")))
}

/// Returns the number of an element, if it has one.
pub(crate) fn number(
    name: &str,
    element: Option<Node<'_, '_>>,
) -> Result<Option<f64>, FormatError> {
    text(element).map(|text| parsed(name, text, "a number")).transpose()
}
