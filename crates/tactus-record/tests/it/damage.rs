//! A damaged recording gives everything before the damage, says where that is, and never panics.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{fs, path::Path};

use crate::synthetic::{Fed, Plan};
use proptest::prelude::*;
use tactus_record::{Completeness, Entry, Message, Reader, RecordError, Recording, info, recover};
use tactus_schema::pb::{self, run_event::Event};

fn recorded(plan: Plan) -> (Vec<u8>, Vec<Entry>) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    plan.make().record(&path).unwrap();
    let bytes = fs::read(&path).unwrap();
    let (entries, completeness) = read_all(&bytes);
    assert_eq!(completeness, Completeness::Complete);
    (bytes, entries)
}

fn read_all(bytes: &[u8]) -> (Vec<Entry>, Completeness) {
    let mut reader = Reader::new(bytes);
    let entries = reader.by_ref().map(Result::unwrap).collect();
    (entries, reader.completeness().unwrap().clone())
}

/// The file while the recording is open, as a kill would leave it.
fn killed_after(path: &Path, messages: usize) -> Vec<u8> {
    let run = Plan { exit_status: None, ..Plan::short(2) }.make();
    let live = path.with_extension("live");
    let mut recording = run.with_header(|header| Recording::create(&live, header)).unwrap();
    for fed in &run.fed[..messages] {
        fed.write(&mut recording).unwrap();
    }
    let bytes = fs::read(&live).unwrap();
    fs::write(path, &bytes).unwrap();
    drop(recording);
    fs::remove_file(live).unwrap();
    bytes
}

fn last_time_ns(entries: &[Entry]) -> i64 {
    let time = |entry: &Entry| match entry {
        Entry::Message { at, .. } => at.ns(),
        Entry::Run(_) | Entry::Attachment(_) => 0,
    };
    entries.iter().map(time).max().unwrap()
}

#[test]
fn a_recording_cut_anywhere_loses_at_most_half_a_second() {
    let (bytes, whole) = recorded(Plan::short(1));
    // Each chunk spans half a second, so a cut within the data loses the chunk that was cut.
    let mut before = 0;
    for cut in (8..bytes.len()).step_by(401) {
        let (entries, completeness) = read_all(&bytes[..cut]);
        assert!(whole.starts_with(&entries), "cut at {cut}");
        assert!(entries.len() >= before, "a longer file gives no less: cut at {cut}");
        before = entries.len();
        let Completeness::Truncated { at_byte, reason } = completeness else {
            panic!("cut at {cut} unnoticed")
        };
        assert!(at_byte <= cut as u64 && !reason.is_empty());
        let next = whole.get(entries.len()).map(|next| last_time_ns(std::slice::from_ref(next)));
        if let (Some(next_ns), true) = (next, entries.len() > 7) {
            assert!(
                next_ns - last_time_ns(&entries) <= 100_000_000,
                "what is there has no holes: cut at {cut}"
            );
        }
    }
    assert_eq!(before, whole.len(), "the last cuts are in the summary and cost no message");
}

#[test]
fn a_killed_recording_lacks_at_most_a_second() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan { exit_status: None, ..Plan::short(2) }.make();
    for messages in (1..run.fed.len()).step_by(97) {
        let bytes = killed_after(&dir.path().join("killed.mcap"), messages);
        let (entries, _) = read_all(&bytes);
        let written: Vec<Entry> =
            entries.into_iter().filter(|e| matches!(e, Entry::Message { .. })).collect();
        let last_fed_ns = match &run.fed[messages - 1] {
            Fed::Info(_, at) => at.wall.ns(),
            Fed::Frame(frame) => frame.received.wall.ns(),
            Fed::Stage(state) => state.t_wall_ns,
            Fed::Event(event) => event.t_wall_ns,
        };
        let durable_ns =
            if written.is_empty() { crate::synthetic::STARTED_NS } else { last_time_ns(&written) };
        assert!(last_fed_ns - durable_ns <= 1_000_000_000, "after {messages} messages");
    }
}

