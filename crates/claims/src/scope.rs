//! Values of the names in the expressions of a claim.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use crate::evidence::Group;
use crate::limits::Computed;
use crate::regression::Points;
use asperity_manifest::decimal;
use asperity_manifest::expression::Expression;
use asperity_mechanics::theory::persson;
use asperity_pipeline::study::claims::{Reduction, Test};
use asperity_stages::aggregate::Model;
use asperity_statistics::intervals::Weights;

/// Values of one of the data of a claim.
pub enum Values<'a> {
    /// One value per surface.
    Surfaces(&'a [f64]),
    /// A result of a fit, or a mean, with its standard error. `shift` is added in units of the
    /// error.
    Estimate { value: f64, error: f64, shift: Cell<f64> },
    /// A number that is computed from the selected surfaces.
    Computed(Computed<'a>),
}

impl Values<'_> {
    /// Returns the values of a group at the load with this index.
    pub fn at(group: &Group, index: usize) -> Values<'_> {
        match (&group.estimate, group.values[index].as_slice()) {
            (Some((errors, _)), [value]) => {
                Values::Estimate { value: *value, error: errors[index], shift: Cell::new(0.0) }
            }
            (_, values) => Values::Surfaces(values),
        }
    }
}

/// A group at one load, or a group with a number that is computed from its curve.
pub struct State<'a> {
    pub test: &'a Test,
    pub group: &'a Group,
    /// Number of the sample, of which a group has one for each range of pressures.
    pub sample: usize,
    /// Index of the load among those of the claim.
    pub slot: usize,
    /// Load in units of E* × rms slope, or NaN.
    pub load: f64,
    /// Text that distinguishes states of a group besides the load.
    pub detail: String,
    /// Range of pressures of which the value is the fraction.
    pub between: Option<[f64; 2]>,
    /// Values of each of the data of the claim.
    pub values: Vec<Values<'a>>,
    /// Predictions of theories, which do not depend on the selected surfaces.
    pub theories: RefCell<BTreeMap<String, Option<f64>>>,
}

/// Groups that one quantity compares. Each list has one state, or those of a family.
#[derive(Clone, Default)]
pub struct Tuple<'s> {
    pub this: Vec<&'s State<'s>>,
    pub next: Vec<&'s State<'s>>,
    pub previous: Vec<&'s State<'s>>,
    pub first: Vec<&'s State<'s>>,
}

impl<'a> State<'a> {
    /// Creates a state with the values of one group, at the load with this index.
    pub fn new(
        test: &'a Test,
        group: &'a Group,
        index: usize,
        values: Vec<Values<'a>>,
    ) -> State<'a> {
        State {
            test,
            group,
            sample: 0,
            slot: index,
            load: group.loads.get(index).copied().unwrap_or(f64::NAN),
            detail: String::new(),
            between: None,
            values,
            theories: RefCell::default(),
        }
    }

    pub fn surfaces(&self) -> usize {
        self.group.surfaces()
    }

    /// Returns the value of a name for the surfaces that `weights` selects.
    fn value(&self, name: &str, weights: &Weights) -> Option<f64> {
        let of_data = |index: usize| match self.values.get(index)? {
            Values::Surfaces(values) => Some(weights.mean(values)),
            Values::Estimate { value, error, shift } => Some(value + shift.get() * error),
            Values::Computed(value) => value(weights),
        };
        match name {
            "this" => of_data(0),
            "load" => Some(self.load),
            "surfaces" => Some(self.surfaces() as f64),
            "deviation" => self.deviation(weights),
            "error" => Some(self.deviation(&Weights::ALL)? / (self.surfaces() as f64).sqrt()),
            "persson_load" => persson::load_at_noncontact(1.0 - of_data(0)?),
            "reference" => self.reference(),
            _ => match self.test.data.iter().position(|data| data.name == name) {
                Some(index) => of_data(index),
                None => self.parameter(name).or_else(|| self.theory(name)),
            },
        }
    }

    /// Returns the number of a parameter.
    fn parameter(&self, name: &str) -> Option<f64> {
        self.group.number(name)
    }

    fn deviation(&self, weights: &Weights) -> Option<f64> {
        match self.values.first()? {
            Values::Surfaces(values) => self.group.has_scatter.then(|| weights.deviation(values)),
            Values::Estimate { .. } | Values::Computed(_) => None,
        }
    }

    fn theory(&self, name: &str) -> Option<f64> {
        if let Some(known) = self.theories.borrow().get(name) {
            return *known;
        }
        let model = Model::ALL.into_iter().find(|model| model.word().replace('-', "_") == name)?;
        let value = match self.between {
            Some([low, high]) if model == Model::Persson => {
                Some(persson::fraction_between(self.load, low, high))
            }
            Some(_) => None,
            None => model.area(self.load, self.parameter("nayak")),
        };
        self.theories.borrow_mut().insert(name.to_owned(), value);
        value
    }

    /// Returns the reference value at the parameters of the group.
    fn reference(&self) -> Option<f64> {
        let is_own = |(point, _): &&(BTreeMap<String, f64>, f64)| {
            let mut parameters = point.iter();
            parameters.all(|(name, value)| {
                self.parameter(name).is_some_and(|own| decimal::is_same(own, *value))
            })
        };
        self.test.reference.iter().find(is_own).map(|(_, value)| *value)
    }

    /// Returns the value of an expression, or `None` if it is undefined.
    pub fn evaluate(&self, expression: &Expression, weights: &Weights) -> Option<f64> {
        let value = expression.value(&|name| self.value(name, weights).unwrap_or(f64::NAN));
        (!value.is_nan()).then_some(value)
    }
}

