//! What is wrong with a manifest, shown at the place where it is written, and the wording of messages:
//! suggestions, lists, line breaks, and nothing that does harm.

use std::any::Any;
use std::collections::HashSet;
use std::error::Error;
use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource};
use thiserror::Error;

/// Where something is written: bytes of the manifest's text.
pub type Span = Range<usize>;

/// As many problems are collected and shown; a manifest with more is broken in some general way.
const MOST_COLLECTED: usize = 200;
const MOST_SHOWN: usize = 40;

/// One mistake: what it is, where it is, and what would do instead.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Problem {
    message: String,
    labels: Vec<(Span, String)>,
    help: Option<String>,
}

impl Problem {
    /// A problem at one place, with a short label for the caret.
    pub fn new(message: impl Into<String>, span: Span, label: impl Into<String>) -> Self {
        Self { message: message.into(), labels: vec![(span, label.into())], help: None }
    }

    /// A problem of the manifest as a whole.
    pub fn without_place(message: impl Into<String>) -> Self {
        Self { message: message.into(), labels: Vec::new(), help: None }
    }

    /// Points at a second place that takes part in the mistake.
    pub fn and(mut self, span: Span, label: impl Into<String>) -> Self {
        self.labels.push((span, label.into()));
        self
    }

    /// Says what would do.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// What is wrong, in a sentence.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What would do, if it is said.
    pub fn advice(&self) -> Option<&str> {
        self.help.as_deref()
    }

    fn start(&self) -> usize {
        self.labels.first().map_or(0, |(span, _)| span.start)
    }
}

/// A problem in one line, for programs that have no use for a picture.
impl fmt::Display for Problem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)?;
        if let Some((_, label)) = self.labels.first() {
            write!(formatter, " ({label})")?;
        }
        match &self.help {
            Some(help) => write!(formatter, "; {help}"),
            None => Ok(()),
        }
    }
}

/// Problems collected so far, each once: a mistake met at every point of a grid is one mistake.
#[derive(Debug, Default)]
pub struct Problems {
    found: Vec<Problem>,
    known: HashSet<Problem>,
}

impl Problems {
    /// Adds a problem, unless the same one is there already.
    pub fn push(&mut self, problem: Problem) {
        if !self.are_enough() && self.known.insert(problem.clone()) {
            self.found.push(problem);
        }
    }

    /// Whether more would not be kept: time to stop looking.
    pub fn are_enough(&self) -> bool {
        self.found.len() >= MOST_COLLECTED
    }

    /// Whether nothing is wrong.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// The collected problems of a manifest, in the order of its lines.
    pub fn into_errors(mut self, file: &str, text: &str) -> ManifestErrors {
        self.found.sort_by_key(Problem::start);
        ManifestErrors { file: file.to_owned(), text: text.to_owned(), problems: self.found }
    }
}

/// Everything that is wrong with a manifest.
#[derive(Debug, Clone, Error)]
#[error("manifest `{file}` has {}", count(problems.len()))]
pub struct ManifestErrors {
    file: String,
    text: String,
    problems: Vec<Problem>,
}

impl ManifestErrors {
    /// The problems, in the order of the lines that they point at.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// What messages call the manifest.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Every problem with file, line, column, the text around it and a caret; drawn in ASCII and
    /// without escapes unless `colours` are asked for.
    pub fn render(&self, colours: bool) -> String {
        let mut theme = GraphicalTheme::unicode();
        if !colours {
            theme = GraphicalTheme::none();
            // A single column would otherwise be marked by a bar.
            theme.characters.underbar = '^';
        }
        let handler =
            GraphicalReportHandler::new_themed(theme).with_wrap_lines(false).with_links(false);
        let text = harmless(&self.text);
        let source = NamedSource::new(harmless(&self.file), text);
        let mut page = String::new();
        for problem in self.problems.iter().take(MOST_SHOWN) {
            let shown = Shown::new(problem, &source);
            if problem.labels.is_empty() {
                page.push_str(&format!("{}:\n", source.name()));
            }
            if handler.render_report(&mut page, &shown).is_err() {
                page.push_str(&harmless(&format!("{}: {}\n", self.file, problem.message)));
            }
            page.push('\n');
        }
        page + &self.summary()
    }

    /// Line and column of the place that a problem of these points at, from 1 on and in characters, as
    /// [`ManifestErrors::render`] has them; `None` if it has no place.
    pub fn place(&self, problem: &Problem) -> Option<[usize; 2]> {
        let (span, _) = problem.labels.first()?;
        let before: Vec<char> = {
            let characters = self.text.char_indices();
            let before = characters.take_while(|(place, _)| *place < span.start);
            before.map(|(_, character)| character).collect()
        };
        let line_start = before.iter().rposition(|character| *character == '\n');
        let lines = before.iter().filter(|character| **character == '\n').count();
        let column = before.len() - line_start.map_or(0, |place| place + 1);
        Some([lines + 1, column + 1])
    }

