//! The commands and their arguments.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::NonEmptyStringValueParser;
use clap::parser::ValueSource;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use clap_complete::engine::ArgValueCompleter;
use clap_complete::{CompleteEnv, Shell};
use tactus_bus::{Credentials, Endpoint};
use tactus_log::LogFormat;

use crate::commands;
use crate::completion;
use crate::exit::{Exit, in_words};

/// A lab service for tactile arrays: run experiments, watch, record, export.
#[derive(Debug, Parser)]
#[command(name = "tactus", version, about)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: CliCommand,
}

/// Arguments of every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Address of the service: tcp/HOST:PORT, tls/HOST:PORT or unixsock-stream/PATH. Default: the socket of the installed service if it
    /// has one, else loopback. If it is given and nothing answers there, that is an error.
    #[arg(
        long,
        global = true,
        value_name = "ENDPOINT",
        default_value_t = Endpoint::of_this_machine().to_string(),
        env = "TACTUS_ENDPOINT"
    )]
    pub(crate) endpoint: String,
    /// True if the command line or the environment gave the endpoint.
    #[arg(skip)]
    pub(crate) is_endpoint_given: bool,
    /// Folder with authority.pem, client.pem and client.key, for a service at tls/HOST:PORT.
    #[arg(long, global = true, value_name = "DIR", env = "TACTUS_CERTIFICATES")]
    pub(crate) certificates: Option<PathBuf>,
    /// Name of the rig, if several are served; for `stage check` and `devices`, its file.
    #[arg(long, global = true, value_name = "NAME", env = "TACTUS_RIG", add = ArgValueCompleter::new(completion::rigs))]
    pub(crate) rig: Option<String>,
    /// Print one JSON object to standard output.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

impl Common {
    /// The certificates of the command line, for `tls/` endpoints.
    pub(crate) fn credentials(&self) -> Credentials {
        self.certificates.as_deref().map(Credentials::in_folder).unwrap_or_default()
    }
}

#[derive(Debug, Subcommand)]
enum CliCommand {
    /// Run an experiment. Without a service it runs on the embedded simulated rig.
    Run(RunArgs),
    /// Show what an experiment would do on the rig that would run it: parameters, presses, duration, travel, or the refused step.
    Plan(PlanArgs),
    /// List the experiments with their parameters, or explain one.
    Experiments(ExperimentsArgs),
    /// Write an experiment script to start from.
    New(NewArgs),
    /// What experiment scripts can say.
    #[command(subcommand)]
    Script(ScriptCommand),
    /// Show what the service is doing: one rig in detail, several in a table.
    Status,
    /// Stop motion now, retract and end the run.
    Stop(StopArgs),
    /// Pause the run before its next step.
    Pause(LeaseArgs),
    /// Continue a paused run.
    Resume(ResumeArgs),
    /// Clear the stage's alarm, home it and raise the tip. Needed after each start of the service before runs can start.
    Reset(LeaseArgs),
    /// Show the image, the stage and the run live.
    Watch,
    /// Record all rigs that the endpoint reaches, of one service or behind a router, each into files of its own, until Ctrl-C.
    ///
    /// Rigs that come later are recorded from then on, with what their services still keep. What does not arrive is asked for again; what
    /// cannot be had is counted, told in the file, and makes the exit code 3.
    Collect(CollectArgs),
    /// List and search the recorded runs; tag them, write notes, compare them.
    Runs(RunsArgs),
    /// Make an earlier run again, with its script, parameters and seed.
    Rerun(RerunArgs),
    /// Inspect recordings.
    #[command(subcommand)]
    Record(RecordCommand),
    /// Write the measurement table of recordings as .parquet, .csv or .npz, or a recording for stock MCAP viewers.
    Export(ExportArgs),
    /// Make a measurement table of a lab's own .csv, .npz or .mcap files, by a mapping of their columns.
    Import(ImportArgs),
    /// Repair a recording that was cut off or is damaged.
    Recover(RecoverArgs),
    /// Write the report of a recording.
    Report(ReportArgs),
    /// Calibrate the sensor from recordings or tables: faults, registration, responses, point spread.
    Calibrate(CalibrateArgs),
    /// Find which effects the model is missing, fit them and report how much better it predicts; from recordings or tables.
    Discover(DiscoverArgs),
    /// List the effects of the library and the lab's own; show, add, rename and retire those of the lab.
    Effects(EffectsArgs),
    /// Take many recordings together. This is the program `tactus-fleet`, which is built by itself.
    #[command(disable_help_flag = true)]
    Fleet {
        /// A command of it with its arguments; `tactus fleet --help` lists them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<OsString>,
    },
    /// Repeat the paper on one rig: runs, calibration, mechanics, acuity and images in one report.
    Study(StudyArgs),
    /// Simulate what a sensor reads from a tool: one image, frames along a path, or live frames on the bus.
    Simulate(SimulateArgs),
    /// Recommend a covering for a pitch and a force resolution.
    Design(DesignArgs),
    /// Draw the paper's figures.
    Figures(FiguresArgs),
    /// List the devices: what to write into a rig file for each, whether it can be opened, and which rig uses it.
    ///
    /// With `--rig RIG.toml`, also report devices of that rig that are missing.
    Devices(DevicesArgs),
    /// Check or create the description of a device's frames.
    #[command(subcommand)]
    Link(LinkCommand),
    /// Check a stage before it is used.
    #[command(subcommand)]
    Stage(StageCommand),
    /// Check files: configurations, rigs, models, links, scripts, tables, recordings.
    Validate(ValidateArgs),
    /// Print the completions for a shell; they know experiments, rigs and runs.
    Completions {
        /// Shell to complete for.
        shell: Shell,
    },
}

