//! The embedded rig: production drivers and engine against virtual devices, in virtual time.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex};

use tactus_device::{Clock, SensorCodec};
use tactus_plan::{
    Arguments, Call, Evaluate, Host, InThisProcess, Outcome, Parameter, Refusal, Reply, RigView, Script,
    ScriptError, ScriptLimits,
};
use tactus_record::rows;
use tactus_runner::config::RigFiles;
use tactus_runner::continuation::{self, Continuation, ContinuationError, Wish};
use tactus_runner::embedded::{self, EmbeddedError, Finished, Pace, SIMULATED_RIG, Truth};
use tactus_runner::order::RunRequest;
use tactus_runner::{devices, experiments};
use tactus_schema::Rig;
use tactus_schema::pb::ExitStatus;
use tactus_schema::rig::ElementFault;
use tempfile::TempDir;

fn run(script: Script, arguments: Arguments, rig_toml: &str) -> Result<(Finished, TempDir), EmbeddedError> {
    run_with(script, arguments, rig_toml, Arc::new(InThisProcess))
}

fn run_with(
    script: Script,
    arguments: Arguments,
    rig_toml: &str,
    evaluator: Arc<dyn Evaluate>,
) -> Result<(Finished, TempDir), EmbeddedError> {
    let folder = TempDir::new().unwrap();
    let rig = RigFiles::of(rig_toml, Path::new("rig.toml")).unwrap();
    let request =
        RunRequest { script, arguments, seed: Some(1), who: "test".into(), evaluator, earlier: None };
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

/// Presses, and everything else that a script can be told.
const PRESSES: &str = r#"
COUNT = param("count", default = 3, doc = "How many presses", unit = "", min = 1)

def run(rig):
    quiet = read(0.5)
    tare()
    move(4.0, 4.0, height_mm = 1.0)
    dwell(0.5)
    wait(0.5)
    log("at rest", quiet.signal[0])
    for i in range(COUNT):
        press(3.0 + i, 5.0, depths_mm = [0.2, 0.4])
        read(0.2)
"#;

/// Keeps what the scripts are told.
#[derive(Debug, Default, Clone)]
struct Listening(Arc<Mutex<Vec<Reply>>>);

struct Ear<'a>(&'a mut dyn Host, &'a Mutex<Vec<Reply>>);

impl Host for Ear<'_> {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        let reply = self.0.perform(call)?;
        self.1.lock().unwrap().push(reply.clone());
        Ok(reply)
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl Evaluate for Listening {
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        seed: u64,
        limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> Result<Outcome, ScriptError> {
        // Of the dry run.
        self.0.lock().unwrap().clear();
        InThisProcess.execute(script, arguments, rig, seed, limits, &mut Ear(host, &self.0))
    }

    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Arguments, ScriptError> {
        InThisProcess.resolve(script, arguments, rig, limits, stopped)
    }

    fn parameters(
        &self,
        script: &Script,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<Parameter>, ScriptError> {
        InThisProcess.parameters(script, rig, limits, stopped)
    }
}

/// A run of eight presses in a folder, and what its script was told.
fn eight_presses() -> (Finished, TempDir, Vec<Reply>) {
    let script = Script::parse("presses", PRESSES).unwrap();
    let mut arguments = Arguments::default();
    arguments.set("count=8").unwrap();
    let listening = Listening::default();
    let (finished, folder) = run_with(script, arguments, SIMULATED_RIG, Arc::new(listening.clone())).unwrap();
    assert_eq!(finished.outcome.exit_status, ExitStatus::Done, "{:?}", finished.outcome);
    let told = listening.0.lock().unwrap().clone();
    (finished, folder, told)
}

/// What is left of a recording if the service dies after this share of it.
fn cut(recording: &Path, share: f64) {
    let bytes = std::fs::read(recording).unwrap();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let left = (mcap_summary_start(&bytes) as f64 * share) as usize;
    std::fs::write(recording, &bytes[..left]).unwrap();
}

fn rest_of(folder: &TempDir, run_id: &str, rig: &Rig) -> Result<Continuation, ContinuationError> {
    let evaluator = Arc::new(InThisProcess);
    let wish = Wish { run_id, folder: folder.path(), who: "ada".into(), evaluator };
    continuation::of_run(wish, rig, &|| false)
}

fn go_on(folder: &TempDir, run_id: &str) -> Finished {
    let files = RigFiles::of(SIMULATED_RIG, Path::new("rig.toml")).unwrap();
    let request = rest_of(folder, run_id, &files.rig).unwrap().request;
    embedded::run(&files, None, request, folder.path(), Pace::Virtual, &|| false, |_, _| {}).unwrap()
}

#[test]
fn an_earlier_run_tells_its_script_again_to_the_last_bit_what_it_was_told() {
    let (Finished { outcome, recording }, folder, told) = eight_presses();
    let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    let run_id = outcome.run_id.as_str();
    assert!(matches!(rest_of(&folder, run_id, &rig), Err(ContinuationError::Done { .. })));
    let too_long = "r".repeat(5000);
    for strange in ["none", "", "..", "a/b", &too_long] {
        assert!(
            matches!(rest_of(&folder, strange, &rig), Err(ContinuationError::Unknown { .. })),
            "{strange}"
        );
    }

    cut(&recording, 0.75);
    // Who goes on with it closes it.
    let rest = rest_of(&folder, run_id, &rig).unwrap();
    assert_eq!(tactus_record::info(&recording).unwrap().exit_status, Some("crashed"));
    assert_eq!(rest.request.seed, Some(1));
    assert_eq!(rest.request.script.source(), PRESSES);
    assert_eq!(rest.request.arguments.to_json(), r#"{"count":8}"#);
    assert!(!rest.hides_truth);
    let earlier = rest.request.earlier.as_ref().unwrap();
    let replies: Vec<_> = earlier.steps.iter().map(|step| step.reply.clone()).collect();
    assert!((12..told.len()).contains(&replies.len()), "{} of {}", replies.len(), told.len());
    assert!(replies == told[..replies.len()]);
    let confirmed = tactus_record::confirmed_presses(&recording).unwrap();
    assert_eq!(confirmed.last().unwrap().press + 1, earlier.next_press);
    assert_eq!(rest.taken_over().presses as usize, confirmed.len());

    let same = Script::parse("presses", PRESSES).unwrap();
    assert_eq!((rest.note(None), rest.note(Some(&same))), (None, None));
    let other = Script::parse("presses", &PRESSES.replace("0.4", "0.5")).unwrap();
    assert!(rest.note(Some(&other)).unwrap().contains("has changed since"));
}

#[test]
fn only_the_rig_of_the_earlier_run_goes_on_with_it() {
    let (Finished { outcome, recording }, folder, _) = eight_presses();
    cut(&recording, 0.5);
    let field = |from: &str, to: &str| {
        assert!(SIMULATED_RIG.contains(from), "{from}");
        let rig = Rig::from_toml(&SIMULATED_RIG.replace(from, to)).unwrap();
        match rest_of(&folder, &outcome.run_id, &rig) {
            Ok(_) => None,
            Err(ContinuationError::OtherRig { field, .. }) => Some(field),
            Err(error) => unreachable!("{error}"),
        }
    };
    assert_eq!(field("name = \"sim\"", "name = \"other\""), Some("name"));
    assert_eq!(field("rotation_deg = 0.0", "rotation_deg = 1.0"), Some("registration"));
    assert_eq!(field("on_gap = \"repeat\"", "on_gap = \"fail\""), None, "links and policy may change");
}

#[test]
fn a_run_that_goes_on_can_go_on_again_and_the_table_has_each_press_once() {
    let (Finished { outcome, recording: first }, folder, _) = eight_presses();
    cut(&first, 0.4);
    let second = go_on(&folder, &outcome.run_id);
    assert_eq!(second.outcome.exit_status, ExitStatus::Done, "{:?}", second.outcome);
    cut(&second.recording, 0.5);
    let third = go_on(&folder, &second.outcome.run_id);
    assert_eq!(third.outcome.exit_status, ExitStatus::Done, "{:?}", third.outcome);

    let recordings = [first, second.recording, third.recording];
    let confirmed = recordings.iter().flat_map(|path| tactus_record::confirmed_presses(path).unwrap());
    let confirmed: Vec<_> = confirmed.map(|press| (press.press, press.dwells[0].x_mm)).collect();
    assert_eq!(confirmed, (0..8).map(|i| (i, 3.0 + f64::from(i))).collect::<Vec<_>>());
    let done: Vec<_> =
        recordings.iter().map(|path| tactus_record::confirmed_presses(path).unwrap().len()).collect();
    assert!(done.iter().all(|presses| *presses > 0), "each run has done some: {done:?}");

    let mut of_rows = BTreeMap::<i32, BTreeSet<String>>::new();
    rows::visit(&recordings, |_, row| {
        if row.press >= 0 {
            of_rows.entry(row.press).or_default().insert(row.run.to_owned());
        }
    })
    .unwrap();
    assert_eq!(of_rows.keys().copied().collect::<Vec<_>>(), (0..8).collect::<Vec<_>>());
    assert!(of_rows.values().all(|runs| runs.len() == 1), "{of_rows:?}");

    // Without the first one nobody knows what the third took over.
    cut(&recordings[2], 0.5);
    std::fs::remove_dir_all(recordings[0].parent().unwrap()).unwrap();
    let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    let lost = rest_of(&folder, &third.outcome.run_id, &rig).unwrap_err();
    assert!(lost.to_string().contains(&outcome.run_id), "{lost}");
}

/// Where the data of a recording end, as its footer tells.
fn mcap_summary_start(bytes: &[u8]) -> usize {
    let footer = bytes.len() - 8 - 20;
    usize::try_from(u64::from_le_bytes(bytes[footer..footer + 8].try_into().unwrap())).unwrap()
}
