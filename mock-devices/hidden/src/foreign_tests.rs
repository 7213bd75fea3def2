//! Forms that the library does not have, and physics outside it: each at a place or limit where it is known in closed form.

use super::friction::wound;
use super::relaxation::stretched;
use super::tests::sensor;
use super::*;
use crate::{Climate, HiddenSensor, RandomRig};

const DEPTH_MM: f64 = 0.5;
const FRAME_S: f64 = 1.0 / 30.0;

/// A value that the physics drew.
type Drawn = Box<dyn Fn(&str) -> f64>;

fn base() -> RandomRig {
    RandomRig::new(2).unwrap()
}

/// A place near the middle, sensor frame.
fn place(base: &RandomRig) -> [f64; 2] {
    let [x, y] = base.rig.array.extent_mm().map(|[least, greatest]| f64::midpoint(least, greatest));
    [x + 2.0, y + 1.0]
}

fn away(base: &RandomRig) -> [f64; 2] {
    let half_mm = base.rig.array.extent_mm().map(|[least, greatest]| (greatest - least) / 2.0);
    [2.0 / half_mm[0], 1.0 / half_mm[1]]
}

fn tip(base: &RandomRig, at_mm: [f64; 2], depth_mm: f64) -> [f64; 3] {
    let [x, y] = base.rig.registration.to_robot(at_mm);
    [x, y, -depth_mm]
}

/// Signals of the base model in mm of equivalent indentation, or with one physics.
fn signals(base: &RandomRig, counts: &[f64]) -> Vec<f64> {
    let response = base.sensor.model.response();
    let rise = counts.iter().zip(&response.baseline_counts).map(|(count, baseline)| count - baseline);
    rise.zip(&response.sensitivity_counts_per_mm).map(|(rise, gain)| rise / gain).collect()
}

fn plain(base: &RandomRig, at_mm: [f64; 2], depth_mm: f64) -> Vec<f64> {
    let mut sensor = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
    signals(base, sensor.step(0.0, &tip(base, at_mm, depth_mm)))
}

/// With one physics of strength 1, at rest from the first moment on.
fn still(base: &RandomRig, id: &str, at_mm: [f64; 2], depth_mm: f64) -> (Vec<f64>, Drawn) {
    dosed(base, id, 1.0, at_mm, depth_mm)
}

fn dosed(base: &RandomRig, id: &str, strength: f64, at_mm: [f64; 2], depth_mm: f64) -> (Vec<f64>, Drawn) {
    let (mut sensor, drawn) = sensor(base, id, strength);
    (signals(base, sensor.step(0.0, &tip(base, at_mm, depth_mm))), Box::new(drawn))
}

/// Signals at each frame of a path, and what the physics drew.
fn along(base: &RandomRig, id: &str, frames: u32, path: &dyn Fn(f64) -> [f64; 3]) -> (Vec<Vec<f64>>, Drawn) {
    let (mut sensor, drawn) = sensor(base, id, 1.0);
    let step = |frame: u32| signals(base, sensor.step(f64::from(frame) * FRAME_S, &path));
    ((0..frames).map(step).collect(), Box::new(drawn))
}

#[track_caller]
fn near(one: &[f64], other: &[f64], tolerance: f64) {
    let off = one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < tolerance, "{off} apart");
}

