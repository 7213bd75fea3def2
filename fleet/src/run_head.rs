//! What a file says of its run, in its metadata.

use futures::{StreamExt as _, stream};
use object_store::{ObjectMeta, ObjectStoreExt as _};
use parquet::{
    errors::ParquetError,
    file::metadata::{KeyValue, ParquetMetaData, ParquetMetaDataReader},
};
use serde::{Deserialize, Serialize};
use tactus_schema::table::RIG_METADATA_KEY;

use crate::{Place, PlaceError};

/// Key of the file metadata that holds the head as JSON.
const METADATA_KEY: &str = "tactus.run";

/// Form of the head.
pub(crate) const SCHEMA: &str = "tactus.fleet.run/2";

/// Bytes at the end of a file that tell it from others of its size, and hold the metadata of most.
pub(crate) const END_BYTES: u64 = 64 * 1024;

/// What a file says of its run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunHead {
    /// Form of this head.
    pub schema: String,
    /// Id of the run.
    pub run: String,
    /// Name of the rig.
    pub rig: String,
    /// Day of its start, UTC, as `YYYY-MM-DD`.
    pub date: String,
    /// When it began, nanoseconds since 1970, UTC; none of runs in tables.
    pub started_ns: Option<i64>,
    /// Time from its first frame to its last in nanoseconds; none in heads of form 1.
    #[serde(default)]
    pub frames_ns: Option<i64>,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// Name of the experiment; none of runs in tables, as the next two.
    pub experiment: Option<String>,
    /// File name of the experiment's script.
    pub script: Option<String>,
    /// Who started the run.
    pub who: Option<String>,
    /// Id of the earlier run that it goes on with, if it does.
    pub continues: Option<String>,
    /// Id of the run that goes on with it, whose presses are left out here.
    pub continued_by: Option<String>,
    /// Size of the file that the rows come from. A file of another size is read anew.
    pub source_bytes: u64,
    /// CRC-32 of its last 64 KiB. A file of another one is read anew, and so is one of a head of form 1, which has none: equal sizes alone
    /// do not make two files one.
    #[serde(default)]
    pub source_end_crc32: Option<u32>,
    /// What readers of the rows must know, a sentence each.
    pub warnings: Vec<String>,
}

/// How many files are asked at a time.
const AT_A_TIME: usize = 32;

/// Why a file is not that of a run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum HeadError {
    #[error(transparent)]
    Place(#[from] PlaceError),
    #[error("{path}: {problem}: delete it, and ingest its run again")]
    NotOfRun { path: String, problem: String },
}

impl RunHead {
    /// The pair of a file's metadata.
    pub(crate) fn to_metadata(&self) -> serde_json::Result<KeyValue> {
        Ok(KeyValue::new(METADATA_KEY.to_owned(), serde_json::to_string(self)?))
    }

    /// What a file says; its rows are not read.
    pub(crate) async fn read(place: &Place, file: &ObjectMeta) -> Result<Self, HeadError> {
        of_metadata(file, &end(place, file).await?.0)
    }

    /// What these files say, in their order. Those that are not readable are left out.
    pub(crate) async fn readable(place: &Place, files: Vec<ObjectMeta>) -> Vec<Self> {
        let reads = stream::iter(files).map(async |file| Self::read(place, &file).await.ok());
        reads.buffered(AT_A_TIME).filter_map(std::future::ready).collect().await
    }

    /// About when it ended, nanoseconds since 1970, UTC; none of runs in tables.
    pub(crate) fn ended_ns(&self) -> Option<i64> {
        Some(self.started_ns?.saturating_add(self.frames_ns.unwrap_or_default()))
    }

    /// True if its rows come from a recording.
    pub(crate) fn is_recorded(&self) -> bool {
        self.started_ns.is_some()
    }

