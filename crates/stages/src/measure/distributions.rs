//! Distributions of pressures, gaps and contact clusters under each load.
//!
//! A table has one row for each surface, load and bin. Pressures and gaps are counted by the task
//! that solves for them, and clusters are found in its contact maps. An `aggregate` stage grouped
//! by load and bin computes means over surfaces with confidence intervals, because the counts of
//! different surfaces are independent and the nodes of one surface are not.

use std::f64::consts::{LN_10, PI};

use arrow::array::{Array, ArrayRef, AsArray};
use arrow::datatypes::Float64Type;
use serde::Serialize;

use crate::columns::*;
use crate::grids::Grids;
use crate::{Input, Recipe, StageError, solve};
use asperity_mechanics::distribution::EqualBins;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::clusters::Cluster;
use asperity_mechanics::theory::persson;
use asperity_tables::column::{Column, integers, optional_reals, reals};
use asperity_tables::table::Table;

/// Quantity whose distribution is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "lowercase")]
pub enum Distribution {
    /// Pressures of the nodes in contact.
    Pressures,
    /// Gaps of nodes outside contact.
    Gaps,
    /// Areas of the clusters of contact nodes.
    Clusters {
        /// Number of bins per decade.
        bins: u32,
    },
}

/// Returns the columns of all distributions.
pub fn all_columns() -> Vec<Column> {
    [&PRESSURE_DISTRIBUTION[..], &GAP_DISTRIBUTION, &CLUSTER_DISTRIBUTION].concat()
}

impl Distribution {
    /// Returns the columns without the parameter columns of the loads. `attracts` tells that the
    /// surfaces have adhesion.
    pub fn columns(&self, attracts: bool) -> &'static [Column] {
        match self {
            Distribution::Pressures if attracts => &ADHESIVE_PRESSURE_DISTRIBUTION,
            Distribution::Pressures => &PRESSURE_DISTRIBUTION,
            Distribution::Gaps => &GAP_DISTRIBUTION,
            Distribution::Clusters { .. } => &CLUSTER_DISTRIBUTION,
        }
    }

    /// Measures the distribution under each load of a solved block.
    ///
    /// # Errors
    /// Returns an error if the block lacks a column or a contact map does not fit its mesh.
    pub fn measure(&self, solved: &Input) -> Result<Table, StageError> {
        let bins = solved.recipe.bins();
        let bins = |index: usize| bins[index].expect("validation requires the bins");
        let (rows, columns) = match *self {
            Distribution::Pressures => {
                let attracts = matches!(solved.recipe, Recipe::Adhesion(_));
                pressures(&solved.table, bins(0), attracts)?
            }
            Distribution::Gaps => gaps(&solved.table, bins(1))?,
            Distribution::Clusters { bins } => clusters(&solved.table, bins)?,
        };
        Ok(solved.table.coordinates().pick(&rows).with(columns))
    }
}

/// Rows of a distribution: the index of each row's load, and the columns.
type Distributed = (Vec<usize>, Vec<(Column, ArrayRef)>);

/// Number of nodes in one bin under one load.
struct Counted {
    load: usize,
    /// Index of the bin, which is negative for bins of negative pressures.
    bin: i64,
    nodes: u64,
    /// Number of nodes whose values lie above all bins.
    beyond: u64,
    /// Number of nodes for which the probability density in the bin would be 1.
    unit: f64,
}

/// Reads the numbers of nodes from a column of counts, by load and bin. A load without counts has
/// none, because its surfaces are apart.
fn counted(solved: &Table, column: Column, bins: EqualBins) -> Result<Vec<Counted>, StageError> {
    let grids = Grids::new(solved)?;
    let lists = solved.lists(column.name)?;
    let mut counted = Vec::with_capacity(lists.len() * bins.count as usize);
    for load in 0..lists.len() {
        let list = lists.value(load);
        let counts = list.as_primitive::<Float64Type>().values();
        let unit = bins.width() * grids.grid(load)?.count() as f64;
        let Some((beyond, counts)) = counts.split_last().filter(|_| lists.is_valid(load)) else {
            continue;
        };
        let first = i64::from(bins.count) - counts.len() as i64;
        counted.extend((first..).zip(counts).map(|(bin, nodes)| Counted {
            load,
            bin,
            nodes: *nodes as u64,
            beyond: *beyond as u64,
            unit,
        }));
    }
    Ok(counted)
}

