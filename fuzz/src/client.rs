//! A client with a session, fed with answers.

use std::sync::{Arc, LazyLock};

use bytes::Bytes;
use swath_wire::client::{ClientOptions, ClientOutput};
use swath_wire::codec;
use swath_wire::header::{HEADER_BYTES, Header, Kind, Verb};
use swath_wire::message::{Open, Reset, Restore, Seeds, Snapshot, Step};
use swath_wire::resume::{ResumeOptions, ResumingSession};

use crate::golden;
use crate::records::Records;

/// An answer.
pub const MESSAGE: u8 = 0;
/// The payload of an answer to the call in flight.
pub const PAYLOAD: u8 = 1;
/// The payload of a fault in answer to the call in flight.
pub const FAULT: u8 = 2;
/// No answer.
pub const NOTHING: u8 = 3;
/// No answer in time.
pub const TIMEOUT: u8 = 4;
/// Another call, by the first of the bytes.
pub const CALL: u8 = 5;
/// Time passes.
pub const LATER: u8 = 6;
/// Whoever waits has enough.
pub const ABANDON: u8 = 7;

static OPEN: LazyLock<Vec<u8>> = LazyLock::new(|| golden::message("open"));

struct Bench {
    client: ResumingSession,
    now_ms: u64,
    sent: Arc<[u8]>,
}

/// Feeds a client, whose session is that of the golden `open_reply`, and may be resumed or not.
///
/// # Panics
///
/// If it sends what is no request, or is busy with nothing.
pub fn feed(data: &[u8], is_resuming: bool) {
    let often = ResumeOptions { hash_every: 1, snapshot_every: 2, max_bytes: 1 << 16 };
    let mut bench = Bench::new(is_resuming.then_some(often));
    for (what, bytes) in Records(data) {
        bench.happen(what % 8, bytes);
        bench.poll();
    }
}

impl Bench {
    fn new(resume: Option<ResumeOptions>) -> Self {
        let client = ResumingSession::new(ClientOptions::default(), resume);
        let mut bench = Self { client, now_ms: 0, sent: Arc::from([]) };
        let open: Open = codec::read(&OPEN[HEADER_BYTES..]).expect("a golden message can be read");
        bench.client.open(0, &open).expect("a new client has no session");
        bench.poll();
        bench.client.on_reply(0, golden::message("open_reply").into());
        bench.poll();
        if resume.is_some() {
            // It begins with a snapshot.
            bench.happen(PAYLOAD, &golden::message("snapshot_reply")[HEADER_BYTES..]);
            bench.poll();
        }
        assert!(bench.client.lid().is_some(), "the golden reply opens a session");
        bench
    }

    fn happen(&mut self, what: u8, bytes: &[u8]) {
        let Self { client, now_ms, sent } = self;
        let answer = |kind: fn(Verb) -> Kind| {
            let (header, _) = Header::read(sent).expect("a client sends what can be read");
            let Kind::Request(verb) = header.kind else { unreachable!("a client asks") };
            let header = Header { kind: kind(verb), ..header };
            header.message(bytes.len(), |payload| payload.extend(bytes))
        };
        match what {
            MESSAGE => client.on_reply(*now_ms, Bytes::copy_from_slice(bytes)),
            PAYLOAD => client.on_reply(*now_ms, answer(Kind::Reply).into()),
            FAULT => client.on_reply(*now_ms, answer(|_| Kind::Fault).into()),
            NOTHING => client.on_nothing(*now_ms),
            TIMEOUT => client.on_timeout(*now_ms),
            CALL => self.call(bytes),
            LATER => *now_ms += bytes.iter().map(|&byte| 64 * u64::from(byte)).sum::<u64>(),
            _ => drop(client.abandon(*now_ms)),
        }
    }

    /// A call that is refused is none.
    fn call(&mut self, bytes: &[u8]) {
        let Self { client, now_ms, .. } = self;
        let Some((&which, bytes)) = bytes.split_first() else { return };
        let _ = match which % 8 {
            0 | 1 => client.call(*now_ms, Verb::Step, &Step { actions: vec![bytes] }),
            2 => {
                let reset = Reset { seeds: Seeds::Each(bytes), mask: bytes, weeds: Vec::new() };
                client.call(*now_ms, Verb::Reset, &reset)
            }
            3 => client.call(*now_ms, Verb::Snapshot, &Snapshot { env: None }),
            4 => client.call(*now_ms, Verb::Restore, &Restore { env: Some(0), data: bytes }),
            5 => client.call_empty(*now_ms, Verb::Close),
            6 => client.call_empty(*now_ms, Verb::Stats),
            _ => client.retry(*now_ms),
        };
    }

    fn poll(&mut self) {
        // A call is sent, waits, or has ended, and then there is no other.
        for _ in 0..16 {
            match self.client.poll(self.now_ms) {
                ClientOutput::Send { message, .. } => {
                    let (header, _) = Header::read(&message).expect("it can be read");
                    assert!(matches!(header.kind, Kind::Request(_)), "a client asks");
                    self.sent = message;
                }
                ClientOutput::Wait { until_ms } => {
                    assert!(until_ms > self.now_ms, "it waits for what is to come");
                    return;
                }
                ClientOutput::Done(_) => {}
                ClientOutput::Idle => return,
            }
        }
        panic!("a client comes to rest");
    }
}
