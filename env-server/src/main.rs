//! `swath-server`: swath's environments over Zenoh.

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser as _;
use swath_server::endpoint::is_loopback;
use swath_server::options::{Arguments, Options};
use swath_server::server::Server;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let filter =
        EnvFilter::try_from_env("SWATH_LOG").unwrap_or_else(|_| EnvFilter::new("info,zenoh=warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match serve(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            let _ = writeln!(std::io::stderr(), "swath-server: {text}");
            ExitCode::from(2)
        }
    }
}

fn serve(arguments: Arguments) -> Result<(), String> {
    let options: Options = arguments.check().map_err(|error| error.to_string())?;
    if !is_loopback(&options.listen) {
        if !options.insecure {
            return Err(format!(
                "`listen` must be an address of this machine's loopback, such as tcp/127.0.0.1:7447, or be told \
                 `--insecure`, got {}",
                options.listen
            ));
        }
        tracing::warn!(
            listen = options.listen,
            "anybody who reaches this address may use the server"
        );
    }
    let (server, stop) = Server::open(&options).map_err(|error| error.to_string())?;
    ctrlc::set_handler(move || stop.stop()).map_err(|error| error.to_string())?;
    // Whoever has started the server waits for this line.
    let mut out = std::io::stdout();
    writeln!(out, "swath-server ready: {} {}", options.listen, options.name)
        .and_then(|()| out.flush())
        .map_err(|error| error.to_string())?;
    server.run().map_err(|error| error.to_string())
}
