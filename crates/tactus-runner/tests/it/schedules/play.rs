//! Plays one schedule in virtual time.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tactus_device::{Clock, SensorCodec};
use tactus_engine::{Engine, ResumeError, StopOrder};
use tactus_runner::{devices, embedded::Truth};
use tactus_virtual::RigControl;
use tokio::time::{Instant, advance, sleep, sleep_until, timeout};

use super::schedule::{Act, Event, RUNS, Schedule};
use super::tally::Tally;
use super::watch::{Broken, Strictness, TOLERANCE_MM, Witness};
use crate::order;

/// Only a hang takes this long.
const LONGEST: Duration = Duration::from_hours(4);

/// A person resumes what somebody has paused, again and again.
const OPERATOR: Duration = Duration::from_mins(1);

/// Nobody commands anything for this time at the end, and the tip must not go down.
const REST: Duration = Duration::from_secs(3);

/// What one schedule has shown.
#[derive(Debug, Default)]
pub(super) struct Played {
    /// What came of it; equal for equal schedules.
    pub(super) log: String,
    pub(super) broken: Vec<Broken>,
    pub(super) tally: Tally,
}

/// Plays a schedule in a runtime of its own. A panic is a broken promise.
pub(super) fn play(schedule: &Schedule, strictness: Strictness) -> Played {
    let played = catch_unwind(AssertUnwindSafe(|| {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
        runtime.unwrap().block_on(play_all(schedule, strictness))
    }));
    played.unwrap_or_else(|panic| {
        let what = panic.downcast_ref::<String>().cloned();
        let what = what.or_else(|| panic.downcast_ref::<&str>().map(|&text| text.to_owned()));
        let broken = Broken { promise: "panic", what: what.unwrap_or_default() };
        Played { broken: vec![broken], ..Played::default() }
    })
}

async fn play_all(schedule: &Schedule, strictness: Strictness) -> Played {
    let rig = schedule.stand.rig();
    let service = rig.service.clone().unwrap();
    let clock = Clock::paused();
    let started = Instant::now();
    let seed = schedule.seed;
    let mut opened =
        devices::open(&rig, &service, SensorCodec::default(), || Truth::of_rig(&rig, seed), clock);
    // As for real devices: a person puts the covering in place.
    opened.devices.change_covering = None;
    let control = opened.control.unwrap();
    let witness = Arc::new(Witness::new(control.clone(), rig.clone(), &schedule.faults(), strictness));
    let engine = Engine::start(rig, opened.devices, clock, Arc::clone(&witness) as _).unwrap();

    let played = Arc::new(Mutex::new(Tally::default()));
    let others: Vec<_> = schedule
        .events
        .iter()
        .filter_map(|event| {
            let (at, event) = match event {
                Event::Fault(at, _) | Event::Hang(at, _) | Event::Client(at, _) => (*at, event.clone()),
                Event::Step(..) => return None,
            };
            let (engine, control, played) = (engine.clone(), control.clone(), Arc::clone(&played));
            Some(tokio::spawn(async move {
                sleep_until(started + at).await;
                happen(&event, &engine, &control, &played).await;
            }))
        })
        .collect();
    let operator = tokio::spawn(operate(engine.clone(), Arc::clone(&witness)));

    let mut log = String::new();
    for run in 0..RUNS {
        if let Some((text, presses)) = schedule.script(run) {
            perform(&engine, &control, &witness, (run, &text, presses), &mut log).await;
        }
    }
    others.iter().for_each(tokio::task::JoinHandle::abort);
    if timeout(LONGEST, engine.released()).await.is_err() {
        witness.tell("hang", "a client's reset hangs");
    }
    operator.abort();
    let before_mm = control.tip_mm()[2];
    sleep(REST).await;
    let after_mm = control.tip_mm()[2];
    if after_mm < before_mm - TOLERANCE_MM {
        witness.tell(
            "rest",
            format!("nobody commands, and the tip went from {before_mm:.3} mm to {after_mm:.3} mm"),
        );
    }
    witness.check_depth();
    let (events, broken, mut tally) = witness.what_was_seen();
    for event in events {
        writeln!(log, "{event}").unwrap();
    }
    tally.add("virtual time", "s", started.elapsed().as_secs());
    tally.merge(std::mem::take(&mut *played.lock().unwrap()));
    Played { log, broken, tally }
}

/// Resumes whatever is paused. If another covering is asked for, puts it in place first and confirms it.
async fn operate(engine: Engine, witness: Arc<Witness>) {
    loop {
        sleep(OPERATOR).await;
        if let Err(ResumeError::CoveringNotConfirmed { wanted_mm }) = engine.resume("operator", None) {
            witness.put_in_place(wanted_mm);
            drop(engine.resume("operator", Some(wanted_mm)));
        }
    }
}

/// Resets, and runs one script.
async fn perform(
    engine: &Engine,
    control: &RigControl,
    witness: &Arc<Witness>,
    (run, text, presses): (u32, &str, u32),
    log: &mut String,
) {
    let reset = timeout(LONGEST, engine.reset()).await;
    writeln!(log, "reset: {reset:?}").unwrap();
    match reset {
        Err(_) => witness.tell("hang", "a reset hangs"),
        Ok(Ok(())) => witness.count("resets", "done"),
        Ok(Err(_)) => witness.count("resets", "failed"),
    }
    let recording = Witness::recording(witness);
    match timeout(LONGEST, engine.run(order(engine, format!("run-{run}"), text), recording)).await {
        Err(_) => witness.tell("hang", "a run hangs"),
        Ok(Err(busy)) => {
            witness.count("outcomes", "busy");
            writeln!(log, "{busy}").unwrap();
        }
        Ok(Ok(outcome)) => {
            writeln!(log, "{outcome:?} at {:?}", control.tip_mm()).unwrap();
            witness.check_outcome(&outcome, presses, engine.fault().is_some());
        }
    }
}

/// Makes an event happen, other than a step of a script.
async fn happen(event: &Event, engine: &Engine, control: &RigControl, played: &Mutex<Tally>) {
    let (group, name) = match event {
        Event::Fault(_, line) => ("faults", without_numbers(line)),
        Event::Hang(..) => ("faults", "host hangs".into()),
        Event::Client(_, act) => ("client", format!("{act:?}").to_lowercase()),
        Event::Step(..) => return,
    };
    played.lock().unwrap().count(group, name);
    match event {
        Event::Fault(_, line) => control.inject(line.parse().unwrap()).unwrap(),
        Event::Hang(_, lasts) => advance(*lasts).await,
        Event::Client(_, act) => ask(*act, engine).await,
        Event::Step(..) => {}
    }
}

/// Whether there is anything to reset or to resume, a client does not know.
async fn ask(act: Act, engine: &Engine) {
    let stop = |abort| {
        engine.stop(StopOrder { by: "client".into(), reason: String::new(), abort });
    };
    match act {
        Act::Stop => stop(false),
        Act::Abort => stop(true),
        Act::Pause => {
            engine.pause("client");
        }
        Act::Resume => drop(engine.resume("client", None)),
        Act::Confirm => drop(engine.resume("client", Some(20.0))),
        Act::Reset => drop(engine.reset().await),
    }
}

fn without_numbers(line: &str) -> String {
    let is_word = |word: &&str| !word.starts_with(|first: char| first.is_ascii_digit() || first == '-');
    let sign = if line.contains(" -") { " -" } else { "" };
    line.split(' ').filter(is_word).collect::<Vec<_>>().join(" ") + sign
}