    fn summary(&self) -> String {
        let hidden = self.problems.len().saturating_sub(MOST_SHOWN);
        let tail = match hidden {
            0 => String::new(),
            hidden => format!(", of which {hidden} are not shown"),
        };
        format!(
            "{} in `{}`{tail}; nothing was run\n",
            count(self.problems.len()),
            harmless(&self.file)
        )
    }
}

fn count(problems: usize) -> String {
    match problems {
        1 => "1 problem".to_owned(),
        several => format!("{several} problems"),
    }
}

/// A problem beside the text that it is about, as `miette` wants it.
#[derive(Debug)]
struct Shown<'a> {
    message: String,
    labels: Vec<LabeledSpan>,
    help: Option<String>,
    source: &'a NamedSource<String>,
}

impl<'a> Shown<'a> {
    fn new(problem: &Problem, source: &'a NamedSource<String>) -> Self {
        let text = source.inner();
        let label = |(span, label): &(Span, String)| {
            let span = first_line(span, text);
            LabeledSpan::new_with_span(Some(harmless(label)), span)
        };
        let mut labels: Vec<_> = problem.labels.iter().map(label).collect();
        if let Some(first) = labels.first_mut() {
            let (text, span) = (first.label().map(str::to_owned), *first.inner());
            *first = LabeledSpan::new_primary_with_span(text, span);
        }
        Self {
            message: wrapped(&harmless(&problem.message)),
            labels,
            help: problem.help.as_deref().map(|help| wrapped(&harmless(help))),
            source,
        }
    }
}

/// The part of a span on its first line: a caret under a whole table says less than one line.
fn first_line(span: &Span, text: &str) -> Span {
    let start = span.start.min(text.len());
    let end = span.end.clamp(start, text.len());
    let lines = text.get(start..end).unwrap_or_default();
    start..start + lines.find(['\r', '\n']).unwrap_or(lines.len())
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Shown<'_> {}

impl Diagnostic for Shown<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let help = self.help.as_ref()?;
        Some(Box::new(help))
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.labels.iter().cloned()))
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(self.source)
    }
}

/// Width of messages: columns of a message before it goes on in the next line.
const WIDTH: usize = 88;

/// The candidate that a reader would take for the same word, if any comes close.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    /// Jaro–Winkler similarity: one typo in a short word passes, another word does not.
    const ALIKE: f64 = 0.8;
    // Longer words are no slips of the finger, and comparing them takes quadratic time.
    const LONGEST: usize = 64;
    if word.len() > LONGEST {
        return None;
    }
    let folded = word.to_lowercase().replace('-', "_");
    candidates
        .into_iter()
        .map(|candidate| {
            let plain = candidate.to_lowercase().replace('-', "_");
            (strsim::jaro_winkler(&folded, &plain), candidate)
        })
        .filter(|(likeness, _)| *likeness >= ALIKE)
        // The first of equals, so that the advice depends on nothing but the words' order.
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, candidate)| candidate)
}

/// The label of a name that is not known: the known one that is meant, in these quotes, or other
/// words where none comes close.
pub fn suggestion<'a>(
    quote: char,
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: &str,
) -> String {
    let meant = did_you_mean(name, known);
    meant.map_or_else(
        || otherwise.to_owned(),
        |meant| format!("did you mean {quote}{meant}{quote}?"),
    )
}

/// `3 surfaces`, `1 surface`.
pub fn counted(number: usize, thing: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{plural}")
}

/// `a`, `b` and `c`, each in backticks.
pub fn listed<'a>(words: impl IntoIterator<Item = &'a str>, and: &str) -> String {
    /// A longer list is not read.
    const MOST: usize = 50;
    let mut words: Vec<_> = words.into_iter().map(|word| format!("`{word}`")).collect();
    if words.len() > MOST {
        let rest = words.split_off(MOST).len();
        words.push(format!("{rest} more"));
    }
    match words.as_slice() {
        [] => "nothing".to_owned(),
        [only] => only.clone(),
        [most @ .., last] => format!("{} {and} {last}", most.join(", ")),
    }
}

/// The text with control characters blotted out, byte for byte, so that spans stay true and a
/// file from elsewhere cannot steer the reader's terminal.
fn harmless(text: &str) -> String {
    let blot = |letter: char| match letter {
        '\n' | '\t' | '\r' => letter,
        letter if letter.is_control() && letter.len_utf8() == 1 => '?',
        // The other control characters have two bytes, and so has the middle dot.
        letter if letter.is_control() => '·',
        letter => letter,
    };
    text.chars().map(blot).collect()
}

/// An error and its causes on one line.
pub fn chain(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}

/// What a panic says of itself.
pub fn words_of_panic(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}

