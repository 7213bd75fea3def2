use std::collections::BTreeSet;

use super::{pb, with_message};

/// Every value of an enumeration that has a word; protobuf numbers them from 0 without gaps.
macro_rules! words_of {
    ($enumeration:ident) => {
        (0..)
            .map_while(|number| pb::$enumeration::try_from(number).ok())
            .map(pb::$enumeration::word)
            .collect()
    };
}

#[test]
fn every_value_has_a_word_of_its_own() {
    let enumerations: [(Vec<&str>, usize); 4] = [
        (words_of!(StageStatus), 8),
        (words_of!(RunPhase), 7),
        (words_of!(ExitStatus), 8),
        (words_of!(SafetyVerdict), 4),
    ];
    for (words, count) in enumerations {
        assert_eq!(words.iter().collect::<BTreeSet<_>>().len(), count, "{words:?}");
        assert_eq!(words[0], "unknown");
    }
    assert_eq!(pb::StageStatus::Unhomed.word(), "not homed");
}

#[test]
fn a_message_that_begins_with_the_state_does_not_say_it_twice() {
    assert_eq!(with_message("stopped", "stopped by cli"), "stopped by cli");
    assert_eq!(with_message("failed", "no frame for 0.1 s"), "failed: no frame for 0.1 s");
    assert_eq!(with_message("done", ""), "done");
}
