//! Passes cut into blocks of rows, which threads share.

use super::{Row, Rows};
use crate::contact::threads::Crew;

/// Cuts a pass at rows of so many nodes, from zero on, and leaves nothing.
pub fn cut<T, P: Rows<T>>(rows: &mut P, firsts: &[usize], nodes: usize) -> Vec<P> {
    let firsts = firsts.iter().rev();
    let mut parts: Vec<P> = firsts
        .map(|&first| rows.split_off(Row::new(first, nodes)))
        .collect();
    parts.reverse();
    parts
}

/// Cuts pairs of rows, and a pass that is to see them, into blocks.
pub fn cut_pairs<'p, T, P: Rows<T>>(
    rows: &mut P,
    pairs: &'p [usize],
    crew: &Crew,
    nodes: usize,
) -> (Vec<P>, Vec<&'p [usize]>) {
    let cuts = crew.cuts(pairs.len());
    let ends = cuts[1..].iter().copied().chain([pairs.len()]);
    let blocks: Vec<&[usize]> = cuts
        .iter()
        .zip(ends)
        .map(|(&first, end)| &pairs[first..end])
        .collect();
    let firsts = blocks.iter().map(|pairs| 2 * pairs.first().unwrap_or(&0));
    let firsts: Vec<usize> = firsts.collect();
    (cut(rows, &firsts, nodes), blocks)
}
