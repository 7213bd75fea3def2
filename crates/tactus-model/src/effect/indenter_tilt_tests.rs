use std::f64::consts::TAU;
use std::sync::Arc;

use crate::effect::bench::{CYLINDER, THIN, effect, linear, still, upon};
use crate::{Blur, Effect, Indenter, Mesh, Psf, Simulator};

fn tilt(x_deg: f64, y_deg: f64) -> Effect {
    touched(x_deg, y_deg, 0.0)
}

fn touched(x_deg: f64, y_deg: f64, touched_share: f64) -> Effect {
    effect("indenter-tilt", [("tilt_x_deg", x_deg), ("tilt_y_deg", y_deg), ("touched_share", touched_share)])
}

/// A linear sensor whose tool leans.
fn leaning(indenter: Indenter, x_deg: f64, y_deg: f64) -> Simulator {
    Simulator { indenter, ..linear([tilt(x_deg, y_deg)]) }
}

/// A piece of a face: where it is, along the tool's sides, and how large.
type Piece = ([f64; 2], f64);

/// The sum over a face of what each of its pieces gives, in counts.
fn summed(one: &Simulator, [x_deg, y_deg]: [f64; 2], tip_mm: [f64; 3], face: &[Piece]) -> Vec<f64> {
    let blur = Blur { sigma_mm: Psf::PAPER.sigma_mm(THIN) };
    let array = one.model.array();
    let (sin, cos) = one.registration.rotation_deg.to_radians().sin_cos();
    let [x, y] = one.registration.to_sensor([tip_mm[0], tip_mm[1]]);
    let mut counts = vec![0.0; 48];
    for &([u, v], area_mm2) in face {
        let below_mm =
            one.surface_mm - tip_mm[2] + x_deg.to_radians().tan() * u + y_deg.to_radians().tan() * v;
        let pressed_mm = below_mm.clamp(0.0, THIN.thickness_mm);
        // The tool's sides run along the robot's axes.
        let [at_x, at_y] = [x + cos * u + sin * v, y - sin * u + cos * v];
        for (element, count) in counts.iter_mut().enumerate() {
            let side = |centre: f64| [centre - 0.9, centre + 0.9];
            let [centre_x, centre_y] = array.centre_mm(element).unwrap();
            let share = blur.of_point(at_x, side(centre_x)) * blur.of_point(at_y, side(centre_y));
            *count += 1000.0 * pressed_mm * share * area_mm2 / one.model.reference_mm2();
        }
    }
    counts
}

/// Rings of equal width, each in as many equal pieces.
fn disc(radius_mm: f64) -> Vec<Piece> {
    let (rings, pieces) = (50, 48);
    let turn = TAU / f64::from(pieces);
    let piece = |ring: i32, place: i32| {
        let width_mm = radius_mm / f64::from(rings);
        let from_axis_mm = (f64::from(ring) + 0.5) * width_mm;
        let (sin, cos) = (turn * f64::from(place)).sin_cos();
        ([from_axis_mm * cos, from_axis_mm * sin], from_axis_mm * width_mm * turn)
    };
    (0..rings).flat_map(|ring| (0..pieces).map(move |place| piece(ring, place))).collect()
}

/// Equal rectangles.
fn plate([width_mm, height_mm]: [f64; 2]) -> Vec<Piece> {
    let parts = 50;
    let at = |part: i32| (f64::from(part) + 0.5) / f64::from(parts) - 0.5;
    let piece =
        |i, j| ([width_mm * at(i), height_mm * at(j)], width_mm * height_mm / f64::from(parts * parts));
    (0..parts).flat_map(|i| (0..parts).map(move |j| piece(i, j))).collect()
}

fn assert_near(got: &[f64], want: &[f64], share: f64) {
    let peak = want.iter().copied().fold(0.0, f64::max);
    let worst = got.iter().zip(want).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max);
    assert!(worst < share * peak, "{worst} of {peak}");
}

