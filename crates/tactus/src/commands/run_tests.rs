use super::*;

#[test]
fn the_name_of_a_run_is_a_folder_below_the_callers_and_nowhere_else() {
    let out = Path::new("runs");
    assert_eq!(
        folder_of("20261123T014500-corners-1a2b", out).unwrap(),
        Path::new("runs/20261123T014500-corners-1a2b")
    );
    for run_id in ["", ".", "..", "../etc", "/etc", "a/b", ".ssh", "a\\b", "a\0b", "a\nb"] {
        let error = folder_of(run_id, out).unwrap_err().to_string();
        assert!(error.contains("no name for a folder"), "{run_id:?}: {error}");
    }
}

#[test]
fn a_service_cannot_choose_where_its_report_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (bait, out) = (folder.path().join("bait"), folder.path().join("out"));
    std::fs::create_dir(&bait).unwrap();
    std::fs::write(bait.join("recording.mcap"), "no recording").unwrap();
    std::fs::write(bait.join("report.html"), "mine").unwrap();
    let summary = RunSummary {
        run_id: "r1".into(),
        experiment: "corners".into(),
        exit_status: pb::ExitStatus::Done,
        message: String::new(),
        simulated: true,
        embedded: false,
        frames: 0,
        frames_lost: 0,
        presses: 0,
        dwells: 0,
        duration_s: 0.0,
        recording: bait.join("recording.mcap"),
        taken_over: None,
    };
    assert_eq!(make_report(&summary, &out), None);
    assert_eq!(std::fs::read_to_string(bait.join("report.html")).unwrap(), "mine");
    assert_eq!(std::fs::read_dir(&bait).unwrap().count(), 2);
    assert_eq!(make_report(&RunSummary { run_id: "../bait".into(), ..summary }, &out), None);
    assert_eq!(std::fs::read_dir(&bait).unwrap().count(), 2);
}
