//! The program `tactus-mock`: a virtual rig at pseudo-terminals; test data with hidden physics.

use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand};
use serde_json::json;
use tactus_device::SensorCodec;
use tactus_schema::Rig;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::cable::{self, Port};
use crate::control::RigControl;
use crate::faults::{Fault, FaultScript};
use crate::hidden::cli::HiddenArgs;
use crate::rig::start_devices;
use crate::terminal::TerminalPort;
use crate::truth::Truth;
use crate::truth_file::TruthFile;

/// Virtual sensor and stage that speak real device bytes.
#[derive(Debug, Parser)]
#[command(name = "tactus-mock", version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serves a simulated rig at two pseudo-terminals, whose paths it prints.
    ///
    /// It then reads faults from standard input, one a line such as `sensor stall 2s`, answers each with
    /// `ok` or `error: ...`, the line `truth` with where the tip truly is, as one JSON object, and runs until it is
    /// terminated.
    Rig(RigArgs),
    /// Test data for discovery: measurement tables with physics in them that the base model does not know.
    Hidden(HiddenArgs),
}

#[derive(Debug, Args)]
struct RigArgs {
    /// The rig file; its `[simulation]` is what the devices hide, and the sensor speaks as its `[sensor]` says.
    #[arg(long)]
    config: PathBuf,
    /// What the sensor hides: a model file, in the place of the rig file's gains, noise and spread, or a file of
    /// hidden physics that comes upon them.
    ///
    /// The service does not know it: its recordings hold its rig file, whose `[simulation]` then is not so.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Seed of everything random, in the place of the rig file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Folder in which the links `sensor` and `stage` always point to the present pseudo-terminals.
    #[arg(long)]
    link_dir: Option<PathBuf>,
    /// Faults at set times: a TOML file of `[[fault]]` entries with `at_s` and `command`.
    #[arg(long)]
    faults: Option<PathBuf>,
    /// Print the paths as one JSON object.
    #[arg(long)]
    json: bool,
}

impl Cli {
    /// Does what the arguments say.
    ///
    /// # Errors
    /// With the file and the place that are wrong, or what the system refused.
    pub fn run(self) -> Result<()> {
        let args = match self.command {
            Command::Rig(args) => args,
            Command::Hidden(args) => return args.run(),
        };
        tracing_subscriber::fmt().with_writer(io::stderr).with_ansi(io::stderr().is_terminal()).init();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(serve(args))
    }
}

async fn serve(args: RigArgs) -> Result<()> {
    let rig = Rig::from_toml(&read(&args.config)?).with_context(|| args.config.display().to_string())?;
    let (codec, _) = SensorCodec::load(&rig, &args.config)?;
    let script = match &args.faults {
        Some(path) => FaultScript::from_toml(&read(path)?).with_context(|| path.display().to_string())?,
        None => FaultScript::default(),
    };
    let seed = args.seed.unwrap_or_else(|| crate::twin::simulation_of(&rig).seed);
    let truth = match &args.truth {
        Some(path) => truth(path, &rig, seed).with_context(|| path.display().to_string())?,
        None => Truth::of_rig(&rig, seed),
    };
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let sensor_port = open(args.link_dir.as_deref(), "sensor")?;
    let stage_port = open(args.link_dir.as_deref(), "stage")?;
    announce(&sensor_port, &stage_port, args.json)?;
    let started = start_devices(truth, rig.covering, &codec, Instant::now());
    let control = started.control;
    // Dropped at the end, which removes the links.
    let mut devices = JoinSet::new();
    devices.spawn(cable::run(started.sensor, Port::Terminal(sensor_port), started.taps.sensor));
    devices.spawn(cable::run(started.stage, Port::Terminal(stage_port), started.taps.stage));
    let mut lines = standard_input()?;
    let played = control.play(&script);
    tokio::pin!(played);
    let mut is_playing = true;
    loop {
        tokio::select! {
            _ = terminate.recv() => break,
            _ = interrupt.recv() => break,
            Some(ended) = devices.join_next() => return Ok(ended??),
            outcome = &mut played, if is_playing => {
                is_playing = false;
                outcome.context("the fault script")?;
            }
            Some(line) = lines.recv() => answer(&control, &line)?,
        }
    }
    devices.shutdown().await;
    Ok(())
}

fn truth(path: &Path, rig: &Rig, seed: u64) -> Result<Truth> {
    Ok(TruthFile::from_toml(&fs::read_to_string(path)?)?.behind(rig, seed)?)
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

/// Lines of standard input, read by a thread of its own: a read there cannot be cancelled.
fn standard_input() -> Result<mpsc::Receiver<String>> {
    // When it is full the thread waits, and with it whoever writes.
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

fn answer(control: &RigControl, line: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    if line.trim() == "truth" {
        let [x_mm, y_mm, z_mm] = control.tip_mm();
        let truth = json!({
            "x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm,
            "depth_mm": control.depth_mm(), "deepest_mm": control.deepest_mm(), "moving": control.is_moving(),
        });
        writeln!(out, "{truth}")?;
        return Ok(out.flush()?);
    }
    match line.parse::<Fault>().and_then(|fault| control.inject(fault)) {
        Ok(()) => writeln!(out, "ok")?,
        Err(error) => writeln!(out, "error: {error}")?,
    }
    Ok(out.flush()?)
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| path.display().to_string())
}
