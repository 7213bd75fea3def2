use super::*;

#[test]
fn the_answer_must_name_the_feed_and_every_mode() {
    let feed = Feed::of(1.0);
    assert_eq!(feed.line(), "G91G21G94G1F60");
    assert_eq!(feed.is_told("GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F60 S0"), Some(true));
    for wrong in [
        "GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F600 S0",
        "GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F6 S0",
        "GC:G0 G54 G17 G21 G91 G94 M5 M9 T0 F60 S0",
        "GC:G1 G54 G17 G20 G91 G94 M5 M9 T0 F60 S0",
        "GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F60 S0",
        "GC:G1 G54 G17 G21 G91 G93 M5 M9 T0 F60 S0",
        "GC:G1 G54 G17 G21 G91 G94",
    ] {
        assert_eq!(feed.is_told(wrong), Some(false), "{wrong}");
    }
    assert_eq!(feed.is_told("VER:1.1h.20190830:"), None);
}

#[test]
fn a_feed_is_printed_as_a_whole_number() {
    assert_eq!(Feed::of(0.01).line(), "G91G21G94G1F.6");
    assert_eq!(Feed::of(0.01).is_told("GC:G1 G21 G91 G94 F1"), Some(true));
    assert_eq!(Feed::of(0.555_555).is_told("GC:G1 G21 G91 G94 F33"), Some(true));
}
