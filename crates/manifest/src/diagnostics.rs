//! Collection and display of the mistakes in a manifest, and helpers to word messages: suggestions,
//! lists, line breaks.
//!
//! Control characters of the manifest are replaced before display.

use std::any::Any;
use std::collections::HashSet;
use std::error::Error;
use std::fmt;
use std::iter::successors;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report,
    SourceCode,
};
use thiserror::Error;

/// Range of bytes in the text of a manifest.
pub type Span = Range<usize>;

/// Maximum number of problems that are collected for a manifest.
const MAX_COLLECTED: usize = 200;
/// Maximum number of problems that are displayed.
const MAX_SHOWN: usize = 20;
/// Number of bytes above which the lines around a mistake are not displayed: a list of a hundred
/// thousand values may be one line.
const MAX_EXCERPT: usize = 2000;

/// A mistake in a manifest, with its positions and help.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Problem {
    message: String,
    labels: Vec<(Span, String)>,
    help: Option<String>,
}

impl Problem {
    /// Creates a problem at a span. The label is displayed below the span.
    pub fn new(message: impl Into<String>, span: Span, label: impl Into<String>) -> Self {
        Self { message: message.into(), labels: vec![(span, label.into())], help: None }
    }

    /// Creates a problem that has no position in the text.
    pub fn without_position(message: impl Into<String>) -> Self {
        Self { message: message.into(), labels: Vec::new(), help: None }
    }

    /// Creates the problem of things that refer to each other in a cycle. `links` has the name of
    /// each thing with the position at which it refers to the next one; the last one refers to the
    /// first. `verb` says how they refer to each other, such as `reads`.
    pub fn cycle<N: AsRef<str>>(message: &str, verb: &str, links: &[(N, Span)]) -> Problem {
        /// Maximum number of links that are marked in the text.
        const MAX_MARKED: usize = 6;
        let names: Vec<_> =
            links.iter().chain(links.first()).map(|(name, _)| name.as_ref()).collect();
        let labels = links
            .iter()
            .zip(names.windows(2))
            .map(|((_, span), pair)| (span.clone(), format!("`{}` {verb} `{}`", pair[0], pair[1])))
            .take(MAX_MARKED)
            .collect();
        Problem { message: format!("{message}: {}", names.join(" ← ")), labels, help: None }
    }

    /// Adds another span that takes part in the mistake, with its label.
    pub fn and(mut self, span: Span, label: impl Into<String>) -> Self {
        self.labels.push((span, label.into()));
        self
    }

    /// Sets the help, which tells how to correct the mistake. It replaces help that was set before.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Sets the help as [`Problem::help`] does, if there is any.
    pub fn help_if(self, help: Option<impl Into<String>>) -> Self {
        match help {
            Some(help) => self.help(help),
            None => self,
        }
    }

    /// Returns the message without labels and help.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns the help of the problem, if it has any.
    pub fn advice(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Moves all spans by a number of bytes.
    pub fn shifted(mut self, bytes: usize) -> Self {
        self.labels.iter_mut().for_each(|(span, _)| *span = span.start + bytes..span.end + bytes);
        self
    }

    fn start(&self) -> usize {
        self.labels.first().map_or(0, |(span, _)| span.start)
    }

    /// Returns the problem with the text of the manifest, or `None` if the lines around a label are
    /// too long for a display.
    fn shown_in(&self, source: &Arc<NamedSource<String>>) -> Option<Report> {
        let mut labels = Vec::new();
        for (span, label) in &self.labels {
            let span = first_line(span, source.inner()).into();
            let excerpt = source.read_span(&span, 1, 1);
            if excerpt.is_ok_and(|excerpt| excerpt.data().len() > MAX_EXCERPT) {
                return None;
            }
            let label = Some(sanitized(label));
            labels.push(if labels.is_empty() {
                LabeledSpan::new_primary_with_span(label, span)
            } else {
                LabeledSpan::new_with_span(label, span)
            });
        }
        let mut shown = MietteDiagnostic::new(wrapped(&sanitized(&self.message)));
        shown.help = self.help.as_deref().map(|help| wrapped(&sanitized(help)));
        Some(Report::new(shown.with_labels(labels)).with_source_code(source.clone()))
    }
}

/// Formats the problem on one line: message, first label and help.
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

/// The problems of a manifest, collected without duplicates. A mistake in several parameter points
/// counts once.
#[derive(Debug, Default)]
pub struct Problems {
    found: Vec<Problem>,
    known: HashSet<Problem>,
}

impl Problems {
    /// Adds a problem, unless an equal one has been added before.
    pub fn push(&mut self, problem: Problem) {
        if !self.is_full() && self.known.insert(problem.clone()) {
            self.found.push(problem);
        }
    }

    /// Returns whether the maximum number of problems is reached. Further problems are dropped.
    pub fn is_full(&self) -> bool {
        self.found.len() >= MAX_COLLECTED
    }

    /// Returns whether no problem has been added.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns the problems in the order of their positions. `file` is the name of the manifest in
    /// messages, and `text` its content.
    pub fn into_errors(self, file: &str, text: &str) -> ManifestErrors {
        let (name, text) = (file.to_owned(), text.to_owned());
        self.into_errors_in(file, vec![SourceText { name, text, start: 0 }])
    }

