//! Partial slip of pressed bodies under a tangential load.
//!
//! Two elastically similar bodies are pressed by the normal load N and then loaded tangentially by
//! Q, below the friction f N. A part of the contact sticks, and the rest slips. Ciavarella
//! (*J. Mech. Phys. Solids* 46, 1998, 1) and Jäger (*Arch. Appl. Mech.* 68, 1998, 419) found that
//! the tangential traction is a difference of solved normal contacts,
//!
//! ```text
//! t = f [p(N) − p(N − Q/f)],
//! ```
//!
//! and that the stick area is the contact area under the load N − Q/f. When the tangential load
//! turns at Q*, the traction changes by −2f [p(N) − p(N − (Q* − Q)/(2f))]. Nothing is solved again:
//! all follows from the normal contact under a few loads, here written as shares of N.
//!
//! The tangential displacement is that of the same differences of approaches, times
//! (2 − ν)/(2(1 − ν)). This neglects the traction across the direction of Q, which exists if ν is
//! not zero. At ν = 0.3 the error of Q is about 2 % at the same displacement.

/// A part of the tangential traction: `weight` × f [p(N) − p(`share` × N)].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// ±1 for the first loading, ±2 after a turn.
    pub weight: f64,
    /// Normal load of the subtracted contact, relative to N.
    pub share: f64,
}

/// Energy that friction has dissipated: `times` × [`dissipated`] with the normal loads N and
/// `share` × N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Number of first loadings that dissipate as much as this part of the path: 1 for the first
    /// loading, 2 for a branch after a turn, 4 for a closed loop.
    pub times: f64,
    /// Normal load relative to N.
    pub share: f64,
}

/// A state on a path of tangential loads.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Tangential load Q/(f N).
    pub load: f64,
    /// Terms of the traction. There are none without a tangential load.
    pub terms: Vec<Term>,
    /// Losses along the path up to this state.
    pub losses: Vec<Loss>,
}

impl State {
    /// Returns the normal load under which the contact area is the stick area, relative to N.
    pub fn stick_share(&self) -> f64 {
        self.terms.last().map_or(1.0, |term| term.share)
    }

    /// Returns the normal loads that the state needs besides N, relative to N.
    pub fn shares(&self) -> impl Iterator<Item = f64> {
        let of_losses = self.losses.iter().map(|loss| loss.share);
        self.terms.iter().map(|term| term.share).chain(of_losses)
    }
}

/// Returns the states along a path of tangential loads Q/(f N), which starts without a tangential
/// load.
///
/// A contact remembers the loads at which the path turned. When a later branch passes the load at
/// which an earlier one started, the loop between them is closed and forgotten.
///
/// # Panics
/// If a load is not between −1 and 1, where the whole contact slips.
pub fn states(path: &[f64]) -> Vec<State> {
    let mut memory = Memory::default();
    path.iter().map(|&load| memory.go_to(load)).collect()
}

/// Loads that a contact remembers.
#[derive(Debug, Default)]
struct Memory {
    /// Loads at which the path turned, the oldest first, and the present load.
    turns: Vec<f64>,
    /// Losses in closed loops.
    closed: Vec<Loss>,
}

impl Memory {
    fn go_to(&mut self, load: f64) -> State {
        assert!(load.abs() < 1.0, "the tangential load is below the friction");
        self.leave_for(load);
        self.close_loops(load);
        self.turns.push(load);
        let branches = self.branches();
        let closed = self.closed.iter().copied();
        State {
            load,
            terms: branches.iter().map(|branch| branch.term()).collect(),
            losses: branches.iter().map(|branch| branch.loss()).chain(closed).collect(),
        }
    }

    /// Removes the present load, unless the path turns there.
    fn leave_for(&mut self, load: f64) {
        let Some(&present) = self.turns.last() else { return };
        let before = self.turns.len().checked_sub(2).map_or(0.0, |index| self.turns[index]);
        if (load - present) * (present - before) >= 0.0 {
            self.turns.pop();
        }
    }

    /// Forgets the loops that the branch to `load` closes.
    fn close_loops(&mut self, load: f64) {
        while let [.., from, turn] = self.turns[..] {
            if (load - turn).abs() < (from - turn).abs() {
                return;
            }
            let amplitude = 0.5 * (from - turn).abs();
            self.closed.push(Loss { times: 4.0, share: 1.0 - amplitude });
            self.turns.truncate(self.turns.len() - 2);
        }
        if let [turn] = self.turns[..]
            && load.abs() >= turn.abs()
            && load * turn <= 0.0
        {
            // The branch from the first turn meets the first loading in the other direction.
            self.closed.push(Loss { times: 2.0, share: 1.0 - turn.abs() });
            self.turns.clear();
        }
    }

