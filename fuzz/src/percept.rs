//! Mirrors of what mowers perceive, fed with percepts.

use swath_core::mirror::Mirror;
use swath_wire::codec;
use swath_wire::header::{HEADER_BYTES, Header, Kind, Verb};
use swath_wire::hosted::Hosted;
use swath_wire::message::{Limits, Open, Percept, Reset, ResetReply, Seeds, Step, StepReply};
use swath_wire::percept::read_percept;

use crate::header::ANY;
use crate::records::{Records, record};
use crate::{golden, snapshot};

/// Applies percepts one after the other, and looks at what the mirrors show. Returns whether each could be read and followed
/// from those before.
///
/// # Panics
///
/// If a mirror that took one in shows what no mower can know.
pub fn feed(data: &[u8]) -> bool {
    let mut is_read = true;
    let mut mirrors = vec![Mirror::new(snapshot::site()); snapshot::ROWS];
    for (_, bytes) in Records(data) {
        let Ok(percept) = codec::read::<Percept>(bytes) else {
            is_read = false;
            continue;
        };
        if read_percept(Some(&percept), &mut mirrors).is_err() {
            // It shows nothing of use until it is told the whole anew.
            return false;
        }
        for mirror in &mirrors {
            let view = mirror.view();
            assert!(view.pose.x_m.is_finite() && view.path_m.is_finite());
            assert!(view.known_weeds.len() <= view.weeds_detected as usize);
        }
    }
    is_read
}

/// The percepts of a reset and of two steps.
///
/// # Panics
///
/// If a server refuses what is in order.
#[must_use]
pub fn seed() -> Vec<u8> {
    let message = golden::message("open");
    let open: Open = codec::read(&message[HEADER_BYTES..]).expect("a golden message can be read");
    let num_envs = u32::try_from(snapshot::ROWS).expect("there are few");
    let config = snapshot::config();
    let open = Open { percept: true, num_envs, config, snapshot: None, ..open };
    let mut hosted = Hosted::open(&open, &Limits::default(), 1).expect("the scenario is checked");
    let ask = |verb, message: &[u8], hosted: &mut Hosted| {
        let header = Header { kind: Kind::Request(verb), ..ANY };
        hosted.answer(&header, &message[HEADER_BYTES..]).expect("the request is in order")
    };
    let written = |percept: Option<Percept>| {
        let message = codec::write(&ANY, &percept.expect("it was asked for"));
        record(0, &message.expect("it is short")[HEADER_BYTES..])
    };
    let reset = Reset { seeds: Seeds::One(7), mask: &[], weeds: Vec::new() };
    let reset = codec::write(&ANY, &reset).expect("it is short");
    let reply = ask(Verb::Reset, &reset, &mut hosted);
    let reply: ResetReply = codec::read(&reply[HEADER_BYTES..]).expect("a reply can be read");
    let mut seed = written(reply.percept);
    for _ in 0..2 {
        let step = codec::write(&ANY, &Step { actions: vec![&[0; 4 * snapshot::ROWS]] });
        let reply = ask(Verb::Step, &step.expect("it is short"), &mut hosted);
        let reply: StepReply = codec::read(&reply[HEADER_BYTES..]).expect("a reply can be read");
        seed.extend(written(reply.percept));
    }
    seed
}
