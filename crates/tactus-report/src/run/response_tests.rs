use tactus_model::Array;
use tactus_schema::Rig;

use super::{RespondsTo, ResponseCurves};
use crate::run::{DwellSummary, PressSummary, PressWay};

const DEPTHS_MM: [f64; 5] = [0.2, 0.3, 0.4, 0.5, 0.6];

fn rig() -> Rig {
    Rig::from_toml(include_str!("../../../../config/rigs/sim.toml")).unwrap()
}

/// Presses at all centres; an element reads `rise(depth)` times its share of the press.
fn presses(rise: impl Fn(f64) -> f64, share: impl Fn(usize, usize) -> f64) -> Vec<PressSummary> {
    let array = rig().array;
    #[expect(clippy::cast_possible_truncation, reason = "readings are f32")]
    let dwell = |pressed: usize, depth_mm: f64| DwellSummary {
        at_s: 0.0,
        depth_mm,
        covering_mm: 1.016,
        frames: 8,
        rise_counts: (0..48).map(|element| (rise(depth_mm) * share(element, pressed)) as f32).collect(),
    };
    (0..48)
        .map(|pressed| PressSummary {
            index: i32::try_from(pressed).unwrap(),
            at_mm: array.centre_mm(pressed).unwrap(),
            element: Some(pressed),
            way: PressWay::default(),
            dwells: DEPTHS_MM.map(|depth_mm| dwell(pressed, depth_mm)).to_vec(),
        })
        .collect()
}

/// A Gaussian of the distance, as under the paper's thinnest covering.
fn spread(element: usize, pressed: usize) -> f64 {
    let array = Array::digitacts();
    let ([ax, ay], [bx, by]) = (array.centre_mm(element).unwrap(), array.centre_mm(pressed).unwrap());
    (-((ax - bx).powi(2) + (ay - by).powi(2)) / (2.0 * 2.72_f64.powi(2))).exp()
}

#[test]
fn exact_responses_give_their_polynomial() {
    let response =
        ResponseCurves::of(&rig(), &presses(|x| 10.0 + 600.0 * x + 400.0 * x * x, spread)).unwrap();
    assert_eq!((response.curves.len(), response.unresponsive.len(), response.mean.len()), (48, 0, 5));
    let fitted: Vec<f64> = response.quadratic.unwrap().coefficients.iter().map(|c| c.value).collect();
    for (got, expected) in fitted.iter().zip([10.0, 600.0, 400.0]) {
        // Readings are f32.
        assert!((got - expected).abs() < 0.05, "{fitted:?}");
    }
    // The line through a parabola at five even places: slope b + 2 c (their middle).
    let slope = response.linear.unwrap().coefficients[1].value;
    assert!((slope - (600.0 + 2.0 * 400.0 * 0.4)).abs() < 0.01, "{slope}");
}

#[test]
fn cross_wired_and_dead_elements_are_found_and_left_out() {
    let share = |element, pressed| match element {
        18 => spread(19, pressed),
        22 => spread(23, pressed),
        40 => 0.0,
        element => spread(element, pressed),
    };
    for sign in [1.0, -1.0] {
        let response = ResponseCurves::of(&rig(), &presses(|x| sign * 1000.0 * x, share)).unwrap();
        let found: Vec<_> =
            response.unresponsive.iter().map(|s| (s.curve.element, s.curve.place, s.answers_to)).collect();
        assert_eq!(
            found,
            [
                (18, [2, 2], RespondsTo::Element([2, 3])),
                (22, [2, 6], RespondsTo::Element([2, 7])),
                (40, [5, 0], RespondsTo::Nothing)
            ],
            "sign {sign}"
        );
        assert_eq!(response.curves.len(), 45);
        let slope = response.linear.unwrap().coefficients[1].value;
        assert!((slope - sign * 1000.0).abs() < 0.01, "{slope}");
    }
}

/// As the part `tilt` of `diagnose`: the elements that the faulty ones answer for are not pressed.
#[test]
fn cross_wired_elements_are_found_where_only_every_second_element_is_pressed() {
    let share = |element, pressed| match element {
        18 => spread(19, pressed),
        22 => spread(23, pressed),
        element => spread(element, pressed),
    };
    let mut every_second = presses(|x| 1000.0 * x, share);
    every_second.retain(|press| press.element.is_some_and(|element| (element / 8 + element % 8) % 2 == 0));
    let response = ResponseCurves::of(&rig(), &every_second).unwrap();
    let found: Vec<_> = response.unresponsive.iter().map(|s| (s.curve.element, s.answers_to)).collect();
    assert_eq!(found, [(18, RespondsTo::Elsewhere), (22, RespondsTo::Elsewhere)]);
    assert_eq!((response.curves.len(), response.untold.len()), (22, 0));
    let slope = response.linear.unwrap().coefficients[1].value;
    assert!((slope - 1000.0).abs() < 0.01, "{slope}");
}

#[test]
fn of_elements_far_apart_nothing_is_said() {
    let share = |element, pressed| if element == 18 { spread(19, pressed) } else { spread(element, pressed) };
    let mut two = presses(|x| 1000.0 * x, share);
    two.retain(|press| [Some(18), Some(46)].contains(&press.element));
    let response = ResponseCurves::of(&rig(), &two).unwrap();
    assert_eq!((response.unresponsive.len(), response.untold), (0, vec![18, 46]));
}

#[test]
fn presses_off_centre_or_at_one_depth_give_no_curves() {
    let mut elsewhere = presses(|x| x, spread);
    for press in &mut elsewhere {
        press.element = None;
    }
    assert_eq!(ResponseCurves::of(&rig(), &elsewhere), None);
    let mut single = presses(|x| x, spread);
    for press in &mut single {
        press.dwells.truncate(1);
    }
    assert_eq!(ResponseCurves::of(&rig(), &single), None);
}
