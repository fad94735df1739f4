//! A server in a process of its own, and somebody who asks it things.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use swath_server::endpoint::Endpoint;
use swath_wire::codec;
use swath_wire::fault::Fault;
use swath_wire::header::{Header, Kind, Verb};
use swath_wire::hosted::ENV_ID;
use swath_wire::message::{AutoresetMode, Open, OpenReply, Reset, Seeds, SpecReply, Step};
use zenoh::query::{ConsolidationMode, Reply};
use zenoh::{Config, Session, Wait as _};

/// The environment variable with the lease that a client announces, milliseconds, where it is not the usual one.
pub(crate) const LEASE_MS: &str = "SWATH_TEST_LEASE_MS";

/// Longer than anything here takes.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// A server that is ready, and dies with this.
pub(crate) struct Running {
    child: Child,
    pub(crate) endpoint: String,
}

impl Running {
    pub(crate) fn start(flags: &[&str]) -> Self {
        Self::try_start(flags).expect("it starts")
    }

    /// The same; none if it ends instead.
    pub(crate) fn try_start(flags: &[&str]) -> Option<Self> {
        let mut flags = flags.to_vec();
        if !flags.contains(&"--listen") {
            flags.extend(["--listen", "tcp/127.0.0.1:0"]);
        }
        let mut child = command(&flags).stdout(Stdio::piped()).spawn().unwrap();
        let (said, ready) = channel();
        let mut lines = BufReader::new(child.stdout.take().unwrap());
        thread::spawn(move || {
            let mut line = String::new();
            lines.read_line(&mut line).unwrap();
            let _ = said.send(line);
        });
        let line = ready.recv_timeout(PATIENCE).expect("the server says that it is ready");
        let Some(endpoint) = line.split(' ').nth(2).map(str::to_owned) else {
            ended(&mut child);
            return None;
        };
        Some(Self { child, endpoint })
    }

    /// Resident memory, bytes; none where the system does not tell.
    pub(crate) fn memory_bytes(&self) -> Option<u64> {
        let status = fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? << 10)
    }

    /// The same, once it has given back what sessions left behind that have ended; if the test has the time, once the
    /// threads have ended, too, that served them.
    pub(crate) fn memory_at_rest_bytes(&self) -> Option<u64> {
        thread::sleep(Duration::from_secs(size(3, 15)));
        self.memory_bytes()
    }

    /// Stops it, or lets it go on, as `kill -STOP` and `kill -CONT` do.
    pub(crate) fn signal(&self, signal: &str) {
        send_signal(&self.child, signal);
    }

    /// Ends it as `kill -9` does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Ends it as a system does that shuts down.
    pub(crate) fn terminate(&mut self) -> ExitStatus {
        self.signal("-TERM");
        ended(&mut self.child)
    }
}

/// `long` if the environment variable `LONG` is set, as `make test-faults` does, or else `short`.
pub(crate) fn size(short: u64, long: u64) -> u64 {
    if std::env::var_os("LONG").is_some_and(|value| !value.is_empty()) { long } else { short }
}

