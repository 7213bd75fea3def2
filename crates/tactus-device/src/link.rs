//! An open link to a device: a driver reads, writes and waits for deadlines on it.

use std::cell::Cell;
use std::future::poll_fn;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use futures_util::FutureExt;
use tactus_schema::{MonoTime, TimeStamp};
use tokio::io::{AsyncWriteExt, ReadBuf};
use tokio::task::yield_now;
use tokio::time::{Instant, Sleep, sleep_until, timeout};

use crate::transport::ByteStream;
use crate::{Clock, DeviceError, ErrorKind};

/// A device that does not accept a command within this time is taken as disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Size of a read: room for many frames.
const READ_BYTES: usize = 4096;

thread_local! {
    /// Where the links of a thread read to. Each keeps only what it has received, which is a frame or two: a service has thousands of links.
    static ROOM: Cell<Vec<u8>> = const { Cell::new(Vec::new()) };
}

/// An open link to a device.
pub(crate) struct Link {
    stream: Box<dyn ByteStream>,
    /// Size of a read.
    read_bytes: usize,
    /// What was read last.
    received: Vec<u8>,
    /// One for all deadlines: to move it to a later one costs almost nothing, and every frame does.
    timer: Pin<Box<Sleep>>,
    /// The deadline was reached, and the next event is it, unless it has been moved.
    is_due: bool,
    clock: Clock,
    device: String,
}

/// An event on a link.
pub(crate) enum LinkEvent<'a> {
    /// Bytes arrived.
    Received(&'a [u8]),
    /// The deadline was reached.
    Deadline,
}

impl Link {
    pub(crate) fn new(stream: Box<dyn ByteStream>, clock: Clock, device: String) -> Self {
        let timer = Box::pin(sleep_until(Instant::now()));
        let (read_bytes, received) = (READ_BYTES, Vec::new());
        Self { stream, read_bytes, received, timer, is_due: false, clock, device }
    }

    /// The same link, with room for at least `bytes` in one read: for packets, which come in one piece.
    pub(crate) fn reading_at_least(self, bytes: usize) -> Self {
        Self { read_bytes: bytes.max(READ_BYTES), ..self }
    }

    /// Waits for bytes or the deadline. Cancel-safe.
    ///
    /// What has arrived comes before the deadline, although this computer may look at both late: a device is not silent because its host
    /// was. But only one read does: a device that sends without pause must not delay the deadline.
    pub(crate) async fn next(
        &mut self,
        deadline: Option<Duration>,
    ) -> Result<(TimeStamp, LinkEvent<'_>), DeviceError> {
        let deadline = deadline.map(|deadline| self.clock.instant(MonoTime::default().after(deadline)));
        if let Some(deadline) = deadline.filter(|deadline| self.timer.deadline() != *deadline) {
            self.timer.as_mut().reset(deadline);
            self.is_due = false;
        }
        let read = if self.is_due && deadline.is_some() {
            None
        } else {
            tokio::select! {
                biased;
                () = self.timer.as_mut(), if deadline.is_some() => self.read_what_has_arrived().await,
                read = poll_fn(|context| {
                    read(&mut *self.stream, self.read_bytes, &mut self.received, context)
                }) => Some(read),
            }
        };
        let now = self.clock.now();
        // After a read at the deadline.
        self.is_due =
            read.is_some() && deadline.is_some_and(|deadline| deadline <= self.clock.instant(now.mono));
        match read {
            None => Ok((now, LinkEvent::Deadline)),
            Some(Ok(0)) => Err(DeviceError::disconnected(&self.device, None)),
            Some(Ok(_)) => Ok((now, LinkEvent::Received(&self.received))),
            Some(Err(error)) => Err(DeviceError::disconnected(&self.device, Some(error))),
        }
    }

    /// A read, if there is something to read.
    async fn read_what_has_arrived(&mut self) -> Option<io::Result<usize>> {
        // The runtime looks at what has arrived before it goes on here.
        yield_now().await;
        let Self { stream, read_bytes, received, .. } = self;
        poll_fn(|context| read(&mut **stream, *read_bytes, received, context)).now_or_never()
    }

    /// Writes everything.
    pub(crate) async fn send(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        match timeout(WRITE_TIMEOUT, self.stream.write_all(bytes)).await {
            Ok(written) => written.map_err(|error| DeviceError::disconnected(&self.device, Some(error))),
            Err(_) => Err(DeviceError::new(&self.device, ErrorKind::Timeout, "it takes no bytes")),
        }
    }
}

/// Reads at most so many bytes; returns how many were received.
fn read(
    stream: &mut dyn ByteStream,
    bytes: usize,
    received: &mut Vec<u8>,
    context: &mut Context<'_>,
) -> Poll<io::Result<usize>> {
    let mut room = ROOM.take();
    if room.len() < bytes {
        room.resize(bytes, 0);
    }
    let mut buffer = ReadBuf::new(room.get_mut(..bytes).unwrap_or_default());
    let read = Pin::new(stream).poll_read(context, &mut buffer);
    if read.is_ready() {
        received.clear();
        received.extend_from_slice(buffer.filled());
    }
    ROOM.set(room);
    read.map_ok(|()| received.len())
}

/// The time of a session: since the start of the clock.
pub(crate) fn since_start(stamp: TimeStamp) -> Duration {
    stamp.mono.since(MonoTime::default())
}

#[cfg(test)]
#[path = "link_tests.rs"]
mod tests;