fn scaled(values: &[f64], by: f64) -> Vec<f64> {
    values.iter().map(|value| value * by).collect()
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

#[test]
fn every_effect_has_three_foreign_forms_and_twenty_physics_are_outside() {
    let mut foreign: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
    for definition in CATALOGUE {
        if let Some(effect) = definition.effect {
            *foreign.entry(effect).or_default() += usize::from(!definition.is_library_point);
        }
    }
    assert!(foreign.values().all(|count| *count >= 3), "{foreign:?}");
    assert!(CATALOGUE.iter().filter(|definition| definition.effect.is_none()).count() >= 20);
}

#[test]
fn a_bent_guide_a_screw_and_unequal_axes_move_the_place() {
    let base = base();
    let at_mm = place(&base);
    let moved = |[dx, dy]: [f64; 2]| plain(&base, [at_mm[0] + dx, at_mm[1] + dy], DEPTH_MM);
    let (bent, drawn) = still(&base, "bent-guide", at_mm, DEPTH_MM);
    near(&bent, &moved([0.0, drawn("side") * drawn("bow_mm") * away(&base)[0].powi(2)]), 1e-12);
    let (unequal, drawn) = still(&base, "unequal-axes", at_mm, DEPTH_MM);
    let stretch = drawn("side") * drawn("stretch");
    near(&unequal, &moved([2.0 * stretch, -stretch]), 1e-12);
    let (turned, drawn) = still(&base, "screw-error", at_mm, DEPTH_MM);
    let [x, y] = base.rig.registration.to_robot(at_mm);
    let error = |at_mm: f64, phase: &str| {
        let turns = at_mm / drawn("pitch_mm");
        drawn("error_mm") * (std::f64::consts::TAU * turns + drawn(phase)).sin()
    };
    let truly = [x + error(x, "phase_x_rad"), y + error(y, "phase_y_rad")];
    near(&turned, &plain(&base, base.rig.registration.to_sensor(truly), DEPTH_MM), 1e-12);
}

#[test]
fn surfaces_that_are_no_plane_change_the_depth_at_a_place() {
    let base = base();
    let at_mm = place(&base);
    let deeper = |by_mm: f64| plain(&base, at_mm, DEPTH_MM + by_mm);
    let along = |drawn: &Drawn, [x, y]: [f64; 2]| {
        let (sin, cos) = drawn("direction_deg").to_radians().sin_cos();
        cos * x + sin * y
    };
    let (bowed, drawn) = still(&base, "bowed-surface", at_mm, DEPTH_MM);
    let half_mm = [2.0 / away(&base)[0], 1.0 / away(&base)[1]];
    let bow_mm = drawn("side") * drawn("bow_mm") * 5.0 / dot(half_mm, half_mm);
    near(&bowed, &deeper(drawn("slope") * along(&drawn, [2.0, 1.0]) + bow_mm), 1e-12);
    let (twisted, drawn) = still(&base, "twisted-surface", at_mm, DEPTH_MM);
    let [x, y] = away(&base);
    near(&twisted, &deeper(drawn("side") * drawn("lift_mm") * x * y), 1e-12);
    // Once on each side of the fold.
    let (folded, drawn) = still(&base, "folded-surface", at_mm, DEPTH_MM);
    let beyond_mm = along(&drawn, [2.0 - drawn("off_x_mm"), 1.0 - drawn("off_y_mm")]);
    near(&folded, &deeper(drawn("slope") * beyond_mm.max(0.0)), 1e-12);
    let mirrored_mm = [at_mm[0] - 4.0, at_mm[1] - 2.0];
    let beyond_mm = along(&drawn, [-2.0 - drawn("off_x_mm"), -1.0 - drawn("off_y_mm")]);
    let (folded, _) = still(&base, "folded-surface", mirrored_mm, DEPTH_MM);
    near(&folded, &plain(&base, mirrored_mm, DEPTH_MM + drawn("slope") * beyond_mm.max(0.0)), 1e-12);
}

/// The depth that a form makes of the tool's.
type Law = fn(&Drawn, f64) -> f64;

#[test]
fn forms_of_the_depth_alone_scale_the_image() {
    let base = base();
    let at_mm = place(&base);
    let laws: [(&str, Law); 4] = [
        ("toe", |drawn, depth| (depth * depth + drawn("toe_mm").powi(2)).sqrt() - drawn("toe_mm")),
        ("hardening-limit", |drawn, depth| depth / (1.0 - depth * drawn("inverse_length_per_mm"))),
        ("hardening-two-layers", |drawn, depth| {
            depth + drawn("stiffer") * (depth - drawn("from_mm")).max(0.0)
        }),
        // Away from its ends, which are 0.02 mm wide, the step is straight.
        ("hardening-step", |drawn, depth| {
            depth + drawn("stiffer") * (depth.min(drawn("to_mm")) - drawn("from_mm")).max(0.0)
        }),
    ];
    for (id, law) in laws {
        for depth_mm in [0.1, 0.6] {
            let (with, drawn) = still(&base, id, at_mm, depth_mm);
            let tolerance = if id == "hardening-step" { 1e-3 } else { 1e-12 };
            let wanted = scaled(&plain(&base, at_mm, depth_mm), law(&drawn, depth_mm) / depth_mm);
            near(&with, &wanted, tolerance);
        }
    }
}

#[test]
fn a_surface_settles_and_a_column_grows() {
    let base = base();
    let at_mm = place(&base);
    for id in ["settling-surface", "thermal-growth"] {
        let (mut with, drawn) = sensor(&base, id, 1.0);
        let path = tip(&base, at_mm, DEPTH_MM);
        with.step(0.0, &path);
        let later = signals(&base, with.step(60.0, &path));
        let climate = Climate::new(1);
        let by_mm = match id {
            "settling-surface" => -drawn("sunk_mm") * (1.0 - (-60.0 / drawn("time_constant_s")).exp()),
            _ => drawn("side") * drawn("mm_per_k") * (climate.at(60.0) - climate.at(0.0)),
        };
        near(&later, &plain(&base, at_mm, DEPTH_MM + by_mm), 1e-12);
    }
}

#[test]
fn lags_that_change_look_back_by_what_they_say() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, 0.1 * t_s);
    let at = |t_s: f64| plain(&base, at_mm, 0.1 * t_s);
    let (clock, drawn) = along(&base, "late-frames-clock", 90, &path);
    let t_s = 89.0 * FRAME_S;
    near(&clock[89], &at(t_s * (1.0 - drawn("side") * drawn("rate"))), 1e-12);
    let (bundles, drawn) = along(&base, "late-frames-bundles", 90, &path);
    let waits = 1.0 - (t_s / (drawn("frames") * FRAME_S)).fract();
    near(&bundles[89], &at(t_s - drawn("longest_lag_s") * waits), 1e-9);
    let (jitter, drawn) = along(&base, "late-frames-jitter", 90, &path);
    let lag_s = |frame: usize| {
        let [here, before] =
            [at(frame as f64 * FRAME_S), at(frame as f64 * FRAME_S - 0.1)].map(|all| sum(&all));
        0.1 * (here - sum(&jitter[frame])) / (here - before)
    };
    let lags_s: Vec<f64> = (30..90).map(lag_s).collect();
    let longest_s = 2.0 * drawn("mean_lag_s");
    assert!(lags_s.iter().all(|lag_s| (-1e-9..longest_s + 1e-9).contains(lag_s)), "{lags_s:?}");
    assert!((sum(&lags_s) / 60.0 - drawn("mean_lag_s")).abs() < 0.3 * drawn("mean_lag_s"));
}

