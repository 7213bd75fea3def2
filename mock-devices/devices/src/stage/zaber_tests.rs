use std::time::Duration;

use tactus_schema::Rig;

use crate::faults::{ControllerFault, StageFault};
use crate::stage::VirtualStage;
use crate::test_bench::{DeviceBench, sim_rig};

const LINES: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.5 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.5 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.5, direction = -1, origin_microsteps = 60_000, resolution = 32 }
";

fn zaber_rig() -> Rig {
    let toml = include_str!("../../../../config/rigs/sim.toml");
    Rig::from_toml(&toml.replace("protocol = \"grbl\"\n", LINES)).unwrap()
}

fn switched_on() -> DeviceBench<VirtualStage> {
    DeviceBench::new(&zaber_rig(), 1, VirtualStage::new)
}

/// Homed: x 0, y 0, z 30, which is z's position 0.
fn homed() -> DeviceBench<VirtualStage> {
    let mut bench = switched_on();
    ask(&mut bench, "/0 0 home", 10_000);
    bench
}

/// Sends a command and gives what comes back within a time, without line ends.
fn ask(bench: &mut DeviceBench<VirtualStage>, command: &str, ms: u64) -> Vec<String> {
    bench.send(format!("{command}\n").as_bytes());
    let said = String::from_utf8(bench.bytes(ms)).unwrap();
    said.lines().map(str::to_owned).collect()
}

fn true_mm(bench: &DeviceBench<VirtualStage>) -> [f64; 3] {
    bench.world.lock().tip_mm(bench.now)
}

#[track_caller]
fn assert_near(got: [f64; 3], want: [f64; 3]) {
    assert!(got.iter().zip(want).all(|(got, want)| (got - want).abs() < 0.002), "{got:?} {want:?}");
}

#[test]
fn it_says_who_it_is_and_that_it_does_not_know_where() {
    let mut bench = switched_on();
    assert_eq!(
        ask(&mut bench, "/0 0 07 get version", 10),
        [
            "@01 0 07 OK IDLE WR 7.38",
            "#01 0 07 Simulated stage",
            "@02 0 07 OK IDLE WR 7.38",
            "#02 0 07 Simulated stage"
        ]
    );
    assert_eq!(ask(&mut bench, "/1 0 get system.axiscount", 5), ["@01 0 OK IDLE WR 2"]);
    assert_eq!(ask(&mut bench, "/2 1 get pos", 5), ["@02 1 OK IDLE WR 0"]);
    assert_eq!(ask(&mut bench, "/2 1 get resolution", 5), ["@02 1 OK IDLE WR 32"]);
    assert_eq!(ask(&mut bench, "/1 1 warnings", 5), ["@01 1 OK IDLE WR 01 WR"]);
    // z: 30 mm is 0, -6 mm is 72000.
    assert_eq!(ask(&mut bench, "/2 1 get limit.max", 5), ["@02 1 OK IDLE WR 72000"]);
    assert!(true_mm(&bench)[2] > 20.0, "it stands high up, wherever it believes to be");
}

#[test]
fn what_it_does_not_know_is_rejected() {
    let mut bench = switched_on();
    for (command, answer) in [
        ("/1 1 dance", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 get friends", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 3 get pos", "@01 3 RJ IDLE -- BADAXIS"),
        ("/1 1 get version", "@01 1 RJ IDLE WR DEVICEONLY"),
        ("/1 1 move abs far", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 1 move abs 120001", "@01 1 RJ IDLE WR BADDATA"),
    ] {
        assert_eq!(ask(&mut bench, command, 5), [answer]);
    }
    assert_eq!(ask(&mut bench, "/3 1 get pos", 5), [""; 0], "there is no such device");
    assert_eq!(ask(&mut bench, "/1 1 get pos:00", 5), [""; 0], "a wrong checksum is met with silence");
}

#[test]
fn homing_finds_the_reference() {
    let mut bench = switched_on();
    let answer = ask(&mut bench, "/2 1 home", 5);
    assert_eq!(answer, ["@02 1 OK BUSY WR 0"]);
    bench.bytes(5_000);
    assert_eq!(ask(&mut bench, "/2 1 get pos", 5), ["@02 1 OK IDLE -- 0"]);
    assert_near([true_mm(&bench)[2], 0.0, 0.0], [30.0, 0.0, 0.0]);
    assert_eq!(ask(&mut bench, "/1 0 get pos", 5), ["@01 0 OK IDLE WR 0"]);
    ask(&mut bench, "/0 0 home", 10_000);
    assert_near(true_mm(&bench), [0.0, 0.0, 30.0]);
}

#[test]
fn a_move_takes_its_time_and_ends_where_it_was_told() {
    let mut bench = homed();
    // 10 mm at 20 mm/s, which are 40000 microsteps/s, and 500 mm/s2: 0.54 s.
    ask(&mut bench, "/1 1 set maxspeed 65536", 5);
    assert_eq!(ask(&mut bench, "/1 1 move abs 20000", 5), ["@01 1 OK BUSY -- 0"]);
    bench.bytes(272);
    assert!(ask(&mut bench, "/1 1 get pos", 5)[0].starts_with("@01 1 OK BUSY -- 10"));
    bench.bytes(270);
    assert_eq!(ask(&mut bench, "/1 1 get pos", 5), ["@01 1 OK IDLE -- 19998"], "in steps of 3 um");
    assert_near(true_mm(&bench), [10.0, 0.0, 30.0]);
    assert_eq!(ask(&mut bench, "/2 1 move abs 40000", 5_000).len(), 1);
    assert_near(true_mm(&bench), [10.0, 0.0, 10.0]);
}

#[test]
fn stop_brakes_every_axis_and_keeps_the_position() {
    let mut bench = homed();
    ask(&mut bench, "/1 1 set maxspeed 65536", 5);
    ask(&mut bench, "/1 1 move abs 20000", 270);
    assert_eq!(ask(&mut bench, "/0 0 42 stop", 5), ["@01 0 42 OK BUSY NI 0", "@02 0 42 OK IDLE -- 0"]);
    bench.bytes(1_000);
    let [x, ..] = true_mm(&bench);
    assert!((5.0..6.0).contains(&x), "{x}");
    assert_eq!(ask(&mut bench, "/1 1", 5), ["@01 1 OK IDLE NI 0"]);
    ask(&mut bench, "/1 1 move abs 20000", 1_000);
    assert_eq!(ask(&mut bench, "/1 1", 5), ["@01 1 OK IDLE -- 0"], "the flag stays until the next move");
    assert_near(true_mm(&bench), [10.0, 0.0, 30.0]);
}

#[test]
fn an_emergency_stop_is_dead() {
    let mut bench = homed();
    ask(&mut bench, "/1 1 set maxspeed 65536", 5);
    ask(&mut bench, "/1 1 move abs 20000", 270);
    let [x, ..] = true_mm(&bench);
    assert_eq!(ask(&mut bench, "/0 0 estop", 1_000).len(), 2);
    assert_near(true_mm(&bench), [x, 0.0, 30.0]);
}

#[test]
fn the_end_of_the_travel_is_a_stall() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::LostSteps { lost_mm: 1.0 }));
    // 59.5 mm, of which 1 is lost; then back by 59.5 of 58.5.
    ask(&mut bench, "/1 1 move abs 119000", 5_000);
    assert_near(true_mm(&bench), [58.5, 0.0, 30.0]);
    ask(&mut bench, "/1 1 move abs 0", 5_000);
    assert_eq!(ask(&mut bench, "/1 1 warnings", 5), ["@01 1 OK IDLE FS 01 FS"]);
    assert_near(true_mm(&bench), [0.0, 0.0, 30.0]);
    assert_eq!(ask(&mut bench, "/1 1 warnings clear", 5), ["@01 1 OK IDLE -- 0"]);
}