#[test]
fn a_leaning_face_presses_as_the_sum_over_its_points() {
    for (deg, depth_mm) in [([4.0, 0.0], 0.4), ([0.0, 4.0], 0.4), ([-3.0, 5.0], 0.3), ([8.0, -6.0], 0.05)] {
        for (indenter, face) in [
            (CYLINDER, disc(0.5)),
            (Indenter::Cylinder { diameter_mm: 6.0 }, disc(3.0)),
            (Indenter::Box { size_mm: [3.0, 1.2] }, plate([3.0, 1.2])),
        ] {
            let one = leaning(indenter, deg[0], deg[1]);
            let tip_mm = upon(&one, 21, depth_mm);
            assert_near(&still(&one, tip_mm), &summed(&one, deg, tip_mm, &face), 5e-4);
        }
    }
}

#[test]
fn a_tool_that_touched_with_its_lowest_point_stands_as_much_higher() {
    // The edges of a disc of 1 mm and of a box's corner, leaning 5 and 9 degrees.
    let corner_mm = 1.5 * 5.0_f64.to_radians().tan() + 0.6 * 9.0_f64.to_radians().tan();
    let edge_mm = 0.5 * 5.0_f64.to_radians().tan();
    for (indenter, [x_deg, y_deg], lowest_mm) in [
        (CYLINDER, [5.0, 0.0], edge_mm),
        (CYLINDER, [0.0, -5.0], edge_mm),
        (Indenter::Box { size_mm: [3.0, 1.2] }, [5.0, -9.0], corner_mm),
    ] {
        let axis = leaning(indenter.clone(), x_deg, y_deg);
        for share in [0.25, 1.0] {
            let edge = Simulator { indenter: indenter.clone(), ..linear([touched(x_deg, y_deg, share)]) };
            let [deep, higher] = [0.4, 0.4 - share * lowest_mm].map(|depth_mm| upon(&axis, 21, depth_mm));
            assert_near(&still(&edge, deep), &still(&axis, higher), 1e-9);
        }
    }
}

#[test]
fn a_face_is_the_mesh_of_it() {
    let corners = [[-1.0, -2.0, 0.0], [1.0, -2.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]];
    let mesh = Arc::new(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap());
    for ([x_deg, y_deg], depth_mm, share) in
        [([3.0, -2.0], 0.4, 1e-9), ([0.0, 5.0], 0.4, 1e-9), ([9.0, 9.0], 0.9, 1e-5), ([9.0, 9.0], 0.1, 1e-4)]
    {
        let plate = leaning(Indenter::Box { size_mm: [2.0, 4.0] }, x_deg, y_deg);
        let meshed = leaning(Indenter::Mesh(mesh.clone()), x_deg, y_deg);
        let tip_mm = upon(&plate, 21, depth_mm);
        assert_near(&still(&plate, tip_mm), &still(&meshed, tip_mm), share);
    }
}

#[test]
fn the_volume_stays_while_all_of_the_face_touches() {
    // Over an array that catches all: far more than the spread beyond the tool, in all directions.
    let sum = |one: &Simulator| -> f64 { still(one, upon(one, 21, 0.3)).iter().sum() };
    let mut upright = leaning(CYLINDER, 0.0, 0.0);
    let mut leaning = leaning(CYLINDER, 5.0, -4.0);
    for one in [&mut upright, &mut leaning] {
        let centres: Vec<f64> = (0..8).map(|k| 6.0 * f64::from(k)).collect();
        let rows = centres[..6].to_vec();
        let array = crate::Array::new("wide", [6.0; 2], centres, rows, 30.0, 4095.0, 1.0).unwrap();
        one.model = crate::ForwardModel::new(array, Psf::PAPER, one.model.response().clone()).unwrap();
    }
    assert!((sum(&leaning) / sum(&upright) - 1.0).abs() < 1e-5, "{} {}", sum(&leaning), sum(&upright));
}

#[test]
fn round_heads_roll() {
    for indenter in
        [Indenter::Sphere { diameter_mm: 3.0 }, Indenter::Cone { diameter_mm: 2.0, apex_deg: 90.0 }]
    {
        let one = leaning(indenter.clone(), 5.0, 5.0);
        let upright = Simulator { indenter, ..linear([]) };
        assert_eq!(still(&one, upon(&one, 21, 0.4)), still(&upright, upon(&upright, 21, 0.4)));
    }
}
