use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;

use crate::Verdict;
use crate::fixtures::{ELEMENTS, found, known, measured, measured_at, processes};

/// The paper's two faulty elements, which answer for a neighbour each, beside effects that hide them.
#[test]
fn both_of_the_papers_faulty_elements_are_found_beside_other_effects() {
    let known = known();
    let effect =
        |name: &str, parameters: &[(&str, f64)]| Effect::new(name, parameters.iter().copied()).unwrap();
    let answers = |element: f64, answers_for: f64| {
        let shares = [("own_share", 0.0), ("other_share", 1.0)];
        effect("miswired", &[&[("element", element), ("answers_for", answers_for)], &shares[..]].concat())
    };
    let hidden = [
        answers(18.0, 19.0),
        answers(22.0, 23.0),
        effect(
            "misregistration",
            &[("offset_x_mm", 0.06), ("offset_y_mm", -0.04), ("rotation_deg", 0.2), ("scale_error", 0.0)],
        ),
        effect("hardening", &[("growth_at_1_mm", 0.15), ("exponent", 1.0), ("own_share", 1.0)]),
    ];
    let noise = processes(ELEMENTS, 2.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(1));
    let found = found(&known, &measured(&known, &hidden, &noise));
    let mut names: Vec<&str> = found.steps.iter().map(|step| step.effect).collect();
    names.sort_unstable();
    assert_eq!(names, ["hardening", "misregistration", "miswired"]);
    assert_eq!(found.verdict, Verdict::Explained);
    let wires = found.steps.iter().find(|step| step.effect == "miswired").unwrap();
    let mut elements: Vec<f64> = wires.terms.iter().map(|term| term[0].value).collect();
    elements.sort_by(f64::total_cmp);
    assert_eq!(elements, [18.0, 22.0]);
}

/// A tool of another size changes all signals alike; a dead element is no share of that.
#[test]
fn dead_elements_are_named_and_not_taken_for_a_tool_of_another_size() {
    let known = known();
    let dead = |element: f64| {
        let parameters =
            [("element", element), ("answers_for", element), ("own_share", 0.0), ("other_share", 0.0)];
        Effect::new("miswired", parameters).unwrap()
    };
    let noise = processes(ELEMENTS, 2.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(2));
    let found = found(&known, &measured(&known, &[dead(5.0), dead(39.0)], &noise));
    let names: Vec<&str> = found.steps.iter().map(|step| step.effect).collect();
    assert_eq!((names, found.verdict), (vec!["miswired"], Verdict::Explained));
    let mut elements: Vec<f64> = found.steps[0].terms.iter().map(|term| term[0].value).collect();
    elements.sort_by(f64::total_cmp);
    assert_eq!(elements, [5.0, 39.0]);
}

/// Pressed at three places only, elements far from each other have signals of one shape.
#[test]
fn where_presses_do_not_tell_whose_signal_an_element_gives_no_other_is_named() {
    let known = known();
    let parameters = [("element", 18.0), ("answers_for", 19.0), ("own_share", 0.0), ("other_share", 1.0)];
    let answers = [Effect::new("miswired", parameters).unwrap()];
    let noise = processes(ELEMENTS, 2.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(3));
    let partner = |frames| {
        let found = found(&known, &frames);
        let wires = found.steps.into_iter().find(|step| step.effect == "miswired").unwrap();
        let [term] = &wires.terms[..] else { panic!("{:?}", wires.terms) };
        assert_eq!((term[0].name, term[0].value.to_bits()), ("element", 18.0_f64.to_bits()));
        term.iter().find(|one| one.name == "answers_for").map(|one| one.value)
    };
    assert_eq!(partner(measured(&known, &answers, &noise)), Some(19.0));
    let three_places = |press: usize| [0, 5, 47][press % 3];
    assert_eq!(partner(measured_at(three_places, &known, &answers, &noise)), None);
}
