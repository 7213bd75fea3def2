use std::collections::BTreeSet;

use tactus_model::effect::REGISTRY;

use super::hysteresis::Preisach;
use super::motion::play;
use super::relaxation::{Branches, power_law};
use super::*;
use crate::{Climate, HiddenSensor, RandomRig};

/// A sensor with one physics, and what that drew.
pub(super) fn sensor(
    base: &RandomRig,
    id: &str,
    strength: f64,
) -> (HiddenSensor, impl Fn(&str) -> f64 + use<>) {
    let physics = Definition::find(id).unwrap();
    let sensor = HiddenSensor::new(&base.sensor, &[Dose { physics, strength, seed: 3 }], Climate::new(1), 0);
    let drawn = sensor.parameters()[0].clone();
    (sensor, move |name: &str| drawn.iter().find(|(drawn, _)| drawn == name).unwrap().1)
}

/// Over element 19, robot frame, at a height.
fn above(base: &RandomRig, z_mm: f64) -> [f64; 3] {
    let [x, y] = base.rig.registration.to_robot(base.rig.array.centre_mm(19).unwrap());
    [x, y, z_mm]
}

/// Signal of element 19 in mm of equivalent indentation.
fn indentation_mm(base: &RandomRig, counts: &[f64]) -> f64 {
    let response = base.sensor.model.response();
    (counts[19] - response.baseline_counts[19]) / response.sensitivity_counts_per_mm[19]
}

#[test]
fn every_effect_of_the_library_has_an_instance() {
    let library: BTreeSet<&str> = REGISTRY.iter().map(|definition| definition.name).collect();
    let instances: BTreeSet<&str> = CATALOGUE.iter().filter_map(|definition| definition.effect).collect();
    assert_eq!(instances, library);
    let ids: BTreeSet<&str> = CATALOGUE.iter().map(|definition| definition.id).collect();
    assert_eq!(ids.len(), CATALOGUE.len());
}

#[test]
fn the_shape_of_physics_hangs_on_its_seed_and_not_on_its_strength() {
    let base = RandomRig::new(1).unwrap();
    let (_, weak) = sensor(&base, "relaxation-prony", 0.1);
    let (_, strong) = sensor(&base, "relaxation-prony", 1.0);
    assert_eq!(weak("time_constant_2_s").to_bits(), strong("time_constant_2_s").to_bits());
    assert!((strong("relaxed_share") - 10.0 * weak("relaxed_share")).abs() < 1e-15);
}

#[test]
fn a_held_step_relaxes_as_a_prony_series() {
    let base = RandomRig::new(2).unwrap();
    let (mut sensor, drawn) = sensor(&base, "relaxation-prony", 1.0);
    let path = |t_s: f64| above(&base, if t_s > 0.0 { -0.5 } else { 1.0 });
    sensor.step(0.0, &path);
    // The step itself takes a microsecond.
    sensor.step(1e-6, &path);
    let fresh_mm = indentation_mm(&base, sensor.counts());
    let parts: f64 = (1..=3).map(|k| drawn(&format!("part_{k}"))).sum();
    for t_s in [0.1, 0.5, 2.0, 10.0] {
        let relaxed: f64 = (1..=3)
            .map(|k| {
                let share = drawn("relaxed_share") * drawn(&format!("part_{k}")) / parts;
                share * (1.0 - (-t_s / drawn(&format!("time_constant_{k}_s"))).exp())
            })
            .sum();
        sensor.step(t_s, &path);
        let now_mm = indentation_mm(&base, sensor.counts());
        assert!((now_mm / fresh_mm - (1.0 - relaxed)).abs() < 1e-5, "{t_s}: {now_mm} of {fresh_mm}");
    }
}

#[test]
fn a_relaxing_covering_never_pulls_and_its_next_press_is_weaker() {
    let base = RandomRig::new(2).unwrap();
    let (mut sensor, _) = sensor(&base, "relaxation-power-law", 1.0);
    let path = |t_s: f64| above(&base, if t_s.rem_euclid(5.0) > 1.0 { -0.5 } else { 1.0 });
    let mut at = |t_s: f64| indentation_mm(&base, sensor.step(t_s, &path));
    assert!(at(0.0).abs() < 1e-12);
    let (first_mm, held_mm) = (at(1.001), at(4.9));
    let released_mm = at(5.5);
    let second_mm = at(6.001);
    assert!(released_mm.abs() < 1e-12);
    assert!(held_mm < second_mm && second_mm < first_mm, "{first_mm} {held_mm} {second_mm}");
}

