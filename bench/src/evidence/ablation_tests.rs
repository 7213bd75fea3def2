use super::super::outcome::tests::set;
use super::*;

#[test]
fn a_black_box_closes_the_gap_and_names_nothing() {
    let boxed = Outcome { deeper_shrink: Some(-0.4), ..set(&[Some("backlash")], &[], "unexplained") };
    let calm = Outcome { campaign: Campaign::FalseAlarms, ..set(&[], &[], "nothing-missing") };
    let ablation = Ablation::new("black-box".into(), &[boxed, calm]);
    assert_eq!((ablation.exact.hits, ablation.exact.of), (0, 1));
    assert_eq!((ablation.false_alarms.hits, ablation.false_alarms.of), (0, 1));
    assert_eq!((ablation.shrink.median, ablation.deeper_shrink.median), (Some(0.9), Some(-0.4)));
}
