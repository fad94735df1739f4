//! A view put together from percepts is the view of the environment: every agent decides the same on either, to the bit, and
//! percepts tell nothing of weeds that were not detected.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use bincode::Encode;
use swath_agents::agent::{Agent, Decision};
use swath_agents::registry::AgentSpec;
use swath_core::batch::{Actions, Autoreset, BatchEnv, BatchOptions};
use swath_core::config::{ActionKind, Scenario, ValidScenario};
use swath_core::env::{Beginning, Env};
use swath_core::episode::End;
use swath_core::geometry::{Point, Pose};
use swath_core::known::KnownWeed;
use swath_core::mirror::{Mirror, News};
use swath_tests::agents;
use swath_tests::columns::Columns;
use swath_tests::sight::sight;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{HEADER_BYTES, Header, Kind, Verb};
use swath_wire::hosted::{ENV_ID, Hosted};
use swath_wire::message::{
    AutoresetMode, Limits, Open, Reset, ResetReply, Restore, Seeds, Step, StepReply,
};
use swath_wire::numbers::bytes_of;
use swath_wire::percept::read_percept;

const ROWS: usize = 3;

/// A pasture that is mowed within a few hundred steps.
fn scenario(kind: ActionKind) -> Scenario {
    let mut scenario = Scenario::default();
    (scenario.pasture.length_m, scenario.pasture.width_m) = (33.0, 17.5);
    scenario.pasture.headland_m = f64::INFINITY;
    scenario.weeds.count = 25;
    scenario.episode.control_period_s = 1.0;
    scenario.action.kind = kind;
    scenario
}

fn open(scenario: &ValidScenario, rows: usize, autoreset: AutoresetMode) -> Hosted {
    opened(scenario, rows, autoreset, None)
}

fn opened(
    scenario: &ValidScenario,
    rows: usize,
    autoreset: AutoresetMode,
    snapshot: Option<&[u8]>,
) -> Hosted {
    let open = Open {
        nonce: 1,
        env_id: ENV_ID.to_owned(),
        config: scenario.to_toml(),
        num_envs: u32::try_from(rows).unwrap(),
        autoreset,
        hash_every: 0,
        infos: true,
        snapshot,
        percept: true,
        client: String::new(),
    };
    Hosted::open(&open, &Limits::default(), 1).unwrap()
}

/// The payload of the reply to a request.
fn ask(hosted: &mut Hosted, verb: Verb, payload: &impl Encode) -> Result<Vec<u8>, Fault> {
    let header = Header { boot_id: 3, sid: 4, seq: 5, kind: Kind::Request(verb) };
    let message = codec::write(&header, payload).unwrap();
    let reply = hosted.answer(&header, Header::read(&message).unwrap().1)?;
    Ok(Header::read(&reply).unwrap().1.to_vec())
}

/// A batch here, its twin at the other end, and what the twin's percepts make of it.
struct Twins {
    batch: BatchEnv,
    hosted: Hosted,
    mirrors: Vec<Mirror>,
    is_same_step: bool,
    max_reply: usize,
}

impl Twins {
    fn new(scenario: &ValidScenario, local: Autoreset, remote: AutoresetMode) -> Self {
        let options = BatchOptions { rows: ROWS, autoreset: local, threads: 1 };
        let batch = BatchEnv::new(scenario, options).unwrap();
        let mirrors = vec![Mirror::new(batch.rows()[0].site()); ROWS];
        let hosted = open(scenario, ROWS, remote);
        let max_reply = hosted.open_reply(0, 0, Limits::default()).max_reply as usize;
        Self { batch, hosted, mirrors, is_same_step: local == Autoreset::SameStep, max_reply }
    }

    fn check(&self) {
        for (mirror, env) in self.mirrors.iter().zip(self.batch.rows()) {
            assert_eq!(sight(&mirror.view()), sight(&env.view()));
        }
    }