    fn branches(&self) -> Vec<Branch> {
        let starts = [0.0].into_iter().chain(self.turns.iter().copied());
        let branches = starts.zip(&self.turns).enumerate();
        branches
            .map(|(index, (from, &to))| Branch { from, to, is_first: index == 0 })
            .filter(|branch| branch.from != branch.to)
            .collect()
    }
}

/// A part of the path between two remembered loads.
struct Branch {
    from: f64,
    to: f64,
    is_first: bool,
}

impl Branch {
    /// Returns how many times longer the branch is than a first loading of the same shape.
    fn stretch(&self) -> f64 {
        if self.is_first { 1.0 } else { 2.0 }
    }

    fn share(&self) -> f64 {
        1.0 - (self.to - self.from).abs() / self.stretch()
    }

    fn term(&self) -> Term {
        Term { weight: self.stretch() * (self.to - self.from).signum(), share: self.share() }
    }

    fn loss(&self) -> Loss {
        Loss { times: self.stretch(), share: self.share() }
    }
}

/// Normal contact under one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalContact {
    /// Load N.
    pub load: f64,
    /// Approach of the bodies.
    pub approach: f64,
    /// Elastic energy, in the unit of the load times that of the approach.
    pub energy: f64,
}

/// Returns the energy that friction dissipates on the first loading of the contact `full`, up to
/// the tangential load whose stick area is the contact area of `stick`.
///
/// It is f² `ratio` [(N + N₁)(δ − δ₁) − 2 (U − U₁)] with the load N, the approach δ and the elastic
/// energy U. This is the work ∫Q du minus the elastic energy ½⟨t u⟩ of the tractions t. The work
/// follows from dU = N dδ. The elastic energy is less than Q u/2, because the slip zone has moved
/// less than the bodies. The result equals ⟨p g₁⟩ f² `ratio` with the gap g₁ under the load N₁.
/// `ratio` is [`compliance_ratio`].
pub fn dissipated(full: NormalContact, stick: NormalContact, friction: f64, ratio: f64) -> f64 {
    let trapezoid = 0.5 * (full.load + stick.load) * (full.approach - stick.approach);
    2.0 * friction * friction * ratio * (trapezoid - (full.energy - stick.energy))
}