#[test]
fn a_recovered_recording_is_whole_and_closed_as_crashed() {
    let dir = tempfile::tempdir().unwrap();
    let (path, out) = (dir.path().join("killed.mcap"), dir.path().join("recovered.mcap"));
    let bytes = killed_after(&path, 400);
    let (entries, _) = read_all(&bytes);
    let made = recover(&path, &out).unwrap();
    assert!(matches!(made.damage, Completeness::Truncated { .. }));
    assert!(made.closed);
    let (after, completeness) = read_all(&fs::read(&out).unwrap());
    assert_eq!(completeness, Completeness::Complete);
    assert_eq!(&after[..after.len() - 1], entries.as_slice(), "nothing added but the end");
    let Some(Entry::Message { message: Message::Event(event), .. }) = after.last() else { panic!() };
    let Some(Event::Finished(finished)) = &event.event else { panic!("{event:?}") };
    assert_eq!(finished.exit_status(), pb::ExitStatus::Crashed);
    let counted = info(&path).unwrap();
    assert_eq!(
        (finished.frames, finished.presses, finished.dwells),
        (counted.frames, counted.presses, counted.dwells)
    );
    assert_eq!(made.info.exit_status, Some("crashed"));
    let seqs: Vec<u64> = after
        .iter()
        .filter_map(|entry| {
            let Entry::Message { message: Message::Event(event), .. } = entry else { return None };
            Some(event.seq)
        })
        .collect();
    assert!(seqs.iter().copied().eq(0..seqs.len() as u64), "events go on counting: {seqs:?}");
}

#[test]
fn recovery_of_a_closed_run_adds_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (path, out) = (dir.path().join("cut.mcap"), dir.path().join("recovered.mcap"));
    let (bytes, whole) = recorded(Plan::short(1));
    fs::write(&path, &bytes[..bytes.len() - 1000]).unwrap();
    let made = recover(&path, &out).unwrap();
    assert!(!made.closed);
    assert_eq!(read_all(&fs::read(&out).unwrap()), (whole, Completeness::Complete));
}

#[test]
fn recovery_needs_something_to_recover_and_a_free_place() {
    let dir = tempfile::tempdir().unwrap();
    let (path, out) = (dir.path().join("run.mcap"), dir.path().join("out.mcap"));
    let (bytes, _) = recorded(Plan::short(1));
    fs::write(&path, &bytes).unwrap();
    assert!(matches!(recover(&path, &out), Err(RecordError::NothingToRecover { .. })));
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    fs::write(&out, "precious").unwrap();
    assert!(matches!(recover(&path, &out), Err(RecordError::Io { action: "create", .. })));
    assert_eq!(fs::read(&out).unwrap(), b"precious");
    fs::write(&path, &bytes[..9]).unwrap();
    assert!(matches!(recover(&path, &out), Err(RecordError::NoRun { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn a_flipped_bit_never_panics_and_never_changes_a_message(at in 8_usize..usize::MAX, bit in 0_u8..8) {
        thread_local! {
            static RECORDED: (Vec<u8>, Vec<Entry>) = recorded(Plan::short(1));
        }
        RECORDED.with(|(bytes, whole)| {
            let mut flipped = bytes.clone();
            let at = 8 + at % (bytes.len() - 8);
            flipped[at] ^= 1 << bit;
            let (entries, completeness) = read_all(&flipped);
            let is_message = |entry: &&Entry| matches!(entry, Entry::Message { .. });
            let messages: Vec<&Entry> = entries.iter().filter(is_message).collect();
            let expected: Vec<&Entry> = whole.iter().filter(is_message).collect();
            prop_assert!(expected.starts_with(&messages), "flip at {at}");
            prop_assert!(completeness != Completeness::Complete, "flip at {at} unnoticed");
            Ok(())
        })?;
    }

    #[test]
    fn any_bytes_behind_the_magic_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let mut file = mcap::MAGIC.to_vec();
        file.extend(bytes);
        read_all(&file);
    }

    #[test]
    fn any_records_never_panic(
        records in proptest::collection::vec((1_u8..16, proptest::collection::vec(any::<u8>(), 0..60)), 0..20)
    ) {
        let mut file = mcap::MAGIC.to_vec();
        for (opcode, body) in records {
            file.push(opcode);
            file.extend((body.len() as u64).to_le_bytes());
            file.extend(body);
        }
        read_all(&file);
    }
}
