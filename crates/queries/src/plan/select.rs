//! Steps of a `select`.

use std::collections::{BTreeMap, BTreeSet};

use sqlparser::ast::{
    Distinct, Expr, GroupByExpr, Ident, OrderByExpr, Select, SelectItem,
    SelectItemQualifiedWildcardKind as Qualifier,
};

use super::expressions::{Calls, Columns, Item, is_output};
use super::from::{hide_joined_keys, move_conditions, qualifiers};
use super::groups::{GroupedSelect, keys};
use super::windows::{Windows, resolve_windows};
use super::{Ends, Planned, Planner, Result, quoted, refused};
use crate::statement::column_name;

impl Planner<'_> {
    pub(super) fn select(&mut self, mut select: Select, mut ends: Ends) -> Result<Planned> {
        let mut tables = self.from(&mut select.from)?;
        move_conditions(&mut select)?;
        // Polars drops also the other columns of the answer whose names `* exclude (…)` has.
        let is_partial = |item: &SelectItem| is_wildcard(item) && !item.to_string().ends_with('*');
        let needs_names = select.projection.len() > 1 && select.projection.iter().any(is_partial);
        hide_joined_keys(&mut select);
        self.subqueries(&mut select, &mut tables)?;
        self.subqueries(&mut ends.order_by, &mut tables)?;
        resolve_windows(&mut select, &mut ends)?;
        let mut calls = Calls::of(&select.projection);
        calls.add(&select.having);
        calls.add(&select.qualify);
        calls.add(&ends.order_by);
        let is_grouped = match &select.group_by {
            GroupByExpr::All(_) => true,
            GroupByExpr::Expressions(keys, _) => !keys.is_empty() || select.having.is_some(),
        };
        let mut columns = BTreeSet::new();
        for (_, table) in &mut tables {
            columns.extend(self.columns(table)?);
        }
        if is_grouped || calls.aggregate.is_some() {
            self.grouped(select, ends, tables, &columns, &calls)
        } else if calls.has_window || needs_names || is_ambiguous(&select, &mut ends, &columns) {
            self.windowed(select, ends, tables, &columns)
        } else {
            self.step(&format!("{select}{}", ends.text()), &tables)
        }
    }

    /// Plans a `select` that reduces groups of rows.
    fn grouped(
        &mut self,
        mut select: Select,
        mut ends: Ends,
        mut tables: Vec<(String, Planned)>,
        columns: &BTreeSet<String>,
        calls: &Calls,
    ) -> Result<Planned> {
        let mut items = Vec::new();
        for item in std::mem::take(&mut select.projection) {
            let Some(item) = named(item) else {
                let with = calls.aggregate.as_deref().unwrap_or("group by");
                return refused(format!(
                    "`*` cannot be combined with `{with}`: list the columns and add a `group by`"
                ));
            };
            items.push(item);
        }
        let keys = keys(&select.group_by, &items, columns)?;
        let mut groups = GroupedSelect {
            keys: Vec::new(),
            inputs: Columns::with_prefix("a"),
            aggregates: Columns::with_prefix("g"),
            aliases: BTreeMap::new(),
        };
        for key in keys {
            let name = groups.inputs.name(&key);
            groups.keys.push((key, name));
        }
        for (expression, _) in &mut items {
            groups.lower(expression)?;
        }
        groups.aliases = items.iter().map(|(value, name)| (name.clone(), value.clone())).collect();
        let (mut having, mut qualify) = (select.having.take(), select.qualify.take());
        for condition in having.iter_mut().chain(&mut qualify) {
            groups.lower(condition)?;
        }
        for part in ends.order() {
            if !is_output(&part.expr, &items) {
                groups.lower(&mut part.expr)?;
            }
        }
        let GroupedSelect { keys: named, mut inputs, aggregates, .. } = groups;
        // Rows without a column would be lost.
        inputs.name(&1);
        let distinct = select.distinct.take();
        let source = self.inputs(select, &inputs, &tables)?;
        let name = self.name();
        let keys: Vec<&str> = named.iter().map(|(_, name)| name.as_str()).collect();
        let reduced: Vec<String> =
            keys.iter().map(|key| (*key).to_owned()).chain(aggregates.items()).collect();
        let group_by =
            if keys.is_empty() { String::new() } else { format!(" group by {}", keys.join(", ")) };
        let reduced =
            if reduced.is_empty() { "count(*) as __rows".to_owned() } else { reduced.join(", ") };
        let text = format!("select {reduced} from \"{name}\"{group_by}");
        let mut reduced = self.step(&text, &[(name, source)])?;
        if let Some(having) = having {
            let name = self.name();
            let text = format!("select * from \"{name}\" where {having}");
            // The tables of `in (select …)` have names of the planner.
            tables.retain(|(known, _)| known.starts_with("__"));
            tables.push((name, reduced));
            reduced = self.step(&text, &tables)?;
        }
        let mut windows = Windows::new(None);
        windows.lower_all(&mut items, &mut qualify, &mut ends)?;
        if !windows.windows.is_empty() {
            let name = self.name();
            let items: String = windows.inputs.items().map(|item| format!(", {item}")).collect();
            let inputs =
                self.step(&format!("select *{items} from \"{name}\""), &[(name, reduced)])?;
            reduced = windows.add(inputs);
        }
        self.last(reduced, &items, distinct, qualify, &ends)
    }

    /// Plans a `select` with window functions, or whose names polars resolves otherwise.
    fn windowed(
        &mut self,
        mut select: Select,
        mut ends: Ends,
        mut tables: Vec<(String, Planned)>,
        columns: &BTreeSet<String>,
    ) -> Result<Planned> {
        let mut items: Vec<Item> = Vec::new();
        for item in std::mem::take(&mut select.projection) {
            if let Some(item) = named(item.clone()) {
                items.push(item);
                continue;
            }
            // `u.*` has columns of `u`; `*` has those of the first table that has the name.
            let qualifier = match &item {
                SelectItem::QualifiedWildcard(Qualifier::ObjectName(table), _) => {
                    table.0.last().and_then(|part| part.as_ident()).map(|name| name.value.clone())
                }
                _ => None,
            };
            if let SelectItem::Wildcard(options) | SelectItem::QualifiedWildcard(_, options) = &item
                && (options.opt_replace.is_some() || options.opt_rename.is_some())
            {
                return refused(format!(
                    "`{item}` cannot be combined with other columns; list all"
                ));
            }
            let all = Select { projection: vec![item], ..bare(&select) };
            let mut all = self.step(&all.to_string(), &tables)?;
            for name in self.columns(&mut all)? {
                let owner = tables.iter_mut().find_map(|(table, planned)| {
                    let is_meant = qualifier.as_ref().is_none_or(|qualifier| qualifier == table);
                    let has = self.columns(planned).is_ok_and(|names| names.contains(&name));
                    (is_meant && has).then(|| table.clone())
                });
                let parts = owner.iter().chain([&name]).map(|part| Ident::with_quote('"', part));
                items.push((Expr::CompoundIdentifier(parts.collect()), name.clone()));
            }
        }
        let mut windows = Windows::new(Some(columns));
        windows.aliases = items.iter().map(|(value, name)| (name.clone(), value.clone())).collect();
        let mut qualify = select.qualify.take();
        windows.lower_all(&mut items, &mut qualify, &mut ends)?;
        let distinct = select.distinct.take();
        let source = self.inputs(select, &windows.inputs, &tables)?;
        self.last(windows.add(source), &items, distinct, qualify, &ends)
    }

    /// Executes the step that computes the inputs of the next one.
    fn inputs(
        &mut self,
        select: Select,
        inputs: &Columns,
        tables: &[(String, Planned)],
    ) -> Result<Planned> {
        let projection = vec![SelectItem::UnnamedExpr(Expr::Identifier(Ident::new("__inputs")))];
        let text = Select { projection, ..bare(&select) }.to_string();
        let items: Vec<String> = inputs.items().collect();
        self.step(&text.replacen("__inputs", &items.join(", "), 1), tables)
    }

    /// Executes the step that computes the columns of the answer.
    fn last(
        &mut self,
        planned: Planned,
        items: &[Item],
        distinct: Option<Distinct>,
        condition: Option<Expr>,
        ends: &Ends,
    ) -> Result<Planned> {
        let name = self.name();
        let distinct = distinct.map_or(String::new(), |distinct| format!("{distinct} "));
        let columns = items.iter().map(|(value, name)| format!("{value} as {}", quoted(&[name])));
        let items = columns.collect::<Vec<_>>().join(", ");
        let condition = condition.map_or(String::new(), |condition| format!(" where {condition}"));
        let text = format!("select {distinct}{items} from \"{name}\"{condition}{}", ends.text());
        self.step(&text, &[(name, planned)])
    }
}

