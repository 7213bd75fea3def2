use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use tactus_schema::{Frame, pb};

use super::Recording;
use crate::{
    Completeness, Entry, Message, Missing, Reader, RecordError, Storage, SyncHandle, channel::CHUNK_SPAN,
    fixtures::with_header,
};

/// Accepts bytes up to a limit, as a disk does, and shows them. The reserve takes some of the space.
#[derive(Clone)]
struct Disk(Arc<Mutex<DiskState>>);

struct DiskState {
    bytes: Vec<u8>,
    limit_bytes: u64,
    reserve_bytes: u64,
}

impl Disk {
    fn new(limit_bytes: u64) -> Self {
        Self(Arc::new(Mutex::new(DiskState { bytes: Vec::new(), limit_bytes, reserve_bytes: 0 })))
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().bytes.clone()
    }

    /// With the reserve.
    fn taken_bytes(&self) -> u64 {
        let disk = self.0.lock().unwrap();
        disk.bytes.len() as u64 + disk.reserve_bytes
    }

    fn limit(&self, limit_bytes: u64) {
        self.0.lock().unwrap().limit_bytes = limit_bytes;
    }
}

impl Storage for Disk {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut disk = self.0.lock().unwrap();
        if disk.bytes.len() as u64 + bytes.len() as u64 + disk.reserve_bytes > disk.limit_bytes {
            return Err(io::Error::from_raw_os_error(28));
        }
        disk.bytes.extend_from_slice(bytes);
        Ok(())
    }

    fn keep_reserve(&mut self, bytes: u64) -> io::Result<()> {
        let mut disk = self.0.lock().unwrap();
        if disk.bytes.len() as u64 + bytes > disk.limit_bytes {
            return Err(io::Error::from_raw_os_error(28));
        }
        disk.reserve_bytes = bytes;
        Ok(())
    }

    fn release_reserve(&mut self) {
        self.0.lock().unwrap().reserve_bytes = 0;
    }

    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>> {
        Err(io::ErrorKind::Unsupported.into())
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        Ok(self.bytes().len() as u64)
    }
}

fn begin(disk: &Disk) -> Result<Recording<Disk>, RecordError> {
    with_header(|header| Recording::begin(PathBuf::from("/runs/r1/recording.mcap"), disk.clone(), header))
}

fn frame(seq: u64) -> Frame {
    frame_at(seq, i64::try_from(seq).unwrap() * 33_333_333)
}

fn frame_at(seq: u64, mono_ns: i64) -> Frame {
    let counts = (0..48_u16).map(|element| f32::from(element) + (seq % 97) as f32).collect();
    pb::Frame { seq, counts, t_mono_ns: mono_ns, t_wall_ns: 1, ..pb::Frame::default() }.into()
}

fn entries(bytes: &[u8]) -> Vec<Entry> {
    Reader::new(bytes).map(Result::unwrap).collect()
}

fn durable_frames(disk: &Disk) -> u64 {
    let bytes = disk.bytes();
    let is_frame = |entry: &Entry| matches!(entry, Entry::Message { message: Message::Frame(_), .. });
    entries(&bytes).iter().filter(|entry| is_frame(entry)).count() as u64
}

#[test]
fn a_killed_process_loses_at_most_one_chunk_span() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    let spanned = u64::try_from(CHUNK_SPAN.as_millis() * 30 / 1000).unwrap() + 1;
    for seq in 0..100 {
        recording.write(&frame(seq)).unwrap();
        // A kill would leave what is on the disk now.
        let lost = seq + 1 - durable_frames(&disk);
        assert!(lost <= spanned, "{lost} frames at risk after frame {seq}");
    }
    recording.flush().unwrap();
    assert_eq!(durable_frames(&disk), 100);
}

#[test]
fn the_header_is_stored_before_the_first_message() {
    let disk = Disk::new(u64::MAX);
    let _recording = begin(&disk).unwrap();
    let entries = entries(&disk.bytes());
    assert!(matches!(&entries[0], Entry::Run(run) if run.run_id == "r1" && run.script == "corners.star"));
    let names: Vec<&str> = entries[1..]
        .iter()
        .map(|entry| {
            let Entry::Attachment(file) = entry else { panic!("{entry:?}") };
            file.name.as_str()
        })
        .collect();
    assert_eq!(
        names,
        ["rig.json", "rig.toml", "link.toml", "corners.star", "versions.json", "parameters.json"]
    );
}

#[test]
fn a_clock_that_runs_backwards_does_not_hold_messages_back() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    recording.write(&frame_at(0, 1000)).unwrap();
    recording.write(&frame_at(1, 10)).unwrap();
    assert_eq!(durable_frames(&disk), 1);
}

#[test]
fn a_recording_dropped_unfinished_ends_with_its_last_chunk() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    for seq in 0..100 {
        recording.write(&frame(seq)).unwrap();
    }
    let before = disk.bytes();
    drop(recording);
    assert!(disk.bytes() == before);
}

