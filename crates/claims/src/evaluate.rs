//! The quantities of a claim: groups, the states that are compared, and expressions in their
//! values.

use std::collections::BTreeSet;

use crate::evidence::{Evidence, Group};
use crate::limits::{self, KappaLaw};
use crate::quantities::Quantities;
use crate::scope::{State, Tuple, Values, is_of_regression};
use crate::statistics::{Curve, same_load};
use crate::{Claim, ClaimOutcome, Judgement, closed_forms};
use asperity_manifest::expression::Expression;
use asperity_pipeline::study::claims::{
    ClaimSpec, DataSpec, Loads, Reduction, SPECTRUM, Source, Statistic, Test,
};
use asperity_stages::Kind;
use asperity_stages::ensemble::ParameterPoint;
use asperity_statistics::expectation::Expectation;
use asperity_statistics::intervals::Weights;
use asperity_tables::table::TableError;

/// Tests a claim.
///
/// # Errors
/// If a table lacks a column that its kind of stage writes.
pub fn claim(spec: &ClaimSpec, evidence: &Evidence) -> Result<Claim, TableError> {
    let claim = |data: String, outcome| Claim { statement: spec.clone(), data, outcome };
    let Some(test) = &spec.test else {
        return Ok(claim("the paper's print".to_owned(), ClaimOutcome::Noted));
    };
    if let (Some(statistic), true) = (test.statistic, test.data.is_empty()) {
        let bounds = closed_forms::bounds(statistic);
        let judgement = Judgement::new(spec.expected, bounds).expect("closed forms have values");
        let data = closed_forms::data(statistic).to_owned();
        return Ok(claim(data, ClaimOutcome::Judged(judgement)));
    }
    let labels: Vec<&str> = test.data.iter().map(|data| data.label.as_str()).collect();
    Ok(claim(labels.join(" and "), outcome(spec, test, evidence)?))
}

fn outcome(spec: &ClaimSpec, test: &Test, evidence: &Evidence) -> Result<ClaimOutcome, TableError> {
    let is_limit = test.data[0].source == Source::Spectra(Kind::Fit);
    if let (Some(statistic), true) = (test.statistic, is_limit) {
        return Ok(of_limits(spec, test, evidence, statistic));
    }
    let groups = Groups::new(test, evidence)?;
    let samples = groups.samples(test);
    let states = states(test, &samples);
    let mut quantities = Quantities::default();
    for tuple in tuples(test, &samples, &states) {
        for (label, expression) in &test.quantities {
            add(test, &tuple, (label.as_deref(), expression), &mut quantities);
        }
    }
    Ok(quantities.judge(spec.expected, || needs(test, &groups)))
}

/// Adds a quantity of a tuple.
fn add(
    test: &Test,
    tuple: &Tuple<'_>,
    (label, expression): (Option<&str>, &Expression),
    quantities: &mut Quantities,
) {
    let label = match label {
        Some(label) => format!("{}, {label}", name(test, tuple)),
        None => name(test, tuple),
    };
    if tuple.states().any(|state| state.group.estimate.is_some()) {
        return quantities
            .add_estimate(label, tuple.surfaces_of_estimates(), || tuple.estimate(expression));
    }
    let of_data = tuple.states().flat_map(|state| {
        let others = state.values.iter().skip(1).filter_map(|values| match values {
            Values::Surfaces(values) => Some(values.len()),
            Values::Estimate { .. } | Values::Computed(_) => None,
        });
        others.chain([state.surfaces()]).collect::<Vec<_>>()
    });
    let surfaces: Vec<usize> = of_data.filter(|surfaces| *surfaces > 0).collect();
    let names = expression.columns();
    let is_of_means = names.iter().any(|name| !name.ends_with("deviation") && *name != "load");
    let systematic = match is_of_means {
        true => tuple.states().map(|state| state.group.systematic).fold(0.0, libm::hypot),
        false => 0.0,
    };
    quantities.add(label, &surfaces, systematic, |weights| tuple.evaluate(expression, weights));
}