#[test]
fn friction_winds_up_to_its_limit_however_the_way_is_divided() {
    let whole = wound(0.0, 0.04, 0.05);
    let halves = wound(wound(0.0, 0.02, 0.05), 0.02, 0.05);
    assert!((whole - halves).abs() < 1e-15 && (whole - 0.05 * (1.0 - (-0.8_f64).exp())).abs() < 1e-15);
    assert!((wound(0.03, 10.0, 0.05) - 0.05).abs() < 1e-15);
    assert!((wound(0.03, -10.0, 0.05) + 0.05).abs() < 1e-15);
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, 0.3 * t_s - 0.3);
    let (dahl, drawn) = along(&base, "lost-motion-dahl", 90, &path);
    let lag_mm = drawn("wound_mm") * drawn("share_z");
    let wanted = plain(&base, at_mm, 0.3 * 89.0 * FRAME_S - 0.3 - lag_mm);
    near(&dahl[89], &wanted, 1e-6);
}

#[test]
fn an_axis_that_sticks_stands_and_then_is_right() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, 0.2 + 0.1 * t_s);
    let (stuck, _) = along(&base, "lost-motion-stiction", 60, &path);
    let is_right = |frame: usize| {
        let wanted = plain(&base, at_mm, 0.2 + 0.1 * frame as f64 * FRAME_S);
        (sum(&stuck[frame]) - sum(&wanted)).abs() < 1e-9
    };
    let stands = |frame: usize| (sum(&stuck[frame]) - sum(&stuck[frame - 1])).abs() < 1e-12;
    assert!((1..60).all(|frame| is_right(frame) || stands(frame)));
    assert!((1..60).any(is_right) && (1..60).any(stands));
}

#[test]
fn worn_screws_have_their_play_in_the_middle_only() {
    let base = base();
    let [x, y] = base.rig.array.extent_mm().map(|[least, greatest]| f64::midpoint(least, greatest));
    let lag = |at_mm: [f64; 2]| {
        let (mut with, _) = sensor(&base, "lost-motion-worn", 1.0);
        with.step(0.0, &tip(&base, [at_mm[0] - 1.0, at_mm[1]], -1.0));
        let lagging = signals(&base, with.step(1.0, &tip(&base, at_mm, DEPTH_MM)));
        let right = plain(&base, at_mm, DEPTH_MM);
        lagging.iter().zip(&right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(lag([x, y]) > 1e-3, "{}", lag([x, y]));
    let far = lag([x + 40.0, y]);
    assert!(far < 1e-12, "{far}");
}

#[test]
fn a_tool_of_another_width_presses_by_its_area() {
    let base = base();
    let at_mm = place(&base);
    let declared_mm = 1.0;
    let width_mm = |signals: &[f64], depth_mm: f64| {
        declared_mm * (sum(signals) / sum(&plain(&base, at_mm, depth_mm))).sqrt()
    };
    let (rounded, drawn) = still(&base, "rounded-rim", at_mm, 0.1);
    let radius_mm = drawn("radius_mm");
    let wanted_mm = declared_mm - 2.0 * radius_mm + 2.0 * (0.2 * radius_mm - 0.01).sqrt();
    assert!((width_mm(&rounded, 0.1) - wanted_mm).abs() < 2e-3, "{} {wanted_mm}", width_mm(&rounded, 0.1));
    near(&still(&base, "rounded-rim", at_mm, DEPTH_MM).0, &plain(&base, at_mm, DEPTH_MM), 1e-6);
    let (spread, drawn) = still(&base, "spreading-tip", at_mm, DEPTH_MM);
    let wanted_mm = 1.0 + drawn("excess") * (1.0 - (-DEPTH_MM / drawn("scale_mm")).exp());
    assert!((width_mm(&spread, DEPTH_MM) - wanted_mm).abs() < 2e-3);
    let (mut worn, drawn) = sensor(&base, "wearing-tool", 1.0);
    worn.step(0.0, &tip(&base, at_mm, DEPTH_MM));
    let worn = signals(&base, worn.step(20.0, &tip(&base, at_mm, DEPTH_MM)));
    let wanted_mm = 1.0 - drawn("worn") * (1.0 - (-20.0 / drawn("time_constant_s")).exp());
    assert!((width_mm(&worn, DEPTH_MM) - wanted_mm).abs() < 2e-3);
}

#[test]
fn a_tool_that_yields_leans_as_a_cocked_one_at_each_depth() {
    let base = base();
    let at_mm = place(&base);
    let (yielding, drawn) = still(&base, "yielding-tool", at_mm, DEPTH_MM);
    let rise =
        drawn("lean_at_thickness_deg").to_radians().tan() * DEPTH_MM / base.sensor.covering.thickness_mm;
    // The same seed gives both the same direction.
    let (cocked, _) = dosed(&base, "cocked-tool", rise.atan().to_degrees() / 8.0, at_mm, DEPTH_MM);
    near(&yielding, &cocked, 1e-12);
    let middle_mm = [at_mm[0] - 2.0, at_mm[1] - 1.0];
    near(&still(&base, "bending-arm", middle_mm, DEPTH_MM).0, &plain(&base, middle_mm, DEPTH_MM), 1e-6);
    let bent = still(&base, "bending-arm", at_mm, DEPTH_MM).0;
    assert!(sum(&bent) < sum(&plain(&base, at_mm, DEPTH_MM)) - 1e-3);
}

#[test]
fn a_wobbling_tool_leans_in_one_direction_for_each_press() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, if (t_s / 0.5).fract() < 0.5 { -1.0 } else { DEPTH_MM });
    let (readings, _) = along(&base, "wobbling-tool", 60, &path);
    near(&readings[10], &readings[13], 1e-12);
    let off: f64 = readings[10].iter().zip(&readings[25]).map(|(a, b)| (a - b).abs()).sum();
    assert!(off > 1e-3, "{off}");
}

