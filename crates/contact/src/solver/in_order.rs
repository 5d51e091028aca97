//! Sums over the mesh in the order of its rows, whichever thread adds which of them.
//!
//! A sum of doubles depends on the order of its terms. So threads keep what rows come to, and add it
//! up when all are there: as if one thread had seen them, one after the other.

/// What is found on the way over the mesh, and can be added to what was found before.
pub trait Found: Copy {
    /// Nothing was found yet.
    const NOTHING: Self;

    /// Adds what was found later.
    fn add(&mut self, later: Self);
}

impl Found for f64 {
    const NOTHING: Self = 0.0;

    fn add(&mut self, later: Self) {
        *self += later;
    }
}

/// What was found in rows, in their order.
pub struct InOrder<F>(Vec<F>);

impl<F: Found> InOrder<F> {
    pub fn new() -> Self {
        Self(Vec::new())
    }

    pub fn push(&mut self, found: F) {
        self.0.push(found);
    }

    pub fn append(&mut self, mut later: Self) {
        self.0.append(&mut later.0);
    }

    pub fn total(&self) -> F {
        self.0.iter().fold(F::NOTHING, |mut total, found| {
            total.add(*found);
            total
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_who_has_found_what() {
        // Rounded otherwise in any other order.
        let terms = [1.0, 1e16, -1e16, 3.0, 1e-3];
        let one_by_one = terms.iter().fold(0.0, |sum, term| sum + term);
        for cut in 0..=terms.len() {
            let (mut first, mut last) = (InOrder::new(), InOrder::new());
            terms[..cut].iter().for_each(|term| first.push(*term));
            terms[cut..].iter().for_each(|term| last.push(*term));
            first.append(last);
            assert_eq!(first.total(), one_by_one);
        }
        assert_eq!(InOrder::<f64>::new().total(), 0.0);
    }
}
