//! What reads bytes from elsewhere, fed with any: nothing may panic, take memory beyond its limits, or change what a
//! refused message must not change.
//!
//! | module | what is fed |
//! |---|---|
//! | [`header`], [`fault`], [`feed_payload`] | the decoders of messages |
//! | [`server`] | a server with a session, whose requests real environments carry out |
//! | [`client`] | a client with a session, which may be resumed or not |
//! | [`snapshot`] | environments, with states to put back |
//! | [`percept`] | mirrors, with what mowers perceive |
//! | [`seeds`] | what the targets begin with |
//!
//! Each target in `fuzz_targets` is one call of these; the tests here run them over the seeds that they begin with.

pub mod golden;
pub mod records;
pub mod header;
pub mod fault;
pub mod server;
pub mod client;
pub mod snapshot;
pub mod percept;
pub mod seeds;

/// Reads a payload of this type, and wants what was read to be written as the same bytes. Is whether it was read.
#[macro_export]
macro_rules! feed_payload {
    ($type:ty, $data:expr) => {{
        let data: &[u8] = $data;
        let payload = swath_wire::codec::read::<$type>(data);
        let is_read = payload.is_ok();
        if let Ok(payload) = &payload {
            let written = swath_wire::codec::write(&$crate::header::ANY, payload);
            let written = written.expect("what was read is not too long");
            assert_eq!(&written[swath_wire::header::HEADER_BYTES..], data);
        }
        is_read
    }};
}

#[cfg(test)]
mod tests {
    use swath_wire::header::Verb;

    use super::*;

    /// What a target does with bytes. Returns whether they were read; servers and clients take any.
    fn feed(target: &str, data: &[u8]) -> bool {
        use swath_wire::message::*;
        match target {
            "header" => return header::feed(data),
            "fault" => return fault::feed(data),
            "percept" => return percept::feed(data),
            "env_snapshot" => return snapshot::feed_env(data),
            "batch_snapshot" => return snapshot::feed_batch(data),
            "server" => server::feed(data),
            "client" => client::feed(data, false),
            "resuming_client" => client::feed(data, true),
            "spec_reply" => return feed_payload!(SpecReply, data),
            "open" => return feed_payload!(Open, data),
            "open_reply" => return feed_payload!(OpenReply, data),
            "reset" => return feed_payload!(Reset, data),
            "reset_reply" => return feed_payload!(ResetReply, data),
            "step" => return feed_payload!(Step, data),
            "step_reply" => return feed_payload!(StepReply, data),
            "snapshot" => return feed_payload!(Snapshot, data),
            "snapshot_reply" => return feed_payload!(SnapshotReply, data),
            "restore" => return feed_payload!(Restore, data),
            "close_reply" => return feed_payload!(CloseReply, data),
            "stats_reply" => return feed_payload!(StatsReply, data),
            other => panic!("{other} is no target"),
        }
        true
    }

    #[test]
    fn every_target_has_seeds_and_takes_them_and_what_is_near_them() {
        let manifest = include_str!("../Cargo.toml");
        let targets: Vec<&str> = manifest
            .lines()
            .filter_map(|line| line.strip_prefix("path = \"fuzz_targets/"))
            .collect();
        let seeds = seeds::all();
        for target in &targets {
            let target = target.trim_end_matches(".rs\"");
            assert!(seeds.iter().any(|seed| seed.0 == target), "{target} has no seed");
        }
        for (target, _, bytes) in &seeds {
            feed(target, bytes);
            for at in (0..bytes.len()).step_by(1 + bytes.len() / 40) {
                let mut damaged = bytes.clone();
                damaged[at] ^= 0x41;
                feed(target, &damaged);
                feed(target, &bytes[..at]);
            }
        }
    }

    #[test]
    fn every_seed_is_read() {
        for (target, name, bytes) in seeds::all() {
            assert!(feed(&target, &bytes), "{target}: {name}");
        }
        assert_eq!(Verb::ALL.len(), 8, "events name verbs by three bits");
    }
}
