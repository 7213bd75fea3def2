use super::*;

fn event(event: Event, t_wall_ns: i64) -> pb::RunEvent {
    pb::RunEvent { run_id: "r1".into(), t_wall_ns, event: Some(event), ..Default::default() }
}

fn tare(counts: f32, t_wall_ns: i64) -> pb::RunEvent {
    event(Event::TareDone(pb::TareDone { baseline_counts: vec![counts; 2], ..Default::default() }), t_wall_ns)
}

fn frame(flags: u32, t_wall_ns: i64) -> pb::Frame {
    pb::Frame { flags, t_wall_ns, ..Default::default() }
}

#[test]
fn before_anything_is_measured_the_rig_files_baseline_counts() {
    let mut zero = Zero::default();
    assert_eq!(zero.json(), Value::Null);
    zero.describe(&pb::RigDescription { baseline_counts: vec![100.0; 2], ..Default::default() });
    assert_eq!(zero.json()["counts"], json!([100.0, 100.0]));
    assert_eq!(zero.json()["source"], "rig file");
}

#[test]
fn a_runs_zero_replaces_what_was_there_and_the_latest_counts() {
    let mut zero = Zero::default();
    zero.take(vec![7.0; 2], &frame(0, 1));
    let reference = pb::ReferenceDone { mean_counts: vec![101.0; 2], ..Default::default() };
    zero.on_event(&event(Event::ReferenceDone(reference), 2));
    assert_eq!((&zero.json()["source"], &zero.json()["run_id"]), (&json!("reference"), &json!("r1")));
    zero.on_event(&tare(102.0, 3));
    zero.on_event(&event(Event::Log(pb::Log::default()), 4));
    assert_eq!(zero.json()["counts"], json!([102.0, 102.0]));
}

#[test]
fn a_sensor_that_connects_anew_voids_older_zeros_only() {
    let mut zero = Zero::default();
    zero.on_event(&tare(102.0, 10));
    assert!(!zero.on_frame(&frame(0, 11), false));
    assert!(
        !zero.on_frame(&frame(pb::FrameFlag::NewEpoch as u32, 9), false),
        "history: the tare came after it"
    );
    assert!(zero.on_frame(&frame(pb::FrameFlag::NewEpoch as u32, 12), false));
    assert_eq!(zero.json(), Value::Null);
}

#[test]
fn a_service_that_has_restarted_voids_older_zeros_only() {
    let mut zero = Zero::default();
    zero.on_event(&tare(102.0, 10));
    assert!(
        !zero.on_frame(&frame(0, 9), true),
        "the new service's tare came before its first frame was seen here"
    );
    assert!(zero.on_frame(&frame(0, 11), true));
}