fn pressures(solved: &Table, bins: EqualBins, attracts: bool) -> Result<Distributed, StageError> {
    let counted = counted(solved, PRESSURE_COUNTS, bins)?;
    let loads = solved.reals(LOAD.name)?;
    let persson = |of: &Counted| {
        let [low, high] = [of.bin, of.bin + 1].map(|edge| bins.edge(edge as u32));
        persson::fraction_between(loads.value(of.load), low, high) / bins.width()
    };
    let of_theory = if attracts {
        optional_reals(counted.iter().map(|_| None))
    } else {
        reals(counted.iter().map(persson))
    };
    let [center, width, nodes, density, of_persson, beyond] =
        if attracts { ADHESIVE_PRESSURE_DISTRIBUTION } else { PRESSURE_DISTRIBUTION };
    let mut columns = histogram(&counted, bins, [center, width, nodes, density, beyond]);
    columns.insert(4, (of_persson, of_theory));
    Ok((counted.iter().map(|of| of.load).collect(), columns))
}

fn gaps(solved: &Table, bins: EqualBins) -> Result<Distributed, StageError> {
    let counted = counted(solved, GAP_COUNTS, bins)?;
    let columns = histogram(&counted, bins, GAP_DISTRIBUTION);
    Ok((counted.iter().map(|of| of.load).collect(), columns))
}

/// Returns the columns of the bins: center and width, nodes, density and nodes beyond all bins.
fn histogram(
    counted: &[Counted],
    bins: EqualBins,
    [center, width, nodes, density, beyond]: [Column; 5],
) -> Vec<(Column, ArrayRef)> {
    let rows = || counted.iter();
    vec![
        (center, reals(rows().map(|of| (of.bin as f64 + 0.5) * bins.width()))),
        (width, reals(rows().map(|_| bins.width()))),
        (nodes, integers(rows().map(|of| of.nodes as i64))),
        (density, reals(rows().map(|of| of.nodes as f64 / of.unit))),
        (beyond, integers(rows().map(|of| of.beyond as i64))),
    ]
}

/// Sums over the clusters whose areas lie in one bin.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct InBin {
    clusters: u32,
    nodes: u64,
    perimeter: f64,
    compactness: f64,
    /// Number of clusters with an edge. Only a cluster that fills a periodic cell has none.
    with_edge: u32,
}

fn clusters(solved: &Table, bins_a_decade: u32) -> Result<Distributed, StageError> {
    let grids = Grids::new(solved)?;
    let maps = grids.maps(solved, CONTACT)?;
    let boundary = solve::boundary_of(solved);
    let (mut loads, mut centers, mut found) = (Vec::new(), Vec::new(), Vec::new());
    let mut nodes = Vec::new();
    for (load, map) in maps.into_iter().enumerate() {
        let grid = grids.grid(load)?;
        let map = map.with_boundary(boundary);
        let edges = area_edges(grid, bins_a_decade);
        let bins = in_bins(&Cluster::all(&map), grid, &edges);
        for (bin, sums) in bins.into_iter().enumerate() {
            loads.push(load);
            centers.push((edges[bin] * edges[bin + 1]).sqrt());
            nodes.push(grid.count() as f64);
            found.push(sums);
        }
    }
    let width = LN_10 / f64::from(bins_a_decade);
    let mean = |sum: f64, of: u32| (of > 0).then(|| sum / f64::from(of));
    let columns = vec![
        (CLUSTER_AREA, reals(centers)),
        (CLUSTER_NUMBER, integers(found.iter().map(|bin| i64::from(bin.clusters)))),
        (CLUSTER_DENSITY, reals(found.iter().map(|bin| f64::from(bin.clusters) / width))),
        (
            CLUSTER_AREA_SHARE,
            reals(found.iter().zip(&nodes).map(|(bin, nodes)| bin.nodes as f64 / nodes)),
        ),
        (
            CLUSTER_PERIMETER,
            optional_reals(found.iter().map(|bin| mean(bin.perimeter, bin.clusters))),
        ),
        (
            CLUSTER_COMPACTNESS,
            optional_reals(found.iter().map(|bin| mean(bin.compactness, bin.with_edge))),
        ),
    ];
    Ok((loads, columns))
}

