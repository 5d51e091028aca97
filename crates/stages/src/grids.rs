//! Columns that hold the mesh of a surface: numbers of nodes and sides of the cell.
//!
//! Square meshes use the columns `nodes` and `side`; rectangular meshes use `nodes_x`, `nodes_y`,
//! `side_x` and `side_y`. A single set of columns would be simpler, but would rename the columns of
//! existing tables. In a table with both shapes, each row has nulls in the columns of the other
//! shape.

use arrow::array::{Array, Float64Array, Int64Array};

use super::StageError;
use super::columns::{NODES, NODES_X, NODES_Y, SIDE, SIDE_X, SIDE_Y};
use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::morphology::map::ContactMap;
use asperity_tables::column::{Column, Value};
use asperity_tables::table::{Table, TableError};

/// Returns the columns and values that describe a mesh with `nodes` nodes and a cell with sides
/// `size`, each along x and y.
pub fn coordinates(nodes: [usize; 2], size: [f64; 2]) -> Vec<(Column, Value)> {
    let is_square = nodes[0] == nodes[1] && size[0] == size[1];
    let [nodes_x, nodes_y] = nodes.map(|nodes| Value::Integer(nodes as i64));
    let [side_x, side_y] = size.map(Value::Real);
    if is_square {
        vec![(NODES, nodes_x), (SIDE, side_x)]
    } else {
        vec![(NODES_X, nodes_x), (NODES_Y, nodes_y), (SIDE_X, side_x), (SIDE_Y, side_y)]
    }
}

/// Returns whether rows of a table may describe rectangles.
pub fn has_rectangles(table: &Table) -> bool {
    table.has(NODES_X.name)
}

/// Lookup of the number of mesh nodes of the surface in each row of a table.
#[derive(Clone, Copy)]
pub struct Meshes<'a> {
    square: Option<&'a Int64Array>,
    rectangle: Option<[&'a Int64Array; 2]>,
}

impl<'a> Meshes<'a> {
    /// Finds the columns with the numbers of nodes.
    ///
    /// # Errors
    /// Returns an error if the table has neither the columns of squares nor those of rectangles.
    pub fn new(table: &'a Table) -> Result<Self, TableError> {
        if !has_rectangles(table) {
            return Ok(Self { square: Some(table.integers(NODES.name)?), rectangle: None });
        }
        Ok(Self {
            square: table.integers(NODES.name).ok(),
            rectangle: Some([table.integers(NODES_X.name)?, table.integers(NODES_Y.name)?]),
        })
    }

    /// Returns the number of nodes along x and y of the surface in a row.
    pub fn nodes(&self, row: usize) -> [usize; 2] {
        let square = self.square.filter(|nodes| nodes.is_valid(row));
        let nodes = match (square, self.rectangle) {
            (Some(nodes), _) => [nodes.value(row); 2],
            (None, Some(nodes)) => nodes.map(|nodes| nodes.value(row)),
            (None, None) => [0; 2],
        };
        nodes.map(|nodes| nodes.unsigned_abs() as usize)
    }

    /// Returns the number of nodes per side of the surface in a row, or `None` if the mesh is not
    /// square.
    pub fn of_square(&self, row: usize) -> Option<i64> {
        let square = self.square.filter(|nodes| nodes.is_valid(row))?;
        Some(square.value(row))
    }
}

/// Lookup of the mesh and cell of the surface in each row of a table.
#[derive(Clone, Copy)]
pub struct Grids<'a> {
    meshes: Meshes<'a>,
    square: Option<&'a Float64Array>,
    rectangle: Option<[&'a Float64Array; 2]>,
}

