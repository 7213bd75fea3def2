//! Generates the messages of a synthetic run.

use std::sync::Arc;

use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rand_distr::{Distribution, Exp1, StandardNormal};
use tactus_schema::{
    DeviceTick, Frame, FrameFlags, MonoTime, Rig, TimeStamp, WallTime,
    pb::{self, run_event::Event},
};

use super::{Fed, Plan, Press, Run, STARTED_NS, TICK_NS, rig};

pub(super) struct Maker {
    plan: Plan,
    rig: Rig,
    now_s: f64,
    knots: Vec<(f64, [f64; 3])>,
    events: Vec<(f64, Event)>,
    dwells: Vec<(f64, f64, i32, u32, [f64; 2], f64)>,
    rng: ChaCha8Rng,
}

impl Maker {
    pub(super) fn new(plan: Plan) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(plan.seed);
        Self { plan, rig: rig(), now_s: 0.0, knots: Vec::new(), events: Vec::new(), dwells: Vec::new(), rng }
    }

    pub(super) fn make(mut self) -> Run {
        let start_mm = [15.0, 12.0, 2.0];
        self.knots.push((0.0, start_mm));
        self.events.push((0.0, Event::Started(self.started())));
        self.phase(pb::Phase::Idle, -1);
        self.now_s += self.plan.idle_s;
        self.knot(start_mm);
        let presses = self.plan.presses.clone();
        for (index, press) in presses.iter().enumerate() {
            self.press(i32::try_from(index).unwrap(), press);
        }
        self.phase(pb::Phase::Idle, -1);
        self.now_s += 0.5;
        let gains: Vec<f64> = (0..self.rig.array.elements()).map(|_| 1.0 + 0.08 * self.normal()).collect();
        let (frames, sampled_s) = self.frames(&gains);
        let mut fed = vec![Fed::Info(self.info(), stamp(0.0))];
        fed.extend(frames.iter().cloned().map(Fed::Frame));
        fed.extend(self.stage());
        self.dwell_events(&frames);
        self.finish(&frames);
        self.events.sort_by(|a, b| a.0.total_cmp(&b.0));
        fed.extend(self.events.iter().enumerate().map(|(seq, (at_s, event))| {
            Fed::Event(pb::RunEvent {
                seq: seq as u64,
                run_id: self.plan.run_id.clone(),
                t_mono_ns: stamp(*at_s).mono.ns(),
                t_wall_ns: stamp(*at_s).wall.ns(),
                event: Some(event.clone()),
            })
        }));
        fed.sort_by_key(Fed::time_ns);
        Run { plan: self.plan, rig: self.rig, fed, knots: self.knots, sampled_s }
    }

    fn press(&mut self, index: i32, press: &Press) {
        let [x, y] = self.rig.registration.to_robot(press.at_mm);
        self.phase(pb::Phase::Approach, index);
        self.now_s += 0.4;
        self.knot([x, y, 2.0]);
        self.now_s += 0.1;
        self.knot([x, y, 0.0]);
        for (dwell, depth_mm) in (0..).zip(&press.depths_mm) {
            self.phase(pb::Phase::Load, index);
            self.now_s += (self.knots.last().unwrap().1[2] + depth_mm).abs().max(0.01);
            self.knot([x, y, -depth_mm]);
            self.phase(pb::Phase::Hold, index);
            let from_s = self.now_s + 0.2;
            self.now_s += 0.45;
            self.knot([x, y, -depth_mm]);
            self.dwells.push((from_s, self.now_s, index, dwell, press.at_mm, *depth_mm));
        }
        self.phase(pb::Phase::Unload, index);
        self.now_s += 0.3;
        self.knot([x, y, 0.0]);
        self.phase(pb::Phase::Retract, index);
        self.now_s += 0.1;
        self.knot([x, y, 2.0]);
    }

    fn phase(&mut self, phase: pb::Phase, press: i32) {
        self.events.push((self.now_s, Event::PhaseChanged(pb::PhaseChanged { phase: phase.into(), press })));
    }

    fn knot(&mut self, at_mm: [f64; 3]) {
        self.knots.push((self.now_s, at_mm));
    }

    fn frames(&mut self, gains: &[f64]) -> (Vec<Frame>, Vec<f64>) {
        let (mut frames, mut sampled) = (Vec::new(), Vec::new());
        let mut lost_before = 0;
        let period_s = 1.0 / 30.0;
        for seq in 0.. {
            let sampled_s = 0.01 + seq as f64 * period_s;
            if sampled_s > self.now_s {
                break;
            }
            let wait: f64 = Exp1.sample(&mut self.rng);
            let delay_s = 0.002 + 0.0006 * wait;
            if self.plan.lost.contains(&seq) {
                lost_before += 1;
                continue;
            }
            let device_s = 3.0 + sampled_s / (1.0 + self.plan.drift_ppm * 1e-6);
            let flags = if lost_before > 0 { FrameFlags::GAP_BEFORE } else { FrameFlags::default() };
            frames.push(Frame {
                seq,
                epoch: 0,
                device_tick: Some(DeviceTick((device_s * 1e3) as u64)),
                received: stamp(sampled_s + delay_s),
                counts: self.counts(gains, sampled_s),
                flags,
                lost_before,
                simulated: true,
                bad_elements: [].into(),
                temperature_c: None,
            });
            if lost_before > 0 {
                let gap = pb::Gap {
                    frames_lost: lost_before.into(),
                    after_seq: seq - u64::from(lost_before) - 1,
                    next_seq: seq,
                    reason: "bytes lost on the link".into(),
                };
                self.events.push((sampled_s + delay_s, Event::Gap(gap)));
            }
            lost_before = 0;
            sampled.push(sampled_s);
        }
        (frames, sampled)
    }

    fn counts(&mut self, gains: &[f64], at_s: f64) -> Arc<[f32]> {
        let [x, y, z] = position(&self.knots, at_s);
        let [x, y] = self.rig.registration.to_sensor([x, y]);
        let depth_mm = (-z).max(0.0);
        let sigma_mm = self.rig.psf.sigma_mm(self.rig.covering);
        (0..self.rig.array.elements())
            .map(|element| {
                let reads = self.plan.miswired.iter().find(|(faulty, _)| *faulty == element);
                let centre = self.rig.array.centre_mm(reads.map_or(element, |(_, other)| *other)).unwrap();
                let (dx, dy) = (x - centre[0], y - centre[1]);
                let spread = (-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm)).exp();
                let rise = 800.0 * gains[element] * (depth_mm + 0.5 * depth_mm * depth_mm) * spread;
                (100.0 + rise + 2.0 * self.normal()).round() as f32
            })
            .collect()
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    fn stage(&self) -> Vec<Fed> {
        // Every 100 ms, and at each knot, like a controller that is polled while it moves.
        let mut times: Vec<f64> = (0..(self.now_s * 10.0) as u32).map(|n| f64::from(n) * 0.1).collect();
        times.extend(self.knots.iter().map(|knot| knot.0));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let state = |(seq, at_s): (usize, &f64)| {
            let [x_mm, y_mm, z_mm] = position(&self.knots, *at_s);
            Fed::Stage(pb::StageState {
                seq: seq as u64,
                t_mono_ns: stamp(*at_s).mono.ns(),
                t_wall_ns: stamp(*at_s).wall.ns(),
                x_mm,
                y_mm,
                z_mm,
                status: pb::StageStatus::Idle.into(),
                simulated: true,
                ..Default::default()
            })
        };
        times.iter().enumerate().map(state).collect()
    }

    fn dwell_events(&mut self, frames: &[Frame]) {
        for (from_s, to_s, press, dwell, at_mm, depth_mm) in std::mem::take(&mut self.dwells) {
            let within: Vec<&Frame> = frames
                .iter()
                .filter(|frame| (from_s..to_s).contains(&frame.received.mono.seconds()))
                .collect();
            let mean = |element: usize| {
                within.iter().map(|frame| frame.counts[element]).sum::<f32>() / within.len() as f32
            };
            let done = pb::DwellDone {
                press,
                dwell,
                x_mm: at_mm[0],
                y_mm: at_mm[1],
                depth_mm,
                frames: within.len() as u32,
                mean_counts: (0..self.rig.array.elements()).map(mean).collect(),
                from_mono_ns: stamp(from_s).mono.ns(),
                to_mono_ns: stamp(to_s).mono.ns(),
            };
            self.events.push((to_s, Event::DwellDone(done)));
        }
    }

    fn started(&self) -> pb::RunStarted {
        pb::RunStarted {
            experiment: self.plan.experiment.clone(),
            rig: self.rig.name.clone(),
            who: "ada".into(),
            simulated: true,
            seed: self.plan.seed,
            script_sha256: "3f79bb7b435b05321651daefd374cdc681dc06faa65e374e38337b88ca046dea".into(),
            parameters_json: r#"{"dwell_s":0.25}"#.into(),
            covering_mm: self.rig.covering.thickness_mm,
            indenter: self.rig.indenter.clone(),
            presses_planned: self.plan.presses.len() as u32,
            dwells_planned: self.plan.presses.iter().map(|press| press.depths_mm.len() as u32).sum(),
            duration_planned_s: 0.0,
            versions: [("tactus".to_owned(), "0.1.0".to_owned())].into(),
            taken_over: None,
        }
    }

    fn finish(&mut self, frames: &[Frame]) {
        let Some(exit_status) = self.plan.exit_status else { return };
        let finished = pb::RunFinished {
            exit_status: exit_status.into(),
            message: String::new(),
            frames: frames.len() as u64,
            frames_lost: self.plan.lost.len() as u64,
            presses: self.plan.presses.len() as u32,
            dwells: self.plan.presses.iter().map(|press| press.depths_mm.len() as u32).sum(),
            duration_s: self.now_s,
        };
        self.events.push((self.now_s + 0.01, Event::Finished(finished)));
    }

    fn info(&self) -> pb::SensorInfo {
        pb::SensorInfo {
            rig: self.rig.name.clone(),
            array: self.rig.array.name().into(),
            rows: self.rig.array.rows() as u32,
            cols: self.rig.array.cols() as u32,
            rate_hz: self.rig.array.rate_hz(),
            full_scale_counts: self.rig.array.full_scale_counts(),
            tick_ns: TICK_NS,
            link: "weiss-dsa".into(),
            transport: "embedded".into(),
            simulated: true,
        }
    }
}

pub(super) fn position(knots: &[(f64, [f64; 3])], at_s: f64) -> [f64; 3] {
    let next = knots.partition_point(|knot| knot.0 <= at_s);
    match (next.checked_sub(1).map(|index| knots[index]), knots.get(next)) {
        (Some(a), Some(b)) => {
            let share = (at_s - a.0) / (b.0 - a.0);
            std::array::from_fn(|axis| a.1[axis] + share * (b.1[axis] - a.1[axis]))
        }
        (Some(only), None) => only.1,
        (None, first) => first.unwrap().1,
    }
}

fn stamp(at_s: f64) -> TimeStamp {
    let ns = (at_s * 1e9).round() as i64;
    TimeStamp { mono: MonoTime::from_ns(ns), wall: WallTime::from_ns(STARTED_NS + ns) }
}
