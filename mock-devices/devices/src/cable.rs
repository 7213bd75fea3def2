//! A virtual device on its cable: bytes through memory or a pseudo-terminal, and injected faults.

use std::io;
use std::time::Duration;

use tactus_device::transport::memory::MemoryPort;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until, timeout};

use crate::faults::CableFault;
use crate::terminal::TerminalPort;

/// How long a device's output waits for a host that does not read. Then bytes are lost, as in an overrun serial port.
const OVERRUN: Duration = Duration::from_millis(20);

/// The device's side of a stream of bytes.
pub trait ByteStream: AsyncRead + AsyncWrite + Unpin + Send {}

impl<T: AsyncRead + AsyncWrite + Unpin + Send> ByteStream for T {}

/// A device as a state machine of bytes and times; it neither waits nor reads a clock.
///
/// Times never go back. After every call the caller sends [`output`](Self::output), and calls [`wake`](Self::wake) when
/// [`next_wake`](Self::next_wake) has come.
pub trait Device: Send {
    /// Its faults.
    type Fault: Send;

    /// Takes bytes from the host.
    fn receive(&mut self, bytes: &[u8], now: Instant);

    /// Does everything that is due by `now`.
    fn wake(&mut self, now: Instant);

    /// When something is due next.
    fn next_wake(&self) -> Option<Instant>;

    /// Takes the bytes that leave it by `now`.
    fn output(&mut self, now: Instant) -> Vec<u8>;

    /// Injects a fault.
    fn fault(&mut self, fault: Self::Fault, now: Instant);

    /// The cable is plugged in again.
    fn plugged_in(&mut self, now: Instant);
}

/// A fault of the cable, or of the device at its end.
#[derive(Debug, Clone, Copy)]
pub enum CabledFault<F> {
    /// Of the cable.
    Cable(CableFault),
    /// Of the device.
    Device(F),
}

/// Where hosts connect to the device.
#[derive(Debug)]
pub enum Port {
    /// In this process.
    Memory(MemoryPort),
    /// At a pseudo-terminal.
    Terminal(TerminalPort),
}

impl Port {
    /// Waits for a host (a pseudo-terminal does not: it gives its stream at once). Cancel-safe.
    async fn accept(&mut self) -> io::Result<Box<dyn ByteStream>> {
        match self {
            Self::Memory(port) => Ok(Box::new(port.accept().await)),
            Self::Terminal(port) => port.open(),
        }
    }

    /// False if no host would receive the device's bytes.
    fn has_host(&self) -> bool {
        match self {
            Self::Memory(_) => true,
            Self::Terminal(port) => port.has_host(),
        }
    }

    /// A host has sent bytes.
    fn heard_host(&self) {
        match self {
            Self::Memory(_) => {}
            Self::Terminal(port) => port.heard_host(),
        }
    }

    /// Disconnects the host. The device is absent until the next [`accept`](Self::accept).
    fn unplug(&mut self) {
        match self {
            Self::Memory(port) => port.unplug(),
            Self::Terminal(port) => port.close(),
        }
    }

    /// Disconnects the host. The next [`accept`](Self::accept) is at another pseudo-terminal.
    fn move_away(&mut self) -> io::Result<()> {
        match self {
            Self::Memory(port) => {
                port.unplug();
                Ok(())
            }
            Self::Terminal(port) => port.reopen_elsewhere(),
        }
    }
}

/// Runs a device forever, whether or not a host is connected.
///
/// # Errors
/// If the system gives no pseudo-terminal.
pub async fn run<D: Device>(
    mut device: D,
    mut port: Port,
    mut faults: mpsc::Receiver<CabledFault<D::Fault>>,
) -> io::Result<()> {
    let mut link = Link::Waiting;
    let mut buffer = [0; 1024];
    loop {
        let now = Instant::now();
        device.wake(now);
        let output = device.output(now);
        if !output.is_empty()
            && let Link::Up(stream) = &mut link
            && port.has_host()
            && !send(stream, &output).await
        {
            link = Link::Waiting;
        }
        let wake = device.next_wake();
        let event = tokio::select! {
            biased;
            Some(fault) = faults.recv() => CableEvent::Fault(fault),
            event = listen(&mut link, &mut port, &mut buffer) => event?,
            () = until(wake) => continue,
        };
        let now = Instant::now();
        match event {
            CableEvent::Connected(stream) => link = Link::Up(stream),
            CableEvent::Bytes(count) => {
                port.heard_host();
                device.receive(buffer.get(..count).unwrap_or_default(), now);
            }
            CableEvent::Closed => link = Link::Waiting,
            CableEvent::Replugged => {
                link = Link::Waiting;
                device.plugged_in(now);
            }
            CableEvent::Fault(CabledFault::Device(fault)) => device.fault(fault, now),
            CableEvent::Fault(CabledFault::Cable(CableFault::Disconnect(duration))) => {
                link = Link::Out(now + duration);
                port.unplug();
            }
            CableEvent::Fault(CabledFault::Cable(CableFault::Renumber)) => {
                link = Link::Out(now);
                port.move_away()?;
            }
        }
    }
}

enum Link {
    /// Plugged in, no host.
    Waiting,
    Up(Box<dyn ByteStream>),
    /// Unplugged until then.
    Out(Instant),
}

enum CableEvent<F> {
    Connected(Box<dyn ByteStream>),
    Bytes(usize),
    Closed,
    Replugged,
    Fault(CabledFault<F>),
}

/// Waits for a host, its bytes, its end, or the time to plug in again. Cancel-safe.
async fn listen<F>(link: &mut Link, port: &mut Port, buffer: &mut [u8]) -> io::Result<CableEvent<F>> {
    match link {
        Link::Waiting => Ok(CableEvent::Connected(port.accept().await?)),
        Link::Up(stream) => Ok(match stream.read(buffer).await {
            Ok(0) | Err(_) => CableEvent::Closed,
            Ok(count) => CableEvent::Bytes(count),
        }),
        Link::Out(until) => {
            sleep_until(*until).await;
            Ok(CableEvent::Replugged)
        }
    }
}

/// Sends bytes; false if the host has gone.
async fn send(stream: &mut dyn ByteStream, bytes: &[u8]) -> bool {
    let sent = timeout(OVERRUN, stream.write_all(bytes)).await;
    sent.unwrap_or_else(|_| {
        tracing::debug!(bytes = bytes.len(), "the host does not read: bytes are lost");
        Ok(())
    })
    .is_ok()
}

async fn until(wake: Option<Instant>) {
    match wake {
        Some(wake) => sleep_until(wake).await,
        None => std::future::pending().await,
    }
}
