//! The commands and their arguments.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

use crate::commands;
use crate::exit::{Exit, in_words};

/// A lab service for tactile arrays: run experiments, watch, record, export.
#[derive(Debug, Parser)]
#[command(name = "tactus", version, about)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

/// Arguments of every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Where the service listens.
    #[arg(
        long,
        global = true,
        value_name = "ENDPOINT",
        default_value = "tcp/127.0.0.1:7447",
        env = "TACTUS_ENDPOINT"
    )]
    pub(crate) endpoint: String,
    /// Which rig, where several are served; of `stage check`, its file.
    #[arg(long, global = true, value_name = "NAME", env = "TACTUS_RIG")]
    pub(crate) rig: Option<String>,
    /// One JSON object on standard output, for machines.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run an experiment; without a service, on the embedded simulated rig.
    Run(RunArgs),
    /// Show what an experiment would do: parameters, presses, duration, extremes, or the refused step.
    Plan(PlanArgs),
    /// What the service is doing.
    Status,
    /// Stop motion now, retract, end the run.
    Stop(StopArgs),
    /// Hold the run before its next step.
    Pause,
    /// Let a held run go on.
    Resume,
    /// Let runs start: clear the stage's alarm, home it, raise the tip. Wanted after each start of the service.
    Reset,
    /// Live view: the image, the stage, the run.
    Watch,
    /// Look into recordings.
    #[command(subcommand)]
    Record(RecordCommand),
    /// Make the measurement table (Parquet) of recordings.
    Export(ExportArgs),
    /// Make a whole recording of one that was cut off.
    Recover(RecoverArgs),
    /// Make the report of a recording again.
    Report(ReportArgs),
    /// Characterise the sensor from recordings or tables: faults, place, responses, point spread.
    Calibrate(CalibrateArgs),
    /// Find what the model is missing, name it, add it, and show the gap shrink; from recordings or tables.
    Discover(DiscoverArgs),
    /// Everything in the paper on one rig: runs, calibration, mechanics, acuity, images, one report.
    Study(StudyArgs),
    /// What a sensor reads of a tool: an image, frames along a path, or live on the bus.
    Simulate(SimulateArgs),
    /// Which covering to order for a pitch and a force resolution.
    Design(DesignArgs),
    /// Draw the paper's figures.
    Figures(FiguresArgs),
    /// Which devices are there, what to write into a rig file for each, whether they may be opened, whose they are.
    ///
    /// With `--rig RIG.toml`, what that rig means is looked for too.
    Devices(DevicesArgs),
    /// Match the description of a device's frames to what the device sends.
    #[command(subcommand)]
    Link(LinkCommand),
    /// Look at a stage before it is used.
    #[command(subcommand)]
    Stage(StageCommand),
    /// Check files: configurations, rigs, models, links, scripts, tables, recordings.
    Validate(ValidateArgs),
    /// Print the completions for a shell.
    Completions {
        /// The shell.
        shell: Shell,
    },
}

/// Which experiment, and with what.
#[derive(Debug, Clone, Args)]
pub(crate) struct ExperimentArgs {
    /// Name of an experiment, or path of a .star file.
    pub(crate) experiment: String,
    /// A parameter of the script, such as `depths_mm=[0.2,0.4]`.
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) parameters: Vec<String>,
    /// Seed of the random order and, on a simulated rig, of its noise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
}

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) experiment: ExperimentArgs,
    /// Use the embedded simulated rig even if a service is there.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// The embedded rig's file, in place of the shipped one.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig_file: Option<PathBuf>,
    /// What the embedded rig's sensor hides: a model file, in place of the rig file's gains, noise and spread, or a
    /// file of hidden physics.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Let the embedded rig run in real time; else nobody waits.
    #[arg(long)]
    pub(crate) real_time: bool,
    /// Where the run's folder goes.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub(crate) out: PathBuf,
    /// Who runs it, for the recording.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
    /// Make no report.
    #[arg(long)]
    pub(crate) no_report: bool,
}

/// Arguments of `plan`.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) experiment: ExperimentArgs,
    /// The rig's file, in place of the shipped simulated one.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig_file: Option<PathBuf>,
}

/// Arguments of `stop`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StopArgs {
    /// The data so far are not to be used: the run ends as aborted.
    #[arg(long)]
    pub(crate) abort: bool,
    /// Why, for the recording.
    #[arg(long, default_value = "")]
    pub(crate) reason: String,
}

