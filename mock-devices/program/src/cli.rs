//! The command line, and what `rig` and `usb` share.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufRead, Write};
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{Context, Result, bail};
use clap::{Args, CommandFactory, Parser, Subcommand};
use serde_json::json;
use tactus_device::SensorCodec;
use tactus_log::LogFormat;
use tactus_model::Array;
use tactus_schema::Rig;
use tactus_virtual::cable::{self, Port};
use tactus_virtual::faults::{FaultScript, InjectedFault};
use tactus_virtual::{RigControl, Started, TerminalPort, Truth, TruthFile, simulation_of, start_devices};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::hidden::HiddenArgs;
use crate::usb::UsbArgs;

/// Virtual sensor and stage that speak real device bytes.
#[derive(Debug, Parser)]
#[command(name = "tactus-mock", version)]
struct Cli {
    #[command(subcommand)]
    command: MockCommand,
}

#[derive(Debug, Subcommand)]
enum MockCommand {
    /// Serves a simulated rig at two pseudo-terminals, whose paths it prints.
    ///
    /// It then reads faults from standard input, one per line, such as `sensor stall 2s`, and answers each with `ok` or
    /// `error: ...`. It answers the line `truth` with the true position of the tip as one JSON object. It runs until it is
    /// terminated.
    Rig(RigArgs),
    /// Plugs virtual USB devices into this machine's kernel (Linux, root, `modprobe vhci-hcd`).
    ///
    /// It then reads commands from standard input, one per line: `sensor unplug`, `sensor plug`, `sensor plug
    /// elsewhere`, `sensor halt` (its endpoint stalls until the host clears the halt), `sensor slow 50ms`, the same
    /// for `stage`, and every fault that `rig` takes. It answers each with `ok` or `error: ...`. It runs until it is
    /// terminated, which unplugs everything.
    Usb(UsbArgs),
    /// Test data for discovery: measurement tables of sensors with physics that the base model does not know.
    Hidden(HiddenArgs),
}

#[derive(Debug, Args)]
struct RigArgs {
    #[command(flatten)]
    source: SourceArgs,
    /// Folder in which the links `sensor` and `stage` always point to the current pseudo-terminals.
    #[arg(long)]
    link_dir: Option<PathBuf>,
    /// Print the paths as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What the devices are made from.
#[derive(Debug, Args)]
pub(crate) struct SourceArgs {
    /// The rig file. The devices hide its `[simulation]`, and use the protocols of its `[sensor]` and `[stage]`.
    #[arg(long)]
    config: PathBuf,
    /// What the sensor hides: a model file, which replaces the rig file's gains, noise and spread, or a file of hidden
    /// physics, which is added to them.
    ///
    /// The service does not know this file: its recordings contain the rig file, whose `[simulation]` then does not hold.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Seed of everything random. Default: the rig file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Faults at set times: a TOML file of `[[fault]]` entries with `at_s` and `command`.
    #[arg(long)]
    faults: Option<PathBuf>,
}

/// The files that the arguments name, read and checked.
pub(crate) struct Source {
    rig: Rig,
    codec: SensorCodec,
    truth: Truth,
    script: FaultScript,
}

impl SourceArgs {
    pub(crate) fn read(&self) -> Result<Source> {
        let rig = Rig::from_toml(&read(&self.config)?).with_context(|| self.config.display().to_string())?;
        let (codec, _) = SensorCodec::load(&rig, &self.config)?;
        let script = match &self.faults {
            Some(path) => FaultScript::from_toml(&read(path)?).with_context(|| path.display().to_string())?,
            None => FaultScript::default(),
        };
        let seed = self.seed.unwrap_or_else(|| simulation_of(&rig).seed);
        let truth = match &self.truth {
            Some(path) => truth(path, &rig, seed).with_context(|| path.display().to_string())?,
            None => Truth::of_rig(&rig, seed),
        };
        Ok(Source { rig, codec, truth, script })
    }
}

impl Source {
    pub(crate) fn array(&self) -> &Array {
        &self.rig.array
    }

    /// The format of the sensor on the wire.
    pub(crate) fn codec(&self) -> &SensorCodec {
        &self.codec
    }

    /// The same, with another sensor format than the rig file's.
    pub(crate) fn speaking(self, codec: SensorCodec) -> Self {
        Self { codec, ..self }
    }