/// Folder of the lab's own effects.
#[derive(Debug, Clone, Args)]
pub(crate) struct LibraryOption {
    /// Folder of the lab's own effects: drafts (.toml), tried beside those of the library. Default: `effects` in the state directory
    /// (`$STATE_DIRECTORY` of a service, else `$XDG_STATE_HOME/tactus`, else `~/.local/state/tactus`).
    #[arg(long, global = true, env = "TACTUS_LIBRARY", value_name = "DIR")]
    pub(crate) library: Option<PathBuf>,
}

/// The lab's own library of effects, and what to do with it.
#[derive(Debug, Args)]
pub(crate) struct EffectsArgs {
    #[command(flatten)]
    pub(crate) library: LibraryOption,
    #[command(subcommand)]
    pub(crate) command: Option<EffectsCommand>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum EffectsCommand {
    /// List all effects; the default.
    List,
    /// Show an effect: what it does, on what it depends, where it was seen.
    Show {
        /// Its name.
        name: String,
        /// Draw the curve of a draft into this SVG file.
        #[arg(long, value_name = "FILE")]
        figure: Option<PathBuf>,
    },
    /// Put a draft into the library under its name: every discovery tries it from then on, unless it is refuted.
    Add {
        /// The draft that a discovery wrote, such as discovery/draft-1.toml.
        file: PathBuf,
    },
    /// Give a draft a name, and its file too.
    Rename {
        /// Its name.
        name: String,
        /// The new name: small letters, digits and hyphens.
        to: String,
    },
    /// Measure a draft anew: compare it with recordings that it was not drafted from, and write into its file whether it holds.
    Confirm {
        /// Its name.
        name: String,
        /// New recordings and measurement tables of one rig; presses to several depths and places, as `diagnose` makes them.
        #[arg(required = true, value_name = "RECORDING|TABLE")]
        recordings: Vec<PathBuf>,
        /// The model with what else the rig has, instead of the rig file's, such as the model.toml of a discovery.
        #[arg(long, value_name = "FILE")]
        model: Option<PathBuf>,
        /// Seed of the split into fitted and held-out presses.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Withdraw a draft: its file stays, and no discovery tries it.
    Retire {
        /// Its name.
        name: String,
    },
    /// Take a withdrawn draft back: it is again what it was before.
    Use {
        /// Its name.
        name: String,
    },
}

/// An experiment, its parameters and its seed.
#[derive(Debug, Clone, Args)]
pub(crate) struct ExperimentArgs {
    /// Name of an experiment, or path of a .star file.
    #[arg(add = ArgValueCompleter::new(completion::experiments))]
    pub(crate) experiment: String,
    /// A script parameter, such as `depths_mm=[0.2,0.4]`; may be repeated.
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) parameters: Vec<String>,
    /// Seed of the random order and, on a simulated rig, of its noise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
}

/// An experiment with its parameters and its seed, or the rest of an earlier run, which has all three.
#[derive(Debug, Clone, Args)]
pub(crate) struct RunSubject {
    /// Name of an experiment, or path of a .star file.
    #[arg(required_unless_present = "continue_run", add = ArgValueCompleter::new(completion::experiments))]
    pub(crate) experiment: Option<String>,
    /// A script parameter, such as `depths_mm=[0.2,0.4]`; may be repeated.
    #[arg(short = 'p', long = "param", value_name = "NAME=VALUE")]
    pub(crate) parameters: Vec<String>,
    /// Seed of the random order and, on a simulated rig, of its noise.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Go on with an earlier run that ended early, from its last confirmed press, with its script, parameters and seed.
    #[arg(
        long = "continue",
        id = "continue_run",
        value_name = "RUN_ID",
        add = ArgValueCompleter::new(completion::run_ids),
        value_parser = NonEmptyStringValueParser::new(),
        conflicts_with_all = ["experiment", "parameters", "seed"]
    )]
    pub(crate) continue_run: Option<String>,
}

