//! The commands and their arguments.

#[cfg(feature = "cluster")]
use std::net::SocketAddr;
use std::{
    io,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    process::ExitCode,
    thread,
    time::Duration,
};

use anyhow::{Context as _, bail};
use clap::{Args, Parser, Subcommand};
use jiff::civil::Date;
use serde::Serialize;
use tactus_report::fleet::{FleetReport, Trend, fleet_html};
use tactus_work::{Bar, Claims, LEASE_S, Stop, Worker, cores, write_whole};
use tempfile::TempDir;
use tokio::runtime::Runtime;
use tokio::sync::oneshot;

#[cfg(feature = "cluster")]
use crate::cluster;
use crate::{
    IngestOptions, Place,
    exit::{Exit, in_words},
    ingest,
    output::{self, number_of},
    query::{Limits, Lines, OutFile, Query, Table},
    survey::{self, Analysis, Calibrated, Discovered, SurveyedRun, findings, results, survey},
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
    /// Print JSON to standard output: one object, or one in each line for the rows of a query.
    #[arg(long, global = true)]
    json: bool,
    /// How many threads compute. Default: one per core.
    #[arg(long, global = true, value_name = "NUMBER")]
    threads: Option<NonZeroUsize>,
}

impl Common {
    fn threads(&self) -> NonZeroUsize {
        self.threads.unwrap_or_else(cores)
    }
}

#[derive(Debug, Subcommand)]
enum FleetCommand {
    /// Write recordings and measurement tables into a fleet: one Parquet file per run. Runs that are there already are kept.
    Ingest(IngestArgs),
    /// Calibrate each run by itself; report which sensors drift and which coverings age. Runs that were calibrated before are kept. Workers
    /// that have the same --out share the runs.
    Calibrate(SurveyArgs),
    /// Search each run for effects that its rig's model lacks; report which rigs share one. Runs that were searched before are kept. Workers
    /// that have the same --out share the runs.
    Discover(SurveyArgs),
    /// Ask all frames and runs in SQL.
    Query(QueryArgs),
    /// Share the queries of others among executors, until it is stopped.
    #[cfg(feature = "cluster")]
    Scheduler(SchedulerArgs),
    /// Do a part of the queries that a scheduler has, until it is stopped.
    #[cfg(feature = "cluster")]
    Executor(ExecutorArgs),
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

/// Which fleet is read.
#[derive(Debug, Args)]
struct FleetArgs {
    /// The fleet: a folder, or an address such as `s3://bucket/fleet`.
    #[arg(long, value_name = "DIR_OR_URL", default_value = "fleet", env = "TACTUS_FLEET")]
    at: String,
}

#[derive(Debug, Args)]
struct SurveyArgs {
    #[command(flatten)]
    fleet: FleetArgs,
    /// Folder for the result of each run, and for report.html and report.json, which calibrations and discoveries share.
    #[arg(long, value_name = "DIR", default_value = "survey")]
    out: PathBuf,
    /// Another worker takes over the runs of one that is silent for so long: a process or a machine that died.
    #[arg(long, value_name = "SECONDS", default_value_t = LEASE_S, value_parser = clap::value_parser!(u64).range(1..))]
    lease_s: u64,
}

#[derive(Debug, Args)]
struct QueryArgs {
    /// One query. `SHOW TABLES` lists the tables, `DESCRIBE frames` the columns of one.
    #[arg(value_name = "SQL")]
    sql: String,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Write all rows to a file that ends in .parquet or .csv.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Memory for sorts, groups and joins, in GB. What is beyond goes to the disk.
    #[arg(long, value_name = "GB", default_value_t = 2.0)]
    memory: f64,
    /// Folder for what goes to the disk. Default: that of the system for temporary files.
    #[arg(long, value_name = "DIR")]
    spill: Option<PathBuf>,
    /// The scheduler of a cluster that does the query. All its machines must reach the fleet at the same place.
    #[cfg(feature = "cluster")]
    #[arg(long, value_name = "IP:PORT")]
    cluster: Option<SocketAddr>,
}

#[cfg(feature = "cluster")]
#[derive(Debug, Args)]
struct SchedulerArgs {
    /// Where it listens. Whoever reaches it can read the fleet: stay within a trusted network.
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:50050")]
    listen: SocketAddr,
    /// An executor that is silent for so long is given up; others do its part again. At least 10, because a busy one is heard every 5.
    #[arg(long, value_name = "SECONDS", default_value_t = 20, value_parser = clap::value_parser!(u64).range(10..))]
    lost_s: u64,
}

#[cfg(feature = "cluster")]
#[derive(Debug, Args)]
struct ExecutorArgs {
    /// The scheduler.
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:50050")]
    scheduler: SocketAddr,
    /// Where it hands out parts of answers, under this address.
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:50051")]
    listen: SocketAddr,
    /// Memory for sorts, groups and joins, in GB. What is beyond goes to the disk.
    #[arg(long, value_name = "GB", default_value_t = 2.0)]
    memory: f64,
    /// Folder for parts of answers, and for what goes to the disk. Default: that of the system for temporary files.
    #[arg(long, value_name = "DIR")]
    spill: Option<PathBuf>,
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
        FleetCommand::Calibrate(args) => run_survey::<Calibrated>(&runtime, &cli.common, args),
        FleetCommand::Discover(args) => run_survey::<Discovered>(&runtime, &cli.common, args),
        FleetCommand::Query(args) => run_query(runtime, &cli.common, args),
        #[cfg(feature = "cluster")]
        FleetCommand::Scheduler(args) => run_scheduler(&runtime, args),
        #[cfg(feature = "cluster")]
        FleetCommand::Executor(args) => run_executor(&runtime, &cli.common, args),
    }
}

