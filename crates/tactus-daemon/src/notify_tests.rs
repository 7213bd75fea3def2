use super::*;

const PATIENCE: Duration = Duration::from_secs(1);

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::from_ns(ms * 1_000_000)
}

fn everything_at(ms: i64) -> Progress {
    Progress { acquisition: Some(at_ms(ms)), stage: Some(at_ms(ms)), recorder: Some(at_ms(ms)) }
}

/// The verdicts of looks at these times.
fn verdicts(watch: &mut Watch, progress: Progress, looks_ms: &[i64]) -> Vec<Liveness> {
    looks_ms.iter().map(|ms| watch.judge(progress, at_ms(*ms))).collect()
}

#[test]
fn each_part_that_hangs_alone_is_named_and_forgiven_only_by_progress() {
    let held = Some(at_ms(0));
    for (progress, part) in [
        (Progress { acquisition: held, ..everything_at(2_000) }, "acquisition"),
        (Progress { stage: held, ..everything_at(2_000) }, "the stage's driver"),
        (Progress { recorder: held, ..everything_at(2_000) }, "the recorder"),
    ] {
        let mut watch = Watch::new(at_ms(0), PATIENCE);
        let looks = [250, 500, 750, 1_000, 1_250, 1_500];
        let mut wanted = vec![Liveness::Alive; 4];
        wanted.extend([Liveness::Hangs(part), Liveness::StillHangs(part)]);
        assert_eq!(verdicts(&mut watch, progress, &looks), wanted);
        let wanted = [Liveness::Recovered, Liveness::Alive];
        assert_eq!(verdicts(&mut watch, everything_at(1_700), &[1_750, 2_000]), wanted);
    }
}

#[test]
fn systemd_restarts_the_service_only_if_every_rig_hangs_and_still_does() {
    let (alive, back) = (Liveness::Alive, Liveness::Recovered);
    let (hangs, still) = (Liveness::Hangs("acquisition"), Liveness::StillHangs("the recorder"));
    for one_lives in [&[][..], &[alive], &[back], &[hangs, alive], &[still, still, back], &[alive, still]] {
        assert_eq!(of_all(one_lives), Some(Message::Alive), "{one_lives:?}");
    }
    for just_now in [&[hangs][..], &[still, hangs]] {
        assert_eq!(of_all(just_now), None, "{just_now:?}");
    }
    for for_a_while in [&[still][..], &[still, still]] {
        assert_eq!(of_all(for_a_while), Some(Message::Hangs), "{for_a_while:?}");
    }
}

#[test]
fn a_part_with_nothing_to_do_does_not_hang() {
    let mut watch = Watch::new(at_ms(0), PATIENCE);
    let idle = Progress { stage: None, recorder: None, ..everything_at(1_500) };
    assert_eq!(verdicts(&mut watch, idle, &[500, 1_000, 1_500]), [Liveness::Alive; 3]);
}

#[test]
fn a_look_that_is_late_itself_accuses_nobody() {
    // As after a pause of the whole process: nobody had time for progress.
    let mut watch = Watch::new(at_ms(0), PATIENCE);
    let looks = [250, 10_000, 10_250, 10_500, 10_750, 11_000, 11_250];
    let mut wanted = vec![Liveness::Alive; 6];
    wanted.push(Liveness::Hangs("acquisition"));
    assert_eq!(verdicts(&mut watch, everything_at(240), &looks), wanted);
}

/// Judgements of looks four times a second, while the recorder shows this.
fn of_recorder(signs: &[Option<u64>]) -> Vec<Liveness> {
    let (mut watch, mut recorded) = (Watch::new(at_ms(0), PATIENCE), Changes::default());
    let looks = signs.iter().zip(1..).map(|(sign, nth)| {
        let now = at_ms(nth * 250);
        let progress = Progress { recorder: recorded.look(*sign, now), ..everything_at(nth * 250) };
        watch.judge(progress, now)
    });
    looks.collect()
}

#[test]
fn a_recorder_that_beats_goes_on_and_one_that_does_not_hangs() {
    let beating: Vec<_> = (0..20).map(Some).collect();
    assert_eq!(of_recorder(&beating), [Liveness::Alive; 20]);
    let stuck = [Some(7); 8];
    let hangs = Liveness::Hangs("the recorder");
    let still = Liveness::StillHangs("the recorder");
    let mut wanted = vec![Liveness::Alive; 5];
    wanted.extend([hangs, still, still]);
    assert_eq!(of_recorder(&stuck), wanted);
}

#[test]
fn a_recorder_that_waits_for_its_disk_for_a_minute_is_no_part_that_hangs() {
    let mut signs = vec![Some(1), Some(2)];
    signs.extend([None; 240]);
    signs.extend([Some(3), Some(4)]);
    assert!(of_recorder(&signs).iter().all(|verdict| *verdict == Liveness::Alive));
}

#[test]
fn between_two_runs_no_recorder_is_waited_for() {
    let mut signs = vec![Some(1), Some(2), None, None, None, None, None, None];
    signs.extend([Some(1), Some(2)]);
    assert!(of_recorder(&signs).iter().all(|verdict| *verdict == Liveness::Alive));
}
