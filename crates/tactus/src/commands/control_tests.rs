use super::*;

#[test]
fn the_next_command_is_one_that_works() {
    let run = |phase: pb::RunPhase| pb::RunState { phase: phase.into(), ..Default::default() };
    let next = |phase, is_held| next_command(&run(phase), is_held).unwrap();
    assert!(next(pb::RunPhase::Running, false).contains("`tactus pause` holds it"));
    assert!(next(pb::RunPhase::Running, true).contains("`tactus pause --take-over REASON` holds it"));
    assert!(next(pb::RunPhase::Paused, true).contains("`tactus resume --take-over REASON` continues"));
    let faulty = pb::RunState { fault: "a fault".into(), ..run(pb::RunPhase::Idle) };
    assert_eq!(next_command(&faulty, false), None);
}
