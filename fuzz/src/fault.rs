//! What a server answers when it cannot do what was asked.

use swath_wire::codec;
use swath_wire::header::{Header, Kind};

/// Reads a fault, and wants the same fault from what is written of it. Returns whether it could be read.
///
/// # Panics
///
/// If it is another one.
pub fn feed(data: &[u8]) -> bool {
    let fault = codec::read_fault(data);
    if let Ok(fault) = &fault {
        let written = codec::write_fault(&crate::header::ANY, fault);
        let (header, payload) = Header::read(&written).expect("we have just written it");
        assert_eq!(header.kind, Kind::Fault);
        assert_eq!(codec::read_fault(payload).as_ref(), Ok(fault));
    }
    fault.is_ok()
}
