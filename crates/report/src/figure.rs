//! A figure of the page, or what it would take.

use serde::Serialize;

use super::ReportError;
use super::figure_data::FigureData;
use super::load_slider::LoadSlider;
use crate::charts::figure::Figure;

/// What a figure is, and how to draw it.
pub struct Definition {
    /// Its file's name, and its anchor on the page.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// Draws it from a study's tables.
    pub draw: fn(&FigureData) -> Result<Drawn, ReportError>,
}

impl Definition {
    /// Returns the names of its files.
    pub fn file_names(&self) -> [String; 2] {
        ["svg", "png"].map(|ending| format!("{}.{ending}", self.name))
    }
}

/// What came of a figure.
pub enum Drawn {
    /// It is there.
    Figure {
        /// Charts and maps.
        figure: Box<Figure>,
        /// What is to be seen, of how many surfaces, under which correction.
        caption: String,
        /// What the page has below it, and its files have not.
        sliders: Vec<LoadSlider>,
    },
    /// The study has computed it, but what it is drawn from is gone.
    Gone {
        /// What it needs, in words.
        needs: &'static str,
    },
    /// The study has no data for it.
    Missing {
        /// What it needs, in words.
        needs: &'static str,
        /// The lines of a manifest that would add it.
        lines: String,
    },
    /// It is of a kind of stage that the study has not, and that most studies have not.
    NotAsked,
}

impl Drawn {
    /// A figure and its caption.
    pub fn figure(figure: Figure, caption: impl Into<String>) -> Drawn {
        Drawn::Figure { figure: Box::new(figure), caption: caption.into(), sliders: Vec::new() }
    }

    /// A figure with these below it.
    pub fn with_sliders(mut self, below: Vec<LoadSlider>) -> Drawn {
        if let Drawn::Figure { sliders, .. } = &mut self {
            *sliders = below;
        }
        self
    }

    /// What a figure is drawn from is gone.
    pub fn gone(needs: &'static str) -> Drawn {
        Drawn::Gone { needs }
    }

    /// What would add a figure: a stage of the given lines below its header.
    pub fn missing(needs: &'static str, lines: impl Into<String>) -> Drawn {
        Drawn::Missing { needs, lines: lines.into() }
    }
}

/// A figure that is there.
#[derive(Debug, Serialize)]
pub struct DrawnFigure {
    /// Its files' name, and its anchor.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// The drawing.
    pub svg: String,
    /// The drawing as a file of its own.
    #[serde(skip)]
    pub alone: String,
    /// The same in pixels.
    #[serde(skip)]
    pub png: Vec<u8>,
    /// What is to be seen.
    pub caption: String,
    /// Maps under more loads, of which a reader chooses.
    pub sliders: Vec<LoadSlider>,
}

impl DrawnFigure {
    /// Its files: their names, and what is in them.
    pub fn files(&self) -> [(String, &[u8]); 2] {
        let bytes = [("svg", self.alone.as_bytes()), ("png", &self.png)];
        bytes.map(|(ending, bytes)| (format!("{}.{ending}", self.name), bytes))
    }
}

/// A figure for which the study has no data.
#[derive(Debug, Serialize)]
pub struct MissingFigure {
    /// Its heading.
    pub title: &'static str,
    /// What it needs.
    pub needs: &'static str,
    /// The lines of a manifest that would add it; none if the study has them.
    pub lines: Option<String>,
}

/// `8 surfaces`, `4 surfaces for each of 2 spectra`.
pub fn sample(surfaces: &[usize]) -> String {
    let (least, most) = (surfaces.iter().min(), surfaces.iter().max());
    let (Some(&least), Some(&most)) = (least, most) else {
        return "no surfaces".to_owned();
    };
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let each = match least == most {
        true => format!("{most} surface{}", plural(most)),
        false => format!("{least} to {most} surfaces"),
    };
    match surfaces.len() {
        1 => each,
        points => format!("{each} for each of {points} parameter points"),
    }
}
