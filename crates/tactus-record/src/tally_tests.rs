use std::sync::Arc;

use tactus_schema::{
    Frame, FrameFlags, MonoTime, TimeStamp, WallTime,
    pb::{self, run_event::Event},
};

use super::Tally;

fn frame(seq: u64, lost_before: u32) -> Frame {
    Frame {
        seq,
        epoch: 0,
        device_tick: None,
        received: TimeStamp {
            mono: MonoTime::from_ns(seq.cast_signed() * 1_000_000_000),
            wall: WallTime::default(),
        },
        counts: Arc::from([]),
        flags: FrameFlags::default(),
        lost_before,
        simulated: true,
        bad_elements: [].into(),
        temperature_c: None,
    }
}

fn dwell(press: i32, dwell: u32) -> pb::RunEvent {
    let event = Event::DwellDone(pb::DwellDone { press, dwell, ..pb::DwellDone::default() });
    pb::RunEvent { event: Some(event), ..pb::RunEvent::default() }
}

#[test]
fn received_and_lost_add_up_to_what_the_sensor_took() {
    let mut tally = Tally::default();
    let lost: Vec<u64> = [(10, 3), (11, 0), (14, 2), (15, 0), (21, 0), (22, 0)]
        .map(|(seq, lost_before)| tally.frame(&frame(seq, lost_before)))
        .into();
    // Losses before the first frame do not count; 16 to 20 are missing although no frame reports them.
    assert_eq!(lost, [0, 0, 2, 0, 5, 0]);
    assert_eq!((tally.frames(), tally.frames_lost(), tally.gaps()), (6, 7, 2));
    assert_eq!(tally.frames() + tally.frames_lost(), 22 - 10 + 1);
    assert_eq!(tally.frames_missing(), 5, "those that no frame reports");
}

#[test]
fn a_repeated_frame_is_no_loss() {
    let mut tally = Tally::default();
    for seq in [5, 5, 4, 5] {
        tally.frame(&frame(seq, 0));
    }
    assert_eq!((tally.frames(), tally.frames_lost(), tally.gaps()), (4, 0, 0));
}

#[test]
fn presses_of_two_runs_are_two_although_their_numbers_are_one() {
    let mut tally = Tally::default();
    for run in ["one", "two", "one"] {
        tally.event(&pb::RunEvent { run_id: run.into(), ..dwell(0, 0) });
    }
    assert_eq!((tally.presses(), tally.dwells()), (2, 2));
}

#[test]
fn a_repeated_press_counts_its_dwells_once() {
    let mut tally = Tally::default();
    for (press, nth) in [(0, 0), (0, 1), (1, 0), (1, 0), (1, 1), (-1, 0), (-1, 0)] {
        tally.event(&dwell(press, nth));
    }
    assert_eq!((tally.presses(), tally.dwells()), (2, 6));
}

#[test]
fn duration_spans_all_messages_whatever_their_order() {
    let mut tally = Tally::default();
    for seconds in [7, 3, 12, 5] {
        tally.time(MonoTime::from_ns(seconds * 1_000_000_000));
    }
    assert_eq!(tally.duration().as_secs(), 9);
}

#[test]
fn a_run_that_never_said_how_it_ended_is_open() {
    let mut tally = Tally::default();
    tally.event(&dwell(0, 0));
    assert_eq!(tally.exit_status(), None);
    let finished =
        pb::RunFinished { exit_status: pb::ExitStatus::Stopped.into(), ..pb::RunFinished::default() };
    tally.event(&pb::RunEvent { event: Some(Event::Finished(finished)), ..pb::RunEvent::default() });
    assert_eq!(tally.exit_status(), Some(pb::ExitStatus::Stopped));
}