#[test]
fn spreads_that_stretch_are_the_stretched_spread_where_they_reach_its_ratio() {
    let base = base();
    let at_mm = place(&base);
    let stretched = |stretch: f64| dosed(&base, "stretched-spread", stretch / 0.08, at_mm, DEPTH_MM).0;
    let share = DEPTH_MM / base.sensor.covering.thickness_mm;
    near(&still(&base, "stretched-by-depth", at_mm, DEPTH_MM).0, &stretched(0.25 * share), 1e-12);
    // The place is right of the seam.
    near(&still(&base, "stretched-half", at_mm, DEPTH_MM).0, &stretched(0.12), 1e-12);
    let left_mm = [at_mm[0] - 4.0, at_mm[1]];
    near(&still(&base, "stretched-half", left_mm, DEPTH_MM).0, &plain(&base, left_mm, DEPTH_MM), 1e-12);
}

#[test]
fn a_slanted_spread_gives_to_one_diagonal_what_it_takes_from_the_other() {
    let base = base();
    let centre_mm = base.rig.array.centre_mm(19).unwrap();
    let (slanted, drawn) = still(&base, "slanted-spread", centre_mm, DEPTH_MM);
    let even = plain(&base, centre_mm, DEPTH_MM);
    assert!((slanted[19] - even[19]).abs() < 1e-12);
    let ratio = |element: usize| drawn("side") * (slanted[element] / even[element] - 1.0);
    assert!(ratio(28) > 0.0 && ratio(10) > 0.0 && ratio(12) < 0.0 && ratio(26) < 0.0);
    assert!((ratio(28) - ratio(10)).abs() < 1e-9);
}

#[test]
fn a_skin_that_buckles_has_half_its_growth_at_the_depth_where_it_does() {
    let base = base();
    let at_mm = place(&base);
    let (_, drawn) = still(&base, "wider-beyond-depth", at_mm, 0.1);
    let from_mm = drawn("from_mm");
    let (half, _) = still(&base, "wider-beyond-depth", at_mm, from_mm);
    let wider = base.spread_by(1.0 + drawn("growth") / 2.0).unwrap();
    // Signals of another spread are stated for that spread's reference press.
    let shares = |signals: &[f64]| scaled(signals, 1.0 / sum(signals));
    near(&shares(&half), &shares(&plain(&wider, at_mm, from_mm)), 1e-6);
}

#[test]
fn edges_lose_what_they_say_at_the_edge() {
    let base = base();
    let [[left_mm, right_mm], [_, top_mm]] = base.rig.array.extent_mm();
    let corner_mm = [right_mm, top_mm];
    let (cut, drawn) = still(&base, "soft-corners", corner_mm, DEPTH_MM);
    near(&cut, &scaled(&plain(&base, corner_mm, DEPTH_MM), 1.0 - drawn("loss")), 1e-12);
    let (_, drawn) = still(&base, "glued-side", corner_mm, DEPTH_MM);
    let side_mm = if drawn("right_side") > 0.0 { right_mm } else { left_mm };
    let inward = if drawn("right_side") > 0.0 { -1.0 } else { 1.0 };
    for (lengths, left) in [(0.0, 1.0), (1.0, 0.5), (2.0, 0.2)] {
        let at_mm = [side_mm + inward * lengths * drawn("length_mm"), place(&base)[1]];
        let glued = still(&base, "glued-side", at_mm, DEPTH_MM).0;
        near(&glued, &scaled(&plain(&base, at_mm, DEPTH_MM), 1.0 - drawn("loss") * left), 1e-12);
    }
}

