//! The batch behind a session: requests in, replies out.

mod columns;
mod holdings;

use std::path::Path;
use std::sync::Arc;

use sha2::{Digest, Sha256};
use swath_core::action::{ActionError, ActionSpec};
use swath_core::batch::{Actions, Autoreset, BatchEnv, BatchError, BatchOptions, Last};
use swath_core::config::{Document, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::geometry::Point;
use swath_core::observation::Observation;

use crate::codec;
use crate::fault::Fault;
use crate::header::{Header, Kind, Verb};
use crate::layout::{Layout, OUTCOMES};
use crate::message::Limits;
use crate::message::{
    AutoresetMode, Open, OpenReply, Reset, ResetReply, Restore, Seeds, Snapshot, SnapshotReply,
    Step, StepReply,
};
use crate::numbers::{self, bytes_in, bytes_of};
use crate::percept::{Tables, Teller};
use crate::room::{Bounds, Place, Room, Size};
use columns::Columns;
use holdings::{
    bad_snapshot, check_size, check_weeds, most_of, most_weeds, weeds_of, weeds_of_rows,
};

/// The longest scenario that is read, bytes: to read it takes far more memory than its text.
const LARGEST_CONFIG: usize = 2 << 20;

/// The scenarios that can be opened.
pub const ENV_ID: &str = "swath/MowerRouting-v0";

/// A batch of environments that is stepped by messages.
#[derive(Debug)]
pub struct Hosted {
    batch: BatchEnv,
    scenario: ValidScenario,
    autoreset: Autoreset,
    layout: Layout,
    columns: Columns,
    infos: bool,
    /// Where percepts were asked for.
    teller: Option<Teller>,
    hash_every: u32,
    requests: u32,
    steps: u64,
    max_msg: u32,
    place: Place,
    /// Of each environment, the most weeds that it has had or will draw: it keeps the memory for them.
    weeds: Vec<u64>,
}

impl Hosted {
    /// The batch that a client asks for, in a room of its own with the usual bounds; see [`Self::open_in`].
    ///
    /// # Errors
    ///
    /// Those of [`Self::open_in`].
    pub fn open(open: &Open, limits: &Limits, threads: usize) -> Result<Self, Fault> {
        let room = Room::new(Bounds::OF_SESSION, Bounds::OF_ALL);
        Self::open_in(open, limits, &room, threads)
    }

    /// The batch that a client asks for, stepped by `threads` threads at most.
    ///
    /// Nothing is built before its size is known.
    /// A scenario that names a file of weeds is refused: a server reads no files for its clients.
    ///
    /// # Errors
    ///
    /// [`Fault::BadConfig`] if the scenario or the snapshot cannot be used or the environments are too many or too large,
    /// [`Fault::TooLarge`] if a reply would not fit into a message, [`Fault::Capacity`] if the room is taken by others.
    pub fn open_in(
        open: &Open,
        limits: &Limits,
        room: &Arc<Room>,
        threads: usize,
    ) -> Result<Self, Fault> {
        let bad = |text: String| Fault::BadConfig { text };
        if open.env_id != ENV_ID {
            return Err(bad(format!("`env_id` must be {ENV_ID}, got {}", open.env_id)));
        }
        let rows = open.num_envs as usize;
        if rows == 0 {
            return Err(bad("`num_envs` must be at least 1, got 0".to_owned()));
        }
        if open.num_envs > limits.max_envs {
            let (most, got) = (limits.max_envs, open.num_envs);
            return Err(bad(format!(
                "`num_envs` must be at most {most} on this server, got {got}"
            )));
        }
        if open.config.len() > LARGEST_CONFIG {
            let got = open.config.len();
            return Err(bad(format!(
                "`config` must have at most {LARGEST_CONFIG} bytes, got {got}: more weeds can be given with a reset"
            )));
        }
        let document = Document::parse("remote", &open.config, Path::new(""))
            .map_err(|error| bad(error.to_string()))?;
        let file = document.written().get("weeds").and_then(|weeds| weeds.get("file"));
        if let Some(file) = file {
            return Err(bad(format!(
                "`weeds.file` must be sent as `weeds.positions_m`, got {file}"
            )));
        }
        let scenario = document.scenario().map_err(|error| bad(error.to_string()))?;
        let autoreset = match open.autoreset {
            AutoresetMode::NextStep => Autoreset::NextStep,
            AutoresetMode::SameStep => Autoreset::SameStep,
            AutoresetMode::Disabled => Autoreset::Disabled,
        };
        let cells = check_size(&scenario, rows as u64, open.percept, room.session())?;
        let mut weeds = vec![most_weeds(&scenario) as u64; rows];
        if let Some(snapshot) = open.snapshot {
            let most = open.percept.then(|| most_weeds(&scenario) as u64);
            weeds = most_of(&weeds, weeds_of_rows(snapshot, rows, most)?);
        }
        let mut place = room.place();
        let all_weeds = check_weeds("snapshot", &weeds, room.session())?;
        place.resize(Size { cells, weeds: all_weeds })?;
        let batch_of = |rows| {
            BatchEnv::new(&scenario, BatchOptions { rows, autoreset, threads })
                .map_err(|error| bad(error.to_string()))
        };
        let one = batch_of(1)?;
        let layout = Layout::of(&one, open.infos);
        let teller_of =
            |batch: &BatchEnv| open.percept.then(|| Teller::new(batch, most_weeds(&scenario)));
        let longest = longest_reply(&layout, rows, teller_of(&one).as_ref()) as u64;
        if longest > limits.max_msg.into() {
            return Err(Fault::TooLarge { size: longest, limit: limits.max_msg.into() });
        }
        let mut batch = batch_of(rows)?;
        let mut teller = teller_of(&batch);
        if let Some(snapshot) = open.snapshot {
            batch.restore(snapshot).map_err(|error| bad(error.to_string()))?;
            // What a client knows who held the snapshot: a session that is resumed tells what the lost one would have told.
            if let Some(teller) = &mut teller {
                teller.tell(batch.rows(), |_| true);
            }
        }
        let columns = Columns::new(&batch);
        let (hash_every, max_msg) = (open.hash_every, limits.max_msg);
        Ok(Self {
            batch,
            scenario,
            autoreset,
            layout,
            columns,
            infos: open.infos,
            teller,
            hash_every,
            requests: 0,
            steps: 0,
            max_msg,
            place,
            weeds,
        })
    }

    /// What the client is told of its session.
    #[must_use]
    pub fn open_reply(&self, sid: u128, lid: u128, limits: Limits) -> OpenReply {
        let Layout { observation, action, info, ended } = self.layout.clone();
        let longest = longest_reply(&self.layout, self.batch.rows().len(), self.teller.as_ref());
        OpenReply {
            sid,
            lid,
            observation,
            action,
            info,
            ended,
            outcomes: OUTCOMES.iter().map(|outcome| outcome.name().to_owned()).collect(),
            config_hash: self.scenario.hash(),
            max_reply: u32::try_from(longest).expect("it is below the largest message"),
            limits,
        }
    }

    /// Environment steps so far, of all environments together.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Carries out one request; returns the whole reply.
    ///
    /// # Errors
    ///
    /// A [`Fault`]; every environment is then as it was.
    pub fn answer(&mut self, header: &Header, payload: &[u8]) -> Result<Vec<u8>, Fault> {
        let Kind::Request(verb) = header.kind else { return Err(Fault::Malformed { offset: 48 }) };
        let reply = Header { kind: Kind::Reply(verb), ..*header };
        match verb {
            Verb::Step => self.step(&reply, &codec::read(payload)?),
            Verb::Reset => self.reset(&reply, &codec::read(payload)?),
            Verb::Restore => self.restore(&reply, &codec::read(payload)?),
            Verb::Snapshot => self.snapshot(&reply, codec::read(payload)?),
            _ => Err(Fault::Malformed { offset: 48 }),
        }
    }

    fn step(&mut self, reply: &Header, step: &Step) -> Result<Vec<u8>, Fault> {
        let &[table] = &step.actions[..] else { return Err(Fault::Malformed { offset: 53 }) };
        let spec = self.batch.decoder().spec();
        let (numbers, choices): (Vec<f32>, Vec<i64>) = match spec {
            ActionSpec::Continuous(_) => (numbers::read(table)?, Vec::new()),
            ActionSpec::Discrete(_) => (Vec::new(), numbers::read(table)?),
        };
        let actions = match spec {
            ActionSpec::Continuous(_) => Actions::Continuous(&numbers),
            ActionSpec::Discrete(_) => Actions::Discrete(&choices),
        };
        let ended = self.batch.step(actions, self.columns.out()).map_err(fault_of)?;
        self.steps += self.batch.rows().len() as u64;
        let state_hash = self.state_hash();
        let percept = self.percept_of_step();
        let columns = &self.columns;
        let mut done = Vec::new();
        if ended > 0 {
            let has_ended = |&row: &usize| columns.terminated[row] || columns.truncated[row];
            done.extend((0..columns.reward.len()).filter(has_ended));
        }
        let last: Vec<&Last> =
            done.iter().map(|&row| self.batch.last(row).expect("it has just ended")).collect();
        let (observation, info) = (columns.observation(&self.layout), columns.info(self.infos));
        let final_observation = self.final_observation(&done);
        let ended = self.ended(&done, &last);
        let index = bytes_of(done.iter().map(|&row| u32::try_from(row).expect("rows are few")));
        codec::write(
            reply,
            &StepReply {
                observation: borrowed(&observation),
                reward: &bytes_in(&columns.reward),
                terminated: &bytes_in(&columns.terminated),
                truncated: &bytes_in(&columns.truncated),
                info: borrowed(&info),
                done_index: &index,
                final_observation: borrowed(&final_observation),
                ended: borrowed(&ended),
                state_hash,
                percept: percept.as_ref().map(Tables::borrowed),
            },
        )
    }

    fn reset(&mut self, reply: &Header, reset: &Reset) -> Result<Vec<u8>, Fault> {
        let rows = self.batch.rows().len();
        let bad = |text: String| Fault::BadConfig { text };
        let mask: Vec<bool> =
            if reset.mask.is_empty() { vec![true; rows] } else { numbers::read(reset.mask)? };
        let seeds = seeds(&reset.seeds, rows)?;
        if mask.len() != rows || seeds.len() != rows {
            return Err(Fault::Malformed { offset: 53 });
        }
        let unstarted = (0..rows)
            .find(|&row| !self.batch.has_begun(row) && (!mask[row] || seeds[row].is_none()));
        if let Some(row) = unstarted {
            let text = format!("environment {row} needs a seed for its first reset");
            return Err(Fault::NotReset { env: row as u64, text });
        }
        if ![0, 1, rows].contains(&reset.weeds.len()) {
            return Err(Fault::Malformed { offset: 53 });
        }
        let site = *self.batch.rows()[0].site();
        let mut weeds: Vec<Option<Vec<Point>>> = Vec::with_capacity(reset.weeds.len());
        for (row, table) in reset.weeds.iter().enumerate() {
            let Some(table) = table else {
                weeds.push(None);
                continue;
            };
            let numbers: Vec<f64> = numbers::read(table)?;
            let (points, rest) = numbers.as_chunks::<2>();
            if !rest.is_empty() {
                return Err(Fault::Malformed { offset: 53 });
            }
            if let Some([x, y]) = points.iter().find(|[x, y]| !site.holds(*x, *y)) {
                return Err(bad(format!(
                    "`weeds[{row}]` must stand on the pasture, got [{x}, {y}]"
                )));
            }
            if let Some(most) = self.most_weeds()
                && points.len() as u64 > most
            {
                let got = points.len();
                return Err(bad(format!(
                    "`weeds[{row}]` must be at most {most} with `percept`, got {got}"
                )));
            }
            weeds.push(Some(points.iter().map(|&[x, y]| Point::new(x, y)).collect()));
        }
        let given = |row: usize| weeds.get(row).or(weeds.first()).and_then(Option::as_deref);
        let begun = || (0..rows).filter(|&row| mask[row]);
        let of_row = |row: usize| if mask[row] { given(row).map_or(0, <[_]>::len) } else { 0 };
        let all_weeds = most_of(&self.weeds, (0..rows).map(|row| of_row(row) as u64));
        self.make_room("weeds", all_weeds)?;
        for row in begun() {
            self.batch.reset_row(row, seeds[row], Beginning { weeds: given(row), start: None });
        }
        self.present(reply, &mask)
    }

    fn restore(&mut self, reply: &Header, restore: &Restore) -> Result<Vec<u8>, Fault> {
        let bad = |text: String| Fault::BadConfig { text };
        let rows = self.batch.rows().len();
        let most = self.most_weeds();
        let weeds = match restore.env {
            None => weeds_of_rows(restore.data, rows, most)?,
            Some(row) if (row as usize) < rows => {
                let mut weeds = vec![0; rows];
                weeds[row as usize] = weeds_of(restore.data, row as usize, most)?;
                weeds
            }
            Some(row) => {
                return Err(bad(format!("`env` must be from 0 to {}, got {row}", rows - 1)));
            }
        };
        let weeds = most_of(&self.weeds, weeds);
        let before = self.weeds.clone();
        self.make_room("snapshot", weeds)?;
        let restored = match restore.env {
            None => self.batch.restore(restore.data),
            Some(row) => self.batch.restore_row(row as usize, restore.data),
        };
        if let Err(error) = restored {
            self.make_room("snapshot", before).expect("there was room for as much before");
            return Err(bad_snapshot(&error));
        }
        let begun: Vec<bool> = (0..rows).map(|row| self.batch.has_begun(row)).collect();
        self.present(reply, &begun)
    }

    /// The present state of every environment; those of `mask` have open choices to tell of.
    fn present(&mut self, reply: &Header, mask: &[bool]) -> Result<Vec<u8>, Fault> {
        let Self { batch, columns, .. } = self;
        *columns = Columns {
            observation: std::mem::take(&mut columns.observation),
            ..Columns::new(batch)
        };
        if (0..mask.len()).all(|row| batch.has_begun(row)) {
            batch.observe(columns.observation.as_mut());
        }
        let choices = batch.mask_width();
        if choices > 0 {
            batch.action_masks(&mut columns.action_mask);
            for (open, &is_begun) in columns.action_mask.chunks_exact_mut(choices).zip(mask) {
                if !is_begun {
                    open.fill(false);
                }
            }
        }
        let state_hash = self.state_hash();
        let observation = self.columns.observation(&self.layout);
        let info = self.columns.info(self.infos);
        // Of every row: a client may have dropped what the last step told.
        let percept = self.teller.as_mut().map(|teller| teller.tell(self.batch.rows(), |_| true));
        codec::write(
            reply,
            &ResetReply {
                observation: borrowed(&observation),
                info: borrowed(&info),
                state_hash,
                percept: percept.as_ref().map(Tables::borrowed),
            },
        )
    }

    fn snapshot(&self, reply: &Header, snapshot: Snapshot) -> Result<Vec<u8>, Fault> {
        let rows = self.batch.rows();
        let data = match snapshot.env {
            None => self.batch.snapshot(),
            Some(row) => rows.get(row as usize).map(Env::snapshot).ok_or_else(|| {
                let text = format!("`env` must be from 0 to {}, got {row}", rows.len() - 1);
                Fault::BadConfig { text }
            })?,
        };
        let (size, limit) = (data.len() as u64 + 128, u64::from(self.max_msg));
        if size > limit {
            return Err(Fault::TooLarge { size, limit });
        }
        codec::write(reply, &SnapshotReply { config_hash: self.scenario.hash(), data: &data })
    }

    /// What the mowers perceive after a step.
    fn percept_of_step(&mut self) -> Option<Tables> {
        let Self { batch, teller, columns, autoreset, .. } = self;
        let begins_at_once = *autoreset == Autoreset::SameStep;
        let has_begun =
            |row: usize| begins_at_once && (columns.terminated[row] || columns.truncated[row]);
        teller.as_mut().map(|teller| teller.tell(batch.rows(), has_begun))
    }

    /// Counts a request that was carried out; the hash of the state, if it is its turn.
    fn state_hash(&mut self) -> Option<[u8; 16]> {
        self.requests = self.requests.wrapping_add(1);
        let is_due = self.hash_every > 0 && self.requests.is_multiple_of(self.hash_every);
        is_due.then(|| state_hash(&self.batch))
    }

    /// Counts so many weeds of each environment, if there is room for them.
    fn make_room(&mut self, field: &str, weeds: Vec<u64>) -> Result<(), Fault> {
        let all = check_weeds(field, &weeds, self.place.session())?;
        self.place.resize(Size { weeds: all, ..self.place.size() })?;
        self.weeds = weeds;
        Ok(())
    }

    /// Most weeds that an environment may have, where there are percepts.
    fn most_weeds(&self) -> Option<u64> {
        self.teller.as_ref().map(Teller::most_weeds)
    }

    fn final_observation(&self, done: &[usize]) -> Vec<Vec<u8>> {
        if self.autoreset != Autoreset::SameStep {
            return Vec::new();
        }
        let observation = self.batch.last_observation();
        self.layout
            .observation
            .iter()
            .map(|leaf| rows_of(observation, &leaf.name, done, self.batch.rows().len()))
            .collect()
    }

    fn ended(&self, done: &[usize], last: &[&Last]) -> Vec<Vec<u8>> {
        let floats = |of: fn(&Last) -> f64| bytes_of(last.iter().map(|last| of(last)));
        let counts = |of: fn(&Last) -> usize| {
            bytes_of(last.iter().map(|last| i64::try_from(of(last)).expect("weeds are few")))
        };
        let mut tables = vec![
            floats(|last| last.terms.weed),
            floats(|last| last.terms.path),
            floats(|last| last.terms.failure),
            bytes_of(last.iter().map(|last| last.is_clipped)),
        ];
        let choices = self.batch.mask_width();
        if choices > 0 {
            tables.push(floats(|last| last.distance_m));
            // Where a row keeps its state when its episode ends, the mask is the one that the step wrote.
            let masks = match self.autoreset {
                Autoreset::SameStep => self.batch.last_masks(),
                _ => &self.columns.action_mask,
            };
            let of_row = |&row: &usize| masks[row * choices..(row + 1) * choices].iter().copied();
            tables.push(bytes_of(done.iter().flat_map(of_row)));
        }
        let outcome = |last: &&Last| {
            let place = OUTCOMES.iter().position(|&outcome| outcome == last.outcome);
            u8::try_from(place.expect("every outcome is listed")).expect("there are few")
        };
        tables.extend([
            floats(|last| last.summary.path_length_m),
            floats(|last| last.summary.bcp_length_m),
            floats(|last| last.summary.seen_fraction),
            counts(|last| last.summary.weeds_total),
            counts(|last| last.summary.weeds_detected),
            counts(|last| last.summary.weeds_mowed),
            bytes_of(last.iter().map(outcome)),
        ]);
        tables
    }
}

/// Longest reply to a step of so many environments, bytes.
fn longest_reply(layout: &Layout, rows: usize, teller: Option<&Teller>) -> usize {
    layout.longest_reply(rows).saturating_add(teller.map_or(0, |teller| teller.longest(rows)))
}

/// First half of the SHA-256 of a batch's snapshot.
#[must_use]
pub fn state_hash(batch: &BatchEnv) -> [u8; 16] {
    let hash: [u8; 32] = Sha256::digest(batch.snapshot()).into();
    std::array::from_fn(|i| hash[i])
}

/// The seed of each environment.
fn seeds(seeds: &Seeds, rows: usize) -> Result<Vec<Option<u64>>, Fault> {
    match *seeds {
        Seeds::None => Ok(vec![None; rows]),
        Seeds::One(seed) => Ok((0..rows as u64).map(|row| Some(seed.wrapping_add(row))).collect()),
        Seeds::Each(table) => Ok(numbers::read(table)?.into_iter().map(Some).collect()),
        Seeds::Some(table) => {
            let (is_there, table) =
                table.split_at_checked(rows).ok_or(Fault::Malformed { offset: 53 })?;
            let is_there: Vec<bool> = numbers::read(is_there)?;
            let seeds: Vec<u64> = numbers::read(table)?;
            if seeds.len() != rows {
                return Err(Fault::Malformed { offset: 53 });
            }
            Ok(is_there.into_iter().zip(seeds).map(|(is, seed)| is.then_some(seed)).collect())
        }
    }
}

fn fault_of(error: BatchError) -> Fault {
    match error {
        BatchError::Row { row, error: ActionError::NotReset } => {
            Fault::NotReset { env: row as u64, text: error.to_string() }
        }
        BatchError::Row { row, .. } => {
            Fault::BadAction { env: row as u64, leaf: 0, text: error.to_string() }
        }
        BatchError::Size { .. } => Fault::BadAction { env: 0, leaf: 0, text: error.to_string() },
    }
}

fn borrowed<T: AsRef<[u8]>>(tables: &[T]) -> Vec<&[u8]> {
    tables.iter().map(T::as_ref).collect()
}

/// Some rows of one part of an observation of `rows` rows.
fn rows_of(observation: &Observation, part: &str, wanted: &[usize], rows: usize) -> Vec<u8> {
    fn some<T: numbers::Number>(table: &[T], wanted: &[usize], rows: usize) -> Vec<u8> {
        let width = table.len() / rows;
        bytes_of(
            wanted.iter().flat_map(|row| table[row * width..(row + 1) * width].iter().copied()),
        )
    }
    match part {
        "features" => some(&observation.features, wanted, rows),
        "candidates" => some(&observation.candidates, wanted, rows),
        "action_mask" => some(&observation.action_mask, wanted, rows),
        _ => some(&observation.maps, wanted, rows),
    }
}
