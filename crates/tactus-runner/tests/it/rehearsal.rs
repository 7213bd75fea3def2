//! A rehearsal moves as the run does, and a dry run promises what the run does.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use tactus_plan::{Arguments, InThisProcess, Script};
use tactus_record::rows;
use tactus_runner::config::RigFiles;
use tactus_runner::embedded::{self, Finished, Pace, SIMULATED_RIG};
use tactus_runner::experiments;
use tactus_runner::order::{self, RunRequest};
use tactus_runner::rehearsal::{self, Rehearsal};
use tactus_runner::twin::{self, TwinError};
use tactus_schema::pb::ExitStatus;
use tactus_schema::rig::ElementFault;
use tactus_schema::table::{Phase, RowView};
use tactus_schema::{Rig, WallTime};
use tempfile::TempDir;

/// Longest rehearsal here.
const LONGEST: Duration = Duration::from_mins(30);

/// The embedded stage homes in this time.
const HOMING_S: f64 = 6.0;

/// Where a row says that the tip was: press and phase, time in ns since the first row, position, covering.
type Motion = (i32, Phase, i64, [f64; 3], f64);

fn request(script: Script, parameters: &[&str], seed: u64) -> RunRequest {
    let mut arguments = Arguments::default();
    for parameter in parameters {
        arguments.set(parameter).unwrap();
    }
    let evaluator = Arc::new(InThisProcess);
    RunRequest { script, arguments, seed: Some(seed), who: "test".into(), evaluator, earlier: None }
}

fn rehearsed(request: RunRequest, rig_toml: &str, longest: Duration) -> Result<Rehearsal, TwinError> {
    let rig = Rig::from_toml(rig_toml).unwrap();
    let faults: BTreeMap<usize, ElementFault> = rig.simulation.clone().unwrap().faults;
    let order = order::order(request, &rig, WallTime::default(), &|| false).unwrap();
    rehearsal::rehearse(&rig, faults, order, longest, &|| false)
}

