use super::{Contest, Reported, Rivalry, contests_table};

fn rivalry(rival: &str, instead: f64, beside: f64) -> Rivalry {
    Rivalry { rival: rival.into(), instead_ln_odds: Some(instead), beside_ln_odds: Some(beside) }
}

#[test]
fn only_rivals_that_act_like_a_class_count_beside_it() {
    let rivals = vec![rivalry("place", 80.0, 12.0), rivalry("tone in x", 20.0, 70.0)];
    let effect = "backlash".into();
    let reported =
        Reported { effect, ln_odds: 100.0, rivals, classes: Vec::new(), left_ln_odds: 0.0, kept: true };
    let label = tactus_sets::Recipe::new(3).make().unwrap().label;
    let contest = Contest::of("outside/any", &label, &reported);
    assert_eq!(contest.instead, Some(("place".into(), 0.8)));
    assert_eq!(contest.beside, Some(("place".into(), 0.12)));
    let text = contests_table(&[Contest { is_right: false, ..contest }]);
    assert!(text.contains("right: 0 contests") && text.contains("wrong: 1 contests"), "{text}");
    assert!(text.contains("beside 0.12 place"), "{text}");
}
