//! The stage driver with each protocol, against the virtual stage, in virtual time: a move that did not happen is never
//! reported as done.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::sync::Arc;
use std::time::Duration;

use tactus_device::{Clock, Connection, DrivenStage, ErrorKind, Stage, StageError, StageOptions, Target};
use tactus_schema::Rig;
use tactus_schema::pb::StageStatus;
use tactus_schema::rig::StageProtocol;
use tactus_virtual::{RigControl, VirtualRig};
use tokio::task::JoinHandle;
use tokio::time::sleep;

use crate::permits::{homing, permit};

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

/// Each stage under test, as in a rig file: default axes, and axes that are exchanged, reversed and shifted.
const STAGES: [&str; 4] = [
    "protocol = \"grbl\"\n",
    "protocol = \"grbl\"
axes.x = { machine_axis = \"y\", direction = -1, steps_per_mm = 400.0 }
axes.y = { machine_axis = \"x\", origin_mm = 12.5 }
axes.z = { direction = -1, origin_mm = 30.0, steps_per_mm = 1000.0 }
",
    "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
",
    "protocol = \"zaber-ascii\"
checksums = true
accel_mm_per_s2 = 400.0
homing_speed_mm_per_s = 25.0
axes.x = { device = 3, axis = 1, um_per_microstep = 0.5, direction = -1, origin_microsteps = 120_000 }
axes.y = { device = 2, axis = 1, um_per_microstep = 0.5, resolution = 128 }
axes.z = { device = 1, axis = 1, um_per_microstep = 0.124, direction = -1, origin_microsteps = 241_935, resolution = 64 }
",
];

/// Start position of every test.
const START_MM: [f64; 3] = [20.0, 15.0, 5.0];

/// A virtual stage with its driver.
struct ConnectedRig {
    stage: Arc<DrivenStage>,
    control: RigControl,
}

impl ConnectedRig {
    /// Connected, and not homed.
    fn new(lines: &str) -> Self {
        let rig = Rig::from_toml(&SIM.replace("protocol = \"grbl\"\n", lines)).unwrap();
        let protocol = rig.service.as_ref().unwrap().stage.protocol.clone();
        Self::speaking(&rig, &protocol)
    }

    /// A stage whose driver expects another protocol, or other axes.
    fn speaking(rig: &Rig, protocol: &StageProtocol) -> Self {
        let mut devices = VirtualRig::start(rig, 1);
        let options = StageOptions { tolerance_mm: 0.005, simulated: true };
        let (stage, mut reports) =
            DrivenStage::start(devices.stage_connector(), protocol, options, Clock::paused());
        tokio::spawn(async move { while reports.recv().await.is_some() {} });
        Self { stage, control: devices.control() }
    }

    /// Homed, and at [`START_MM`].
    async fn homed(lines: &str) -> Self {
        let lab = Self::new(lines);
        lab.until(StageStatus::Unhomed).await;
        lab.stage.home(homing()).await.unwrap();
        near(lab.go(START_MM).await.unwrap(), START_MM);
        lab
    }

    fn inject(&self, line: &str) {
        self.control.inject(line.parse().unwrap()).unwrap();
    }

    async fn until(&self, status: StageStatus) {
        self.stage.state().wait_for(|state| state.status() == status).await.unwrap();
    }

    fn status(&self) -> StageStatus {
        self.stage.state().borrow().status()
    }

    async fn go(&self, position_mm: [f64; 3]) -> Result<[f64; 3], StageError> {
        self.stage.move_to(permit(Target { position_mm, speed_mm_per_s: 10.0 })).await
    }

    /// A move of 20 mm along x, half a second after it began.
    async fn under_way(&self) -> JoinHandle<Result<[f64; 3], StageError>> {
        let stage = Arc::clone(&self.stage);
        let target = Target { position_mm: [40.0, 15.0, 5.0], speed_mm_per_s: 10.0 };
        let moving = tokio::spawn(async move { stage.move_to(permit(target)).await });
        sleep(Duration::from_millis(500)).await;
        assert!(self.control.is_moving());
        moving
    }
}

/// True if two positions agree within the stage's steps of 3 um and 1 um.
#[track_caller]
fn near(got_mm: [f64; 3], want_mm: [f64; 3]) {
    let is_near = got_mm.iter().zip(want_mm).all(|(got, want)| (got - want).abs() < 0.0021);
    assert!(is_near, "{got_mm:?} {want_mm:?}");
}

#[tokio::test(start_paused = true)]
async fn a_move_ends_where_it_was_told_and_truly_there() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        near(lab.control.tip_mm(), START_MM);
        let target_mm = [33.3, 11.1, 2.25];
        near(lab.go(target_mm).await.unwrap(), target_mm);
        near(lab.control.tip_mm(), target_mm);
        assert_eq!(lab.status(), StageStatus::Idle);
        let down_mm = [33.3, 11.1, 2.15];
        near(lab.go(down_mm).await.unwrap(), down_mm);
        near(lab.control.tip_mm(), down_mm);
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_in_mid_move_ends_it_and_keeps_the_position() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        let moving = lab.under_way().await;
        let before_mm = lab.control.tip_mm();
        lab.stage.stop();
        let result = moving.await.unwrap();
        let Err(StageError::Stopped { position_mm }) = result else { panic!("{lines}: {result:?}") };
        near(position_mm, lab.control.tip_mm());
        let way_mm = position_mm[0] - before_mm[0];
        // From 10 mm/s with 400 mm/s2 it brakes within 0.125 mm; the stop may be a message away.
        assert!((0.0..0.3).contains(&way_mm), "{lines}: {way_mm}");
        assert_eq!(lab.status(), StageStatus::Idle);
        near(lab.go(START_MM).await.unwrap(), START_MM);
        near(lab.control.tip_mm(), START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn homing_can_be_stopped_and_leaves_the_stage_unhomed() {
    for lines in STAGES {
        let lab = ConnectedRig::new(lines);
        lab.until(StageStatus::Unhomed).await;
        let stage = Arc::clone(&lab.stage);
        let homing = tokio::spawn(async move { stage.home(homing()).await });
        sleep(Duration::from_millis(500)).await;
        lab.stage.stop();
        assert!(matches!(homing.await.unwrap(), Err(StageError::Stopped { .. })), "{lines}");
        assert!(!lab.control.is_moving());
        assert_ne!(lab.status(), StageStatus::Idle);
        assert!(lab.go(START_MM).await.is_err());
    }
}

#[tokio::test(start_paused = true)]
async fn an_unplugged_stage_fails_the_move_and_is_found_again() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        let moving = lab.under_way().await;
        lab.inject("stage disconnect 3s");
        let result = moving.await.unwrap();
        let Err(StageError::Device(error)) = result else { panic!("{lines}: {result:?}") };
        assert_eq!(error.kind, ErrorKind::Disconnected);
        let refused = lab.go(START_MM).await;
        assert!(matches!(refused, Err(StageError::Device(_))), "{lines}: {refused:?}");
        if lines.contains("grbl") {
            // It has arrived meanwhile.
            lab.until(StageStatus::Idle).await;
        } else {
            lab.until(StageStatus::Unhomed).await;
            assert!(matches!(lab.go(START_MM).await, Err(StageError::Unhomed)));
            lab.stage.home(homing()).await.unwrap();
        }
        near(lab.go(START_MM).await.unwrap(), START_MM);
        near(lab.control.tip_mm(), START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn a_reset_leaves_the_position_suspect() {
    for lines in STAGES {
        // At rest, and during a move.
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage reset");
        lab.until(StageStatus::Unhomed).await;
        assert!(matches!(lab.go(START_MM).await, Err(StageError::Unhomed)), "{lines}");

        let lab = ConnectedRig::homed(lines).await;
        let moving = lab.under_way().await;
        lab.inject("stage reset");
        let result = moving.await.unwrap();
        assert!(matches!(result, Err(StageError::Unhomed)), "{lines}: {result:?}");
        assert!(!lab.control.is_moving());
        assert!(matches!(lab.go(START_MM).await, Err(StageError::Unhomed)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_lies_is_not_there() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage lie 0.008");
        let result = lab.go([20.0, 15.0, 4.0]).await;
        let Err(StageError::NotThere { target_mm, position_mm }) = result else {
            panic!("{lines}: {result:?}")
        };
        assert!((position_mm[2] - target_mm[2] - 0.008).abs() < 0.002, "{lines}: {position_mm:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_lied_before_it_was_homed_is_noticed_by_its_first_move() {
    for lie_mm in [0.3, -0.3] {
        // Zaber's moves are absolute.
        for lines in STAGES {
            let lab = ConnectedRig::new(lines);
            lab.until(StageStatus::Unhomed).await;
            lab.inject(&format!("stage lie {lie_mm}"));
            lab.stage.home(homing()).await.unwrap();
            let result = lab.go([20.0, 15.0, 25.0]).await;
            let noticed = matches!(result, Err(StageError::NotThere { .. } | StageError::Astray { .. }));
            assert!(noticed, "{lines}: {result:?}");
            assert!(lab.go([20.0, 15.0, 5.0]).await.is_err(), "{lines}: it goes down");
            assert!(lab.control.tip_mm()[2] > 5.0 - 0.002, "{lines}: {:?}", lab.control.tip_mm());
        }
    }
}

/// Somebody has set the work frame of a grbl controller: of the z that counts upwards, or downwards.
fn with_work_frames() -> impl Iterator<Item = (&'static str, f64)> {
    STAGES.into_iter().filter(|lines| lines.contains("grbl")).flat_map(|lines| [(lines, 2.0), (lines, -2.0)])
}

#[tokio::test(start_paused = true)]
async fn a_controller_with_another_work_frame_is_refused() {
    for (lines, offset_mm) in with_work_frames() {
        let lab = ConnectedRig::new(lines);
        lab.inject(&format!("stage work-offset {offset_mm}"));
        let mut connection = lab.stage.connection();
        let lost = connection.wait_for(|now| matches!(now, Connection::Seeking(Some(_)))).await.unwrap();
        let Connection::Seeking(Some(error)) = lost.clone() else { panic!() };
        drop(lost);
        assert_eq!(error.kind, ErrorKind::DeviceFault);
        assert!(error.what.contains("work frame is offset by") && error.what.contains("2.000"), "{error}");
        assert!(lab.stage.home(homing()).await.is_err());
        lab.inject("stage clear");
        lab.until(StageStatus::Unhomed).await;
        lab.stage.home(homing()).await.unwrap();
        near(lab.go(START_MM).await.unwrap(), START_MM);
        near(lab.control.tip_mm(), START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn a_work_frame_that_is_set_later_moves_nothing_elsewhere_and_refuses_the_next_homing() {
    for (lines, offset_mm) in with_work_frames() {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject(&format!("stage work-offset {offset_mm}"));
        for position_mm in [[20.0, 15.0, 0.3], [20.0, 15.0, -0.1], [20.0, 15.0, 2.0], [22.0, 15.0, 2.0]] {
            near(lab.go(position_mm).await.unwrap(), position_mm);
            near(lab.control.tip_mm(), position_mm);
        }
        assert!(lab.control.deepest_mm() < 0.102, "{}", lab.control.deepest_mm());
        // A while later a report has told it.
        sleep(Duration::from_secs(2)).await;
        let refused = lab.stage.home(homing()).await.unwrap_err();
        assert!(refused.to_string().contains("work frame is offset by"), "{refused}");
        assert!(lab.go(START_MM).await.is_err());
    }
}

#[tokio::test(start_paused = true)]
async fn a_stage_that_is_off_its_way_is_stopped_at_once() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage lie 0.05");
        let result = lab.go([20.0, 15.0, 4.0]).await;
        assert!(matches!(result, Err(StageError::Astray { .. })), "{lines}: {result:?}");
        assert!(lab.control.tip_mm()[2] > 4.5, "{lines}: it went on");
    }
}

#[tokio::test(start_paused = true)]
async fn a_move_that_is_accepted_and_not_made_is_not_done() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage ignore-moves");
        let result = lab.go([20.0, 15.0, 4.0]).await;
        let Err(StageError::NotThere { position_mm, .. }) = result else { panic!("{lines}: {result:?}") };
        near(position_mm, START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn a_refused_move_is_told_and_the_next_is_taken() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage refuse");
        let result = lab.go([20.0, 15.0, 4.0]).await;
        assert!(matches!(result, Err(StageError::Refused { .. })), "{lines}: {result:?}");
        near(lab.control.tip_mm(), START_MM);
        near(lab.go([20.0, 15.0, 4.0]).await.unwrap(), [20.0, 15.0, 4.0]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_move_that_does_not_end_is_overdue() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage never-idle");
        let result = lab.go([20.0, 15.0, 4.0]).await;
        assert!(matches!(result, Err(StageError::Overdue { .. })), "{lines}: {result:?}");
        assert!(lab.go(START_MM).await.is_err(), "a stage that says even then that it moves is not believed");
    }
}

#[tokio::test(start_paused = true)]
async fn an_alarm_stops_the_stage_until_it_is_cleared_and_homed() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        let moving = lab.under_way().await;
        lab.inject("stage alarm 1");
        let result = moving.await.unwrap();
        let Err(error @ StageError::Alarm { .. }) = result else { panic!("{lines}: {result:?}") };
        let words =
            if lines.contains("grbl") { "alarm 1: a hard limit" } else { "alarm z FS: the axis stalled" };
        assert!(error.to_string().contains(words), "{error}");
        assert!(!lab.control.is_moving());
        assert_eq!(lab.status(), StageStatus::Alarm);
        assert!(matches!(lab.go(START_MM).await, Err(StageError::Alarm { .. })));
        assert!(matches!(lab.stage.home(homing()).await, Err(StageError::Alarm { .. })));
        lab.stage.clear_alarm().await.unwrap();
        assert!(matches!(lab.go(START_MM).await, Err(StageError::Unhomed)));
        lab.stage.home(homing()).await.unwrap();
        near(lab.go(START_MM).await.unwrap(), START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn homing_that_fails_is_an_alarm() {
    for lines in STAGES {
        let lab = ConnectedRig::new(lines);
        lab.until(StageStatus::Unhomed).await;
        lab.inject("stage homing-fails");
        let result = lab.stage.home(homing()).await;
        assert!(matches!(result, Err(StageError::Alarm { .. })), "{lines}: {result:?}");
        assert_eq!(lab.status(), StageStatus::Alarm);
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_beyond_the_travel_is_not_gone_to() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        let result = lab.go([20.0, 15.0, -6.5]).await;
        let refused = matches!(result, Err(StageError::Refused { .. } | StageError::Alarm { code: 2, .. }));
        assert!(refused, "{lines}: {result:?}");
        near(lab.control.tip_mm(), START_MM);
    }
}

#[tokio::test(start_paused = true)]
async fn a_hung_stage_is_lost_and_not_done() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        let moving = lab.under_way().await;
        lab.inject("stage stall 20s");
        let result = moving.await.unwrap();
        let Err(StageError::Device(error)) = result else { panic!("{lines}: {result:?}") };
        assert_eq!(error.kind, ErrorKind::Timeout);
    }
}

#[tokio::test(start_paused = true)]
async fn garbage_between_the_lines_harms_nothing() {
    for lines in STAGES {
        let lab = ConnectedRig::homed(lines).await;
        lab.inject("stage echo-garbage");
        near(lab.go([20.0, 15.0, 4.0]).await.unwrap(), [20.0, 15.0, 4.0]);
    }
}

#[tokio::test(start_paused = true)]
async fn another_stage_than_the_rigs_is_refused_with_both_values() {
    let of = |lines: &str| Rig::from_toml(&SIM.replace("protocol = \"grbl\"\n", lines)).unwrap();
    let protocol = |rig: Rig| rig.service.unwrap().stage.protocol;
    for (true_lines, from, to, both) in [
        (STAGES[1], "steps_per_mm = 400.0", "steps_per_mm = 80.0", ["$101 = 400.000", "80 steps/mm"]),
        (STAGES[3], "resolution = 128", "resolution = 64", ["resolution = 128 on y", "the rig needs 64"]),
        (
            STAGES[3],
            "device = 1, axis = 1",
            "device = 1, axis = 2",
            ["device 1 has 1 axes", "its axis 2 as z"],
        ),
    ] {
        let told = true_lines.replace(from, to);
        let lab = ConnectedRig::speaking(&of(true_lines), &protocol(of(&told)));
        let mut connection = lab.stage.connection();
        let lost =
            connection.wait_for(|now| matches!(now, Connection::Seeking(Some(_)))).await.unwrap().clone();
        let Connection::Seeking(Some(error)) = lost else { panic!() };
        assert_eq!(error.kind, ErrorKind::DeviceFault);
        assert!(both.iter().all(|part| error.what.contains(part)), "{error}");
        assert!(matches!(lab.stage.home(homing()).await, Err(StageError::Device(_))));
    }
}

#[tokio::test(start_paused = true)]
async fn what_answers_says_who_it_is() {
    for (lines, identity) in STAGES.iter().zip([
        "Grbl 1.1h ['$' for help], VER:1.1h.20190830:simulated by Tactus",
        "Grbl 1.1h ['$' for help], VER:1.1h.20190830:simulated by Tactus",
        "device 1 firmware 7.38, device 2 firmware 7.38",
        "device 3 firmware 7.38, device 2 firmware 7.38, device 1 firmware 7.38",
    ]) {
        let lab = ConnectedRig::homed(lines).await;
        let Connection::Connected(controller) = lab.stage.connection().borrow().clone() else { panic!() };
        assert_eq!(controller.identity, identity);
        assert!(!controller.settings.is_empty());
    }
}
