use std::time::Duration;

use tactus_schema::Rig;

use super::*;
use crate::TruthFile;
use crate::test_bench::{sim_rig, world_of};

/// Puts the tip at a place at once, as far as depth records go: by a move that has long ended.
fn put(world: &mut World, tip_mm: Point, at: Instant) -> Instant {
    world.motion.push_true(tip_mm, 50.0, at);
    let later = at + Duration::from_mins(1);
    world.settle(later);
    later
}

/// True robot position of an element's centre, at a height.
fn over(world: &World, element: usize, z_mm: f64) -> Point {
    let centre = world.truth().model.array().centre_mm(element).unwrap();
    let [x, y] = world.truth().registration.to_robot(centre);
    [x, y, z_mm]
}

#[test]
fn a_press_at_an_elements_true_centre_reads_its_true_response() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let t0 = Instant::now();
    assert!(world.image(t0).iter().all(|counts| (counts - 100.0).abs() < 1e-12), "nothing presses yet");
    let down_mm = over(&world, 21, -0.5);
    let at = put(&mut world, down_mm, t0);
    let gain = world.truth().model.response().sensitivity_counts_per_mm[21];
    assert!((gain - 1000.0).abs() > 1.0, "gains are spread");
    let want = 100.0 + gain * (0.5 + 0.15 * 0.25);
    let got = world.image(at)[21];
    // The stage stands within half a step of 3 um of the centre.
    assert!((got - want).abs() < 0.01, "{got} {want}");
}

#[test]
fn a_model_in_place_of_the_simulation_gives_gains_noise_and_effects_and_leaves_the_rest_the_rigs() {
    let rig = sim_rig();
    let effect = r#"
        [[effect]]
        name = "relaxation"
        parameters = { relaxed_share = 0.5, time_constant_s = 1.0, spread_ratio = 1.0, after_release = 0.0, recovery_ratio = 1.0 }"#;
    let model =
        include_str!("../../../config/models/digitacts.toml").replace("rms_counts = 2.0", "rms_counts = 0.0");
    let truth = TruthFile::from_toml(&format!("{model}{effect}")).unwrap().behind(&rig, 7).unwrap();
    let shared = SharedWorld::new(World::new(Arc::new(truth), rig.covering));
    let mut world = shared.lock();
    let down_mm = over(&world, 21, -0.5);
    assert!((world.truth().registration.rotation_deg - 0.2).abs() < 1e-12, "the rig's error stays");
    let at = put(&mut world, down_mm, Instant::now());
    let mut counts = Vec::new();
    for (after_s, want) in
        [(0, 100.0 + 500.0), (1, 100.0 + 500.0 * (1.0 - 0.5 * (1.0 - (-1.0_f64).exp()))), (60, 350.0)]
    {
        world.sample(at + Duration::from_secs(after_s), &mut counts);
        assert!((f64::from(counts[21]) - want).abs() <= 1.0, "after {after_s} s: {} {want}", counts[21]);
    }
    assert!(counts[18] == counts[19] && counts[20] > counts[19], "the rig's element 18 answers for 19");
}

#[test]
fn gains_spread_as_the_rig_says_and_the_truth_differs_from_the_declaration() {
    let rig = sim_rig();
    let truth = world_of(&rig, 7).lock().truth().clone();
    let gains = &truth.model.response().sensitivity_counts_per_mm;
    let mean = gains.iter().sum::<f64>() / 48.0;
    let spread = (gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / 47.0).sqrt();
    // 80 counts/mm; the standard error of a deviation from 48 samples is a tenth of it.
    assert!((mean - 1000.0).abs() < 40.0, "{mean}");
    assert!((spread - 80.0).abs() < 25.0, "{spread}");
    assert!((truth.registration.origin_mm[0] - 20.06).abs() < 1e-12);
    assert!((truth.registration.rotation_deg - 0.2).abs() < 1e-12);
}

#[test]
fn a_miswired_element_answers_for_its_neighbour() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let down_mm = over(&world, 19, -0.5);
    let at = put(&mut world, down_mm, Instant::now());
    let gains = world.truth().model.response().sensitivity_counts_per_mm.clone();
    let image = world.image(at);
    let signal = |element: usize| (image[element] - 100.0) / gains[element];
    assert!((signal(18) - signal(19)).abs() < 1e-9, "18 gives the signal of 19 by its own gain");
    assert!(signal(20) < 0.9 * signal(19));
}

