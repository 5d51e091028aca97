//! Polars, held to one answer.
//!
//! SQL leaves the order of groups, of joined rows and of rows that sort alike to the engine. This
//! one settles it by hashes that are new in every process, and adds up in as many parts as it has
//! threads, so that the last digits of a mean would differ from run to run. Here it keeps every
//! order, and works on one thread.

use std::sync::Arc;
use std::thread;

use bytesize::ByteSize;
use polars::polars_utils::arena::{Arena, Node};
use polars::prelude::{DataFrame, LazyFrame, MaintainOrderJoin, PolarsResult, UniqueKeepStrategy};
use polars_async::executor::ALLOW_RAYON_THREADS;
use polars_plan::plans::IR;

use super::{QueryError, budget};
use crate::diagnostics::words_of_panic;

/// The name of the thread.
pub const THREAD: &str = "query";

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
    thread::scope(|scope| {
        let builder = thread::Builder::new().name(THREAD.to_owned());
        let started = builder.stack_size(STACK).spawn_scoped(scope, alone);
        let thread = started.map_err(|error| {
            let room = STACK >> 20;
            refused(format!(
                "no thread starts with {room} MiB of stack: {error}"
            ))
        })?;
        thread.join().unwrap_or_else(|panic| {
            let words = words_of_panic(panic.as_ref());
            Err(refused(format!("polars gives up: {words}")))
        })
    })
}

/// What a query answers, rows in an order that follows from the tables.
///
/// # Errors
/// When the query names what is not there, asks for what polars cannot do, or takes more memory than
/// there is.
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
