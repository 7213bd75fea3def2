//! A run from start to end, and everything that can end it, in virtual time.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot go on fails; a measurement is printed"
)]

mod continued;
mod rig;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use pb::ExitStatus;
use pb::Phase::{Approach, Hold, Idle, Load, Retract, Unload};
use pb::run_event::Event;
use rig::{Bench, Memory};
use tactus_engine::{CoveringMemory, Fault, ResumeError, RunOrder, StopOrder};
use tactus_schema::pb::{self, RunPhase, StageStatus};
use tokio::time::{Instant, sleep, timeout};

const PRESS: &str = "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.2, 0.4])\n";
const PRESSES: &str =
    "def run(rig):\n    for i in range(3):\n        press(5.0, 5.0, depths_mm = [0.2, 0.4])\n";
const HOLD: &str = "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 60.0)\n";

fn order(abort: bool) -> StopOrder {
    StopOrder { by: "test".into(), reason: "enough".into(), abort }
}

/// Starts a run beside the test.
fn start(bench: &Bench, source: &str, memory: &Memory) -> tokio::task::JoinHandle<tactus_engine::RunOutcome> {
    let (engine, order, sink) = (bench.engine.clone(), bench.order(source), memory.sink());
    tokio::spawn(async move { engine.run(order, sink).await.unwrap() })
}

/// Waits until the tip is that deep.
async fn until_deep(bench: &mut Bench, depth_mm: f64) {
    bench.stage.wait_for(|stage| -stage.z_mm >= depth_mm - 1e-6).await.unwrap();
}

async fn until_phase(bench: &Bench, phase: RunPhase) {
    bench.engine.state().wait_for(|state| state.phase() == phase).await.unwrap();
}

/// How long the stage goes without a stop, and how long the tip then needs to the safe height.
async fn until_stopped_and_up(bench: &mut Bench) -> [Duration; 2] {
    let begin = Instant::now();
    bench.stops.changed().await.unwrap();
    let stopped = begin.elapsed();
    bench.stage.wait_for(|stage| stage.z_mm > 2.0 - 1e-9).await.unwrap();
    [stopped, begin.elapsed()]
}

fn print_greatest(what: &str, times: &[[Duration; 2]]) {
    let [stopped, up] = [0, 1].map(|part| times.iter().map(|time| time[part]).max().unwrap().as_secs_f64());
    println!(
        "{what}: stopped after {:.0} ms, up after {:.0} ms at most of {}",
        stopped * 1e3,
        up * 1e3,
        times.len()
    );
}

fn height_mm(bench: &Bench) -> f64 {
    bench.stage.borrow().z_mm
}

#[tokio::test(start_paused = true)]
async fn a_run_without_a_stage_says_what_its_driver_knows() {
    let bench = Bench::start(|rig| rig);
    bench.lose_stage("$20 is 0: soft limits are off").await;
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Failed);
    assert!(outcome.message.contains("$20 is 0: soft limits are off"), "{outcome:?}");
}

#[tokio::test(start_paused = true)]
async fn a_press_is_approached_loaded_held_unloaded_and_retracted() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let outcome = bench.engine.run(bench.order(PRESS), memory.sink()).await.unwrap();
    assert_eq!(
        (outcome.exit_status, outcome.presses, outcome.dwells),
        (ExitStatus::Done, 1, 2),
        "{outcome:?}"
    );
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    assert!(*memory.finished.lock().unwrap());
    assert_eq!(outcome.frames, memory.frames.lock().unwrap().len() as u64);

    let kinds = memory.kinds();
    let phases: Vec<_> = kinds
        .iter()
        .filter_map(|kind| if let Event::PhaseChanged(c) = kind { Some((c.phase(), c.press)) } else { None })
        .collect();
    let expected = [
        (Idle, -1),
        (Approach, 0),
        (Load, 0),
        (Hold, 0),
        (Load, 0),
        (Hold, 0),
        (Unload, 0),
        (Retract, 0),
        (Idle, -1),
        (Retract, -1),
        (Idle, -1),
    ];
    assert_eq!(phases, expected);
    let means: Vec<_> = kinds
        .iter()
        .filter_map(|kind| if let Event::DwellDone(d) = kind { Some(d.mean_counts[0]) } else { None })
        .collect();
    assert_eq!(means, [300.0, 500.0], "what the sensor reads at 0.2 and 0.4 mm");
    let seqs: Vec<_> = memory.events.lock().unwrap().iter().map(|event| event.seq).collect();
    assert_eq!(seqs, (0..seqs.len() as u64).collect::<Vec<_>>());
}

