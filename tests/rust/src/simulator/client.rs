//! Clients: what they want, and what they make of the answers.

use bytes::Bytes;
use swath_wire::client::{ClientError, ClientOptions, ClientOutput};
use swath_wire::codec;
use swath_wire::fault::{Fault, Loss};
use swath_wire::header::{Header, Verb};
use swath_wire::message::{
    AutoresetMode, CloseReply, Open, Reset, Restore, Seeds, Snapshot, SnapshotReply, Step,
};
use swath_wire::resume::{ResumeOptions, ResumingSession};

use super::server::stepped;
use super::{ATTEMPT_MS, DEADLINE_MS, Event, Sender, World};

pub(super) struct Client {
    pub(super) machine: ResumingSession,
    pub(super) is_resuming: bool,
    /// How often its session was resumed before.
    pub(super) resumed: u64,
    /// The lease that it holds.
    pub(super) lid: Option<u128>,
    pub(super) ask: Ask,
    pub(super) call: u64,
    pub(super) attempt: u64,
    /// The state that its session has to have.
    pub(super) state: u64,
    pub(super) has_reset: bool,
    /// The states that it has snapshots of, those of sessions before too.
    pub(super) saved: Vec<u64>,
    pub(super) steps_left: u64,
    pub(super) session_left: u64,
    pub(super) cut_until_ms: u64,
    pub(super) pause_until_ms: u64,
    /// When it is woken next.
    pub(super) wake_ms: Option<u64>,
    pub(super) is_done: bool,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Ask {
    Nothing,
    Open,
    Reset(u64),
    Step(u64),
    Snapshot,
    /// The state of one of its snapshots.
    Restore(u64),
    Close,
}

impl Client {
    pub(super) fn new(seed: u64, is_resuming: bool, steps: u64) -> Self {
        Self {
            machine: machine(seed, is_resuming),
            is_resuming,
            resumed: 0,
            lid: None,
            ask: Ask::Nothing,
            call: 0,
            attempt: 0,
            state: 0,
            has_reset: false,
            saved: Vec::new(),
            steps_left: steps,
            session_left: 0,
            cut_until_ms: 0,
            pause_until_ms: 0,
            wake_ms: None,
            is_done: false,
        }
    }
}

fn machine(seed: u64, is_resuming: bool) -> ResumingSession {
    let options = ClientOptions {
        attempt_ms: ATTEMPT_MS,
        deadline_ms: DEADLINE_MS,
        jitter_seed: seed,
        ..ClientOptions::default()
    };
    let resume = ResumeOptions { hash_every: 4, snapshot_every: 10, ..ResumeOptions::default() };
    ResumingSession::new(options, is_resuming.then_some(resume))
}

impl World {
    /// Does what a client's machine says, and asks the next thing when it has none.
    pub(super) fn drive(&mut self, client: usize) {
        loop {
            let now_ms = self.now_ms;
            match self.clients[client].machine.poll(now_ms) {
                ClientOutput::Send { verb, message, timeout_ms } => {
                    let sender = &mut self.clients[client];
                    sender.attempt += 1;
                    let from = Sender { client, call: sender.call, attempt: sender.attempt };
                    for _ in 0..self.copies(client) {
                        let (delay_ms, message) = (self.delay_ms(), message.clone());
                        self.at(delay_ms, Event::ToServer { from, verb, message });
                    }
                    self.at(timeout_ms, Event::Timeout(from));
                    return;
                }
                ClientOutput::Wait { until_ms } => {
                    self.wake(client, until_ms);
                    return;
                }
                ClientOutput::Done(result) => self.done(client, result),
                ClientOutput::Idle => {
                    let sender = &self.clients[client];
                    if sender.is_done {
                        return;
                    }
                    if sender.pause_until_ms > now_ms {
                        let until_ms = sender.pause_until_ms;
                        self.wake(client, until_ms);
                        return;
                    }
                    self.ask(client);
                }
            }
        }
    }

    pub(super) fn wake(&mut self, client: usize, at_ms: u64) {
        let me = &mut self.clients[client];
        if me.wake_ms.is_none_or(|before_ms| at_ms < before_ms) {
            me.wake_ms = Some(at_ms);
            self.at(at_ms - self.now_ms, Event::Wake { client });
        }
    }

