//! Flags of nodes, and groups of active nodes.
//!
//! The last step of each node is kept from iteration to iteration. It only guides the iterations,
//! so its two or three lowest bits can hold flags. A separate map of flags would have to be read
//! and written in every pass.
//!
//! [`ActiveGroups`] are the groups of sixteen neighbours in a row ([`Lanes`]) that take part in the
//! iterations. The nodes at the end of a row that do not fill a group are always visited. Contact
//! consists of patches: under a light load, most of the mesh has no free node and no pressure
//! changes there. Skipping these groups saves most of the memory traffic of a pass over a large
//! mesh.

use pulp::Simd;

use super::lanes::{LANES, Lanes, Mask, Shared};
use crate::fft::{Band, Row};

/// Flag of free nodes, whose pressure may change in the present iteration.
pub const FREE: u32 = 1;

/// Flag of nodes that have pressure.
pub const PRESSED: u32 = 2;

/// Flag of nodes with pressure equal to the hardness; these nodes also have the flag [`PRESSED`].
/// Without a hardness the bit belongs to the number.
pub const SATURATED: u32 = 4;

const MARKS: u32 = FREE | PRESSED;

const ALL_MARKS: u32 = MARKS | SATURATED;

#[inline(always)]
pub fn mark<S: Simd, const R: usize>(
    last_step: Lanes<S, R>,
    free: Mask<S, R>,
    pressed: Mask<S, R>,
) -> Lanes<S, R> {
    last_step.with(MARKS, [(FREE, free), (PRESSED, pressed)])
}

/// Sets the flags [`FREE`], [`PRESSED`] and [`SATURATED`], and clears them where a mask is false.
#[inline(always)]
pub fn mark_yielding<S: Simd, const R: usize>(
    last_step: Lanes<S, R>,
    free: Mask<S, R>,
    pressed: Mask<S, R>,
    saturated: Mask<S, R>,
) -> Lanes<S, R> {
    let marks = [(FREE, free), (PRESSED, pressed), (SATURATED, saturated)];
    last_step.with(ALL_MARKS, marks)
}

#[inline(always)]
pub fn has(last_step: f32, mark: u32) -> bool {
    last_step.to_bits() & mark != 0
}

/// Returns `last_step` with the flags [`PRESSED`] and [`SATURATED`] that `pressure` requires, and
/// with its flag [`FREE`].
#[inline(always)]
pub fn marked_by_pressure(last_step: f32, pressure: f64, hardness: f64) -> f32 {
    let pressed = PRESSED * u32::from(pressure > 0.0);
    let saturated = SATURATED * u32::from(pressure >= hardness);
    f32::from_bits((last_step.to_bits() & !(PRESSED | SATURATED)) | pressed | saturated)
}

/// Marks of the nodes at the end of a row that do not fill a group. All are true, because these
/// nodes are always visited.
pub const ALL: [bool; LANES] = [true; LANES];

/// Two marks of each group of [`LANES`] nodes in a row: whether it is active (a node is free or has
/// pressure), and whether it contains a free node.
///
/// Inactive groups have zero pressures and zero last steps. In active groups without a free node,
/// every pressure is zero or the hardness.
pub struct ActiveGroups {
    row_groups: usize,
    active: Vec<bool>,
    free: Vec<bool>,
    /// True if all groups are always active. This is so for small tolerances, for which the
    /// reference pressure is not zero outside contact.
    pub always: bool,
}

impl ActiveGroups {
    pub fn new([rows, row_nodes]: [usize; 2]) -> Self {
        let row_groups = row_nodes / LANES;
        Self {
            row_groups,
            active: vec![true; rows * row_groups],
            free: vec![true; rows * row_groups],
            always: false,
        }
    }

    #[inline(always)]
    pub fn row(&self, row: Row) -> &[bool] {
        Row::new(row.index, self.row_groups).of(&self.active)
    }

    #[inline(always)]
    pub fn free_row(&self, row: Row) -> &[bool] {
        Row::new(row.index, self.row_groups).of(&self.free)
    }

    pub fn band(&mut self) -> ActiveBand<'_> {
        ActiveBand {
            row_groups: self.row_groups,
            active: Band::new(&mut self.active),
            free: Band::new(&mut self.free),
            always: self.always,
        }
    }
}

/// Mutable access to the marks of groups in consecutive rows.
pub struct ActiveBand<'a> {
    row_groups: usize,
    active: Band<'a, bool>,
    free: Band<'a, bool>,
    pub always: bool,
}

pub struct GroupsOfRow<'r> {
    pub active: &'r mut [bool],
    pub free: &'r mut [bool],
}

impl ActiveBand<'_> {
    #[inline(always)]
    pub fn row(&mut self, row: Row) -> GroupsOfRow<'_> {
        let row = Row::new(row.index, self.row_groups);
        GroupsOfRow { active: self.active.row(row), free: self.free.row(row) }
    }
}

impl Shared for ActiveBand<'_> {
    fn split_off(&mut self, row: Row) -> Self {
        let row = Row::new(row.index, self.row_groups);
        Self { active: self.active.split_off(row), free: self.free.split_off(row), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(last_step: f32, free: bool, pressed: bool) -> f32 {
        let marks = (FREE * u32::from(free)) | (PRESSED * u32::from(pressed));
        f32::from_bits((last_step.to_bits() & !MARKS) | marks)
    }

    #[test]
    fn marks_hardly_change_the_number_that_bears_them() {
        for number in [0.0_f32, 1.0, -3.7e-5, 2.5e20] {
            for (free, pressed) in [(false, false), (false, true), (true, false), (true, true)] {
                let bearer = marked(number, free, pressed);
                assert_eq!((has(bearer, FREE), has(bearer, PRESSED)), (free, pressed));
                assert!((bearer - number).abs() <= 4e-7 * number.abs() + f32::MIN_POSITIVE);
            }
        }
    }

    #[test]
    fn marks_of_a_pressure_leave_whether_the_node_is_free() {
        for free in [false, true] {
            for (pressure, pressed, saturated) in
                [(0.0, false, false), (0.3, true, false), (0.5, true, true)]
            {
                let bearer = marked_by_pressure(marked(-2.5, free, true), pressure, 0.5);
                let found = [FREE, PRESSED, SATURATED].map(|mark| has(bearer, mark));
                assert_eq!(found, [free, pressed, saturated]);
                assert!((bearer + 2.5).abs() <= 1e-6 * 2.5);
            }
        }
    }
}
