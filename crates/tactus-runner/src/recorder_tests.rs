use std::collections::BTreeMap;
use std::io;
use std::iter;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tactus_engine::Record;
use tactus_record::{Header, RecordError, Recording, Script, Storage, SyncHandle, info};
use tactus_schema::{Frame, MonoTime, Rig, WallTime, pb};

use super::life::Living;
use super::{Gauge, ThreadRecorder};

const RIG_TOML: &str = include_str!("../../../config/rigs/sim.toml");

/// A disk of which each write waits for a permit, and reports that it waits.
struct HangingDisk {
    waits: Sender<()>,
    permits: Receiver<()>,
    bytes: Arc<Mutex<Vec<u8>>>,
    /// A sync that hangs, too.
    sync: SyncKind,
}

#[derive(Clone, Copy)]
enum SyncKind {
    Works,
    Hangs,
    NearlyFull,
}

/// The other end of a [`HangingDisk`].
struct DiskControl {
    waits: Receiver<()>,
    permits: Sender<()>,
    bytes: Arc<Mutex<Vec<u8>>>,
}

struct Sync(SyncKind);

impl SyncHandle for Sync {
    fn sync(&mut self) -> Result<(), RecordError> {
        match self.0 {
            SyncKind::Works | SyncKind::NearlyFull => Ok(()),
            SyncKind::Hangs => loop {
                std::thread::park();
            },
        }
    }

    fn free_bytes(&self) -> io::Result<u64> {
        Ok(if matches!(self.0, SyncKind::NearlyFull) { 20 * 1024 * 1024 } else { u64::MAX })
    }
}

impl Storage for HangingDisk {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        // Without somebody to give permits, the disk never answers.
        if self.waits.send(()).is_err() || self.permits.recv().is_err() {
            return Err(io::Error::from_raw_os_error(5));
        }
        self.bytes.lock().unwrap().extend_from_slice(bytes);
        Ok(())
    }

    fn keep_reserve(&mut self, _: u64) -> io::Result<()> {
        Ok(())
    }

    fn release_reserve(&mut self) {}

    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>> {
        Ok(Box::new(Sync(self.sync)))
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        Ok(0)
    }
}

fn hanging(sync: SyncKind) -> (HangingDisk, DiskControl) {
    let ((waits, waiting), (permits, permitted)) = (channel(), channel());
    let bytes = Arc::default();
    let disk = HangingDisk { waits, permits: permitted, bytes: Arc::clone(&bytes), sync };
    (disk, DiskControl { waits: waiting, permits, bytes })
}

/// A recorder with 17 frames: 16 fill a chunk, the next one closes it, and the disk hangs.
fn stuck_after_a_chunk(gauge: &Gauge) -> (ThreadRecorder, DiskControl) {
    let (disk, control) = hanging(SyncKind::Works);
    control.permits.send(()).unwrap();
    let mut recorder = start(begin(&path(), disk), gauge.clone()).unwrap();
    control.waits.recv().unwrap();
    (0..=16).for_each(|seq| recorder.frame(&frame(seq)).unwrap());
    control.waits.recv().unwrap();
    (recorder, control)
}

/// A recorder that writes each message at once.
fn start<S: Storage + 'static>(recording: Recording<S>, gauge: Gauge) -> io::Result<ThreadRecorder> {
    ThreadRecorder::start_gathering(Duration::ZERO, recording, gauge)
}

fn begin<S: Storage>(path: &Path, storage: S) -> Recording<S> {
    with_header(|header| Recording::begin(path.to_owned(), storage, header)).unwrap()
}

