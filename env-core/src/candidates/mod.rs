//! Places to go to: what the action kind `target` chooses from.
//!
//! [`Candidates`] are made from a [`View`] and nothing else: the nearest known weeds, views of unseen ground, and the next
//! piece of a search sweep. Each comes with a [`Way`] that the mower can drive.

mod approach;
mod tiles;
mod way;

pub use way::Way;

use approach::{Approach, Headings};
use tiles::{Column, Tiles};

use crate::config::ActionConfig;
use crate::geometry::{Frame, Point, Pose, Sight, Triangle, shortest};
use crate::grid::Grid;
use crate::known::KnownWeed;
use crate::motion::LOOK_SPACING_M;
use crate::site::Site;
use crate::view::View;

/// What the search pays for unseen ground that it leaves behind, in metres of way: for each cell, for each tile that is
/// passed over, and for each pass that is joined too late to see all of its tile. Coming back costs more than going there.
const SKIPPED_CELL_M: f64 = 0.2;
const SKIPPED_TILE_M: f64 = 6.0;
const JOINED_LATE_M: f64 = 3.0;
/// From how many missed cells on a pass counts as joined too late.
const MISSED_CELLS: f64 = 0.5;
/// A tile of which at least this share is unseen is swept along the middle of its band; others are looked at from anywhere.
const SWEPT_SHARE: f64 = 0.5;
/// At how many places a pass of the sweep may be joined, and how far they are apart, in ways to the far corner of a view.
const JOINTS: usize = 9;
const JOINT_SPACING: f64 = 0.25;
/// How many more tiles than views are looked into, so that the cheapest ones are among them.
const SPARE_TILES: usize = 3;

/// What a candidate is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// To mow the known weed of this number.
    Weed(u32),
    /// To look at unseen ground.
    View,
    /// To go on with the search.
    Search,
}

/// A place to go to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// What for.
    pub purpose: Purpose,
    /// How to get there.
    pub way: Way,
    /// Share of what the sensor will show at the end of the way that is not seen yet, 0 to 1.
    pub unseen_share: f64,
}

/// The candidates of one moment, at fixed places: first the nearest known weeds, nearest first; then the views of unseen
/// ground, cheapest first; last the search, which is always there.
#[derive(Debug, Clone)]
pub struct Candidates {
    weeds: usize,
    rows: Vec<Option<Candidate>>,
    headings: Headings,
    tiles: Tiles,
    is_current: bool,
    /// Whether the search still looks for unseen ground.
    is_searching: bool,
    nearest: Vec<(f64, KnownWeed)>,
    columns: Vec<Column>,
    near_tiles: Vec<(f64, usize)>,
    views: Vec<(f64, Way)>,
}

impl Candidates {
    /// Room for the candidates of a site, none of them worked out yet.
    #[must_use]
    pub fn new(config: &ActionConfig, site: &Site, grid: Grid) -> Self {
        let nobody = (0.0, KnownWeed { number: 0, position: Point::origin() });
        Self {
            weeds: config.weeds,
            rows: vec![None; config.candidates()],
            headings: Headings::new(),
            tiles: Tiles::new(grid, site),
            is_current: false,
            is_searching: false,
            nearest: vec![nobody; config.weeds],
            columns: Vec::new(),
            near_tiles: Vec::new(),
            views: Vec::new(),
        }
    }

    /// Forgets everything: the next view may be one of another episode. Makes room for all that it may bring.
    pub fn reset(&mut self) {
        self.tiles.reset();
        self.is_current = false;
        self.columns.clear();
        self.columns.reserve(self.tiles.grid().columns());
        let views = self.rows.len() - 1 - self.weeds;
        self.near_tiles.clear();
        self.near_tiles.reserve(views + SPARE_TILES + 1);
        self.views.clear();
        self.views.reserve(views + SPARE_TILES + 1);
    }

    /// Says that the view has changed within the episode.
    pub fn expire(&mut self) {
        self.is_current = false;
    }

    /// Works the candidates out, unless that was done since [`Candidates::expire`].
    pub fn refresh(&mut self, view: &View) {
        if std::mem::replace(&mut self.is_current, true) {
            return;
        }
        let headings = self.headings.clone();
        let approach = Approach::new(view.pose, view.site, &headings);
        self.rows.fill(None);
        self.find_weeds(view, &approach);
        self.find_views(view, &approach);
        let last = self.rows.len() - 1;
        self.rows[last] = Some(self.search(view, &approach));
    }

    /// The candidates by place; `None` where there is none.
    #[must_use]
    pub fn rows(&self) -> &[Option<Candidate>] {
        &self.rows
    }

