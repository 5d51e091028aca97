//! How a series looks: its colour, its line, its markers.

use kuva::plot::LineStyle;
use kuva::plot::scatter::MarkerShape;

use super::colour::Colour;

/// How a series looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Its colour.
    pub colour: Colour,
    /// The line that joins its points.
    pub line: Option<Line>,
    /// What stands at its points.
    pub marker: Option<Marker>,
}

/// A line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its pattern.
    pub dash: Dash,
    /// Its width, in pixels.
    pub width: f64,
}

/// The pattern of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::enum_variant_names, reason = "a dash-dot line is called so")]
pub enum Dash {
    Solid,
    Dashed,
    Dotted,
    DashDot,
}

/// What stands at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    TriangleDown,
    Cross,
}

impl Marker {
    /// The marker of a place among all; they come round again after the last.
    pub fn of(place: usize) -> Marker {
        const ALL: [Marker; 6] = [
            Marker::Circle,
            Marker::Triangle,
            Marker::Square,
            Marker::Diamond,
            Marker::TriangleDown,
            Marker::Cross,
        ];
        ALL[place % ALL.len()]
    }

    pub(super) fn shape(self) -> MarkerShape {
        match self {
            Marker::Circle => MarkerShape::Circle,
            Marker::Square => MarkerShape::Square,
            Marker::Triangle => MarkerShape::Triangle,
            Marker::Diamond => MarkerShape::Diamond,
            Marker::TriangleDown => MarkerShape::TriangleDown,
            Marker::Cross => MarkerShape::Cross,
        }
    }
}

impl Style {
    /// A line.
    pub fn line(colour: Colour, dash: Dash, width: f64) -> Style {
        Style { colour, line: Some(Line { dash, width }), marker: None }
    }

    /// Separate points.
    pub fn marker(colour: Colour, marker: Marker) -> Style {
        Style { colour, line: None, marker: Some(marker) }
    }

    /// The same with a thin line through the points.
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

    /// Lengths of strokes and gaps.
    pub(super) fn array(self) -> Option<String> {
        self.pattern().dasharray()
    }
}