#[derive(Debug, Subcommand)]
enum RecordCommand {
    /// Summarise a recording.
    Info {
        /// The recording.
        file: PathBuf,
    },
}

/// Arguments of `export`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ExportArgs {
    /// The recordings.
    #[arg(required = true)]
    pub(crate) recordings: Vec<PathBuf>,
    /// The table; beside the first recording if not given.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `recover`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RecoverArgs {
    /// The recording that was cut off.
    pub(crate) recording: PathBuf,
    /// The whole one; beside it if not given.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `report`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ReportArgs {
    /// The recording.
    pub(crate) recording: PathBuf,
    /// The report; `report.html` beside the recording if not given.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `calibrate`.
#[derive(Debug, Clone, Args)]
pub(crate) struct CalibrateArgs {
    /// Recordings and measurement tables of one rig.
    #[arg(required = true, value_name = "RECORDING|TABLE")]
    pub(crate) files: Vec<PathBuf>,
    /// Where model.toml, calibration.json and report.html go.
    #[arg(short, long, value_name = "DIR", default_value = "calibration")]
    pub(crate) out: PathBuf,
}

/// Arguments of `discover`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DiscoverArgs {
    /// Recordings and measurement tables of one rig.
    #[arg(required_unless_present = "active", value_name = "RECORDING|TABLE")]
    pub(crate) files: Vec<PathBuf>,
    /// The model that the data are held against, in place of the rig's description; of the same array.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Where report.html, report.json, model.toml and residuals.parquet go.
    #[arg(short, long, value_name = "DIR", default_value = "discovery")]
    pub(crate) out: PathBuf,
    /// Seed of the split into fitted and held-out presses and of the tests against noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// How many threads compute; the result does not depend on it. As many as there are cores if not given.
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Run what tells undecided explanations apart on the rig, and go on with its recording; without a service, on the
    /// embedded simulated rig. Without files it begins with `diagnose`.
    #[arg(long)]
    pub(crate) active: bool,
    /// How often to look at what is undecided and to run experiments.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "active")]
    pub(crate) rounds: u32,
    /// Time that the experiments may take on the rig, in all, in minutes.
    #[arg(long, value_name = "M", default_value_t = 30.0, requires = "active")]
    pub(crate) budget_min: f64,
    /// Use the embedded simulated rig even if a service is there.
    #[arg(long, requires = "active")]
    pub(crate) embedded: bool,
    /// The embedded rig's file, in place of the shipped one.
    #[arg(long, value_name = "FILE", requires = "active")]
    pub(crate) rig_file: Option<PathBuf>,
    /// What the embedded rig's sensor hides: a model file or a file of hidden physics, as of `run`.
    #[arg(long, value_name = "FILE", requires = "active")]
    pub(crate) truth: Option<PathBuf>,
    /// Who runs the experiments, for the recordings.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
    /// Go about it in another way, for comparison.
    #[arg(long, hide = true, value_name = "WAY")]
    pub(crate) ablation: Option<Ablation>,
}

/// Another way to find effects, which `docs/discovery-evidence.md` compares with.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Ablation {
    /// By the Bayesian information criterion alone.
    Bic,
}

/// Arguments of `study`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StudyArgs {
    /// Where runs, results and the report go; an interrupted study goes on there.
    #[arg(short, long, value_name = "DIR", default_value = "study")]
    pub(crate) out: PathBuf,
    /// Use the embedded simulated rig even if a service is there.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// The embedded rig's file, in place of the shipped one.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig_file: Option<PathBuf>,
    /// What the embedded rig's sensor hides: a model file, in place of the rig file's gains, noise and spread, or a
    /// file of hidden physics.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Seed of the random orders and, on a simulated rig, of its noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Points along each side of the grid sweep; the paper has 15.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(3..=101))]
    pub(crate) points: u32,
    /// Who runs it, for the recordings.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
}

