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
