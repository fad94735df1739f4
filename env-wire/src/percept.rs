//! What the mowers of a batch perceive, as tables: enough to put their views together again, and nothing more.

use swath_core::batch::BatchEnv;
use swath_core::env::Env;
use swath_core::episode::End;
use swath_core::geometry::{Point, Pose};
use swath_core::known::KnownWeed;
use swath_core::mirror::{Mirror, News, Told};

use crate::fault::Fault;
use crate::message::Percept;
use crate::numbers::{self, Number};

/// Bytes of a row's part of a percept, without its lists.
const ROW_BYTES: usize = 1 + 6 * 8 + 4 * 4;
/// Bytes of a weed: when it is detected, and when it is mowed.
const WEED_BYTES: usize = 4 + 2 * 8 + 4;
/// Bytes of a tile.
const TILE_BYTES: usize = 4 + 8;

/// Finds what is new in the views of a batch since they were told last.
#[derive(Debug)]
pub(crate) struct Teller {
    told: Vec<Told>,
    /// Rows whose next telling is of another episode, or the first.
    begin: Vec<bool>,
    news: News,
    /// Most weeds that an environment may have, so that no percept is longer than was promised.
    most_weeds: usize,
    tiles: usize,
}

/// A percept that owns its tables.
#[derive(Debug, Default)]
pub(crate) struct Tables {
    whole: Vec<u8>,
    mowers: Vec<u8>,
    counts: Vec<u8>,
    known: Vec<u8>,
    known_m: Vec<u8>,
    mowed: Vec<u8>,
    tiles: Vec<u8>,
    seen: Vec<u8>,
}

impl Tables {
    /// The message's part.
    pub(crate) fn borrowed(&self) -> Percept<'_> {
        Percept {
            whole: &self.whole,
            mowers: &self.mowers,
            counts: &self.counts,
            known: &self.known,
            known_m: &self.known_m,
            mowed: &self.mowed,
            tiles: &self.tiles,
            seen: &self.seen,
        }
    }

    fn push(&mut self, news: &News) {
        let Pose { x_m, y_m, heading_rad } = news.pose;
        let (cos, sin) = news.direction;
        self.whole.push(u8::from(news.is_whole));
        put(&mut self.mowers, [x_m, y_m, heading_rad, cos, sin, news.path_m]);
        let count = |length: usize| u32::try_from(length).expect("a message holds no more");
        let lists = [count(news.known.len()), count(news.mowed.len()), count(news.seen.len())];
        put(&mut self.counts, [news.weeds_detected]);
        put(&mut self.counts, lists);
        put(&mut self.known, news.known.iter().map(|weed| weed.number));
        put(
            &mut self.known_m,
            news.known.iter().flat_map(|weed| [weed.position.x, weed.position.y]),
        );
        put(&mut self.mowed, news.mowed.iter().copied());
        put(&mut self.tiles, news.seen.iter().map(|&(tile, _)| tile));
        put(&mut self.seen, news.seen.iter().map(|&(_, bits)| bits));
    }
}

fn put<T: Number>(bytes: &mut Vec<u8>, numbers: impl IntoIterator<Item = T>) {
    numbers.into_iter().for_each(|number| number.put(bytes));
}

impl Teller {
    /// Nothing is told yet of a batch whose scenario has so many weeds.
    pub(crate) fn new(batch: &BatchEnv, most_weeds: usize) -> Self {
        let grid = batch.rows()[0].view().ground.grid();
        let (tiles_x, tiles_y) = grid.tiles();
        let rows = batch.rows().len();
        let (told, begin) = (vec![Told::nothing(grid); rows], vec![true; rows]);
        Self { told, begin, news: News::default(), most_weeds, tiles: tiles_x * tiles_y }
    }

    /// Most bytes that a percept adds to a reply of so many rows.
    pub(crate) fn longest(&self, rows: usize) -> usize {
        let row = ROW_BYTES + WEED_BYTES * self.most_weeds + TILE_BYTES * self.tiles;
        row.saturating_mul(rows).saturating_add(8 * 8)
    }

