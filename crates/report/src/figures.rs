//! All figures of a page: surfaces, then contact in the order of the paper.
//!
//! A figure is a [`Definition`]: what it needs, from which tables, over which axes, with which words.

mod area;
mod contact_maps;
mod corrections;
mod distributions;
mod flow;
mod full_contact;
mod heights;
mod limits;
mod pressure;
mod spectra;
mod summits;

use serde::Serialize;

use crate::ReportError;
use crate::charts::Figure;
use crate::figure_data::FigureData;
use crate::figures::contact_maps::LoadSlider;

/// Every figure that a study can have.
pub const ALL: [&Definition; 25] = [
    &heights::MAPS,
    &heights::HEIGHTS,
    &spectra::SPECTRUM,
    &spectra::SLOPE_BY_SCALE,
    &area::AREA_LIGHT,
    &area::SLOPE,
    &full_contact::ALL_LOADS,
    &contact_maps::CONTACT_MAPS,
    &full_contact::APPROACH,
    &pressure::AGAINST_PRESSURE,
    &pressure::GAP,
    &corrections::RELATIVE_ERROR,
    &corrections::CORRECTED,
    &corrections::COLLAPSE,
    &pressure::GROWTH,
    &summits::NAYAK,
    &summits::DENSITY,
    &limits::MESH,
    &distributions::CONTACT_PRESSURES,
    &distributions::GAPS,
    &distributions::CLUSTERS,
    &flow::SEALING,
    &flow::FLOW,
    &area::ASPERITIES,
    &limits::LIMITS,
];

/// A figure that a study can have, and how to draw it from its tables.
pub struct Definition {
    /// The name of its files, and its anchor on the page.
    pub name: &'static str,
    pub title: &'static str,
    pub draw: fn(&FigureData) -> Result<Drawn, ReportError>,
}

impl Definition {
    pub fn file_names(&self) -> [String; 2] {
        ["svg", "png"].map(|ending| format!("{}.{ending}", self.name))
    }
}

/// What drawing a figure has come to.
pub enum Drawn {
    Figure {
        figure: Box<Figure>,
        /// What is to be seen, of how many surfaces, under which correction.
        caption: String,
        /// What the page has below it, and its files have not.
        sliders: Vec<LoadSlider>,
    },
    /// The study has no data for it, or what it is drawn from is gone.
    Missing {
        needs: &'static str,
        /// The lines of a manifest that would add it; none if the study has them.
        lines: Option<String>,
    },
    /// It is of a kind of stage that the study has not, and that most studies have not.
    NotAsked,
}

impl Drawn {
    pub fn figure(figure: Figure, caption: impl Into<String>) -> Drawn {
        Drawn::Figure { figure: Box::new(figure), caption: caption.into(), sliders: Vec::new() }
    }

    pub fn with_sliders(mut self, below: Vec<LoadSlider>) -> Drawn {
        if let Drawn::Figure { sliders, .. } = &mut self {
            *sliders = below;
        }
        self
    }

    /// The study has computed the figure, but what it is drawn from is gone.
    pub fn gone(needs: &'static str) -> Drawn {
        Drawn::Missing { needs, lines: None }
    }

    /// The study has no data for the figure; a stage of the given lines would add it.
    pub fn missing(needs: &'static str, lines: String) -> Drawn {
        Drawn::Missing { needs, lines: Some(lines) }
    }
}

/// A figure as SVG for the page, and as files of their own.
#[derive(Debug, Serialize)]
pub struct DrawnFigure {
    pub name: &'static str,
    pub title: &'static str,
    pub svg: String,
    #[serde(skip)]
    pub alone: String,
    #[serde(skip)]
    pub png: Vec<u8>,
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
    pub title: &'static str,
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
    let each = if least == most {
        format!("{most} surface{}", plural(most))
    } else {
        format!("{least} to {most} surfaces")
    };
    match surfaces.len() {
        1 => each,
        points => format!("{each} for each of {points} parameter points"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_claims::{Evidence, all};

    #[test]
    fn claims_name_figures_that_are_drawn() {
        let claims = all(&Evidence::of(&[]).unwrap());
        let figures = claims.iter().filter_map(|claim| claim.statement.figure);
        for figure in figures {
            let mut drawn = ALL.iter();
            assert!(drawn.any(|definition| definition.name == figure), "{figure}");
        }
    }
}
