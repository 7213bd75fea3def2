//! The commands and their arguments.

use std::{num::NonZeroUsize, path::PathBuf, process::ExitCode, thread};

use anyhow::Context as _;
use clap::{Args, Parser, Subcommand};
use jiff::civil::Date;
use tokio::runtime::Runtime;

use crate::{
    IngestOptions, Place,
    exit::{Exit, in_words},
    ingest, output,
    progress::Progress,
};

/// Many recordings in one place: Parquet by rig and date.
#[derive(Debug, Parser)]
#[command(name = "tactus fleet", bin_name = "tactus fleet", version)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: FleetCommand,
}

/// Arguments of every command.
#[derive(Debug, Args)]
struct Common {
    /// Print one JSON object to standard output.
    #[arg(long, global = true)]
    json: bool,
    /// How many threads compute. Default: one per core.
    #[arg(long, global = true, value_name = "NUMBER")]
    threads: Option<NonZeroUsize>,
}

impl Common {
    fn threads(&self) -> NonZeroUsize {
        self.threads.or_else(|| thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN)
    }
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Write recordings and measurement tables into a fleet: one Parquet file per run. Runs that are there already are kept.
    Ingest(IngestArgs),
}

#[derive(Debug, Args)]
struct IngestArgs {
    /// Recordings (.mcap), measurement tables (.parquet), and folders that are searched for recordings.
    #[arg(required = true, value_name = "RUNS")]
    runs: Vec<PathBuf>,
    /// The fleet: a folder, or an address such as `s3://bucket/fleet`.
    #[arg(long, value_name = "DIR_OR_URL")]
    to: String,
    /// Date of runs whose file does not say when they were made: those of tables, unless their id begins with a date.
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: Option<Date>,
}

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let exit = match run(&cli) {
        Ok(exit) => exit,
        Err(error) => {
            eprintln!("error: {}", in_words(&error));
            Exit::Failed
        }
    };
    exit.into()
}

fn run(cli: &Cli) -> anyhow::Result<Exit> {
    let threads = cli.common.threads();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(threads.get())
        .enable_all()
        .build()
        .context("threads cannot be started")?;
    match &cli.command {
        FleetCommand::Ingest(args) => run_ingest(&runtime, &cli.common, args),
    }
}

fn run_ingest(runtime: &Runtime, common: &Common, args: &IngestArgs) -> anyhow::Result<Exit> {
    let place = Place::create(&args.to)?;
    let progress = Progress::new(common.json);
    let options = IngestOptions { threads: common.threads(), date: args.date };
    let ingested = ingest(runtime.handle(), &args.runs, &place, &options, &|now| progress.show(now))?;
    progress.clear();
    if common.json {
        output::write(&format!("{}\n", serde_json::to_string_pretty(&ingested)?))?;
    } else {
        output::write(&ingested.to_string())?;
    }
    Ok(if ingested.is_whole() { Exit::Done } else { Exit::Degraded })
}
