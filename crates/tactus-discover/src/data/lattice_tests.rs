use tactus_schema::table::{Phase, RowView};

use super::wider_step;
use crate::Frames;

fn readings(counts: impl Iterator<Item = f32>) -> Frames {
    let mut frames = Frames::new(1);
    for (t_ns, counts) in (0..).step_by(33_000_000).zip(counts) {
        frames.push(RowView {
            run: "a",
            press: -1,
            phase: Phase::Idle,
            t_ns,
            position_mm: [0.0; 3],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[counts],
        });
    }
    frames
}

#[test]
fn readings_on_a_wider_lattice_give_its_step() {
    let (step, chance) = wider_step(&readings((0..40_i16).map(|k| 100.0 + 4.0 * f32::from(k))), 1.0).unwrap();
    assert!((step - 4.0).abs() < 1e-6 && chance < 1e-9, "{step} {chance}");
}

#[test]
fn readings_on_the_declared_lattice_give_none() {
    assert!(wider_step(&readings((0..40_i16).map(|k| 100.0 + f32::from(k))), 1.0).is_none());
    // One reading between two steps disproves the lattice.
    let odd = (0..40_i16).map(|k| 100.0 + 4.0 * f32::from(k)).chain([107.0]);
    assert!(wider_step(&readings(odd), 1.0).is_none());
}

#[test]
fn few_readings_give_none() {
    assert!(wider_step(&readings((0..9_i16).map(|k| 4.0 * f32::from(k))), 1.0).is_none());
}
