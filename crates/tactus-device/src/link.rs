//! An open link to a device: a driver reads, writes and waits for deadlines on it.

use std::pin::Pin;
use std::time::Duration;

use tactus_schema::{MonoTime, TimeStamp};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{Instant, Sleep, sleep_until, timeout};

use crate::transport::ByteStream;
use crate::{Clock, DeviceError, ErrorKind};

/// A device that does not accept a command within this time is taken as disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Size of a read: room for many frames. Every link has one all the time.
const BUFFER_BYTES: usize = 4096;

/// An open link to a device.
pub(crate) struct Link {
    stream: Box<dyn ByteStream>,
    buffer: Box<[u8]>,
    /// One for all deadlines: to move it to a later one costs almost nothing, and every frame does.
    timer: Pin<Box<Sleep>>,
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
        Self { stream, buffer: vec![0; BUFFER_BYTES].into(), timer, clock, device }
    }

    /// The same link, with room for at least `bytes` in one read: for packets, which come in one piece.
    pub(crate) fn reading_at_least(self, bytes: usize) -> Self {
        Self { buffer: vec![0; bytes.max(BUFFER_BYTES)].into(), ..self }
    }

    /// Waits for bytes or the deadline. Cancel-safe.
    pub(crate) async fn next(
        &mut self,
        deadline: Option<Duration>,
    ) -> Result<(TimeStamp, LinkEvent<'_>), DeviceError> {
        if let Some(deadline) = deadline {
            let deadline = self.clock.instant(MonoTime::default().after(deadline));
            if self.timer.deadline() != deadline {
                self.timer.as_mut().reset(deadline);
            }
        }
        let read = tokio::select! {
            // The deadline comes first: a device that sends without pause must not delay it.
            biased;
            () = self.timer.as_mut(), if deadline.is_some() => None,
            read = self.stream.read(&mut self.buffer) => Some(read),
        };
        let now = self.clock.now();
        match read {
            None => Ok((now, LinkEvent::Deadline)),
            Some(Ok(0)) => Err(DeviceError::disconnected(&self.device, None)),
            Some(Ok(count)) => Ok((now, LinkEvent::Received(self.buffer.get(..count).unwrap_or_default()))),
            Some(Err(error)) => Err(DeviceError::disconnected(&self.device, Some(error))),
        }
    }

    /// Writes everything.
    pub(crate) async fn send(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        match timeout(WRITE_TIMEOUT, self.stream.write_all(bytes)).await {
            Ok(written) => written.map_err(|error| DeviceError::disconnected(&self.device, Some(error))),
            Err(_) => Err(DeviceError::new(&self.device, ErrorKind::Timeout, "it takes no bytes")),
        }
    }
}

/// The time of a session: since the start of the clock.
pub(crate) fn since_start(stamp: TimeStamp) -> Duration {
    stamp.mono.since(MonoTime::default())
}
