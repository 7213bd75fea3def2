//! A run that goes on with an earlier one.

#![expect(clippy::wildcard_enum_match_arm, reason = "most events do not matter here")]
#![expect(clippy::float_cmp, reason = "the counts are whole numbers")]

use std::sync::Arc;

use tactus_engine::{DoneStep, EarlierRun, RunOrder, RunOutcome};
use tactus_plan::{MeanReading, Reply, Step};
use tactus_schema::pb::{self, ExitStatus, RunPhase, run_event::Event};

use crate::rig::{Bench, Memory};
use crate::{order, start, until_deep, until_phase};

/// Four presses, each at its own place and depth.
const PRESSES: &str = "def run(rig):\n    tare()\n    for i in range(4):\n        press(3.0 + 2.0 * i, 5.0, depths_mm = [0.1 * (i + 1)], dwell_s = 2.0)\n    log(\"over\")\n";

/// Goes on with the deepest press that answered with less than 250 counts.
const ADAPTIVE: &str = "def run(rig):\n    tare()\n    depth_mm = 0.0\n    for i in range(1, 6):\n        if press(5.0, 5.0, depths_mm = [0.1 * i])[0].signal[0] > 250:\n            break\n        depth_mm = 0.1 * i\n    press(9.0, 5.0, depths_mm = [depth_mm], dwell_s = 60.0)\n";

/// The steps that a run has done, with what its script was told.
fn earlier(memory: &Memory) -> EarlierRun {
    let mut earlier =
        EarlierRun { run_id: "first".into(), covering_mm: 1.016, steps: Vec::new(), next_press: 0 };
    let mut zero = Vec::new();
    let (mut step, mut readings, mut pressed) = (None, Vec::new(), false);
    let reading = |counts: &[f32], zero: &[f32], frames| MeanReading {
        mean_counts: counts.iter().map(|count| f64::from(*count)).collect(),
        signal: counts.iter().zip(zero).map(|(count, zero)| f64::from(count - zero)).collect(),
        rms: vec![0.0; counts.len()],
        frames,
    };
    for event in memory.kinds() {
        match event {
            Event::StepStarted(started) => {
                let asked: Step = serde_json::from_str(&started.step_json).unwrap();
                (step, readings, pressed) = (Some((asked, started.at)), Vec::new(), false);
            }
            Event::ReferenceDone(done) => zero = done.mean_counts,
            Event::TareDone(done) => {
                zero.clone_from(&done.baseline_counts);
                readings.push(reading(&done.baseline_counts, &zero, done.frames));
            }
            Event::ReadDone(done) => readings.push(reading(&done.mean_counts, &zero, done.frames)),
            Event::DwellDone(done) => {
                pressed = true;
                earlier.next_press = done.press;
                readings.push(reading(&done.mean_counts, &zero, done.frames));
            }
            Event::StepDone(done) => {
                let (step, at) = step.take().unwrap();
                let reply = match (&step, done.height_mm) {
                    (Step::Move { to, .. }, Some(height_mm)) => {
                        Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm }
                    }
                    _ if pressed => Reply::Pressed(std::mem::take(&mut readings)),
                    _ => readings.pop().map_or(Reply::Done, Reply::Reading),
                };
                earlier.steps.push(DoneStep { step, at, reply });
            }
            _ => {}
        }
    }
    let is_press = |step: &&DoneStep| matches!(step.reply, Reply::Pressed(_));
    earlier.next_press = i32::try_from(earlier.steps.iter().filter(is_press).count()).unwrap();
    earlier
}

/// What a run has done until it is stopped in the first press of that depth.
async fn stopped_at(source: &str, depth_mm: f64) -> EarlierRun {
    let mut bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, source, &memory);
    until_deep(&mut bench, depth_mm).await;
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    earlier(&memory)
}

/// An order to go on.
fn rest_of(bench: &Bench, source: &str, earlier: EarlierRun) -> RunOrder {
    RunOrder { run_id: "rest".into(), earlier: Some(Arc::new(earlier)), ..bench.order(source) }
}

async fn go_on(bench: &Bench, source: &str, earlier: EarlierRun, memory: &Memory) -> RunOutcome {
    bench.engine.run(rest_of(bench, source, earlier), memory.sink()).await.unwrap()
}

fn dwells(memory: &Memory) -> Vec<(i32, f64)> {
    let dwell = |event| if let Event::DwellDone(done) = event { Some((done.press, done.x_mm)) } else { None };
    memory.kinds().into_iter().filter_map(dwell).collect()
}