impl Tuple<'_> {
    /// Returns all states of the tuple.
    pub fn states(&self) -> impl Iterator<Item = &State<'_>> {
        let all = [&self.this, &self.next, &self.previous, &self.first];
        all.into_iter().flatten().copied()
    }

    /// Returns the value of an expression for the surfaces that `weights` selects, or `None` if it
    /// is undefined.
    pub fn evaluate(&self, expression: &Expression, weights: &Weights) -> Option<f64> {
        let value = expression.value(&|name| self.value(name, weights).unwrap_or(f64::NAN));
        value.is_finite().then_some(value)
    }

    /// Returns the smallest number of surfaces of the estimates.
    pub fn surfaces_of_estimates(&self) -> usize {
        let counts = self.states().filter_map(|state| Some(state.group.estimate.as_ref()?.1));
        counts.min().unwrap_or(0)
    }

    /// Returns the value of an expression in estimates, and its standard error to first order in
    /// those of the estimates, which count as independent.
    pub fn estimate(&self, expression: &Expression) -> Option<(f64, f64)> {
        let mut variance = 0.0;
        for values in self.states().flat_map(|state| &state.values) {
            let Values::Estimate { shift, .. } = values else { continue };
            let shifted = |by: f64| {
                shift.set(by);
                self.evaluate(expression, &Weights::ALL)
            };
            let ends = [1.0, -1.0].map(shifted);
            shift.set(0.0);
            variance += (0.5 * (ends[0]? - ends[1]?)).powi(2);
        }
        Some((self.evaluate(expression, &Weights::ALL)?, variance.sqrt()))
    }

    fn value(&self, name: &str, weights: &Weights) -> Option<f64> {
        let test = self.this.first()?.test;
        // The curve starts at load 0 with the value 0.
        let is_zero = test.from_zero && self.previous.is_empty();
        if is_zero && ["previous", "previous_load"].contains(&name) {
            return Some(0.0);
        }
        let others = [("next", &self.next), ("previous", &self.previous), ("first", &self.first)];
        for (word, states) in others {
            match name.strip_prefix(word) {
                Some("") => return self.reduced(states, "this", weights),
                Some(rest) if rest.starts_with('_') => {
                    return self.reduced(states, &rest[1..], weights);
                }
                _ => {}
            }
        }
        if let (Some(regression), true) = (&test.regression, is_of_regression(name)) {
            let of = |expression: &Expression| {
                let states = self.this.iter();
                states.map(|state| state.evaluate(expression, weights)).collect::<Option<Vec<_>>>()
            };
            let abscissae = regression.on.iter().map(of).collect::<Option<Vec<_>>>()?;
            return Points { abscissae, ordinates: of(&regression.of)? }.result(name);
        }
        self.reduced(&self.this, name, weights)
    }

    fn reduced(&self, states: &[&State<'_>], name: &str, weights: &Weights) -> Option<f64> {
        if let [state] = states {
            return state.value(name, weights);
        }
        let all = states.iter().map(|state| state.value(name, weights));
        let values: Vec<f64> = all.collect::<Option<_>>()?;
        match states.first()?.test.reduce? {
            Reduction::Max => values.into_iter().reduce(f64::max),
            Reduction::Mean | Reduction::Largest => {
                Some(values.iter().sum::<f64>() / values.len() as f64)
            }
        }
    }
}

/// Returns whether a name is a result of a regression.
pub fn is_of_regression(name: &str) -> bool {
    let word = name.trim_end_matches(|letter: char| letter.is_ascii_digit());
    ["slope", "step", "range", "residual", "spread"].contains(&word)
}
