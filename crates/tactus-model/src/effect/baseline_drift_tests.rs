use super::DEFINITION;
use crate::effect::bench::{simulator, still, upon};
use crate::{Effect, Moment, Pipeline};

/// A zero that is at 20 counts after 300 s, at -10 after 1200 s and from 1500 s on, and at 0 at the knots between.
fn drift() -> Effect {
    let of = |effect: Effect, (name, value): (&str, f64)| effect.with(name, value).unwrap();
    let offsets = [("offset_03_counts", 20.0), ("offset_12_counts", -10.0), ("offset_16_counts", -10.0)];
    [("duration_s", 1600.0)].into_iter().chain(offsets).fold(Effect::neutral(&DEFINITION), of)
}

#[test]
fn the_zero_wanders_alike_on_all_elements() {
    let one = simulator([drift()]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    for (t_s, want) in [(0.0, 0.0), (225.0, 5.0), (300.0, 20.0), (350.0, 10.0), (1250.0, -5.0), (1e5, -10.0)]
    {
        for (got, plain) in pipeline.step(Moment::at(t_s), &tip_mm).iter().zip(&plain) {
            assert!((got - plain - want).abs() < 1e-9, "after {t_s} s: {}", got - plain);
        }
    }
}

#[test]
fn one_element_wanders_for_itself_and_from_a_start() {
    let late = drift().with("element", 20.0).unwrap().with("start_s", 1000.0).unwrap();
    let one = simulator([late]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    for (t_s, want) in [(0.0, 0.0), (900.0, 0.0), (1225.0, 5.0), (1300.0, 20.0), (1e5, -10.0)] {
        for (element, (got, plain)) in pipeline.step(Moment::at(t_s), &tip_mm).iter().zip(&plain).enumerate()
        {
            let want = if element == 20 { want } else { 0.0 };
            assert!((got - plain - want).abs() < 1e-9, "{element} after {t_s} s: {}", got - plain);
        }
    }
}

#[test]
fn without_an_element_it_is_that_of_all() {
    let given = drift();
    let named = |(name, _): &(&str, f64)| !["element", "start_s"].contains(name);
    assert_eq!(Effect::new("baseline-drift", given.parameters().filter(named)).unwrap(), given);
    assert!(!given.names_elements());
    let one = given.with("element", 48.0).unwrap();
    assert!(one.names_elements() && one.fits(simulator([]).model.array()).is_err());
}
