//! The colours of a picture: told apart in daylight, by colour-blind readers (after Okabe & Ito, 2008), and in grey.

use tiny_skia::Color;

/// A colour that hides what is below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rgb(pub(crate) u8, pub(crate) u8, pub(crate) u8);

impl Rgb {
    /// The same, through which what is below shines: 255 hides it.
    pub(crate) fn with_alpha(self, alpha: u8) -> Color {
        Color::from_rgba8(self.0, self.1, self.2, alpha)
    }
}

impl From<Rgb> for Color {
    fn from(colour: Rgb) -> Self {
        colour.with_alpha(255)
    }
}

/// What lies around a picture's plot.
pub(crate) const PAPER: Rgb = Rgb(255, 255, 255);
pub(crate) const INK: Rgb = Rgb(30, 30, 30);
pub(crate) const FAINT_INK: Rgb = Rgb(110, 110, 110);

/// Ground, from dark to light: the less is known of it, the darker.
pub(crate) const UNSEEN: Rgb = Rgb(133, 150, 128);
pub(crate) const SEEN: Rgb = Rgb(196, 214, 180);
pub(crate) const MOWED_STRIP: Rgb = Rgb(250, 241, 205);
/// Outside the fence.
pub(crate) const HEADLAND: Rgb = Rgb(236, 234, 228);
pub(crate) const FENCE: Rgb = Rgb(70, 70, 70);

pub(crate) const PATH: Rgb = Rgb(0, 114, 178);
pub(crate) const SENSOR: Rgb = Rgb(240, 228, 66);
pub(crate) const SENSOR_BORDER: Rgb = Rgb(120, 95, 0);

pub(crate) const UNDETECTED: Rgb = Rgb(30, 30, 30);
pub(crate) const DETECTED: Rgb = Rgb(213, 94, 0);
pub(crate) const MOWED: Rgb = Rgb(122, 31, 98);
