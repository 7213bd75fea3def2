//! A queue of lines to a thread that may wait for its reader for ever.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use tracing_subscriber::fmt::MakeWriter;

use crate::LogFormat;

/// Longest line in bytes. The rest is cut off; the line then ends with its length.
pub const LINE_MAX_BYTES: usize = 8 << 10;

/// Most bytes that wait for the reader. A line that does not fit is dropped and counted.
pub const QUEUE_MAX_BYTES: usize = 1 << 20;

/// Memory of an entry of the queue besides its bytes, rounded up.
const ENTRY_BYTES: usize = 64;

/// Pause before a write is tried again on an output that must not be waited for, such as a shared terminal.
const RETRY: Duration = Duration::from_millis(20);

/// Lines to a slow output. Writing a line never waits: a thread of its own hands the lines on.
///
/// Overflow policy: when [`QUEUE_MAX_BYTES`] wait, new lines are dropped. Once the output takes lines again, the number of
/// dropped lines stands at their place.
#[derive(Debug, Clone)]
pub struct Lines {
    shared: Arc<Shared>,
    format: LogFormat,
}

#[derive(Debug, Default)]
struct Shared {
    queue: Mutex<Queue>,
    /// The queue has a new entry, or has become empty.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Queue {
    entries: VecDeque<Entry>,
    /// Size of the entries, with the one that is being written.
    bytes: usize,
}

#[derive(Debug)]
enum Entry {
    Line(Vec<u8>),
    /// So many lines were dropped here.
    Dropped(u64),
}

impl Entry {
    fn bytes(&self) -> usize {
        match self {
            Self::Line(line) => ENTRY_BYTES + line.len(),
            Self::Dropped(_) => ENTRY_BYTES,
        }
    }
}

thread_local! {
    /// On the writing thread only: the line that is logged about dropped lines, which must not be queued behind others.
    static NOTE: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

impl Lines {
    /// Starts the thread that writes to `out`. `tell_dropped` logs how many lines were dropped; it is called on that thread.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(
        out: impl Write + Send + 'static,
        format: LogFormat,
        tell_dropped: impl Fn(u64) + Send + 'static,
    ) -> io::Result<Self> {
        let shared = Arc::<Shared>::default();
        let to_write = Arc::clone(&shared);
        thread::Builder::new().name("log".into()).spawn(move || write_all(&to_write, out, &tell_dropped))?;
        Ok(Self { shared, format })
    }

    /// Waits until everything is written, at most for `timeout`. False if something is not.
    pub fn flush(&self, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        let mut queue = self.shared.queue();
        while queue.bytes > 0 {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            queue = self.shared.changed.wait_timeout(queue, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }
}

impl Shared {
    /// Held for the moment of a change only, never while a line is written.
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, line: Vec<u8>) {
        let mut queue = self.queue();
        let entry = Entry::Line(line);
        if queue.bytes + entry.bytes() <= QUEUE_MAX_BYTES {
            queue.bytes += entry.bytes();
            queue.entries.push_back(entry);
        } else if let Some(Entry::Dropped(lines)) = queue.entries.back_mut() {
            *lines += 1;
        } else {
            // Beyond the limit, but there is at most one for each line.
            let entry = Entry::Dropped(1);
            queue.bytes += entry.bytes();
            queue.entries.push_back(entry);
        }
        drop(queue);
        self.changed.notify_all();
    }

    /// Waits for the first entry. It stays counted until [`Shared::written`].
    fn next(&self) -> Entry {
        let mut queue = self.queue();
        loop {
            match queue.entries.pop_front() {
                Some(entry) => return entry,
                None => queue = self.changed.wait(queue).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }

    fn written(&self, bytes: usize) {
        let mut queue = self.queue();
        queue.bytes -= bytes;
        let is_empty = queue.bytes == 0;
        drop(queue);
        if is_empty {
            self.changed.notify_all();
        }
    }
}

/// The writing thread. It ends with the process.
fn write_all(shared: &Shared, mut out: impl Write, tell_dropped: &impl Fn(u64)) {
    loop {
        let entry = shared.next();
        let bytes = entry.bytes();
        let line = match entry {
            Entry::Line(line) => line,
            Entry::Dropped(lines) => {
                NOTE.set(Some(Vec::new()));
                tell_dropped(lines);
                NOTE.take().unwrap_or_default()
            }
        };
        // An output that is gone, such as a closed pipe, loses lines and nothing else.
        let _gone = write_patiently(&mut out, &line);
        shared.written(bytes);
    }
}

/// As `write_all`, also on an output in non-blocking mode.
fn write_patiently(out: &mut impl Write, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match out.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => thread::sleep(RETRY),
            Err(error) => return Err(error),
        }
    }
    out.flush()
}

/// Shortens a line that is too long. A JSON line stays one JSON object.
fn cut(mut line: Vec<u8>, format: LogFormat) -> Vec<u8> {
    let bytes = line.len();
    if bytes <= LINE_MAX_BYTES {
        return line;
    }
    line.truncate(LINE_MAX_BYTES);
    let kept = String::from_utf8_lossy(&line);
    let kept = kept.trim_end_matches(char::REPLACEMENT_CHARACTER);
    match format {
        LogFormat::Text => format!("{kept} ... (a line of {bytes} bytes)\n").into_bytes(),
        LogFormat::Json => format!("{}\n", serde_json::json!({ "cut": kept, "bytes": bytes })).into_bytes(),
    }
}

impl<'a> MakeWriter<'a> for Lines {
    type Writer = Line<'a>;

    fn make_writer(&'a self) -> Line<'a> {
        Line(&self.shared, self.format)
    }
}

/// Takes one line for the queue.
#[derive(Debug)]
pub struct Line<'a>(&'a Shared, LogFormat);

impl Write for Line<'_> {
    /// Takes a whole line, as log subscribers write them. Never fails.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let is_note = NOTE.with_borrow_mut(|note| note.as_mut().map(|note| note.extend(bytes)).is_some());
        if !is_note {
            self.0.push(cut(bytes.to_vec(), self.1));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
