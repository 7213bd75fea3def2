//! Receivers of frames, reports and events: the recording, which must not lose any, and the viewers.

use std::error::Error;

use tactus_schema::{Frame, MonoTime, TimeStamp, pb};

/// A recording in progress. An error fails the run.
pub trait Record: Send {
    /// What the sensor says of itself.
    ///
    /// # Errors
    /// If it could not be stored; the recording is then incomplete.
    fn sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordFailure>;
    /// One frame.
    ///
    /// # Errors
    /// As [`Record::sensor_info`].
    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure>;
    /// One report of the stage.
    ///
    /// # Errors
    /// As [`Record::sensor_info`].
    fn stage(&mut self, state: &pb::StageState) -> Result<(), RecordFailure>;
    /// One event of the run.
    ///
    /// # Errors
    /// As [`Record::sensor_info`].
    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure>;
    /// One action of the safety supervisor.
    ///
    /// # Errors
    /// As [`Record::sensor_info`].
    fn safety(&mut self, event: &pb::SafetyEvent) -> Result<(), RecordFailure>;
    /// Looks at the time, because messages may fail to come. Called about thirty times a second.
    ///
    /// # Errors
    /// As [`Record::sensor_info`].
    fn check(&mut self, _now: MonoTime) -> Result<(), RecordFailure> {
        Ok(())
    }

    /// A warning for who watches the run, each once.
    fn alarm(&mut self) -> Option<String> {
        None
    }

    /// Closes the recording; returns once everything is on disk. It is called after a failure, too, and its error then has the
    /// final counts.
    ///
    /// # Errors
    /// If earlier data could not be stored.
    fn finish(self: Box<Self>) -> Result<(), RecordFailure>;
}

/// The recording could not be written.
#[derive(Debug, thiserror::Error)]
#[error("the recording failed: {0}")]
pub struct RecordFailure(#[from] pub Box<dyn Error + Send + Sync>);

/// Publishes to the viewers. Must return at once: an implementation drops and counts what it cannot send.
pub trait Publish: Send + Sync {
    /// What the sensor says of itself.
    fn sensor_info(&self, info: &pb::SensorInfo);
    /// One frame.
    fn frame(&self, frame: &Frame);
    /// One frame, while nobody may move the stage and nothing is recorded: this call alone may take up to a tenth of a second.
    fn frame_at_rest(&self, frame: &Frame) {
        self.frame(frame);
    }
    /// One report of the stage.
    fn stage(&self, state: &pb::StageState);
    /// One event of the run.
    fn event(&self, event: &pb::RunEvent);
    /// State of the run.
    fn state(&self, state: &pb::RunState);
    /// One action of the safety supervisor.
    fn safety(&self, event: &pb::SafetyEvent);
}

/// Publishes to nobody.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unpublished;

impl Publish for Unpublished {
    fn sensor_info(&self, _: &pb::SensorInfo) {}
    fn frame(&self, _: &Frame) {}
    fn stage(&self, _: &pb::StageState) {}
    fn event(&self, _: &pb::RunEvent) {}
    fn state(&self, _: &pb::RunState) {}
    fn safety(&self, _: &pb::SafetyEvent) {}
}

/// Takes what a recording takes, and keeps none of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unrecorded;

impl Record for Unrecorded {
    fn sensor_info(&mut self, _: &pb::SensorInfo, _: TimeStamp) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn frame(&mut self, _: &Frame) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn stage(&mut self, _: &pb::StageState) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn event(&mut self, _: &pb::RunEvent) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn safety(&mut self, _: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        Ok(())
    }
}
