//! A recording for stock MCAP viewers such as Foxglove: the array as a grid and an image, the stage and the sensor as transforms, the
//! events as a log, all in the viewers' own schemas.
//!
//! It is a file of its own: a recording keeps what was measured, once.

mod schemas;

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use mcap::records::MessageHeader;
use tactus_record::{Entry, Message, Timeline, read};
use tactus_schema::{
    Frame, Rig, WallTime,
    pb::{self, run_event::Event},
};

use crate::run::{ReportError, log::in_words};
use schemas::{
    FrameTransform, Grid, Level, Log, PackedElementField, Pose, Quaternion, RawImage, Timestamp, Vector2,
    Vector3,
};

/// The viewers' schemas, as the package foxglove-schemas-protobuf 0.4 (MIT) has them: Grid, `RawImage`, `FrameTransform`, Log.
const SCHEMAS: &[u8] = include_bytes!("../foxglove/schemas.binpb");

/// Viewers have metres.
const M_PER_MM: f64 = 1e-3;

/// Name of the frames of reference.
const ROBOT: &str = "robot";
const SENSOR: &str = "sensor";
const TIP: &str = "tip";

/// What was written.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ViewerFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Number of frames in it.
    pub frames: u64,
    /// Number of reports of the stage.
    pub positions: u64,
    /// Number of lines of the log.
    pub lines: u64,
}

/// Writes a recording, complete or damaged, for stock viewers.
///
/// # Errors
/// If the recording cannot be read, or the file cannot be written.
pub fn viewer_file(recording: &Path, out: impl Into<PathBuf>) -> Result<ViewerFile, ReportError> {
    let out = out.into();
    let timeline = Timeline::read(recording)?;
    let part = with_suffix(&out, ".part");
    let written = write(recording, &timeline, &part);
    let failed = |source| ReportError::Io { path: out.clone(), source };
    match written.and_then(|written| fs::rename(&part, &out).map(|()| written).map_err(failed)) {
        Ok(Written { frames, positions, lines }) => Ok(ViewerFile { path: out, frames, positions, lines }),
        Err(error) => {
            // An error of the removal would hide the one that matters.
            drop(fs::remove_file(&part));
            Err(error)
        }
    }
}

#[derive(Default)]
struct Written {
    frames: u64,
    positions: u64,
    lines: u64,
}

fn write(recording: &Path, timeline: &Timeline, part: &Path) -> Result<Written, ReportError> {
    let io_failed = |source| ReportError::Io { path: part.to_owned(), source };
    let failed = |error: mcap::McapError| io_failed(io::Error::other(error));
    let read_failed = |source| ReportError::Io { path: recording.to_owned(), source };
    let rig = timeline.rig();
    let greatest_counts = greatest_rise(recording, timeline)?;
    let mut viewer = Viewer::create(part, rig).map_err(failed)?;
    let mut zero = Zero::of(rig);
    let (mut written, mut is_placed) = (Written::default(), false);
    for entry in read(recording)? {
        let Entry::Message { message, at, .. } = entry.map_err(read_failed)? else { continue };
        if !is_placed {
            viewer.sensor_at(rig, at).map_err(failed)?;
            is_placed = true;
        }
        #[expect(clippy::wildcard_enum_match_arm, reason = "other kinds have no picture")]
        match message {
            Message::Frame(frame) => {
                viewer.frame(&frame, &zero.rises(&frame), greatest_counts, at).map_err(failed)?;
                written.frames += 1;
            }
            Message::Stage(state) => {
                written.positions += u64::from(viewer.tip_at(&state, at).map_err(failed)?);
            }
            Message::Event(event) => {
                zero.take(&event);
                let (kind, detail) = in_words(&event);
                // Where the tip is, the transforms say.
                if !matches!(kind, "phase" | "step done") {
                    viewer.log(level_of(&event), kind, &detail, at).map_err(failed)?;
                    written.lines += 1;
                }
            }
            Message::Safety(event) => {
                let level =
                    if event.verdict() == pb::SafetyVerdict::Clear { Level::Info } else { Level::Error };
                viewer.log(level, &event.rule, &event.detail, at).map_err(failed)?;
                written.lines += 1;
            }
            _ => {}
        }
    }
    viewer.mcap.finish().map_err(failed)?;
    let file = viewer.mcap.into_inner().into_inner().map_err(|error| io_failed(error.into_error()))?;
    file.sync_all().map_err(io_failed)?;
    Ok(written)
}

