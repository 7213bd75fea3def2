//! Any sequence of steps, orders and faults at the run engine with virtual devices, in virtual time. Whatever happens, the true tip keeps
//! its limit, no dwell is told that was none, a run that is told as done has done every press, and the tip is up after it or a fault is
//! told; nothing hangs.
//!
//! `crates/tactus-runner/tests/it/schedules.rs` plays the same with random scripts. Here the input chooses every step itself, also those
//! that no script can ask for.
#![no_main]

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use tactus_device::{Clock, SensorCodec};
use tactus_engine::{Engine, Record, RecordFailure, RunOrder, RunOutcome, StopOrder, Unpublished};
use tactus_model::Covering;
use tactus_plan::{
    Arguments, Call, Evaluate, Host, InThisProcess, Location, Outcome, Position, Press, RigView, Script,
    ScriptError, ScriptLimits, Step,
};
use tactus_runner::{devices, embedded::Truth};
use tactus_schema::pb::{self, ExitStatus, run_event::Event};
use tactus_schema::{Frame, Rig, TimeStamp};
use tactus_virtual::RigControl;
use tactus_virtual::schedule::Schedule;
use tokio::time::{sleep, timeout};

const SIM: &str = include_str!("../../config/rigs/sim.toml");

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
";

/// How far the tip may pass the limit: the tolerance of a move, and the stage's step.
const TOLERANCE_MM: f64 = 0.007;

/// How much farther a damaged command may carry it, at the greatest speed of a step down: docs/decisions/0020-a-damaged-byte.md.
const DAMAGE_MM: f64 = 1.5;

/// Virtual time. Only a hang takes this long.
const LONGEST: Duration = Duration::from_hours(4);

/// Most steps of a run, and most faults and orders of a sequence.
const STEPS_MAX: usize = 6;
const FAULTS_MAX: usize = 4;
const ORDERS_MAX: usize = 6;

const RUNS: usize = 2;

/// What is played, as the input says it.
#[derive(Debug)]
struct Sequence {
    toml: String,
    seed: u64,
    faults: Schedule,
    /// Each a pause, and what a client asks then.
    orders: Vec<(Duration, Order)>,
    runs: Vec<Vec<Step>>,
}

#[derive(Debug, Clone, Copy)]
enum Order {
    Stop { abort: bool },
    Pause,
    Resume { covering_mm: Option<f64> },
    Reset,
}

fuzz_target!(|input: &[u8]| {
    let Ok(sequence) = Sequence::new(&mut Unstructured::new(input)) else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
    runtime.expect("a runtime").block_on(play(sequence));
});

impl Sequence {
    fn new(choices: &mut Unstructured<'_>) -> Result<Self> {
        let toml =
            if choices.arbitrary()? { SIM.replace("protocol = \"grbl\"\n", ZABER) } else { SIM.to_owned() };
        let seed = choices.arbitrary::<u8>()?.into();
        let mut faults = Schedule::default();
        for _ in 0..choices.int_in_range(0..=FAULTS_MAX)? {
            let at = Duration::from_millis(choices.arbitrary::<u16>()?.into());
            let random = Schedule::random(choices.arbitrary::<u16>()?.into(), Duration::ZERO, 1, 48);
            faults.faults.extend(random.faults.into_iter().map(|(_, line)| (at, line)));
        }
        faults.faults.sort();
        let mut orders = Vec::new();
        for _ in 0..choices.int_in_range(0..=ORDERS_MAX)? {
            let pause = Duration::from_millis(choices.arbitrary::<u16>()?.into());
            let order = match choices.int_in_range(0..=5)? {
                0 => Order::Stop { abort: choices.arbitrary()? },
                1 => Order::Pause,
                2 => Order::Resume { covering_mm: Some(length(choices)?) },
                3 => Order::Reset,
                _ => Order::Resume { covering_mm: None },
            };
            orders.push((pause, order));
        }
        let mut runs = Vec::new();
        for _ in 0..RUNS {
            let steps = choices.int_in_range(1..=STEPS_MAX)?;
            runs.push((0..steps).map(|_| step(choices)).collect::<Result<Vec<_>>>()?);
        }
        Ok(Self { toml, seed, faults, orders, runs })
    }
}

