//! Who is told what every stretch of a command brings.

use crate::deck::Cut;
use crate::sensor::Percept;

/// Hears of every cut and every look while a command is driven, such as a record of the episode. It changes nothing.
///
/// Stretches that bring nothing new may be left out. The look at the start belongs to the reset and is not told.
pub trait Watch {
    /// Whether nobody hears of anything, so that stretches need not be told apart.
    const IS_NOBODY: bool = false;

    /// The deck has cut on a stretch that ended when the mower had come `path_m` since reset.
    fn on_cut(&mut self, path_m: f64, cut: &Cut);

    /// The sensor has looked when the mower had come `path_m` since reset.
    fn on_look(&mut self, path_m: f64, percept: &Percept);
}

/// Nobody.
impl Watch for () {
    const IS_NOBODY: bool = true;

    #[inline]
    fn on_cut(&mut self, _path_m: f64, _cut: &Cut) {}

    #[inline]
    fn on_look(&mut self, _path_m: f64, _percept: &Percept) {}
}