    fn take_present(&mut self, reply: &[u8]) {
        let reply: ResetReply = codec::read(reply).unwrap();
        read_percept(reply.percept.as_ref(), &mut self.mirrors).unwrap();
        self.check();
    }

    fn reset(&mut self, seed: u64) {
        self.batch.reset(seed);
        let reset = Reset { seeds: Seeds::One(seed), mask: &[], weeds: Vec::new() };
        let reply = ask(&mut self.hosted, Verb::Reset, &reset).unwrap();
        self.take_present(&reply);
    }

    /// Restores the rows here from the state of some moments ago, both here and there.
    fn restore(&mut self, row: Option<u32>, data: &[u8]) {
        match row {
            None => self.batch.restore(data).unwrap(),
            Some(row) => self.batch.restore_row(row as usize, data).unwrap(),
        }
        let restore = Restore { env: row, data };
        let reply = ask(&mut self.hosted, Verb::Restore, &restore).unwrap();
        self.take_present(&reply);
    }

    /// Steps both; returns which rows ended.
    fn step(&mut self, actions: &[f32]) -> Vec<bool> {
        self.step_told(actions).0
    }

    /// The same, and the payload of the reply.
    fn step_told(&mut self, actions: &[f32]) -> (Vec<bool>, Vec<u8>) {
        let mut columns = Columns::of(&self.batch);
        self.batch.step(Actions::Continuous(actions), columns.as_mut()).unwrap();
        let table = bytes_of(actions.iter().copied());
        let reply = ask(&mut self.hosted, Verb::Step, &Step { actions: vec![&table] }).unwrap();
        assert!(HEADER_BYTES + reply.len() <= self.max_reply);
        let payload = reply.clone();
        let reply: StepReply = codec::read(&reply).unwrap();
        let percept = reply.percept.as_ref().unwrap();
        let has_ended: Vec<bool> = (0..ROWS).map(|row| columns.has_ended(row)).collect();
        if self.is_same_step {
            assert_eq!(percept.whole, bytes_of(has_ended.iter().copied()));
        }
        read_percept(Some(percept), &mut self.mirrors).unwrap();
        self.check();
        (has_ended, payload)
    }
}

fn build(spec: &AgentSpec, kind: ActionKind, seed: u64) -> Box<dyn Agent> {
    if kind == ActionKind::Drive { spec.build(seed) } else { spec.build_tracked(seed) }
}

/// Asks an agent here and one there; their actions, which have to be equal.
fn decide(
    twins: &Twins,
    here: &mut [Box<dyn Agent>],
    there: &mut [Box<dyn Agent>],
) -> Vec<Option<Vec<f32>>> {
    let mut actions = Vec::new();
    for (row, (here, there)) in here.iter_mut().zip(there).enumerate() {
        let env = &twins.batch.rows()[row];
        let (one, other) = (here.act(&env.view()), there.act(&twins.mirrors[row].view()));
        assert_eq!(one, other);
        actions.push(match one {
            Decision::Drive(command) => env.decoder().encode(command),
            Decision::Done | Decision::Capped => None,
        });
    }
    actions
}

