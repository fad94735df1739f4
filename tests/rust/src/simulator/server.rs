//! The server of the time, and the environments of its sessions.

use std::collections::BTreeMap;

use swath_wire::codec;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::message::{Limits, Open, OpenReply, Reset, Restore, Seeds, SnapshotReply, Step};
use swath_wire::server::{Finished, Job, QueryId, ServerOptions, ServerOutput, ServerSessions};

use super::{ATTEMPT_MS, Event, Sender, World};
use crate::dice::{Dice, mixed};

const GRACE_MS: u32 = 4_000;
const IDLE_MS: u32 = 20_000;

pub(super) struct Server {
    pub(super) sessions: ServerSessions,
    pub(super) queries: BTreeMap<QueryId, Sender>,
    pub(super) envs: BTreeMap<u128, Toy>,
    pub(super) last_query: u64,
    /// When it is woken next.
    pub(super) wake_ms: Option<u64>,
}

/// The environments of a session.
pub(super) struct Toy {
    state: u64,
    journal: Vec<u64>,
}

/// The state after an action.
pub(super) fn stepped(state: u64, action: u64) -> u64 {
    mixed(state.rotate_left(7) ^ action)
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes.try_into().expect("eight bytes"))
}

impl Toy {
    fn answer(&mut self, header: &Header, payload: &[u8]) -> Vec<u8> {
        let Kind::Request(verb) = header.kind else { unreachable!() };
        let reply = Header { kind: Kind::Reply(verb), ..*header };
        if verb == Verb::Snapshot {
            assert_eq!(header.seq, self.journal.len() as u64, "a snapshot is of the present");
            let data = self.state.to_le_bytes();
            return codec::write(&reply, &SnapshotReply { config_hash: [0; 32], data: &data })
                .expect("it is short");
        }
        assert_eq!(header.seq, self.journal.len() as u64 + 1, "carried out once, and in order");
        self.journal.push(header.seq);
        self.state = match verb {
            Verb::Reset => {
                let reset: Reset = codec::read(payload).expect("a client writes it");
                let Seeds::One(seed) = reset.seeds else { unreachable!() };
                seed
            }
            Verb::Restore => {
                let restore: Restore = codec::read(payload).expect("a client writes it");
                number(restore.data)
            }
            _ => {
                let step: Step = codec::read(payload).expect("a client writes it");
                stepped(self.state, number(step.actions[0]))
            }
        };
        codec::write(&reply, &self.state).expect("it is short")
    }
}

impl World {
    pub(super) fn start_server(&mut self) {
        self.boot += 1;
        let limits = Limits {
            // Fewer than there are clients and sessions of crashed ones, at times.
            max_sessions: u32::try_from(self.clients.len() + 4).expect("clients are few"),
            grace_ms: GRACE_MS,
            idle_ms: IDLE_MS,
            ..Limits::default()
        };
        let options = ServerOptions {
            server: "default".to_owned(),
            build: "test".to_owned(),
            boot_id: u128::from(mixed(self.boot)) + 1,
            limits,
            allow_snapshot: true,
            envs: Vec::new(),
            max_cached_bytes: 1 << 30,
        };
        let mut dice = Dice::new(self.dice.bits());
        let ids = Box::new(move || u128::from(dice.bits()) << 64 | u128::from(dice.bits()));
        self.server = Some(Server {
            sessions: ServerSessions::new(options, ids),
            queries: BTreeMap::new(),
            envs: BTreeMap::new(),
            last_query: 0,
            wake_ms: None,
        });
        let life_ms = self.weather.server_life_ms;
        if life_ms > 0 {
            let up_ms = life_ms + self.dice.below(2 * life_ms);
            self.at(up_ms, Event::Crash);
        }
    }

    /// Does what the server says.
    pub(super) fn serve(&mut self) {
        let now_ms = self.now_ms;
        let Some(mut server) = self.server.take() else { return };
        while let Some(output) = server.sessions.poll(now_ms) {
            match output {
                ServerOutput::Start(job) => {
                    let took_ms = if self.happens(self.weather.slow_in) {
                        ATTEMPT_MS + self.dice.below(2 * ATTEMPT_MS)
                    } else {
                        self.dice.below(4)
                    };
                    let finished = self.work(&mut server, &job);
                    self.at(took_ms, Event::JobDone { boot: self.boot, job: job.id, finished });
                }
                ServerOutput::Reply { query, message } => {
                    let to = server.queries.remove(&query).expect("answered once");
                    let copies = self.copies(to.client);
                    for _ in 0..copies {
                        let delay_ms = self.delay_ms();
                        let message = Some(message.clone());
                        self.at(delay_ms, Event::ToClient { to, message });
                    }
                }
                ServerOutput::Drop(query) => {
                    let to = server.queries.remove(&query).expect("answered once");
                    self.at(1, Event::ToClient { to, message: None });
                }
                ServerOutput::Free { sid, .. } => {
                    server.envs.remove(&sid).expect("freed once");
                    self.tally.freed += 1;
                }
            }
        }
        if let Some(wake_ms) = server.sessions.wake_ms() {
            assert!(wake_ms > now_ms, "what is due is done");
            if server.wake_ms.is_none_or(|before_ms| wake_ms < before_ms) {
                server.wake_ms = Some(wake_ms);
                self.at(wake_ms - now_ms, Event::ServerWake);
            }
        }
        self.server = Some(server);
    }

    /// Carries out a job.
    fn work(&mut self, server: &mut Server, job: &Job) -> Finished {
        let (_, payload) = Header::read(&job.message).expect("it was read before");
        if job.header.kind == Kind::Request(Verb::Open) {
            let open: Open = codec::read(payload).expect("a client writes it");
            let state = open.snapshot.map_or(0, number);
            let is_new = server.envs.insert(job.sid, Toy { state, journal: Vec::new() });
            assert!(is_new.is_none());
            self.tally.opened += 1;
            let header = Header { kind: Kind::Reply(Verb::Open), ..job.header };
            let reply = OpenReply {
                sid: job.sid,
                lid: job.lid,
                observation: Vec::new(),
                action: Vec::new(),
                info: Vec::new(),
                ended: Vec::new(),
                outcomes: Vec::new(),
                config_hash: [0; 32],
                max_reply: 100,
                limits: Limits::default(),
            };
            let message = codec::write(&header, &reply).expect("it is short");
            return Finished { message, steps: 0, max_reply: 100 };
        }
        let toy = server.envs.get_mut(&job.sid).expect("its environments are there");
        let message = toy.answer(&job.header, payload);
        self.tally.executed += 1;
        Finished { message, steps: toy.journal.len() as u64, max_reply: 0 }
    }
}