fn run_ingest(runtime: &Runtime, common: &Common, args: &IngestArgs) -> anyhow::Result<Exit> {
    let place = Place::create(&args.to)?;
    let progress = Bar::new("files", common.json);
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

fn run_survey<T: Analysis>(runtime: &Runtime, common: &Common, args: &SurveyArgs) -> anyhow::Result<Exit> {
    let (place, runtime) = (Place::at(&args.fleet.at)?, runtime.handle());
    let worker = Worker {
        claims: Claims::new(survey::claims::<T>(&args.out), Duration::from_secs(args.lease_s)),
        threads: common.threads(),
        stop: Stop::on_signals().context("signals cannot be received")?,
    };
    let progress = Bar::new("runs", common.json);
    let (runs, left_out) = runtime.block_on(SurveyedRun::all(&place))?;
    let worked = survey::<T>(runtime, &place, &runs, &args.out, &worker, &|now| progress.show(now))?;
    progress.clear();
    for run in &worked.lost {
        eprintln!("warning: {run} was taken over by another worker: this one had been silent for its lease");
    }
    if worked.left > 0 {
        bail!("stopped; {} not done: the same command goes on", number_of(worked.left as u64, "run"));
    }
    let calibrated = results::<Calibrated>(&place, &runs, &args.out)?;
    let discovered = results::<Discovered>(&place, &runs, &args.out)?;
    let report = findings(place.url().as_str(), &calibrated, &discovered);
    let surveyed = Surveyed {
        analysed: worked.done,
        by_others: worked.by_others,
        kept: worked.kept,
        all: runs.len() + left_out,
        left_out,
        calibrated: calibrated.len(),
        searched: discovered.len(),
    };
    let json =
        serde_json::to_string_pretty(&SurveyJson { schema: SURVEY_SCHEMA, surveyed, report: &report })?;
    let page = args.out.join("report.html");
    for (path, text) in [(&page, &fleet_html(&report)), (&args.out.join("report.json"), &json)] {
        write_whole(path, text.as_bytes()).with_context(|| path.display().to_string())?;
    }
    if common.json {
        output::write(&format!("{json}\n"))?;
    } else {
        output::write(&in_short(&surveyed, &report, &page))?;
    }
    Ok(if report.refused.is_empty() { Exit::Done } else { Exit::Degraded })
}

fn run_query(runtime: Runtime, common: &Common, args: &QueryArgs) -> anyhow::Result<Exit> {
    let place = Place::at(&args.fleet.at)?;
    let spill = spill_folder(args.spill.as_deref())?;
    let interrupted = interrupted()?;
    let asked = runtime.block_on(async {
        tokio::select! {
            asked = ask(&place, spill.path(), common, args) => asked,
            interrupted = interrupted => {
                interrupted?.context("signals cannot be received")?;
                bail!("stopped by Ctrl-C; nothing is left behind")
            }
        }
    });
    // A thread in the middle of a join would go on until it has a row.
    runtime.shutdown_background();
    asked
}

/// Tells of Ctrl-C. On a thread and a runtime of its own, because a join may keep all threads of the query's runtime from looking for signals.
fn interrupted() -> anyhow::Result<oneshot::Receiver<io::Result<()>>> {
    let (tell, told) = oneshot::channel();
    let signals = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    thread::Builder::new().name("signals".into()).spawn(move || {
        // The query may be over already.
        drop(tell.send(signals.block_on(tokio::signal::ctrl_c())));
    })?;
    Ok(told)
}

/// A folder of the query's own, which disappears with it.
fn spill_folder(within: Option<&Path>) -> anyhow::Result<TempDir> {
    let mut folder = tempfile::Builder::new();
    folder.prefix("tactus-fleet-");
    match within {
        Some(within) => folder.tempdir_in(within).with_context(|| within.display().to_string()),
        None => folder.tempdir().context("there is no folder for temporary files"),
    }
}

#[cfg(feature = "cluster")]
fn run_scheduler(runtime: &Runtime, args: &SchedulerArgs) -> anyhow::Result<Exit> {
    let ready = |at| eprintln!("scheduler at {at}; Ctrl-C stops it");
    runtime.block_on(cluster::schedule(args.listen, args.lost_s, ready))?;
    Ok(Exit::Done)
}

#[cfg(feature = "cluster")]
fn run_executor(runtime: &Runtime, common: &Common, args: &ExecutorArgs) -> anyhow::Result<Exit> {
    let folder = spill_folder(args.spill.as_deref())?;
    let options = cluster::ExecutorOptions {
        scheduler: args.scheduler,
        listen: args.listen,
        threads: common.threads().get(),
        memory_bytes: bytes(args.memory) as u64,
        folder: folder.path().to_owned(),
    };
    let ready = |at| eprintln!("executor at {at} of the scheduler at {}; Ctrl-C stops it", args.scheduler);
    runtime.block_on(cluster::execute(options, ready))?;
    Ok(Exit::Done)
}

async fn ask(place: &Place, spill: &Path, common: &Common, args: &QueryArgs) -> anyhow::Result<Exit> {
    let limits = Limits {
        threads: common.threads(),
        memory_bytes: bytes(args.memory),
        spill: spill.to_owned(),
        #[cfg(feature = "cluster")]
        cluster: args.cluster,
    };
    let query = Query::new(place, &args.sql, &limits).await?;
    let mut progress = None;
    let show = |now| progress.get_or_insert_with(|| Bar::new("files", common.json)).show(now);
    if let Some(path) = &args.out {
        let mut file = OutFile::create(path, &query.columns())?;
        query.run(&mut file, show).await?;
        drop(progress);
        let rows = file.finish()?;
        let told = if common.json {
            format!("{}\n", serde_json::json!({ "schema": QUERY_SCHEMA, "out": path, "rows": rows }))
        } else {
            format!("{}: {}\n", number_of(rows, "row"), path.display())
        };
        output::write(&told)?;
    } else if common.json {
        query.run(&mut Lines, show).await?;
    } else {
        let mut table = Table::new(query.columns());
        query.run(&mut table, show).await?;
        drop(progress);
        output::write(&format!("{}\n", table.in_lines().join("\n")))?;
        if table.is_cut() {
            output::write(&format!(
                "the first {} rows\nnext: the same with --out rows.parquet, which takes all\n",
                Table::ROWS
            ))?;
        }
    }
    Ok(Exit::Done)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "such a cast takes the nearest number of bytes that there is"
)]
fn bytes(gb: f64) -> usize {
    (gb * 1e9) as usize
}

