//! Memory that a query takes, as far as its plan tells before anything is read.
//!
//! The numbers of rows of tables are known, and a cross join has their product. Where another join
//! might be too large, the equal values of its columns are counted if these are columns of tables.
//! All other joins are assumed to have as many rows as the longer side.

use bytesize::ByteSize;
use polars::polars_utils::arena::{Arena, Node};
use polars::prelude::{AnonymousScan, DataType, JoinType, PolarsError, PolarsResult, Schema};
use polars_plan::dsl::FileScanIR;
use polars_plan::plans::expr_ir::ExprIR;
use polars_plan::plans::{AExpr, IR};

use super::scan;
use asperity_manifest::diagnostics::counted;

/// A query plan as polars executes it.
struct Plan<'a> {
    parts: &'a Arena<IR>,
    expressions: &'a Arena<AExpr>,
    room: ByteSize,
}

/// Refuses a plan in which one node takes more memory than `room`.
///
/// # Errors
/// When one does.
pub fn check(
    root: Node,
    parts: &Arena<IR>,
    expressions: &Arena<AExpr>,
    room: ByteSize,
) -> PolarsResult<()> {
    let plan = Plan { parts, expressions, room };
    let mut largest = Extent::default();
    plan.known(root, &mut largest);
    if largest.bytes <= room.0 as f64 {
        return Ok(());
    }
    let Extent { rows, columns, bytes } = largest;
    Err(PolarsError::ComputeError(
        format!(
            "it puts {rows} rows of {} together, {} of memory where {} may be taken: \
             select rows and columns first, join by equal columns, or allow more",
            counted(columns, "column"),
            ByteSize(bytes as u64).display().si(),
            room.display().si(),
        )
        .into(),
    ))
}

/// The node of a plan that takes the most memory.
#[derive(Default)]
struct Extent {
    rows: f64,
    columns: usize,
    bytes: f64,
}

/// Size of the result of a node.
struct Known<'a> {
    /// Upper bound or estimate of the number of rows.
    rows: f64,
    /// The table, if the rows are all rows of one table.
    table: Option<&'a dyn AnonymousScan>,
}

impl Plan<'_> {
    fn known(&self, node: Node, largest: &mut Extent) -> Known<'_> {
        let part = self.parts.get(node);
        let inputs: Vec<Known> = part.inputs().map(|input| self.known(input, largest)).collect();
        let longest = || inputs.iter().fold(0.0, |most, input| input.rows.max(most));
        let rows = match part {
            IR::Scan { scan_type, unified_scan_args, .. } => {
                let FileScanIR::Anonymous { function, .. } = scan_type.as_ref() else {
                    return Known { rows: 0.0, table: None };
                };
                let table = function.as_ref();
                let all = scan::rows_of(table);
                let slice = unified_scan_args.pre_slice.as_ref();
                let rows = slice.map_or(all, |slice| all.min(slice.len()));
                largest.extend(rows as f64, &part.schema(self.parts));
                return Known { rows: rows as f64, table: (rows == all).then_some(table) };
            }
            IR::DataFrameScan { df, .. } => df.height() as f64,
            IR::Slice { len, .. } => longest().min(f64::from(*len)),
            IR::Union { .. } => inputs.iter().map(|input| input.rows).sum(),
            IR::Join { options, left_on, right_on, .. } => {
                let product: f64 = inputs.iter().map(|input| input.rows).product();
                let all = match &options.args.how {
                    JoinType::Cross if options.options.is_none() => product,
                    JoinType::Inner | JoinType::Left | JoinType::Right | JoinType::Full
                        if product * width(&part.schema(self.parts)) > self.room.0 as f64 =>
                    {
                        longest() + self.pairs(&inputs, [left_on, right_on]).unwrap_or(0.0)
                    }
                    _ => longest(),
                };
                let slice = options.args.slice;
                slice.map_or(all, |(_, length)| all.min(length as f64))
            }
            _ => longest(),
        };
        largest.extend(rows, &part.schema(self.parts));
        let is_same = matches!(
            part,
            IR::SimpleProjection { .. } | IR::Cache { .. } | IR::Sort { slice: None, .. }
        );
        Known { rows, table: inputs.first().and_then(|input| input.table.filter(|_| is_same)) }
    }

    /// Counts the pairs of rows that a join matches, or returns `None` if it joins anything but
    /// columns of tables.
    fn pairs(&self, inputs: &[Known], on: [&[ExprIR]; 2]) -> Option<f64> {
        let counts = |side: usize| {
            let names = on[side].iter().map(|column| {
                let AExpr::Column(name) = self.expressions.get(column.node()) else {
                    return None;
                };
                Some(name.as_str())
            });
            scan::counts_of(inputs.get(side)?.table?, &names.collect::<Option<Vec<_>>>()?)
        };
        let (left, right) = (counts(0)?, counts(1)?);
        let pairs = left.iter().map(|(key, count)| {
            let others = right.get(key).copied().unwrap_or(0);
            *count as f64 * others as f64
        });
        Some(pairs.sum())
    }
}

impl Extent {
    /// Replaces the extent if this many rows of these columns take more memory.
    fn extend(&mut self, rows: f64, schema: &Schema) {
        let bytes = rows * width(schema);
        if bytes > self.bytes {
            *self = Extent { rows, columns: schema.len(), bytes };
        }
    }
}

/// Returns the number of bytes of a row.
fn width(schema: &Schema) -> f64 {
    let types = schema.iter_values();
    let bytes = types.map(|kind| match kind {
        DataType::Boolean => 1.0,
        DataType::String => 16.0,
        _ => 8.0,
    });
    bytes.sum()
}
