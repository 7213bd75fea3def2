//! A stage and its driver in virtual time, under random schedules of faults, random moves, looks and stops. What is checked is
//! the true tip. A schedule that breaks a promise is reduced to a small one, whose text plays again.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "a schedule that is played again is told")]

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_device::{Clock, DrivenStage, Stage, StageError, StageOptions, Target};
use tactus_schema::Rig;
use tactus_virtual::schedule::{self, shrink};
use tactus_virtual::{RigControl, VirtualRig};
use tokio::time::{sleep, timeout};

use crate::permits::{homing, permit};

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

/// Lines of the rig file, by name.
const STAGES: [(&str, &str); 2] = [
    ("grbl", "protocol = \"grbl\"\n"),
    (
        "zaber",
        "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
",
    ),
];

const TOLERANCE_MM: f64 = 0.005;

/// Deepest order of the moves.
const DEEPEST_MM: f64 = 0.3;

/// How much deeper the tip may get: a step, and the bound of a damaged byte at the speed of the steps, for a report that comes
/// 300 ms late at most.
const MARGIN_MM: f64 = 0.1 + 0.31;

/// How far from the told position the tip may be.
const NEAR_MM: f64 = 0.012;

/// Schedules with grbl, a twentieth of it with Zaber; `TACTUS_SCHEDULES` sets another number, `TACTUS_SEED` plays one seed, and
/// `TACTUS_SCHEDULE` one text.
const SCHEDULES: u64 = 40;

const TRIES_MAX: u32 = 300;

/// What is played.
#[derive(Debug, Clone, PartialEq)]
struct Schedule {
    seed: u64,
    stage: &'static str,
    events: Vec<Event>,
}

#[derive(Debug, Clone, PartialEq)]
enum Event {
    /// At a time since the rig was switched on.
    Fault(Duration, String),
    Order(Order),
}

/// An order to the stage; each follows the end of the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Home,
    Clear,
    Stop,
    Look,
    Wait {
        ms: u64,
    },
    /// A step down from where it stands; stopped after this time.
    Down {
        ms: u64,
    },
    Up {
        ms: u64,
    },
}

/// What was ordered and what came of it, and the first broken promise.
#[derive(Debug, PartialEq)]
struct Played {
    log: Vec<String>,
    broken: Option<(&'static str, String)>,
}

impl Schedule {
    fn of_seed(stage: &'static str, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let faults =
            schedule::Schedule::random(seed, Duration::from_secs(20), rng.random_range(0..5), 48).faults;
        let faults = faults.into_iter().map(|(at, line)| Event::Fault(at, line));
        let orders = (0..25).map(|_| Event::Order(Order::random(&mut rng)));
        let events = faults.chain([Event::Order(Order::Home)]).chain(orders).collect();
        Self { seed, stage, events }
    }

    fn faults(&self) -> schedule::Schedule {
        let fault = |event: &Event| match event {
            Event::Fault(at, line) => Some((*at, line.clone())),
            Event::Order(_) => None,
        };
        schedule::Schedule { faults: self.events.iter().filter_map(fault).collect() }
    }
}

impl Order {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let ms = rng.random_range(1..20_000);
        match rng.random_range(0..10) {
            0 => Self::Home,
            1 => Self::Clear,
            2 => Self::Stop,
            3 => Self::Wait { ms: ms % 1500 },
            4 => Self::Look,
            5..=7 => Self::Down { ms },
            _ => Self::Up { ms },
        }
    }
}