fn with_header<T>(use_it: impl FnOnce(&Header<'_>) -> T) -> T {
    use_it(&Header {
        run_id: "r1",
        experiment: "corners",
        who: "ada",
        rig: &Rig::from_toml(RIG_TOML).unwrap(),
        rig_toml: Some(RIG_TOML),
        link_toml: None,
        script: Script { name: "corners.star", source: "" },
        versions: &BTreeMap::new(),
        parameters_json: "{}",
        started: WallTime::from_ns(1),
        simulated: true,
        continues: None,
    })
}

/// A frame; 33 ms apart.
fn frame(seq: u64) -> Frame {
    let t_mono_ns = i64::try_from(seq).unwrap() * 33_333_333;
    pb::Frame { seq, counts: vec![1.0; 48], t_mono_ns, t_wall_ns: 1, ..pb::Frame::default() }.into()
}

fn path() -> PathBuf {
    PathBuf::from("/runs/r1/recording.mcap")
}

#[test]
fn a_disk_that_hangs_never_delays_the_engine_alarms_and_fails_the_run_after_a_second() {
    let gauge = Gauge::default();
    let (mut recorder, _control) = stuck_after_a_chunk(&gauge);
    let failed = (17..).find_map(|seq| recorder.frame(&frame(seq)).err().map(|error| (seq, error)));
    let (seq, error) = failed.unwrap();
    let now = MonoTime::from_ns(i64::try_from(seq).unwrap() * 33_333_333);
    let backlog = gauge.backlog(now);
    assert!(backlog > Duration::from_secs(1) && backlog < Duration::from_millis(1050), "{backlog:?}");
    assert!(gauge.waiting_bytes() > 1000);
    let alarm = gauge.take_alarm().unwrap();
    assert!(alarm.contains("the disk is late") && alarm.contains("for 0.5"), "{alarm}");
    assert_eq!(gauge.take_alarm(), None);
    let text = error.to_string();
    let waiting = seq + 1 - gauge.written();
    assert!(waiting >= 30 && text.contains(&format!("with {waiting} frames")), "{text}");
    assert!(text.contains("/runs/r1/recording.mcap"), "{text}");

    let error = recorder.finish_within(Duration::ZERO).unwrap_err().to_string();
    assert!(
        error.contains("did not answer") && error.contains(&format!("{} frames are not in", seq + 1)),
        "{error}"
    );
}

#[test]
fn what_found_the_queue_full_is_told_although_the_disk_comes_back() {
    let (mut recorder, control) = stuck_after_a_chunk(&Gauge::default());
    let all = 17 + 6000;
    // The run has failed after a second; what comes until the tip is up is offered all the same.
    let failed = (17..all).filter(|seq| recorder.frame(&frame(*seq)).is_err()).count();
    assert!(failed > 5900, "{failed}");
    for _ in 0..1000 {
        control.permits.send(()).unwrap();
    }
    let error = recorder.finish_within(Duration::from_mins(1)).unwrap_err().to_string();
    let kept = frames_in(&control);
    assert!(kept < all, "the queue was full");
    assert!(error.contains(&format!("with {} frames are not in it", all - kept)), "{kept}: {error}");
}

/// Number of frames that reached the disk.
fn frames_in(control: &DiskControl) -> u64 {
    let bytes = control.bytes.lock().unwrap().clone();
    let is_frame = |entry: &Result<_, _>| matches!(entry, Ok(tactus_record::Entry::Message { .. }));
    tactus_record::Reader::new(bytes.as_slice()).filter(is_frame).count() as u64
}

#[test]
fn a_disk_that_comes_back_in_time_loses_nothing() {
    let (mut recorder, control) = stuck_after_a_chunk(&Gauge::default());
    // 0.8 s of backlog.
    (17..=38).for_each(|seq| recorder.frame(&frame(seq)).unwrap());
    for _ in 0..10 {
        control.permits.send(()).unwrap();
    }
    recorder.finish_within(Duration::from_mins(1)).unwrap();
    assert_eq!(frames_in(&control), 39);
}

#[test]
fn the_end_of_a_run_does_not_wait_for_more_messages() {
    let (disk, control) = hanging(SyncKind::Works);
    (0..10).for_each(|_| control.permits.send(()).unwrap());
    let gauge = Gauge::default();
    let an_hour = Duration::from_hours(1);
    let mut recorder = ThreadRecorder::start_gathering(an_hour, begin(&path(), disk), gauge.clone()).unwrap();
    recorder.frame(&frame(0)).unwrap();
    while gauge.written() == 0 {
        std::thread::yield_now();
    }
    // The writer waits for more.
    (1..20).for_each(|seq| recorder.frame(&frame(seq)).unwrap());
    recorder.finish_within(Duration::from_mins(1)).unwrap();
    assert_eq!(frames_in(&control), 20);
}

#[test]
fn a_silence_of_the_devices_does_not_hide_a_disk_that_hangs() {
    let gauge = Gauge::default();
    let (mut recorder, _control) = stuck_after_a_chunk(&gauge);
    recorder.frame(&frame(17)).unwrap();
    let oldest = frame(gauge.written()).received.mono;
    recorder.check(oldest.after(Duration::from_millis(900))).unwrap();
    assert!(recorder.check(oldest.after(Duration::from_millis(1100))).is_err());
}

#[test]
fn a_disk_that_is_slow_to_sync_delays_nothing() {
    let (disk, control) = hanging(SyncKind::Hangs);
    for _ in 0..1000 {
        control.permits.send(()).unwrap();
    }
    let gauge = Gauge::default();
    let mut recorder = start(begin(&path(), disk), gauge.clone()).unwrap();
    // Ten seconds of frames, each once the one before is written.
    for seq in 0..300 {
        recorder.frame(&frame(seq)).unwrap();
        while gauge.written() <= seq {
            std::thread::yield_now();
        }
    }
    let unsynced = gauge.unsynced(MonoTime::from_ns(10_000_000_000)).unwrap();
    assert_eq!(unsynced, Duration::from_secs(10), "nothing is durable, and it shows");
    let alarm = gauge.take_alarm().unwrap();
    assert!(alarm.contains("a loss of power would cost the last"), "{alarm}");
    recorder.finish_within(Duration::from_mins(1)).unwrap();
}

#[test]
fn a_disk_error_is_the_runs_error_at_the_next_message() {
    let (disk, control) = hanging(SyncKind::Works);
    control.permits.send(()).unwrap();
    let gauge = Gauge::default();
    let mut recorder = start(begin(&path(), disk), gauge.clone()).unwrap();
    // The disk fails from now on.
    drop(control);
    let error = (0..).find_map(|seq| {
        let failed = recorder.frame(&frame(seq)).err();
        while gauge.written() <= seq {
            std::thread::yield_now();
        }
        failed
    });
    let text = error.unwrap().to_string();
    assert!(text.contains("cannot write /runs/r1/recording.mcap: Input/output error (os error 5)"), "{text}");
    let text = recorder.finish_within(Duration::from_mins(1)).unwrap_err().to_string();
    assert!(text.contains("(os error 5)") && text.contains("are missing"), "{text}");
}

/// A disk that makes the recorder's thread panic after the beginning of the file.
struct PanickingDisk {
    has_begun: bool,
}

impl Storage for PanickingDisk {
    fn append(&mut self, _: &[u8]) -> io::Result<()> {
        assert!(!std::mem::replace(&mut self.has_begun, true), "a recorder that panics, for a test");
        Ok(())
    }

    fn keep_reserve(&mut self, _: u64) -> io::Result<()> {
        Ok(())
    }

    fn release_reserve(&mut self) {}

    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>> {
        Ok(Box::new(Sync(SyncKind::Works)))
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        Ok(0)
    }
}

#[test]
fn a_recorder_that_panics_is_the_runs_error_at_the_next_message() {
    let gauge = Gauge::default();
    let disk = PanickingDisk { has_begun: false };
    let mut recorder = start(begin(&path(), disk), gauge.clone()).unwrap();
    // The seventeenth frame closes a chunk.
    (0..=16).for_each(|seq| recorder.frame(&frame(seq)).unwrap());
    assert!(recorder.ended.recv().is_err(), "the thread has ended without a result");
    // Of the same time, so that none is late.
    let error = iter::repeat_with(|| recorder.frame(&frame(16))).find_map(Result::err).unwrap();
    assert!(error.to_string().contains("the recording's thread ended early"), "{error}");
    assert_eq!(gauge.sign_of_life(), None, "the watchdog has nobody to wait for");
}

#[test]
fn a_folder_deleted_while_a_run_is_recorded_fails_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r1/recording.mcap");
    std::fs::create_dir(path.parent().unwrap()).unwrap();
    let recording = with_header(|header| Recording::create(&path, header)).unwrap();
    let gauge = Gauge::default();
    let mut recorder = start(recording, gauge.clone()).unwrap();
    recorder.frame(&frame(0)).unwrap();
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
    // Within the sync period a message fails.
    let error = (1..).find_map(|seq| {
        let failed = recorder.frame(&frame(seq)).err();
        while gauge.written() <= seq {
            std::thread::yield_now();
        }
        failed
    });
    let text = error.unwrap().to_string();
    assert!(text.contains("recording.mcap was deleted, moved or replaced"), "{text}");
    assert!(recorder.finish_within(Duration::from_mins(1)).is_err());
}

