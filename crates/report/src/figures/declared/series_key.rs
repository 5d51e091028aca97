//! Colours, markers and dashes of the series of a figure.

use asperity_tables::column::Value;

use super::{Further, LOGARITHMIC, MOST_ENTRIES};
use crate::charts::style::{self, Colour, Dash, GRADIENT_STEPS, Line, Style};

/// Properties that distinguish the series of a figure: colours, markers and dashes.
pub struct SeriesKey {
    /// Values that have their own colour, in ascending order.
    pub colours: Vec<Option<Value>>,
    /// The same values, if there are several and all are numbers.
    pub numbers: Option<Vec<f64>>,
    pub further: Vec<Further>,
}

pub(super) const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted];

impl SeriesKey {
    /// Returns whether colours stand for one parameter, and markers for everything else.
    pub fn is_crossed(&self) -> bool {
        let has_colours = self.numbers.is_some() || (2..=7).contains(&self.colours.len());
        has_colours && (2..=24).contains(&self.further.len())
    }

    /// Returns the style of a series. No two series of a figure look alike.
    pub fn style(&self, colour: usize, further: usize) -> Style {
        let look = |colour: Colour, marker: usize, dash: usize| Style {
            colour,
            line: Some(Line { dash: DASHES[dash % DASHES.len()], width: 1.2 }),
            marker: Some(style::marker(marker)),
        };
        // These pairs of marker and dash differ for 24 indices.
        let pair = [further / 4 * 5 + further % 4, further % 4];
        match &self.numbers {
            Some(numbers) if self.is_crossed() => {
                look(Colour::Gradient(step(numbers, colour)), pair[0], pair[1])
            }
            Some(numbers) if self.further.len() == 1 => {
                look(Colour::Gradient(step(numbers, colour)), colour, 0)
            }
            _ if self.is_crossed() => look(Colour::Series(colour), pair[0], pair[1]),
            _ => {
                // 7 colours and 6 markers give 42 pairs.
                let index = colour * self.further.len() + further;
                look(Colour::Series(index), index, index / 42)
            }
        }
    }
}

/// Returns the colour of the number with this index, as a step of the gradient. Up to
/// [`MOST_ENTRIES`] numbers get evenly spaced colours. The colours of more numbers follow a linear
/// or a logarithmic scale.
fn step(numbers: &[f64], index: usize) -> usize {
    let last = (GRADIENT_STEPS - 1) as f64;
    let (least, most) = (numbers[0], numbers[numbers.len() - 1]);
    let share = if numbers.len() <= MOST_ENTRIES {
        index as f64 / (numbers.len() - 1) as f64
    } else if least > 0.0 && most > LOGARITHMIC * least {
        (numbers[index] / least).ln() / (most / least).ln()
    } else {
        (numbers[index] - least) / (most - least)
    };
    (last * share).round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::number;

    fn key(colours: usize, further: usize, are_numbers: bool) -> SeriesKey {
        let value = |index: usize| match are_numbers {
            true => Value::Real(index as f64),
            false => Value::Text(format!("word {index}")),
        };
        let colours: Vec<Option<Value>> = (0..colours).map(|index| Some(value(index))).collect();
        let numbers: Option<Vec<f64>> =
            colours.iter().map(|colour| number(colour.as_ref()?)).collect();
        let further = (0..further)
            .map(|index| (vec![("k_upper".to_owned(), Some(Value::Integer(index as i64)))], None));
        let numbers = numbers.filter(|all| all.len() > 1);
        SeriesKey { colours, numbers, further: further.collect() }
    }

    #[test]
    fn no_two_series_look_alike() {
        for are_numbers in [true, false] {
            for (colours, further) in [(1, 1), (12, 1), (60, 1), (1, 24), (8, 3), (3, 20), (20, 7)]
            {
                let key = key(colours, further, are_numbers);
                let mut looks = Vec::new();
                for colour in 0..colours {
                    for index in 0..further {
                        let style = key.style(colour, index);
                        assert!(
                            !looks.contains(&style),
                            "{colour}, {index} of {colours} × {further}"
                        );
                        looks.push(style);
                    }
                }
            }
        }
    }

    #[test]
    fn ascending_numbers_have_ascending_colours_to_the_ends_of_the_gradient() {
        let steps = |numbers: &[f64]| -> Vec<usize> {
            (0..numbers.len()).map(|index| step(numbers, index)).collect()
        };
        assert_eq!(steps(&[0.1, 0.2, 100.0]), [0, 32, 63], "few numbers are evenly spaced");
        let powers: Vec<f64> = (0..19).map(|power| f64::from(power).exp2()).collect();
        let found = steps(&powers);
        assert_eq!((found[0], found[9], found[18]), (0, 32, 63), "a logarithmic scale");
    }
}
