//! Any bytes as a recording, and a sound recording with any damage. Reading takes bounded memory and ends with a verdict; the summary
//! counts what the reader gives; and what recovery writes is whole and holds the same frames.
//!
//! The first byte of the input names what the edits after it damage: nothing, a recording, or one without compression and
//! checksums, in which damage reaches what is inside the chunks.
#![no_main]

#[path = "../../crates/tactus-record/examples/synthetic/mod.rs"]
mod synthetic;

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use mcap::records::{MessageHeader, Record};
use synthetic::{Fed, Plan, Run};
use tactus_fuzz::{Scratch, edited, memory};
use tactus_record::{
    Completeness, Entry, Message, Reader, RecordError, Recording, confirmed_presses, info, recover, rows,
    tail,
};

/// Most memory to read a file of a few kilobytes: an unpacked chunk of 64 MiB, and the same again as messages.
const READ_MAX_BYTES: usize = 512 << 20;

/// Messages of the sound recordings, from the front and from the end.
const KEPT: [usize; 2] = [12, 12];

static SCRATCH: LazyLock<Scratch> = LazyLock::new(Scratch::new);

/// Nothing, a recording, and one without compression and checksums.
static SOUND: LazyLock<[Vec<u8>; 3]> = LazyLock::new(|| {
    let ours = recording();
    let plain = plain(&ours);
    for sound in [&ours, &plain] {
        let path = SCRATCH.file("sound.mcap", sound);
        let info = info(&path).expect("a sound recording");
        assert_eq!((info.completeness, info.exit_status), (Completeness::Complete, Some("done")));
    }
    [Vec::new(), ours, plain]
});

fuzz_target!(|input: &[u8]| {
    let Some((which, edits)) = input.split_first() else { return };
    let sound = &SOUND[usize::from(*which) % SOUND.len()];
    let file = edited(sound, edits);
    let frames = memory::within(READ_MAX_BYTES, || read(&file));
    let path = SCRATCH.file("any.mcap", &file);
    memory::within(2 * READ_MAX_BYTES, || analyse(&path, frames));
});

/// The recording's frames, by the reader.
fn read(file: &[u8]) -> u64 {
    let mut reader = Reader::new(file);
    let mut frames = 0;
    for entry in reader.by_ref() {
        let entry = entry.expect("memory has no errors");
        frames += u64::from(matches!(entry, Entry::Message { message: Message::Frame(_), .. }));
    }
    assert!(reader.completeness().is_some(), "a verdict at the end");
    frames
}

fn analyse(path: &Path, frames: u64) {
    let known = info(path);
    match &known {
        Ok(info) => {
            assert_eq!(info.frames, frames, "{info}");
            assert!(!info.to_string().is_empty());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    // Errors are as good as results.
    drop(tail::run_has_ended(path));
    drop(confirmed_presses(path));
    drop(rows::visit(&[path], |_, _| {}));
    let out = SCRATCH.free("recovered.mcap");
    match recover(path, &out) {
        Ok(recovery) => {
            assert_eq!(recovery.info.frames, frames, "{recovery:?}");
            // Of the file that it has written.
            assert_eq!(recovery.info.completeness, Completeness::Complete);
            assert!(recovery.info.exit_status.is_some(), "its run is closed");
        }
        Err(error @ RecordError::Unverified { .. }) => panic!("{error}"),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert!(!out.exists(), "{error}: nothing is left behind");
        }
    }
}

/// A short run with a press, as the service records it.
fn recording() -> Vec<u8> {
    let Run { fed, plan, rig, knots, sampled_s } = Plan { idle_s: 0.2, ..Plan::short(1) }.make();
    let [first, last] = KEPT;
    let events = |fed: &Fed| matches!(fed, Fed::Event(_));
    let end = fed.len() - last;
    let kept = fed.iter().enumerate().filter(|(at, fed)| *at < first || *at >= end || events(fed));
    let run = Run { fed: kept.map(|(_, fed)| fed.clone()).collect(), plan, rig, knots, sampled_s };
    let path = SCRATCH.free("made.mcap");
    run.with_header(|header| {
        let mut recording = Recording::create(&path, header)?;
        run.fed.iter().try_for_each(|fed| fed.write(&mut recording))?;
        recording.finish()
    })
    .expect("a recording");
    fs::read(&path).expect("the recording")
}

/// The same recording without compression, and without the checksums that are optional.
fn plain(recording: &[u8]) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .compression(None)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .calculate_attachment_crcs(false)
        .chunk_size(Some(2048));
    let mut plain = options.create(Cursor::new(Vec::new())).expect("a writer");
    for record in mcap::read::LinearReader::new(recording).expect("a recording") {
        match record.expect("a record") {
            Record::Metadata(mut metadata) => {
                metadata.metadata.remove("crc32");
                plain.write_metadata(&metadata).expect("metadata");
            }
            Record::Attachment { header, data, .. } => {
                let attachment = mcap::Attachment {
                    log_time: header.log_time,
                    create_time: header.create_time,
                    name: header.name,
                    media_type: header.media_type,
                    data,
                };
                plain.attach(&attachment).expect("an attachment");
            }
            _ => {}
        }
    }
    let mut channels = BTreeMap::new();
    for message in mcap::MessageStream::new(recording).expect("a recording") {
        let message = message.expect("a message");
        let old: &Arc<mcap::Channel> = &message.channel;
        let channel_id = *channels.entry(old.id).or_insert_with(|| {
            let name = &old.schema.as_ref().expect("a schema").name;
            let schema = plain.add_schema(name, "protobuf", &[]).expect("a schema");
            plain.add_channel(schema, &old.topic, "protobuf", &BTreeMap::new()).expect("a channel")
        });
        let mcap::Message { sequence, log_time, publish_time, .. } = message;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        plain.write_to_known_channel(&header, &message.data).expect("a message");
    }
    plain.finish().expect("an end");
    plain.into_inner().into_inner()
}