/// Judges a claim on the limits of κ.
fn of_limits(
    spec: &ClaimSpec,
    test: &Test,
    evidence: &Evidence,
    statistic: Statistic,
) -> ClaimOutcome {
    let laws: Vec<KappaLaw> = evidence.kappa.iter().filter_map(KappaLaw::best_fit).collect();
    let group = Group::default();
    let mut quantities = Quantities::default();
    for value in limits::values(&laws, statistic) {
        let surfaces = value.surfaces;
        let state = State::new(test, &group, 0, vec![Values::Computed(value.value)]);
        let tuple = Tuple { this: vec![&state], ..Tuple::default() };
        for (_, expression) in &test.quantities {
            let label = value.label.clone();
            quantities.add(label, &surfaces, 0.0, |weights| tuple.evaluate(expression, weights));
        }
    }
    quantities.judge(spec.expected, || match evidence.kappa.is_empty() {
        true => test.data[0].needs.clone().unwrap_or_default(),
        false => "more spectra and meshes than the fit has parameters".to_owned(),
    })
}

/// A range of pressures, if the claim has any, and the groups of each of the data.
type OfRange = (Option<[f64; 2]>, Vec<Vec<Group>>);

/// Groups of each of the data of a claim.
struct Groups {
    /// Groups before and after the condition `within`, for each of the data. If the claim is on
    /// fractions of pressures, for each range.
    all: Vec<OfRange>,
    /// Number of groups of the first data that do not meet the condition `within`.
    excluded: usize,
}

impl Groups {
    fn new(test: &Test, evidence: &Evidence) -> Result<Groups, TableError> {
        let ranges: Vec<Option<[f64; 2]>> = match test.between.as_slice() {
            [] => vec![None],
            ranges => ranges.iter().map(|range| Some(*range)).collect(),
        };
        let mut groups = Groups { all: Vec::new(), excluded: 0 };
        for range in ranges {
            let mut of_data = Vec::new();
            for (index, data) in test.data.iter().enumerate() {
                let mut own = match (range, test.statistic) {
                    (Some(range), _) => evidence.fractions(data, range)?,
                    (None, Some(Statistic::SealingArea)) => evidence.sealing_areas(data)?,
                    (None, Some(Statistic::MeshError)) => evidence.mesh_errors(data)?,
                    (None, _) => evidence.groups(data)?,
                };
                let before = own.len();
                own.retain(|group| meets(data, group, test));
                groups.excluded += if index == 0 { before - own.len() } else { 0 };
                of_data.push(own);
            }
            groups.all.push((range, of_data));
        }
        Ok(groups)
    }

    /// Returns the groups of the first data, each with the groups of the other data that agree in
    /// the parameters that both have.
    fn samples(&self, test: &Test) -> Vec<Sample<'_>> {
        let mut samples = Vec::new();
        for (between, of_data) in &self.all {
            let Some((main, others)) = of_data.split_first() else { continue };
            for group in main {
                let own = others.iter().map(|groups| {
                    let is_own = |other: &&Group| {
                        agrees(&group.point, &other.point) && other.surfaces() == group.surfaces()
                    };
                    groups.iter().find(is_own)
                });
                if let Some(others) = own.collect::<Option<Vec<_>>>() {
                    let number = samples.len();
                    samples.push(Sample { number, group, others, between: *between });
                }
            }
        }
        debug_assert!(samples.iter().all(|sample| sample.others.len() + 1 == test.data.len()));
        samples
    }

    fn main(&self) -> impl Iterator<Item = &Group> {
        self.all.iter().filter_map(|(_, of_data)| of_data.first()).flatten()
    }
}

fn meets(data: &DataSpec, group: &Group, test: &Test) -> bool {
    let state = State::new(test, group, 0, Vec::new());
    data.within.iter().all(|(expression, range)| {
        state.evaluate(expression, &Weights::ALL).is_some_and(|value| range.contains(value))
    })
}

