//! Buffers that begin on a cache line, so that no register is loaded from two lines.

use std::ops::{Deref, DerefMut};

use super::Real;

/// Bytes of a cache line, and of the widest register.
const LINE: usize = 64;

/// A slice on the heap that begins on a cache line.
pub struct Aligned<T> {
    storage: Vec<T>,
    start: usize,
    len: usize,
}

impl<T: Real> Aligned<T> {
    pub fn zeros(len: usize) -> Self {
        let slack = LINE / size_of::<T>();
        let storage = vec![T::zero(); len + slack];
        let start = storage.as_ptr().align_offset(LINE).min(slack);
        Self { storage, start, len }
    }
}

impl<T: Real> FromIterator<T> for Aligned<T> {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        let values: Vec<T> = values.into_iter().collect();
        let mut aligned = Self::zeros(values.len());
        aligned.copy_from_slice(&values);
        aligned
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.storage[self.start..][..self.len]
    }
}

impl<T> DerefMut for Aligned<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.storage[self.start..][..self.len]
    }
}