/// Arguments of `simulate`; places in the sensor's frame.
#[derive(Debug, Clone, Args)]
pub(crate) struct SimulateArgs {
    /// The tool: h, wrench, spaceship, cylinder, sphere, cone, box, or a file (.stl, .obj, .ply; in mm).
    #[arg(long, default_value = "h")]
    pub(crate) scene: String,
    /// The array: digitacts, fingertip, tekscan-5027; the model's own if not given.
    #[arg(long, value_name = "NAME")]
    pub(crate) array: Option<String>,
    /// A calibrated sensor's model, in place of the paper's.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Thickness of the covering.
    #[arg(long, value_name = "MM", default_value_t = 1.016)]
    pub(crate) covering_mm: f64,
    /// How far the tool's lowest point stands below the covering's surface.
    #[arg(long, value_name = "MM", default_value_t = 0.3, allow_negative_numbers = true)]
    pub(crate) depth_mm: f64,
    /// The tool's angle about the vertical, counter-clockwise.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) angle_deg: f64,
    /// The tool's tilt about x, for meshes.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) roll_deg: f64,
    /// The tool's tilt about y, for meshes.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) pitch_deg: f64,
    /// Where the tool's axis stands; the array's middle if not given.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) x_mm: Option<f64>,
    /// Where the tool's axis stands; the array's middle if not given.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) y_mm: Option<f64>,
    /// Diameter of a cylinder, sphere or cone.
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    pub(crate) diameter_mm: f64,
    /// Sides of a box along x and y.
    #[arg(long, value_name = "X,Y", value_delimiter = ',', default_values_t = [3.0, 1.0])]
    pub(crate) size_mm: Vec<f64>,
    /// Full angle at a cone's tip.
    #[arg(long, value_name = "DEG", default_value_t = 90.0)]
    pub(crate) apex_deg: f64,
    /// Add the sensor's noise, saturation and steps; else counts before the converter.
    #[arg(long)]
    pub(crate) noise: bool,
    /// Seed of the noise; each copy has the next one.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// That many sensors with the same characterisation.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) copies: u32,
    /// Render the image on the graphics processor.
    #[arg(long, conflicts_with_all = ["live", "trajectory"])]
    pub(crate) gpu: bool,
    /// The image as .png or .csv, or the frames as .csv.
    #[arg(short, long, value_name = "FILE", conflicts_with = "live")]
    pub(crate) out: Option<PathBuf>,
    /// Frames along a path: CSV lines of `t_s,x_mm,y_mm,z_mm`, the surface at z = 0.
    #[arg(long, value_name = "FILE")]
    pub(crate) trajectory: Option<PathBuf>,
    /// Frames a second, up to 1000; the array's own if not given.
    #[arg(long, value_name = "HZ")]
    pub(crate) rate_hz: Option<f64>,
    /// Publish frames of the moving tool on a bus at the endpoint, as a real sensor's.
    #[arg(long)]
    pub(crate) live: bool,
    /// End the live frames after so long.
    #[arg(long, value_name = "S", requires = "live", allow_negative_numbers = true)]
    pub(crate) seconds: Option<f64>,
}

/// Arguments of `design`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DesignArgs {
    /// Distance between elements' centres; the model's if not given, and the paper's 2 without a model.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) pitch_mm: Option<f64>,
    /// Steps of the converter that one press's whole signal is worth.
    #[arg(long, value_name = "N")]
    pub(crate) force_steps: u32,
    /// Least spread, in pitches; that which forbids aliasing, 3/pi = 0.955, if not given.
    #[arg(long, value_name = "PITCHES", allow_negative_numbers = true)]
    pub(crate) min_sigma: Option<f64>,
    /// A calibrated sensor's model, in place of the paper's Eq. 4.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Where the trade-off goes as a figure: .svg or .html.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `figures`.
#[derive(Debug, Clone, Args)]
pub(crate) struct FiguresArgs {
    /// Where the figures go.
    #[arg(short, long, value_name = "DIR", default_value = "figures")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Subcommand)]
enum LinkCommand {
    /// Check a description, and hold recorded bytes against it: what decodes, where it fails first, what to correct.
    Check(LinkCheckArgs),
    /// Show the bytes that a device sends, and what they may be.
    Sniff(LinkSniffArgs),
}

/// Arguments of `devices`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DevicesArgs {
    /// A service's configuration, whose rig is looked at in place of those in config/rigs and /etc/tactus/rigs.
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}

/// Arguments of `link check`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LinkCheckArgs {
    /// The description, such as config/links/digitacts.toml.
    pub(crate) file: PathBuf,
    /// Bytes as the device sent them; packets one behind the other.
    #[arg(long, value_name = "FILE")]
    pub(crate) capture: Option<PathBuf>,
}

