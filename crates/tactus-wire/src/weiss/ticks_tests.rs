use core::time::Duration;

use super::{TickOrder, TickUnwrapper};

/// Places frames given as (host time in ms, tick in ms).
fn check(frames: &[(u64, u32)], expected: &[TickOrder]) {
    let mut ticks = TickUnwrapper::default();
    let placed: Vec<_> = frames
        .iter()
        .map(|(host_ms, raw_ms)| ticks.place(Duration::from_millis(*host_ms), *raw_ms))
        .collect();
    assert_eq!(placed, expected);
}

const fn new(tick_ms: u64) -> TickOrder {
    TickOrder::NewClock { tick_ms }
}

const fn next(tick_ms: u64) -> TickOrder {
    TickOrder::Next { tick_ms }
}

#[test]
fn ticks_wrap_without_a_trace() {
    check(
        &[(0, u32::MAX - 20), (33, 12), (66, 45), (99, 78)],
        &[new(4_294_967_275), next(4_294_967_308), next(4_294_967_341), next(4_294_967_374)],
    );
}

#[test]
fn a_frame_twice_is_stale() {
    check(&[(0, 5), (1, 5), (33, 38), (34, 38)], &[new(5), TickOrder::Stale, next(38), TickOrder::Stale]);
}

#[test]
fn two_frames_in_the_wrong_order_cost_the_late_one() {
    check(&[(0, 100), (66, 166), (67, 133), (99, 199)], &[new(100), next(166), TickOrder::Stale, next(199)]);
}

#[test]
fn a_reordered_pair_after_another_is_still_late() {
    check(
        &[(0, 100), (66, 166), (67, 133), (133, 232), (134, 199)],
        &[new(100), next(166), TickOrder::Stale, next(232), TickOrder::Stale],
    );
}

#[test]
fn a_clock_set_far_back_is_new_at_once() {
    check(&[(0, 60_000), (33, 7), (66, 40)], &[new(60_000), new(7), next(40)]);
}

#[test]
fn a_clock_set_back_a_little_costs_one_frame() {
    check(&[(0, 1000), (33, 533), (66, 566), (99, 600)], &[new(1000), TickOrder::Stale, new(566), next(600)]);
}

#[test]
fn a_clock_set_forward_is_new() {
    check(&[(0, 0), (33, 5033), (66, 5066)], &[new(0), new(5033), next(5066)]);
}

#[test]
fn a_pause_of_the_link_is_no_jump() {
    // Frames are lost for 5 s, or delayed and then delivered at once.
    check(&[(0, 0), (5000, 5000)], &[new(0), next(5000)]);
    check(&[(0, 0), (5000, 33), (5000, 66)], &[new(0), next(33), next(66)]);
    check(&[(900, 0), (933, 933)], &[new(0), next(933)]);
}
