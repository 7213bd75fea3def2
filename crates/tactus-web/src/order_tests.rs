use super::*;

fn run_of(body: &str) -> Result<pb::RunRequest, String> {
    match Order::of("run", body.as_bytes()).unwrap()? {
        Order::Run(request) => Ok(request),
        Order::Pause | Order::Resume { .. } | Order::Reset => unreachable!("run is a run"),
    }
}

#[test]
fn a_form_becomes_a_request_of_an_experiment_by_name() {
    let body = r#"{"experiment":"corners","parameters":{"depth_mm":0.3},"seed":"18446744073709551615","who":" ada\n "}"#;
    let request = run_of(body).unwrap();
    assert_eq!((request.experiment.as_str(), request.who.as_str()), ("corners", "ada"));
    assert_eq!(request.parameters_json, r#"{"depth_mm":0.3}"#);
    assert_eq!(request.seed, Some(u64::MAX));
    assert!(request.script.is_empty() && request.lease.is_empty());
    assert_eq!(run_of(r#"{"experiment":"corners"}"#).unwrap().seed, None);
}

#[test]
fn what_is_no_form_is_refused_with_the_reason() {
    for (body, reason) in [
        ("", "not understood"),
        ("[]", "not understood"),
        (r#"{"experiment":"corners","script":"def run(rig): pass"}"#, "unknown field"),
        (r#"{"experiment":"corners","seed":"-1"}"#, "the seed is a whole number"),
        (r#"{"experiment":""}"#, "names no experiment"),
        (r#"{"experiment":"corners","parameters":[1]}"#, "not understood"),
    ] {
        let error = run_of(body).unwrap_err();
        assert!(error.contains(reason), "{body}: {error}");
    }
    assert!(Order::of("move", br#"{"x_mm":1e999,"y_mm":0}"#).unwrap().is_err());
    assert!(Order::of("resume", b"{").unwrap().is_err());
    assert_eq!(Order::of("fire", b""), None);
}

#[test]
fn a_move_is_a_run_of_its_experiment() {
    for (body, parameters) in [
        (r#"{"x_mm":1.5,"y_mm":-2}"#, r#"{"x_mm":1.5,"y_mm":-2.0}"#),
        (r#"{"x_mm":1.5,"y_mm":-2,"height_mm":0}"#, r#"{"height_mm":0.0,"x_mm":1.5,"y_mm":-2.0}"#),
    ] {
        let Some(Ok(Order::Run(request))) = Order::of("move", body.as_bytes()) else {
            panic!("a move is a run")
        };
        assert_eq!((request.experiment.as_str(), request.parameters_json.as_str()), ("move-to", parameters));
    }
    assert_eq!(
        Order::of("resume", br#"{"covering_mm":2.54}"#),
        Some(Ok(Order::Resume { covering_mm: Some(2.54) }))
    );
    assert_eq!(Order::of("resume", b""), Some(Ok(Order::Resume { covering_mm: None })));
}
