//! Stages that solve the contact of surfaces under blocks of loads.

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

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use self::block::Block;
use self::solved::OptionalColumns;
pub use self::units::{GivenHardness, PressureUnit};
use crate::columns::*;
use crate::stage::range;
use crate::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, RowKind, Stage,
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

/// Version of the numbers, which is part of every key; raise it whenever they change.
pub const VERSION: u32 = 16;

/// Definition of the kind of stage `solve`.
pub const STAGE: Definition = Definition {
    name: "solve",
    version: VERSION,
    reads: Reads { rows: &[RowKind::Surfaces], from: Cow::Borrowed("`generate` stages") },
    row_kind: |_| Some(RowKind::Loads),
    columns: || {
        let heavy = [CONTACT, PRESSURES, PRESSURE_COUNTS, GAP_COUNTS];
        let all = OptionalColumns {
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

/// Parameters of one block of loads. Within a block, each load starts from earlier solutions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// Effective elastic modulus E* of the two bodies: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.
    pub effective_modulus: f64,
    /// Unit of `loads` and `pressures`.
    pub load_unit: PressureUnit,
    /// Loads, positive and in ascending order. There is at least one.
    pub loads: Vec<f64>,
    /// Largest accepted gap in contact and penetration outside contact, in units of rms slope ×
    /// mesh step.
    pub tolerance: f64,
    /// Maximum number of pairs of transforms for one load.
    pub max_pairs: u32,
    /// Pressure fields that are stored.
    pub pressures: Pressures,
    /// Boundary condition at the edges of the surface. Omitted from the recipe if periodic, so that
    /// existing keys stay valid.
    #[serde(skip_serializing_if = "Boundary::is_periodic", serialize_with = "boundary_recipe")]
    pub boundary: Boundary,
    /// Hardness of the material, if it yields. Omitted from the recipe for elastic solves, so that
    /// existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<GivenHardness>,
    /// Bins in which the pressures of contact nodes are counted, in units of E* × rms slope.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_bins: Option<EqualBins>,
    /// Bins in which the gaps of nodes outside contact are counted, in rms heights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_bins: Option<EqualBins>,
    /// True if the flow through the gap is computed under every load.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub flow: bool,
    /// Interaction of asperities, if Hertzian contacts of the summits replace the solved contact.
    /// Omitted from the recipe if the contact of every node is solved, so that existing keys stay
    /// valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asperities: Option<Interaction>,
    /// Smallest hardness among `bodies`, in the unit of their moduli, for a warning about higher
    /// pressures. It influences no result and is not part of the recipe.
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

    /// Returns the elastic body, with the hardness in the unit in which it is given.
    fn body(&self) -> HalfSpace {
        let hardness = self.hardness.as_ref();
        HalfSpace {
            boundary: self.boundary,
            hardness: hardness.and_then(|given| Hardness::new(given.pressure).ok()),
        }
    }

    /// Returns the parameter columns that all rows share, with their values, except the hardness.
    fn setting(&self) -> Vec<(Column, Value)> {
        let mut setting = vec![
            (EFFECTIVE_MODULUS, Value::Real(self.effective_modulus)),
            (TOLERANCE, Value::Real(self.tolerance)),
            (MAX_PAIRS, Value::Integer(i64::from(self.max_pairs))),
        ];
        if let Some(interaction) = self.asperities {
            let word = interaction.name().to_owned();
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

/// Pressure fields that are stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Pressures {
    /// No pressure field is stored.
    None,
    /// The pressure field under every load is stored.
    All,
    /// The pressure fields under these loads, which a manifest lists, are stored.
    #[serde(skip_deserializing)]
    At(Vec<f64>),
}

/// Cost of the gap under one load, in pairs of single-precision transforms. The gap takes one pair
/// of double-precision transforms.
const PAIRS_OF_GAP: f64 = 2.5;

/// Cost of computing the flow along both axes under one load, in pairs of transforms. It was
/// measured on 512² and 1024² nodes, from light loads to loads near percolation; a sealed gap takes
/// almost no time.
const PAIRS_OF_FLOW: f64 = 900.0;

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Solve
    }

    /// Solves the contact of one surface under the loads. Ends early if every node is in contact
    /// and none yields under all remaining loads.
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
        let checkpoint = context.checkpoints.last();
        let threads = context.threads.clone();
        let mut block = Block::new(self, surface, rms_slope, checkpoint.as_deref(), threads)?;
        drop(checkpoint);
        let loads = block.loads().to_vec();
        let expected =
            |loads: &[f64]| cost::expected_pairs(&self.body(), nodes, loads, self.tolerance);
        while block.has_next_load() {
            let [before, after] = [0, 1].map(|more| expected(&loads[..block.count() + more]));
            let watch = LoadWatch {
                context,
                expected: after - before,
                finished: [before, after].map(|pairs| pairs / expected(&loads)),
                last_report: Cell::new(Instant::now()),
            };
            block.press(&watch)?;
            (context.advance)(watch.finished[1]);
            if block.has_next_load() && context.checkpoints.is_due() {
                let save = &mut |out: &mut dyn Write| block.save(out);
                context.checkpoints.keep(save);
            }
        }
        Ok(block.table(table))
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let columns = solved::columns(OptionalColumns {
            boundary: self.boundary,
            asperities: self.asperities.is_some(),
            flow: self.flow,
            load_unit: self.load_unit,
            hardness: self.hardness.map(|given| given.unit),
        });
        Ok(beside_coordinates(&columns, inputs)?)
    }

    /// Returns true, because the columns depend on boundary, hardness, flow and asperities.
    fn columns_depend_on_params(&self) -> bool {
        true
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// Returns the memory of the solver and of the maps in the table: one bit per node and load,
    /// and the stored pressure fields with their null flags.
    ///
    /// The measured peak, without the memory of the idle program, is 61.5 bytes per node for ten
    /// loads at 4096² on one or two threads, and 58.8 for three loads at 8192².
    fn footprint(&self) -> Footprint {
        let loads = self.loads.len() as f64;
        let kept = match &self.pressures {
            Pressures::None => 0.0,
            Pressures::All => loads,
            Pressures::At(loads) => loads.len() as f64,
        };
        let gap = if self.flow {
            // The gap, the pressure, and the gap with closed contact.
            24.0 + flow::BYTES_PER_NODE
        } else {
            self.gap_bins.map_or(0.0, |_| 16.0)
        };
        let work = match self.asperities {
            Some(interaction) => 4.0 + block::asperity_bytes_per_node(interaction),
            None => self.body().bytes_per_node(self.tolerance),
        };
        Footprint { work: 3.0 + work + gap, table: loads / 8.0 + kept * (8.0 + 1.0 / 8.0) }
    }

    /// Returns all parameter columns except the loads, with their values. The hardness is included
    /// only in the given unit, because the value in the other unit depends on the surface.
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
        Effort { seconds: effort.seconds + cost::preparation_seconds(&body, nodes), ..effort }
    }

    /// Returns the recipe of the same block without stored pressures, or `None` if this block
    /// stores none.
    fn identity_recipe(&self) -> Option<Recipe> {
        let keeps_pressures = self.pressures != Pressures::None;
        keeps_pressures
            .then(|| Recipe::Solve(Arc::new(Params { pressures: Pressures::None, ..self.clone() })))
    }
}

/// Watch that reports the progress of a block while one of its loads is solved.
struct LoadWatch<'a> {
    context: &'a Context<'a>,
    /// Expected pairs of transforms of the load.
    expected: f64,
    /// Finished fraction of the block before and after the load.
    finished: [f64; 2],
    last_report: Cell<Instant>,
}