#[tokio::test(start_paused = true)]
async fn done_presses_are_not_done_again_and_the_interrupted_one_is() {
    let earlier = stopped_at(PRESSES, 0.3).await;
    assert_eq!(earlier.steps.len(), 3, "a tare and two presses");
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let outcome = go_on(&bench, PRESSES, earlier, &memory).await;
    assert_eq!(
        (outcome.exit_status, outcome.presses, outcome.dwells),
        (ExitStatus::Done, 2, 2),
        "{outcome:?}"
    );
    assert_eq!(dwells(&memory), [(2, 7.0), (3, 9.0)]);

    let kinds = memory.kinds();
    let Some(Event::Started(started)) = kinds.first() else { panic!("{kinds:?}") };
    let taken = pb::TakenOver { run_id: "first".into(), steps: 3, presses: 2, dwells: 2, first_press: 2 };
    assert_eq!(started.taken_over, Some(taken.clone()));
    assert_eq!(bench.engine.run_state().taken_over, Some(taken));
    let steps: Vec<_> = kinds
        .iter()
        .filter_map(|kind| if let Event::StepStarted(started) = kind { Some(started.step) } else { None })
        .collect();
    assert_eq!(steps, [3, 4, 5], "the steps are counted on");
}

#[tokio::test(start_paused = true)]
async fn the_zero_is_taken_anew_before_anything_is_pressed() {
    let earlier = stopped_at(PRESSES, 0.3).await;
    let bench = Bench::start(|rig| rig);
    // At rest the array reads otherwise than in the earlier run.
    bench.trouble.lock().unwrap().push_counts = 200.0;
    let script =
        PRESSES.replace("log(\"over\")", "log(\"%d\" % press(3.0, 5.0, depths_mm = [0.2])[0].signal[0])");
    let memory = Memory::default();
    let outcome = go_on(&bench, &script, earlier, &memory).await;
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    let kinds = memory.kinds();
    let place = |is_it: fn(&Event) -> bool| kinds.iter().position(is_it).unwrap();
    let tare = place(|kind| matches!(kind, Event::TareDone(done) if done.baseline_counts[0] == 300.0));
    assert!(tare < place(|kind| matches!(kind, Event::StepStarted(_))));
    assert!(kinds.iter().any(|kind| matches!(kind, Event::Log(log) if log.message == "200")), "{kinds:?}");
}

#[tokio::test(start_paused = true)]
async fn a_script_that_decides_from_its_readings_takes_the_same_way() {
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&bench, ADAPTIVE, &memory);
    let mut stage = bench.stage.clone();
    stage.wait_for(|stage| stage.x_mm > 28.5 && stage.z_mm < -0.15).await.unwrap();
    bench.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    let earlier = earlier(&memory);
    assert_eq!(
        earlier.steps.len(),
        4,
        "a tare and three presses, the last of which answered with 300 counts"
    );

    // The interrupted press follows from what the three had answered.
    let bench = Bench::start(|rig| rig);
    let memory = Memory::default();
    let outcome = go_on(&bench, ADAPTIVE, earlier, &memory).await;
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 1), "{outcome:?}");
    assert!((*bench.deepest_mm.lock().unwrap() - 0.2).abs() < 1e-6);
    assert_eq!(dwells(&memory), [(3, 9.0)]);
}

#[tokio::test(start_paused = true)]
async fn a_step_that_differs_from_the_record_refuses_the_run_and_says_how() {
    let earlier = stopped_at(PRESSES, 0.3).await;
    for (other, says) in [
        (PRESSES.replace("dwell_s = 2.0", "dwell_s = 3.0"), "\"dwell_s\":3.0"),
        (PRESSES.replace("3.0 + 2.0 * i", "3.0 + 2.5 * i"), "press at (5.500, 5.000) mm, depths 0.200 mm"),
        (PRESSES.replace("    tare()\n", "    tare()\n    wait(1.0)\n"), "wait 1 s"),
        (PRESSES.replace("    tare()", "\n    tare()"), "test.star:3"),
        (PRESSES.replace("range(4)", "range(1)").replace("    log(\"over\")\n", ""), "ended after 2 steps"),
    ] {
        let bench = Bench::start(|rig| rig);
        let memory = Memory::default();
        let outcome = go_on(&bench, &other, earlier.clone(), &memory).await;
        assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
        assert!(outcome.message.contains(says), "{says}: {}", outcome.message);
        assert!(
            outcome.message.contains("run first") && outcome.message.contains("start the experiment anew")
        );
        assert!(*bench.deepest_mm.lock().unwrap() < 0.0, "nothing was pressed");
        assert_eq!(memory.safety.lock().unwrap()[0].rule, "continue");
    }
}