    /// Whether an environment may have so many weeds.
    pub(crate) fn check_weeds(&self, row: usize, weeds: usize) -> Result<(), Fault> {
        let most = self.most_weeds;
        if weeds <= most {
            return Ok(());
        }
        let text =
            format!("environment {row} may have {most} weeds, as its scenario has, got {weeds}");
        Err(Fault::BadConfig { text })
    }

    /// What every row perceives: what is new, or all of it if another episode has begun, as `has_begun` says of episodes that
    /// ended meanwhile.
    pub(crate) fn tell(&mut self, rows: &[Env], has_begun: impl Fn(usize) -> bool) -> Tables {
        let mut tables = Tables::default();
        for (row, env) in rows.iter().enumerate() {
            let is_whole = self.begin[row] || has_begun(row);
            self.told[row].news(&env.view(), is_whole, &mut self.news);
            self.begin[row] = env.end() != Some(End::Running);
            tables.push(&self.news);
        }
        tables
    }
}

/// Takes in what the mowers of some rows perceive.
///
/// # Errors
///
/// [`Fault::Malformed`] if it is not a percept of as many rows, or does not follow from what they perceived before.
pub fn read_percept(percept: Option<&Percept>, mirrors: &mut [Mirror]) -> Result<(), Fault> {
    let malformed = Fault::Malformed { offset: 0 };
    let percept = percept.ok_or(malformed.clone())?;
    let whole: Vec<bool> = numbers::read(percept.whole)?;
    let mowers: Vec<f64> = numbers::read(percept.mowers)?;
    let counts: Vec<u32> = numbers::read(percept.counts)?;
    let (mowers, mowers_rest) = mowers.as_chunks::<6>();
    let (counts, counts_rest) = counts.as_chunks::<4>();
    let known_m: Vec<f64> = numbers::read(percept.known_m)?;
    let (known_m, known_rest) = known_m.as_chunks::<2>();
    let (known, tiles): (Vec<u32>, Vec<u32>) =
        (numbers::read(percept.known)?, numbers::read(percept.tiles)?);
    let (mowed, seen): (Vec<u32>, Vec<u64>) =
        (numbers::read(percept.mowed)?, numbers::read(percept.seen)?);
    let rows = mirrors.len();
    let has_rows = whole.len() == rows && mowers.len() == rows && counts.len() == rows;
    let has_rest = !(mowers_rest.is_empty() && counts_rest.is_empty() && known_rest.is_empty());
    if !has_rows || has_rest || known.len() != known_m.len() || tiles.len() != seen.len() {
        return Err(malformed);
    }
    let mut known = known.into_iter().zip(known_m);
    let mut mowed = mowed.into_iter();
    let mut seen = tiles.into_iter().zip(seen);
    for (row, mirror) in mirrors.iter_mut().enumerate() {
        let [x_m, y_m, heading_rad, cos, sin, path_m] = mowers[row];
        let [weeds_detected, of_known, of_mowed, of_seen] = counts[row];
        let weed =
            |(number, &[x, y]): (u32, &[f64; 2])| KnownWeed { number, position: Point::new(x, y) };
        let news = News {
            is_whole: whole[row],
            pose: Pose { x_m, y_m, heading_rad },
            direction: (cos, sin),
            path_m,
            weeds_detected,
            known: known.by_ref().take(of_known as usize).map(weed).collect(),
            mowed: mowed.by_ref().take(of_mowed as usize).collect(),
            seen: seen.by_ref().take(of_seen as usize).collect(),
        };
        let is_there = news.known.len() == of_known as usize
            && news.mowed.len() == of_mowed as usize
            && news.seen.len() == of_seen as usize;
        if !is_there || mirror.apply(&news).is_err() {
            return Err(malformed);
        }
    }
    let is_over = known.next().is_none() && mowed.next().is_none() && seen.next().is_none();
    if is_over { Ok(()) } else { Err(malformed) }
}
