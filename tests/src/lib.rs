//! Drives the real binaries: starts them, waits for their output, ends them.
//!
//! The binaries are those that `cargo test --workspace` has just built. Nothing here sleeps: every wait is for a line, an
//! answer or an exit, with a deadline that only a hang can reach.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot go on says why and fails")]

#[cfg(feature = "bus")]
mod bus;
mod disk;
mod link;
mod tap;
mod terminal;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use serde_json::Value;
use tempfile::TempDir;

#[cfg(feature = "bus")]
pub use bus::{raw_session, within};
pub use disk::SmallDisk;
pub use link::Link;
pub use tap::{Tap, Way};
pub use terminal::Terminal;

/// Only a hang takes this long.
pub const DEADLINE: Duration = Duration::from_mins(2);

/// Only a computation that hangs takes this long, however slow the machine is.
const COMPUTATION_DEADLINE: Duration = Duration::from_mins(15);
/// How often a service that was late with a frame is reset once more.
const RESETS_MAX: usize = 5;

/// Asks until there is an answer, and returns it. Nothing is waited for between two questions: each takes its time.
///
/// # Panics
/// If none comes before the deadline.
pub fn until<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + DEADLINE;
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(Instant::now() < deadline, "never: {what}");
    }
}

/// Takes what comes until its sender has ended; false if that takes until the deadline.
fn until_ended<T>(from: &Receiver<T>, mut take: impl FnMut(T)) -> bool {
    let deadline = Instant::now() + DEADLINE;
    loop {
        match from.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(one) => take(one),
            Err(end) => return end == RecvTimeoutError::Disconnected,
        }
    }
}

/// Path of one of our binaries.
///
/// # Panics
/// If it is missing: `cargo test --workspace` builds it.
pub fn binary(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a test knows its own path");
    let folder = test.ancestors().nth(2).expect("tests stand in target/<profile>/deps");
    let path = folder.join(name);
    assert!(path.is_file(), "{} is missing: run `cargo test --workspace`", path.display());
    path
}

/// A file of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// All files below a folder, by their paths in it, with what is in them. One that disappears meanwhile is left out.
///
/// # Panics
/// If a folder cannot be read.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).into_iter().flatten() {
            let path = entry.expect("a folder can be read").path();
            if path.is_dir() {
                folders.push(path);
            } else if let Ok(content) = fs::read(&path) {
                files.insert(path.strip_prefix(folder).expect("it is in the folder").to_owned(), content);
            }
        }
    }
    files
}

/// Output of a finished command.
#[derive(Debug)]
pub struct CommandOutput {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl CommandOutput {
    /// The one JSON object on standard output.
    ///
    /// # Panics
    /// If it is no JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error} in {self:?}"))
    }
}

impl From<Output> for CommandOutput {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Runs `tactus` to its end, in `folder`. One that hangs is killed: its exit code is `None`.
///
/// # Panics
/// If it cannot be started.
pub fn tactus(folder: &Path, args: &[&str]) -> CommandOutput {
    computed("tactus", folder, args)
}

/// As [`tactus()`], with another of our binaries.
///
/// # Panics
/// If it cannot be started.
pub fn computed(name: &str, folder: &Path, args: &[&str]) -> CommandOutput {
    let mut command = computing();
    command.arg(binary(name));
    // The lab's own effects are those of the test, not of the user.
    command.env("XDG_STATE_HOME", folder.join("state")).env_remove("STATE_DIRECTORY");
    command.args(args).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().expect("the binary starts");
    let pid = pid_of(&child);
    let (running, ended) = mpsc::channel::<()>();
    thread::spawn(move || {
        if ended.recv_timeout(COMPUTATION_DEADLINE) == Err(RecvTimeoutError::Timeout) {
            // It may end just now.
            let _ended = kill_process(pid, Signal::KILL);
        }
    });
    let output = child.wait_with_output();
    drop(running);
    output.expect("the output can be read").into()
}

/// What computes leaves the processor to services and virtual devices, which are tested in real time beside it.
fn computing() -> Command {
    let mut command = Command::new("nice");
    command.arg("--adjustment=5");
    command
}

fn pid_of(child: &Child) -> Pid {
    i32::try_from(child.id()).ok().and_then(Pid::from_raw).expect("a process id")
}

/// A process that runs beside the test and is killed with it.
#[derive(Debug)]
pub struct Process {
    name: String,
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
    seen: Vec<String>,
    /// The reading end of standard error, if nobody reads it.
    _unread: Option<OwnedFd>,
}

impl Process {
    /// Starts one of our binaries. Its lines are those of standard output and standard error. Programs in the folder `bin` of
    /// `folder` stand before those of the system.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start(name: &str, folder: &Path, args: &[&str]) -> Self {
        Self::start_with(name, folder, args, &[], Stdio::piped(), None)
    }

