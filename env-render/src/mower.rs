//! The mower, its deck and what it detects.

use swath_core::geometry::{Frame, Point, Triangle};
use swath_core::site::Site;
use tiny_skia::{PathBuilder, Pixmap};

use crate::colours::{INK, PAPER, PATH, SENSOR, SENSOR_BORDER};
use crate::draw::{bar_ends, fill, line, polygon, stroke};
use crate::layout::Plot;

/// Draws the triangle in which weeds are detected.
pub(crate) fn triangle(pixmap: &mut Pixmap, plot: &Plot, site: &Site, at: &Frame) {
    let triangle = Triangle::new(site.sensor_range_m, site.sensor_width_m);
    let shape = polygon(triangle.corners(at).map(|corner| plot.at(corner)));
    fill(pixmap, shape.as_ref(), SENSOR.with_alpha(80));
    stroke(pixmap, shape.as_ref(), plot.zoom, SENSOR_BORDER);
}

/// Draws the mower: its deck in its true width, its body ahead of it, never too small to be found.
pub(crate) fn mower(pixmap: &mut Pixmap, plot: &Plot, site: &Site, at: &Frame) {
    let (x, y) = plot.at(at.pose.position());
    let (cos, sin) = (crate::layout::single(at.cos), crate::layout::single(at.sin));
    let body = plot.px(0.8 * site.deck_width_m).clamp(9.0 * plot.zoom, 40.0 * plot.zoom);
    body_of(pixmap, (x, y), (cos, -sin), body, plot.zoom);
    let deck = bar_ends(at, site.deck_width_m).map(|end: Point| plot.at(end));
    deck_of(pixmap, deck, plot.zoom);
}

/// Marks where the path begins.
pub(crate) fn start(pixmap: &mut Pixmap, (x, y): (f32, f32), zoom: f32) {
    let dot = PathBuilder::from_circle(x, y, 3.0 * zoom);
    fill(pixmap, dot.as_ref(), PAPER);
    stroke(pixmap, dot.as_ref(), 1.6 * zoom, PATH);
}

/// Draws a small one for the legend, which drives to the right.
pub(crate) fn icon(pixmap: &mut Pixmap, (x, y): (f32, f32), zoom: f32) {
    let (back, half) = (x - 4.0 * zoom, 5.0 * zoom);
    body_of(pixmap, (back, y), (1.0, 0.0), 9.0 * zoom, zoom);
    deck_of(pixmap, [(back, y - half), (back, y + half)], zoom);
}

/// A body that points along a direction of the picture, from the middle of the deck on.
fn body_of(
    pixmap: &mut Pixmap,
    (x, y): (f32, f32),
    (ahead_x, ahead_y): (f32, f32),
    length: f32,
    zoom: f32,
) {
    let half = 0.38 * length;
    let corner = |ahead: f32, aside: f32| {
        (x + ahead * ahead_x - aside * ahead_y, y + ahead * ahead_y + aside * ahead_x)
    };
    let shape = polygon([
        corner(0.0, half),
        corner(0.55 * length, half),
        corner(length, 0.0),
        corner(0.55 * length, -half),
        corner(0.0, -half),
    ]);
    stroke(pixmap, shape.as_ref(), 2.0 * zoom, PAPER);
    fill(pixmap, shape.as_ref(), PATH);
}

fn deck_of(pixmap: &mut Pixmap, ends: [(f32, f32); 2], zoom: f32) {
    let bar = line(ends);
    stroke(pixmap, bar.as_ref(), 4.0 * zoom, PAPER);
    stroke(pixmap, bar.as_ref(), 2.4 * zoom, INK);
}