/// What `--json` prints of a query whose rows are in a file.
const QUERY_SCHEMA: &str = "tactus.fleet.query/1";

/// What became of the runs.
#[derive(Debug, Clone, Copy, Serialize)]
struct Surveyed {
    #[serde(rename = "runs_analysed")]
    analysed: usize,
    /// Analysed meanwhile by other workers.
    #[serde(rename = "runs_by_others")]
    by_others: usize,
    #[serde(rename = "runs_kept")]
    kept: usize,
    /// In the fleet.
    #[serde(rename = "runs_in_fleet")]
    all: usize,
    /// Files of `tactus collect` whose frames are in runs, too.
    #[serde(rename = "runs_left_out")]
    left_out: usize,
    /// With a calibration by this version of their file as it is now; the report is of these, and for effects of those that were searched.
    #[serde(rename = "runs_calibrated")]
    calibrated: usize,
    #[serde(rename = "runs_searched")]
    searched: usize,
}

/// `report.json`, and what `--json` prints.
#[derive(Serialize)]
struct SurveyJson<'a> {
    schema: &'static str,
    #[serde(flatten)]
    surveyed: Surveyed,
    #[serde(flatten)]
    report: &'a FleetReport,
}

const SURVEY_SCHEMA: &str = "tactus.fleet.survey/1";

