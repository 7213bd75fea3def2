//! A host that performs nothing: it answers from a formula and keeps count.

use tactus_model::Registration;
use tactus_plan::{Call, Host, MeanReading, Press, Refusal, Reply, RigView, Step};
use tactus_schema::Rig;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

fn rig() -> Rig {
    Rig::from_toml(SIM).unwrap()
}

/// A sensor whose elements answer with a Gaussian of the distance.
#[derive(Debug)]
pub(crate) struct FakeRig {
    rig: Rig,
    view: RigView,
    /// True place of the sensor in the robot frame.
    pub(crate) origin_mm: [f64; 2],
    pub(crate) rotation_deg: f64,
    /// True depth of the surface below the nominal one.
    pub(crate) surface_mm: f64,
    pub(crate) noise_counts: f64,
    /// `(element, answers for)`.
    pub(crate) miswired: Vec<(usize, usize)>,
    pub(crate) calls: Vec<Call>,
    pub(crate) covering_mm: f64,
    pub(crate) elapsed_s: f64,
    at_mm: [f64; 2],
    state: u64,
}

impl FakeRig {
    pub(crate) fn new() -> Self {
        let rig = rig();
        Self {
            view: RigView::of(&rig),
            origin_mm: rig.registration.origin_mm,
            rotation_deg: rig.registration.rotation_deg,
            surface_mm: 0.0,
            noise_counts: 2.0,
            miswired: Vec::new(),
            calls: Vec::new(),
            covering_mm: rig.covering.thickness_mm,
            elapsed_s: 0.0,
            at_mm: [0.0; 2],
            state: 1,
            rig,
        }
    }

    pub(crate) fn view(&self) -> RigView {
        self.view.clone()
    }

    pub(crate) fn presses(&self) -> Vec<&Press> {
        let press = |call| match call {
            &Call { step: Step::Press(ref press), .. } => Some(press),
            Call { .. } => None,
        };
        self.calls.iter().filter_map(press).collect()
    }

    pub(crate) fn dwells(&self) -> usize {
        self.presses().iter().map(|press| press.depths_mm.len()).sum()
    }

    pub(crate) fn logged(&self) -> String {
        let line = |call: &Call| match &call.step {
            Step::Log { message } => Some(format!("{message}\n")),
            _ => None,
        };
        self.calls.iter().filter_map(line).collect()
    }

    fn reading(&mut self, depth_mm: f64, duration_s: f64) -> MeanReading {
        let registration = Registration { origin_mm: self.origin_mm, rotation_deg: self.rotation_deg };
        let [x_mm, y_mm] = registration.to_sensor(self.rig.registration.to_robot(self.at_mm));
        let sigma_mm = self.view.sigma_mm;
        let depth_mm = (depth_mm - self.surface_mm).max(0.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds of frames")]
        let frames = (duration_s * self.view.rate_hz).round().max(1.0) as u32;
        let mut signal = Vec::new();
        for element in self.view.elements.clone() {
            let miswired = self.miswired.iter().find(|(faulty, _)| *faulty == element.index);
            let seen = self.view.elements[miswired.map_or(element.index, |(_, answers_for)| *answers_for)];
            let (dx, dy) = (x_mm - seen.x_mm, y_mm - seen.y_mm);
            // Sensitivities differ by up to 10 % either way.
            let gain = 1000.0 * (1.0 + 0.1 * (element.index as f64 * 2.399).sin());
            let noise = self.noise_counts / f64::from(frames).sqrt() * self.normal();
            signal.push(gain * depth_mm * (-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm)).exp() + noise);
        }
        MeanReading {
            mean_counts: signal.iter().map(|signal| signal + 100.0).collect(),
            rms: vec![self.noise_counts; signal.len()],
            signal,
            frames,
        }
    }

    /// Roughly normal: the sum of twelve uniform numbers of a 64-bit congruential generator (Knuth).
    fn normal(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.state =
                self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }

    fn travel(&mut self, to_mm: [f64; 2]) {
        let motion = &self.rig.service.as_ref().unwrap().motion;
        let distance_mm = (to_mm[0] - self.at_mm[0]).hypot(to_mm[1] - self.at_mm[1]);
        self.elapsed_s += distance_mm / motion.travel_speed_mm_per_s + 0.1;
        self.at_mm = to_mm;
    }
}

impl Host for FakeRig {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        self.calls.push(call.clone());
        let service = self.rig.service.clone().unwrap();
        let limit_mm = service.envelope.depth_share_max * self.covering_mm;
        match &call.step {
            Step::Press(press) => {
                let deepest_mm = press.depths_mm.iter().copied().fold(0.0, f64::max);
                if deepest_mm > limit_mm {
                    return Err(Refusal::Outside(format!(
                        "press is {deepest_mm} mm deep, the limit is {limit_mm:.4} mm"
                    )));
                }
                if let Some([dx, dy]) = press.approach_from_mm {
                    self.travel([press.at.x_mm + dx, press.at.y_mm + dy]);
                }
                self.travel([press.at.x_mm, press.at.y_mm]);
                let way_mm = service.motion.safe_height_mm - service.motion.approach_height_mm;
                self.elapsed_s += 2.0 * (way_mm / service.motion.travel_speed_mm_per_s + 0.1);
                let speed = press.speed_mm_per_s.unwrap_or(service.motion.load_speed_mm_per_s);
                self.elapsed_s += 2.0 * (service.motion.approach_height_mm + deepest_mm) / speed;
                let mut readings = Vec::new();
                for depth_mm in &press.depths_mm {
                    self.elapsed_s += service.motion.settle_s + press.dwell_s;
                    readings.push(self.reading(*depth_mm, press.dwell_s));
                }
                Ok(Reply::Pressed(readings))
            }
            Step::Move { to, height_mm, .. } => {
                self.travel([to.x_mm, to.y_mm]);
                let height_mm = height_mm.unwrap_or(service.motion.safe_height_mm);
                Ok(Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm })
            }
            Step::Dwell { duration_s } | Step::Read { duration_s } => {
                self.elapsed_s += duration_s;
                Ok(Reply::Reading(self.reading(0.0, *duration_s)))
            }
            Step::Tare { duration_s } | Step::Wait { duration_s } => {
                self.elapsed_s += duration_s;
                Ok(Reply::Done)
            }
            Step::Covering { thickness_mm } => {
                self.covering_mm = *thickness_mm;
                Ok(Reply::Done)
            }
            Step::Log { .. } => Ok(Reply::Done),
        }
    }

    fn cancelled(&self) -> bool {
        false
    }
}
