//! Counts contacts, or heights, and measures surfaces.
//!
//! How a density of heights varies between surfaces takes the histograms of a thousand of them, and
//! nobody looks at those one by one: as rows they would be millions. `pool` counts all surfaces of a
//! parameter point in one task that keeps sums alone. More surfaces count the old ones again, which
//! takes seconds, for they are drawn and not solved.

use std::borrow::Cow;

pub mod distributions;
pub mod keys;
pub mod statistics;
mod stiffness;

use serde::Serialize;

use super::columns::*;
use super::grids::Grids;
use super::summary::range;
use super::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reach, Reads, Recipe, Rows, Stage,
    StageError, beside_coordinates, generate, grids, solve, stacked,
};
use crate::contact::grid::Grid;
use crate::contact::morphology::area::ContactArea;
use crate::contact::morphology::clusters::Clusters;
use crate::contact::morphology::map::ContactMap;
use crate::contact::topography::histogram::{Histogram, Pool};
use crate::diagnostics::counted;
use crate::store::column::{Column, Role, flags, integers, optional_reals, reals};
use crate::store::parquet::Columns;
use crate::store::table::Table;

pub use distributions::Distribution;
use statistics::Statistic;

/// Raise it when the numbers change, or what columns say of themselves.
pub const VERSION: u32 = 3;

/// Counts contacts, or heights, and measures surfaces.
pub const STAGE: Definition = Definition {
    name: "measure",
    version: VERSION,
    reads: Reads {
        rows: &[Rows::Loads, Rows::Surfaces],
        from: Cow::Borrowed("either `solve` or `generate` stages"),
    },
    makes: |read| match read? {
        Rows::Surfaces => Some(Rows::Heights),
        _ => Some(Rows::Contacts),
    },
    columns: || {
        let contacts = contact_measures(true, true, true, true);
        let of_surfaces = statistics::all_columns();
        let distributions = distributions::all_columns();
        let lists: [&[Column]; 5] = [
            &contacts,
            &distributions,
            &HEIGHT_MEASURES,
            &POOLED_HEIGHTS[1..],
            &of_surfaces,
        ];
        lists.concat()
    },
    summary: |table| {
        let rows = Some(counted(table.rows(), "row"));
        let area = range(table, AREA_FRACTION.name, "contact covers")?;
        let heights = range(table, BIN.name, "heights from")?;
        let pressures = range(table, CONTACT_PRESSURE.name, "pressures from")?;
        let gaps = range(table, GAP.name, "gaps from")?;
        let spectrum = range(table, WAVENUMBER.name, "wavenumbers from")?;
        let slopes = range(table, SLOPE_AT_SCALE.name, "slopes from")?;
        let roughness = range(table, ROUGHNESS[0].name, "Sq")?;
        let parts = [
            rows, area, pressures, gaps, heights, spectrum, slopes, roughness,
        ];
        Ok(parts.into_iter().flatten().collect())
    },
};

