//! A damaged recording gives everything that is intact, says what is not, and never panics.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{collections::BTreeSet, fs, ops::Range, path::Path};

use crate::synthetic::{Fed, Plan};
use proptest::prelude::*;
use tactus_record::{Completeness, Damage, Entry, Message, Reader, RecordError, Recording, info, recover};
use tactus_schema::pb::{self, run_event::Event};

/// Kinds of MCAP records.
mod op {
    pub(super) const HEADER: u8 = 1;
    pub(super) const FOOTER: u8 = 2;
    pub(super) const CHUNK: u8 = 6;
    pub(super) const MESSAGE_INDEX: u8 = 7;
    pub(super) const ATTACHMENT: u8 = 9;
    pub(super) const METADATA: u8 = 12;
    pub(super) const DATA_END: u8 = 15;
}

/// A message as any MCAP reader gives it: topic, number, time, bytes.
type Raw = (String, u32, u64, Vec<u8>);

/// A recording, and where its records are.
struct Original {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    records: Vec<(u8, Range<usize>)>,
    messages: Vec<Raw>,
}

impl Original {
    fn of(plan: Plan) -> Self {
        let (bytes, entries) = recorded(plan);
        let mut records = Vec::new();
        let mut at = mcap::MAGIC.len();
        while at < bytes.len() - mcap::MAGIC.len() {
            let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
            let end = at + 9 + usize::try_from(length).unwrap();
            records.push((bytes[at], at..end));
            at = end;
        }
        let messages = stock_messages(&bytes);
        Self { bytes, entries, records, messages }
    }

    fn kind(&self, opcode: u8) -> impl Iterator<Item = Range<usize>> {
        self.records.iter().filter(move |(kind, _)| *kind == opcode).map(|(_, range)| range.clone())
    }

    /// Where the index at the end begins.
    fn index(&self) -> usize {
        self.kind(op::DATA_END).last().unwrap().start
    }

    /// The messages in a chunk.
    fn messages_of(&self, chunk: &Range<usize>) -> Vec<Raw> {
        let header_and_chunk =
            [&self.bytes[..self.kind(op::CHUNK).next().unwrap().end], &self.bytes[chunk.clone()]].concat();
        let options = mcap::read::Options::IgnoreEndMagic.into();
        mcap::MessageStream::new_with_options(&header_and_chunk, options).unwrap().map(raw).collect()
    }
}

/// All messages, read by the `mcap` crate with the checksums compared. Fails if the file or its index is not whole.
fn stock_messages(bytes: &[u8]) -> Vec<Raw> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let messages: Vec<Raw> = mcap::MessageStream::new(bytes).unwrap().map(raw).collect();
    assert_eq!(summary.stats.unwrap().message_count, messages.len() as u64);
    messages
}

fn raw(message: mcap::McapResult<mcap::Message<'_>>) -> Raw {
    let message = message.unwrap();
    (message.channel.topic.clone(), message.sequence, message.log_time, message.data.into_owned())
}

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

