use super::super::products::Apart;
use super::*;
use crate::{Contact, Indenter};

/// A processor without fused products gives the same images, but for the last bits.
#[test]
fn images_are_the_same_by_other_instructions() {
    let centres = |count: u8| (0..count).map(|place| 2.0 * f32::from(place)).collect::<Vec<_>>();
    let (columns, rows) = (centres(11), centres(5));
    for indenter in [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Sphere { diameter_mm: 4.0 },
        Indenter::Box { size_mm: [3.0, 1.0] },
    ] {
        for element_mm in [[1.5, 1.5], [2.0, 1.0]] {
            let press = Contact {
                indenter: indenter.clone(),
                position_mm: [0.0; 2],
                rotation_deg: 0.0,
                depth_mm: 0.0,
            };
            let layers = Layers::new(&press, 0.5, 1.5, element_mm, 1.0);
            let (mut fast, mut plain) = (vec![f32::NAN; 55], vec![f32::NAN; 55]);
            let place = [(9.3, &columns), (4.1, &rows)];
            layers.sample(place, 33.0, 0.3, &mut fast);
            layers.sampling(place, 33.0, 0.3, &mut plain).by(Apart);
            let peak = plain.iter().copied().fold(0.0, f32::max);
            assert!(peak > 0.0);
            for (fast, plain) in fast.iter().zip(&plain) {
                assert!((fast - plain).abs() <= 1e-6 * peak, "{indenter:?}: {fast} and {plain} of {peak}");
            }
        }
    }
}
