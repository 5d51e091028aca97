//! All figures of a page: surfaces, then contact in the order of the paper. Each file is one figure: what it needs, from
//! which tables, over which axes, with which words.

mod area;
mod asperities;
mod clusters;
mod collapse;
mod contact_maps;
mod contact_pressures;
mod corrections;
mod flow;
mod full_contact;
mod gap;
mod gap_distribution;
mod heights;
mod limits;
mod measured_heights;
mod measured_spectrum;
mod mesh;
mod near_full_contact;
mod pressure;
mod pressure_growth;
mod scales;
mod sealing;
mod slope;
mod spectrum;
mod summits;
mod surfaces;
mod theories;

use super::figure::Definition;

/// Every figure that a study can have.
pub const ALL: [&Definition; 25] = [
    &surfaces::FIGURE,
    &heights::FIGURE,
    &spectrum::FIGURE,
    &scales::FIGURE,
    &area::FIGURE,
    &slope::FIGURE,
    &full_contact::FIGURE,
    &contact_maps::FIGURE,
    &near_full_contact::FIGURE,
    &pressure::FIGURE,
    &gap::FIGURE,
    &corrections::RELATIVE_ERROR,
    &corrections::CORRECTED,
    &collapse::FIGURE,
    &pressure_growth::FIGURE,
    &summits::NAYAK,
    &summits::DENSITY,
    &mesh::FIGURE,
    &contact_pressures::FIGURE,
    &gap_distribution::FIGURE,
    &clusters::FIGURE,
    &sealing::FIGURE,
    &flow::FIGURE,
    &asperities::FIGURE,
    &limits::FIGURE,
];

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
