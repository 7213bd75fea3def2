use super::*;

const PATIENCE: Duration = Duration::from_secs(1);

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::from_ns(ms * 1_000_000)
}

fn everything_at(ms: i64) -> Progress {
    Progress { acquisition: Some(at_ms(ms)), stage: Some(at_ms(ms)), recorder: Some(at_ms(ms)) }
}

#[test]
fn each_part_that_hangs_alone_is_named_and_then_forgiven_only_by_progress() {
    let held = Some(at_ms(10_000));
    for (progress, part) in [
        (Progress { acquisition: held, ..everything_at(12_000) }, "acquisition"),
        (Progress { stage: held, ..everything_at(12_000) }, "the stage's driver"),
        (Progress { recorder: held, ..everything_at(12_000) }, "the recorder"),
    ] {
        let mut watch = Watch::new(at_ms(0), PATIENCE);
        assert_eq!(watch.judge(progress, at_ms(11_000)), Verdict::Alive);
        assert_eq!(watch.judge(progress, at_ms(11_001)), Verdict::Hangs(part));
        assert_eq!(watch.judge(progress, at_ms(11_250)), Verdict::StillHangs(part));
        assert_eq!(watch.judge(everything_at(11_400), at_ms(11_500)), Verdict::Recovered);
        assert_eq!(watch.judge(everything_at(11_700), at_ms(11_750)), Verdict::Alive);
    }
}

#[test]
fn a_part_with_nothing_to_do_does_not_hang() {
    let mut watch = Watch::new(at_ms(0), PATIENCE);
    let idle = Progress { stage: None, recorder: None, ..everything_at(9_900) };
    assert_eq!(watch.judge(idle, at_ms(10_000)), Verdict::Alive);
}

#[test]
fn a_new_service_has_its_patience_before_the_first_progress() {
    let mut watch = Watch::new(at_ms(5_000), PATIENCE);
    assert_eq!(watch.judge(everything_at(0), at_ms(6_000)), Verdict::Alive);
    assert_eq!(watch.judge(everything_at(0), at_ms(6_001)), Verdict::Hangs("acquisition"));
}
