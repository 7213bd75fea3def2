//! SQL over all runs of a fleet.
//!
//! | module | does |
//! |---|---|
//! | `session` | the tables, the functions, and how much memory a query may take |
//! | `runs` | the table of runs, from the heads of the files |
//! | `image` | `image(counts)`: the mean image of frames |
//! | `response` | `response(image, zeros)` |
//! | `rms` | `rms(list)` |
//! | `predicted` | `predicted('model.toml')`: frames with what a model predicts |
//! | `lists` | columns of lists as slices of numbers |
//! | `answer` | rows as a table for people, as JSON, and as files |
//! | `problem` | why a query has no answer, for who wrote it |

mod answer;
mod image;
mod lists;
mod predicted;
mod problem;
mod response;
mod rms;
mod runs;
mod session;

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, time::Duration};

use arrow::datatypes::SchemaRef;
use datafusion::{
    datasource::{
        physical_plan::{FileGroup, FileScanConfig},
        source::DataSourceExec,
    },
    error::DataFusionError,
    execution::TaskContext,
    physical_plan::{ExecutionPlan, execute_stream},
};
use futures::StreamExt as _;
use tokio::time::{Instant, interval_at};

#[cfg(feature = "cluster")]
use crate::cluster;
use tactus_work::Now;

use crate::Place;

pub(crate) use answer::{Answer, Lines, OutFile, Table};
use problem::in_words;
#[cfg(feature = "cluster")]
pub(crate) use {predicted::Prediction, runs::Runs, session::register_functions};

/// What a query may take.
#[derive(Debug, Clone)]
pub(crate) struct Limits {
    /// How many threads compute.
    pub(crate) threads: NonZeroUsize,
    /// Memory for sorts, groups and joins. What is beyond goes to the disk. What is just read comes on top.
    pub(crate) memory_bytes: usize,
    /// Folder for what goes to the disk.
    pub(crate) spill: PathBuf,
    /// The scheduler of the cluster that does all that; `None` if this process does it.
    #[cfg(feature = "cluster")]
    pub(crate) cluster: Option<std::net::SocketAddr>,
}

/// A query that can be run.
pub(crate) struct Query {
    place: Place,
    sql: String,
    plan: Arc<dyn ExecutionPlan>,
    context: Arc<TaskContext>,
}

impl Query {
    /// Work that takes longer shows its progress.
    const PATIENCE: Duration = Duration::from_secs(2);
    const TICK: Duration = Duration::from_millis(500);

    /// Checks the query, and decides how it is run. Ends of files are read, their rows are not.
    pub(crate) async fn new(place: &Place, sql: &str, limits: &Limits) -> anyhow::Result<Self> {
        #[cfg(feature = "cluster")]
        if let Some(scheduler) = limits.cluster {
            cluster::check(scheduler, place).await?;
        }
        place.check_holds_runs().await?;
        match Self::planned(place, sql, limits).await {
            Ok(query) => Ok(query),
            Err(error) => Err(in_words(error, place, sql).await),
        }
    }

    async fn planned(place: &Place, sql: &str, limits: &Limits) -> Result<Self, DataFusionError> {
        let session = session::session(place, limits).await?;
        let frame = session.sql_with_options(sql, session::read_only()).await?;
        let context = Arc::new(frame.task_ctx());
        let plan = frame.create_physical_plan().await?;
        Ok(Self { place: place.clone(), sql: sql.to_owned(), plan, context })
    }

    /// Columns of the answer.
    pub(crate) fn columns(&self) -> SchemaRef {
        self.plan.schema()
    }

    /// Runs the query until the answer wants no more; how far it is, is shown if it takes long.
    pub(crate) async fn run(self, answer: &mut dyn Answer, mut show: impl FnMut(Now)) -> anyhow::Result<()> {
        let mut ticks = interval_at(Instant::now() + Self::PATIENCE, Self::TICK);
        let mut batches = match execute_stream(Arc::clone(&self.plan), Arc::clone(&self.context)) {
            Ok(batches) => batches,
            Err(error) => return Err(in_words(error, &self.place, &self.sql).await),
        };
        loop {
            tokio::select! {
                batch = batches.next() => match batch {
                    Some(Ok(batch)) => if answer.add(&batch)?.is_break() { return Ok(()) },
                    Some(Err(error)) => return Err(in_words(error, &self.place, &self.sql).await),
                    None => return Ok(()),
                },
                _ = ticks.tick() => match self.scanned() {
                    // A cluster does not say how far it is.
                    Now { pieces_all: 0, .. } => {}
                    now => show(now),
                },
            }
        }
    }

    /// How many of the files that the query reads are done.
    fn scanned(&self) -> Now {
        let mut now = Now::default();
        add_scans(&self.plan, &mut now);
        now
    }
}

/// Adds the files that a plan reads. A part of a file counts as one.
fn add_scans(plan: &Arc<dyn ExecutionPlan>, now: &mut Now) {
    if let Some(scan) = plan.downcast_ref::<DataSourceExec>()
        && let Some(files) = scan.data_source().downcast_ref::<FileScanConfig>()
    {
        now.pieces_all += files.file_groups.iter().map(FileGroup::len).sum::<usize>();
        let done = scan.metrics().and_then(|metrics| metrics.sum_by_name("files_processed"));
        now.pieces += done.map_or(0, |done| done.as_usize());
        (now.size, now.size_all) = (now.pieces as u64, now.pieces_all as u64);
    }
    for input in plan.children() {
        add_scans(input, now);
    }
}