/// Whole episodes of an agent, and one that begins with a restore; returns how many steps it took.
fn follow(spec: &AgentSpec, kind: ActionKind) -> usize {
    let scenario = scenario(kind).check().unwrap();
    let mut twins = Twins::new(&scenario, Autoreset::Disabled, AutoresetMode::Disabled);
    let crew =
        || -> Vec<Box<dyn Agent>> { (0..ROWS as u64).map(|row| build(spec, kind, row)).collect() };
    let (mut here, mut there) = (crew(), crew());
    let idle: Vec<f32> = if kind == ActionKind::Drive { vec![0.0, -1.0] } else { vec![0.0] };
    twins.reset(11);
    let mut steps = 0;
    let mut kept = None;
    for episode in 0..2 {
        for (row, (here, there)) in here.iter_mut().zip(&mut there).enumerate() {
            here.reset(&twins.batch.rows()[row].view());
            there.reset(&twins.mirrors[row].view());
        }
        let mut live = [true; ROWS];
        for step in 0..20_000 {
            let actions = decide(&twins, &mut here, &mut there);
            for row in 0..ROWS {
                live[row] &= actions[row].is_some();
            }
            if live == [false; ROWS] {
                break;
            }
            // Rows whose agent has stopped stand still meanwhile.
            let flat: Vec<f32> = actions
                .into_iter()
                .flat_map(|action| action.unwrap_or_else(|| idle.clone()))
                .collect();
            if twins.batch.rows().iter().any(|env| env.end() != Some(End::Running)) {
                break;
            }
            twins.step(&flat);
            steps += 1;
            if episode == 0 && step == 60 {
                kept = Some((twins.batch.snapshot(), twins.batch.rows()[1].snapshot()));
            }
        }
        if let Some((all, one)) = kept.take() {
            twins.restore(None, &all);
            twins.restore(Some(2), &one);
        }
    }
    steps
}

#[test]
fn every_agent_decides_the_same_on_a_view_put_together_elsewhere() {
    for kind in [ActionKind::Drive, ActionKind::Steer] {
        for name in agents::quick().chain(["bcp:spacing=sensor"]) {
            let steps = follow(&name.parse().unwrap(), kind);
            assert!(steps > 150, "{name}, {kind:?}: {steps} steps");
        }
    }
}

#[test]
fn a_percept_belongs_to_the_episode_that_the_observation_belongs_to() {
    for (local, remote) in [
        (Autoreset::NextStep, AutoresetMode::NextStep),
        (Autoreset::SameStep, AutoresetMode::SameStep),
    ] {
        let mut scenario = scenario(ActionKind::Steer);
        scenario.episode.budget = 0.02;
        let mut twins = Twins::new(&scenario.check().unwrap(), local, remote);
        twins.reset(4);
        let mut ended = 0;
        for step in 0..200 {
            let actions: Vec<f32> =
                (0..ROWS).map(|row| ((step * (row + 2)) as f32).sin()).collect();
            ended += twins.step(&actions).into_iter().filter(|&has| has).count();
        }
        assert!(ended > 3 * ROWS, "{ended}");
    }
}

/// The percepts of a drive among these weeds, and how many were detected by then.
fn told(scenario: &ValidScenario, weeds: &[Point], drive: &[f32]) -> Vec<(Vec<u8>, u32)> {
    let mut hosted = open(scenario, 1, AutoresetMode::Disabled);
    let mut env = Env::new(scenario);
    let mut observation = env.observation_spec().rows(1);
    env.reset_from(0, Beginning { weeds: Some(weeds), start: None });
    let table = bytes_of(weeds.iter().flat_map(|weed| [weed.x, weed.y]));
    let reset = Reset { seeds: Seeds::One(0), mask: &[], weeds: vec![Some(&table)] };
    let reply = ask(&mut hosted, Verb::Reset, &reset).unwrap();
    let bytes = |percept: &swath_wire::message::Percept| {
        let header = Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Reply(Verb::Step) };
        codec::write(&header, percept).unwrap()
    };
    let reply: ResetReply = codec::read(&reply).unwrap();
    let mut told = vec![(bytes(reply.percept.as_ref().unwrap()), env.view().weeds_detected)];
    for &steering in drive {
        let action = swath_core::action::Action::Continuous(&[steering]);
        env.step(action, observation.as_mut()).unwrap();
        let table = bytes_of([steering]);
        let reply = ask(&mut hosted, Verb::Step, &Step { actions: vec![&table] }).unwrap();
        let reply: StepReply = codec::read(&reply).unwrap();
        told.push((bytes(reply.percept.as_ref().unwrap()), env.view().weeds_detected));
    }
    told
}