#[tokio::test(start_paused = true)]
async fn who_is_told_that_a_run_is_finished_can_begin_the_next() {
    let bench = Bench::start(|rig| rig);
    let engine = bench.engine.clone();
    let next = tokio::spawn(async move {
        engine.state().wait_for(|state| state.phase() == RunPhase::Finished).await.unwrap();
        engine.claim()
    });
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    let next = next.await.unwrap();
    assert!(next.is_ok(), "{next:?}");
}

#[tokio::test(start_paused = true)]
async fn a_step_outside_the_envelope_ends_the_run_with_its_line_and_is_not_begun() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let script = "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.2])\n    press(5.0, 5.0, depths_mm = [0.3, 0.8])\n";
    let outcome = bench.engine.run(bench.order(script), memory.sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused);
    assert!(
        outcome.message.contains("test.star:3") && outcome.message.contains("too deep"),
        "{}",
        outcome.message
    );
    assert!(*bench.deepest_mm.lock().unwrap() < 0.2 + 1e-9);
    assert_eq!(memory.safety.lock().unwrap()[0].verdict(), pb::SafetyVerdict::Refused);
}

#[tokio::test(start_paused = true)]
async fn stop_in_a_hold_retracts_at_once_and_keeps_the_recording() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    assert!(bench.engine.stop(order(false)));
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Stopped);
    assert!(outcome.duration_s < 10.0, "the hold of 60 s was not waited for: {outcome:?}");
    assert!(outcome.message.contains("stopped by test: enough"), "{}", outcome.message);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    assert!(*memory.finished.lock().unwrap());
}

#[tokio::test(start_paused = true)]
async fn stop_works_while_preparing_moving_paused_and_retracting() {
    // Preparing: the run waits for frames.
    let bench = Bench::start(|rig| rig);
    bench.trouble.lock().unwrap().silent = true;
    let run = start(&bench, PRESS, &Memory::default());
    until_phase(&bench, RunPhase::Preparing).await;
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);

    // Moving down.
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    bench.stage.wait_for(|stage| stage.z_mm < 0.25 && stage.status() == StageStatus::Moving).await.unwrap();
    bench.engine.stop(order(true));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Aborted);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);

    // Paused.
    let bench = Bench::start(|rig| rig);
    let run = start(&bench, PRESSES, &Memory::default());
    until_phase(&bench, RunPhase::Running).await;
    assert!(bench.engine.pause("test"));
    until_phase(&bench, RunPhase::Paused).await;
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);

    // Retracting already: a second stop does not keep the tip down.
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.engine.stop(order(false));
    until_phase(&bench, RunPhase::Stopping).await;
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);

    // Idle: nothing to stop, and nothing wrong with asking.
    assert!(!bench.engine.stop(order(false)));
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "an old stop does not end a new run");
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_meets_a_question_to_the_stage_is_the_reason() {
    for looks in 0..6 {
        let bench = Bench::start(|rig| rig);
        bench.trouble.lock().unwrap().looks_before_stop = Some(looks);
        let run = start(&bench, PRESS, &Memory::default());
        while bench.trouble.lock().unwrap().looks_before_stop.is_some() {
            sleep(Duration::from_millis(1)).await;
        }
        assert!(bench.engine.stop(order(false)));
        let outcome = run.await.unwrap();
        assert_eq!(outcome.exit_status, ExitStatus::Stopped, "question {looks}: {}", outcome.message);
        assert!(outcome.message.contains("stopped by test: enough"), "{}", outcome.message);
    }
}

#[tokio::test(start_paused = true)]
async fn a_pause_comes_between_steps_with_the_tip_up_and_resuming_does_every_press_once() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    assert!(!bench.engine.pause("test"), "nothing runs yet");
    let run = start(&bench, PRESSES, &memory);
    until_deep(&mut bench, 0.2).await;
    assert!(bench.engine.pause("who pauses"));
    assert_eq!(bench.engine.run_state().message, "pauses before its next step");
    until_phase(&bench, RunPhase::Paused).await;
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    bench.engine.resume("who resumes", None).unwrap();
    assert_eq!(bench.engine.resume("test", None), Err(ResumeError::NotPaused), "it goes on already");
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses, outcome.dwells), (ExitStatus::Done, 3, 6));
    let by = memory.kinds().into_iter().filter_map(|kind| {
        if let Event::Paused(pb::Paused { by }) | Event::Resumed(pb::Resumed { by }) = kind {
            Some(by)
        } else {
            None
        }
    });
    assert_eq!(by.collect::<Vec<_>>(), ["who pauses", "who resumes"]);
}

