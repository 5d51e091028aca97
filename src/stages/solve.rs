//! Presses a surface through a block of loads.

pub mod checks;
mod hardness;
pub mod keys;
mod solved;

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::columns::*;
use super::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, Rows, Stage,
    StageError, beside_coordinates, summary::range,
};
use crate::contact::grid::Boundary;
use crate::contact::solver::{HalfSpace, Hardness, Settings, Stop, Watch, cost};
use crate::diagnostics::counted;
use crate::store::column::{Column, Value};
use crate::store::parquet::Columns;
use crate::store::table::{Table, TableError};
use solved::{Scales, Solved};

pub use hardness::GivenHardness;

/// Raise it when the numbers change, or what columns say of themselves.
pub const VERSION: u32 = 5;

/// Presses surfaces, load after load.
pub const STAGE: Definition = Definition {
    name: "solve",
    version: VERSION,
    reads: Reads {
        rows: &[Rows::Surfaces],
        from: Cow::Borrowed("`generate` stages"),
    },
    makes: |_| Some(Rows::Loads),
    columns: || {
        let heavy = [CONTACT, PRESSURES];
        [&solved::columns(Boundary::Free, true)[..], &heavy].concat()
    },
    summary: |table| Ok(summary(table)?.into_iter().flatten().collect()),
};

/// One block of loads; warm starts go on inside it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// Effective modulus E*: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.
    pub effective_modulus: f64,
    /// What `loads` and `pressures` are measured in.
    pub load_unit: PressureUnit,
    /// Ascending, positive, not empty.
    pub loads: Vec<f64>,
    /// Largest gap in contact and penetration outside it, over rms slope × mesh step.
    pub tolerance: f64,
    /// Pairs of transforms after which one load is given up.
    pub max_pairs: u32,
    /// Which pressure fields are stored.
    pub pressures: Pressures,
    /// What lies beyond the edges of the surface; a recipe says so where that is not the surface
    /// again, as it was before there was a choice.
    #[serde(skip_serializing_if = "Boundary::is_periodic")]
    pub boundary: Boundary,
    /// The highest pressure that the material bears; a recipe has none where it is elastic under any,
    /// as all were before there was a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<GivenHardness>,
    /// The smallest hardness among the bodies, in the unit of their moduli. Whoever reads results
    /// should know where pressures pass it; it decides none, and is no part of the recipe.
    #[serde(skip)]
    pub softest_body: Option<f64>,
}

impl Params {
    fn settings(&self) -> Settings {
        Settings {
            tolerance: self.tolerance,
            pair_limit: self.max_pairs,
        }
    }

    /// What a solver is made of, in the unit in which the hardness is given.
    fn body(&self) -> HalfSpace {
        let hardness = self.hardness.as_ref();
        HalfSpace {
            boundary: self.boundary,
            hardness: hardness.and_then(|given| Hardness::new(given.pressure).ok()),
        }
    }

    /// What places all its rows, but for loads and hardness.
    fn setting(&self) -> Vec<(Column, Value)> {
        let mut setting = vec![
            (EFFECTIVE_MODULUS, Value::Real(self.effective_modulus)),
            (TOLERANCE, Value::Real(self.tolerance)),
            (MAX_PAIRS, Value::Integer(i64::from(self.max_pairs))),
        ];
        if self.boundary == Boundary::Free {
            let name = self.boundary.name().to_owned();
            setting.push((BOUNDARY, Value::Text(name)));
        }
        setting
    }

    fn keeps_pressures_at(&self, load: f64) -> bool {
        match &self.pressures {
            Pressures::None => false,
            Pressures::All => true,
            Pressures::At(loads) => loads.contains(&load),
        }
    }
}

/// What loads and hardnesses are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PressureUnit {
    /// In units of E* × rms slope.
    Relative,
    /// A pressure, in the unit of `effective_modulus`.
    Absolute,
}