    /// As [`Self::start`], with one that computes: as [`tactus()`], it leaves the processor to others.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_computing(name: &str, folder: &Path, args: &[&str]) -> Self {
        let mut command = computing();
        command.args(["env", "--default-signal=HUP,INT,QUIT,TERM"]).arg(binary(name));
        Self::spawn(name, command, folder, args, Stdio::piped(), None)
    }

    /// As [`Self::start`], but any program, in a network namespace.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_in(namespace: &str, program: &Path, folder: &Path, args: &[&str]) -> Self {
        let mut inside = Command::new("ip");
        inside.args(["netns", "exec", namespace, "env", "--default-signal=HUP,INT,QUIT,TERM"]);
        inside.arg(program);
        Self::spawn(&program.display().to_string(), inside, folder, args, Stdio::piped(), None)
    }

    /// As [`Self::start`], with the variables that the service's unit sets.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_as_unit(name: &str, folder: &Path, args: &[&str]) -> Self {
        let unit = fs::read_to_string(repository("systemd/tactusd.service")).expect("the service's unit");
        let variables: Vec<_> = unit.lines().filter_map(|line| line.strip_prefix("Environment=")).collect();
        Self::start_with(name, folder, args, &variables, Stdio::piped(), None)
    }

    /// As [`Self::start`], with a standard error that is full and that nobody reads.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_unread(name: &str, folder: &Path, args: &[&str]) -> Self {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        Self::start_full(name, folder, args, OwnedFd::from(writer).into(), reader.into())
    }

    /// As [`Self::start_unread`], at a terminal whose output is held, as Ctrl-S does.
    ///
    /// # Panics
    /// If it cannot be started.
    pub fn start_at_held_terminal(name: &str, folder: &Path, args: &[&str]) -> Self {
        let keyboard = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
        unlockpt(&keyboard).expect("a pseudo-terminal of ours");
        let path = ptsname(&keyboard, Vec::new()).expect("a pseudo-terminal has a path");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let terminal = open(path.as_c_str(), flags, Mode::empty()).expect("a terminal");
        Self::start_full(name, folder, args, terminal.into(), keyboard)
    }

    /// Starts with a standard error that is filled up before.
    fn start_full(name: &str, folder: &Path, args: &[&str], mut stderr: File, unread: OwnedFd) -> Self {
        let flags = fcntl_getfl(&stderr).expect("an output has flags");
        fcntl_setfl(&stderr, flags | OFlags::NONBLOCK).expect("an output can refuse to wait");
        while stderr.write(&[b'.'; 4096]).is_ok() {}
        while stderr.write(b".").is_ok() {}
        fcntl_setfl(&stderr, flags).expect("an output can wait");
        Self::start_with(name, folder, args, &[], stderr.into(), Some(unread))
    }

    /// `variables` are written as `NAME=VALUE`.
    fn start_with(
        name: &str,
        folder: &Path,
        args: &[&str],
        variables: &[&str],
        stderr: Stdio,
        unread: Option<OwnedFd>,
    ) -> Self {
        // Whoever runs the tests may ignore signals, as `nohup` does.
        let mut command = Command::new("env");
        command.args(["--default-signal=HUP,INT,QUIT,TERM"]).args(variables).arg(binary(name));
        Self::spawn(name, command, folder, args, stderr, unread)
    }

    fn spawn(
        name: &str,
        mut command: Command,
        folder: &Path,
        args: &[&str],
        stderr: Stdio,
        unread: Option<OwnedFd>,
    ) -> Self {
        let mut child = command
            .args(args)
            .current_dir(folder)
            .env("RUST_LOG", "info,zenoh=error")
            .env("XDG_STATE_HOME", folder.join("state"))
            .env("PATH", format!("{}:{}", folder.join("bin").display(), env!("PATH")))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(stderr)
            .spawn()
            .expect("the binary starts");
        let (told, lines) = mpsc::channel();
        let stdin = child.stdin.take().expect("stdin is piped");
        let stdout = child.stdout.take().expect("stdout is piped");
        let mut streams: Vec<Box<dyn std::io::Read + Send>> = vec![Box::new(stdout)];
        if let Some(stderr) = child.stderr.take() {
            streams.push(Box::new(stderr));
        }
        for stream in streams {
            let told = told.clone();
            thread::spawn(move || {
                let lines = BufReader::new(stream).lines().map_while(Result::ok);
                lines.map(|line| told.send(line)).take_while(Result::is_ok).for_each(drop);
            });
        }
        Self { name: name.to_owned(), child, stdin, lines, seen: Vec::new(), _unread: unread }
    }

    /// Waits for a line that contains `text`, and returns it.
    ///
    /// # Panics
    /// If the process ends or hangs before that line.
    pub fn wait_for(&mut self, text: &str) -> String {
        self.wait_until(|line| line.contains(text))
    }

    /// Waits for a line that `is_it`, and returns it.
    ///
    /// # Panics
    /// If the process ends or hangs before that line.
    pub fn wait_until(&mut self, is_it: impl Fn(&str) -> bool) -> String {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else {
                panic!("{} never printed the awaited line; it printed:\n{}", self.name, self.seen.join("\n"));
            };
            self.seen.push(line.clone());
            if is_it(&line) {
                return line;
            }
        }
    }

    /// Types a line into its standard input.
    ///
    /// # Panics
    /// If it no longer reads.
    pub fn type_line(&mut self, line: &str) {
        writeln!(self.stdin, "{line}")
            .and_then(|()| self.stdin.flush())
            .expect("the process reads its input");
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// True if it has not ended.
    ///
    /// # Panics
    /// If the system does not say.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child can be asked").is_none()
    }

    /// Sends a signal.
    ///
    /// # Panics
    /// If it has already ended.
    pub fn signal(&self, signal: Signal) {
        kill_process(pid_of(&self.child), signal).expect("the process is there");
    }

    /// Stops it where it is, and returns when all its threads stand still. [`Signal::CONT`] lets it go on.
    ///
    /// # Panics
    /// If it has ended.
    pub fn hold(&self) {
        self.signal(Signal::STOP);
        let status =
            waitpid(Some(pid_of(&self.child)), WaitOptions::UNTRACED).expect("a child can be waited for");
        assert!(status.is_some_and(|(_, status)| status.stopped()), "{} has ended: {status:?}", self.name);
    }

    /// [Holds](Self::hold) it at a moment of which this is true.
    ///
    /// # Panics
    /// If no such moment comes before the deadline.
    pub fn hold_when(&self, what: &str, is_so: impl Fn() -> bool) {
        until(what, || {
            // Only then, because a process that is held again and again gets no further.
            if !is_so() {
                return None;
            }
            self.hold();
            if is_so() {
                return Some(());
            }
            self.signal(Signal::CONT);
            None
        });
    }

    /// Kills it, and returns when it is gone with all that it held: a port that it listened on is free again.
    ///
    /// # Panics
    /// If it has already ended.
    pub fn kill(&mut self) {
        self.signal(Signal::KILL);
        self.child.wait().expect("a child can be waited for");
    }

    /// Waits for its end and returns the exit code and everything that it printed.
    ///
    /// # Panics
    /// If it hangs.
    pub fn wait(mut self) -> (Option<i32>, String) {
        // Both streams end with the process.
        let has_ended = until_ended(&self.lines, |line| self.seen.push(line));
        assert!(has_ended, "{} does not end; it printed:\n{}", self.name, self.seen.join("\n"));
        let status = self.child.wait().expect("a child can be waited for");
        (status.code(), self.seen.join("\n"))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        if self.child.kill().is_ok() {
            drop(self.child.wait());
        }
    }
}