#[tokio::test(start_paused = true)]
async fn one_run_at_a_time() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    let busy = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap_err();
    assert_eq!(busy.run_id, "run");
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped, "the refused run did not disturb it");
}

#[tokio::test(start_paused = true)]
async fn a_press_in_which_frames_were_lost_is_repeated_under_a_new_index() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    sleep(Duration::from_secs(1)).await;
    bench.trouble.lock().unwrap().lose = 2;
    let outcome = run.await.unwrap();
    assert_eq!(
        (outcome.exit_status, outcome.presses, outcome.dwells, outcome.frames_lost),
        (ExitStatus::Degraded, 1, 1, 2)
    );
    let kinds = memory.kinds();
    assert!(kinds.iter().any(|kind| matches!(kind, Event::Gap(gap) if gap.frames_lost == 2)));
    assert!(kinds.iter().any(|kind| matches!(kind, Event::PressRepeated(repeated) if repeated.press == 0)));
    assert!(kinds.iter().any(|kind| matches!(kind, Event::DwellDone(dwell) if dwell.press == 1)));
}

#[tokio::test(start_paused = true)]
async fn a_press_that_is_repeated_in_vain_fails_the_run_and_says_how_often() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    for _ in 0..4 {
        until_deep(&mut bench, 0.3).await;
        sleep(Duration::from_secs(1)).await;
        bench.trouble.lock().unwrap().lose = 2;
        bench.stage.wait_for(|stage| stage.z_mm > 1.9).await.unwrap();
    }
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Failed);
    let says = "the press was repeated 3 times, and something was lost each time; the last time: 2 frames";
    assert!(outcome.message.contains(says), "{}", outcome.message);
    let repeated = memory.kinds().into_iter().filter(|kind| matches!(kind, Event::PressRepeated(_)));
    assert_eq!(repeated.count(), 3);
}

#[tokio::test(start_paused = true)]
async fn a_sensor_that_falls_silent_in_contact_gets_the_tip_up_and_the_press_is_repeated() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().silent = true;
    bench.stage.wait_for(|stage| stage.z_mm > 1.9).await.unwrap();
    let silent_frames = bench.trouble.lock().unwrap().lose;
    // Three periods, and the way up.
    assert!((3..10).contains(&silent_frames), "{silent_frames}");
    bench.trouble.lock().unwrap().silent = false;
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Degraded, 1), "{outcome:?}");
    assert_eq!(memory.safety.lock().unwrap()[0].rule, "silence");
}

#[tokio::test(start_paused = true)]
async fn a_sensor_that_does_not_come_back_fails_the_run() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().silent = true;
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Failed);
    assert!(outcome.message.contains("no frame from the sensor for 10.0 s"), "{}", outcome.message);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn where_the_policy_says_fail_lost_frames_fail_the_run() {
    let mut bench = Bench::start(|rig| rig.replace("on_gap = \"repeat\"", "on_gap = \"fail\""));
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().lose = 1;
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.frames_lost), (ExitStatus::Failed, 1), "{outcome:?}");
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn frames_that_are_lost_again_and_again_stop_the_rising_tip_once() {
    let mut bench = Bench::start(|rig| rig.replace("on_gap = \"repeat\"", "on_gap = \"fail\""));
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    let before = *bench.stops.borrow();
    while height_mm(&bench) < 2.0 - 1e-9 {
        bench.trouble.lock().unwrap().lose = 1;
        sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(*bench.stops.borrow() - before, 1);
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Failed);
}

#[tokio::test(start_paused = true)]
async fn too_much_force_stops_retracts_and_refuses() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().push_counts = 2500.0;
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
    assert_eq!(memory.safety.lock().unwrap()[0].rule, "element-force");
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

/// Milliseconds into a sample period at which something begins.
const PHASES_MS: [u64; 11] = [0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30];

