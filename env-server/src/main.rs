//! `swath-server`: swath's environments over Zenoh.

use std::io::{IsTerminal as _, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser as _;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use swath_server::clock::Clock;
use swath_server::options::Arguments;
use swath_server::server::Server;
use swath_server::settings::{THREADS, THREADS_VARIABLE};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// What is logged: where that is said, and what if it is not.
const LOG_VARIABLE: &str = "SWATH_LOG";
const LOG: &str = "info,zenoh=off";
/// After so long, another signal to end is another wish.
const AGAIN: Duration = Duration::from_secs(1);

fn main() -> ExitCode {
    if std::env::var_os(THREADS_VARIABLE).is_none() {
        #[expect(unsafe_code, reason = "Zenoh takes its threads from the environment alone")]
        // SAFETY: there is no other thread yet that could read the environment meanwhile.
        unsafe {
            std::env::set_var(THREADS_VARIABLE, THREADS);
        }
    }
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if error.use_stderr() => {
            let text = error.to_string();
            let line = text.lines().next().unwrap_or_default();
            return refuse(line.trim_start_matches("error: "));
        }
        Err(help) => help.exit(),
    };
    let wish = std::env::var_os(LOG_VARIABLE).unwrap_or_else(|| LOG.into());
    // A word alone would be a part of the program, of which everything is logged, and nothing of the others.
    let is_level = |part: &str| part.contains(['=', '[']) || part.parse::<LevelFilter>().is_ok();
    let checked = wish.to_str().filter(|wish| wish.split(',').all(is_level));
    let Some(filter) = checked.and_then(|wish| EnvFilter::try_new(wish).ok()) else {
        return refuse(&format!(
            "`{LOG_VARIABLE}` must be filters such as `{LOG}`, got `{}`",
            wish.display()
        ));
    };
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr)
        .init();
    // A panic of an environment is caught and answered; what it was stands in the log.
    std::panic::set_hook(Box::new(|panic| tracing::error!(%panic, "a panic")));
    serve(arguments).map_or_else(|text| refuse(&text), |()| ExitCode::SUCCESS)
}

fn refuse(text: &str) -> ExitCode {
    // Whoever has closed the error stream wants to hear nothing.
    let _ = writeln!(std::io::stderr(), "swath-server: {text}");
    ExitCode::from(2)
}

/// Every client has a connection or two: as many as the system lets the process have.
fn raise_most_connections() {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current != maximum
        && setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }).is_err()
    {
        tracing::debug!(?current, ?maximum, "the limit of open files stays");
    }
}

fn serve(arguments: Arguments) -> Result<(), String> {
    raise_most_connections();
    let options = arguments.check().map_err(|error| error.to_string())?;
    if !options.listen.is_loopback() && options.access.allow_cn.is_empty() {
        tracing::warn!(listen = %options.listen, "insecure: whoever reaches this address may use the server");
    }
    let name = options.name.clone();
    // Zenoh panics where it cannot read what threads it should have.
    let opened = catch_unwind(AssertUnwindSafe(|| Server::open(options))).map_err(|panic| {
        let threads = std::env::var(THREADS_VARIABLE).unwrap_or_default();
        if threads == THREADS {
            resume_unwind(panic);
        }
        format!("`{THREADS_VARIABLE}` must be threads as Zenoh reads them, got {threads:?}")
    })?;
    let (server, stop) = opened.map_err(|error| error.to_string())?;
    let mut first = None;
    let on_signal = move || {
        stop.stop();
        // Whoever says it again after a while does not want to wait for anything; some say it twice at once.
        if first.get_or_insert_with(Clock::start).elapsed() > AGAIN {
            std::process::exit(1);
        }
    };
    ctrlc::set_handler(on_signal).map_err(|error| error.to_string())?;
    // Whoever has started the server waits for this line.
    let mut out = std::io::stdout();
    writeln!(out, "swath-server ready: {} {name}", server.listen())
        .and_then(|()| out.flush())
        .map_err(|error| error.to_string())?;
    server.run().map_err(|error| error.to_string())
}
