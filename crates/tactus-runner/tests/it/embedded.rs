//! The embedded rig: production drivers and engine against virtual devices, in virtual time.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use tactus_device::{Clock, SensorCodec};
use tactus_plan::{Arguments, InThisProcess, Script};
use tactus_runner::config::RigFiles;
use tactus_runner::continuation::{self, ContinuationError};
use tactus_runner::embedded::{self, EmbeddedError, Finished, Pace, SIMULATED_RIG, Truth};
use tactus_runner::order::RunRequest;
use tactus_runner::{crashed, devices, experiments};
use tactus_schema::Rig;
use tactus_schema::pb::ExitStatus;
use tactus_schema::rig::ElementFault;
use tempfile::TempDir;

fn run(script: Script, arguments: Arguments, rig_toml: &str) -> Result<(Finished, TempDir), EmbeddedError> {
    let folder = TempDir::new().unwrap();
    let rig = RigFiles::of(rig_toml, Path::new("rig.toml")).unwrap();
    let request = RunRequest {
        script,
        arguments,
        seed: Some(1),
        who: "test".into(),
        evaluator: Arc::new(InThisProcess),
    };
    let finished = embedded::run(&rig, None, request, folder.path(), Pace::Virtual, &|| false, |_, _| {})?;
    Ok((finished, folder))
}

#[test]
fn element_centres_presses_every_element_five_deep() {
    let script = experiments::find("element-centres", None).unwrap();
    let (Finished { outcome, recording }, _folder) =
        run(script, Arguments::default(), SIMULATED_RIG).unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    assert_eq!((outcome.presses, outcome.dwells, outcome.frames_lost), (48, 240, 0));
    assert!((outcome.travel_mm[2][0] + 0.6).abs() < 1e-9, "{:?}", outcome.travel_mm);
    assert!(recording.is_file());
}

#[test]
fn what_the_twin_refuses_leaves_nothing_behind() {
    let script = Script::parse("deep", "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.9])\n").unwrap();
    let Err(EmbeddedError::NotPossible(plan)) = run(script, Arguments::default(), SIMULATED_RIG) else {
        unreachable!("0.9 mm is deeper than the covering allows");
    };
    assert_eq!(plan.outcome.exit_status, ExitStatus::Refused);
    assert!(plan.outcome.message.contains("deep.star:2"), "{}", plan.outcome.message);
}

#[test]
fn the_truth_is_the_rig_files_and_the_devices_own() {
    let toml = SIMULATED_RIG
        .replace("surface_mm = 0.0", "surface_mm = 0.05\nstuck = [{ element = 5, counts = 812 }]");
    let rig = Rig::from_toml(&toml).unwrap();
    let truth = embedded::truth(&rig).unwrap();
    assert_eq!((truth.surface_mm, truth.noise_rms_counts, truth.model.psf()), (0.05, 2.0, rig.psf));
    assert!((truth.registration.origin_mm[0] - 20.06).abs() < 1e-12);
    let response = truth.model.response();
    assert_eq!(response.quadratic_per_mm, [0.15; 48]);
    assert!(response.sensitivity_counts_per_mm.iter().all(|gain| (600.0..1400.0).contains(gain)));
    let faults = [
        (5, ElementFault::Stuck { counts: 812 }),
        (18, ElementFault::Miswired { answers_for: 19 }),
        (22, ElementFault::Miswired { answers_for: 23 }),
    ];
    assert_eq!(truth.faults, BTreeMap::from(faults));

    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
    let of_the_devices = runtime.unwrap().block_on(async {
        let service = rig.service.as_ref().unwrap();
        let codec = SensorCodec::default();
        devices::open(&rig, service, codec, || Truth::of_rig(&rig, truth.seed), Clock::paused())
            .control
            .unwrap()
            .truth()
    });
    assert_eq!(format!("{truth:?}"), format!("{of_the_devices:?}"));
}

#[test]
fn a_rig_that_hides_nothing_has_no_truth() {
    let simulated = Rig::from_toml(SIMULATED_RIG).unwrap();
    let real = Rig { simulated: false, ..simulated.clone() };
    let of_data = Rig::from_json(&simulated.to_json()).unwrap();
    assert!(embedded::truth(&real).is_none() && embedded::truth(&of_data).is_none());
}

