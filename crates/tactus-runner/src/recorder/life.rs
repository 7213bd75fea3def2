//! Whether the recorder's thread goes on, hangs, or waits for the disk.

use std::io;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use tactus_record::{RecordError, Storage, SyncHandle};

use super::Gauge;

const ABSENT: u8 = 0;
const WORKING: u8 = 1;
const AT_DISK: u8 = 2;

/// Signs of life of the thread, without a clock: whoever looks has one.
#[derive(Debug, Default)]
pub(super) struct Life {
    beats: AtomicU64,
    /// Where the thread is.
    place: AtomicU8,
}

/// While it lives, the thread has to show that it goes on. It ends with the thread, also if that panics: an ended thread is told
/// by the queue that nobody reads.
#[derive(Debug)]
pub(super) struct Living(Gauge);

/// A storage whose calls show as waiting for the disk.
#[derive(Debug)]
pub(super) struct Watched<S> {
    storage: S,
    gauge: Gauge,
}

impl Life {
    /// The thread goes on.
    pub(super) fn beat(&self) {
        self.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// The number of beats; `None` if no thread works.
    pub(super) fn sign(&self) -> Option<u64> {
        let works = self.place.load(Ordering::Relaxed) == WORKING;
        works.then(|| self.beats.load(Ordering::Relaxed))
    }

    fn go_to(&self, place: u8) {
        self.beat();
        self.place.store(place, Ordering::Relaxed);
    }
}

impl Living {
    pub(super) fn begin(gauge: Gauge) -> Self {
        gauge.0.life.go_to(WORKING);
        Self(gauge)
    }
}

impl Drop for Living {
    fn drop(&mut self) {
        self.0.0.life.go_to(ABSENT);
    }
}

impl<S> Watched<S> {
    pub(super) fn new(storage: S, gauge: Gauge) -> Self {
        Self { storage, gauge }
    }

    fn at_disk<T>(&mut self, call: impl FnOnce(&mut S) -> T) -> T {
        self.gauge.0.life.go_to(AT_DISK);
        let done = call(&mut self.storage);
        self.gauge.0.life.go_to(WORKING);
        done
    }
}

impl<S: Storage> Storage for Watched<S> {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at_disk(|storage| storage.append(bytes))
    }

    fn keep_reserve(&mut self, bytes: u64) -> io::Result<()> {
        self.at_disk(|storage| storage.keep_reserve(bytes))
    }

    fn release_reserve(&mut self) {
        self.at_disk(Storage::release_reserve);
    }

    fn sync_handle(&self) -> io::Result<Box<dyn SyncHandle>> {
        self.storage.sync_handle()
    }

    fn close(&mut self) -> Result<u64, RecordError> {
        self.at_disk(Storage::close)
    }
}
