use tactus_schema::{DeviceTick, FrameFlags, Rig, TimeStamp, WallTime};

use super::*;
use crate::Void;

fn rig(change: impl Fn(String) -> String) -> Rig {
    Rig::from_toml(&change(include_str!("../../../config/rigs/sim.toml").to_owned())).unwrap()
}

/// Of the simulated rig, changed, with a run in progress and nothing to reset.
fn changed(change: impl Fn(String) -> String) -> Supervisor {
    let rig = rig(change);
    let mut supervisor = Supervisor::new(&rig, &rig.service.clone().unwrap());
    supervisor.fault = None;
    supervisor.begin_run();
    supervisor
}

fn supervisor() -> Supervisor {
    changed(|rig| rig)
}

/// Of an array with a baseline of 10,000 and much room above it.
fn wide() -> Supervisor {
    changed(|rig| {
        rig.replace("full_scale_counts = 4095", "full_scale_counts = 100000")
            .replace("baseline_counts = 100.0", "baseline_counts = 10000.0")
    })
}

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::from_ns(ms * 1_000_000)
}

fn frame(ms: i64, counts: &[f32]) -> Frame {
    Frame {
        seq: 0,
        epoch: 0,
        device_tick: None,
        received: TimeStamp { mono: at_ms(ms), wall: WallTime::default() },
        counts: counts.into(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    }
}

fn at_height(z_mm: f64) -> pb::StageState {
    let t_mono_ns = at_ms(1000).ns();
    pb::StageState { z_mm, t_mono_ns, status: StageStatus::Idle.into(), ..Default::default() }
}

#[test]
fn repeated_taring_cannot_ratchet_the_force_limit_up() {
    let mut supervisor = supervisor();
    supervisor.set_reference(&[100.0; 4]).unwrap();
    assert_eq!(supervisor.on_frame(&frame(0, &[100.0, 1500.0, 100.0, 100.0])), None);
    supervisor.set_tare(&[550.0; 4]).unwrap();
    let violation = supervisor.on_frame(&frame(33, &[550.0, 2200.0, 550.0, 550.0])).unwrap();
    assert!(
        matches!(violation, Violation::ElementForce { element: 1, against: "the run's first zero", .. }),
        "{violation}"
    );
}

#[test]
fn many_elements_below_their_limit_are_still_too_much_together() {
    let mut supervisor = supervisor();
    supervisor.set_reference(&[100.0; 48]).unwrap();
    let violation = supervisor.on_frame(&frame(0, &[1100.0; 48])).unwrap();
    assert_eq!(violation.rule(), "sum-force");
}

#[test]
fn silence_counts_only_near_the_covering() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&frame(1000, &[100.0; 48])), None);
    assert_eq!(supervisor.on_report(&at_height(2.0)), None);
    assert_eq!(supervisor.on_time(at_ms(5000)), None);
    assert_eq!(supervisor.on_frame(&frame(5000, &[100.0; 48])), None);
    assert_eq!(supervisor.on_report(&at_height(-0.2)), None);
    assert_eq!(supervisor.on_time(at_ms(5099)), None);
    assert_eq!(supervisor.on_time(at_ms(5101)).unwrap().rule(), "silence");
}

#[test]
fn a_violation_is_told_once_until_rearmed() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&at_height(-0.72)).unwrap().rule(), "depth");
    assert_eq!(supervisor.on_report(&at_height(-0.73)), None);
    supervisor.begin_reset(at_ms(0));
    assert_eq!(supervisor.on_report(&at_height(-0.73)).unwrap().rule(), "depth");
}

#[test]
fn rearming_gives_a_returning_sensor_its_full_time() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&at_height(0.0)), None);
    assert!(supervisor.on_time(at_ms(200)).is_some());
    supervisor.forgive_silence(at_ms(300));
    assert_eq!(supervisor.on_time(at_ms(350)), None);
    assert!(supervisor.on_time(at_ms(401)).is_some());
}

