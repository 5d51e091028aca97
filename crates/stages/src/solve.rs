//! Stages that solve the contact of surfaces under loads.
//!
//! Each load is solved on its own: its row is a function of the surface, the load and the settings.
//! The rows of a table are therefore a series, of which the store keeps single rows. Flow, stored
//! pressures and counts in bins are parts of the rows, and can be added later.

pub mod adhesion;
mod asperities;
mod contact;
pub mod exceeded_hardness;
mod fields;
pub mod keys;
pub mod layer;
mod parallel;
mod parts;
mod rows;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use crate::bodies::{Bodies, LayerConduction};
use crate::columns::*;
use crate::nominal_area::{self, NominalArea};
use crate::per_axis::PerAxis;
use crate::reduced_units::{FREE_BOUNDARY_VERSION, GivenHardness, HARDNESS_VERSION, PressureUnit};
use crate::stage::range;
use crate::surface::pair;
use crate::unloading::Branch;
use crate::version::{PartVersion, Version};
use crate::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, RowKind, Series,
    Stage, StageError, beside_coordinates,
};
use asperity_manifest::diagnostics::counted;
use asperity_manifest::keys::quantity;
use asperity_mechanics::asperities::Interaction;
use asperity_mechanics::distribution::EqualBins;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::solver::{Body, Elastic, Hardness, Settings, cost};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, Role, Value};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::store::series::{Part, SeriesRows};
use asperity_tables::table::{Table, TableError};

pub use self::contact::{Contact, gap_under};
pub use self::fields::ContactFields;
pub use self::layer::GivenLayer;
pub use self::rows::SolvedLoad;

/// Version of the numbers, which is part of every key; raise it whenever they change.
pub const VERSION: Version = Version::new(17, &[]);

/// Differences between the loads in the manifest and the loads that are solved, for warnings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ListedLoads {
    /// True if the list does not ascend.
    pub is_unsorted: bool,
    /// Loads that the list repeats, in ascending order.
    pub repeated: Vec<f64>,
    /// True if the loads are plain numbers and `load_unit` is left out, although other pressures of
    /// the stage have a unit.
    pub lack_unit: bool,
    /// Start of a range, which is not one of its loads.
    pub start: Option<f64>,
}

/// Definition of the kind of stage `solve`.
pub const STAGE: Definition = Definition {
    name: "solve",
    version: VERSION,
    reads: Reads { rows: &[RowKind::Surfaces], from: Cow::Borrowed("`generate` stages") },
    row_kind: |_| Some(RowKind::Loads),
    columns: || {
        let settings = [EFFECTIVE_MODULUS, TOLERANCE, MAX_PAIRS, PRESSURE_UNIT, BOUNDARY];
        let hardness = PressureUnit::Absolute.hardness_columns();
        let further = [INTERACTION, LOADING_BRANCH, MAXIMUM_LOAD];
        let elastic = rows::columns().all();
        let stiffness = [FROZEN_STIFFNESS, UNLOADING_STIFFNESS, CONTACT_CONDUCTANCE];
        let heavy = [CONTACT, PRESSURES, PRESSURE_COUNTS, GAP_COUNTS, REPULSIVE, GAPS];
        let settings = [&settings[..], &LAYER_PARAMETERS, &further, &hardness].concat();
        let mut columns = [&settings[..], &elastic, &FLOW, &stiffness].concat();
        for adhesive in adhesion::all_columns() {
            if !columns.contains(&adhesive) {
                columns.push(adhesive);
            }
        }
        [columns, heavy.to_vec()].concat()
    },
    summary: |source, _| Ok(summary(source)?.into_iter().flatten().collect()),
};

