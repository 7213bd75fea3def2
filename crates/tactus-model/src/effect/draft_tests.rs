use super::{Carrier, Draft, Law, When};
use crate::effect::PipelineStage;
use crate::effect::bench::{effect, free, linear, simulator, still, upon};
use crate::{Covariate, Effect, Moment, Pipeline};

/// A draft of one covariate, in contact.
fn draft(carrier: Carrier, covariate: Covariate, law: Law) -> Draft {
    Draft {
        name: "draft-1".into(),
        sentence: "something nobody has named".into(),
        carrier,
        when: When::InContact,
        covariates: vec![covariate],
        ranges: vec![[-100.0, 100.0]],
        law,
        weights: None,
    }
}

fn strong(draft: Draft, strength: f64) -> Effect {
    Effect::of(draft.define().unwrap(), [("strength", strength)]).unwrap()
}

/// Counts at a series of depths over an element, a second apart.
fn counts(effects: Vec<Effect>, element: usize, depths_mm: &[f64]) -> Vec<Vec<f64>> {
    let one = linear(effects);
    let mut pipeline = Pipeline::new(&one).unwrap();
    let moments = depths_mm.iter().enumerate();
    moments
        .map(|(second, depth)| {
            pipeline.step(Moment::at(second as f64), &upon(&one, element, *depth)).to_vec()
        })
        .collect()
}

fn assert_near(got: &[f64], want: &[f64], within: f64) {
    assert_eq!(got.len(), want.len());
    for (place, (got, want)) in got.iter().zip(want).enumerate() {
        assert!((got - want).abs() <= within, "{place}: {got} {want}");
    }
}

#[test]
fn without_strength_it_changes_nothing_to_the_bit() {
    for carrier in Carrier::ALL {
        let law = Law::Linear { offset: 0.3, slope: 0.1 };
        let one = simulator([strong(draft(carrier, Covariate::Time, law), 0.0)]);
        let none = simulator([]);
        assert_eq!(still(&one, upon(&one, 21, 0.4)), still(&none, upon(&none, 21, 0.4)), "{carrier:?}");
    }
}

#[test]
fn a_deeper_tip_is_that_of_the_offset_of_the_surface() {
    let law = Law::Linear { offset: 0.05, slope: 0.0 };
    let drafted = strong(draft(Carrier::Depth, Covariate::Time, law), 1.0);
    let named = effect("surface-offset", [("offset_mm", 0.05)]);
    let [drafted, named] = [drafted, named].map(|one| counts(vec![one], 21, &[0.2, 0.5]));
    assert_near(&drafted[1], &named[1], 1e-9);
}

#[test]
fn a_share_of_the_own_signal_by_the_own_signal_is_saturation_through_knots() {
    let law = Law::Table { at: vec![vec![0.0, 0.2, 0.4]], values: vec![0.0, -0.1, -0.3] };
    let drafted = draft(Carrier::OwnSignal, Covariate::Signal, law);
    assert_eq!(drafted.stage(), PipelineStage::Element);
    let named = free("saturation", [], &[0.2, 0.4], &[0.1, 0.3]);
    let [drafted, named] = [strong(drafted, 1.0), named].map(|one| counts(vec![one], 21, &[0.3, 0.6]));
    assert_near(&drafted[0], &named[0], 1e-9);
    assert_near(&drafted[1], &named[1], 1e-9);
}

#[test]
fn counts_rise_by_their_weights_while_the_tool_touches() {
    let weights: Vec<f64> = (0..48_u8).map(|element| f64::from(element) / 47.0).collect();
    let law = Law::Linear { offset: 8.0, slope: 0.0 };
    let grounded = Draft { weights: Some(weights.clone()), ..draft(Carrier::Counts, Covariate::Depth, law) };
    let got = counts(vec![strong(grounded, 0.5)], 21, &[-0.1, 0.3]);
    let base = counts(Vec::new(), 21, &[-0.1, 0.3]);
    assert_eq!(got[0], base[0], "out of contact nothing happens");
    let rises: Vec<f64> = base[1].iter().zip(&weights).map(|(base, weight)| base + 4.0 * weight).collect();
    assert_near(&got[1], &rises, 1e-9);
}

#[test]
fn what_stays_at_the_last_place_fades_with_the_time_since_release() {
    let law = Law::Exponential { scale: 0.1, length: 2.0 };
    let dent = Draft { when: When::OutOfContact, ..draft(Carrier::PressThere, Covariate::SinceRelease, law) };
    let got = counts(vec![strong(dent, 1.0)], 21, &[0.4, -0.2, -0.2, -0.2]);
    // 1,000 counts per mm of a press at the centre; 0.1 mm of it at once, and e^-1/2 of that a second later.
    assert!((got[1][21] - 100.0).abs() < 1e-6, "{}", got[1][21]);
    assert!((got[3][21] - 100.0 * (-1.0_f64).exp()).abs() < 1e-6, "{}", got[3][21]);
}