/// The reading that counts as no load: the last reference or tare, before them the rig's baseline.
struct Zero(Vec<f32>);

impl Zero {
    fn of(rig: &Rig) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "counts are far within f32")]
        let counts = rig.baseline_counts.iter().map(|counts| *counts as f32).collect();
        Self(counts)
    }

    fn take(&mut self, event: &pb::RunEvent) {
        let counts = match &event.event {
            Some(Event::ReferenceDone(reference)) => &reference.mean_counts,
            Some(Event::TareDone(tare)) => &tare.baseline_counts,
            _ => return,
        };
        if counts.len() == self.0.len() {
            self.0.clone_from(counts);
        }
    }

    fn rises(&self, frame: &Frame) -> Vec<f32> {
        frame.counts.iter().zip(&self.0).map(|(counts, zero)| counts - zero).collect()
    }
}

/// The greatest rise of any element in the run, at least 1: white in the image.
fn greatest_rise(recording: &Path, timeline: &Timeline) -> Result<f32, ReportError> {
    let mut zero = Zero::of(timeline.rig());
    let mut greatest = 1.0_f32;
    for entry in read(recording)? {
        match entry.map_err(|source| ReportError::Io { path: recording.to_owned(), source })? {
            Entry::Message { message: Message::Event(event), .. } => zero.take(&event),
            Entry::Message { message: Message::Frame(frame), .. } => {
                greatest =
                    zero.rises(&frame).into_iter().filter(|rise| rise.is_finite()).fold(greatest, f32::max);
            }
            Entry::Run(_) | Entry::Attachment(_) | Entry::Message { .. } => {}
        }
    }
    Ok(greatest)
}

/// How grave an event is.
fn level_of(event: &pb::RunEvent) -> Level {
    match &event.event {
        Some(Event::StopRequested(_)) => Level::Error,
        Some(Event::Gap(_) | Event::PressRepeated(_) | Event::Paused(_) | Event::LeaseTaken(_)) => {
            Level::Warning
        }
        Some(Event::Finished(finished)) if finished.exit_status() != pb::ExitStatus::Done => Level::Warning,
        _ => Level::Info,
    }
}

/// A file of the viewers' messages being written.
struct Viewer {
    mcap: mcap::Writer<BufWriter<File>>,
    channels: [u16; 5],
    /// Size of the grid's cells, x and y.
    cell_mm: [f64; 2],
    corner_mm: [f64; 2],
    shape: [usize; 2],
}

#[derive(Clone, Copy)]
enum Channel {
    Grid,
    Image,
    Tip,
    Sensor,
    Log,
}

impl Viewer {
    fn create(path: &Path, rig: &Rig) -> Result<Self, mcap::McapError> {
        let file = BufWriter::new(File::create(path)?);
        let mut mcap = mcap::WriteOptions::new().profile("").library("tactus").create(file)?;
        let mut channels = [0; 5];
        for (channel, (topic, schema)) in channels.iter_mut().zip([
            ("/array/grid", "foxglove.Grid"),
            ("/array/image", "foxglove.RawImage"),
            ("/tf", "foxglove.FrameTransform"),
            ("/tf/sensor", "foxglove.FrameTransform"),
            ("/log", "foxglove.Log"),
        ]) {
            let schema = mcap.add_schema(schema, "protobuf", SCHEMAS)?;
            *channel = mcap.add_channel(schema, topic, "protobuf", &BTreeMap::new())?;
        }
        let array = &rig.array;
        // A grid's cells are even; those of an array need not be.
        let even = |centres: &[f64], size_mm: f64| match centres {
            [first, .., last] => (last - first) / (centres.len() - 1) as f64,
            _ => size_mm,
        };
        let [x_mm, y_mm] = array.element_mm();
        let cell_mm = [even(array.col_centres_mm(), x_mm), even(array.row_centres_mm(), y_mm)];
        let first = |centres: &[f64]| centres.first().copied().unwrap_or(0.0);
        let corner_mm = [
            first(array.col_centres_mm()) - cell_mm[0] / 2.0,
            first(array.row_centres_mm()) - cell_mm[1] / 2.0,
        ];
        Ok(Self { mcap, channels, cell_mm, corner_mm, shape: [array.rows(), array.cols()] })
    }

