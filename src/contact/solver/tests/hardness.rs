//! Materials that yield: against independent code, in the limits of hard and soft, and for any
//! surface.

use proptest::prelude::*;

use super::reference::HARDNESS as REFERENCE;
use super::*;
use crate::contact::elasticity::FreeHalfSpace;
use crate::contact::grid::samples::rectangle;
use crate::contact::morphology::area::ContactArea;
use crate::contact::morphology::clusters::Clusters;
use crate::contact::morphology::map::ContactMap;
use crate::contact::topography::moments::Moments;

fn yielding(nodes: usize, hardness: f64, heights: &[f64]) -> Solver {
    let body = PeriodicHalfSpace::new(square(nodes, 1.0));
    Solver::yielding(body, Some(Hardness::new(hardness).unwrap()), heights)
}

fn saturated(solver: &Solver, hardness: f64) -> Vec<bool> {
    solver.pressure().iter().map(|p| *p == hardness).collect()
}

#[test]
fn saturated_and_elastic_contact_is_as_independent_code_has_it() {
    for name in ["h128_hard03", "h128_hard08"] {
        let surface = REFERENCE.heights(name, [1.0; 2]);
        let grid = surface.grid();
        let slope = Moments::of(&surface).rms_slope();
        assert!((slope - 0.02).abs() < 1e-14);
        let reduced: Vec<f64> = surface.heights().iter().map(|h| h / slope).collect();
        let rows = REFERENCE.solved(name);
        let hardness = rows[0].number(3) / slope;
        let mut solver = yielding(128, hardness, &reduced);
        let maps = REFERENCE.maps(name, "maps", grid);
        for (row, maps) in rows.iter().zip(maps.chunks(2)) {
            let load = row.number(4);
            let settings = Settings {
                tolerance: 1e-8,
                ..Settings::default()
            };
            let outcome = press(&mut solver, load, &settings);
            assert_eq!(outcome.stop, Stop::Converged, "{name} at {load}");
            let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
            assert!(touches == maps[0], "{name} at {load}");
            assert!(saturated(&solver, hardness) == maps[1], "{name} at {load}");
            assert_eq!(outcome.contact_nodes, row.count(6));
            assert_eq!(outcome.saturated_nodes, row.count(7));
            assert_eq!(outcome.peak_pressure, hardness);
            let contact = ContactMap::of_pressures(grid.nodes(), solver.pressure());
            let area = ContactArea::of(&contact);
            assert_eq!(area.switches_along_columns, row.count(8));
            assert_eq!(area.switches_along_rows, row.count(9));
            assert_eq!(Clusters::of_contact(&contact).count, row.count(10));
            let cells = grid.count() as f64;
            let open = cells - row.number(6);
            let gap = row.number(11) * open / cells;
            assert!((outcome.mean_gap * slope / gap - 1.0).abs() < 1e-6);
            let depth = row.number(12) * row.number(7) / cells;
            assert!((outcome.yielded_depth * slope / depth - 1.0).abs() < 1e-6);
        }
    }
}
