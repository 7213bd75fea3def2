use super::*;

const STILL_MM: f64 = 0.005;

/// Phases and presses of a path at 30 Hz over one place, as one letter for each frame and the number of presses.
fn letters(z_mm: &[f64]) -> (String, i32) {
    let t_ns: Vec<i64> =
        (0..z_mm.len()).map(|frame| 33_333_333 * i64::try_from(frame).unwrap_or(0)).collect();
    let path: Vec<[f64; 3]> = z_mm.iter().map(|z| [1.0, 2.0, *z]).collect();
    let phases = of_path(&t_ns, &path, STILL_MM, None);
    let letter = |(phase, press): &(Phase, i32)| {
        assert_eq!(*phase == Phase::Idle, *press == -1, "a frame of a press has its index");
        phase.name().chars().next().unwrap_or('?')
    };
    (phases.iter().map(letter).collect(), phases.iter().map(|(_, press)| press + 1).max().unwrap_or(0))
}

#[test]
fn a_press_with_two_depths() {
    let path = [
        vec![2.0; 6],
        vec![1.5, 1.0, 0.5, 0.0, -0.1],
        vec![-0.2; 6],
        vec![-0.3],
        vec![-0.4; 6],
        vec![-0.3, -0.1, 0.5, 1.5],
        vec![2.0; 6],
    ];
    let (found, presses) = letters(&path.concat());
    assert_eq!((found.as_str(), presses), ("iiiiiiaaaalhhhhhhlhhhhhhuurriiiiii", 1));
}

#[test]
fn strokes_without_a_stand_are_presses_too() {
    let (found, presses) = letters(&[1.0, 0.5, -0.1, -0.3, -0.1, 0.5, 1.0, 0.5, -0.1, -0.3, -0.1, 0.5]);
    assert_eq!((found.as_str(), presses), ("aallurrallur", 2));
}

#[test]
fn a_tip_that_rests_a_little_lower_ends_its_press() {
    let (found, presses) =
        letters(&[&[0.0, -5.0, -10.0, -5.0][..], &[-0.02; 5], &[-5.0, -10.0, -5.0, 0.0]].concat());
    assert_eq!((found.as_str(), presses), ("alluiiiiillur", 2));
}

#[test]
fn a_path_that_touches_nothing_has_no_press() {
    assert_eq!(letters(&[0.004, -0.004, 0.0, 1.0, -0.004]), ("iiiii".to_owned(), 0));
}

#[test]
fn phases_of_a_file_give_its_presses() {
    use Phase::{Approach, Hold, Idle, Load, Retract};
    let phases = [Idle, Approach, Load, Hold, Retract, Load, Hold, Idle, Load];
    assert_eq!(presses(&phases), [-1, 0, 0, 0, 0, 1, 1, -1, 2]);
}
