//! Where a problem is, and all of it in a line, for programs that have no use for a picture.

use std::fmt;

use super::{ManifestErrors, Problem};

impl ManifestErrors {
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
}

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

#[cfg(test)]
mod tests {
    use super::super::Problems;
    use super::*;

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
}
