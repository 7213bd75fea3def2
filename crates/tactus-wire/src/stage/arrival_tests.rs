use super::*;

const TARGET_MM: [f64; 3] = [1.0, 2.0, 3.0];
const TOLERANCE_MM: f64 = 0.005;

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// What a report means, at `x_mm` on the line to the target.
fn judge(arrival: &mut ArrivalCheck, at_ms: u64, stands: bool, x_mm: f64) -> Judgement {
    arrival.judge(ms(at_ms), stands, [x_mm, 2.0, 3.0], TOLERANCE_MM)
}

#[test]
fn it_is_done_when_the_stage_stands_within_tolerance() {
    let mut arrival = ArrivalCheck::new(ms(100), TARGET_MM, 0.5);
    assert_eq!(judge(&mut arrival, 200, false, 1.0), Judgement::Underway, "it moves");
    assert_eq!(judge(&mut arrival, 300, true, 1.004), Judgement::Done);
    assert_eq!(judge(&mut arrival, 300, true, f64::NAN), Judgement::Underway, "that is no place");
}

#[test]
fn standing_elsewhere_is_believed_after_a_while() {
    let mut arrival = ArrivalCheck::new(ms(0), TARGET_MM, 0.5);
    assert_eq!(judge(&mut arrival, 100, true, 0.0), Judgement::Underway);
    assert_eq!(judge(&mut arrival, 250, false, 0.5), Judgement::Underway, "it has set out after all");
    assert_eq!(judge(&mut arrival, 310, true, 0.9), Judgement::Underway);
    assert_eq!(judge(&mut arrival, 509, true, 0.9), Judgement::Underway);
    assert_eq!(judge(&mut arrival, 510, true, 0.9), Judgement::NotThere);
}

#[test]
fn it_may_take_twice_as_long_as_it_should_and_two_seconds() {
    let arrival = ArrivalCheck::new(ms(100), TARGET_MM, 0.5);
    assert_eq!((arrival.overdue(), arrival.waited(ms(350))), (ms(3100), ms(250)));
    assert_eq!(ArrivalCheck::new(ms(100), TARGET_MM, f64::INFINITY).overdue(), Duration::MAX);
}
