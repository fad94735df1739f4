//! A batch that is stepped by messages brings the same bytes as one in the same process.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use allocation_counter::measure;
use swath_core::batch::{Actions, Autoreset, BatchEnv, BatchOptions, Last};
use swath_core::config::{ActionKind, ObservationKind, Scenario};
use swath_core::env::Beginning;
use swath_tests::columns::Columns;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::hosted::{ENV_ID, Hosted, state_hash};
use swath_wire::message::{
    AutoresetMode, Limits, Open, Reset, ResetReply, Restore, Seeds, Snapshot, SnapshotReply, Step,
    StepReply,
};
use swath_wire::numbers::bytes_of;
use swath_wire::received::{EndedMut, read_reset, read_step};
use swath_wire::room::{Bounds, Room};

const ROWS: usize = 5;

/// A pasture on which episodes last some ten steps and end in different ways.
fn scenario(action: ActionKind, observation: ObservationKind) -> Scenario {
    let mut scenario = Scenario::default();
    scenario.pasture.headland_m = 2.0;
    scenario.episode.budget = 0.003;
    scenario.episode.control_period_s = 1.0;
    scenario.action.kind = action;
    scenario.observation.kind = observation;
    scenario
}

fn open(scenario: &Scenario, autoreset: AutoresetMode) -> Open<'static> {
    Open {
        nonce: 1,
        env_id: ENV_ID.to_owned(),
        config: scenario.clone().check().unwrap().to_toml(),
        num_envs: u32::try_from(ROWS).unwrap(),
        autoreset,
        hash_every: 1,
        infos: true,
        snapshot: None,
        percept: false,
        client: "test".to_owned(),
    }
}

fn request(verb: Verb) -> Header {
    Header { boot_id: 3, sid: 4, seq: 5, kind: Kind::Request(verb) }
}

/// Sends a request through its bytes, and returns those of the reply.
fn ask(hosted: &mut Hosted, verb: Verb, payload: &impl bincode::Encode) -> Result<Vec<u8>, Fault> {
    let message = codec::write(&request(verb), payload).unwrap();
    let (header, payload) = Header::read(&message).unwrap();
    let reply = hosted.answer(&header, payload)?;
    let (header, payload) = Header::read(&reply).unwrap();
    assert_eq!(header, Header { kind: Kind::Reply(verb), ..request(verb) });
    Ok(payload.to_vec())
}

