//! The ellipses on which summits touch, and which of them overlap.

use std::f64::consts::PI;

use super::summits::Summit;
use crate::grid::Grid;

/// Golden sections: 0.618²⁴ is 1e-5.
const SECTIONS: usize = 24;

/// The ellipse on which a summit touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Its centre, in longer sides.
    pub place: [f64; 2],
    /// Major and minor semi-axis.
    pub axes: [f64; 2],
    /// Direction of the major axis, as cosine and sine.
    pub direction: [f64; 2],
    /// Area.
    pub area: f64,
    /// Pressure in the middle: 3/2 of the mean.
    pub peak_pressure: f64,
}

/// The ellipses of summits with a positive overlap.
pub fn contacts(summits: &[Summit], overlaps: &[f64]) -> Vec<Contact> {
    let touching = summits.iter().zip(overlaps);
    let touching = touching.filter(|(_, overlap)| **overlap > 0.0);
    let contact = |(summit, &overlap): (&Summit, &f64)| {
        let area = summit.spread * overlap;
        let major = (area / (PI * summit.axis_ratio)).sqrt();
        let force = summit.stiffness * overlap * overlap.sqrt();
        Contact {
            place: summit.place,
            axes: [major, summit.axis_ratio * major],
            direction: [libm::cos(summit.angle), libm::sin(summit.angle)],
            area,
            peak_pressure: 1.5 * force / area,
        }
    };
    touching.map(contact).collect()
}

impl Contact {
    /// The symmetric matrix with the squares of the semi-axes as eigenvalues: xx, xy, yy.
    fn squares(&self) -> [f64; 3] {
        let [cosine, sine] = self.direction;
        let [major, minor] = self.axes.map(|axis| axis * axis);
        [
            major * cosine * cosine + minor * sine * sine,
            (major - minor) * cosine * sine,
            major * sine * sine + minor * cosine * cosine,
        ]
    }

    /// Whether two ellipses have a point in common, the other one's centre lying `apart` from this one's:
    /// they have none if and only if the contact function of Perram & Wertheim (1985) exceeds one.
    fn overlaps(&self, other: &Contact, apart: [f64; 2]) -> bool {
        let distance = apart[0].hypot(apart[1]);
        if distance > self.axes[0] + other.axes[0] {
            return false;
        }
        if distance <= self.axes[1] + other.axes[1] {
            return true;
        }
        let (one, two) = (self.squares(), other.squares());
        let separation = |share: f64| {
            let mixed: [f64; 3] = std::array::from_fn(|i| (1.0 - share) * one[i] + share * two[i]);
            let [xx, xy, yy] = mixed;
            let [x, y] = apart;
            let form = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
            share * (1.0 - share) * form
        };
        greatest(separation) <= 1.0
    }
}

