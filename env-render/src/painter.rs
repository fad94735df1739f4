//! From an environment to a picture.

use swath_core::env::Env;
use swath_core::geometry::Frame;
use swath_core::ground::SeenGround;
use swath_core::site::Site;
use tiny_skia::{Pixmap, PremultipliedColorU8};

use crate::chrome::{Chrome, Status};
use crate::colours::{FENCE, HEADLAND, MOWED_STRIP, PATH, Rgb, SEEN, UNSEEN};
use crate::draw::{Layer, line, rectangle, stroke, swath};
use crate::layout::{Plot, Size, Window, single};
use crate::marks::{Marks, State};
use crate::mower;
use crate::picture::Picture;
use crate::track::Track;

/// Paints the pictures of one environment, and keeps what stays the same from one to the next.
///
/// A picture depends on the state of the environment and the path it has kept, not on the pictures before.
/// It shows the truth: undetected weeds too. It is for who owns an environment, never for an agent.
#[derive(Debug, Clone)]
pub struct Painter {
    size: Size,
    title: String,
    least: Option<Window>,
    scene: Option<Scene>,
}

impl Painter {
    /// A painter of pictures of one size, with a title where it is not empty.
    #[must_use]
    pub fn new(size: Size, title: impl Into<String>) -> Self {
        Self { size, title: title.into(), least: None, scene: None }
    }

    /// Shows this window at least, instead of the pasture and what turns take around it.
    #[must_use]
    pub fn showing(mut self, window: Window) -> Self {
        self.least = Some(window);
        self
    }

    /// Size of the pictures.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// Paints an environment as it stands: the path as far as it was kept ([`Env::keep_trace`]).
    pub fn paint(&mut self, env: &Env) -> Picture {
        let scene = self.scene.get_or_insert_with(|| {
            let site = env.site();
            let least = self.least.unwrap_or_else(|| Window::around(site));
            Scene::new(self.size, least, site, &self.title)
        });
        scene.follow(env, &self.title);
        scene.paint(env)
    }
}

/// What is kept from one picture to the next.
#[derive(Debug, Clone)]
struct Scene {
    size: Size,
    least: Window,
    chrome: Chrome,
    marks: Marks,
    track: Track,
    ground: Ground,
    /// Of the parts of the path that are complete.
    strip: Layer,
    path: Layer,
    /// Memory that every picture works in: where a plot is put together, and a layer with what is not complete.
    canvas: Pixmap,
    layer: Layer,
}

impl Scene {
    fn new(size: Size, least: Window, site: &Site, title: &str) -> Self {
        // Marks grow with the scale, within what can be read and what leaves room for others.
        let zoom = size.zoom();
        let rough = f64::from(size.width()) / (least.high_m[0] - least.low_m[0]);
        let marks = Marks::new(single(0.45 * rough).clamp(2.8 * zoom, 4.2 * zoom));
        let chrome = Chrome::new(size, least, &marks, title);
        let track = Track::new(site.turning_radius_m, site.deck_width_m, least);
        let (ground, canvas) = (Ground::new(&chrome.plot, site), blank(&chrome.plot));
        let layer = Layer::new(canvas.width(), canvas.height());
        let (strip, path) = (layer.clone(), layer.clone());
        Self { size, least, chrome, marks, track, ground, strip, path, canvas, layer }
    }

    /// Takes over what has happened since the last picture.
    fn follow(&mut self, env: &Env, title: &str) {
        let (view, site) = (env.view(), env.site());
        let goes_on = match env.trace() {
            Some(trace) => self.track.follow(trace, view.pose, self.least),
            None => self.track.stand(view.pose, self.least),
        };
        let window = self.track.window();
        if window != self.chrome.plot.window {
            self.chrome = Chrome::new(self.size, window, &self.marks, title);
            self.canvas = blank(&self.chrome.plot);
            self.layer = Layer::new(self.canvas.width(), self.canvas.height());
            (self.strip, self.path) = (self.layer.clone(), self.layer.clone());
            self.ground = Ground::new(&self.chrome.plot, site);
            self.track.rewind();
        } else if !goes_on {
            self.strip.clear();
            self.path.clear();
            self.ground = Ground::new(&self.chrome.plot, site);
        }
        let plot = self.chrome.plot;
        while let Some(part) = self.track.next_part() {
            add_strip(&mut self.strip, &plot, part.iter().copied(), site);
            add_path(&mut self.path, &plot, part.iter().copied());
        }
        self.ground.show(&plot, view.ground);
    }

    fn paint(&mut self, env: &Env) -> Picture {
        let (view, site, plot) = (env.view(), env.site(), self.chrome.plot);
        let at = Frame::from(view.pose);
        let Self { canvas, layer, .. } = self;
        canvas.data_mut().copy_from_slice(self.ground.pixmap.data());
        layer.copy_from(&self.strip);
        add_strip(layer, &plot, self.track.rest(), site);
        layer.lay(canvas, MOWED_STRIP);
        draw_fence(canvas, &plot, site);
        layer.copy_from(&self.path);
        add_path(layer, &plot, self.track.rest());
        layer.lay(canvas, PATH);
        if let Some(start) = self.track.start() {
            mower::start(canvas, plot.at(start.pose.position()), plot.zoom);
        }
        mower::triangle(canvas, &plot, site, &at);
        let status = draw_weeds(canvas, &plot, &self.marks, env);
        mower::mower(canvas, &plot, site, &at);
        self.chrome.finish(canvas, &status)
    }
}

