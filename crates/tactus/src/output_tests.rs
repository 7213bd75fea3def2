use super::{duration, table};

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

#[test]
fn a_table_is_aligned_and_ends_at_the_edge() {
    let rows = [vec!["left".to_owned(), "idle".to_owned()], vec!["b".to_owned(), "a long story".to_owned()]];
    let lines = table(&["RIG", "WHAT"], &rows, None);
    assert_eq!(lines, "RIG   WHAT\nleft  idle\nb     a long story");
    let narrow = table(&["RIG", "WHAT"], &rows, Some(16));
    assert_eq!(narrow, "RIG   WHAT\nleft  idle\nb     a long\n      story");
    // No room for the longest words side by side.
    let paragraphs = table(&["RIG", "WHAT"], &rows, Some(10));
    assert_eq!(paragraphs, "RIG   left\nWHAT  idle\n\nRIG   b\nWHAT  a long story");
}
