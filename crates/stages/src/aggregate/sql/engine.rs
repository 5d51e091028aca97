//! Deterministic execution of polars queries.
//!
//! SQL does not define the order of groups, of joined rows, and of rows that compare equal. Polars
//! orders them by hashes that differ between processes, and splits sums by the number of threads,
//! so that the last digits of a mean would differ between runs. This module makes polars keep all
//! orders and work on one thread.

use std::sync::{Arc, Mutex, OnceLock};
use std::{env, panic, thread};

use bytesize::ByteSize;
use polars::polars_utils::arena::{Arena, Node};
use polars::prelude::{
    AnonymousScan, DataFrame, DataType, JoinType, LazyFrame, MaintainOrderJoin, PolarsError,
    PolarsResult, Schema, UniqueKeepStrategy,
};
use polars_async::executor::ALLOW_RAYON_THREADS;
use polars_plan::dsl::FileScanIR;
use polars_plan::plans::expr_ir::ExprIR;
use polars_plan::plans::{AExpr, IR};

use super::QueryError;
use crate::aggregate::frame;
use asperity_contact::threads::available_cores;
use asperity_manifest::diagnostics::{counted, words_of_panic};

/// Message for systems that do not let polars start its threads.
const TOO_FEW_THREADS: &str = "polars, which computes statistics and answers queries, cannot \
                               start its threads: allow more processes (`ulimit -u`), or set the \
                               environment variable `POLARS_MAX_THREADS` to 1";

/// Name of the query thread.
const THREAD: &str = "query";

/// Stack size of the query thread in bytes. The deepest accepted query needs a third of it.
const STACK: usize = 256 << 20;

/// Runs `work` on a new thread with a large stack, and keeps polars on this thread.
///
/// # Errors
/// Returns an error if the thread cannot be started or polars panics.
pub fn on_query_thread<T: Send, E: From<QueryError> + Send>(
    work: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T, E> {
    let single_threaded = || {
        ALLOW_RAYON_THREADS.set(false);
        work()
    };
    let refused = |reason: String| E::from(QueryError::Refused(reason));
    if !polars_can_start() {
        return Err(refused(TOO_FEW_THREADS.to_owned()));
    }
    thread::scope(|scope| {
        let builder = thread::Builder::new().name(THREAD.to_owned());
        let started = builder.stack_size(STACK).spawn_scoped(scope, single_threaded);
        let thread = started.map_err(|error| {
            let size = STACK >> 20;
            refused(format!("cannot start a thread with a stack of {size} MiB: {error}"))
        })?;
        let answer = thread.join();
        answer.unwrap_or_else(|panic| Err(refused(panic_message(&words_of_panic(panic.as_ref())))))
    })
}

/// Returns whether the system allows the query thread and the two thread pools that polars starts
/// at its first use.
///
/// Polars panics or waits forever if it cannot start all of them. The first positive answer holds
/// for the whole process, because the pools remain.
fn polars_can_start() -> bool {
    static CAN_START: OnceLock<()> = OnceLock::new();
    if CAN_START.get().is_some() {
        return true;
    }
    let limit = env::var("POLARS_MAX_THREADS").ok();
    let limit = limit.and_then(|count| count.parse::<usize>().ok());
    let count = 1 + 2 * limit.unwrap_or_else(|| available_cores().get());
    let gate = Mutex::new(());
    let all_start = thread::scope(|scope| {
        // The gate keeps all threads alive until the last one has started.
        let _closed = gate.lock();
        (0..count).all(|_| {
            let pass = || drop(gate.lock());
            thread::Builder::new().spawn_scoped(scope, pass).is_ok()
        })
    });
    if all_start {
        CAN_START.get_or_init(|| ());
    }
    all_start
}

/// Returns the error message for a panic of polars.
fn panic_message(panic: &str) -> String {
    // Other threads may have started since `polars_can_start` returned.
    if panic.starts_with("could not spawn threads") {
        return TOO_FEW_THREADS.to_owned();
    }
    // Drop the part of the message that is about the code of polars.
    let cause = match panic.split_once("` value: ") {
        Some((_, cause)) => cause,
        None => panic,
    };
    format!(
        "polars cannot answer this query because of an internal error ({cause}); write the query \
         in another form, or split it into parts with `with`"
    )
}

/// Suppresses the printed trace of panics on query threads, because they become errors.
pub fn silence_panics() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        if thread::current().name() != Some(THREAD) {
            print(panic);
        }
    }));
}

/// Executes a query and collects its rows. The order of the rows depends only on the tables.
///
/// # Errors
/// Returns an error if a name does not exist, polars does not support the query, or the query takes
/// more memory than `memory`.
pub fn collect(frame: LazyFrame, memory: ByteSize) -> PolarsResult<DataFrame> {
    frame._collect_post_opt(|root, plan, expressions, _| {
        check_memory(root, plan, expressions, memory)?;
        keep_orders(plan);
        Ok(())
    })
}