/// Minimum time between two progress reports. On small meshes a report takes longer than an
/// iteration.
const REPORT_INTERVAL: Duration = Duration::from_millis(200);

impl Watch for LoadWatch<'_> {
    fn is_interrupted(&self) -> bool {
        (self.context.interrupted)()
    }

    fn spent(&self, pairs: u32) {
        if self.last_report.get().elapsed() < REPORT_INTERVAL {
            return;
        }
        self.last_report.set(Instant::now());
        let [before, after] = self.finished;
        let done = (f64::from(pairs) / self.expected).min(1.0);
        (self.context.advance)(before + done * (after - before));
    }
}

/// Code in the column `stop` of loads that did not converge within `max_pairs` pairs of transforms.
pub const PAIR_LIMIT: &str = "pair-limit";

fn summary(source: &TableSource) -> Result<Vec<Option<String>>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
    let rows = table.rows();
    let pairs: i64 = table.integers(PAIRS.name)?.iter().flatten().sum();
    let among = |word: &str| -> Result<usize, TableError> {
        let stops = table.texts(STOP.name)?;
        Ok(stops.iter().filter(|stop| *stop == Some(word)).count())
    };
    let surfaces: BTreeSet<_> = table.texts(SURFACE.name)?.iter().collect();
    let unconverged = among(PAIR_LIMIT)?;
    let full = among("full-contact")?;
    Ok(vec![
        Some(format!("{} on {}", counted(rows, "load"), counted(surfaces.len(), "surface"))),
        Some(match unconverged {
            0 => "all converged".to_owned(),
            _ => format!("{} not converged", counted(unconverged, "load")),
        }),
        (full > 0).then(|| format!("{full} in full contact")),
        range(source, SATURATED_FRACTION.name, "saturated")?,
        (rows > 0).then(|| format!("{} pairs of transforms per load", pairs / rows as i64)),
    ])
}

/// Version of the numbers of loads with a free boundary. It is part of their recipes only, so that
/// raising it does not recompute periodic loads.
const FREE_BOUNDARY_VERSION: u32 = 2;

#[derive(Serialize)]
struct BoundaryRecipe {
    beyond: Boundary,
    version: u32,
}

/// Serializes the boundary for a recipe.
fn boundary_recipe<S: Serializer>(boundary: &Boundary, serializer: S) -> Result<S::Ok, S::Error> {
    let recipe = BoundaryRecipe { beyond: *boundary, version: FREE_BOUNDARY_VERSION };
    recipe.serialize(serializer)
}

/// Reads the boundary condition from the table of a task.
pub fn boundary_of(solved: &Table) -> Boundary {
    let words = solved.texts(BOUNDARY.name);
    let is_free =
        words.is_ok_and(|words| words.iter().flatten().any(|word| word == Boundary::Free.name()));
    if is_free { Boundary::Free } else { Boundary::Periodic }
}
