//! The recorded runs: listed, marked, compared, reported, downloaded, made again. Files are read on threads that may wait.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use axum::body::Bytes;
use futures_util::{Stream, stream};
use serde::Deserialize;
use serde_json::{Value, json};
use tactus_record::table::TableFormat;
use tactus_runs::{ListedRun, RunsError, RunsFolder};
use tactus_schema::pb;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use crate::order;

/// Reports and tables that are made at a time: each reads a whole recording.
const BUSY_MAX: usize = 2;
/// Runs that are compared at most.
const COMPARED_MAX: usize = 8;
/// Longest note, in bytes.
const NOTE_BYTES_MAX: usize = 16 << 10;
/// Bytes of a download that are read at once.
const PIECE_BYTES: usize = 256 << 10;

/// The runs of a folder.
#[derive(Debug, Clone)]
pub(crate) struct Runs {
    folder: Arc<RunsFolder>,
    places: Arc<Semaphore>,
}

/// Why there is no answer.
#[derive(Debug)]
pub(crate) enum NotRead {
    /// There is no such run, or no such file of one.
    Unknown(String),
    /// The request is not understood.
    Wrong(String),
    /// Too much at once.
    Busy(String),
    /// Any other reason.
    Failed(String),
}

/// A file to be sent.
pub(crate) struct Download {
    /// The name under which a browser keeps it.
    pub(crate) name: String,
    pub(crate) bytes: Pin<Box<dyn Stream<Item = io::Result<Bytes>> + Send>>,
}

/// Body of `POST /runs/ID/notes`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NotesForm {
    tags: Vec<String>,
    note: String,
}

/// Body of `POST /runs/ID/again`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AgainForm {
    #[serde(default)]
    who: String,
}

impl From<RunsError> for NotRead {
    fn from(error: RunsError) -> Self {
        if error.is_usage() { Self::Unknown(error.to_string()) } else { Self::Failed(error.to_string()) }
    }
}

