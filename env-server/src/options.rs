//! What an operator may set.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Parser;
use serde::Deserialize;
use swath_wire::message::Limits;
use swath_wire::room::Bounds;

use crate::access::{Access, AccessError, Wish};
use crate::endpoint::Endpoint;
use crate::stall;

/// Serves swath's environments over Zenoh.
#[derive(Debug, Parser)]
#[command(
    name = "swath-server",
    version,
    allow_negative_numbers = true,
    after_help = "The environment variable SWATH_LOG says what is logged [default: info,zenoh=off]."
)]
pub struct Arguments {
    /// Where to listen; port 0 for one that is free [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT")]
    pub listen: Option<String>,
    /// Zenoh routers to connect to
    #[arg(long, value_name = "ENDPOINT", num_args = 1..)]
    pub connect: Vec<String>,
    /// The server's name, part of its keys: lower-case letters, digits and dashes [default: default]
    #[arg(long)]
    pub name: Option<String>,
    /// A TOML file with the same settings, `max_sessions` for `--max-sessions`; flags count for more
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Threads that step environments [default: one a core]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub workers: Option<usize>,
    /// Most sessions at a time [default: 64]
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub max_sessions: Option<u32>,
    /// Most environments of a session [default: 16384]
    #[arg(long, value_name = "N", value_parser = whole::<u32>)]
    pub max_envs: Option<u32>,
    /// Most cells of the pastures of a session, 1 m by 1 m in whole squares of 8 by 8; counted twice where percepts are told
    /// [default: 268435456]
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub max_cells: Option<u64>,
    /// Most weeds of a session [default: 4194304]
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub max_weeds: Option<u64>,
    /// Most cells of the pastures of all sessions together, counted the same [default: 1073741824]
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub max_all_cells: Option<u64>,
    /// Most weeds of all sessions together [default: 16777216]
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub max_all_weeds: Option<u64>,
    /// Largest message, bytes [default: 67108864]
    #[arg(long, value_name = "BYTES", value_parser = whole::<u32>)]
    pub max_msg: Option<u32>,
    /// Most bytes of requests that wait to be looked at, and most of replies that wait to be sent [default: 268435456]
    #[arg(long, value_name = "BYTES", value_parser = whole::<usize>)]
    pub max_waiting: Option<usize>,
    /// Most bytes of replies that are kept in case they are asked for again [default: 1073741824]
    #[arg(long, value_name = "BYTES", value_parser = whole::<u64>)]
    pub max_cached: Option<u64>,
    /// How long until clients take a frozen server for gone, milliseconds; each client announces its own [default: 10000]
    #[arg(long, value_name = "MS", value_parser = whole::<u32>)]
    pub lease_ms: Option<u32>,
    /// How long a session outlives its client, milliseconds [default: 30000]
    #[arg(long, value_name = "MS", value_parser = whole::<u32>)]
    pub grace_ms: Option<u32>,
    /// How long a session outlives its last request, milliseconds [default: 600000]
    #[arg(long, value_name = "MS", value_parser = whole::<u32>)]
    pub idle_ms: Option<u32>,
    /// Lets clients have the state as bytes, in which weeds stand that nobody has seen
    #[arg(long)]
    pub allow_snapshot: bool,
    /// Whether steps of few environments, of at most 32 KiB, are answered sooner, by Zenoh's low-latency transport, at
    /// another port: only where this listens at tcp/ and a number of the loopback, without `--connect` [default: on there]
    #[arg(long, value_name = "on|off", num_args = 0..=1, default_missing_value = "on", value_parser = switch)]
    pub low_latency: Option<bool>,
    /// The certificate of the authority that clients and servers are signed by, PEM
    #[arg(long, value_name = "FILE")]
    pub tls_ca: Option<PathBuf>,
    /// The server's certificate, PEM
    #[arg(long, value_name = "FILE")]
    pub tls_certificate: Option<PathBuf>,
    /// The private key of the server's certificate, PEM
    #[arg(long, value_name = "FILE")]
    pub tls_key: Option<PathBuf>,
    /// The common names in the certificates of those who may use the server
    #[arg(long, value_name = "NAME", num_args = 1..)]
    pub allow_cn: Vec<String>,
    /// Listens where anybody may connect
    #[arg(long)]
    pub insecure: bool,
}

