//! A device at a pseudo-terminal, for hosts that open a serial port.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};
use tokio::io::AsyncReadExt;
use tokio::net::unix::pipe;
use tokio::task::JoinSet;

use crate::cable::ByteStream;

/// A port with one pseudo-terminal at a time, and a link that points to the current one and is gone without one.
#[derive(Debug)]
pub struct TerminalPort {
    link: Option<PathBuf>,
    terminal: Option<Terminal>,
}

/// An open pseudo-terminal.
#[derive(Debug)]
struct Terminal {
    controller: OwnedFd,
    path: PathBuf,
    has_host: Arc<AtomicBool>,
    /// Keeps the hosts' side open, so that the controller's side never reads an error.
    _caretaker: JoinSet<()>,
}

impl TerminalPort {
    /// Opens a pseudo-terminal and points `link` to it.
    ///
    /// # Errors
    /// If the system gives no pseudo-terminal, or the link cannot be made.
    pub fn new(link: Option<PathBuf>) -> io::Result<Self> {
        let mut port = Self { link, terminal: None };
        port.replace()?;
        Ok(port)
    }

    /// Path of the current pseudo-terminal.
    pub fn path(&self) -> Option<&Path> {
        self.terminal.as_ref().map(|terminal| terminal.path.as_path())
    }

    /// The device's side of the current pseudo-terminal. Opens one if there is none.
    ///
    /// # Errors
    /// If the system gives no pseudo-terminal, or the link cannot be made.
    pub fn open(&mut self) -> io::Result<Box<dyn ByteStream>> {
        let terminal = match &self.terminal {
            Some(terminal) => terminal,
            None => self.replace()?,
        };
        // A pseudo-terminal is read, written and waited for like a pair of pipes.
        let input = pipe::Receiver::from_owned_fd_unchecked(terminal.controller.try_clone()?)?;
        let output = pipe::Sender::from_owned_fd_unchecked(terminal.controller.try_clone()?)?;
        Ok(Box::new(tokio::io::join(input, output)))
    }

    /// True if a host has opened the current pseudo-terminal. Without a host, bytes that leave the device are lost.
    pub fn has_host(&self) -> bool {
        self.terminal.as_ref().is_some_and(|terminal| terminal.has_host.load(Ordering::Relaxed))
    }

    /// Bytes came from a host, so there is one: its opening may not have been noticed yet.
    pub fn heard_host(&self) {
        if let Some(terminal) = &self.terminal {
            terminal.has_host.store(true, Ordering::Relaxed);
        }
    }

    /// Hangs up on the host; there is no link until the next [`open`](Self::open).
    pub fn close(&mut self) {
        // First the link: any program may get the freed number, and the link would lead to its terminal.
        self.remove_link();
        self.terminal = None;
    }

    /// Hangs up and opens another pseudo-terminal, which has another number.
    ///
    /// # Errors
    /// If the system gives no pseudo-terminal, or the link cannot be made.
    pub fn reopen_elsewhere(&mut self) -> io::Result<()> {
        // The old one still holds its number while the new one gets another.
        self.replace().map(drop)
    }

    fn replace(&mut self) -> io::Result<&Terminal> {
        let terminal = Terminal::open()?;
        if let Some(link) = &self.link {
            point(link, &terminal.path)?;
        }
        tracing::info!(path = %terminal.path.display(), "pseudo-terminal opened");
        Ok(self.terminal.insert(terminal))
    }

    fn remove_link(&self) {
        // Another program may have replaced the link meanwhile: then it is not ours to remove.
        if let (Some(link), Some(terminal)) = (&self.link, &self.terminal)
            && fs::read_link(link).is_ok_and(|target| target == terminal.path)
            && let Err(error) = fs::remove_file(link)
        {
            tracing::warn!(link = %link.display(), %error, "the link could not be removed");
        }
    }
}

impl Terminal {
    fn open() -> io::Result<Self> {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let controller = openpt(flags)?;
        grantpt(&controller)?;
        unlockpt(&controller)?;
        let host_side = ioctl_tiocgptpeer(&controller, flags)?;
        let mut settings = tcgetattr(&host_side)?;
        settings.make_raw();
        tcsetattr(&host_side, OptionalActions::Now, &settings)?;
        fcntl_setfl(&controller, fcntl_getfl(controller.as_fd())? | OFlags::NONBLOCK)?;
        let path = PathBuf::from(OsString::from_vec(ptsname(&controller, Vec::new())?.into_bytes()));
        let hosts = inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC)?;
        inotify::add_watch(&hosts, &path, WatchFlags::OPEN | WatchFlags::CLOSE)?;
        let hosts = pipe::Receiver::from_owned_fd_unchecked(hosts)?;
        let has_host = Arc::new(AtomicBool::new(false));
        let mut caretaker = JoinSet::new();
        caretaker.spawn(take_care(host_side, hosts, Arc::clone(&has_host)));
        Ok(Self { controller, path, has_host, _caretaker: caretaker })
    }
}

/// Watches hosts open and close the terminal. After the last one it resets their side: unread bytes are discarded, and the
/// host's exclusive lock is released, because it outlives a killed host.
async fn take_care(host_side: OwnedFd, mut hosts: pipe::Receiver, has_host: Arc<AtomicBool>) {
    let mut present = 0_u32;
    let mut buffer = [0; 64 * EVENT_BYTES];
    while let Ok(count) = hosts.read(&mut buffer).await {
        let (events, _) = buffer.get(..count).unwrap_or_default().as_chunks::<EVENT_BYTES>();
        for event in events {
            if is_opening(event) {
                present += 1;
            } else {
                present = present.saturating_sub(1);
            }
        }
        has_host.store(present > 0, Ordering::Relaxed);
        if present == 0
            && let Err(error) = ioctl_tiocnxcl(&host_side).and(tcflush(&host_side, QueueSelector::IFlush))
        {
            tracing::warn!(%error, "the pseudo-terminal could not be reset after its last host");
        }
    }
}

/// Size of an inotify event of a watched file: four words; the second is the mask.
const EVENT_BYTES: usize = 16;

fn is_opening(event: &[u8; EVENT_BYTES]) -> bool {
    let [_, _, _, _, mask @ .., _, _, _, _, _, _, _, _] = *event;
    ReadFlags::from_bits_retain(u32::from_ne_bytes(mask)).contains(ReadFlags::OPEN)
}

impl Drop for TerminalPort {
    fn drop(&mut self) {
        self.remove_link();
    }
}

/// Changes a link atomically, so that it never dangles.
fn point(link: &Path, target: &Path) -> io::Result<()> {
    if let Some(folder) = link.parent() {
        fs::create_dir_all(folder)?;
    }
    if fs::symlink_metadata(link).is_ok_and(|there| !there.is_symlink()) {
        let what = format!("{} is there already, and is no link", link.display());
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, what));
    }
    let fresh = link.with_extension("new");
    match fs::remove_file(&fresh) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        Ok(()) | Err(_) => {}
    }
    symlink(target, &fresh)?;
    fs::rename(&fresh, link)
}
