//! The pressures of Hertz' contacts on a mesh.

use super::overlaps::Contact;
use crate::grid::Grid;

/// Writes the pressure of every node: p √(1 − s²) within an ellipse, the sum where several overlap. A
/// contact smaller than a mesh step may have no node.
pub fn draw(grid: Grid, contacts: &[Contact], pressure: &mut [f64]) {
    pressure.fill(0.0);
    let [nodes_x, nodes_y] = grid.nodes();
    let steps = super::steps(grid);
    for contact in contacts {
        let [major, minor] = contact.axes;
        let [cosine, sine] = contact.direction;
        let half = [(major * cosine).hypot(minor * sine), (major * sine).hypot(minor * cosine)];
        let range = |axis: usize| {
            let low = ((contact.place[axis] - half[axis]) / steps[axis]).ceil() as isize;
            let high = ((contact.place[axis] + half[axis]) / steps[axis]).floor() as isize;
            low..=high
        };
        for i in range(0) {
            for j in range(1) {
                let x = i as f64 * steps[0] - contact.place[0];
                let y = j as f64 * steps[1] - contact.place[1];
                let along = (cosine * x + sine * y) / major;
                let across = (cosine * y - sine * x) / minor;
                let inside = 1.0 - along * along - across * across;
                if inside > 0.0 {
                    let [i, j] = [(i, nodes_x), (j, nodes_y)]
                        .map(|(index, nodes)| index.rem_euclid(nodes as isize) as usize);
                    pressure[i * nodes_y + j] += contact.peak_pressure * inside.sqrt();
                }
            }
        }
    }
}
