//! Columns of a step, and the calls in their expressions.

use std::ops::ControlFlow;

use sqlparser::ast::{Expr, Function, Ident, Visit, Visitor};

use crate::statement;

/// Column of an answer in the making: its expression on the last step, and its name.
pub(super) type Item = (Expr, String);

/// Expressions that a step computes as columns, with the names of these columns.
pub(super) struct Columns {
    prefix: &'static str,
    pub(super) names: Vec<(String, String)>,
}

impl Columns {
    pub(super) fn with_prefix(prefix: &'static str) -> Columns {
        Columns { prefix, names: Vec::new() }
    }

    /// Returns the name of the column with an expression, which is added if it is new.
    pub(super) fn name(&mut self, expression: &impl ToString) -> String {
        let text = expression.to_string();
        if let Some((_, name)) = self.names.iter().find(|(known, _)| *known == text) {
            return name.clone();
        }
        let name = format!("__{}{}", self.prefix, self.names.len());
        self.names.push((text, name.clone()));
        name
    }

    pub(super) fn column(&mut self, expression: &impl ToString) -> Expr {
        Expr::Identifier(Ident::new(self.name(expression)))
    }

    pub(super) fn items(&self) -> impl Iterator<Item = String> {
        self.names.iter().map(|(value, name)| format!("{value} as {name}"))
    }
}

/// Aggregates and window functions in expressions.
#[derive(Default)]
pub(super) struct Calls {
    /// First aggregate.
    pub(super) aggregate: Option<String>,
    pub(super) has_window: bool,
}

impl Calls {
    pub(super) fn add(&mut self, node: &impl Visit) {
        visit_each(node, &mut |expression| {
            if let Expr::Function(function) = expression {
                self.has_window |= function.over.is_some();
                if is_aggregate(function) && self.aggregate.is_none() {
                    self.aggregate = Some(function.to_string());
                }
            }
        });
    }

    pub(super) fn of(node: &impl Visit) -> Calls {
        let mut calls = Calls::default();
        calls.add(node);
        calls
    }

    pub(super) fn is_empty(&self) -> bool {
        self.aggregate.is_none() && !self.has_window
    }
}

/// Calls `look` for each expression of a node.
pub(super) fn visit_each(node: &impl Visit, look: &mut dyn FnMut(&Expr)) {
    // One type of visitor, as in `each_expression`.
    struct Each<'a>(&'a mut dyn FnMut(&Expr));
    impl Visitor for Each<'_> {
        type Break = ();

        fn pre_visit_expr(&mut self, expression: &Expr) -> ControlFlow<()> {
            (self.0)(expression);
            ControlFlow::Continue(())
        }
    }
    let _ = node.visit(&mut Each(look));
}

/// Returns whether a function aggregates rows. With `over` it computes one value per row.
pub(super) fn is_aggregate(function: &Function) -> bool {
    function.over.is_none() && statement::is_aggregate(&name_of(function))
}

pub(super) fn name_of(function: &Function) -> String {
    function.name.to_string().to_lowercase()
}

/// Returns whether a name stands for a column of a step.
pub(super) fn is_planned(name: &Ident) -> bool {
    name.value.starts_with("__")
}

/// Returns whether a part of `order by` is a column of the answer or its number.
pub(super) fn is_output(expression: &Expr, items: &[Item]) -> bool {
    match expression {
        Expr::Identifier(name) => items.iter().any(|(_, known)| *known == name.value),
        Expr::Value(_) => true,
        _ => false,
    }
}
