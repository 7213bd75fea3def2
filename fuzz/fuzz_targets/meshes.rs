//! Any bytes as a mesh file of each format: a mesh or a refusal, in bounded memory. A mesh has sound triangles, and can be drawn.
#![no_main]

use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::memory;
use tactus_model::{Covering, ForwardModel, Mesh, Response};
use tactus_scene::{Attitude, Format, Pose, Renderer, read};
use tactus_schema::Rig;

/// Most memory to read and draw a file of a few kilobytes.
const READ_MAX_BYTES: usize = 64 << 20;

/// Largest side of a cell of the raster. Small ones take long and show nothing more.
const CELL_MM: f64 = 0.5;

const COVERING: Covering = Covering::PAPER[0];

static MODEL: LazyLock<ForwardModel> = LazyLock::new(|| {
    let rig = Rig::from_toml(include_str!("../../config/rigs/sim.toml")).expect("a shipped rig");
    let elements = rig.array.elements();
    ForwardModel::new(rig.array, rig.psf, Response::uniform(elements, 1000.0, 100.0)).expect("a sound model")
});

fuzz_target!(|input: &[u8]| {
    for format in [Format::Stl, Format::Obj, Format::Ply] {
        memory::within(READ_MAX_BYTES, || match read(format, input) {
            Ok(mesh) => draw(mesh, input),
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 1000, "{text}");
            }
        });
    }
});

fn draw(mesh: Mesh, input: &[u8]) {
    let corners = mesh.vertices_mm().len();
    assert!(!mesh.triangles().is_empty());
    assert!(mesh.triangles().iter().flatten().all(|corner| (*corner as usize) < corners));
    assert!(mesh.corners_mm().flatten().flatten().all(f64::is_finite));
    let Ok(renderer) = Renderer::with_cell_mm(MODEL.clone(), COVERING, Arc::new(mesh), CELL_MM) else {
        unreachable!("the array, the covering and the cells are sound")
    };
    // The file's last bytes give the attitude, so that meshes are seen from all sides.
    let angle = |place: usize| f64::from(input[input.len() - 1 - place % input.len()]) * 360.0 / 256.0;
    let attitude = Attitude { yaw_deg: angle(0), pitch_deg: angle(1), roll_deg: angle(2) };
    for attitude in [Attitude::default(), attitude] {
        let pose = Pose { position_mm: [8.1, 5.9], attitude, depth_mm: 0.3 };
        let Ok(map) = renderer.depth_map(&pose) else { unreachable!("the pose is finite") };
        let deepest_mm = COVERING.thickness_mm as f32;
        assert!(map.penetration_mm.iter().all(|depth_mm| (0.0..=deepest_mm).contains(depth_mm)));
        let mut counts = [0.0; 48];
        assert_eq!(renderer.image(&pose, &mut counts), Ok(()));
        assert!(counts.iter().all(|counts| counts.is_finite()), "{counts:?}");
    }
}
