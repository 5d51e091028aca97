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
use polars::prelude::{DataFrame, LazyFrame, MaintainOrderJoin, PolarsResult, UniqueKeepStrategy};
use polars_async::executor::ALLOW_RAYON_THREADS;
use polars_plan::plans::IR;

use super::{QueryError, budget};
use asperity_contact::threads::available_cores;
use asperity_manifest::diagnostics::words_of_panic;

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
        budget::check(root, plan, expressions, room)?;
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
