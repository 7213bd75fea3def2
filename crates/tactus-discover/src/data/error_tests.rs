use super::*;

#[test]
fn an_unknown_indenter_is_said_beside_the_known_ones() {
    let of = |known: &[&str]| {
        let known = known.iter().map(|id| (*id).to_owned()).collect();
        DiscoverError::from(Mismatch::UnknownIndenter { id: "cone".into(), known }).to_string()
    };
    assert_eq!(
        of(&["sphere-6", "flat-4"]),
        "the rig describes no indenter \"cone\"; it describes sphere-6, flat-4"
    );
    assert_eq!(of(&[]), "the rig describes no indenter \"cone\"; it describes none");
}

#[test]
fn only_what_more_data_would_mend_is_too_little() {
    let few = DiscoverError::from(TooLittle::FewPresses { fitted: 2, least: 3 });
    assert!(matches!(few, DiscoverError::TooLittle(_)));
    assert_eq!(
        few.to_string(),
        "2 presses can be fitted; at least 3 are needed, and half as many to hold out"
    );
    let path = DiscoverError::from(Mismatch::Path(TrajectoryError::Empty));
    assert!(matches!(path, DiscoverError::Model(_)));
    assert_eq!(path.to_string(), "the stage's path: a trajectory needs at least one point");
}
