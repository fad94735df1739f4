//! One message of each kind, byte by byte, as committed in `docs/protocol/golden_messages.txt` for other implementations.
//! `make test-rust GOLDEN=1` rewrites the file.

#![cfg(test)] // for helpers, too, an unwrap is a failing test

use std::fmt::Write as _;
use std::path::Path;

use bincode::Encode;
use swath_wire::codec;
use swath_wire::fault::{Fault, Loss};
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::leaf::{Dtype, Leaf};
use swath_wire::message::{
    AutoresetMode, CloseReply, EnvInfo, Limits, Open, OpenReply, Percept, Reset, ResetReply,
    Restore, Seeds, SessionStats, Snapshot, SnapshotReply, SpecReply, StatsReply, Step, StepReply,
};
use swath_wire::numbers::bytes_of;

const BOOT: u128 = 0x0f0e_0d0c_0b0a_0908_0706_0504_0302_0100;
const SID: u128 = 0x1f1e_1d1c_1b1a_1918_1716_1514_1312_1110;
const LID: u128 = 0x2f2e_2d2c_2b2a_2928_2726_2524_2322_2120;

struct Page(String);

impl Page {
    fn add(&mut self, name: &str, message: &[u8]) {
        write!(self.0, "{name} ").unwrap();
        for byte in message {
            write!(self.0, "{byte:02x}").unwrap();
        }
        self.0.push('\n');
    }

    fn of_server(&mut self, name: &str, kind: Kind, payload: &impl Encode) {
        let boot_id = if matches!(kind, Kind::Reply(_)) { BOOT } else { 0 };
        let header = Header { boot_id, sid: 0, seq: 0, kind };
        self.add(name, &codec::write(&header, payload).unwrap());
    }

    fn of_session(&mut self, name: &str, seq: u64, kind: Kind, payload: &impl Encode) {
        let header = Header { boot_id: BOOT, sid: SID, seq, kind };
        self.add(name, &codec::write(&header, payload).unwrap());
    }

    fn fault(&mut self, name: &str, fault: &Fault) {
        let header = Header { boot_id: BOOT, sid: SID, seq: 7, kind: Kind::Fault };
        self.add(name, &codec::write_fault(&header, fault));
    }
}

#[test]
fn every_message_has_the_bytes_that_are_written_down() {
    let request = Kind::Request;
    let reply = Kind::Reply;
    let mut page = Page(String::new());
    spec_and_open(&mut page);

    let mask = [1, 0];
    let weeds = bytes_of([1.5_f64, 2.5]);
    let reset = Reset { seeds: Seeds::None, mask: &[], weeds: Vec::new() };
    page.of_session("reset", 1, request(Verb::Reset), &reset);
    let seeds = bytes_of([7_u64, 8]);
    let some = [&mask[..], &seeds].concat();
    for (name, seeds) in [
        ("reset_one", Seeds::One(7)),
        ("reset_each", Seeds::Each(&seeds)),
        ("reset_some", Seeds::Some(&some)),
    ] {
        let reset = Reset { seeds, mask: &mask, weeds: vec![None, Some(&weeds)] };
        page.of_session(name, 1, request(Verb::Reset), &reset);
    }
    let features = bytes_of([0.5_f32, -1.0]);
    let terms = bytes_of([0.25_f64, -0.5]);
    let present = ResetReply {
        observation: vec![&features],
        info: vec![&terms],
        state_hash: Some(std::array::from_fn(|i| u8::try_from(i).unwrap())),
        percept: None,
    };
    page.of_session("reset_reply", 1, reply(Verb::Reset), &present);

    let action = bytes_of([0.5_f32, -1.0, 0.25, 1.0]);
    page.of_session("step", 7, request(Verb::Step), &Step { actions: vec![&action] });
    let stepped = StepReply {
        observation: vec![&features],
        reward: &terms,
        terminated: &[0, 1],
        truncated: &[0, 0],
        info: vec![&terms],
        done_index: &bytes_of([1_u32]),
        final_observation: vec![&features[4..]],
        ended: vec![&terms[8..]],
        state_hash: None,
        percept: None,
    };
    page.of_session("step_reply", 7, reply(Verb::Step), &stepped);
    let percept = Percept {
        whole: &[0, 1],
        mowers: &bytes_of([1.0_f64, 2.0, 0.0, 1.0, 0.0, 3.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]),
        counts: &bytes_of([4_u32, 1, 2, 1, 0, 0, 0, 1]),
        known: &bytes_of([3_u32]),
        known_m: &bytes_of([1.5_f64, 2.5]),
        mowed: &bytes_of([0_u32, 2]),
        tiles: &bytes_of([1_u32, 0]),
        seen: &bytes_of([0x0000_0000_0000_0301_u64, 0x0000_0000_0000_0001]),
    };
    let told = StepReply { percept: Some(percept.clone()), ..stepped };
    page.of_session("step_reply_percept", 7, reply(Verb::Step), &told);
    let told =
        ResetReply { percept: Some(Percept { whole: &[1, 1], ..percept }), ..present.clone() };
    page.of_session("reset_reply_percept", 1, reply(Verb::Reset), &told);

    page.of_session("snapshot", 7, request(Verb::Snapshot), &Snapshot { env: None });
    page.of_session("snapshot_one", 7, request(Verb::Snapshot), &Snapshot { env: Some(1) });
    let state = SnapshotReply { config_hash: [0xc0; 32], data: b"state" };
    page.of_session("snapshot_reply", 7, reply(Verb::Snapshot), &state);
    let restore = Restore { env: None, data: b"state" };
    page.of_session("restore", 8, request(Verb::Restore), &restore);
    page.of_session("restore_reply", 8, reply(Verb::Restore), &present);
    page.of_session("close", 8, request(Verb::Close), &());
    page.of_session("close_reply", 8, reply(Verb::Close), &CloseReply { steps: 16 });
    faults(&mut page);

    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/protocol/golden_messages.txt");
    if std::env::var_os("GOLDEN").is_some() {
        std::fs::write(&file, &page.0).unwrap();
    }
    let golden = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        page.0 == golden,
        "messages have changed; look at them with `make test-rust GOLDEN=1` and git diff"
    );
}