#[test]
fn a_hidden_weed_changes_no_byte_of_a_percept_until_it_is_seen() {
    let mut scenario = scenario(ActionKind::Steer);
    scenario.weeds.count = 3;
    let scenario = scenario.check().unwrap();
    let drive: Vec<f32> = vec![0.0; 25];
    let near = Point::new(4.0, 1.0);
    let base = told(&scenario, &[near, Point::new(3.0, 16.0)], &drive);
    assert_eq!(base.last().unwrap().1, 1, "the weed behind is never seen");
    for hidden in [
        vec![near],
        vec![Point::new(1.0, 17.0), near],
        vec![Point::new(30.0, 17.5), near, Point::new(0.5, 16.0)],
    ] {
        assert_eq!(told(&scenario, &hidden, &drive), base);
    }
    let ahead = told(&scenario, &[near, Point::new(22.0, 1.0)], &drive);
    let first = ahead.iter().position(|(_, detected)| *detected == 2).expect("it is driven to");
    assert!(first > 3, "it is out of sight at first");
    assert_eq!(ahead[..first], base[..first]);
    assert_ne!(ahead[first].0, base[first].0);
}

#[test]
fn a_session_that_does_not_ask_for_percepts_is_told_none() {
    let scenario = scenario(ActionKind::Steer).check().unwrap();
    let mut open = Open {
        nonce: 1,
        env_id: ENV_ID.to_owned(),
        config: scenario.to_toml(),
        num_envs: 2,
        autoreset: AutoresetMode::NextStep,
        hash_every: 0,
        infos: true,
        snapshot: None,
        percept: false,
        client: String::new(),
    };
    let (mut longest, mut sizes) = (Vec::new(), Vec::new());
    for percept in [false, true] {
        open.percept = percept;
        let mut hosted = Hosted::open(&open, &Limits::default(), 1).unwrap();
        longest.push(hosted.open_reply(0, 0, Limits::default()).max_reply);
        let reset = Reset { seeds: Seeds::One(0), mask: &[], weeds: Vec::new() };
        let reply = ask(&mut hosted, Verb::Reset, &reset).unwrap();
        assert_eq!(codec::read::<ResetReply>(&reply).unwrap().percept.is_some(), percept);
        let table = bytes_of([0.0_f32; 2]);
        let reply = ask(&mut hosted, Verb::Step, &Step { actions: vec![&table] }).unwrap();
        assert_eq!(codec::read::<StepReply>(&reply).unwrap().percept.is_some(), percept);
        let mut bytes = 0;
        for _ in 0..50 {
            let step = Step { actions: vec![&table] };
            bytes += ask(&mut hosted, Verb::Step, &step).unwrap().len();
        }
        sizes.push(bytes);
    }
    assert!(longest[0] < longest[1], "{longest:?}");
    // Eight lengths, then for each of two mowers 65 bytes and what little is new.
    let told = (sizes[1] - sizes[0]) / 50;
    assert!((64 + 2 * 65..64 + 2 * 100).contains(&told), "{told} bytes a step");
}

#[test]
fn more_weeds_than_percepts_have_room_for_are_refused_and_nothing_changes() {
    let mut scenario = scenario(ActionKind::Steer);
    scenario.weeds.count = 1;
    let scenario = scenario.check().unwrap();
    let mut hosted = open(&scenario, 1, AutoresetMode::Disabled);
    let mut env = Env::new(&scenario);
    env.reset(5);
    let state = |hosted: &mut Hosted| {
        ask(hosted, Verb::Snapshot, &swath_wire::message::Snapshot { env: None }).unwrap()
    };
    let reset = Reset { seeds: Seeds::One(5), mask: &[], weeds: Vec::new() };
    ask(&mut hosted, Verb::Reset, &reset).unwrap();
    let before = state(&mut hosted);
    let weeds = [Point::new(1.0, 1.0), Point::new(2.0, 1.0)];
    let table = bytes_of(weeds.iter().flat_map(|weed| [weed.x, weed.y]));
    let text = "`weeds[0]` must be at most 1 with `percept`, got 2";
    let many = Reset { weeds: vec![Some(&table)], ..reset };
    assert_eq!(ask(&mut hosted, Verb::Reset, &many).unwrap_err().to_string(), text);
    env.reset_from(5, Beginning { weeds: Some(&weeds), start: None });
    let restore = Restore { env: Some(0), data: &env.snapshot() };
    let text = "`snapshot` must have at most 1 weeds in environment 0 with `percept`, got 2";
    assert_eq!(ask(&mut hosted, Verb::Restore, &restore).unwrap_err().to_string(), text);
    assert_eq!(state(&mut hosted), before);
}

