use tactus_model::Array;
use tactus_schema::table::Phase;

use super::*;

fn row(press: i32, phase: Phase, z_mm: f64, counts: &[f32]) -> RowView<'_> {
    RowView {
        run: "a",
        press,
        phase,
        t_ns: 0,
        position_mm: [1.0, 2.0, z_mm],
        covering_mm: 1.016,
        indenter: "cyl1",
        temperature_c: None,
        counts,
    }
}

fn array() -> Array {
    Array::new("two", [1.0, 1.0], vec![0.0, 2.0], vec![0.0], 30.0, 4095.0, 1.0).unwrap()
}

/// At rest reading 100 and 50, then two depths held.
fn one_press(builder: &mut ReadingsBuilder) {
    for frame in 0..10 {
        let odd = if frame % 2 == 0 { 1.0 } else { -1.0 };
        builder.take(row(-1, Phase::Idle, 2.0, &[100.0 + odd, 50.0]));
    }
    builder.take(row(0, Phase::Approach, 0.1, &[999.0, 999.0]));
    for (z_mm, count) in [(-0.2, 300.0), (-0.4, 500.0), (-0.6, 700.0)] {
        builder.take(row(0, Phase::Load, z_mm + 0.05, &[9.0, 9.0]));
        for _ in 0..8 {
            builder.take(row(0, Phase::Hold, z_mm, &[count, 60.0]));
        }
    }
}

#[test]
fn a_press_has_its_dwells_and_the_rest_before_it() {
    let mut builder = ReadingsBuilder::new(&array());
    one_press(&mut builder);
    let readings = builder.finish();
    let [press] = readings.presses.as_slice() else { panic!("{readings:?}") };
    assert_eq!(press.rest, Some(Rest { counts: vec![100.0, 50.0], frames: 10 }));
    let dwells: Vec<(f64, f64, usize)> =
        press.dwells.iter().map(|dwell| (dwell.height_mm, dwell.counts[0], dwell.frames)).collect();
    // The tip may move during the first and the last frame of a hold.
    assert_eq!(dwells, [(-0.2, 300.0, 6), (-0.4, 500.0, 6), (-0.6, 700.0, 6)]);
    assert_eq!(press.rise(&press.dwells[1], 0), Some([400.0, 1.0 / 6.0 + 1.0 / 10.0]));
}

#[test]
fn noise_is_that_at_rest_and_no_less_than_the_converters() {
    let mut builder = ReadingsBuilder::new(&array());
    one_press(&mut builder);
    let readings = builder.finish();
    let noise: Vec<f64> = readings.noise_rms_counts.iter().map(|noise| noise.unwrap()).collect();
    assert!((noise[0] - (10.0_f64 / 9.0).sqrt()).abs() < 1e-12);
    assert!((noise[1] - 12.0_f64.sqrt().recip()).abs() < 1e-12);
}

#[test]
fn a_frame_that_no_noise_explains_is_left_out() {
    let mut builder = ReadingsBuilder::new(&array());
    for frame in 0..10 {
        let counts = if frame == 4 { [4000.0, 50.0] } else { [100.0, 50.0] };
        builder.take(row(-1, Phase::Idle, 2.0, &counts));
    }
    for frame in 0..9 {
        let counts = if frame == 5 { [0.0, 4095.0] } else { [400.0, 60.0] };
        builder.take(row(0, Phase::Hold, -0.3, &counts));
    }
    let readings = builder.finish();
    assert_eq!(readings.frames_left_out, 2);
    assert_eq!(readings.presses[0].dwells[0].counts, [400.0, 60.0]);
    assert_eq!(readings.presses[0].rest.as_ref().unwrap().counts, [100.0, 50.0]);
}

#[test]
fn frames_taken_on_the_way_count_where_nothing_else_is_there() {
    let mut builder = ReadingsBuilder::new(&array());
    for _ in 0..10 {
        builder.take(row(-1, Phase::Idle, 0.0, &[100.0, 50.0]));
    }
    for step in 1..=20 {
        let depth = f64::from(step) * 0.1;
        builder.take(row(0, Phase::Load, -depth, &[100.0 + 10.0 * step as f32, 50.0]));
    }
    for _ in 0..4 {
        builder.take(row(0, Phase::Hold, -2.0, &[300.0, 50.0]));
    }
    let readings = builder.finish();
    assert_eq!(readings.presses[0].dwells.len(), 21);
    assert!((readings.presses[0].deepest().unwrap().height_mm + 2.0).abs() < 1e-12);
}

#[test]
fn nothing_gathered_is_nothing_read() {
    let readings = ReadingsBuilder::new(&array()).finish();
    assert!(readings.presses.is_empty());
    assert_eq!(readings.noise_rms_counts, [None, None]);
}

#[test]
fn a_press_before_any_rest_has_none() {
    let mut builder = ReadingsBuilder::new(&array());
    for _ in 0..6 {
        builder.take(row(0, Phase::Hold, -0.3, &[400.0, 60.0]));
    }
    let readings = builder.finish();
    assert_eq!(readings.presses[0].rest, None);
    assert_eq!(readings.presses[0].rise(&readings.presses[0].dwells[0], 0), None);
}
