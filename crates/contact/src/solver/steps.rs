//! How far a direction is followed, before it is known how far would have been best.

/// Iterations of one load whose steps are told apart; later ones share the last.
const STEPS: usize = 16;

/// The step before any was learnt. Corrections are too large by up to a third; with one half, first loads
/// take half as many pairs again.
const UNTRIED_STEP: f64 = 0.9;

/// Steps stay above what surfaces of all kinds were seen to need: a load that ends in rounding must not
/// teach the next. More than the whole correction closes the gap only of nodes about to be let go; one
/// load may have many of them, and the next one none.
const STEP_RANGE: (f64, f64) = (0.1, 1.0);

/// The steps that each iteration of a load learnt from earlier loads.
#[derive(Clone)]
pub struct Steps([f64; STEPS]);

impl Default for Steps {
    fn default() -> Self {
        Self([UNTRIED_STEP; STEPS])
    }
}

impl Steps {
    pub fn of(&self, iteration: usize) -> f64 {
        self.0[iteration.min(STEPS - 1)]
    }

    /// All of them, in the order of iterations.
    pub fn all(&self) -> &[f64] {
        &self.0
    }

    /// Those that [`Steps::all`] has told, one after the other.
    pub fn restored<E>(mut next: impl FnMut() -> Result<f64, E>) -> Result<Steps, E> {
        let mut steps = Steps::default();
        for step in &mut steps.0 {
            *step = next()?;
        }
        Ok(steps)
    }

    /// Learns, by half, that `best` times the step would have been right.
    pub fn learn(&mut self, iteration: usize, best: f64) {
        let (least, most) = STEP_RANGE;
        let step = &mut self.0[iteration.min(STEPS - 1)];
        *step = (*step * (0.5 + 0.5 * best.min(2.0))).clamp(least, most);
    }
}
