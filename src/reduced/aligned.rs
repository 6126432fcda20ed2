//! Lists that begin with a line of the cache: the widest registers are as long, and one that lies across two lines takes twice the time.

use std::ops::{Deref, DerefMut};

/// Bytes of a line.
const LINE: usize = 64;

/// Numbers of a fixed count.
#[derive(Debug)]
pub struct Aligned<N> {
    numbers: Vec<N>,
    first: usize,
    count: usize,
}

impl<N: Copy + Default> Aligned<N> {
    /// So many zeros.
    pub fn zeros(count: usize) -> Self {
        let numbers = vec![N::default(); count + LINE / size_of::<N>()];
        let first = numbers.as_ptr().align_offset(LINE).min(numbers.len() - count);
        Self { numbers, first, count }
    }
}

impl<N: Copy + Default> From<Vec<N>> for Aligned<N> {
    fn from(list: Vec<N>) -> Self {
        let mut own = Self::zeros(list.len());
        own.copy_from_slice(&list);
        own
    }
}

impl<N: Copy + Default> Clone for Aligned<N> {
    fn clone(&self) -> Self {
        let mut own = Self::zeros(self.count);
        own.copy_from_slice(self);
        own
    }

    fn clone_from(&mut self, other: &Self) {
        if self.count == other.count {
            self.copy_from_slice(other);
        } else {
            *self = other.clone();
        }
    }
}

impl<N> Deref for Aligned<N> {
    type Target = [N];

    #[inline(always)]
    fn deref(&self) -> &[N] {
        &self.numbers[self.first..self.first + self.count]
    }
}

impl<N> DerefMut for Aligned<N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [N] {
        &mut self.numbers[self.first..self.first + self.count]
    }
}

impl<'a, N> IntoIterator for &'a Aligned<N> {
    type Item = &'a N;
    type IntoIter = std::slice::Iter<'a, N>;

    #[inline(always)]
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, N> IntoIterator for &'a mut Aligned<N> {
    type Item = &'a mut N;
    type IntoIter = std::slice::IterMut<'a, N>;

    #[inline(always)]
    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}