    /// True if the rows of both come from the same file. It may have been cut in one where another run goes on.
    pub(crate) fn is_same_source(&self, other: &Self) -> bool {
        self.schema == other.schema
            && self.source_bytes == other.source_bytes
            && self.source_end_crc32 == other.source_end_crc32
    }
}

/// The head of a run, and what else the end of its file says.
#[derive(Debug)]
pub(crate) struct Described {
    pub(crate) head: RunHead,
    /// The rig's description.
    pub(crate) rig_json: String,
    pub(crate) frames: i64,
    pub(crate) bytes: u64,
    /// CRC-32 of the file's last 64 KiB.
    pub(crate) end_crc32: u32,
}

impl Described {
    /// What all files of a fleet say, in order of their paths.
    pub(crate) async fn all(place: &Place) -> Result<Vec<Self>, HeadError> {
        Self::each(place, |_, described| described).await?.into_iter().collect()
    }

    /// Takes what each file of a fleet says, or why it is not readable, in order of their paths.
    pub(crate) async fn each<T>(
        place: &Place,
        take: impl Fn(ObjectMeta, Result<Self, HeadError>) -> T,
    ) -> Result<Vec<T>, PlaceError> {
        let reads = stream::iter(place.files().await?).map(async |file| {
            let described = Self::read(place, &file).await;
            (file, described)
        });
        Ok(reads.buffered(AT_A_TIME).map(|(file, described)| take(file, described)).collect().await)
    }

    /// What a file says; its rows are not read.
    pub(crate) async fn read(place: &Place, file: &ObjectMeta) -> Result<Self, HeadError> {
        let (metadata, end_crc32) = end(place, file).await?;
        Ok(Self {
            head: of_metadata(file, &metadata)?,
            rig_json: value(file, &metadata, RIG_METADATA_KEY)?.to_owned(),
            frames: metadata.file_metadata().num_rows(),
            bytes: file.size,
            end_crc32,
        })
    }
}

fn of_metadata(file: &ObjectMeta, metadata: &ParquetMetaData) -> Result<RunHead, HeadError> {
    let head = value(file, metadata, METADATA_KEY)?;
    serde_json::from_str(head).map_err(|error| not_of_run(file, format!("{METADATA_KEY}: {error}")))
}

/// What the metadata have under a key.
fn value<'a>(file: &ObjectMeta, metadata: &'a ParquetMetaData, key: &str) -> Result<&'a str, HeadError> {
    let mut pairs = metadata.file_metadata().key_value_metadata().into_iter().flatten();
    let value = pairs.find(|pair| pair.key == key).and_then(|pair| pair.value.as_deref());
    value.ok_or_else(|| not_of_run(file, format!("its metadata lack {key:?}")))
}

/// The metadata, and CRC-32 of the last 64 KiB.
async fn end(place: &Place, file: &ObjectMeta) -> Result<(ParquetMetaData, u32), HeadError> {
    let mut wanted = END_BYTES.min(file.size);
    let mut end_crc32 = None;
    loop {
        let end = place.store().get_range(&file.location, file.size - wanted..file.size);
        let end = end.await.map_err(|source| place.refused(source))?;
        // A longer end comes later only.
        let end_crc32 = *end_crc32.get_or_insert_with(|| crc32fast::hash(&end));
        let mut reader = ParquetMetaDataReader::new();
        match reader.try_parse_sized(&end, file.size) {
            Ok(()) => {}
            Err(ParquetError::NeedMoreData(more)) if wanted < file.size => {
                wanted = u64::try_from(more).unwrap_or(u64::MAX).max(wanted + 1).min(file.size);
                continue;
            }
            Err(error) => return Err(not_of_run(file, error.to_string())),
        }
        let metadata = reader.finish().map_err(|error| not_of_run(file, error.to_string()))?;
        return Ok((metadata, end_crc32));
    }
}

fn not_of_run(file: &ObjectMeta, problem: String) -> HeadError {
    HeadError::NotOfRun { path: file.location.to_string(), problem }
}
