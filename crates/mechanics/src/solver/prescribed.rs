//! Contact at a prescribed mean gap or approach, found by a search for the load.
//!
//! The approach d of the bodies grows with the load p. It is d ∝ p^(2/3) for Hertz's contact, and
//! d ∝ ln p + const. for many contacts of a rough surface, so that ln d is a smooth function of
//! ln p with a moderate slope. A secant search in these variables, kept within a bracket, takes
//! three or four loads. The first load is that of the smallest of the coarser meshes, on which the
//! search takes next to no time. Loads that differ little from the one before start from its
//! pressures, and only the last ones are solved to the whole tolerance, so that the search takes
//! about as many pairs as two loads.
//!
//! With a hardness H, the approach is not a function of the load alone. If all k nodes in contact
//! out of N have yielded, they bear the load k H/N at each approach from the one at which the last
//! of them yields to the one at which another node touches. The search approaches such a load from
//! both sides. It then tries whether these pressures solve the contact at the prescribed approach.

use super::passes::Convergence;
use super::refinement::Evaluation;
use super::{Hardness, Outcome, Settings, Solver, Stop, Watch};

/// Quantity that is prescribed instead of the load, in units of rms slope × longer side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prescribed {
    /// Mean gap over the map, positive. The surfaces do not touch if it is larger than the height
    /// of the highest node above the mean plane. A gap below the tolerance × rms slope × mesh step
    /// is not resolved.
    MeanGap(f64),
    /// Rigid approach of the bodies since the first touch of the highest node, positive.
    Approach {
        /// The approach, with the uniform compression of a layer.
        approach: f64,
        /// Uniform compression of a layer on a rigid base under the mean pressure 1, and zero for
        /// all other bodies, which a uniform pressure does not compress.
        uniform_compliance: f64,
    },
}

/// Settings of the search on the smallest mesh.
const COARSE: Settings = Settings { tolerance: 1e-2, pair_limit: 1000 };

/// Largest accepted error of the approach as a fraction of the approach. It is stricter than the
/// tolerance where only a few nodes touch.
const MAX_RELATIVE_ERROR: f64 = 1e-3;

/// Tolerance to which the first loads of a search are solved.
const LOOSE: f64 = 1e-2;

/// Tolerance of the next load as a fraction of the error of the approach.
const FORCING: f64 = 0.05;

/// Smallest change of the approach, in units of the tolerance, that the error of the solution does
/// not hide.
const CLEAR: f64 = 4.0;

/// Maximum number of loads of a search. A search takes more than ten if rounding hides the
/// approach, or if the approach is steep at a load at which nearly all nodes in contact have
/// yielded.
const MAX_LOADS: usize = 40;

/// Number of loads after which every second one halves the bracket, and after which loads are
/// solved to the whole tolerance.
const SECANTS: usize = 8;

/// Number of loads after which a search tries whether all nodes in contact yield. Most searches end
/// before.
const ELASTIC_LOADS: usize = 3;

/// Largest fraction of the load on elastic nodes with which a search tries whether all nodes in
/// contact yield.
const MAX_ELASTIC: f64 = 0.2;

/// Largest factor by which a load differs from the one before while the bracket has one end.
const MAX_FACTOR: f64 = 16.0;

/// Largest ratio of the larger to the smaller of two successive loads at which the second one
/// starts from the pressures of the first one.
const MAX_RATIO: f64 = 1.2;

/// Maximum number of pairs from the pressures of the load before. Most loads take fewer than 20; if
/// the nodes that yield are others, the pressures may never converge from these.
const NEAR_PAIRS: u32 = 100;

/// Largest load as a fraction of the hardness, at which a material yields everywhere.
const BELOW_HARDNESS: f64 = 1.0 - 1e-9;

