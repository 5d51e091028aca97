//! The colours of figures, by what they are for.
//!
//! A figure names colours by variables, so that the page that shows it may be light or dark. A
//! figure that goes out alone has the light ones written in. Series have the colours of Okabe & Ito
//! (2008), which the colour-blind tell apart; on dark paper they are lighter.

use std::fmt::Write;

/// A colour, by what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Axes, words, and what is drawn in black.
    Text,
    /// What is of lesser weight: guides, asymptotes.
    Muted,
    /// Lines of the grid.
    Grid,
    /// What it is all drawn on.
    Background,
    /// A series of data, by its place among all; colours come round again after the last.
    Series(usize),
}

const SERIES: [(&str, &str); 7] = [
    ("#0072b2", "#56b4e9"),
    ("#d55e00", "#ff8c42"),
    ("#009e73", "#2fd3a2"),
    ("#aa4499", "#e69acb"),
    ("#b8860b", "#f0c75e"),
    ("#332288", "#a99cf0"),
    ("#882255", "#f2789f"),
];

impl Colour {
    fn all() -> impl Iterator<Item = Colour> {
        let fixed = [Colour::Text, Colour::Muted, Colour::Grid, Colour::Background];
        fixed.into_iter().chain((0..SERIES.len()).map(Colour::Series))
    }

    /// As CSS writes it.
    pub fn css(self) -> String {
        format!("var({})", self.variable())
    }

    fn variable(self) -> String {
        match self {
            Colour::Text => "--ink".to_owned(),
            Colour::Muted => "--soft".to_owned(),
            Colour::Grid => "--grid".to_owned(),
            Colour::Background => "--paper".to_owned(),
            Colour::Series(place) => format!("--series-{}", place % SERIES.len()),
        }
    }

    /// On light paper and on dark.
    fn shades(self) -> [&'static str; 2] {
        let (light, dark) = match self {
            Colour::Text => ("#1b1b1b", "#e8e8e8"),
            Colour::Muted => ("#6b6b6b", "#a8a8a8"),
            Colour::Grid => ("#e4e4e4", "#3a3d42"),
            Colour::Background => ("#ffffff", "#17191c"),
            Colour::Series(place) => SERIES[place % SERIES.len()],
        };
        [light, dark]
    }
}

/// Declarations of all variables, for light paper.
pub fn light() -> String {
    declarations(0)
}

/// Declarations of all variables, for dark paper.
pub fn dark() -> String {
    declarations(1)
}

fn declarations(mode: usize) -> String {
    let mut text = String::new();
    for colour in Colour::all() {
        let _ = write!(text, "{}:{};", colour.variable(), colour.shades()[mode]);
    }
    text
}

/// The same drawing with the colours of light paper written in, for programs that know no
/// variables.
pub fn written_in(svg: &str) -> String {
    Colour::all().fold(svg.to_owned(), |svg, colour| svg.replace(&colour.css(), colour.shades()[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance by WCAG 2.
    fn luminance(colour: &str) -> f64 {
        let channel = |at: usize| {
            let value = u8::from_str_radix(&colour[at..at + 2], 16).unwrap();
            let share = f64::from(value) / 255.0;
            match share <= 0.04045 {
                true => share / 12.92,
                false => ((share + 0.055) / 1.055).powf(2.4),
            }
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    fn contrast(one: &str, other: &str) -> f64 {
        let [darker, lighter] = {
            let mut both = [luminance(one), luminance(other)];
            both.sort_by(f64::total_cmp);
            both
        };
        (lighter + 0.05) / (darker + 0.05)
    }

    #[test]
    fn words_and_series_stand_out_from_light_paper_and_from_dark() {
        for mode in [0, 1] {
            let paper = Colour::Background.shades()[mode];
            for colour in
                Colour::all().filter(|colour| !matches!(colour, Colour::Background | Colour::Grid))
            {
                let shade = colour.shades()[mode];
                // WCAG asks for 4.5 of words and for 3 of graphics.
                let least = if matches!(colour, Colour::Series(_)) { 3.0 } else { 4.5 };
                assert!(contrast(shade, paper) >= least, "{colour:?} in mode {mode}");
            }
        }
    }

    #[test]
    fn a_figure_that_goes_out_alone_has_no_variables() {
        let svg = Colour::all().map(Colour::css).collect::<String>();
        assert!(!written_in(&svg).contains("var("));
    }
}
