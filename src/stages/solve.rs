//! Presses a surface through a block of loads.

pub mod checks;
pub mod keys;
mod solved;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;

use serde::Serialize;

use super::columns::*;
use super::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, Rows, Stage,
    StageError, beside_coordinates,
};
use crate::contact::elasticity::{FreeHalfSpace, PeriodicHalfSpace};
use crate::contact::grid::Boundary;
use crate::contact::solver::{Settings, Solver, Stop, bytes_per_node, cost};
use crate::diagnostics::counted;
use crate::store::column::{Column, Value};
use crate::store::parquet::Columns;
use crate::store::table::{Table, TableError};
use solved::{Scales, Solved};

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
        [&solved::columns(Boundary::Free)[..], &heavy].concat()
    },
    summary: |table| Ok(summary(table)?.into_iter().flatten().collect()),
};

/// One block of loads; warm starts go on inside it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// Effective modulus E*: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.
    pub effective_modulus: f64,
    /// What `loads` and `pressures` are measured in.
    pub load_unit: LoadUnit,
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
}

impl Params {
    fn settings(&self) -> Settings {
        Settings {
            tolerance: self.tolerance,
            pair_limit: self.max_pairs,
        }
    }

    fn keeps_pressures_at(&self, load: f64) -> bool {
        match &self.pressures {
            Pressures::None => false,
            Pressures::All => true,
            Pressures::At(loads) => loads.contains(&load),
        }
    }
}

/// What a load is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LoadUnit {
    /// In units of E* × rms slope.
    Relative,
    /// A mean pressure, in the unit of `effective_modulus`.
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

    /// Presses one surface, load after load, up to the first at which every node touches.
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
        let grid = surface.grid();
        let heights = scales.reduced(surface);
        let begin = || match self.boundary {
            Boundary::Periodic => {
                let body = PeriodicHalfSpace::new(grid);
                (Solver::new(body, &heights), Solved::default())
            }
            Boundary::Free => {
                let body = FreeHalfSpace::new(grid);
                let rows = Solved::absolute(&body);
                (Solver::new(body, &heights), rows)
            }
        };
        let (mut solver, mut rows) = begin();
        if let Some(kept) = context.checkpoints.last()
            && rows.restore(&mut solver, &kept).is_err()
        {
            (solver, rows) = begin();
        }
        drop(heights);
        let expected = |loads: &[f64]| cost::expected_pairs(scales.nodes, loads, self.tolerance);
        for (index, &given) in self.loads.iter().enumerate().skip(rows.count()) {
            let load = scales.load(given, self.load_unit);
            let outcome = solver.press(load, &self.settings(), context.interrupted);
            if outcome.stop == Stop::Interrupted {
                return Err(StageError::Interrupted);
            }
            let keep = self.keeps_pressures_at(given);
            rows.push(load, outcome, solver.pressure(), keep, &scales);
            (context.advance)(expected(&self.loads[..=index]) / expected(&self.loads));
            if outcome.stop == Stop::FullContact {
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
        Ok(beside_coordinates(&solved::columns(self.boundary), inputs)?)
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// The peak of a run on one thread, at 512² and 1024². Besides the
    /// solver's arrays there is a bit for each node and load, and each pressure field that is kept
    /// with its nulls.
    fn footprint(&self) -> Footprint {
        let loads = self.loads.len() as f64;
        let kept = match &self.pressures {
            Pressures::None => 0.0,
            Pressures::All => loads,
            Pressures::At(loads) => loads.len() as f64,
        };
        let mesh = match self.boundary {
            Boundary::Periodic => 0.0,
            Boundary::Free => DOUBLED_MESH,
        };
        Footprint {
            work: 5.0 + bytes_per_node(self.tolerance) + mesh,
            table: loads / 8.0 + kept * (8.0 + 1.0 / 8.0),
        }
    }

    /// All but its loads.
    fn coordinates(&self) -> Vec<(Column, Value)> {
        let mut coordinates = vec![
            (EFFECTIVE_MODULUS, Value::Real(self.effective_modulus)),
            (TOLERANCE, Value::Real(self.tolerance)),
            (MAX_PAIRS, Value::Integer(i64::from(self.max_pairs))),
        ];
        if self.boundary == Boundary::Free {
            let name = self.boundary.name().to_owned();
            coordinates.push((BOUNDARY, Value::Text(name)));
        }
        coordinates
    }

    fn rows(&self, _: usize) -> usize {
        self.loads.len()
    }

    fn effort(&self, extent: Extent) -> Effort {
        let pairs = cost::expected_pairs(extent.nodes, &self.loads, self.tolerance);
        Effort::pairs(match self.boundary {
            Boundary::Periodic => pairs,
            Boundary::Free => pairs * FREE_OVER_PERIODIC,
        })
    }

    /// The same block with no pressures kept.
    fn without_extras(&self) -> Option<Recipe> {
        let keeps_pressures = self.pressures != Pressures::None;
        keeps_pressures.then(|| {
            Recipe::Solve(Arc::new(Params {
                pressures: Pressures::None,
                ..self.clone()
            }))
        })
    }
}

/// What a pair on a mesh of twice the nodes along both axes takes, most of which are known to be zero,
/// over one on the mesh itself.
const FREE_OVER_PERIODIC: f64 = 3.0;

/// Bytes that a mesh of twice the nodes along both axes adds for each node, at the peak of a run on
/// 1024² and 2048² nodes.
const DOUBLED_MESH: f64 = 105.0;

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
        (rows > 0).then(|| format!("{} pairs of transforms a load", pairs / rows as i64)),
    ])
}