#[test]
fn dead_stuck_and_noisy_elements_read_as_they_should_and_change_no_other() {
    let sound = sim_rig();
    let mut faulty = sound.clone();
    faulty.simulation.as_mut().unwrap().faults.extend([
        (20, ElementFault::Dead),
        (21, ElementFault::Stuck { counts: 812 }),
        (12, ElementFault::Noisy { noise_rms_counts: 25.0 }),
    ]);
    let read = |rig: &Rig| -> Vec<Vec<u16>> {
        let shared = world_of(rig, 7);
        let mut world = shared.lock();
        let down_mm = over(&world, 20, -0.5);
        let at = put(&mut world, down_mm, Instant::now());
        let image = world.image(at);
        assert_eq!(image[20] > 200.0, world.truth().faults.len() == 2);
        let mut counts = Vec::new();
        let frames = std::iter::repeat_with(|| {
            world.sample(at, &mut counts);
            counts.clone()
        });
        frames.take(2000).collect()
    };
    let (sound, faulty) = (read(&sound), read(&faulty));
    let others = (0..48).filter(|element| ![12, 20, 21].contains(element));
    for element in others {
        assert!(sound.iter().zip(&faulty).all(|(sound, faulty)| sound[element] == faulty[element]));
    }
    let moments = |element: usize| {
        let all: Vec<f64> = faulty.iter().map(|counts| f64::from(counts[element])).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (mean, (all.iter().map(|read| (read - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt())
    };
    let (dead, dead_rms) = moments(20);
    // The baseline, and the noise of every element with that of rounding: 2.02 counts, known to 0.03 of 2,000 frames.
    assert!((dead - 100.0).abs() < 0.25 && (dead_rms - 2.02).abs() < 0.15, "{dead} {dead_rms}");
    assert!(faulty.iter().all(|counts| counts[21] == 812));
    let (_, noisy_rms) = moments(12);
    assert!((noisy_rms - 25.0).abs() < 2.0, "{noisy_rms}");
}

#[test]
fn noise_has_the_stated_deviation_and_readings_are_whole_counts() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let (at, mut counts) = (Instant::now(), Vec::new());
    let mut all = Vec::new();
    for _ in 0..500 {
        world.sample(at, &mut counts);
        all.extend(counts.iter().map(|count| f64::from(*count) - 100.0));
    }
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let variance = all.iter().map(|x| x * x).sum::<f64>() / n;
    // 2.0 counts rms and 1/12 of a count from rounding; 24,000 samples give the mean to 0.013 and the variance to 0.04.
    assert!(mean.abs() < 0.06, "{mean}");
    assert!((variance - 4.0 - 1.0 / 12.0).abs() < 0.2, "{variance}");
}

#[test]
fn positions_are_whole_steps() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let at = put(&mut world, [20.0004, 20.0016, -0.0004], Instant::now());
    let [x, y, z] = world.tip_mm(at);
    assert!((x - 20.001).abs() < 1e-9 && (y - 20.001).abs() < 1e-9 && z.abs() < 1e-9, "{x} {y} {z}");
}

#[test]
fn the_record_of_depths_misses_nothing_between_looks() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let t0 = Instant::now();
    assert!(world.deepest_mm(t0) < -20.0, "it starts high above");
    let here_mm = world.motion.true_mm(t0);
    world.motion.push_true([here_mm[0], here_mm[1], -0.3], 50.0, t0);
    world.motion.push_true(here_mm, 50.0, t0);
    let later = t0 + Duration::from_mins(1);
    assert!((world.deepest_mm(later) - 0.3).abs() < 1e-9);
    assert!(world.depth_mm(later) < -20.0);
    world.set_surface_mm(0.1, later);
    assert!(
        (world.deepest_mm(later) - 0.3).abs() < 1e-9,
        "a surface that rises later was not pressed before"
    );
    world.set_covering_mm(0.508, later);
    assert!(world.deepest_mm(later) < -20.0, "another covering was not pressed before");
}

#[test]
fn covering_surface_and_stiffness_can_be_changed() {
    let shared = world_of(&sim_rig(), 7);
    let mut world = shared.lock();
    let down_mm = over(&world, 21, -0.5);
    let at = put(&mut world, down_mm, Instant::now());
    let rises =
        |world: &mut World| -> Vec<f64> { world.image(at).iter().map(|counts| counts - 100.0).collect() };
    let thin = rises(&mut world);
    world.set_covering_mm(5.08, at);
    let thick = rises(&mut world);
    assert!(
        thick[21] < thin[21] && thick[0] / thick[21] > thin[0] / thin[21],
        "a thick covering spreads more"
    );
    world.set_covering_mm(1.016, at);
    world.set_surface_mm(0.2, at);
    assert!((world.depth_mm(at) - 0.7).abs() < 1e-9);
    assert!(rises(&mut world)[21] > 1.35 * thin[21]);
    world.set_surface_mm(0.0, at);
    world.set_stiffness(2.0);
    assert!(rises(&mut world)[21] > 2.0 * thin[21]);
}
