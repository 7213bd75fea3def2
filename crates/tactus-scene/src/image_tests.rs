use super::*;
use crate::Attitude;
use tactus_model::{Array, Psf, Response};

const COVERING: Covering = Covering { thickness_mm: 1.016 };

fn renderer(covering: Covering) -> Result<Renderer, RenderError> {
    let response = Response { quadratic_per_mm: vec![0.1; 48], ..Response::uniform(48, 1000.0, 100.0) };
    let square = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let mesh = Mesh::new(&square, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let model = ForwardModel::new(Array::digitacts(), Psf::PAPER, response).unwrap();
    Renderer::new(model, covering, Arc::new(mesh))
}

fn pose(depth_mm: f64) -> Pose {
    Pose { position_mm: [8.1, 5.9], attitude: Attitude::upright(20.0), depth_mm }
}

#[test]
fn the_depth_map_holds_the_volume_that_the_tool_displaces() {
    let renderer = renderer(COVERING).unwrap();
    for (depth_mm, volume_mm3) in [(0.4, 6.4), (1.0, 16.0), (5.0, 16.256)] {
        let map = renderer.depth_map(&pose(depth_mm)).unwrap();
        let sum: f64 = map.penetration_mm.iter().map(|depth_mm| f64::from(*depth_mm)).sum();
        let held_mm3 = sum * map.cell_mm * map.cell_mm;
        assert_eq!(map.penetration_mm.len(), map.cols * map.rows);
        assert!((held_mm3 / volume_mm3 - 1.0).abs() < 1e-3, "{held_mm3} of {volume_mm3}");
    }
    // Tilted about its middle, its lowest edge 0.4 mm deep, the square stands below the surface by a wedge.
    let tilted = Pose { attitude: Attitude { pitch_deg: 10.0, ..Attitude::default() }, ..pose(0.4) };
    let map = renderer.depth_map(&tilted).unwrap();
    let sum: f64 = map.penetration_mm.iter().map(|depth_mm| f64::from(*depth_mm)).sum();
    let wedge_mm3 = 4.0 * 0.4 * 0.4 / 10f64.to_radians().tan() / 2.0;
    assert!((sum * map.cell_mm * map.cell_mm / wedge_mm3 - 1.0).abs() < 2e-3);
}

#[test]
fn a_tool_that_does_not_press_leaves_the_baseline() {
    let renderer = renderer(COVERING).unwrap();
    for pose in [pose(0.0), pose(-3.0), Pose { position_mm: [1e6, 0.0], ..pose(0.5) }] {
        let mut counts = vec![0.0; 48];
        renderer.image(&pose, &mut counts).unwrap();
        assert_eq!(counts, vec![100.0; 48]);
        assert_eq!(renderer.depth_map(&pose).unwrap().penetration_mm, []);
    }
}

#[test]
fn a_batch_equals_its_single_images() {
    let renderer = renderer(COVERING).unwrap();
    let poses: Vec<_> = (0..7).map(|k| pose(0.1 * f64::from(k))).collect();
    let mut batch = vec![0.0; 7 * 48];
    renderer.images(&poses, &mut batch).unwrap();
    for (pose, image) in poses.iter().zip(batch.chunks(48)) {
        let mut single = vec![0.0; 48];
        renderer.image(pose, &mut single).unwrap();
        assert_eq!(single, image);
    }
    renderer.images(&[], &mut []).unwrap();
}

#[test]
fn what_makes_no_image_is_named() {
    let made = renderer(COVERING).unwrap();
    let mut counts = [0.0; 96];
    let length = RenderError::Length { poses: 1, elements: 48, places: 96 };
    assert_eq!(made.image(&pose(0.5), &mut counts), Err(length));
    let nowhere = Pose { position_mm: [f64::NAN, 0.0], ..pose(0.5) };
    let refused = RenderError::Pose { pose: 1, field: "position" };
    assert_eq!(made.images(&[pose(0.5), nowhere], &mut counts), Err(refused));
    assert!(matches!(
        renderer(Covering { thickness_mm: 0.0 }).unwrap_err(),
        RenderError::Covering { field: "covering thickness", .. }
    ));
}