impl From<ExperimentArgs> for RunSubject {
    fn from(ExperimentArgs { experiment, parameters, seed }: ExperimentArgs) -> Self {
        Self { experiment: Some(experiment), parameters, seed, continue_run: None }
    }
}

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) subject: RunSubject,
    /// Use the embedded simulated rig even if a service is running.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// File of the embedded rig, instead of the shipped one.
    #[arg(long, value_name = "FILE", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
    /// True physics of the embedded rig's sensor: a model file, which replaces the rig file's gains, noise and spread, or
    /// a file of hidden physics.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Run the embedded rig in real time; the default is virtual time, without waiting.
    #[arg(long)]
    pub(crate) real_time: bool,
    /// Folder in which the run's folder is created: by the embedded rig for the recording, and for the report of a run on a service.
    /// With --continue on the embedded rig, the folder with the earlier run's folder, too.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub(crate) out: PathBuf,
    /// Who runs it, for the recording.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
    /// Do not write a report.
    #[arg(long)]
    pub(crate) no_report: bool,
    #[command(flatten)]
    pub(crate) lease: LeaseArgs,
}

/// Arguments of commands that want the lease, which one client holds at a time.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct LeaseArgs {
    /// Command the rig although another client holds its lease; the reason is kept with the run.
    #[arg(long, value_name = "REASON")]
    pub(crate) take_over: Option<String>,
}

/// Arguments of `resume`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ResumeArgs {
    #[command(flatten)]
    pub(crate) lease: LeaseArgs,
    /// Confirms that the covering of this thickness is in place, for a run that waits for it.
    #[arg(long, alias = "covering", value_name = "MM")]
    pub(crate) covering_mm: Option<f64>,
}

/// Arguments of `plan`.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) experiment: ExperimentArgs,
    /// Plan for the embedded simulated rig even if a service is running.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// The rig's file, instead of the rig that would run it.
    #[arg(long, value_name = "FILE", conflicts_with = "embedded", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
}

/// Arguments of `experiments`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ExperimentsArgs {
    /// Name of an experiment, or path of a .star file; without it all are listed.
    #[arg(add = ArgValueCompleter::new(completion::experiments))]
    pub(crate) name: Option<String>,
    /// Folder of the lab's own experiments (.star), listed too.
    #[arg(long, value_name = "DIR")]
    pub(crate) experiments: Option<PathBuf>,
}