/// So that a client may compare replies when its session is resumed at another server.
#[test]
fn a_session_opened_from_a_snapshot_tells_what_the_lost_one_would_have_told() {
    for (autoreset, remote) in [
        (Autoreset::NextStep, AutoresetMode::NextStep),
        (Autoreset::SameStep, AutoresetMode::SameStep),
    ] {
        let mut scenario = scenario(ActionKind::Steer);
        scenario.episode.budget = 0.02;
        let scenario = scenario.check().unwrap();
        let mut twins = Twins::new(&scenario, autoreset, remote);
        twins.reset(4);
        let mut resumed = opened(&scenario, ROWS, remote, Some(&twins.batch.snapshot()));
        for step in 0..120 {
            if step % 9 == 0 {
                resumed = opened(&scenario, ROWS, remote, Some(&twins.batch.snapshot()));
            }
            let actions: Vec<f32> =
                (0..ROWS).map(|row| ((step * (row + 2)) as f32).sin()).collect();
            let table = bytes_of(actions.iter().copied());
            let told = ask(&mut resumed, Verb::Step, &Step { actions: vec![&table] }).unwrap();
            assert_eq!(told, twins.step_told(&actions).1, "step {step}");
        }
    }
}

type Change = fn(&mut News);

/// A mirror is told by whoever stands at the other end.
#[test]
fn news_that_do_not_follow_are_refused() {
    let scenario = scenario(ActionKind::Steer).check().unwrap();
    let site = *Env::new(&scenario).site();
    let weed = |number, x| KnownWeed { number, position: Point::new(x, 1.0) };
    let news = News {
        pose: Pose::new(1.0, 1.0, 0.0),
        weeds_detected: 3,
        known: vec![weed(0, 1.0), weed(2, 2.0)],
        mowed: vec![1],
        seen: vec![(0, 0b11)],
        ..News::default()
    };
    let next =
        News { is_whole: false, known: vec![], mowed: vec![2], seen: vec![], ..news.clone() };
    let mut mirror = Mirror::new(&site);
    mirror.apply(&news).unwrap();
    assert_eq!((mirror.view().known_weeds.len(), mirror.view().weeds_detected), (2, 3));
    mirror.clone().apply(&next).unwrap();
    let changes: [(Change, &str); 9] = [
        (|news| news.path_m = f64::NAN, "a pose that is no pose"),
        (
            |news| news.known = vec![KnownWeed { number: 0, position: Point::origin() }],
            "weeds out of their order",
        ),
        (
            |news| {
                news.weeds_detected = 4;
                news.known = vec![KnownWeed { number: 3, position: Point::new(-9.0, 0.0) }];
            },
            "weeds off the pasture",
        ),
        (|news| news.weeds_detected = u32::MAX, "another number of weeds"),
        (|news| news.weeds_detected = 1, "another number of weeds"),
        (|news| news.mowed = vec![1], "mowed weeds that were not known"),
        (|news| news.mowed = vec![2, 0], "mowed weeds that were not known"),
        (|news| news.seen = vec![(0, 1)], "ground that was seen already"),
        (|news| news.seen = vec![(u32::MAX, 1)], "ground that was seen already"),
    ];
    for (change, got) in changes {
        let mut wrong = next.clone();
        change(&mut wrong);
        let error = mirror.clone().apply(&wrong).unwrap_err().to_string();
        assert!(error.ends_with(&format!("got {got}")), "{error}");
    }
}