/// Waits until the frame is written, and no more than four seconds before it are not durable.
fn keep_synced(gauge: &Gauge, seq: u64) {
    let now = frame(seq).received.mono;
    while gauge.written() <= seq || gauge.unsynced(now).is_some_and(|age| age > Duration::from_secs(4)) {
        std::thread::yield_now();
    }
}

#[test]
fn what_was_recorded_is_made_durable_during_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.mcap");
    let recording = with_header(|header| Recording::create(&path, header)).unwrap();
    let gauge = Gauge::default();
    let mut recorder = start(recording, gauge.clone()).unwrap();
    for seq in 0..300 {
        recorder.frame(&frame(seq)).unwrap();
        keep_synced(&gauge, seq);
    }
    recorder.finish_within(Duration::from_mins(1)).unwrap();
    assert_eq!(info(&path).unwrap().frames, 300);
}

#[test]
fn a_disk_that_is_nearly_full_is_an_alarm_before_it_is_full() {
    let (disk, control) = hanging(SyncKind::NearlyFull);
    for _ in 0..1000 {
        control.permits.send(()).unwrap();
    }
    let gauge = Gauge::default();
    let mut recorder = start(begin(&path(), disk), gauge.clone()).unwrap();
    let alarm = (0..).find_map(|seq| {
        recorder.frame(&frame(seq)).unwrap();
        // The frames' clock waits for the thread that syncs: a slow disk would be another alarm.
        keep_synced(&gauge, seq);
        gauge.take_alarm()
    });
    assert_eq!(alarm.unwrap(), "the disk of the recordings is nearly full: 20 MiB are free");
    recorder.finish_within(Duration::from_mins(1)).unwrap();
}

