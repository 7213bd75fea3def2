use crate::effect::bench::{effect, fine, free, model, simulator, still, upon};
use crate::{Array, Blur, Covering, ForwardModel, Psf, Response};

fn tail(tail_share: f64, width_ratio: f64) -> crate::Effect {
    effect("heavy-tail", [("tail_share", tail_share), ("width_ratio", width_ratio)])
}

#[test]
fn a_point_is_spread_by_the_mixture() {
    let one = fine(tail(0.3, 2.5));
    let counts = still(&one, upon(&one, 0, 1.0));
    let gaussian = |r2: f64, sigma: f64| (-0.5 * r2 / sigma.powi(2)).exp() / sigma.powi(2);
    for (element, r2) in [(0, 0.0), (1, 1.0), (4, 2.0), (8, 32.0)] {
        let want = 0.7 * gaussian(r2, 1.0) + 0.3 * gaussian(r2, 2.5);
        assert!((counts[element] / want - 1.0).abs() < 1e-5, "element {element}: {} {want}", counts[element]);
    }
}

#[test]
fn a_point_is_spread_by_a_mixture_of_any_gaussians() {
    let one = fine(free("heavy-tail", [], &[1.5, 2.5, 4.0], &[0.2, 0.0, 0.3]));
    let counts = still(&one, upon(&one, 0, 1.0));
    let gaussian = |r2: f64, sigma: f64| (-0.5 * r2 / sigma.powi(2)).exp() / sigma.powi(2);
    for (element, r2) in [(0, 0.0), (1, 1.0), (4, 2.0), (8, 32.0)] {
        let want = 0.5 * gaussian(r2, 1.0) + 0.2 * gaussian(r2, 1.5) + 0.3 * gaussian(r2, 4.0);
        assert!((counts[element] / want - 1.0).abs() < 1e-5, "element {element}: {} {want}", counts[element]);
    }
}

#[test]
fn shares_of_more_than_all_leave_nothing_in_the_core() {
    let one = fine(free("heavy-tail", [], &[1.5, 3.0], &[0.6, 0.9]));
    let same = fine(free("heavy-tail", [], &[1.5, 3.0], &[0.4, 0.6]));
    let tip_mm = upon(&one, 0, 1.0);
    for (got, want) in still(&one, tip_mm).iter().zip(still(&same, tip_mm)) {
        assert!((got - want).abs() < 1e-9 * want, "{got} {want}");
    }
}

/// Student's family is a mean over Gaussians of which the precisions have a gamma density: `(1 + r^2 / 2)^-2` of those with the density `exp(-1 / sigma^2)`.
#[test]
fn a_power_law_is_a_sum_of_a_few_gaussians() {
    let ratios: Vec<f64> = (0..10).map(|k| 0.45 * 1.6_f64.powi(k)).collect();
    let shares: Vec<f64> = ratios.iter().map(|ratio| ratio.powi(-2) * (-ratio.powi(-2)).exp()).collect();
    let one = fine(free("heavy-tail", [], &ratios, &shares));
    let counts = still(&one, upon(&one, 0, 1.0));
    for (element, r2) in [(1, 1.0), (4, 2.0), (8, 32.0)] {
        let (got, want) = (counts[element] / counts[0], (1.0_f64 + 0.5 * r2).powi(-2));
        assert!((got / want - 1.0).abs() < 0.03, "element {element}: {got} {want}");
    }
}

#[test]
fn nothing_pressed_is_lost_or_gained() {
    // An array that covers all of both Gaussians: each element reads in proportion to its share.
    let centres: Vec<f64> = (0..30).map(|k| 2.0 * f64::from(k)).collect();
    let array = Array::new("wide", [2.0; 2], centres.clone(), centres, 30.0, 4095.0, 1.0).unwrap();
    let response = Response::uniform(900, 1.0, 0.0);
    let mut one = simulator([tail(0.4, 2.0)]);
    one.model = ForwardModel::new(array, Psf::PAPER, response).unwrap();
    let mut plain = one.clone();
    plain.effects.clear();
    let sum = |one: &_| -> f64 { still(one, upon(&plain, 435, 0.5)).iter().sum() };
    assert!((sum(&one) / sum(&plain) - 1.0).abs() < 1e-4, "{} {}", sum(&one), sum(&plain));
}

#[test]
fn all_tail_of_the_cores_width_is_the_core() {
    let (plain, same) = (simulator([]), simulator([tail(0.6, 1.0)]));
    let tip_mm = upon(&plain, 21, 0.5);
    for (got, want) in still(&same, tip_mm).iter().zip(still(&plain, tip_mm)) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn a_wide_tail_takes_from_the_peak_what_blur_says() {
    let (plain, wide) = (simulator([]), simulator([tail(0.25, 3.0)]));
    let rise = |one: &_| {
        let counts = still(one, upon(&plain, 21, 0.1))[21];
        let rise = (counts - 100.0) / model().response().sensitivity_counts_per_mm[21];
        ((1.0 + 0.6 * rise).sqrt() - 1.0) / 0.3
    };
    // A point in the element's middle: the shares that arrive, one along x and one along y. The tool is half a mm
    // in radius against a spread of 2.7 mm.
    let share = |sigma_mm: f64| Blur { sigma_mm }.of_point(0.0, [-0.9, 0.9]).powi(2);
    let sigma_mm = Psf::PAPER.sigma_mm(Covering { thickness_mm: 1.016 });
    let want = 0.75 + 0.25 * share(3.0 * sigma_mm) / share(sigma_mm);
    assert!((rise(&wide) / rise(&plain) / want - 1.0).abs() < 0.005);
}