    /// The next thing that a client wants.
    fn ask(&mut self, client: usize) {
        let now_ms = self.now_ms;
        let Self { clients, dice, weather, .. } = self;
        let me = &mut clients[client];
        if me.machine.is_in_doubt() {
            // It has found no room at the next server.
            me.call += 1;
            me.machine.retry(now_ms).expect("it is to be resumed");
            return;
        }
        let ask = if me.machine.lid().is_none() {
            if me.steps_left == 0 {
                me.is_done = true;
                return;
            }
            Ask::Open
        } else if me.session_left == 0 || me.steps_left == 0 {
            Ask::Close
        } else if !me.has_reset || dice.one_in(100) {
            Ask::Reset(dice.bits())
        } else if dice.one_in(50) {
            Ask::Snapshot
        } else if !me.saved.is_empty() && dice.one_in(40) {
            let place = dice.below(me.saved.len() as u64);
            Ask::Restore(me.saved[usize::try_from(place).expect("snapshots are few")])
        } else {
            Ask::Step(dice.bits())
        };
        if weather.cut_in > 0 && dice.one_in(weather.cut_in) {
            me.cut_until_ms = now_ms + dice.below(2 * DEADLINE_MS);
        }
        if weather.crash_in > 0 && dice.one_in(weather.crash_in) {
            self.crash(client);
            return;
        }
        self.call(client, ask);
    }

    fn call(&mut self, client: usize, ask: Ask) {
        let now_ms = self.now_ms;
        let me = &mut self.clients[client];
        (me.ask, me.call) = (ask, me.call + 1);
        let machine = &mut me.machine;
        let is_begun = match ask {
            Ask::Open => {
                let nonce = u128::from(self.dice.bits()) << 64 | client as u128;
                let open = Open {
                    nonce,
                    env_id: "toy".to_owned(),
                    config: String::new(),
                    num_envs: 1,
                    autoreset: AutoresetMode::NextStep,
                    hash_every: 0,
                    infos: true,
                    snapshot: None,
                    percept: false,
                    client: client.to_string(),
                };
                machine.open(now_ms, &open)
            }
            Ask::Reset(seed) => machine.call(
                now_ms,
                Verb::Reset,
                &Reset { seeds: Seeds::One(seed), mask: &[], weeds: Vec::new() },
            ),
            Ask::Step(action) => {
                machine.call(now_ms, Verb::Step, &Step { actions: vec![&action.to_le_bytes()] })
            }
            Ask::Snapshot => machine.call(now_ms, Verb::Snapshot, &Snapshot { env: None }),
            Ask::Restore(state) => {
                let data = &state.to_le_bytes();
                machine.call(now_ms, Verb::Restore, &Restore { env: None, data })
            }
            Ask::Close => machine.call_empty(now_ms, Verb::Close),
            Ask::Nothing => unreachable!("there is something to ask"),
        };
        match is_begun {
            // It was lost while it was to be resumed: there is nothing to close.
            Err(error) if matches!(ask, Ask::Close) && me.is_resuming => {
                assert!(
                    matches!(
                        error,
                        ClientError::Fault(Fault::SessionLost { .. } | Fault::NoSession { .. })
                    ),
                    "{error}"
                );
                self.leave(client);
            }
            is_begun => assert_eq!(is_begun, Ok(()), "{ask:?}"),
        }
    }

    /// A call has ended.
    fn done(&mut self, client: usize, result: Result<Bytes, ClientError>) {
        let now_ms = self.now_ms;
        self.hold_lease(client);
        let me = &mut self.clients[client];
        match result {
            Ok(message) => self.answered(client, &message),
            Err(ClientError::Timeout { waited_ms, .. }) => {
                assert_eq!(waited_ms, DEADLINE_MS);
                self.tally.timeouts += 1;
                self.doubt(client);
            }
            Err(ClientError::Fault(Fault::SessionLost { .. })) => {
                self.tally.seen_lost += 1;
                self.leave(client);
            }
            Err(ClientError::Fault(Fault::NoSession { reason, .. })) => {
                assert_ne!(reason, Loss::Unknown as u64, "no session is forgotten");
                self.tally.seen_ended += 1;
                self.leave(client);
            }
            Err(ClientError::Fault(Fault::Capacity { .. })) => {
                me.pause_until_ms = now_ms + 200;
                self.tally.full += 1;
            }
            Err(error) => panic!("{:?}: {error}", me.ask),
        }
    }

