//! Deterministic execution of polars queries.
//!
//! SQL does not define the order of groups, of joined rows, and of rows that compare equal. Polars
//! orders them by hashes that differ between processes, and splits sums by the number of threads,
//! so that the last digits of a mean would differ between runs. This module makes polars keep all
//! orders and work on one thread.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::{env, panic, thread};

use bytesize::ByteSize;
use polars::polars_utils::arena::{Arena, Node};
use polars::prelude::{
    DataFrame, DataType, DslPlan, Expr, IntoLazy, JoinType, LazyFrame, MaintainOrderJoin, OptFlags,
    PolarsError, PolarsResult, Schema, UniqueKeepStrategy, col, len,
};
use polars_async::executor::ALLOW_RAYON_THREADS;
use polars_plan::dsl::FileScanIR;
use polars_plan::plans::{AExpr, IR};

use crate::QueryError;
use crate::frame;
use asperity_manifest::diagnostics::{counted, words_of_panic};
use asperity_mechanics::threads::available_cores;
use asperity_tables::column::Value;

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
    let limit = env::var("POLARS_MAX_THREADS").ok().and_then(|count| count.parse::<usize>().ok());
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
            IR::Union { options, .. } => options.maintain_order = true,
            IR::Join { options, .. } => {
                Arc::make_mut(options).args.maintain_order = MaintainOrderJoin::LeftRight;
            }
            _ => {}
        }
    }
}

/// Optimized query plan with its memory limit.
///
/// The memory is estimated before the query is executed. The numbers of rows of tables are known,
/// and a join has at most their product. If that might be too much, and the join compares values by
/// `=`, its sides are computed, and their pairs of equal values are counted.
struct Plan<'a> {
    nodes: &'a mut Arena<IR>,
    expressions: &'a Arena<AExpr>,
    memory: ByteSize,
    /// Output size of the node that takes the most memory.
    largest: LargestTable,
}

/// Refuses a plan in which one node takes more memory than `memory`.
fn check_memory(
    root: Node,
    nodes: &mut Arena<IR>,
    expressions: &Arena<AExpr>,
    memory: ByteSize,
) -> PolarsResult<()> {
    let mut plan = Plan { nodes, expressions, memory, largest: LargestTable::default() };
    plan.rows(root)?;
    plan.check()
}

/// Estimated size of the output of a plan node.
#[derive(Default)]
struct LargestTable {
    rows: f64,
    columns: usize,
    bytes: f64,
}