/// Returns whether an expression of `order by` has the name of a column of a table that a column of
/// the answer has, too. The table goes before; polars takes the column of the answer.
fn is_ambiguous(select: &Select, ends: &mut Ends, columns: &BTreeSet<String>) -> bool {
    let named = select.projection.iter().filter_map(|item| match item {
        SelectItem::ExprWithAlias { alias, .. } => Some(alias.value.clone()),
        _ => None,
    });
    let aliases: BTreeSet<String> = named.filter(|alias| columns.contains(alias)).collect();
    let is_expression = |part: &&OrderByExpr| !matches!(part.expr, Expr::Identifier(_));
    // The columns of `select distinct` cannot be sorted by others.
    select.distinct.is_none()
        && ends
            .order()
            .iter()
            .filter(is_expression)
            .any(|part| !qualifiers(&part.expr).is_disjoint(&aliases))
}

fn is_wildcard(item: &SelectItem) -> bool {
    matches!(item, SelectItem::Wildcard(_) | SelectItem::QualifiedWildcard(..))
}

/// Returns the expression and the name of a column of an answer; `None` for `*`.
fn named(item: SelectItem) -> Option<Item> {
    match item {
        SelectItem::ExprWithAlias { expr, alias } => Some((expr, alias.value)),
        SelectItem::UnnamedExpr(expression) => {
            let name = column_name(&expression);
            Some((expression, name))
        }
        _ => None,
    }
}

/// Returns a `select` with the tables and the condition of another one, and nothing else.
fn bare(select: &Select) -> Select {
    Select {
        distinct: None,
        projection: Vec::new(),
        group_by: GroupByExpr::Expressions(Vec::new(), Vec::new()),
        having: None,
        qualify: None,
        ..select.clone()
    }
}