    /// Shows the server a sign of life of the session of the time.
    fn hold_lease(&mut self, client: usize) {
        let me = &mut self.clients[client];
        let (before, lid) = (me.lid, me.machine.lid());
        (me.lid, self.tally.resumed) =
            (lid, self.tally.resumed + me.machine.resumed() - me.resumed);
        me.resumed = me.machine.resumed();
        if before == lid {
            return;
        }
        for (lid, is_there) in [(before, false), (lid, true)] {
            if let Some(lid) = lid {
                self.at(1, Event::Lease { lid, is_there });
            }
        }
    }

    fn answered(&mut self, client: usize, message: &[u8]) {
        let me = &mut self.clients[client];
        let (header, payload) = Header::read(message).expect("the machine has read it");
        match me.ask {
            Ask::Open => {
                (me.has_reset, me.session_left) = (false, 50 + self.dice.below(150));
            }
            Ask::Reset(state) | Ask::Restore(state) => {
                assert_eq!(codec::read::<u64>(payload).expect("a number"), state);
                assert!(me.is_resuming || header.seq + 1 == me.machine.next_seq());
                (me.state, me.has_reset) = (state, true);
                self.tally.restored += u64::from(matches!(me.ask, Ask::Restore(_)));
            }
            Ask::Step(action) => {
                me.state = stepped(me.state, action);
                assert_eq!(
                    codec::read::<u64>(payload).expect("a number"),
                    me.state,
                    "its own reply"
                );
                assert!(me.is_resuming || header.seq + 1 == me.machine.next_seq());
                self.tally.stepped += 1;
                (me.steps_left, me.session_left) = (me.steps_left - 1, me.session_left - 1);
            }
            Ask::Snapshot => {
                let SnapshotReply { data, .. } =
                    codec::read(payload).expect("it is what was asked for");
                assert_eq!(data, me.state.to_le_bytes());
                me.saved.push(me.state);
            }
            Ask::Close => {
                // Each numbered request of the session was carried out, one of them perhaps without being seen.
                let CloseReply { steps } = codec::read(payload).expect("it is what was asked for");
                assert!((0..=1).contains(&(steps + 1 - me.machine.next_seq())));
                self.tally.closed += 1;
                me.has_reset = false;
            }
            Ask::Nothing => unreachable!("nothing was asked"),
        }
    }

    /// A call was not answered in time: asked again, or settled by a reset, or the client ends.
    fn doubt(&mut self, client: usize) {
        let now_ms = self.now_ms;
        let me = &mut self.clients[client];
        assert!(me.machine.is_in_doubt());
        let is_numbered = matches!(me.ask, Ask::Step(_) | Ask::Reset(_) | Ask::Restore(_));
        let step = Step { actions: vec![&[0; 8]] };
        if is_numbered {
            let again = me.machine.call(now_ms, Verb::Step, &step);
            assert_eq!(
                again,
                Err(ClientError::InDoubt),
                "{:?} {:?}: a step on a state that nobody knows",
                me.ask,
                me.machine
            );
        }
        match self.dice.below(4) {
            0 if is_numbered => {
                let seed = self.dice.bits();
                self.call(client, Ask::Reset(seed));
            }
            1 if is_numbered => self.call(client, Ask::Close),
            2 if self.dice.one_in(4) => self.crash(client),
            _ => {
                me.call += 1;
                me.machine.retry(now_ms).expect("it is in doubt");
            }
        }
    }

    fn crash(&mut self, client: usize) {
        self.tally.crashes += 1;
        self.leave(client);
    }

    /// The client goes and comes back as a new one.
    fn leave(&mut self, client: usize) {
        let seed = self.dice.bits();
        let me = &mut self.clients[client];
        me.machine = machine(seed, me.is_resuming);
        (me.call, me.has_reset, me.resumed) = (me.call + 1, false, 0);
        self.hold_lease(client);
    }
}
