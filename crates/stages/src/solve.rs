//! Presses a surface through a block of loads.

pub mod block;
pub mod keys;
mod loads;
mod maps;
mod solved;
pub mod units;

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Serialize, Serializer};

use self::block::Block;
use self::solved::Besides;
pub use self::units::{GivenHardness, PressureUnit};
use crate::columns::*;
use crate::stage::range;
use crate::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, Rows, Stage,
    StageError, beside_coordinates,
};
use asperity_contact::asperities::Interaction;
use asperity_contact::distribution::EqualBins;
use asperity_contact::flow;
use asperity_contact::grid::Boundary;
use asperity_contact::solver::{HalfSpace, Hardness, Settings, Watch, cost};
use asperity_manifest::diagnostics::counted;
use asperity_tables::column::{Column, Value};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::table::{Table, TableError};

/// Version of the numbers, part of every key: raised whenever they change.
pub const VERSION: u32 = 16;

/// Presses surfaces, load after load.
pub const STAGE: Definition = Definition {
    name: "solve",
    version: VERSION,
    reads: Reads { rows: &[Rows::Surfaces], from: Cow::Borrowed("`generate` stages") },
    makes: |_| Some(Rows::Loads),
    columns: || {
        let heavy = [CONTACT, PRESSURES, PRESSURE_COUNTS, GAP_COUNTS];
        let all = Besides {
            boundary: Boundary::Free,
            asperities: true,
            flow: true,
            load_unit: PressureUnit::Relative,
            hardness: Some(PressureUnit::Absolute),
        };
        [&solved::columns(all)[..], &heavy].concat()
    },
    summary: |source| Ok(summary(source)?.into_iter().flatten().collect()),
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
    #[serde(skip_serializing_if = "Boundary::is_periodic", serialize_with = "boundary_recipe")]
    pub boundary: Boundary,
    /// The highest pressure that the material bears; a recipe has none where it is elastic under any,
    /// as all were before there was a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<GivenHardness>,
    /// How many nodes bear which pressure is counted in these bins, in units of E* × rms slope.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_bins: Option<EqualBins>,
    /// How many nodes out of contact have which gap is counted in these, in rms heights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_bins: Option<EqualBins>,
    /// Whether what flows through the gap is found under each load.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub flow: bool,
    /// How asperities act on each other, where Hertz' contacts of the summits stand for the solved contact;
    /// a recipe has none where the contact of every node is solved, as all were before there was a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asperities: Option<Interaction>,
    /// The smallest hardness among the bodies, in the unit of their moduli. Whoever reads results
    /// should know where pressures pass it; it decides none, and is no part of the recipe.
    #[serde(skip)]
    pub softest_body: Option<f64>,
    /// Number of entries of `bodies`, for a warning. It is not part of the recipe.
    #[serde(skip)]
    pub bodies: usize,
}

impl Params {
    fn settings(&self) -> Settings {
        Settings { tolerance: self.tolerance, pair_limit: self.max_pairs }
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
        if let Some(interaction) = self.asperities {
            let word = interaction.word().to_owned();
            setting.push((INTERACTION, Value::Text(word)));
        }
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

/// What the gap of one load costs: a pair in double precision.
const PAIRS_OF_GAP: f64 = 2.5;

/// What the flow of one load takes, along both axes, in pairs: as measured at 512² and 1024² from light
/// loads to those near percolation. Beyond them nothing flows, which takes next to no time.
const PAIRS_OF_FLOW: f64 = 900.0;

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Solve
    }