#[test]
fn a_recorder_shows_that_it_goes_on_but_not_while_it_waits_for_the_disk() {
    let gauge = Gauge::default();
    assert_eq!(gauge.sign_of_life(), None, "nothing is recorded");
    let (recorder, control) = stuck_after_a_chunk(&gauge);
    assert_eq!(gauge.sign_of_life(), None, "it waits for the disk");
    (0..3).for_each(|_| control.permits.send(()).unwrap());
    let mut signs = Vec::new();
    // Without messages it beats four times a second.
    while signs.len() < 3 {
        signs.extend(gauge.sign_of_life().filter(|sign| signs.last() != Some(sign)));
        std::thread::yield_now();
    }
    assert!(signs.is_sorted());
    recorder.finish_within(Duration::from_mins(1)).unwrap();
    // The thread ends a moment after it has said so.
    while gauge.sign_of_life().is_some() {
        std::thread::yield_now();
    }
}

#[test]
fn a_recorder_that_hangs_in_its_own_code_shows_always_the_same() {
    let gauge = Gauge::default();
    let living = Living::begin(gauge.clone());
    let sign = gauge.sign_of_life();
    assert!(sign.is_some());
    assert_eq!(gauge.sign_of_life(), sign);
    drop(living);
    assert_eq!(gauge.sign_of_life(), None);
}