impl<'a> Grids<'a> {
    /// Finds the columns with the numbers of nodes and the sides of the cell.
    ///
    /// # Errors
    /// Returns an error if the table has neither the columns of squares nor those of rectangles.
    pub fn new(table: &'a Table) -> Result<Self, TableError> {
        let meshes = Meshes::new(table)?;
        if !has_rectangles(table) {
            return Ok(Self { meshes, square: Some(table.reals(SIDE.name)?), rectangle: None });
        }
        Ok(Self {
            meshes,
            square: table.reals(SIDE.name).ok(),
            rectangle: Some([table.reals(SIDE_X.name)?, table.reals(SIDE_Y.name)?]),
        })
    }

    /// Returns the mesh and cell of the surface in a row.
    ///
    /// # Errors
    /// Returns an error if a number of nodes or a side is invalid. No table written by this program
    /// contains such numbers.
    pub fn grid(&self, row: usize) -> Result<Grid, StageError> {
        let square = self.square.filter(|side| side.is_valid(row));
        let size = match (square, self.rectangle) {
            (Some(side), _) => [side.value(row); 2],
            (None, Some(sides)) => sides.map(|side| side.value(row)),
            (None, None) => [0.0; 2],
        };
        grid(self.meshes.nodes(row), size)
    }

    /// Returns the contact maps in a column of a table. A table without rows may lack the column.
    ///
    /// # Errors
    /// Returns an error if the column is missing or a map does not fit its mesh.
    pub fn maps(&self, table: &Table, column: Column) -> Result<Vec<ContactMap>, StageError> {
        if table.rows() == 0 {
            return Ok(Vec::new());
        }
        let maps = table.bytes(column.name)?;
        let map = |row: usize| {
            let nodes = self.grid(row)?.nodes();
            ContactMap::from_bytes(nodes, maps.value(row)).map_err(StageError::Map)
        };
        (0..table.rows()).map(map).collect()
    }
}

/// Creates a mesh with `nodes` nodes on a cell with sides `size`, each along x and y.
///
/// # Errors
/// Returns an error if the number of nodes or the area of the cell is zero.
pub fn grid(nodes: [usize; 2], size: [f64; 2]) -> Result<Grid, StageError> {
    let grid = Cell::new(size).and_then(|cell| Grid::new(nodes, cell));
    grid.map_err(|error| StageError::Heights(error.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(nodes: [usize; 2], size: [f64; 2]) -> Table {
        Table::row(&coordinates(nodes, size))
    }

    #[test]
    fn squares_and_rectangles_have_their_own_columns() {
        assert_eq!(row([8, 8], [0.5, 0.5]).names(), ["nodes", "side"]);
        let four = ["nodes_x", "nodes_y", "side_x", "side_y"];
        assert_eq!(row([8, 4], [0.5, 0.5]).names(), four);
        assert_eq!(row([8, 8], [0.5, 0.25]).names(), four);
    }

    #[test]
    fn grids_are_read_back_from_tables_with_squares_and_rectangles() {
        let grids = [([8, 8], [0.5, 0.5]), ([8, 4], [2.0, 1.0]), ([16, 16], [1.0, 1.0])];
        let rows = grids.map(|(nodes, size)| row(nodes, size));
        for tables in [&rows[..], &rows[..1], &rows[1..2], &rows[1..]] {
            let table = Table::stack(tables).unwrap();
            let grids = Grids::new(&table).unwrap();
            for (at, one) in tables.iter().enumerate() {
                let alone = Grids::new(one).unwrap().grid(0).unwrap();
                assert_eq!(grids.grid(at).unwrap(), alone);
            }
        }
        let second = Table::stack(&rows).unwrap();
        let meshes = Meshes::new(&second).unwrap();
        assert_eq!(meshes.nodes(1), [8, 4]);
        assert_eq!([0, 1, 2].map(|row| meshes.of_square(row)), [Some(8), None, Some(16)]);
    }

    #[test]
    fn a_table_without_surfaces_has_no_grids() {
        let load = Table::row(&[(crate::columns::LOAD, Value::Real(0.1))]);
        assert!(Grids::new(&load).is_err());
    }
}
