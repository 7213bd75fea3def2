use std::f64::consts::PI;
use std::sync::Arc;

use super::*;
use crate::Mesh;

fn contact(indenter: Indenter, rotation_deg: f64, depth_mm: f64) -> Contact {
    Contact { indenter, position_mm: [3.0, -2.0], rotation_deg, depth_mm }
}

/// Volume and second moments about the tool's axis along x and y.
fn moments(contact: &Contact, sigma_mm: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for Slice { x_mm, y_mm: [low, high], weight_mm2, .. } in contact.slices(sigma_mm) {
        let (dx, low, high) = (x_mm - 3.0, low + 2.0, high + 2.0);
        sum[0] += weight_mm2 * (high - low);
        sum[1] += weight_mm2 * (high - low) * dx * dx;
        sum[2] += weight_mm2 * (high.powi(3) - low.powi(3)) / 3.0;
    }
    sum
}

fn assert_moments(contact: &Contact, want: [f64; 3]) {
    for sigma_mm in [0.05, 1.0, 10.0] {
        for (got, want) in moments(contact, sigma_mm).into_iter().zip(want) {
            assert!((got / want - 1.0).abs() < 1e-9, "{contact:?} sigma {sigma_mm}: {got} {want}");
        }
    }
}

#[test]
fn the_slices_of_a_cylinder_have_its_volume_and_moments() {
    let a: f64 = 0.5;
    let second = 0.3 * PI * a.powi(4) / 4.0;
    assert_moments(
        &contact(Indenter::Cylinder { diameter_mm: 1.0 }, 0.0, 0.3),
        [0.3 * PI * a * a, second, second],
    );
}

#[test]
fn the_slices_of_a_sphere_have_its_caps_volume_and_its_shafts_beyond() {
    let radius: f64 = 2.0;
    // Cap of height h: pi h^2 (R - h/3); second moment about a diameter plane: the integral of pi c^4/4 over height.
    let cap = |h: f64| PI * h * h * (radius - h / 3.0);
    let second =
        |h: f64| PI / 4.0 * (4.0 * radius * radius * h.powi(3) / 3.0 - radius * h.powi(4) + h.powi(5) / 5.0);
    for h in [0.1, 1.0, 2.0] {
        let sphere = contact(Indenter::Sphere { diameter_mm: 4.0 }, 0.0, h);
        assert_moments(&sphere, [cap(h), second(h), second(h)]);
    }
    let sunk = contact(Indenter::Sphere { diameter_mm: 4.0 }, 0.0, 2.5);
    let shaft_second = 0.5 * PI * radius.powi(4) / 4.0;
    let second = second(radius) + shaft_second;
    assert_moments(&sunk, [cap(radius) + 0.5 * PI * radius * radius, second, second]);
}

#[test]
fn the_slices_of_a_turned_box_have_its_volume_and_moments() {
    let [width, height]: [f64; 2] = [3.0, 1.0];
    let tool = Indenter::Box { size_mm: [width, height] };
    let volume = 0.4 * width * height;
    let (along, across) = (volume * width * width / 12.0, volume * height * height / 12.0);
    for degrees in [0.0, 0.2, 30.0, 45.0, 90.0, -110.0, 180.0] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let in_x = along * cos * cos + across * sin * sin;
        let in_y = along * sin * sin + across * cos * cos;
        assert_moments(&contact(tool.clone(), degrees, 0.4), [volume, in_x, in_y]);
    }
}

#[test]
fn three_times_finer_slices_change_nothing() {
    use crate::blur::Blur;
    let tools = [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Sphere { diameter_mm: 4.0 },
        Indenter::Box { size_mm: [3.0, 1.0] },
    ];
    for sigma_mm in [0.1, 0.3, 1.0, 3.0] {
        let blur = Blur { sigma_mm };
        for tool in &tools {
            let contact = contact(tool.clone(), 20.0, 0.7);
            for (dx, dy) in [(0.0, 0.0), (1.4, -0.5), (-0.2, 2.3)] {
                let side = |centre: f64| [centre - 0.9, centre + 0.9];
                let signal = |fineness: f64| -> f64 {
                    let slices = contact.slices(sigma_mm / fineness);
                    let one = |s: &Slice| {
                        s.weight_mm2
                            * blur.of_point(s.x_mm, side(3.0 + dx))
                            * blur.of_line(s.y_mm, side(dy - 2.0))
                    };
                    slices.iter().map(one).sum()
                };
                let (got, want) = (signal(1.0), signal(3.0));
                assert!((got - want).abs() < 1e-11, "{tool:?} {sigma_mm} {dx} {dy}: {got} {want}");
            }
        }
    }
}

#[test]
fn a_tool_at_or_above_the_surface_presses_nothing() {
    for depth_mm in [0.0, -0.3] {
        assert!(contact(Indenter::Sphere { diameter_mm: 4.0 }, 0.0, depth_mm).slices(1.0).is_empty());
    }
}