/// Arguments of `new`.
#[derive(Debug, Clone, Args)]
pub(crate) struct NewArgs {
    /// Name of the experiment: letters, digits, '-' and '_'.
    pub(crate) name: String,
    /// Folder in which NAME.star is written.
    #[arg(short, long, value_name = "DIR", default_value = ".")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Subcommand)]
enum ScriptCommand {
    /// Print the functions that scripts can call, with what they do.
    Reference,
}

/// Arguments of `stop`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StopArgs {
    /// End the run as aborted: its data are not to be used.
    #[arg(long)]
    pub(crate) abort: bool,
    /// Reason, for the recording.
    #[arg(long, default_value = "")]
    pub(crate) reason: String,
}

/// Arguments of `collect`.
#[derive(Debug, Clone, Args)]
pub(crate) struct CollectArgs {
    /// Names of the rigs; without any, all that are there or come.
    pub(crate) rigs: Vec<String>,
    /// Folder of the recordings, with a folder for each rig.
    #[arg(short, long, value_name = "DIR", default_value = "collected")]
    pub(crate) out: PathBuf,
    /// Begin a new file after this time, in minutes.
    #[arg(long, value_name = "MIN", default_value_t = 60.0)]
    pub(crate) roll_min: f64,
    /// Begin a new file beyond this size.
    #[arg(long, value_name = "MIB", default_value_t = 256)]
    pub(crate) roll_mib: u64,
    /// Stop after this time; the default is to stop at Ctrl-C.
    #[arg(long, value_name = "S")]
    pub(crate) seconds: Option<f64>,
}

/// Arguments of `runs`.
#[derive(Debug, Clone, Args)]
#[command(subcommand_precedence_over_arg = true)]
pub(crate) struct RunsArgs {
    /// Words to search for: in id, experiment, rig, person, date, status, message, tags and note. All must be there.
    pub(crate) words: Vec<String>,
    /// Only runs with this tag; may be repeated.
    #[arg(long, value_name = "TAG")]
    pub(crate) tag: Vec<String>,
    /// Folder of the recordings.
    #[arg(long, global = true, value_name = "DIR", default_value = "runs")]
    pub(crate) runs: PathBuf,
    #[command(subcommand)]
    pub(crate) command: Option<RunsCommand>,
}

/// What to do with runs, each named by its id or a part that only one has.
#[derive(Debug, Clone, Subcommand)]
pub(crate) enum RunsCommand {
    /// Add tags to a run, in `notes.toml` beside its recording.
    Tag {
        /// Id of the run.
        #[arg(add = ArgValueCompleter::new(completion::run_ids))]
        run: String,
        /// Single words.
        #[arg(required = true, value_parser = tactus_runs::tag)]
        tags: Vec<String>,
        /// Remove them instead.
        #[arg(long)]
        remove: bool,
    },
    /// Write a note about a run, in `notes.toml` beside its recording. It replaces the earlier one.
    Note {
        /// Id of the run.
        #[arg(add = ArgValueCompleter::new(completion::run_ids))]
        run: String,
        /// The note; an empty one removes it.
        text: String,
    },
    /// Show in which settings and results runs differ.
    Compare {
        /// Ids of the runs.
        #[arg(required = true, num_args = 2.., value_name = "RUN", add = ArgValueCompleter::new(completion::run_ids))]
        ids: Vec<String>,
    },
}

/// Arguments of `rerun`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RerunArgs {
    /// Id of the run, or a part that only one has.
    #[arg(add = ArgValueCompleter::new(completion::run_ids))]
    pub(crate) run: String,
    /// Folder of the recordings.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub(crate) runs: PathBuf,
    /// Use the embedded simulated rig even if a service is running.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// File of the embedded rig, instead of the shipped one.
    #[arg(long, value_name = "FILE", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
    /// True physics of the embedded rig's sensor, as for `run`.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Run the embedded rig in real time; the default is virtual time, without waiting.
    #[arg(long)]
    pub(crate) real_time: bool,
    /// Folder in which the new run's folder is created, as for `run`.
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub(crate) out: PathBuf,
    /// Who runs it, for the recording.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
    /// Do not write a report.
    #[arg(long)]
    pub(crate) no_report: bool,
    #[command(flatten)]
    pub(crate) lease: LeaseArgs,
}

