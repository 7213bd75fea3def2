//! A tap on a serial line between a virtual device and the service: it shows what passes, with the times.

use std::fs;
use std::io::{self, PipeWriter};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::thread;
use std::time::Instant;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::io::{Errno, read, write};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};

/// Which way bytes go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the service to the device.
    ToDevice,
    /// From the device to the service.
    ToService,
}

/// A tapped line. It ends when this is dropped.
#[derive(Debug)]
pub struct Tap {
    /// The service's side, held open: without it each end of the service would look like an unplugged device.
    service_side: OwnedFd,
    _quit: PipeWriter,
}

impl Tap {
    /// Joins the device at `device` to a new pseudo-terminal, to which `link` points. `see` is called with all bytes before
    /// they are passed on, with the time at which they were there.
    ///
    /// # Errors
    /// The system's.
    pub fn open(
        device: &Path,
        link: &Path,
        see: impl FnMut(Way, Instant, &[u8]) + Send + 'static,
    ) -> io::Result<Self> {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let controller = openpt(flags)?;
        grantpt(&controller)?;
        unlockpt(&controller)?;
        let service_side = ioctl_tiocgptpeer(&controller, flags)?;
        let mut settings = tcgetattr(&service_side)?;
        settings.make_raw();
        tcsetattr(&service_side, OptionalActions::Now, &settings)?;
        fcntl_setfl(&controller, fcntl_getfl(controller.as_fd())? | OFlags::NONBLOCK)?;
        if let Some(folder) = link.parent() {
            fs::create_dir_all(folder)?;
        }
        let path = ptsname(&controller, Vec::new())?;
        symlink(Path::new(&*path.to_string_lossy()), link)?;
        let device = open(device, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let (quit, quitter) = io::pipe()?;
        thread::Builder::new()
            .name("tap".into())
            .spawn(move || pass_on(&controller, &device, &quit.into(), see))?;
        Ok(Self { service_side, _quit: quitter })
    }

    /// What a device does when its last host has gone: it discards what nobody has read, and ends the host's exclusive lock.
    ///
    /// # Errors
    /// The system's.
    pub fn hang_up(&self) -> io::Result<()> {
        ioctl_tiocnxcl(&self.service_side)?;
        Ok(tcflush(&self.service_side, QueueSelector::IFlush)?)
    }
}

/// Passes bytes on until the device ends or the tap is dropped.
fn pass_on(controller: &OwnedFd, device: &OwnedFd, quit: &OwnedFd, mut see: impl FnMut(Way, Instant, &[u8])) {
    let mut buffer = [0; 4096];
    loop {
        let mut sources = [controller, device, quit].map(|source| PollFd::new(source, PollFlags::IN));
        match poll(&mut sources, None) {
            Ok(_) => {}
            Err(Errno::INTR) => continue,
            Err(_) => return,
        }
        let [from_service, from_device, quit] = sources.map(|source| source.revents());
        if !quit.is_empty() {
            return;
        }
        for (events, from, to, way) in [
            (from_service, controller, device, Way::ToDevice),
            (from_device, device, controller, Way::ToService),
        ] {
            if events.is_empty() {
                continue;
            }
            match read(from, &mut buffer) {
                Ok(0) => return,
                Ok(count) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    see(way, Instant::now(), bytes);
                    // What does not fit into the service's buffer is lost, as on a line without flow control.
                    if write_all(to, bytes).is_err_and(|error| error != Errno::AGAIN) {
                        return;
                    }
                }
                Err(Errno::AGAIN | Errno::INTR) => {}
                Err(_) => return,
            }
        }
    }
}

fn write_all(to: &OwnedFd, mut bytes: &[u8]) -> Result<(), Errno> {
    while !bytes.is_empty() {
        match write(to, bytes) {
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(Errno::INTR) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
