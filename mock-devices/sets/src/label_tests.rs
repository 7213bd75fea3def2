use crate::{Content, Recipe};

#[test]
fn fits_go_over_to_a_label_of_the_same_set_and_to_no_other() {
    let label = |seed| {
        let content = Content { physics: vec!["late-touch".into()], ..Content::default() };
        Recipe { frames: Some(400), content, ..Recipe::new(seed) }.make().unwrap().label
    };
    let mut earlier = label(3);
    earlier.physics[0].z_of_effects.insert("hardening".into(), 7.0);
    let mut same = label(3);
    same.adopt_fits(&earlier);
    assert_eq!(same, earlier);
    let mut other = label(4);
    other.adopt_fits(&earlier);
    assert_eq!(other, label(4));
}
