//! What surrounds the plot: axes with their units, the legend, the line on top.

use tiny_skia::Pixmap;

use crate::colours::{
    FAINT_INK, INK, MOWED_STRIP, PAPER, PATH, Rgb, SEEN, SENSOR, SENSOR_BORDER, UNSEEN,
};
use crate::draw::{fill, line, polygon, rectangle, stroke};
use crate::layout::{Area, Plot, Size, Window, label_of, round_length, single};
use crate::marks::{Marks, State};
use crate::mower;
use crate::picture::Picture;
use crate::text::{Anchor, Letters};

const TITLE_EM: f32 = 13.0;
const TEXT_EM: f32 = 11.5;
const TOP: f32 = 24.0;
const LEFT: f32 = 38.0;
const RIGHT: f32 = 12.0;
const TICKS: f32 = 18.0;
const LEGEND_LINE: f32 = 17.0;
const BOTTOM: f32 = 5.0;
const SWATCH: f32 = 13.0;
const GAP: f32 = 12.0;
/// A legend that takes more of a picture than this is left out.
const LEGEND_SHARE: f32 = 0.2;

/// The entries of the legend, in order.
const LEGEND: [(Entry, &str); 10] = [
    (Entry::Weed(State::Undetected), "weed, undetected"),
    (Entry::Weed(State::Detected), "weed, detected"),
    (Entry::Weed(State::Mowed), "weed, mowed"),
    (Entry::Mower, "mower, deck"),
    (Entry::Sensor, "sensor"),
    (Entry::Path, "path"),
    (Entry::Start, "start"),
    (Entry::Ground(MOWED_STRIP), "mowed strip"),
    (Entry::Ground(SEEN), "seen"),
    (Entry::Ground(UNSEEN), "not seen"),
];

#[derive(Debug, Clone, Copy)]
enum Entry {
    Ground(Rgb),
    Path,
    Start,
    Mower,
    Sensor,
    Weed(State),
}

/// What the line on top says of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Status {
    pub(crate) path_m: f64,
    pub(crate) mowed: usize,
    pub(crate) detected: usize,
    pub(crate) undetected: usize,
    pub(crate) seen_fraction: f64,
}

impl Status {
    /// The same in more and in fewer words.
    fn texts(&self) -> [String; 3] {
        let Self { path_m, mowed, detected, undetected, seen_fraction } = *self;
        let all = mowed + detected + undetected;
        // What is not whole is not called whole. The decimals are the same however much room there is.
        let seen = (1e3 * seen_fraction + 1e-9).floor() / 10.0;
        let weeds = format!("weeds: {mowed} mowed, {detected} detected, {undetected} undetected");
        [
            format!("path {path_m:.1} m · {weeds} · {seen:.1} % seen"),
            format!("{path_m:.1} m · {mowed} of {all} mowed · {seen:.1} % seen"),
            format!("{path_m:.1} m · {mowed}/{all}"),
        ]
    }
}

/// The parts of a picture that stay as they are while the window does.
#[derive(Debug, Clone)]
pub(crate) struct Chrome {
    pub(crate) plot: Plot,
    pixmap: Pixmap,
    /// The same as bytes, and the line on top by itself.
    picture: Picture,
    line: Pixmap,
    text: Letters,
    title: Letters,
    status_left: f32,
    status_right: f32,
}