fn follow(
    action: ActionKind,
    observation: ObservationKind,
    local: Autoreset,
    remote: AutoresetMode,
) {
    let scenario = scenario(action, observation);
    let options = BatchOptions { rows: ROWS, autoreset: local, threads: 1 };
    let mut batch = BatchEnv::new(&scenario.clone().check().unwrap(), options).unwrap();
    let mut hosted = Hosted::open(&open(&scenario, remote), &Limits::default(), 1).unwrap();
    batch.reset(9);
    let reset = Reset { seeds: Seeds::One(9), mask: &[], weeds: Vec::new() };
    let reply = ask(&mut hosted, Verb::Reset, &reset).unwrap();
    let mut expected = Columns::of(&batch);
    batch.observe(expected.observation.as_mut());
    let mut received = Columns::of(&batch);
    let reply: ResetReply = codec::read(&reply).unwrap();
    read_reset(&reply, received.as_mut()).unwrap();
    assert_eq!(received.observation, expected.observation);
    assert_eq!(reply.state_hash, Some(state_hash(&batch)));

    let mut ended = 0;
    let mut last: Vec<Option<Last>> = vec![None; ROWS];
    let mut last_observation = batch.last_observation().clone();
    for step in 0..40 {
        let steering: Vec<f32> =
            (0..ROWS).map(|row| 1.1 * ((step * 31) as f32 + (row * 17) as f32).sin()).collect();
        let choices: Vec<i64> = (0..).take(ROWS).map(|row: i64| (7 * step + row) % 5).collect();
        let (actions, table) = if action == ActionKind::Steer {
            (Actions::Continuous(&steering), bytes_of(steering.iter().copied()))
        } else {
            (Actions::Discrete(&choices), bytes_of(choices.iter().copied()))
        };
        let mut expected = Columns::of(&batch);
        let count = batch.step(actions, expected.as_mut()).unwrap();
        let reply = ask(&mut hosted, Verb::Step, &Step { actions: vec![&table] }).unwrap();
        let reply: StepReply = codec::read(&reply).unwrap();
        let mut received = Columns::of(&batch);
        // The way is told where actions are decisions, and nowhere else: there its column stays as it is.
        let is_way_told = batch.mask_width() > 0;
        if !is_way_told {
            expected.distance_m.clone_from(&received.distance_m);
        }
        let mut masks = vec![false; ROWS * batch.mask_width()];
        let out =
            EndedMut { last: &mut last, observation: last_observation.as_mut(), mask: &mut masks };
        assert_eq!(read_step(&reply, received.as_mut(), out), Ok(count));
        assert_eq!(format!("{received:?}"), format!("{expected:?}"), "step {step}");
        assert_eq!(reply.state_hash, Some(state_hash(&batch)));
        for row in (0..ROWS).filter(|&row| expected.has_ended(row)) {
            let distance_m = if is_way_told { batch.last(row).unwrap().distance_m } else { 0.0 };
            assert_eq!(last[row], batch.last(row).map(|&last| Last { distance_m, ..last }));
            let width = batch.mask_width();
            if local == Autoreset::SameStep {
                assert_eq!(
                    masks[row * width..(row + 1) * width],
                    batch.last_masks()[row * width..(row + 1) * width]
                );
            }
        }
        assert_eq!(&last_observation, batch.last_observation());
        ended += count;
        if local == Autoreset::Disabled {
            let mask: Vec<bool> = (0..ROWS).map(|row| expected.has_ended(row)).collect();
            if count > 0 {
                let table = bytes_of(mask.iter().copied());
                let reset = Reset { seeds: Seeds::None, mask: &table, weeds: Vec::new() };
                ask(&mut hosted, Verb::Reset, &reset).unwrap();
            }
            for row in (0..ROWS).filter(|&row| mask[row]) {
                batch.reset_row(row, None, Beginning::default());
            }
        }
    }
    assert!(ended > ROWS, "{ended} episodes ended");
    let reply = ask(&mut hosted, Verb::Snapshot, &Snapshot { env: None }).unwrap();
    assert_eq!(codec::read::<SnapshotReply>(&reply).unwrap().data, batch.snapshot());
}

#[test]
fn without_infos_all_else_is_the_same() {
    for action in [ActionKind::Steer, ActionKind::Target] {
        let scenario = scenario(action, ObservationKind::Features);
        let with = open(&scenario, AutoresetMode::NextStep);
        let without = Open { infos: false, ..with.clone() };
        let [mut told, mut untold] =
            [with, without].map(|open| Hosted::open(&open, &Limits::default(), 1).unwrap());
        let reset = Reset { seeds: Seeds::One(9), mask: &[], weeds: Vec::new() };
        let [full, short] =
            [&mut told, &mut untold].map(|hosted| ask(hosted, Verb::Reset, &reset).unwrap());
        let (full, short): (ResetReply, ResetReply) =
            (codec::read(&full).unwrap(), codec::read(&short).unwrap());
        assert_eq!(short, ResetReply { info: short.info.clone(), ..full });
        let mut ended = 0;
        for step in 0_i64..40 {
            let table = if action == ActionKind::Steer {
                bytes_of((0..ROWS).map(|row| (step as f32 + row as f32).sin()))
            } else {
                bytes_of((0..ROWS).map(|_| step % 5))
            };
            let step = Step { actions: vec![&table] };
            let [full, short] =
                [&mut told, &mut untold].map(|hosted| ask(hosted, Verb::Step, &step).unwrap());
            let (full, short): (StepReply, StepReply) =
                (codec::read(&full).unwrap(), codec::read(&short).unwrap());
            let masks = full.info[4..].last().copied();
            assert_eq!(short.info, masks.into_iter().collect::<Vec<_>>());
            ended += short.done_index.len() / 4;
            assert_eq!(short, StepReply { info: short.info.clone(), ..full });
        }
        assert!(ended > ROWS, "{ended} episodes ended");
    }
}

#[test]
fn a_batch_at_the_other_end_goes_the_same_way_to_the_bit() {
    for (local, remote) in [
        (Autoreset::NextStep, AutoresetMode::NextStep),
        (Autoreset::SameStep, AutoresetMode::SameStep),
        (Autoreset::Disabled, AutoresetMode::Disabled),
    ] {
        for (action, observation) in [
            (ActionKind::Steer, ObservationKind::Features),
            (ActionKind::Steer, ObservationKind::Dict),
            (ActionKind::Discrete, ObservationKind::Maps),
            (ActionKind::Target, ObservationKind::Candidates),
        ] {
            follow(action, observation, local, remote);
        }
    }
}

