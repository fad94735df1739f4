//! Who may use a server that asks for certificates.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use rcgen::{
    BasicConstraints, CertificateParams, CertifiedIssuer, DnType, ExtendedKeyUsagePurpose, IsCa,
    KeyPair, KeyUsagePurpose, date_time_ymd,
};

use crate::common::{Client, Papers, Running, batch, header, refusal};
use swath_wire::codec;
use swath_wire::header::Verb;
use zenoh::Wait as _;

/// A folder of certificates and keys that goes with this.
struct Office {
    folder: PathBuf,
    authority: CertifiedIssuer<'static, KeyPair>,
}

impl Office {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("swath-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mut params = CertificateParams::new(Vec::<String>::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        params.distinguished_name.push(DnType::CommonName, "authority");
        let authority = CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap();
        fs::write(folder.join("ca.pem"), authority.pem()).unwrap();
        Self { folder, authority }
    }

    fn ca(&self) -> PathBuf {
        self.folder.join("ca.pem")
    }

    /// The files of a certificate for this common name, and its key.
    fn papers(&self, name: &str, is_expired: bool) -> (PathBuf, PathBuf) {
        self.papers_for(&["127.0.0.1", "localhost"], name, is_expired)
    }

    /// The same for a machine with one of these names.
    fn papers_for(&self, hosts: &[&str], name: &str, is_expired: bool) -> (PathBuf, PathBuf) {
        let hosts: Vec<String> = hosts.iter().map(|&host| host.to_owned()).collect();
        let mut params = CertificateParams::new(hosts).unwrap();
        params.distinguished_name.push(DnType::CommonName, name);
        params.extended_key_usages =
            vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
        if is_expired {
            (params.not_before, params.not_after) =
                (date_time_ymd(2020, 1, 1), date_time_ymd(2021, 1, 1));
        }
        let key = KeyPair::generate().unwrap();
        let certificate = params.signed_by(&key, &self.authority).unwrap();
        let file = |part: &str| self.folder.join(format!("{name}-{is_expired}.{part}.pem"));
        let (certificate_file, key_file) = (file("certificate"), file("key"));
        fs::write(&certificate_file, certificate.pem()).unwrap();
        fs::write(&key_file, key.serialize_pem()).unwrap();
        (certificate_file, key_file)
    }

    /// A server that robots may use.
    fn server(&self) -> Running {
        self.server_with(&self.papers("server", false))
    }

    fn server_with(&self, (certificate, key): &(PathBuf, PathBuf)) -> Running {
        let mut flags = vec!["--listen", "tls/127.0.0.1:0", "--allow-cn", "robot", "rover"];
        let ca = self.ca();
        let files = [("--tls-ca", &ca), ("--tls-certificate", certificate), ("--tls-key", key)];
        for (flag, file) in &files {
            flags.extend([*flag, file.to_str().unwrap()]);
        }
        Running::start(&flags)
    }
}

impl Drop for Office {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn connect(
    server: &Running,
    ca: &Path,
    own: Option<&(PathBuf, PathBuf)>,
) -> Result<Client, zenoh::Error> {
    let own = own.map(|(certificate, key)| (certificate.as_path(), key.as_path()));
    Client::connect(&server.endpoint, Some(&Papers { ca, own }))
}

#[test]
fn a_listed_name_is_served_and_one_that_is_not_gets_silence() {
    let office = Office::new("listed");
    let server = office.server();
    let robot = connect(&server, &office.ca(), Some(&office.papers("robot", false))).unwrap();
    let session = robot.open(&batch(1, 2)).unwrap();
    assert!(robot.ask(Verb::Reset, &session.reset(1, 7)).is_some());
    let stranger = connect(&server, &office.ca(), Some(&office.papers("stranger", false))).unwrap();
    assert_eq!(stranger.spec(), None);
    let alive = |client: &Client| {
        let tokens = client.session.liveliness().get("swath/v1/default/alive/*").wait().unwrap();
        tokens.into_iter().filter(|token| token.result().is_ok()).count()
    };
    assert_eq!((alive(&robot), alive(&stranger)), (1, 0));
}

#[test]
fn nobody_comes_in_without_a_certificate_of_the_right_authority_that_is_valid() {
    let office = Office::new("authority");
    let foreign = Office::new("foreign");
    let server = office.server();
    let robot = office.papers("robot", false);
    let strangers = [
        ("no certificate", office.ca(), None),
        ("of a foreign authority", office.ca(), Some(foreign.papers("robot", false))),
        ("expired", office.ca(), Some(office.papers("robot", true))),
        ("at a server of a foreign authority", foreign.ca(), Some(robot.clone())),
    ];
    // Each tries for seconds.
    thread::scope(|all| {
        for (what, ca, own) in &strangers {
            let server = &server;
            all.spawn(move || assert!(connect(server, ca, own.as_ref()).is_err(), "{what}"));
        }
        let plain = server.endpoint.replace("tls/", "tcp/");
        all.spawn(move || assert!(Client::connect(&plain, None).is_err(), "without TLS"));
    });
    assert!(connect(&server, &office.ca(), Some(&robot)).is_ok());
}

#[test]
fn a_server_whose_certificate_is_for_another_machine_or_expired_is_not_talked_to() {
    let office = Office::new("machine");
    let robot = office.papers("robot", false);
    for papers in [
        office.papers_for(&["elsewhere.example"], "elsewhere", false),
        office.papers("expired-server", true),
    ] {
        let server = office.server_with(&papers);
        assert!(connect(&server, &office.ca(), Some(&robot)).is_err());
    }
}

#[test]
fn a_client_that_declares_the_servers_keys_is_asked_nothing() {
    let office = Office::new("impostor");
    let server = office.server();
    let impostor = connect(&server, &office.ca(), Some(&office.papers("rover", false))).unwrap();
    let (asked, questions) = std::sync::mpsc::channel();
    for verb in Verb::ALL {
        let asked = asked.clone();
        impostor
            .session
            .declare_queryable(format!("swath/v1/default/rpc/{}", verb.name()))
            .callback(move |_| asked.send(verb).unwrap())
            .background()
            .wait()
            .unwrap();
    }
    let robot = connect(&server, &office.ca(), Some(&office.papers("robot", false))).unwrap();
    for key in ["swath/v1/default/rpc/spec", "swath/v1/default/rpc/stats", "swath/**"] {
        robot.get(key, &codec::write_empty(&header(Verb::Spec)));
    }
    assert!(robot.spec().is_some(), "the server answers, and nobody beside it");
    assert_eq!(questions.try_iter().count(), 0);
}

#[test]
fn files_of_certificates_that_are_not_there_are_named() {
    let files =
        ["--tls-ca", "no/ca.pem", "--tls-certificate", "no/it.pem", "--tls-key", "no/key.pem"];
    let flags = [&["--listen", "tls/0.0.0.0:0", "--allow-cn", "robot"][..], &files].concat();
    let (status, text) = refusal(&flags);
    assert_eq!((status, text.lines().count()), (Some(2), 1), "{text}");
    assert!(text.contains("`tls_ca` must be a file in PEM, got no/ca.pem: No such file"), "{text}");
}
