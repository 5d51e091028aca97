//! What captions say of a study beside its data: what its meshes add, which surfaces are not what
//! theories assume, in which unit its lengths are.

use super::ensembles::{self, Mean};
use super::figure_data::{COUNTED_AREA, FigureData, LIGHT};
use super::units::LengthUnit;
use asperity_contact::grid::Grid;
use asperity_contact::morphology::area::YASTREBOV_2017;
use asperity_stages::columns::PERIMETER_MANHATTAN;
use asperity_tables::table::TableError;

impl FigureData<'_> {
    /// The unit of length that the measured contacts share.
    pub fn unit_of_length(&self) -> LengthUnit {
        let points = self.measured.iter().map(|one| &one.point);
        LengthUnit::common(points.map(|point| self.units.at(point)))
    }

    /// What the mesh adds to the counted areas, as the correction of 2017 estimates it from their
    /// edges: a sentence, empty where nothing is counted.
    ///
    /// # Errors
    /// When a table lacks a column of its stage.
    pub fn share_of_mesh(&self) -> Result<String, TableError> {
        let mut shares = Vec::new();
        for ensemble in &self.measured {
            let (areas, perimeters) =
                (ensemble.mean(COUNTED_AREA)?, ensemble.mean(PERIMETER_MANHATTAN.name)?);
            let pairs = areas.iter().zip(&perimeters);
            let distance = |mean: &Mean| (mean.load / LIGHT).ln().abs();
            let nearest = pairs.min_by(|one, other| distance(one.0).total_cmp(&distance(other.0)));
            let grid = ensembles::grid(&ensemble.point).filter(Grid::has_square_cells);
            if let (Some((area, perimeter)), Some(grid)) = (nearest, grid) {
                // S_d Δx/(L_x L_y).
                let edge = perimeter.mean / (grid.cell().size()[0] * grid.nodes()[1] as f64);
                shares.push(100.0 * YASTREBOV_2017 * edge / area.mean);
            }
        }
        let ends = [f64::min, f64::max].map(|end| shares.iter().copied().reduce(end));
        let [Some(least), Some(most)] = ends.map(|end| end.map(|end| format!("{end:.1}"))) else {
            return Ok(String::new());
        };
        let range = match least == most {
            true => least,
            false => format!("{least} to {most}"),
        };
        Ok(format!(
            "By the correction of 2017, the mesh adds {range} % to the counted area under the \
             load nearest to {LIGHT}."
        ))
    }
}