impl Solver {
    /// Solves the contact at a prescribed mean gap or approach. Returns the load, in units of E* ×
    /// rms slope, with its outcome.
    ///
    /// The error of the mean gap or the approach is at most `settings.tolerance`, in units of rms
    /// slope × the smaller mesh step, as the residual is. The load is zero if the surfaces do not
    /// touch ([`Stop::NoContact`]). If no load gives the prescribed value, as in full contact of a
    /// body that a uniform pressure does not compress, the outcome is that of the nearest load
    /// ([`Stop::NotReached`]). `settings.pair_limit` holds for all loads of the search together.
    ///
    /// ```
    /// use asperity_mechanics::elasticity::PeriodicHalfSpace;
    /// use asperity_mechanics::grid::Grid;
    /// use asperity_mechanics::reduced::ReducedHeights;
    /// use asperity_mechanics::solver::{Prescribed, Settings, Solver};
    /// use asperity_mechanics::topography::shapes::Shape;
    ///
    /// let grid = Grid::square(64, 1.0)?;
    /// let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid);
    /// let heights = ReducedHeights::reduced(grid, wave.into_heights())?;
    /// let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
    /// let settings = Settings::default();
    /// let pressed = solver.press(0.1, &settings, &|| false);
    /// let gap = Prescribed::MeanGap(pressed.mean_gap);
    /// let (load, outcome) = solver.press_to(gap, &settings, &|| false);
    /// assert!((load - 0.1).abs() < 1e-4);
    /// assert_eq!(outcome.contact_nodes, pressed.contact_nodes);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn press_to(
        &mut self,
        prescribed: Prescribed,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> (f64, Outcome) {
        let wanted = self.wanted(prescribed);
        if wanted <= 0.0 {
            return (0.0, self.without_contact(prescribed));
        }
        if let Some(end) = self.beyond_full_contact(prescribed, wanted, settings, watch) {
            return end;
        }
        let guess = self.coarse_guess(prescribed, watch);
        self.search(prescribed, guess, settings, watch).0
    }

    /// Returns the approach at which the search ends; not positive if the surfaces do not touch.
    fn wanted(&self, prescribed: Prescribed) -> f64 {
        match prescribed {
            Prescribed::MeanGap(gap) => self.problem.highest - gap,
            Prescribed::Approach { approach, .. } => approach,
        }
    }

    /// Returns the approach under the load that was solved last.
    ///
    /// With a prescribed gap it is the height of the highest node above the mean plane less the
    /// mean gap, which is zero at first touch, too.
    fn approach_of(&self, prescribed: Prescribed, load: f64, outcome: &Outcome) -> f64 {
        let highest = self.problem.highest;
        match prescribed {
            Prescribed::MeanGap(_) => highest - outcome.mean_gap,
            Prescribed::Approach { uniform_compliance, .. } => {
                highest + self.inner.reference + self.offset + uniform_compliance * load
            }
        }
    }

    fn without_contact(&mut self, prescribed: Prescribed) -> Outcome {
        self.pressure.fill(0.0);
        let mean_gap = (self.problem.highest - self.wanted(prescribed)).max(0.0);
        Outcome { mean_gap, ..Outcome::default() }
    }