/// Parameters of the loads on one surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Params {
    /// Effective elastic modulus E* of the two bodies: 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂.
    pub effective_modulus: f64,
    /// Quantity that the contact prescribes.
    #[serde(skip_serializing_if = "Control::is_load", serialize_with = "control_recipe")]
    pub control: Control,
    /// Unit of `loads` and `pressures`, if loads are prescribed.
    pub load_unit: PressureUnit,
    /// Symbol of the unit of all pressures, which is a label. Omitted from the recipe if the
    /// manifest names none, so that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_unit: Option<&'static str>,
    /// Force on the nominal area under the pressure 1 in newtons, if the manifest gives loads as
    /// forces, which are mean pressures in `loads`, or if loads are results with units. Only
    /// surfaces with this area are pressed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub newtons: Option<f64>,
    /// Loads, positive and in ascending order, or mean gaps or displacements in the unit of length
    /// if `control` prescribes these. There is at least one, except in the recipe that all loads
    /// share.
    #[serde(skip_serializing_if = "Vec::is_empty")]
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
    #[serde(
        skip_serializing_if = "Boundary::is_periodic",
        serialize_with = "crate::reduced_units::serialize_free_boundary"
    )]
    pub boundary: Boundary,
    /// Layer between the rough surface and the rest of the body. Omitted from the recipe of a
    /// half-space, so that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<GivenLayer>,
    /// Hardness of the material, if it yields. Omitted from the recipe for elastic solves, so that
    /// existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardness: Option<GivenHardness>,
    /// Part of a path of loads that goes up and down; `None` without the key `path`. Only a
    /// material with a hardness has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub branch: Option<Branch>,
    /// Bins in which the pressures of contact nodes are counted, in units of E* × rms slope.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_bins: Option<EqualBins>,
    /// Bins in which the gaps of nodes outside contact are counted, in rms heights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_bins: Option<EqualBins>,
    /// True if the flow through the gap is computed under every load.
    #[serde(skip_serializing_if = "std::ops::Not::not", serialize_with = "flow_recipe")]
    pub flow: bool,
    /// Stiffness of the contact that is computed under every load.
    #[serde(skip_serializing_if = "Stiffness::is_none", serialize_with = "stiffness_recipe")]
    pub stiffness: Stiffness,
    /// Conduction through the layer, whose conductance is computed under every load. Omitted from
    /// the recipe if conductivities are not given, so that existing keys stay valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer_conduction: Option<LayerConduction>,
    /// Interaction of asperities, if Hertzian contacts of the summits replace the solved contact.
    /// Omitted from the recipe if the contact of every node is solved, so that existing keys stay
    /// valid.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "asperities_recipe")]
    pub asperities: Option<Interaction>,
    /// Shift of the second surface along x and y in fractions of the sides, if two rough surfaces
    /// are pressed against each other. Omitted from the recipe if not, so that existing keys stay
    /// valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<PerAxis<f64>>,
    /// Properties of `bodies` that change no solved load. They are not part of the recipe.
    #[serde(skip)]
    pub bodies: Bodies,
    /// Differences between the loads in the manifest and `loads`, for warnings. They are not part
    /// of the recipe.
    #[serde(skip)]
    pub listed: ListedLoads,
}

impl Params {
    fn settings(&self) -> Settings {
        Settings { tolerance: self.tolerance, pair_limit: self.max_pairs }
    }

    /// Returns a body with the costs of the contact below cells with this longer side. The hardness
    /// is in the unit in which it is given.
    fn body(&self, longer_side: f64) -> Body {
        let hardness = self.hardness.as_ref();
        let layer = self.layer.and_then(|layer| layer.below(longer_side).ok());
        Body {
            elastic: layer.map_or(self.boundary.into(), Elastic::Layer),
            hardness: hardness.and_then(|given| Hardness::new(given.pressure).ok()),
        }
    }

    /// Returns the expected number of pairs of transforms for one load with its parts.
    fn pairs_per_load(&self, longer_side: f64) -> f64 {
        let loads = if self.control.is_load() { 1.0 } else { LOADS_OF_SEARCH };
        let of_load = cost::pairs_per_load(&self.body(longer_side), self.tolerance);
        loads * of_load + self.pairs_of_parts()
    }

