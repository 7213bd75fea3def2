use super::*;

#[test]
fn a_reason_reads_once_whatever_the_rival_is_called() {
    for (because, words) in [
        (
            Because::Rival("place along x"),
            "what explains more has no name in the library: a dependence on place along x",
        ),
        (
            Because::Rival("sum of signals, apart"),
            "what explains more has no name in the library: a dependence on sum of signals, loading and unloading apart",
        ),
        (Because::Rival("tone in travel"), "what explains more has no name in the library: a tone in travel"),
        (Because::Rival("hardening that varies with time"), "hardening that varies with time explains more"),
        (
            Because::NearestForm("jump in counts"),
            "it is only the nearest form of what has no name in the library: a jump in counts",
        ),
    ] {
        assert_eq!(GivenUp { effect: "softening", because }.in_words(), words);
    }
}