    /// Switches the devices on. Also returns the faults of `--faults`.
    pub(crate) fn start(self) -> (Started, FaultScript) {
        (start_devices(self.truth, self.rig.covering, &self.codec, Instant::now()), self.script)
    }
}

/// The commands and their options.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Runs `tactus-mock` with the process's arguments.
///
/// # Errors
/// The message names the file and the place that are wrong, or what the system refused.
pub fn main() -> Result<()> {
    Cli::parse().run()
}

impl Cli {
    fn run(self) -> Result<()> {
        match self.command {
            MockCommand::Rig(args) => in_runtime(serve(args)),
            MockCommand::Usb(args) => in_runtime(args.serve()),
            MockCommand::Hidden(args) => args.run(),
        }
    }
}

/// Runs on a runtime of one thread, with the log on standard error.
fn in_runtime(serving: impl Future<Output = Result<()>>) -> Result<()> {
    let _log = tactus_log::start(LogFormat::Text, "info");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(serving)
}

async fn serve(args: RigArgs) -> Result<()> {
    let source = args.source.read()?;
    // Held to the end: another virtual rig would take the links over.
    let _folder = args.link_dir.as_deref().map(occupy).transpose()?;
    let termination = Termination::listen()?;
    let sensor_port = open(args.link_dir.as_deref(), "sensor")?;
    let stage_port = open(args.link_dir.as_deref(), "stage")?;
    announce(&sensor_port, &stage_port, args.json)?;
    let (started, script) = source.start();
    let control = started.control;
    // Dropped at the end, which removes the links.
    let mut devices = JoinSet::new();
    devices.spawn(cable::run(started.sensor, Port::Terminal(sensor_port), started.faults.sensor));
    devices.spawn(cable::run(started.stage, Port::Terminal(stage_port), started.faults.stage));
    until_terminated(termination, &mut devices, &control, &script, async |line| {
        line.parse::<InjectedFault>()
            .and_then(|fault| control.inject(fault))
            .map_err(|error| error.to_string())
    })
    .await?;
    devices.shutdown().await;
    Ok(())
}

/// SIGTERM and SIGINT. The program listens to them before it announces its devices, so that both always end it in order.
pub(crate) struct Termination {
    terminate: Signal,
    interrupt: Signal,
}

impl Termination {
    pub(crate) fn listen() -> io::Result<Self> {
        Ok(Self { terminate: signal(SignalKind::terminate())?, interrupt: signal(SignalKind::interrupt())? })
    }
}

/// Lets the devices run until the program is terminated, and answers each line of standard input.
///
/// # Errors
/// If a device ends, or the rig refuses a fault of the script.
pub(crate) async fn until_terminated<E: std::error::Error + Send + Sync + 'static>(
    Termination { mut terminate, mut interrupt }: Termination,
    devices: &mut JoinSet<Result<(), E>>,
    control: &RigControl,
    script: &FaultScript,
    mut execute: impl AsyncFnMut(&str) -> Result<(), String>,
) -> Result<()> {
    let mut lines = standard_input()?;
    let played = control.play(script);
    tokio::pin!(played);
    let mut is_playing = true;
    loop {
        tokio::select! {
            _ = terminate.recv() => return Ok(()),
            _ = interrupt.recv() => return Ok(()),
            Some(ended) = devices.join_next() => return Ok(ended??),
            outcome = &mut played, if is_playing => {
                is_playing = false;
                outcome.context("the fault script")?;
            }
            Some(line) = lines.recv() => match line.trim() {
                "truth" => print_truth(control)?,
                _ => answer(execute(&line).await)?,
            },
        }
    }
}

fn truth(path: &Path, rig: &Rig, seed: u64) -> Result<Truth> {
    Ok(TruthFile::from_toml(&fs::read_to_string(path)?)?.behind(rig, seed)?)
}

/// Locks a folder of links for this process, as long as the returned file is open.
fn occupy(folder: &Path) -> Result<File> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let lock = File::open(folder).with_context(|| folder.display().to_string())?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => bail!(
            "another virtual rig has its links in {}: stop it, or give another folder with --link-dir",
            folder.display()
        ),
        Err(TryLockError::Error(error)) => Err(error).with_context(|| folder.display().to_string()),
    }
}

fn open(link_dir: Option<&Path>, device: &str) -> Result<TerminalPort> {
    let link = link_dir.map(|folder| folder.join(device));
    TerminalPort::new(link).with_context(|| format!("no pseudo-terminal for the {device}"))
}

fn announce(sensor: &TerminalPort, stage: &TerminalPort, as_json: bool) -> Result<()> {
    let [sensor, stage] =
        [sensor, stage].map(|port| port.path().map(|path| path.display().to_string()).unwrap_or_default());
    let mut out = io::stdout().lock();
    if as_json {
        writeln!(out, "{}", json!({ "sensor": sensor, "stage": stage }))?;
    } else {
        writeln!(out, "sensor {sensor}\nstage {stage}")?;
    }
    Ok(out.flush()?)
}

/// Lines of standard input. A separate thread reads them, because such a read cannot be cancelled.
fn standard_input() -> Result<mpsc::Receiver<String>> {
    // When the channel is full the thread waits, and so does the writer.
    let (sender, lines) = mpsc::channel(16);
    thread::Builder::new().name("stdin".into()).spawn(move || {
        for line in io::stdin().lock().lines().map_while(Result::ok) {
            if sender.blocking_send(line).is_err() {
                return;
            }
        }
    })?;
    Ok(lines)
}

/// Prints the true position of the tip as one JSON object.
fn print_truth(control: &RigControl) -> Result<()> {
    let [x_mm, y_mm, z_mm] = control.tip_mm();
    let truth = json!({
        "x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm,
        "depth_mm": control.depth_mm(), "deepest_mm": control.deepest_mm(), "moving": control.is_moving(),
    });
    let mut out = io::stdout().lock();
    writeln!(out, "{truth}")?;
    Ok(out.flush()?)
}

fn answer(outcome: Result<(), String>) -> Result<()> {
    let mut out = io::stdout().lock();
    match outcome {
        Ok(()) => writeln!(out, "ok")?,
        Err(error) => writeln!(out, "error: {error}")?,
    }
    Ok(out.flush()?)
}

pub(crate) fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| path.display().to_string())
}