#[test]
fn the_slices_of_a_cone_have_its_volume_and_its_shafts_beyond() {
    // A right angle at the tip: as wide as high. Second moment of a cone of height h: pi h^5 / 20.
    let cone = Indenter::Cone { diameter_mm: 2.0, apex_deg: 90.0 };
    for h in [0.5_f64, 1.0] {
        let second = PI * h.powi(5) / 20.0;
        assert_moments(&contact(cone.clone(), 0.0, h), [PI * h.powi(3) / 3.0, second, second]);
    }
    let second = PI / 20.0 + 0.5 * PI / 4.0;
    assert_moments(&contact(cone, 0.0, 1.5), [PI / 3.0 + 0.5 * PI, second, second]);
}

fn mesh(corners: &[[f64; 3]], triangles: &[[u32; 3]]) -> Indenter {
    Indenter::Mesh(Arc::new(Mesh::new(corners, triangles).unwrap()))
}

#[test]
fn the_slices_of_a_mesh_of_a_box_have_the_boxs_moments() {
    // Its top too, which cannot be seen from below, and a corner in the middle of its face.
    let corners = [
        [-1.5, -0.5, 0.0],
        [1.5, -0.5, 0.0],
        [1.5, 0.5, 0.0],
        [-1.5, 0.5, 0.0],
        [0.2, 0.1, 0.0],
        [-1.5, -0.5, 0.2],
        [1.5, -0.5, 0.2],
        [1.5, 0.5, 0.2],
    ];
    let tool = mesh(&corners, &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [5, 6, 7]]);
    let volume: f64 = 0.4 * 3.0 * 1.0;
    let (along, across) = (volume * 9.0 / 12.0, volume / 12.0);
    for degrees in [0.0, 0.2, 30.0, 90.0, -110.0] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let in_x = along * cos * cos + across * sin * sin;
        let in_y = along * sin * sin + across * cos * cos;
        assert_moments(&contact(tool.clone(), degrees, 0.4), [volume, in_x, in_y]);
    }
}

#[test]
fn a_slanting_face_presses_as_deep_as_it_stands() {
    // A ramp that rises by its length: at depth h a triangle of h x h is below the surface, 1 mm wide.
    let corners = [[-1.0, -0.5, 0.0], [2.0, -0.5, 3.0], [2.0, 0.5, 3.0], [-1.0, 0.5, 0.0]];
    let ramp = mesh(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let h: f64 = 0.6;
    // Second moment along the ramp about the axis, 1 mm from its foot: the integral of (s - 1)^2 (h - s).
    let along = h.powi(4) / 12.0 - h.powi(3) / 3.0 + h * h / 2.0;
    assert_moments(&contact(ramp.clone(), 0.0, h), [h * h / 2.0, along, h * h / 24.0]);
    assert_moments(&contact(ramp, 90.0, h), [h * h / 2.0, h * h / 24.0, along]);
}

#[test]
fn of_surfaces_that_pass_through_each_other_the_deepest_presses() {
    // Two ramps against each other, both 2 mm long and 1 mm wide: a roof upside down, its valley at x = 0 and
    // z = 0.5 (the lowest points at both ends), and the parts above hidden.
    let corners = [
        [-1.0, -0.5, 0.0],
        [1.0, -0.5, 1.0],
        [1.0, 0.5, 1.0],
        [-1.0, 0.5, 0.0],
        [-1.0, -0.5, 1.0],
        [1.0, -0.5, 0.0],
        [1.0, 0.5, 0.0],
        [-1.0, 0.5, 1.0],
    ];
    let crossed = mesh(&corners, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    // At depth h <= 1/2 each end presses a triangle 2h long and h deep.
    let got = moments(&contact(crossed.clone(), 0.0, 0.4), 1.0)[0];
    assert!((got - 2.0 * 0.4 * 0.4).abs() < 1e-9, "{got}");
    // Turned, the planes of one x cut both ramps at once.
    let got = moments(&contact(crossed.clone(), 90.0, 0.4), 1.0)[0];
    assert!((got - 2.0 * 0.4 * 0.4).abs() < 1e-9, "{got}");
    // Deeper, the whole area: its mean depth is h - 1/4.
    for degrees in [0.0, 25.0, 90.0] {
        let got = moments(&contact(crossed.clone(), degrees, 0.9), 1.0)[0];
        assert!((got - 2.0 * 0.65).abs() < 1e-9, "{degrees}: {got}");
    }
}

#[test]
fn the_footprint_is_the_derivative_by_depth() {
    let corners = [[-1.0, -0.5, 0.0], [2.0, -0.5, 3.0], [2.0, 0.5, 3.0], [-1.0, 0.5, 0.0]];
    let tools = [
        Indenter::Cylinder { diameter_mm: 1.0 },
        Indenter::Sphere { diameter_mm: 4.0 },
        Indenter::Cone { diameter_mm: 1.0, apex_deg: 100.0 },
        Indenter::Box { size_mm: [3.0, 1.0] },
        mesh(&corners, &[[0, 1, 2], [0, 2, 3]]),
    ];
    for tool in tools {
        let volume = |depth_mm| moments(&contact(tool.clone(), 20.0, depth_mm), 1.0)[0];
        let want = (volume(0.700_1) - volume(0.699_9)) / 0.000_2;
        let area = |slice: &Slice| slice.weight_mm2 * (slice.y_mm[1] - slice.y_mm[0]);
        let got: f64 = contact(tool.clone(), 20.0, 0.7).footprint(1.0).iter().map(area).sum();
        assert!((got / want - 1.0).abs() < 1e-6, "{tool:?}: {got} {want}");
    }
}
