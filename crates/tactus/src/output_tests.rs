use super::duration;

#[test]
fn durations_are_in_words_without_sixty_seconds() {
    for (seconds, words) in [
        (0.04, "0.0 s"),
        (12.34, "12.3 s"),
        (59.9, "59.9 s"),
        (60.0, "1 min 00 s"),
        (119.6, "2 min 00 s"),
        (245.0, "4 min 05 s"),
        (3599.7, "1 h 00 min"),
        (7260.0, "2 h 01 min"),
    ] {
        assert_eq!(duration(seconds), words);
    }
}
