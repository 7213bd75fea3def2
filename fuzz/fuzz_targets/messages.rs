//! Any bytes as a message of the bus: it is read or refused without a panic, and what was read is written and read alike.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_schema::{Message, pb};

/// Reads the bytes, and what was read again.
fn read<M: Message>(bytes: &[u8]) {
    if let Ok(message) = M::decode(bytes) {
        let written = message.encode_to_vec();
        let again = M::decode(written.as_slice()).map(|message| message.encode_to_vec());
        assert_eq!(again, Ok(written), "{} is read as it was written", M::NAME);
    }
}

fuzz_target!(|input: &[u8]| {
    read::<pb::Frame>(input);
    read::<pb::SensorInfo>(input);
    read::<pb::StageState>(input);
    read::<pb::RunEvent>(input);
    read::<pb::RunState>(input);
    read::<pb::SafetyEvent>(input);
    read::<pb::Health>(input);
    read::<pb::RunRequest>(input);
    read::<pb::CommandRequest>(input);
    read::<pb::CommandReply>(input);
});
