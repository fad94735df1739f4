//! Zenoh's settings, and its threads.

use serde_json::{Value, json};
use zenoh::Config;

use crate::endpoint::Endpoint;
use crate::options::Options;

/// Pieces of replies, of 64 KiB, that may wait for the network before their sender has to: as many as Zenoh allows.
const WAITING_PIECES: usize = 16;
/// Longer than what Zenoh adds to a message.
const MESSAGE_SLACK: u32 = 64 << 10;

/// Connections of those who have no session, at most.
const CONNECTIONS: u64 = 1000;
/// By low latency, at most; others go the usual way. Each may hold a thread of Zenoh's until it is cut off, and with all 50
/// of those that read nobody would be read any more.
const LOW_LATENCY_CONNECTIONS: u64 = 32;

/// The threads that read also notice what there is to read, and accept connections: by Zenoh's own count others do, which
/// wake them. Time-outs stay with a thread of their own, since they may have to wait for clients that do not read.
pub const THREADS: &str = "(acc: (handover: rx), app: (handover: rx))";
/// Where Zenoh looks for them, once in a process.
pub const THREADS_VARIABLE: &str = "ZENOH_RUNTIME";

/// Settings for a server that listens at its endpoint and looks for nobody.
///
/// # Errors
///
/// Zenoh's own, if it does not take them.
pub fn settings(options: &Options) -> Result<Config, zenoh::Error> {
    Config::from_json5(&all(options).to_string())
}

/// Settings for one that only asks at the routers: these answer clients what they keep from servers, which they take to
/// know each other. None where there are no routers.
///
/// # Errors
///
/// Zenoh's own, if it does not take them.
pub fn settings_to_ask(options: &Options) -> Result<Option<Config>, zenoh::Error> {
    if options.connect.is_empty() {
        return Ok(None);
    }
    let mut all = all(options);
    all["mode"] = "client".into();
    all["listen"] = json!({});
    all["access_control"] = json!({ "enabled": false });
    Config::from_json5(&all.to_string()).map(Some)
}

/// Settings for the low-latency transport, at an endpoint of its own that only this machine can reach.
///
/// # Errors
///
/// Zenoh's own, if it does not take them.
pub fn settings_of_low_latency(
    options: &Options,
    listen: &Endpoint,
) -> Result<Config, zenoh::Error> {
    let mut all = all(options);
    all["listen"]["endpoints"] = json!([listen.to_string()]);
    // Zenoh takes only one of the two.
    all["transport"]["unicast"]["lowlatency"] = true.into();
    all["transport"]["unicast"]["qos"] = json!({ "enabled": false });
    all["transport"]["unicast"]["max_sessions"] = LOW_LATENCY_CONNECTIONS.into();
    Config::from_json5(&all.to_string())
}

fn all(options: &Options) -> Value {
    let texts = |endpoints: &[Endpoint]| -> Vec<String> {
        endpoints.iter().map(Endpoint::to_string).collect()
    };
    let listen = std::slice::from_ref(&options.listen);
    let has = |is_tls: bool| listen.iter().chain(&options.connect).any(|it| it.is_tls() == is_tls);
    let protocols: Vec<&str> = [("tcp", has(false)), ("tls", has(true))]
        .into_iter()
        .filter(|protocol| protocol.1)
        .map(|protocol| protocol.0)
        .collect();
    let mut link = json!({
        "protocols": protocols,
        "tx": { "lease": options.limits.lease_ms, "queue": { "size": { "data": WAITING_PIECES } } },
        "rx": { "max_message_size": options.limits.max_msg.saturating_add(MESSAGE_SLACK) },
    });
    if let Some(tls) = &options.access.tls {
        link["tls"] = json!({
            "root_ca_certificate": tls.ca,
            "listen_certificate": tls.certificate,
            "listen_private_key": tls.key,
            "connect_certificate": tls.certificate,
            "connect_private_key": tls.key,
            "enable_mtls": true,
            "verify_name_on_connect": true,
            "close_link_on_expiration": true,
        });
    }
    json!({
        "mode": "peer",
        "listen": { "endpoints": texts(listen), "exit_on_failure": true },
        "connect": { "endpoints": texts(&options.connect), "timeout_ms": 5000, "exit_on_failure": true },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "transport": {
            "link": link,
            "unicast": {
                "max_sessions": CONNECTIONS + u64::from(options.limits.max_sessions),
            },
        },
        "access_control": access_control(options),
    })
}

/// What clients with the right names may do, and nobody else anything: ask the server, hear that it is alive, and show
/// that they are.
fn access_control(options: &Options) -> Value {
    let Options { access, name, .. } = options;
    if access.allow_cn.is_empty() {
        return json!({ "enabled": false });
    }
    let rpc = [format!("swath/v1/{name}/rpc/*"), format!("swath/*/{name}/rpc/spec")];
    let alive = [format!("swath/v1/{name}/alive/*")];
    let lease = [format!("swath/v1/{name}/lease/*")];
    let rule = |id: &str, flow: &str, messages: &[&str], keys: &[String]| json!({ "id": id, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys });
    let mut rules = vec![
        rule("ask", "ingress", &["query"], &rpc),
        rule("answer", "egress", &["reply", "declare_queryable"], &rpc),
        rule("lease", "ingress", &["liveliness_token"], &lease),
        rule("look", "ingress", &["declare_liveliness_subscriber", "liveliness_query"], &alive),
        rule("alive", "egress", &["liveliness_token"], &alive),
    ];
    if !options.connect.is_empty() {
        // A router has to be asked for the leases of its clients, and for another server of this name.
        let ask = ["declare_liveliness_subscriber", "liveliness_query"];
        rules.push(rule("router-leases", "egress", &ask, &lease));
        rules.push(rule("router-alive", "egress", &ask, &alive));
        rules.push(rule("router-others", "ingress", &["liveliness_token"], &alive));
    }
    let ids: Vec<&Value> = rules.iter().map(|rule| &rule["id"]).collect();
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{ "id": "clients", "cert_common_names": access.allow_cn }],
        "policies": [{ "rules": ids, "subjects": ["clients"] }],
    })
}