fn motion(visit: impl FnOnce(&mut dyn FnMut(RowView<'_>))) -> Vec<Motion> {
    let mut motion: Vec<Motion> = Vec::new();
    let mut first_ns = None;
    visit(&mut |row| {
        let t_ns = row.t_ns - *first_ns.get_or_insert(row.t_ns);
        motion.push((row.press, row.phase, t_ns, row.position_mm, row.covering_mm));
    });
    motion
}

/// Runs it on the embedded rig.
fn ran(request: RunRequest, rig_toml: &str, folder: &Path) -> Finished {
    let rig = RigFiles::of(rig_toml, Path::new("rig.toml")).unwrap();
    let ran = embedded::run(&rig, None, request, folder, Pace::Virtual, &|| false, |_, _| {}).unwrap();
    assert_eq!(ran.outcome.exit_status, ExitStatus::Done, "{:?}", ran.outcome);
    ran
}

/// Rehearses a script, runs it on the embedded rig with the same seed, and compares what both say of the tip, frame by frame.
fn moves_as_the_run(name: &str, parameters: &[&str], rig_toml: &str) -> Rehearsal {
    let script = experiments::find(name, None).unwrap();
    let rehearsal = rehearsed(request(script.clone(), parameters, 7), rig_toml, LONGEST).unwrap();
    assert_eq!(rehearsal.outcome.exit_status, ExitStatus::Done, "{:?}", rehearsal.outcome);
    let folder = TempDir::new().unwrap();
    let ran = ran(request(script, parameters, 7), rig_toml, folder.path());
    let predicted = motion(|take| rehearsal.visit(take).unwrap());
    let recorded = motion(|take| drop(rows::visit(&[&ran.recording], |_, row| take(row)).unwrap()));
    assert_eq!(predicted.len(), recorded.len());
    for (predicted, recorded) in predicted.iter().zip(&recorded) {
        assert_eq!(predicted, recorded);
    }
    assert!(predicted.iter().filter(|(press, ..)| *press >= 0).count() > 200, "there are presses");
    assert_eq!(
        (rehearsal.outcome.presses, rehearsal.outcome.dwells),
        (ran.outcome.presses, ran.outcome.dwells)
    );
    rehearsal
}

#[test]
fn a_rehearsal_moves_exactly_as_the_embedded_rig_with_the_same_seed() {
    moves_as_the_run("diagnose", &["parts=rates,approach,rests", "scale=0.1"], SIMULATED_RIG);
    moves_as_the_run("element-centres", &[], SIMULATED_RIG);
    let coverings = ["points=2", "coverings_mm=[1.016,2.54]"];
    let changed = moves_as_the_run("grid-sweep", &coverings, SIMULATED_RIG);
    let mut coverings_mm: Vec<f64> =
        motion(|take| changed.visit(take).unwrap()).iter().map(|row| row.4).collect();
    coverings_mm.dedup();
    assert_eq!(coverings_mm, [1.016, 2.54]);
}

#[test]
fn a_rehearsal_avoids_the_elements_that_are_known_to_be_faulty_as_the_run_does() {
    let dead = SIMULATED_RIG.replace("miswired = [", "dead = [19, 20, 27, 28]\nmiswired = [");
    let parts = ["parts=repeats", "scale=0.1"];
    let sound = moves_as_the_run("diagnose", &parts, SIMULATED_RIG);
    let faulty = moves_as_the_run("diagnose", &parts, &dead);
    assert_ne!(sound.outcome.presses, faulty.outcome.presses, "other elements are tried");
}

#[test]
fn the_order_of_the_presses_is_the_seeds() {
    let script = experiments::find("element-centres", None).unwrap();
    let [one, same, other] = [7, 7, 8].map(|seed| {
        let rehearsal = rehearsed(request(script.clone(), &[], seed), SIMULATED_RIG, LONGEST).unwrap();
        motion(|take| rehearsal.visit(take).unwrap())
    });
    assert!(one == same && one != other);
}

#[test]
fn what_the_rig_cannot_do_and_what_takes_too_long_is_told() {
    let script = |text: &str| Script::parse("own", text).unwrap();
    let deep = script("def run(rig):\n    press(5.0, 5.0, [0.9])\n");
    let refused = rehearsed(request(deep, &[], 1), SIMULATED_RIG, LONGEST).unwrap().outcome;
    assert_eq!(refused.exit_status, ExitStatus::Refused);
    assert!(refused.message.contains("own.star:2"), "{}", refused.message);
    let failing = script("def run(rig):\n    fail(\"no\")\n");
    let failed = rehearsed(request(failing, &[], 1), SIMULATED_RIG, LONGEST).unwrap().outcome;
    assert_eq!(failed.exit_status, ExitStatus::Failed);
    assert!(failed.message.contains("own.star:2"), "{}", failed.message);
    let long = script("def run(rig):\n    wait(7200.0)\n");
    let error = rehearsed(request(long, &[], 1), SIMULATED_RIG, LONGEST).unwrap_err();
    assert_eq!(error.to_string(), "the experiment would take more than 30 min");
}

#[test]
fn a_dry_run_promises_what_the_run_does() {
    let grid = &["points=2", "coverings_mm=[1.016,2.54]"][..];
    for (name, parameters) in [
        ("element-centres", &[][..]),
        ("diagnose", &["parts=rates,approach", "scale=0.1"]),
        ("grid-sweep", grid),
    ] {
        let script = experiments::find(name, None).unwrap();
        let rig = Rig::from_toml(SIMULATED_RIG).unwrap();
        let planned = request(script.clone(), parameters, 7);
        let order = order::order(planned, &rig, WallTime::default(), &|| false).unwrap();
        let plan = twin::dry_run(&rig, order, &|| false).unwrap().outcome;
        assert_eq!(plan.exit_status, ExitStatus::Done, "{plan:?}");
        let folder = TempDir::new().unwrap();
        let ran = ran(request(script, parameters, 7), SIMULATED_RIG, folder.path()).outcome;
        assert_eq!(
            (plan.presses, plan.dwells, plan.travel_mm),
            (ran.presses, ran.dwells, ran.travel_mm),
            "{name}"
        );
        // The run's stage is homed first. The dry run's tells 20 ms apart when it has arrived, the run's at its controller's pace.
        println!("{name}: {} s promised, {} s taken", plan.duration_s, ran.duration_s);
        let late_s = ran.duration_s - plan.duration_s;
        let tolerance_s = 0.01 * ran.duration_s;
        assert!((-tolerance_s..HOMING_S + tolerance_s).contains(&late_s), "{name}: {late_s} s late");
    }
}

#[test]
fn the_twin_of_a_rig_with_physical_devices_homes_within_the_envelope_and_does_the_experiment() {
    let (shipped, _simulation) = SIMULATED_RIG.split_once("[simulation]").unwrap();
    let real = Rig::from_toml(&shipped.replace("simulated = true", "simulated = false")).unwrap();
    assert!(!real.simulated && real.simulation.is_none());
    let script = experiments::find("corners", None).unwrap();
    let order = order::order(request(script, &[], 1), &real, WallTime::default(), &|| false).unwrap();
    let plan = twin::dry_run(&real, order, &|| false).unwrap();
    assert!(plan.is_possible(), "{}", plan.outcome.message);
}
