//! Which shift of pressures within bounds changes their sum by as much as it should.

/// Shifts and sums are found to so much of the largest change, as far as single precision knows them, or in
/// so many steps.
const PRECISION: f64 = 1e-6;
const ROUNDING: f64 = 1e-7;
const STEPS: usize = 40;

/// Nodes whose pressures may change.
#[derive(Default)]
pub struct Nodes {
    pressure: Vec<f32>,
    /// What their pressure is to change by, but for a shift common to all.
    change: Vec<f32>,
}

impl Nodes {
    pub fn clear(&mut self) {
        self.pressure.clear();
        self.change.clear();
    }

    pub fn len(&self) -> usize {
        self.pressure.len()
    }

    /// Makes the changes `step` times as large, after `share` of other ones were added.
    pub fn follow(&mut self, step: f32, share: f32, others: &[f32]) {
        for (change, other) in self.change.iter_mut().zip(others) {
            *change = step * (*change + share * other);
        }
    }

    /// Adds those that were gathered later.
    pub fn append(&mut self, mut later: Self) {
        self.pressure.append(&mut later.pressure);
        self.change.append(&mut later.change);
    }

    /// Adds the first of these, with what each is to change by. Copies of one size take a register.
    #[inline(always)]
    pub fn extend<const N: usize>(
        &mut self,
        pressures: &[f32; N],
        changes: &[f32; N],
        first: usize,
    ) {
        let nodes = self.len() + first;
        self.pressure.extend_from_slice(pressures);
        self.change.extend_from_slice(changes);
        self.pressure.truncate(nodes);
        self.change.truncate(nodes);
    }

    #[inline(always)]
    pub fn push(&mut self, pressure: f32, change: f32) {
        self.pressure.push(pressure);
        self.change.push(change);
    }

    /// The shift of all changes with which pressures, kept between zero and `ceiling`, come to
    /// `lacked` more than they do. Of several such shifts, any; none without nodes, or if even
    /// all at their bounds do not.
    pub fn shift(&self, lacked: f64, ceiling: f32) -> Option<f64> {
        let count = self.len() as f64;
        let before: f64 = self.total(|pressure, _| pressure.clamp(0.0, ceiling));
        let wanted = before + lacked;
        if !(wanted >= 0.0 && wanted <= count * f64::from(ceiling) && count > 0.0) {
            return None;
        }
        let (mut low, mut high) = self.range(ceiling);
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        let largest = self.largest_change() + lacked.abs() / count;
        let close = PRECISION * largest.min(f64::from(ceiling));
        let balanced = close + ROUNDING / PRECISION * close * count;
        let mut shift = 0.0_f64.clamp(low, high);
        for _ in 0..STEPS {
            let by = shift as f32;
            let after = |pressure: f32, change: f32| pressure + (change + by);
            // What is not clipped counts to its last digit, though pressures are much larger.
            let gained = self.total(|p, change| {
                let beyond = p - p.clamp(0.0, ceiling);
                (change + by).clamp(-p, ceiling - p) + beyond
            });
            let inside = self.total(|p, change| {
                let after = after(p, change);
                f32::from(u8::from(after > 0.0 && after < ceiling))
            });
            let missing = lacked - gained;
            *(if missing > 0.0 { &mut low } else { &mut high }) = shift;
            let step = missing / inside;
            if missing.abs() <= balanced || step.abs() <= close || high - low <= close {
                return Some(shift);
            }
            let next = shift + step;
            shift = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        Some(shift)
    }

    fn largest_change(&self) -> f64 {
        let larger = |largest: f32, change: &f32| largest.max(change.abs());
        f64::from(self.change.iter().fold(0.0, larger))
    }

    /// Shifts with which all nodes are at one bound or the other.
    fn range(&self, ceiling: f32) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (pressure, change) in self.pressure.iter().zip(&self.change) {
            let after = pressure + change;
            (low, high) = (low.min(after), high.max(after));
        }
        (-f64::from(high), f64::from(ceiling) - f64::from(low))
    }

    /// Σ term(pressure, change), in chunks that single precision bears.
    fn total(&self, term: impl Fn(f32, f32) -> f32) -> f64 {
        const CHUNK: usize = 256;
        let chunks = self.pressure.chunks(CHUNK).zip(self.change.chunks(CHUNK));
        let sums = chunks.map(|(pressure, change)| {
            let mut partial = [0.0_f32; 16];
            let (pressures, rest) = pressure.as_chunks::<16>();
            let (changes, changes_rest) = change.as_chunks::<16>();
            for (pressure, change) in pressures.iter().zip(changes) {
                for lane in 0..16 {
                    partial[lane] += term(pressure[lane], change[lane]);
                }
            }
            for (lane, (pressure, change)) in rest.iter().zip(changes_rest).enumerate() {
                partial[lane] += term(*pressure, *change);
            }
            partial.into_iter().map(f64::from).sum::<f64>()
        });
        sums.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(nodes: &[(f32, f32)]) -> Nodes {
        let mut all = Nodes::default();
        for (pressure, change) in nodes {
            all.push(*pressure, *change);
        }
        all
    }

    #[test]
    fn between_their_bounds_nodes_share_equally() {
        let all = nodes(&[(1.0, 0.5), (2.0, -0.25), (3.0, 0.0), (4.0, 0.0)]);
        assert!((all.shift(0.0, 10.0).unwrap() + 0.0625).abs() < 1e-6);
        assert!((all.shift(1.0, 10.0).unwrap() - 0.1875).abs() < 1e-6);
    }

    #[test]
    fn nodes_at_their_bounds_leave_it_to_the_others() {
        // The first falls to zero, which takes away one; the last would pass the ceiling.
        let all = nodes(&[(1.0, -3.0), (2.0, 0.0), (3.0, 0.0), (4.0, 7.0)]);
        assert!((all.shift(0.0, 4.0).unwrap() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn nodes_that_jump_from_bound_to_bound_are_chosen_by_how_much_they_want_to() {
        // Two of three that want to rise may, for two fall.
        let all = nodes(&[(0.0, 900.0), (0.0, 800.0), (0.0, 700.0), (1.0, -800.0), (1.0, -900.0)]);
        let shift = all.shift(0.0, 1.0).unwrap();
        assert!((-800.0..=-699.0).contains(&shift), "{shift}");
    }

    #[test]
    fn what_no_shift_does_is_said() {
        assert_eq!(Nodes::default().shift(0.0, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(0.6, 1.0), None);
        assert_eq!(nodes(&[(0.5, 0.0)]).shift(-0.6, 1.0), None);
    }
}