#[test]
fn a_stage_that_does_not_know_where_it_is_counts_as_where_it_was_last() {
    let lost = |z_mm| pb::StageState { z_mm, status: StageStatus::Unhomed.into(), ..Default::default() };
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&lost(0.0)), None);
    assert_eq!(supervisor.on_time(at_ms(500)), None, "nothing says yet that the tip is near");
    assert_eq!(supervisor.on_report(&at_height(-0.3)), None);
    assert_eq!(supervisor.on_report(&lost(5.0)), None);
    assert!(
        supervisor.on_time(at_ms(500)).is_some(),
        "the tip was pressed in when the stage lost its position"
    );
}

#[test]
fn a_sensor_that_falls_when_pressed_is_limited_too() {
    let mut supervisor = changed(|rig| {
        rig.replace("sensitivity_counts_per_mm = 1000.0", "sensitivity_counts_per_mm = -1000.0")
            .replace("\nbaseline_counts = 100.0", "\nbaseline_counts = 3000.0")
    });
    supervisor.set_reference(&[3000.0; 48]).unwrap();
    assert_eq!(supervisor.on_frame(&frame(0, &[4000.0; 48])), None, "it rises when it is let go");
    let violation = supervisor.on_frame(&frame(33, &[900.0; 48])).unwrap();
    assert_eq!(violation.rule(), "element-force");
}

/// A frame in which elements were not read.
fn partly_read(ms: i64, counts: &[f32], bad: &[u32]) -> Frame {
    Frame { bad_elements: bad.into(), flags: FrameFlags::BAD_ELEMENTS, ..frame(ms, counts) }
}

#[test]
fn what_was_not_read_neither_trips_nor_hides_a_load() {
    let mut supervisor = wide();
    supervisor.set_reference(&[10_000.0; 48]).unwrap();
    let mut counts = [10_000.0; 48];
    counts[3] = f32::NAN;
    counts[4] = 60_000.0;
    counts[5] = 0.0;
    assert_eq!(supervisor.on_frame(&partly_read(0, &counts, &[4, 5])), None);
    // 45 elements rise by 900: their sum is over its limit, whatever the three others stand with.
    let mut counts = counts.map(|count| count + 900.0);
    counts[5] = -1e9;
    let violation = supervisor.on_frame(&partly_read(33, &counts, &[4, 5])).unwrap();
    assert_eq!(violation.rule(), "sum-force");
}

#[test]
fn an_element_that_falls_silent_near_the_covering_is_a_stop() {
    let mut supervisor = changed(|rig| rig.replace("[motion]", "unwatched_elements = [2]\n[motion]"));
    assert_eq!(supervisor.on_frame(&partly_read(0, &[100.0; 4], &[2])), None);
    supervisor.set_reference(&[100.0; 4]).unwrap();
    assert_eq!(supervisor.on_report(&at_height(-0.2)), None);
    for ms in [33, 67, 100] {
        assert_eq!(supervisor.on_frame(&partly_read(ms, &[100.0; 4], &[1, 2])), None);
        assert_eq!(supervisor.on_time(at_ms(ms)), None, "a bad reading or three are borne");
    }
    assert_eq!(supervisor.on_frame(&partly_read(133, &[100.0; 4], &[1, 2])), None);
    let violation = supervisor.on_time(at_ms(134)).unwrap();
    assert!(matches!(violation, Violation::ElementSilence { element: 1, .. }), "{violation}");
}

#[test]
fn an_element_that_is_not_read_at_the_zero_is_named_by_the_rig_file_or_the_run_is_refused() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&partly_read(0, &[0.0, 100.0], &[0])), None);
    let refused = supervisor.set_reference(&[0.0, 100.0]).unwrap_err();
    assert_eq!(refused, Violation::Unread { element: 0 });
    assert!(!supervisor.has_zero());

    let mut known = changed(|rig| rig.replace("[motion]", "unwatched_elements = [0]\n[motion]"));
    assert_eq!(known.on_frame(&partly_read(0, &[0.0, 100.0], &[0])), None);
    known.set_reference(&[0.0, 100.0]).unwrap();
    assert_eq!(known.on_frame(&frame(33, &[3000.0, 100.0])), None, "nobody watches it");
}

