use crate::effect::bench::{effect, simulator, upon};
use crate::{Effect, Moment, Pipeline};

fn tone(sine: f64, cosine: f64, frequency_hz: f64, phase_per_column_deg: f64) -> Effect {
    effect(
        "periodic-interference",
        [
            ("sine_counts", sine),
            ("cosine_counts", cosine),
            ("frequency_hz", frequency_hz),
            ("phase_per_column_deg", phase_per_column_deg),
        ],
    )
}

/// Readings above the baseline at times, of a sensor that nothing touches.
fn read<const N: usize>(effect: Effect, times_s: [f64; N]) -> [Vec<f64>; N] {
    let one = simulator([effect]);
    let mut pipeline = Pipeline::new(&one).unwrap();
    let tip_mm = upon(&one, 21, -1.0);
    times_s.map(|t_s| pipeline.step(Moment::at(t_s), &tip_mm).iter().map(|count| count - 100.0).collect())
}

#[test]
fn a_tone_rises_and_falls_on_all_elements() {
    let quarters = read(tone(3.0, 2.0, 0.5, 0.0), [0.0, 0.5, 1.0, 1.5, 2.0]);
    for (got, want) in quarters.iter().zip([2.0, 3.0, -2.0, -3.0, 2.0]) {
        assert!(got.iter().all(|got| (got - want).abs() < 1e-12), "{got:?} {want}");
    }
}

#[test]
fn a_tone_runs_over_the_columns() {
    let [got] = read(tone(4.0, 0.0, 1.0, 90.0), [0.0]);
    for (element, got) in got.iter().enumerate() {
        let want = [0.0, 4.0, 0.0, -4.0][element % 8 % 4];
        assert!((got - want).abs() < 1e-12, "element {element}: {got} {want}");
    }
}

#[test]
fn the_mains_show_as_their_alias() {
    // 50 Hz at 30 frames a second are 10 Hz that run backwards.
    let frames = [0.0, 1.0, 2.0, 3.0, 17.0].map(|frame| frame / 30.0);
    let (mains, alias) = (read(tone(3.0, 1.0, 50.0, 0.0), frames), read(tone(-3.0, 1.0, 10.0, 0.0), frames));
    for (mains, alias) in mains.iter().flatten().zip(alias.iter().flatten()) {
        assert!((mains - alias).abs() < 1e-9, "{mains} {alias}");
    }
}