    /// Returns the parameter columns that all rows share, with their values, except the hardness.
    fn setting(&self) -> Vec<(Column, Value)> {
        let mut setting = vec![
            (EFFECTIVE_MODULUS, Value::Real(self.effective_modulus)),
            (TOLERANCE, Value::Real(self.tolerance)),
            (MAX_PAIRS, Value::Integer(i64::from(self.max_pairs))),
        ];
        if let Some(unit) = self.pressure_unit {
            setting.push((PRESSURE_UNIT, Value::Text(unit.to_owned())));
        }
        if let Some(interaction) = self.asperities {
            let word = interaction.name().to_owned();
            setting.push((INTERACTION, Value::Text(word)));
        }
        if self.boundary == Boundary::Free {
            let name = self.boundary.name().to_owned();
            setting.push((BOUNDARY, Value::Text(name)));
        }
        if !self.control.is_load() {
            setting.push((CONTROL, Value::Text(self.control.name().to_owned())));
        }
        setting.extend(self.branch.into_iter().flat_map(|branch| branch.setting(self.load_unit)));
        setting.extend(self.layer.iter().flat_map(GivenLayer::coordinates));
        setting
    }

    /// Returns the column that identifies loads: that of the load in the unit of the manifest, or
    /// of the quantity that the contact prescribes.
    pub fn load_column(&self) -> Column {
        let [reduced, absolute] = self.load_unit.load_columns();
        match (self.control, self.load_unit) {
            (Control::Load, PressureUnit::Relative) => reduced,
            (Control::Load, PressureUnit::Absolute) => absolute,
            (Control::Gap, _) => PRESCRIBED_GAP.with_role(Role::Load),
            (Control::Displacement, _) => PRESCRIBED_DISPLACEMENT.with_role(Role::Load),
        }
    }

    /// Returns the symbol of the unit of the loads; `None` for reduced loads, for prescribed
    /// lengths, and if the manifest names no unit.
    pub fn unit_of_loads(&self) -> Option<&'static str> {
        let is_pressure = self.control.is_load() && self.load_unit == PressureUnit::Absolute;
        self.pressure_unit.filter(|_| is_pressure)
    }

    /// Turns loads that are forces into mean pressures; without `newtons` they are not forces.
    fn under_forces(self, newtons: Option<f64>) -> Params {
        if !self.control.is_load() {
            return Params { newtons, ..self };
        }
        let pressures = |loads: &[f64]| nominal_area::pressures(loads, newtons);
        Params {
            newtons,
            loads: pressures(&self.loads),
            pressures: match &self.pressures {
                Pressures::At(loads) => Pressures::At(pressures(loads)),
                word => word.clone(),
            },
            listed: ListedLoads {
                repeated: pressures(&self.listed.repeated),
                start: self.listed.start.and_then(|start| pressures(&[start]).pop()),
                ..self.listed
            },
            ..self
        }
    }

    /// Returns the same contact on another nominal area, with loads that are the same forces.
    pub fn on_area(&self, area: &NominalArea) -> Params {
        let after = self.pressure_unit.and_then(|unit| area.newtons(unit));
        let (Some(before), Some(after)) = (self.newtons, after) else { return self.clone() };
        if !self.control.is_load() {
            return Params { newtons: Some(after), ..self.clone() };
        }
        let moved = |load: &f64| nominal_area::pressure(nominal_area::force(*load, before), after);
        Params {
            newtons: Some(after),
            loads: self.loads.iter().map(moved).collect(),
            branch: self.branch.map(|branch| match branch {
                Branch::Loading => Branch::Loading,
                Branch::Unloading(largest) => Branch::Unloading(moved(&largest)),
            }),
            ..self.clone()
        }
    }

    /// Returns a load as the manifest gives it, which may be a force.
    pub fn given_load(&self, load: f64) -> f64 {
        let newtons = self.newtons.filter(|_| self.control.is_load());
        newtons.map_or(load, |newtons| nominal_area::force(load, newtons))
    }

    /// Returns the loads as the manifest gives them, which may be forces.
    pub fn given_loads(&self) -> Vec<f64> {
        self.loads.iter().map(|load| self.given_load(*load)).collect()
    }

    /// Returns the symbol of the unit of [`Params::given_loads`].
    pub fn unit_of_given_loads(&self) -> Option<&'static str> {
        let newtons = self.newtons.filter(|_| self.control.is_load());
        newtons.map(|_| "N").or(self.unit_of_loads())
    }

    /// Formats a load as the manifest gives it: `0.02`, `10 MPa`, `10 N`.
    pub fn written_load(&self, load: f64) -> String {
        quantity::written(self.given_load(load), self.unit_of_given_loads())
    }

    /// Returns whether both are the same contact but for their loads: parts of one path, or blocks
    /// of one list of loads.
    pub fn is_same_contact(&self, other: &Params) -> bool {
        let of_contact = |params: &Params| {
            let (loads, listed) = (Vec::new(), ListedLoads::default());
            Params { branch: None, loads, listed, ..params.clone() }
        };
        of_contact(self) == of_contact(other)
    }

    fn keeps_pressures_at(&self, load: f64) -> bool {
        match &self.pressures {
            Pressures::None => false,
            Pressures::All => true,
            Pressures::At(loads) => loads.contains(&load),
        }
    }
}

