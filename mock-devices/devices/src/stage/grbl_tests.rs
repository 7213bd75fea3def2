use std::time::Duration;

use crate::faults::{ControllerFault, StageFault};
use crate::stage::{GARBAGE_BYTES, VirtualStage};
use crate::test_bench::{DeviceBench, sim_rig};

fn switched_on() -> DeviceBench<VirtualStage> {
    DeviceBench::new(&sim_rig(), 1, VirtualStage::new)
}

/// Homed and idle at x 1, y 1, z 29, with nothing unread.
fn homed() -> DeviceBench<VirtualStage> {
    let mut bench = switched_on();
    ask(&mut bench, "$H", 20_000);
    bench
}

/// Sends a line (real-time bytes go as they are) and gives what comes back within a time.
fn ask(bench: &mut DeviceBench<VirtualStage>, line: &str, ms: u64) -> String {
    match line {
        "?" | "!" | "~" | "\x18" => bench.send(line.as_bytes()),
        _ => bench.send(format!("{line}\n").as_bytes()),
    }
    hear(bench, ms)
}

fn hear(bench: &mut DeviceBench<VirtualStage>, ms: u64) -> String {
    String::from_utf8(bench.bytes(ms)).unwrap()
}

/// State and position of a status report, without what comes now and then.
fn status(bench: &mut DeviceBench<VirtualStage>) -> String {
    let report = ask(bench, "?", 5);
    report.split("|Bf").next().unwrap().to_owned()
}

fn true_mm(bench: &DeviceBench<VirtualStage>) -> [f64; 3] {
    bench.world.lock().tip_mm(bench.now)
}

#[track_caller]
fn assert_near(got: [f64; 3], want: [f64; 3]) {
    assert!(got.iter().zip(want).all(|(got, want)| (got - want).abs() < 0.002), "{got:?} {want:?}");
}