    /// Solves full contact if the prescribed approach reaches or exceeds it. Returns `None` if it
    /// does not, or if no formula gives the load of full contact.
    fn beyond_full_contact(
        &mut self,
        prescribed: Prescribed,
        wanted: f64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Option<(f64, Outcome)> {
        let (full, flattened) = (self.full_contact_load()?, self.problem.highest);
        let compliance = prescribed.uniform_compliance();
        if wanted < flattened + compliance * full {
            return None;
        }
        let within = if compliance > 0.0 { (wanted - flattened) / compliance } else { full };
        let load = within.max(full);
        if load == 0.0 {
            // A flat surface touches everywhere under any load.
            let outcome = self.without_contact(prescribed);
            return Some((0.0, Outcome { stop: Stop::NotReached, ..outcome }));
        }
        let outcome = self.press(load, settings, watch);
        let is_reached = compliance > 0.0 || wanted == flattened;
        let stop = if is_reached { outcome.stop } else { Stop::NotReached };
        Some((load, Outcome { stop, ..outcome }))
    }

    /// Searches the load on the smallest of the coarser meshes. Returns the default guess if there
    /// is no coarser mesh or if the search fails.
    fn coarse_guess(&mut self, prescribed: Prescribed, watch: &dyn Watch) -> Guess {
        let (highest, nodes) = (self.problem.highest, self.pressure.len());
        let Some(coarser) = &mut self.coarser else { return Guess::default() };
        let solver = &mut coarser.coarsest.solver;
        // The highest node may be between the nodes of the coarser mesh.
        let lower = highest - solver.problem.highest;
        let prescribed = match prescribed {
            Prescribed::MeanGap(_) => prescribed,
            Prescribed::Approach { approach, uniform_compliance } => {
                Prescribed::Approach { approach: approach - lower, uniform_compliance }
            }
        };
        if solver.wanted(prescribed) <= 0.0 {
            return Guess::default();
        }
        let watch = || watch.is_interrupted();
        let ((load, outcome), slope) = solver.search(prescribed, Guess::default(), &COARSE, &watch);
        let pairs = f64::from(outcome.pairs) * solver.pressure.len() as f64 / nodes as f64;
        let pairs_of_mesh = pairs.round() as u32;
        if outcome.stop == Stop::Converged {
            Guess { load, slope, pairs: pairs_of_mesh }
        } else {
            Guess { pairs: pairs_of_mesh, ..Guess::default() }
        }
    }

    /// Searches the load of a prescribed approach. Returns the load, its outcome and the slope
    /// d ln(approach) / d ln(load).
    fn search(
        &mut self,
        prescribed: Prescribed,
        guess: Guess,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> ((f64, Outcome), f64) {
        let wanted = self.wanted(prescribed);
        let full = self.full_contact_load().map(|load| Point {
            load: libm::log(load),
            approach: self.problem.highest + prescribed.uniform_compliance() * load,
            noise: 0.0,
        });
        let ceiling = self.problem.hardness.map_or(f64::INFINITY, Hardness::pressure);
        let mut search = Search {
            wanted,
            max_load: libm::log(BELOW_HARDNESS * ceiling),
            low: None,
            high: full,
            last: None,
            slope: guess.slope,
        };
        let (mut load, mut pairs) = (search.within(libm::log(guess.load)), guess.pairs);
        let mut tolerance = settings.tolerance.max(LOOSE);
        for count in 1..=MAX_LOADS {
            let rest = settings.pair_limit.saturating_sub(pairs).max(1);
            let (given, of_load) = (libm::exp(load), Settings { pair_limit: rest, tolerance });
            let is_near =
                search.last.is_some_and(|last| libm::exp((load - last.load).abs()) <= MAX_RATIO);
            let counted = Continued { watch, before: pairs };
            let outcome = if is_near {
                self.press_from_last(given, &of_load, &counted)
            } else {
                self.press(given, &of_load, &counted)
            };
            pairs += outcome.pairs;
            let approach = self.approach_of(prescribed, given, &outcome);
            let error = (approach - wanted).abs();
            let residual = self.inner.residual(error);
            let is_final = tolerance <= settings.tolerance;
            let is_reached = residual <= settings.tolerance && error <= MAX_RELATIVE_ERROR * wanted;
            let noise = if is_final { 0.0 } else { CLEAR * tolerance / self.inner.residual(1.0) };
            search.add(Point { load, approach: approach.max(f64::MIN_POSITIVE), noise });
            if count > ELASTIC_LOADS
                && outcome.stop == Stop::Converged
                && !is_reached
                && let Some(yielded) =
                    self.press_yielded(prescribed, given, approach < wanted, settings)
            {
                pairs += yielded.outcome.pairs;
                if yielded.outcome.stop == Stop::Converged {
                    let outcome = Outcome { pairs, ..yielded.outcome };
                    return ((yielded.load, outcome), search.slope);
                }
            }
            let next = search.next(count);
            let stop = match outcome.stop {
                Stop::Interrupted | Stop::PairLimit => outcome.stop,
                stop if is_reached && is_final => stop,
                _ if pairs >= settings.pair_limit => Stop::PairLimit,
                _ if count == MAX_LOADS || next == load && is_final => Stop::NotReached,
                _ => {
                    load = next;
                    let loose = if count < SECANTS { (FORCING * residual).min(LOOSE) } else { 0.0 };
                    tolerance = loose.max(settings.tolerance);
                    continue;
                }
            };
            let residual = outcome.residual.max(residual);
            return ((given, Outcome { stop, pairs, residual, ..outcome }), search.slope);
        }
        unreachable!("the last load ends the search")
    }

    /// Solves the contact under a load that differs little from the last one, from its pressures.
    fn press_from_last(&mut self, load: f64, settings: &Settings, watch: &dyn Watch) -> Outcome {
        let (bound, reference) = (self.inner.bound, self.inner.reference + self.offset);
        self.begin_load(load, settings);
        if self.reaches_full_contact(load) {
            return self.press_to_full_contact();
        }
        self.inner.bound = bound;
        self.inner.reference = reference;
        self.impose_load();
        let evaluation = self.evaluate_guess(settings);
        let few = Settings { pair_limit: settings.pair_limit.min(NEAR_PAIRS), ..*settings };
        let outcome = self.solve(self.inner.step_control(true), evaluation, &few, watch);
        let yields = outcome.saturated_nodes > 0;
        let ceiling = self.problem.hardness.map_or(f64::INFINITY, Hardness::pressure);
        // Nodes begin or cease to yield between both loads.
        let is_other = bound.is_some() != yields || outcome.peak_pressure > ceiling;
        let has_failed = outcome.stop == Stop::PairLimit && outcome.pairs < settings.pair_limit;
        if has_failed || outcome.stop == Stop::Converged && is_other {
            let pair_limit = settings.pair_limit.saturating_sub(outcome.pairs).max(1);
            let rest = Continued { watch, before: outcome.pairs };
            let whole = self.press(load, &Settings { pair_limit, ..*settings }, &rest);
            return Outcome { pairs: outcome.pairs + whole.pairs, ..whole };
        }
        outcome
    }
}

impl Solver {
    /// Tries whether all nodes in contact yield at the prescribed approach, if few of those under
    /// the last load, `load`, are elastic. With `touches_less` the approach under this load is
    /// smaller than the prescribed one, so that elastic nodes would yield; otherwise they would
    /// not touch.
    ///
    /// Returns the load on the yielded nodes. If its pressures do not solve the contact, the
    /// outcome has not converged, and the solver holds those of the last load.
    fn press_yielded(
        &mut self,
        prescribed: Prescribed,
        load: f64,
        touches_less: bool,
        settings: &Settings,
    ) -> Option<Yielded> {
        let hardness = self.inner.bound?.pressure();
        let cells = self.pressure.len() as f64;
        let is_elastic = |pressure: f64| pressure > 0.0 && pressure < hardness;
        let nodes_with_pressure = self.pressure.iter().copied().enumerate();
        let elastic: Vec<(usize, f64)> =
            nodes_with_pressure.filter(|(_, pressure)| is_elastic(*pressure)).collect();
        let on_elastic = elastic.iter().map(|(_, pressure)| pressure).sum::<f64>() / cells;
        let replaced = if touches_less { hardness } else { 0.0 };
        let yielded = self.pressure.iter().filter(|pressure| **pressure >= hardness).count();
        let nodes = yielded + if touches_less { elastic.len() } else { 0 };
        if on_elastic > MAX_ELASTIC * load || nodes == 0 || nodes == self.pressure.len() {
            return None;
        }
        elastic.iter().for_each(|(node, _)| self.pressure[*node] = replaced);
        let (reference, offset) = (self.inner.reference, self.offset);
        self.inner.begin_bounded(hardness * nodes as f64 / cells, self.inner.bound);
        self.inner.reference += offset;
        let outcome = self.yielded_at(prescribed, nodes as f64 / cells, settings);
        let yielded = Yielded { load: self.inner.load, outcome };
        if outcome.stop != Stop::Converged {
            elastic.iter().for_each(|(node, pressure)| self.pressure[*node] = *pressure);
            self.inner.begin_bounded(load, self.inner.bound);
            self.inner.reference = reference;
            self.offset = offset;
        }
        Some(yielded)
    }

    /// Evaluates the present pressures, which are zero or the hardness, at the prescribed approach.
    /// `share` is the fraction of the nodes in contact.
    fn yielded_at(&mut self, prescribed: Prescribed, share: f64, settings: &Settings) -> Outcome {
        let evaluation = self.evaluate();
        let middle = evaluation.convergence.offset;
        // Yielded nodes count as zero gap.
        let change = match prescribed {
            Prescribed::MeanGap(gap) => middle + (evaluation.mean_gap - gap) / (1.0 - share),
            Prescribed::Approach { approach, uniform_compliance } => {
                let uniform = uniform_compliance * self.inner.load;
                approach - uniform - self.problem.highest - self.inner.reference
            }
        };
        self.inner.reference += change;
        let evaluation = self.evaluate();
        self.offset = 0.0;
        let Convergence { offset: middle, error } = evaluation.convergence;
        let shifted = Evaluation {
            convergence: Convergence { offset: 0.0, error: error + middle.abs() },
            mean_gap: evaluation.mean_gap + middle * (1.0 - share),
            yielded_depth: evaluation.yielded_depth - middle * share,
            ..evaluation
        };
        let is_solved = self.is_solved(settings, &shifted);
        let stop = if is_solved { Stop::Converged } else { Stop::NotReached };
        let summary = self.summarise();
        self.outcome(stop, shifted, summary)
    }
}

/// Load on nodes that have all yielded, with its outcome.
struct Yielded {
    load: f64,
    outcome: Outcome,
}

/// First load of a search, with the slope d ln(approach) / d ln(load) there and the number of
/// transform pairs used to find it.
#[derive(Debug, Clone, Copy)]
struct Guess {
    load: f64,
    slope: f64,
    pairs: u32,
}

impl Default for Guess {
    /// Returns a light load with the slope of Hertz's contact.
    fn default() -> Guess {
        Guess { load: 0.02, slope: 2.0 / 3.0, pairs: 0 }
    }
}

impl Prescribed {
    fn uniform_compliance(self) -> f64 {
        match self {
            Prescribed::MeanGap(_) => 0.0,
            Prescribed::Approach { uniform_compliance, .. } => uniform_compliance,
        }
    }
}

/// A load with its approach.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// Logarithm of the load.
    load: f64,
    approach: f64,
    /// Change of the approach that the tolerance of the solution hides.
    noise: f64,
}

/// Bracketed secant search, in the logarithm of the load, for the load that gives an approach.
#[derive(Debug)]
struct Search {
    /// Approach of the load.
    wanted: f64,
    /// Bound that all loads are below.
    max_load: f64,
    /// Heaviest load with a smaller approach, and lightest load with a larger one.
    low: Option<Point>,
    high: Option<Point>,
    last: Option<Point>,
    /// Slope d ln(approach) / d ln(load) at the last load.
    slope: f64,
}

impl Search {
    fn add(&mut self, point: Point) {
        let is_clear =
            |approach: f64, noise: f64| (point.approach - approach).abs() >= point.noise.max(noise);
        if let Some(last) = self.last.filter(|last| is_clear(last.approach, last.noise)) {
            let slope = libm::log(point.approach / last.approach) / (point.load - last.load);
            self.slope = if slope > 0.0 && slope.is_finite() { slope } else { self.slope };
        }
        if is_clear(self.wanted, 0.0) {
            let end = if point.approach < self.wanted { &mut self.low } else { &mut self.high };
            *end = Some(point);
        }
        self.last = Some(point);
    }

