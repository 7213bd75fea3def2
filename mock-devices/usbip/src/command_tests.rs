use super::*;

#[test]
fn each_command() {
    for (line, device, command) in [
        ("sensor unplug", "sensor", PlugCommand::Unplug),
        ("stage plug", "stage", PlugCommand::Plug),
        ("sensor  plug elsewhere", "sensor", PlugCommand::PlugElsewhere),
        ("sensor halt", "sensor", PlugCommand::Halt),
        ("sensor slow 50ms", "sensor", PlugCommand::Slow(Duration::from_millis(50))),
        ("sensor slow 0s", "sensor", PlugCommand::Slow(Duration::ZERO)),
    ] {
        assert_eq!(PlugCommand::parse(line), Some((device, Ok(command))), "{line}");
    }
}

#[test]
fn what_is_wrong_with_a_line() {
    for (line, words) in [
        ("sensor slow", "slow takes a duration such as 50ms, or 0s, not \"\""),
        ("sensor slow 5", "slow takes a duration such as 50ms, or 0s, not \"5\""),
        ("sensor halt 2s", "halt takes nothing more, not \"2s\""),
        ("stage plug nowhere", "plug takes nothing more, not \"nowhere\""),
    ] {
        let Some((_, Err(error))) = PlugCommand::parse(line) else { panic!("{line}") };
        assert_eq!(error.to_string(), words);
    }
}

#[test]
fn other_lines_are_perhaps_faults() {
    for line in ["", "sensor", "sensor stall 2s", "rig covering 2", "unplug sensor"] {
        assert_eq!(PlugCommand::parse(line), None, "{line}");
    }
}