impl Chrome {
    /// Lays out a picture of a window.
    pub(crate) fn new(size: Size, window: Window, marks: &Marks, title: &str) -> Self {
        let zoom = size.zoom();
        let (text, title_letters) = (Letters::new(TEXT_EM * zoom), Letters::new(TITLE_EM * zoom));
        let (width, height) = (size.width() as f32, size.height() as f32);
        let lines = legend_lines(&text, width - (LEFT + RIGHT) * zoom, zoom);
        let mut legend_px = lines.len() as f32 * LEGEND_LINE * zoom;
        let has_legend = legend_px <= LEGEND_SHARE * height;
        if !has_legend {
            legend_px = 0.0;
        }
        let (top, left) = (TOP * zoom, LEFT * zoom);
        let below = (TICKS + BOTTOM) * zoom + legend_px;
        let area = Area {
            left: whole(left),
            top: whole(top),
            width: whole(width - left - RIGHT * zoom).max(1),
            height: whole(height - top - below).max(1),
        };
        let plot = Plot::within(area, window, zoom);
        let mut pixmap = Pixmap::new(size.width(), size.height()).expect("a picture is not empty");
        pixmap.fill(PAPER.into());
        let line = Pixmap::new(size.width(), area.top).expect("there is a line on top");
        let picture = Picture::of(&pixmap);
        let mut chrome = Self {
            plot,
            pixmap,
            picture,
            line,
            text,
            title: title_letters,
            status_left: left,
            status_right: 0.0,
        };
        chrome.axes();
        if has_legend {
            chrome.legend(&lines, marks, height - BOTTOM * zoom - legend_px);
        }
        chrome.scale_bar(width - RIGHT * zoom);
        chrome.title(title);
        chrome.picture = Picture::of(&chrome.pixmap);
        let top = chrome.line.data().len();
        chrome.line.data_mut().copy_from_slice(&chrome.pixmap.data()[..top]);
        chrome
    }

    /// Ticks along both axes, at round metres.
    fn axes(&mut self) {
        let Self { plot, pixmap, text, .. } = self;
        let (area, window, zoom) = (plot.area, plot.window, plot.zoom);
        let (left, top) = (area.left as f32, area.top as f32);
        let bottom = top + area.height as f32;
        let tick = 4.0 * zoom;
        let widest = [0, 1]
            .map(|end| text.width(&label_of([window.low_m, window.high_m][end][0].round())))
            .into_iter()
            .fold(0.0, f32::max);
        let x_axis = Ticks::new(plot, 0, widest + 14.0 * zoom, 0.0);
        let is_tight = x_axis.pitch_px(plot) < widest + 3.0 * zoom;
        for (x_m, end) in x_axis.ends() {
            let x = left + plot.x(x_m);
            stroke(pixmap, line([(x, bottom), (x, bottom + tick)]).as_ref(), zoom, FAINT_INK);
            let label = label_of(x_m);
            // Where labels would touch, those of the ends stand outside their ticks.
            let (anchor, half) = match end {
                _ if !is_tight => (Anchor::Middle, 0.5 * text.width(&label)),
                Some(End::First) => (Anchor::Right, 0.0),
                Some(End::Last) => (Anchor::Left, 0.0),
                None => continue,
            };
            // Labels stay within the picture, and left of that of the other axis's there is nothing to hit.
            let x = x.clamp(half, pixmap.width() as f32 - half);
            text.draw(pixmap, &label, (x, bottom + 15.0 * zoom), anchor, INK);
        }
        let y_axis = Ticks::new(plot, 1, 22.0 * zoom, 1.0_f64.min(x_axis.every_m));
        let is_tight = y_axis.pitch_px(plot) < 12.0 * zoom;
        for (y_m, end) in y_axis.ends() {
            let y = top + plot.y(y_m);
            stroke(pixmap, line([(left - tick, y), (left, y)]).as_ref(), zoom, FAINT_INK);
            let aside = match end {
                _ if !is_tight => 0.0,
                Some(End::First) => 4.0 * zoom,
                Some(End::Last) => -4.0 * zoom,
                None => continue,
            };
            let at = (left - 6.0 * zoom, y + aside + 4.0 * zoom);
            text.draw(pixmap, &label_of(y_m), at, Anchor::Right, INK);
        }
    }

