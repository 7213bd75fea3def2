//! Turns a blocking library's packets into an asynchronous stream of bytes.
//!
//! A thread reads, and ends when the stream is dropped. Packets keep their boundaries: one read returns one packet, if
//! the buffer has room for it; otherwise the next read returns the rest. Each write is one packet.

use std::fmt;
use std::io;
use std::mem;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::task::{Context, Poll, ready};
use std::thread;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use tokio::task::{JoinHandle, spawn_blocking};

use super::ByteStream;
use crate::{DeviceError, ErrorKind};

/// Packets that may wait for the reader. When so many wait, the thread stops reading: a USB device then waits too, and
/// the kernel queues some further HID reports.
pub(super) const PACKETS_MAX: usize = 512;

/// Reads packets, blocking.
pub(super) trait PacketSource: Send + 'static {
    /// The next packet, or `None` after a short time without one, so that the thread can check whether to end.
    fn next(&mut self) -> io::Result<Option<Vec<u8>>>;

    /// Called after reading was delayed because the reader of the stream was slow.
    fn was_held_up(&mut self) {}
}

/// Writes packets, blocking.
pub(super) trait PacketSink: Send + 'static {
    /// Writes one packet, all of it.
    fn send(&mut self, packet: &[u8]) -> io::Result<()>;
}

/// The last reading thread of a device, so that the device is not opened again before it is closed.
#[derive(Debug, Clone, Default)]
pub(super) struct LastReader(Arc<Mutex<Option<Reader>>>);

#[derive(Debug)]
struct Reader {
    thread: thread::JoinHandle<()>,
    stream: Weak<()>,
}

/// The stream is still open.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct StillOpen;

impl LastReader {
    /// Blocks until the last reader has closed the device, at most for one read.
    pub(super) fn wait(&self) -> Result<(), StillOpen> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if last.as_ref().is_some_and(|reader| reader.stream.strong_count() > 0) {
            return Err(StillOpen);
        }
        if let Some(reader) = last.take()
            && reader.thread.join().is_err()
        {
            tracing::error!("the thread that read the device has panicked; it is opened anew");
        }
        Ok(())
    }
}

/// Opens a device with a blocking library on a separate thread.
pub(super) async fn open_apart<T>(
    device: &impl fmt::Display,
    open: impl FnOnce() -> Result<T, DeviceError> + Send + 'static,
) -> Result<Box<dyn ByteStream>, DeviceError>
where
    T: ByteStream + 'static,
{
    match spawn_blocking(open).await {
        Ok(opened) => Ok(Box::new(opened?)),
        Err(error) => {
            let what = format!("it could not be opened: {error}");
            Err(DeviceError::from_io(device, ErrorKind::DeviceFault, what, error.into()))
        }
    }
}

/// Like [`stream`], with errors that name the device.
pub(super) fn stream_of(
    device: &impl fmt::Display,
    source: impl PacketSource,
    sink: Option<Box<dyn PacketSink>>,
    last: &LastReader,
) -> Result<PacketStream, DeviceError> {
    stream(&device.to_string(), source, sink, last).map_err(|error| {
        let what = format!("no thread to read it: {error}");
        DeviceError::from_io(device, ErrorKind::DeviceFault, what, error)
    })
}

/// Starts the thread that reads `source`; `sink` is `None` for a device that is only read.
pub(super) fn stream(
    name: &str,
    mut source: impl PacketSource,
    sink: Option<Box<dyn PacketSink>>,
    last: &LastReader,
) -> io::Result<PacketStream> {
    // Bounded; see PACKETS_MAX for what happens when it is full.
    let (sender, packets) = mpsc::channel(PACKETS_MAX);
    let held = Arc::new(());
    let stream = Arc::downgrade(&held);
    // Linux shows 15 characters of a thread's name.
    let thread = thread::Builder::new().name("tactus-packets".into()).spawn({
        let name = name.to_owned();
        move || {
            pump(&name, &mut source, &sender);
            tracing::debug!(device = %name, "closed");
        }
    })?;
    *last.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Reader { thread, stream });
    let writer = sink.map_or(Writer::ReadOnly, Writer::Idle);
    Ok(PacketStream { packets, rest: Vec::new(), handed_out: 0, writer, _held: held })
}