/// One schedule, until the first broken promise; the tip may be `deepest_mm` deep.
fn play(schedule: &Schedule, deepest_mm: f64) -> Played {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.unwrap().block_on(async {
        let (_, lines) = STAGES.iter().find(|(name, _)| *name == schedule.stage).unwrap();
        let rig = Rig::from_toml(&SIM.replace("protocol = \"grbl\"\n", lines)).unwrap();
        let protocol = rig.service.as_ref().unwrap().stage.protocol.clone();
        let mut devices = VirtualRig::start(&rig, schedule.seed);
        let control = devices.control();
        let options = StageOptions { tolerance_mm: TOLERANCE_MM, simulated: true };
        let (stage, mut reports) =
            DrivenStage::start(devices.stage_connector(), &protocol, options, Clock::paused());
        tokio::spawn(async move { while reports.recv().await.is_some() {} });
        let faults = schedule.faults();
        let hidden_mm = faults.hidden_mm();
        let (script, injected) = (faults.script().unwrap(), control.clone());
        tokio::spawn(async move { injected.play(&script).await });
        // It answers, unless a fault is in the way.
        sleep(Duration::from_secs(1)).await;
        let mut log = Vec::new();
        for event in &schedule.events {
            let Event::Order(order) = event else { continue };
            let (told, broken) = perform(*order, &stage, &control, hidden_mm).await;
            log.push(format!("{told} at {:?}", control.tip_mm()));
            let (tip_mm, limit_mm) = (control.deepest_mm(), deepest_mm + hidden_mm);
            let too_deep = (tip_mm > limit_mm).then(|| ("depth", format!("{tip_mm:.3} mm deep")));
            let broken = broken.map(|what| ("truth", what)).or(too_deep);
            if broken.is_some() {
                return Played { log, broken };
            }
        }
        Played { log, broken: None }
    })
}

/// Gives one order. Tells what came of it, and what of it is false.
async fn perform(
    order: Order,
    stage: &Arc<DrivenStage>,
    control: &RigControl,
    hidden_mm: f64,
) -> (String, Option<String>) {
    let [x_mm, y_mm, z_mm] = position_mm(stage);
    // Down in steps, up in one way.
    let (to_z_mm, speed_mm_per_s, ms) = match order {
        Order::Home => return (format!("home {:?}", stage.home(homing()).await), None),
        Order::Clear => return (format!("clear {:?}", stage.clear_alarm().await), None),
        Order::Stop => {
            stage.stop();
            return ("stop".to_owned(), None);
        }
        Order::Wait { ms } => {
            sleep(Duration::from_millis(ms)).await;
            return ("wait".to_owned(), None);
        }
        Order::Look => return told_true(("look", None), control, hidden_mm, &stage.look().await),
        Order::Down { ms } => ((z_mm - 0.1).max(-DEEPEST_MM), 1.0, ms),
        Order::Up { ms } => (2.0, 20.0, ms),
    };
    let [x_mm, y_mm] = if z_mm > 1.0 { [20.0, 15.0] } else { [x_mm, y_mm] };
    let position_mm = [x_mm, y_mm, to_z_mm];
    let moved = stage.move_to(permit(Target { position_mm, speed_mm_per_s }));
    if let Ok(result) = timeout(Duration::from_millis(ms), moved).await {
        return told_true(("move", Some(position_mm)), control, hidden_mm, &result);
    }
    stage.stop();
    (format!("move to {position_mm:?} was stopped after {ms} ms"), None)
}

/// A success must be true: the tip stands, and where it was told.
fn told_true(
    (what, target_mm): (&str, Option<[f64; 3]>),
    control: &RigControl,
    hidden_mm: f64,
    result: &Result<[f64; 3], StageError>,
) -> (String, Option<String>) {
    let told = format!("{what} to {target_mm:?} {result:?}");
    let Ok(told_mm) = result else { return (told, None) };
    let tip_mm = control.tip_mm();
    let is_near =
        |at_mm: [f64; 3]| tip_mm.iter().zip(at_mm).all(|(tip, at)| (tip - at).abs() <= NEAR_MM + hidden_mm);
    let is_true = is_near(*told_mm) && target_mm.is_none_or(is_near) && !control.is_moving();
    let broken = (!is_true).then(|| format!("{told}, and the tip is at {tip_mm:?}"));
    (told, broken)
}

fn position_mm(stage: &Arc<DrivenStage>) -> [f64; 3] {
    let state = *stage.state().borrow();
    [state.x_mm, state.y_mm, state.z_mm]
}

/// The smallest schedule found that breaks the same promise.
fn reduce(schedule: &Schedule, promise: &str, deepest_mm: f64) -> Schedule {
    let with = |events: &[Event]| Schedule { events: events.to_vec(), ..*schedule };
    let breaks = |events: &[Event]| {
        play(&with(events), deepest_mm).broken.is_some_and(|(broken, _)| broken == promise)
    };
    with(&shrink(&schedule.events, |_| Vec::new(), breaks, TRIES_MAX).events)
}

