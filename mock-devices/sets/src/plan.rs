//! What the stage does in a set: generated experiments for the array and tool of the random rig.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use tactus_model::{Array, Covering, Phase, Registration, Trajectory, TrajectoryError};

/// An experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Plan {
    /// Everything that shows effects, in about 200 s: presses over the whole array at two depths each, repeats, ladders of
    /// depths, rates, four directions, two holds of 12 s with rest, idle time.
    #[default]
    Bundle,
    /// The paper's experiments only: two corners, all element centres at five depths, and a coarse grid sweep under
    /// two coverings.
    Paper,
    /// The parts of the bundle at the length of the `diagnose` experiment: about 20 minutes.
    Diagnose,
}

/// The stage's path through one run, and the phases of it.
#[derive(Debug, Clone)]
pub struct PlannedRun {
    /// The covering of this run.
    pub covering: Covering,
    /// Path of the tip, robot frame.
    pub trajectory: Trajectory,
    /// In order of time.
    pub phases: Vec<PhaseInterval>,
    /// Number of frames, the first at 0 s.
    pub frames: usize,
}

/// What the stage does from the end of the previous interval until the end of this one.
#[derive(Debug, Clone, Copy)]
pub struct PhaseInterval {
    /// Its end, since the start of the run.
    pub until_s: f64,
    /// Press index; -1 outside a press.
    pub press: i32,
    /// What the stage does.
    pub phase: Phase,
}

const SAFE_MM: f64 = 2.0;
const APPROACH_MM: f64 = 0.3;
const TRAVEL_MM_PER_S: f64 = 20.0;
const LOAD_MM_PER_S: f64 = 1.0;
/// Sideways distance from which a press approaches when its direction matters.
const ASIDE_MM: f64 = 1.0;
/// Second covering of the grid sweep, one of the paper's four.
const THICKER: Covering = Covering { thickness_mm: 2.54 };

impl Plan {
    /// The runs of the plan on an array under `covering`. With `frames`, the parts of the last run are repeated or cut so
    /// that all runs together have this many frames. Without it the plan has its own length.
    ///
    /// # Errors
    /// None for arrays of the simulated rigs.
    pub fn runs(
        self,
        array: &Array,
        registration: Registration,
        covering: Covering,
        frames: Option<usize>,
        seed: u64,
    ) -> Result<Vec<PlannedRun>, TrajectoryError> {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let mut builder = PlanBuilder::new(array, registration, covering, rng);
        let wanted_s = frames.map(|frames| frames as f64 / array.rate_hz());
        let mut planned = Vec::new();
        let mut taken_s = 0.0;
        match self {
            Self::Bundle => builder.repeat(wanted_s, |builder| builder.bundle(&BUNDLE)),
            Self::Diagnose => builder.repeat(wanted_s, |builder| builder.bundle(&DIAGNOSE)),
            Self::Paper => {
                builder.element_centres();
                builder.grid_sweep();
                taken_s = builder.t_s;
                let rng = builder.rng.clone();
                planned.push(builder.run(wanted_s)?);
                builder = PlanBuilder::new(array, registration, THICKER, rng);
                let rest_s = wanted_s.map(|wanted_s| wanted_s - taken_s);
                builder.repeat(rest_s, PlanBuilder::grid_sweep);
            }
        }
        let rest_s = wanted_s.map(|wanted_s| wanted_s - taken_s);
        if rest_s.is_none_or(|rest_s| rest_s > 0.0) {
            planned.push(builder.run(rest_s)?);
        }
        Ok(planned)
    }
}

impl PlannedRun {
    /// Press index and phase of each frame.
    pub fn phases_of_frames(&self, rate_hz: f64) -> impl Iterator<Item = (i32, Phase)> {
        let mut mark = 0;
        (0..self.frames).map(move |frame| {
            let t_s = frame as f64 / rate_hz;
            while mark + 1 < self.phases.len() && self.phases[mark].until_s < t_s {
                mark += 1;
            }
            self.phases.get(mark).map_or((-1, Phase::Idle), |mark| (mark.press, mark.phase))
        })
    }
}

/// Numbers and durations of the parts of a bundle.
struct PartSizes {
    rounds: usize,
    idle_s: f64,
    repeats: usize,
    ladder_rounds: usize,
    rate_repeats: usize,
    direction_repeats: usize,
    holds: usize,
    hold_s: f64,
    rest_s: f64,
    dwell_s: [f64; 2],
}

const BUNDLE: PartSizes = PartSizes {
    rounds: 1,
    idle_s: 3.0,
    repeats: 8,
    ladder_rounds: 1,
    rate_repeats: 2,
    direction_repeats: 1,
    holds: 2,
    hold_s: 12.0,
    rest_s: 8.0,
    dwell_s: [0.25, 0.5],
};

const DIAGNOSE: PartSizes = PartSizes {
    rounds: 4,
    idle_s: 60.0,
    repeats: 30,
    ladder_rounds: 3,
    rate_repeats: 5,
    direction_repeats: 5,
    holds: 3,
    hold_s: 55.0,
    rest_s: 40.0,
    dwell_s: [0.25, 0.5],
};