fn hosted() -> Hosted {
    let scenario = scenario(ActionKind::Steer, ObservationKind::Features);
    Hosted::open(&open(&scenario, AutoresetMode::NextStep), &Limits::default(), 1).unwrap()
}

/// The text of the fault that an open is answered with.
fn refused(change: impl FnOnce(&mut Open)) -> String {
    let mut open =
        open(&scenario(ActionKind::Steer, ObservationKind::Features), AutoresetMode::NextStep);
    change(&mut open);
    Hosted::open(&open, &Limits::default(), 1).unwrap_err().to_string()
}

#[test]
fn what_cannot_be_opened_is_refused_by_name() {
    assert_eq!(
        refused(|open| open.env_id = "swath/Ploughing-v0".to_owned()),
        "`env_id` must be swath/MowerRouting-v0, got swath/Ploughing-v0"
    );
    assert_eq!(refused(|open| open.num_envs = 0), "`num_envs` must be at least 1, got 0");
    assert_eq!(
        refused(|open| open.num_envs = 20_000),
        "`num_envs` must be at most 16384 on this server, got 20000"
    );
    assert_eq!(
        refused(|open| open.config = "[mower]\ndeck_width_m = 0.0".to_owned()),
        "`mower.deck_width_m` must be finite and > 0, got 0"
    );
    assert_eq!(
        refused(|open| open.config = "[weeds]\nfile = '/etc/passwd'".to_owned()),
        "`weeds.file` must be sent as `weeds.positions_m`, got \"/etc/passwd\""
    );
    assert_eq!(
        refused(|open| open.config = "#".repeat(3 << 20)),
        "`config` must have at most 2097152 bytes, got 3145728: more weeds can be given with a reset"
    );
    assert!(refused(|open| open.snapshot = Some(b"none")).starts_with("`snapshot` must be"));
}

fn opened_within(open: &Open, limits: &Limits, bounds: Bounds) -> Result<Hosted, Fault> {
    Hosted::open_in(open, limits, &Room::new(bounds, Bounds::OF_ALL), 1)
}

#[test]
fn environments_that_are_too_large_together_are_refused_before_they_are_built() {
    let scenario = Scenario::default();
    let many = Open { num_envs: 16_000, ..open(&scenario, AutoresetMode::NextStep) };
    let bounds = Bounds { max_cells: 66_560_000, max_weeds: 640_000 };
    let limits = Limits::default();
    let ask = |open: &Open, bounds| {
        let mut text = String::new();
        let used = measure(|| {
            text = match opened_within(open, &limits, bounds) {
                Ok(_) => String::new(),
                Err(fault) => fault.to_string(),
            };
        });
        (text, used.bytes_max)
    };
    let (text, bytes) = ask(&many, Bounds { max_cells: 66_559_999, ..bounds });
    assert_eq!(
        text,
        "`num_envs` x the cells of the pasture, 1 m by 1 m in whole squares of 8 by 8, must be at most 66559999 \
         on this server, got 66560000"
    );
    assert!(bytes < 1_000_000, "{bytes}");
    let (text, bytes) = ask(&many, Bounds { max_weeds: 639_999, ..bounds });
    assert_eq!(
        text,
        "`num_envs` x the number of weeds must be at most 639999 on this server, got 640000"
    );
    assert!(bytes < 1_000_000, "{bytes}");
    // So are replies that would be too long.
    let short = Limits { max_msg: 1_000_000, ..limits };
    let mut fault = None;
    let used = measure(|| fault = opened_within(&many, &short, bounds).err());
    assert!(matches!(fault, Some(Fault::TooLarge { limit: 1_000_000, .. })), "{fault:?}");
    assert!(used.bytes_max < 1_000_000, "{used:?}");
    let few = Open { num_envs: 5, ..many };
    let bounds = Bounds { max_weeds: 200, ..bounds };
    let mut hosted = opened_within(&few, &limits, bounds).unwrap();
    let table = bytes_of([1.0; 2 * 41]);
    let reset = Reset { seeds: Seeds::One(1), mask: &[], weeds: vec![Some(&table)] };
    let fault = ask_for(&mut hosted, &reset).unwrap_err();
    assert_eq!(
        fault.to_string(),
        "`weeds` must leave at most 200 weeds in all environments of a session together, each counted with the most \
         that it has had, got 205"
    );
    let one = Reset { mask: &[1, 0, 0, 0, 0], ..reset };
    assert!(matches!(ask_for(&mut hosted, &one), Err(Fault::NotReset { env: 1, .. })));
}

