use super::{LEVELS, Scale, colour};

#[test]
fn the_ends_are_the_maps_ends() {
    assert_eq!(colour(0), "#440154");
    assert_eq!(colour(LEVELS - 1), "#fde725");
}

#[test]
fn colours_grow_brighter() {
    let luminance = |level: u8| {
        let hex = colour(level);
        let part = |at: usize| f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap());
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    };
    assert!((1..LEVELS).all(|level| luminance(level) > luminance(level - 1)));
}

#[test]
fn values_have_levels() {
    let scale = Scale::new(0.0, 48.0);
    assert_eq!(scale.level(-5.0), Some(0));
    assert_eq!(scale.level(10.5), Some(10));
    assert_eq!(scale.level(1e9), Some(LEVELS - 1));
    assert_eq!(scale.level(f64::NAN), None);
}

#[test]
fn a_scale_begins_at_zero_unless_values_lie_clearly_below() {
    assert_eq!(Scale::of([-3.0, 600.0].into_iter()), Scale::new(0.0, 600.0));
    assert_eq!(Scale::of([-300.0, 600.0].into_iter()), Scale::new(-300.0, 600.0));
    assert_eq!(Scale::of([-300.0, -100.0].into_iter()), Scale::new(-300.0, 0.0));
    assert_eq!(Scale::of([f64::NAN].into_iter()), Scale::new(0.0, 1.0));
}
