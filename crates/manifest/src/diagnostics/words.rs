//! The wording of messages: suggestions, lists, line breaks, and nothing that does harm.

use std::any::Any;
use std::error::Error;

/// Columns of a message before it goes on in the next line.
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
pub fn harmless(text: &str) -> String {
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