#[test]
fn an_element_that_is_not_read_at_a_tare_keeps_its_limit_above_the_first_zero() {
    let mut supervisor = supervisor();
    supervisor.set_reference(&[100.0; 2]).unwrap();
    assert_eq!(supervisor.on_frame(&partly_read(0, &[100.0; 2], &[])), None);
    assert_eq!(supervisor.on_frame(&partly_read(2000, &[0.0, 100.0], &[0])), None);
    supervisor.set_tare(&[0.0, 100.0]).unwrap();
    assert_eq!(supervisor.on_frame(&frame(2033, &[2000.0, 100.0])), None);
    let violation = supervisor.on_frame(&frame(2067, &[2101.0, 100.0])).unwrap();
    assert!(matches!(violation, Violation::ElementForce { element: 0, .. }), "{violation}");
}

#[test]
fn elements_that_fall_do_not_hide_the_load_on_those_that_rise() {
    let mut supervisor = wide();
    supervisor.set_reference(&[10_000.0; 48]).unwrap();
    let mut counts = [11_900.0; 48];
    counts[24..].fill(5_000.0);
    assert_eq!(supervisor.on_frame(&frame(0, &counts)).unwrap().rule(), "sum-force");
}

#[test]
fn a_zero_far_from_the_rigs_baseline_is_refused_and_changes_nothing() {
    let mut supervisor = supervisor();
    let refused = supervisor.set_reference(&[100.0, 601.0, 100.0, 100.0]).unwrap_err();
    assert!(matches!(refused, Violation::Zero { element: 1, .. }), "{refused}");
    assert!(!supervisor.has_zero());
    supervisor.set_reference(&[100.0, 599.0, 100.0, 100.0]).unwrap();
    supervisor.set_tare(&[100.0, 700.0, 100.0, 100.0]).unwrap_err();

    let mut unwatched = changed(|rig| rig.replace("[motion]", "unwatched_elements = [1]\n[motion]"));
    unwatched.set_reference(&[100.0, 4000.0, 100.0, 100.0]).unwrap();
    assert_eq!(unwatched.on_frame(&frame(0, &[100.0, 0.0, 100.0, 100.0])), None);
}

#[test]
fn before_the_first_zero_loads_are_held_against_the_baseline() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&frame(0, &[2599.0; 4])), None);
    let violation = supervisor.on_frame(&frame(33, &[2601.0; 4])).unwrap();
    assert!(
        matches!(violation, Violation::ElementForce { against: "the rig's baseline", .. }),
        "{violation}"
    );
}

fn to(z_mm: f64) -> Target {
    Target { position_mm: [25.0, 20.0, z_mm], speed_mm_per_s: 1.0 }
}

fn standing(z_mm: f64) -> pb::StageState {
    pb::StageState { x_mm: 25.0, y_mm: 20.0, ..at_height(z_mm) }
}

/// Over the array at a height, with a zero and a frame at 1 s.
fn ready(z_mm: f64) -> Supervisor {
    ready_with(supervisor(), z_mm)
}

fn ready_with(mut supervisor: Supervisor, z_mm: f64) -> Supervisor {
    assert_eq!(supervisor.on_frame(&frame(1000, &[100.0; 48])), None);
    supervisor.set_reference(&[100.0; 48]).unwrap();
    assert_eq!(supervisor.on_report(&standing(z_mm)), None);
    assert_eq!(supervisor.on_frame(&frame(1000, &[100.0; 48])), None);
    supervisor
}

#[test]
fn a_permit_down_lasts_one_sample_period_and_one_up_lasts() {
    let mut supervisor = ready(0.1);
    let down = supervisor.permit(to(0.0), at_ms(1010)).unwrap();
    assert_eq!(down.check(at_ms(1043)), Ok(()));
    assert_eq!(down.check(at_ms(1044)), Err(Void::Expired));
    let up = supervisor.permit(to(2.0), at_ms(1010)).unwrap();
    assert_eq!(up.check(at_ms(100_000)), Ok(()));
}

#[test]
fn a_permit_down_of_a_fast_sensor_lasts_long_enough_for_a_question_to_the_controller() {
    let mut supervisor = ready_with(changed(|rig| rig.replace("rate_hz = 30.0", "rate_hz = 1000.0")), 0.1);
    let down = supervisor.permit(to(0.0), at_ms(1010)).unwrap();
    assert_eq!(down.check(at_ms(1040)), Ok(()));
    assert_eq!(down.check(at_ms(1041)), Err(Void::Expired));
}

