//! STOP without a connection: one datagram to the service.
//!
//! Connections can run out, and a client that connects needs some ten messages before its first command. A datagram needs
//! neither. A service that listens on `tcp/HOST:PORT` on loopback takes datagrams at the same port, and one that listens
//! on a Unix socket takes them at `<socket>.stop` beside it. Whoever reaches it can stop, and nothing else.
//!
//! A datagram is `tactus stop RIG`, a line feed, and a [`pb::CommandRequest`]; an empty `RIG` means every rig. The answer is a
//! [`pb::CommandReply`].

use std::{
    fs, io,
    net::{SocketAddr, ToSocketAddrs, UdpSocket},
    os::{
        linux::net::SocketAddrExt,
        unix::{
            fs::PermissionsExt as _,
            net::{SocketAddr as UnixAddr, UnixDatagram},
        },
    },
    path::{Path, PathBuf},
    process,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use prost::Message as _;
use tactus_schema::{key::Command, pb};
use tokio::sync::mpsc;

use crate::{CommandCall, Endpoint, Request, Responder, command::unreadable_stop, node::Served};

/// Start of each datagram.
const START: &[u8] = b"tactus stop";
/// Longest datagram that is read, in bytes; the rest of a longer one is ignored.
const BYTES_MAX: usize = 4_096;
/// Longest answer, in bytes: a state with its messages.
const ANSWER_BYTES_MAX: usize = 65_536;
/// Time for an answer to find room in its client's buffer.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(10);
/// Time after which a client sends its datagram again.
const AGAIN: Duration = Duration::from_millis(50);

/// A service's socket for stops. Its thread ends when this is dropped.
#[derive(Debug)]
pub(crate) struct StopSocket {
    socket: Arc<Socket>,
    closed: Arc<AtomicBool>,
    path: Option<PathBuf>,
    /// The thread that takes stops.
    taking: Option<JoinHandle<()>>,
}

/// Who sent a stop.
#[derive(Debug)]
pub(crate) struct StopSender {
    socket: Arc<Socket>,
    from: Sender,
}

#[derive(Debug)]
enum Socket {
    Udp(UdpSocket),
    Unix(UnixDatagram),
}

#[derive(Debug)]
enum Sender {
    Udp(SocketAddr),
    Unix(UnixAddr),
}

impl StopSocket {
    /// Takes stops for the served rigs at an endpoint; `None` if the endpoint has no place for datagrams.
    ///
    /// # Errors
    /// If another program has the place, or there is no thread.
    pub(crate) fn open(
        endpoint: &Endpoint,
        served: Served,
        stops: mpsc::Sender<Box<CommandCall>>,
    ) -> io::Result<Option<Self>> {
        let (socket, path) = if let Some(path) = place(endpoint) {
            (Socket::Unix(bind_unix(&path)?), Some(path))
        } else if endpoint.is_loopback() {
            (Socket::Udp(UdpSocket::bind(endpoint.address())?), None)
        } else {
            return Ok(None);
        };
        socket.limit_answers()?;
        let socket = Arc::new(socket);
        let closed = Arc::new(AtomicBool::new(false));
        let taking = thread::Builder::new().name("bus-stop".to_owned()).spawn({
            let (socket, closed) = (socket.clone(), closed.clone());
            move || {
                while !closed.load(Ordering::Acquire) {
                    if let Some((rig, request, from)) = receive(&socket, &served) {
                        let reply = Responder::to_datagram(StopSender { socket: socket.clone(), from });
                        let call = Box::new(CommandCall { rig, command: Command::Stop, request, reply });
                        // Full: so many stops wait already that this one would change nothing.
                        if stops.try_send(call).is_err() {
                            tracing::debug!("a stop finds many others waiting");
                        }
                    }
                }
            }
        })?;
        Ok(Some(Self { socket, closed, path, taking: Some(taking) }))
    }
}

impl Drop for StopSocket {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Release);
        let woken = match (&*self.socket, &self.path) {
            (Socket::Udp(socket), _) => socket.local_addr().and_then(|own| socket.send_to(&[], own)),
            (Socket::Unix(socket), Some(path)) => socket.send_to(&[], path),
            (Socket::Unix(_), None) => Ok(0),
        };
        // Until the thread has ended, the place is taken.
        let taking = self.taking.take().filter(|_| woken.is_ok());
        if taking.is_some_and(|taking| taking.join().is_err()) {
            tracing::error!("the thread that takes stops panicked");
        }
        let removed = self.path.as_ref().map_or(Ok(()), fs::remove_file);
        if let Err(error) = woken.map(drop).and(removed) {
            tracing::warn!(%error, "the socket for stops did not close cleanly");
        }
    }
}

impl StopSender {
    /// Answers, unless the client's buffer stays full.
    pub(crate) fn answer(&self, reply: &pb::CommandReply) {
        let mut bytes = reply.encode_to_vec();
        if bytes.len() > BYTES_MAX {
            let short = pb::CommandReply { ok: reply.ok, rig: reply.rig.clone(), ..Default::default() };
            bytes = short.encode_to_vec();
        }
        let sent = match (&*self.socket, &self.from) {
            (Socket::Udp(socket), Sender::Udp(from)) => socket.send_to(&bytes, from),
            (Socket::Unix(socket), Sender::Unix(from)) => socket.send_to_addr(&bytes, from),
            (Socket::Udp(_), Sender::Unix(_)) | (Socket::Unix(_), Sender::Udp(_)) => Ok(0),
        };
        if let Err(error) = sent {
            tracing::debug!(%error, "the answer to a stop did not reach its client");
        }
    }
}

