//! Polars, held to one answer.
//!
//! SQL leaves the order of groups, of joined rows and of rows that sort alike to the engine. This
//! one settles it by hashes that are new in every process, and adds up in as many parts as it has
//! threads, so that the last digits of a mean would differ from run to run. Here it keeps every
//! order, and works on one thread.

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

/// Message for systems that refuse polars its threads.
const TOO_FEW_THREADS: &str = "polars, which computes statistics and answers queries, cannot start its \
                               threads: allow more processes (`ulimit -u`), or set the environment \
                               variable `POLARS_MAX_THREADS` to 1";

/// The name of the thread.
const THREAD: &str = "query";

/// Bytes of stack: for the deepest query that is let in, three times over.
const STACK: usize = 256 << 20;

/// Works with queries on a thread of its own, with room for deep ones, and on no other thread.
///
/// # Errors
/// When the thread does not start, or polars gives up.
pub fn apart<T: Send, E: From<QueryError> + Send>(
    work: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T, E> {
    let alone = || {
        ALLOW_RAYON_THREADS.set(false);
        work()
    };
    let refused = |reason: String| E::from(QueryError::Refused(reason));
    if !polars_can_start() {
        return Err(refused(TOO_FEW_THREADS.to_owned()));
    }
    thread::scope(|scope| {
        let builder = thread::Builder::new().name(THREAD.to_owned());
        let started = builder.stack_size(STACK).spawn_scoped(scope, alone);
        let thread = started.map_err(|error| {
            let room = STACK >> 20;
            refused(format!("no thread starts with {room} MiB of stack: {error}"))
        })?;
        let answered = thread.join();
        answered.unwrap_or_else(|panic| Err(refused(told(&words_of_panic(panic.as_ref())))))
    })
}

/// Returns whether the system allows the thread of a query and the two thread pools that polars
/// starts at its first use.
///
/// Polars panics or waits forever if it is refused some of them. The first positive answer holds
/// for the whole process, because the pools stay.
fn polars_can_start() -> bool {
    static CAN_START: OnceLock<()> = OnceLock::new();
    if CAN_START.get().is_some() {
        return true;
    }
    let said = env::var("POLARS_MAX_THREADS").ok();
    let said = said.and_then(|count| count.parse::<usize>().ok());
    let count = 1 + 2 * said.unwrap_or_else(|| available_cores().get());
    let gate = Mutex::new(());
    let all_start = thread::scope(|scope| {
        // All threads exist at the same time, until the gate opens.
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

/// Returns an error message for a panic of polars.
fn told(words: &str) -> String {
    // Another thread may have started since `polars_can_start` answered.
    if words.starts_with("could not spawn threads") {
        return TOO_FEW_THREADS.to_owned();
    }
    // Drop the part of the message that is about the code of polars.
    let cause = match words.split_once("` value: ") {
        Some((_, cause)) => cause,
        None => words,
    };
    format!(
        "polars cannot answer this query, and ended with an internal error ({cause}); ask in another \
         form, or for parts of it by `with`"
    )
}

/// Suppresses the printed trace of panics on query threads: the error says what happened.
pub fn silence_panics() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        if thread::current().name() != Some(THREAD) {
            print(panic);
        }
    }));
}

/// What a query answers, rows in an order that follows from the tables.
///
/// # Errors
/// When the query names what is not there, asks for what polars cannot do, or takes more memory
/// than there is.
pub fn collected(frame: LazyFrame, room: ByteSize) -> PolarsResult<DataFrame> {
    frame._collect_post_opt(|root, plan, expressions, _| {
        check_memory(root, plan, expressions, room)?;
        keep_orders(plan);
        Ok(())
    })
}

/// Settles every row order by the order of the input.
///
/// A sort of the answer would not do: means of groups, too, depend on the order of what they read.
/// The optimizer holds that they do not, and so it comes before.
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

/// A query plan as polars executes it, and the memory that it may take.
///
/// What it takes is known as far as the plan tells before anything is read. The numbers of rows of
/// tables are known, and a cross join has their product. Where another join might be too large, the
/// equal values of its columns are counted if these are columns of tables. All other joins are
/// assumed to have as many rows as the longer side.
struct Plan<'a> {
    parts: &'a Arena<IR>,
    expressions: &'a Arena<AExpr>,
    room: ByteSize,
}

/// Refuses a plan in which one node takes more memory than `room`.
///
/// # Errors
/// When one does.
fn check_memory(
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
                let all = frame::rows_of(table);
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