fn messages(entries: &[Entry]) -> Vec<&Entry> {
    entries.iter().filter(|entry| matches!(entry, Entry::Message { .. })).collect()
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

/// Recovers a file with these bytes, and reads the result with the `mcap` crate.
fn recovered(folder: &Path, bytes: &[u8]) -> Result<(tactus_record::Recovery, Vec<Raw>), RecordError> {
    let (path, out) = (folder.join("damaged.mcap"), folder.join("recovered.mcap"));
    fs::write(&path, bytes).unwrap();
    let recovery = recover(&path, &out)?;
    let messages = stock_messages(&fs::read(&out).unwrap());
    fs::remove_file(&out).unwrap();
    Ok((recovery, messages))
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
            panic!("cut at {cut}: {completeness}")
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
fn cut_at_every_byte_of_the_last_chunk_everything_before_it_comes_back() {
    let original = Original::of(Plan::short(1));
    let last = original.kind(op::CHUNK).last().unwrap();
    let lost = original.messages_of(&last).len();
    let kept = messages(&original.entries).len() - lost;
    for cut in last.start..last.end {
        let (entries, completeness) = read_all(&original.bytes[..cut]);
        assert!(original.entries.starts_with(&entries) && messages(&entries).len() == kept, "cut at {cut}");
        assert!(matches!(completeness, Completeness::Truncated { .. }), "cut at {cut}: {completeness}");
    }
    let dir = tempfile::tempdir().unwrap();
    for cut in [last.start, last.start + 1, last.start + 9, last.start + 40, last.end - 1] {
        let (recovery, messages) = recovered(dir.path(), &original.bytes[..cut]).unwrap();
        assert!(recovery.closed && recovery.info.exit_status == Some("crashed"), "cut at {cut}");
        assert_eq!(messages[..kept], original.messages[..kept]);
        assert_eq!(messages.len(), kept + 1, "the end of the run was added");
        assert_eq!(recovery.is_lossy, cut > last.start, "cut at {cut}");
    }
}

/// One byte of every chunk at a time, at places of every kind: the chunk may be lost, and nothing else.
#[test]
fn a_byte_flipped_in_any_chunk_costs_that_chunk_only() {
    let original = Original::of(Plan::short(1));
    let dir = tempfile::tempdir().unwrap();
    let chunks: Vec<_> = original.kind(op::CHUNK).collect();
    assert!(chunks.len() > 10, "{}", chunks.len());
    for (nth, chunk) in chunks.iter().enumerate() {
        let inside = original.messages_of(chunk);
        let rest: Vec<&Raw> = original.messages.iter().filter(|message| !inside.contains(message)).collect();
        // Kind, length, times, sizes, checksum, compression, size, content; other places in each chunk.
        let anywhere =
            (1..6).map(|part| 40 + (chunk.len() - 41) * (nth * 7 + part * 13) % (chunk.len() - 41));
        for offset in
            [0, 1, 2, 4, 8, 9, 17, 25, 33, 37, 41, 45, 46, 53, chunk.len() - 1].into_iter().chain(anywhere)
        {
            let mut bytes = original.bytes.clone();
            bytes[chunk.start + offset] ^= 0x41;
            let place = format!("chunk {nth}, byte {offset}");
            let (recovery, messages) = recovered(dir.path(), &bytes).unwrap();
            let is_whole = messages.starts_with(&original.messages);
            // The run's own end is in the last chunk; then an end is added.
            let copied = &messages[..messages.len() - usize::from(recovery.closed)];
            assert!(
                is_whole || copied.iter().collect::<Vec<_>>() == rest,
                "{place}: {} messages of {}: {}",
                messages.len(),
                original.messages.len(),
                recovery.damage
            );
            // Its kind, its length and its times are not needed to read it.
            assert!(is_whole || offset >= 25, "{place}");
            assert!(
                is_whole
                    || inside.is_empty()
                    || matches!(&recovery.damage, Completeness::Damaged(Damage { chunks: 1, .. })),
                "{place}: {}",
                recovery.damage
            );
            assert!(
                recovery.damage != Completeness::Complete && recovery.is_lossy,
                "{place}: {}",
                recovery.damage
            );
            let frames = inside.iter().filter(|(topic, ..)| topic.ends_with("frame")).count() as u64;
            let ends = nth + 1 == chunks.len();
            if !is_whole && !ends {
                assert_eq!(recovery.frames_missing, frames, "{place}");
                assert_eq!(recovery.info.exit_status, Some("done"), "{place}");
            }
            if !is_whole && ends {
                assert_eq!(recovery.info.exit_status, Some("failed"), "no crash: {place}");
            }
        }
    }
}

#[test]
fn any_byte_of_a_chunk_costs_that_chunk_at_most() {
    let original = Original::of(Plan::short(1));
    let chunks: Vec<_> = original.kind(op::CHUNK).collect();
    let [.., one, next, _] = chunks.as_slice() else { panic!("{}", chunks.len()) };
    let end =
        original.kind(op::MESSAGE_INDEX).map(|range| range.start).find(|start| *start == next.end).unwrap();
    let (whole, _) = read_all(&original.bytes[..end]);
    let whole = messages(&whole).len();
    let of_one = original.messages_of(one).len();
    assert!(of_one > 10);
    for at in one.clone() {
        let mut bytes = original.bytes[..end].to_vec();
        bytes[at] ^= 0x20;
        let (entries, completeness) = read_all(&bytes);
        let kept = messages(&entries).len();
        assert!(kept == whole || kept == whole - of_one, "byte {at}: {kept} of {whole}: {completeness}");
        let is_noticed = matches!(&completeness, Completeness::Damaged(Damage { places: 1, .. }));
        // Some bits of a chunk say nothing, and its times are in no checksum but the one over everything.
        assert!(is_noticed || kept == whole, "byte {at}: {completeness}");
    }
}

#[test]
fn a_byte_outside_of_the_chunks_costs_one_attachment_at_most() {
    let mut plan = Plan::short(1);
    plan.presses[0].depths_mm.truncate(1);
    let original = Original::of(Plan { idle_s: 1.0, ..plan });
    let all = messages(&original.entries).len();
    let files =
        |entries: &[Entry]| entries.iter().filter(|entry| matches!(entry, Entry::Attachment(_))).count();
    let heads = |range: Range<usize>| range.clone().take(10).chain(range.skip(10).step_by(997));
    let outside =
        original.records.iter().filter(|(kind, _)| *kind != op::CHUNK).map(|(_, range)| range.clone());
    // Message indexes are many and alike.
    let some = outside.clone().filter(|range| original.bytes[range.start] != op::MESSAGE_INDEX);
    let marks = [0..mcap::MAGIC.len(), original.bytes.len() - mcap::MAGIC.len()..original.bytes.len()];
    for at in outside.take(9).chain(some.skip(8).step_by(3)).chain(marks).flat_map(heads) {
        let mut bytes = original.bytes.clone();
        bytes[at] ^= 0x20;
        let (entries, completeness) = read_all(&bytes);
        assert_eq!(messages(&entries).len(), all, "byte {at}: {completeness}");
        assert!(completeness != Completeness::Complete, "byte {at} unnoticed");
        if at > original.index() + 13 {
            let index_only = match &completeness {
                Completeness::Damaged(damage) => damage.index_only,
                Completeness::Truncated { at_byte, .. } => *at_byte > original.index() as u64,
                Completeness::Complete => false,
            };
            assert!(index_only, "byte {at}: {completeness}");
        }
        let damaged_file = original.kind(op::ATTACHMENT).any(|range| range.contains(&at));
        assert!(files(&entries) + usize::from(damaged_file) >= files(&original.entries), "byte {at}");
    }
}

/// One byte in each record that is no chunk, through recovery: nothing of the run is missing afterwards.
#[test]
fn recovery_rebuilds_what_stands_around_the_chunks() {
    let original = Original::of(Plan::short(1));
    let dir = tempfile::tempdir().unwrap();
    let rig_json = original.kind(op::ATTACHMENT).next().unwrap();
    for (kind, place) in [
        (op::HEADER, 0),
        (op::HEADER, 3),
        (op::HEADER, 20),
        (op::METADATA, 0),
        (op::METADATA, 5),
        (op::METADATA, 12),
        (op::METADATA, 60),
        (op::ATTACHMENT, 0),
        (op::ATTACHMENT, 2),
        (op::ATTACHMENT, rig_json.len() / 2),
        (op::MESSAGE_INDEX, 0),
        (op::MESSAGE_INDEX, 1),
        (op::MESSAGE_INDEX, 11),
        (op::MESSAGE_INDEX, 20),
        (op::DATA_END, 0),
        (op::DATA_END, 1),
        (op::DATA_END, 10),
        (op::FOOTER, 0),
        (op::FOOTER, 1),
        (op::FOOTER, 12),
        (op::FOOTER, 27),
    ] {
        let record = original.kind(kind).next().unwrap();
        let mut bytes = original.bytes.clone();
        bytes[record.start + place] ^= 0x10;
        let (recovery, messages) = recovered(dir.path(), &bytes).unwrap();
        let place = format!("kind {kind}, byte {place}: {}", recovery.damage);
        assert!(messages == original.messages, "{place}");
        assert!(!recovery.closed && recovery.info.exit_status == Some("done"), "{place}");
        assert_eq!(recovery.frames_missing, 0, "{place}");
        assert_eq!(recovery.info.attachments.len(), 5, "{place}");
        assert_eq!(
            (recovery.info.run_id.as_str(), recovery.info.who.as_str()),
            ("20260325-100000-element-centres", "ada")
        );
    }
}

#[test]
fn two_damaged_chunks_and_a_cut_cost_just_these() {
    let original = Original::of(Plan::short(3));
    let chunks: Vec<_> = original.kind(op::CHUNK).collect();
    let (first, second, cut) = (&chunks[3], &chunks[9], &chunks[chunks.len() - 2]);
    let lost: BTreeSet<Raw> = [first, second, cut, &chunks[chunks.len() - 1]]
        .into_iter()
        .flat_map(|chunk| original.messages_of(chunk))
        .collect();
    let mut bytes = original.bytes[..cut.start + cut.len() / 2].to_vec();
    bytes[first.start + 100] ^= 1;
    // The length of the second one leads far beyond the end.
    bytes[second.start + 8] ^= 0x7f;
    bytes[second.start + 200] ^= 1;
    let dir = tempfile::tempdir().unwrap();
    let (recovery, messages) = recovered(dir.path(), &bytes).unwrap();
    let Completeness::Damaged(damage) = &recovery.damage else { panic!("{}", recovery.damage) };
    assert_eq!((damage.places, damage.chunks), (2, 2));
    assert_eq!(damage.at_byte, first.start as u64);
    assert_eq!(damage.bytes, (first.len() + second.len()) as u64);
    assert_eq!(damage.cut_at_byte, Some(cut.start as u64));
    let rest: Vec<&Raw> = original.messages.iter().filter(|message| !lost.contains(message)).collect();
    assert_eq!(messages[..messages.len() - 1].iter().collect::<Vec<_>>(), rest);
    assert_eq!(recovery.info.exit_status, Some("crashed"));
    assert!(recovery.frames_missing > 20, "{}", recovery.frames_missing);
    assert!(recovery.info.to_string().contains("MISSING"), "{}", recovery.info);
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
    assert!(made.closed && !made.is_lossy);
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
            let mut expected = whole.iter().filter(is_message);
            for message in entries.iter().filter(is_message) {
                prop_assert!(expected.any(|other| other == message), "flip at {at}");
            }
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
