//! Passes cut into blocks of rows, which threads share.

use super::{Real, Row, Rows};
use crate::threads::{Crew, Threads};

/// Cuts a pass at rows of so many nodes, from zero on, and leaves nothing.
pub fn cut<T, P: Rows<T>>(rows: &mut P, firsts: &[usize], nodes: usize) -> Vec<P> {
    let firsts = firsts.iter().rev();
    let mut parts: Vec<P> = firsts.map(|&first| rows.split_off(Row::new(first, nodes))).collect();
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
    let blocks: Vec<&[usize]> =
        cuts.iter().zip(ends).map(|(&first, end)| &pairs[first..end]).collect();
    let firsts = blocks.iter().map(|pairs| 2 * pairs.first().unwrap_or(&0));
    let firsts: Vec<usize> = firsts.collect();
    (cut(rows, &firsts, nodes), blocks)
}

/// Lets a pass see, for each of these pairs, rows 2 `pair` and, if there is one, 2 `pair` + 1 of a map of `nodes`, of
/// which nothing is known before. Pairs ascend.
pub fn see_pairs<T: Real, P: Rows<T>>(
    threads: &Threads,
    pairs: &[usize],
    [rows, row_nodes]: [usize; 2],
    pass: &mut P,
) {
    let crew = threads.crew(2 * pairs.len() * row_nodes);
    let (parts, pairs) = cut_pairs(pass, pairs, &crew, row_nodes);
    let mut blocks: Vec<(P, &[usize])> = parts.into_iter().zip(pairs).collect();
    let new = || vec![T::zero(); row_nodes];
    crew.each(&mut Vec::new(), new, &mut blocks, |values, (part, pairs)| {
        let seen = pairs.iter().flat_map(|pair| [2 * pair, 2 * pair + 1]);
        for row in seen.filter(|row| *row < rows) {
            part.row(Row::new(row, row_nodes), values);
        }
    });
    for (part, _) in blocks {
        pass.append(part);
    }
}