/// Makes every node of a plan keep the order of its input.
///
/// Sorting the answer is not enough, because the last digits of means depend on the order of their
/// input. Call this after the optimizer, which may give up orders that it considers irrelevant.
fn keep_orders(plan: &mut Arena<IR>) {
    for node in (0..plan.len()).map(Node) {
        match plan.get_mut(node) {
            IR::GroupBy { maintain_order, .. } => *maintain_order = true,
            IR::Distinct { options, .. } => {
                options.maintain_order = true;
                if options.keep_strategy == UniqueKeepStrategy::Any {
                    options.keep_strategy = UniqueKeepStrategy::First;
                }
            }
            IR::Sort { sort_options, .. } => sort_options.maintain_order = true,
            IR::Join { options, .. } => {
                Arc::make_mut(options).args.maintain_order = MaintainOrderJoin::LeftRight;
            }
            _ => {}
        }
    }
}

/// Optimized query plan with its memory limit.
///
/// The memory is estimated before anything is read. The numbers of rows of tables are known, and a
/// cross join has their product. If another join might be too large, its pairs of equal values are
/// counted, provided that it joins columns of tables. All other joins are assumed to have as many
/// rows as the longer side.
struct Plan<'a> {
    nodes: &'a Arena<IR>,
    expressions: &'a Arena<AExpr>,
    memory: ByteSize,
}

/// Refuses a plan in which one node takes more memory than `memory`.
fn check_memory(
    root: Node,
    nodes: &Arena<IR>,
    expressions: &Arena<AExpr>,
    memory: ByteSize,
) -> PolarsResult<()> {
    let plan = Plan { nodes, expressions, memory };
    let mut largest = Extent::default();
    plan.output_size(root, &mut largest);
    if largest.bytes <= memory.0 as f64 {
        return Ok(());
    }
    let Extent { rows, columns, bytes } = largest;
    Err(PolarsError::ComputeError(
        format!(
            "it combines {rows} rows of {}, which take {} of memory (limit {}): select rows and \
             columns first, join on equal columns, or raise the limit",
            counted(columns, "column"),
            ByteSize(bytes as u64).display().si(),
            memory.display().si(),
        )
        .into(),
    ))
}

/// Output size of the plan node that takes the most memory.
#[derive(Default)]
struct Extent {
    rows: f64,
    columns: usize,
    bytes: f64,
}

/// Estimated size of the output of a plan node.
struct OutputSize<'a> {
    /// Upper bound or estimate of the number of rows.
    rows: f64,
    /// Table that the output contains with all rows unchanged, if there is one.
    table: Option<&'a dyn AnonymousScan>,
}

impl Plan<'_> {
    /// Estimates the output of a node, and updates `largest` for the node and all its inputs.
    fn output_size(&self, node: Node, largest: &mut Extent) -> OutputSize<'_> {
        let part = self.nodes.get(node);
        let inputs = part.inputs().map(|input| self.output_size(input, largest));
        let inputs: Vec<OutputSize> = inputs.collect();
        let longest = || inputs.iter().fold(0.0, |most, input| input.rows.max(most));
        let rows = match part {
            IR::Scan { scan_type, unified_scan_args, .. } => {
                let FileScanIR::Anonymous { function, .. } = scan_type.as_ref() else {
                    return OutputSize { rows: 0.0, table: None };
                };
                let table = function.as_ref();
                let all = frame::rows_of(table);
                let slice = unified_scan_args.pre_slice.as_ref();
                let rows = slice.map_or(all, |slice| all.min(slice.len()));
                largest.extend(rows as f64, &part.schema(self.nodes));
                return OutputSize { rows: rows as f64, table: (rows == all).then_some(table) };
            }
            IR::DataFrameScan { df, .. } => df.height() as f64,
            IR::Slice { len, .. } => longest().min(f64::from(*len)),
            IR::Union { .. } => inputs.iter().map(|input| input.rows).sum(),
            IR::Join { options, left_on, right_on, .. } => {
                let product: f64 = inputs.iter().map(|input| input.rows).product();
                let all = match &options.args.how {
                    JoinType::Cross if options.options.is_none() => product,
                    JoinType::Inner | JoinType::Left | JoinType::Right | JoinType::Full
                        if product * width(&part.schema(self.nodes)) > self.memory.0 as f64 =>
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
        largest.extend(rows, &part.schema(self.nodes));
        let keeps_rows = matches!(
            part,
            IR::SimpleProjection { .. } | IR::Cache { .. } | IR::Sort { slice: None, .. }
        );
        let table = inputs.first().and_then(|input| input.table.filter(|_| keeps_rows));
        OutputSize { rows, table }
    }

    /// Counts the pairs of rows that a join of `inputs` on the expressions `on` matches. Returns
    /// `None` if an expression is not a column of a table.
    fn pairs(&self, inputs: &[OutputSize], on: [&[ExprIR]; 2]) -> Option<f64> {
        let counts = |side: usize| {
            let names = on[side].iter().map(|column| {
                let AExpr::Column(name) = self.expressions.get(column.node()) else {
                    return None;
                };
                Some(name.as_str())
            });
            frame::counts_of(inputs.get(side)?.table?, &names.collect::<Option<Vec<_>>>()?)
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
    /// Replaces this extent by `rows` rows with this schema if those take more memory.
    fn extend(&mut self, rows: f64, schema: &Schema) {
        let bytes = rows * width(schema);
        if bytes > self.bytes {
            *self = Extent { rows, columns: schema.len(), bytes };
        }
    }
}

/// Returns the size in bytes of a row with this schema.
fn width(schema: &Schema) -> f64 {
    let types = schema.iter_values();
    let bytes = types.map(|kind| match kind {
        DataType::Boolean => 1.0,
        DataType::String => 16.0,
        _ => 8.0,
    });
    bytes.sum()
}
