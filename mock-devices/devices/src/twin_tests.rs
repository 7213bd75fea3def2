use super::*;
use crate::test_bench::sim_rig;

#[test]
fn a_twin_gives_nothing_away() {
    let rig = sim_rig();
    let simulation = twin_of(&rig).simulation.unwrap();
    let hidden = rig.simulation.unwrap();
    assert_eq!(simulation.stage, hidden.stage);
    assert_eq!(simulation.registration_error, RegistrationError::default());
    assert!(!hidden.faults.is_empty() && simulation.faults.is_empty());
    assert!(
        [simulation.noise_rms_counts, simulation.gain_spread, simulation.surface_mm]
            .iter()
            .all(|hidden| *hidden == 0.0)
    );
}

#[test]
fn the_twin_of_a_real_rig_can_reach_its_whole_envelope() {
    let real = Rig { simulated: false, simulation: None, ..sim_rig() };
    let twin = twin_of(&real);
    assert!(twin.simulated);
    let stage = twin.simulation.unwrap().stage;
    let envelope = real.service.unwrap().envelope;
    let bounds = [envelope.x_mm, envelope.y_mm, [-real.covering.thickness_mm, envelope.z_max_mm]];
    for ([least, greatest], [lower, upper]) in stage.travel_mm.into_iter().zip(bounds) {
        assert!(least < lower && upper <= greatest);
    }
    assert!(stage.travel_mm[2][1] <= envelope.z_max_mm, "it homes there");
    assert!(stage.speed_max_mm_per_s >= envelope.speed_max_mm_per_s);
}
