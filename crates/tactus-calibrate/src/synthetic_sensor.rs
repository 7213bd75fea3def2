//! A synthetic sensor for tests, and experiments on it that give rows of the measurement table.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Array, Contact, Covering, ForwardModel, Indenter, Psf, Registration, Response};
use tactus_schema::table::{Phase, RowView};

use crate::{Declared, Readings, ReadingsBuilder};

/// The paper's cylinder.
pub(crate) const TOOL: Indenter = Indenter::Cylinder { diameter_mm: 1.0 };
/// Its thinnest covering.
pub(crate) const THIN_MM: f64 = 1.016;

/// Changes the counts of a frame, given the index of its press.
type Spoil = Box<dyn Fn(&mut [f64], i32)>;

/// A simulated sensor on a stage, with the readings so far.
pub(crate) struct SyntheticSensor {
    pub(crate) model: ForwardModel,
    pub(crate) registration: Registration,
    pub(crate) surface_mm: f64,
    pub(crate) noise_counts: f64,
    /// Changes the counts of a frame, given the index of its press.
    pub(crate) spoil: Spoil,
    rng: ChaCha8Rng,
    builder: ReadingsBuilder,
    press: i32,
    pub(crate) run: String,
}

impl SyntheticSensor {
    /// Unequal gains, one curvature, and a pose and a surface that differ from the declared ones.
    pub(crate) fn new(seed: u64) -> Self {
        let array = Array::digitacts();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let gains = (0..array.elements()).map(|_| {
            let deviate: f64 = StandardNormal.sample(&mut rng);
            1000.0 * (1.0 + 0.08 * deviate)
        });
        let response = Response {
            sensitivity_counts_per_mm: gains.collect(),
            quadratic_per_mm: vec![0.15; array.elements()],
            ..Response::uniform(array.elements(), 1000.0, 100.0)
        };
        Self {
            model: ForwardModel::new(array.clone(), Psf::PAPER, response).unwrap(),
            registration: Registration { origin_mm: [20.06, 14.96], rotation_deg: 0.2 },
            surface_mm: 0.013,
            noise_counts: 2.0,
            spoil: Box::new(|_, _| ()),
            rng,
            builder: ReadingsBuilder::new(&array),
            press: 0,
            run: "run".into(),
        }
    }

    /// The rig's description, without this truth.
    pub(crate) fn declared(&self) -> Declared {
        let array = self.model.array().clone();
        let response = Response::uniform(array.elements(), 900.0, 0.0);
        let psf = Psf { sigma_intercept_mm: 2.0, sigma_per_mm: 0.4 };
        Declared {
            model: ForwardModel::new(array, psf, response).unwrap(),
            registration: Registration { origin_mm: [20.0, 15.0], rotation_deg: 0.0 },
            indenters: BTreeMap::from([("cyl1".to_owned(), TOOL)]),
        }
    }

    /// Declared position of an element's centre, robot frame.
    pub(crate) fn centre_mm(&self, element: usize) -> [f64; 2] {
        self.declared().registration.to_robot(self.model.array().centre_mm(element).unwrap())
    }

    /// All elements at their centres, five depths each.
    pub(crate) fn centres(&mut self) {
        for element in 0..self.model.array().elements() {
            self.press(self.centre_mm(element), THIN_MM, &[0.2, 0.3, 0.4, 0.5, 0.6]);
        }
    }

    /// A grid over 1.4 mm around an element near the middle, at three shares of the covering.
    pub(crate) fn sweep(&mut self, covering_mm: f64, points: u32) {
        let [x, y] = self.centre_mm(19);
        for step in 0..points * points {
            let away = |step: u32| 1.4 * (f64::from(step) / f64::from(points - 1) - 0.5);
            let place_mm = [x + away(step % points), y + away(step / points)];
            for share in [0.3, 0.5, 0.65] {
                self.press(place_mm, covering_mm, &[share * covering_mm]);
            }
        }
    }

    /// Ends the run; the next press belongs to a new one.
    pub(crate) fn next_run(&mut self) {
        self.run.push('+');
        self.press = 0;
    }

    /// A press: at rest, then at depths below the declared surface, twelve frames each.
    pub(crate) fn press(&mut self, [x, y]: [f64; 2], covering_mm: f64, depths_mm: &[f64]) {
        let index = self.press;
        self.press += 1;
        for _ in 0..15 {
            self.frame([x, y, 2.0], covering_mm, -1, Phase::Idle, index);
        }
        for depth_mm in depths_mm {
            for _ in 0..12 {
                self.frame([x, y, -depth_mm], covering_mm, index, Phase::Hold, index);
            }
            self.frame([x, y, -depth_mm - 0.01], covering_mm, index, Phase::Load, index);
        }
    }

    fn frame(&mut self, position_mm: [f64; 3], covering_mm: f64, press: i32, phase: Phase, index: i32) {
        let [x, y, z] = position_mm;
        let contact = Contact {
            indenter: TOOL,
            position_mm: self.registration.to_sensor([x, y]),
            rotation_deg: 0.0,
            depth_mm: self.surface_mm - z,
        };
        let mut counts = vec![0.0; self.model.array().elements()];
        self.model.image(&contact, Covering { thickness_mm: covering_mm }, &mut counts);
        (self.spoil)(&mut counts, index);
        let read: Vec<f32> = counts
            .iter()
            .map(|count| {
                let deviate: f64 = StandardNormal.sample(&mut self.rng);
                #[expect(clippy::cast_possible_truncation, reason = "whole numbers below 2^24")]
                let count = (count + self.noise_counts * deviate).round() as f32;
                count
            })
            .collect();
        let run = self.run.clone();
        self.builder.take(RowView {
            run: &run,
            press,
            phase,
            t_ns: 0,
            position_mm,
            covering_mm,
            indenter: "cyl1",
            temperature_c: None,
            counts: &read,
        });
    }

    /// The declared description and the readings.
    pub(crate) fn readings(self) -> (Declared, Readings) {
        (self.declared(), self.builder.finish())
    }
}
