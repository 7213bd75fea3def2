use std::f64::consts::PI;

use super::*;

fn contact(indenter: Indenter, rotation_deg: f64, depth_mm: f64) -> Contact {
    Contact { indenter, position_mm: [3.0, -2.0], rotation_deg, depth_mm }
}

/// Volume and second moments about the tool's axis along x and y.
fn moments(contact: Contact, sigma_mm: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for Slice { x_mm, y_mm: [low, high], weight_mm2 } in contact.slices(sigma_mm) {
        let (dx, low, high) = (x_mm - 3.0, low + 2.0, high + 2.0);
        sum[0] += weight_mm2 * (high - low);
        sum[1] += weight_mm2 * (high - low) * dx * dx;
        sum[2] += weight_mm2 * (high.powi(3) - low.powi(3)) / 3.0;
    }
    sum
}

fn assert_moments(contact: Contact, want: [f64; 3]) {
    for sigma_mm in [0.05, 1.0, 10.0] {
        for (got, want) in moments(contact.clone(), sigma_mm).into_iter().zip(want) {
            assert!((got / want - 1.0).abs() < 1e-9, "{contact:?} sigma {sigma_mm}: {got} {want}");
        }
    }
}

#[test]
fn the_slices_of_a_cylinder_have_its_volume_and_moments() {
    let a: f64 = 0.5;
    let second = 0.3 * PI * a.powi(4) / 4.0;
    assert_moments(
        contact(Indenter::Cylinder { diameter_mm: 1.0 }, 0.0, 0.3),
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
        assert_moments(sphere, [cap(h), second(h), second(h)]);
    }
    let sunk = contact(Indenter::Sphere { diameter_mm: 4.0 }, 0.0, 2.5);
    let shaft_second = 0.5 * PI * radius.powi(4) / 4.0;
    let second = second(radius) + shaft_second;
    assert_moments(sunk, [cap(radius) + 0.5 * PI * radius * radius, second, second]);
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
        assert_moments(contact(tool.clone(), degrees, 0.4), [volume, in_x, in_y]);
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