/// Stiffness of the contact that is computed under every load.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub enum Stiffness {
    #[default]
    None,
    /// The stiffness under a further increase of the load.
    Loading,
    /// Also the stiffness under a decrease of the load, for a material with a hardness.
    LoadingAndUnloading,
}

impl Stiffness {
    pub fn is_none(&self) -> bool {
        *self == Stiffness::None
    }
}

/// Pressure fields that are stored.
#[derive(Debug, Default, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Pressures {
    /// No pressure field is stored.
    #[default]
    None,
    /// The pressure field under every load is stored.
    All,
    /// The pressure fields under these loads, which a manifest lists, are stored.
    #[serde(skip_deserializing)]
    At(Vec<f64>),
}

/// Ratio of the time to find the load of a prescribed gap or displacement to that of a load.
const LOADS_OF_SEARCH: f64 = 2.5;

/// Memory for the contact map of a load and other results, in bytes per node.
const WORK_BYTES_PER_NODE: f64 = 3.0;

/// Returns the surface of a task, and its row in the table of its stage.
fn pressed<'a>(inputs: &'a [Input], context: &Context) -> Result<(Surface, &'a Table), StageError> {
    let [Input { recipe: Recipe::Generate(drawn), table, .. }] = inputs else {
        unreachable!("the plan gives one surface to each task")
    };
    Ok((drawn.surface(table, context.sources, context.threads)?, table))
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Solve
    }

    fn part_versions(&self) -> Vec<PartVersion> {
        vec![
            PartVersion::new("control", "prescribed lengths", PRESCRIBED_VERSION),
            PartVersion::new("boundary", "free boundary", FREE_BOUNDARY_VERSION),
            PartVersion::new("layer", "layer", layer::VERSION),
            PartVersion::new("hardness", "hardness", HARDNESS_VERSION),
            PartVersion::new("flow", "flow", parts::FLOW_VERSION),
            PartVersion::new("asperities", "asperity models", ASPERITIES_VERSION),
        ]
    }

    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let (surface, table) = pressed(inputs, context)?;
        match self.asperities {
            Some(interaction) => asperities::solve(self, interaction, surface, table, context),
            None => contact::solve(self, surface, table, context),
        }
    }

    fn reads_input(&self, input: &Recipe) -> bool {
        pair::is_at(self.shift, input)
            && nominal_area::is_of(input, self.newtons, self.pressure_unit)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        let hardness = self.hardness.map(|given| given.unit.hardness_columns());
        let mut columns: Vec<Column> =
            self.setting().into_iter().map(|(column, _)| column).collect();
        columns.extend(hardness.into_iter().flatten());
        columns.extend(rows::columns().of(self));
        if self.flow {
            columns.extend(FLOW);
        }
        if !self.stiffness.is_none() {
            columns.push(FROZEN_STIFFNESS);
        }
        if self.stiffness == Stiffness::LoadingAndUnloading {
            columns.push(UNLOADING_STIFFNESS);
        }
        if self.layer_conduction.is_some() {
            columns.push(CONTACT_CONDUCTANCE);
        }
        Ok(beside_coordinates(&columns, inputs)?)
    }

    /// Returns true, because the columns depend on boundary, hardness, flow and asperities.
    fn columns_depend_on_params(&self) -> bool {
        true
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    /// Returns the memory of one solver and of the maps in the table: one bit per node and load,
    /// and the stored pressure fields with their null flags.
    ///
    /// The measured peak at 4096², without the memory of the idle program, is 53 bytes per node on
    /// one core, and 87 on two cores that solve different loads.
    fn footprint(&self) -> Footprint {
        let loads = self.loads.len() as f64;
        let kept = match &self.pressures {
            Pressures::None => 0.0,
            Pressures::All => loads,
            Pressures::At(loads) => loads.len() as f64,
        };
        let solver = match self.asperities {
            Some(interaction) => 4.0 + asperities::bytes_per_node(interaction),
            // A layer needs as much as a half-space.
            None => self.body(1.0).bytes_per_node(self.tolerance),
        };
        Footprint {
            work: WORK_BYTES_PER_NODE + solver + self.part_bytes_per_node(),
            table: loads / 8.0 + kept * (8.0 + 1.0 / 8.0),
        }
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
        let Extent { nodes, longer_side, .. } = extent;
        if let Some(interaction) = self.asperities {
            return asperities::effort(interaction, self.loads.len(), nodes);
        }
        let effort = Effort::pairs(self.pairs_per_load(longer_side) * self.loads.len() as f64);
        let preparation = cost::preparation_seconds(&self.body(longer_side), nodes);
        Effort { seconds: effort.seconds + preparation, ..effort }
    }

    /// Returns the recipe without parts, or `None` if this recipe has none.
    fn identity_recipe(&self) -> Option<Recipe> {
        let identity = self.with_parts(|_| false);
        (identity != *self).then(|| Recipe::Solve(Arc::new(identity)))
    }

    /// Returns the loads, whose rows do not depend on each other.
    fn series(&self, _: Option<&SeriesRows>) -> Option<Series> {
        let shared = Params { loads: Vec::new(), ..self.with_parts(|_| false) };
        Some(Series {
            recipe: Recipe::Solve(Arc::new(shared)),
            rows: SeriesRows {
                column: self.load_column().name,
                values: self.loads.clone(),
                parts: parts::requested(self),
            },
        })
    }

    fn restricted(&self, values: &[f64], wanted: &dyn Fn(&Part) -> bool) -> Option<Recipe> {
        let restricted = Params { loads: values.to_vec(), ..self.clone() };
        Some(Recipe::Solve(Arc::new(restricted.with_parts(wanted))))
    }

    /// Returns the stored pressures.
    fn source_part(&self) -> Option<Part> {
        Some(parts::pressures())
    }
}

