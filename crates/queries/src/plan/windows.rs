//! Calls with `over`: replacement by columns that window functions compute.

use std::collections::{BTreeMap, BTreeSet};

use sqlparser::ast::{
    DuplicateTreatment, Expr, Function, FunctionArg, FunctionArgExpr, FunctionArguments, Ident,
    NamedWindowDefinition, NamedWindowExpr, Select, WindowFrameBound, WindowFrameUnits, WindowSpec,
    WindowType,
};

use super::expressions::{Calls, Columns, Item, is_output, is_planned, name_of};
use super::{Ends, Planned, Result, each_expression, refused};
use crate::QueryError;
use crate::statement;
use crate::window::{Bound, Direction, Window, WindowFunction};

/// Replacement of window functions by columns.
pub(super) struct Windows<'a> {
    /// Arguments and keys of the window functions.
    pub(super) inputs: Columns,
    pub(super) windows: Vec<Window>,
    /// Columns of `from` if the step that computes the inputs reads them. All other columns of the
    /// answer then become inputs, too.
    carried: Option<&'a BTreeSet<String>>,
    /// Expressions of the answer by their names, for conditions and `order by`.
    pub(super) aliases: BTreeMap<String, Expr>,
}

impl<'a> Windows<'a> {
    pub(super) fn new(carried: Option<&'a BTreeSet<String>>) -> Windows<'a> {
        Windows {
            inputs: Columns::with_prefix("i"),
            windows: Vec::new(),
            carried,
            aliases: BTreeMap::new(),
        }
    }

    /// Lowers the columns of an answer, its condition, and its order.
    pub(super) fn lower_all(
        &mut self,
        items: &mut [Item],
        condition: &mut Option<Expr>,
        ends: &mut Ends,
    ) -> Result<()> {
        let mut expressions: Vec<&mut Expr> = condition.iter_mut().collect();
        for part in ends.order() {
            if !is_output(&part.expr, items) {
                expressions.push(&mut part.expr);
            }
        }
        expressions.extend(items.iter_mut().map(|(value, _)| value));
        for expression in expressions {
            each_expression(expression, &mut |part| self.replace(part))?;
        }
        // A table without columns has no rows.
        if self.inputs.names.is_empty() {
            self.inputs.name(&1);
        }
        Ok(())
    }

    fn replace(&mut self, expression: &mut Expr) -> Result<()> {
        match expression {
            Expr::Function(function) if function.over.is_some() => {
                let window = self.window(function)?;
                let known = self.windows.iter().position(|known| *known == window);
                let index = known.unwrap_or(self.windows.len());
                if known.is_none() {
                    self.windows.push(window);
                }
                *expression = Expr::Identifier(Ident::new(format!("__w{index}")));
            }
            Expr::Identifier(name) if !is_planned(name) => {
                let is_column = self.carried.is_some_and(|columns| columns.contains(&name.value));
                match self.aliases.get(&name.value).filter(|_| !is_column) {
                    Some(value) => *expression = Expr::Nested(Box::new(value.clone())),
                    None => *expression = self.inputs.column(&*expression),
                }
            }
            Expr::CompoundIdentifier(_) => *expression = self.inputs.column(&*expression),
            _ => {}
        }
        Ok(())
    }

    /// Adds the columns of the window functions to a table with their inputs.
    pub(super) fn add(&self, inputs: Planned) -> Planned {
        let windows = self.windows.iter().enumerate();
        let columns =
            windows.map(|(index, window)| window.expression().alias(format!("__w{index}")));
        let frame = inputs.frame.with_columns(columns.collect::<Vec<_>>());
        Planned { frame, ..inputs }
    }

    fn window(&mut self, call: &Function) -> Result<Window> {
        let Some(WindowType::WindowSpec(spec)) = &call.over else {
            return refused(format!("`{call}` names a window that `window` does not define"));
        };
        let mut inner = Calls::of(&call.args);
        inner.add(spec);
        let is_plain = call.null_treatment.is_none() && call.within_group.is_empty();
        if inner.has_window || !is_plain || spec.window_name.is_some() {
            return refused(format!(
                "`{call}` is not supported; compute parts of it in a subquery"
            ));
        }
        let mut arguments = arguments(call)?;
        let function = window_function(call, &mut arguments)?;
        if let Some(condition) = &call.filter {
            let value = arguments.first().map_or("1", String::as_str);
            arguments = vec![format!("case when {condition} then {value} end")];
        }
        let parts = spec.order_by.iter().map(|part| {
            let descending = part.options.asc == Some(false);
            let nulls_first = part.options.nulls_first.unwrap_or(descending);
            (self.inputs.name(&part.expr), Direction { descending, nulls_first })
        });
        let order: Vec<_> = parts.collect();
        let frame = frame(spec)?;
        let mut names = |parts: &[String]| -> Vec<String> {
            parts.iter().map(|part| self.inputs.name(part)).collect()
        };
        let partition: Vec<String> = spec.partition_by.iter().map(ToString::to_string).collect();
        let window = Window {
            function,
            arguments: names(&arguments),
            partition: names(&partition),
            order,
            frame,
        };
        // Without an input, the number of rows would be unknown.
        let has_input =
            !(window.arguments.is_empty() && partition.is_empty() && window.order.is_empty());
        Ok(if has_input {
            window
        } else {
            Window { partition: names(&["1".to_owned()]), ..window }
        })
    }
}

/// Returns the window function of a call, and keeps only those arguments that are columns.
fn window_function(call: &Function, arguments: &mut Vec<String>) -> Result<WindowFunction> {
    use WindowFunction::*;
    let mut literal = |index: usize, default: &str| {
        let given = (arguments.len() > index).then(|| arguments.remove(index));
        given.unwrap_or_else(|| default.to_owned())
    };
    let needs = |what: &str, text: &str| {
        QueryError::Refused(format!("`{call}` needs {what}, not `{text}`"))
    };
    let offset = |text: String| text.parse::<isize>().map_err(|_| needs("a number of rows", &text));
    let positive = |text: String| {
        let number = text.parse().ok().filter(|&number: &usize| number > 0);
        number.ok_or_else(|| needs("a positive integer", &text))
    };
    let share = |text: String| {
        let number = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
        number.ok_or_else(|| needs("a number from 0 to 1", &text))
    };
    let name = name_of(call);
    let function = match name.as_str() {
        "row_number" => RowNumber,
        "rank" => Rank,
        "dense_rank" => DenseRank,
        "percent_rank" => PercentRank,
        "cume_dist" => CumeDist,
        "ntile" => Ntile(positive(literal(0, ""))?),
        "lag" => Offset(-offset(literal(1, "1"))?),
        "lead" => Offset(offset(literal(1, "1"))?),
        "first_value" | "first" => First,
        "last_value" | "last" => Last,
        "nth_value" => Nth(positive(literal(1, ""))?),
        "count" => Count,
        "sum" | "total" => Sum,
        "avg" => Average,
        "min" => Minimum,
        "max" => Maximum,
        "var" | "var_samp" | "variance" => Variance(1),
        "var_pop" => Variance(0),
        "stddev" | "stddev_samp" | "stdev" | "stdev_samp" => StandardDeviation(1),
        "stddev_pop" => StandardDeviation(0),
        "median" => Quantile(0.5),
        "quantile_cont" => Quantile(share(literal(1, ""))?),
        "quantile_disc" => DiscreteQuantile(share(literal(1, ""))?),
        _ => return refused(format!("`{name}` with `over` is not supported")),
    };
    let expected = match function {
        RowNumber | Rank | DenseRank | PercentRank | CumeDist | Ntile(_) => 0..=0,
        Offset(_) => 1..=2,
        Count => 0..=1,
        _ => 1..=1,
    };
    if !expected.contains(&arguments.len()) {
        return refused(format!("`{call}` has a wrong number of arguments"));
    }
    if call.filter.is_some() && !statement::is_aggregate(&name) {
        return refused(format!("`{name}` with `filter` and `over` is not supported"));
    }
    Ok(function)
}

/// Returns the bounds of a frame. Without bounds, the frame ends with the rows that are equal to
/// the current one in `order by`.
fn frame(spec: &WindowSpec) -> Result<(Bound, Bound)> {
    let Some(frame) = &spec.window_frame else {
        let is_sorted = !spec.order_by.is_empty();
        return Ok((Bound::Unbounded, if is_sorted { Bound::Peers } else { Bound::Unbounded }));
    };
    let by_rows = frame.units == WindowFrameUnits::Rows;
    let bound = |bound: &WindowFrameBound, is_start: bool| {
        let offset = match bound {
            WindowFrameBound::CurrentRow if by_rows => return Some(Bound::Rows(0)),
            WindowFrameBound::CurrentRow => return Some(Bound::Peers),
            WindowFrameBound::Preceding(None) => return is_start.then_some(Bound::Unbounded),
            WindowFrameBound::Following(None) => return (!is_start).then_some(Bound::Unbounded),
            WindowFrameBound::Preceding(Some(rows)) => format!("-{rows}"),
            WindowFrameBound::Following(Some(rows)) => rows.to_string(),
        };
        by_rows.then(|| offset.parse().ok().map(Bound::Rows)).flatten()
    };
    let end = frame.end_bound.as_ref().unwrap_or(&WindowFrameBound::CurrentRow);
    let is_known = frame.units != WindowFrameUnits::Groups;
    let bounds = bound(&frame.start_bound, true).zip(bound(end, false)).filter(|_| is_known);
    bounds.ok_or_else(|| {
        QueryError::Refused(format!(
            "the frame of `over ({spec})` is not supported; write `rows between …` with numbers of \
             rows, or `range between unbounded preceding and current row`"
        ))
    })
}

/// Returns the arguments of a call as texts; `*` is none.
fn arguments(call: &Function) -> Result<Vec<String>> {
    let FunctionArguments::List(list) = &call.args else {
        return Ok(Vec::new());
    };
    if list.duplicate_treatment == Some(DuplicateTreatment::Distinct) || !list.clauses.is_empty() {
        return refused(format!("`{call}` is not supported"));
    }
    let values = list.args.iter().filter_map(|argument| match argument {
        FunctionArg::Unnamed(FunctionArgExpr::Wildcard) => None,
        other => Some(other.to_string()),
    });
    Ok(values.collect())
}

/// Replaces references to named windows by their definitions.
pub(super) fn resolve_windows(select: &mut Select, ends: &mut Ends) -> Result<()> {
    let mut specs = BTreeMap::new();
    for NamedWindowDefinition(name, window) in std::mem::take(&mut select.named_window) {
        let NamedWindowExpr::WindowSpec(spec) = window else {
            return refused(format!("`window {name}` names another window"));
        };
        specs.insert(name.value, spec);
    }
    let mut resolve = |expression: &mut Expr| {
        if let Expr::Function(function) = expression
            && let Some(WindowType::NamedWindow(name)) = &function.over
            && let Some(spec) = specs.get(&name.value)
        {
            function.over = Some(WindowType::WindowSpec(spec.clone()));
        }
        Ok(())
    };
    each_expression(select, &mut resolve)?;
    each_expression(&mut ends.order_by, &mut resolve)
}