    /// Returns the problems of a manifest that is composed of several texts, at least one. The
    /// texts are in the order of their positions.
    pub fn into_errors_in(mut self, file: &str, sources: Vec<SourceText>) -> ManifestErrors {
        self.found.sort_by_key(Problem::start);
        ManifestErrors { file: file.to_owned(), sources, problems: self.found }
    }
}

/// A text in which problems have positions.
#[derive(Debug, Clone)]
pub struct SourceText {
    /// Name of the text in messages.
    pub name: String,
    pub text: String,
    /// Position of the first byte of the text in the spans of problems.
    pub start: usize,
}

impl SourceText {
    /// Returns line and column of a position in a span, counted from 1 in characters.
    pub fn line_and_column(&self, position: usize) -> [usize; 2] {
        let all = self.text.char_indices();
        let before = all.take_while(|(index, _)| index + self.start < position);
        before.fold([1, 1], |[line, column], (_, character)| match character {
            '\n' => [line + 1, 1],
            _ => [line, column + 1],
        })
    }
}

/// All problems of a manifest, ready for display.
#[derive(Debug, Clone, Error)]
#[error("manifest `{file}` has {}", count(problems.len()))]
pub struct ManifestErrors {
    file: String,
    sources: Vec<SourceText>,
    problems: Vec<Problem>,
}

impl ManifestErrors {
    /// Returns the problems in the order of their positions.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// Returns the name of the manifest in messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Renders every problem with file, line, column, the surrounding text and a caret. Without
    /// `colours` the result has no escape sequences and marks spans in ASCII.
    pub fn render(&self, colours: bool) -> String {
        let mut theme = GraphicalTheme::unicode();
        if !colours {
            theme = GraphicalTheme::none();
            // A single column would otherwise be marked with a bar.
            theme.characters.underbar = '^';
        }
        let handler =
            GraphicalReportHandler::new_themed(theme).with_wrap_lines(false).with_links(false);
        let sources = self.sources.iter();
        let named: Vec<_> = sources
            .map(|source| NamedSource::new(sanitized(&source.name), sanitized(&source.text)))
            .map(Arc::new)
            .collect();
        let mut page = String::new();
        for problem in self.problems.iter().take(MAX_SHOWN) {
            let index = self.source_index(problem.start());
            let shown = self.within(problem, index).shown_in(&named[index]);
            if problem.labels.is_empty() {
                page.push_str(&format!("{}:\n", sanitized(&self.file)));
            }
            if shown.is_none_or(|shown| handler.render_report(&mut page, &*shown).is_err()) {
                let place = self.place(problem).unwrap_or_else(|| self.file.clone());
                page.push_str(&sanitized(&format!("{place}: {problem}\n")));
            }
            page.push('\n');
        }
        page + &self.summary()
    }

    /// Returns line and column of a problem, counted from 1 in characters, as
    /// [`ManifestErrors::render`] displays them. Returns `None` for a problem without a position.
    pub fn position(&self, problem: &Problem) -> Option<[usize; 2]> {
        let (span, _) = problem.labels.first()?;
        Some(self.sources[self.source_index(span.start)].line_and_column(span.start))
    }

    /// Returns the file, the line and the column of a problem: `study.toml:12:9`. Returns `None`
    /// for a problem without a position.
    pub fn place(&self, problem: &Problem) -> Option<String> {
        problem.labels.first().map(|(span, _)| self.at(span.start))
    }

    fn at(&self, position: usize) -> String {
        let source = &self.sources[self.source_index(position)];
        let [line, column] = source.line_and_column(position);
        format!("{}:{line}:{column}", source.name)
    }

    /// Returns the index of the text that contains a position.
    fn source_index(&self, position: usize) -> usize {
        self.sources.iter().rposition(|source| source.start <= position).unwrap_or(0)
    }

    /// Returns a problem with spans in one of the texts. Labels in other texts become help.
    fn within(&self, problem: &Problem, index: usize) -> Problem {
        let mut own = Problem { labels: Vec::new(), ..problem.clone() };
        let start = self.sources[index].start;
        for (span, label) in &problem.labels {
            let other = self.source_index(span.start);
            if other == index {
                let span = span.start.saturating_sub(start)..span.end.saturating_sub(start);
                own.labels.push((span, label.clone()));
                continue;
            }
            let place = format!("{}: {label}", self.at(span.start));
            own.help = Some(match own.help {
                Some(help) => format!("{help}; {place}"),
                None => place,
            });
        }
        own
    }