#[tokio::test(start_paused = true)]
async fn too_much_force_stops_within_one_frame() {
    let mut times = Vec::new();
    for phase_ms in PHASES_MS {
        let mut bench = Bench::start(|rig| rig);
        let run = start(&bench, HOLD, &Memory::default());
        until_deep(&mut bench, 0.3).await;
        sleep(Duration::from_millis(1000 + phase_ms)).await;
        bench.stops.mark_unchanged();
        bench.trouble.lock().unwrap().push_counts = 2500.0;
        times.push(until_stopped_and_up(&mut bench).await);
        assert_eq!(run.await.unwrap().exit_status, ExitStatus::Refused);
    }
    print_greatest("too much force", &times);
    // A sample period, at 30 Hz.
    assert!(times.iter().all(|[stopped, _]| *stopped <= Duration::from_millis(34)), "{times:?}");
}

#[tokio::test(start_paused = true)]
async fn three_periods_without_a_frame_stop() {
    let mut times = Vec::new();
    for phase_ms in PHASES_MS {
        let mut bench = Bench::start(|rig| rig);
        let run = start(&bench, HOLD, &Memory::default());
        until_deep(&mut bench, 0.3).await;
        sleep(Duration::from_millis(1000 + phase_ms)).await;
        bench.stops.mark_unchanged();
        bench.trouble.lock().unwrap().silent = true;
        times.push(until_stopped_and_up(&mut bench).await);
        bench.trouble.lock().unwrap().silent = false;
        assert_eq!(run.await.unwrap().exit_status, ExitStatus::Degraded);
    }
    print_greatest("no frame", &times);
    // Three periods, and one until the supervisor looks at its clock.
    assert!(times.iter().all(|[stopped, _]| *stopped <= Duration::from_millis(134)), "{times:?}");
}

#[tokio::test(start_paused = true)]
async fn an_array_that_goes_on_reading_the_same_stops_the_tip() {
    let deeper = "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.2, 0.6], dwell_s = 1.0)\n";
    // At the first depth, and from the beginning.
    for (stuck_at_mm, rule) in [(0.2, "frozen"), (0.0, "no-response")] {
        let mut bench = Bench::start(|rig| rig);
        let memory = Memory::default();
        let run = start(&bench, deeper, &memory);
        until_deep(&mut bench, stuck_at_mm).await;
        bench.trouble.lock().unwrap().stuck_depth_mm = Some(stuck_at_mm);
        let outcome = run.await.unwrap();
        assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
        assert_eq!(memory.safety.lock().unwrap()[0].rule, rule);
        let deepest_mm = *bench.deepest_mm.lock().unwrap();
        println!("{rule}: {deepest_mm:.3} mm deep, and read like {stuck_at_mm} mm");
        // Way that it may not show, three frames at 1 mm/s, and the step under way; the depth that was asked for.
        let limit_mm = if rule == "frozen" { stuck_at_mm + 0.15 + 0.1 + 0.1 } else { 0.6 };
        assert!(deepest_mm < limit_mm + 1e-9, "{deepest_mm}");
        assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    }
}

#[tokio::test(start_paused = true)]
async fn a_recording_that_fails_fails_the_run_loudly_with_the_tip_up() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory { fails_after: Some(60), ..Memory::default() };
    let outcome = bench.engine.run(bench.order(HOLD), memory.sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Failed);
    assert!(outcome.message.contains("no space left"), "{}", outcome.message);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn near_the_covering_no_step_down_exceeds_a_tenth_of_a_millimetre() {
    let bench = Bench::start(|rig| rig);
    let mut stage = bench.stage.clone();
    let watching = tokio::spawn(async move {
        let (mut from_mm, mut longest_mm) = (stage.borrow().z_mm, 0.0_f64);
        while stage.changed().await.is_ok() {
            let z_mm = stage.borrow_and_update().z_mm;
            if from_mm < 0.3 + 1e-9 {
                longest_mm = longest_mm.max(from_mm - z_mm);
            }
            from_mm = z_mm;
        }
        longest_mm
    });
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done);
    drop(bench);
    let longest_mm = watching.await.unwrap();
    assert!(longest_mm > 0.09 && longest_mm < 0.1 + 1e-9, "{longest_mm}");
}