/// Returns the ends of the bins of area fractions in ascending order. The last end is 1, and the
/// first bin contains the area of one node.
fn area_edges(grid: Grid, bins_a_decade: u32) -> Vec<f64> {
    let smallest = 1.0 / grid.count() as f64;
    let edge = |bin: u32| libm::exp10(-f64::from(bin) / f64::from(bins_a_decade));
    let bins = (1..).find(|bin| edge(*bin) <= smallest).expect("the ends of bins tend to zero");
    (0..=bins).rev().map(edge).collect()
}

fn in_bins(clusters: &[Cluster], grid: Grid, edges: &[f64]) -> Vec<InBin> {
    let last = edges.len() - 2;
    let mut bins = vec![InBin::default(); last + 1];
    let nodes = grid.count() as f64;
    for cluster in clusters {
        let share = cluster.nodes as f64 / nodes;
        let above = edges.partition_point(|edge| *edge <= share);
        let bin = &mut bins[above.saturating_sub(1).min(last)];
        let perimeter = cluster.euclidean_perimeter(grid);
        bin.clusters += 1;
        bin.nodes += cluster.nodes as u64;
        bin.perimeter += perimeter;
        if perimeter > 0.0 {
            let area = share * grid.cell().area();
            bin.compactness += 4.0 * PI * area / (perimeter * perimeter);
            bin.with_edge += 1;
        }
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_mechanics::morphology::map::ContactMap;

    /// Returns the map of a square in which node (i, j) is in contact if `contact(i, j)`.
    fn map(nodes: usize, contact: impl Fn(usize, usize) -> bool) -> ContactMap {
        let touches = |node: usize| f64::from(u8::from(contact(node / nodes, node % nodes)));
        let pressures: Vec<f64> = (0..nodes * nodes).map(touches).collect();
        ContactMap::from_pressures([nodes; 2], &pressures)
    }

    #[test]
    fn bins_of_areas_extend_from_one_node_to_the_whole_map() {
        for (nodes, bins_a_decade) in [(1, 5), (2, 1), (10, 5), (64, 7), (1000, 3)] {
            let grid = Grid::square(nodes, 2.0).unwrap();
            let edges = area_edges(grid, bins_a_decade);
            assert_eq!(edges.last(), Some(&1.0));
            assert!(edges[0] <= 1.0 / grid.count() as f64);
            assert!(edges.is_sorted());
            let bin = |nodes| {
                let cluster = Cluster { nodes, ..Cluster::default() };
                let bins = in_bins(&[cluster], grid, &edges);
                bins.iter().position(|bin| bin.clusters == 1)
            };
            assert_eq!(bin(1), Some(0));
            assert_eq!(bin(grid.count()), Some(edges.len() - 2));
        }
    }

    #[test]
    fn the_compactness_of_a_large_disc_is_one_and_of_a_square_four_over_pi() {
        let grid = Grid::square(256, 1.0).unwrap();
        let compactness = |contact: &dyn Fn(usize, usize) -> bool| {
            let clusters = Cluster::all(&map(256, contact));
            let bins = in_bins(&clusters, grid, &[0.0, 1.0]);
            bins[0].compactness
        };
        let from_middle = |index: usize| index as f64 - 127.5;
        let disc = compactness(&|i, j| from_middle(i).hypot(from_middle(j)) < 80.0);
        // The Manhattan perimeter of a disc equals that of its bounding square.
        assert!((disc - 1.0).abs() < 0.01, "{disc}");
        let square = compactness(&|i, j| i.max(j) < 50);
        assert!((square - 4.0 / PI).abs() < 1e-12);
    }

    #[test]
    fn full_contact_is_one_cluster_without_an_edge() {
        let grid = Grid::square(16, 1.0).unwrap();
        let full = Cluster::all(&map(16, |_, _| true));
        let bins = in_bins(&full, grid, &area_edges(grid, 5));
        let last = bins.last().unwrap();
        assert_eq!((last.clusters, last.nodes, last.with_edge), (1, 256, 0));
    }

    #[test]
    fn a_distribution_is_serialised_by_its_name() {
        let written =
            |of| serde_json::to_string(&crate::measure::Params::Distribution(of)).unwrap();
        assert_eq!(written(Distribution::Gaps), r#"{"of":"gaps"}"#);
        let clusters = Distribution::Clusters { bins: 5 };
        assert_eq!(written(clusters), r#"{"of":"clusters","bins":5}"#);
    }
}