#[tokio::test(start_paused = true)]
async fn another_covering_than_the_earlier_runs_refuses_the_run() {
    let earlier = EarlierRun { covering_mm: 2.54, ..stopped_at(PRESSES, 0.3).await };
    let bench = Bench::start(|rig| rig);
    let outcome = go_on(&bench, PRESSES, earlier, &Memory::default()).await;
    assert_eq!(outcome.exit_status, ExitStatus::Refused, "{outcome:?}");
    assert!(
        outcome.message.contains("under the 2.54 mm covering") && outcome.message.contains("1.016 mm thick"),
        "{}",
        outcome.message
    );
    assert!(*bench.deepest_mm.lock().unwrap() < 0.0, "nothing was pressed");
}

#[tokio::test(start_paused = true)]
async fn a_covering_that_the_script_has_asked_for_is_confirmed_again() {
    let script = "def run(rig):\n    covering(2.54)\n    for depth_mm in (0.5, 0.75):\n        press(5.0, 5.0, depths_mm = [depth_mm])\n";
    let mut first = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&first, script, &memory);
    until_phase(&first, RunPhase::Paused).await;
    first.engine.resume("test", Some(2.54)).unwrap();
    until_deep(&mut first, 0.75).await;
    first.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);

    // After a restart the thinner covering counts.
    let bench = Bench::start(|rig| rig);
    let again = Memory::default();
    let (engine, rest, sink) =
        (bench.engine.clone(), rest_of(&bench, script, earlier(&memory)), again.sink());
    let run = tokio::spawn(async move { engine.run(rest, sink).await.unwrap() });
    until_phase(&bench, RunPhase::Paused).await;
    assert!(*bench.deepest_mm.lock().unwrap() < 0.0, "nothing is pressed before");
    bench.engine.resume("test", Some(2.54)).unwrap();
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 1), "{outcome:?}");
    assert!((*bench.deepest_mm.lock().unwrap() - 0.75).abs() < 1e-6);
}

#[tokio::test(start_paused = true)]
async fn a_tip_that_a_script_has_moved_is_there_again_before_the_next_step() {
    let script = "def run(rig):\n    move(6.0, 4.0, height_mm = 1.0)\n    wait(1.0)\n    read(30.0)\n    press(5.0, 5.0, depths_mm = [0.3])\n";
    let mut first = Bench::start(|rig| rig);
    let memory = Memory::default();
    let run = start(&first, script, &memory);
    first.stage.wait_for(|stage| (stage.z_mm - 1.0).abs() < 1e-9).await.unwrap();
    tokio::time::sleep(std::time::Duration::from_secs(5)).await;
    first.engine.stop(order(false));
    assert_eq!(run.await.unwrap().exit_status, ExitStatus::Stopped);
    let earlier = earlier(&memory);
    assert_eq!(earlier.steps.len(), 2, "the reading was not done");
    let there = first.engine.rig().registration.to_robot([6.0, 4.0]);

    let bench = Bench::start(|rig| rig);
    let mut stage = bench.stage.clone();
    let (engine, rest, sink) =
        (bench.engine.clone(), rest_of(&bench, script, earlier), Memory::default().sink());
    let run = tokio::spawn(async move { engine.run(rest, sink).await.unwrap() });
    stage.wait_for(|stage| (stage.z_mm - 1.0).abs() < 1e-9).await.unwrap();
    assert!((stage.borrow().x_mm - there[0]).abs() < 1e-9 && (stage.borrow().y_mm - there[1]).abs() < 1e-9);
    let outcome = run.await.unwrap();
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 1), "{outcome:?}");
    assert!(outcome.duration_s < 45.0, "the wait was not waited for again: {outcome:?}");
}

#[tokio::test(start_paused = true)]
async fn a_run_whose_script_has_nothing_left_to_do_is_done_without_a_press() {
    let memory = Memory::default();
    let first = Bench::start(|rig| rig);
    first.engine.run(first.order(PRESSES), memory.sink()).await.unwrap();
    let bench = Bench::start(|rig| rig);
    let outcome = go_on(&bench, PRESSES, earlier(&memory), &Memory::default()).await;
    assert_eq!((outcome.exit_status, outcome.presses), (ExitStatus::Done, 0), "{outcome:?}");
    assert!(*bench.deepest_mm.lock().unwrap() < 0.0);
}
