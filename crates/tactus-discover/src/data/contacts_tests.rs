use std::f64::consts::PI;

use tactus_schema::table::{Phase, RowView};

use super::Contacts;
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