#[tokio::test(start_paused = true)]
async fn a_change_of_covering_is_asked_for_waited_for_and_moves_the_depth_limit() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let script = "def run(rig):\n    covering(2.54)\n    press(5.0, 5.0, depths_mm = [0.75])\n";
    let run = start(&bench, script, &memory);
    until_phase(&bench, RunPhase::Paused).await;
    assert!(bench.engine.state().borrow().message.contains("2.54 mm covering"));
    let unconfirmed = bench.engine.resume("test", None).unwrap_err();
    assert_eq!(unconfirmed, ResumeError::CoveringNotConfirmed { wanted_mm: 2.54 });
    bench.engine.resume("test", Some(1.016)).unwrap_err();
    bench.engine.resume("test", Some(2.54)).unwrap();
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    assert!(memory.kinds().iter().any(|kind| matches!(kind, Event::CoveringChanged(_))));
}

#[tokio::test(start_paused = true)]
async fn a_script_decides_from_what_it_read() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let script = "def run(rig):\n    tare()\n    for i in range(1, 7):\n        reading = press(5.0, 5.0, depths_mm = [0.1 * i])[0]\n        if reading.signal[0] > 250:\n            log(\"answers at %d\" % i)\n            return\n";
    let outcome = bench.engine.run(bench.order(script), memory.sink()).await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 3), "{outcome:?}");
    assert!(
        memory.kinds().iter().any(|kind| matches!(kind, Event::Log(log) if log.message == "answers at 3"))
    );
}

#[tokio::test(start_paused = true)]
async fn a_stop_while_a_silent_press_is_retracted_is_not_forgiven_with_the_silence() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().silent = true;
    // On its way up, before the sensor is back.
    bench.stage.wait_for(|stage| stage.z_mm > 1.9).await.unwrap();
    bench.engine.stop(order(false));
    bench.trouble.lock().unwrap().silent = false;
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Stopped, 0), "{outcome:?}");
}

#[tokio::test(start_paused = true)]
async fn however_often_stop_is_pressed_the_tip_ends_up() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    for _ in 0..10 {
        bench.engine.stop(order(false));
        sleep(Duration::from_millis(5)).await;
    }
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn while_stop_is_pressed_without_end_the_tip_rises() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    let mut stops = 0;
    while height_mm(&bench) < 2.0 - 1e-9 {
        bench.engine.stop(order(false));
        stops += 1;
        assert!(stops < 400, "the tip is at {} mm after two seconds", height_mm(&bench));
        sleep(Duration::from_millis(5)).await;
    }
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
}

#[tokio::test(start_paused = true)]
async fn a_stop_just_after_one_of_the_supervisor_reaches_the_stage() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.stops.mark_unchanged();
    bench.trouble.lock().unwrap().silent = true;
    bench.stops.changed().await.unwrap();
    let is_rising = |stage: &pb::StageState| stage.status() == StageStatus::Moving;
    bench.stage.wait_for(is_rising).await.unwrap();
    bench.stops.mark_unchanged();
    bench.engine.stop(order(false));
    assert!(bench.stops.has_changed().unwrap(), "the stop has no effect");
    bench.trouble.lock().unwrap().silent = false;
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
}

#[tokio::test(start_paused = true)]
async fn a_stop_before_the_run_has_begun_ends_it_before_anything_moves() {
    let bench = Bench::start(|rig| rig);
    let claim = bench.engine.claim().unwrap();
    assert!(bench.engine.stop(order(false)));
    assert!(claim.check().unwrap_err().reason.contains("stopped by test"));
    let outcome = claim.run(bench.order(PRESS), Memory::default().sink()).await;
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Stopped, 0), "{outcome:?}");
    assert!(*bench.deepest_mm.lock().unwrap() < 0.0, "the tip was never pressed in");
}

#[tokio::test(start_paused = true)]
async fn the_covering_in_place_stays_from_run_to_run() {
    let bench = Bench::start(|rig| rig);
    let thinner = "def run(rig):\n    covering(0.5)\n";
    let run = start(&bench, thinner, &Memory::default());
    until_phase(&bench, RunPhase::Paused).await;
    bench.engine.resume("test", Some(0.5)).unwrap();
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Done);
    assert!((bench.engine.rig().covering.thickness_mm - 0.5).abs() < 1e-12);
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "0.4 mm is too deep under 0.5 mm: {outcome:?}");
}

