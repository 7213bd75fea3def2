use super::super::outcome::tests::set;
use super::*;

const BOUNDS: Bounds = Bounds { least_exact: 1, least_pairs: 0, most_wrong: 0, ..Bounds::SAMPLE };

fn outcomes(outside: Outcome) -> Vec<Outcome> {
    let right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let right = Outcome { alone_shrink: Some(0.9), ..right };
    vec![right, Outcome { campaign: Campaign::Outside, ..outside }]
}

#[test]
fn physics_outside_the_library_must_be_unexplained_and_without_a_name() {
    let unexplained = outcomes(set(&[None], &[], "unexplained"));
    let counts = Counts::of(&unexplained);
    assert_eq!((counts.exact, counts.unexplained, counts.wrong), (1, 1, 0));
    assert_eq!(counts.shrink, Some([1.0, 1.0]));
    BOUNDS.check(&counts).unwrap();
    for wrong in [
        set(&[None], &[("imprint", &[])], "explained"),
        set(&[None], &[("imprint", &[])], "partly-explained"),
        set(&[None], &[], "nothing-missing"),
        set(&[None], &[], "failed"),
    ] {
        let counts = Counts::of(&outcomes(wrong));
        assert_eq!(counts.unexplained, 0);
        assert!(BOUNDS.check(&counts).is_err());
    }
}

#[test]
fn each_bound_can_break() {
    let held = Counts::of(&outcomes(set(&[None], &[], "unexplained")));
    for broken in [
        Counts { false_alarms: 1, ..held },
        Counts { exact: 0, ..held },
        Counts { wrong: 1, ..held },
        Counts { shrink: Some([0.9, 0.9]), ..held },
        Counts { shrink: Some([1.0, 0.6]), ..held },
    ] {
        assert!(BOUNDS.check(&broken).is_err(), "{broken}");
    }
    assert!(Bounds { least_pairs: 1, ..BOUNDS }.check(&held).is_err());
}