#[test]
fn whatever_stops_voids_every_permit_that_was_given_before() {
    let mut supervisor = ready(0.1);
    let before_stop = supervisor.permit(to(0.0), at_ms(1010)).unwrap();
    supervisor.revocation().revoke();
    assert_eq!(before_stop.check(at_ms(1010)), Err(Void::Revoked));

    let before_trip = supervisor.permit(to(0.0), at_ms(1010)).unwrap();
    supervisor.on_frame(&frame(1033, &[3000.0; 48])).unwrap();
    assert_eq!(before_trip.check(at_ms(1033)), Err(Void::Revoked));

    supervisor.begin_reset(at_ms(1033));
    let homing = supervisor.permit_homing(at_ms(1034)).unwrap();
    supervisor.on_connected();
    assert_eq!(homing.check(at_ms(1034)), Err(Void::Revoked));
}

#[test]
fn a_permit_is_void_once_another_is_given_or_the_stage_has_moved() {
    let mut supervisor = ready(0.1);
    let first = supervisor.permit(to(2.0), at_ms(1010)).unwrap();
    let second = supervisor.permit(to(2.0), at_ms(1010)).unwrap();
    assert_eq!(first.check(at_ms(1010)), Err(Void::Revoked));
    assert_eq!(supervisor.on_report(&standing(0.1004)), None);
    assert_eq!(second.check(at_ms(1010)), Ok(()), "within tolerance it stands where it stood");
    let aside = pb::StageState { x_mm: 25.1, ..standing(0.1) };
    assert_eq!(supervisor.on_report(&aside), None);
    assert_eq!(second.check(at_ms(1010)), Err(Void::Revoked));
}

#[test]
fn an_old_report_of_the_stage_permits_the_way_up_only() {
    let mut supervisor = ready(0.1);
    assert_eq!(supervisor.on_frame(&frame(1500, &[100.0; 48])), None);
    supervisor.permit(to(0.0), at_ms(1500)).unwrap();
    let denied = supervisor.permit(to(0.0), at_ms(1501)).unwrap_err();
    assert!(denied.may_pass() && matches!(denied, Denied::NoFreshReport { .. }), "{denied}");
    supervisor.permit(to(2.0), at_ms(1501)).unwrap();
}

#[test]
fn a_step_down_wants_frames_a_zero_small_steps_and_a_straight_way() {
    let denied =
        |supervisor: &mut Supervisor, to: Target, ms: i64| supervisor.permit(to, at_ms(ms)).unwrap_err();
    let mut supervisor = ready(0.3);
    assert!(matches!(denied(&mut supervisor, to(0.2), 1101), Denied::NoFreshFrame { .. }));
    assert!(matches!(denied(&mut supervisor, to(0.19), 1010), Denied::TooFarDown { .. }));
    let aside = Target { position_mm: [26.0, 20.0, 0.25], ..to(0.0) };
    assert!(matches!(denied(&mut supervisor, aside, 1010), Denied::Sideways { .. }));
    let outside = Target { position_mm: [9.0, 20.0, 0.3], ..to(0.3) };
    assert!(matches!(denied(&mut supervisor, outside, 1010), Denied::Outside { axis: "x", .. }));
    let fast = Target { speed_mm_per_s: 6.0, ..to(0.2) };
    assert!(matches!(denied(&mut supervisor, fast, 1010), Denied::TooFast { .. }));
    let nowhere = Target { position_mm: [25.0, 20.0, f64::NAN], ..to(0.2) };
    assert!(matches!(denied(&mut supervisor, nowhere, 1010), Denied::Outside { axis: "z", .. }));
    supervisor.permit(to(0.2), at_ms(1010)).unwrap();

    let mut deep = ready(-0.7);
    assert!(matches!(denied(&mut deep, to(-0.72), 1010), Denied::TooDeep { .. }));
    deep.permit(to(-0.71), at_ms(1010)).unwrap();

    let mut supervisor = ready(0.3);
    supervisor.on_connected().unwrap();
    supervisor.forgive_silence(at_ms(1010));
    assert_eq!(denied(&mut supervisor, to(0.2), 1010), Denied::NoZero);

    let mut moving = ready(0.3);
    let report = pb::StageState { status: StageStatus::Moving.into(), ..standing(0.3) };
    assert_eq!(moving.on_report(&report), None);
    assert!(matches!(denied(&mut moving, to(0.2), 1010), Denied::NotStanding { .. }));
}

