//! Devices without wires keep to the rig's kinematics, travel and rate.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::float_cmp, reason = "places are whole steps of the stage, and readings whole counts")]

use std::future::poll_fn;
use std::time::Duration;

use tactus_device::{Clock, Sensor, SensorEvent, Stage, StageError, Target};
use tactus_schema::pb::StageStatus;
use tactus_schema::{Frame, FrameFlags, Rig};
use tactus_virtual::{Truth, UnwiredRig, UnwiredSensor, twin_of};
use tokio::time::Instant;

use crate::permits::permit;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

/// Speed, in mm/s, and the acceleration of the shipped rig, in mm/s^2.
const SPEED: f64 = 10.0;
const ACCELERATION: f64 = 500.0;

fn twin() -> Rig {
    twin_of(&Rig::from_toml(SIM).unwrap())
}

fn start(rig: &Rig) -> UnwiredRig {
    UnwiredRig::start(rig, Truth::of_rig(rig, 1), Clock::paused())
}

fn to(position_mm: [f64; 3]) -> Target {
    Target { position_mm, speed_mm_per_s: SPEED }
}

/// The next frame.
async fn frame(sensor: &mut UnwiredSensor) -> Frame {
    loop {
        if let SensorEvent::Frame(frame) = poll_fn(|context| sensor.poll_next(context)).await {
            return frame;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_move_takes_its_time_and_is_known_from_the_next_report() {
    let rig = start(&twin());
    let [x_mm, y_mm, z_mm] = rig.stage.look().await.unwrap();
    let begun = Instant::now();
    assert_eq!(
        rig.stage.move_to(permit(to([x_mm + 6.0, y_mm, z_mm]))).await.unwrap(),
        [x_mm + 6.0, y_mm, z_mm]
    );
    // A trapezium of speed over time: distance / speed + speed / acceleration. Reports come every 20 ms.
    let least_s = 6.0 / SPEED + SPEED / ACCELERATION;
    let took_s = begun.elapsed().as_secs_f64();
    assert!((least_s..least_s + 0.0211).contains(&took_s), "{took_s} s");
    let state = *rig.stage.state().borrow();
    assert_eq!((state.status(), state.simulated), (StageStatus::Idle, true));
}

#[tokio::test(start_paused = true)]
async fn it_tells_of_its_way_at_each_frame() {
    let mut rig = start(&twin());
    let [x_mm, y_mm, z_mm] = rig.stage.look().await.unwrap();
    let going = async { rig.stage.move_to(permit(to([x_mm + 3.0, y_mm, z_mm]))).await.unwrap() };
    let frames = async {
        loop {
            frame(&mut rig.sensor).await;
        }
    };
    tokio::select! {
        biased;
        _reached = going => {}
        () = frames => {}
    }
    let mut xs_mm = Vec::new();
    while let Ok(report) = rig.reports.try_recv() {
        xs_mm.push(report.x_mm);
    }
    // 0.32 s at 30 Hz.
    assert!(xs_mm.len() >= 9 && xs_mm.is_sorted(), "{xs_mm:?}");
    assert!((xs_mm[0], *xs_mm.last().unwrap()) == (x_mm, x_mm + 3.0), "{xs_mm:?}");
}

#[tokio::test(start_paused = true)]
async fn a_stop_ends_a_move_where_it_is_and_the_next_goes_on_from_there() {
    let rig = start(&twin());
    let [x_mm, y_mm, z_mm] = rig.stage.look().await.unwrap();
    let stopping = async {
        tokio::time::sleep(Duration::from_millis(300)).await;
        rig.stage.stop();
        std::future::pending::<()>().await;
    };
    let stopped = tokio::select! {
        biased;
        stopped = rig.stage.move_to(permit(to([x_mm + 6.0, y_mm, z_mm]))) => stopped,
        () = stopping => unreachable!("it waits"),
    };
    let Err(StageError::Stopped { position_mm: [there_mm, ..] }) = stopped else { panic!("{stopped:?}") };
    // 10 mm/s for 0.3 s, less what it took to get that fast.
    assert!((there_mm - x_mm - 2.9).abs() < 0.01, "{there_mm} mm");
    assert_eq!(rig.stage.look().await.unwrap()[0], there_mm);
    let back = rig.stage.move_to(permit(to([x_mm, y_mm, z_mm]))).await.unwrap();
    assert_eq!(back, [x_mm, y_mm, z_mm]);
}

#[tokio::test(start_paused = true)]
async fn what_is_beyond_the_travel_is_refused_and_nothing_moves() {
    let mut rig = twin();
    rig.simulation.as_mut().unwrap().stage.travel_mm[0] = [20.0, 30.0];
    let started = start(&rig);
    let before_mm = started.stage.look().await.unwrap();
    let refused = started.stage.move_to(permit(to([31.0, before_mm[1], before_mm[2]]))).await.unwrap_err();
    assert!(
        refused.to_string().contains("x = 31.000 mm") && refused.to_string().contains("20 to 30 mm"),
        "{refused}"
    );
    assert_eq!(started.stage.look().await.unwrap(), before_mm);

    // A stage without y: it cannot go there.
    let lines = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625 }
";
    let rig = twin_of(&Rig::from_toml(&SIM.replace("protocol = \"grbl\"\n", lines)).unwrap());
    let started = start(&rig);
    let [x_mm, y_mm, z_mm] = started.stage.look().await.unwrap();
    assert_eq!(y_mm, 0.0);
    let refused = started.stage.move_to(permit(to([x_mm, 5.0, z_mm]))).await.unwrap_err();
    assert!(refused.to_string().contains("y = 5.000 mm"), "{refused}");
}

#[tokio::test(start_paused = true)]
async fn frames_come_at_the_arrays_rate_and_show_the_tip() {
    let rig = twin();
    let mut started = start(&rig);
    let first = frame(&mut started.sensor).await;
    assert!(first.flags.contains(FrameFlags::NEW_EPOCH) && first.simulated);
    let mut last = first.clone();
    for _ in 0..300 {
        last = frame(&mut started.sensor).await;
    }
    assert_eq!(last.seq, first.seq + 300);
    // The runtime's timers have milliseconds.
    let took_s = last.received.mono.since(first.received.mono).as_secs_f64();
    assert!((took_s - 300.0 / rig.array.rate_hz()).abs() <= 0.0011, "{took_s} s");
    let read: Vec<f64> = last.counts.iter().map(|counts| f64::from(*counts)).collect();
    let nothing: Vec<f64> = rig.baseline_counts.iter().map(|counts| counts.round()).collect();
    assert_eq!(read, nothing);

    let [x_mm, y_mm] = rig.array.centre_mm(19).unwrap();
    let at_mm = rig.registration.to_robot([x_mm, y_mm]);
    started.stage.move_to(permit(to([at_mm[0], at_mm[1], -0.5]))).await.unwrap();
    let pressed = frame(&mut started.sensor).await;
    // The sensitivity is that of a press on the element's centre under the covering in place, and the twin has no other effect.
    let rise = f64::from(pressed.counts[19]) - rig.baseline_counts[19];
    assert!((rise - 0.5 * rig.sensitivity_counts_per_mm[19]).abs() <= 2.0, "{rise} counts");
}