impl Socket {
    fn limit_answers(&self) -> io::Result<()> {
        match self {
            Self::Udp(socket) => socket.set_write_timeout(Some(ANSWER_TIMEOUT)),
            Self::Unix(socket) => socket.set_write_timeout(Some(ANSWER_TIMEOUT)),
        }
    }

    fn receive(&self, bytes: &mut [u8]) -> io::Result<(usize, Sender)> {
        match self {
            Self::Udp(socket) => socket.recv_from(bytes).map(|(len, from)| (len, Sender::Udp(from))),
            Self::Unix(socket) => socket.recv_from(bytes).map(|(len, from)| (len, Sender::Unix(from))),
        }
    }
}

/// Waits for one datagram; `None` if it is not a stop for one of the rigs. Without a name it is for all of them.
fn receive(socket: &Socket, served: &Served) -> Option<(Option<Arc<str>>, Request, Sender)> {
    let mut bytes = [0; BYTES_MAX];
    match socket.receive(&mut bytes) {
        Ok((len, from)) => {
            let (asked, request) = parse(bytes.get(..len).unwrap_or_default())?;
            let rig = match std::str::from_utf8(asked).ok()? {
                "" => None,
                asked => Some(served.get(asked)?),
            };
            Some((rig, Request::Control(request), from))
        }
        // A client that left before its answer shows up here as an error of the next call.
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => None,
        Err(error) => {
            tracing::warn!(%error, "the socket for stops");
            // Errors that stay must not keep a core busy.
            thread::sleep(ANSWER_TIMEOUT);
            None
        }
    }
}

/// The rig and the request of a datagram; `None` if it is not a stop.
fn parse(datagram: &[u8]) -> Option<(&[u8], pb::CommandRequest)> {
    let rest = datagram.strip_prefix(START)?;
    let end = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
    let (rig, request) = rest.split_at(end);
    let rig = rig.strip_prefix(b" ").unwrap_or(rig);
    let request = match pb::CommandRequest::decode(request.strip_prefix(b"\n").unwrap_or(request)) {
        Ok(request) if request.who.is_empty() => pb::CommandRequest { who: "unknown".to_owned(), ..request },
        Ok(request) => request,
        Err(error) => unreadable_stop(error.to_string()),
    };
    Some((rig, request))
}

/// Path of the datagrams beside a Unix socket.
fn place(endpoint: &Endpoint) -> Option<PathBuf> {
    endpoint.unix_path().map(|path| {
        let mut name = path.as_os_str().to_owned();
        name.push(".stop");
        PathBuf::from(name)
    })
}

/// Binds a path for the group, also one that a service that was killed has left behind.
fn bind_unix(path: &Path) -> io::Result<UnixDatagram> {
    let bound = match UnixDatagram::bind(path) {
        Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
            if UnixDatagram::unbound()?.connect(path).is_ok() {
                return Err(error);
            }
            fs::remove_file(path)?;
            UnixDatagram::bind(path)
        }
        bound => bound,
    }?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o660))?;
    Ok(bound)
}

/// Sends a stop by datagram until it is answered; `None` if the endpoint has no place for datagrams.
///
/// # Errors
/// If nobody takes datagrams there, or nobody answers in time.
pub(crate) fn send(
    endpoint: &Endpoint,
    rig: Option<&str>,
    request: &pb::CommandRequest,
    patience: Duration,
) -> io::Result<Option<pb::CommandReply>> {
    let socket = if let Some(path) = place(endpoint) {
        let socket = UnixDatagram::bind_addr(&own_name()?)?;
        socket.connect(path)?;
        socket.set_read_timeout(Some(AGAIN))?;
        Socket::Unix(socket)
    } else if endpoint.is_loopback() {
        let to = endpoint.address().to_socket_addrs()?.next();
        let to = to.ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "the host has no address"))?;
        let socket = UdpSocket::bind((if to.is_ipv4() { "127.0.0.1" } else { "::1" }, 0))?;
        socket.connect(to)?;
        socket.set_read_timeout(Some(AGAIN))?;
        Socket::Udp(socket)
    } else {
        return Ok(None);
    };
    let datagram =
        [START, b" ", rig.unwrap_or_default().as_bytes(), b"\n", &request.encode_to_vec()].concat();
    let until = Instant::now() + patience;
    let mut bytes = vec![0; ANSWER_BYTES_MAX];
    loop {
        let answered = match &socket {
            Socket::Udp(socket) => socket.send(&datagram).and_then(|_| socket.recv(&mut bytes)),
            Socket::Unix(socket) => socket.send(&datagram).and_then(|_| socket.recv(&mut bytes)),
        };
        match answered {
            Ok(len) => {
                let reply = pb::CommandReply::decode(bytes.get(..len).unwrap_or_default());
                return reply.map(Some).map_err(io::Error::other);
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                if Instant::now() >= until {
                    return Err(error);
                }
            }
            Err(error) => return Err(error),
        }
    }
}

/// A name without a file, for answers.
fn own_name() -> io::Result<UnixAddr> {
    static SENT: AtomicU64 = AtomicU64::new(0);
    let number = SENT.fetch_add(1, Ordering::Relaxed);
    UnixAddr::from_abstract_name(format!("tactus-stop-{}-{number}", process::id()))
}

#[cfg(test)]
#[path = "stop_tests.rs"]
mod tests;