#[test]
fn a_fault_permits_the_way_up_and_lasts_until_a_reset() {
    let mut supervisor = ready(-0.3);
    supervisor.on_frame(&frame(1033, &[3000.0; 48])).unwrap();
    assert_eq!(supervisor.on_frame(&frame(1067, &[100.0; 48])), None);
    assert!(matches!(supervisor.permit(to(-0.35), at_ms(1070)), Err(Denied::Fault(Fault::Tripped(_)))));
    assert!(matches!(supervisor.permit_homing(at_ms(1070)), Err(Denied::Fault(Fault::Tripped(_)))));
    supervisor.permit(to(2.0), at_ms(1070)).unwrap();
    supervisor.end();
    supervisor.begin_run();
    supervisor.forgive_silence(at_ms(1070));
    assert!(supervisor.fault().is_some(), "neither a new run nor a returning sensor clears it");

    supervisor.begin_reset(at_ms(1070));
    assert_eq!(supervisor.fault(), Some(Fault::Unfinished));
    supervisor.permit_homing(at_ms(1070)).unwrap();
    assert!(supervisor.permit(to(-0.35), at_ms(1070)).is_err(), "nothing goes down in a reset");
    supervisor.finish_reset(at_ms(1070)).unwrap();
    assert_eq!(supervisor.fault(), None);
}

#[test]
fn a_reset_does_not_end_while_the_stage_or_the_sensor_is_missing() {
    let mut supervisor = ready(2.0);
    supervisor.begin_reset(at_ms(1010));
    assert!(matches!(supervisor.finish_reset(at_ms(1200)), Err(Denied::NoFreshFrame { .. })));
    let unhomed = pb::StageState { status: StageStatus::Unhomed.into(), ..standing(2.0) };
    supervisor.on_report(&unhomed);
    assert_eq!(supervisor.finish_reset(at_ms(1010)), Err(Denied::Fault(Fault::Unhomed)));
    let alarm = pb::StageState { status: StageStatus::Alarm.into(), ..standing(2.0) };
    supervisor.on_report(&alarm);
    assert!(matches!(supervisor.permit_homing(at_ms(1010)), Err(Denied::Fault(Fault::Alarm))));
    assert!(supervisor.finish_reset(at_ms(1010)).is_err());
}

#[test]
fn homing_is_watched_for_silence_wherever_the_tip_is() {
    let mut supervisor = ready(2.0);
    supervisor.begin_reset(at_ms(1000));
    let homing = pb::StageState { status: StageStatus::Homing.into(), ..standing(2.0) };
    supervisor.on_report(&homing);
    assert_eq!(supervisor.on_time(at_ms(1099)), None);
    assert_eq!(supervisor.on_time(at_ms(1101)).unwrap().rule(), "silence");
}

#[test]
fn a_thinner_covering_lowers_the_limit_and_a_thicker_one_does_not_pass_the_cap() {
    let mut supervisor = ready(-0.3);
    supervisor.set_covering(Covering { thickness_mm: 0.5 });
    assert!(matches!(supervisor.permit(to(-0.36), at_ms(1010)), Err(Denied::TooDeep { .. })));
    supervisor.set_covering(Covering { thickness_mm: 20.0 });
    assert_eq!(supervisor.on_report(&standing(-3.5)), None);
    assert_eq!(supervisor.on_report(&standing(-3.6)).unwrap().rule(), "depth");
}

#[test]
fn a_frozen_array_is_a_stop_and_a_steady_one_is_not() {
    let mut supervisor = ready(-0.1);
    let pressed = [250.0; 48];
    for ms in (1033..1400).step_by(33) {
        assert_eq!(supervisor.on_frame(&frame(ms, &pressed)), None, "it stands still");
    }
    assert_eq!(supervisor.on_report(&standing(-0.2)), None);
    for ms in (1400..1700).step_by(33) {
        assert_eq!(supervisor.on_frame(&frame(ms, &pressed)), None, "its reading was ahead of the report");
    }
    assert_eq!(supervisor.on_report(&standing(-0.3)), None);
    assert_eq!(supervisor.on_frame(&frame(1700, &pressed)), None);
    assert_eq!(supervisor.on_frame(&frame(1733, &pressed)), None);
    assert_eq!(supervisor.on_frame(&frame(1767, &pressed)).unwrap().rule(), "frozen");
}

