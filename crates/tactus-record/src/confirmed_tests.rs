use tactus_schema::pb::{self, run_event::Event};

use super::Confirmed;

fn started(step: u64) -> Event {
    Event::StepStarted(pb::StepStarted {
        step,
        at: format!("corners.star:{}", step + 2),
        ..Default::default()
    })
}

fn done(step: u64) -> Event {
    Event::StepDone(pb::StepDone { step, ..Default::default() })
}

fn dwell(press: i32, dwell: u32) -> Event {
    Event::DwellDone(pb::DwellDone { press, dwell, ..Default::default() })
}

fn confirmed(events: impl IntoIterator<Item = (u64, Event)>) -> Vec<(u64, i32, usize)> {
    let mut confirmed = Confirmed::default();
    for (seq, event) in events {
        confirmed.take(&pb::RunEvent { seq, event: Some(event), ..Default::default() });
    }
    confirmed.presses.iter().map(|press| (press.step, press.press, press.dwells.len())).collect()
}

/// Two presses of two dwells, with a tare before them.
fn two() -> Vec<(u64, Event)> {
    let tare = [started(0), done(0)];
    let first = [started(1), dwell(0, 0), dwell(0, 1), done(1)];
    let second = [started(2), dwell(1, 0), dwell(1, 1), done(2)];
    (0..).zip([&tare[..], &first, &second].concat()).collect()
}

#[test]
fn a_press_is_confirmed_when_its_step_is_done() {
    assert_eq!(confirmed(two()), [(1, 0, 2), (2, 1, 2)]);
    let mut cut = two();
    cut.pop();
    assert_eq!(confirmed(cut), [(1, 0, 2)]);
}

#[test]
fn of_a_repeated_press_the_last_time_counts() {
    let repeated = Event::PressRepeated(pb::PressRepeated { press: 0, ..Default::default() });
    let events = [started(0), dwell(0, 0), repeated, dwell(1, 0), dwell(1, 1), done(0)];
    assert_eq!(confirmed((0..).zip(events)), [(0, 1, 2)]);
}

#[test]
fn a_press_whose_events_are_not_all_there_is_none() {
    for lost in 3..5 {
        let mut events = two();
        events.remove(lost);
        assert_eq!(confirmed(events), [(2, 1, 2)], "without event {lost}");
    }
    let mut events = two();
    events.remove(5);
    assert_eq!(
        confirmed(events),
        [(2, 1, 2)],
        "without the end of the first press, which may have been repeated"
    );
}
