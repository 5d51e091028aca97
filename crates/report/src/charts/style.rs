//! Colours, lines and markers of series.
//!
//! A figure uses CSS variables for colours, so a page can be light or dark. A separate file
//! contains the light colours. Series have colours after Okabe & Ito (2008), which colour-blind
//! people can distinguish, and lighter ones on a dark page. Series of ascending numbers have
//! colours of the gradient *plasma*: its dark part on a light page, its light part on a dark one.

use std::collections::HashMap;

use colorous::PLASMA;
use kuva::plot::LineStyle;
use kuva::plot::scatter::MarkerShape;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    pub colour: Colour,
    pub line: Option<Line>,
    pub marker: Option<MarkerShape>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub dash: Dash,
    /// Width of the line in pixels.
    pub width: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::enum_variant_names, reason = "a dash-dot line is called so")]
pub enum Dash {
    Solid,
    Dashed,
    Dotted,
    DashDot,
}

/// Returns the marker with this index; markers repeat after the last.
pub fn marker(index: usize) -> MarkerShape {
    const ALL: [MarkerShape; 6] = [
        MarkerShape::Circle,
        MarkerShape::Triangle,
        MarkerShape::Square,
        MarkerShape::Diamond,
        MarkerShape::TriangleDown,
        MarkerShape::Cross,
    ];
    ALL[index % ALL.len()]
}

impl Style {
    pub fn line(colour: Colour, dash: Dash, width: f64) -> Style {
        Style { colour, line: Some(Line { dash, width }), marker: None }
    }

    /// Creates a style of separate markers.
    pub fn marker(colour: Colour, marker: MarkerShape) -> Style {
        Style { colour, line: None, marker: Some(marker) }
    }

    /// Adds a thin line through the points.
    pub fn joined(self) -> Style {
        let line = Line { dash: Dash::Solid, width: 1.0 };
        Style { line: Some(line), ..self }
    }
}

impl Dash {
    pub(super) fn pattern(self) -> LineStyle {
        match self {
            Dash::Solid => LineStyle::Solid,
            Dash::Dashed => LineStyle::Custom("7,4".to_owned()),
            Dash::Dotted => LineStyle::Custom("1.5,3".to_owned()),
            Dash::DashDot => LineStyle::Custom("8,3,2,3".to_owned()),
        }
    }

    /// Returns the lengths of strokes and gaps.
    pub(super) fn array(self) -> Option<String> {
        self.pattern().dasharray()
    }
}

/// A colour by its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    Text,
    /// Secondary elements, such as guides and asymptotes.
    Muted,
    Grid,
    Background,
    /// Series of data, by its index; colours repeat after the last.
    Series(usize),
    /// Step of the gradient for ascending numbers, below [`GRADIENT_STEPS`].
    Gradient(usize),
}

/// Number of colours of the gradient for ascending numbers.
pub const GRADIENT_STEPS: usize = 64;
/// Parts of the gradient that stand out from light and from dark paper.
const GRADIENT: [[f64; 2]; 2] = [[0.0, 0.63], [0.41, 1.0]];

/// Number of distinct colours of series.
pub const SERIES_COLOURS: usize = SERIES.len();

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
        let series = (0..SERIES.len()).map(Colour::Series);
        fixed.into_iter().chain(series).chain((0..GRADIENT_STEPS).map(Colour::Gradient))
    }

    pub fn css(self) -> String {
        format!("var({})", self.variable())
    }

    fn variable(self) -> String {
        match self {
            Colour::Text => "--ink".to_owned(),
            Colour::Muted => "--soft".to_owned(),
            Colour::Grid => "--grid".to_owned(),
            Colour::Background => "--paper".to_owned(),
            Colour::Series(index) => format!("--series-{}", index % SERIES.len()),
            Colour::Gradient(step) => format!("--step-{step}"),
        }
    }

    /// Returns the colours on a light and on a dark page.
    fn shades(self) -> [String; 2] {
        let (light, dark) = match self {
            Colour::Gradient(step) => {
                let share = step as f64 / (GRADIENT_STEPS - 1) as f64;
                let shade =
                    |[from, to]: [f64; 2]| PLASMA.eval_continuous(from + share * (to - from));
                return GRADIENT.map(|part| format!("#{:x}", shade(part)));
            }
            Colour::Text => ("#1b1b1b", "#e8e8e8"),
            Colour::Muted => ("#6b6b6b", "#a8a8a8"),
            Colour::Grid => ("#e4e4e4", "#3a3d42"),
            Colour::Background => ("#ffffff", "#17191c"),
            Colour::Series(index) => SERIES[index % SERIES.len()],
        };
        [light, dark].map(str::to_owned)
    }
}

/// Returns the declarations of all variables, for light and dark pages.
pub fn declarations() -> [String; 2] {
    [0, 1].map(|mode| {
        let colours = Colour::all();
        colours.map(|colour| format!("{}:{};", colour.variable(), colour.shades()[mode])).collect()
    })
}

/// Replaces CSS variables by the light colours, for programs without them.
pub fn with_light_colours(svg: &str) -> String {
    let known: HashMap<String, [String; 2]> =
        Colour::all().map(|colour| (colour.css(), colour.shades())).collect();
    let mut parts = svg.split("var(");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(')').map_or(part.len(), |end| end + 1);
        let variable = format!("var({}", &part[..end]);
        text += known.get(&variable).map_or(&variable, |[light, _]| light);
        text += &part[end..];
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the relative luminance by WCAG 2.
    fn luminance(colour: &str) -> f64 {
        let channel = |at: usize| {
            let value = u8::from_str_radix(&colour[at..at + 2], 16).unwrap();
            let share = f64::from(value) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
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
            let paper = &Colour::Background.shades()[mode];
            for colour in
                Colour::all().filter(|colour| !matches!(colour, Colour::Background | Colour::Grid))
            {
                let shade = &colour.shades()[mode];
                // WCAG requires a contrast of 4.5 for text and 3 for graphics.
                let is_graphic = matches!(colour, Colour::Series(_) | Colour::Gradient(_));
                let least = if is_graphic { 3.0 } else { 4.5 };
                assert!(contrast(shade, paper) >= least, "{colour:?} in mode {mode}");
            }
        }
    }

    #[test]
    fn a_figure_that_goes_out_alone_has_no_variables() {
        let svg = Colour::all().map(Colour::css).collect::<String>();
        let shades = Colour::all().map(|colour| colour.shades()[0].clone());
        assert_eq!(with_light_colours(&svg), shades.collect::<String>());
    }
}
