use super::*;

#[test]
fn the_shipped_rig_is_seen_as_the_papers_sensor() {
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let view = RigView::of(&rig);
    assert_eq!((view.rows, view.cols, view.elements.len()), (6, 8, 48));
    assert_eq!(view.elements[10], ElementView { index: 10, row: 1, col: 2, x_mm: 5.1, y_mm: 2.9 });
    assert!((view.pitch_mm[0] - 2.0).abs() < 1e-12 && (view.pitch_mm[1] - 2.0).abs() < 1e-12);
    assert!((view.depth_max_mm.unwrap() - 0.7112).abs() < 1e-12);
    assert!((view.sigma_mm - 2.725).abs() < 0.001);
}

#[test]
fn a_description_without_limits_shows_none() {
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let view = RigView::of(&Rig { service: None, ..rig });
    assert_eq!((view.depth_max_mm, view.safe_height_mm), (None, None));
}