#[test]
fn a_full_disk_names_the_cause_and_the_reserve_holds_the_end_of_the_recording() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    let begun_bytes = disk.taken_bytes();
    disk.limit(begun_bytes + 20_000);
    let failed = (0..10_000).find(|seq| recording.write(&frame(*seq)).is_err()).unwrap();
    assert!(failed > 100, "the reserve was not used up first: {failed}");
    // What comes until the run has ended is not lost, for the reserve has room.
    for seq in failed + 1..failed + 60 {
        let error = recording.write(&frame(seq)).unwrap_err();
        let text = error.to_string();
        assert_eq!(
            text, "cannot write /runs/r1/recording.mcap: No space left on device (os error 28)",
            "each later call says the same"
        );
    }
    let error = recording.finish().unwrap_err();
    let RecordError::Store { missing, .. } = &error else { panic!("{error}") };
    assert_eq!(*missing, Missing { told: true, ..Missing::default() });
    assert!(error.to_string().contains("(os error 28); nothing is missing"), "{error}");

    let bytes = disk.bytes();
    let mut reader = Reader::new(bytes.as_slice());
    let events: Vec<pb::RunEvent> = reader
        .by_ref()
        .filter_map(|entry| match entry.unwrap() {
            Entry::Message { message: Message::Event(event), .. } => Some(*event),
            Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => None,
        })
        .collect();
    assert_eq!(reader.completeness(), Some(&Completeness::Complete));
    assert_eq!(durable_frames(&disk), failed + 60);
    let [pb::RunEvent { event: Some(pb::run_event::Event::Finished(finished)), .. }] = events.as_slice()
    else {
        panic!("{events:?}")
    };
    assert_eq!(finished.exit_status(), pb::ExitStatus::Failed);
    assert!(finished.message.contains("No space left on device"), "{}", finished.message);
}

#[test]
fn more_than_the_reserve_holds_is_counted() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    let begun_bytes = disk.taken_bytes();
    disk.limit(begun_bytes);
    let given = 60_000;
    for seq in 0..given {
        drop(recording.write(&frame(seq)));
    }
    let error = recording.finish().unwrap_err();
    let RecordError::Store { missing, .. } = &error else { panic!("{error}") };
    assert!(missing.frames > 0 && missing.messages == missing.frames, "{missing:?}");
    assert_eq!(durable_frames(&disk) + missing.frames, given, "received = recorded + missing");
    assert!(error.to_string().contains(&format!("{} messages are missing", missing.messages)), "{error}");
}

#[test]
fn a_disk_that_takes_nothing_any_more_is_told_with_all_that_is_missing() {
    let disk = Disk::new(u64::MAX);
    let mut recording = begin(&disk).unwrap();
    for seq in 0..40 {
        recording.write(&frame(seq)).unwrap();
    }
    disk.limit(0);
    for seq in 40..80 {
        drop(recording.write(&frame(seq)));
    }
    let error = recording.finish().unwrap_err();
    let RecordError::Store { missing, .. } = &error else { panic!("{error}") };
    // The event that closes the run is missing, too.
    assert_eq!((missing.frames, missing.messages), (80 - durable_frames(&disk), 81 - durable_frames(&disk)));
    assert!(missing.unclosed && error.to_string().contains("`tactus recover`"), "{error}");
}

#[test]
fn a_disk_without_room_for_the_start_gives_no_recording() {
    assert!(matches!(begin(&Disk::new(1000)), Err(RecordError::Store { .. })));
}

#[test]
fn a_file_is_locked_while_it_is_written_and_its_reserve_has_no_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("recording.mcap");
    let recording = with_header(|header| Recording::create(&path, header)).unwrap();
    let names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["recording.mcap"]);
    assert!(fs::File::open(&path).unwrap().try_lock().is_err());
    recording.finish().unwrap();
    assert!(fs::File::open(&path).unwrap().try_lock().is_ok());
}

/// A recording with a few frames, and what became of it after something was done to its file.
fn after(do_it: impl FnOnce(&Path)) -> (RecordError, RecordError) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("r1");
    fs::create_dir(&folder).unwrap();
    let path = folder.join("recording.mcap");
    let mut recording = with_header(|header| Recording::create(&path, header)).unwrap();
    let mut sync = recording.sync_handle().unwrap();
    for seq in 0..40 {
        recording.write(&frame(seq)).unwrap();
    }
    sync.sync().unwrap();
    do_it(&path);
    (sync.sync().unwrap_err(), recording.finish().unwrap_err())
}

#[test]
fn a_file_that_is_deleted_moved_or_replaced_is_noticed_while_it_is_written_and_at_the_end() {
    let deleted = |path: &Path| fs::remove_file(path).unwrap();
    let without_folder = |path: &Path| fs::remove_dir_all(path.parent().unwrap()).unwrap();
    let moved = |path: &Path| fs::rename(path, path.with_extension("old")).unwrap();
    let folder_moved = |path: &Path| {
        let folder = path.parent().unwrap();
        fs::rename(folder, folder.with_extension("old")).unwrap();
    };
    let replaced = |path: &Path| {
        fs::remove_file(path).unwrap();
        fs::write(path, "something else").unwrap();
    };
    let all: [&dyn Fn(&Path); 5] = [&deleted, &without_folder, &moved, &folder_moved, &replaced];
    for do_it in all {
        let (while_written, at_end) = after(do_it);
        assert!(matches!(while_written, RecordError::Vanished { .. }), "{while_written}");
        assert!(matches!(at_end, RecordError::Vanished { .. }), "{at_end}");
        assert!(at_end.to_string().contains("recording.mcap was deleted"), "{at_end}");
    }
}