/// A virtual rig at pseudo-terminals and a service that uses it, in a temporary folder.
#[derive(Debug)]
pub struct ServiceUnderTest {
    /// The running `tactusd`. It ends before the devices: else it could open a terminal that got their number.
    pub daemon: Process,
    /// The virtual devices; faults are typed into them.
    pub mock: Process,
    /// Bus endpoint of the service.
    pub endpoint: String,
    /// The working directory of both.
    pub folder: TempDir,
}

impl ServiceUnderTest {
    /// Starts both, waits until frames flow, and resets, so that runs can start. `change` may rewrite the rig file, the shipped one with a
    /// sensor of 10 Hz.
    ///
    /// # Panics
    /// If one of them does not start.
    pub fn start(change: impl Fn(String) -> String) -> Self {
        let lab = Self::start_only(change);
        let mut reset = lab.tactus(&["reset"]);
        // A busy machine may be late with a frame. The service then stops, and is reset again.
        for _ in 0..RESETS_MAX {
            if reset.code == Some(0) || !reset.err.contains("safety stop: no frame for") {
                break;
            }
            reset = lab.tactus(&["reset"]);
        }
        assert_eq!(reset.code, Some(0), "{reset:?}");
        lab
    }

    /// As [`Self::start`], but nothing has been reset.
    ///
    /// # Panics
    /// If one of them does not start.
    pub fn start_only(change: impl Fn(String) -> String) -> Self {
        let mut lab = Self::start_with(change, Process::start);
        lab.daemon.wait_for("ready");
        lab
    }