    /// Names every colour and every mark.
    fn legend(&mut self, lines: &[Vec<(f32, usize)>], marks: &Marks, top: f32) {
        let zoom = self.plot.zoom;
        let side = SWATCH * zoom;
        for (row, entries) in lines.iter().enumerate() {
            let middle = top + (row as f32 + 0.5) * LEGEND_LINE * zoom;
            for &(offset, number) in entries {
                let left = self.status_left + offset;
                let (entry, label) = LEGEND[number];
                swatch(&mut self.pixmap, entry, marks, (left, middle), side, zoom);
                let at = (left + side + 5.0 * zoom, middle + 4.0 * zoom);
                self.text.draw(&mut self.pixmap, label, at, Anchor::Left, INK);
            }
        }
    }

    /// A bar of a round length, with that length beside it.
    fn scale_bar(&mut self, right: f32) {
        let Self { plot, pixmap, text, .. } = self;
        let zoom = plot.zoom;
        let length_m = round_length(f64::from(40.0 * zoom) / plot.px_per_m);
        let (label, length) = (label_of(length_m), single(length_m * plot.px_per_m));
        let (y, end) = (14.0 * zoom, 3.0 * zoom);
        text.draw(pixmap, &label, (right, y + 2.0 * zoom), Anchor::Right, INK);
        let stop = right - text.width(&label) - 5.0 * zoom;
        let start = stop - length;
        for bar in [
            [(start, y - 2.0 * zoom), (stop, y - 2.0 * zoom)],
            [(start, y - 2.0 * zoom - end), (start, y - 2.0 * zoom + end)],
            [(stop, y - 2.0 * zoom - end), (stop, y - 2.0 * zoom + end)],
        ] {
            stroke(pixmap, line(bar).as_ref(), 1.5 * zoom, INK);
        }
        self.status_right = start - GAP * zoom;
    }

    /// The name of what is shown, if it has one.
    fn title(&mut self, title: &str) {
        let zoom = self.plot.zoom;
        let left = self.status_left;
        let room = 0.45 * (self.status_right - left);
        let shown = self.title.cut(title, room);
        if !shown.is_empty() {
            self.title.draw(&mut self.pixmap, &shown, (left, 16.0 * zoom), Anchor::Left, PATH);
            self.status_left = left + self.title.width(&shown) + GAP * zoom;
        }
    }

    /// The finished picture: a plot and how the episode stands, in as many words as there is room for.
    pub(crate) fn finish(&self, plot: &Pixmap, status: &Status) -> Picture {
        let mut picture = self.picture.clone();
        picture.put(plot, self.plot.area.left, self.plot.area.top);
        let room = self.status_right - self.status_left;
        let texts = status.texts();
        if let Some(text) = texts.iter().find(|text| self.text.width(text) <= room) {
            let mut line = self.line.clone();
            let at = (self.status_left, 16.0 * self.plot.zoom);
            self.text.draw(&mut line, text, at, Anchor::Left, INK);
            picture.put(&line, 0, 0);
        }
        picture
    }
}

/// Which entries stand in which line, and how far from its beginning.
fn legend_lines(text: &Letters, width: f32, zoom: f32) -> Vec<Vec<(f32, usize)>> {
    let mut lines = vec![Vec::new()];
    let mut at = 0.0;
    for (number, (_, label)) in LEGEND.iter().enumerate() {
        let needed = (SWATCH + 5.0) * zoom + text.width(label);
        if at > 0.0 && at + needed > width {
            lines.push(Vec::new());
            at = 0.0;
        }
        lines.last_mut().expect("there is a line").push((at, number));
        at += needed + GAP * zoom;
    }
    lines
}

