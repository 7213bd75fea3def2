//! A virtual device in the same process. Transfers take no time, so it works in virtual time.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tokio::io::{DuplexStream, duplex};
use tokio::sync::mpsc;

use super::{ByteStream, Connect};
use crate::{DeviceError, ErrorKind};

/// Bytes that either side may write before the other reads; then the writer waits, as on a full serial port.
const BUFFER_BYTES: usize = 64 * 1024;

/// The two ends of a socket for a virtual device. The device is plugged in from the start.
pub fn pair(name: impl Into<String>) -> (MemoryConnector, MemoryPort) {
    let socket = Socket::default();
    let mut port = MemoryPort { socket: socket.clone(), plug: None };
    port.plug_in();
    (MemoryConnector { name: name.into(), socket }, port)
}

/// The host's end.
#[derive(Debug)]
pub struct MemoryConnector {
    name: String,
    socket: Socket,
}

/// The device's end.
#[derive(Debug)]
pub struct MemoryPort {
    socket: Socket,
    plug: Option<mpsc::Receiver<DuplexStream>>,
}

/// Holds the sender for the stream of a device that is plugged in but not connected.
type Socket = Arc<Mutex<Option<mpsc::Sender<DuplexStream>>>>;

impl MemoryPort {
    /// Plugs the device in and waits for the host to connect. When the returned stream is dropped, the device is
    /// absent until the next call.
    ///
    /// Cancel-safe; a device whose waiting is cancelled stays plugged in.
    pub async fn accept(&mut self) -> DuplexStream {
        loop {
            if let Some(stream) = self.plug_in().recv().await {
                self.plug = None;
                return stream;
            }
            // The connector gave up the plug without a stream in it: offer a new one.
            self.plug = None;
        }
    }

    /// Makes the device absent until the next [`accept`](Self::accept).
    pub fn unplug(&mut self) {
        self.plug = None;
    }

    fn plug_in(&mut self) -> &mut mpsc::Receiver<DuplexStream> {
        self.plug.get_or_insert_with(|| {
            // One connection at a time; a second finds no plug.
            let (sender, receiver) = mpsc::channel(1);
            *self.socket.lock().unwrap_or_else(PoisonError::into_inner) = Some(sender);
            receiver
        })
    }
}

impl MemoryConnector {
    fn open(&self) -> Result<Box<dyn ByteStream>, DeviceError> {
        let plug = self.socket.lock().unwrap_or_else(PoisonError::into_inner).take();
        let (host, device) = duplex(BUFFER_BYTES);
        plug.and_then(|plug| plug.try_send(device).ok()).ok_or_else(|| DeviceError {
            device: self.to_string(),
            kind: ErrorKind::Absent,
            what: "the virtual device is not plugged in".to_owned(),
            source: None,
        })?;
        Ok(Box::new(host))
    }
}

impl ByteStream for DuplexStream {}

impl Connect for MemoryConnector {
    fn connect(&self) -> BoxFuture<'_, Result<Box<dyn ByteStream>, DeviceError>> {
        async { self.open() }.boxed()
    }
}

impl fmt::Display for MemoryConnector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "memory:{}", self.name)
    }
}

#[cfg(test)]
#[path = "memory_tests.rs"]
mod tests;