impl Runs {
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder: Arc::new(RunsFolder::new(folder)), places: Arc::new(Semaphore::new(BUSY_MAX)) }
    }

    pub(crate) async fn list(&self) -> Result<Value, NotRead> {
        self.read(|folder| {
            let found = folder.runs()?;
            let runs: Vec<Value> = found.runs.iter().rev().map(view).collect();
            Ok(json!({ "runs": runs, "unreadable": found.unreadable }))
        })
        .await
    }

    pub(crate) async fn compare(&self, ids: Vec<String>) -> Result<Value, NotRead> {
        if ids.len() > COMPARED_MAX {
            return Err(NotRead::Wrong(format!("at most {COMPARED_MAX} runs can be compared")));
        }
        self.computed(move |folder| Ok(json!(folder.compare(&ids)?))).await
    }

    pub(crate) async fn mark(&self, id: String, body: &[u8]) -> Result<Value, NotRead> {
        let NotesForm { tags, note } = order::parse(body).map_err(NotRead::Wrong)?;
        if note.len() > NOTE_BYTES_MAX {
            return Err(NotRead::Wrong(format!("a note has at most {NOTE_BYTES_MAX} bytes")));
        }
        let tags: Result<Vec<String>, String> = tags.iter().map(|tag| tactus_runs::tag(tag)).collect();
        let tags = tags.map_err(NotRead::Wrong)?;
        self.read(move |folder| {
            let run = folder.find(&id)?;
            let marked = tactus_runs::mark(run, |notes| {
                notes.set_tags(tags);
                notes.note = note;
            })?;
            Ok(view(&marked))
        })
        .await
    }

    /// What makes a run again.
    pub(crate) async fn again(&self, id: String, body: &[u8]) -> Result<pb::RunRequest, NotRead> {
        let AgainForm { who } = order::parse(body).map_err(NotRead::Wrong)?;
        self.read(move |folder| {
            let again = tactus_runs::again(&folder.find(&id)?.entry.path)?;
            Ok(pb::RunRequest {
                experiment: again.experiment,
                script: again.source,
                parameters_json: again.parameters_json,
                seed: Some(again.seed),
                who: order::name(&who),
                ..Default::default()
            })
        })
        .await
    }

    /// The report of a run as HTML.
    pub(crate) async fn report(&self, id: String) -> Result<String, NotRead> {
        self.computed(move |folder| {
            let report = tactus_report::run_report(&folder.find(&id)?.entry.path).map_err(RunsError::from)?;
            Ok(tactus_report::render_html(&report))
        })
        .await
    }

    /// A run's recording (`mcap`), or its table in a format.
    pub(crate) async fn download(&self, id: String, format: &str) -> Result<Download, NotRead> {
        let table = TableFormat::ALL.into_iter().find(|one| one.name() == format);
        if table.is_none() && format != "mcap" {
            return Err(NotRead::Unknown("there is report, parquet, csv, npz and mcap".to_owned()));
        }
        let (name, file) = self
            .computed(move |folder| {
                let entry = folder.find(&id)?.entry;
                let failed = |error: io::Error| NotRead::Failed(error.to_string());
                match table {
                    None => Ok((format!("{}.mcap", entry.run_id), File::open(&entry.path).map_err(failed)?)),
                    Some(table) => {
                        let name = format!("{}.{}", entry.run_id, table.name());
                        Ok((name, exported(&entry.path, table)?))
                    }
                }
            })
            .await?;
        Ok(Download { name, bytes: Box::pin(pieces(file)) })
    }

    /// Reads what is quick.
    async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&RunsFolder) -> Result<T, NotRead> + Send + 'static,
    ) -> Result<T, NotRead> {
        let folder = Arc::clone(&self.folder);
        let done = spawn_blocking(move || read(&folder)).await;
        done.unwrap_or_else(|panic| Err(NotRead::Failed(format!("a defect of this program: {panic}"))))
    }

    /// Reads whole recordings, a few at a time.
    async fn computed<T: Send + 'static>(
        &self,
        read: impl FnOnce(&RunsFolder) -> Result<T, NotRead> + Send + 'static,
    ) -> Result<T, NotRead> {
        let Ok(place) = Arc::clone(&self.places).try_acquire_owned() else {
            return Err(NotRead::Busy("other reports or tables are being made: try again".to_owned()));
        };
        self.read(move |folder| {
            // Held until the work is done, also if the browser does not wait for it.
            let _place = place;
            read(folder)
        })
        .await
    }
}

/// What a page gets of a run: all but its path.
fn view(run: &ListedRun) -> Value {
    let mut value = run.to_json();
    if let Some(fields) = value.as_object_mut() {
        fields.remove("path");
    }
    value
}

/// A table of a recording. Its file has no name any more: it goes when it is closed.
fn exported(recording: &Path, format: TableFormat) -> Result<File, NotRead> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let failed = |error: &dyn std::fmt::Display| NotRead::Failed(error.to_string());
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("tactus-web-{}-{number}", std::process::id()));
    fs::create_dir(&folder).map_err(|error| failed(&error))?;
    let path = folder.join("table");
    let written = tactus_record::export_as(&[recording], &path, format).map_err(|error| failed(&error));
    let file = written.and_then(|_| File::open(&path).map_err(|error| failed(&error)));
    // An error of the removal would hide the one that matters.
    drop(fs::remove_dir_all(&folder));
    file
}

/// The bytes of a file, read as fast as the browser takes them.
fn pieces(file: File) -> impl Stream<Item = io::Result<Bytes>> + Send {
    stream::unfold(Some(file), |file| async move {
        let mut file = file?;
        let read = spawn_blocking(move || {
            let mut piece = vec![0; PIECE_BYTES];
            let read = file.read(&mut piece)?;
            piece.truncate(read);
            Ok::<_, io::Error>((piece, file))
        });
        match read.await.unwrap_or_else(|panic| Err(io::Error::other(panic))) {
            Ok((piece, _)) if piece.is_empty() => None,
            Ok((piece, file)) => Some((Ok(piece.into()), Some(file))),
            Err(error) => Some((Err(error), None)),
        }
    })
}
