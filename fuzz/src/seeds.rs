//! What the targets begin with: the golden messages, and conversations made of them.

use swath_wire::header::{HEADER_BYTES, Header, Kind, Verb};

use crate::records::record;
use crate::{client, golden, percept, server, snapshot};

/// Every seed: its target, its name and its bytes.
#[must_use]
pub fn all() -> Vec<(String, String, Vec<u8>)> {
    let mut seeds = Vec::new();
    let mut add = |target: &str, name: &str, bytes: Vec<u8>| {
        seeds.push((target.to_owned(), name.to_owned(), bytes));
    };
    let (mut asked, mut answered) = (Vec::new(), Vec::new());
    for (name, message) in golden::all() {
        let (header, _) = Header::read(&message).expect("a golden message can be read");
        let payload = &message[HEADER_BYTES..];
        add("header", name, message.clone());
        match header.kind {
            Kind::Request(verb) => {
                if !matches!(verb, Verb::Spec | Verb::Stats | Verb::Close) {
                    add(verb.name(), name, payload.to_vec());
                }
                let place = Verb::ALL.iter().position(|&other| other == verb);
                let place = u8::try_from(place.expect("it is one of them")).expect("there are few");
                let events = [
                    record(server::MESSAGE + place, &message),
                    record(server::PAYLOAD + place, payload),
                    record(server::AGAIN, &[]),
                    record(server::LATER, &[9]),
                ];
                add("server", name, events.concat());
                asked.extend(events.concat());
            }
            Kind::Reply(verb) => {
                add(&format!("{}_reply", verb.name()), name, payload.to_vec());
                let events = [
                    record(client::CALL, &[call_of(verb), 0, 0, 0, 0]),
                    record(client::TIMEOUT, &[]),
                    record(client::LATER, &[40]),
                    record(client::MESSAGE, &message),
                    record(client::PAYLOAD, payload),
                ];
                add("client", name, events.concat());
                add("resuming_client", name, events.concat());
                answered.extend(events.concat());
            }
            Kind::Fault => {
                add("fault", name, payload.to_vec());
                let events =
                    [record(client::CALL, &[0, 1, 2, 3, 4]), record(client::FAULT, payload)];
                add("client", name, events.concat());
                add("resuming_client", name, events.concat());
            }
        }
    }
    add("server", "all", asked);
    add("client", "all", answered.clone());
    add("resuming_client", "all", answered);
    let [env, batch] = snapshot::seeds();
    add("env_snapshot", "driven", env);
    add("batch_snapshot", "begun", batch);
    add("percept", "driven", percept::seed());
    // A restore is answered as a reset is.
    seeds
        .iter_mut()
        .filter(|seed| seed.0 == "restore_reply")
        .for_each(|seed| seed.0 = "reset_reply".to_owned());
    seeds
}

/// Which call a reply is one to.
fn call_of(verb: Verb) -> u8 {
    match verb {
        Verb::Reset => 2,
        Verb::Snapshot => 3,
        Verb::Restore => 4,
        Verb::Close => 5,
        Verb::Stats => 6,
        _ => 0,
    }
}