fn step(choices: &mut Unstructured<'_>) -> Result<Step> {
    let place = |choices: &mut Unstructured<'_>| -> Result<Position> {
        Ok(Position { x_mm: length(choices)?, y_mm: length(choices)? })
    };
    let speed = |choices: &mut Unstructured<'_>| -> Result<Option<f64>> {
        choices.arbitrary::<bool>()?.then(|| length(choices)).transpose()
    };
    Ok(match choices.int_in_range(0..=9)? {
        0 => Step::Tare { duration_s: duration_s(choices)? },
        1 => Step::Wait { duration_s: duration_s(choices)? },
        2 => Step::Dwell { duration_s: duration_s(choices)? },
        3 => Step::Read { duration_s: duration_s(choices)? },
        4 => Step::Log { message: String::new() },
        5 => Step::Covering { thickness_mm: length(choices)? },
        6 => {
            let height_mm = choices.arbitrary::<bool>()?.then(|| length(choices)).transpose()?;
            Step::Move { to: place(choices)?, height_mm, speed_mm_per_s: speed(choices)? }
        }
        _ => {
            let mut depths_mm = Vec::new();
            for _ in 0..choices.int_in_range(0..=4)? {
                depths_mm.push(length(choices)?);
            }
            let approach_from_mm =
                if choices.ratio(1, 4)? { Some([length(choices)?, length(choices)?]) } else { None };
            let at = if choices.ratio(3, 4)? { Position { x_mm: 7.1, y_mm: 4.9 } } else { place(choices)? };
            let dwell_s = duration_s(choices)?;
            Step::Press(Press { at, depths_mm, dwell_s, speed_mm_per_s: speed(choices)?, approach_from_mm })
        }
    })
}

/// A depth, a place, a thickness or a speed: mostly one that a rig allows.
fn length(choices: &mut Unstructured<'_>) -> Result<f64> {
    Ok(match choices.int_in_range(0..=9)? {
        0 => *choices.choose(&[
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            -0.0,
            1e300,
            1e-300,
            1.016,
            5.08,
        ])?,
        1 => f64::from(choices.arbitrary::<i16>()?) * 0.001,
        2 => f64::from(choices.arbitrary::<u8>()?) * 0.1,
        _ => f64::from(choices.arbitrary::<u8>()?) * 0.71 / 255.0,
    })
}

fn duration_s(choices: &mut Unstructured<'_>) -> Result<f64> {
    Ok(match choices.int_in_range(0..=15)? {
        0 => *choices.choose(&[f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300, 1e-300])?,
        _ => f64::from(choices.arbitrary::<u8>()?) * 0.004,
    })
}

/// Asks for the steps of the input.
#[derive(Debug)]
struct Steps(Vec<Step>);

impl Evaluate for Steps {
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        _rig: &RigView,
        _seed: u64,
        _limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> std::result::Result<Outcome, ScriptError> {
        for (step, line) in self.0.iter().zip(1..) {
            let at = Location { script: script.name().to_owned(), line };
            let call = Call { step: step.clone(), at: at.clone() };
            host.perform(&call).map_err(|refusal| ScriptError::Refused {
                at,
                refusal,
                call_stack: String::new(),
            })?;
        }
        let steps = self.0.len() as u64;
        Ok(Outcome {
            arguments: arguments.clone(),
            result: Default::default(),
            steps,
            ticks: 0,
            heap_bytes: 0,
        })
    }

    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> std::result::Result<Arguments, ScriptError> {
        InThisProcess.resolve(script, arguments, rig, limits, stopped)
    }
}

/// Checks each event against the true tip.
struct Witness {
    control: RigControl,
    rig: Rig,
    /// Dwells that were told and were none.
    broken: Arc<Mutex<Vec<String>>>,
}

impl Record for Witness {
    fn sensor_info(&mut self, _: &pb::SensorInfo, _: TimeStamp) -> std::result::Result<(), RecordFailure> {
        Ok(())
    }

    fn frame(&mut self, _: &Frame) -> std::result::Result<(), RecordFailure> {
        Ok(())
    }

    fn stage(&mut self, _: &pb::StageState) -> std::result::Result<(), RecordFailure> {
        Ok(())
    }

    fn event(&mut self, event: &pb::RunEvent) -> std::result::Result<(), RecordFailure> {
        if let Some(Event::DwellDone(dwell)) = &event.event {
            let [x_mm, y_mm] = self.rig.registration.to_robot([dwell.x_mm, dwell.y_mm]);
            let (tip_mm, told_mm) = (self.control.tip_mm(), [x_mm, y_mm, -dwell.depth_mm]);
            let away_mm =
                tip_mm.iter().zip(told_mm).map(|(tip, told)| (tip - told).powi(2)).sum::<f64>().sqrt();
            if !(away_mm <= 2.0 * TOLERANCE_MM) || self.control.is_moving() {
                let broken = format!("a dwell at {told_mm:?} is told, and the tip is at {tip_mm:?}");
                self.broken.lock().unwrap_or_else(PoisonError::into_inner).push(broken);
            }
        }
        Ok(())
    }

    fn safety(&mut self, _: &pb::SafetyEvent) -> std::result::Result<(), RecordFailure> {
        Ok(())
    }

    fn finish(self: Box<Self>) -> std::result::Result<(), RecordFailure> {
        Ok(())
    }
}