/// Says what a test has measured; `make test-faults` collects it.
#[expect(clippy::print_stdout, reason = "what was measured is there to be read")]
pub(crate) fn measured(text: &str) {
    println!("measured: {text}");
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The exit status and the error stream of a server that does not start.
pub(crate) fn refusal(flags: &[&str]) -> (Option<i32>, String) {
    let mut child = command(flags).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let status = ended(&mut child);
    let mut text = String::new();
    child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    (status.code(), text)
}

fn command(flags: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_swath-server"));
    command.args(flags).env("SWATH_LOG", "error,zenoh=off").env_remove("RUST_LOG");
    command
}

pub(crate) fn send_signal(child: &Child, signal: &str) {
    let pid = child.id().to_string();
    assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
}

fn ended(child: &mut Child) -> ExitStatus {
    for _ in 0..PATIENCE.as_millis() / 20 {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    panic!("the server does not end");
}

/// A router of Zenoh's; ends with this.
pub(crate) struct Router {
    session: Session,
    pub(crate) endpoint: String,
}

impl Router {
    pub(crate) fn start() -> Self {
        let endpoint = Endpoint::parse("tcp/127.0.0.1:0").unwrap().with_port().unwrap().to_string();
        let config = json!({
            "mode": "router",
            "listen": { "endpoints": [endpoint], "exit_on_failure": true },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        });
        let config = Config::from_json5(&config.to_string()).unwrap();
        Self { session: zenoh::open(config).wait().unwrap(), endpoint }
    }
}

impl Drop for Router {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}

/// What makes a client known to a server that asks for certificates.
pub(crate) struct Papers<'a> {
    pub(crate) ca: &'a Path,
    pub(crate) own: Option<(&'a Path, &'a Path)>,
}

/// Somebody who asks a server; the session is closed with this.
pub(crate) struct Client {
    pub(crate) session: Session,
    pub(crate) server: String,
}

impl Client {
    pub(crate) fn new(endpoint: &str) -> Self {
        Self::connect(endpoint, None).unwrap()
    }

    pub(crate) fn connect(endpoint: &str, papers: Option<&Papers>) -> Result<Self, zenoh::Error> {
        Self::connect_by(endpoint, papers, false)
    }

    /// One by low latency, if the server of this one offers that.
    pub(crate) fn by_low_latency(&self) -> Option<Self> {
        let offers = self.session.liveliness().get("swath/v1/default/low-latency/*/*");
        let offer = offers.timeout(PATIENCE).wait().unwrap().into_iter().next()?;
        let port = offer.result().ok()?.key_expr().rsplit_once('/')?.1.to_owned();
        Self::connect_by(&format!("tcp/127.0.0.1:{port}"), None, true).ok()
    }

    fn connect_by(
        endpoint: &str,
        papers: Option<&Papers>,
        low_latency: bool,
    ) -> Result<Self, zenoh::Error> {
        let mut tls = json!({});
        if let Some(Papers { ca, own }) = papers {
            tls = json!({ "root_ca_certificate": ca });
            if let Some((certificate, key)) = own {
                tls["connect_certificate"] = json!(certificate);
                tls["connect_private_key"] = json!(key);
                tls["enable_mtls"] = Value::Bool(true);
            }
        }
        // What a client announces is how long a server waits for one that is frozen.
        let lease_ms = std::env::var(LEASE_MS).map_or(10_000, |text| text.parse().unwrap());
        let config = json!({
            "mode": "client",
            "connect": {
                "endpoints": [endpoint],
                "timeout_ms": 3000,
                "exit_on_failure": true,
                "retry": { "period_init_ms": 100, "period_max_ms": 500 },
            },
            "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
            "transport": {
                "link": { "tls": tls, "tx": { "lease": lease_ms } },
                "unicast": { "lowlatency": low_latency, "qos": { "enabled": !low_latency } },
            },
        });
        let session = zenoh::open(Config::from_json5(&config.to_string())?).wait()?;
        Ok(Self { session, server: "default".to_owned() })
    }

    /// Everything that is answered to a message at a key; a timeout is a failure, no answer is none.
    pub(crate) fn get(&self, key: &str, message: &[u8]) -> Vec<Vec<u8>> {
        self.get_within(PATIENCE, key, message)
    }

    fn get_within(&self, patience: Duration, key: &str, message: &[u8]) -> Vec<Vec<u8>> {
        let query = self.session.get(key).payload(message).timeout(patience);
        let replies = query.consolidation(ConsolidationMode::None).wait().unwrap();
        let bytes = |reply: Reply| match reply.result() {
            Ok(sample) => sample.payload().to_bytes().into_owned(),
            Err(error) => panic!("{error:?}"),
        };
        replies.into_iter().map(bytes).collect()
    }

    /// What the server answers, if it does.
    pub(crate) fn ask(&self, verb: Verb, message: &[u8]) -> Option<Vec<u8>> {
        self.ask_within(PATIENCE, verb, message)
    }

    pub(crate) fn ask_within(
        &self,
        patience: Duration,
        verb: Verb,
        message: &[u8],
    ) -> Option<Vec<u8>> {
        let key = format!("swath/v1/{}/rpc/{}", self.server, verb.name());
        let mut replies = self.get_within(patience, &key, message);
        assert!(replies.len() < 2, "one server, one answer");
        replies.pop()
    }

    /// The fault that the server answers.
    pub(crate) fn fault(&self, verb: Verb, message: &[u8]) -> Fault {
        fault_of(&self.ask(verb, message).expect("the server answers"))
    }

    pub(crate) fn spec(&self) -> Option<SpecReply> {
        let message = codec::write_empty(&header(Verb::Spec));
        self.ask(Verb::Spec, &message).map(|reply| codec::read(payload(&reply)).unwrap())
    }

    pub(crate) fn open(&self, open: &Open) -> Result<Opened, Fault> {
        let message = codec::write(&header(Verb::Open), open).unwrap();
        let reply = self.ask(Verb::Open, &message).expect("the server answers");
        let (head, payload) = Header::read(&reply).unwrap();
        if head.kind == Kind::Fault {
            return Err(codec::read_fault(payload).unwrap());
        }
        let reply: OpenReply = codec::read(payload).unwrap();
        Ok(Opened { boot_id: head.boot_id, reply })
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.session.close().wait();
    }
}

/// A session.
pub(crate) struct Opened {
    pub(crate) boot_id: u128,
    pub(crate) reply: OpenReply,
}

impl Opened {
    pub(crate) fn header(&self, verb: Verb, seq: u64) -> Header {
        Header { boot_id: self.boot_id, sid: self.reply.sid, seq, kind: Kind::Request(verb) }
    }

    pub(crate) fn reset(&self, seq: u64, seed: u64) -> Vec<u8> {
        let reset = Reset { seeds: Seeds::One(seed), mask: &[], weeds: Vec::new() };
        codec::write(&self.header(Verb::Reset, seq), &reset).unwrap()
    }

    pub(crate) fn step(&self, seq: u64, actions: &[f32]) -> Vec<u8> {
        let actions: Vec<u8> = actions.iter().flat_map(|action| action.to_le_bytes()).collect();
        codec::write(&self.header(Verb::Step, seq), &Step { actions: vec![&actions] }).unwrap()
    }

    pub(crate) fn close(&self) -> Vec<u8> {
        codec::write_empty(&self.header(Verb::Close, 0))
    }
}

/// The header of a request that no session is needed for.
pub(crate) fn header(verb: Verb) -> Header {
    Header { boot_id: 0, sid: 0, seq: 0, kind: Kind::Request(verb) }
}

/// A batch of short episodes.
pub(crate) fn batch(nonce: u128, num_envs: u32) -> Open<'static> {
    Open {
        nonce,
        env_id: ENV_ID.to_owned(),
        config: "[episode]\nbudget = 0.02\n".to_owned(),
        num_envs,
        autoreset: AutoresetMode::NextStep,
        hash_every: 1,
        infos: true,
        snapshot: None,
        percept: false,
        client: "test".to_owned(),
    }
}

pub(crate) fn payload(message: &[u8]) -> &[u8] {
    Header::read(message).unwrap().1
}

pub(crate) fn fault_of(message: &[u8]) -> Fault {
    let (header, payload) = Header::read(message).unwrap();
    assert_eq!(header.kind, Kind::Fault);
    codec::read_fault(payload).unwrap()
}