#[test]
fn it_starts_locked_and_not_knowing_where_it_is() {
    let mut bench = switched_on();
    let greeting = hear(&mut bench, 10);
    assert!(greeting.contains("\r\nGrbl 1.1h ['$' for help]\r\n"), "{greeting}");
    assert!(greeting.ends_with("[MSG:Simulated stage]\r\n[MSG:'$H'|'$X' to unlock]\r\n"), "{greeting}");
    assert_eq!(status(&mut bench), "<Alarm|MPos:0.000,0.000,0.000");
    assert_eq!(ask(&mut bench, "G0 X1", 0), "error:9\r\n");
    assert_eq!(ask(&mut bench, "$X", 0), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:0.000,0.000,0.000");
    assert!(true_mm(&bench)[2] > 20.0, "it stands high up, wherever it believes to be");
}

#[test]
fn now_and_then_a_boot_finds_its_settings_unreadable() {
    let greetings: Vec<_> = (0..20)
        .map(|seed| {
            hear(&mut DeviceBench::new(&sim_rig(), seed, VirtualStage::new), 10).starts_with("error:7\r\n")
        })
        .collect();
    assert!(greetings.contains(&true) && greetings.contains(&false));
}

#[test]
fn homing_says_one_thing_and_then_nothing_until_it_is_done() {
    let mut bench = switched_on();
    hear(&mut bench, 10);
    bench.send(b"$H\n");
    let first = hear(&mut bench, 5);
    assert!(first.starts_with("<Home|MPos:") && first.lines().count() == 1, "{first}");
    for _ in 0..5 {
        assert_eq!(ask(&mut bench, "?", 100), "");
    }
    assert_eq!(hear(&mut bench, 20_000), "ok\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:0.999,0.999,29.000");
    assert_near(true_mm(&bench), [1.0, 1.0, 29.0]);
}

#[test]
fn a_move_takes_its_time_and_ends_where_it_was_told() {
    let mut bench = homed();
    // 10 mm at 20 mm/s and 500 mm/s2: 0.54 s.
    assert_eq!(ask(&mut bench, "G90 G21 G1 X11 F1200", 0), "ok\r\n");
    hear(&mut bench, 262);
    let report = ask(&mut bench, "?", 5);
    assert!(report.starts_with("<Run|MPos:5.9") && report.contains("|Bf:14,128|FS:1200,0"), "{report}");
    hear(&mut bench, 262);
    assert!(status(&mut bench).starts_with("<Run|MPos:10.9"));
    hear(&mut bench, 10);
    assert_eq!(status(&mut bench), "<Idle|MPos:11.001,0.999,29.000", "in steps of 3 um");
    assert_near(true_mm(&bench), [11.0, 1.0, 29.0]);
    assert_eq!(ask(&mut bench, "G91 Z-2 F120", 5_000), "ok\r\n", "G1 stays in force");
    assert_eq!(status(&mut bench), "<Idle|MPos:11.001,0.999,27.000");
}

#[test]
fn hold_brakes_and_resume_is_heard_only_at_a_stand() {
    let mut bench = homed();
    ask(&mut bench, "G1 X11 F1200", 270);
    bench.send(b"!");
    assert!(status(&mut bench).starts_with("<Hold:1|MPos:6."));
    bench.send(b"~");
    hear(&mut bench, 100);
    assert_eq!(status(&mut bench), "<Hold:0|MPos:6.399,0.999,29.000");
    assert_eq!(ask(&mut bench, "G1 X1", 1000), "", "in a hold lines wait");
    bench.send(b"~");
    assert_eq!(hear(&mut bench, 5_000), "ok\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:0.999,0.999,29.000");
    assert_eq!(ask(&mut bench, "!", 0), "");
    assert!(status(&mut bench).starts_with("<Hold:0|"), "a hold at rest holds too");
}

#[test]
fn a_reset_at_a_stand_keeps_the_position_and_forgets_the_rest() {
    let mut bench = homed();
    ask(&mut bench, "G1 X11 F1200", 270);
    ask(&mut bench, "!", 100);
    assert_eq!(ask(&mut bench, "\x18", 10), "\r\nGrbl 1.1h ['$' for help]\r\n[MSG:Simulated stage]\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:6.399,0.999,29.000");
    hear(&mut bench, 5_000);
    assert_near(true_mm(&bench), [6.4, 1.0, 29.0]);
    assert_eq!(ask(&mut bench, "G1 X11", 0), "error:22\r\n", "the feed is forgotten too");
}

#[test]
fn a_reset_in_motion_stops_dead_and_may_or_may_not_be_noticed() {
    let noticed: Vec<_> = (0..20)
        .map(|seed| {
            let mut bench = DeviceBench::new(&sim_rig(), seed, VirtualStage::new);
            ask(&mut bench, "$H", 20_000);
            ask(&mut bench, "G1 X11 F1200", 270);
            let answer = ask(&mut bench, "\x18", 10);
            hear(&mut bench, 5_000);
            assert_near(true_mm(&bench), [6.0, 1.0, 29.0]);
            assert!(answer.contains("Grbl 1.1h"));
            assert_eq!(answer.starts_with("ALARM:3\r\n"), status(&mut bench).starts_with("<Alarm|"));
            answer.starts_with("ALARM:3\r\n")
        })
        .collect();
    assert!(noticed.contains(&true) && noticed.contains(&false));
}

#[test]
fn a_reset_ends_homing() {
    let mut bench = switched_on();
    hear(&mut bench, 10);
    ask(&mut bench, "$H", 500);
    assert!(ask(&mut bench, "\x18", 10).starts_with("ALARM:6\r\n"));
    assert!(status(&mut bench).starts_with("<Alarm|"));
}

#[test]
fn a_target_beyond_the_travel_is_an_alarm_that_needs_a_reset() {
    let mut bench = homed();
    ask(&mut bench, "G1 X11 F1200", 270);
    // It brakes before it raises the alarm; the line has no other answer.
    assert_eq!(ask(&mut bench, "G1 X99", 50), "ALARM:2\r\n[MSG:Reset to continue]\r\n");
    assert_near(true_mm(&bench), [6.4, 1.0, 29.0]);
    for line in ["G1 X1", "$X", "$H"] {
        assert_eq!(ask(&mut bench, line, 0), "error:9\r\n");
    }
    assert!(ask(&mut bench, "\x18", 10).ends_with("to unlock]\r\n"));
    assert_eq!(ask(&mut bench, "$X", 0), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:6.399,0.999,29.000", "nothing was lost");
}

#[test]
fn a_limit_switch_stops_dead_where_the_tip_truly_is() {
    let mut bench = switched_on();
    hear(&mut bench, 10);
    ask(&mut bench, "$X", 0);
    // Believed at 0, truly at 26.4 of 30 mm: the soft limits let it pass, the switch does not.
    assert_eq!(ask(&mut bench, "G1 Z10 F600", 1000), "ok\r\nALARM:1\r\n[MSG:Reset to continue]\r\n");
    assert_near(true_mm(&bench), [30.0, 25.0, 30.0]);
    assert_eq!(ask(&mut bench, "G1 Z0", 0), "error:9\r\n");
}

#[test]
fn jogs_are_checked_first_and_can_be_cancelled() {
    let mut bench = homed();
    for (line, error) in [
        ("$J=G91 X99 F1200", "error:15\r\n"),
        ("$J=G91 X10", "error:22\r\n"),
        ("$J=F1200", "error:26\r\n"),
        ("$J=G1 X10 F1200", "error:16\r\n"),
    ] {
        assert_eq!(ask(&mut bench, line, 0), error, "{line}");
    }
    assert_eq!(ask(&mut bench, "$J=G91 X10 F1200", 0), "ok\r\n");
    assert_eq!(ask(&mut bench, "$J=G91 X10 F1200", 265), "ok\r\n", "jogs queue up");
    assert_eq!(ask(&mut bench, "G1 X1 F1200", 0), "error:9\r\n");
    assert!(status(&mut bench).starts_with("<Jog|MPos:6."));
    bench.send(b"\x85");
    hear(&mut bench, 50);
    assert_eq!(
        status(&mut bench),
        "<Idle|MPos:6.399,0.999,29.000",
        "the second jog is forgotten with the first"
    );
    ask(&mut bench, "G1 X11 F1200", 0);
    assert_eq!(ask(&mut bench, "$J=G91 X1 F60", 0), "error:8\r\n");
}

#[test]
fn the_planner_takes_fifteen_moves_and_then_one_for_each_that_is_done() {
    let mut bench = homed();
    for _ in 0..18 {
        bench.send(b"G91G1X1F600\n");
    }
    assert_eq!(hear(&mut bench, 0), "ok\r\n".repeat(15));
    // 1 mm at 10 mm/s and 500 mm/s2 takes 0.12 s.
    assert_eq!(hear(&mut bench, 119), "");
    assert_eq!(hear(&mut bench, 2), "ok\r\n");
    hear(&mut bench, 18 * 120);
    assert_near(true_mm(&bench), [19.0, 1.0, 29.0]);
}

#[test]
fn a_second_question_is_dropped() {
    let mut bench = homed();
    bench.send(b"??");
    assert_eq!(hear(&mut bench, 100).lines().count(), 1);
}

#[test]
fn statements_and_settings() {
    let mut bench = homed();
    assert!(ask(&mut bench, "$I", 0).starts_with("[VER:1.1h.20190830:simulated by Tactus]\r\n"));
    let settings = ask(&mut bench, "$$", 0);
    for line in ["$20=1", "$102=1000.000", "$110=3000.000", "$120=500.000", "$132=36.000"] {
        assert!(settings.contains(&format!("{line}\r\n")), "{line} in {settings}");
    }
    assert_eq!(ask(&mut bench, "$10=0", 99), "", "a write takes 100 to 220 ms");
    assert_eq!(hear(&mut bench, 121), "ok\r\n");
    assert!(ask(&mut bench, "?", 5).starts_with("<Idle|WPos:0.999,0.999,29.000|FS:0,0"));
    for (line, error) in [("$foo", 3), ("$999=1", 3), ("$20=x", 2), ("$20=-1", 4), ("G1 X2", 22), ("G5", 20)]
    {
        assert_eq!(ask(&mut bench, line, 0), format!("error:{error}\r\n"), "{line}");
    }
    ask(&mut bench, "$22=0", 220);
    assert_eq!(ask(&mut bench, "$H", 0), "error:5\r\n");
    assert_eq!(ask(&mut bench, "", 0), "ok\r\n");
}

#[test]
fn a_dwell_is_answered_when_it_is_over() {
    let mut bench = homed();
    bench.send(b"G1 X11 F1200\nG4 P0.5\n");
    assert_eq!(hear(&mut bench, 540 + 499), "ok\r\n");
    assert_eq!(hear(&mut bench, 2), "ok\r\n");
}

#[test]
fn what_it_reports_may_be_wrong() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::Lie { z_mm: 0.05 }));
    assert_eq!(status(&mut bench), "<Idle|MPos:0.999,0.999,29.050");
    bench.fault(StageFault::Controller(ControllerFault::NeverIdle));
    assert!(status(&mut bench).starts_with("<Run|"));
    bench.fault(StageFault::Clear);
    assert_eq!(status(&mut bench), "<Idle|MPos:0.999,0.999,29.000");
}