/// Code in the column `stop` of loads that did not converge within `max_pairs` pairs of transforms.
pub const PAIR_LIMIT: &str = "pair-limit";

/// Code in the column `stop` of contacts whose surfaces do not touch at the prescribed mean gap.
pub const NO_CONTACT: &str = "no-contact";

/// Code in the column `stop` of contacts whose mean gap or displacement is not the prescribed one.
pub const NOT_REACHED: &str = "not-reached";

/// Codes in the column `stop` of loads whose solution is not that of the prescribed load or gap.
pub const UNCONVERGED: [&str; 4] =
    [PAIR_LIMIT, NOT_REACHED, adhesion::STALLED, adhesion::GAP_NOT_REACHED];

/// Returns whether a code of the column `stop` is that of a load that did not converge.
pub fn is_unconverged(stop: &str) -> bool {
    UNCONVERGED.contains(&stop)
}

/// Largest number of nodes in contact with which area and stiffness are those of the mesh.
const FEW_NODES: i64 = 2;

fn summary(source: &TableSource) -> Result<Vec<Option<String>>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
    let rows = table.rows();
    let pairs: i64 = table.integers(PAIRS.name)?.iter().flatten().sum();
    let among = |word: &str| -> Result<usize, TableError> {
        let stops = table.texts(STOP.name)?;
        Ok(stops.iter().filter(|stop| *stop == Some(word)).count())
    };
    let surfaces: BTreeSet<_> = table.texts(SURFACE.name)?.iter().collect();
    let solved = if table.has(STEP.name) { "state" } else { "load" };
    let unconverged: usize = UNCONVERGED.into_iter().map(among).sum::<Result<_, _>>()?;
    let [full, apart, untouched] =
        [among("full-contact")?, among(adhesion::PULLED_OFF)?, among(NO_CONTACT)?];
    let nodes = table.integers(CONTACT_NODES.name)?.iter().flatten();
    let few = nodes.filter(|nodes| (1..=FEW_NODES).contains(nodes)).count();
    Ok(vec![
        Some(format!("{} on {}", counted(rows, solved), counted(surfaces.len(), "surface"))),
        Some(match unconverged {
            0 => "all converged".to_owned(),
            _ => format!("{} not converged", counted(unconverged, solved)),
        }),
        (full > 0).then(|| format!("{full} in full contact")),
        (apart > 0).then(|| format!("{apart} pulled off")),
        (untouched > 0).then(|| format!("{untouched} without contact")),
        (few > 0).then(|| format!("{few} with at most {FEW_NODES} nodes in contact")),
        range(source, SATURATED_FRACTION.name, "saturated")?,
        (rows > 0).then(|| {
            let pairs = counted(pairs as usize / rows, "pair");
            format!("{pairs} of transforms per {solved}")
        }),
    ])
}