/// One press of the plan.
struct PlannedPress {
    /// Sensor frame.
    at_mm: [f64; 2],
    depths_mm: Vec<f64>,
    dwell_s: f64,
    load_mm_per_s: f64,
    /// Start of the approach, relative to the press, robot frame.
    from_mm: [f64; 2],
}

struct PlanBuilder {
    centres_mm: Vec<[f64; 2]>,
    cols: usize,
    rate_hz: f64,
    registration: Registration,
    covering: Covering,
    rng: ChaCha8Rng,
    t_s: f64,
    points: Vec<(f64, [f64; 3])>,
    phases: Vec<PhaseInterval>,
    presses: i32,
}

impl PlanBuilder {
    /// Starts at rest at the safe height above the array's middle.
    fn new(array: &Array, registration: Registration, covering: Covering, rng: ChaCha8Rng) -> Self {
        let middle_mm = array.extent_mm().map(|[least, greatest]| f64::midpoint(least, greatest));
        let [x, y] = registration.to_robot(middle_mm);
        Self {
            centres_mm: (0..array.elements()).filter_map(|element| array.centre_mm(element)).collect(),
            cols: array.cols(),
            rate_hz: array.rate_hz(),
            registration,
            covering,
            rng,
            t_s: 0.0,
            points: vec![(0.0, [x, y, SAFE_MM])],
            phases: Vec::new(),
            presses: 0,
        }
    }

    fn run(self, wanted_s: Option<f64>) -> Result<PlannedRun, TrajectoryError> {
        let length_s = wanted_s.map_or(self.t_s, |wanted_s| wanted_s.min(self.t_s));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 0")]
        let frames = (length_s * self.rate_hz).round() as usize;
        let trajectory = Trajectory::new(self.points)?;
        Ok(PlannedRun { covering: self.covering, trajectory, phases: self.phases, frames })
    }

    /// Makes a part once, and again until the wanted time is over.
    fn repeat(&mut self, wanted_s: Option<f64>, mut part: impl FnMut(&mut Self)) {
        part(self);
        while wanted_s.is_some_and(|wanted_s| self.t_s < wanted_s) {
            part(self);
        }
    }

    fn bundle(&mut self, parts: &PartSizes) {
        self.rest(parts.idle_s);
        for _ in 0..parts.rounds {
            self.all_over(parts);
            self.rest(parts.idle_s / 2.0);
        }
        let site_mm = self.site();
        for _ in 0..parts.repeats {
            self.press(&PlannedPress { dwell_s: 0.3, ..PlannedPress::at(site_mm, vec![self.share(0.45)]) });
            self.rest(0.5);
        }
        for _ in 0..3 * parts.ladder_rounds {
            let site_mm = self.site();
            let depths_mm =
                [0.13, 0.26, 0.39, 0.52, 0.65, 0.52, 0.39, 0.26, 0.13].map(|share| self.share(share));
            self.press(&PlannedPress { dwell_s: 0.25, ..PlannedPress::at(site_mm, depths_mm.to_vec()) });
            self.rest(0.6);
        }
        self.rates(parts.rate_repeats);
        self.directions(parts.direction_repeats);
        self.rest(parts.idle_s / 2.0);
        for _ in 0..parts.holds {
            let site_mm = self.site();
            self.press(&PlannedPress {
                dwell_s: parts.hold_s,
                ..PlannedPress::at(site_mm, vec![self.share(0.5)])
            });
            self.rest(parts.rest_s);
        }
    }

    /// Every second element's centre, as on a chessboard, and four places off centre, in random order, at two depths each.
    fn all_over(&mut self, parts: &PartSizes) {
        let odd = self.rng.random_range(0..2_usize);
        let mut sites_mm: Vec<[f64; 2]> = (self.centres_mm.iter().enumerate())
            .filter(|(element, _)| (element / self.cols + element % self.cols) % 2 == odd)
            .map(|(_, centre_mm)| *centre_mm)
            .collect();
        for _ in 0..4 {
            let [x, y] = self.site();
            sites_mm.push([x + self.rng.random_range(-1.0..1.0), y + self.rng.random_range(-1.0..1.0)]);
        }
        sites_mm.shuffle(&mut self.rng);
        for site_mm in sites_mm {
            let light = self.rng.random_range(0.1..0.35);
            let deep = self.rng.random_range(0.35..0.65);
            let [least_s, most_s] = parts.dwell_s;
            let dwell_s = self.rng.random_range(least_s..most_s);
            self.press(&PlannedPress {
                dwell_s,
                ..PlannedPress::at(site_mm, vec![self.share(light), self.share(deep)])
            });
            let rest_s = self.rng.random_range(0.3..0.7);
            self.rest(rest_s);
        }
    }

    fn rates(&mut self, repeats: usize) {
        let site_mm = self.site();
        let mut speeds: Vec<f64> = [0.1, 0.3, 1.0, 2.0, 5.0].repeat(repeats);
        speeds.shuffle(&mut self.rng);
        for load_mm_per_s in speeds {
            let depths_mm = vec![self.share(0.4)];
            self.press(&PlannedPress { load_mm_per_s, dwell_s: 0.4, ..PlannedPress::at(site_mm, depths_mm) });
            self.rest(0.5);
        }
    }

