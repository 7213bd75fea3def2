use std::collections::HashSet;

use super::*;

#[test]
fn memory_is_used_again_only_when_nobody_holds_it() {
    let mut memory = Memory::default();
    let first = memory.counts(2, |counts| counts.fill(1.0));
    let place = first.as_ptr();
    let second = memory.counts(2, |counts| counts.fill(2.0));
    assert_eq!((&first[..], &second[..]), (&[1.0, 1.0][..], &[2.0, 2.0][..]));
    drop(first);
    let third = memory.counts(2, |counts| counts[0] = 3.0);
    assert_eq!(third.as_ptr(), place);
    assert_eq!(second[..], [2.0, 2.0]);
    // Nobody holds the second, but it has another length.
    drop(second);
    assert_eq!(memory.counts(3, |counts| counts.fill(4.0))[..], [4.0, 4.0, 4.0]);
}

#[test]
fn memory_is_used_again_while_a_recorder_holds_100_ms_of_5_khz() {
    let (mut memory, mut held) = (Memory::default(), VecDeque::new());
    let mut next = || {
        if held.len() == 500 {
            held.pop_front();
        }
        let counts = memory.counts(48, |counts| counts.fill(1.0));
        let place = counts.as_ptr();
        held.push_back(counts);
        place
    };
    let first: HashSet<_> = (0..500).map(|_| next()).collect();
    let later: HashSet<_> = (0..5_000).map(|_| next()).collect();
    assert_eq!(later, first);
}