#[test]
fn weeds_do_not_pile_up_over_resets_of_a_part_nor_restores_nor_opens() {
    let mut scenario = scenario(ActionKind::Steer, ObservationKind::Features);
    scenario.weeds.count = 4;
    let open = open(&scenario, AutoresetMode::NextStep);
    let bounds = Bounds { max_cells: 1 << 28, max_weeds: 60 };
    let opened = |open: &Open, bounds| opened_within(open, &Limits::default(), bounds);
    let mut hosted = opened(&open, bounds).unwrap();
    let all = Reset { seeds: Seeds::One(1), mask: &[], weeds: Vec::new() };
    ask_for(&mut hosted, &all).unwrap();
    // 40 in one environment and 4 in each of the others; then 40 in a second one.
    let table = bytes_of([1.0; 2 * 40]);
    let one = |mask| Reset { mask, weeds: vec![Some(&table)], ..all.clone() };
    ask_for(&mut hosted, &one(&[1, 0, 0, 0, 0])).unwrap();
    let before = state_of(&mut hosted, None);
    let refused = |result: Result<Vec<u8>, Fault>, field: &str| {
        let text = format!(
            "`{field}` must leave at most 60 weeds in all environments of a session together, each counted with the \
             most that it has had, got 92"
        );
        assert_eq!(result.unwrap_err().to_string(), text);
    };
    refused(ask_for(&mut hosted, &one(&[0, 1, 0, 0, 0])), "weeds");
    // So it is with one row's snapshot, restored into another, and with all rows at once.
    let row = state_of(&mut hosted, Some(0));
    let second = Restore { env: Some(1), data: &row };
    refused(ask(&mut hosted, Verb::Restore, &second), "snapshot");
    let mut wide = opened(&open, Bounds { max_weeds: 92, ..bounds }).unwrap();
    ask_for(&mut wide, &all).unwrap();
    ask_for(&mut wide, &one(&[1, 1, 0, 0, 0])).unwrap();
    let snapshot = state_of(&mut wide, None);
    let whole = Restore { env: None, data: &snapshot };
    refused(ask(&mut hosted, Verb::Restore, &whole), "snapshot");
    assert_eq!(state_of(&mut hosted, None), before);
    let begun = Open { snapshot: Some(&snapshot), ..open };
    refused(opened(&begun, bounds).map(|_| Vec::new()), "snapshot");
    assert!(opened(&begun, Bounds { max_weeds: 92, ..bounds }).is_ok());
    // What has held many weeds keeps the memory for them.
    ask_for(&mut hosted, &all).unwrap();
    refused(ask_for(&mut hosted, &one(&[0, 1, 0, 0, 0])), "weeds");
    ask_for(&mut hosted, &one(&[1, 0, 0, 0, 0])).unwrap();
}