#[test]
fn what_it_does_may_be_wrong() {
    let mut bench = homed();
    bench.fault(StageFault::Controller(ControllerFault::Refuse(33)));
    assert_eq!(ask(&mut bench, "G1 X11 F1200", 0), "error:33\r\n");
    bench.fault(StageFault::Controller(ControllerFault::LostSteps { lost_mm: 0.05 }));
    assert_eq!(ask(&mut bench, "G1 X11 F1200", 1000), "ok\r\n");
    assert_eq!(status(&mut bench), "<Idle|MPos:11.001,0.999,29.000");
    assert_near(true_mm(&bench), [10.95, 1.0, 29.0]);
    bench.fault(StageFault::Controller(ControllerFault::IgnoreMoves));
    assert_eq!(ask(&mut bench, "G1 X5 F1200", 1000), "ok\r\n");
    assert_near(true_mm(&bench), [10.95, 1.0, 29.0]);
    bench.fault(StageFault::Clear);
    bench.fault(StageFault::Controller(ControllerFault::HomingFails));
    assert!(ask(&mut bench, "$H", 23_999).starts_with("<Home|"));
    assert_eq!(hear(&mut bench, 2), "ALARM:9\r\n");
    assert_eq!(ask(&mut bench, "$H", 20_000).lines().last(), Some("ok"));
    assert_near(true_mm(&bench), [1.0, 1.0, 29.0]);
}

