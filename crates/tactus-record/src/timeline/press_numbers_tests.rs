use super::*;

fn in_phase(run: &str, press: i32) -> pb::RunEvent {
    let changed = pb::PhaseChanged { press, ..pb::PhaseChanged::default() };
    pb::RunEvent { run_id: run.into(), event: Some(Event::PhaseChanged(changed)), ..pb::RunEvent::default() }
}

fn repeated(run: &str, press: i32) -> pb::RunEvent {
    let repeated = pb::PressRepeated { press, ..pb::PressRepeated::default() };
    pb::RunEvent { event: Some(Event::PressRepeated(repeated)), ..in_phase(run, press) }
}

#[test]
fn presses_of_later_runs_go_on_after_those_before() {
    let mut numbers = PressNumbers::default();
    let mut events = [
        in_phase("one", 0),
        in_phase("one", -1),
        in_phase("one", 2),
        in_phase("two", -1),
        in_phase("two", 0),
        repeated("two", 0),
        in_phase("one", 1),
        in_phase("two", 1),
        in_phase("three", 4),
    ];
    let told = events.each_mut().map(|event| {
        numbers.renumber(event);
        press_of(&mut event.event).map(|press| *press)
    });
    let want = [Some(0), None, Some(2), None, Some(3), Some(3), Some(1), Some(4), Some(9)];
    assert_eq!(told, want);
}