/// Returns whether two points agree in all parameters that both have.
fn agrees(one: &ParameterPoint, other: &ParameterPoint) -> bool {
    one.iter().all(|(name, value)| other.get(name).is_none_or(|own| own == value))
}

/// A group with the groups of the other data.
struct Sample<'a> {
    number: usize,
    group: &'a Group,
    others: Vec<&'a Group>,
    between: Option<[f64; 2]>,
}

/// Returns the states of all samples, in their order.
fn states<'a>(test: &'a Test, samples: &[Sample<'a>]) -> Vec<State<'a>> {
    samples.iter().flat_map(|sample| of_sample(test, sample)).collect()
}

fn of_sample<'a>(test: &'a Test, sample: &Sample<'a>) -> Vec<State<'a>> {
    let group = sample.group;
    let state = |slot: usize, index: usize, values: Vec<Values<'a>>| State {
        sample: sample.number,
        slot,
        between: sample.between,
        ..State::new(test, group, index, values)
    };
    match test.statistic {
        None | Some(Statistic::SealingArea) => {
            let loads = match &test.loads {
                Loads::Lightest | Loads::Heaviest => &Loads::All,
                loads => loads,
            };
            let indices = group.indices(loads).into_iter().enumerate();
            let at = indices.filter_map(|(slot, index)| {
                let index = index?;
                let mut values = vec![Values::at(group, index)];
                for other in &sample.others {
                    let index = same_load(other, group.loads[index])?;
                    values.push(Values::at(other, index));
                }
                Some(state(slot, index, values))
            });
            at.collect()
        }
        Some(Statistic::MeshError) => {
            let value = move |weights: &Weights| {
                Some(weights.mean(&group.values[0]) / weights.mean(&group.values[1]))
            };
            let own = state(0, 0, vec![Values::Computed(Box::new(value))]);
            vec![State { load: f64::NAN, ..own }]
        }
        Some(statistic) => {
            let Some(indices) = group.indices(&test.loads).into_iter().collect::<Option<Vec<_>>>()
            else {
                return Vec::new();
            };
            let areas = if test.areas.is_empty() { &[f64::NAN][..] } else { &test.areas };
            let at = areas.iter().enumerate().filter_map(|(slot, &area)| {
                let other = sample.others.first().copied();
                let curve = Curve { group, other, indices: indices.clone(), area };
                if !curve.has(statistic) {
                    return None;
                }
                let value = move |weights: &Weights| curve.value(statistic, weights);
                let own = state(slot, 0, vec![Values::Computed(Box::new(value))]);
                let detail = if area.is_nan() { String::new() } else { format!("area {area}") };
                Some(State { load: f64::NAN, detail, ..own })
            });
            at.collect()
        }
    }
}

/// Returns the tuples of states from which quantities are computed.
fn tuples<'s>(test: &Test, samples: &[Sample<'_>], states: &'s [State<'s>]) -> Vec<Tuple<'s>> {
    let mut tuples = if test.regression.is_some() {
        families(test, samples, states)
    } else if test.along.iter().any(|along| along == "load") {
        along_loads(test, states)
    } else if !test.along.is_empty() {
        let along = test.along.iter();
        along.flat_map(|parameter| steps(test, parameter, samples, states)).collect()
    } else if !test.order.is_empty() {
        beside_first(test, states)
    } else {
        states.iter().map(|state| Tuple { this: vec![state], ..Tuple::default() }).collect()
    };
    tuples.retain(|tuple| is_tested(test, tuple));
    let by_sample = |tuples| grouped_by(tuples, |tuple: &Tuple| tuple.this[0].sample).into_iter();
    tuples = match test.loads {
        Loads::Lightest => by_sample(tuples).map(|(_, mut own)| own.swap_remove(0)).collect(),
        Loads::Heaviest => by_sample(tuples).filter_map(|(_, mut own)| own.pop()).collect(),
        _ => tuples,
    };
    if test.reduce.is_some() { reduced(test, tuples) } else { tuples }
}

