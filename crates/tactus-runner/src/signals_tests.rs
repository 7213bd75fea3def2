use super::*;

#[test]
fn a_hangup_that_nohup_has_switched_off_is_seen() {
    let status =
        |set: &str| format!("Name:\ttactusd\nSigBlk:\t0000000000000000\nSigIgn:\t{set}\nSigCgt:\t0\n");
    // `nohup grep SigIgn /proc/self/status`, and the same from a program of Rust, which ignores SIGPIPE.
    for (set, is_off) in [("0000000000000001", true), ("0000000000001001", true), ("0000000000001000", false)]
    {
        assert_eq!(is_in(ignored_in(&status(set)), 1), is_off, "{set}");
    }
    assert_eq!(ignored_in("nothing of that kind"), 0);
}