/// What is measured; it follows from what the stage reads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "lowercase")]
pub enum Params {
    /// Contact maps, from a solve stage.
    Contacts {
        /// Whether the stiffness of the interface is measured, too; a recipe says so where it is, as it was
        /// before there was a choice.
        #[serde(skip_serializing_if = "not_asked")]
        stiffness: bool,
    },
    /// The distribution of heights, from a generate stage.
    Heights {
        /// Number of bins.
        bins: u32,
        /// Half width of the histogram, in rms heights.
        range: f64,
    },
    /// How that distribution varies between the surfaces of a parameter point.
    Pool {
        /// Number of bins.
        bins: u32,
        /// Half width of the histograms, in rms heights.
        range: f64,
    },
    /// Another statistic of each surface.
    #[serde(untagged)]
    Surface(Statistic),
    /// A distribution under each load, from a solve stage.
    #[serde(untagged)]
    Distribution(Distribution),
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn not_asked(asked: &bool) -> bool {
    !asked
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Measure
    }

    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        if let Params::Pool { bins, range } = *self {
            return pool(inputs, bins as usize, range, context);
        }
        let [input] = inputs else {
            unreachable!("the plan measures one table at a time")
        };
        match *self {
            Params::Heights { bins, range } => heights(input, bins as usize, range, context),
            Params::Surface(statistic) => measured(input, statistic, context),
            Params::Distribution(distribution) => distribution.of(input),
            Params::Contacts { stiffness } => contacts(&input.table, stiffness),
            Params::Pool { .. } => unreachable!("pools were told apart"),
        }
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(match self {
            Params::Contacts { stiffness } => {
                let solved = stacked(inputs)?;
                let yields = solved.has(SATURATED_NODES.name);
                let flows = solved.has(FLOW_STOP.name);
                let of_rectangles = grids::has_rectangles(&solved);
                let measures = contact_measures(of_rectangles, yields, flows, *stiffness);
                beside_coordinates(&measures, inputs)?
            }
            Params::Heights { .. } => beside_coordinates(&HEIGHT_MEASURES, inputs)?,
            Params::Surface(statistic) => beside_coordinates(&statistic.columns(), inputs)?,
            Params::Distribution(distribution) => {
                beside_coordinates(distribution.columns(), inputs)?
            }
            Params::Pool { .. } => {
                let points = stacked(inputs)?.in_role(Role::Parameter);
                let names = points.names();
                points.beside(&Table::empty(&POOLED_HEIGHTS).without(&names))
            }
        })
    }

    fn reach(&self) -> Reach {
        match self {
            Params::Contacts { .. }
            | Params::Distribution(_)
            | Params::Heights { .. }
            | Params::Surface(_) => Reach::Single,
            Params::Pool { .. } => Reach::Point,
        }
    }

    /// Pooled surfaces are drawn again, whether or not their heights were kept.
    fn columns_read(&self) -> Columns {
        match self {
            Params::Contacts { .. }
            | Params::Distribution(_)
            | Params::Heights { .. }
            | Params::Surface(_) => Columns::All,
            Params::Pool { .. } => Columns::Light,
        }
    }

    /// A surface drawn again, or the labels of clusters.
    fn footprint(&self) -> Footprint {
        let beside = match self {
            Params::Surface(statistic) => statistic.bytes_per_node(),
            Params::Contacts { .. }
            | Params::Distribution(_)
            | Params::Heights { .. }
            | Params::Pool { .. } => 0.0,
        };
        Footprint {
            work: 36.0 + beside,
            table: 0.0,
        }
    }

    /// A surface is drawn again to look at its heights; of contact there are bits to count.
    fn effort(&self, extent: Extent) -> Effort {
        Effort::pairs(match self {
            Params::Contacts { .. } | Params::Distribution(_) => 0.2 * extent.rows as f64,
            Params::Heights { .. } | Params::Pool { .. } => 6.0 * extent.tables as f64,
            Params::Surface(statistic) => 6.0 + statistic.pairs(),
        })
    }
}

/// What has been solved for and stands beside what is measured, as far as it is there.
const CARRIED: [Column; 12] = [
    SATURATED_NODES,
    SATURATED_FRACTION,
    MEAN_GAP,
    MEAN_YIELDED_DEPTH,
    FLOW_FACTOR_X,
    FLOW_FACTOR_Y,
    FLOW_CONDUCTIVITY_X,
    FLOW_CONDUCTIVITY_Y,
    FLOW_RESIDUAL,
    FLOW_STOP,
    ENERGY,
    STOP,
];

/// What is measured of contact maps, squares or rectangles, of materials that yield or not, beside flows
/// or without, with the stiffness or without.
fn contact_measures(
    of_rectangles: bool,
    yields: bool,
    flows: bool,
    stiffness: bool,
) -> Vec<Column> {
    let mut measures = CONTACT_MEASURES.to_vec();
    let gap = measures.iter().position(|column| *column == MEAN_GAP);
    let gap = gap.expect("it is measured");
    if flows {
        measures.splice(gap + 1..gap + 1, FLOW);
    }
    if stiffness {
        measures.insert(gap, STIFFNESS);
    }
    if yields {
        let gap = measures.iter().position(|column| *column == MEAN_GAP);
        let gap = gap.expect("it is measured");
        measures.insert(gap + 1, MEAN_YIELDED_DEPTH);
        measures.splice(gap..gap, [SATURATED_NODES, SATURATED_FRACTION]);
    }
    if of_rectangles {
        let before = measures.iter().position(|column| *column == SWITCHES);
        let place = before.unwrap_or(measures.len());
        measures.splice(place..place, SWITCHES_ALONG_AXES);
    }
    measures
}