    /// Returns the next load after `count` loads, or the last one if the bracket is too small to
    /// hold another one.
    fn next(&self, count: usize) -> f64 {
        let last = self.last.expect("a load was added");
        if let (Some(low), Some(high)) = (self.low, self.high)
            && count > SECANTS
            && count.is_multiple_of(2)
        {
            return 0.5 * (low.load + high.load);
        }
        let max_step = libm::log(MAX_FACTOR);
        let step = libm::log(self.wanted / last.approach) / self.slope;
        self.within(last.load + step.clamp(-max_step, max_step))
    }

    /// Returns a load within the bracket: the given one, or the middle of the bracket.
    fn within(&self, load: f64) -> f64 {
        let low = self.low.map_or(f64::NEG_INFINITY, |low| low.load);
        let high = self.high.map_or(self.max_load, |high| high.load);
        if load > low && load < high {
            return load;
        }
        if low.is_finite() { 0.5 * (low + high) } else { high - 1.0 }
    }
}

/// Observer of one load of a search, which counts the pairs of the loads before it, too.
struct Continued<'a> {
    watch: &'a dyn Watch,
    before: u32,
}

impl Watch for Continued<'_> {
    fn is_interrupted(&self) -> bool {
        self.watch.is_interrupted()
    }

    fn spent(&self, pairs: u32) {
        self.watch.spent(self.before + pairs);
    }
}
