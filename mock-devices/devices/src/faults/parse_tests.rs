use super::*;

fn parse(line: &str) -> Result<InjectedFault, FaultError> {
    line.parse()
}

#[test]
fn every_fault_has_its_line() {
    use {ControllerFault as C, LinkFault as L, RigFault as R, SensorFault as S, StageFault as T};
    let two_seconds = Duration::from_secs(2);
    for (line, fault) in [
        ("sensor clock-jump -500ms", S::ClockJump { ms: -500 }),
        ("sensor clock-wrap", S::ClockWrap),
        ("sensor clock-drift -50", S::ClockDrift { ppm: -50 }),
        ("sensor stuck 7", S::Stuck(7)),
        ("sensor saturate 7", S::Saturate(7)),
        ("  sensor   clear ", S::Clear),
    ] {
        assert_eq!(parse(line), Ok(InjectedFault::Sensor(fault)), "{line}");
    }
    for (line, fault) in [
        ("sensor stall 2s", L::Stall(two_seconds)),
        ("sensor drip 0.5s", L::Drip(Duration::from_millis(500))),
        ("sensor drop 5", L::Drop(5)),
        ("sensor drop-frames 5", L::DropFrames(5)),
        ("sensor flip-bits 3", L::FlipBits(3)),
        ("sensor garbage 64", L::Garbage(64)),
        ("sensor duplicate", L::Duplicate),
        ("sensor reorder", L::Reorder),
        ("sensor wrong-checksum", L::WrongChecksum),
        ("sensor truncate", L::Truncate),
        ("sensor burst 10", L::Burst(10)),
        ("sensor wrong-count 47", L::WrongCount(47)),
    ] {
        assert_eq!(parse(line), Ok(InjectedFault::Sensor(S::Link(fault))), "{line}");
    }
    for (line, fault) in [
        ("stage echo-garbage", T::EchoGarbage),
        ("stage stall 2s", T::Stall(two_seconds)),
        ("stage clear", T::Clear),
    ] {
        assert_eq!(parse(line), Ok(InjectedFault::Stage(fault)), "{line}");
    }
    for (line, fault) in [
        ("stage alarm 1", C::Alarm(1)),
        ("stage lie -0.05", C::Lie { z_mm: -0.05 }),
        ("stage never-idle", C::NeverIdle),
        ("stage refuse", C::Refuse(33)),
        ("stage refuse 9", C::Refuse(9)),
        ("stage ignore-moves", C::IgnoreMoves),
        ("stage reset", C::Reset),
        ("stage lost-steps 0.05", C::LostSteps { lost_mm: 0.05 }),
        ("stage work-offset -2", C::WorkOffset { mm: -2.0 }),
        ("stage homing-fails", C::HomingFails),
    ] {
        assert_eq!(parse(line), Ok(InjectedFault::Stage(T::Controller(fault))), "{line}");
    }
    for (line, fault) in [
        ("sensor disconnect 2000ms", InjectedFault::SensorCable(CableFault::Disconnect(two_seconds))),
        ("sensor renumber", InjectedFault::SensorCable(CableFault::Renumber)),
        ("stage disconnect 2s", InjectedFault::StageCable(CableFault::Disconnect(two_seconds))),
        ("stage renumber", InjectedFault::StageCable(CableFault::Renumber)),
    ] {
        assert_eq!(parse(line), Ok(fault), "{line}");
    }
    for (line, fault) in [
        ("rig covering 2.54", R::Covering { thickness_mm: 2.54 }),
        ("rig surface -0.1", R::Surface { z_mm: -0.1 }),
        ("rig stiffness 3", R::Stiffness(3.0)),
    ] {
        assert_eq!(parse(line), Ok(InjectedFault::Rig(fault)), "{line}");
    }
}

#[test]
fn what_is_no_fault_is_refused_in_words() {
    for (line, words) in [
        ("", "\"\" is no device; there is: sensor, stage, rig"),
        ("robot stall 2s", "\"robot\" is no device"),
        ("sensor", "the sensor has no fault \"\"; there is: burst N, clear"),
        ("stage explode", "the stage has no fault \"explode\"; there is: alarm N"),
        ("sensor stall", "stall needs a duration such as 2s or 500ms"),
        ("sensor stall 2", "stall needs a duration such as 2s or 500ms, not \"2\""),
        ("sensor stall -2s", "not \"-2s\""),
        ("sensor stall 1e300s", "not \"1e300s\""),
        ("sensor stall NaNs", "not \"NaNs\""),
        ("sensor drop 99999", "drop needs a number from 0 to 32000, not \"99999\""),
        ("stage alarm 0", "alarm needs a number from 1 to 99, not \"0\""),
        ("stage lie inf", "lie needs a length in mm, not \"inf\""),
        ("rig covering 0", "covering needs a positive thickness in mm, not \"0\""),
        ("sensor duplicate 2", "duplicate takes nothing more, but \"2\" follows"),
    ] {
        let error = parse(line).unwrap_err().to_string();
        assert!(error.contains(words), "{line}: {error}");
    }
}
