#![expect(clippy::float_cmp, reason = "the controller prints positions with three decimals")]

#[path = "driven_tests/grbl.rs"]
mod fake;
#[path = "driven_tests/hang.rs"]
mod hang;
#[path = "driven_tests/zaber.rs"]
mod zaber;

use std::sync::Arc;
use std::time::Duration;

use fake::{Fault, Shared};
use tactus_safety::{Supervisor, Void};
use tactus_schema::pb::{StageState, StageStatus};
use tactus_schema::rig::{GrblAxes, StageProtocol};
use tactus_schema::{MonoTime, Rig};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep};

use super::{Connection, DrivenStage, REPORTS_MAX, StageOptions};
use crate::transport::memory::{MemoryPort, pair};
use crate::{Clock, ErrorKind, HomingPermit, Permit, Stage, StageError, Target};

const OPTIONS: StageOptions = StageOptions { tolerance_mm: 0.005, simulated: true };

fn to(x_mm: f64, speed_mm_per_s: f64) -> Target {
    Target { position_mm: [x_mm, 1.0, 5.0], speed_mm_per_s }
}

/// Leave to move anywhere: a supervisor that takes the stage to stand there already.
fn permit(target: Target) -> Permit {
    let [x_mm, y_mm, z_mm] = target.position_mm;
    let status = StageStatus::Idle.into();
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&StageState { x_mm, y_mm, z_mm, status, ..Default::default() }), None);
    supervisor.permit(target, MonoTime::default()).unwrap()
}

/// Leave to home, which does not expire in a test.
fn homing() -> HomingPermit {
    supervisor().permit_homing(MonoTime::default().after(Duration::from_secs(1_000_000))).unwrap()
}

fn supervisor() -> Supervisor {
    let rig = Rig::from_toml(include_str!("../../../../config/rigs/sim.toml")).unwrap();
    Supervisor::without_sensor(&rig, rig.service.as_ref().unwrap())
}

fn start() -> (Arc<DrivenStage>, mpsc::Receiver<StageState>, MemoryPort) {
    let (connector, port) = pair("stage");
    let protocol = StageProtocol::Grbl(GrblAxes::default());
    let (stage, reports) = DrivenStage::start(Box::new(connector), &protocol, OPTIONS, Clock::paused());
    (stage, reports, port)
}

/// A stage that stands homed at (1, 1, 5), its controller, and a task that takes every report.
async fn homed() -> (Arc<DrivenStage>, Shared) {
    let (stage, reports, port) = start();
    let shared = Shared::new();
    tokio::spawn(fake::run(port, shared.clone()));
    tokio::spawn(drain(reports));
    until(&stage, StageStatus::Unhomed).await;
    stage.home(homing()).await.unwrap();
    assert_eq!(stage.state().borrow().status(), StageStatus::Idle);
    (stage, shared)
}

async fn drain(mut reports: mpsc::Receiver<StageState>) {
    let mut last = 0;
    while let Some(report) = reports.recv().await {
        assert_eq!(report.seq, last + 1, "a report was lost");
        last = report.seq;
    }
}

async fn until(stage: &Arc<DrivenStage>, status: StageStatus) {
    stage.state().wait_for(|state| state.status() == status).await.unwrap();
}

/// Begins a move, and lets it get under way for a time.
async fn begin(
    stage: &Arc<DrivenStage>,
    target: Target,
    under_way: Duration,
) -> tokio::task::JoinHandle<Result<[f64; 3], StageError>> {
    let stage = Arc::clone(stage);
    let moving = tokio::spawn(async move { stage.move_to(permit(target)).await });
    sleep(under_way).await;
    moving
}

#[tokio::test(start_paused = true)]
async fn a_move_is_done_soon_after_the_stage_arrives() {
    let (stage, shared) = homed().await;
    let began = Instant::now();
    let reached = stage.move_to(permit(to(11.0, 10.0))).await.unwrap();
    assert_eq!(reached, [11.0, 1.0, 5.0]);
    assert_eq!((shared.count("G91G21G94G1F600"), shared.count("$G"), shared.count("G53X11")), (1, 1, 1));
    // The way takes a second; the stage is asked every 20 ms.
    let took = began.elapsed();
    assert!((Duration::from_secs(1)..=Duration::from_millis(1020)).contains(&took), "{took:?}");
    let state = *stage.state().borrow();
    assert_eq!((state.status(), state.x_mm, state.simulated), (StageStatus::Idle, 11.0, true));
}