#[derive(Debug, Subcommand)]
enum RecordCommand {
    /// Summarise recordings: one in full, several as a table.
    Info {
        /// .mcap files.
        #[arg(required = true, value_name = "RECORDING")]
        files: Vec<PathBuf>,
    },
}

/// Arguments of `export`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ExportArgs {
    /// .mcap files.
    #[arg(required = true)]
    pub(crate) recordings: Vec<PathBuf>,
    /// The table to write: .parquet, .csv or .npz; default: `table.parquet` beside the first recording.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Format of the table; default: as the name of the file ends. Tactus itself reads Parquet only. `foxglove` writes one recording for
    /// Foxglove and other MCAP viewers: the array as grid and image, the tip as a transform, the events as a log.
    #[arg(long, value_name = "FORMAT", value_parser = ["parquet", "csv", "npz", "foxglove"])]
    pub(crate) format: Option<String>,
}

/// Arguments of `import`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ImportArgs {
    /// .csv, .tsv, .txt, .npz or .mcap (JSON, protobuf or CDR messages) files with the same columns.
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// The mapping: which column is what, in which unit.
    #[arg(long, value_name = "FILE")]
    pub(crate) map: Option<PathBuf>,
    /// Write a mapping to start from, by the columns of the first file. Lines that begin with `#?` are questions.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["map", "out"])]
    pub(crate) new_map: Option<PathBuf>,
    /// The table to write; default: .parquet beside the first file.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `recover`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RecoverArgs {
    /// The recording that was cut off or is damaged.
    pub(crate) recording: PathBuf,
    /// The repaired recording to write; default: beside the original.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `report`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ReportArgs {
    /// A .mcap file.
    pub(crate) recording: PathBuf,
    /// The report to write; default: `report.html` beside the recording.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `calibrate`.
#[derive(Debug, Clone, Args)]
pub(crate) struct CalibrateArgs {
    /// Recordings and measurement tables of one rig.
    #[arg(required = true, value_name = "RECORDING|TABLE")]
    pub(crate) files: Vec<PathBuf>,
    /// Folder for model.toml, calibration.json and report.html.
    #[arg(short, long, value_name = "DIR", default_value = "calibration")]
    pub(crate) out: PathBuf,
}

/// Arguments of `discover`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DiscoverArgs {
    /// Recordings and measurement tables of one rig.
    #[arg(required_unless_present = "active", value_name = "RECORDING|TABLE")]
    pub(crate) files: Vec<PathBuf>,
    /// The model to compare with the data, instead of the rig file's; of the same array.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Folder for report.html, report.json, model.toml, residuals.parquet and, where something is left that no effect explains,
    /// draft-1.toml; they appear there when all are complete.
    #[arg(short, long, value_name = "DIR", default_value = "discovery")]
    pub(crate) out: PathBuf,
    /// Seed of the split into fitted and held-out presses and of the tests against noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Number of threads; the result does not depend on it. Default: the number of cores.
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Tolerable residual in counts rms, declared before the data are judged: if what is not noise is certainly less, the added
    /// effects count as the explanation.
    #[arg(long, value_name = "COUNTS")]
    pub(crate) tolerance: Option<f64>,
    /// Folder of the lab's own experiments (.star), which may be proposed beside the built-in ones.
    #[arg(long, value_name = "DIR")]
    pub(crate) experiments: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) library: LibraryOption,
    /// Run the experiments that distinguish the remaining explanations, and analyse again with their recordings. Without
    /// a service they run on the embedded simulated rig; without files the first run is `diagnose`.
    #[arg(long)]
    pub(crate) active: bool,
    /// Rounds of experiments and analysis.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "active")]
    pub(crate) rounds: u32,
    /// Total time that the experiments may take on the rig, in minutes.
    #[arg(long, value_name = "M", default_value_t = 30.0, requires = "active")]
    pub(crate) budget_min: f64,
    /// Use the embedded simulated rig even if a service is running.
    #[arg(long, requires = "active")]
    pub(crate) embedded: bool,
    /// File of the embedded rig, instead of the shipped one.
    #[arg(long, value_name = "FILE", requires = "active", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
    /// True physics of the embedded rig's sensor, as for `run`.
    #[arg(long, value_name = "FILE", requires = "active")]
    pub(crate) truth: Option<PathBuf>,
    /// Who runs the experiments, for the recordings.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
    /// Use another method, for comparison.
    #[arg(long, hide = true, value_name = "WAY")]
    pub(crate) ablation: Option<Ablation>,
    /// Write when each stage began, in time of the processor: the table of the time left is made from this.
    #[arg(long, hide = true, value_name = "FILE")]
    pub(crate) stages: Option<PathBuf>,
}

