//! A client as a program has it: the state machine of `swath-wire` over a Zenoh session of its own, and beside it a batch
//! in this process that every reply is held against.

use std::time::Duration;

use swath_server::clock::Clock;
use swath_wire::client::{ClientError, ClientOptions, ClientOutput};
use swath_wire::codec;
use swath_wire::header::{Header, Verb};
use swath_wire::hosted::Hosted;
use swath_wire::message::{CloseReply, Limits, Open, Reset, Seeds, Step};
use swath_wire::resume::{ResumeOptions, ResumingSession};
use zenoh::Wait as _;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::ConsolidationMode;

use crate::common::{Client, batch, header};

/// A client with an open session.
pub(crate) struct Agent {
    client: Client,
    /// By which steps go, until one is not answered.
    low_latency: Option<Client>,
    clock: Clock,
    machine: ResumingSession,
    lease: Option<(u128, LivelinessToken)>,
    local: Hosted,
    rows: u16,
    /// How long the longest call took, milliseconds.
    pub(crate) longest_ms: u64,
    /// Steps whose replies came.
    pub(crate) steps: u64,
}

impl Agent {
    /// Opens a session of `rows` environments at an endpoint.
    pub(crate) fn open(
        endpoint: &str,
        nonce: u128,
        rows: u16,
        options: ClientOptions,
        resume: Option<ResumeOptions>,
    ) -> Result<Self, ClientError> {
        Self::try_open(endpoint, nonce, rows, options, resume).expect("somebody listens there")
    }

    /// The same; none where nobody listens.
    pub(crate) fn try_open(
        endpoint: &str,
        nonce: u128,
        rows: u16,
        options: ClientOptions,
        resume: Option<ResumeOptions>,
    ) -> Option<Result<Self, ClientError>> {
        let hash_every = resume.map_or(16, |resume| resume.hash_every);
        let open = Open { hash_every, ..batch(nonce, rows.into()) };
        let client = Client::connect(endpoint, None).ok()?;
        let mut agent = Self {
            low_latency: client.by_low_latency(),
            client,
            clock: Clock::start(),
            machine: ResumingSession::new(options, resume),
            lease: None,
            local: Hosted::open(&open, &Limits::default(), 1).unwrap(),
            rows,
            longest_ms: 0,
            steps: 0,
        };
        let now_ms = agent.clock.now_ms();
        let opened = agent.machine.open(now_ms, &open).and_then(|()| agent.finish());
        Some(opened.map(|_| agent))
    }

    /// Begins episodes.
    pub(crate) fn reset(&mut self, seed: u64) -> Result<(), ClientError> {
        let reset = Reset { seeds: Seeds::One(seed), mask: &[], weeds: Vec::new() };
        self.machine.call(self.clock.now_ms(), Verb::Reset, &reset)?;
        let reply = self.finish()?;
        self.compare(&codec::write(&header(Verb::Reset), &reset).unwrap(), &reply);
        Ok(())
    }

    /// The next step, with actions that depend on its number and on the row.
    pub(crate) fn step(&mut self) -> Result<(), ClientError> {
        let number = self.steps % 1_000;
        let action = |row: u16| ((number * 7 + u64::from(row) * 3) % 21) as f32 / 10.0 - 1.0;
        let actions: Vec<u8> = (0..self.rows).flat_map(|row| action(row).to_le_bytes()).collect();
        let step = Step { actions: vec![&actions] };
        self.machine.call(self.clock.now_ms(), Verb::Step, &step)?;
        let reply = self.finish()?;
        self.steps += 1;
        self.compare(&codec::write(&header(Verb::Step), &step).unwrap(), &reply);
        Ok(())
    }

    /// Ends the session; how many steps its environments have made together.
    pub(crate) fn close(mut self) -> Result<u64, ClientError> {
        self.machine.call_empty(self.clock.now_ms(), Verb::Close)?;
        let reply = self.finish()?;
        Ok(codec::read::<CloseReply>(Header::read(&reply).unwrap().1).unwrap().steps)
    }

    /// How often the session was resumed.
    pub(crate) fn resumed(&self) -> u64 {
        self.machine.resumed()
    }

    /// A reply has to be the one of the batch at hand, to the byte.
    fn compare(&mut self, request: &[u8], reply: &[u8]) {
        let (asked, payload) = Header::read(request).unwrap();
        let (header, got) = Header::read(reply).unwrap();
        let expected = self.local.answer(&Header { kind: asked.kind, ..header }, payload).unwrap();
        assert!(got == Header::read(&expected).unwrap().1, "{:?} {}", asked.kind, self.steps);
    }

    /// Does what the machine says until the call has ended.
    fn finish(&mut self) -> Result<Vec<u8>, ClientError> {
        let began_ms = self.clock.now_ms();
        let mut result = self.move_messages();
        // What was not answered in time is asked once more, where nothing may be lost.
        while let Err(ClientError::Timeout { .. }) = result
            && self.machine.is_resuming()
        {
            self.machine.retry(self.clock.now_ms())?;
            result = self.move_messages();
        }
        self.longest_ms = self.longest_ms.max(self.clock.now_ms() - began_ms);
        self.hold_lease();
        result
    }

    fn move_messages(&mut self) -> Result<Vec<u8>, ClientError> {
        loop {
            match self.machine.poll(self.clock.now_ms()) {
                ClientOutput::Send { verb, message, timeout_ms } => {
                    self.send(verb, &message, timeout_ms);
                }
                ClientOutput::Wait { until_ms } => {
                    let wait_ms = until_ms.saturating_sub(self.clock.now_ms());
                    std::thread::sleep(Duration::from_millis(wait_ms));
                }
                ClientOutput::Done(result) => return result.map(Vec::from),
                ClientOutput::Idle => unreachable!("a call is in flight"),
            }
        }
    }

    fn send(&mut self, verb: Verb, message: &[u8], timeout_ms: u64) {
        let key = format!("swath/v1/default/rpc/{}", verb.name());
        let low_latency = self.low_latency.as_ref().filter(|_| verb == Verb::Step);
        let query = low_latency.unwrap_or(&self.client).session.get(key).payload(message);
        let query = query.consolidation(ConsolidationMode::None);
        let mut is_silent = true;
        if let Ok(replies) = query.timeout(Duration::from_millis(timeout_ms)).wait() {
            for reply in replies {
                is_silent = false;
                let now_ms = self.clock.now_ms();
                if let Ok(sample) = reply.result() {
                    let message = sample.payload().to_bytes().into_owned();
                    self.machine.on_reply(now_ms, message.into());
                } else {
                    self.machine.on_timeout(now_ms);
                    self.low_latency = None;
                }
            }
        }
        if is_silent {
            self.machine.on_nothing(self.clock.now_ms());
            self.low_latency = None;
        }
    }

    /// Shows the server that somebody is there.
    fn hold_lease(&mut self) {
        let lid = self.machine.lid();
        if lid == self.lease.as_ref().map(|lease| lease.0) {
            return;
        }
        self.lease = lid.map(|lid| {
            let key = format!("swath/v1/default/lease/{lid:032x}");
            (lid, self.client.session.liveliness().declare_token(key).wait().unwrap())
        });
    }
}