#[tokio::test(start_paused = true)]
async fn a_thinner_covering_is_the_limit_from_when_it_is_asked_for_although_nobody_confirms_it() {
    let note = Arc::new(Note::default());
    let bench = Bench::with_covering_memory(|rig| rig, Some(note.clone()));
    let thinner = "def run(rig):\n    covering(0.5)\n";
    let run = start(&bench, thinner, &Memory::default());
    until_phase(&bench, RunPhase::Paused).await;
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    assert_eq!(note.recall().unwrap(), Some(0.5), "after a restart, too");
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "0.4 mm is too deep under 0.5 mm: {outcome:?}");

    let run = start(&bench, thinner, &Memory::default());
    until_phase(&bench, RunPhase::Paused).await;
    bench.engine.resume("test", Some(0.5)).unwrap();
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Done, "it is asked for again");
}

#[tokio::test(start_paused = true)]
async fn a_new_engine_wants_a_reset_and_a_reset_wants_frames() {
    let bench = Bench::start(|rig| rig);
    assert_eq!(bench.engine.fault(), Some(Fault::Started));
    assert!(bench.engine.run_state().fault.contains("since the service started"));

    bench.trouble.lock().unwrap().silent = true;
    let silent = bench.engine.reset().await.unwrap_err();
    assert!(silent.to_string().contains("no frame from the sensor"), "{silent}");
    assert_eq!(bench.engine.fault(), Some(Fault::Unfinished));

    bench.trouble.lock().unwrap().silent = false;
    bench.engine.reset().await.unwrap();
    assert_eq!(bench.engine.fault(), None);
    assert_eq!(bench.engine.run_state().fault, "");
    assert_eq!(bench.stage.borrow().status(), StageStatus::Idle);

    bench.trouble.lock().unwrap().silent = true;
    bench.engine.reset().await.unwrap_err();
    assert_eq!(bench.engine.fault(), Some(Fault::Unfinished), "one that fails undoes the one before it");
}

#[tokio::test(start_paused = true)]
async fn a_run_before_the_reset_moves_nothing_unless_its_order_stands_for_one() {
    let bench = Bench::start(|rig| rig);
    let before = *bench.stage.borrow();
    let memory = Memory::default();
    let order = RunOrder { resets: false, ..bench.order(PRESS) };
    let outcome = bench.engine.run(order, memory.sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
    assert_eq!(*bench.stage.borrow(), before);
    assert_eq!(memory.safety.lock().unwrap()[0].rule, "reset");
    assert!(*memory.finished.lock().unwrap());

    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    assert_eq!(bench.engine.fault(), None);
}

#[tokio::test(start_paused = true)]
async fn a_panic_of_the_sensors_driver_stops_retracts_and_is_a_fault() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().panics = true;
    let outcome = run.await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Failed, "{outcome:?}");
    assert!(outcome.message.contains("defect"), "{}", outcome.message);
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    assert!(matches!(bench.engine.fault(), Some(Fault::Defect(_))), "{:?}", bench.engine.fault());
    assert!(*memory.finished.lock().unwrap());
    assert!(bench.engine.is_acquiring(), "the supervision goes on");
}