/// Returns the ratio (2 − ν)/(2(1 − ν)) of the tangential to the normal compliance of a half-space.
pub fn compliance_ratio(poisson_ratio: f64) -> f64 {
    (2.0 - poisson_ratio) / (2.0 * (1.0 - poisson_ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Settings;
    use crate::solver::tests::{rough, solver};

    /// Returns the contact of a sphere with E* = R = 1, whose load is δ^(3/2) × 4/3.
    fn sphere(load: f64) -> NormalContact {
        let approach = (0.75 * load).powf(2.0 / 3.0);
        NormalContact { load, approach, energy: 0.4 * load * approach }
    }

    fn displacement(state: &State, load: f64) -> f64 {
        let approach = |load| sphere(load).approach;
        let terms = state.terms.iter();
        terms.map(|term| term.weight * (approach(load) - approach(term.share * load))).sum()
    }

    fn lost(state: &State) -> f64 {
        let losses = state.losses.iter();
        losses.map(|loss| loss.times * dissipated(sphere(1.0), sphere(loss.share), 1.0, 1.0)).sum()
    }

    #[test]
    fn the_first_loading_of_a_sphere_is_that_of_cattaneo_and_mindlin() {
        let state = &states(&[0.3])[0];
        assert_eq!(state.terms, [Term { weight: 1.0, share: 0.7 }]);
        // u/u_max = 1 − (1 − Q/fN)^(2/3)
        let expected = sphere(1.0).approach * (1.0 - 0.7_f64.powf(2.0 / 3.0));
        assert!((displacement(state, 1.0) - expected).abs() < 1e-15);
    }

    #[test]
    fn unloading_after_a_turn_is_twice_the_first_loading() {
        let states = states(&[0.6, 0.2]);
        let expected = [Term { weight: 1.0, share: 0.4 }, Term { weight: -2.0, share: 0.8 }];
        let [first, second] = expected;
        assert_eq!(states[1].terms[0], first);
        assert!((states[1].terms[1].share - second.share).abs() < 1e-15);
        assert_eq!(states[1].stick_share(), states[1].terms[1].share);
    }

    #[test]
    fn a_cycle_of_a_sphere_dissipates_what_mindlin_and_deresiewicz_found() {
        for amplitude in [0.1_f64, 0.5, 0.9] {
            let path = [amplitude, -amplitude, amplitude, -amplitude, amplitude];
            let states = states(&path);
            let cycle = lost(&states[4]) - lost(&states[2]);
            let rest = 1.0 - amplitude;
            let braces =
                1.0 - rest.powf(5.0 / 3.0) - 5.0 * amplitude / 6.0 * (1.0 + rest.powf(2.0 / 3.0));
            let expected = 4.8 * sphere(1.0).approach * braces;
            assert!((cycle - expected).abs() < 1e-12, "{amplitude}: {cycle} {expected}");
            // The first loading slips half as far as each half of the cycle, under the same
            // tractions.
            let first = lost(&states[0]);
            assert!((4.0 * first - expected).abs() < 1e-12, "{amplitude}: {first} {expected}");
        }
    }

    #[test]
    fn a_closed_loop_returns_to_the_curve_that_it_left() {
        let with_loop = states(&[0.5, 0.2, 0.4, 0.2, 0.5, 0.7]);
        let direct = states(&[0.7]);
        assert_eq!(with_loop[5].terms, direct[0].terms);
        assert_eq!(with_loop[3].terms, with_loop[1].terms);
        let through_zero = states(&[0.5, -0.5, -0.8]);
        assert_eq!(through_zero[2].terms, states(&[-0.8])[0].terms);
        let lost_on_the_way = states(&[0.5, -0.5]);
        // The first loading and the reversal, which dissipates twice as much.
        let first = dissipated(sphere(1.0), sphere(0.5), 1.0, 1.0);
        assert!((lost(&lost_on_the_way[1]) - 3.0 * first).abs() < 1e-15);
    }

    #[test]
    fn the_first_loading_dissipates_the_friction_times_the_slip() {
        // A point of the slip zone slips under the traction f p, by f `ratio` times its gap under
        // the load of the stick area.
        let heights = rough(32, 5);
        let mut solver = solver(32, &heights);
        let settings = Settings { tolerance: 1e-12, pair_limit: 4000 };
        let (friction, ratio) = (0.3, compliance_ratio(0.25));
        let mut press = |load: f64| {
            let outcome = solver.press(load, &settings, &|| false);
            let contact =
                NormalContact { load, approach: -outcome.mean_gap, energy: outcome.energy };
            let pressure = solver.pressure().to_vec();
            let gap = solver.gap_under(&pressure);
            (contact, pressure, gap)
        };
        let (full, pressure, _) = press(0.2);
        for share in [0.9, 0.5, 0.1] {
            let (stick, _, gap) = press(share * 0.2);
            let slipped: f64 = pressure.iter().zip(&gap).map(|(p, gap)| p * gap).sum();
            let expected = friction * friction * ratio * slipped / pressure.len() as f64;
            let found = dissipated(full, stick, friction, ratio);
            assert!((found / expected - 1.0).abs() < 1e-8, "{share}: {found} {expected}");
        }
    }

    #[test]
    fn the_area_of_the_hysteresis_loop_is_the_dissipated_energy() {
        let steps = 4000;
        let up = |step: usize| -0.8 + 1.6 * step as f64 / f64::from(steps);
        let rising: Vec<f64> = (0..=steps as usize).map(up).collect();
        let path: Vec<f64> = [0.8].into_iter().chain(rising.iter().copied()).collect();
        let path: Vec<f64> = path.into_iter().chain(rising.iter().rev().copied()).collect();
        let states = states(&path);
        let area: f64 = states[1..]
            .windows(2)
            .map(|pair| {
                let [from, to] = [&pair[0], &pair[1]];
                let run = displacement(to, 1.0) - displacement(from, 1.0);
                0.5 * (from.load + to.load) * run
            })
            .sum();
        let dissipated = lost(states.last().unwrap()) - lost(&states[1]);
        assert!((area - dissipated).abs() < 1e-6 * area, "{area} {dissipated}");
    }

    #[test]
    fn a_tangential_load_of_zero_slips_nowhere() {
        let state = &states(&[0.0])[0];
        assert!(state.terms.is_empty());
        assert_eq!(state.stick_share(), 1.0);
        assert_eq!(states(&[0.5, 0.0])[1].terms.len(), 2);
    }
}
