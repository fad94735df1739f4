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