#[test]
fn an_own_knee_stiffens_the_elements_beyond_it_alone() {
    let base = base();
    let at_mm = place(&base);
    let (with, drawn) = still(&base, "hardening-own-knee", at_mm, DEPTH_MM);
    let law = |u: &f64| u + drawn("stiffer") * (u - drawn("from_mm")).max(0.0);
    near(&with, &plain(&base, at_mm, DEPTH_MM).iter().map(law).collect::<Vec<_>>(), 1e-12);
}

#[test]
fn a_plate_gives_the_same_to_every_element_within_its_radius() {
    let base = base();
    let at_mm = base.rig.array.centre_mm(19).unwrap();
    let (with, drawn) = still(&base, "plate-tail", at_mm, DEPTH_MM);
    let rest = plain(&base, at_mm, DEPTH_MM);
    let added: Vec<f64> =
        with.iter().zip(&rest).map(|(with, u)| with - (1.0 - drawn("weight")) * u).collect();
    assert!(added[19] > 0.0 && (added[19] - added[18]).abs() < 1e-12 && added[47].abs() < 1e-12, "{added:?}");
}

#[test]
fn a_spread_that_grows_with_the_cube_of_depth_is_that_spread_at_each_depth() {
    let base = base();
    let at_mm = place(&base);
    let (with, drawn) = still(&base, "wider-cubed", at_mm, DEPTH_MM);
    let share = DEPTH_MM / base.sensor.covering.thickness_mm;
    let wider = base.spread_by(1.0 + drawn("growth") * share.powi(3)).unwrap();
    let shares = |signals: &[f64]| scaled(signals, 1.0 / sum(signals));
    near(&shares(&with), &shares(&plain(&wider, at_mm, DEPTH_MM)), 1e-5);
}

#[test]
fn what_flows_by_load_loses_twice_the_share_at_twice_the_depth() {
    let base = base();
    let at_mm = place(&base);
    for depth_mm in [0.25, 0.5] {
        let (mut with, drawn) = sensor(&base, "relaxation-by-load", 1.0);
        with.step(0.0, &tip(&base, at_mm, -1.0));
        let held = signals(&base, with.step(2.0, &tip(&base, at_mm, depth_mm)));
        let flown = 1.0 - (-2.0 / drawn("time_constant_s")).exp();
        let share = drawn("share_at_thickness") * depth_mm / base.sensor.covering.thickness_mm;
        near(&held, &scaled(&plain(&base, at_mm, depth_mm), 1.0 - share * flown), 1e-12);
    }
}

#[test]
fn gains_cycle_and_jump() {
    let base = base();
    let path = |_: f64| tip(&base, place(&base), DEPTH_MM);
    let clean = plain(&base, place(&base), DEPTH_MM);
    let (cycle, drawn) = along(&base, "gain-cycle", 300, &path);
    let turn = std::f64::consts::TAU * 299.0 * FRAME_S / drawn("period_s");
    near(&cycle[299], &scaled(&clean, 1.0 + drawn("swing") * turn.sin()), 1e-9);
    let (jumps, drawn) = along(&base, "gain-jumps", 1500, &path);
    let levels = [1.0, 1.0 + drawn("side") * drawn("change")];
    let at = |row: &Vec<f64>, level: f64| (row[19] / clean[19] - level).abs() < 1e-9;
    assert!(jumps.iter().all(|row| levels.iter().any(|level| at(row, *level))));
    assert!(levels.iter().all(|level| jumps.iter().filter(|row| at(row, *level)).count() > 50));
}

#[test]
fn a_mixture_of_exponentials_is_the_stretched_one() {
    let (times_s, weights) = stretched(0.7);
    for t_s in [0.0, 0.05, 0.5, 2.0, 10.0] {
        let mixture: f64 = times_s.iter().zip(&weights).map(|(time_s, w)| w * (-t_s / time_s).exp()).sum();
        let law = (-(t_s / 0.7_f64).sqrt()).exp();
        assert!((mixture - law).abs() < 0.003, "{t_s}: {mixture} for {law}");
    }
}

#[test]
fn a_fast_press_is_stiffer_by_its_law() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, (0.3 * t_s).min(0.4));
    for (id, is_held) in [("rate-eyring", false), ("rate-saturating", true)] {
        let (readings, drawn) = along(&base, id, 60, &path);
        let ratio = 0.3 / drawn("scale_mm_per_s");
        let law = if is_held { ratio / (1.0 + ratio) } else { ratio.asinh() };
        let stiffer = 1.0 + drawn("share") * law;
        near(&readings[30], &scaled(&plain(&base, at_mm, 0.3), stiffer), 1e-9);
        near(&readings[59], &scaled(&plain(&base, at_mm, 0.4), if is_held { stiffer } else { 1.0 }), 1e-9);
    }
}

