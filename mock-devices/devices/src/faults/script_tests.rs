use super::*;
use crate::faults::{ControllerFault, LinkFault, SensorFault, StageFault};

#[test]
fn faults_come_in_order_of_time() {
    let script = FaultScript::from_toml(
        r#"
        [[fault]]
        at_s = 3.5
        command = "sensor duplicate"
        [[fault]]
        at_s = 1
        command = "stage reset"
        "#,
    )
    .unwrap();
    let at = |s| Duration::from_secs_f64(s);
    assert_eq!(
        script.faults,
        [
            TimedFault {
                at: at(1.0),
                fault: InjectedFault::Stage(StageFault::Controller(ControllerFault::Reset))
            },
            TimedFault { at: at(3.5), fault: InjectedFault::Sensor(SensorFault::Link(LinkFault::Duplicate)) },
        ]
    );
    assert_eq!(FaultScript::from_toml(""), Ok(FaultScript::default()));
}

#[test]
fn a_wrong_entry_is_refused_with_its_place() {
    for (text, words) in [
        (
            "[[fault]]\nat_s = 1\ncommand = \"stage jump\"",
            "fault[0].command: the stage has no fault \"jump\"",
        ),
        ("[[fault]]\nat_s = -1.0\ncommand = \"stage reset\"", "fault[0].at_s: seconds from 0 on, not -1"),
        ("[[fault]]\nat_s = nan\ncommand = \"stage reset\"", "fault[0].at_s"),
        ("[[fault]]\nat = 1\ncommand = \"stage reset\"", "line 2"),
    ] {
        let error = FaultScript::from_toml(text).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