#[tokio::test(start_paused = true)]
async fn a_panic_of_the_run_leaves_the_tip_up_and_the_recording_closed() {
    let bench = Bench::start(|rig| rig);
    bench.trouble.lock().unwrap().look_panics = true;
    let memory = Memory::default();
    let outcome = bench.engine.run(bench.order(PRESS), memory.sink()).await.unwrap();
    assert!(*bench.deepest_mm.lock().unwrap() > 0.19, "it panicked in contact");
    assert_eq!(outcome.exit_status, ExitStatus::Failed, "{outcome:?}");
    assert!((height_mm(&bench) - 2.0).abs() < 1e-9);
    assert!(*memory.finished.lock().unwrap());
    assert!(matches!(memory.kinds().last(), Some(Event::Finished(_))));
    assert!(matches!(bench.engine.fault(), Some(Fault::Defect(_))), "{:?}", bench.engine.fault());
    bench.engine.reset().await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_retract_that_fails_is_tried_again_and_then_told_until_a_reset() {
    for (refused_rises, is_up) in [(5, true), (6, false)] {
        let mut bench = Bench::start(|rig| rig);
        let memory = Memory::default();
        let run = start(&bench, HOLD, &memory);
        until_deep(&mut bench, 0.3).await;
        bench.trouble.lock().unwrap().refused_rises = refused_rises;
        bench.engine.stop(order(false));
        let outcome = run.await.unwrap();
        assert_eq!((height_mm(&bench) - 2.0).abs() < 1e-9, is_up, "{outcome:?}");
        assert_eq!(outcome.message.contains("THE TIP IS NOT RETRACTED"), !is_up, "{outcome:?}");
        if is_up {
            assert_eq!((outcome.exit_status, bench.engine.fault()), (ExitStatus::Stopped, None));
            continue;
        }
        assert_eq!(outcome.exit_status, ExitStatus::Failed);
        assert_eq!(memory.safety.lock().unwrap()[0].rule, "retract");
        let order = RunOrder { resets: false, ..bench.order(PRESS) };
        let refused = bench.engine.run(order, Memory::default().sink()).await.unwrap();
        assert_eq!(refused.exit_status, ExitStatus::Refused);
        assert!(refused.message.contains("THE TIP IS NOT RETRACTED"), "{}", refused.message);
        bench.engine.reset().await.unwrap();
        assert_eq!(bench.engine.fault(), None);
    }
}

#[tokio::test(start_paused = true)]
async fn a_broken_rule_is_a_fault_until_a_reset() {
    let mut bench = Bench::start(|rig| rig);
    let run = start(&bench, HOLD, &Memory::default());
    until_deep(&mut bench, 0.3).await;
    bench.trouble.lock().unwrap().push_counts = 2500.0;
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Refused);
    bench.trouble.lock().unwrap().push_counts = 0.0;
    let order = RunOrder { resets: false, ..bench.order(PRESS) };
    let refused = bench.engine.run(order, Memory::default().sink()).await.unwrap();
    assert_eq!(refused.exit_status, ExitStatus::Refused);
    assert!(refused.message.contains("a safety rule was broken"), "{}", refused.message);
    bench.engine.reset().await.unwrap();
    let order = RunOrder { resets: false, ..bench.order(PRESS) };
    let done = bench.engine.run(order, Memory::default().sink()).await.unwrap();
    assert_eq!(done.exit_status, ExitStatus::Done, "{done:?}");
}

#[tokio::test(start_paused = true)]
async fn zeros_far_from_the_baseline_refuse_the_run_and_cannot_ratchet() {
    let bench = Bench::start(|rig| rig);
    bench.trouble.lock().unwrap().push_counts = 501.0;
    let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
    assert!(outcome.message.contains("baseline_band_counts"), "{}", outcome.message);
    assert!(*bench.deepest_mm.lock().unwrap() < 0.0);
}

#[tokio::test(start_paused = true)]
async fn a_move_of_which_no_report_came_goes_on_a_few_times_and_then_fails() {
    for (unanswered, status) in [(4, ExitStatus::Done), (5, ExitStatus::Failed)] {
        let bench = Bench::start(|rig| rig);
        bench.trouble.lock().unwrap().unanswered = unanswered;
        let outcome = bench.engine.run(bench.order(PRESS), Memory::default().sink()).await.unwrap();
        assert_eq!(outcome.exit_status, status, "{outcome:?}");
        assert_eq!(outcome.dwells, if status == ExitStatus::Done { 2 } else { 0 });
        assert!(*bench.deepest_mm.lock().unwrap() < 0.4 + 1e-9);
    }
}

#[tokio::test(start_paused = true)]
async fn a_dwell_in_which_the_stage_lost_its_place_is_not_told_as_done() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, HOLD, &memory);
    until_deep(&mut bench, 0.3).await;
    sleep(Duration::from_secs(1)).await;
    bench.trouble.lock().unwrap().epoch += 1;
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.dwells), (ExitStatus::Failed, 0), "{outcome:?}");
    assert!(outcome.message.contains("did not stand still"), "{}", outcome.message);
    assert!(!memory.kinds().iter().any(|kind| matches!(kind, Event::DwellDone(_))));
}