#[test]
fn a_branch_follows_a_ramp_exactly() {
    // dq/dt = (k t - q)/T from rest: q = k (t - T (1 - exp(-t/T))).
    let mut branch = Branches::new(vec![0.7]);
    branch.follow(0.0, &[0.0]);
    for step in 1..=10 {
        branch.follow(0.3, &[2.0 * 0.3 * f64::from(step)]);
    }
    let exact = 2.0 * (3.0 - 0.7 * (1.0 - (-3.0_f64 / 0.7).exp()));
    assert!((branch.at(0).sum::<f64>() - exact).abs() < 1e-12);
}

#[test]
fn a_mixture_of_exponentials_is_the_power_law() {
    for exponent in [0.15, 0.5, 1.2] {
        let (times_s, weights) = power_law(exponent, 0.3);
        for t_s in [0.0, 0.1, 1.0, 10.0, 30.0] {
            let mixture: f64 =
                times_s.iter().zip(&weights).map(|(time_s, w)| w * (-t_s / time_s).exp()).sum();
            let law = (1.0 + t_s / 0.3_f64).powf(-exponent);
            assert!((mixture - law).abs() < 0.002, "{exponent} {t_s}: {mixture} for {law}");
        }
    }
}

#[test]
fn a_play_encloses_its_width_times_its_stroke() {
    let (half, stroke, steps) = (0.1, 1.0, 1000);
    let up = (0..=steps).map(|k| stroke * f64::from(k) / f64::from(steps));
    let (mut value, mut area, mut last) = (0.0, 0.0, 0.0);
    // Once round to be on the loop, then the integral of output by input round it.
    for lap in 0..2 {
        for input in up.clone().chain(up.clone().rev()) {
            let next = play(value, input, half);
            if lap == 1 {
                area += f64::midpoint(value, next) * (input - last);
            }
            (value, last) = (next, input);
        }
    }
    // Play of half-width r over a stroke A: a parallelogram of 2 r (A - 2 r).
    assert!((area.abs() - 2.0 * half * (stroke - 2.0 * half)).abs() < 1e-3, "{area}");
}

#[test]
fn preisach_forgets_small_loops_once_outdone_and_closes_them() {
    let mut outdone = Preisach::new(0.1);
    for input in [0.6, 0.2, 0.5, 0.3, 0.4, 0.35, 0.9] {
        outdone.follow(input);
    }
    let mut plain = Preisach::new(0.1);
    plain.follow(0.9);
    assert!((outdone.follow(0.4) - plain.follow(0.4)).abs() < 1e-15, "wiping out");

    let mut minor = Preisach::new(0.1);
    minor.follow(0.8);
    let before = minor.follow(0.3);
    let at_top = minor.follow(0.5);
    let after = minor.follow(0.3);
    assert!((before - after).abs() < 1e-15, "return point");
    assert!(at_top > after);
    assert!(minor.follow(0.0).abs() < 1e-15, "all off");
    assert!((minor.follow(1.0) - 1.0).abs() < 1e-15, "all on");
}

#[test]
fn preisach_goes_up_below_and_comes_down_above_its_mean_branch() {
    let mut memory = Preisach::new(0.1);
    assert!(memory.follow(0.5) < memory.mean_branch(0.5));
    memory.follow(1.0);
    assert!(memory.follow(0.5) > memory.mean_branch(0.5));
}

#[test]
fn bouc_wen_goes_to_its_limit_on_the_way_down() {
    let base = RandomRig::new(2).unwrap();
    let (mut sensor, drawn) = sensor(&base, "hysteresis-bouc-wen", 1.0);
    let path = |t_s: f64| above(&base, -0.02 * t_s);
    let frames = (0..=1500).map(|frame| f64::from(frame) / 30.0);
    for t_s in frames {
        sensor.step(t_s, &path);
    }
    let plain_mm = {
        let mut sensor = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
        indentation_mm(&base, sensor.step(0.0, &above(&base, -1.0)))
    };
    // One mm deep: dz = dx (1 - z/limit) has come to rest.
    let more = indentation_mm(&base, sensor.counts()) / plain_mm - 1.0;
    let limit = drawn("weight") * drawn("limit_mm");
    assert!((more / limit - 1.0).abs() < 1e-3, "{more} for {limit}");
}

