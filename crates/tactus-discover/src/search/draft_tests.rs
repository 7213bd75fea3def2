use std::sync::Arc;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Array, Response};
use tactus_schema::table::{Phase, RowView};

use super::super::evidence::{Addition, Evidence, Signs};
use super::{Against, COLUMNS_MAX, NoDraft, PARTS_MAX, Sight, grammar, width};
use crate::fit::{BLOCKS_MAX, Prepared};
use crate::fixtures::{OPTIONS, known, search};
use crate::progress::Reporter;
use crate::search::grow::ALPHA;
use crate::{BaseModel, Frames, Known, predict};

/// Two knots of a curve explain a residual of 30 standard deviations; a third one is seen by hardly a reading, and the products of its column
/// are those of rounding.
#[test]
fn a_knot_that_hardly_any_reading_sees_has_no_great_value() {
    let sizes = [10.0, 5.0, 1e-9];
    let along = [20.0, 22.0, 1e-3];
    let mut products = DMatrix::zeros(4, 4);
    for (knot, (size, along)) in sizes.iter().zip(along).enumerate() {
        products[(knot, knot)] = size * size;
        products[(knot, 3)] = size * along;
        products[(3, knot)] = size * along;
    }
    products[(3, 3)] = 900.0;
    let additions = [Addition {
        class: 0,
        directions: vec![0, 1, 2],
        widths: vec![width(30.0, sizes.into_iter()); 3],
        signs: vec![Signs::Both; 3],
        among: 1.0,
        is_free: false,
    }];
    let evidence = Evidence { additions: &additions, products: &products, variance: 1.0, present: &[] };
    let found = evidence.coefficients(&evidence.set([0]));
    let value = |knot: usize| found.iter().find(|(one, _)| *one == knot).map(|(_, value)| *value).unwrap();
    for (knot, want) in [(0, 2.0), (1, 4.4)] {
        assert!((value(knot) / want - 1.0).abs() < 0.02, "{knot}: {}", value(knot));
    }
    assert!(value(2).abs() < 1e-6, "{}", value(2));
}

/// Presses all over an array, with 10 frames a second, in which all elements read 3 counts more in contact, under noise of 1 count.
fn more_in_contact(array: Array) -> (Known, Frames) {
    let known = known();
    let elements = array.elements();
    let response = Response {
        reference_covering: known.response.reference_covering,
        ..Response::uniform(elements, 1000.0, 100.0)
    };
    let known = Known { array, response, ..known };
    let frames = |counts: &dyn Fn(usize) -> Vec<f32>| {
        let mut frames = Frames::new(elements);
        for (frame, t_ns) in (0..480).zip((0..).step_by(100_000_000)) {
            let (press, within) = (frame / 12, frame % 12);
            let [x, y] = known.array.centre_mm(press * 29 % elements).unwrap();
            let depth_mm = if (3..9).contains(&within) { 0.3 + 0.1 * (press % 3) as f64 } else { -2.0 };
            frames.push(RowView {
                run: "a",
                press: if depth_mm > 0.0 { i32::try_from(press).unwrap() } else { -1 },
                phase: if depth_mm > 0.0 { Phase::Hold } else { Phase::Idle },
                t_ns,
                position_mm: [x, y, -depth_mm],
                covering_mm: 1.016,
                indenter: "cyl1",
                temperature_c: None,
                counts: &counts(frame),
            });
        }
        frames
    };
    let blank = frames(&|_| vec![0.0; elements]);
    let base = BaseModel {
        psf: known.psf,
        response: known.response.clone(),
        run_gains: vec![1.0],
        run_baselines_counts: vec![vec![100.0; elements]],
        run_walks: None,
    };
    let clean = predict(&known, &blank, &base, &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let readings = (0..clean.len()).map(|reading| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let more = if blank.position_mm[reading / elements][2] < 0.0 { 3.0 } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts = (f64::from(clean[reading]) + more + noise) as f32;
        counts
    });
    let readings: Vec<f32> = readings.collect();
    let frames = frames(&|frame| readings[frame * elements..(frame + 1) * elements].to_vec());
    (known, frames)
}

/// Each of 280 elements with three values of its own would take 840 columns of a pass, and a gigabyte.
#[test]
fn drafts_of_single_elements_that_take_too_much_memory_are_not_tried() {
    for (array, is_tried) in [(Array::digitacts(), true), (Array::fingertip(), false)] {
        let elements = array.elements();
        let (known, frames) = more_in_contact(array);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        let problem = prepared.problem();
        let reporter = Reporter::new(&|_| {});
        let search = search(&problem, &[], &reporter);
        let sight = Arc::new(Sight::of(&problem, &prepared.base).unwrap());
        let atoms = search.atoms(&prepared.base, &sight);
        let all = grammar::atoms(&problem, &prepared.base, &sight, false).len();
        assert_eq!((atoms.len() == all, search.drafts_not_tried().is_none()), (is_tried, is_tried));
        let blocks = problem.predictor.bins.blocks.min(BLOCKS_MAX);
        for atom in &atoms {
            let columns = atom.columns(elements);
            assert!(columns <= COLUMNS_MAX && columns * blocks * elements <= PARTS_MAX, "{atom:?}");
        }
        let drafted = || {
            let found =
                search.draft(&prepared.base, "draft-1", ALPHA, Against::Classes { refuted: &[] }, &[]);
            found.unwrap().map(|found| (found.draft.sentence, found.ln_odds, found.unseen_gains))
        };
        let found = drafted();
        assert_ne!(found.as_ref().err(), Some(&NoDraft::Noise), "{elements}");
        // What is known of the model by then is taken again.
        assert_eq!(found, drafted(), "{elements}");
    }
}
