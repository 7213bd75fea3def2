use super::{Flag, Severity};

#[test]
fn what_each_flag_asks_for() {
    for (text, severity) in [
        ("--", Severity::None),
        ("FF", Severity::Fault),
        ("FS", Severity::Fault),
        ("FQ", Severity::Fault),
        ("FD", Severity::Fault),
        ("F9", Severity::Fault),
        ("WL", Severity::Fault),
        ("WS", Severity::Fault),
        ("WR", Severity::Suspect),
        ("WH", Severity::Suspect),
        ("WM", Severity::Suspect),
        ("WT", Severity::Caution),
        ("WX", Severity::Caution),
        ("NC", Severity::Notice),
        ("NI", Severity::Notice),
        ("XX", Severity::Notice),
    ] {
        let flag = Flag::parse(text).unwrap();
        assert_eq!(flag.severity(), severity, "{text}");
        assert_eq!(flag.to_string(), text);
        assert_eq!(Flag::from_code(flag.code()), Some(flag));
    }
    assert_eq!(Flag::STALLED.code(), 0x4653);
}

#[test]
fn what_is_no_flag() {
    for text in ["", "F", "FSS", "fs", "-F", "é"] {
        assert_eq!(Flag::parse(text), None, "{text}");
    }
    assert_eq!(Flag::from_code(0xFFFF), None);
}

#[test]
fn each_has_words() {
    assert!(Flag::NO_REFERENCE.meaning().contains("home it"));
    assert_eq!(Flag::parse("F9").unwrap().meaning(), "a fault that is not in Zaber's list");
}

#[test]
fn a_lost_reference_hides_behind_graver_flags_only() {
    for (text, hides) in
        [("FS", true), ("WV", true), ("WM", true), ("WR", false), ("WH", false), ("NI", false)]
    {
        assert_eq!(Flag::parse(text).unwrap().hides_reference(), hides, "{text}");
    }
}