    /// Presses one surface, load after load, up to the first from which on every node touches and none
    /// yields.
    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let [Input { recipe: Recipe::Generate(drawn), table }] = inputs else {
            unreachable!("the plan gives one surface to each block of loads")
        };
        let surface = drawn.surface(table, context.sources, context.threads)?;
        if let Some(interaction) = self.asperities {
            return block::press_asperities(self, interaction, (surface, table), context);
        }
        let rms_slope = table.reals(RMS_SLOPE.name)?.value(0);
        let nodes = surface.grid().nodes();
        let kept = context.checkpoints.last();
        let threads = context.threads.clone();
        let mut block = Block::new(self, surface, rms_slope, kept.as_deref(), threads)?;
        drop(kept);
        let loads = block.loads().to_vec();
        let expected =
            |loads: &[f64]| cost::expected_pairs(&self.body(), nodes, loads, self.tolerance);
        while block.goes_on() {
            let [before, after] = [0, 1].map(|more| expected(&loads[..block.count() + more]));
            let watch = LoadWatch {
                context,
                expected: after - before,
                shares: [before, after].map(|pairs| pairs / expected(&loads)),
                told: Cell::new(Instant::now()),
            };
            block.press(&watch)?;
            (context.advance)(watch.shares[1]);
            if block.goes_on() && context.checkpoints.is_due() {
                let save = &mut |out: &mut dyn Write| block.save(out);
                context.checkpoints.keep(save);
            }
        }
        Ok(block.table(table))
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let columns = solved::columns(Besides {
            boundary: self.boundary,
            asperities: self.asperities.is_some(),
            flow: self.flow,
            load_unit: self.load_unit,
            hardness: self.hardness.map(|given| given.unit),
        });
        Ok(beside_coordinates(&columns, inputs)?)
    }

    /// Those of a boundary, of a hardness, of a flow and of asperities.
    fn has_columns_of_its_own(&self) -> bool {
        true
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// The peak of runs of ten loads at 4096², on one thread and on two: 61.5 bytes a node beyond what the
    /// program takes by itself; 58.8 of three loads at 8192². Besides the solver's arrays there is a bit for
    /// each node and load, and each pressure field that is kept with its nulls.
    fn footprint(&self) -> Footprint {
        let loads = self.loads.len() as f64;
        let kept = match &self.pressures {
            Pressures::None => 0.0,
            Pressures::All => loads,
            Pressures::At(loads) => loads.len() as f64,
        };
        let gap = match self.flow {
            // The gap, the pressure, and the gap as it is where nothing touches.
            true => 24.0 + flow::BYTES_PER_NODE,
            false => self.gap_bins.map_or(0.0, |_| 16.0),
        };
        let work = match self.asperities {
            Some(interaction) => 4.0 + block::asperity_bytes_per_node(interaction),
            None => self.body().bytes_per_node(self.tolerance),
        };
        Footprint { work: 3.0 + work + gap, table: loads / 8.0 + kept * (8.0 + 1.0 / 8.0) }
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
        if let Some(interaction) = self.asperities {
            return block::asperity_effort(interaction, self.loads.len(), nodes);
        }
        let pairs = cost::expected_pairs(&body, nodes, &self.loads, self.tolerance);
        let gaps = match (self.flow, self.gap_bins) {
            (true, _) => PAIRS_OF_GAP + PAIRS_OF_FLOW,
            (false, Some(_)) => PAIRS_OF_GAP,
            (false, None) => 0.0,
        };
        let effort = Effort::pairs(pairs + gaps * self.loads.len() as f64);
        Effort { seconds: effort.seconds + cost::preparation(&body, nodes), ..effort }
    }

    /// The same block with no pressures kept.
    fn identity_recipe(&self) -> Option<Recipe> {
        let keeps_pressures = self.pressures != Pressures::None;
        keeps_pressures
            .then(|| Recipe::Solve(Arc::new(Params { pressures: Pressures::None, ..self.clone() })))
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

/// The word for loads that were given up.
pub const GIVEN_UP: &str = "pair-limit";

fn summary(source: &TableSource) -> Result<Vec<Option<String>>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
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
        Some(format!("{} on {}", counted(rows, "load"), counted(surfaces.len(), "surface"))),
        Some(match given_up {
            0 => "all converged".to_owned(),
            _ => format!("{} not converged", counted(given_up, "load")),
        }),
        (full > 0).then(|| format!("{full} in full contact")),
        range(source, SATURATED_FRACTION.name, "saturated")?,
        (rows > 0).then(|| format!("{} pairs of transforms a load", pairs / rows as i64)),
    ])
}

/// Version of the numbers of loads that are solved with nothing beyond the edges. It is a part of their recipes
/// alone: where it is raised and that of the stage is not, periodic loads are not computed again.
const FREE_BOUNDARY_VERSION: u32 = 2;

#[derive(Serialize)]
struct BoundaryRecipe {
    beyond: Boundary,
    version: u32,
}

/// Writes what recipes say where it is not the surface again.
fn boundary_recipe<S: Serializer>(boundary: &Boundary, serializer: S) -> Result<S::Ok, S::Error> {
    let recipe = BoundaryRecipe { beyond: *boundary, version: FREE_BOUNDARY_VERSION };
    recipe.serialize(serializer)
}

/// What the table of one task says.
pub fn boundary_of(solved: &Table) -> Boundary {
    let words = solved.texts(BOUNDARY.name);
    let is_free =
        words.is_ok_and(|words| words.iter().flatten().any(|word| word == Boundary::Free.name()));
    match is_free {
        true => Boundary::Free,
        false => Boundary::Periodic,
    }
}
