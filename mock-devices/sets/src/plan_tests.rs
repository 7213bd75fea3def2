use tactus_hidden::RandomRig;

use super::*;

fn planned(plan: Plan, frames: Option<usize>) -> Vec<PlannedRun> {
    let base = RandomRig::new(3).unwrap();
    plan.runs(&base.rig.array, base.rig.registration, base.rig.covering, frames, 3).unwrap()
}

#[test]
fn a_bundle_takes_some_200_s_and_presses_at_28_places_and_more() {
    let [run] = &planned(Plan::Bundle, None)[..] else { panic!("one run") };
    assert!((5_400..7_200).contains(&run.frames), "{}", run.frames);
    let presses = run.phases_of_frames(30.0).map(|(press, _)| press).max().unwrap() + 1;
    assert_eq!(presses, 28 + 8 + 3 + 10 + 4 + 2);
}

#[test]
fn frames_are_as_many_as_asked() {
    for plan in [Plan::Bundle, Plan::Paper, Plan::Diagnose] {
        for frames in [100, 9_000, 36_000] {
            let all: usize = planned(plan, Some(frames)).iter().map(|run| run.frames).sum();
            assert_eq!(all, frames, "{plan:?}");
        }
    }
}

#[test]
fn phases_say_where_the_tip_is() {
    for plan in [Plan::Bundle, Plan::Paper] {
        for run in planned(plan, None) {
            let thickness_mm = run.covering.thickness_mm;
            for (frame, (press, phase)) in run.phases_of_frames(30.0).enumerate() {
                let t_s = frame as f64 / 30.0;
                let [_, _, z] = run.trajectory.at(t_s);
                assert!((-0.66 * thickness_mm..=SAFE_MM + 1e-9).contains(&z), "{z}");
                assert_eq!(press < 0, phase == Phase::Idle, "{t_s}");
                match phase {
                    Phase::Idle => assert!((z - SAFE_MM).abs() < 1e-9, "{t_s}: {z}"),
                    Phase::Approach | Phase::Retract => assert!(z >= -1e-9, "{t_s}: {z}"),
                    Phase::Load | Phase::Hold | Phase::Unload => assert!(z <= 1e-9, "{t_s}: {z}"),
                }
                if phase == Phase::Hold {
                    assert!(run.trajectory.velocity_mm_per_s(t_s - 1e-6)[2].abs() < 1e-9, "{t_s}");
                }
            }
        }
    }
}

#[test]
fn the_paper_presses_every_element_and_sweeps_under_two_coverings() {
    let planned = planned(Plan::Paper, None);
    let thicknesses: Vec<f64> = planned.iter().map(|run| run.covering.thickness_mm).collect();
    assert_eq!(thicknesses, [1.016, 2.54]);
    let presses: Vec<i32> = planned
        .iter()
        .map(|run| run.phases_of_frames(30.0).map(|(press, _)| press).max().unwrap() + 1)
        .collect();
    assert_eq!(presses, [2 + 48 + 49, 49]);
}