/// The greatest value of a concave function on [0, 1].
fn greatest(function: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    let inner = |low: f64, high: f64| (high - golden * (high - low), low + golden * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (function(left), function(right));
    for _ in 0..SECTIONS {
        if at_left < at_right {
            low = left;
            (left, at_left) = (right, at_right);
            right = inner(low, high).1;
            at_right = function(right);
        } else {
            high = right;
            (right, at_right) = (left, at_left);
            left = inner(low, high).0;
            at_left = function(left);
        }
    }
    at_left.max(at_right)
}

/// For each contact, whether its ellipse overlaps another, around the cell.
pub fn overlapping(grid: Grid, contacts: &[Contact]) -> Vec<bool> {
    let size = grid.cell().aspect().map(|aspect| 1.0 / aspect);
    let largest = contacts.iter().map(|contact| contact.axes[0]).fold(0.0, f64::max);
    let boxes = Boxes::new(size, 2.0 * largest, contacts);
    let mut overlaps = vec![false; contacts.len()];
    for (one, contact) in contacts.iter().enumerate() {
        for other in boxes.around(contact.place) {
            // Each pair once, and none with itself; what is known of both needs no second look.
            if other <= one || (overlaps[one] && overlaps[other]) {
                continue;
            }
            let apart = [0, 1].map(|axis| {
                let by = contacts[other].place[axis] - contact.place[axis];
                by - size[axis] * (by / size[axis]).round()
            });
            if contact.overlaps(&contacts[other], apart) {
                overlaps[one] = true;
                overlaps[other] = true;
            }
        }
    }
    overlaps
}

/// Contacts by the box in which they lie; whoever may overlap lies in the same box or a neighbour.
struct Boxes {
    size: [f64; 2],
    counts: [usize; 2],
    members: Vec<Vec<usize>>,
}

/// More boxes than this along a side would take longer to look at than contacts do.
const MOST_BOXES: f64 = 256.0;

impl Boxes {
    fn new(size: [f64; 2], least: f64, contacts: &[Contact]) -> Boxes {
        let counts = size.map(|side| (side / least).clamp(1.0, MOST_BOXES) as usize);
        let mut boxes = Boxes { size, counts, members: vec![Vec::new(); counts[0] * counts[1]] };
        for (index, contact) in contacts.iter().enumerate() {
            let [i, j] = boxes.of(contact.place);
            boxes.members[i * counts[1] + j].push(index);
        }
        boxes
    }

    fn of(&self, place: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let turns = (place[axis] / self.size[axis]).rem_euclid(1.0);
            ((turns * self.counts[axis] as f64) as usize).min(self.counts[axis] - 1)
        })
    }

    /// The contacts in the box of a place and those around it, each once.
    fn around(&self, place: [f64; 2]) -> impl Iterator<Item = usize> + '_ {
        let [i, j] = self.of(place);
        let near = |index: usize, count: usize| {
            let mut near: Vec<usize> = [count - 1, 0, 1].map(|by| (index + by) % count).to_vec();
            near.sort_unstable();
            near.dedup();
            near
        };
        let columns = near(j, self.counts[1]);
        let rows = near(i, self.counts[0]).into_iter();
        let boxes = rows.flat_map(move |i| columns.clone().into_iter().map(move |j| (i, j)));
        boxes.flat_map(|(i, j)| self.members[i * self.counts[1] + j].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;

    fn contact(place: [f64; 2], axes: [f64; 2], angle: f64) -> Contact {
        Contact {
            place,
            axes,
            direction: [angle.cos(), angle.sin()],
            area: PI * axes[0] * axes[1],
            peak_pressure: 1.0,
        }
    }

    fn both_overlap(one: Contact, other: Contact) -> bool {
        let found = overlapping(square(8, 1.0), &[one, other]);
        assert_eq!(found[0], found[1]);
        found[0]
    }

    #[test]
    fn circles_overlap_where_their_centres_are_closer_than_their_radii() {
        let circle = |x| contact([x, 0.5], [0.1, 0.1], 0.3);
        assert!(both_overlap(circle(0.2), circle(0.399)));
        assert!(!both_overlap(circle(0.2), circle(0.401)));
        // Around the cell.
        assert!(both_overlap(circle(0.05), circle(0.86)));
    }

    #[test]
    fn ellipses_overlap_by_their_directions() {
        let ellipse = |x, angle| contact([x, 0.5], [0.2, 0.05], angle);
        assert!(both_overlap(ellipse(0.3, 0.0), ellipse(0.69, 0.0)));
        assert!(!both_overlap(ellipse(0.3, 0.0), ellipse(0.71, 0.0)));
        // Side by side their minor axes count, across each other one of each.
        let across = 0.5 * PI;
        assert!(both_overlap(ellipse(0.3, across), ellipse(0.399, across)));
        assert!(!both_overlap(ellipse(0.3, across), ellipse(0.401, across)));
        assert!(both_overlap(ellipse(0.3, 0.0), ellipse(0.549, across)));
        assert!(!both_overlap(ellipse(0.3, 0.0), ellipse(0.551, across)));
    }
}
