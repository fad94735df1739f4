//! Lines, shapes and marks on a pixmap.

use swath_core::geometry::{Frame, Point};
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform,
};

use crate::layout::Plot;

/// A paint of one colour.
pub(crate) fn paint(colour: impl Into<Color>) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour.into());
    paint
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
