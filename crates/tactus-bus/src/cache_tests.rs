use std::ops::RangeInclusive;

use super::{KeptMessages, wanted};

const ALL: RangeInclusive<u32> = 0..=u32::MAX;

/// The messages that a client would get, copied two at a time.
fn found(kept: &KeptMessages, numbers: &RangeInclusive<u32>, limit: usize) -> Vec<(u32, Vec<u8>)> {
    let Some((mut next, mut left)) = kept.first(numbers, limit) else { return Vec::new() };
    let mut all = Vec::new();
    while left > 0 {
        let some = kept.from(next, numbers, left.min(2));
        next = some.last().unwrap().0.wrapping_add(1);
        left -= some.len();
        all.extend(some);
    }
    all
}

/// The numbers found after this many messages, of which the last `capacity` are kept.
fn check(published: u32, capacity: usize, numbers: Option<&str>, limit: Option<&str>) -> Vec<u32> {
    let mut kept = KeptMessages::new(capacity);
    for number in 0..published {
        kept.push(&number.to_le_bytes());
    }
    let (numbers, limit) = wanted(numbers, limit);
    let found = found(&kept, &numbers, limit);
    for (number, payload) in &found {
        assert_eq!(*payload, number.to_le_bytes(), "the number belongs to the message");
    }
    found.into_iter().map(|(number, _)| number).collect()
}

#[test]
fn the_last_messages_are_kept() {
    assert_eq!(check(0, 3, None, None), [0; 0]);
    assert_eq!(check(2, 3, None, None), [0, 1]);
    assert_eq!(check(10, 3, None, None), [7, 8, 9]);
}

#[test]
fn a_question_may_name_the_numbers_it_wants() {
    assert_eq!(check(10, 10, Some("3..5"), None), [3, 4, 5]);
    assert_eq!(check(10, 10, Some("8.."), None), [8, 9]);
    assert_eq!(check(10, 10, Some("..1"), None), [0, 1]);
    assert_eq!(check(10, 10, Some("4"), None), [4]);
    assert_eq!(check(10, 3, Some("..7"), None), [7]);
    assert_eq!(check(10, 10, Some("5..3"), None), [0; 0]);
}

#[test]
fn a_question_may_limit_itself_to_the_last() {
    assert_eq!(check(10, 10, None, Some("1")), [9]);
    assert_eq!(check(10, 10, Some("..6"), Some("2")), [5, 6]);
    assert_eq!(check(2, 10, None, Some("5")), [0, 1]);
}

#[test]
fn what_cannot_be_read_is_taken_as_not_said() {
    assert_eq!(check(3, 10, Some("..many"), Some("-1")), [0, 1, 2]);
    assert_eq!(check(3, 10, Some(""), Some("")), [0, 1, 2]);
}

#[test]
fn the_kept_messages_are_bounded_in_bytes_and_the_last_is_kept_in_any_case() {
    let mut kept = KeptMessages::new(16_384);
    for _ in 0..40 {
        kept.push(&vec![0; 1 << 20]);
    }
    assert_eq!(found(&kept, &ALL, usize::MAX).len(), 4);
    kept.push(&vec![0; 20 << 20]);
    let all = found(&kept, &ALL, usize::MAX);
    assert_eq!(all.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [40]);
    kept.push(&[0]);
    assert_eq!(found(&kept, &ALL, usize::MAX).len(), 1);
}

/// Between two copies the publisher goes on.
#[test]
fn messages_that_gave_way_meanwhile_are_passed_over() {
    let mut kept = KeptMessages::new(4);
    (0..6_u8).for_each(|byte| kept.push(&[byte]));
    let numbers =
        |found: Vec<(u32, Vec<u8>)>| found.into_iter().map(|(number, _)| number).collect::<Vec<_>>();
    assert_eq!(kept.first(&ALL, usize::MAX), Some((2, 4)));
    assert_eq!(numbers(kept.from(2, &ALL, 2)), [2, 3]);
    (6..9_u8).for_each(|byte| kept.push(&[byte]));
    assert_eq!(numbers(kept.from(4, &ALL, 2)), [5, 6]);
    assert_eq!(numbers(kept.from(9, &ALL, 2)), [0; 0]);
}

#[test]
fn numbers_begin_anew_after_the_greatest() {
    let mut kept = KeptMessages { next: u32::MAX - 1, ..KeptMessages::new(10) };
    (0..4_u8).for_each(|byte| kept.push(&[byte]));
    let numbers: Vec<u32> = found(&kept, &ALL, usize::MAX).iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, [u32::MAX - 1, u32::MAX, 0, 1]);
}

/// The queue of bytes begins anew at its start, so that a message may stand at its end and at its start.
#[test]
fn each_message_is_found_as_it_was_whatever_its_length() {
    let message = |number: u32| vec![number.to_le_bytes()[0]; (number as usize * 7) % 23];
    let mut kept = KeptMessages::new(13);
    for number in 0..500 {
        kept.push(&message(number));
        let found = found(&kept, &ALL, usize::MAX);
        assert_eq!(found.len(), 13.min(number as usize + 1));
        assert!(found.iter().all(|(number, payload)| *payload == message(*number)), "{found:?}");
    }
}

#[test]
fn kept_messages_take_little_more_memory_than_their_bytes() {
    let mut kept = KeptMessages::new(1_800);
    (0..5_000).for_each(|_| kept.push(&[7; 240]));
    assert!(kept.bytes.capacity() < 1_800 * 240 * 9 / 8 + 240, "{}", kept.bytes.capacity());
    assert!(kept.lengths.capacity() < 1_800 * 9 / 8 + 1, "{}", kept.lengths.capacity());
}