    /// As [`Self::start`], with a service whose standard error is full and that nobody reads.
    ///
    /// # Panics
    /// If one of them does not start.
    pub fn start_unread(change: impl Fn(String) -> String) -> Self {
        let lab = Self::start_with(change, Process::start_unread);
        // It cannot say that it is ready. Each attempt waits for an answer by itself.
        until("a reset", || (lab.tactus(&["reset"]).code == Some(0)).then_some(()));
        lab
    }

    fn start_with(
        change: impl Fn(String) -> String,
        start: impl Fn(&str, &Path, &[&str]) -> Process,
    ) -> Self {
        let folder = TempDir::new().expect("a folder");
        let rig = fs::read_to_string(repository("config/rigs/pty.toml")).expect("the shipped rig");
        let rig = change(changed(rig, &[UNHURRIED]));
        fs::write(folder.path().join("rig.toml"), rig).expect("a writable folder");
        let endpoint = free_endpoint();
        let config = format!("rig = \"rig.toml\"\nrecordings = \"runs\"\n[bus]\nlisten = [\"{endpoint}\"]\n");
        fs::write(folder.path().join("tactusd.toml"), config).expect("a writable folder");
        let mut mock = Process::start(
            "tactus-mock",
            folder.path(),
            &["rig", "--config", "rig.toml", "--link-dir", "mock"],
        );
        mock.wait_for("stage");
        let daemon = start("tactusd", folder.path(), &["--config", "tactusd.toml"]);
        Self { daemon, mock, endpoint, folder }
    }

    /// Runs `tactus` against the service, to its end.
    pub fn tactus(&self, args: &[&str]) -> CommandOutput {
        tactus(self.folder.path(), &[&["--endpoint", &self.endpoint], args].concat())
    }

    /// Starts `tactus` against the service.
    pub fn start_tactus(&self, args: &[&str]) -> Process {
        Process::start("tactus", self.folder.path(), &[&["--endpoint", &self.endpoint], args].concat())
    }