/// Groups items by their keys, in order of appearance.
fn grouped_by<T, K: PartialEq>(items: Vec<T>, key: impl Fn(&T) -> K) -> Vec<(K, Vec<T>)> {
    let mut groups: Vec<(K, Vec<T>)> = Vec::new();
    for item in items {
        let key = key(&item);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, own)) => own.push(item),
            None => groups.push((key, vec![item])),
        }
    }
    groups
}

/// Returns whether a tuple meets the conditions `tested`. In a family, each group must meet those
/// that are not on results of the regression.
fn is_tested(test: &Test, tuple: &Tuple<'_>) -> bool {
    test.tested.iter().all(|(expression, range)| {
        let meets = |tuple: &Tuple<'_>| {
            let value = tuple.evaluate(expression, &Weights::ALL);
            value.is_some_and(|value| range.contains(value))
        };
        let is_of_family = expression.columns().into_iter().any(is_of_regression);
        if tuple.this.len() == 1 || is_of_family {
            return meets(tuple);
        }
        tuple.this.iter().all(|state| meets(&Tuple { this: vec![*state], ..Tuple::default() }))
    })
}

/// Returns the state of a sample at the load of another state.
fn at_load_of<'s>(
    test: &Test,
    states: &'s [State<'s>],
    sample: usize,
    state: &State<'_>,
) -> Option<&'s State<'s>> {
    let own = states.iter().filter(|other| other.sample == sample && other.detail == state.detail);
    if state.load.is_nan() || matches!(test.loads, Loads::At(_)) {
        let mut own = own;
        return own.find(|other| other.slot == state.slot);
    }
    let alternatives: Vec<&State> = own.collect();
    let loads: Vec<f64> = alternatives.iter().map(|state| state.load).collect();
    Some(alternatives[crate::evidence::nearest(&loads, state.load)?])
}

/// Returns the tuples of each group and the group with the next larger value of a parameter.
fn steps<'s>(
    test: &Test,
    parameter: &str,
    samples: &[Sample<'_>],
    states: &'s [State<'s>],
) -> Vec<Tuple<'s>> {
    let next: Vec<Option<usize>> =
        samples.iter().map(|sample| next(test, parameter, sample, samples)).collect();
    let uses_previous = uses(test, "previous");
    let mut tuples = Vec::new();
    for state in states {
        let other = next[state.sample].and_then(|next| at_load_of(test, states, next, state));
        let Some(other) = other else { continue };
        let tuple = Tuple { this: vec![state], next: vec![other], ..Tuple::default() };
        if !uses_previous {
            tuples.push(tuple);
            continue;
        }
        let before = (0..samples.len()).filter(|&before| next[before] == Some(state.sample));
        let earlier = before.filter_map(|before| at_load_of(test, states, before, state));
        tuples.extend(earlier.map(|before| Tuple { previous: vec![before], ..tuple.clone() }));
    }
    tuples
}

/// Returns the number of the sample that differs from `from` by the next larger value of a
/// parameter.
fn next(test: &Test, parameter: &str, from: &Sample, samples: &[Sample]) -> Option<usize> {
    let own = from.group.number(parameter)?;
    let is_beyond = |other: &&Sample| {
        other.group.number(parameter).is_some_and(|value| value > own)
            && other.between == from.between
            && is_alike(test, parameter, from.group, other.group)
            && may_follow(test, from.group, other.group)
    };
    let value = |sample: &&Sample| sample.group.number(parameter).unwrap_or(f64::NAN);
    let next = samples.iter().filter(is_beyond);
    next.min_by(|one, other| value(one).total_cmp(&value(other))).map(|sample| sample.number)
}

