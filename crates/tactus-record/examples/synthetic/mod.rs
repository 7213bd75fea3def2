//! A synthetic run with known truth, for tests, benchmarks and examples without a rig.
//!
//! The stage moves on straight lines between knots; each element reads a Gaussian of its distance to the tip, times
//! the depth; frames are sampled by a device clock that may drift and arrive after a varying delay.

#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    reason = "shared by several test programs, each using a part"
)]
#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    reason = "what is made up here is known to fit"
)]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what is made up here is known to fit"
)]

mod maker;

use std::{collections::BTreeMap, path::Path};

use tactus_record::{Header, RecordError, Recording, Script, Summary};
use tactus_schema::{Frame, Rig, TimeStamp, WallTime, pb};

pub const RIG_TOML: &str = include_str!("../../../../config/rigs/sim.toml");
pub const SCRIPT: &str = "def experiment(rig):\n    pass\n";
pub const TICK_NS: u64 = 1_000_000;
/// 2026-03-25 10:00:00 UTC.
pub const STARTED_NS: i64 = 1_774_432_800_000_000_000;

/// The parameters of a run.
#[derive(Debug, Clone)]
pub struct Plan {
    pub run_id: String,
    pub experiment: String,
    pub presses: Vec<Press>,
    pub seed: u64,
    /// Numbers of frames, from 0, that never arrive.
    pub lost: Vec<u64>,
    /// By how much the host's clock runs faster than the device's.
    pub drift_ppm: f64,
    /// Time at rest before the first press.
    pub idle_s: f64,
    pub exit_status: Option<pb::ExitStatus>,
    /// `(element, answers for)`.
    pub miswired: Vec<(usize, usize)>,
}

/// One press, sensor frame.
#[derive(Debug, Clone)]
pub struct Press {
    pub at_mm: [f64; 2],
    pub depths_mm: Vec<f64>,
}

/// The messages for a recording, in order of time.
#[derive(Debug, Clone)]
pub enum Fed {
    Info(pb::SensorInfo, TimeStamp),
    Frame(Frame),
    Stage(pb::StageState),
    Event(pb::RunEvent),
}

/// A synthetic run, and its truth.
#[derive(Debug, Clone)]
pub struct Run {
    pub plan: Plan,
    pub rig: Rig,
    pub fed: Vec<Fed>,
    /// Where the tip is, robot frame, by host time in seconds.
    pub knots: Vec<(f64, [f64; 3])>,
    /// When each frame that arrived was sampled, host time.
    pub sampled_s: Vec<f64>,
}

impl Plan {
    /// All 48 elements at 5 depths, in row-major order.
    pub fn element_centres() -> Self {
        let rig = rig();
        let at = |element| rig.array.centre_mm(element).unwrap();
        let depths_mm = vec![0.2, 0.3, 0.4, 0.5, 0.6];
        let presses =
            (0..48).map(|element| Press { at_mm: at(element), depths_mm: depths_mm.clone() }).collect();
        Self {
            run_id: "20260325-100000-element-centres".into(),
            experiment: "element-centres".into(),
            presses,
            seed: 7,
            lost: Vec::new(),
            drift_ppm: 0.0,
            idle_s: 2.0,
            exit_status: Some(pb::ExitStatus::Done),
            miswired: vec![(18, 19), (22, 23)],
        }
    }

    /// The first few presses only.
    pub fn short(presses: usize) -> Self {
        let mut plan = Self::element_centres();
        plan.presses.truncate(presses);
        plan
    }

    pub fn make(self) -> Run {
        maker::Maker::new(self).make()
    }
}

impl Run {
    pub fn with_header<T>(&self, use_it: impl FnOnce(&Header<'_>) -> T) -> T {
        let versions = BTreeMap::from([
            ("tactus".to_owned(), "0.1.0".to_owned()),
            ("stage".to_owned(), "Grbl 1.1h ['$' for help]".to_owned()),
        ]);
        use_it(&Header {
            run_id: &self.plan.run_id,
            experiment: &self.plan.experiment,
            who: "ada",
            rig: &self.rig,
            rig_toml: Some(RIG_TOML),
            link_toml: None,
            script: Script { name: "element-centres.star", source: SCRIPT },
            versions: &versions,
            parameters_json: r#"{"dwell_s":0.25}"#,
            started: WallTime::from_ns(STARTED_NS),
            simulated: true,
            continues: None,
        })
    }

    pub fn record(&self, path: &Path) -> Result<Summary, RecordError> {
        let mut recording = self.with_header(|header| Recording::create(path, header))?;
        for fed in &self.fed {
            fed.write(&mut recording)?;
        }
        recording.finish()
    }

    pub fn frames(&self) -> impl Iterator<Item = &Frame> {
        self.fed.iter().filter_map(|fed| match fed {
            Fed::Frame(frame) => Some(frame),
            _ => None,
        })
    }

    pub fn position_mm(&self, at_s: f64) -> [f64; 3] {
        maker::position(&self.knots, at_s)
    }
}

impl Fed {
    pub fn write(&self, recording: &mut Recording) -> Result<(), RecordError> {
        match self {
            Self::Info(info, at) => recording.write_sensor_info(info, *at),
            Self::Frame(frame) => recording.write(frame),
            Self::Stage(state) => recording.write(state),
            Self::Event(event) => recording.write(event),
        }
    }

    fn time_ns(&self) -> i64 {
        match self {
            Self::Info(_, at) => at.mono.ns(),
            Self::Frame(frame) => frame.received.mono.ns(),
            Self::Stage(state) => state.t_mono_ns,
            Self::Event(event) => event.t_mono_ns,
        }
    }
}

pub fn rig() -> Rig {
    Rig::from_toml(RIG_TOML).unwrap()
}