/// A tone has the phase of its run: so much of it, and so much of what it is a quarter of a period ahead, make any other.
#[test]
fn a_tone_goes_on_beyond_its_range_with_any_phase() {
    let law = Law::Periodic { offset: 0.0, sine: 3.0, cosine: 4.0, per_unit: 0.3 };
    let tone = Draft { ranges: vec![[0.0, 2.0]], ..draft(Carrier::Counts, Covariate::Time, law) };
    let definition = tone.define().unwrap();
    let depths_mm = [0.3; 12];
    let base = counts(Vec::new(), 21, &depths_mm);
    for [strength, quadrature] in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
        let values = [("strength", strength), ("quadrature", quadrature)];
        let got = counts(vec![Effect::of(definition, values).unwrap()], 21, &depths_mm);
        for (second, (got, base)) in got.iter().zip(&base).enumerate() {
            let tone = |ahead: f64| {
                let turn = std::f64::consts::TAU * (0.3 * second as f64 + ahead);
                3.0 * turn.sin() + 4.0 * turn.cos()
            };
            let want = strength * tone(0.0) + quadrature * tone(0.25);
            assert!((got[21] - base[21] - want).abs() < 1e-9, "{second}: {} {want}", got[21] - base[21]);
        }
    }
}

#[test]
fn a_tone_by_place_has_its_phase() {
    let law = Law::Periodic { offset: 0.0, sine: 0.1, cosine: 0.2, per_unit: 3.0 };
    let [by_time, by_place] = [Covariate::Time, Covariate::PlaceX]
        .map(|of| draft(Carrier::Depth, of, law.clone()).define().unwrap());
    assert_eq!((by_time.parameters.len(), by_place.parameters.len()), (2, 1));
}

#[test]
fn a_table_of_two_covariates_is_straight_between_its_places() {
    let law = Law::Table { at: vec![vec![0.0, 1.0], vec![0.0, 2.0]], values: vec![0.0, 2.0, 4.0, 6.0] };
    assert!((law.value(&[0.5, 1.0]) - 3.0).abs() < 1e-12);
    assert!((law.value(&[9.0, -1.0]) - 4.0).abs() < 1e-12, "constant beyond the ends");
}

#[test]
fn laws_are_read_from_their_own_numbers() {
    for law in [
        Law::Linear { offset: 0.1, slope: 0.2 },
        Law::Power { scale: 0.1, exponent: 1.5 },
        Law::Exponential { scale: 0.1, length: 0.2 },
        Law::Saturating { scale: 0.1, length: 0.2 },
        Law::Threshold { scale: 0.1, at: 0.2 },
        Law::Periodic { offset: 0.0, sine: 0.1, cosine: 0.2, per_unit: 3.0 },
        Law::Logarithm { scale: 0.1, length: 0.2 },
    ] {
        let numbers = law.numbers();
        assert_eq!(Law::of_numbers(law.name(), &numbers).as_ref(), Some(&law));
        assert_eq!(Law::of_numbers(law.name(), &numbers[1..]), None, "a number is missing");
    }
    assert!(
        (Law::Saturating { scale: 2.0, length: 1.0 }.value(&[1.0]) - 2.0 * (1.0 - (-1.0_f64).exp())).abs()
            < 1e-12
    );
}

#[test]
fn the_same_draft_is_one_definition() {
    let law = Law::Linear { offset: 0.3, slope: 0.25 };
    let [one, other] =
        [(); 2].map(|()| draft(Carrier::Counts, Covariate::Time, law.clone()).define().unwrap());
    assert!(std::ptr::eq(one, other));
    let another = draft(Carrier::Counts, Covariate::Depth, law).define().unwrap();
    assert!(!std::ptr::eq(one, another));
    assert_ne!(Effect::neutral(one), Effect::neutral(another), "the name is the same, the effect is not");
}

#[test]
fn what_is_no_effect_is_refused_with_the_reason() {
    let law = || Law::Linear { offset: 0.3, slope: 0.1 };
    let fine = || draft(Carrier::OwnSignal, Covariate::Depth, law());
    let table = |at: Vec<Vec<f64>>, values: Vec<f64>| Law::Table { at, values };
    let cases = [
        (Draft { name: "Draft 1".into(), ..fine() }, "small letters"),
        (Draft { name: "hardening".into(), ..fine() }, "of the library"),
        (Draft { covariates: vec![], ..fine() }, "one covariate or two"),
        (Draft { ranges: vec![[1.0, 0.0]], ..fine() }, "least value first"),
        (
            Draft { carrier: Carrier::Depth, covariates: vec![Covariate::Signal], ..fine() },
            "motion of the tip",
        ),
        (Draft { covariates: vec![Covariate::Counts], ..fine() }, "only what is added to counts"),
        (Draft { law: Law::Exponential { scale: 1.0, length: 0.0 }, ..fine() }, "length must be above 0"),
        (Draft { law: Law::Linear { offset: f64::NAN, slope: 0.0 }, ..fine() }, "offset must be finite"),
        (Draft { law: table(vec![vec![0.0, 1.0]], vec![1.0]), ..fine() }, "one for each"),
        (Draft { law: table(vec![vec![1.0, 0.0]], vec![1.0, 2.0]), ..fine() }, "in order"),
        (Draft { weights: Some(vec![f64::INFINITY; 48]), ..fine() }, "weights must be finite"),
    ];
    for (draft, want) in cases {
        let told = draft.define().unwrap_err().to_string();
        assert!(told.contains(want), "{told}");
    }
    let few = Draft { weights: Some(vec![1.0; 9]), ..fine() }.define().unwrap();
    let refused = Pipeline::new(&simulator([Effect::neutral(few)])).unwrap_err().to_string();
    assert!(refused.contains("weights for 9 elements"), "{refused}");
}