#[test]
fn a_deep_tip_that_no_element_feels_is_a_stop_over_the_array_only() {
    let at = |supervisor: &mut Supervisor, ms: i64| {
        #[expect(clippy::cast_precision_loss, reason = "a small number that makes frames differ")]
        supervisor.on_frame(&frame(ms, &[110.0 + (ms % 7) as f32; 48]))
    };
    let mut supervisor = ready(-0.4);
    assert_eq!([1033, 1067].map(|ms| at(&mut supervisor, ms)), [None, None]);
    assert_eq!(at(&mut supervisor, 1100).unwrap().rule(), "no-response");

    let mut rising = ready(-0.4);
    assert_eq!([1033, 1067].map(|ms| at(&mut rising, ms)), [None, None]);
    rising.permit(to(2.0), at_ms(1101)).unwrap();
    assert_eq!([1133, 1167, 1200].map(|ms| at(&mut rising, ms)), [None, None, None], "it is on its way up");

    let mut beside = ready(2.0);
    assert_eq!(beside.on_report(&pb::StageState { x_mm: 12.0, y_mm: 12.0, ..at_height(-0.4) }), None);
    assert_eq!([1033, 1067, 1100, 1133].map(|ms| at(&mut beside, ms)), [None, None, None, None]);
}

#[test]
fn under_a_thicker_covering_less_is_expected_and_a_rig_may_expect_nothing() {
    let at = |supervisor: &mut Supervisor, ms: i64| {
        #[expect(clippy::cast_precision_loss, reason = "a small number that makes frames differ")]
        supervisor.on_frame(&frame(ms, &[110.0 + (ms % 7) as f32; 48]))
    };
    // The spread under 20 mm is 12.16 mm instead of 2.725: a twentieth of 1,000 counts per mm becomes 2.5.
    let mut thick = ready(-0.4);
    thick.set_covering(Covering { thickness_mm: 20.0 });
    let mut violations: Vec<_> = [1033, 1067, 1100, 1133].map(|ms| at(&mut thick, ms)).into();
    assert_eq!(thick.on_report(&standing(-3.5)), None);
    violations.extend([1167, 1200, 1233, 1267].map(|ms| at(&mut thick, ms)));
    assert!(violations.iter().all(Option::is_none), "{violations:?}");

    let mut silent = changed(|rig| rig.replace("[motion]", "expects_response = false\n[motion]"));
    silent.set_reference(&[100.0; 48]).unwrap();
    assert_eq!(silent.on_report(&standing(-0.4)), None);
    assert_eq!([1033, 1067, 1100, 1133].map(|ms| at(&mut silent, ms)), [None, None, None, None]);
}

#[test]
fn without_a_sensor_nothing_goes_below_the_safe_height() {
    let rig = rig(|rig| rig);
    let mut supervisor = Supervisor::without_sensor(&rig, &rig.service.clone().unwrap());
    supervisor.permit_homing(at_ms(0)).unwrap();
    assert_eq!(supervisor.on_report(&standing(10.0)), None);
    supervisor.permit(to(2.0), at_ms(0)).unwrap();
    assert!(supervisor.permit(to(1.9), at_ms(0)).is_err());
}

#[test]
fn however_slow_the_sensor_is_two_steps_down_are_the_most_without_a_frame() {
    let mut supervisor = ready(0.3);
    for z_mm in [0.2, 0.1] {
        supervisor.permit(to(z_mm), at_ms(1010)).unwrap();
        assert_eq!(supervisor.on_report(&standing(z_mm)), None);
    }
    let denied = supervisor.permit(to(0.0), at_ms(1010)).unwrap_err();
    assert!(denied.may_pass() && matches!(denied, Denied::NoFreshFrame { .. }), "{denied}");
    assert_eq!(supervisor.on_frame(&frame(1020, &[f32::NAN; 48])), None);
    let denied = supervisor.permit(to(0.0), at_ms(1021)).unwrap_err();
    assert!(matches!(denied, Denied::NoFreshFrame { .. }), "a frame that reads no element is none: {denied}");
    assert_eq!(supervisor.on_frame(&frame(1033, &[100.0; 48])), None);
    supervisor.permit(to(0.0), at_ms(1040)).unwrap();
}