/// Which pressure fields are stored.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pressures {
    /// None.
    None,
    /// One per load.
    All,
    /// Those at these loads, each one of `loads`.
    At(Vec<f64>),
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Solve
    }

    /// Presses one surface, load after load, up to the first from which on every node touches and none
    /// yields.
    ///
    /// The problem is linear and homogeneous, so the solver knows neither lengths nor moduli: heights
    /// go in in units of side × rms slope, pressures come out in units of E* × rms slope.
    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let [
            Input {
                recipe: Recipe::Generate(drawn),
                table,
            },
        ] = inputs
        else {
            unreachable!("the plan gives one surface to each block of loads")
        };
        let surface = drawn.surface(table, context.sources)?;
        let scales = Scales::of(&surface, table, self)?;
        let hardness = self.hardness.map(|given| scales.hardness(given));
        let hardness = hardness.transpose()?;
        let body = HalfSpace {
            boundary: self.boundary,
            hardness: hardness.map(|hardness| hardness.reduced),
        };
        let loads = self.loads.iter();
        let loads: Vec<f64> = loads
            .map(|&given| scales.reduced_pressure(given, self.load_unit))
            .collect();
        let heaviest = *loads.last().expect("a block has a load");
        body.hardness.map_or(Ok(()), |bound| bound.bear(heaviest))?;
        let grid = surface.grid();
        let heights = scales.reduced(surface);
        let begin = || {
            let mut solver = body.solver(grid, &heights);
            solver.work_on(context.threads.clone());
            let rows = Solved::of(hardness, solver.under_unit_pressure());
            (solver, rows)
        };
        let (mut solver, mut rows) = begin();
        if let Some(kept) = context.checkpoints.last()
            && rows.restore(&mut solver, &kept).is_err()
        {
            (solver, rows) = begin();
        }
        drop(heights);
        let expected =
            |loads: &[f64]| cost::expected_pairs(&body, scales.nodes, loads, self.tolerance);
        let done = rows.count();
        for (index, (&given, &load)) in self.loads.iter().zip(&loads).enumerate().skip(done) {
            let watch = LoadWatch {
                context,
                expected: expected(&loads[..=index]) - expected(&loads[..index]),
                shares: [&loads[..index], &loads[..=index]]
                    .map(|done| expected(done) / expected(&loads)),
                told: Cell::new(Instant::now()),
            };
            let outcome = solver.press(load, &self.settings(), &watch);
            if outcome.stop == Stop::Interrupted {
                return Err(StageError::Interrupted);
            }
            let keep = self.keeps_pressures_at(given);
            rows.push(load, outcome, solver.pressure(), keep, &scales);
            (context.advance)(watch.shares[1]);
            if outcome.stop == Stop::FullContact && solver.is_flattened_by(heaviest) {
                break;
            }
            if context.checkpoints.is_due() && index + 1 < self.loads.len() {
                let save = &mut |out: &mut dyn Write| rows.save(&solver, out);
                context.checkpoints.keep(save);
            }
        }
        Ok(rows.table(self, table, &scales))
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let columns = solved::columns(self.boundary, self.hardness.is_some());
        Ok(beside_coordinates(&columns, inputs)?)
    }

    /// Those of a boundary and of a hardness.
    fn has_columns_of_its_own(&self) -> bool {
        true
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// The peak of a run at 4096², whatever the number of threads. Besides the
    /// solver's arrays there is a bit for each node and load, and each pressure field that is kept
    /// with its nulls.
    fn footprint(&self) -> Footprint {
        let loads = self.loads.len() as f64;
        let kept = match &self.pressures {
            Pressures::None => 0.0,
            Pressures::All => loads,
            Pressures::At(loads) => loads.len() as f64,
        };
        Footprint {
            work: 1.0 + self.body().bytes_per_node(self.tolerance),
            table: loads / 8.0 + kept * (8.0 + 1.0 / 8.0),
        }
    }

    /// All but its loads, and of the hardness what is given: the other unit takes a surface.
    fn coordinates(&self) -> Vec<(Column, Value)> {
        let mut coordinates = self.setting();
        coordinates.extend(self.hardness.map(|given| given.coordinate()));
        coordinates
    }

    fn rows(&self, _: usize) -> usize {
        self.loads.len()
    }

    fn effort(&self, extent: Extent) -> Effort {
        let (body, nodes) = (self.body(), extent.nodes);
        let pairs = cost::expected_pairs(&body, nodes, &self.loads, self.tolerance);
        let effort = Effort::pairs(pairs);
        Effort {
            seconds: effort.seconds + cost::preparation(&body, nodes),
            ..effort
        }
    }

    /// The same block with no pressures kept.
    fn identity_recipe(&self) -> Option<Recipe> {
        let keeps_pressures = self.pressures != Pressures::None;
        keeps_pressures.then(|| {
            Recipe::Solve(Arc::new(Params {
                pressures: Pressures::None,
                ..self.clone()
            }))
        })
    }
}

/// Tells how much of a block is done while one of its loads is solved.
struct LoadWatch<'a> {
    context: &'a Context<'a>,
    /// Transform pairs that the load is expected to take.
    expected: f64,
    /// What is done of the block before the load, and after it.
    shares: [f64; 2],
    /// When that was told last.
    told: Cell<Instant>,
}

/// Nobody needs to be told more often; on small meshes telling would take longer than iterations.
const TELL_EVERY: Duration = Duration::from_millis(200);

impl Watch for LoadWatch<'_> {
    fn is_interrupted(&self) -> bool {
        (self.context.interrupted)()
    }

    fn spent(&self, pairs: u32) {
        if self.told.get().elapsed() < TELL_EVERY {
            return;
        }
        self.told.set(Instant::now());
        let [before, after] = self.shares;
        let done = (f64::from(pairs) / self.expected).min(1.0);
        (self.context.advance)(before + done * (after - before));
    }
}

/// What lies beyond the edges of the surface in the table of one task.
pub fn boundary(solved: &Table) -> Boundary {
    let words = solved.texts(BOUNDARY.name);
    let is_free = words.is_ok_and(|words| {
        words
            .iter()
            .flatten()
            .any(|word| word == Boundary::Free.name())
    });
    match is_free {
        true => Boundary::Free,
        false => Boundary::Periodic,
    }
}

/// The word for loads that were given up.
pub const GIVEN_UP: &str = "pair-limit";

fn summary(table: &Table) -> Result<Vec<Option<String>>, TableError> {
    let rows = table.rows();
    let pairs: i64 = table.integers(PAIRS.name)?.iter().flatten().sum();
    let among = |word: &str| -> Result<usize, TableError> {
        let stops = table.texts(STOP.name)?;
        Ok(stops.iter().filter(|stop| *stop == Some(word)).count())
    };
    let surfaces: BTreeSet<_> = table.texts(SURFACE.name)?.iter().collect();
    let given_up = among(GIVEN_UP)?;
    let full = among("full-contact")?;
    Ok(vec![
        Some(format!(
            "{} on {}",
            counted(rows, "load"),
            counted(surfaces.len(), "surface")
        )),
        Some(match given_up {
            0 => "all converged".to_owned(),
            _ => format!("{} not converged", counted(given_up, "load")),
        }),
        (full > 0).then(|| format!("{full} in full contact")),
        range(table, SATURATED_FRACTION.name, "saturated")?,
        (rows > 0).then(|| format!("{} pairs of transforms a load", pairs / rows as i64)),
    ])
}