async fn play(sequence: Sequence) {
    let Sequence { toml, seed, faults, orders, runs } = &sequence;
    let rig = Rig::from_toml(toml).expect("a shipped rig");
    let service = rig.service.clone().expect("a rig with a service");
    let clock = Clock::paused();
    let opened = devices::open(&rig, &service, SensorCodec::default(), || Truth::of_rig(&rig, *seed), clock);
    let control = opened.control.expect("virtual devices");
    let engine = Engine::start(rig.clone(), opened.devices, clock, Arc::new(Unpublished)).expect("an engine");
    let script = faults.script().expect("faults");
    let faulty = control.clone();
    tokio::spawn(async move { faulty.play(&script).await });
    tokio::spawn(client(engine.clone(), orders.clone()));

    let broken = Arc::new(Mutex::new(Vec::new()));
    for (run, steps) in runs.iter().enumerate() {
        let reset = timeout(LONGEST, engine.reset()).await;
        assert!(reset.is_ok(), "a reset hangs: {sequence:?}");
        let witness = Witness { control: control.clone(), rig: rig.clone(), broken: Arc::clone(&broken) };
        let ran = timeout(LONGEST, engine.run(order(run, steps), Box::new(witness))).await;
        let Ok(ran) = ran else { panic!("a run hangs: {sequence:?}") };
        if let Ok(outcome) = ran {
            check_outcome(&outcome, steps, &engine, &control, &sequence);
        }
    }
    let broken = broken.lock().unwrap_or_else(PoisonError::into_inner);
    assert!(broken.is_empty(), "{broken:?}: {sequence:?}");
    let limit_mm = limit_mm(&rig, &sequence);
    let deepest_mm = control.deepest_mm();
    assert!(
        deepest_mm <= limit_mm,
        "the tip was {deepest_mm} mm deep, the limit is {limit_mm} mm: {sequence:?}"
    );
}

/// The greatest depth under any covering that was put in place, and what a damaged command may add.
fn limit_mm(rig: &Rig, sequence: &Sequence) -> f64 {
    let envelope = &rig.service.as_ref().expect("a rig with a service").envelope;
    let asked = sequence.runs.iter().flatten().filter_map(|step| match step {
        Step::Covering { thickness_mm } if thickness_mm.is_finite() => {
            Some(Covering { thickness_mm: *thickness_mm })
        }
        _ => None,
    });
    let depths_mm = asked.chain([rig.covering]).map(|covering| envelope.depth_max_mm(covering));
    let is_damaged = sequence.faults.faults.iter().any(|(_, line)| line.starts_with("to-stage"));
    depths_mm.fold(0.0, f64::max) + TOLERANCE_MM + if is_damaged { DAMAGE_MM } else { 0.0 }
}

async fn client(engine: Engine, orders: Vec<(Duration, Order)>) {
    for (pause, order) in orders {
        sleep(pause).await;
        match order {
            Order::Stop { abort } => {
                engine.stop(StopOrder { by: "client".into(), reason: String::new(), abort });
            }
            Order::Pause => {
                engine.pause("client");
            }
            // Whether there is anything to resume or to reset, it does not know.
            Order::Resume { covering_mm } => drop(engine.resume("client", covering_mm)),
            Order::Reset => drop(engine.reset().await),
        }
    }
    // A run that waits for somebody goes on.
    loop {
        sleep(Duration::from_secs(20)).await;
        drop(engine.resume("client", None));
        engine.stop(StopOrder { by: "client".into(), reason: String::new(), abort: false });
    }
}

fn check_outcome(
    outcome: &RunOutcome,
    steps: &[Step],
    engine: &Engine,
    control: &RigControl,
    sequence: &Sequence,
) {
    let presses = steps.iter().filter(|step| matches!(step, Step::Press(_))).count();
    if outcome.exit_status == ExitStatus::Done {
        let are_all = outcome.frames_lost == 0 && outcome.presses as usize == presses;
        assert!(are_all, "done, with {presses} presses asked for: {outcome:?}: {sequence:?}");
    }
    let rig = engine.rig();
    let safe_mm =
        rig.service.as_ref().expect("a rig with a service").motion.safe_height_mm - 2.0 * TOLERANCE_MM;
    // A run that was refused before it began has moved nothing.
    let has_moved = outcome.travel_mm[2][0].is_finite();
    if has_moved && control.tip_mm()[2] < safe_mm {
        let is_told = outcome.message.contains("NOT RETRACTED") && engine.fault().is_some();
        assert!(is_told, "the tip is at {:?} after {outcome:?}: {sequence:?}", control.tip_mm());
    }
}

fn order(run: usize, steps: &[Step]) -> RunOrder {
    RunOrder {
        run_id: format!("run-{run}"),
        script: Script::parse("any", "def run(rig):\n    pass\n").expect("a script"),
        arguments: Arguments::default(),
        seed: 1,
        who: "any".into(),
        limits: ScriptLimits::default(),
        earlier: None,
        planned: None,
        versions: BTreeMap::new(),
        recording: String::new(),
        resets: false,
        evaluator: Arc::new(Steps(steps.to_vec())),
    }
}