/// The settings of a file; what is not there is as by default.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct File {
    listen: Option<String>,
    connect: Vec<String>,
    name: Option<String>,
    workers: Option<usize>,
    max_sessions: Option<u32>,
    max_envs: Option<u32>,
    max_cells: Option<u64>,
    max_weeds: Option<u64>,
    max_all_cells: Option<u64>,
    max_all_weeds: Option<u64>,
    max_msg: Option<u32>,
    max_waiting: Option<usize>,
    max_cached: Option<u64>,
    lease_ms: Option<u32>,
    grace_ms: Option<u32>,
    idle_ms: Option<u32>,
    allow_snapshot: bool,
    low_latency: Option<bool>,
    tls_ca: Option<PathBuf>,
    tls_certificate: Option<PathBuf>,
    tls_key: Option<PathBuf>,
    allow_cn: Vec<String>,
    insecure: bool,
}

/// Settings that were checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Where to listen.
    pub listen: Endpoint,
    /// Routers to connect to.
    pub connect: Vec<Endpoint>,
    /// The server's name.
    pub name: String,
    /// Threads that step environments.
    pub workers: usize,
    /// How much is taken on.
    pub limits: Limits,
    /// How large the environments of a session may be.
    pub bounds: Bounds,
    /// How large those of all sessions together may be.
    pub all_bounds: Bounds,
    /// Most bytes of requests that wait to be looked at, and most of replies that wait to be sent.
    pub max_waiting: usize,
    /// Most bytes of replies that are kept.
    pub max_cached: u64,
    /// Whether clients may have the state as bytes.
    pub allow_snapshot: bool,
    /// Whether clients may have Zenoh's low-latency transport.
    pub low_latency: bool,
    /// Who may reach the server.
    pub access: Access,
}

/// A setting that cannot be used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum OptionsError {
    /// A value outside its range.
    #[error("`{field}` must be {expected}, got {value}")]
    Value {
        /// The setting.
        field: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        value: String,
    },
    /// A file that cannot be read.
    #[error("`{file}`: {text}")]
    File {
        /// Its name.
        file: String,
        /// Why.
        text: String,
    },
    /// The wrong ones could reach the server.
    #[error(transparent)]
    Access(#[from] AccessError),
}