#[tokio::test(start_paused = true)]
async fn an_alarm_in_a_long_dwell_ends_it_at_once_and_is_named() {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, &HOLD.replace("60.0", "600.0"), &memory);
    until_deep(&mut bench, 0.3).await;
    sleep(Duration::from_secs(10)).await;
    bench.trouble.lock().unwrap().alarm = Some(1);
    let outcome = timeout(Duration::from_secs(2), run).await.unwrap().unwrap();
    assert_eq!((outcome.exit_status, outcome.dwells), (ExitStatus::Failed, 0), "{outcome:?}");
    assert!(outcome.message.contains("alarm 1: hard limit"), "{}", outcome.message);
}

#[tokio::test(start_paused = true)]
async fn a_step_in_which_the_stage_lost_its_place_is_not_told_as_done() {
    for step in ["dwell(60)", "read(60)", "tare(60)"] {
        let mut bench = Bench::start(|rig| rig);
        let memory = Memory::default();
        let script = format!("def run(rig):\n    move(5.0, 5.0, height_mm = 1.0)\n    {step}\n");
        let run = start(&bench, &script, &memory);
        bench.stage.wait_for(|stage| (stage.z_mm - 1.0).abs() < 1e-9).await.unwrap();
        sleep(Duration::from_secs(30)).await;
        bench.trouble.lock().unwrap().epoch += 1;
        let outcome = run.await.unwrap();
        assert_eq!(outcome.exit_status, ExitStatus::Failed, "{step}: {outcome:?}");
        assert!(outcome.message.contains("did not stand still"), "{step}: {}", outcome.message);
        let done = |kind: &Event| matches!(kind, Event::ReadDone(_) | Event::TareDone(_));
        assert!(!memory.kinds().iter().any(done), "{step}");
    }
}

/// Remembers in memory.
#[derive(Default)]
struct Note(Mutex<Option<f64>>);

impl CoveringMemory for Note {
    fn recall(&self) -> std::io::Result<Option<f64>> {
        Ok(*self.0.lock().unwrap())
    }

    fn remember(&self, thickness_mm: f64) -> std::io::Result<()> {
        *self.0.lock().unwrap() = Some(thickness_mm);
        Ok(())
    }
}

#[tokio::test(start_paused = true)]
async fn a_confirmed_covering_outlives_the_engine_and_the_thinner_one_counts() {
    let note = Arc::new(Note::default());
    let bench = || Bench::with_covering_memory(|rig| rig, Some(note.clone()));
    for (thickness_mm, after_restart_mm) in [(0.5, 0.5), (2.54, 1.016)] {
        let first = bench();
        let script = format!("def run(rig):\n    covering({thickness_mm})\n");
        let run = start(&first, &script, &Memory::default());
        until_phase(&first, RunPhase::Paused).await;
        first.engine.resume("test", Some(thickness_mm)).unwrap();
        assert_eq!(run.await.unwrap().exit_status, ExitStatus::Done);
        drop(first);
        assert_eq!(note.recall().unwrap(), Some(thickness_mm));
        let restarted_mm = bench().engine.rig().covering.thickness_mm;
        assert!((restarted_mm - after_restart_mm).abs() < 1e-12, "{restarted_mm}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_reset_raises_a_tip_that_breaks_a_rule_where_it_stands() {
    let bench = Bench::start(|rig| rig);
    bench.engine.reset().await.unwrap();
    bench.place([25.0, 20.0, -0.9]).await;
    assert_eq!(bench.engine.reset().await.map_err(|error| error.to_string()), Ok(()));
    assert_eq!(bench.engine.fault(), None);
    assert!(height_mm(&bench) > 1.9);
}

#[tokio::test(start_paused = true)]
async fn a_reset_finishes_once_an_absent_stage_is_back_and_was_homed() {
    let bench = Bench::start(|rig| rig);
    bench.engine.reset().await.unwrap();
    bench.lose_stage("it was unplugged").await;
    let back = async {
        sleep(Duration::from_millis(300)).await;
        bench.trouble.lock().unwrap().absent = None;
        bench.place([25.0, 20.0, 5.0]).await;
    };
    let (reset, ()) = tokio::join!(bench.engine.reset(), back);
    assert_eq!(reset.map_err(|error| error.to_string()), Ok(()));
    assert_eq!(bench.engine.fault(), None);
    bench.lose_stage("it was unplugged").await;
    bench.trouble.lock().unwrap().absent = None;
    bench.place([25.0, 20.0, 5.0]).await;
    sleep(Duration::from_secs(1)).await;
    assert_eq!(bench.engine.fault(), Some(Fault::Away), "its place is good for the way up alone");
}