    /// The candidate at a place and whether it is the one that was asked for: where there is none, it is the search.
    ///
    /// # Panics
    ///
    /// Before the first [`Candidates::refresh`].
    #[must_use]
    pub fn chosen(&self, place: usize) -> (Candidate, bool) {
        let search = self.rows.last().copied().flatten().expect("the candidates are worked out");
        match self.rows.get(place) {
            Some(Some(candidate)) => (*candidate, true),
            _ => (search, false),
        }
    }

    /// How much longer the way of the search gets by going to a candidate first, metres; its beginning is cut off where the
    /// candidate's way ends. Once all ground is seen the search goes to the nearest weed: then, how much longer the
    /// candidate's own way is.
    ///
    /// # Panics
    ///
    /// Before the first [`Candidates::refresh`].
    #[must_use]
    pub fn detour_m(&self, candidate: &Candidate, site: &Site) -> f64 {
        let search = self.rows.last().copied().flatten().expect("the candidates are worked out");
        let there_m = candidate.way.length_m() - search.way.length_m();
        if candidate.purpose == Purpose::Search || !self.is_searching {
            return there_m;
        }
        let (from, to) = (candidate.way.end().pose, search.way.end().pose);
        let onward = shortest(from, to, site.turning_radius_m);
        there_m + onward.expect("a checked scenario has a turning radius").length_m()
    }

    fn find_weeds(&mut self, view: &View, approach: &Approach) {
        let found = view.known_weeds.nearest(view.pose.position(), &mut self.nearest);
        for (row, (_, weed)) in self.rows.iter_mut().zip(&self.nearest[..found]) {
            *row = approach
                .weed(weed.position)
                .map(|way| candidate(Purpose::Weed(weed.number), way, view));
        }
    }

    fn find_views(&mut self, view: &View, approach: &Approach) {
        let wanted = self.rows.len() - 1 - self.weeds;
        if wanted == 0 || view.ground.unseen_count() == 0 {
            return;
        }
        let Self { tiles, near_tiles, views, .. } = self;
        let from = view.pose.position();
        let most = wanted + SPARE_TILES;
        // Tiles that turn out to be seen altogether make room for others.
        loop {
            near_tiles.clear();
            for tile in (0..tiles.len()).filter(|&tile| !tiles.is_done(tile)) {
                insert(near_tiles, (tiles.distance_m2(tile, from), tile), most);
            }
            let mut is_settled = true;
            views.clear();
            for &(_, tile) in near_tiles.iter() {
                let Some(unseen) = tiles.look_into(tile, view.ground) else {
                    is_settled = false;
                    continue;
                };
                let cell = tiles.nearest_unseen(tile, view.ground, unseen.middle);
                let is_full = views.len() == wanted;
                let limit_m = views.last().filter(|_| is_full).map_or(f64::INFINITY, |last| last.0);
                if let Some(way) = cell.and_then(|cell| approach.view(cell, limit_m)) {
                    insert(views, (way.length_m(), way), wanted);
                }
            }
            if is_settled {
                break;
            }
        }
        for (row, (_, way)) in self.rows[self.weeds..].iter_mut().zip(&self.views) {
            *row = Some(candidate(Purpose::View, *way, view));
        }
    }

    /// The way on with the search.
    ///
    /// While ground is unseen: the cheapest of the next passes of a boustrophedon sweep, as high as the sensor sees, where
    /// unseen cells left behind cost something too; ground that lies about in small pieces is looked at from anywhere.
    /// When all is seen: the cheapest weed in reach. Where there is no way within the fence, turning on the spot.
    fn search(&mut self, view: &View, approach: &Approach) -> Candidate {
        let sweep = if view.ground.unseen_count() > 0 { self.sweep(view, approach) } else { None };
        self.is_searching = sweep.is_some();
        if let Some(way) = sweep {
            return candidate(Purpose::Search, way, view);
        }
        let weeds = self.rows[..self.weeds].iter().flatten();
        let length_m = |candidate: &&Candidate| candidate.way.length_m();
        match weeds.min_by(|a, b| length_m(a).total_cmp(&length_m(b))) {
            Some(weed) => Candidate { purpose: Purpose::Search, ..*weed },
            None => candidate(Purpose::Search, approach.pastime(), view),
        }
    }

