use super::*;

#[test]
fn the_time_left_of_a_run_in_virtual_time_is_by_the_clock_on_the_wall() {
    let (mut pacing, began) = (Pacing::default(), Instant::now());
    let left_s = |pacing: &mut Pacing, remaining_s, after_s| {
        pacing.left_s(remaining_s, began + Duration::from_secs_f64(after_s))
    };
    // The dry run: nothing is known.
    assert!(left_s(&mut pacing, -1.0, 0.0) < 0.0);
    assert!(left_s(&mut pacing, 600.0, 2.0) < 0.0);
    // 300 of 600 s of the rig in 3 s: as much is left.
    assert!((left_s(&mut pacing, 300.0, 5.0) - 3.0).abs() < 1e-9);
    // Slower since then: 60 s left of 600 after 9 s.
    assert!((left_s(&mut pacing, 60.0, 11.0) - 1.0).abs() < 1e-9);
    assert!(left_s(&mut pacing, 0.0, 12.0).abs() < 1e-9);
}