fn spec_and_open(page: &mut Page) {
    let spec = SpecReply {
        major_min: 1,
        major_max: 1,
        minor: 0,
        server: "default".to_owned(),
        build: "0.1.0".to_owned(),
        envs: vec![EnvInfo {
            id: "swath/MowerRouting-v0".to_owned(),
            config_schema: "{}".to_owned(),
            autoreset: 7,
        }],
        limits: Limits::default(),
    };
    page.of_server("spec", Kind::Request(Verb::Spec), &());
    page.of_server("spec_reply", Kind::Reply(Verb::Spec), &spec);
    let open = Open {
        nonce: LID,
        env_id: "swath/MowerRouting-v0".to_owned(),
        config: "[mower]\n".to_owned(),
        num_envs: 2,
        autoreset: AutoresetMode::SameStep,
        hash_every: 100,
        infos: true,
        snapshot: None,
        percept: false,
        client: "me".to_owned(),
    };
    page.of_server("open", Kind::Request(Verb::Open), &open);
    let with_snapshot = Open { snapshot: Some(b"state"), ..open };
    page.of_server("open_snapshot", Kind::Request(Verb::Open), &with_snapshot);
    let with_percept = Open { percept: true, snapshot: None, ..with_snapshot };
    page.of_server("open_percept", Kind::Request(Verb::Open), &with_percept);
    let opened = OpenReply {
        sid: SID,
        lid: LID,
        observation: vec![Leaf::new("features", Dtype::F32, &[1])],
        action: vec![Leaf::new("action", Dtype::F32, &[2])],
        info: vec![Leaf::new("reward_terms/weed", Dtype::F64, &[])],
        ended: vec![Leaf::new("outcome", Dtype::U8, &[])],
        outcomes: vec!["done".to_owned()],
        config_hash: [0xc0; 32],
        max_reply: 300,
        limits: Limits::default(),
    };
    page.of_session("open_reply", 0, Kind::Reply(Verb::Open), &opened);
    let stats = StatsReply {
        uptime_ms: 60_000,
        sessions: 1,
        envs: 2,
        opened: 3,
        lost: 1,
        requests: 100,
        faults: 4,
        steps: 190,
        latency_us: vec![0, 0, 100],
        open: vec![SessionStats {
            lease: "2f2e2d2c".to_owned(),
            client: "me".to_owned(),
            envs: 2,
            steps: 16,
            age_ms: 5_000,
            idle_ms: 10,
        }],
    };
    page.of_server("stats", Kind::Request(Verb::Stats), &());
    page.of_server("stats_reply", Kind::Reply(Verb::Stats), &stats);
}

fn faults(page: &mut Page) {
    let text = || "why".to_owned();
    for (name, fault) in [
        ("version_mismatch", Fault::VersionMismatch { least: 1, most: 1 }),
        ("no_session", Fault::NoSession { reason: Loss::Closed as u64, text: text() }),
        ("session_lost", Fault::SessionLost { boot_id: LID }),
        ("bad_seq", Fault::BadSeq { expected: 8 }),
        ("seq_reuse", Fault::SeqReuse { seq: 7 }),
        ("bad_action", Fault::BadAction { env: 1, leaf: 0, text: text() }),
        ("bad_config", Fault::BadConfig { text: text() }),
        ("too_large", Fault::TooLarge { size: 101, limit: 100 }),
        ("busy", Fault::Busy { retry_ms: 10 }),
        ("capacity", Fault::Capacity { used: 64, most: 64, text: text() }),
        ("env_fault", Fault::EnvFault { seq: 7, text: text() }),
        ("malformed", Fault::Malformed { offset: 48 }),
        ("not_reset", Fault::NotReset { env: 1, text: text() }),
        ("not_allowed", Fault::NotAllowed { text: text() }),
    ] {
        page.fault(&format!("fault_{name}"), &fault);
    }
}