/// Returns whether two groups agree in what a claim along a parameter holds constant.
fn is_alike(test: &Test, parameter: &str, one: &Group, other: &Group) -> bool {
    if let Some(equal) = &test.equal {
        return equal.iter().all(|expression| {
            let [one, other] = [one, other].map(|group| {
                State::new(test, group, 0, Vec::new()).evaluate(expression, &Weights::ALL)
            });
            one.zip(other).is_some_and(|(one, other)| {
                (one - other).abs() <= 1e-12 * one.abs().max(other.abs())
            })
        });
    }
    // α follows from the other parameters, and the end of the plateau moves with the cutoff.
    let follows = ["nayak", "k_rolloff"];
    let others = |group: &Group| {
        let ends = group.number("k_rolloff").zip(group.number("k_lower"));
        let plateau = ends.map(|(rolloff, lower)| rolloff / lower);
        (group.point.clone().without(&[parameter]).without(&follows), plateau)
    };
    others(one) == others(other)
}

/// Returns whether two groups meet the conditions on the parameters of both.
fn may_follow(test: &Test, one: &Group, other: &Group) -> bool {
    let is_parameter = |name: &str| {
        let own = name.strip_prefix("next_").unwrap_or(name);
        one.number(own).is_some()
    };
    let states = [one, other].map(|group| State::new(test, group, 0, Vec::new()));
    let tuple = Tuple { this: vec![&states[0]], next: vec![&states[1]], ..Tuple::default() };
    let mut on_parameters = test.tested.iter().filter(|(expression, _)| {
        let names = expression.columns();
        names.iter().any(|name| name.starts_with("next_")) && names.into_iter().all(is_parameter)
    });
    on_parameters.all(|(expression, range)| {
        let value = tuple.evaluate(expression, &Weights::ALL);
        value.is_some_and(|value| range.contains(value))
    })
}

/// Returns the tuples of neighbouring loads of each group that has all loads of the claim.
fn along_loads<'s>(test: &Test, states: &'s [State<'s>]) -> Vec<Tuple<'s>> {
    let (uses_next, uses_previous) = (uses(test, "next"), uses(test, "previous"));
    let mut tuples = Vec::new();
    for own in states.chunk_by(|one, other| one.sample == other.sample) {
        let asked = match &test.loads {
            Loads::At(loads) => loads.len(),
            _ => own.len(),
        };
        let is_ascending = own.is_sorted_by(|one, other| one.load < other.load);
        if own.len() != asked || !is_ascending {
            continue;
        }
        for (index, state) in own.iter().enumerate() {
            let next = own.get(index + 1);
            let previous = index.checked_sub(1).map(|index| &own[index]);
            let is_first = test.from_zero && index == 0;
            if (uses_next && next.is_none()) || (uses_previous && previous.is_none() && !is_first) {
                continue;
            }
            tuples.push(Tuple {
                this: vec![state],
                next: next.into_iter().collect(),
                previous: previous.into_iter().collect(),
                first: Vec::new(),
            });
        }
    }
    tuples
}

/// Returns whether an expression of the claim uses the value or a property of another group.
fn uses(test: &Test, word: &str) -> bool {
    let quantities = test.quantities.iter().map(|(_, expression)| expression);
    let expressions = quantities.chain(test.tested.iter().map(|(expression, _)| expression));
    let is_of = |name: &str| {
        name.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    };
    expressions.flat_map(Expression::columns).any(is_of)
}

/// Returns a tuple for each family of groups and each load that all of its groups have.
fn families<'s>(test: &Test, samples: &[Sample<'_>], states: &'s [State<'s>]) -> Vec<Tuple<'s>> {
    let numbers = (0..samples.len()).collect();
    let families = grouped_by(numbers, |&sample| family(test, samples[sample].group));
    let mut tuples = Vec::new();
    for (_, own) in families {
        for state in states.iter().filter(|state| state.sample == own[0]) {
            let members = own.iter().map(|&sample| at_load_of(test, states, sample, state));
            if let Some(this) = members.collect::<Option<Vec<_>>>() {
                tuples.push(Tuple { this, ..Tuple::default() });
            }
        }
    }
    tuples
}