/// Another method to find effects; `docs/discovery-evidence.md` compares it with the default.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Ablation {
    /// The Bayesian information criterion alone.
    Bic,
}

/// Arguments of `study`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StudyArgs {
    /// Folder for runs, results and the report; an interrupted study continues there.
    #[arg(short, long, value_name = "DIR", default_value = "study")]
    pub(crate) out: PathBuf,
    /// Use the embedded simulated rig even if a service is running.
    #[arg(long)]
    pub(crate) embedded: bool,
    /// File of the embedded rig, instead of the shipped one.
    #[arg(long, value_name = "FILE", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
    /// True physics of the embedded rig's sensor: a model file, which replaces the rig file's gains, noise and spread, or
    /// a file of hidden physics.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Seed of the random orders and, on a simulated rig, of its noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Points along each side of the grid sweep; 15 in the paper.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(3..=101))]
    pub(crate) points: u32,
    /// Who runs it, for the recordings.
    #[arg(long, env = "USER", default_value = "unknown")]
    pub(crate) who: String,
}

/// Arguments of `simulate`; positions are in the sensor's frame.
#[derive(Debug, Clone, Args)]
pub(crate) struct SimulateArgs {
    /// The tool: h, wrench, spaceship, cylinder, sphere, cone, box, or a file (.stl, .obj, .ply; in mm).
    #[arg(long, default_value = "h")]
    pub(crate) scene: String,
    /// The array: digitacts, fingertip or tekscan-5027; default: the model's.
    #[arg(long, value_name = "NAME")]
    pub(crate) array: Option<String>,
    /// Model of a calibrated sensor, instead of the paper's.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Thickness of the covering.
    #[arg(long, value_name = "MM", default_value_t = 1.016)]
    pub(crate) covering_mm: f64,
    /// Depth of the tool's lowest point below the covering's surface.
    #[arg(long, value_name = "MM", default_value_t = 0.3, allow_negative_numbers = true)]
    pub(crate) depth_mm: f64,
    /// Rotation of the tool about the vertical, counter-clockwise.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) angle_deg: f64,
    /// Tilt of the tool about x; meshes only.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) roll_deg: f64,
    /// Tilt of the tool about y; meshes only.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) pitch_deg: f64,
    /// x of the tool's axis; default: the array's middle.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) x_mm: Option<f64>,
    /// y of the tool's axis; default: the array's middle.
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
    /// Add noise, saturation and quantisation; the default is counts before the converter.
    #[arg(long)]
    pub(crate) noise: bool,
    /// Seed of the noise; each further copy uses the next seed.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Number of sensors with the same characterisation.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) copies: u32,
    /// Render the image on the graphics processor.
    #[arg(long, conflicts_with_all = ["live", "trajectory"])]
    pub(crate) gpu: bool,
    /// File to write: an image as .png or .csv, frames as .csv.
    #[arg(short, long, value_name = "FILE", conflicts_with = "live")]
    pub(crate) out: Option<PathBuf>,
    /// Frames along a path: CSV lines of `t_s,x_mm,y_mm,z_mm`, the surface at z = 0.
    #[arg(long, value_name = "FILE")]
    pub(crate) trajectory: Option<PathBuf>,
    /// Frames per second, up to 1000; default: the array's rate.
    #[arg(long, value_name = "HZ")]
    pub(crate) rate_hz: Option<f64>,
    /// Publish live frames of a moving tool on a bus at the endpoint, as a service does.
    #[arg(long)]
    pub(crate) live: bool,
    /// Stop the live frames after this time.
    #[arg(long, value_name = "S", requires = "live", allow_negative_numbers = true)]
    pub(crate) seconds: Option<f64>,
}