/// What a survey found, in a few lines.
fn in_short(surveyed: &Surveyed, report: &FleetReport, page: &Path) -> String {
    let changing = |trends: &[Trend]| {
        let changing = trends.iter().filter(|trend| trend.changes).count();
        if surveyed.calibrated == 0 {
            "not calibrated".to_owned()
        } else {
            format!("{changing} of {}", trends.len())
        }
    };
    let shared = report.effects.iter().filter(|effect| effect.shared).map(|effect| effect.effect.as_str());
    let shared = match shared.collect::<Vec<&str>>().join(", ") {
        _ if surveyed.searched == 0 => "not searched".to_owned(),
        none if none.is_empty() => "no effect".to_owned(),
        shared => shared,
    };
    let simulated = if report.simulated { " (SIMULATED)" } else { "" };
    let by_others = match surveyed.by_others {
        0 => String::new(),
        number => format!(", {number} by other workers"),
    };
    let left_out = match surveyed.left_out {
        0 => String::new(),
        number => format!(
            "left out     {} of `tactus collect`, whose frames are in runs\n",
            number_of(number as u64, "file")
        ),
    };
    let refused = match report.refused.as_slice() {
        [] => String::new(),
        refused => {
            format!("not judged   {}, the first: {}\n", number_of(refused.len() as u64, "run"), refused[0])
        }
    };
    format!(
        "runs         {} analysed{by_others}, {} kept, of {}{simulated}\n\
         {left_out}calibrated   {} of {} runs\n\
         searched     {} of {} runs\n\
         drifts       {}\n\
         ageing       {}\n\
         shared       {shared}\n\
         {refused}report       {}\n",
        surveyed.analysed,
        surveyed.kept,
        number_of(report.rigs, "rig"),
        surveyed.calibrated,
        surveyed.all,
        surveyed.searched,
        surveyed.all,
        changing(&report.drifts),
        changing(&report.ageing),
        page.display()
    )
}