/// Returns the values of `per` for a group, by default of the parameters that are not in `on`.
fn family(test: &Test, group: &Group) -> Vec<f64> {
    let of = |expression: &Expression| {
        let state = State::new(test, group, 0, Vec::new());
        state.evaluate(expression, &Weights::ALL).unwrap_or(f64::MAX)
    };
    if let Some(per) = &test.per {
        return per.iter().map(of).collect();
    }
    let on = test.regression.iter().flat_map(|regression| &regression.on);
    let varied: BTreeSet<&str> = on.flat_map(Expression::columns).collect();
    let follows = ["nayak", "k_rolloff"];
    let is_other = |name: &str| !varied.contains(name) && !follows.contains(&name);
    let others = group.point.iter().map(|(name, _)| name).filter(|name| is_other(name));
    others.map(|name| group.number(name).unwrap_or(0.0)).collect()
}

/// Returns tuples of each group and the first group in the order of the claim.
fn beside_first<'s>(test: &Test, states: &'s [State<'s>]) -> Vec<Tuple<'s>> {
    let key = |state: &State| -> Vec<f64> {
        let order = test.order.iter();
        order.map(|one| state.evaluate(one, &Weights::ALL).unwrap_or(f64::MAX)).collect()
    };
    let slots: BTreeSet<(usize, &str)> =
        states.iter().map(|state| (state.slot, state.detail.as_str())).collect();
    let mut tuples = Vec::new();
    for (slot, detail) in slots {
        let own = states.iter().filter(|state| state.slot == slot && state.detail == detail);
        let first = own.clone().min_by(|one, other| {
            key(one).partial_cmp(&key(other)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(first) = first else { continue };
        let others = own.filter(|state| state.sample != first.sample);
        tuples.extend(others.map(|state| Tuple {
            this: vec![state],
            first: vec![first],
            ..Tuple::default()
        }));
    }
    tuples
}

/// Joins the tuples of each family.
fn reduced<'s>(test: &Test, tuples: Vec<Tuple<'s>>) -> Vec<Tuple<'s>> {
    let mut families = grouped_by(tuples, |tuple| -> Vec<f64> {
        let states = tuple.this.iter().chain(&tuple.next).filter(|_| test.per.is_some());
        states.flat_map(|state| family(test, state.group)).collect()
    });
    families.sort_by(|one, other| one.0.partial_cmp(&other.0).unwrap_or(std::cmp::Ordering::Equal));
    let join = |own: Vec<Tuple<'s>>| {
        if test.reduce == Some(Reduction::Largest) {
            let (_, expression) = &test.quantities[0];
            let value =
                |tuple: &Tuple| tuple.evaluate(expression, &Weights::ALL).unwrap_or(f64::NAN);
            return own.into_iter().max_by(|one, other| value(one).total_cmp(&value(other)));
        }
        let mut joined = Tuple::default();
        for tuple in own {
            joined.this.extend(tuple.this);
            joined.next.extend(tuple.next);
        }
        Some(joined)
    };
    families.into_iter().filter_map(|(_, own)| join(own)).collect()
}

/// Returns the label of a tuple, such as `k_lower 4, k_upper 32 → k_lower 16, load 0.060`.
fn name(test: &Test, tuple: &Tuple<'_>) -> String {
    let this = tuple.this[0];
    let mut parts = Vec::new();
    match (tuple.this.len(), &test.regression) {
        (1, _) => {
            let mut name = this.group.name.clone();
            for parameter in test.along.iter().filter(|parameter| *parameter != "load") {
                let next = tuple.next.first().and_then(|next| next.group.number(parameter));
                if let Some(next) = next.filter(|next| this.group.number(parameter) != Some(*next))
                {
                    name += &format!(" → {parameter} {next}");
                }
            }
            parts.push(name);
        }
        (_, Some(_)) => {}
        (groups, None) => {
            let of_parameter = test.per.iter().flatten().filter_map(|expression| {
                let value = |state: &&State| state.evaluate(expression, &Weights::ALL);
                let own = value(&tuple.this[0])?;
                let next = tuple.next.first().and_then(value).filter(|next| *next != own);
                let arrow = next.map_or_else(String::new, |next| format!(" → {next}"));
                Some(format!("{expression} {own}{arrow}"))
            });
            parts.extend(of_parameter);
            let what = if test.reduce == Some(Reduction::Max) { "largest" } else { "mean" };
            parts.push(format!("{what} of {groups} groups"));
        }
    }
    if !this.detail.is_empty() {
        parts.push(this.detail.clone());
    }
    if let Some([low, high]) = this.between {
        parts.push(format!("pressures {low} to {high}"));
    }
    if !this.load.is_nan() {
        let next = tuple.next.first().filter(|_| test.along.iter().any(|along| along == "load"));
        let arrow = next.map_or_else(String::new, |next| format!(" → {:.3}", next.load));
        // Three decimals would not distinguish the lightest loads.
        let digits = if this.load < 0.01 { 4 } else { 3 };
        parts.push(format!("load {:.digits$}{arrow}", this.load));
    }
    parts.retain(|part| !part.is_empty());
    if parts.is_empty() { "all rows".to_owned() } else { parts.join(", ") }
}

/// Returns the first requirement that a study does not meet: rows, groups, loads, or what the claim
/// says.
fn needs(test: &Test, groups: &Groups) -> String {
    let data = &test.data[0];
    if groups.main().next().is_none() {
        if groups.excluded > 0 {
            return data.needs_groups.clone().unwrap_or_else(|| {
                let ranges = data.within.iter();
                let conditions = ranges.map(|(expression, range)| shown(expression, *range));
                format!("groups with {}", conditions.collect::<Vec<_>>().join(" and "))
            });
        }
        return data.needs.clone().unwrap_or_else(|| match &data.source {
            Source::Stage(stage) => format!("rows of the stage `{stage}` with `{}`", data.value),
            Source::Spectra(kind) => format!("a `{}` stage on random surfaces", kind.name()),
        });
    }
    // Values of other data at the same parameters and loads.
    if let Some(other) = test
        .data
        .iter()
        .skip(1)
        .zip(1..)
        .find(|(_, index)| groups.all.iter().all(|(_, of_data)| of_data[*index].is_empty()))
    {
        return other.0.needs.clone().unwrap_or_else(|| format!("values of {}", other.0.label));
    }
    if let Loads::At(loads) = &test.loads
        && let Some(first) = loads.first()
    {
        let has_one = loads.iter().any(|load| groups.main().any(|group| group.at(*load).is_some()));
        if !has_one {
            let wanted: Vec<String> = loads.iter().map(|load| load.value.to_string()).collect();
            let known = groups.main().flat_map(|group| match first.is_pressure {
                true => &group.given,
                false => &group.loads,
            });
            let distance = |load: &f64| (load - first.value).abs();
            let nearest = known.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let note = nearest.map_or_else(String::new, |load| {
                format!("; the load nearest to {} is {load}", first.value)
            });
            return format!("a load at {}{note}", wanted.join(" or "));
        }
    }
    test.needs.clone().unwrap_or_else(|| match test.along.as_slice() {
        [] => "values that meet the conditions of the claim".to_owned(),
        along => format!("two groups that differ only in `{}`", along.join("` or `")),
    })
}

fn shown(expression: &Expression, range: Expectation) -> String {
    let is_plain = SPECTRUM.contains(&expression.to_string().as_str());
    match range.range {
        [low, high] if low == high && is_plain => format!("`{expression} = {low}`"),
        _ => format!("`{expression}` {range}"),
    }
}
