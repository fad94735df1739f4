//! Whether the other end is what this end takes it for.

use crate::layout::{Layout, OUTCOMES};
use crate::message::{OpenReply, SpecReply};

/// What sets a server apart from this build of swath: its environments would not be those of this process.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// Another version of swath.
    #[error(
        "the server runs swath {server}, and this is swath {here}: both have to be the same version"
    )]
    Build {
        /// The server's.
        server: String,
        /// This one.
        here: String,
    },
    /// The same scenario has another hash there.
    #[error("the server has another version of swath: it reads the scenario otherwise")]
    Scenario,
    /// Observations, actions or infos have other tables.
    #[error("the server has another version of swath: its tables differ")]
    Tables,
    /// Episodes end in other ways.
    #[error("the server has another version of swath: its episodes end in other ways")]
    Outcomes,
}

/// Checks a server's version of swath against one's own.
///
/// # Errors
///
/// [`Mismatch::Build`].
pub fn check_build(spec: &SpecReply, here: &str) -> Result<(), Mismatch> {
    if spec.build == here {
        return Ok(());
    }
    Err(Mismatch::Build { server: spec.build.clone(), here: here.to_owned() })
}

/// Checks what a server says of the environments that it has opened against those that this process would have made.
///
/// # Errors
///
/// [`Mismatch`], the first that is found.
pub fn check_opened(
    reply: &OpenReply,
    layout: &Layout,
    config_hash: &[u8; 32],
) -> Result<(), Mismatch> {
    let Layout { observation, action, info, ended } = layout;
    let got = (&reply.observation, &reply.action, &reply.info, &reply.ended);
    if reply.config_hash != *config_hash {
        Err(Mismatch::Scenario)
    } else if got != (observation, action, info, ended) {
        Err(Mismatch::Tables)
    } else if !reply.outcomes.iter().map(String::as_str).eq(OUTCOMES.iter().map(|it| it.name())) {
        Err(Mismatch::Outcomes)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hosted::{ENV_ID, Hosted};
    use crate::message::{AutoresetMode, Limits, Open};

    #[test]
    fn a_server_of_another_version_is_named_with_both() {
        let spec = SpecReply {
            major_min: 1,
            major_max: 1,
            minor: 0,
            server: "default".to_owned(),
            build: "0.9.0".to_owned(),
            envs: Vec::new(),
            limits: Limits::default(),
        };
        assert_eq!(check_build(&spec, "0.9.0"), Ok(()));
        assert_eq!(
            check_build(&spec, "1.0.0").unwrap_err().to_string(),
            "the server runs swath 0.9.0, and this is swath 1.0.0: both have to be the same version"
        );
    }

    #[test]
    fn environments_that_are_not_those_of_this_process_are_told_apart() {
        let open = Open {
            nonce: 1,
            env_id: ENV_ID.to_owned(),
            config: String::new(),
            num_envs: 1,
            autoreset: AutoresetMode::NextStep,
            hash_every: 0,
            infos: true,
            snapshot: None,
            percept: false,
            client: String::new(),
        };
        let limits = Limits::default();
        let reply = Hosted::open(&open, &limits, 1).unwrap().open_reply(1, 2, limits);
        let OpenReply { observation, action, info, ended, config_hash, .. } = reply.clone();
        let layout = Layout { observation, action, info, ended };
        assert_eq!(check_opened(&reply, &layout, &config_hash), Ok(()));
        assert_eq!(check_opened(&reply, &layout, &[0; 32]), Err(Mismatch::Scenario));
        let mut other = reply.clone();
        other.info[0].name.push('s');
        assert_eq!(check_opened(&other, &layout, &config_hash), Err(Mismatch::Tables));
        let mut other = reply.clone();
        other.outcomes.swap(0, 1);
        assert_eq!(check_opened(&other, &layout, &config_hash), Err(Mismatch::Outcomes));
        let mut other = reply;
        other.outcomes.pop();
        assert_eq!(check_opened(&other, &layout, &config_hash), Err(Mismatch::Outcomes));
    }
}
