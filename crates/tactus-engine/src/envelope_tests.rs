use super::*;

fn bounds() -> Bounds {
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let service = rig.service.clone().unwrap();
    Bounds::new(&rig, &service.envelope, &service.motion, rig.covering)
}

fn press(x_mm: f64, depths_mm: &[f64]) -> Step {
    Step::Press(Press {
        at: Position { x_mm, y_mm: 5.0 },
        depths_mm: depths_mm.to_vec(),
        dwell_s: 0.25,
        speed_mm_per_s: None,
        approach_from_mm: None,
    })
}

#[test]
fn the_depth_limit_is_a_share_of_the_covering_in_place() {
    let bounds = bounds();
    assert_eq!(bounds.check(&press(8.0, &[0.2, 0.7112])), Ok(()));
    let refused = bounds.check(&press(8.0, &[0.2, 0.72])).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "0.72 mm is too deep: the limit is 0.711 mm (70 % of the covering's 1.016 mm; envelope.depth_share_max)"
    );
    let thicker = bounds.under(Covering { thickness_mm: 5.08 });
    assert_eq!(thicker.check(&press(8.0, &[3.3])), Ok(()));
    assert!(matches!(thicker.check(&press(8.0, &[3.6])), Err(Outside::Depth { .. })));
}

#[test]
fn places_are_checked_in_the_robot_frame() {
    // The sensor's origin stands at x = 20 in the robot frame; the envelope ends at 50.
    assert_eq!(bounds().check(&press(30.0, &[0.1])), Ok(()));
    let refused = bounds().check(&press(30.1, &[0.1])).unwrap_err();
    assert!(matches!(refused, Outside::Travel { axis: "x", .. }), "{refused}");
}

#[test]
fn what_is_not_a_number_is_inside_no_bounds() {
    for step in [press(f64::NAN, &[0.1]), press(8.0, &[f64::NAN]), press(8.0, &[f64::INFINITY])] {
        assert!(bounds().check(&step).is_err(), "{step:?}");
    }
}

#[test]
fn a_move_stays_above_the_surface_and_within_the_speed() {
    let go = |height_mm, speed_mm_per_s| Step::Move {
        to: Position { x_mm: 1.0, y_mm: 1.0 },
        height_mm,
        speed_mm_per_s,
    };
    assert_eq!(bounds().check(&go(None, None)), Ok(()));
    assert!(matches!(bounds().check(&go(Some(-0.1), None)), Err(Outside::Travel { axis: "z", .. })));
    assert!(matches!(bounds().check(&go(Some(31.0), None)), Err(Outside::Travel { axis: "z", .. })));
    assert!(matches!(bounds().check(&go(None, Some(51.0))), Err(Outside::Speed { .. })));
    assert!(matches!(bounds().check(&go(None, Some(0.0))), Err(Outside::Speed { .. })));
}

#[test]
fn the_place_that_a_press_comes_from_is_checked_too() {
    let Step::Press(mut from_afar) = press(29.0, &[0.1]) else { unreachable!() };
    from_afar.approach_from_mm = Some([2.0, 0.0]);
    assert!(matches!(bounds().check(&Step::Press(from_afar)), Err(Outside::Travel { axis: "x", .. })));
}

#[test]
fn times_and_coverings_that_nobody_means_are_refused() {
    for duration_s in [-1.0, 1e30, f64::NAN, f64::INFINITY] {
        assert!(
            matches!(bounds().check(&Step::Wait { duration_s }), Err(Outside::Duration { .. })),
            "{duration_s}"
        );
        let Step::Press(mut press) = press(8.0, &[0.1]) else { unreachable!() };
        press.dwell_s = duration_s;
        assert!(bounds().check(&Step::Press(press)).is_err(), "{duration_s}");
    }
    for thickness_mm in [0.0, -1.0, 1000.0, f64::NAN] {
        let covering = Step::Covering { thickness_mm };
        assert!(matches!(bounds().check(&covering), Err(Outside::Covering { .. })), "{thickness_mm}");
    }
}
