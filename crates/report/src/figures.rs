//! All figures of a page: those that the study declares, automatic ones, then figures of surfaces
//! and figures of contact in the order of the paper.
//!
//! Each figure is a [`Definition`] with a function that draws the figure from the tables of a
//! study.

mod adhesion_maps;
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

use serde::Serialize;

use crate::ReportError;
use crate::charts::Figure;
use crate::charts::interactive::PageFigure;
use crate::figure_data::FigureData;
use crate::figures::contact_maps::LoadSlider;
use crate::finished::FinishedStages;
use crate::samples::{FILE_IS_GONE, MeasuredMaps};
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
    &adhesion_maps::MAPS,
    &errors::ERRORS,
];

pub use shipped::{missing, names};

/// A figure that a page may have.
pub enum Planned<'a> {
    Declared(&'a FigureSpec),
    Automatic(Box<FigureSpec>),
    Coded(&'static Definition),
    Shipped(&'static WrittenFigure),
}

impl Planned<'_> {
    /// Lists the figures of a study in the order of the page: those that it declares, automatic
    /// ones, and all others. A declared figure takes the place of another one with its name.
    pub fn all<'a>(study: &'a Study, finished: &FinishedStages) -> Vec<Planned<'a>> {
        let declared = study.figures.iter().map(Planned::Declared);
        let automatic = automatic::figures(study, finished)
            .into_iter()
            .map(|figure| Planned::Automatic(Box::new(figure)));
        // Some file systems do not distinguish case.
        let is_declared =
            |name: &&str| study.figures.iter().any(|figure| figure.name.to_lowercase() == **name);
        let paper = shipped::names().filter(|name| !is_declared(name)).filter_map(|name| {
            let coded = CODED.into_iter().find(|figure| figure.name == name);
            coded.map(Planned::Coded).or_else(|| shipped::find(name).map(Planned::Shipped))
        });
        declared.chain(automatic).chain(paper).collect()
    }

    pub fn name(&self) -> &str {
        match self {
            Planned::Declared(figure) => &figure.name,
            Planned::Automatic(figure) => &figure.name,
            Planned::Coded(definition) => definition.name,
            Planned::Shipped(figure) => &figure.name.value,
        }
    }

    pub fn title(&self) -> String {
        match self {
            Planned::Declared(figure) => declared::title(figure),
            Planned::Automatic(figure) => declared::title(figure),
            Planned::Coded(definition) => definition.title.to_owned(),
            Planned::Shipped(figure) => shipped::title(figure),
        }
    }

    pub fn group(&self) -> Group {
        match self {
            Planned::Declared(_) => Group::Declared,
            Planned::Automatic(_) => Group::Automatic,
            Planned::Coded(_) | Planned::Shipped(_) => Group::Paper,
        }
    }

    pub fn draw(&self, data: &FigureData) -> Result<Drawn, ReportError> {
        let drawn = match self {
            Planned::Declared(figure) => return declared::draw(data, figure),
            // Nobody waits for an automatic figure that cannot be drawn.
            Planned::Automatic(figure) => {
                return Ok(match declared::draw(data, figure)? {
                    Drawn::Missing { .. } => Drawn::NotAsked,
                    drawn => drawn,
                });
            }
            Planned::Coded(definition) => (definition.draw)(data)?,
            Planned::Shipped(figure) => shipped::draw(data, figure)?,
        };
        Ok(match drawn {
            Drawn::NotAsked => missing(data, self.name()),
            drawn => drawn,
        })
    }
}

/// Returns the names of the files of figures. An automatic figure whose name another figure has
/// gets a number; some file systems do not distinguish case.
pub fn file_stems(figures: &[Planned]) -> Vec<String> {
    let is_automatic = |figure: &&Planned| figure.group() == Group::Automatic;
    let others = figures.iter().filter(|figure| !is_automatic(figure));
    let mut taken: BTreeSet<String> = others.map(|figure| figure.name().to_lowercase()).collect();
    let stem = |figure: &Planned| {
        let name = figure.name();
        if !is_automatic(&figure) {
            return name.to_owned();
        }
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut names = std::iter::once(name.to_owned()).chain(numbered);
        names.find(|name| taken.insert(name.to_lowercase())).expect("there are always more numbers")
    };
    figures.iter().map(stem).collect()
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
        sliders: Vec<LoadSlider>,
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

    pub fn with_sliders(mut self, below: Vec<LoadSlider>) -> Drawn {
        if let Drawn::Figure { sliders, .. } = &mut self {
            *sliders = below;
        }
        self
    }

    /// Creates a missing figure of a study that has lost the data.
    pub fn gone(needs: &'static str) -> Drawn {
        Drawn::Missing { needs: needs.into(), lines: None }
    }

    /// Creates a missing figure of surfaces, which is lost if the file of a measured surface is.
    pub fn missing_surfaces(data: &FigureData) -> Drawn {
        match data.maps {
            MeasuredMaps::Gone => Drawn::gone(FILE_IS_GONE),
            MeasuredMaps::There(_) => Drawn::NotAsked,
        }
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
    pub drawing: PageFigure,
    #[serde(skip)]
    pub alone: String,
    #[serde(skip)]
    pub png: Vec<u8>,
    #[serde(skip)]
    pub pdf: Vec<u8>,
    pub caption: String,
    /// Maps at further loads, which a reader selects with sliders.
    pub sliders: Vec<LoadSlider>,
}

impl DrawnFigure {
    /// Returns the names and contents of the files.
    pub fn files(&self) -> [(String, &[u8]); 3] {
        let contents = [self.alone.as_bytes(), &self.png, &self.pdf];
        std::array::from_fn(|index| (file_names(&self.name)[index].clone(), contents[index]))
    }
}

/// Returns the names of the files of a figure.
pub fn file_names(figure: &str) -> [String; 3] {
    ["svg", "png", "pdf"].map(|ending| format!("{figure}.{ending}"))
}

/// A figure for which the study has no data or has lost the data.
#[derive(Debug, Serialize)]
pub struct MissingFigure {
    /// Name of the files that the figure would have.
    pub name: String,
    pub title: String,
    pub group: Group,
    pub needs: Cow<'static, str>,
    /// Lines of a manifest that would add the data; `None` if the data are lost.
    pub lines: Option<String>,
}

impl MissingFigure {
    /// Returns true if the data of a figure of the paper are lost.
    pub fn is_lost(&self) -> bool {
        self.group == Group::Paper && self.lines.is_none()
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
