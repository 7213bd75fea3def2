use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::{Phase, RowView};

use super::{Contacts, far};
use crate::Frames;

/// Strokes at one place, between which the tip rests a hundredth of a millimetre below the surface.
fn strokes(depth_mm: impl Fn(f64) -> f64) -> Frames {
    let mut frames = Frames::new(1);
    for (frame, t_ns) in (0..400).zip((0..).step_by(100_000_000)) {
        let (press, within) = (frame / 100, frame % 100);
        let share = f64::from(within) / 90.0;
        let (press, phase, depth_mm) = match within {
            0..45 => (press, Phase::Load, depth_mm(share)),
            45..90 => (press, Phase::Unload, depth_mm(1.0 - share)),
            _ => (-1, Phase::Idle, 0.01),
        };
        frames.push(RowView {
            run: "a",
            press,
            phase,
            t_ns,
            position_mm: [0.0, 0.0, -depth_mm.max(0.01)],
            covering_mm: 20.0,
            indenter: "probe",
            temperature_c: None,
            counts: &[0.0],
        });
    }
    frames
}

#[test]
fn presses_between_which_the_tip_stays_below_the_surface_are_contacts_of_their_own() {
    let frames = strokes(|share| 12.0 * (PI * share).sin());
    let contacts = Contacts::of(&frames);
    assert_eq!((contacts.count(), contacts.distinct_places()), (4, 1));
    assert!(contacts.repeats());
}

#[test]
fn a_half_sine_shows_several_speeds_and_a_straight_stroke_one() {
    let (sine, straight) = (strokes(|share| 12.0 * (PI * share).sin()), strokes(|share| 24.0 * share));
    assert_eq!(Contacts::of(&sine).distinct_speeds(), 2);
    assert_eq!(Contacts::of(&straight).distinct_speeds(), 1);
}

/// Presses of one frame each at these places, from a millimetre beside it.
fn touches(places_mm: &[([f64; 2], [f64; 2])]) -> Frames {
    let mut frames = Frames::new(1);
    for (press, ([x, y], [from_x, from_y])) in (0..).zip(places_mm) {
        let way = [([x + from_x, y + from_y, 1.0], -1, Phase::Idle), ([*x, *y, -0.3], press, Phase::Hold)];
        for (position_mm, press, phase) in way {
            frames.push(RowView {
                run: "a",
                press,
                phase,
                t_ns: i64::try_from(frames.len()).unwrap() * 33_333_333,
                position_mm,
                covering_mm: 20.0,
                indenter: "probe",
                temperature_c: None,
                counts: &[0.0],
            });
        }
    }
    frames
}

#[test]
fn one_of_many_places_is_found_that_is_reached_from_two_sides() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (presses, width_mm) in [(40, 0.05), (40, 0.3), (200, 1.0), (200, 5.0)] {
        let mut place = || [0, 1].map(|_| rng.random_range(-0.5 * width_mm..0.5 * width_mm));
        let places: Vec<[f64; 2]> = (0..presses).map(|_| place()).collect();
        // One of them from the other side.
        let froms = |press: usize| if press == 7 { [1.0, 1.0] } else { [-1.0, -1.0] };
        let from: Vec<([f64; 2], [f64; 2])> =
            places.iter().enumerate().map(|(press, place)| (*place, froms(press))).collect();
        let want = places.iter().enumerate().any(|(press, place)| press != 7 && !far(*place, places[7]));
        assert_eq!(Contacts::of(&touches(&from)).approaches(), want, "{presses} {width_mm}");
    }
}

/// None is compared with all others.
#[test]
fn many_contacts_take_no_time() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut place = || ([0, 1].map(|_| rng.random_range(0.0..100.0)), [-1.0, -1.0]);
    let places: Vec<([f64; 2], [f64; 2])> = (0..20_000).map(|_| place()).collect();
    let frames = touches(&places);
    let contacts = Contacts::of(&frames);
    assert_eq!(contacts.count(), 20_000);
    assert!(!contacts.approaches() && contacts.distinct_places() > 19_000);
}