#[test]
fn all_sessions_together_have_so_many_cells_and_weeds_and_no_more() {
    let mut scenario = scenario(ActionKind::Steer, ObservationKind::Features);
    scenario.weeds.count = 4;
    let open = open(&scenario, AutoresetMode::NextStep);
    let told = Open { percept: true, ..open.clone() };
    let cells = |used, most| Fault::full(used, most, "cells of pastures", "max_all_cells");
    let weeds = |used| Fault::full(used, 100, "weeds", "max_all_weeds");
    // Five pastures of 100 m by 40 m: three sessions, or one and another one with percepts.
    let all = Bounds { max_cells: 62_400, max_weeds: 100 };
    let room = Room::new(Bounds::OF_SESSION, all);
    let opened = |open: &Open| Hosted::open_in(open, &Limits::default(), &room, 1);
    let mut first = opened(&open).unwrap();
    let second = opened(&told).unwrap();
    let full = opened(&open).unwrap_err();
    assert_eq!(full, cells(62_400, 62_400));
    drop(second);
    let second = opened(&open).unwrap();
    assert_eq!(opened(&told).unwrap_err(), cells(41_600, 62_400));
    // What could never be there is told so.
    let text = Open { num_envs: 16, ..open.clone() };
    assert_eq!(
        opened(&text).unwrap_err().to_string(),
        "`num_envs` x the cells of the pasture, 1 m by 1 m in whole squares of 8 by 8, must be at most 62400 \
         on this server, got 66560"
    );
    // 20 weeds each so far; resets and restores are charged as well.
    let table = bytes_of([1.0; 2 * 70]);
    let reset = Reset { seeds: Seeds::One(1), mask: &[], weeds: Vec::new() };
    ask_for(&mut first, &reset).unwrap();
    let before = state_of(&mut first, None);
    let one = Reset { mask: &[1, 0, 0, 0, 0], weeds: vec![Some(&table)], ..reset.clone() };
    let fault = ask_for(&mut first, &one).unwrap_err();
    assert_eq!(fault, weeds(40));
    let mut alone = Hosted::open(&open, &Limits::default(), 1).unwrap();
    ask_for(&mut alone, &reset).unwrap();
    ask_for(&mut alone, &one).unwrap();
    let many = state_of(&mut alone, Some(0));
    let restore = Restore { env: Some(0), data: &many };
    assert_eq!(ask(&mut first, Verb::Restore, &restore), Err(weeds(40)));
    assert_eq!(state_of(&mut first, None), before);
    // A snapshot that cannot be restored takes no room.
    let mut damaged = many.clone();
    *damaged.last_mut().unwrap() ^= 1;
    drop(second);
    ask(&mut first, Verb::Restore, &Restore { data: &damaged, ..restore.clone() }).unwrap_err();
    let second = opened(&open).unwrap();
    drop(second);
    ask_for(&mut first, &one).unwrap();
    assert_eq!(opened(&open).unwrap_err(), weeds(86));
}

fn state_of(hosted: &mut Hosted, env: Option<u32>) -> Vec<u8> {
    let reply = ask(hosted, Verb::Snapshot, &Snapshot { env }).unwrap();
    codec::read::<SnapshotReply>(&reply).unwrap().data.to_vec()
}

fn ask_for(hosted: &mut Hosted, reset: &Reset) -> Result<Vec<u8>, Fault> {
    ask(hosted, Verb::Reset, reset)
}

#[test]
fn a_refused_request_leaves_every_environment_as_it_was() {
    let mut hosted = hosted();
    let steer = |number: f32| bytes_of(vec![number; ROWS]);
    let step = ask(&mut hosted, Verb::Step, &Step { actions: vec![&steer(0.0)] });
    assert!(matches!(step, Err(Fault::NotReset { env: 0, .. })), "{step:?}");
    let reset = Reset { seeds: Seeds::One(3), mask: &[], weeds: Vec::new() };
    ask(&mut hosted, Verb::Reset, &reset).unwrap();
    let state = |hosted: &mut Hosted| ask(hosted, Verb::Snapshot, &Snapshot { env: None }).unwrap();
    let before = state(&mut hosted);
    let nan = steer(f32::NAN);
    for (verb, fault) in [
        (
            ask(&mut hosted, Verb::Step, &Step { actions: vec![&nan] }),
            "row 0: `action[0]` must be finite",
        ),
        (ask(&mut hosted, Verb::Step, &Step { actions: vec![&nan[4..]] }), "must have 5 number(s)"),
        (ask(&mut hosted, Verb::Step, &Step { actions: vec![&nan[1..]] }), "not a request"),
        (ask(&mut hosted, Verb::Step, &Step { actions: Vec::new() }), "not a request"),
        (ask(&mut hosted, Verb::Reset, &Reset { mask: &[1, 0], ..reset.clone() }), "not a request"),
        (
            ask(&mut hosted, Verb::Restore, &Restore { env: Some(7), data: b"" }),
            "`env` must be from 0 to 4, got 7",
        ),
        (
            ask(&mut hosted, Verb::Snapshot, &Snapshot { env: Some(5) }),
            "`env` must be from 0 to 4, got 5",
        ),
        (
            ask(&mut hosted, Verb::Restore, &Restore { env: None, data: b"x" }),
            "`snapshot` must be the bytes",
        ),
    ] {
        let text = verb.unwrap_err().to_string();
        assert!(text.contains(fault), "{text}");
        assert_eq!(state(&mut hosted), before);
    }
    let far = bytes_of([1e6, 0.0]);
    let reset = Reset { weeds: vec![Some(&far)], ..reset };
    let text = ask(&mut hosted, Verb::Reset, &reset).unwrap_err().to_string();
    assert_eq!(text, "`weeds[0]` must stand on the pasture, got [1000000, 0]");
    assert_eq!(state(&mut hosted), before);
}