/// The colour or the mark of an entry.
fn swatch(
    pixmap: &mut Pixmap,
    entry: Entry,
    marks: &Marks,
    (left, middle): (f32, f32),
    side: f32,
    zoom: f32,
) {
    let (right, centre, half) = (left + side, left + 0.5 * side, 0.5 * side);
    let square = rectangle((left, middle - 0.7 * half), (right, middle + 0.7 * half));
    match entry {
        Entry::Ground(colour) => {
            fill(pixmap, square.as_ref(), colour);
            stroke(pixmap, square.as_ref(), 0.75 * zoom, FAINT_INK);
        }
        Entry::Path => {
            stroke(pixmap, line([(left, middle), (right, middle)]).as_ref(), 1.6 * zoom, PATH);
        }
        Entry::Start => mower::start(pixmap, (centre, middle), zoom),
        Entry::Mower => mower::icon(pixmap, (centre, middle), zoom),
        Entry::Sensor => {
            let triangle = polygon([
                (left, middle),
                (right, middle - 0.8 * half),
                (right, middle + 0.8 * half),
            ]);
            fill(pixmap, triangle.as_ref(), SENSOR.with_alpha(150));
            stroke(pixmap, triangle.as_ref(), zoom, SENSOR_BORDER);
        }
        Entry::Weed(state) => marks.draw(pixmap, state, (centre, middle)),
    }
}

/// Where the ticks of an axis are.
#[derive(Debug, Clone)]
struct Ticks {
    every_m: f64,
    at_m: Vec<f64>,
}

/// Which end of an axis a tick is nearest to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    First,
    Last,
}

impl Ticks {
    /// At round metres, `room_px` and `least_m` apart at least, but two in any case.
    fn new(plot: &Plot, axis: usize, room_px: f32, least_m: f64) -> Self {
        let (low_m, high_m) = (plot.window.low_m[axis], plot.window.high_m[axis]);
        let mut every_m = round_length(f64::from(room_px) / plot.px_per_m).max(least_m);
        loop {
            let at_m: Vec<f64> = multiples(every_m, low_m, high_m).collect();
            if at_m.len() >= 2 {
                return Self { every_m, at_m };
            }
            // The next one of 1, 2, 5, 10 ... below.
            every_m = round_length(0.4 * every_m);
        }
    }

    fn pitch_px(&self, plot: &Plot) -> f32 {
        plot.px(self.every_m)
    }

    /// Every tick, and whether it is the first or the last.
    fn ends(&self) -> impl Iterator<Item = (f64, Option<End>)> {
        let last = self.at_m.len() - 1;
        self.at_m.iter().enumerate().map(move |(number, &at_m)| {
            let end = match number {
                0 => Some(End::First),
                _ if number == last => Some(End::Last),
                _ => None,
            };
            (at_m, end)
        })
    }
}

/// The multiples of a length between two others.
fn multiples(every_m: f64, low_m: f64, high_m: f64) -> impl Iterator<Item = f64> {
    let first = (low_m / every_m).ceil();
    (0..).map(move |i| (first + f64::from(i)) * every_m).take_while(move |&at_m| at_m <= high_m)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the picture")]
fn whole(value: f32) -> u32 {
    value.round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_of_any_pasture_has_two_ticks_at_least() {
        for (length_m, width_m) in [(100.0, 40.0), (12.0, 60.0), (3.0, 400.0), (400.0, 3.0)] {
            let window = Window { low_m: [-7.0; 2], high_m: [length_m + 7.0, width_m + 7.0] };
            for (width, height) in [(640, 360), (1280, 720), (160, 90)] {
                let area = Area { left: 30, top: 20, width, height };
                let plot = Plot::within(area, window, 1.0);
                for (axis, room_px) in [(0, 40.0), (1, 22.0)] {
                    let ticks = Ticks::new(&plot, axis, room_px, 0.0);
                    assert!(ticks.at_m.len() >= 2);
                    assert!(ticks.at_m[0] >= window.low_m[axis]);
                    assert!(*ticks.at_m.last().unwrap() <= window.high_m[axis]);
                }
            }
        }
    }

    #[test]
    fn a_length_has_one_decimal_whatever_room_there_is_and_what_is_not_whole_is_not_100() {
        let status = Status {
            path_m: 291.64,
            mowed: 39,
            detected: 0,
            undetected: 1,
            seen_fraction: 0.99996,
        };
        for text in status.texts() {
            assert!(text.contains("291.6 m"), "{text}");
            assert!(!text.contains("100"), "{text}");
        }
        assert!(status.texts()[0].contains("99.9 % seen"));
    }
}
