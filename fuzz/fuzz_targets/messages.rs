//! Any bytes as each message of the bus: it is read or refused without a panic, and what was read is written and read alike.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_schema::{Frame, Message, pb};

/// Reads the bytes, and what was read again. Gives both forms.
fn read<M: Message>(bytes: &[u8]) -> Option<(M, Vec<u8>)> {
    let message = M::decode(bytes).ok()?;
    let written = message.encode_to_vec();
    let again = M::decode(written.as_slice()).map(|message| message.encode_to_vec());
    assert_eq!(again.as_ref(), Ok(&written), "{} is read as it was written", M::NAME);
    Some((message, written))
}

fn written<M: Message>(message: &M) -> Vec<u8> {
    message.encode_to_vec()
}

fuzz_target!(|input: &[u8]| {
    // What a service takes.
    read::<pb::RunRequest>(input);
    read::<pb::CommandRequest>(input);
    read::<pb::LeaseRequest>(input);
    // What a client takes.
    read::<pb::CommandReply>(input);
    read::<pb::SensorInfo>(input);
    read::<pb::StageState>(input);
    read::<pb::RunEvent>(input);
    read::<pb::RunState>(input);
    read::<pb::SafetyEvent>(input);
    read::<pb::Health>(input);
    if let Some((message, bytes)) = read::<pb::Frame>(input) {
        let frame = Frame::from(message);
        assert_eq!(written(&pb::Frame::from(&frame)), bytes, "a frame keeps everything");
    }
});