#[test]
fn a_dent_sets_in_the_dwell_and_closes_after_it() {
    let base = base();
    let at_mm = place(&base);
    let (mut sensor, drawn) = sensor(&base, "imprint-dwell", 1.0);
    let held = plain(&base, at_mm, DEPTH_MM);
    sensor.step(0.0, &tip(&base, at_mm, -1.0));
    near(&signals(&base, sensor.step(2.0, &tip(&base, at_mm, DEPTH_MM))), &held, 1e-12);
    let set = drawn("share") * (1.0 - (-2.0 / drawn("setting_s")).exp());
    let after = signals(&base, sensor.step(7.0, &tip(&base, at_mm, -1.0)));
    near(&after, &scaled(&held, set * (-5.0 / drawn("recovery_s")).exp()), 1e-12);
}

#[test]
fn work_softens_an_element_by_the_way_that_it_was_pressed() {
    let base = base();
    let at_mm = place(&base);
    let (mut sensor, drawn) = sensor(&base, "softening-work", 1.0);
    let held = plain(&base, at_mm, DEPTH_MM);
    for press in 0..3 {
        sensor.step(f64::from(press), &tip(&base, at_mm, -1.0));
        let with = signals(&base, sensor.step(f64::from(press) + 0.5, &tip(&base, at_mm, DEPTH_MM)));
        let ways = f64::from(press + 1);
        let law = |u: f64| u * (1.0 - drawn("loss") * (1.0 - (-ways * u / drawn("scale_mm")).exp()));
        near(&with, &held.iter().map(|u| law(*u)).collect::<Vec<_>>(), 1e-12);
    }
}

#[test]
fn charge_goes_on_to_the_next_element_and_stray_fields_fall_with_the_cube() {
    let base = base();
    let rise = |id: &str| {
        let (mut with, drawn) = sensor(&base, id, 1.0);
        let mut plain = HiddenSensor::new(&base.sensor, &[], Climate::new(1), 0);
        let path = tip(&base, place(&base), DEPTH_MM);
        let baselines = &base.sensor.model.response().baseline_counts;
        let of = |counts: &[f64]| -> Vec<f64> { counts.iter().zip(baselines).map(|(c, b)| c - b).collect() };
        (of(with.step(0.0, &path)), of(plain.step(0.0, &path)), drawn)
    };
    let (ghost, clean, drawn) = rise("crosstalk-ghost");
    assert!((ghost[20] - clean[20] - drawn("share") * clean[19]).abs() < 1e-9);
    assert!((ghost[0] - clean[0]).abs() < 1e-12);
    let (stray, clean, drawn) = rise("crosstalk-stray-field");
    let array = &base.rig.array;
    let pitch_mm = array.element_mm()[0];
    let from_others: f64 = (0..48)
        .filter(|other| *other != 20)
        .map(|other| {
            let [x, y] = minus(array.centre_mm(20).unwrap(), array.centre_mm(other).unwrap());
            clean[other] * (pitch_mm / x.hypot(y)).powi(3)
        })
        .sum();
    assert!((stray[20] - clean[20] - drawn("share") * from_others).abs() < 1e-9);
}

#[test]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an element's index")]
fn wires_that_come_and_go_are_right_or_wrong_and_nothing_between() {
    let base = base();
    for id in ["loose-contact", "flickering-address", "opens-when-pressed"] {
        let (_, drawn) = still(&base, id, place(&base), DEPTH_MM);
        let element = drawn("element") as usize;
        let at_mm = base.rig.array.centre_mm(element).unwrap();
        let beside = if element % 8 + 1 < 8 { element + 1 } else { element - 1 };
        let path = |t_s: f64| tip(&base, at_mm, 0.01 * t_s);
        let (readings, drawn) = along(&base, id, 1500, &path);
        let gain = |of: usize| base.sensor.model.response().sensitivity_counts_per_mm[of];
        let (mut right, mut wrong) = (0, 0);
        for (frame, with) in readings.iter().enumerate().skip(1) {
            let clean = plain(&base, at_mm, 0.01 * frame as f64 * FRAME_S);
            let fault =
                if id == "flickering-address" { clean[beside] * gain(beside) / gain(element) } else { 0.0 };
            let is_right = (with[element] - clean[element]).abs() < 1e-9;
            assert!(is_right || (with[element] - fault).abs() < 1e-9, "{id} at {frame}");
            if id == "opens-when-pressed" {
                assert_eq!(is_right, clean[element] * gain(element) <= drawn("limit_counts"));
            }
            (right, wrong) = if is_right { (right + 1, wrong) } else { (right, wrong + 1) };
        }
        assert!(right > 50 && wrong > 50, "{id}: {right} right, {wrong} wrong");
    }
}

#[test]
fn a_slow_warmth_is_the_temperature_in_the_end() {
    let base = base();
    let path = tip(&base, place(&base), DEPTH_MM);
    let (mut sensor, drawn) = sensor(&base, "gain-warmth", 1.0);
    let climate = Climate::new(1);
    sensor.step(0.0, &path);
    let later = signals(&base, sensor.step(1e5, &path));
    let gain = 1.0 + drawn("side") * drawn("per_k") * (climate.at(1e5) - climate.at(0.0));
    near(&later, &scaled(&plain(&base, place(&base), DEPTH_MM), gain), 1e-9);
}