fn contacts(solved: &Table, stiffness: bool) -> Result<Table, StageError> {
    let grids = Grids::of(solved)?;
    let maps = solved.bytes(CONTACT.name)?;
    let boundary = solve::boundary(solved);
    let measured = (0..solved.rows())
        .map(|row| {
            let grid = grids.grid(row)?;
            let map = ContactMap::from_bytes(grid.nodes(), maps.value(row));
            let map = map.map_err(StageError::Map)?.within(boundary);
            Ok(Contact::of(grid, &map))
        })
        .collect::<Result<Vec<_>, StageError>>()?;

    let real = |value: &dyn Fn(usize, &Contact) -> f64| {
        reals(
            measured
                .iter()
                .enumerate()
                .map(|(row, contact)| value(row, contact)),
        )
    };
    let area = |value: fn(&ContactArea) -> usize| {
        integers(measured.iter().map(|contact| value(&contact.area) as i64))
    };
    let contact = |value: fn(&Clusters) -> usize| {
        integers(
            measured
                .iter()
                .map(|contact| value(&contact.contact) as i64),
        )
    };
    let flag = |value: fn(&Contact) -> bool| flags(measured.iter().map(value));
    let load = solved.reals(LOAD.name)?;
    let pressure = solved.reals(PRESSURE.name)?;
    let mut columns = vec![
        (AREA_FRACTION, real(&|_, contact| contact.area.fraction())),
        (CONTACT_NODES, area(|area| area.contact_nodes)),
        (SWITCHES_ALONG_ROWS, area(|area| area.switches_along_rows)),
        (
            SWITCHES_ALONG_COLUMNS,
            area(|area| area.switches_along_columns),
        ),
    ];
    if grids::has_rectangles(solved) {
        columns.extend([
            (SWITCHES_X, area(|area| area.switches_along_columns)),
            (SWITCHES_Y, area(|area| area.switches_along_rows)),
        ]);
    }
    columns.extend([
        (SWITCHES, area(ContactArea::switches)),
        (
            PERIMETER_MANHATTAN,
            real(&|_, contact| contact.area.manhattan_perimeter(contact.grid)),
        ),
        (
            PERIMETER_EUCLIDEAN,
            real(&|_, contact| contact.area.euclidean_perimeter(contact.grid)),
        ),
        (EDGE_NODES_4, area(|area| area.edge_nodes_4)),
        (EDGE_NODES_8, area(|area| area.edge_nodes_8)),
        (INTERIOR_NODES, area(|area| area.interior_nodes)),
        (CLUSTERS, contact(|clusters| clusters.count)),
        (LARGEST_CLUSTER, contact(|clusters| clusters.largest)),
        (PERCOLATES_X, flag(|contact| contact.contact.around_x)),
        (PERCOLATES_Y, flag(|contact| contact.contact.around_y)),
        (GAP_PERCOLATES_X, flag(|contact| contact.gap.around_x)),
        (GAP_PERCOLATES_Y, flag(|contact| contact.gap.around_y)),
        (
            MEAN_CONTACT_PRESSURE,
            optional_reals(measured.iter().enumerate().map(|(row, contact)| {
                let touches = contact.area.contact_nodes > 0;
                touches.then(|| pressure.value(row) / contact.area.fraction())
            })),
        ),
        (
            SECANT,
            real(&|row, contact| contact.area.fraction() / load.value(row)),
        ),
    ]);
    if stiffness {
        columns.push((STIFFNESS, optional_reals(stiffnesses(solved, grids)?)));
    }
    let carried = solved.only(&CARRIED.map(|column| column.name));
    Ok(solved.coordinates().with(columns).beside(&carried))
}

/// The stiffness at each load of a block, in units of E* over the longer side.
fn stiffnesses(solved: &Table, grids: Grids) -> Result<Vec<Option<f64>>, StageError> {
    let pressures = solved.reals(PRESSURE.name)?;
    let gaps = solved.reals(MEAN_GAP.name)?;
    let moduli = solved.reals(EFFECTIVE_MODULUS.name)?;
    let stops = solved.texts(STOP.name)?;
    let approach = |row| stiffness::Approach {
        pressure: pressures.value(row),
        mean_gap: gaps.value(row),
        is_solved: stops.value(row) != solve::GIVEN_UP,
    };
    let loads: Vec<_> = (0..solved.rows()).map(approach).collect();
    let found = stiffness::of_block(&loads).into_iter().enumerate();
    found
        .map(|(row, stiffness)| {
            let side = grids.grid(row)?.cell().longer_side();
            Ok(stiffness.map(|stiffness| stiffness * side / moduli.value(row)))
        })
        .collect()
}

