use tactus_plan::InThisProcess;
use tactus_schema::table::{Phase, RowView};
use tempfile::TempDir;

use super::*;

/// A rig, and one press on it at 0.4 mm/s.
fn measured(rig: Rig) -> Measurements {
    let mut frames = Frames::new(rig.array.elements());
    let counts = vec![100.0; rig.array.elements()];
    for frame in 0..60 {
        frames.push(RowView {
            run: "r",
            press: 0,
            phase: Phase::Load,
            t_ns: i64::from(frame) * 50_000_000,
            position_mm: [28.0, 21.0, (0.3 - 0.02 * f64::from(frame)).max(-0.5)],
            covering_mm: 2.54,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    Measurements {
        files: Vec::new(),
        simulated: rig.simulated,
        rig,
        data: Vec::new(),
        notes: Vec::new(),
        renamed: None,
        frames,
        covering_mm: 2.54,
        indenter: "cyl1".to_owned(),
    }
}

fn rehearsed(
    experiments: TwinExperiments,
    experiment: &str,
    parameters: &[(&'static str, String)],
) -> Result<Rehearsal, String> {
    let experiments = TwinExperiments { evaluator: Arc::new(InThisProcess), ..experiments };
    experiments.rehearse(RehearsalOrder { experiment, parameters, seed: 1, faulty: &[] })
}

#[test]
fn a_rig_that_is_only_described_is_rehearsed_at_the_datas_speed_under_their_covering() {
    let shipped = Rig::from_toml(SIMULATED_RIG).unwrap();
    let described = Rig { simulated: false, simulation: None, service: None, ..shipped };
    let experiments = TwinExperiments::of(&measured(described), None, None).unwrap();
    assert!((experiments.covering_mm() - 2.54).abs() < 1e-12);
    let parameters = [("parts", "repeats".to_owned()), ("scale", "0.1".to_owned())];
    let rehearsal = rehearsed(experiments, "diagnose", &parameters).unwrap();
    assert!(rehearsal.duration_s > 30.0, "{}", rehearsal.duration_s);
    let speed_mm_per_s = rehearsal.frames.load_speed_mm_per_s().unwrap();
    assert!((0.38..0.42).contains(&speed_mm_per_s), "{speed_mm_per_s}");
}

#[test]
fn what_the_envelope_of_the_live_rig_forbids_is_told() {
    let mut rig = Rig::from_toml(SIMULATED_RIG).unwrap();
    rig.service.as_mut().unwrap().envelope.x_mm = [10.0, 22.0];
    let experiments = TwinExperiments::of(&measured(rig.clone()), Some(&rig), None).unwrap();
    let error = rehearsed(experiments, "element-centres", &[]).unwrap_err();
    assert!(error.contains("element-centres.star:") && error.contains("x_mm"), "{error}");
}

#[test]
fn the_labs_scripts_are_those_in_the_folder_that_are_not_built_in() {
    let folder = TempDir::new().unwrap();
    let of = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let (_, diagnose) = experiments::BUILT_IN[1];
    let [second, first] = ["b.star", "a.star"].map(|name| of(name, "def run(rig):\n    tare()\n"));
    of("diagnose.star", diagnose);
    of("notes.md", "no script");
    assert_eq!(own_scripts(folder.path()).unwrap(), [first, second]);
    let error = own_scripts(&folder.path().join("nowhere")).unwrap_err();
    assert!(format!("{error:#}").contains("nowhere"), "{error:#}");
}
