use super::*;

#[test]
fn zeros_that_say_nothing_are_left_out() {
    for (value, text) in [
        (-0.1, "-.1"),
        (12.0, "12"),
        (0.005, ".005"),
        (-1.25, "-1.25"),
        (100.0, "100"),
        (0.0, "0"),
        (33.3333, "33.333"),
    ] {
        assert_eq!(short(value), text);
    }
}
