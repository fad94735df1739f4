//! The marks of weeds: one shape and one colour for each state.

use tiny_skia::{PathBuilder, Pixmap, PixmapPaint, Transform};

use crate::colours::{DETECTED, INK, MOWED, PAPER, UNDETECTED};
use crate::draw::{fill, line, polygon, stroke};

/// What has become of a weed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    /// A ring.
    Undetected,
    /// A diamond.
    Detected,
    /// A cross.
    Mowed,
}

/// A mark for each state, drawn once.
#[derive(Debug, Clone)]
pub(crate) struct Marks {
    undetected: Pixmap,
    detected: Pixmap,
    mowed: Pixmap,
}

impl Marks {
    /// Marks that reach so far from their middle.
    pub(crate) fn new(radius_px: f32) -> Self {
        // An odd side, so that the middle is the middle of a pixel.
        let side = 2 * reach(radius_px) + 1;
        let mut undetected = Pixmap::new(side, side).expect("a mark is not empty");
        let (mut detected, mut mowed) = (undetected.clone(), undetected.clone());
        let (middle, r) = (0.5 * side as f32, radius_px);
        let ring = PathBuilder::from_circle(middle, middle, 0.8 * r);
        fill(&mut undetected, ring.as_ref(), PAPER.with_alpha(190));
        stroke(&mut undetected, ring.as_ref(), (0.36 * r).max(1.0), UNDETECTED);
        let s = 1.15 * r;
        let diamond = polygon([
            (middle, middle - s),
            (middle + s, middle),
            (middle, middle + s),
            (middle - s, middle),
        ]);
        stroke(&mut detected, diamond.as_ref(), (0.5 * r).max(1.4), INK);
        fill(&mut detected, diamond.as_ref(), DETECTED);
        let d = 0.78 * r;
        for (x, y) in [(d, d), (d, -d)] {
            let stroke_of = line([(middle - x, middle - y), (middle + x, middle + y)]);
            stroke(&mut mowed, stroke_of.as_ref(), (0.5 * r).max(1.5), MOWED);
        }
        Self { undetected, detected, mowed }
    }

    /// Draws a mark whose middle is at a point.
    pub(crate) fn draw(&self, pixmap: &mut Pixmap, state: State, (x, y): (f32, f32)) {
        let mark = match state {
            State::Undetected => &self.undetected,
            State::Detected => &self.detected,
            State::Mowed => &self.mowed,
        };
        let half = 0.5 * mark.width() as f32;
        let (left, top) = (whole(x - half), whole(y - half));
        pixmap.draw_pixmap(
            left,
            top,
            mark.as_ref(),
            &PixmapPaint::default(),
            Transform::identity(),
            None,
        );
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
fn reach(radius_px: f32) -> u32 {
    (1.5 * radius_px).ceil() as u32 + 1
}

#[expect(clippy::cast_possible_truncation, reason = "within the picture, or cut off")]
fn whole(value: f32) -> i32 {
    value.round() as i32
}