impl Arguments {
    /// The settings of flags and file together.
    ///
    /// # Errors
    ///
    /// [`OptionsError`] naming the first one that cannot be used.
    pub fn check(self) -> Result<Options, OptionsError> {
        let file = self.config.as_deref().map_or_else(|| Ok(File::default()), File::read)?;
        let usual = Limits::default();
        let (of_session, of_all) = (Bounds::OF_SESSION, Bounds::OF_ALL);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let either = |flags: Vec<String>, file| if flags.is_empty() { file } else { flags };
        let listen = self.listen.or(file.listen);
        let listen = endpoint("listen", listen.as_deref().unwrap_or("tcp/127.0.0.1:7447"))?;
        let connect = either(self.connect, file.connect);
        let connect: Vec<Endpoint> =
            connect.iter().map(|text| endpoint("connect", text)).collect::<Result<_, _>>()?;
        let wish = Wish {
            ca: self.tls_ca.or(file.tls_ca),
            certificate: self.tls_certificate.or(file.tls_certificate),
            key: self.tls_key.or(file.tls_key),
            allow_cn: either(self.allow_cn, file.allow_cn),
            insecure: self.insecure || file.insecure,
        };
        let endpoints: Vec<&Endpoint> = [&listen].into_iter().chain(&connect).collect();
        let access = wish.check(&endpoints)?;
        let options = Options {
            listen,
            connect,
            name: self.name.or(file.name).unwrap_or("default".to_owned()),
            workers: self.workers.or(file.workers).unwrap_or(cores),
            limits: Limits {
                max_msg: self.max_msg.or(file.max_msg).unwrap_or(usual.max_msg),
                max_sessions: self.max_sessions.or(file.max_sessions).unwrap_or(usual.max_sessions),
                max_envs: self.max_envs.or(file.max_envs).unwrap_or(usual.max_envs),
                lease_ms: self.lease_ms.or(file.lease_ms).unwrap_or(usual.lease_ms),
                grace_ms: self.grace_ms.or(file.grace_ms).unwrap_or(usual.grace_ms),
                idle_ms: self.idle_ms.or(file.idle_ms).unwrap_or(usual.idle_ms),
            },
            bounds: Bounds {
                max_cells: self.max_cells.or(file.max_cells).unwrap_or(of_session.max_cells),
                max_weeds: self.max_weeds.or(file.max_weeds).unwrap_or(of_session.max_weeds),
            },
            all_bounds: Bounds {
                max_cells: self.max_all_cells.or(file.max_all_cells).unwrap_or(of_all.max_cells),
                max_weeds: self.max_all_weeds.or(file.max_all_weeds).unwrap_or(of_all.max_weeds),
            },
            max_waiting: self.max_waiting.or(file.max_waiting).unwrap_or(256 << 20),
            max_cached: self.max_cached.or(file.max_cached).unwrap_or(1 << 30),
            allow_snapshot: self.allow_snapshot || file.allow_snapshot,
            low_latency: false,
            access,
        };
        options.with_low_latency(self.low_latency.or(file.low_latency))?.check()
    }
}

/// What numbers have to be, flags and those of the file.
const WHOLE: &str = "a whole number from 0 on, and not too large";

/// A number of the command line.
fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("it must be {WHOLE}"))
}

/// A switch of the command line.
fn switch(text: &str) -> Result<bool, &'static str> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("it must be on or off"),
    }
}

impl File {
    fn read(path: &Path) -> Result<Self, OptionsError> {
        let error = |text: String| OptionsError::File { file: path.display().to_string(), text };
        let text = std::fs::read_to_string(path).map_err(|found| error(found.to_string()))?;
        toml::from_str(&text).map_err(|found: toml::de::Error| {
            let start = found.span().map_or(0, |span| span.start);
            let line = 1 + text[..start].matches('\n').count();
            let written = text.lines().nth(line - 1).unwrap_or_default().trim();
            let mut why = found.message().lines().next().unwrap_or_default().to_owned();
            for number in ["u32", "u64", "usize"] {
                why = why.replace(&format!("expected {number}"), &format!("expected {WHOLE}"));
            }
            let why = why.replace("expected a sequence", "expected a list of strings in brackets");
            error(format!("line {line}, {written}: {why}"))
        })
    }
}

fn endpoint(field: &'static str, text: &str) -> Result<Endpoint, OptionsError> {
    Endpoint::parse(text).map_err(|expected| OptionsError::Value {
        field,
        expected: expected.to_string(),
        value: text.to_owned(),
    })
}

impl Options {
    /// With or without low latency, as it is wished for; else with it where nothing is in its way.
    fn with_low_latency(self, wish: Option<bool>) -> Result<Self, OptionsError> {
        let obstacle = [
            (
                self.listen.is_tls() || !self.listen.is_loopback(),
                "off where `listen` is not tcp/ and a number of the loopback",
            ),
            (!self.connect.is_empty(), "off with `connect`, since routers do not have it"),
            (
                !stall::can_be_watched(),
                "off where there is no /proc as Linux has it, since nobody sees which client reads nothing",
            ),
        ];
        let obstacle = obstacle.iter().find(|one| one.0);
        if let (Some(true), Some((_, expected))) = (wish, obstacle) {
            let expected = (*expected).to_owned();
            return Err(OptionsError::Value { field: "low_latency", expected, value: "on".into() });
        }
        Ok(Self { low_latency: wish.unwrap_or(obstacle.is_none()), ..self })
    }

