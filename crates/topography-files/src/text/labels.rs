//! Labels of the lines and columns of a matrix, which are not heights.

/// Smallest number of labels that are told from heights by their numbers alone: those that count,
/// and those with another step.
const MIN_COUNTED: usize = 4;
const MIN_STEPS: usize = 8;
/// Largest deviation of a label from an even spacing, in steps.
const TOLERANCE: f64 = 1e-2;

/// First line and first column of a matrix that are labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Labels {
    /// Spacing of the labels along x, if the first line is labels.
    pub(crate) line: Option<Spacing>,
    /// Spacing of the labels along y, if the first column is labels.
    pub(crate) column: Option<Spacing>,
}

/// What a file says about the labels of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Evidence {
    /// The header gives sides or numbers of nodes, so that all numbers are heights.
    Header,
    /// Numbers between spaces.
    Spaces,
    /// Cells between tabs, semicolons or commas, as `to_csv` of pandas and spreadsheets write them.
    Cells,
    /// The first cell of the first line is empty or a word.
    Corner,
    /// The line above has a title for each column, the first of which is empty or says that the
    /// column counts the lines.
    Index,
}

/// Even spacing of labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Spacing {
    /// The labels are the numbers of the lines, counted from 0 or 1.
    Counted,
    /// The labels are coordinates with this step.
    Step(f64),
}

impl Labels {
    pub(crate) const NONE: Labels = Labels { line: None, column: None };

    /// Finds the labels of a matrix of `columns` numbers a line.
    pub(crate) fn find(numbers: &[f64], columns: usize, evidence: Evidence) -> Labels {
        let lines = numbers.len() / columns;
        if lines < 2 || columns < 2 {
            return Labels::NONE;
        }
        let row = |line: usize, from: usize| &numbers[line * columns + from..(line + 1) * columns];
        let column = |index: usize, from: usize| -> Vec<f64> {
            (from..lines).map(|line| numbers[line * columns + index]).collect()
        };
        let axes = || Labels { line: spacing(row(0, 1)), column: spacing(&column(0, 1)) };
        match evidence {
            Evidence::Header => Labels::NONE,
            Evidence::Index => {
                let spacing = spacing(&column(0, 0)).unwrap_or(Spacing::Counted);
                Labels { line: None, column: Some(spacing) }
            }
            Evidence::Corner => Some(axes()).filter(Labels::are_both).unwrap_or(Labels::NONE),
            Evidence::Spaces | Evidence::Cells => {
                // Heights are hardly ever spaced evenly, and never along both edges alone.
                let is_long = columns > MIN_COUNTED && lines > MIN_COUNTED;
                let is_even = || spacing(row(1, 1)).or(spacing(&column(1, 1))).is_some();
                if is_long && axes().are_both() && !is_even() {
                    return axes();
                }
                // The columns of `to_csv` without an index; heights may well count from 1.
                let from_zero = evidence == Evidence::Cells && numbers[0] == 0.0;
                let is_uneven = spacing(row(1, 0)).is_none();
                let line = spacing(row(0, 0)).filter(|spacing| {
                    let is_counted = *spacing == Spacing::Counted;
                    let least = if is_counted { MIN_COUNTED } else { MIN_STEPS };
                    from_zero && is_uneven && columns >= least
                });
                // The index of `to_csv` without its columns.
                let is_index = line.is_none() && from_zero && lines >= MIN_COUNTED && columns > 2;
                let is_beside = || spacing(&column(1, 0)).is_some();
                let column = counted(&column(0, 0)).filter(|_| is_index && !is_beside());
                Labels { line, column }
            }
        }
    }

    fn are_both(&self) -> bool {
        self.line.is_some() && self.column.is_some()
    }

    /// Returns true if numbers increase or decrease evenly.
    pub(crate) fn are_even(numbers: &[f64]) -> bool {
        spacing(numbers).is_some()
    }

    /// Returns the steps of axes along x and y, or `None` if labels of lines or columns only count
    /// them. Labels that count are coordinates if they have a unit or if those of the other axis
    /// are coordinates.
    pub(crate) fn steps(&self, has_unit: bool) -> Option<[f64; 2]> {
        let labels = [self.line?, self.column?];
        let are_counted = labels == [Spacing::Counted; 2] && !has_unit;
        (!are_counted).then(|| labels.map(Spacing::step))
    }

    /// Describes what was taken for labels; `unit` is the unit of the axes.
    pub(crate) fn note(&self, unit: Option<&str>) -> Option<String> {
        let of_unit = unit.map_or_else(String::new, |unit| format!(" in {unit}"));
        let axis = |spacing: Spacing, counted: &str| match spacing {
            Spacing::Counted => counted.to_owned(),
            Spacing::Step(_) => format!("an axis{of_unit}"),
        };
        match (self.line, self.column) {
            (Some(_), Some(_)) if self.steps(unit.is_some()).is_some() => {
                Some(format!("the first line and the first column are taken for axes{of_unit}"))
            }
            (Some(_), Some(_)) => Some(
                "the first line and the first column are taken for numbers of columns and lines"
                    .to_owned(),
            ),
            (Some(line), None) => {
                Some(format!("the first line is taken for {}", axis(line, "numbers of columns")))
            }
            (None, Some(column)) => {
                Some(format!("the first column is taken for {}", axis(column, "numbers of lines")))
            }
            (None, None) => None,
        }
    }
}

