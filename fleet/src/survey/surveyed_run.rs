//! The runs that a survey is of.

use std::collections::BTreeSet;

use object_store::ObjectMeta;

use crate::{Place, PlaceError, RunHead, run_head::Described, twice::collected_too};

/// A run of a fleet, as it is when a survey begins.
#[derive(Debug)]
pub(crate) struct SurveyedRun {
    pub(crate) file: ObjectMeta,
    /// Names as the path has them, if the file is not readable.
    pub(crate) run: String,
    pub(crate) rig: String,
    pub(crate) date: String,
    pub(crate) started_ns: Option<i64>,
    pub(crate) simulated: bool,
    /// CRC-32 of the file's last 64 KiB, or why it is not readable.
    pub(crate) end_crc32: Result<u32, String>,
}

impl SurveyedRun {
    /// All runs of a fleet, in order of their paths, without files of `tactus collect` whose frames are in runs, too; and the number of
    /// these files.
    ///
    /// # Errors
    /// If the fleet cannot be listed. A file that is not readable says so itself.
    pub(crate) async fn all(place: &Place) -> Result<(Vec<Self>, usize), PlaceError> {
        let files = Described::each(place, |file, described| {
            (file, described.map(|Described { head, end_crc32, .. }| (head, end_crc32)))
        });
        let files = files.await?;
        let heads: Vec<RunHead> =
            files.iter().filter_map(|(_, read)| Some(read.as_ref().ok()?.0.clone())).collect();
        let left_out: BTreeSet<_> =
            collected_too(&heads).map(|(collection, _)| (&collection.rig, &collection.run)).collect();
        let is_left_out = |head: &RunHead| left_out.contains(&(&head.rig, &head.run));
        let all = files.into_iter().filter_map(|(file, read)| match read {
            Ok((head, _)) if is_left_out(&head) => None,
            Ok((head, end_crc32)) => Some(Self::readable(file, head, end_crc32)),
            Err(problem) => Some(Self::unreadable(place, file, problem.to_string())),
        });
        Ok((all.collect(), left_out.len()))
    }

    fn readable(file: ObjectMeta, head: RunHead, end_crc32: u32) -> Self {
        Self {
            file,
            run: head.run,
            rig: head.rig,
            date: head.date,
            started_ns: head.started_ns,
            simulated: head.simulated,
            end_crc32: Ok(end_crc32),
        }
    }

    fn unreadable(place: &Place, file: ObjectMeta, problem: String) -> Self {
        let parts = place.in_fleet(&file.location);
        let part = |from_end: usize, start: &str, end: &str| {
            let part = parts.len().checked_sub(from_end).and_then(|at| parts.get(at));
            let part = part.map(String::as_str).unwrap_or_default();
            let part = part.strip_prefix(start).unwrap_or(part);
            part.strip_suffix(end).unwrap_or(part).to_owned()
        };
        Self {
            run: part(1, "", ".parquet"),
            rig: part(3, "rig=", ""),
            date: part(2, "date=", ""),
            started_ns: None,
            simulated: false,
            end_crc32: Err(problem),
            file,
        }
    }
}