    fn check(self) -> Result<Self, OptionsError> {
        let is_plain =
            |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
        if !(1..=64).contains(&self.name.len()) || !self.name.bytes().all(is_plain) {
            let expected = "1 to 64 lower-case letters, digits and dashes".to_owned();
            let value = format!("{:?}", self.name);
            return Err(OptionsError::Value { field: "name", expected, value });
        }
        let limits = &self.limits;
        for (field, value, least, most) in [
            ("workers", self.workers as u64, 1, 1024),
            ("max_sessions", limits.max_sessions.into(), 1, 65_536),
            ("max_envs", limits.max_envs.into(), 1, 1_000_000),
            ("max_cells", self.bounds.max_cells, 1, 1 << 40),
            ("max_weeds", self.bounds.max_weeds, 1, 1 << 40),
            ("max_all_cells", self.all_bounds.max_cells, 1, 1 << 40),
            ("max_all_weeds", self.all_bounds.max_weeds, 1, 1 << 40),
            ("max_msg", limits.max_msg.into(), 4096, 64 << 20),
            ("max_waiting", self.max_waiting as u64, limits.max_msg.into(), 1 << 40),
            ("max_cached", self.max_cached, 4096, 1 << 40),
            ("lease_ms", limits.lease_ms.into(), 100, 3_600_000),
            ("grace_ms", limits.grace_ms.into(), 100, 86_400_000),
            // It cannot be switched off: sessions whose clients hang would fill the server.
            ("idle_ms", limits.idle_ms.into(), 1000, 86_400_000),
        ] {
            if !(least..=most).contains(&value) {
                let expected = format!("from {least} to {most}");
                return Err(OptionsError::Value { field, expected, value: value.to_string() });
            }
        }
        if let Some(tls) = &self.access.tls {
            for (field, file, content) in [
                ("tls_ca", &tls.ca, "CERTIFICATE"),
                ("tls_certificate", &tls.certificate, "CERTIFICATE"),
                ("tls_key", &tls.key, "PRIVATE KEY"),
            ] {
                let found = std::fs::read(file).map(|bytes| {
                    let text = String::from_utf8_lossy(&bytes);
                    // Keys are called after their kind too, as in `BEGIN EC PRIVATE KEY`.
                    text.lines().any(|line| {
                        line.starts_with("-----BEGIN ") && line.contains(&format!("{content}-----"))
                    })
                });
                let trouble = match found {
                    Ok(true) => continue,
                    Ok(false) => format!("there is no {content} in it"),
                    Err(error) => error.to_string(),
                };
                return Err(OptionsError::Value {
                    field,
                    expected: "a file in PEM".to_owned(),
                    value: format!("{}: {trouble}", file.display()),
                });
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    fn options(flags: &[&str]) -> Result<Options, String> {
        let flags = ["swath-server"].iter().chain(flags);
        Arguments::try_parse_from(flags).unwrap().check().map_err(|error| error.to_string())
    }

    #[test]
    fn the_example_of_a_file_has_every_setting_at_its_default() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/server.toml");
        assert_eq!(options(&["--config", path]), options(&[]));
        let text = std::fs::read_to_string(path).unwrap();
        for flag in Arguments::command().get_arguments().map(|flag| flag.get_id().as_str()) {
            let is_there = text.lines().any(|line| {
                line.trim_start_matches("# ").split_once(" = ").is_some_and(|set| set.0 == flag)
            });
            assert!(is_there || flag == "config", "{flag}");
        }
    }

    #[test]
    fn low_latency_is_as_it_is_wished_for_and_else_on_where_only_this_machine_can_connect() {
        let folder = std::env::temp_dir().join(format!("swath-latency-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("server.toml");
        let path = file.display().to_string();
        let has = |flags: &[&str], in_file: &str| {
            std::fs::write(&file, in_file).unwrap();
            let flags = [&["--config", &path], flags].concat();
            options(&flags).unwrap().low_latency
        };
        let can = stall::can_be_watched();
        for (flags, in_file, expected) in [
            (&[][..], "", can),
            (&["--listen", "tcp/[::1]:7447"], "", can),
            (&["--listen", "tcp/localhost:7447", "--insecure"], "", false),
            (&["--listen", "tcp/0.0.0.0:7447", "--insecure"], "", false),
            (&["--connect", "tcp/127.0.0.1:7448"], "", false),
            (&["--low-latency=off"], "", false),
            (&["--low-latency", "off"], "low_latency = true", false),
            (&[], "low_latency = false", false),
            (&["--low-latency"], "low_latency = false", true),
            (&["--low-latency=on", "--listen", "tcp/127.0.0.2:1"], "", true),
        ] {
            if can || !expected {
                assert_eq!(has(flags, in_file), expected, "{flags:?} {in_file}");
            }
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_setting_that_cannot_be_used_is_named() {
        for (flags, text) in [
            (
                &["--name", "A b"][..],
                "`name` must be 1 to 64 lower-case letters, digits and dashes, got \"A b\"",
            ),
            (&["--workers", "0"], "`workers` must be from 1 to 1024, got 0"),
            (&["--grace-ms", "3"], "`grace_ms` must be from 100 to 86400000, got 3"),
            (&["--idle-ms", "0"], "`idle_ms` must be from 1000 to 86400000, got 0"),
            (&["--max-all-cells", "0"], "`max_all_cells` must be from 1 to 1099511627776, got 0"),
            (&["--max-msg", "12"], "`max_msg` must be from 4096 to 67108864, got 12"),
            (
                &["--low-latency", "--connect", "tcp/127.0.0.1:7447"],
                "`low_latency` must be off with `connect`, since routers do not have it, got on",
            ),
            (&["--listen", "7447"], "`listen` must be tcp/HOST:PORT or tls/HOST:PORT, got 7447"),
        ] {
            assert_eq!(options(flags), Err(text.to_owned()));
        }
        let missing = options(&["--config", "no/such/file.toml"]).unwrap_err();
        assert!(missing.starts_with("`no/such/file.toml`: "), "{missing}");
    }

    #[test]
    fn flags_count_for_more_than_the_file_and_unknown_keys_are_refused() {
        let folder = std::env::temp_dir().join(format!("swath-server-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("server.toml");
        let path = file.display().to_string();
        std::fs::write(
            &file,
            "name = 'field'\nmax_sessions = 3\ngrace_ms = 500\nmax_all_weeds = 7",
        )
        .unwrap();
        let read = options(&["--config", &path, "--max-sessions", "4"]).unwrap();
        assert_eq!((read.name.as_str(), read.limits.max_sessions), ("field", 4));
        assert_eq!(read.all_bounds, Bounds { max_weeds: 7, ..Bounds::OF_ALL });
        assert_eq!((read.limits.grace_ms, read.limits.max_envs), (500, 16_384));
        std::fs::write(&file, "listen = 'tcp/0.0.0.0:7447'").unwrap();
        assert!(options(&["--config", &path]).unwrap_err().contains("missing: tls/"));
        std::fs::write(&file, "\n\nmax_session = 3").unwrap();
        let refused = options(&["--config", &path]).unwrap_err();
        assert!(
            refused.contains("line 3, max_session = 3: unknown field `max_session`"),
            "{refused}"
        );
        std::fs::write(&file, "name = 'field'\n\nworkers = 'two'").unwrap();
        let refused = options(&["--config", &path]).unwrap_err();
        assert!(
            refused.ends_with(
                ": line 3, workers = 'two': invalid type: string \"two\", expected a whole number from 0 on, and not too large"
            ),
            "{refused}"
        );
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
