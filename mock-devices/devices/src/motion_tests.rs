use super::*;

/// 500 mm/s2: at 20 mm/s, 40 ms and 0.4 mm to speed up or brake.
const ACCELERATION: f64 = 500.0;

fn at_rest() -> (Motion, Instant) {
    (Motion::at_rest([0.0; 3], [0.0; 3], ACCELERATION), Instant::now())
}

fn ms(count: u64) -> Duration {
    Duration::from_millis(count)
}

#[track_caller]
fn assert_at(got: Point, want: Point) {
    assert!(got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-6), "{got:?} {want:?}");
}

#[test]
fn moves_follow_each_other_without_a_pause() {
    let (mut motion, t0) = at_rest();
    motion.push([6.0, 8.0, 0.0], 20.0, t0);
    motion.push([6.0, 8.0, -10.0], 20.0, t0);
    // 0.54 s each, as in the tests of the kinematics.
    assert_at(motion.believed_mm(t0 + ms(270)), [3.0, 4.0, 0.0]);
    assert_at(motion.believed_mm(t0 + ms(540)), [6.0, 8.0, 0.0]);
    assert_at(motion.believed_mm(t0 + ms(810)), [6.0, 8.0, -5.0]);
    assert_eq!(motion.pending(), 2);
    motion.settle(t0 + ms(541));
    assert_eq!(motion.pending(), 1);
    motion.settle(t0 + ms(1081));
    assert!(!motion.is_moving());
    assert_at(motion.true_mm(t0 + ms(2000)), [6.0, 8.0, -10.0]);
}

#[test]
fn a_hold_brakes_and_what_is_left_is_done_after_it() {
    let (mut motion, t0) = at_rest();
    motion.push([10.0, 0.0, 0.0], 20.0, t0);
    motion.push([10.0, 5.0, 0.0], 20.0, t0);
    motion.hold(t0 + ms(270));
    let stopped = t0 + ms(311);
    motion.settle(stopped);
    assert!(!motion.is_moving());
    assert_at(motion.true_mm(stopped), [5.4, 0.0, 0.0]);
    assert_eq!(motion.pending(), 2);
    assert_at(motion.destination_mm(), [10.0, 5.0, 0.0]);
    motion.push([0.0; 3], 20.0, stopped);
    assert!(!motion.is_moving(), "a held motion is not resumed by another move");
    motion.resume(stopped);
    motion.settle(stopped + ms(5000));
    assert_at(motion.true_mm(stopped + ms(5000)), [0.0; 3]);
}

#[test]
fn a_hold_in_the_last_braking_changes_nothing() {
    let (mut motion, t0) = at_rest();
    motion.push([10.0, 0.0, 0.0], 20.0, t0);
    motion.hold(t0 + ms(520));
    motion.settle(t0 + ms(541));
    assert_at(motion.true_mm(t0 + ms(541)), [10.0, 0.0, 0.0]);
    assert_eq!(motion.pending(), 0);
}

#[test]
fn a_freeze_stops_dead() {
    let (mut motion, t0) = at_rest();
    motion.push([10.0, 0.0, 0.0], 20.0, t0);
    motion.freeze(t0 + ms(270));
    assert_at(motion.true_mm(t0 + ms(271)), [5.0, 0.0, 0.0]);
    assert_eq!(motion.pending(), 0);
}

#[test]
fn lost_steps_leave_the_tip_behind_and_homing_makes_it_good() {
    let (mut motion, t0) = at_rest();
    motion.lose_steps(0.05);
    motion.push([0.0, 0.0, 10.0], 20.0, t0);
    assert_at(motion.true_mm(t0), [0.0; 3]);
    assert_at(motion.believed_mm(t0 + ms(270)), [0.0, 0.0, 5.0]);
    assert_at(motion.true_mm(t0 + ms(270)), [0.0, 0.0, 4.95]);
    motion.settle(t0 + ms(541));
    motion.push([0.0, 0.0, 0.0], 20.0, t0 + ms(541));
    motion.settle(t0 + ms(5000));
    assert_at(motion.true_mm(t0 + ms(5000)), [0.0, 0.0, -0.05]);
    assert_at(motion.believed_mm(t0 + ms(5000)), [0.0; 3]);
    motion.believe([0.0, 0.0, -0.05]);
    assert_at(motion.true_mm(t0 + ms(5000)), [0.0, 0.0, -0.05]);
    assert_at(motion.believed_mm(t0 + ms(5000)), [0.0, 0.0, -0.05]);
}

#[test]
fn steps_lost_in_a_move_that_is_held_stay_lost() {
    let (mut motion, t0) = at_rest();
    motion.lose_steps(0.05);
    motion.push([10.0, 0.0, 0.0], 20.0, t0);
    motion.hold(t0 + ms(270));
    motion.settle(t0 + ms(400));
    assert_at(motion.true_mm(t0 + ms(400)), [5.35, 0.0, 0.0]);
    motion.resume(t0 + ms(400));
    motion.settle(t0 + ms(5000));
    assert_at(motion.true_mm(t0 + ms(5000)), [9.95, 0.0, 0.0]);
}

#[test]
fn the_end_of_travel_is_met_when_the_tip_truly_gets_there() {
    let travel_mm = [[-5.0, 5.0], [-5.0, 5.0], [-6.0, 30.0]];
    let t0 = Instant::now();
    // Believed at 0, truly at 1 in x.
    let mut motion = Motion::at_rest([0.0; 3], [1.0, 0.0, 0.0], ACCELERATION);
    motion.push([4.0, 0.0, 0.0], 20.0, t0);
    assert_eq!(motion.leaves(travel_mm), None, "to the very end is allowed");
    motion.push([10.0, 0.0, 0.0], 20.0, t0);
    let leaves = motion.leaves(travel_mm).unwrap();
    assert_at(motion.true_mm(leaves), [5.0, 0.0, 0.0]);
    motion.freeze(leaves);
    motion.push([-20.0, 0.0, 0.0], 20.0, leaves);
    let leaves = motion.leaves(travel_mm).unwrap();
    assert_at(motion.true_mm(leaves), [-5.0, 0.0, 0.0]);
}
