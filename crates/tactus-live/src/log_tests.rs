use super::*;

fn started(run_id: &str, t_wall_ns: i64) -> pb::RunEvent {
    let started = pb::RunStarted { experiment: "corners".into(), who: "ada".into(), ..Default::default() };
    pb::RunEvent {
        run_id: run_id.into(),
        t_wall_ns,
        event: Some(Event::Started(started)),
        ..Default::default()
    }
}

fn logged(run_id: &str, seq: u64, message: &str) -> pb::RunEvent {
    let event = Some(Event::Log(pb::Log { message: message.into() }));
    pb::RunEvent { run_id: run_id.into(), seq, event, ..Default::default() }
}

fn safety(seq: u64, t_wall_ns: i64) -> pb::SafetyEvent {
    let verdict = pb::SafetyVerdict::Stopped.into();
    pb::SafetyEvent {
        seq,
        t_wall_ns,
        verdict,
        rule: "load".into(),
        detail: "too much".into(),
        ..Default::default()
    }
}

fn texts(log: &Log) -> Vec<String> {
    let entries = log.json_from(0);
    let text = |entry: &Value| entry["text"].as_str().unwrap().to_owned();
    entries.as_array().unwrap().iter().map(text).collect()
}

#[test]
fn safety_news_belongs_to_the_run_that_had_started_last() {
    let mut log = Log::default();
    log.on_event(&started("r1", 100));
    log.on_event(&started("r2", 200));
    assert_eq!(log.run_at(50), "");
    log.on_safety(&safety(0, 150));
    log.on_safety(&safety(1, 250));
    let runs: Vec<_> =
        log.json_from(2).as_array().unwrap().iter().map(|entry| entry["run_id"].clone()).collect();
    assert_eq!(runs, ["r1", "r2"]);
    assert_eq!(log.who("r1"), "ada");
    assert_eq!(log.who("r3"), "");
}

#[test]
fn what_the_service_tells_again_is_not_logged_twice() {
    let mut log = Log::default();
    for _ in 0..2 {
        log.on_event(&started("r1", 100));
        log.on_event(&logged("r1", 1, "element 3 is centred"));
        log.on_safety(&safety(0, 150));
    }
    assert_eq!(log.next(), 3, "{:?}", texts(&log));
    log.on_event(&logged("r1", 2, "element 4 is centred"));
    assert_eq!(log.next(), 4);
}

#[test]
fn it_is_bounded_in_entries_and_in_text() {
    let mut log = Log::default();
    for seq in 0..1_000 {
        log.on_event(&logged("r1", seq + 1, &"ä".repeat(2_000)));
    }
    assert_eq!(log.entries.len(), ENTRIES_MAX);
    assert!(texts(&log).iter().all(|text| text.len() <= TEXT_BYTES_MAX + 4));
    for run in 0..3_000 {
        log.on_event(&started(&format!("r{run}"), run));
    }
    assert_eq!(log.runs.len(), RUNS_MAX);
}

#[test]
fn a_tip_that_is_not_retracted_is_said_in_capitals() {
    let cleanup = |retracted| Event::Cleanup(pb::Cleanup { retracted, ..Default::default() });
    assert_eq!(in_words(&cleanup(true)).unwrap().0, Weight::Note);
    let (weight, text) = in_words(&cleanup(false)).unwrap();
    assert!(weight == Weight::Stop && text.starts_with("TIP NOT RETRACTED"), "{text}");
}