/// Arguments of `link sniff`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LinkSniffArgs {
    /// A serial port's path, serial:VID:PID[/SERIAL], usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT, hid:VID:PID[/SERIAL], or
    /// tcp:HOST:PORT; numbers in hexadecimal but the interface's. `tactus devices` shows what is there.
    #[arg(value_name = "PORT|usb:VID:PID[/SERIAL]:IFACE:EP|hid:VID:PID")]
    pub(crate) device: String,
    /// Bits per second of a serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) baud: u32,
    /// Number of the interface, of a HID that has several.
    #[arg(long, value_name = "N")]
    pub(crate) interface: Option<u8>,
    /// End after so long; else with Ctrl-C.
    #[arg(long, value_name = "S")]
    pub(crate) seconds: Option<f64>,
    /// End after so many bytes.
    #[arg(long, value_name = "N")]
    pub(crate) bytes: Option<NonZeroUsize>,
    /// Where the bytes go, for `link check --capture`.
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum StageCommand {
    /// Is the stage there, is it the one of the rig file, does each axis move as it says? Without `--rig RIG.toml`,
    /// the embedded simulated rig's.
    ///
    /// It opens the stage itself, shows what answered, and at the safe height moves each axis by 10 um and back. The
    /// service must not run: it holds the stage. Exit code 0 if all is good, 1 if not.
    Check(StageCheckArgs),
}

/// Arguments of `stage check`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StageCheckArgs {
    /// The rig's file; the same as `--rig FILE.toml`.
    #[arg(long, value_name = "FILE")]
    pub(crate) rig_file: Option<PathBuf>,
    /// Home the stage first: it moves all the way to its switches.
    #[arg(long)]
    pub(crate) home: bool,
    /// Move hardware without asking.
    #[arg(long)]
    pub(crate) yes: bool,
}

/// Arguments of `validate`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ValidateArgs {
    /// .toml, .star, .parquet or .mcap files.
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,
}

/// Runs `tactus` with the process's arguments.
pub fn main() -> ExitCode {
    let Cli { common, command } = Cli::parse();
    // Scripts log through the service's own lines; a person at the terminal needs warnings only.
    tactus_runner::logging::start(
        tactus_runner::config::LogFormat::Text,
        "warn,zenoh=error,zenoh_transport=error",
    );
    match dispatch(&common, command) {
        Ok(exit) => exit.into(),
        Err(error) => {
            let exit = Exit::of_error(&error);
            if common.json {
                println!("{}", serde_json::json!({ "error": in_words(&error), "exit_code": exit as u8 }));
            } else {
                eprintln!("tactus: {}", in_words(&error));
            }
            exit.into()
        }
    }
}

fn dispatch(common: &Common, command: Command) -> anyhow::Result<Exit> {
    match command {
        Command::Run(args) => commands::run::run(common, &args),
        Command::Plan(args) => commands::plan::plan(common, &args),
        Command::Status => commands::control::status(common),
        Command::Stop(args) => commands::control::stop(common, &args),
        Command::Pause => commands::control::pause(common),
        Command::Resume => commands::control::resume(common),
        Command::Reset => commands::control::reset(common),
        Command::Watch => commands::watch::watch(common),
        Command::Record(RecordCommand::Info { file }) => commands::files::info(common, &file),
        Command::Export(args) => commands::files::export(common, &args),
        Command::Recover(args) => commands::files::recover(common, &args),
        Command::Report(args) => commands::files::report(common, &args),
        Command::Calibrate(args) => commands::calibrate::calibrate(common, &args),
        Command::Discover(args) => commands::discover::discover(common, &args),
        Command::Study(args) => commands::study::study(common, &args),
        Command::Simulate(args) => commands::simulate::simulate(common, &args),
        Command::Design(args) => commands::design::design(common, &args),
        Command::Figures(args) => commands::figures::figures(common, &args),
        Command::Devices(args) => commands::devices::devices(common, &args),
        Command::Link(LinkCommand::Check(args)) => commands::link::check(common, &args),
        Command::Link(LinkCommand::Sniff(args)) => commands::link::sniff::sniff(common, &args),
        Command::Stage(StageCommand::Check(args)) => commands::stage::check(common, &args),
        Command::Validate(args) => Ok(commands::validate::validate(common, &args)),
        Command::Completions { shell } => {
            clap_complete::generate(shell, &mut Cli::command(), "tactus", &mut std::io::stdout());
            Ok(Exit::Done)
        }
    }
}
