//! What is met on the way.

use crate::grid::Cell;

/// What is met on a piece of a motion, with an answer each: it seldom is anything, and then nothing has to be tested
/// stretch by stretch.
#[derive(Debug, Clone)]
pub struct Ahead<T> {
    pub(crate) weeds: Vec<(u32, T)>,
    pub(crate) cells: Vec<(Cell, T)>,
}

impl<T> Default for Ahead<T> {
    fn default() -> Self {
        Self { weeds: Vec::new(), cells: Vec::new() }
    }
}

impl<T> Ahead<T> {
    /// Makes room for so many weeds and cells.
    pub(crate) fn reserve(&mut self, weeds: usize, cells: usize) {
        self.clear();
        self.weeds.reserve(weeds);
        self.cells.reserve(cells);
    }

    pub(crate) fn clear(&mut self) {
        self.weeds.clear();
        self.cells.clear();
    }

    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.weeds.is_empty() && self.cells.is_empty()
    }
}

/// Adds to a list if that is wanted: without a branch, where no processor could foresee whether it is.
#[inline]
pub(crate) fn push_if<T: Copy>(list: &mut Vec<T>, entry: T, is_wanted: bool) {
    list.push(entry);
    list.truncate(list.len() - usize::from(!is_wanted));
}