#[test]
fn a_sensor_that_connects_anew_in_a_run_is_a_silence_that_may_be_forgiven() {
    let mut supervisor = ready(2.0);
    assert_eq!(supervisor.on_connected(), Some(Violation::Reconnected));
    assert!(!supervisor.has_zero());
    supervisor.forgive_silence(at_ms(1100));
    assert_eq!(supervisor.fault(), None);
    assert_eq!(supervisor.on_connected(), None, "it had no zero to lose");
}

#[test]
fn an_overload_during_a_silence_is_told_and_not_forgiven_with_it() {
    let mut supervisor = ready(-0.3);
    assert_eq!(supervisor.on_time(at_ms(1101)).unwrap().rule(), "silence");
    assert_eq!(supervisor.on_frame(&frame(1133, &[3000.0; 48])).unwrap().rule(), "element-force");
    supervisor.forgive_silence(at_ms(1140));
    assert!(matches!(supervisor.fault(), Some(Fault::Tripped(Violation::ElementForce { .. }))));
}

#[test]
fn a_tip_that_is_not_up_is_told_before_all_other_faults() {
    let mut supervisor = ready(-0.3);
    supervisor.on_frame(&frame(1033, &[3000.0; 48])).unwrap();
    supervisor.latch(Fault::NotRetracted("test".into()));
    supervisor.latch(Fault::Defect("test".into()));
    let alarm = pb::StageState { status: StageStatus::Alarm.into(), ..standing(-0.3) };
    supervisor.on_report(&alarm);
    assert_eq!(supervisor.fault(), Some(Fault::NotRetracted("test".into())));
}

#[test]
fn a_reset_that_does_not_finish_tells_again_that_the_tip_is_not_up() {
    let mut supervisor = ready(-0.3);
    supervisor.latch(Fault::NotRetracted("test".into()));
    for _ in 0..2 {
        supervisor.begin_reset(at_ms(1010));
        assert_eq!(supervisor.fault(), Some(Fault::Unfinished), "the reset may home and raise the tip");
    }
    supervisor.end();
    assert_eq!(supervisor.fault(), Some(Fault::NotRetracted("test".into())));

    supervisor.begin_reset(at_ms(1010));
    supervisor.finish_reset(at_ms(1010)).unwrap();
    supervisor.end();
    assert_eq!(supervisor.fault(), None);
}

#[test]
fn a_frame_that_reads_no_element_permits_nothing() {
    let mut supervisor = ready(2.0);
    supervisor.begin_reset(at_ms(1010));
    supervisor.permit_homing(at_ms(1034)).unwrap();
    supervisor.on_frame(&frame(1200, &[f32::NAN; 48]));
    assert!(matches!(supervisor.permit_homing(at_ms(1201)), Err(Denied::NoFreshFrame { .. })));
    supervisor.on_frame(&frame(1233, &[100.0; 48]));
    supervisor.permit_homing(at_ms(1234)).unwrap();
}

#[test]
fn a_report_whose_position_is_no_number_permits_nothing() {
    for no_number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for place in [
            pb::StageState { x_mm: no_number, ..standing(0.1) },
            pb::StageState { y_mm: no_number, ..standing(0.1) },
            pb::StageState { z_mm: no_number, ..standing(0.1) },
        ] {
            let mut supervisor = ready(0.1);
            assert_eq!(supervisor.on_report(&place), None);
            let there = [place.x_mm, place.y_mm, place.z_mm];
            for position_mm in [there, [25.0, 20.0, 0.0], [24.9, 20.0, 7.0]] {
                let denied = supervisor.permit(Target { position_mm, ..to(0.0) }, at_ms(1010)).unwrap_err();
                assert_eq!(denied, Denied::NoPlace, "{place:?} to {position_mm:?}");
            }
            assert!(supervisor.on_time(at_ms(1200)).is_some(), "the tip is where it was last");
        }
    }
}

