//! All figures of a page: those that the study declares, automatic ones, then figures of surfaces
//! and figures of contact in the order of the paper.
//!
//! Each figure is a [`Definition`] with a function that draws the figure from the tables of a
//! study.

mod automatic;
mod contact_maps;
mod curves;
mod declared;
mod errors;
mod heights;
mod shipped;
mod spectra;

use std::borrow::Cow;
use std::collections::BTreeSet;

use minijinja::Value;
use serde::Serialize;

use crate::ReportError;
use crate::charts::Figure;
use crate::figure_data::FigureData;
use crate::finished::FinishedStages;
use crate::samples::FILE_IS_GONE;
use asperity_pipeline::manifest::figure::WrittenFigure;
use asperity_pipeline::study::Study;
use asperity_pipeline::study::figures::FigureSpec;

/// Figures that code draws, which every study can have.
const CODED: [&Definition; 7] = [
    &heights::MAPS,
    &heights::HEIGHTS,
    &spectra::SPECTRUM,
    &spectra::SLOPE_BY_SCALE,
    &contact_maps::CONTACT_MAPS,
    &contact_maps::ADHESION_MAPS,
    &errors::ERRORS,
];

pub use shipped::missing;

/// A figure that a page may have.
pub struct Planned {
    /// Name of the files, and anchor on the page.
    pub name: String,
    pub title: String,
    pub group: Group,
    source: Source,
}

enum Source {
    Spec(Box<FigureSpec>),
    Coded(&'static Definition),
    Shipped(&'static WrittenFigure),
}

impl Planned {
    /// Lists the figures of a study in the order of the page: those that it declares, automatic
    /// ones, and all others. A declared figure takes the place of another one with its name. An
    /// automatic figure whose name another figure has gets a number.
    pub fn all(study: &Study, finished: &FinishedStages) -> Vec<Planned> {
        let declared = study.figures.iter().cloned();
        let mut all: Vec<Planned> =
            declared.map(|figure| Planned::from_spec(Group::Declared, figure)).collect();
        // Some file systems do not distinguish case.
        let mut taken: BTreeSet<String> =
            all.iter().map(|figure| figure.name.to_lowercase()).collect();
        let names = shipped::names().filter(|name| taken.insert((*name).to_owned()));
        let paper: Vec<Planned> = names.filter_map(Planned::of_paper).collect();
        for figure in automatic::figures(study, finished) {
            let mut figure = Planned::from_spec(Group::Automatic, figure);
            let numbered = (2..).map(|number| format!("{}-{number}", figure.name));
            let mut names = std::iter::once(figure.name.clone()).chain(numbered);
            let free = names.find(|name| taken.insert(name.to_lowercase()));
            figure.name = free.expect("there are always more numbers");
            all.push(figure);
        }
        all.extend(paper);
        all
    }

    fn from_spec(group: Group, spec: FigureSpec) -> Planned {
        let (name, title) = (spec.name.clone(), declared::title(&spec));
        Planned { name, title, group, source: Source::Spec(Box::new(spec)) }
    }

    fn of_paper(name: &str) -> Option<Planned> {
        let (title, source) = match CODED.into_iter().find(|figure| figure.name == name) {
            Some(coded) => (coded.title.to_owned(), Source::Coded(coded)),
            None => {
                let figure = shipped::find(name)?;
                (shipped::title(figure), Source::Shipped(figure))
            }
        };
        Some(Planned { name: name.to_owned(), title, group: Group::Paper, source })
    }

    pub fn draw(&self, data: &FigureData) -> Result<Drawn, ReportError> {
        let drawn = match &self.source {
            Source::Spec(figure) => declared::draw(data, figure)?,
            Source::Coded(definition) => (definition.draw)(data)?,
            Source::Shipped(figure) => shipped::draw(data, figure)?,
        };
        Ok(match (drawn, self.group) {
            // Nobody waits for an automatic figure that cannot be drawn.
            (Drawn::Missing { .. }, Group::Automatic) => Drawn::NotAsked,
            (Drawn::NotAsked, Group::Paper) => missing(data, &self.name),
            (drawn, _) => drawn,
        })
    }
}

/// Name, title and drawing function of a figure.
pub struct Definition {
    /// Name of the files, and anchor on the page.
    pub name: &'static str,
    pub title: &'static str,
    pub draw: fn(&FigureData) -> Result<Drawn, ReportError>,
}

/// Result of drawing a figure.
pub enum Drawn {
    Figure {
        figure: Box<Figure>,
        /// Text below the figure on the page.
        caption: String,
        /// Interactive maps below the figure, only on the page.
        sliders: Vec<Value>,
    },
    /// The study has no data for the figure, or has lost the data.
    Missing {
        needs: Cow<'static, str>,
        /// Lines of a manifest that would add the data; `None` if the data are lost.
        lines: Option<String>,
    },
    /// The study has no rows that the figure shows.
    NotAsked,
}

impl Drawn {
    pub fn figure(figure: Figure, caption: impl Into<String>) -> Drawn {
        Drawn::Figure { figure: Box::new(figure), caption: caption.into(), sliders: Vec::new() }
    }

    /// Creates a missing figure of a study that has lost the data.
    pub fn gone(needs: &'static str) -> Drawn {
        Drawn::Missing { needs: needs.into(), lines: None }
    }

    /// Creates a missing figure of surfaces, which is lost if the file of a measured surface is.
    pub fn missing_surfaces(data: &FigureData) -> Drawn {
        if data.maps.is_some() { Drawn::NotAsked } else { Drawn::gone(FILE_IS_GONE) }
    }
}

/// Reason why a figure is on the page, in the order of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// The manifest declares the figure in a table `[figure.NAME]`.
    Declared,
    /// The figure shows results of a stage against a swept parameter.
    Automatic,
    /// The figure is one of those of every study.
    Paper,
    /// The figure is one of those of every study and has maps only.
    Maps,
}

/// A figure for the page, and as separate files.
#[derive(Debug, Serialize)]
pub struct DrawnFigure {
    /// Name of the files, and anchor on the page.
    pub name: String,
    pub title: String,
    pub group: Group,
    /// Drawings for the page.
    pub drawing: Value,
    #[serde(skip)]
    pub alone: String,
    #[serde(skip)]
    pub png: Vec<u8>,
    #[serde(skip)]
    pub pdf: Vec<u8>,
    pub caption: String,
    /// Maps at further loads, which a reader selects with sliders.
    pub sliders: Vec<Value>,
}

impl DrawnFigure {
    /// Returns the names and contents of the files.
    pub fn files(&self) -> [(String, &[u8]); 3] {
        let contents = [("svg", self.alone.as_bytes()), ("png", &self.png), ("pdf", &self.pdf)];
        contents.map(|(ending, bytes)| (format!("{}.{ending}", self.name), bytes))
    }
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
    use asperity_pipeline::study::claims;

    #[test]
    fn every_figure_is_drawn_by_code_or_declared() {
        for name in shipped::names() {
            let is_coded = CODED.iter().any(|figure| figure.name == name);
            assert_ne!(is_coded, shipped::find(name).is_some(), "{name}");
        }
    }

    #[test]
    fn claims_name_figures_that_are_drawn() {
        for figure in claims::shipped().into_iter().filter_map(|claim| claim.figure) {
            assert!(shipped::names().any(|name| name == figure), "{figure}");
        }
    }
}