/// Arguments of `design`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DesignArgs {
    /// Distance between element centres; default: the model's, or 2 (the paper's) without a model.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) pitch_mm: Option<f64>,
    /// Number of converter steps in the whole signal of one press.
    #[arg(long, value_name = "N")]
    pub(crate) force_steps: u32,
    /// Least spread, in pitches; default: 3/pi = 0.955, the least that prevents aliasing.
    #[arg(long, value_name = "PITCHES", allow_negative_numbers = true)]
    pub(crate) min_sigma: Option<f64>,
    /// Model of a calibrated sensor, instead of the paper's Eq. 4.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Write the trade-off as a figure: .svg or .html.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `figures`.
#[derive(Debug, Clone, Args)]
pub(crate) struct FiguresArgs {
    /// Folder for the figures.
    #[arg(short, long, value_name = "DIR", default_value = "figures")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Subcommand)]
enum LinkCommand {
    /// Check a description, and decode recorded bytes with it: how many frames, the first failure, what to correct.
    Check(LinkCheckArgs),
    /// Show the bytes that a device sends, and propose a frame format.
    Sniff(LinkSniffArgs),
}

/// Arguments of `devices`.
#[derive(Debug, Clone, Args)]
pub(crate) struct DevicesArgs {
    /// A service's configuration; its rigs are used instead of those in config/rigs and /etc/tactus/rigs.
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}

/// Arguments of `link check`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LinkCheckArgs {
    /// The description, such as config/links/digitacts.toml.
    pub(crate) file: PathBuf,
    /// File of bytes as the device sent them; packets concatenated.
    #[arg(long, value_name = "FILE")]
    pub(crate) capture: Option<PathBuf>,
}

