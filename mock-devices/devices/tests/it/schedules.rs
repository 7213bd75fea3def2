//! A stage and its driver in virtual time, under random schedules of faults, random moves, looks and stops. What is checked is
//! the true tip.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_device::{Clock, DrivenStage, Stage, StageError, StageOptions, Target};
use tactus_schema::Rig;
use tactus_virtual::schedule::Schedule;
use tactus_virtual::{RigControl, VirtualRig};
use tokio::time::{sleep, timeout};

use crate::permits::{homing, permit};

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
";

const TOLERANCE_MM: f64 = 0.005;

/// Deepest order of the moves.
const DEEPEST_MM: f64 = 0.3;

/// How much deeper the tip may get: a step, and the bound of a damaged byte at the speed of the steps, for a report that comes
/// 300 ms late at most.
const MARGIN_MM: f64 = 0.1 + 0.31;

/// Schedules with grbl, a twentieth of it with Zaber; `TACTUS_SCHEDULES` sets another number, and `TACTUS_SEED` plays one seed.
const SCHEDULES: u64 = 40;

/// One schedule: what was ordered and what came of it, for comparison and for a failure's message.
async fn play(lines: &str, seed: u64) -> Vec<String> {
    let rig = Rig::from_toml(&SIM.replace("protocol = \"grbl\"\n", lines)).unwrap();
    let protocol = rig.service.as_ref().unwrap().stage.protocol.clone();
    let mut devices = VirtualRig::start(&rig, seed);
    let control = devices.control();
    let options = StageOptions { tolerance_mm: TOLERANCE_MM, simulated: true };
    let (stage, mut reports) =
        DrivenStage::start(devices.stage_connector(), &protocol, options, Clock::paused());
    tokio::spawn(async move { while reports.recv().await.is_some() {} });
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let schedule = Schedule::random(seed, Duration::from_secs(20), rng.random_range(0..5), 48);
    let script = schedule.script().unwrap();
    let faults = control.clone();
    tokio::spawn(async move { faults.play(&script).await });
    let mut log = vec![schedule.to_string()];
    // It answers, unless a fault is in the way.
    sleep(Duration::from_secs(1)).await;
    log.push(format!("home {:?}", stage.home(homing()).await));
    for _ in 0..25 {
        let order = order(&stage, &control, &mut rng).await;
        assert!(
            control.deepest_mm() <= DEEPEST_MM + MARGIN_MM,
            "seed {seed}, {lines}: {} mm deep\n{}\n{order}",
            control.deepest_mm(),
            log.join("\n")
        );
        log.push(order);
    }
    log
}

/// Gives one order, checks its result against the true tip, and tells both.
async fn order(stage: &Arc<DrivenStage>, control: &RigControl, rng: &mut ChaCha8Rng) -> String {
    let told = match rng.random_range(0..10) {
        0 => format!("home {:?}", stage.home(homing()).await),
        1 => format!("clear {:?}", stage.clear_alarm().await),
        2 => {
            stage.stop();
            "stop".to_owned()
        }
        3 => {
            sleep(Duration::from_millis(rng.random_range(1..1500))).await;
            "wait".to_owned()
        }
        4 => told_true("look", control, None, &stage.look().await),
        _ => {
            let [_, _, z_mm] = position_mm(stage);
            // Down in steps, up in one way.
            let to_z_mm = if rng.random() { (z_mm - 0.1).max(-DEEPEST_MM) } else { 2.0 };
            let speed_mm_per_s = if to_z_mm < z_mm { 1.0 } else { 20.0 };
            let [x_mm, y_mm] =
                if z_mm > 1.0 { [20.0, 15.0] } else { [position_mm(stage)[0], position_mm(stage)[1]] };
            let position_mm = [x_mm, y_mm, to_z_mm];
            let moved = stage.move_to(permit(Target { position_mm, speed_mm_per_s }));
            let stops_after = Duration::from_millis(rng.random_range(1..20_000));
            let Ok(result) = timeout(stops_after, moved).await else {
                stage.stop();
                return format!("move to {position_mm:?} was stopped after {stops_after:?}");
            };
            told_true("move", control, Some(position_mm), &result)
        }
    };
    format!("{told} at {:?}", control.tip_mm())
}

/// A success must be true: the tip stands, and where it was told.
fn told_true(
    what: &str,
    control: &RigControl,
    target_mm: Option<[f64; 3]>,
    result: &Result<[f64; 3], StageError>,
) -> String {
    if let Ok(told_mm) = result {
        let tip_mm = control.tip_mm();
        let is_near = |at_mm: [f64; 3]| tip_mm.iter().zip(at_mm).all(|(tip, at)| (tip - at).abs() <= 0.012);
        assert!(is_near(*told_mm), "{what}: told {told_mm:?}, and the tip is at {tip_mm:?}");
        assert!(target_mm.is_none_or(is_near), "{what}: ordered {target_mm:?}, and the tip is at {tip_mm:?}");
        assert!(!control.is_moving(), "{what}: told while the tip moves");
    }
    format!("{what} to {target_mm:?} {result:?}")
}

fn position_mm(stage: &Arc<DrivenStage>) -> [f64; 3] {
    let state = *stage.state().borrow();
    [state.x_mm, state.y_mm, state.z_mm]
}

fn run(lines: &str, seed: u64) -> Vec<String> {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build().unwrap();
    runtime.block_on(play(lines, seed))
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn run_all(lines: &str, share: u64) {
    let seeds = match number("TACTUS_SEED") {
        Some(seed) => seed..seed + 1,
        None => 0..number("TACTUS_SCHEDULES").unwrap_or(SCHEDULES) / share,
    };
    for seed in seeds {
        drop(run(lines, seed));
    }
}

#[test]
fn whatever_happens_to_grbl_a_success_is_true_and_the_tip_is_never_too_deep() {
    run_all("protocol = \"grbl\"\n", 1);
}

#[test]
fn whatever_happens_to_zaber_a_success_is_true_and_the_tip_is_never_too_deep() {
    // Its positions are asked for as fast as the answers come, so that a schedule takes longer.
    run_all(ZABER, 20);
}

#[test]
fn the_same_seed_plays_the_same() {
    assert_eq!(run("protocol = \"grbl\"\n", 11), run("protocol = \"grbl\"\n", 11));
}