fn check(schedule: &Schedule) {
    let deepest_mm = DEEPEST_MM + MARGIN_MM;
    if let Some((promise, what)) = play(schedule, deepest_mm).broken {
        let small = reduce(schedule, promise, deepest_mm);
        panic!("seed {}, {}: {what}\nreduced: TACTUS_SCHEDULE='{small}'", schedule.seed, schedule.stage);
    }
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn check_all(stage: &'static str, share: u64) {
    if let Ok(text) = std::env::var("TACTUS_SCHEDULE") {
        let schedule: Schedule = text.parse().unwrap();
        if schedule.stage == stage {
            println!("{}", play(&schedule, f64::INFINITY).log.join("\n"));
            check(&schedule);
        }
        return;
    }
    let seeds = match number("TACTUS_SEED") {
        Some(seed) => seed..seed + 1,
        None => 0..number("TACTUS_SCHEDULES").unwrap_or(SCHEDULES) / share,
    };
    for seed in seeds {
        check(&Schedule::of_seed(stage, seed));
    }
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {}; stage {}", self.seed, self.stage)?;
        self.events.iter().try_for_each(|event| match event {
            Event::Fault(at, line) => write!(f, "; at {} {line}", at.as_millis()),
            Event::Order(order) => match order {
                Order::Home => f.write_str("; home"),
                Order::Clear => f.write_str("; clear"),
                Order::Stop => f.write_str("; stop"),
                Order::Look => f.write_str("; look"),
                Order::Wait { ms } => write!(f, "; wait {ms}"),
                Order::Down { ms } => write!(f, "; down {ms}"),
                Order::Up { ms } => write!(f, "; up {ms}"),
            },
        })
    }
}

impl FromStr for Schedule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split(';').map(str::trim);
        let seed = parts.next().and_then(|part| part.strip_prefix("seed ")?.parse().ok());
        let name = parts.next().and_then(|part| part.strip_prefix("stage "));
        let stage = STAGES.iter().find(|(known, _)| Some(*known) == name);
        let (Some(seed), Some((stage, _))) = (seed, stage) else {
            return Err("a schedule begins with \"seed N; stage NAME\"".to_owned());
        };
        let event = |part: &str| -> Option<Event> {
            let (word, rest) = part.split_once(' ').unwrap_or((part, ""));
            let ms = rest.parse();
            Some(Event::Order(match word {
                "at" => {
                    let (ms, line) = rest.split_once(' ')?;
                    return Some(Event::Fault(Duration::from_millis(ms.parse().ok()?), line.to_owned()));
                }
                "home" => Order::Home,
                "clear" => Order::Clear,
                "stop" => Order::Stop,
                "look" => Order::Look,
                "wait" => Order::Wait { ms: ms.ok()? },
                "down" => Order::Down { ms: ms.ok()? },
                "up" => Order::Up { ms: ms.ok()? },
                _ => return None,
            }))
        };
        let events = parts.map(|part| event(part).ok_or_else(|| format!("{part:?} is no event")));
        Ok(Self { seed, stage, events: events.collect::<Result<_, _>>()? })
    }
}

#[test]
fn whatever_happens_to_grbl_a_success_is_true_and_the_tip_is_never_too_deep() {
    check_all("grbl", 1);
}

#[test]
fn whatever_happens_to_zaber_a_success_is_true_and_the_tip_is_never_too_deep() {
    // Its positions are asked for as fast as the answers come, so that a schedule takes longer.
    check_all("zaber", 20);
}

#[test]
fn the_same_schedule_plays_the_same_and_so_does_its_text() {
    let schedule = Schedule::of_seed("grbl", 11);
    let again: Schedule = schedule.to_string().parse().unwrap();
    assert_eq!(again, schedule);
    assert_eq!(play(&schedule, 1.0), play(&again, 1.0));
}

#[test]
fn a_schedule_that_breaks_a_promise_is_reduced() {
    // As if the surface were a limit: it takes the homing, one way up to the place, and some steps down.
    let breaks = |schedule: &Schedule| play(schedule, -1.95).broken.is_some();
    let schedule = (0..100).map(|seed| Schedule::of_seed("grbl", seed)).find(breaks).unwrap();
    let small = reduce(&schedule, "depth", -1.95);
    assert!(breaks(&small) && small.events.len() < schedule.events.len() / 2, "{small}");
    assert_eq!(reduce(&schedule, "depth", -1.95), small);
}