#[test]
fn each_line_of_its_own_resistance_follows_a_step_exponentially() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, if t_s > 0.0 { DEPTH_MM } else { -1.0 });
    let (mut sensor, drawn) = sensor(&base, "low-pass-uneven", 1.0);
    sensor.step(0.0, &path);
    sensor.step(1e-9, &path);
    let end = plain(&base, at_mm, DEPTH_MM);
    let first = signals(&base, sensor.step(0.05, &path));
    let second = signals(&base, sensor.step(0.1, &path));
    let mut times_s = Vec::new();
    for element in 0..48 {
        let left = |values: &[f64]| 1.0 - values[element] / end[element];
        assert!((left(&second) - left(&first).powi(2)).abs() < 1e-6, "{element}");
        times_s.push(-0.05 / left(&first).ln());
    }
    let range_s = [0.2, 1.8].map(|share| share * drawn("time_constant_s"));
    assert!(times_s.iter().all(|time_s| (range_s[0]..range_s[1]).contains(time_s)), "{times_s:?}");
}

#[test]
fn scans_in_other_orders_sample_each_element_when_they_say() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, 0.2 * t_s);
    // The share of the scan that has passed when element 8, the first of the second row, and element 0 are sampled.
    for (id, of_second, of_first) in [
        ("scan-interleaved", 2.0 / 6.0, 5.0 / 6.0),
        ("scan-serpentine", 32.0 / 48.0, 47.0 / 48.0),
        ("scan-halves", 1.0, 1.0),
    ] {
        let (readings, drawn) = along(&base, id, 61, &path);
        for (element, share) in [(8, of_second), (0, of_first)] {
            let wanted = plain(&base, at_mm, 0.2 * (2.0 - share * drawn("scan_s")))[element];
            assert!((readings[60][element] - wanted).abs() < 1e-9, "{id} {element}");
        }
        let last = if id == "scan-serpentine" { 40 } else { 47 };
        assert!((readings[60][last] - plain(&base, at_mm, 0.4)[last]).abs() < 1e-9, "{id}");
    }
}

#[test]
fn a_hum_that_wanders_keeps_its_amplitude_and_loses_its_phase() {
    let base = base();
    let path = |_: f64| tip(&base, place(&base), -1.0);
    let (readings, drawn) = along(&base, "hum-wandering", 9000, &path);
    let response = base.sensor.model.response();
    let series: Vec<f64> =
        readings.iter().map(|row| row[0] * response.sensitivity_counts_per_mm[0]).collect();
    let most = 1.4 * drawn("amplitude_counts");
    assert!(series.iter().all(|count| count.abs() <= most));
    let turn = |frame: usize| std::f64::consts::TAU * drawn("frequency_hz") * frame as f64 * FRAME_S;
    let line = |frames: std::ops::Range<usize>| {
        let [re, im] = [f64::cos, f64::sin]
            .map(|wave| frames.clone().map(|frame| series[frame] * wave(turn(frame))).sum::<f64>());
        re.hypot(im) / frames.len() as f64
    };
    assert!(line(0..9000) < 0.8 * line(0..60), "{} {}", line(0..9000), line(0..60));
}

#[test]
fn uneven_converters_step_where_they_say() {
    let base = base();
    let (missing, drawn) = sensor(&base, "missing-codes", 1.0);
    let (period, width) = (drawn("period_counts"), drawn("missing_counts"));
    assert!((missing.convert(2.0 * period + 0.9 * width) - 2.0 * period).abs() < 1e-9);
    assert!((missing.convert(2.0 * period + 1.1 * width) - (2.0 * period + 1.1 * width)).abs() < 1e-9);
    let (uneven, drawn) = sensor(&base, "uneven-steps", 1.0);
    let (step, wide) = (drawn("step_counts"), drawn("wide_share"));
    assert!((uneven.convert(step * (4.0 + 1.99 * wide)) - 4.0 * step).abs() < 1e-9);
    assert!((uneven.convert(step * (4.0 + 2.01 * wide)) - 5.0 * step).abs() < 1e-9);
    let (companded, drawn) = sensor(&base, "companded", 1.0);
    let step = drawn("step_counts");
    for (count, doubled) in [(90.0, 1.0), (200.0, 2.0), (400.0, 4.0)] {
        let read = companded.convert(count);
        assert!(
            (read / (doubled * step)).fract().abs() < 1e-9 && (read - count).abs() <= doubled * step / 2.0
        );
    }
}