impl Plan<'_> {
    fn check(&self) -> PolarsResult<()> {
        let LargestTable { rows, columns, bytes } = self.largest;
        if bytes <= self.memory.0 as f64 {
            return Ok(());
        }
        Err(PolarsError::ComputeError(
            format!(
                "it combines {rows} rows of {}, which take {} of memory (limit {}): select rows and \
                 columns first, join on equal columns, or raise the limit",
                counted(columns, "column"),
                ByteSize(bytes as u64).display().si(),
                self.memory.display().si(),
            )
            .into(),
        ))
    }

    /// Returns an upper bound or an estimate of the number of rows of a node, and updates `largest`
    /// for the node and all its inputs.
    fn rows(&mut self, node: Node) -> PolarsResult<f64> {
        let inputs: Vec<Node> = self.nodes.get(node).inputs().collect();
        let sizes: Vec<f64> =
            inputs.iter().map(|&input| self.rows(input)).collect::<PolarsResult<_>>()?;
        let longest = sizes.iter().copied().fold(0.0, f64::max);
        let width = width(&self.nodes.get(node).schema(self.nodes));
        let rows = match self.nodes.get(node) {
            IR::Scan { scan_type, unified_scan_args, .. } => {
                let FileScanIR::Anonymous { function, .. } = scan_type.as_ref() else {
                    return Ok(0.0);
                };
                let all = frame::rows_of(function.as_ref());
                let slice = unified_scan_args.pre_slice.as_ref();
                slice.map_or(all, |slice| all.min(slice.len())) as f64
            }
            IR::DataFrameScan { df, .. } => df.height() as f64,
            IR::Slice { len, .. } => longest.min(f64::from(*len)),
            IR::Union { .. } => sizes.iter().sum(),
            IR::Join { options, left_on, right_on, .. } => {
                let options = options.clone();
                let product: f64 = sizes.iter().product();
                let counts = matches!(
                    options.args.how,
                    JoinType::Inner | JoinType::Left | JoinType::Right | JoinType::Full
                );
                let all = if counts && product * width > self.memory.0 as f64 {
                    let on = [left_on, right_on].map(|columns| {
                        columns.iter().map(|column| column.to_expr(self.expressions)).collect()
                    });
                    longest + self.pairs(&inputs, on)?
                } else {
                    product.max(longest)
                };
                options.args.slice.map_or(all, |(_, length)| all.min(length as f64))
            }
            _ => longest,
        };
        self.largest.extend(rows, &self.nodes.get(node).schema(self.nodes));
        Ok(rows)
    }

    /// Counts the pairs of rows that a join of two nodes on the expressions `on` matches. The
    /// tables that have been computed for this take the places of the nodes.
    fn pairs(&mut self, inputs: &[Node], on: [Vec<Expr>; 2]) -> PolarsResult<f64> {
        self.check()?;
        let mut counts = Vec::new();
        for (&node, on) in inputs.iter().zip(on) {
            let table = self.computed(node)?;
            counts.push(counts_of(&table, on)?);
            let schema = table.schema().clone();
            let scan = IR::DataFrameScan { df: Arc::new(table), schema, output_schema: None };
            self.nodes.replace(node, scan);
        }
        let pairs = counts[0].iter().map(|(key, count)| {
            let others = counts[1].get(key).copied().unwrap_or(0);
            *count as f64 * others as f64
        });
        Ok(pairs.sum())
    }

    /// Computes the table of a node.
    fn computed(&self, node: Node) -> PolarsResult<DataFrame> {
        let plan = DslPlan::IR {
            dsl: Arc::default(),
            version: self.nodes.version(),
            node: Some(node),
            opt_flags: Some(OptFlags::default()),
        };
        let frame = LazyFrame::from(plan);
        frame.set_cached_arena(self.nodes.clone(), self.expressions.clone());
        let table = frame._collect_post_opt(|_, plan, _, _| {
            keep_orders(plan);
            Ok(())
        })?;
        if table.schema() != self.nodes.get(node).schema(self.nodes).as_ref() {
            return Err(PolarsError::ComputeError("polars lost a part of the plan".into()));
        }
        Ok(table)
    }
}

/// Counts the rows of each combination of values of some expressions. Rows with a null are left
/// out, because no join matches them.
fn counts_of(table: &DataFrame, on: Vec<Expr>) -> PolarsResult<BTreeMap<Vec<Value>, i64>> {
    let keys: Vec<Expr> = (0..on.len()).map(|index| col(format!("{index}"))).collect();
    let named = on.into_iter().zip(0..).map(|(key, index)| key.alias(format!("{index}")));
    let groups = table.clone().lazy().select(named.collect::<Vec<_>>()).group_by(keys);
    let grouped = groups.agg([len().cast(DataType::Int64).alias("count")]).collect()?;
    let columns = frame::columns(&grouped)
        .map_err(|error| PolarsError::ComputeError(error.to_string().into()))?;
    let mut counts = BTreeMap::new();
    for row in 0..grouped.height() {
        let values = columns.iter().map(|(_, column)| Value::from_array(column.as_ref(), row));
        let Some(mut key) = values.collect::<Option<Vec<Value>>>() else { continue };
        if let Some(Value::Integer(count)) = key.pop() {
            counts.insert(key, count);
        }
    }
    Ok(counts)
}

impl LargestTable {
    /// Replaces this extent by `rows` rows with this schema if those take more memory.
    fn extend(&mut self, rows: f64, schema: &Schema) {
        let bytes = rows * width(schema);
        if bytes > self.bytes {
            *self = LargestTable { rows, columns: schema.len(), bytes };
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