    fn put(
        &mut self,
        channel: Channel,
        message: &impl prost::Message,
        at: WallTime,
    ) -> Result<(), mcap::McapError> {
        let log_time = u64::try_from(at.ns()).unwrap_or(0);
        let channel_id = self.channels[channel as usize];
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        self.mcap.write_to_known_channel(&header, &message.encode_to_vec())
    }

    fn sensor_at(&mut self, rig: &Rig, at: WallTime) -> Result<(), mcap::McapError> {
        let [x_mm, y_mm] = rig.registration.origin_mm;
        let half = rig.registration.rotation_deg.to_radians() / 2.0;
        let transform = FrameTransform {
            timestamp: Some(Timestamp::of(at)),
            parent_frame_id: ROBOT.into(),
            child_frame_id: SENSOR.into(),
            translation: Some(metres([x_mm, y_mm, 0.0])),
            rotation: Some(Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() }),
        };
        self.put(Channel::Sensor, &transform, at)
    }

    /// False if the stage does not say where it is.
    fn tip_at(&mut self, state: &pb::StageState, at: WallTime) -> Result<bool, mcap::McapError> {
        let position_mm = [state.x_mm, state.y_mm, state.z_mm];
        if state.status() == pb::StageStatus::Disconnected || !position_mm.iter().all(|mm| mm.is_finite()) {
            return Ok(false);
        }
        let transform = FrameTransform {
            timestamp: Some(Timestamp::of(at)),
            parent_frame_id: ROBOT.into(),
            child_frame_id: TIP.into(),
            translation: Some(metres(position_mm)),
            rotation: Some(Quaternion::NONE),
        };
        self.put(Channel::Tip, &transform, at)?;
        Ok(true)
    }

    fn frame(
        &mut self,
        frame: &Frame,
        rises: &[f32],
        greatest: f32,
        at: WallTime,
    ) -> Result<(), mcap::McapError> {
        let [rows, cols] = self.shape;
        if frame.counts.len() != rows * cols {
            return Ok(());
        }
        let number = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let timestamp = Some(Timestamp::of(at));
        let grid = Grid {
            timestamp,
            frame_id: SENSOR.into(),
            pose: Some(Pose {
                position: Some(metres([self.corner_mm[0], self.corner_mm[1], 0.0])),
                orientation: Some(Quaternion::NONE),
            }),
            column_count: number(cols),
            cell_size: Some(Vector2 { x: self.cell_mm[0] * M_PER_MM, y: self.cell_mm[1] * M_PER_MM }),
            row_stride: number(4 * cols),
            cell_stride: 4,
            fields: vec![PackedElementField {
                name: "rise_counts".into(),
                offset: 0,
                r#type: PackedElementField::FLOAT32,
            }],
            data: rises.iter().flat_map(|rise| rise.to_le_bytes()).collect(),
        };
        self.put(Channel::Grid, &grid, at)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 and 255")]
        let grey = |rise: f32| (255.0 * (rise / greatest).clamp(0.0, 1.0)) as u8;
        // The first line of an image is its top; row 0 of an array is at the bottom.
        let data = rises.chunks(cols).rev().flatten().map(|rise| grey(*rise)).collect();
        let image = RawImage {
            timestamp,
            frame_id: SENSOR.into(),
            width: number(cols),
            height: number(rows),
            encoding: "mono8".into(),
            step: number(cols),
            data,
        };
        self.put(Channel::Image, &image, at)
    }

    fn log(&mut self, level: Level, name: &str, message: &str, at: WallTime) -> Result<(), mcap::McapError> {
        let (name, message) = (name.to_owned(), message.to_owned());
        let line = Log { timestamp: Some(Timestamp::of(at)), level: level as i32, message, name };
        self.put(Channel::Log, &line, at)
    }
}

fn metres([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x: x * M_PER_MM, y: y * M_PER_MM, z: z * M_PER_MM }
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}
