use super::Rejection;

#[test]
fn each_word_is_read_and_has_a_meaning() {
    for word in [
        "AGAIN",
        "BADAXIS",
        "BADCOMMAND",
        "BADDATA",
        "BADMESSAGEID",
        "DEVICEONLY",
        "DRIVERDISABLED",
        "FULL",
        "INACTIVE",
        "LOCKSTEP",
        "NOACCESS",
        "NOTSUPPORTED",
        "PARKED",
        "REMOTE",
        "STATUSBUSY",
    ] {
        let rejection = Rejection::parse(word);
        assert!(!matches!(rejection, Rejection::Other(_)), "{word}");
        assert_eq!(rejection.word(), word);
    }
    let other = Rejection::parse("NEWS");
    assert_eq!(other.to_string(), "NEWS: a reason that is not in Zaber's list");
}
