use proptest::prelude::*;

use super::Response;
use crate::grbl::{alarm_meaning, error_meaning};

#[test]
fn each_kind_of_line() {
    let golden = [
        ("ok", Response::Ok),
        ("error:9", Response::Error(9)),
        ("ALARM:1", Response::Alarm(1)),
        ("Grbl 1.1h ['$' for help]", Response::Banner("Grbl 1.1h ['$' for help]".into())),
        ("\x01~GrblHAL 1.1f ['$HELP' for help]", Response::Banner("GrblHAL 1.1f ['$HELP' for help]".into())),
        ("[MSG:'$H'|'$X' to unlock]", Response::Message("'$H'|'$X' to unlock".into())),
        ("[PRB:1.000,2.000,-0.250:1]", Response::Probe { position_mm: [1.0, 2.0, -0.25], touched: true }),
        ("[PRB:1.000,2.000,-0.250:0]", Response::Probe { position_mm: [1.0, 2.0, -0.25], touched: false }),
        ("$110=500.000", Response::Setting { number: 110, value: "500.000".into() }),
        ("[GC:G0 G54 G17 G21 G90 G94]", Response::Feedback("GC:G0 G54 G17 G21 G90 G94".into())),
    ];
    for (line, response) in golden {
        assert_eq!(Response::parse(line), response);
    }
    assert!(matches!(Response::parse("<Idle|MPos:0.000,0.000,0.000|FS:0,0>"), Response::Status(_)));
}

#[test]
fn broken_lines_are_unknown() {
    for line in
        ["okk", "k", "error:", "error:999", "ALARM:-1", "<Idle|MPos:0,0", "[PRB:1,2:1]", "$H", "$x=1", "?"]
    {
        assert_eq!(Response::parse(line), Response::Unknown(line.into()));
    }
}

#[test]
fn numbers_have_words() {
    assert_eq!(error_meaning(9), "locked by an alarm or a jog");
    assert_eq!(alarm_meaning(1), "a hard limit switch was hit");
    assert_eq!(error_meaning(200), "an error that is not in Grbl's list");
    assert_eq!(alarm_meaning(200), "an alarm that is not in Grbl's list");
}

proptest! {
    #[test]
    fn any_line_is_read(line in "\\PC{0,60}") {
        Response::parse(&line);
    }
}