#[test]
fn a_run_on_a_stage_that_speaks_zaber_is_done_and_goes_no_deeper_than_it_may() {
    let toml = SIMULATED_RIG.replace(
        "protocol = \"grbl\"\n",
        "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.047625, direction = -1, origin_microsteps = 629_921 }
",
    );
    let script = Script::parse(
        "two",
        "def run(rig):\n    for x in (5.0, 9.0):\n        press(x, 5.0, depths_mm = [0.2, 0.6])\n",
    );
    let (Finished { outcome, .. }, _folder) = run(script.unwrap(), Arguments::default(), &toml).unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    assert_eq!((outcome.presses, outcome.dwells, outcome.frames_lost), (2, 4, 0));
    assert!((outcome.travel_mm[2][0] + 0.6).abs() < 1e-3, "{:?}", outcome.travel_mm);
}

/// Presses in a row.
const PRESSES: &str = r#"
COUNT = param("count", default = 3, doc = "How many presses", unit = "", min = 1)

def run(rig):
    tare()
    for i in range(COUNT):
        press(5.0 + i, 5.0, depths_mm = [0.2, 0.4])
"#;

#[test]
fn a_run_that_ended_early_is_continued_with_what_it_confirmed() {
    let script = Script::parse("presses", PRESSES).unwrap();
    let mut arguments = Arguments::default();
    arguments.set("count=4").unwrap();
    let (Finished { outcome, recording }, folder) = run(script, arguments, SIMULATED_RIG).unwrap();
    assert_eq!(outcome.exit_status, ExitStatus::Done, "{outcome:?}");
    let continued =
        |run_id: &str| continuation::of_run(folder.path(), run_id, "ada".into(), Arc::new(InThisProcess));
    assert!(matches!(continued(&outcome.run_id), Err(ContinuationError::Done { .. })));
    for strange in ["none", "", "..", "a/b"] {
        assert!(matches!(continued(strange), Err(ContinuationError::Unknown { .. })), "{strange}");
    }

    // The service died before the last quarter.
    let bytes = std::fs::read(&recording).unwrap();
    let summary = mcap_summary_start(&bytes);
    std::fs::write(&recording, &bytes[..summary * 3 / 4]).unwrap();
    assert!(matches!(continued(&outcome.run_id), Err(ContinuationError::Open { .. })));
    assert_eq!(crashed::close_all(folder.path()).len(), 1);
    let continuation = continued(&outcome.run_id).unwrap();
    assert_eq!(continuation.request.seed, Some(1));
    assert_eq!(continuation.request.script.source(), PRESSES);
    assert_eq!(continuation.request.arguments.to_json(), r#"{"count":4}"#);
    let confirmed = continuation.confirmed;
    assert!((1..4).contains(&confirmed.len()), "{}", confirmed.len());
    let dwells: Vec<_> = tactus_record::confirmed_presses(&recording).unwrap();
    for (nth, (done, recorded)) in confirmed.iter().zip(&dwells).enumerate() {
        assert_eq!((done.at_mm, done.depths_mm.as_slice()), ([5.0 + nth as f64, 5.0], &[0.2, 0.4][..]));
        for (reading, dwell) in done.readings.iter().zip(&recorded.dwells) {
            let close = |a: &f64, b: &f32| (a - f64::from(*b)).abs() < 1e-3;
            assert!(reading.mean_counts.iter().zip(&dwell.mean_counts).all(|(a, b)| close(a, b)));
            assert!(reading.signal.len() == 48 && reading.rms.iter().any(|rms| *rms > 0.1));
            assert!(reading.signal.iter().any(|signal| *signal > 20.0), "{:?}", reading.signal);
        }
    }
}

/// Where the data of a recording end, as its footer tells.
fn mcap_summary_start(bytes: &[u8]) -> usize {
    let footer = bytes.len() - 8 - 20;
    usize::try_from(u64::from_le_bytes(bytes[footer..footer + 8].try_into().unwrap())).unwrap()
}