#[test]
fn a_filter_of_second_order_answers_a_step_as_the_books_say() {
    let base = RandomRig::new(2).unwrap();
    let (mut sensor, drawn) = sensor(&base, "low-pass-second-order", 3.0);
    let path = |t_s: f64| above(&base, if t_s > 0.0 { -0.5 } else { 1.0 });
    sensor.step(0.0, &path);
    sensor.step(1e-9, &path);
    let time_s = drawn("time_constant_s");
    let settled_mm = {
        let mut plain = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
        indentation_mm(&base, plain.step(0.0, &above(&base, -0.5)))
    };
    for t_s in [0.05, 0.1, 0.2, 0.5] {
        sensor.step(t_s, &path);
        let share = indentation_mm(&base, sensor.counts()) / settled_mm;
        let exact = 1.0 - (1.0 + t_s / time_s) * (-t_s / time_s).exp();
        // The second pole takes what the first gives as straight between steps of 1/240 s.
        assert!((share - exact).abs() < 1e-3, "{t_s}: {share} for {exact}");
    }
}

#[test]
fn a_moving_average_lags_a_ramp_by_half_its_window_and_a_late_frame_by_its_lag() {
    let base = RandomRig::new(2).unwrap();
    let path = |t_s: f64| above(&base, -0.2 * t_s);
    for (id, name, share) in [("low-pass-moving-average", "window_s", 0.5), ("late-frames", "lag_s", 1.0)] {
        let (mut lagging, drawn) = sensor(&base, id, 1.0);
        let mut plain = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
        let side = if id == "late-frames" && drawn("side") < 0.0 { -1.0 } else { 1.0 };
        for frame in 0..=60 {
            lagging.step(f64::from(frame) / 30.0, &path);
        }
        let lagged_mm = indentation_mm(&base, lagging.counts());
        let plain_mm = indentation_mm(&base, plain.step(2.0 - side * share * drawn(name), &path));
        assert!((lagged_mm - plain_mm).abs() < 1e-9, "{id}: {lagged_mm} for {plain_mm}");
    }
}

#[test]
fn a_scan_samples_the_first_row_earliest_and_the_last_element_at_the_stamp() {
    let base = RandomRig::new(2).unwrap();
    let (mut skewed, drawn) = sensor(&base, "scan-elements", 1.0);
    let mut plain = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
    let path = |t_s: f64| above(&base, -0.2 * t_s);
    for frame in 0..=60 {
        skewed.step(f64::from(frame) / 30.0, &path);
    }
    let now = plain.step(2.0, &path).to_vec();
    assert!((skewed.counts()[47] - now[47]).abs() < 1e-9);
    let earlier = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0)
        .step(2.0 - drawn("scan_s") * 47.0 / 48.0, &path)
        .to_vec();
    assert!((skewed.counts()[0] - earlier[0]).abs() < 1e-9);
}

#[test]
fn a_column_shares_what_its_elements_read() {
    let base = RandomRig::new(2).unwrap();
    let (mut shared, drawn) = sensor(&base, "crosstalk-column", 1.0);
    let mut plain = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
    let baselines = &base.sensor.model.response().baseline_counts;
    let clean: Vec<f64> =
        plain.step(0.0, &above(&base, -0.5)).iter().zip(baselines).map(|(count, b)| count - b).collect();
    let others: f64 = [3, 11, 27, 35, 43].iter().map(|element| clean[*element]).sum();
    let signal = shared.step(0.0, &above(&base, -0.5))[19] - baselines[19];
    assert!((signal - clean[19] - drawn("share") * others).abs() < 1e-9);
}

#[test]
fn an_imprint_shows_after_release_only_and_closes() {
    let base = RandomRig::new(2).unwrap();
    let (mut sensor, drawn) = sensor(&base, "imprint-two-exponentials", 1.0);
    let path = |t_s: f64| above(&base, if t_s > 0.0 && t_s < 2.0 { -0.5 } else { 1.0 });
    let mut at = |t_s: f64| indentation_mm(&base, sensor.step(t_s, &path));
    at(0.0);
    let held_mm = at(1.0);
    assert!((at(1.999) - held_mm).abs() < 1e-12);
    let skin = drawn("skin_share");
    for t_s in [2.0_f64, 4.0, 20.0] {
        let since_s = t_s - 1.999;
        let exact = drawn("share")
            * held_mm
            * (skin * (-since_s / drawn("time_constant_1_s")).exp()
                + (1.0 - skin) * (-since_s / drawn("time_constant_2_s")).exp());
        assert!((at(t_s) - exact).abs() < 1e-9, "{t_s}");
    }
}