    fn summary(&self) -> String {
        let hidden = self.problems.len().saturating_sub(MAX_SHOWN);
        let tail = match hidden {
            0 => String::new(),
            hidden => format!(", of which {hidden} are not shown"),
        };
        format!(
            "{} in `{}`{tail}; nothing was run\n",
            count(self.problems.len()),
            sanitized(&self.file)
        )
    }
}

fn count(problems: usize) -> String {
    match problems {
        1 => "1 problem".to_owned(),
        several => format!("{several} problems"),
    }
}

/// Returns the part of `span` on the line of `text` on which the span starts, clamped to the length
/// of `text`.
fn first_line(span: &Span, text: &str) -> Span {
    let start = span.start.min(text.len());
    let end = span.end.clamp(start, text.len());
    let lines = text.get(start..end).unwrap_or_default();
    let length = lines.find(['\r', '\n']).unwrap_or(lines.len());
    start..start + length
}

/// Maximum width of a line of a message, in characters.
const WIDTH: usize = 88;

/// Returns the candidate that is most similar to a word, or `None` if the word is not a probable
/// misspelling of any candidate.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    /// Minimum Jaro–Winkler similarity. One typing error in a short word passes; another word does
    /// not.
    const SIMILAR: f64 = 0.8;
    // The comparison takes quadratic time, which matters for longer words.
    const MAX_LENGTH: usize = 64;
    if word.len() > MAX_LENGTH {
        return None;
    }
    let folded = word.to_lowercase().replace('-', "_");
    candidates
        .into_iter()
        .map(|candidate| {
            let plain = candidate.to_lowercase().replace('-', "_");
            (strsim::jaro_winkler(&folded, &plain), candidate)
        })
        .filter(|(likeness, _)| *likeness >= SIMILAR)
        // Of equally similar candidates the first one is returned.
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, candidate)| candidate)
}

/// Returns the label of an unknown name: "did you mean" with the most similar known name between
/// two `quote` characters, or `otherwise` if no name is similar.
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

/// Formats a number with a noun in singular or plural: `3 surfaces`, `1 surface`.
pub fn counted(number: usize, thing: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{plural}")
}

/// Quotes a path as one word of a shell command.
pub fn shell_word(path: &Path) -> String {
    let text = path.to_string_lossy();
    let word = shlex::try_quote(&text).map(|word| word.into_owned());
    word.unwrap_or_else(|_| text.replace('\0', ""))
}

/// Formats words in backticks as a list, with `and` before the last word: `a`, `b` and `c`.
pub fn listed<'a>(words: impl IntoIterator<Item = &'a str>, and: &str) -> String {
    /// Maximum number of words in the list.
    const MAX: usize = 50;
    let mut words: Vec<_> = words.into_iter().map(|word| format!("`{word}`")).collect();
    if words.len() > MAX {
        let rest = words.split_off(MAX).len();
        words.push(format!("{rest} more"));
    }
    match words.as_slice() {
        [] => "nothing".to_owned(),
        [only] => only.clone(),
        [most @ .., last] => format!("{} {and} {last}", most.join(", ")),
    }
}

/// Replaces control characters, so that a manifest cannot send escape sequences to the terminal.
/// The number of bytes does not change, so that spans stay valid.
fn sanitized(text: &str) -> String {
    let replaced = |letter: char| match letter {
        '\n' | '\t' | '\r' => letter,
        letter if letter.is_control() && letter.len_utf8() == 1 => '?',
        // The other control characters have two bytes, and so has the middle dot.
        letter if letter.is_control() => '·',
        letter => letter,
    };
    text.chars().map(replaced).collect()
}

/// Formats an error and its causes on one line.
pub fn chain(error: &(dyn Error + 'static)) -> String {
    let errors = successors(Some(error), |&error| error.source());
    errors.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// Returns the message of a panic from its payload.
pub fn words_of_panic(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}

/// Breaks a text into lines of at most `WIDTH` characters, at spaces outside backticks.
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
        assert_eq!(sanitized(text).len(), text.len());
        let page = errors(text, Problem::new("a\u{1b}b", 0..1, "\u{7}")).render(false);
        assert!(!page.contains(|c: char| c.is_control() && c != '\n'), "{page:?}");
    }

    #[test]
    fn a_hundred_thousand_mistakes_on_a_line_fit_on_a_page() {
        let values: Vec<String> = (0..100_000).map(|value| format!("\"é{value}\"")).collect();
        let text = format!("loads = [{}]\n", values.join(", "));
        let mut problems = Problems::default();
        for (start, _) in text.match_indices("\"é") {
            let span = start..start + 5;
            problems.push(
                Problem::new("wrong", span, "here").and(text.len() - 4..text.len() - 3, "end"),
            );
        }
        let page = problems.into_errors("study.toml", &text).render(false);
        assert!(page.len() < 20_000, "{} bytes", page.len());
        assert!(page.contains("study.toml:1:10: wrong (here)"), "{page}");
        assert!(
            page.contains("200 problems in `study.toml`, of which 180 are not shown"),
            "{page}"
        );
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
    fn a_position_is_counted_in_lines_and_characters_from_one_on() {
        let text = "a = 1\nµ = 'é' # x\n";
        for (start, position) in [(0, [1, 1]), (4, [1, 5]), (6, [2, 1]), (11, [2, 5])] {
            let mut problems = Problems::default();
            problems.push(Problem::new("wrong", start..start + 1, "here"));
            let errors = problems.into_errors("study.toml", text);
            let [problem] = errors.problems() else {
                panic!("one was pushed");
            };
            assert_eq!(errors.position(problem), Some(position));
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