    fn directions(&mut self, repeats: usize) {
        let site_mm = self.site();
        let mut ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].repeat(repeats);
        ways.shuffle(&mut self.rng);
        for way in ways {
            let depths_mm = vec![self.share(0.45)];
            let from_mm = way.map(|by| by * ASIDE_MM);
            self.press(&PlannedPress { from_mm, dwell_s: 0.3, ..PlannedPress::at(site_mm, depths_mm) });
            self.rest(0.5);
        }
    }

    /// The paper's calibration: two corners, then each element at five depths of 0.25 s.
    fn element_centres(&mut self) {
        self.rest(1.0);
        let count = self.centres_mm.len();
        for corner in [0, count - 1] {
            self.press(&PlannedPress {
                dwell_s: 0.25,
                ..PlannedPress::at(self.centres_mm[corner], vec![0.2])
            });
            self.rest(0.3);
        }
        for element in 0..count {
            let depths_mm = vec![0.2, 0.3, 0.4, 0.5, 0.6];
            self.press(&PlannedPress {
                dwell_s: 0.25,
                ..PlannedPress::at(self.centres_mm[element], depths_mm)
            });
        }
    }

    /// 7 x 7 places, 0.1 mm apart, around one element, at 30, 50 and 65 % of the thickness.
    fn grid_sweep(&mut self) {
        self.rest(1.0);
        let [x, y] = self.centres_mm[self.centres_mm.len() / 2 + 4];
        for row in -3..=3 {
            for col in -3..=3 {
                let at_mm = [x + 0.1 * f64::from(col), y + 0.1 * f64::from(row)];
                let depths_mm = [0.3, 0.5, 0.65].map(|share| self.share(share));
                self.press(&PlannedPress { dwell_s: 0.25, ..PlannedPress::at(at_mm, depths_mm.to_vec()) });
            }
        }
    }

    fn press(&mut self, press: &PlannedPress) {
        let [x, y] = self.registration.to_robot(press.at_mm);
        let [dx, dy] = press.from_mm;
        self.go([x + dx, y + dy, SAFE_MM], TRAVEL_MM_PER_S, -1, Phase::Idle);
        let index = self.presses;
        self.presses += 1;
        self.go([x + dx, y + dy, APPROACH_MM], TRAVEL_MM_PER_S, index, Phase::Approach);
        self.go([x, y, APPROACH_MM], TRAVEL_MM_PER_S, index, Phase::Approach);
        self.go([x, y, 0.0], LOAD_MM_PER_S, index, Phase::Approach);
        let mut last_mm = 0.0;
        for &depth_mm in &press.depths_mm {
            let phase = if depth_mm >= last_mm { Phase::Load } else { Phase::Unload };
            self.go([x, y, -depth_mm], press.load_mm_per_s, index, phase);
            self.wait(press.dwell_s, index, Phase::Hold);
            last_mm = depth_mm;
        }
        self.go([x, y, 0.0], LOAD_MM_PER_S, index, Phase::Unload);
        self.go([x, y, SAFE_MM], TRAVEL_MM_PER_S, index, Phase::Retract);
    }

    fn rest(&mut self, duration_s: f64) {
        self.wait(duration_s, -1, Phase::Idle);
    }

    fn go(&mut self, to_mm: [f64; 3], speed_mm_per_s: f64, press: i32, phase: Phase) {
        let [x, y, z] = self.points.last().map_or(to_mm, |(_, at_mm)| *at_mm);
        let way_mm = ((to_mm[0] - x).powi(2) + (to_mm[1] - y).powi(2) + (to_mm[2] - z).powi(2)).sqrt();
        if way_mm > 1e-9 {
            self.until(way_mm / speed_mm_per_s, to_mm, press, phase);
        }
    }

    fn wait(&mut self, duration_s: f64, press: i32, phase: Phase) {
        if let Some(&(_, at_mm)) = self.points.last() {
            self.until(duration_s, at_mm, press, phase);
        }
    }

    fn until(&mut self, duration_s: f64, at_mm: [f64; 3], press: i32, phase: Phase) {
        self.t_s += duration_s;
        self.points.push((self.t_s, at_mm));
        self.phases.push(PhaseInterval { until_s: self.t_s, press, phase });
    }

    /// The centre of a random element, sensor frame.
    fn site(&mut self) -> [f64; 2] {
        self.centres_mm[self.rng.random_range(0..self.centres_mm.len())]
    }

    /// A share of the covering's thickness, mm.
    fn share(&self, share: f64) -> f64 {
        share * self.covering.thickness_mm
    }
}

impl PlannedPress {
    fn at(at_mm: [f64; 2], depths_mm: Vec<f64>) -> Self {
        Self { at_mm, depths_mm, dwell_s: 0.25, load_mm_per_s: LOAD_MM_PER_S, from_mm: [0.0; 2] }
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
