//! Labels, in the font that comes with the crate.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use tiny_skia::{Pixmap, PremultipliedColorU8};

use crate::colours::Rgb;

static INTER: &[u8] = include_bytes!("../font/Inter-Medium.subset.otf");
/// What the font lacks is drawn as this.
const REPLACEMENT: char = '?';

/// Where the point of a label lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Left,
    Middle,
    Right,
}

/// A font of one size.
#[derive(Debug, Clone)]
pub(crate) struct Letters {
    font: FontRef<'static>,
    scale: PxScale,
}

impl Letters {
    /// Letters of `em_px` points a side.
    pub(crate) fn new(em_px: f32) -> Self {
        let font = FontRef::try_from_slice(INTER).expect("the font was read when the tests ran");
        let units = font.units_per_em().expect("the font says how many units an em has");
        let scale = PxScale::from(em_px * font.height_unscaled() / units);
        Self { font, scale }
    }

    /// How wide a text is, in pixels.
    pub(crate) fn width(&self, text: &str) -> f32 {
        self.glyphs(text, 0.0, 0.0).1
    }

    /// The longest beginning of a text that is not wider than that, with an ellipsis where something is cut off.
    pub(crate) fn cut(&self, text: &str, width_px: f32) -> String {
        if self.width(text) <= width_px {
            return text.to_owned();
        }
        let mut beginning: String = text.to_owned();
        while beginning.pop().is_some() {
            let cut = format!("{}…", beginning.trim_end());
            if self.width(&cut) <= width_px {
                return cut;
            }
        }
        String::new()
    }

    /// Draws a text whose baseline is at `y`.
    pub(crate) fn draw(
        &self,
        pixmap: &mut Pixmap,
        text: &str,
        (x, y): (f32, f32),
        anchor: Anchor,
        colour: Rgb,
    ) {
        let width = self.width(text);
        let left = match anchor {
            Anchor::Left => x,
            Anchor::Middle => x - 0.5 * width,
            Anchor::Right => x - width,
        };
        let (columns, rows) = (pixmap.width(), pixmap.height());
        for glyph in self.glyphs(text, left.round(), y.round()).0 {
            let Some(outline) = self.font.outline_glyph(glyph) else { continue };
            let bounds = outline.px_bounds();
            outline.draw(|column, row, coverage| {
                let (x, y) = (bounds.min.x + column as f32, bounds.min.y + row as f32);
                if x < 0.0 || y < 0.0 || x >= columns as f32 || y >= rows as f32 {
                    return;
                }
                let at = pixel(y) * columns as usize + pixel(x);
                let below = &mut pixmap.pixels_mut()[at];
                *below = over(*below, colour, coverage);
            });
        }
    }

    /// The glyphs of a text from a point on, and how far they reach.
    fn glyphs(&self, text: &str, left: f32, baseline: f32) -> (Vec<Glyph>, f32) {
        let font = self.font.as_scaled(self.scale);
        let mut at = left;
        let glyphs = text.chars().map(|letter| {
            let mut id = font.glyph_id(letter);
            if id.0 == 0 {
                id = font.glyph_id(REPLACEMENT);
            }
            let glyph = id.with_scale_and_position(self.scale, point(at, baseline));
            at += font.h_advance(id);
            glyph
        });
        let glyphs = glyphs.collect();
        (glyphs, at - left)
    }
}

/// A colour over an opaque one.
fn over(below: PremultipliedColorU8, colour: Rgb, coverage: f32) -> PremultipliedColorU8 {
    let mix = |below: u8, above: u8| {
        let value = f32::from(below) + (f32::from(above) - f32::from(below)) * coverage.min(1.0);
        byte(value)
    };
    let (red, green, blue) =
        (mix(below.red(), colour.0), mix(below.green(), colour.1), mix(below.blue(), colour.2));
    PremultipliedColorU8::from_rgba(red, green, blue, 255)
        .expect("opaque colours are premultiplied")
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
fn byte(value: f32) -> u8 {
    value.round() as u8
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the picture")]
fn pixel(value: f32) -> usize {
    value as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_of_one_width_and_every_letter_of_a_label_is_there() {
        let letters = Letters::new(12.0);
        let widths = ["111.1", "888.8"].map(|text| letters.width(text));
        assert!((widths[0] - widths[1]).abs() < 1e-3, "{widths:?}");
        for letter in (' '..='~').chain("·×–…°±²".chars()) {
            assert_ne!(letters.font.glyph_id(letter).0, 0, "{letter:?} is missing");
        }
    }

    #[test]
    fn a_text_that_is_cut_fits() {
        let letters = Letters::new(12.0);
        for width_px in [0.0, 5.0, 30.0, 60.0, 500.0] {
            let cut = letters.cut("maskable-routing", width_px);
            assert!(letters.width(&cut) <= width_px, "{cut:?}");
        }
        assert_eq!(letters.cut("snake", 100.0), "snake");
    }
}
