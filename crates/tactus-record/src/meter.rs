//! How far a job is with the files that it reads.
//!
//! A job says beforehand which files it will read, how often, and how long that takes in comparison; what this crate reads is then
//! counted. The job runs on the thread that asked for it, and the meter is that thread's: the functions that read files neither know of
//! meters nor pass them on.

use std::{
    cell::{Cell, RefCell},
    collections::VecDeque,
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
    /// What it will still read, in order: the present pass first.
    passes: RefCell<VecDeque<Pass>>,
    /// Bytes that were read in the present one.
    read: Cell<u64>,
    /// Length of all passes, and of those that are over.
    whole: Cell<f64>,
    over: Cell<f64>,
    tell: Box<dyn Fn(f64)>,
}

/// One reading of one file.
#[derive(Clone, Copy)]
struct Pass {
    bytes: u64,
    /// Time for each byte, in any unit.
    cost: f64,
}

/// Does a job, and tells what share of it is done, 0 to 1, after each piece that it reads.
pub fn metered<T>(tell: impl Fn(f64) + 'static, job: impl FnOnce() -> T) -> T {
    let meter = Meter {
        passes: RefCell::default(),
        read: Cell::default(),
        whole: Cell::default(),
        over: Cell::default(),
        tell: Box::new(tell),
    };
    let _outer = Outer(METER.replace(Some(Rc::new(meter))));
    job()
}

/// Says that this thread is about to read a file, once for each of the costs, which say how long a byte takes in comparison with the other
/// passes. Without a meter it does nothing.
pub fn will_read(path: impl AsRef<Path>, costs: &[f64]) {
    with(|meter| {
        // A file that is not there is its reader's to tell.
        let bytes = fs::metadata(path).map_or(0, |file| file.len());
        for cost in costs {
            let pass = Pass { bytes, cost: *cost };
            meter.whole.set(meter.whole.get() + pass.length());
            meter.passes.borrow_mut().push_back(pass);
        }
    });
}

/// Counts what was read or, in a pass that reads what is in memory, the share of the file's bytes that it is at.
pub fn count(bytes: u64) {
    with(|meter| meter.count(bytes));
}

impl Meter {
    fn count(&self, bytes: u64) {
        // What is read before anything is announced is in no pass.
        if self.whole.get() <= 0.0 {
            return;
        }
        let mut passes = self.passes.borrow_mut();
        let mut read = self.read.get() + bytes;
        while let Some(pass) = passes.pop_front_if(|pass| read >= pass.bytes) {
            read -= pass.bytes;
            self.over.set(self.over.get() + pass.length());
        }
        self.read.set(read);
        let present = passes.front().map_or(0.0, |pass| read as f64 * pass.cost);
        (self.tell)(((self.over.get() + present) / self.whole.get()).min(1.0));
    }
}

impl Pass {
    fn length(&self) -> f64 {
        self.bytes as f64 * self.cost
    }
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

impl MeteredFile {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`File::open`].
    pub fn open(path: impl AsRef<Path>) -> io::Result<Self> {
        File::open(path).map(Self)
    }
}

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