/// Arguments of `link sniff`.
#[derive(Debug, Clone, Args)]
pub(crate) struct LinkSniffArgs {
    /// A serial port's path, serial:VID:PID[/SERIAL], usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT, hid:VID:PID[/SERIAL], or
    /// tcp:HOST:PORT. Numbers are hexadecimal, except the interface's. `tactus devices` lists the devices.
    #[arg(value_name = "PORT|usb:VID:PID[/SERIAL]:IFACE:EP|hid:VID:PID")]
    pub(crate) device: String,
    /// Bits per second of a serial port.
    #[arg(long, value_name = "N", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) baud: u32,
    /// Interface number, for a HID with several.
    #[arg(long, value_name = "N")]
    pub(crate) interface: Option<u8>,
    /// Stop after this time; the default is to stop at Ctrl-C.
    #[arg(long, value_name = "S")]
    pub(crate) seconds: Option<f64>,
    /// Stop after this many bytes.
    #[arg(long, value_name = "N")]
    pub(crate) bytes: Option<NonZeroUsize>,
    /// Save the bytes to a file, for `link check --capture`.
    #[arg(long, value_name = "FILE")]
    pub(crate) save: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum StageCommand {
    /// Check that the stage answers, matches the rig file and moves as it reports. Without `--rig RIG.toml` it checks the
    /// embedded simulated rig.
    ///
    /// The command opens the stage itself, shows what answered, and at the safe height moves each axis by 10 um and back.
    /// The service must not run, because it holds the stage. Exit code 0 if all is good, 1 if not.
    Check(StageCheckArgs),
}

/// Arguments of `stage check`.
#[derive(Debug, Clone, Args)]
pub(crate) struct StageCheckArgs {
    /// The rig's file; the same as `--rig FILE.toml`.
    #[arg(long, value_name = "FILE", add = ArgValueCompleter::new(completion::rig_files))]
    pub(crate) rig_file: Option<PathBuf>,
    /// Home the stage first: it moves to its limit switches.
    #[arg(long)]
    pub(crate) home: bool,
    /// Move hardware without asking.
    #[arg(long)]
    pub(crate) yes: bool,
}

/// Arguments of `validate`.
#[derive(Debug, Clone, Args)]
pub(crate) struct ValidateArgs {
    /// .toml, .star, .parquet or .mcap files; of a folder, the rig files in it, also against each other.
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,
}

/// The commands and their options.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Runs `tactus` with the process's arguments.
pub fn main() -> ExitCode {
    // A shell that completes asks for it in a variable, and this call then ends the process.
    CompleteEnv::with_factory(Cli::command).complete();
    let given = Cli::command().get_matches();
    let Cli { common, command } = Cli::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    let source = given.value_source("endpoint");
    let is_endpoint_given = source.is_some_and(|source| source != ValueSource::DefaultValue);
    let common = Common { is_endpoint_given, ..common };
    // At the terminal only warnings matter; scripts log through the service.
    let _log = tactus_log::start(LogFormat::Text, "warn,zenoh=error,zenoh_transport=error");
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

fn dispatch(common: &Common, command: CliCommand) -> anyhow::Result<Exit> {
    match command {
        CliCommand::Run(args) => commands::run::run(common, &args),
        CliCommand::Plan(args) => commands::plan::plan(common, &args),
        CliCommand::Experiments(args) => commands::experiments::experiments(common, &args),
        CliCommand::New(args) => commands::experiments::new(common, &args),
        CliCommand::Script(ScriptCommand::Reference) => commands::experiments::reference(common),
        CliCommand::Status => commands::control::status(common),
        CliCommand::Stop(args) => commands::control::stop(common, &args),
        CliCommand::Pause(args) => commands::control::pause(common, &args),
        CliCommand::Resume(args) => commands::control::resume(common, &args),
        CliCommand::Reset(args) => commands::control::reset(common, &args),
        CliCommand::Watch => commands::watch::watch(common),
        CliCommand::Collect(args) => commands::collect::collect(common, &args),
        CliCommand::Runs(args) => commands::runs::runs(common, &args),
        CliCommand::Rerun(args) => commands::runs::rerun(common, &args),
        CliCommand::Record(RecordCommand::Info { files }) => commands::files::info(common, &files),
        CliCommand::Export(args) => commands::files::export(common, &args),
        CliCommand::Import(args) => commands::import::import(common, &args),
        CliCommand::Recover(args) => commands::files::recover(common, &args),
        CliCommand::Report(args) => commands::files::report(common, &args),
        CliCommand::Calibrate(args) => commands::calibrate::calibrate(common, &args),
        CliCommand::Discover(args) => commands::discover::discover(common, &args),
        CliCommand::Fleet { args } => commands::fleet::fleet(common, &args),
        CliCommand::Study(args) => commands::study::study(common, &args),
        CliCommand::Simulate(args) => commands::simulate::simulate(common, &args),
        CliCommand::Effects(args) => commands::effects::effects(common, &args),
        CliCommand::Design(args) => commands::design::design(common, &args),
        CliCommand::Figures(args) => commands::figures::figures(common, &args),
        CliCommand::Devices(args) => commands::devices::devices(common, &args),
        CliCommand::Link(LinkCommand::Check(args)) => commands::link::check(common, &args),
        CliCommand::Link(LinkCommand::Sniff(args)) => commands::link::sniff::sniff(common, &args),
        CliCommand::Stage(StageCommand::Check(args)) => commands::stage::check(common, &args),
        CliCommand::Validate(args) => Ok(commands::validate::validate(common, &args)),
        CliCommand::Completions { shell } => completion::register(&shell.to_string()),
    }
}