/// Serializes the stiffness for a recipe, as `true` for elastic contacts.
fn stiffness_recipe<S: Serializer>(
    stiffness: &Stiffness,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match stiffness {
        Stiffness::LoadingAndUnloading => serializer.serialize_str("loading and unloading"),
        other => serializer.serialize_bool(!other.is_none()),
    }
}

/// Serializes the flow for a recipe, as the version of its numbers.
fn flow_recipe<S: Serializer>(_: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u32(parts::FLOW_VERSION.number())
}

/// Version of the numbers of prescribed gaps and displacements. Only their recipes contain it.
pub const PRESCRIBED_VERSION: Version = Version::new(
    1,
    &["a value at which all nodes in contact have yielded has the load on these nodes"],
);

/// Serializes a control other than loads for a recipe, with the version of its numbers.
fn control_recipe<S: Serializer>(control: &Control, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{}_{}", control.name(), PRESCRIBED_VERSION.number()))
}

/// Version of the numbers of asperity models. Only their recipes contain it.
const ASPERITIES_VERSION: Version = Version::new(2, &[]);

#[derive(Serialize)]
struct AsperitiesRecipe {
    interaction: Interaction,
    version: u32,
}

/// Serializes the interaction of asperities for a recipe.
fn asperities_recipe<S: Serializer>(
    interaction: &Option<Interaction>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let recipe = interaction
        .map(|interaction| AsperitiesRecipe { interaction, version: ASPERITIES_VERSION.number() });
    recipe.serialize(serializer)
}

/// Returns the limit of pairs of transforms with which contacts were solved.
fn max_pairs(solved: &Table) -> Result<u32, TableError> {
    let pairs = solved.integers(MAX_PAIRS.name)?.value(0);
    Ok(u32::try_from(pairs).unwrap_or(u32::MAX))
}

/// Reads the boundary condition from the table of a task.
pub fn boundary_of(solved: &Table) -> Boundary {
    let is_free = |word: &str| word == Boundary::Free.name();
    let words = solved.texts(BOUNDARY.name);
    if words.is_ok_and(|words| words.iter().flatten().any(is_free)) {
        Boundary::Free
    } else {
        Boundary::Periodic
    }
}

/// The quantity that a contact prescribes, the value of `control`.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// The mean pressure is prescribed, and the mean gap follows.
    #[default]
    Load,
    /// The mean gap is prescribed, and the mean pressure follows.
    Gap,
    /// The rigid approach of the bodies since first touch is prescribed, and the mean pressure
    /// follows.
    Displacement,
}

impl Control {
    /// Returns the word in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Control::Load => "load",
            Control::Gap => "gap",
            Control::Displacement => "displacement",
        }
    }

    /// Returns whether loads are prescribed. Recipes omit this control, so that existing keys stay
    /// valid.
    pub fn is_load(&self) -> bool {
        *self == Control::Load
    }

    /// Returns the key with the prescribed values.
    pub fn key(self) -> &'static str {
        match self {
            Control::Load => "loads",
            Control::Gap => "gaps",
            Control::Displacement => "displacements",
        }
    }

    /// Returns the name of a prescribed value in texts.
    pub fn value_in_words(self) -> &'static str {
        match self {
            Control::Load => "load",
            Control::Gap => "mean gap",
            Control::Displacement => "displacement",
        }
    }
}
