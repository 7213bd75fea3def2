use tactus_model::{Contact, ForwardModel};

use super::*;
use crate::model;

fn image(model: &ForwardModel, indenter: Indenter) -> Vec<f64> {
    let contact = Contact { indenter, position_mm: [7.0, 6.0], rotation_deg: 0.0, depth_mm: 0.4 };
    let mut counts = vec![0.0; model.array().elements()];
    model.image(&contact, COVERING, &mut counts);
    counts
}

#[test]
fn poses_stay_on_the_array_and_within_the_depths() {
    let array = Array::fingertip();
    let [along_x, along_y] = array.extent_mm();
    for pose in poses(&array, 500) {
        let within = |[least, most]: [f64; 2], value: f64| least <= value && value <= most;
        assert!(within(along_x, pose.position_mm[0]) && within(along_y, pose.position_mm[1]));
        assert!(
            within([0.0, 360.0], pose.rotation_deg) && within([DEPTH_MIN_MM, DEPTH_MAX_MM], pose.depth_mm)
        );
    }
}

/// Three boxes that do not overlap make the same H; their signals add because indentation is linear.
#[test]
fn the_h_presses_as_its_three_strokes_do() {
    let model = model(Array::digitacts()).unwrap();
    let mut indentation = vec![0.0; 48];
    let mut strokes = vec![0.0; 48];
    let at = |indenter: Indenter, x_mm: f64| Contact {
        indenter,
        position_mm: [x_mm, 6.0],
        rotation_deg: 0.0,
        depth_mm: 0.4,
    };
    for (size_mm, x_mm) in [([2.0, 10.0], 4.0), ([4.0, 2.0], 7.0), ([2.0, 10.0], 10.0)] {
        model.indentation(&at(Indenter::Box { size_mm }, x_mm), COVERING, &mut indentation);
        for (sum, one) in strokes.iter_mut().zip(&indentation) {
            *sum += one;
        }
    }
    model.indentation(&at(Tool::H.indenter(), 7.0), COVERING, &mut indentation);
    for (h, strokes) in indentation.iter().zip(&strokes) {
        assert!((h - strokes).abs() < 1e-9, "{h} {strokes}");
    }
}

/// The facets of the fine mesh are inside the sphere.
#[test]
fn a_fine_mesh_presses_as_the_sphere_does() {
    let model = model(Array::digitacts()).unwrap();
    let round = image(&model, Indenter::Sphere { diameter_mm: 4.0 });
    let fine = image(&model, fine_sphere(8_000).unwrap());
    let peak = round.iter().fold(0.0_f64, |peak, count| peak.max(*count));
    for (fine, round) in fine.iter().zip(&round) {
        assert!((fine - round).abs() < 5e-3 * peak, "{fine} {round}");
    }
}
