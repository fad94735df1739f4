//! Lines, shapes and marks on a pixmap.

use swath_core::geometry::{Frame, Point};
use tiny_skia::{
    BlendMode, Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap,
    PremultipliedColorU8, Stroke, Transform,
};

use crate::colours::Rgb;
use crate::layout::Plot;

/// A paint of one colour.
pub(crate) fn paint(colour: impl Into<Color>) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour.into());
    paint
}

/// What lies where, as the coverage of its pixels: pieces that border on each other close without a seam, and what is
/// covered twice is covered.
#[derive(Debug, Clone)]
pub(crate) struct Layer(Pixmap);

impl Layer {
    /// Nothing yet, on so many pixels.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        Self(Pixmap::new(width, height).expect("a plot is not empty"))
    }

    /// Takes everything away.
    pub(crate) fn clear(&mut self) {
        self.0.fill(Color::TRANSPARENT);
    }

    /// Becomes what another one of the same size is.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.0.data_mut().copy_from_slice(other.0.data());
    }

    /// Adds a shape; where its parts overlap nothing is left out.
    pub(crate) fn add(&mut self, path: Option<&Path>) {
        let Some(path) = path else { return };
        self.0.fill_path(path, &Self::paint(), FillRule::Winding, Transform::identity(), None);
    }

    /// Adds a line that ends where its last point is.
    pub(crate) fn add_line(&mut self, path: Option<&Path>, width_px: f32) {
        let Some(path) = path else { return };
        let stroke = Stroke { width: width_px, line_join: LineJoin::Round, ..Stroke::default() };
        self.0.stroke_path(path, &Self::paint(), &stroke, Transform::identity(), None);
    }

    /// Paints what is covered on an opaque pixmap of the same size.
    pub(crate) fn lay(&self, pixmap: &mut Pixmap, colour: Rgb) {
        for (below, above) in pixmap.pixels_mut().iter_mut().zip(self.0.pixels()) {
            let (share, rest) = (u16::from(above.alpha()), u16::from(u8::MAX - above.alpha()));
            if share == 0 {
                continue;
            }
            let mix = |below: u8, above: u8| {
                let sum = u16::from(below) * rest + u16::from(above) * share;
                u8::try_from((sum + 127) / 255).expect("a mean of bytes is one")
            };
            let (red, green, blue) = (
                mix(below.red(), colour.0),
                mix(below.green(), colour.1),
                mix(below.blue(), colour.2),
            );
            *below = PremultipliedColorU8::from_rgba(red, green, blue, u8::MAX)
                .expect("opaque colours are premultiplied");
        }
    }

    fn paint() -> Paint<'static> {
        Paint { blend_mode: BlendMode::Plus, ..paint(Color::WHITE) }
    }
}

/// Fills a shape; where its parts overlap nothing is left out.
pub(crate) fn fill(pixmap: &mut Pixmap, path: Option<&Path>, colour: impl Into<Color>) {
    let Some(path) = path else { return };
    pixmap.fill_path(path, &paint(colour), FillRule::Winding, Transform::identity(), None);
}

/// Draws the border of a shape, or a line.
pub(crate) fn stroke(
    pixmap: &mut Pixmap,
    path: Option<&Path>,
    width_px: f32,
    colour: impl Into<Color>,
) {
    let Some(path) = path else { return };
    let stroke = Stroke {
        width: width_px,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        ..Stroke::default()
    };
    pixmap.stroke_path(path, &paint(colour), &stroke, Transform::identity(), None);
}

/// A line through points.
pub(crate) fn line(points: impl IntoIterator<Item = (f32, f32)>) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (x, y) in points {
        if builder.is_empty() { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    builder.finish()
}

/// A shape with these corners.
pub(crate) fn polygon(corners: impl IntoIterator<Item = (f32, f32)>) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (x, y) in corners {
        if builder.is_empty() { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    builder.close();
    builder.finish()
}

/// A rectangle between two corners.
pub(crate) fn rectangle((left, top): (f32, f32), (right, bottom): (f32, f32)) -> Option<Path> {
    polygon([(left, top), (right, top), (right, bottom), (left, bottom)])
}

/// Where the ends of a bar of `width_m` across a frame are, left and right.
pub(crate) fn bar_ends(frame: &Frame, width_m: f64) -> [Point; 2] {
    let Frame { pose, cos, sin } = *frame;
    let half_m = 0.5 * width_m;
    let (x_m, y_m) = (half_m * sin, half_m * cos);
    [Point::new(pose.x_m - x_m, pose.y_m + y_m), Point::new(pose.x_m + x_m, pose.y_m - y_m)]
}

/// The ground that a bar passes over between frames.
pub(crate) fn swath(
    plot: &Plot,
    frames: impl IntoIterator<Item = Frame>,
    width_m: f64,
) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let mut before: Option<[(f32, f32); 2]> = None;
    for frame in frames {
        let ends = bar_ends(&frame, width_m).map(|end| plot.at(end));
        if let Some([left, right]) = before {
            // Two triangles, each turned the same way round: the inner end of the bar may go backwards in a turn.
            for mut corners in [[left, right, ends[1]], [left, ends[1], ends[0]]] {
                let [a, b, c] = corners;
                if (b.0 - a.0) * (c.1 - a.1) < (b.1 - a.1) * (c.0 - a.0) {
                    corners.swap(1, 2);
                }
                builder.move_to(corners[0].0, corners[0].1);
                builder.line_to(corners[1].0, corners[1].1);
                builder.line_to(corners[2].0, corners[2].1);
                builder.close();
            }
        }
        before = Some(ends);
    }
    builder.finish()
}
