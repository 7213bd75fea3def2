use super::*;

fn turned(attitude: Attitude, [x, y, z]: [f64; 3]) -> [f64; 3] {
    attitude.matrix().map(|[a, b, c]| a * x + b * y + c * z)
}

fn near(one: [f64; 3], other: [f64; 3]) -> bool {
    one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-15)
}

#[test]
fn each_angle_turns_about_its_own_axis_counter_clockwise() {
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let quarter = Attitude::default();
    assert!(near(turned(Attitude { yaw_deg: 90.0, ..quarter }, x), y));
    assert!(near(turned(Attitude { pitch_deg: 90.0, ..quarter }, z), x));
    assert!(near(turned(Attitude { roll_deg: 90.0, ..quarter }, y), z));
}

#[test]
fn roll_comes_first_and_yaw_last() {
    let attitude = Attitude { yaw_deg: 90.0, pitch_deg: 90.0, roll_deg: 90.0 };
    // y to z by roll, z to x by pitch, x to y by yaw.
    assert!(near(turned(attitude, [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]));
}