fn heights(input: &Input, bins: usize, range: f64, context: &Context) -> Result<Table, StageError> {
    let surface = drawn(input).surface(&input.table, context.sources)?;
    let histogram = Histogram::of(&surface, bins, range);
    let columns = vec![
        (BIN, reals(histogram.bins.iter().map(|bin| bin.center))),
        (
            COUNT,
            integers(histogram.bins.iter().map(|bin| bin.count as i64)),
        ),
        (DENSITY, reals(histogram.bins.iter().map(|bin| bin.density))),
    ];
    let rows = vec![0; histogram.bins.len()];
    Ok(input.table.coordinates().pick(&rows).with(columns))
}

fn measured(input: &Input, statistic: Statistic, context: &Context) -> Result<Table, StageError> {
    let params = drawn(input);
    let surface = params.surface(&input.table, context.sources)?;
    let (rows, columns) = statistic.of(&surface, &params.origin);
    Ok(input.table.coordinates().pick(&vec![0; rows]).with(columns))
}

fn pool(inputs: &[Input], bins: usize, range: f64, context: &Context) -> Result<Table, StageError> {
    let histogram = |input: &Input| {
        if (context.interrupted)() {
            return Err(StageError::Interrupted);
        }
        let surface = drawn(input).draw(context.sources)?;
        Ok(Pool::of(&Histogram::of(&surface, bins, range)))
    };
    let mut pooled = Pool::default();
    // As many at a time as there are threads, which others may need after these.
    for inputs in inputs.chunks(context.threads.count()) {
        let mut pools: Vec<_> = inputs.iter().map(|input| (input, None)).collect();
        let crew = context.threads.crew_of(inputs.len());
        crew.each(
            &mut Vec::new(),
            || (),
            &mut pools,
            |(), (input, pool)| {
                *pool = Some(histogram(input));
            },
        );
        for (_, pool) in pools {
            pooled = pooled.and(pool.expect("all were measured")?);
        }
    }
    let bins = pooled.bins();
    let surfaces = i64::from(pooled.surfaces());
    let columns = vec![
        (BIN, reals(bins.iter().map(|bin| bin.center))),
        (SURFACES, integers(bins.iter().map(|_| surfaces))),
        (DENSITY_MEAN, reals(bins.iter().map(|bin| bin.mean))),
        (DENSITY_SD, optional_reals(bins.iter().map(|bin| bin.sd))),
        (DENSITY_NORMAL, reals(bins.iter().map(|bin| bin.normal))),
    ];
    let point = inputs[0].table.in_role(Role::Parameter);
    Ok(point.pick(&vec![0; bins.len()]).with(columns))
}

fn drawn<'a>(input: &Input<'a>) -> &'a generate::Params {
    let Recipe::Generate(drawn) = input.recipe else {
        unreachable!("the study lets surfaces alone be measured so")
    };
    drawn
}

/// One contact map, measured.
struct Contact {
    grid: Grid,
    area: ContactArea,
    contact: Clusters,
    gap: Clusters,
}

impl Contact {
    fn of(grid: Grid, map: &ContactMap) -> Contact {
        Contact {
            grid,
            area: ContactArea::of(map),
            contact: Clusters::of_contact(map),
            gap: Clusters::of_gap(map),
        }
    }
}

#[cfg(test)]
mod tests {
    use arrow::array::Array;

    use super::*;
    use crate::store::column::{bytes, texts};

    #[test]
    fn nothing_in_contact_has_no_mean_pressure() {
        let map = |pressures: [f64; 4]| ContactMap::of_pressures([2, 2], &pressures).to_bytes();
        let maps = [map([0.0; 4]), map([0.0, 3.0, 0.0, 5.0])];
        let ones = || reals([1.0; 2]);
        let columns = vec![
            (NODES, integers([2; 2])),
            (SIDE, ones()),
            (LOAD, ones()),
            (PRESSURE, reals([2.0; 2])),
            (MEAN_GAP, ones()),
            (ENERGY, ones()),
            (STOP, texts(["converged"; 2])),
            (CONTACT, bytes(&maps)),
        ];
        let measured = contacts(&Table::new(2, columns), false).unwrap();
        let means = measured.reals(MEAN_CONTACT_PRESSURE.name).unwrap();
        assert!(means.is_null(0), "not infinite");
        assert_eq!(means.value(1), 4.0);
    }
}