impl Spacing {
    fn step(self) -> f64 {
        match self {
            Spacing::Counted => 1.0,
            Spacing::Step(step) => step,
        }
    }
}

/// Returns the spacing of labels that increase or decrease evenly. Two labels must count, because
/// any two numbers are spaced evenly.
fn spacing(labels: &[f64]) -> Option<Spacing> {
    let (&[first, _, .., last], count) = (labels, labels.len()) else {
        return counted(labels);
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
        assert_eq!(Labels::find(&numbers, 4, Evidence::Corner), both);
        assert_eq!(Labels::find(&numbers, 4, Evidence::Cells), Labels::NONE);
        let heights = [f64::NAN, 4.0, 1.0, 2.0, 0.0, 5.0, 3.0, 8.0, 1.0, 2.0, 7.0, 1.0];
        assert_eq!(Labels::find(&heights, 4, Evidence::Corner), Labels::NONE);
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
        assert_eq!(Labels::find(&numbers, 6, Evidence::Spaces), axes);
        assert_eq!(Labels::find(&numbers, 6, Evidence::Header), Labels::NONE);
        assert_eq!(axes.steps(false), Some([0.5, 2.0]));
        // A plane is evenly spaced everywhere.
        let plane: Vec<f64> =
            (0..36).map(|index| 0.5 * (index % 6) as f64 + (index / 6) as f64).collect();
        assert_eq!(Labels::find(&plane, 6, Evidence::Spaces), Labels::NONE);
    }

    #[test]
    fn a_first_line_or_column_that_counts_is_labels() {
        let numbers = [0.0, 1.0, 2.0, 3.0, 5.0, 3.0, 8.0, 2.0];
        let of_line = Labels { line: COUNTED, column: None };
        assert_eq!(Labels::find(&numbers, 4, Evidence::Cells), of_line);
        assert_eq!(Labels::find(&numbers, 4, Evidence::Spaces), Labels::NONE);
        let numbers = [0.0, 5.0, 1.0, 3.0, 2.0, 4.0];
        let of_column = Labels { line: None, column: COUNTED };
        assert_eq!(Labels::find(&numbers, 2, Evidence::Index), of_column);
        assert_eq!(Labels::find(&numbers, 2, Evidence::Cells), Labels::NONE);
        let index = [0.0, 5.0, 2.0, 1.0, 3.0, 1.0, 2.0, 8.0, 4.0, 3.0, 1.0, 7.0];
        assert_eq!(Labels::find(&index, 3, Evidence::Cells), of_column);
        assert_eq!(Labels::find(&index, 3, Evidence::Spaces), Labels::NONE);
        let plane = [0.0, 1.0, 2.0, 1.0, 2.0, 3.0, 2.0, 3.0, 4.0, 3.0, 4.0, 5.0];
        assert_eq!(Labels::find(&plane, 3, Evidence::Cells), Labels::NONE);
    }

    #[test]
    fn a_first_line_of_many_even_steps_from_zero_is_labels() {
        let steps = (0..8).map(|index| 1e-7 * f64::from(index));
        let numbers: Vec<f64> = steps.chain([5.0, 3.0, 8.0, 2.0, 1.0, 1.0, 4.0, 0.0]).collect();
        assert!(matches!(Labels::find(&numbers, 8, Evidence::Cells).line, Some(Spacing::Step(_))));
        assert_eq!(Labels::find(&numbers, 8, Evidence::Spaces), Labels::NONE);
    }

    #[test]
    fn two_labels_must_count() {
        let numbers = [f64::NAN, 2.0, 3.0, 4.0, 1.0, 7.0, 2.0, 5.0, 6.0, 3.0, 9.0, 1.0];
        assert_eq!(Labels::find(&numbers, 4, Evidence::Corner), Labels::NONE);
        let counting = [f64::NAN, 2.0, 3.0, 4.0, 0.0, 7.0, 2.0, 5.0, 1.0, 3.0, 9.0, 1.0];
        assert!(Labels::find(&counting, 4, Evidence::Corner).are_both());
    }

    #[test]
    fn labels_that_count_are_coordinates_beside_other_coordinates_or_with_a_unit() {
        let labels = |column| Labels { line: COUNTED, column: Some(column) };
        assert_eq!(labels(Spacing::Counted).steps(false), None);
        assert_eq!(labels(Spacing::Counted).steps(true), Some([1.0, 1.0]));
        assert_eq!(labels(Spacing::Step(-2.0)).steps(false), Some([1.0, -2.0]));
    }
}