#[test]
fn a_forgiven_silence_takes_no_other_fault_with_it() {
    let rig = rig(|rig| rig);
    let mut started = Supervisor::new(&rig, &rig.service.clone().unwrap());
    assert_eq!(started.on_report(&standing(0.0)), None);
    assert_eq!(started.on_time(at_ms(1200)).unwrap().rule(), "silence");
    assert_eq!(started.on_time(at_ms(1233)), None, "it is told once");
    assert_eq!(started.on_frame(&frame(1250, &[100.0; 48])), None);
    started.forgive_silence(at_ms(1250));
    assert_eq!(started.fault(), Some(Fault::Started));
    assert_eq!(started.finish_reset(at_ms(1250)), Err(Denied::Fault(Fault::Started)));

    let mut unfinished = ready(0.1);
    unfinished.begin_reset(at_ms(1010));
    unfinished.on_time(at_ms(1200)).unwrap();
    assert!(matches!(unfinished.permit_homing(at_ms(1200)), Err(Denied::Fault(Fault::Tripped(_)))));
    unfinished.end();
    unfinished.forgive_silence(at_ms(1200));
    assert_eq!(unfinished.fault(), Some(Fault::Unfinished));
}

#[test]
fn a_zero_without_an_element_is_refused_and_the_baseline_still_limits() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.set_reference(&[]), Err(Violation::Unread { element: 0 }));
    assert_eq!(supervisor.on_frame(&frame(1000, &[4000.0; 48])).unwrap().rule(), "element-force");
}

#[test]
fn a_stage_that_was_away_may_go_up_and_nothing_else_before_a_reset() {
    let mut supervisor = ready(-0.3);
    let away = pb::StageState { status: StageStatus::Disconnected.into(), ..standing(-0.3) };
    supervisor.on_report(&away);
    assert_eq!(supervisor.permit(to(2.0), at_ms(1010)).unwrap_err(), Denied::NoStage);
    supervisor.on_report(&standing(-0.3));
    assert_eq!(supervisor.fault(), Some(Fault::Away));
    assert_eq!(supervisor.permit(to(-0.35), at_ms(1010)).unwrap_err(), Denied::Fault(Fault::Away));
    supervisor.permit(to(2.0), at_ms(1010)).unwrap();
    supervisor.permit_homing(at_ms(1010)).unwrap();
    supervisor.begin_reset(at_ms(1010));
    supervisor.finish_reset(at_ms(1010)).unwrap();
    assert_eq!(supervisor.fault(), None);
    // Away during a reset: the place is not that which the homing found.
    supervisor.begin_reset(at_ms(1010));
    supervisor.on_report(&away);
    supervisor.on_report(&standing(2.0));
    assert_eq!(supervisor.finish_reset(at_ms(1010)), Err(Denied::Fault(Fault::Away)));
}

#[test]
fn frames_that_a_link_keeps_back_are_not_fresh() {
    let mut supervisor = ready(-0.3);
    supervisor.set_tick(1_000_000);
    let sampled_ms = |tick_ms: u64, at_ms: i64| Frame {
        device_tick: Some(DeviceTick(tick_ms)),
        ..frame(at_ms, &[100.0; 48])
    };
    let mut violation = None;
    // Sampled every 33 ms, and 59 ms apart when they arrive.
    for (tick_ms, arrived_ms) in (0..12).map(|at| (33 * at, 1010 + 59 * i64::try_from(at).unwrap())) {
        violation = violation.or(supervisor.on_frame(&sampled_ms(tick_ms, arrived_ms)));
        violation = violation.or(supervisor.on_time(at_ms(arrived_ms + 58)));
    }
    assert!(matches!(violation, Some(Violation::Silence { .. })), "{violation:?}");
    assert!(supervisor.late_s().is_some_and(|late_s| late_s > 0.25));
    // They come until 1659 ms; from then on none comes at all.
    supervisor.begin_reset(at_ms(1500));
    let refused = supervisor.finish_reset(at_ms(1700)).unwrap_err();
    assert!(matches!(refused, Denied::LateFrames { .. }) && refused.may_pass(), "{refused}");
    assert!(matches!(supervisor.finish_reset(at_ms(2000)), Err(Denied::NoFreshFrame { .. })));
    // They still show a load.
    let loaded = Frame { counts: [3000.0; 48].into(), ..sampled_ms(400, 1720) };
    assert!(matches!(
        supervisor.on_frame(&loaded),
        Some(Violation::ElementForce { .. } | Violation::SumForce { .. })
    ));
}
