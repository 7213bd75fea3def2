//! What viewers are shown of a rig, message by message: the same in a file and live.

use prost::Message as _;
use tactus_schema::{Rig, WallTime, pb};

use super::schemas::{
    FrameTransform, Grid, Log, PackedElementField, Pose, Quaternion, RawImage, Timestamp, Vector2, Vector3,
};

/// The viewers' schemas, as the package foxglove-schemas-protobuf 0.4 (MIT) has them: Grid, `RawImage`, `FrameTransform`, Log.
pub const SCHEMAS: &[u8] = include_bytes!("../../foxglove/schemas.binpb");

/// Encoding of messages and schemas.
pub const ENCODING: &str = "protobuf";

/// Viewers have metres.
const M_PER_MM: f64 = 1e-3;

/// Name of the frames of reference.
const ROBOT: &str = "robot";
const SENSOR: &str = "sensor";
const TIP: &str = "tip";

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The rise of each element, in its place.
    Grid,
    /// The same as grey values.
    Image,
    /// The tip in the robot's frame.
    Tip,
    /// The array in the robot's frame.
    Sensor,
    /// What happens.
    Log,
}

/// How grave a line of the log is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the viewers' own words")]
pub enum Level {
    Info = 2,
    Warning = 3,
    Error = 4,
}

/// Makes the messages of one rig, in protobuf.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Size of the grid's cells, x and y.
    cell_mm: [f64; 2],
    corner_mm: [f64; 2],
    shape: [usize; 2],
    origin_mm: [f64; 2],
    rotation_deg: f64,
}

impl Channel {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Grid, Self::Image, Self::Tip, Self::Sensor, Self::Log];

    /// Its name for viewers.
    pub const fn topic(self) -> &'static str {
        match self {
            Self::Grid => "/array/grid",
            Self::Image => "/array/image",
            Self::Tip => "/tf",
            Self::Sensor => "/tf/sensor",
            Self::Log => "/log",
        }
    }

    /// The name of its messages in [`SCHEMAS`].
    pub const fn schema(self) -> &'static str {
        match self {
            Self::Grid => "foxglove.Grid",
            Self::Image => "foxglove.RawImage",
            Self::Tip | Self::Sensor => "foxglove.FrameTransform",
            Self::Log => "foxglove.Log",
        }
    }
}

impl Scene {
    /// As a rig file has it.
    pub fn of(rig: &Rig) -> Self {
        let (array, place) = (&rig.array, &rig.registration);
        Self::new(
            array.col_centres_mm(),
            array.row_centres_mm(),
            array.element_mm(),
            place.origin_mm,
            place.rotation_deg,
        )
    }

    /// As a service describes it; `None` if the description lacks a place.
    pub fn described(rig: &pb::RigDescription) -> Option<Self> {
        let (element_mm, origin_mm) =
            (rig.element_mm.as_slice().try_into().ok()?, rig.origin_mm.as_slice().try_into().ok()?);
        Some(Self::new(&rig.col_centres_mm, &rig.row_centres_mm, element_mm, origin_mm, rig.rotation_deg))
    }

    fn new(
        col_centres_mm: &[f64],
        row_centres_mm: &[f64],
        [x_mm, y_mm]: [f64; 2],
        origin_mm: [f64; 2],
        rotation_deg: f64,
    ) -> Self {
        // A grid's cells are even; those of an array need not be.
        let even = |centres: &[f64], size_mm: f64| match centres {
            [first, .., last] => (last - first) / (centres.len() - 1) as f64,
            _ => size_mm,
        };
        let first = |centres: &[f64]| centres.first().copied().unwrap_or(0.0);
        let cell_mm = [even(col_centres_mm, x_mm), even(row_centres_mm, y_mm)];
        let corner_mm = [first(col_centres_mm) - cell_mm[0] / 2.0, first(row_centres_mm) - cell_mm[1] / 2.0];
        let shape = [row_centres_mm.len(), col_centres_mm.len()];
        Self { cell_mm, corner_mm, shape, origin_mm, rotation_deg }
    }

    /// Where the array is.
    pub fn sensor(&self, at: WallTime) -> Vec<u8> {
        let [x_mm, y_mm] = self.origin_mm;
        let half = self.rotation_deg.to_radians() / 2.0;
        let transform = FrameTransform {
            timestamp: Some(Timestamp::of(at)),
            parent_frame_id: ROBOT.into(),
            child_frame_id: SENSOR.into(),
            translation: Some(metres([x_mm, y_mm, 0.0])),
            rotation: Some(Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() }),
        };
        transform.encode_to_vec()
    }

    /// Where the tip is; `None` if the stage does not say.
    pub fn tip(&self, state: &pb::StageState, at: WallTime) -> Option<Vec<u8>> {
        let position_mm = [state.x_mm, state.y_mm, state.z_mm];
        let is_known =
            state.status() != pb::StageStatus::Disconnected && position_mm.iter().all(|mm| mm.is_finite());
        is_known.then(|| {
            let transform = FrameTransform {
                timestamp: Some(Timestamp::of(at)),
                parent_frame_id: ROBOT.into(),
                child_frame_id: TIP.into(),
                translation: Some(metres(position_mm)),
                rotation: Some(Quaternion::NONE),
            };
            transform.encode_to_vec()
        })
    }

    /// The array as a grid and an image in which `white_counts` is white; `None` if the rises are not those of its elements.
    pub fn frame(&self, rises: &[f32], white_counts: f32, at: WallTime) -> Option<[(Channel, Vec<u8>); 2]> {
        let [rows, cols] = self.shape;
        if rises.is_empty() || rises.len() != rows * cols {
            return None;
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
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 and 255")]
        let grey = |rise: f32| (255.0 * (rise / white_counts).clamp(0.0, 1.0)) as u8;
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
        Some([(Channel::Grid, grid.encode_to_vec()), (Channel::Image, image.encode_to_vec())])
    }
}

/// A line of the log.
pub fn log_line(level: Level, name: &str, message: &str, at: WallTime) -> Vec<u8> {
    let (name, message) = (name.to_owned(), message.to_owned());
    Log { timestamp: Some(Timestamp::of(at)), level: level as i32, message, name }.encode_to_vec()
}

/// Which rig it is, for the log: a simulated one is marked.
pub fn rig_in_words(name: &str, simulated: bool) -> String {
    let mark = if simulated { ", which is SIMULATED" } else { "" };
    format!("rig {name}{mark}")
}

fn metres([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x: x * M_PER_MM, y: y * M_PER_MM, z: z * M_PER_MM }
}
