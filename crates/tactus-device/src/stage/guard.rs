//! The guard: it stops the stage if its driver hangs or dies while a command is under way.
//!
//! The driver gives signs of life. A thread of its own, which shares nothing with the driver's runtime, watches for them,
//! and writes the stop to the device itself when they cease. It begins with a command, and lives on for a while after the last.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use tactus_schema::MonoTime;

use crate::Clock;

/// Longest time without a sign of life while a command is under way. With [`LOOK`] it is below 100 ms to the stop.
const HANG_MAX: Duration = Duration::from_millis(80);

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(10);

/// The thread ends if no command has begun for this long: of many rigs, few move.
const REST: Duration = Duration::from_secs(10);

/// How often a driver with a command under way gives a sign of life.
pub(super) const SIGN_OF_LIFE: Duration = Duration::from_millis(20);

/// The driver's end of the guard. Without a second way to the device it only keeps the signs of life.
#[derive(Debug)]
pub(super) struct Guard {
    shared: Arc<Shared>,
}

/// When the driver last gave a sign of life.
#[derive(Debug, Clone)]
pub(super) struct Heartbeat(Arc<AtomicI64>);

#[derive(Debug)]
struct Shared {
    clock: Clock,
    /// See [`REST`].
    rest: Duration,
    heartbeat: Heartbeat,
    watch: Mutex<Watch>,
    changed: Condvar,
    /// The stop was written, and the driver does not know it yet.
    has_fired: AtomicBool,
}

/// What the thread watches.
#[derive(Default)]
struct Watch {
    /// A second way to the device; `None` while no device is open.
    writer: Option<Box<dyn Write + Send>>,
    /// Bytes that stop the command under way; `None` without one.
    halt: Option<Vec<u8>>,
    /// Somebody looks, or will look.
    has_thread: bool,
    /// A command is about to begin.
    is_awaited: bool,
    /// The driver is gone: the thread ends.
    is_over: bool,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("halt", &self.halt).finish_non_exhaustive()
    }
}

impl Guard {
    pub(super) fn new(clock: Clock) -> Self {
        Self::resting_after(clock, REST)
    }

    fn resting_after(clock: Clock, rest: Duration) -> Self {
        let shared = Shared {
            clock,
            rest,
            heartbeat: Heartbeat(Arc::default()),
            watch: Mutex::default(),
            changed: Condvar::new(),
            has_fired: AtomicBool::new(false),
        };
        Self { shared: Arc::new(shared) }
    }

    pub(super) fn heartbeat(&self) -> Heartbeat {
        self.shared.heartbeat.clone()
    }

    /// A device was opened. `writer` is a second way to it, if it has one.
    pub(super) fn open(&mut self, writer: Option<Box<dyn Write + Send>>) {
        let mut watch = self.shared.watch();
        (watch.writer, watch.halt) = (writer, None);
    }

    /// Sees to it that somebody looks before a command begins. A stage that is not simulated `needs` somebody.
    ///
    /// # Errors
    /// If nobody can. Then nothing may move.
    pub(super) fn ready(&self, needs: bool) -> io::Result<()> {
        let mut watch = self.shared.watch();
        if needs && watch.writer.is_none() {
            let why = "its transport has no second way to write a stop; use kind = \"serial\" or \"tcp\"";
            return Err(io::Error::new(io::ErrorKind::Unsupported, why));
        }
        if watch.writer.is_some() && !watch.has_thread {
            let (shared, span) = (Arc::clone(&self.shared), tracing::Span::current());
            let guard = move || span.in_scope(|| shared.guard());
            thread::Builder::new().name("stage-guard".into()).spawn(guard)?;
            watch.has_thread = true;
        }
        watch.is_awaited = true;
        Ok(())
    }

    /// A command begins, which `halt` stops.
    pub(super) fn begin(&self, halt: Vec<u8>) {
        self.sign_of_life();
        let mut watch = self.shared.watch();
        (watch.halt, watch.is_awaited) = (Some(halt), false);
        drop(watch);
        self.shared.changed.notify_one();
    }

    /// The command has ended.
    pub(super) fn end(&self) {
        self.shared.watch().halt = None;
    }

    /// True if there is somebody to notice that the driver hangs.
    pub(super) fn is_guarding(&self) -> bool {
        self.shared.watch().has_thread
    }

    /// The bytes that stop the command under way.
    pub(super) fn halt(&self) -> Option<Vec<u8>> {
        self.shared.watch().halt.clone()
    }

    /// The driver lives.
    pub(super) fn sign_of_life(&self) {
        self.shared.heartbeat.beat(self.shared.clock.now().mono);
    }

    /// True once after the guard has written the stop.
    pub(super) fn has_fired(&self) -> bool {
        self.shared.has_fired.swap(false, Ordering::SeqCst)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        self.shared.watch().is_over = true;
        self.shared.changed.notify_one();
    }
}

impl Heartbeat {
    pub(super) fn last(&self) -> MonoTime {
        MonoTime::from_ns(self.0.load(Ordering::SeqCst))
    }

    fn beat(&self, now: MonoTime) {
        self.0.store(now.ns(), Ordering::SeqCst);
    }
}

impl Shared {
    fn watch(&self) -> MutexGuard<'_, Watch> {
        // What a panic left is as good as what was there before.
        self.watch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The thread's work.
    fn guard(&self) {
        let mut watch = self.watch();
        while !watch.is_over {
            if watch.halt.is_none() {
                let (rested, waited) =
                    self.changed.wait_timeout(watch, self.rest).unwrap_or_else(PoisonError::into_inner);
                watch = rested;
                if waited.timed_out() && watch.halt.is_none() && !watch.is_awaited {
                    break;
                }
                continue;
            }
            let silent = self.clock.now().mono.since(self.heartbeat.last());
            if silent >= HANG_MAX {
                self.fire(&mut watch, silent);
            }
            let waited = self.changed.wait_timeout(watch, LOOK).unwrap_or_else(PoisonError::into_inner);
            watch = waited.0;
        }
        // Under the lock: the next command begins another one.
        watch.has_thread = false;
    }

    /// Writes the stop, at each look until the driver lives again.
    fn fire(&self, watch: &mut Watch, silent: Duration) {
        let Watch { writer: Some(writer), halt: Some(halt), .. } = watch else { return };
        let written = writer.write_all(halt);
        // Only now: a driver that learns of the stop has it behind it, so that what it sends next comes after it.
        let is_first = !self.has_fired.swap(true, Ordering::SeqCst);
        if let Err(error) = written {
            tracing::error!(%error, ?silent, "the stage's driver hangs, and the stop cannot be written");
        } else if is_first {
            tracing::error!(?silent, "the stage's driver hangs: the stage was stopped without it");
        }
    }
}

#[cfg(test)]
#[path = "guard_tests.rs"]
pub(super) mod tests;