    /// Waits until the live frames show a press.
    ///
    /// # Panics
    /// If there is none.
    pub fn wait_until_pressing(&self) {
        let mut viewer = self.start_tactus(&["watch", "--json"]);
        viewer.wait_until(|line| {
            let frame: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
            let counts = frame["counts"].as_array().expect("a frame has counts");
            // At rest an element reads about 100 counts; a press of 0.2 mm adds 200.
            counts.iter().any(|count| count.as_f64().is_some_and(|count| count > 250.0))
        });
    }

    /// What is true of the virtual rig now.
    ///
    /// # Panics
    /// If the virtual rig does not answer.
    pub fn truth(&mut self) -> Value {
        self.mock.type_line("truth");
        let line = self.mock.wait_until(|line| line.starts_with('{'));
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    /// The recording of the only run.
    ///
    /// # Panics
    /// If there is not exactly one.
    pub fn recording(&self) -> PathBuf {
        let runs: Vec<_> = fs::read_dir(self.folder.path().join("runs"))
            .expect("a folder of recordings")
            .map(|run| run.expect("an entry").path())
            .collect();
        assert_eq!(runs.len(), 1, "{runs:?}");
        runs[0].join("recording.mcap")
    }

    /// Writes an experiment script into the folder, and returns its path.
    ///
    /// # Panics
    /// If the folder is not writable.
    pub fn script(&self, name: &str, source: &str) -> String {
        let path = self.folder.path().join(name);
        fs::write(&path, source).expect("a writable folder");
        path.display().to_string()
    }
}

/// An endpoint on this machine that nobody uses, and that no connection takes while its service is away: its port is below
/// those that the system gives to connections. A client that tries such a port again and again would in the end be given it
/// as its own.
///
/// # Panics
/// If there is none.
pub fn free_endpoint() -> String {
    /// Tests of one process take one after the other.
    static TAKEN: AtomicU32 = AtomicU32::new(0);
    let first = std::process::id().wrapping_mul(64);
    let mut addresses = (0..PORTS).map(|_| {
        let offset = first.wrapping_add(TAKEN.fetch_add(1, Ordering::Relaxed)) % PORTS;
        format!("127.0.0.1:{}", FIRST_PORT + offset)
    });
    let address = addresses.find(|address| TcpListener::bind(address).is_ok()).expect("a free port");
    format!("tcp/{address}")
}

/// The first port of an endpoint, above those of services that are known to all.
const FIRST_PORT: u32 = 10_000;

/// Number of ports from it, all below those that Linux gives to connections.
const PORTS: u32 = 22_000;

/// A slow sensor for the shipped rig: a busy machine may need longer than three periods of the shipped rate for a frame, which is a
/// safety stop.
const UNHURRIED: (&str, &str) = ("rate_hz = 30.0", "rate_hz = 10.0");

/// The shipped rig with little travel, so that homing and ways are short, and a slow sensor.
///
/// # Panics
/// If the shipped rig has become another one.
pub fn small_rig() -> String {
    let rig = fs::read_to_string(repository("config/rigs/pty.toml")).expect("the shipped rig");
    let changes = [
        ("x_mm = [10.0, 50.0]", "x_mm = [18.0, 32.0]"),
        ("y_mm = [10.0, 40.0]", "y_mm = [13.0, 27.0]"),
        ("z_max_mm = 30.0", "z_max_mm = 4.0"),
        UNHURRIED,
        ("[[0.0, 60.0], [0.0, 50.0], [-6.0, 30.0]]", "[[18.0, 32.0], [13.0, 27.0], [-6.0, 4.0]]"),
    ];
    changed(rig, &changes)
}

/// A rig file with other texts in the place of some of its own.
///
/// # Panics
/// If the file lacks one of them.
pub fn changed(rig: String, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(rig, |rig, (usual, other)| {
        assert!(rig.contains(usual), "the rig lacks {usual}");
        rig.replace(usual, other)
    })
}