    fn sweep(&mut self, view: &View, approach: &Approach) -> Option<Way> {
        let (site, from) = (view.site, view.pose.position());
        let mut best: Option<(f64, Way)> = None;
        let mut skipped_m = 0.0;
        for tile in 0..self.tiles.len() {
            let limit_m = best.as_ref().map_or(f64::INFINITY, |best| best.0);
            if skipped_m >= limit_m {
                break;
            }
            let Some(unseen) = self.tiles.look_into(tile, view.ground) else { continue };
            let is_swept = unseen.count as f64 >= SWEPT_SHARE * unseen.cells as f64;
            let reached_m = self.tiles.distance_m2(tile, from).sqrt() - site.sensor_range_m;
            if reached_m + skipped_m < limit_m {
                let pass = if is_swept {
                    self.tiles.write_columns(tile, view.ground, &mut self.columns);
                    self.pass(tile, limit_m - skipped_m, view, approach)
                } else {
                    None
                };
                let offer = pass.or_else(|| {
                    let cell = self.tiles.nearest_unseen(tile, view.ground, unseen.middle)?;
                    let way = approach.view(cell, limit_m - skipped_m)?;
                    Some((way.length_m(), way))
                });
                if let Some((cost_m, way)) = offer
                    && cost_m + skipped_m < limit_m
                {
                    best = Some((cost_m + skipped_m, way));
                }
            }
            skipped_m += SKIPPED_TILE_M + SKIPPED_CELL_M * unseen.count as f64;
        }
        best.map(|(_, way)| way)
    }

    /// The cheapest pass through a tile along the middle of its band, with its cost; `self.columns` are those of the tile.
    fn pass(
        &self,
        tile: usize,
        mut limit_m: f64,
        view: &View,
        approach: &Approach,
    ) -> Option<(f64, Way)> {
        let site = view.site;
        let (first, last) = (self.columns.first()?, self.columns.last()?);
        // A cell so far from the line is seen from this far before it.
        let before_m = |across_m: f64| {
            across_m * 2.0 * site.sensor_range_m / site.sensor_width_m + LOOK_SPACING_M
        };
        let corner_m = before_m(self.tiles.reach_m(tile)).min(site.sensor_range_m);
        let is_rightward = self.tiles.is_rightward(tile);
        let y_m = self.tiles.middle_y_m(tile);
        let mut best = None;
        for joint in 0..JOINTS {
            let join_m = first.along_m - corner_m * (1.0 - JOINT_SPACING * joint as f64);
            let join_m = join_m.max(0.0);
            let shows = |column: &Column| {
                let ahead_m = column.along_m - join_m;
                ahead_m <= site.sensor_range_m && ahead_m >= before_m(column.nearest_m)
            };
            if !self.columns.iter().any(shows) {
                continue;
            }
            let missed: f64 = self
                .columns
                .iter()
                .map(|column| {
                    let shown = ((column.along_m - join_m) / corner_m).clamp(0.0, 1.0);
                    column.unseen as f64 * (1.0 - shown)
                })
                .sum();
            let late_m = if missed > MISSED_CELLS { JOINED_LATE_M } else { 0.0 };
            let missed_m = late_m + SKIPPED_CELL_M * missed;
            let straight_m = (last.along_m - corner_m - join_m).max(LOOK_SPACING_M);
            let goal = if is_rightward {
                Pose::new(join_m, y_m, 0.0)
            } else {
                Pose::new(site.length_m - join_m, y_m, std::f64::consts::PI)
            };
            if let Some((way, length_m)) = approach.pass(goal, straight_m, limit_m - missed_m) {
                limit_m = length_m + missed_m;
                best = Some((limit_m, way));
            }
        }
        best
    }
}

/// A candidate, with what it will show.
fn candidate(purpose: Purpose, way: Way, view: &View) -> Candidate {
    Candidate { purpose, way, unseen_share: unseen_share(way.end(), view) }
}

/// Share of the detection triangle at a pose that is unseen ground, 0 to 1.
fn unseen_share(from: Frame, view: &View) -> f64 {
    let (site, ground) = (view.site, view.ground);
    if ground.unseen_count() == 0 {
        return 0.0;
    }
    let triangle = Triangle::new(site.sensor_range_m, site.sensor_width_m);
    let grid = ground.grid();
    let (side_x_m, side_y_m) = grid.cell_m();
    let mut unseen = 0_u32;
    ground.unseen().for_each_held(grid, &Sight::from(&triangle, &from), |cell| {
        unseen += u32::from(triangle.contains(&from, grid.centre(cell.column, cell.row)));
    });
    let triangle_m2 = 0.5 * site.sensor_range_m * site.sensor_width_m;
    (f64::from(unseen) * side_x_m * side_y_m / triangle_m2).min(1.0)
}

/// Puts an entry into a list that is sorted by its number and holds at most `most`; ties stay in the order of arrival.
fn insert<T>(list: &mut Vec<(f64, T)>, entry: (f64, T), most: usize) {
    let place = list.partition_point(|other| other.0 <= entry.0);
    if place < most {
        list.insert(place, entry);
        list.truncate(most);
    }
}