/// Marks every weed, those that matter most on top; returns how the episode stands.
fn draw_weeds(canvas: &mut Pixmap, plot: &Plot, marks: &Marks, env: &Env) -> Status {
    let weeds = env.weeds();
    let state_of = |weed: usize| match (weeds.is_mowed()[weed], weeds.is_detected()[weed]) {
        (true, _) => State::Mowed,
        (false, true) => State::Detected,
        (false, false) => State::Undetected,
    };
    let counts = [State::Mowed, State::Undetected, State::Detected].map(|state| {
        let mut count = 0;
        for (weed, &position) in weeds.positions().iter().enumerate() {
            if state_of(weed) == state {
                marks.draw(canvas, state, plot.at(position));
                count += 1;
            }
        }
        count
    });
    let ([mowed, undetected, detected], view) = (counts, env.view());
    let seen_fraction = view.ground.fraction();
    Status { path_m: view.path_m, mowed, detected, undetected, seen_fraction }
}

/// The ground without what was driven over it.
#[derive(Debug, Clone)]
struct Ground {
    pixmap: Pixmap,
    /// Which cells are painted as seen, row by row.
    is_shown: Vec<bool>,
    shown: usize,
}

impl Ground {
    /// Ground of which nothing is seen.
    fn new(plot: &Plot, site: &Site) -> Self {
        let mut pixmap = blank(plot);
        pixmap.fill(HEADLAND.into());
        let columns = span(plot.x(0.0), plot.x(site.length_m));
        let rows = span(plot.y(site.width_m), plot.y(0.0));
        paint_pixels(&mut pixmap, columns, rows, UNSEEN);
        Self { pixmap, is_shown: Vec::new(), shown: 0 }
    }

    /// Paints the cells seen since: each pixel belongs to the cell that its middle lies in.
    fn show(&mut self, plot: &Plot, ground: &SeenGround) {
        let grid = ground.grid();
        self.is_shown.resize(grid.cells(), false);
        let seen = grid.cells() - ground.unseen_count();
        if seen == self.shown {
            return;
        }
        self.shown = seen;
        let (side_x_m, side_y_m) = grid.cell_m();
        for row in 0..grid.rows() {
            let low_m = row as f64 * side_y_m;
            let rows = span(plot.y(low_m + side_y_m), plot.y(low_m));
            for column in 0..grid.columns() {
                let is_shown = &mut self.is_shown[row * grid.columns() + column];
                if *is_shown || !ground.is_seen(column, row) {
                    continue;
                }
                *is_shown = true;
                let left_m = column as f64 * side_x_m;
                let columns = span(plot.x(left_m), plot.x(left_m + side_x_m));
                paint_pixels(&mut self.pixmap, columns, rows.clone(), SEEN);
            }
        }
    }
}

fn add_strip(layer: &mut Layer, plot: &Plot, frames: impl IntoIterator<Item = Frame>, site: &Site) {
    layer.add(swath(plot, frames, site.deck_width_m).as_ref());
}

fn add_path(layer: &mut Layer, plot: &Plot, frames: impl IntoIterator<Item = Frame>) {
    let points = frames.into_iter().map(|frame| plot.at(frame.pose.position()));
    layer.add_line(line(points).as_ref(), 1.3 * plot.zoom);
}

fn draw_fence(pixmap: &mut Pixmap, plot: &Plot, site: &Site) {
    let corners = ((plot.x(0.0), plot.y(site.width_m)), (plot.x(site.length_m), plot.y(0.0)));
    stroke(pixmap, rectangle(corners.0, corners.1).as_ref(), 1.2 * plot.zoom, FENCE);
}

/// Pixels for a plot.
fn blank(plot: &Plot) -> Pixmap {
    Pixmap::new(plot.area.width, plot.area.height).expect("a plot is not empty")
}

/// The pixels whose middles lie between two places.
fn span(from: f32, to: f32) -> std::ops::Range<usize> {
    let edge = |at: f32| swath_core::math::floor_index(f64::from((at + 0.5).floor()));
    edge(from)..edge(to)
}

fn paint_pixels(
    pixmap: &mut Pixmap,
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
    Rgb(red, green, blue): Rgb,
) {
    let colour = PremultipliedColorU8::from_rgba(red, green, blue, 255);
    let colour = colour.expect("opaque colours are premultiplied");
    let (across, down) = (pixmap.width() as usize, pixmap.height() as usize);
    let columns = columns.start.min(across)..columns.end.min(across);
    for row in rows.start.min(down)..rows.end.min(down) {
        let first = row * across;
        pixmap.pixels_mut()[first + columns.start..first + columns.end].fill(colour);
    }
}
