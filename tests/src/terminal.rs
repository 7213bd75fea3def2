//! A program at a pseudo-terminal, whose screen a test reads as a person does.

use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Instant;

use rustix::fs::{Mode, OFlags, open};
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use crate::{DEADLINE, binary, until_ended};

/// One of our binaries at a terminal of its own, killed with the test.
#[expect(missing_debug_implementations, reason = "a screen has none")]
pub struct Terminal {
    child: Child,
    keyboard: OwnedFd,
    output: Receiver<Vec<u8>>,
    screen: vt100::Parser,
}

impl Terminal {
    /// Starts one of our binaries in a folder, at a terminal of `[columns, rows]`.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(name: &str, folder: &Path, args: &[&str], [cols, rows]: [u16; 2]) -> Self {
        let keyboard = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
        unlockpt(&keyboard).expect("a pseudo-terminal of ours");
        let path = ptsname(&keyboard, Vec::new()).expect("a pseudo-terminal has a path");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let terminal = File::from(open(path.as_c_str(), flags, Mode::empty()).expect("a terminal"));
        set_size(&keyboard, [cols, rows]);
        let ours = || terminal.try_clone().expect("a terminal can be shared");
        // The terminal is the program's own, whatever the test itself runs at.
        let child = Command::new("setsid")
            .arg("--ctty")
            .arg(binary(name))
            .args(args)
            .current_dir(folder)
            .env("TERM", "xterm-256color")
            .env("XDG_STATE_HOME", folder.join("state"))
            .stdin(ours())
            .stdout(ours())
            .stderr(ours())
            .spawn()
            .expect("the binary starts");
        let (told, output) = mpsc::channel();
        let mut from = File::from(keyboard.try_clone().expect("a terminal can be shared"));
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            // An error is the end of the program.
            while let Ok(length) = from.read(&mut bytes) {
                if length == 0 || told.send(bytes[..length].to_vec()).is_err() {
                    break;
                }
            }
        });
        let [cols, rows] = lengths([cols, rows]);
        Self { child, keyboard, output, screen: vt100::Parser::new(rows, cols, 0) }
    }

    /// The text that is on the screen now.
    pub fn text(&self) -> String {
        self.screen.screen().contents()
    }

    /// Waits until the screen `is_it`, and returns its text.
    ///
    /// # Panics
    /// If the program ends or hangs before.
    pub fn wait_until(&mut self, is_it: impl Fn(&str) -> bool) -> String {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let text = self.text();
            if is_it(&text) {
                return text;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(bytes) = self.output.recv_timeout(left) else {
                panic!("the awaited screen never came; the last one:\n{text}");
            };
            self.screen.process(&bytes);
        }
    }

    /// Waits until the screen has these texts.
    ///
    /// # Panics
    /// As [`Self::wait_until`].
    pub fn wait_for(&mut self, texts: &[&str]) -> String {
        self.wait_until(|screen| texts.iter().all(|text| screen.contains(text)))
    }

    /// Types keys.
    ///
    /// # Panics
    /// If the terminal is gone.
    pub fn type_keys(&mut self, keys: &str) {
        let mut keyboard = File::from(self.keyboard.try_clone().expect("a terminal can be shared"));
        keyboard.write_all(keys.as_bytes()).expect("a terminal takes keys");
    }

    /// Gives the terminal another size, `[columns, rows]`.
    pub fn resize(&mut self, [cols, rows]: [u16; 2]) {
        let [to_cols, to_rows] = lengths([cols, rows]);
        self.screen.screen_mut().set_size(to_rows, to_cols);
        set_size(&self.keyboard, [cols, rows]);
    }

    /// Waits for the program's end and returns its exit code.
    ///
    /// # Panics
    /// If it hangs.
    pub fn wait(&mut self) -> Option<i32> {
        // Its output ends with it.
        let has_ended = until_ended(&self.output, |bytes| self.screen.process(&bytes));
        assert!(has_ended, "it does not end; its screen:\n{}", self.text());
        self.child.wait().expect("a child can be waited for").code()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended already.
        if self.child.kill().is_ok() {
            drop(self.child.wait());
        }
    }
}

fn lengths(lengths: [u16; 2]) -> [NonZeroU16; 2] {
    lengths.map(|length| NonZeroU16::new(length).expect("a terminal has room"))
}

fn set_size(terminal: &OwnedFd, [cols, rows]: [u16; 2]) {
    let size = Winsize { ws_row: rows, ws_col: cols, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(terminal, size).expect("a pseudo-terminal has a size");
}