#[test]
fn outside_physics_of_the_covering_is_what_it_says() {
    let base = base();
    let at_mm = place(&base);
    let clean = plain(&base, at_mm, DEPTH_MM);
    let (taut, drawn) = still(&base, "taut-sheet", at_mm, DEPTH_MM);
    let lift_mm = drawn("lift") * DEPTH_MM * DEPTH_MM / base.sensor.covering.thickness_mm;
    near(&taut, &clean.iter().map(|u| u - lift_mm).collect::<Vec<_>>(), 1e-12);
    let (gritty, drawn) = still(&base, "grit", at_mm, DEPTH_MM);
    for (element, (with, u)) in gritty.iter().zip(&clean).enumerate() {
        let is_grain = (drawn("element") - element as f64).abs() < 0.5;
        let wanted = if is_grain { u + drawn("gain") * (u - drawn("from_mm")).max(0.0) } else { *u };
        assert!((with - wanted).abs() < 1e-12);
    }
    let (_, drawn) = still(&base, "air-pocket", at_mm, DEPTH_MM);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an element's index")]
    let bubble_mm = base.rig.array.centre_mm(drawn("near_element") as usize).unwrap();
    let squeezed = 1.0 - drawn("height_mm") * (1.0 - (-DEPTH_MM / drawn("height_mm")).exp()) / DEPTH_MM;
    let over = still(&base, "air-pocket", bubble_mm, DEPTH_MM).0;
    near(&over, &scaled(&plain(&base, bubble_mm, DEPTH_MM), squeezed), 1e-12);
    let path = |_: f64| tip(&base, at_mm, DEPTH_MM);
    let (shaken, drawn) = along(&base, "vibrating-table", 10, &path);
    let swing = drawn("swing_mm") * (std::f64::consts::TAU * drawn("frequency_hz") * 9.0 * FRAME_S).sin();
    near(&shaken[9], &scaled(&clean, 1.0 + swing / DEPTH_MM), 1e-12);
}

#[test]
fn outside_physics_of_the_electronics_changes_what_it_says_and_nothing_else() {
    let base = base();
    let at_mm = place(&base);
    let path = |t_s: f64| tip(&base, at_mm, if t_s < 1.0 { DEPTH_MM } else { -1.0 });
    let response = base.sensor.model.response();
    let rises = |signals: &[f64]| -> Vec<f64> {
        signals.iter().zip(&response.sensitivity_counts_per_mm).map(|(u, gain)| u * gain).collect()
    };
    let clean = rises(&plain(&base, at_mm, DEPTH_MM));
    let of = |id: &str, frames: u32| {
        let (readings, drawn) = along(&base, id, frames, &path);
        (readings.iter().map(|row| rises(row)).collect::<Vec<_>>(), drawn)
    };
    let (common, drawn) = of("common-mode", 1);
    let shift = drawn("side") * drawn("share") * sum(&clean) / 48.0;
    near(&common[0], &clean.iter().map(|rise| rise - shift).collect::<Vec<_>>(), 1e-9);
    let (shadow, drawn) = of("arm-shadow", 40);
    // 2 mm from the middle.
    let reach = 2.0 / drawn("length_mm");
    let counts = drawn("side") * drawn("counts") * reach.tanh();
    near(&shadow[0], &clean.iter().map(|rise| rise + counts).collect::<Vec<_>>(), 1e-9);
    near(&shadow[39], &[counts; 48], 1e-9);
    let (flicker, _) = of("gain-flicker", 2);
    for row in &flicker {
        near(row, &scaled(&clean, row[19] / clean[19]), 1e-9);
    }
    assert!((flicker[0][19] - flicker[1][19]).abs() > 1e-6);
    let (bursts, _) = of("row-bursts", 3000);
    let mut noisy: Vec<usize> = Vec::new();
    for row in &bursts[31..] {
        noisy.extend((0..48).filter(|element| row[*element].abs() > 1e-9).map(|element| element / 8));
    }
    assert!(!noisy.is_empty() && noisy.iter().all(|row| *row == noisy[0]));
    let (torn, _) = of("frame-tearing", 60);
    // The tool leaves between frames 29 and 30: rows show one or the other.
    let frame = &torn[30];
    assert!(frame.iter().zip(&clean).all(|(now, before)| now.abs() < 1e-9 || (now - before).abs() < 1e-9));
    let (flips, drawn) = of("bit-flips", 3000);
    let flipped = flips[31..].iter().flatten().filter(|count| count.abs() > 1e-9);
    assert!(flipped.clone().all(|count| (count - 64.0).abs() < 1e-9));
    let share = flipped.count() as f64 / 2969.0;
    assert!((share - drawn("flipped_share")).abs() < 0.01, "{share}");
    let (hum, _) = of("contact-hum", 60);
    assert!(sum(&hum[59]).abs() < 1e-9 && (sum(&hum[10]) - sum(&clean)).abs() > 1e-3);
    let (charge, drawn) = of("static-charge", 60);
    near(&charge[20], &clean, 1e-9);
    near(&charge[45], &scaled(&charge[31], (-14.0 * FRAME_S / drawn("time_constant_s")).exp()), 1e-9);
    assert!(sum(&charge[31]).abs() > 1.0);
    let (switched, drawn) = sensor(&base, "range-switch", 1.0);
    let step = drawn("side") * drawn("step_counts");
    for (by, wanted) in [(-1.0, 0.0), (1.0, step)] {
        let count = drawn("limit_counts") + by;
        assert!((switched.convert(count) - count - wanted).abs() < 1e-9);
    }
}