#[tokio::test(start_paused = true)]
async fn a_move_to_the_present_place_moves_nothing_and_asks() {
    let (stage, shared) = homed().await;
    let asked = shared.count("?");
    assert_eq!(stage.move_to(permit(to(1.0, 10.0))).await.unwrap(), [1.0, 1.0, 5.0]);
    assert_eq!(stage.look().await.unwrap(), [1.0, 1.0, 5.0]);
    assert_eq!((shared.count("?"), shared.count("G")), (asked + 4, 0));
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_falls_silent_answers_no_look() {
    let (stage, shared) = homed().await;
    shared.fall_silent();
    assert!(matches!(stage.look().await, Err(StageError::Device(_))));
    assert!(matches!(stage.look().await, Err(StageError::Device(_))));
}

#[tokio::test(start_paused = true)]
async fn the_epoch_rises_with_whatever_makes_the_position_doubtful_and_with_nothing_else() {
    let (stage, shared) = homed().await;
    let epoch = || stage.state().borrow().epoch;
    let homed = epoch();
    stage.move_to(permit(to(3.0, 10.0))).await.unwrap();
    let moving = begin(&stage, to(11.0, 10.0), Duration::from_millis(200)).await;
    stage.stop();
    assert!(matches!(moving.await.unwrap(), Err(StageError::Stopped { .. })));
    stage.look().await.unwrap();
    assert_eq!(epoch(), homed);

    shared.set(Fault::Resets);
    assert!(matches!(stage.move_to(permit(to(2.0, 10.0))).await, Err(StageError::Unhomed)));
    let reset = epoch();
    stage.home(homing()).await.unwrap();
    let homed_again = epoch();
    shared.set(Fault::HardLimit);
    assert!(matches!(stage.move_to(permit(to(11.0, 10.0))).await, Err(StageError::Alarm { .. })));
    let alarmed = epoch();
    // In an alarm a controller may stay silent.
    stage.clear_alarm().await.unwrap();
    shared.fall_silent();
    until(&stage, StageStatus::Disconnected).await;
    let lost = epoch();
    until(&stage, StageStatus::Unhomed).await;
    let epochs = [homed, reset, homed_again, alarmed, lost, epoch()];
    assert!(epochs.is_sorted_by(|a, b| a < b), "{epochs:?}");
}

#[tokio::test(start_paused = true)]
async fn stop_is_sent_in_the_same_instant_and_keeps_the_position() {
    let (stage, shared) = homed().await;
    let moving = begin(&stage, to(11.0, 10.0), Duration::from_millis(537)).await;
    let pressed = Instant::now();
    stage.stop();
    let result = moving.await.unwrap();
    assert_eq!(shared.first_heard("!"), Some(pressed));
    let Err(StageError::Stopped { position_mm }) = result else { panic!("{result:?}") };
    assert!((position_mm[0] - 6.37).abs() < 0.001, "{position_mm:?}");
    assert!((position_mm[0] - shared.position_mm()[0]).abs() < 0.0006);
    // Still homed: it goes on from where it stands.
    assert_eq!(stage.move_to(permit(to(6.0, 10.0))).await.unwrap(), [6.0, 1.0, 5.0]);
}

#[tokio::test(start_paused = true)]
async fn a_command_given_before_the_stop_is_not_begun_after_it() {
    let (stage, shared) = homed().await;
    let given = stage.move_to(permit(to(11.0, 10.0)));
    stage.stop();
    assert!(matches!(given.await, Err(StageError::Stopped { .. })));
    assert_eq!(shared.count("G"), 0);
}

#[tokio::test(start_paused = true)]
async fn a_command_given_while_the_stage_comes_to_a_stand_waits_for_it() {
    let (stage, shared) = homed().await;
    let moving = begin(&stage, to(11.0, 10.0), Duration::from_millis(500)).await;
    stage.stop();
    assert_eq!(stage.move_to(permit(to(2.0, 10.0))).await.unwrap(), [2.0, 1.0, 5.0]);
    assert!(matches!(moving.await.unwrap(), Err(StageError::Stopped { .. })));
    assert_eq!(shared.count("\x18"), 2, "one at the greeting, one after the hold");
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_nobody_else_could_stop_is_not_moved_unless_it_is_simulated() {
    let (connector, port) = pair("stage");
    let protocol = StageProtocol::Grbl(GrblAxes::default());
    let options = StageOptions { simulated: false, ..OPTIONS };
    let (stage, reports) = DrivenStage::start(Box::new(connector), &protocol, options, Clock::paused());
    let shared = Shared::new();
    tokio::spawn(fake::run(port, shared.clone()));
    tokio::spawn(drain(reports));
    until(&stage, StageStatus::Unhomed).await;
    let refused = stage.home(homing()).await;
    let Err(StageError::Refused { reason, .. }) = refused else { panic!("{refused:?}") };
    assert!(reason.contains("use kind = \"serial\" or \"tcp\""), "{reason}");
    assert_eq!(shared.count("$H"), 0);
}

#[tokio::test(start_paused = true)]
async fn a_second_move_is_refused_while_one_is_in_hand() {
    let (stage, _shared) = homed().await;
    let moving = begin(&stage, to(11.0, 10.0), Duration::from_millis(500)).await;
    assert!(matches!(stage.move_to(permit(to(2.0, 10.0))).await, Err(StageError::Refused { .. })));
    assert_eq!(moving.await.unwrap().unwrap(), [11.0, 1.0, 5.0]);
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_lies_is_not_there() {
    let (stage, shared) = homed().await;
    shared.set(Fault::StopsShort);
    let result = stage.move_to(permit(to(11.0, 10.0))).await;
    let Err(StageError::NotThere { target_mm, position_mm }) = result else { panic!("{result:?}") };
    assert_eq!((target_mm[0], position_mm[0]), (11.0, 10.0));
}

#[tokio::test(start_paused = true)]
async fn a_move_that_does_not_end_is_stopped_and_overdue() {
    let (stage, shared) = homed().await;
    shared.set(Fault::NeverIdle);
    let result = stage.move_to(permit(to(11.0, 10.0))).await;
    let Err(StageError::Overdue { position_mm, waited_s, .. }) = result else { panic!("{result:?}") };
    assert_eq!((position_mm[0], waited_s), (11.0, 4.0));
    assert!(shared.first_heard("!").is_some());
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_told_and_cleared() {
    let (stage, shared) = homed().await;
    shared.set(Fault::HardLimit);
    let result = stage.move_to(permit(to(11.0, 10.0))).await;
    let Err(StageError::Alarm { code: 1, meaning, .. }) = result else { panic!("{result:?}") };
    assert_eq!(meaning, "a hard limit switch was hit");
    let state = *stage.state().borrow();
    assert_eq!((state.status(), state.alarm), (StageStatus::Alarm, Some(1)));
    assert!(matches!(stage.move_to(permit(to(2.0, 10.0))).await, Err(StageError::Alarm { code: 1, .. })));
    stage.clear_alarm().await.unwrap();
    assert_eq!(stage.state().borrow().status(), StageStatus::Unhomed);
    assert!(matches!(stage.move_to(permit(to(2.0, 10.0))).await, Err(StageError::Unhomed)));
    stage.home(homing()).await.unwrap();
    stage.move_to(permit(to(2.0, 10.0))).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_reset_leaves_the_stage_unhomed() {
    let (stage, shared) = homed().await;
    shared.set(Fault::Resets);
    assert!(matches!(stage.move_to(permit(to(11.0, 10.0))).await, Err(StageError::Unhomed)));
    assert_eq!(stage.state().borrow().status(), StageStatus::Unhomed);
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_falls_silent_is_held_and_found_again() {
    let (stage, shared) = homed().await;
    shared.set(Fault::FallsSilent);
    let result = stage.move_to(permit(to(31.0, 10.0))).await;
    let Err(StageError::Device(error)) = result else { panic!("{result:?}") };
    assert_eq!(error.kind, ErrorKind::Timeout);
    assert!(shared.first_heard("!").is_some());
    assert_eq!(stage.state().borrow().status(), StageStatus::Disconnected);
    assert!(matches!(stage.move_to(permit(to(2.0, 10.0))).await, Err(StageError::Device(_))));
    // It stands on its way, and has not been reset by others.
    let epoch = stage.state().borrow().epoch;
    let mut state = stage.state();
    let first = state.wait_for(|state| state.status() != StageStatus::Disconnected).await.unwrap().status();
    assert_eq!(first, StageStatus::Idle, "not a place that is not known yet");
    assert!(stage.state().borrow().epoch > epoch, "no dwell outlasts it");
    stage.move_to(permit(to(2.0, 10.0))).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_was_moved_while_it_was_silent_must_be_homed() {
    let (stage, shared) = homed().await;
    shared.fall_silent();
    until(&stage, StageStatus::Disconnected).await;
    shared.place([1.0, 1.0, 4.0]);
    until(&stage, StageStatus::Unhomed).await;
}

#[tokio::test(start_paused = true)]
async fn an_unplugged_stage_fails_the_move_and_keeps_its_place_if_it_has_arrived_when_it_is_back() {
    let (stage, reports, mut port) = start();
    tokio::spawn(drain(reports));
    let shared = Shared::new();
    let plugged = tokio::spawn({
        let shared = shared.clone();
        async move {
            let stream = port.accept().await;
            // Half a second into the move.
            tokio::select! {
                () = fake::serve(stream, &shared) => {}
                () = sleep(Duration::from_millis(1500)) => {}
            }
            port
        }
    });
    assert!(matches!(stage.home(homing()).await, Err(StageError::Device(_))), "it cannot have answered yet");
    until(&stage, StageStatus::Unhomed).await;
    stage.home(homing()).await.unwrap();
    let result = stage.move_to(permit(to(31.0, 10.0))).await;
    let Err(StageError::Device(error)) = result else { panic!("{result:?}") };
    assert_eq!(error.kind, ErrorKind::Disconnected);
    until(&stage, StageStatus::Disconnected).await;
    sleep(Duration::from_secs(5)).await;
    tokio::spawn(fake::run(plugged.await.unwrap(), shared));
    until(&stage, StageStatus::Idle).await;
    stage.move_to(permit(to(2.0, 10.0))).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn reports_that_nobody_takes_hold_up_the_stage_but_not_a_stop() {
    let (stage, mut reports, port) = start();
    let shared = Shared::new();
    tokio::spawn(fake::run(port, shared.clone()));
    until(&stage, StageStatus::Unhomed).await;
    // Ten reports a second: full after half a minute, and then no more is asked.
    sleep(Duration::from_mins(5)).await;
    let asked = shared.count("?");
    assert!((REPORTS_MAX..REPORTS_MAX + 5).contains(&asked), "{asked}");
    let pressed = Instant::now();
    stage.stop();
    sleep(Duration::from_millis(1)).await;
    assert_eq!(shared.first_heard("!"), Some(pressed));
    for seq in 1..=REPORTS_MAX as u64 {
        assert_eq!(reports.recv().await.unwrap().seq, seq);
    }
}

#[tokio::test(start_paused = true)]
async fn two_runs_are_alike() {
    let mut runs = Vec::new();
    for _ in 0..2 {
        let (stage, mut reports, port) = start();
        tokio::spawn(fake::run(port, Shared::new()));
        until(&stage, StageStatus::Unhomed).await;
        stage.home(homing()).await.unwrap();
        stage.move_to(permit(to(3.0, 1.0))).await.unwrap();
        drop(stage);
        let mut run = Vec::new();
        while let Some(report) = reports.recv().await {
            run.push(StageState { t_wall_ns: 0, ..report });
        }
        runs.push(run);
    }
    assert!(runs[0].len() > 30);
    assert_eq!(runs[0], runs[1]);
}

#[tokio::test(start_paused = true)]
async fn what_answers_is_told() {
    let (stage, _shared) = homed().await;
    let Connection::Connected(controller) = stage.connection().borrow().clone() else { panic!() };
    assert_eq!(controller.identity, "Grbl 1.1h ['$' for help], VER:1.1h.20190830");
    let settings: Vec<_> =
        controller.settings.iter().map(|one| format!("{}={}", one.name, one.value)).collect();
    assert_eq!(settings, ["$20=1", "$22=1", "$23=3", "$100=250.000"]);
}

#[tokio::test(start_paused = true)]
async fn a_controller_that_is_not_the_rigs_is_refused_and_not_moved() {
    let (connector, port) = pair("stage");
    let mut axes = GrblAxes::default();
    axes.axes[0].steps_per_mm = Some(80.0);
    let protocol = StageProtocol::Grbl(axes);
    let (stage, reports) = DrivenStage::start(Box::new(connector), &protocol, OPTIONS, Clock::paused());
    tokio::spawn(drain(reports));
    let shared = Shared::new();
    tokio::spawn(fake::run(port, shared.clone()));
    let mut connection = stage.connection();
    let refused = connection.wait_for(|now| matches!(now, Connection::Seeking(Some(_)))).await;
    assert!(refused.is_ok());
    drop(refused);
    let Err(StageError::Device(error)) = stage.home(homing()).await else { panic!() };
    assert_eq!(error.kind, ErrorKind::DeviceFault);
    let both = ["$100 = 250.000", "80 steps/mm", "not connected", "stage on memory:stage"];
    assert!(both.iter().all(|part| error.to_string().contains(part)), "{error}");
    assert_eq!(stage.state().borrow().status(), StageStatus::Disconnected);
    assert_eq!(shared.count("$H") + shared.count("G") + shared.count("$100"), 0);
}

#[tokio::test(start_paused = true)]
async fn a_rig_that_makes_no_stage_is_told() {
    let (connector, _port) = pair("stage");
    let mut axes = GrblAxes::default();
    axes.axes[0].machine_axis = axes.axes[1].machine_axis;
    let protocol = StageProtocol::Grbl(axes);
    let (stage, _reports) = DrivenStage::start(Box::new(connector), &protocol, OPTIONS, Clock::paused());
    let mut connection = stage.connection();
    let why = connection.wait_for(|now| matches!(now, Connection::Seeking(Some(_)))).await.unwrap().clone();
    let Connection::Seeking(Some(error)) = why else { panic!() };
    assert_eq!(error.kind, ErrorKind::Protocol);
    assert!(error.what.contains("x and y are the same axis"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_is_not_watched_any_more_is_stopped() {
    let (stage, shared) = homed().await;
    stage.watch();
    let moving = begin(&stage, to(11.0, 10.0), Duration::from_millis(70)).await;
    assert_eq!(shared.first_heard("!"), None);
    stage.watch();
    let watched = Instant::now();
    let result = moving.await.unwrap();
    assert!(matches!(result, Err(StageError::Unwatched { .. })), "{result:?}");
    assert_eq!(shared.first_heard("!"), Some(watched + Duration::from_millis(80)));
    // It stands, and goes on with a new permit.
    stage.watch();
    assert_eq!(stage.look().await.unwrap()[1], 1.0);
}

#[tokio::test(start_paused = true)]
async fn without_a_valid_permit_no_byte_is_sent() {
    let (stage, shared) = homed().await;
    let heard = shared.count("$H");
    let old = supervisor().permit_homing(MonoTime::default()).unwrap();
    assert!(matches!(stage.home(old).await, Err(StageError::Void(Void::Expired))));

    let mut supervisor = supervisor();
    let revoked =
        supervisor.permit_homing(MonoTime::default().after(Duration::from_secs(1_000_000))).unwrap();
    supervisor.revocation().revoke();
    assert!(matches!(stage.home(revoked).await, Err(StageError::Void(Void::Revoked))));
    assert_eq!(shared.count("$H"), heard);
}

/// Leave to move from where the stage stands now, which lasts a sample period.
async fn short_permit(stage: &Arc<DrivenStage>, target: Target) -> Permit {
    stage.look().await.unwrap();
    let report = *stage.state().borrow();
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&report), None);
    supervisor.permit(target, MonoTime::from_ns(report.t_mono_ns)).unwrap()
}

#[tokio::test(start_paused = true)]
async fn a_permit_that_expires_while_the_speed_is_read_back_moves_nothing() {
    let (stage, shared) = homed().await;
    shared.set(Fault::TellsSlowly);
    let result = stage.move_to(short_permit(&stage, to(2.0, 10.0)).await).await;
    assert!(matches!(result, Err(StageError::Void(Void::Expired))), "{result:?}");
    assert_eq!((shared.count("X"), shared.first_heard("!")), (0, None));
    // The speed is known now.
    let reached = stage.move_to(short_permit(&stage, to(2.0, 10.0)).await).await.unwrap();
    assert_eq!((reached[0], shared.count("$G")), (2.0, 1));
}
