use std::sync::Arc;

use super::*;
use crate::fixtures::{block, rotation};
use crate::{Array, Mesh, Psf, Response};

const COVERING: Covering = Covering { thickness_mm: 1.016 };

fn model(array: Array, psf: Psf) -> ForwardModel {
    let elements = array.elements();
    let response = Response {
        sensitivity_counts_per_mm: (0..elements).map(|e| 900.0 + 10.0 * (e % 7) as f64).collect(),
        baseline_counts: (0..elements).map(|e| 100.0 + (e % 3) as f64).collect(),
        quadratic_per_mm: vec![0.05; elements],
        reference_indenter: Indenter::Cylinder { diameter_mm: 1.0 },
        reference_covering: COVERING,
    };
    ForwardModel::new(array, psf, response).unwrap()
}

/// A spread of one pitch, as in the paper's Fig. 10.
fn one_pitch(array: Array) -> ForwardModel {
    let psf = Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 };
    model(array, psf)
}

/// A wedge beside a step, so that the touched area both grows and jumps.
fn stepped_wedge() -> Indenter {
    let corners = [
        [-2.0, -1.0, 0.0],
        [2.0, -1.0, 0.8],
        [2.0, 1.5, 0.8],
        [-2.0, 1.5, 0.0],
        [-1.0, 1.5, 0.33],
        [3.0, 1.5, 0.33],
        [3.0, 3.0, 0.33],
    ];
    Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3], [4, 5, 6]]).unwrap()))
}

/// Flat letters of two strokes.
fn flat_mesh() -> Indenter {
    let corners = [[-3.0, -4.0, 0.0], [-1.0, -4.0, 0.0], [-1.0, 4.0, 0.0], [3.0, 1.0, 0.0]];
    Indenter::Mesh(Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 1, 3]]).unwrap()))
}

/// Greatest difference to the exact image over some poses, as a share of the greatest rise in any of them.
fn error(model: &ForwardModel, indenter: &Indenter) -> f64 {
    let table = PressTable::new(model, indenter, COVERING, 0.7).unwrap();
    let elements = model.array().elements();
    let (mut exact, mut counts) = (vec![0.0; elements], vec![0.0; elements]);
    let (mut worst, mut peak) = (0.0_f64, 0.0_f64);
    for pose in 0..12 {
        let share = |step: f64| (f64::from(pose) * step).fract();
        let position_mm = [1.0 + 14.0 * share(0.618), 1.0 + 9.0 * share(0.414)];
        let (rotation_deg, depth_mm) = (360.0 * share(0.731), 0.7 * (0.05 + 0.95 * share(0.281)));
        let contact = Contact { indenter: indenter.clone(), position_mm, rotation_deg, depth_mm };
        model.image(&contact, COVERING, &mut exact);
        table.image(position_mm, rotation_deg, depth_mm, &mut counts).unwrap();
        for ((got, want), baseline) in counts.iter().zip(&exact).zip(&model.response().baseline_counts) {
            worst = worst.max((f64::from(*got) - want).abs());
            peak = peak.max(want - baseline);
        }
    }
    worst / peak
}

#[test]
fn it_agrees_with_the_exact_image() {
    let tools = [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Sphere { diameter_mm: 4.0 },
        Indenter::Cone { diameter_mm: 1.0, apex_deg: 100.0 },
        Indenter::Box { size_mm: [3.0, 1.0] },
        flat_mesh(),
        stepped_wedge(),
    ];
    for tool in &tools {
        for model in [model(Array::digitacts(), Psf::PAPER), one_pitch(Array::fingertip())] {
            let error = error(&model, tool);
            assert!(error < 5e-5, "{} {tool:?}: {error:.1e}", model.array().name());
        }
    }
}

/// A block that is tilted a little, so that the touched area sweeps over its face within a tenth of a millimetre.
fn tilted_block() -> Indenter {
    Indenter::Mesh(Arc::new(block([6.0, 8.0, 4.0]).turned(rotation([0.0, 1.0, 0.5])).unwrap()))
}

#[test]
fn a_tool_that_is_tilted_a_little_agrees_with_the_exact_image() {
    for model in [
        model(Array::digitacts(), Psf::PAPER),
        one_pitch(Array::fingertip()),
        one_pitch(Array::tekscan_5027()),
    ] {
        let error = error(&model, &tilted_block());
        assert!(error < 5e-5, "{}: {error:.1e}", model.array().name());
    }
}

#[test]
fn oblong_elements_take_part() {
    let places = |step: f64| (0..6).map(|place| 0.5 + step * f64::from(place)).collect::<Vec<_>>();
    let array = Array::new("oblong", [2.0, 1.0], places(2.2), places(1.1), 30.0, 4095.0, 1.0).unwrap();
    let psf = Psf { sigma_intercept_mm: 2.0, sigma_per_mm: 0.0 };
    for tool in [Indenter::Cylinder { diameter_mm: 1.0 }, flat_mesh()] {
        let error = error(&model(array.clone(), psf), &tool);
        assert!(error < 5e-5, "{tool:?}: {error:.1e}");
    }
}

#[test]
fn a_tool_above_the_surface_or_far_away_leaves_the_baseline() {
    let model = model(Array::digitacts(), Psf::PAPER);
    let table = PressTable::new(&model, &flat_mesh(), COVERING, 0.5).unwrap();
    let mut counts = vec![0.0; 48];
    for (x, depth) in [(5.0, 0.0), (5.0, -3.0), (200.0, 0.5)] {
        table.image([x, 5.0], 10.0, depth, &mut counts).unwrap();
        let baseline = &model.response().baseline_counts;
        assert!(
            counts.iter().zip(baseline).all(|(count, baseline)| (f64::from(*count) - baseline).abs() < 1e-12)
        );
    }
}

#[test]
fn what_it_cannot_do_is_refused() {
    let model = model(Array::digitacts(), Psf::PAPER);
    let cylinder = Indenter::Cylinder { diameter_mm: 1.0 };
    for depth_max_mm in [0.0, 1.1, f64::NAN] {
        assert!(matches!(
            PressTable::new(&model, &cylinder, COVERING, depth_max_mm),
            Err(PressTableError::DepthMax { .. })
        ));
    }
    let plate = Indenter::Box { size_mm: [600.0, 600.0] };
    assert!(matches!(PressTable::new(&model, &plate, COVERING, 0.5), Err(PressTableError::Fine { .. })));
    let table = PressTable::new(&model, &cylinder, COVERING, 0.5).unwrap();
    let mut counts = vec![0.0; 48];
    for depth_mm in [0.6, f64::NAN] {
        assert!(matches!(
            table.image([5.0; 2], 0.0, depth_mm, &mut counts),
            Err(PressTableError::Depth { .. })
        ));
    }
    assert!(matches!(table.image([5.0; 2], 0.0, 0.1, &mut counts[1..]), Err(PressTableError::Length { .. })));
}