/// The text in lines, broken at spaces, but not within backticks: what stands there is quoted.
pub fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let (mut width, mut is_quoting) = (0, false);
    for word in text.split(' ') {
        let length = word.chars().count();
        if width > 0 && !is_quoting && width + 1 + length > WIDTH {
            lines.push('\n');
            width = 0;
        } else if width > 0 {
            lines.push(' ');
            width += 1;
        }
        lines.push_str(word);
        width += length;
        is_quoting ^= word.matches('`').count() % 2 == 1;
    }
    lines
}

#[cfg(test)]
mod tests {

    use super::*;

    fn errors(text: &str, problem: Problem) -> ManifestErrors {
        let mut problems = Problems::default();
        problems.push(problem);
        problems.into_errors("study.toml", text)
    }

    #[test]
    fn plain_rendering_names_file_line_and_column_and_keeps_the_caret() {
        let text = "one = 1\ntwo = 3\n";
        let page = errors(text, Problem::new("wrong", 14..15, "here")).render(false);
        assert!(page.contains("study.toml:2:7"), "{page}");
        assert!(page.contains('^'), "{page}");
        assert!(page.is_ascii(), "{page}");
    }

    #[test]
    fn colours_are_escapes_and_only_there_when_asked_for() {
        let errors = errors("one = 1\n", Problem::new("wrong", 0..3, "here"));
        assert!(errors.render(true).contains("\u{1b}["));
        assert!(!errors.render(false).contains('\u{1b}'));
    }

    #[test]
    fn a_manifest_cannot_send_escapes_to_the_terminal() {
        let text = "a = '\u{1b}[2J\u{9b}' # \u{7f}";
        assert_eq!(harmless(text).len(), text.len());
        let page = errors(text, Problem::new("a\u{1b}b", 0..1, "\u{7}")).render(false);
        assert!(!page.contains(|c: char| c.is_control() && c != '\n'), "{page:?}");
    }

    #[test]
    fn spans_outside_the_text_are_shown_all_the_same() {
        for (text, span) in [("", 0..0), ("", 3..9), ("a", 1..1), ("é", 1..2), ("a\n", 2..2)] {
            let page = errors(text, Problem::new("wrong", span, "here")).render(false);
            assert!(page.contains("wrong"), "{page}");
        }
    }

    #[test]
    fn the_same_problem_is_reported_once() {
        let mut problems = Problems::default();
        problems.push(Problem::new("wrong", 0..1, "here"));
        problems.push(Problem::new("wrong", 0..1, "here"));
        problems.push(Problem::new("wrong", 1..2, "here"));
        assert_eq!(problems.into_errors("", "").problems().len(), 2);
    }

    #[test]
    fn a_place_is_counted_in_lines_and_characters_from_one_on() {
        let text = "a = 1\nµ = 'é' # x\n";
        for (start, place) in [(0, [1, 1]), (4, [1, 5]), (6, [2, 1]), (11, [2, 5])] {
            let mut problems = Problems::default();
            problems.push(Problem::new("wrong", start..start + 1, "here"));
            let errors = problems.into_errors("study.toml", text);
            let [problem] = errors.problems() else {
                panic!("one was pushed");
            };
            assert_eq!(errors.place(problem), Some(place));
        }
    }

    #[test]
    fn a_problem_in_a_line_has_its_label_and_its_advice() {
        let problem = Problem::new("`a` is 1", 0..1, "must be 2").help("write 2");
        assert_eq!(problem.to_string(), "`a` is 1 (must be 2); write 2");
    }

    #[test]
    fn slips_of_the_finger_are_recognised_and_other_words_are_not() {
        let keys = ["hurst", "k_lower", "k_upper", "realizations"];
        assert_eq!(did_you_mean("hrust", keys), Some("hurst"));
        assert_eq!(did_you_mean("k_uper", keys), Some("k_upper"));
        assert_eq!(did_you_mean("K-Lower", keys), Some("k_lower"));
        assert_eq!(did_you_mean("realisations", keys), Some("realizations"));
        assert_eq!(did_you_mean("colour", keys), None);
        assert_eq!(did_you_mean(&"k_lower".repeat(100), keys), None);
    }

    #[test]
    fn lines_break_at_spaces_and_never_within_backticks() {
        let text = format!("{} `a b c` d", "x".repeat(WIDTH - 4));
        assert_eq!(wrapped(&text), format!("{} `a b c`\nd", "x".repeat(WIDTH - 4)));
        assert_eq!(wrapped("short"), "short");
    }

    #[test]
    fn lists_read_like_sentences() {
        assert_eq!(listed(["a"], "and"), "`a`");
        assert_eq!(listed(["a", "b", "c"], "or"), "`a`, `b` or `c`");
        assert!(listed(["a"; 60], "and").ends_with("`a` and 10 more"));
    }
}