#[test]
fn alarms_and_resets_come_out_of_the_blue() {
    let mut bench = homed();
    ask(&mut bench, "G1 X11 F1200", 270);
    bench.fault(StageFault::Controller(ControllerFault::Alarm(1)));
    assert_eq!(hear(&mut bench, 1000), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
    assert_near(true_mm(&bench), [6.0, 1.0, 29.0]);
    bench.fault(StageFault::Controller(ControllerFault::Reset));
    assert!(hear(&mut bench, 10).contains("Grbl 1.1h"));
    assert_eq!(status(&mut bench), "<Alarm|MPos:0.000,0.000,0.000", "it no longer knows where it is");
    assert_near(true_mm(&bench), [6.0, 1.0, 29.0]);
}

#[test]
fn a_hung_controller_goes_on_moving_and_hears_later() {
    let mut bench = homed();
    ask(&mut bench, "G1 X11 F1200", 270);
    bench.fault(StageFault::Stall(Duration::from_secs(2)));
    assert_eq!(ask(&mut bench, "!", 1000), "");
    assert_eq!(ask(&mut bench, "?", 900), "");
    let late = hear(&mut bench, 200);
    assert!(late.starts_with("<Hold:0|MPos:11.001,0.999,29.000"), "{late}");
}

#[test]
fn an_echo_comes_with_garbage() {
    let mut bench = homed();
    bench.fault(StageFault::EchoGarbage);
    bench.send(b"$G\n");
    let answer = bench.bytes(0);
    assert!(answer.starts_with(b"$G\n"));
    assert!(answer.ends_with(b"[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n"));
    assert_eq!(answer.len(), 3 + GARBAGE_BYTES + 2 + 44 + 4);
}
