//! Meanings of error and alarm numbers.

/// What `error:n` means.
pub fn error_meaning(code: u8) -> &'static str {
    match code {
        1 => "a word has no letter",
        2 => "a number is missing or malformed",
        3 => "unknown $ command",
        4 => "a value is negative",
        5 => "homing is switched off in the controller ($22)",
        6 => "the step pulse is too short",
        7 => "the stored settings could not be read; defaults are in force",
        8 => "the command needs the controller to be idle",
        9 => "locked by an alarm or a jog",
        10 => "soft limits need homing to be switched on",
        11 => "the line is too long",
        12 => "the step rate is too high",
        13 => "the safety door is open",
        14 => "the start-up line or build information is too long",
        15 => "the target is outside the controller's travel",
        16 => "malformed jog",
        17 => "laser mode needs a variable spindle",
        20 => "unknown or unsupported G-code",
        21 => "two commands of one modal group in a line",
        22 => "no feed rate is set",
        23 => "a value must be a whole number",
        24 => "two commands of the line want the same axes",
        25 => "a word occurs twice",
        26 => "the command lacks an axis",
        27 => "the line number is out of range",
        28 => "the command lacks a value",
        29 => "there is no such work coordinate system",
        30 => "machine coordinates go with G0 and G1 only",
        31 => "the command takes no axes",
        32 => "the arc has no axis in its plane",
        33 => "the target of the motion is invalid",
        34 => "the arc's radius is impossible",
        35 => "the arc has no offset in its plane",
        36 => "the line has values that no command uses",
        37 => "the tool offset is for another axis",
        38 => "the tool number is too high",
        _ => "an error that is not in Grbl's list",
    }
}

/// What `ALARM:n` means.
pub fn alarm_meaning(code: u8) -> &'static str {
    match code {
        0 => "an alarm whose number was not told",
        1 => "a hard limit switch was hit",
        2 => "the target is outside the controller's travel (soft limit)",
        3 => "reset while moving: steps may be lost",
        4 => "the probe was not in its initial state",
        5 => "the probe did not touch within its travel",
        6 => "homing was ended by a reset",
        7 => "homing was ended by the safety door",
        8 => "homing could not leave the limit switch",
        9 => "homing did not find the limit switch",
        10 => "emergency stop, or homing failed on the second motor of an axis",
        11 => "homing is required",
        12 => "a limit switch is engaged",
        13 => "probe protection was triggered",
        14 => "the spindle did not reach its speed",
        15 => "homing failed on the second motor of an axis",
        17 => "a motor reports a fault",
        _ => "an alarm that is not in Grbl's list",
    }
}
