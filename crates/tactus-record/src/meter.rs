//! How far a job is with the files that it reads.
//!
//! A job says beforehand how often it reads which files; what this crate reads is then counted. The job runs on the thread that asked for it,
//! and the meter is that thread's: the functions that read files neither know of meters nor pass them on.

use std::{
    cell::{Cell, RefCell},
    fmt,
    fs::{self, File},
    io::{self, Read},
    path::Path,
    rc::Rc,
};

thread_local! {
    static METER: RefCell<Option<Rc<Meter>>> = const { RefCell::new(None) };
}

/// Counts what one job reads.
struct Meter {
    /// Bytes that the job will have read in all.
    due: Cell<u64>,
    read: Cell<u64>,
    tell: Box<dyn Fn(f64)>,
}

/// Does a job, and tells the share of its files that it has read, 0 to 1, after each piece.
pub fn metered<T>(tell: impl Fn(f64) + 'static, job: impl FnOnce() -> T) -> T {
    let meter = Rc::new(Meter { due: Cell::new(0), read: Cell::new(0), tell: Box::new(tell) });
    let _outer = Outer(METER.replace(Some(meter)));
    job()
}

/// Says that this thread is about to read each of the files so many times. Without a meter it does nothing.
pub fn will_read<P: AsRef<Path>>(paths: &[P], times: u64) {
    with(|meter| {
        // A file that is not there is its reader's to tell.
        let bytes = |path: &P| fs::metadata(path).map_or(0, |file| file.len());
        meter.due.set(meter.due.get() + times * paths.iter().map(bytes).sum::<u64>());
    });
}

/// Counts what was read.
pub(crate) fn count(bytes: u64) {
    with(|meter| {
        meter.read.set(meter.read.get() + bytes);
        if meter.due.get() > 0 {
            (meter.tell)((meter.read.get() as f64 / meter.due.get() as f64).min(1.0));
        }
    });
}

fn with(action: impl FnOnce(&Meter)) {
    let meter = METER.with_borrow(Clone::clone);
    if let Some(meter) = meter {
        action(&meter);
    }
}

/// The meter before this one, which comes back at the end of the job, also if that panics.
struct Outer(Option<Rc<Meter>>);

impl Drop for Outer {
    fn drop(&mut self) {
        METER.set(self.0.take());
    }
}

/// A file whose reading counts.
pub struct MeteredFile(pub(crate) File);

impl Read for MeteredFile {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let bytes = self.0.read(to)?;
        count(bytes as u64);
        Ok(bytes)
    }
}

impl fmt::Debug for MeteredFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
#[path = "meter_tests.rs"]
mod tests;
