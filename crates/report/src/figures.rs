//! All figures of a page: first figures of surfaces, then figures of contact in the order of the
//! paper.
//!
//! Each figure is a [`Definition`] with a function that draws the figure from the tables of a
//! study.

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

/// All figures, in the order of the page.
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

/// Name, title and drawing function of a figure.
pub struct Definition {
    /// Name of the files, and anchor on the page.
    pub name: &'static str,
    pub title: &'static str,
    pub draw: fn(&FigureData) -> Result<Drawn, ReportError>,
}

impl Definition {
    pub fn file_names(&self) -> [String; 2] {
        ["svg", "png"].map(|ending| format!("{}.{ending}", self.name))
    }
}

/// Result of drawing a figure.
pub enum Drawn {
    Figure {
        figure: Box<Figure>,
        /// Text below the figure on the page.
        caption: String,
        /// Interactive maps below the figure, only on the page.
        sliders: Vec<LoadSlider>,
    },
    /// The study has no data for the figure, or has lost the data.
    Missing {
        needs: &'static str,
        /// Lines of a manifest that would add the data; `None` if the data are lost.
        lines: Option<String>,
    },
    /// The study has no stage of the special kind that the figure shows.
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

    /// Creates a missing figure of a study that has lost the data.
    pub fn gone(needs: &'static str) -> Drawn {
        Drawn::Missing { needs, lines: None }
    }

    /// Creates a missing figure with lines of a manifest that would add the data.
    pub fn missing(needs: &'static str, lines: String) -> Drawn {
        Drawn::Missing { needs, lines: Some(lines) }
    }
}

/// A figure as SVG for the page, and as separate files.
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
    /// Maps at further loads, which a reader selects with sliders.
    pub sliders: Vec<LoadSlider>,
}

impl DrawnFigure {
    /// Returns the names and contents of the files.
    pub fn files(&self) -> [(String, &[u8]); 2] {
        let bytes = [("svg", self.alone.as_bytes()), ("png", &self.png)];
        bytes.map(|(ending, bytes)| (format!("{}.{ending}", self.name), bytes))
    }
}

/// A figure for which the study has no data or has lost the data.
#[derive(Debug, Serialize)]
pub struct MissingFigure {
    pub title: &'static str,
    pub needs: &'static str,
    /// Lines of a manifest that would add the data; `None` if the data are lost.
    pub lines: Option<String>,
}

/// Returns text such as `8 surfaces` or `4 surfaces for each of 2 parameter points`.
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
        let claims = all(&Evidence::from_tables(&[]).unwrap());
        let figures = claims.iter().filter_map(|claim| claim.statement.figure);
        for figure in figures {
            let mut drawn = ALL.iter();
            assert!(drawn.any(|definition| definition.name == figure), "{figure}");
        }
    }
}
