use super::*;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature of a simplification")]
fn nothing_simpler(_: &u32) -> Vec<u32> {
    Vec::new()
}

#[test]
fn what_fails_together_remains_in_its_order() {
    let events: Vec<u32> = (0..100).collect();
    for needed in [&[7][..], &[0, 99], &[3, 4, 50, 98]] {
        let fails = |events: &[u32]| needed.iter().all(|event| events.contains(event));
        let shrunk = shrink(&events, nothing_simpler, fails, 1000);
        assert_eq!(shrunk.events, needed);
        assert!(!shrunk.is_cut_short && shrunk.tries < 100, "{}", shrunk.tries);
    }
}

#[test]
fn what_remains_is_simplified_and_may_then_be_removed() {
    let halves = |event: &u32| if *event > 1 { vec![event / 2] } else { Vec::new() };
    let fails = |events: &[u32]| events.iter().sum::<u32>() >= 5;
    let shrunk = shrink(&[40, 1, 9], halves, fails, 1000);
    assert!(fails(&shrunk.events) && shrunk.events.len() == 1 && shrunk.events[0] < 10, "{shrunk:?}");
}

#[test]
fn the_tries_are_bounded_and_the_result_fails() {
    let events: Vec<u32> = (0..100).collect();
    let mut asked = 0;
    let fails = |events: &[u32]| {
        asked += 1;
        events.contains(&42)
    };
    let shrunk = shrink(&events, nothing_simpler, fails, 5);
    assert!(shrunk.is_cut_short && shrunk.events.contains(&42) && shrunk.events.len() < 100);
    assert_eq!((shrunk.tries, asked), (5, 5));
}

#[test]
fn what_fails_without_any_event_ends_with_none() {
    assert!(shrink(&[1, 2, 3], nothing_simpler, |_| true, 100).events.is_empty());
}