/// Reads until the stream is dropped or the link breaks.
fn pump(name: &str, source: &mut impl PacketSource, sender: &mpsc::Sender<io::Result<Vec<u8>>>) {
    let mut is_slow = false;
    while !sender.is_closed() {
        let packet = match source.next() {
            Ok(None) => {
                is_slow = false;
                continue;
            }
            Ok(Some(packet)) => packet,
            Err(error) => {
                tracing::debug!(device = name, %error, "the link broke");
                // Without a reader the error is not needed.
                drop(sender.blocking_send(Err(error)));
                return;
            }
        };
        match sender.try_send(Ok(packet)) {
            Ok(()) => {}
            Err(TrySendError::Closed(_)) => return,
            Err(TrySendError::Full(packet)) => {
                // Warn once, until all waiting packets have been read.
                if !mem::replace(&mut is_slow, true) {
                    tracing::warn!(device = name, "packets are taken too slowly: {PACKETS_MAX} of them wait");
                }
                if sender.blocking_send(packet).is_err() {
                    return;
                }
                source.was_held_up();
            }
        }
    }
}

/// The stream; dropping it ends the thread and closes the device.
pub(super) struct PacketStream {
    packets: mpsc::Receiver<io::Result<Vec<u8>>>,
    /// The last packet, until all of it has been handed out.
    rest: Vec<u8>,
    handed_out: usize,
    writer: Writer,
    _held: Arc<()>,
}

enum Writer {
    /// Nothing can be written.
    ReadOnly,
    Idle(Box<dyn PacketSink>),
    /// A packet is being written.
    Busy(JoinHandle<(Box<dyn PacketSink>, io::Result<()>)>),
    /// It panicked, or the runtime is going down.
    Lost,
}

impl PacketStream {
    /// Waits until the last packet is written; its error, if it was not.
    fn poll_written(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let Writer::Busy(writing) = &mut self.writer else { return Poll::Ready(Ok(())) };
        match ready!(Pin::new(writing).poll(context)) {
            Ok((sink, written)) => {
                self.writer = Writer::Idle(sink);
                Poll::Ready(written)
            }
            Err(error) => {
                self.writer = Writer::Lost;
                Poll::Ready(Err(error.into()))
            }
        }
    }
}

impl ByteStream for PacketStream {}

impl AsyncRead for PacketStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if buffer.remaining() == 0 {
            return Poll::Ready(Ok(()));
        }
        // An empty packet would read as the end of the stream.
        while self.handed_out >= self.rest.len() {
            match ready!(self.packets.poll_recv(context)) {
                Some(Ok(packet)) => (self.rest, self.handed_out) = (packet, 0),
                Some(Err(error)) => return Poll::Ready(Err(error)),
                None => return Poll::Ready(Ok(())),
            }
        }
        let rest = self.rest.get(self.handed_out..).unwrap_or_default();
        let part = rest.get(..buffer.remaining()).unwrap_or(rest);
        buffer.put_slice(part);
        self.handed_out += part.len();
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for PacketStream {
    /// Returns when writing has started. The next write or flush reports an error of this one.
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        packet: &[u8],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_written(context))?;
        if packet.is_empty() {
            return Poll::Ready(Ok(0));
        }
        match mem::replace(&mut self.writer, Writer::Lost) {
            Writer::Idle(mut sink) => {
                let bytes = packet.to_vec();
                self.writer = Writer::Busy(spawn_blocking(move || {
                    let written = sink.send(&bytes);
                    (sink, written)
                }));
                Poll::Ready(Ok(packet.len()))
            }
            Writer::ReadOnly => {
                self.writer = Writer::ReadOnly;
                Poll::Ready(Err(io::Error::new(io::ErrorKind::Unsupported, READ_ONLY)))
            }
            Writer::Busy(_) | Writer::Lost => Poll::Ready(Err(io::ErrorKind::BrokenPipe.into())),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_written(context)
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_flush(context)
    }
}

const READ_ONLY: &str = "nothing can be written to it: the rig file names no endpoint_out";

#[cfg(test)]
#[path = "packets_tests.rs"]
mod tests;