#[test]
fn checksums_are_sent_when_they_are_switched_on() {
    let mut bench = switched_on();
    ask(&mut bench, "/2 0 set comm.checksum 1", 5);
    let answer = ask(&mut bench, "/2 1 get pos", 5);
    assert!(answer[0].starts_with("@02 1 OK IDLE WR 0:"), "{answer:?}");
    assert_eq!(ask(&mut bench, "/1 1 get pos", 5), ["@01 1 OK IDLE WR 0"]);
}

#[test]
fn what_it_reports_may_be_wrong() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::Lie { z_mm: -0.05 }));
    assert_eq!(ask(&mut bench, "/2 1 get pos", 5), ["@02 1 OK IDLE -- 100"]);
    bench.fault(StageFault::Controller(ControllerFault::NeverIdle));
    assert_eq!(ask(&mut bench, "/2 1", 5), ["@02 1 OK BUSY -- 0"]);
    bench.fault(StageFault::Clear);
    assert_eq!(ask(&mut bench, "/2 1 get pos", 5), ["@02 1 OK IDLE -- 0"]);
}

#[test]
fn what_it_does_may_be_wrong() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::Refuse(33)));
    assert_eq!(ask(&mut bench, "/2 1 move abs 100", 5), ["@02 1 RJ IDLE -- BADDATA"]);
    bench.fault(StageFault::Controller(ControllerFault::IgnoreMoves));
    assert_eq!(ask(&mut bench, "/2 1 move abs 100", 1_000), ["@02 1 OK IDLE -- 0"]);
    assert_near(true_mm(&bench), [0.0, 0.0, 30.0]);
    bench.fault(StageFault::Clear);
    bench.fault(StageFault::Controller(ControllerFault::HomingFails));
    ask(&mut bench, "/2 1 home", 4_900);
    assert_eq!(ask(&mut bench, "/2 1", 5), ["@02 1 OK BUSY -- 0"]);
    bench.bytes(200);
    assert_eq!(ask(&mut bench, "/2 1", 5), ["@02 1 OK IDLE FE 0"]);
}

#[test]
fn alarms_and_resets_come_out_of_the_blue() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::Alarm(1)));
    assert_eq!(ask(&mut bench, "/0 0", 5), ["@01 0 OK IDLE -- 0", "@02 0 OK IDLE FS 0"]);
    bench.fault(StageFault::Controller(ControllerFault::Reset));
    assert_eq!(ask(&mut bench, "/0 0", 5), ["@01 0 OK IDLE WR 0", "@02 0 OK IDLE WR 0"]);
    assert_near(true_mm(&bench), [0.0, 0.0, 30.0]);
}

#[test]
fn a_hung_device_goes_on_moving_and_answers_later() {
    let mut bench = homed();
    ask(&mut bench, "/1 1 move abs 20000", 5);
    bench.fault(StageFault::Stall(Duration::from_secs(5)));
    assert_eq!(ask(&mut bench, "/1 1 get pos", 4_000), [""; 0]);
    assert_near(true_mm(&bench), [10.0, 0.0, 30.0]);
    let answer = ask(&mut bench, "/1 1", 1_100);
    assert_eq!(answer, ["@01 1 OK IDLE -- 19998", "@01 1 OK IDLE -- 0"]);
}

#[test]
fn the_shipped_rig_speaks_grbl() {
    let mut bench = DeviceBench::new(&sim_rig(), 1, VirtualStage::new);
    assert!(String::from_utf8(bench.bytes(10)).unwrap().contains("Grbl 1.1h"));
}
