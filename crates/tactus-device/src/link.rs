//! An open link: what a driver reads, writes and waits for.

use std::time::Duration;

use tactus_schema::{MonoTime, TimeStamp};
use tactus_wire::declared::MAX_FRAME_BYTES;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{sleep_until, timeout};

use crate::transport::ByteStream;
use crate::{Clock, DeviceError, ErrorKind};

/// A device that does not take a command within this is not there any more.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// Read at once: many frames' worth, and the longest packet whole.
const BUFFER_BYTES: usize = MAX_FRAME_BYTES;

/// An open link, the clock, and the device's name for errors.
pub(crate) struct Link {
    stream: Box<dyn ByteStream>,
    buffer: Box<[u8]>,
    clock: Clock,
    device: String,
}

/// What happened on a link.
pub(crate) enum LinkEvent<'a> {
    /// Bytes came.
    Received(&'a [u8]),
    /// The deadline has come.
    Deadline,
}

impl Link {
    pub(crate) fn new(stream: Box<dyn ByteStream>, clock: Clock, device: String) -> Self {
        Self { stream, buffer: vec![0; BUFFER_BYTES].into(), clock, device }
    }

    /// The same link, of which one read gives up to `bytes`, or more.
    pub(crate) fn reading_at_least(self, bytes: usize) -> Self {
        Self { buffer: vec![0; bytes.max(BUFFER_BYTES)].into(), ..self }
    }

    /// Waits for bytes or the deadline. Cancel-safe.
    pub(crate) async fn next(
        &mut self,
        deadline: Option<Duration>,
    ) -> Result<(TimeStamp, LinkEvent<'_>), DeviceError> {
        let read = tokio::select! {
            // The deadline first: a device that babbles without end must not keep it from being met.
            biased;
            () = until(&self.clock, deadline) => None,
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

/// A session's time: since the clock's start.
pub(crate) fn since_start(stamp: TimeStamp) -> Duration {
    stamp.mono.since(MonoTime::default())
}

async fn until(clock: &Clock, deadline: Option<Duration>) {
    match deadline {
        Some(deadline) => sleep_until(clock.instant(MonoTime::default().after(deadline))).await,
        None => std::future::pending().await,
    }
}
