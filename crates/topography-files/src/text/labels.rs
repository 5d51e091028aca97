//! Labels of the lines and columns of a matrix, which are not heights.

/// Smallest number of labels that are told from heights by their numbers alone.
const MIN_LABELS: usize = 4;
/// Largest deviation of a label from an even spacing, in steps.
const TOLERANCE: f64 = 1e-2;

/// First line and first column of a matrix that are labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labels {
    /// Spacing of the labels along x, if the first line is labels.
    pub line: Option<Spacing>,
    /// Spacing of the labels along y, if the first column is labels.
    pub column: Option<Spacing>,
}

/// Even spacing of labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spacing {
    /// The labels are the numbers of the lines, counted from 0 or 1.
    Counted,
    /// The labels are coordinates with this step.
    Step(f64),
}

impl Labels {
    pub const NONE: Labels = Labels { line: None, column: None };

    /// Finds the labels of a matrix of `columns` numbers a line.
    ///
    /// `has_corner` is true if the first cell of the first line is empty or a word. `has_titles` is
    /// true if the line above has a title for each column, the first of which is empty or says that
    /// the column counts the lines.
    pub fn find(numbers: &[f64], columns: usize, has_corner: bool, has_titles: bool) -> Labels {
        let lines = numbers.len() / columns;
        if lines < 2 || columns < 2 {
            return Labels::NONE;
        }
        let row = |line: usize, from: usize| &numbers[line * columns + from..(line + 1) * columns];
        let column = |index: usize, from: usize| -> Vec<f64> {
            (from..lines).map(|line| numbers[line * columns + index]).collect()
        };
        if has_titles {
            return Labels { line: None, column: counted(&column(0, 0)) };
        }
        let axes = Labels { line: spacing(row(0, 1)), column: spacing(&column(0, 1)) };
        let has_both = axes.line.is_some() && axes.column.is_some();
        if has_corner {
            return if has_both { axes } else { Labels::NONE };
        }
        // Heights are hardly ever spaced evenly, and never along both edges alone.
        let is_long = columns > MIN_LABELS && lines > MIN_LABELS;
        let is_plane = lines > 1 && spacing(row(1, 1)).is_some();
        if has_both && is_long && !is_plane && spacing(&column(1, 1)).is_none() {
            return axes;
        }
        // The columns of `to_csv` without an index; heights may well count from 1.
        let is_counted = columns >= MIN_LABELS && numbers[0] == 0.0;
        let first = if is_counted { counted(row(0, 0)) } else { None };
        Labels { line: first.filter(|_| spacing(row(1, 0)).is_none()), column: None }
    }

    /// Returns true if numbers increase or decrease evenly.
    pub fn are_even(numbers: &[f64]) -> bool {
        spacing(numbers).is_some()
    }

    /// Describes what was taken for labels; `unit` is the unit of the axes.
    pub fn note(&self, unit: Option<&str>) -> Option<String> {
        let what = match (self.line, self.column) {
            (Some(_), Some(_)) => "the first line and the first column are taken for",
            (Some(_), None) => "the first line is taken for",
            (None, Some(_)) => "the first column is taken for",
            (None, None) => return None,
        };
        let is_counted = [self.line, self.column].contains(&Some(Spacing::Counted));
        let labels = match unit {
            _ if is_counted => "numbers of lines and columns".to_owned(),
            Some(unit) => format!("axes in {unit}"),
            None => "axes".to_owned(),
        };
        Some(format!("{what} {labels}"))
    }
}

/// Returns the spacing of labels that increase or decrease evenly.
fn spacing(labels: &[f64]) -> Option<Spacing> {
    let (&[first, .., last], count) = (labels, labels.len()) else {
        return None;
    };
    let step = (last - first) / (count - 1) as f64;
    let is_even = step != 0.0
        && step.is_finite()
        && labels.iter().enumerate().all(|(index, label)| {
            (label - (first + index as f64 * step)).abs() <= TOLERANCE * step.abs()
        });
    is_even.then(|| counted(labels).unwrap_or(Spacing::Step(step)))
}

/// Returns `Counted` if labels count from 0 or 1.
fn counted(labels: &[f64]) -> Option<Spacing> {
    let from =
        |first: f64| labels.iter().enumerate().all(|(index, label)| *label == first + index as f64);
    (labels.len() > 1 && (from(0.0) || from(1.0))).then_some(Spacing::Counted)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTED: Option<Spacing> = Some(Spacing::Counted);

    #[test]
    fn an_empty_corner_between_even_labels_is_told_from_heights() {
        let numbers = [f64::NAN, 0.0, 1.0, 2.0, 0.0, 5.0, 3.0, 8.0, 1.0, 2.0, 7.0, 1.0];
        let both = Labels { line: COUNTED, column: COUNTED };
        assert_eq!(Labels::find(&numbers, 4, true, false), both);
        assert_eq!(Labels::find(&numbers, 4, false, false), Labels::NONE);
        let heights = [f64::NAN, 4.0, 1.0, 2.0, 0.0, 5.0, 3.0, 8.0, 1.0, 2.0, 7.0, 1.0];
        assert_eq!(Labels::find(&heights, 4, true, false), Labels::NONE);
    }

    #[test]
    fn axes_along_both_edges_are_told_by_their_even_spacing() {
        let height = |line: usize, column: usize| ((line * 7 + column * 5) % 11) as f64;
        let number = |index: usize| match (index / 6, index % 6) {
            (0, 0) => 0.0,
            (0, column) => 0.5 * column as f64,
            (line, 0) => 2.0 * line as f64,
            (line, column) => height(line, column) * height(line, column),
        };
        let numbers: Vec<f64> = (0..36).map(number).collect();
        let axes = Labels { line: Some(Spacing::Step(0.5)), column: Some(Spacing::Step(2.0)) };
        assert_eq!(Labels::find(&numbers, 6, false, false), axes);
        // A plane is evenly spaced everywhere.
        let plane: Vec<f64> =
            (0..36).map(|index| 0.5 * (index % 6) as f64 + (index / 6) as f64).collect();
        assert_eq!(Labels::find(&plane, 6, false, false), Labels::NONE);
    }

    #[test]
    fn a_first_line_or_column_that_counts_is_labels() {
        let numbers = [0.0, 1.0, 2.0, 3.0, 5.0, 3.0, 8.0, 2.0];
        assert_eq!(Labels::find(&numbers, 4, false, false), Labels { line: COUNTED, column: None });
        let numbers = [0.0, 5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!(Labels::find(&numbers, 2, false, true), Labels { line: None, column: COUNTED });
        assert_eq!(Labels::find(&numbers, 2, false, false), Labels::NONE);
    }
}
