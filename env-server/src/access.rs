//! Who may reach a server: nobody beyond this machine, unless certificates and names say who.

use std::path::PathBuf;

use crate::endpoint::Endpoint;

/// The files of mutual TLS, in PEM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tls {
    /// Of the authority that signs the certificates of clients and servers.
    pub ca: PathBuf,
    /// The server's certificate.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
}

/// Who may reach a server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Access {
    /// How both ends show who they are; `None` where nothing is spoken through TLS.
    pub tls: Option<Tls>,
    /// The common names of the certificates that may use the server; empty: whoever can connect may.
    pub allow_cn: Vec<String>,
}

/// What an operator has said of access.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wish {
    /// The authority's certificate.
    pub ca: Option<PathBuf>,
    /// The server's certificate.
    pub certificate: Option<PathBuf>,
    /// Its private key.
    pub key: Option<PathBuf>,
    /// The common names that may use the server.
    pub allow_cn: Vec<String>,
    /// Whether anybody may reach it.
    pub insecure: bool,
}

/// Settings that would let in whom they should not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Machines elsewhere could use the server.
    #[error(
        "{endpoint} is not an address of this machine's loopback and needs mutual TLS and access control, or `--insecure`; \
         missing: {missing}"
    )]
    Open {
        /// The address.
        endpoint: String,
        /// What would close it.
        missing: String,
    },
    /// TLS without its files.
    #[error("{endpoint} needs mutual TLS; missing: {missing}")]
    NoFiles {
        /// The address.
        endpoint: String,
        /// The settings.
        missing: String,
    },
    /// Files that nobody is shown.
    #[error("{setting} is about TLS and needs tls/ endpoints, got {endpoint}")]
    NoTls {
        /// The setting.
        setting: &'static str,
        /// The address.
        endpoint: String,
    },
    /// Names that nobody shows.
    #[error(
        "`allow_cn` is about the names in certificates and needs tls/ endpoints, got {endpoint}"
    )]
    NoNames {
        /// The address.
        endpoint: String,
    },
}

impl Wish {
    /// Who may reach a server with these endpoints.
    ///
    /// # Errors
    ///
    /// [`AccessError`] naming what is missing.
    pub fn check(self, endpoints: &[&Endpoint]) -> Result<Access, AccessError> {
        let files = [
            ("`--tls-ca`", self.ca.is_none()),
            ("`--tls-certificate`", self.certificate.is_none()),
            ("`--tls-key`", self.key.is_none()),
        ];
        let missing_files = files.into_iter().filter(|file| file.1).map(|file| file.0);
        for endpoint in endpoints {
            let mut missing = Vec::new();
            if !endpoint.is_tls() {
                missing.push("tls/ in place of tcp/");
            }
            missing.extend(missing_files.clone());
            if self.allow_cn.is_empty() {
                missing.push("`--allow-cn`");
            }
            let is_open = !endpoint.is_loopback() && !missing.is_empty();
            if is_open && !self.insecure {
                let missing = missing.join(", ");
                return Err(AccessError::Open { endpoint: endpoint.to_string(), missing });
            }
            if endpoint.is_tls() && missing_files.clone().next().is_some() {
                let missing: Vec<&str> = missing_files.clone().collect();
                return Err(AccessError::NoFiles {
                    endpoint: endpoint.to_string(),
                    missing: missing.join(", "),
                });
            }
            if !endpoint.is_tls() && !self.allow_cn.is_empty() {
                return Err(AccessError::NoNames { endpoint: endpoint.to_string() });
            }
        }
        let given = files.into_iter().find(|file| !file.1).map(|file| file.0);
        if let (Some(setting), Some(endpoint)) = (given, endpoints.first())
            && !endpoints.iter().any(|endpoint| endpoint.is_tls())
        {
            return Err(AccessError::NoTls { setting, endpoint: endpoint.to_string() });
        }
        let tls = match (self.ca, self.certificate, self.key) {
            (Some(ca), Some(certificate), Some(key)) => Some(Tls { ca, certificate, key }),
            _ => None,
        };
        Ok(Access { tls, allow_cn: self.allow_cn })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(endpoint: &str, wish: Wish) -> Result<Access, String> {
        let endpoint = Endpoint::parse(endpoint).unwrap();
        wish.check(&[&endpoint]).map_err(|error| error.to_string())
    }

    fn files() -> Wish {
        let file = |name: &str| Some(PathBuf::from(name));
        Wish { ca: file("ca"), certificate: file("it"), key: file("key"), ..Wish::default() }
    }

    #[test]
    fn beyond_the_loopback_everything_that_is_missing_is_named() {
        let refused = check("tcp/0.0.0.0:1", Wish::default()).unwrap_err();
        assert_eq!(
            refused,
            "tcp/0.0.0.0:1 is not an address of this machine's loopback and needs mutual TLS and access control, or \
             `--insecure`; missing: tls/ in place of tcp/, `--tls-ca`, `--tls-certificate`, `--tls-key`, `--allow-cn`"
        );
        let refused = check("tls/0.0.0.0:1", files()).unwrap_err();
        assert!(refused.ends_with("missing: `--allow-cn`"), "{refused}");
        let named = Wish { allow_cn: vec!["robot".to_owned()], ..files() };
        let refused = check("tcp/0.0.0.0:1", named.clone()).unwrap_err();
        assert!(refused.ends_with("missing: tls/ in place of tcp/"), "{refused}");
        let no_key = Wish { key: None, ..named.clone() };
        assert!(check("tls/0.0.0.0:1", no_key).unwrap_err().ends_with("missing: `--tls-key`"));
        let access = check("tls/0.0.0.0:1", named).unwrap();
        assert_eq!((access.tls.is_some(), access.allow_cn.len()), (true, 1));
    }

    #[test]
    fn the_loopback_needs_nothing_and_the_insecure_at_most_files() {
        let nothing = Access { tls: None, allow_cn: Vec::new() };
        assert_eq!(check("tcp/127.0.0.1:1", Wish::default()), Ok(nothing.clone()));
        let insecure = Wish { insecure: true, ..Wish::default() };
        assert_eq!(check("tcp/0.0.0.0:1", insecure.clone()), Ok(nothing));
        let refused = check("tls/0.0.0.0:1", insecure).unwrap_err();
        assert!(refused.starts_with("tls/0.0.0.0:1 needs mutual TLS; missing: `--tls-ca`"));
        let named = Wish { allow_cn: vec!["robot".to_owned()], ..Wish::default() };
        assert!(check("tcp/127.0.0.1:1", named).unwrap_err().starts_with("`allow_cn`"));
        let refused = check("tcp/127.0.0.1:1", files()).unwrap_err();
        assert_eq!(
            refused,
            "`--tls-ca` is about TLS and needs tls/ endpoints, got tcp/127.0.0.1:1"
        );
    }
}
